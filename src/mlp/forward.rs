//! The forward pass, scalar for one vertex and vectorised over many. Sums are taken in the order of the inputs, so the
//! result of a vertex does not depend on the others.
//!
//! Vertices pass in tiles of one or two vectors, and each weight is repeated over a vector. Four outputs at a time have
//! their sums in registers, so that each loaded vector serves four multiplications and additions.
//!
//! A network with layers in int8 ([`super::int8`]) fuses no multiplication with an addition, so that it gives the same
//! bits on every processor.

use super::int8::Words;
use super::{Layer, MAX_INPUTS, MAX_OUTPUTS, MAX_WIDTH, Network, Parameters};
use crate::simd::int8::Whole;
use crate::simd::{Kernel, Real, dispatch};

/// A value of as many vertices as `COLUMNS` vectors hold.
pub(crate) type Tile<R, const COLUMNS: usize> = [R; COLUMNS];

/// What layers read and write, for a tile of vertices.
pub(crate) struct Scratch<R: Real, const COLUMNS: usize> {
    here: [Tile<R, COLUMNS>; MAX_WIDTH],
    there: [Tile<R, COLUMNS>; MAX_WIDTH],
    words: Words<R, COLUMNS>,
}

impl<R: Real, const COLUMNS: usize> Scratch<R, COLUMNS> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        let zero = [[R::splat(0.0); COLUMNS]; MAX_WIDTH];
        let words = [[R::Whole::splat(0); COLUMNS]; _];
        Self { here: zero, there: zero, words }
    }
}

/// Outputs computed at a time.
const ROW_BATCH: usize = 4;

/// `sums + weight values`.
#[inline(always)]
fn plus<R: Real, const COLUMNS: usize, const FUSED: bool>(
    sums: Tile<R, COLUMNS>,
    weight: f32,
    values: &Tile<R, COLUMNS>,
) -> Tile<R, COLUMNS> {
    let weight = R::splat(weight);
    // Not a closure, which the compiler may not inline.
    let mut out = sums;
    for column in 0..COLUMNS {
        out[column] =
            if FUSED { weight.fused(values[column], sums[column]) } else { weight * values[column] + sums[column] };
    }
    out
}

/// `to = activation(W from + b)`.
#[inline(always)]
fn dense<R: Real, const COLUMNS: usize, const FUSED: bool>(
    layer: &Layer<'_>,
    (weights, biases): (&[f32], &[f32]),
    from: &[Tile<R, COLUMNS>],
    to: &mut [Tile<R, COLUMNS>],
) {
    let slope = R::splat(layer.activation.slope());
    let rows = weights.chunks((ROW_BATCH * layer.inputs).max(1));
    for ((rows, biases), to) in rows.zip(biases.chunks(ROW_BATCH)).zip(to.chunks_mut(ROW_BATCH)) {
        // The last batch may be short: it repeats its first row, and drops the result.
        let row = |index: usize| {
            let start = if index < biases.len() { index * layer.inputs } else { 0 };
            rows.get(start..start + layer.inputs).unwrap_or_default()
        };
        let [mut one, mut two, mut three, mut four] =
            [0, 1, 2, 3].map(|index| [R::splat(biases.get(index).copied().unwrap_or(0.0)); COLUMNS]);
        // Zipped, so that no index is checked; four variables, which the compiler keeps in registers.
        for ((((values, &a), &b), &c), &d) in from.iter().zip(row(0)).zip(row(1)).zip(row(2)).zip(row(3)) {
            one = plus::<R, COLUMNS, FUSED>(one, a, values);
            two = plus::<R, COLUMNS, FUSED>(two, b, values);
            three = plus::<R, COLUMNS, FUSED>(three, c, values);
            four = plus::<R, COLUMNS, FUSED>(four, d, values);
        }
        for (to, sums) in to.iter_mut().zip([one, two, three, four]).take(biases.len()) {
            // The leaky ReLU for slopes from zero to one.
            for (to, sum) in to.iter_mut().zip(sums) {
                *to = sum.max(slope * sum);
            }
        }
    }
}

/// The layers of a part, from `here` to what is returned.
#[inline(always)]
fn run<'a, R: Real, const COLUMNS: usize, const FUSED: bool>(
    layers: &[Layer<'_>],
    scratch: &'a mut Scratch<R, COLUMNS>,
) -> &'a [Tile<R, COLUMNS>] {
    let Scratch { here, there, words } = scratch;
    let (mut from, mut to) = (here, there);
    for layer in layers {
        match &layer.parameters {
            Parameters::Float { weights, biases } => {
                dense::<R, COLUMNS, FUSED>(layer, (weights, biases), from.as_slice(), to.as_mut_slice());
            }
            Parameters::Int8(int8) => {
                let inputs = from.get(..layer.inputs).unwrap_or_default();
                int8.run(layer.activation, inputs, words, to.as_mut_slice());
            }
        }
        core::mem::swap(&mut from, &mut to);
    }
    from
}

