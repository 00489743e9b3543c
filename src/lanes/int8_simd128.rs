//! Whole numbers in one vector of WebAssembly: the same results as [`Packed`](super::int8::Packed), in the way of
//! AVX2: bytes become numbers of 16 bits, even and odd ones apart, and pairs of products sums of 32.

use core::arch::wasm32::{
    f32x4_convert_i32x4, i8x16_shuffle, i16x8, i16x8_add_sat, i16x8_max, i16x8_narrow_i32x4,
    i16x8_q15mulr_sat, i32x4_add, i32x4_dot_i16x8, i32x4_shr, i32x4_splat, u8x16_narrow_i16x8, u16x8_shr,
    u16x8_splat, u32x4_shl, u32x4_splat, v128, v128_and, v128_or,
};

use super::int8::{Requantise, Whole};
use super::simd128::Simd128;

#[inline(always)]
fn low_byte(number: Simd128) -> v128 {
    v128_and(number.0, u32x4_splat(255))
}

/// The first in the lower four, the second in the upper.
#[inline(always)]
fn halves(low: i16, high: i16) -> v128 {
    i16x8(low, low, low, low, high, high, high, high)
}

/// Four of them.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(super) struct Bytes16(v128);

impl Bytes16 {
    /// Two outputs' sums, brought to activations that are not clamped yet.
    #[inline(always)]
    fn pair(a: Self, b: Self, [by_a, by_b]: [Requantise; 2]) -> v128 {
        let a = i32x4_shr(a.0, by_a.shift as u32);
        let b = i32x4_shr(b.0, by_b.shift as u32);
        let kept = i16x8_narrow_i32x4(a, b);
        let positive = i16x8_q15mulr_sat(kept, halves(by_a.positive, by_b.positive));
        let negative = i16x8_q15mulr_sat(kept, halves(by_a.negative, by_b.negative));
        i16x8_add_sat(i16x8_max(positive, negative), halves(by_a.zero, by_b.zero))
    }
}

impl Whole<Simd128> for Bytes16 {
    #[inline(always)]
    fn splat(number: i32) -> Self {
        Self(i32x4_splat(number))
    }
    #[inline(always)]
    fn dot(self, bytes: Self, [a, b, c, d]: [i8; 4]) -> Self {
        let weights =
            |[low, high]: [i8; 2]| -> v128 { bytemuck::must_cast([[i16::from(low), i16::from(high)]; 4]) };
        let even = v128_and(bytes.0, u16x8_splat(255));
        let odd = u16x8_shr(bytes.0, 8);
        let products =
            i32x4_add(i32x4_dot_i16x8(even, weights([a, c])), i32x4_dot_i16x8(odd, weights([b, d])));
        Self(i32x4_add(self.0, products))
    }
    #[inline(always)]
    fn requantise([a, b, c, d]: [Self; 4], &[by_a, by_b, by_c, by_d]: &[Requantise; 4]) -> Self {
        let (ab, cd) = (Self::pair(a, b, [by_a, by_b]), Self::pair(c, d, [by_c, by_d]));
        let bytes = u8x16_narrow_i16x8(ab, cd);
        // Four outputs of four vertices, transposed.
        Self(i8x16_shuffle::<0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15>(bytes, bytes))
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
