//! Integers in one vector of WebAssembly: the results of [`Packed`](super::int8::Packed). As for AVX2, even and odd
//! bytes are widened to 16 bits separately, and pairs of products are added to sums of 32 bits.

use core::arch::wasm32::{
    f32x4_convert_i32x4, i32x4_add, i32x4_dot_i16x8, i32x4_splat, u16x8_shr, u16x8_splat, u32x4_shl, u32x4_splat, v128,
    v128_and, v128_or,
};

use super::int8::Whole;
use super::simd128::Simd128;

#[inline(always)]
fn low_byte(floats: Simd128) -> v128 {
    v128_and(floats.0, u32x4_splat(255))
}

/// Four words of 32 bits.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Bytes16(v128);

impl Whole<Simd128> for Bytes16 {
    #[inline(always)]
    fn splat(value: i32) -> Self {
        Self(i32x4_splat(value))
    }
    #[inline(always)]
    fn dot(self, bytes: Self, [a, b, c, d]: [i8; 4]) -> Self {
        let weights = |[low, high]: [i8; 2]| -> v128 { bytemuck::must_cast([[i16::from(low), i16::from(high)]; 4]) };
        let even = v128_and(bytes.0, u16x8_splat(255));
        let odd = u16x8_shr(bytes.0, 8);
        let products = i32x4_add(i32x4_dot_i16x8(even, weights([a, c])), i32x4_dot_i16x8(odd, weights([b, d])));
        Self(i32x4_add(self.0, products))
    }
    #[inline(always)]
    fn numbers(self) -> Simd128 {
        Simd128(f32x4_convert_i32x4(self.0))
    }
    #[inline(always)]
    fn low_bytes([a, b, c, d]: [Simd128; 4]) -> Self {
        let low = v128_or(low_byte(a), u32x4_shl(low_byte(b), 8));
        let high = v128_or(u32x4_shl(low_byte(c), 16), u32x4_shl(d.0, 24));
        Self(v128_or(low, high))
    }
}
