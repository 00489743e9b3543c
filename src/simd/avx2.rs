//! Width8 values in one AVX register. For [`Portable`](super::Portable) the compiler has to recognise vectors in
//! unrolled loops, and fails in long kernels; here each operation is one instruction with the same result.
//!
//! Only [`super::level`] uses this type, after it has checked that the processor has AVX2 and FMA.

#![allow(unsafe_code)] // Intrinsics are unsafe where the processor may lack the instruction.

#[cfg(not(feature = "deterministic"))]
use core::arch::x86_64::_mm256_fmadd_ps;
use core::arch::x86_64::{
    __m256, __m256i, _CMP_GT_OQ, _mm256_add_epi32, _mm256_add_ps, _mm256_and_ps, _mm256_blendv_ps, _mm256_castps_si256,
    _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cmpeq_epi32, _mm256_cvtepi32_ps, _mm256_div_ps, _mm256_max_epu32,
    _mm256_max_ps, _mm256_min_ps, _mm256_movemask_epi8, _mm256_mul_ps, _mm256_or_si256, _mm256_set1_epi32,
    _mm256_set1_ps, _mm256_setzero_ps, _mm256_setzero_si256, _mm256_shuffle_ps, _mm256_slli_epi32, _mm256_sqrt_ps,
    _mm256_srli_epi32, _mm256_sub_epi32, _mm256_sub_ps, _mm256_unpackhi_ps, _mm256_unpacklo_ps, _mm256_xor_ps,
};
use core::ops::{Add, Mul, Neg, Sub};

use super::functions::Bits;
use super::int8_avx2::Bytes32;
use super::register::{memory, same_methods};
use super::{Piece, Real, TILE};

/// Width8 float32 values in one register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Avx2(pub(super) __m256);

memory!(Avx2, 8);

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for Avx2 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the processor has AVX2, see the module.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}

operator!(Add, add, _mm256_add_ps);
operator!(Sub, sub, _mm256_sub_ps);
operator!(Mul, mul, _mm256_mul_ps);

impl Neg for Avx2 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_xor_ps(self.0, _mm256_set1_ps(-0.0)) })
    }
}

impl Real for Avx2 {
    const COUNT: usize = 8;
    const MANY_REGISTERS: bool = true;
    type Width8 = Self;
    type Whole = Bytes32;

    same_methods!();

