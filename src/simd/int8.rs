//! Vectors of integers, for layers with int8 weights and activations. Everything here is exact, so every instruction
//! set gives the same bits; [`Packed`] is the reference in plain loops.
//!
//! Activations are `u8`, four channels of a vertex in one word of 32 bits, channel 0 in the lowest byte; each lane
//! holds another vertex. Weights are `i8`. A sum of products is an `i32`; layers are not wide enough for it to
//! overflow.

use super::Real;

/// 1.5 * 2^23. Adding it to a value between -2^22 and 2^22 rounds that to an integer, half to even, in the low bits.
pub(crate) const ROUNDING: f32 = 12_582_912.0;

/// A vector of integers of 32 bits, or of words of four bytes.
pub trait Whole<R: Real>: Copy {
    /// Whether the registers hold the sums of eight outputs for two vectors of vertices. If not, four outputs are
    /// computed at a time.
    const EIGHT: bool = false;

    /// The same value in every lane.
    fn splat(value: i32) -> Self;
    /// `self` plus, in each lane, the sum of the products of its four bytes (0 to 255) with the four weights.
    #[must_use]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self;
    /// The integers, converted to the nearest float32, half to even.
    fn numbers(self) -> R;
    /// Words of four bytes: the lowest bytes of four vectors of floats.
    fn low_bytes(floats: [R; 4]) -> Self;
}

/// `L` integers in plain loops: the reference, and the version for processors without a register type here.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
#[repr(transparent)]
pub struct Packed<const L: usize>(pub [i32; L]);

impl<R: Real, const L: usize> Whole<R> for Packed<L> {
    #[inline(always)]
    fn splat(value: i32) -> Self {
        Self([value; L])
    }
    #[inline(always)]
    fn dot(self, bytes: Self, weights: [i8; 4]) -> Self {
        let Self(mut sums) = self;
        let [a, b, c, d] = weights.map(i32::from);
        for (sum, bytes) in sums.iter_mut().zip(bytes.0) {
            let products =
                (bytes & 255) * a + (bytes >> 8 & 255) * b + (bytes >> 16 & 255) * c + (bytes >> 24 & 255) * d;
            *sum = sum.wrapping_add(products);
        }
        Self(sums)
    }
    #[inline(always)]
    fn numbers(self) -> R {
        R::from_fn(|lane| self.0.get(lane).map_or(0.0, |&value| value as f32))
    }
    #[inline(always)]
    fn low_bytes(floats: [R; 4]) -> Self {
        let mut words = [0; L];
        for (place, floats) in floats.iter().enumerate() {
            for (lane, word) in words.iter_mut().enumerate() {
                *word |= ((floats.lane(lane).to_bits() & 255) << (8 * place)) as i32;
            }
        }
        Self(words)
    }
}
