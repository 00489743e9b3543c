//! Sixteen values in one AVX-512 register, as [`avx2`](super::avx2) holds eight: each operation is one instruction with
//! the same result.
//!
//! Only [`super::level`] uses this type, after it has checked that the processor has AVX-512 (F, BW, DQ, VL, VNNI).

#![allow(unsafe_code)] // Intrinsics are unsafe where the processor may lack the instruction.

#[cfg(not(feature = "deterministic"))]
use core::arch::x86_64::_mm512_fmadd_ps;
use core::arch::x86_64::{
    __m512, _CMP_GT_OQ, _mm512_abs_ps, _mm512_add_epi32, _mm512_add_ps, _mm512_castps_si512, _mm512_castsi512_ps,
    _mm512_cmp_ps_mask, _mm512_cmpge_epu32_mask, _mm512_cvtepi32_ps, _mm512_div_ps, _mm512_mask_blend_ps,
    _mm512_maskz_mov_ps, _mm512_max_ps, _mm512_min_ps, _mm512_mul_ps, _mm512_set1_epi32, _mm512_set1_ps,
    _mm512_setzero_ps, _mm512_shuffle_ps, _mm512_slli_epi32, _mm512_sqrt_ps, _mm512_srli_epi32, _mm512_sub_epi32,
    _mm512_sub_ps, _mm512_unpackhi_ps, _mm512_unpacklo_ps, _mm512_xor_ps,
};
use core::ops::{Add, Mul, Neg, Sub};

use super::avx2::Avx2;
use super::functions::Bits;
use super::int8_avx512::Bytes64;
use super::register::{memory, same_methods};
use super::{Piece, Real, TILE, unrolled};

/// Sixteen float32 values in one register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Avx512(pub(super) __m512);

memory!(Avx512, 16);

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for Avx512 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: the processor has AVX-512, see the module.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}

operator!(Add, add, _mm512_add_ps);
operator!(Sub, sub, _mm512_sub_ps);
operator!(Mul, mul, _mm512_mul_ps);

impl Neg for Avx512 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_xor_ps(self.0, _mm512_set1_ps(-0.0)) })
    }
}

impl Real for Avx512 {
    const COUNT: usize = 16;
    const MANY_REGISTERS: bool = true;
    type Width8 = Avx2;
    type Whole = Bytes64;

    same_methods!();

    #[inline(always)]
    fn run_piece<P: Piece>(piece: P) -> P::Output {
        #[target_feature(enable = "avx2,fma,avx512f,avx512bw,avx512dq,avx512vl,avx512vnni")]
        #[inline(never)]
        fn with_instructions<P: Piece>(piece: P) -> P::Output {
            piece.run()
        }
        // SAFETY: the processor has these instructions, see the module.
        unsafe { with_instructions(piece) }
    }
    #[inline(always)]
    fn from_rows(row: impl Fn(usize) -> [f32; 4]) -> [Self; 4] {
        // Rows 0, 4, 8 and 12 in the four quarters of a register, and so on; then all quarters are transposed at once.
        let four = |lane: usize| Self(bytemuck::must_cast([row(lane), row(lane + 4), row(lane + 8), row(lane + 12)]));
        transpose([four(0), four(1), four(2), four(3)])
    }
    #[inline(always)]
    fn to_rows(columns: [Self; 4], mut row: impl FnMut(usize, [f32; 4])) {
        let quarters = quarters(columns);
        // `black_box` makes the compiler read whole rows from memory. Without it each row is assembled from single
        // values.
        let quarters = core::hint::black_box(&quarters);
        eight_rows::<0>(quarters, &mut row);
        eight_rows::<8>(quarters, &mut row);
    }
    #[inline(always)]
    fn corners_to_rows<const N: usize>(corners: [[Self; 4]; N], mut row: impl FnMut(usize, usize, [f32; 4])) {
        let mut rows = [[[[0.0; 4]; 4]; 4]; N];
        unrolled!(corner < N => {
            rows[corner] = quarters(corners[corner]);
        });
        // `black_box` as in `to_rows`.
        let corners = core::hint::black_box(&rows);
        unrolled!(corner < N => {
            eight_rows::<0>(&corners[corner], |lane, values| row(corner, lane, values));
        });
        unrolled!(corner < N => {
            eight_rows::<8>(&corners[corner], |lane, values| row(corner, lane, values));
        });
    }
    #[inline(always)]
    fn all_in_range<const N: usize>(rows: [&[u32; TILE]; N], first: u32, count: u32) -> bool {
        let mut outside = 0;
        for row in rows {
            // SAFETY: as above; any bits are valid integers.
            outside |= unsafe {
                let at = _mm512_sub_epi32(bytemuck::must_cast(*row), _mm512_set1_epi32(first as i32));
                _mm512_cmpge_epu32_mask(at, _mm512_set1_epi32(count as i32))
            };
        }
        outside == 0
    }
    #[inline(always)]
    fn from_consecutive_rows(rows: &[[f32; 4]]) -> [Self; 4] {
        // Consecutive rows in the four quarters of a register; all quarters are transposed at once.
        let rows: [__m512; 4] = bytemuck::must_cast(*rows.first_chunk::<16>().unwrap_or(&[[0.0; 4]; 16]));
        transpose(rows.map(Self))
    }
    #[inline(always)]
    fn to_consecutive_rows(columns: [Self; 4], rows: &mut [[f32; 4]]) {
        let [a, b, c, d] = transpose(columns);
        if let Some(rows) = rows.first_chunk_mut::<16>() {
            *rows = bytemuck::must_cast([a.0, b.0, c.0, d.0]);
        }
    }
    #[inline(always)]
    fn lane_of_row(row: usize) -> usize {
        4 * (row % 4) + row / 4
    }
    #[inline(always)]
    fn row_of_lane(lane: usize) -> usize {
        4 * (lane % 4) + lane / 4
    }
    #[cfg(not(feature = "deterministic"))]
    #[inline(always)]
    fn fused(self, factor: Self, addend: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_fmadd_ps(self.0, factor.0, addend.0) })
    }
    #[inline(always)]
    fn choose(self, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe {
            _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_ps()), no.0, yes.0)
        })
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_set1_ps(value) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_max_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_min_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn positive(self) -> Self {
        // SAFETY: as above.
        Self(unsafe {
            let positive = _mm512_cmp_ps_mask::<_CMP_GT_OQ>(self.0, _mm512_setzero_ps());
            _mm512_maskz_mov_ps(positive, _mm512_set1_ps(1.0))
        })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_abs_ps(self.0) })
    }
    #[inline(always)]
    fn divide(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_div_ps(self.0, other.0) })
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_sqrt_ps(self.0) })
    }
}

