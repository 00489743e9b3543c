//! Integers in one AVX-512 register: the results of [`Packed`](super::int8::Packed), with the instruction for sums of
//! four products of bytes (VNNI, `vpdpbusd`, the form that does not saturate).
//!
//! Only [`super::level`] uses this type, after it has checked that the processor has the instructions.

#![allow(unsafe_code)] // Intrinsics are unsafe where the processor may lack the instruction.

use core::arch::x86_64::*;

use super::avx512::Avx512;
use super::int8::Whole;

#[inline(always)]
fn low_byte(floats: Avx512) -> __m512i {
    // SAFETY: the processor has AVX-512, see the module.
    unsafe { _mm512_and_si512(_mm512_castps_si512(floats.0), _mm512_set1_epi32(255)) }
}

/// Sixteen words of 32 bits.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Bytes64(__m512i);

impl Whole<Avx512> for Bytes64 {
    const EIGHT: bool = true;

    #[inline(always)]
    fn splat(value: i32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_set1_epi32(value) })
    }
    #[inline(always)]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self {
        let weights = i32::from_le_bytes(bytemuck::must_cast(weights));
        // SAFETY: as above.
        Self(unsafe { _mm512_dpbusd_epi32(self.0, bytes.0, _mm512_set1_epi32(weights)) })
    }
    #[inline(always)]
    fn numbers(self) -> Avx512 {
        // SAFETY: as above.
        Avx512(unsafe { _mm512_cvtepi32_ps(self.0) })
    }
    #[inline(always)]
    fn low_bytes([a, b, c, d]: [Avx512; 4]) -> Self {
        // SAFETY: as above.
        unsafe {
            let low = _mm512_or_si512(low_byte(a), _mm512_slli_epi32::<8>(low_byte(b)));
            let high = _mm512_or_si512(
                _mm512_slli_epi32::<16>(low_byte(c)),
                _mm512_slli_epi32::<24>(_mm512_castps_si512(d.0)),
            );
            Self(_mm512_or_si512(low, high))
        }
    }
}
