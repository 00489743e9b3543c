//! Whole numbers side by side, for networks of eight-bit weights and activations. Everything here is exact, so every
//! instruction set gives the same bits; [`Packed`] says in plain loops what the others must give.
//!
//! Activations are `u8`, four channels of a vertex in one word of 32 bits, channel 0 lowest; a lane is a vertex. Weights
//! are `i8`. A sum of products is an `i32` and never saturates: the weight file is checked for that. It becomes an
//! activation again by [`Requantise`], in whole numbers throughout:
//!
//! ```text
//! t = clamp(sum >> shift, -2^15, 2^15 - 1)                      rounds down; the bias holds the half that rounds to nearest
//! q = clamp(zero + max(positive * t, negative * t), 0, 255)     a * b here is (a b + 2^14) >> 15
//! ```
//! `0 <= negative <= positive`, so the maximum is a leaky ReLU. The product of sixteen bits is one instruction in SSSE3
//! (`pmulhrsw`), NEON (`sqrdmulh`) and wasm (`q15mulr_sat`), and handles twice as many numbers as one of 32 would.

use bytemuck::{Pod, Zeroable};

use super::Real;

/// From a sum to an activation, see the module: one for each output of a layer.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Requantise {
    /// Factor of positive sums, zero to 2^15 - 1.
    pub positive: i16,
    /// Factor of negative ones, from zero to `positive`.
    pub negative: i16,
    /// The activation that stands for zero; it may lie outside 0 to 255.
    pub zero: i16,
    /// Bits that are dropped first, 0 to 30.
    pub shift: i16,
}

impl Requantise {
    /// The activation of a sum.
    #[must_use]
    #[inline(always)]
    pub const fn apply(self, sum: i32) -> u8 {
        let shifted = sum >> (self.shift & 31);
        let kept = if shifted > 32_767 {
            32_767
        } else if shifted < -32_768 {
            -32_768
        } else {
            shifted
        };
        let positive = (kept * self.positive as i32 + 0x4000) >> 15;
        let negative = (kept * self.negative as i32 + 0x4000) >> 15;
        let q = (if positive > negative { positive } else { negative }) + self.zero as i32;
        if q < 0 {
            0
        } else if q > 255 {
            255
        } else {
            q as u8
        }
    }
}

/// Four outputs of four vertices, transposed, by the places of their bytes: for instructions that pick bytes.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
pub(super) const VERTICES: [u8; 16] = [0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15];

/// Adding this to a number between -2^22 and 2^22 rounds it to a whole one, half to even, that stands in the low bits.
pub(crate) const ROUNDING: f32 = 12_582_912.0;

/// Whole numbers of 32 bits side by side, or four bytes in each.
pub trait Whole<R: Real>: Copy {
    /// Sums of eight outputs fit into registers, for two vectors of vertices; else those of four.
    const EIGHT: bool = false;

    /// The same number in every lane.
    fn splat(number: i32) -> Self;
    /// `self` plus the four products of each lane's bytes, which are from 0 to 255, with the weights.
    #[must_use]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self;
    /// Four outputs' sums as bytes.
    fn requantise(sums: [Self; 4], by: &[Requantise; 4]) -> Self;
    /// The numbers, each rounded to the nearest float32 and half to even.
    fn numbers(self) -> R;
    /// The lowest bytes of what floats consist of.
    fn low_bytes(numbers: [R; 4]) -> Self;
}

/// `L` whole numbers in plain loops: the reference, and what instruction sets without a form of their own use.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
#[repr(transparent)]
pub struct Packed<const L: usize>(pub [i32; L]);

impl<R: Real, const L: usize> Whole<R> for Packed<L> {
    #[inline(always)]
    fn splat(number: i32) -> Self {
        Self([number; L])
    }
    #[inline(always)]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self {
        let Self(mut sums) = self;
        let [a, b, c, d] = weights.map(i32::from);
        for (sum, bytes) in sums.iter_mut().zip(bytes.0) {
            let products = (bytes & 255) * a
                + (bytes >> 8 & 255) * b
                + (bytes >> 16 & 255) * c
                + (bytes >> 24 & 255) * d;
            *sum = sum.wrapping_add(products);
        }
        Self(sums)
    }
    #[inline(always)]
    fn requantise(sums: [Self; 4], by: &[Requantise; 4]) -> Self {
        let mut bytes = [0; L];
        for (place, (sums, by)) in sums.iter().zip(by).enumerate() {
            for (bytes, &sum) in bytes.iter_mut().zip(&sums.0) {
                *bytes |= i32::from(by.apply(sum)) << (8 * place);
            }
        }
        Self(bytes)
    }
    #[inline(always)]
    fn numbers(self) -> R {
        R::from_fn(|lane| self.0.get(lane).map_or(0.0, |&number| number as f32))
    }
    #[inline(always)]
    fn low_bytes(numbers: [R; 4]) -> Self {
        let mut bytes = [0; L];
        for (place, numbers) in numbers.iter().enumerate() {
            for (lane, bytes) in bytes.iter_mut().enumerate() {
                *bytes |= ((numbers.lane(lane).to_bits() & 255) << (8 * place)) as i32;
            }
        }
        Self(bytes)
    }
}
