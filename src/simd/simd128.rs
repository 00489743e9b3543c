//! Four values in one vector of WebAssembly, where the crate is compiled with the target feature `simd128`. Kernels use
//! them in [pairs](Pair): eight values as at other levels, so that all sums are computed in the same order.
//!
//! Nothing is fused here: WebAssembly has no fused instruction whose result is the same on every processor.

use core::arch::wasm32::{
    f32x4_abs, f32x4_add, f32x4_convert_i32x4, f32x4_div, f32x4_gt, f32x4_mul, f32x4_neg, f32x4_pmax, f32x4_pmin,
    f32x4_splat, f32x4_sqrt, f32x4_sub, i32x4_shuffle, i64x2_shuffle, u32x4_add, u32x4_shl, u32x4_shr, u32x4_splat,
    u32x4_sub, v128, v128_and, v128_bitselect,
};
use core::ops::{Add, Mul, Neg, Sub};

use super::functions::Bits;
use super::int8_simd128::Bytes16;
use super::register::{four_rows, memory, same_methods};
use super::{Pair, Piece, Real};

/// Four float32 values in one vector.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Simd128(pub(super) v128);

memory!(Simd128, 4);

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for Simd128 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($instruction(self.0, other.0))
            }
        }
    };
}

operator!(Add, add, f32x4_add);
operator!(Sub, sub, f32x4_sub);
operator!(Mul, mul, f32x4_mul);

impl Neg for Simd128 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(f32x4_neg(self.0))
    }
}

impl Real for Simd128 {
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
        Self(v128_bitselect(yes.0, no.0, f32x4_gt(self.0, f32x4_splat(0.0))))
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(f32x4_splat(value))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // The first operand unless the second is larger.
        Self(f32x4_pmax(other.0, self.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(f32x4_pmin(other.0, self.0))
    }
    #[inline(always)]
    fn positive(self) -> Self {
        Self(v128_and(f32x4_gt(self.0, f32x4_splat(0.0)), f32x4_splat(1.0)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(f32x4_abs(self.0))
    }
    #[inline(always)]
    fn divide(self, other: Self) -> Self {
        Self(f32x4_div(self.0, other.0))
    }
    #[inline(always)]
    fn root(self) -> Self {
        Self(f32x4_sqrt(self.0))
    }
}

/// Transposes a 4 x 4 matrix: first pairs of values, then pairs of pairs.
#[inline(always)]
fn transpose([a, b, c, d]: [Simd128; 4]) -> [Simd128; 4] {
    let (low_ab, high_ab) = (i32x4_shuffle::<0, 4, 1, 5>(a.0, b.0), i32x4_shuffle::<2, 6, 3, 7>(a.0, b.0));
    let (low_cd, high_cd) = (i32x4_shuffle::<0, 4, 1, 5>(c.0, d.0), i32x4_shuffle::<2, 6, 3, 7>(c.0, d.0));
    [
        Simd128(i64x2_shuffle::<0, 2>(low_ab, low_cd)),
        Simd128(i64x2_shuffle::<1, 3>(low_ab, low_cd)),
        Simd128(i64x2_shuffle::<0, 2>(high_ab, high_cd)),
        Simd128(i64x2_shuffle::<1, 3>(high_ab, high_cd)),
    ]
}

impl Bits for Simd128 {
    #[inline(always)]
    fn bits_to_float(self) -> Self {
        Self(f32x4_convert_i32x4(self.0))
    }
    #[inline(always)]
    fn plus_shifted(self, addend: u32, left: u32) -> Self {
        Self(u32x4_shl(u32x4_add(self.0, u32x4_splat(addend)), left))
    }
    #[inline(always)]
    fn half_from(self, minuend: u32) -> Self {
        Self(u32x4_sub(u32x4_splat(minuend), u32x4_shr(self.0, 1)))
    }
}
