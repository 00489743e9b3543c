//! Whole numbers side by side, for layers of eight-bit weights and activations. Everything here is exact, so every
//! instruction set gives the same bits; [`Packed`] says in plain loops what the others must give.
//!
//! Activations are `u8`, four channels of a vertex in one word of 32 bits, channel 0 lowest; a lane is a vertex. Weights
//! are `i8`. A sum of products is an `i32`; layers are not wide enough for one to overflow.

use super::Real;

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
