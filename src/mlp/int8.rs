//! Layers of eight-bit weights and activations. What goes in is brought to `u8` channel by channel, sums are taken in
//! `i32`, and what comes out is either the next layer's `u8` or `f32` again:
//!
//! ```text
//! q_i = clamp(round(x_i inverse_i + zero_i), 0, 255)        from f32: half to even (Quantise)
//! s_o = b_o + sum_i w_oi q_i                                in i32, exact
//! q_o = Requantise(s_o)                                     for an int8 layer after it (lanes/int8.rs)
//! y_o = act(scale_o s_o)                                    else
//! ```
//! Each channel has a scale and a zero of its own: they cost nothing, since those of a layer's outputs are in its
//! requantisation and those of its inputs in its weights and biases.
//!
//! Vertices lie side by side, as in the float32 layers: a weight is repeated over a vector of vertices, so nothing has to be
//! transposed between layers of either kind.

use bytemuck::{Pod, Zeroable};

use super::forward::Tile;
use super::{Activation, MAX_WIDTH};
use crate::lanes::Real;
use crate::lanes::int8::{ROUNDING, Requantise, Whole};

/// Inputs whose bytes stand in one word.
pub const GROUP: usize = 4;
/// Outputs whose weights stand together.
pub const BLOCK: usize = 8;
/// Weights of eight outputs and four inputs, output by output.
pub type WeightTile = [[i8; GROUP]; BLOCK];

/// From a float32 input to an activation, see the module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Quantise {
    /// One over what a step of the activation is; positive.
    pub inverse: f32,
    /// The activation that stands for zero, a whole number from -2^15 to 2^15 - 1.
    pub zero: f32,
}

/// What a layer of eight-bit numbers does with its sums.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outputs<'w> {
    /// Activations for the next layer; with the zeros behind them a multiple of eight.
    Requantised(&'w [Requantise]),
    /// What one is worth, a multiple of eight as well: float32, and then the layer's activation function.
    Float(&'w [f32]),
}

/// Numbers of a layer of eight bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Int8<'w> {
    /// One an input, if what goes in is float32; nothing after a layer that hands on activations.
    pub quantise: Option<&'w [Quantise]>,
    /// For each eight outputs a tile for each four inputs; what there is not is zero.
    pub weights: &'w [WeightTile],
    /// One an output, a multiple of eight, with what the zeros of the inputs add and the half of [`Requantise`].
    pub biases: &'w [i32],
    /// See there.
    pub outputs: Outputs<'w>,
}

/// Activations of a tile of vertices, four channels a word.
pub(crate) type Words<R, const COLUMNS: usize> = [[<R as Real>::Whole; COLUMNS]; MAX_WIDTH / GROUP];

/// Float32 inputs to activations; an input that is not a number counts as the least.
#[inline(always)]
pub(super) fn quantise<R: Real, const COLUMNS: usize>(
    by: &[Quantise],
    from: &[Tile<R, COLUMNS>],
    to: &mut Words<R, COLUMNS>,
) {
    for ((by, from), to) in by.chunks(GROUP).zip(from.chunks(GROUP)).zip(to) {
        for (column, to) in to.iter_mut().enumerate() {
            let mut bits = [R::splat(ROUNDING); GROUP];
            for ((bits, by), from) in bits.iter_mut().zip(by).zip(from) {
                let value = from[column % COLUMNS] * R::splat(by.inverse);
                let (least, most) = (R::splat(-by.zero), R::splat(255.0 - by.zero));
                *bits = value.max(least).min(most) + R::splat(ROUNDING + by.zero);
            }
            *to = R::Whole::low_bytes(bits);
        }
    }
}

/// Sums of `N` outputs, `first` the first of eight.
#[inline(always)]
fn sums<R: Real, const COLUMNS: usize, const N: usize>(
    tiles: &[WeightTile],
    biases: &[i32],
    first: usize,
    from: &Words<R, COLUMNS>,
) -> [[R::Whole; COLUMNS]; N] {
    let mut sums = [[R::Whole::splat(0); COLUMNS]; N];
    for (output, sums) in sums.iter_mut().enumerate() {
        *sums = [R::Whole::splat(biases.get(first + output).copied().unwrap_or(0)); COLUMNS];
    }
    for (values, tile) in from.iter().zip(tiles) {
        for (output, sums) in sums.iter_mut().enumerate() {
            let weights = tile[(first + output) % BLOCK];
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum = sum.dot(value, weights);
            }
        }
    }
    sums
}

