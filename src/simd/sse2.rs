//! Four float32 values in one SSE register. Every x86-64 processor has SSE2. [`Portable`](super::Portable) would give the
//! same bits, but each of its operations is a loop that the compiler has to unroll, which takes it minutes in long kernels.

#![allow(unsafe_code)] // Intrinsics are unsafe in functions that do not enable their feature.

use core::arch::x86_64::{
    __m128, _mm_add_epi32, _mm_add_ps, _mm_and_ps, _mm_andnot_ps, _mm_castps_si128, _mm_castsi128_ps, _mm_cmpgt_ps,
    _mm_cvtepi32_ps, _mm_div_ps, _mm_max_ps, _mm_min_ps, _mm_movehl_ps, _mm_movelh_ps, _mm_mul_ps, _mm_or_ps,
    _mm_set1_epi32, _mm_set1_ps, _mm_setzero_ps, _mm_slli_epi32, _mm_sqrt_ps, _mm_srli_epi32, _mm_sub_epi32,
    _mm_sub_ps, _mm_unpackhi_ps, _mm_unpacklo_ps, _mm_xor_ps,
};
use core::ops::{Add, Mul, Neg, Sub};

use super::functions::Bits;
use super::int8_sse2::Bytes16;
use super::register::{four_rows, memory, same_methods};
use super::{Pair, Piece, Real};

/// Four float32 values in one register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Sse2(pub(super) __m128);

memory!(Sse2, 4);

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for Sse2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: SSE2 is part of x86-64.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}

operator!(Add, add, _mm_add_ps);
operator!(Sub, sub, _mm_sub_ps);
operator!(Mul, mul, _mm_mul_ps);

impl Neg for Sse2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_xor_ps(self.0, _mm_set1_ps(-0.0)) })
    }
}

impl Real for Sse2 {
    const COUNT: usize = 4;
    type Width8 = Pair<Self>;
    type Whole = Bytes16;

    same_methods!();
    four_rows!();

    #[inline(never)]
    fn run_piece<P: Piece>(piece: P) -> P::Output {
        piece.run()
    }
    #[inline(always)]
    fn choose(self, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe {
            let condition = _mm_cmpgt_ps(self.0, _mm_setzero_ps());
            _mm_or_ps(_mm_and_ps(condition, yes.0), _mm_andnot_ps(condition, no.0))
        })
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_set1_ps(value) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn positive(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_and_ps(_mm_cmpgt_ps(self.0, _mm_setzero_ps()), _mm_set1_ps(1.0)) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_andnot_ps(_mm_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn divide(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_div_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_sqrt_ps(self.0) })
    }
}

/// Rows become columns.
#[inline(always)]
fn transpose([a, b, c, d]: [Sse2; 4]) -> [Sse2; 4] {
    // SAFETY: as above.
    unsafe {
        let (low_ab, low_cd) = (_mm_unpacklo_ps(a.0, b.0), _mm_unpacklo_ps(c.0, d.0));
        let (high_ab, high_cd) = (_mm_unpackhi_ps(a.0, b.0), _mm_unpackhi_ps(c.0, d.0));
        [
            Sse2(_mm_movelh_ps(low_ab, low_cd)),
            Sse2(_mm_movehl_ps(low_cd, low_ab)),
            Sse2(_mm_movelh_ps(high_ab, high_cd)),
            Sse2(_mm_movehl_ps(high_cd, high_ab)),
        ]
    }
}

impl Bits for Sse2 {
    #[inline(always)]
    fn bits_to_float(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm_cvtepi32_ps(_mm_castps_si128(self.0)) })
    }
    #[inline(always)]
    fn plus_shifted(self, addend: u32, left: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let sum = _mm_add_epi32(_mm_castps_si128(self.0), _mm_set1_epi32(addend as i32));
            Self(_mm_castsi128_ps(match left {
                8 => _mm_slli_epi32::<8>(sum),
                _ => _mm_slli_epi32::<23>(sum),
            }))
        }
    }
    #[inline(always)]
    fn half_from(self, minuend: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let half = _mm_srli_epi32::<1>(_mm_castps_si128(self.0));
            Self(_mm_castsi128_ps(_mm_sub_epi32(_mm_set1_epi32(minuend as i32), half)))
        }
    }
}
