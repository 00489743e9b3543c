//! Layers in int8. The inputs of each vertex are quantised to `u8` with a step of its own, just wide enough for the largest; sums
//! are taken in `i32` and requantised to `f32`:
//!
//! ```text
//! m = max(max_i x_i, -min_i x_i (255 - zero) / zero)        of this vertex, and at least 2^-100
//! q_i = round(x_i (255 - zero) / m) + zero                  0 to 255, half to even
//! S_o = sum_i w_oi (q_i - zero)                             in i32, exact
//! y_o = act(S_o (scale_o m / (255 - zero)) + b_o)
//! ```
//! So nothing is ever cut off. With one step for all vertices, from the range of the training, roll-outs left that range, and 16
//! bits lost as much as 8.
//!
//! Vertices are vectorised as in the float32 layers: a weight is repeated over a vector of vertices, so nothing is transposed
//! between layers of either kind.

use super::forward::Tile;
use super::{Activation, MAX_WIDTH};
use crate::simd::Real;
use crate::simd::int8::{ROUNDING, Whole};

/// Inputs whose bytes are one word.
pub const GROUP: usize = 4;
/// Outputs of a tile of weights.
pub const TILE_ROWS: usize = 8;
/// Weights of [`TILE_ROWS`] outputs and [`GROUP`] inputs, by rows.
pub type WeightTile = [[i8; GROUP]; TILE_ROWS];
/// The least `m`: a step that can still be divided by.
const LEAST: f32 = 1.0 / (1u128 << 100) as f32;

/// Parameters of a layer in int8.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Int8<'w> {
    /// The activation that stands for zero, 1 to 254.
    pub zero: u8,
    /// Tile after tile of the inputs for each [`TILE_ROWS`] outputs, zeros where there is no input or output.
    pub weights: &'w [WeightTile],
    /// Where sums start: `-zero` times the sum of the weights, one an output, and zeros up to a multiple of [`TILE_ROWS`].
    pub starts: &'w [i32],
    /// Of each output's weights, and zeros as well.
    pub scales: &'w [f32],
    /// Of each output, and zeros as well.
    pub biases: &'w [f32],
}

/// Activations of a tile of vertices, four channels a word.
pub(crate) type Words<R, const COLUMNS: usize> = [[<R as Real>::Whole; COLUMNS]; MAX_WIDTH / GROUP];

/// Quantises inputs. Gives the step of each vertex; an input that is NaN counts as the least.
#[inline(always)]
fn quantise<R: Real, const COLUMNS: usize>(
    zero: u8,
    from: &[Tile<R, COLUMNS>],
    to: &mut Words<R, COLUMNS>,
) -> Tile<R, COLUMNS> {
    let (down, up) = (f32::from(zero), f32::from(u8::MAX - zero));
    let mut most = [R::splat(LEAST); COLUMNS];
    let mut least = [R::splat(0.0); COLUMNS];
    for from in from {
        for column in 0..COLUMNS {
            most[column] = from[column].max(most[column]);
            least[column] = from[column].min(least[column]);
        }
    }
    let (mut inverses, mut steps) = (most, most);
    for column in 0..COLUMNS {
        let most = most[column].max(least[column] * R::splat(-up / down));
        inverses[column] = R::splat(up).divide(most);
        steps[column] = most.divide(R::splat(up));
    }
    for (from, to) in from.chunks(GROUP).zip(to) {
        for (column, to) in to.iter_mut().enumerate() {
            let mut bits = [R::splat(ROUNDING); GROUP];
            for (bits, from) in bits.iter_mut().zip(from) {
                let value = from[column % COLUMNS] * inverses[column % COLUMNS];
                // Only rounding gets below, or NaN.
                *bits = value.max(R::splat(-down)) + R::splat(ROUNDING + down);
            }
            *to = R::Whole::low_bytes(bits);
        }
    }
    steps
}

/// Sums of `N` outputs of a tile from `first` on.
#[inline(always)]
fn sums<R: Real, const COLUMNS: usize, const N: usize>(
    tiles: &[WeightTile],
    starts: &[i32],
    first: usize,
    from: &Words<R, COLUMNS>,
) -> [[R::Whole; COLUMNS]; N] {
    let mut sums = [[R::Whole::splat(0); COLUMNS]; N];
    for (sums, &start) in sums.iter_mut().zip(starts) {
        *sums = [R::Whole::splat(start); COLUMNS];
    }
    for (values, tile) in from.iter().zip(tiles) {
        for (output, sums) in sums.iter_mut().enumerate() {
            let weights = tile[(first + output) % TILE_ROWS];
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum = sum.dot(value, weights);
            }
        }
    }
    sums
}

impl Int8<'_> {
    /// All outputs, `N` at a time, from quantised activations and their steps.
    #[inline(always)]
    fn each<R: Real, const COLUMNS: usize, const N: usize>(
        &self,
        inputs: usize,
        slope: f32,
        (from, steps): (&Words<R, COLUMNS>, Tile<R, COLUMNS>),
        to: &mut [Tile<R, COLUMNS>],
    ) {
        let mut tables =
            self.starts.chunks_exact(N).zip(self.scales.chunks_exact(N)).zip(self.biases.chunks_exact(N));
        let mut outputs = to.chunks_exact_mut(N);
        // Nested loops, not iterators, whose closures the compiler may not inline.
        for tiles in self.weights.chunks_exact(inputs.div_ceil(GROUP).max(1)) {
            for first in (0..TILE_ROWS).step_by(N) {
                let (Some(((starts, scales), biases)), Some(to)) = (tables.next(), outputs.next()) else {
                    return;
                };
                let sums: [_; N] = sums::<R, COLUMNS, N>(tiles, starts, first, from);
                for (((sums, &scale), &bias), to) in sums.iter().zip(scales).zip(biases).zip(to) {
                    for column in 0..COLUMNS {
                        let scale = R::splat(scale) * steps[column];
                        let value = sums[column].numbers() * scale + R::splat(bias);
                        to[column] = value.max(R::splat(slope) * value);
                    }
                }
            }
        }
    }

    /// The layer's outputs.
    #[inline(always)]
    pub(super) fn run<R: Real, const COLUMNS: usize>(
        &self,
        activation: Activation,
        from: &[Tile<R, COLUMNS>],
        words: &mut Words<R, COLUMNS>,
        to: &mut [Tile<R, COLUMNS>],
    ) {
        let steps = quantise(self.zero, from, words);
        let (inputs, slope) = (from.len(), activation.slope());
        // As many outputs at a time as there are registers for.
        if R::Whole::EIGHT {
            self.each::<R, COLUMNS, 8>(inputs, slope, (words, steps), to);
        } else {
            self.each::<R, COLUMNS, 4>(inputs, slope, (words, steps), to);
        }
    }
}