    #[inline(always)]
    fn run_piece<P: Piece>(piece: P) -> P::Output {
        #[target_feature(enable = "avx2,fma")]
        #[inline(never)]
        fn with_instructions<P: Piece>(piece: P) -> P::Output {
            piece.run()
        }
        // SAFETY: the processor has these instructions, see the module.
        unsafe { with_instructions(piece) }
    }
    #[inline(always)]
    fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4] {
        // Rows 0 and 4 in the two halves of a register, and so on; then both halves are transposed at once.
        let pair = |lane: usize| Self(bytemuck::must_cast([row(lane), row(lane + 4)]));
        transpose([pair(0), pair(1), pair(2), pair(3)])
    }
    #[inline(always)]
    fn to_rows(columns: [Self; 4], mut row: impl FnMut(usize, [f32; 4])) {
        let [a, b, c, d] = transpose(columns);
        let pairs: [[[f32; 4]; 2]; 4] = bytemuck::must_cast([a.0, b.0, c.0, d.0]);
        // `black_box` makes the compiler read whole rows from memory. Without it each row is assembled from single
        // values.
        let pairs = core::hint::black_box(&pairs);
        for half in 0..2 {
            for (lane, pair) in pairs.iter().enumerate() {
                row(4 * half + lane, pair[half]);
            }
        }
    }
    #[inline(always)]
    fn all_in_range<const N: usize>(rows: [&[u32; TILE]; N], first: u32, count: u32) -> bool {
        // SAFETY: the processor has AVX2, see the module.
        unsafe {
            let (first, count) = (_mm256_set1_epi32(first as i32), _mm256_set1_epi32(count as i32));
            let mut outside = _mm256_setzero_si256();
            for row in rows {
                let halves: [__m256i; 2] = bytemuck::must_cast(*row);
                for half in halves {
                    let at = _mm256_sub_epi32(half, first);
                    // `at >= count` as `max(at, count) == at`: there is no comparison of unsigned integers.
                    outside = _mm256_or_si256(outside, _mm256_cmpeq_epi32(_mm256_max_epu32(at, count), at));
                }
            }
            _mm256_movemask_epi8(outside) == 0
        }
    }
    #[inline(always)]
    fn from_consecutive_rows(rows: &[[f32; 4]]) -> [Self; 4] {
        // Consecutive rows in the two halves of a register; both halves are transposed at once.
        let &[a, b, c, d, e, f, g, h] = rows.first_chunk().unwrap_or(&[[0.0; 4]; 8]);
        let pair = |a: [f32; 4], b: [f32; 4]| Self(bytemuck::must_cast([a, b]));
        transpose([pair(a, b), pair(c, d), pair(e, f), pair(g, h)])
    }
    #[inline(always)]
    fn to_consecutive_rows(columns: [Self; 4], rows: &mut [[f32; 4]]) {
        let [a, b, c, d] = transpose(columns);
        if let Some(rows) = rows.first_chunk_mut::<8>() {
            *rows = bytemuck::must_cast([a.0, b.0, c.0, d.0]);
        }
    }
    #[inline(always)]
    fn lane_of_row(row: usize) -> usize {
        4 * (row % 2) + row / 2
    }
    #[inline(always)]
    fn row_of_lane(lane: usize) -> usize {
        2 * (lane % 4) + lane / 4
    }
    #[cfg(not(feature = "deterministic"))]
    #[inline(always)]
    fn fused(self, factor: Self, addend: Self) -> Self {
        // SAFETY: the processor has FMA, see the module.
        Self(unsafe { _mm256_fmadd_ps(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn choose(self, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_blendv_ps(no.0, yes.0, _mm256_cmp_ps::<_CMP_GT_OQ>(self.0, _mm256_setzero_ps())) })
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn positive(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_and_ps(_mm256_cmp_ps::<_CMP_GT_OQ>(self.0, _mm256_setzero_ps()), _mm256_set1_ps(1.0)) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_and_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(i32::MAX))) })
    }
    #[inline(always)]
    fn divide(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_div_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_sqrt_ps(self.0) })
    }
}

/// Transposes the 4 x 4 matrix in each half of four registers.
#[inline(always)]
fn transpose([a, b, c, d]: [Avx2; 4]) -> [Avx2; 4] {
    // SAFETY: as above.
    unsafe {
        let (low_ab, high_ab) = (_mm256_unpacklo_ps(a.0, b.0), _mm256_unpackhi_ps(a.0, b.0));
        let (low_cd, high_cd) = (_mm256_unpacklo_ps(c.0, d.0), _mm256_unpackhi_ps(c.0, d.0));
        [
            Avx2(_mm256_shuffle_ps::<0x44>(low_ab, low_cd)),
            Avx2(_mm256_shuffle_ps::<0xEE>(low_ab, low_cd)),
            Avx2(_mm256_shuffle_ps::<0x44>(high_ab, high_cd)),
            Avx2(_mm256_shuffle_ps::<0xEE>(high_ab, high_cd)),
        ]
    }
}

impl Bits for Avx2 {
    #[inline(always)]
    fn bits_to_float(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm256_cvtepi32_ps(_mm256_castps_si256(self.0)) })
    }
    #[inline(always)]
    fn plus_shifted(self, addend: u32, left: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let sum = _mm256_add_epi32(_mm256_castps_si256(self.0), _mm256_set1_epi32(addend as i32));
            Self(_mm256_castsi256_ps(match left {
                8 => _mm256_slli_epi32::<8>(sum),
                _ => _mm256_slli_epi32::<23>(sum),
            }))
        }
    }
    #[inline(always)]
    fn half_from(self, minuend: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let half = _mm256_srli_epi32::<1>(_mm256_castps_si256(self.0));
            Self(_mm256_castsi256_ps(_mm256_sub_epi32(_mm256_set1_epi32(minuend as i32), half)))
        }
    }
}