/// What becomes of the sums of four outputs, the first of which is `first`. Not a closure: the compiler leaves calls of
/// closures over vectors standing.
trait Sink<R: Real, const COLUMNS: usize> {
    fn take(&mut self, first: usize, sums: [[R::Whole; COLUMNS]; 4]);
}

/// Activations for the next layer.
struct ToWords<'a, R: Real, const COLUMNS: usize> {
    by: &'a [[Requantise; GROUP]],
    to: &'a mut Words<R, COLUMNS>,
}

impl<R: Real, const COLUMNS: usize> Sink<R, COLUMNS> for ToWords<'_, R, COLUMNS> {
    #[inline(always)]
    fn take(&mut self, first: usize, [a, b, c, d]: [[R::Whole; COLUMNS]; 4]) {
        if let (Some(by), Some(to)) = (self.by.get(first / GROUP), self.to.get_mut(first / GROUP)) {
            for column in 0..COLUMNS {
                to[column] = R::Whole::requantise([a[column], b[column], c[column], d[column]], by);
            }
        }
    }
}

/// Float32 again.
struct ToFloats<'a, R, const COLUMNS: usize> {
    scales: &'a [[f32; GROUP]],
    slope: f32,
    to: &'a mut [[Tile<R, COLUMNS>; GROUP]],
}

impl<R: Real, const COLUMNS: usize> Sink<R, COLUMNS> for ToFloats<'_, R, COLUMNS> {
    #[inline(always)]
    fn take(&mut self, first: usize, sums: [[R::Whole; COLUMNS]; 4]) {
        if let (Some(scales), Some(to)) = (self.scales.get(first / GROUP), self.to.get_mut(first / GROUP)) {
            for output in 0..GROUP {
                for column in 0..COLUMNS {
                    let value = sums[output][column].numbers() * R::splat(scales[output]);
                    to[output][column] = value.max(R::splat(self.slope) * value);
                }
            }
        }
    }
}

impl Int8<'_> {
    /// Sums of `N` outputs at a time.
    #[inline(always)]
    fn each<R: Real, S: Sink<R, COLUMNS>, const COLUMNS: usize, const N: usize>(
        &self,
        inputs: usize,
        from: &Words<R, COLUMNS>,
        sink: &mut S,
    ) {
        let tiles = self.weights.chunks_exact(inputs.div_ceil(GROUP).max(1));
        for (block, (tiles, biases)) in tiles.zip(self.biases.chunks_exact(BLOCK)).enumerate() {
            for first in (0..BLOCK).step_by(N) {
                let sums: [_; N] = sums::<R, COLUMNS, N>(tiles, biases, first, from);
                for four in (0..N).step_by(4) {
                    let sums = [sums[four], sums[four + 1], sums[four + 2], sums[four + 3]];
                    sink.take(block * BLOCK + first + four, sums);
                }
            }
        }
    }

    /// As many outputs at a time as there are registers for.
    #[inline(always)]
    fn all<R: Real, S: Sink<R, COLUMNS>, const COLUMNS: usize>(
        &self,
        inputs: usize,
        from: &Words<R, COLUMNS>,
        sink: &mut S,
    ) {
        if R::Whole::EIGHT {
            self.each::<R, S, COLUMNS, 8>(inputs, from, sink);
        } else {
            self.each::<R, S, COLUMNS, 4>(inputs, from, sink);
        }
    }

    /// Activations to activations.
    #[inline(always)]
    pub(super) fn words<R: Real, const COLUMNS: usize>(
        &self,
        inputs: usize,
        by: &[Requantise],
        from: &Words<R, COLUMNS>,
        to: &mut Words<R, COLUMNS>,
    ) {
        self.all(inputs, from, &mut ToWords::<R, COLUMNS> { by: by.as_chunks().0, to });
    }

    /// Activations to float32.
    #[inline(always)]
    pub(super) fn floats<R: Real, const COLUMNS: usize>(
        &self,
        inputs: usize,
        scales: &[f32],
        activation: Activation,
        from: &Words<R, COLUMNS>,
        to: &mut [Tile<R, COLUMNS>],
    ) {
        let (to, _) = to.as_chunks_mut();
        self.all(inputs, from, &mut ToFloats { scales: scales.as_chunks().0, slope: activation.slope(), to });
    }
}
