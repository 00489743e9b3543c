//! Four values in one NEON register, which every 64-bit Arm processor of these targets has. Kernels use them in
//! [pairs](Pair): eight values as at other levels, so that all sums are computed in the same order.
//!
//! Maximum and minimum are made from a comparison: NEON's own are NaN where either value is.

#![allow(unsafe_code)] // Intrinsics are unsafe in functions that do not enable their feature.

#[cfg(not(feature = "deterministic"))]
use core::arch::aarch64::vfmaq_f32;
use core::arch::aarch64::{
    float32x4_t, vabsq_f32, vaddq_f32, vaddq_u32, vandq_u32, vbslq_f32, vcgtq_f32, vcgtzq_f32, vcltq_f32,
    vcvtq_f32_s32, vdivq_f32, vdupq_n_f32, vdupq_n_u32, vmulq_f32, vnegq_f32, vreinterpretq_f32_f64,
    vreinterpretq_f32_u32, vreinterpretq_f64_f32, vreinterpretq_s32_f32, vreinterpretq_u32_f32, vshlq_n_u32,
    vshrq_n_u32, vsqrtq_f32, vsubq_f32, vsubq_u32, vtrn1q_f32, vtrn2q_f32, vzip1q_f64, vzip2q_f64,
};
use core::ops::{Add, Mul, Neg, Sub};

use super::functions::Bits;
use super::int8_neon::Bytes16;
use super::register::{four_rows, memory, same_methods};
use super::{Pair, Piece, Real};

/// Four float32 values in one register.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Neon(pub(super) float32x4_t);

memory!(Neon, 4);

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for Neon {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: this module is compiled only for targets with NEON.
                Self(unsafe { $instruction(self.0, other.0) })
            }
        }
    };
}

operator!(Add, add, vaddq_f32);
operator!(Sub, sub, vsubq_f32);
operator!(Mul, mul, vmulq_f32);

impl Neg for Neon {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vnegq_f32(self.0) })
    }
}

impl Real for Neon {
    const COUNT: usize = 4;
    const MANY_REGISTERS: bool = true;
    type Width8 = Pair<Self>;
    type Whole = Bytes16;

    same_methods!();
    four_rows!();

    #[inline(never)]
    fn run_piece<P: Piece>(piece: P) -> P::Output {
        piece.run()
    }
    #[cfg(not(feature = "deterministic"))]
    #[inline(always)]
    fn fused(self, factor: Self, addend: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vfmaq_f32(addend.0, self.0, factor.0) })
    }
    #[inline(always)]
    fn choose(self, yes: Self, no: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vbslq_f32(vcgtzq_f32(self.0), yes.0, no.0) })
    }
    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: as above.
        Self(unsafe { vdupq_n_f32(value) })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vbslq_f32(vcgtq_f32(self.0, other.0), self.0, other.0) })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vbslq_f32(vcltq_f32(self.0, other.0), self.0, other.0) })
    }
    #[inline(always)]
    fn positive(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vreinterpretq_f32_u32(vandq_u32(vcgtzq_f32(self.0), vreinterpretq_u32_f32(vdupq_n_f32(1.0)))) })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vabsq_f32(self.0) })
    }
    #[inline(always)]
    fn divide(self, other: Self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vdivq_f32(self.0, other.0) })
    }
    #[inline(always)]
    fn root(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vsqrtq_f32(self.0) })
    }
}

/// Transposes a 4 x 4 matrix: first pairs of values, then pairs of pairs.
#[inline(always)]
fn transpose([a, b, c, d]: [Neon; 4]) -> [Neon; 4] {
    // SAFETY: as above.
    unsafe {
        let pairs = |values| vreinterpretq_f64_f32(values);
        let (even_ab, odd_ab) = (pairs(vtrn1q_f32(a.0, b.0)), pairs(vtrn2q_f32(a.0, b.0)));
        let (even_cd, odd_cd) = (pairs(vtrn1q_f32(c.0, d.0)), pairs(vtrn2q_f32(c.0, d.0)));
        [
            Neon(vreinterpretq_f32_f64(vzip1q_f64(even_ab, even_cd))),
            Neon(vreinterpretq_f32_f64(vzip1q_f64(odd_ab, odd_cd))),
            Neon(vreinterpretq_f32_f64(vzip2q_f64(even_ab, even_cd))),
            Neon(vreinterpretq_f32_f64(vzip2q_f64(odd_ab, odd_cd))),
        ]
    }
}

impl Bits for Neon {
    #[inline(always)]
    fn bits_to_float(self) -> Self {
        // SAFETY: as above.
        Self(unsafe { vcvtq_f32_s32(vreinterpretq_s32_f32(self.0)) })
    }
    #[inline(always)]
    fn plus_shifted(self, addend: u32, left: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let sum = vaddq_u32(vreinterpretq_u32_f32(self.0), vdupq_n_u32(addend));
            Self(vreinterpretq_f32_u32(match left {
                8 => vshlq_n_u32::<8>(sum),
                _ => vshlq_n_u32::<23>(sum),
            }))
        }
    }
    #[inline(always)]
    fn half_from(self, minuend: u32) -> Self {
        // SAFETY: as above.
        unsafe {
            let half = vshrq_n_u32::<1>(vreinterpretq_u32_f32(self.0));
            Self(vreinterpretq_f32_u32(vsubq_u32(vdupq_n_u32(minuend), half)))
        }
    }
}
