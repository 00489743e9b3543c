//! Integers in one NEON register: the results of [`Packed`](super::int8::Packed), with instructions that every 64-bit
//! Arm processor has.
//!
//! The product of an activation and a weight fits into 16 bits (255 times -128). So one instruction multiplies eight
//! pairs, and one adds the products in pairs to sums of 32 bits.

#![allow(unsafe_code)] // Intrinsics are unsafe in functions that do not enable their feature.

use core::arch::aarch64::*;

use super::int8::Whole;
use super::neon::Neon;

#[inline(always)]
fn low_byte(floats: Neon) -> uint32x4_t {
    // SAFETY: this module is compiled only for targets with NEON.
    unsafe { vandq_u32(vreinterpretq_u32_f32(floats.0), vdupq_n_u32(255)) }
}

/// Four words of 32 bits.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Bytes16(int32x4_t);

impl Whole<Neon> for Bytes16 {
    #[inline(always)]
    fn splat(value: i32) -> Self {
        // SAFETY: as above.
        Self(unsafe { vdupq_n_s32(value) })
    }
    #[inline(always)]
    fn dot(self, bytes: Self, [a, b, c, d]: [i8; 4]) -> Self {
        let weights =
            |[low, high]: [i8; 2]| -> int16x8_t { bytemuck::must_cast([[i16::from(low), i16::from(high)]; 4]) };
        // SAFETY: as above.
        unsafe {
            let bytes = vreinterpretq_u16_s32(bytes.0);
            let even = vreinterpretq_s16_u16(vandq_u16(bytes, vdupq_n_u16(255)));
            let odd = vreinterpretq_s16_u16(vshrq_n_u16::<8>(bytes));
            let sums = vpadalq_s16(self.0, vmulq_s16(even, weights([a, c])));
            Self(vpadalq_s16(sums, vmulq_s16(odd, weights([b, d]))))
        }
    }
    #[inline(always)]
    fn numbers(self) -> Neon {
        // SAFETY: as above.
        Neon(unsafe { vcvtq_f32_s32(self.0) })
    }
    #[inline(always)]
    fn low_bytes([a, b, c, d]: [Neon; 4]) -> Self {
        // SAFETY: as above.
        unsafe {
            let low = vorrq_u32(low_byte(a), vshlq_n_u32::<8>(low_byte(b)));
            let high = vorrq_u32(vshlq_n_u32::<16>(low_byte(c)), vshlq_n_u32::<24>(vreinterpretq_u32_f32(d.0)));
            Self(vreinterpretq_s32_u32(vorrq_u32(low, high)))
        }
    }
}
