//! Integers in one SSE register: the results of [`Packed`](super::int8::Packed), with a few instructions for each of
//! its loops.
//!
//! Bytes and weights are widened to 16 bits for the instruction that adds pairs of products to sums of 32 bits, which
//! is exact.

#![allow(unsafe_code)] // Intrinsics are unsafe in functions that do not enable their feature.

use core::arch::x86_64::*;

use super::int8::Whole;
use super::sse2::Sse2;

#[inline(always)]
fn low_byte(floats: Sse2) -> __m128i {
    // SAFETY: SSE2 is part of x86-64.
    unsafe { _mm_and_si128(_mm_castps_si128(floats.0), _mm_set1_epi32(255)) }
}

/// Four words of 32 bits.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Bytes16(__m128i);

impl Whole<Sse2> for Bytes16 {
    #[inline(always)]
    fn splat(value: i32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_set1_epi32(value) })
    }
    #[inline(always)]
    fn dot(self, bytes: Self, [a, b, c, d]: [i8; 4]) -> Self {
        let weights = |[low, high]: [i8; 2]| -> __m128i { bytemuck::must_cast([[i16::from(low), i16::from(high)]; 4]) };
        // SAFETY: as above.
        unsafe {
            let even = _mm_and_si128(bytes.0, _mm_set1_epi16(255));
            let odd = _mm_srli_epi16::<8>(bytes.0);
            let sums = _mm_add_epi32(self.0, _mm_madd_epi16(even, weights([a, c])));
            Self(_mm_add_epi32(sums, _mm_madd_epi16(odd, weights([b, d]))))
        }
    }
    #[inline(always)]
    fn numbers(self) -> Sse2 {
        // SAFETY: as above.
        Sse2(unsafe { _mm_cvtepi32_ps(self.0) })
    }
    #[inline(always)]
    fn low_bytes([a, b, c, d]: [Sse2; 4]) -> Self {
        // SAFETY: as above.
        unsafe {
            let low = _mm_or_si128(low_byte(a), _mm_slli_epi32::<8>(low_byte(b)));
            let high = _mm_or_si128(_mm_slli_epi32::<16>(low_byte(c)), _mm_slli_epi32::<24>(_mm_castps_si128(d.0)));
            Self(_mm_or_si128(low, high))
        }
    }
}
