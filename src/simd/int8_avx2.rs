//! Integers in one AVX register: the results of [`Packed`](super::int8::Packed), with a few instructions for each of
//! its loops.
//!
//! The product of bytes of AVX2 (`vpmaddubsw`) saturates. So even and odd bytes are widened to 16 bits separately, and
//! pairs of products are added to sums of 32 bits, which is exact.
//!
//! Only [`super::level`] uses this type, after it has checked that the processor has the instructions.

#![allow(unsafe_code)] // Intrinsics are unsafe where the processor may lack the instruction.

use core::arch::x86_64::*;

use super::avx2::Avx2;
use super::int8::Whole;

#[inline(always)]
fn low_byte(floats: Avx2) -> __m256i {
    // SAFETY: the processor has AVX2, see the module.
    unsafe { _mm256_and_si256(_mm256_castps_si256(floats.0), _mm256_set1_epi32(255)) }
}

/// Eight words of 32 bits.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Bytes32(__m256i);

impl Whole<Avx2> for Bytes32 {
    #[inline(always)]
    fn splat(value: i32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_set1_epi32(value) })
    }
    #[inline(always)]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self {
        // SAFETY: as above.
        unsafe {
            let weights = _mm256_set1_epi32(i32::from_le_bytes(bytemuck::must_cast(weights)));
            let even = _mm256_and_si256(bytes.0, _mm256_set1_epi16(255));
            let odd = _mm256_srli_epi16::<8>(bytes.0);
            let even_weights = _mm256_srai_epi16::<8>(_mm256_slli_epi16::<8>(weights));
            let odd_weights = _mm256_srai_epi16::<8>(weights);
            let products = _mm256_add_epi32(_mm256_madd_epi16(even, even_weights), _mm256_madd_epi16(odd, odd_weights));
            Self(_mm256_add_epi32(self.0, products))
        }
    }
    #[inline(always)]
    fn numbers(self) -> Avx2 {
        // SAFETY: as above.
        Avx2(unsafe { _mm256_cvtepi32_ps(self.0) })
    }
    #[inline(always)]
    fn low_bytes([a, b, c, d]: [Avx2; 4]) -> Self {
        // SAFETY: as above.
        unsafe {
            let low = _mm256_or_si256(low_byte(a), _mm256_slli_epi32::<8>(low_byte(b)));
            let high = _mm256_or_si256(
                _mm256_slli_epi32::<16>(low_byte(c)),
                _mm256_slli_epi32::<24>(_mm256_castps_si256(d.0)),
            );
            Self(_mm256_or_si256(low, high))
        }
    }
}
