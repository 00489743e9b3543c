//! Whole numbers in one AVX register: the same results as [`Packed`](super::int8::Packed), an instruction or a few for each
//! of its loops.
//!
//! AVX2 has no product of bytes that could not saturate (`vpmaddubsw` does), so bytes become numbers of 16 bits, even
//! and odd ones apart, and pairs of products sums of 32: exact. Only [`super::level`] leads here, once it has seen that
//! the processor has the instructions.

#![allow(unsafe_code)] // The instructions are unsafe to use without that.

use core::arch::x86_64::*;

use super::avx2::Avx2;
use super::int8::{Requantise, VERTICES, Whole};

/// Bytes 0 and 1 of either half, four times: `positive` of two outputs, each for four vertices.
pub(super) const POSITIVE: [u8; 16] = [0, 1, 0, 1, 0, 1, 0, 1, 8, 9, 8, 9, 8, 9, 8, 9];
/// The same of `negative`.
pub(super) const NEGATIVE: [u8; 16] = [2, 3, 2, 3, 2, 3, 2, 3, 10, 11, 10, 11, 10, 11, 10, 11];
/// The same of `zero`.
pub(super) const ZERO: [u8; 16] = [4, 5, 4, 5, 4, 5, 4, 5, 12, 13, 12, 13, 12, 13, 12, 13];

/// Bytes of each 128 bits, by their places.
#[inline(always)]
fn picked(from: __m256i, places: [u8; 16]) -> __m256i {
    // SAFETY: the processor has AVX2, see the module.
    unsafe { _mm256_shuffle_epi8(from, _mm256_broadcastsi128_si256(bytemuck::must_cast(places))) }
}

#[inline(always)]
fn low_byte(number: Avx2) -> __m256i {
    // SAFETY: as above.
    unsafe { _mm256_and_si256(_mm256_castps_si256(number.0), _mm256_set1_epi32(255)) }
}

/// Eight of them.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Bytes32(__m256i);

impl Bytes32 {
    /// Two outputs' sums, brought to activations that are not clamped yet.
    #[inline(always)]
    fn pair(a: Self, b: Self, [by_a, by_b]: [Requantise; 2]) -> __m256i {
        // SAFETY: as above.
        unsafe {
            let both: __m128i = bytemuck::must_cast([by_a, by_b]);
            let by = _mm256_broadcastsi128_si256(both);
            let a = _mm256_srav_epi32(a.0, _mm256_set1_epi32(i32::from(by_a.shift)));
            let b = _mm256_srav_epi32(b.0, _mm256_set1_epi32(i32::from(by_b.shift)));
            let kept = _mm256_packs_epi32(a, b);
            let positive = _mm256_mulhrs_epi16(kept, picked(by, POSITIVE));
            let negative = _mm256_mulhrs_epi16(kept, picked(by, NEGATIVE));
            _mm256_adds_epi16(_mm256_max_epi16(positive, negative), picked(by, ZERO))
        }
    }
}

impl Whole<Avx2> for Bytes32 {
    #[inline(always)]
    fn splat(number: i32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_set1_epi32(number) })
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
            let products =
                _mm256_add_epi32(_mm256_madd_epi16(even, even_weights), _mm256_madd_epi16(odd, odd_weights));
            Self(_mm256_add_epi32(self.0, products))
        }
    }
    #[inline(always)]
    fn requantise([a, b, c, d]: [Self; 4], &[by_a, by_b, by_c, by_d]: &[Requantise; 4]) -> Self {
        let (ab, cd) = (Self::pair(a, b, [by_a, by_b]), Self::pair(c, d, [by_c, by_d]));
        // SAFETY: as above.
        unsafe { Self(picked(_mm256_packus_epi16(ab, cd), VERTICES)) }
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