impl Network<'_> {
    /// Outputs of a tile of vertices, in their units, from inputs in theirs: clipped, and as they were before.
    #[inline(always)]
    pub(crate) fn forward<R: Real, const COLUMNS: usize>(
        &self,
        inputs: &[Tile<R, COLUMNS>; MAX_INPUTS],
        scratch: &mut Scratch<R, COLUMNS>,
    ) -> [[Tile<R, COLUMNS>; MAX_OUTPUTS]; 2] {
        if self.has_int8() {
            self.parts::<R, COLUMNS, false>(inputs, scratch)
        } else {
            self.parts::<R, COLUMNS, true>(inputs, scratch)
        }
    }

    #[inline(always)]
    fn parts<R: Real, const COLUMNS: usize, const FUSED: bool>(
        &self,
        inputs: &[Tile<R, COLUMNS>; MAX_INPUTS],
        scratch: &mut Scratch<R, COLUMNS>,
    ) -> [[Tile<R, COLUMNS>; MAX_OUTPUTS]; 2] {
        let (first, second) = self.layers();
        let mut scaled = *inputs;
        for (values, range) in scaled.iter_mut().zip(self.inputs) {
            for value in values {
                *value = value.divide(R::splat(range.scale));
            }
        }
        let (count, high) = (self.inputs.len(), self.outputs.len());
        let mut sums = [[R::splat(0.0); COLUMNS]; MAX_OUTPUTS];
        // One loop body for both parts: inlined twice it would be twice the code for every instruction set.
        for (part, layers) in [first, second].into_iter().enumerate() {
            if part > 0 && layers.is_empty() {
                break;
            }
            copy(&scaled, &mut scratch.here, count);
            copy(&sums, scratch.here.get_mut(count..).unwrap_or_default(), high);
            for (sums, values) in sums.iter_mut().zip(run::<R, COLUMNS, FUSED>(layers, scratch)).take(high) {
                for (sum, &value) in sums.iter_mut().zip(values) {
                    *sum = if part == 0 { value } else { *sum + value };
                }
            }
        }
        let mut clipped = sums;
        for ((sums, clipped), range) in sums.iter_mut().zip(&mut clipped).zip(self.outputs) {
            for (sum, clipped) in sums.iter_mut().zip(clipped) {
                *sum = *sum * R::splat(range.scale);
                *clipped = sum.max(R::splat(range.least)).min(R::splat(range.most));
            }
        }
        [clipped, sums]
    }

    /// Outputs, in their units and clipped, of one vertex. Inputs that are not given count as zero. The same bits on
    /// every processor.
    pub fn predict(&self, inputs: &[f32], outputs: &mut [f32]) {
        let mut padded = [[0.0]; MAX_INPUTS];
        for (padded, input) in padded.iter_mut().zip(inputs) {
            *padded = [*input];
        }
        let [clipped, _] = self.forward::<f32, 1>(&padded, &mut Scratch::new());
        for (output, [clipped]) in outputs.iter_mut().zip(clipped).take(self.outputs.len()) {
            *output = clipped;
        }
    }

    /// The same for many vertices: rows of as many inputs as the network has, and of as many outputs. Rows that are not
    /// whole, or have no counterpart, are left out. In float32 it agrees with [`Network::predict`] to rounding, and
    /// gives the same bits on every processor with the feature `deterministic`; with layers in int8 it gives the bits
    /// of [`Network::predict`].
    pub fn predict_rows(&self, inputs: &[f32], outputs: &mut [f32]) {
        dispatch(Rows { network: self, inputs, outputs });
    }
}

struct Rows<'a> {
    network: &'a Network<'a>,
    inputs: &'a [f32],
    outputs: &'a mut [f32],
}

impl Kernel for Rows<'_> {
    type Output = ();

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        if R::MANY_REGISTERS { self.tiles::<R, 2>() } else { self.tiles::<R, 1>() }
    }
}

impl Rows<'_> {
    #[inline(always)]
    fn tiles<R: Real, const COLUMNS: usize>(self) {
        let Self { network, inputs, outputs } = self;
        let (wide, high) = (network.inputs.len().max(1), network.outputs.len().max(1));
        let count = (inputs.len() / wide).min(outputs.len() / high);
        let (Some(inputs), Some(outputs)) = (inputs.get(..count * wide), outputs.get_mut(..count * high)) else {
            return;
        };
        let vertices = COLUMNS * R::COUNT;
        let mut scratch = Scratch::<R, COLUMNS>::new();
        for (inputs, outputs) in inputs.chunks(wide * vertices).zip(outputs.chunks_mut(high * vertices)) {
            let mut values = [[R::splat(0.0); COLUMNS]; MAX_INPUTS];
            for (input, values) in values.iter_mut().enumerate().take(wide) {
                for (column, value) in values.iter_mut().enumerate() {
                    let first = column * R::COUNT;
                    *value = R::from_fn(|lane| inputs.get((first + lane) * wide + input).copied().unwrap_or(0.0));
                }
            }
            let [clipped, _] = network.forward(&values, &mut scratch);
            for (row, outputs) in outputs.chunks_exact_mut(high).enumerate() {
                for (output, values) in outputs.iter_mut().zip(&clipped) {
                    *output = values.get(row / R::COUNT).map_or(0.0, |value| value.lane(row % R::COUNT));
                }
            }
        }
    }
}

#[inline(always)]
fn copy<T: Copy>(from: &[T], to: &mut [T], count: usize) {
    for (to, &from) in to.iter_mut().zip(from).take(count) {
        *to = from;
    }
}
