//! Whole numbers in one AVX-512 register: the same results as [`Packed`](super::int8::Packed), with the instruction for
//! sums of four products of bytes (VNNI, `vpdpbusd`: the form that does not saturate).
//!
//! Only [`super::level`] leads here, once it has seen that the processor has the instructions.

#![allow(unsafe_code)] // The instructions are unsafe to use without that.

use core::arch::x86_64::*;

use super::avx512::Avx512;
use super::int8::{Requantise, VERTICES, Whole};
use super::int8_avx2::{NEGATIVE, POSITIVE, ZERO};

/// Bytes of each 128 bits, by their places.
#[inline(always)]
fn picked(from: __m512i, places: [u8; 16]) -> __m512i {
    // SAFETY: the processor has AVX-512, see the module.
    unsafe { _mm512_shuffle_epi8(from, _mm512_broadcast_i32x4(bytemuck::must_cast(places))) }
}

#[inline(always)]
fn low_byte(number: Avx512) -> __m512i {
    // SAFETY: as above.
    unsafe { _mm512_and_si512(_mm512_castps_si512(number.0), _mm512_set1_epi32(255)) }
}

/// Sixteen of them.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Bytes64(__m512i);

impl Bytes64 {
    /// Two outputs' sums, brought to activations that are not clamped yet.
    #[inline(always)]
    fn pair(a: Self, b: Self, [by_a, by_b]: [Requantise; 2]) -> __m512i {
        // SAFETY: as above.
        unsafe {
            let both: __m128i = bytemuck::must_cast([by_a, by_b]);
            let by = _mm512_broadcast_i32x4(both);
            let a = _mm512_srav_epi32(a.0, _mm512_set1_epi32(i32::from(by_a.shift)));
            let b = _mm512_srav_epi32(b.0, _mm512_set1_epi32(i32::from(by_b.shift)));
            let kept = _mm512_packs_epi32(a, b);
            let positive = _mm512_mulhrs_epi16(kept, picked(by, POSITIVE));
            let negative = _mm512_mulhrs_epi16(kept, picked(by, NEGATIVE));
            _mm512_adds_epi16(_mm512_max_epi16(positive, negative), picked(by, ZERO))
        }
    }
}

impl Whole<Avx512> for Bytes64 {
    const EIGHT: bool = true;

    #[inline(always)]
    fn splat(number: i32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_set1_epi32(number) })
    }
    #[inline(always)]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self {
        let weights = i32::from_le_bytes(bytemuck::must_cast(weights));
        // SAFETY: as above.
        Self(unsafe { _mm512_dpbusd_epi32(self.0, bytes.0, _mm512_set1_epi32(weights)) })
    }
    #[inline(always)]
    fn requantise([a, b, c, d]: [Self; 4], &[by_a, by_b, by_c, by_d]: &[Requantise; 4]) -> Self {
        let (ab, cd) = (Self::pair(a, b, [by_a, by_b]), Self::pair(c, d, [by_c, by_d]));
        // SAFETY: as above.
        unsafe { Self(picked(_mm512_packus_epi16(ab, cd), VERTICES)) }
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