/// Four registers of four rows each: the row of lane `l` is in quarter `l / 4` of register `l % 4`.
type Quarters = [[[f32; 4]; 4]; 4];

#[inline(always)]
fn quarters(columns: [Avx512; 4]) -> Quarters {
    let [a, b, c, d] = transpose(columns);
    bytemuck::must_cast([a.0, b.0, c.0, d.0])
}

/// Calls `row` with the eight places from `FIRST` on, and their rows.
#[inline(always)]
fn eight_rows<const FIRST: usize>(quarters: &Quarters, mut row: impl FnMut(usize, [f32; 4])) {
    for lane in 0..8 {
        row(FIRST + lane, quarters[lane % 4][FIRST / 4 + lane / 4]);
    }
}

/// Transposes the 4 x 4 matrix in each quarter of four registers.
#[inline(always)]
fn transpose([a, b, c, d]: [Avx512; 4]) -> [Avx512; 4] {
    // SAFETY: as above.
    unsafe {
        let (low_ab, high_ab) = (_mm512_unpacklo_ps(a.0, b.0), _mm512_unpackhi_ps(a.0, b.0));
        let (low_cd, high_cd) = (_mm512_unpacklo_ps(c.0, d.0), _mm512_unpackhi_ps(c.0, d.0));
        [
            Avx512(_mm512_shuffle_ps::<0x44>(low_ab, low_cd)),
            Avx512(_mm512_shuffle_ps::<0xEE>(low_ab, low_cd)),
            Avx512(_mm512_shuffle_ps::<0x44>(high_ab, high_cd)),
            Avx512(_mm512_shuffle_ps::<0xEE>(high_ab, high_cd)),
        ]
    }
}

impl Bits for Avx512 {
    #[inline(always)]
    fn bits_to_float(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { _mm512_cvtepi32_ps(_mm512_castps_si512(self.0)) })
    }
    #[inline(always)]
    fn plus_shifted(self, addend: u32, left: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let sum = _mm512_add_epi32(_mm512_castps_si512(self.0), _mm512_set1_epi32(addend as i32));
            Self(_mm512_castsi512_ps(match left {
                8 => _mm512_slli_epi32::<8>(sum),
                _ => _mm512_slli_epi32::<23>(sum),
            }))
        }
    }
    #[inline(always)]
    fn half_from(self, minuend: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let half = _mm512_srli_epi32::<1>(_mm512_castps_si512(self.0));
            Self(_mm512_castsi512_ps(_mm512_sub_epi32(_mm512_set1_epi32(minuend as i32), half)))
        }
    }
}
