//! The forward pass in float32, several vertices side by side. Sums are taken in the order of the inputs, so the result of
//! a vertex does not depend on its neighbours nor on the instruction set.

use super::{Activation, Layer, MAX_INPUTS, MAX_OUTPUTS, MAX_WIDTH, Network};
use crate::lanes::Real;

/// What a layer reads and writes, for vertices side by side.
pub(crate) struct Scratch<R> {
    here: [R; MAX_WIDTH],
    there: [R; MAX_WIDTH],
}

impl<R: Real> Scratch<R> {
    #[inline(always)]
    pub(crate) fn new() -> Self {
        Self { here: [R::splat(0.0); MAX_WIDTH], there: [R::splat(0.0); MAX_WIDTH] }
    }
}

/// Outputs that are computed together: each has a sum of its own, so that none waits for another.
const TOGETHER: usize = 8;

/// `to = activation(W from + b)`.
#[inline(always)]
fn dense<R: Real>(layer: &Layer<'_>, from: &[R], to: &mut [R]) {
    let slope = match layer.activation {
        Activation::Linear => R::splat(1.0),
        Activation::LeakyRelu { slope } => R::splat(slope),
    };
    let rows = layer.weights.chunks((TOGETHER * layer.inputs).max(1));
    for ((rows, biases), to) in rows.zip(layer.biases.chunks(TOGETHER)).zip(to.chunks_mut(TOGETHER)) {
        // Rows that there are not repeat the first, and are not kept.
        let row = |index: usize| {
            let start = if index < biases.len() { index * layer.inputs } else { 0 };
            rows.get(start..start + layer.inputs).unwrap_or_default()
        };
        let mut sums = [R::splat(0.0); TOGETHER];
        for (sum, bias) in sums.iter_mut().zip(biases) {
            *sum = R::splat(*bias);
        }
        // Zipped, so that no index has to be checked.
        let lower = from.iter().zip(row(0)).zip(row(1)).zip(row(2)).zip(row(3));
        for ((((((((&value, a), b), c), d), e), f), g), h) in
            lower.zip(row(4)).zip(row(5)).zip(row(6)).zip(row(7))
        {
            for (sum, weight) in sums.iter_mut().zip([a, b, c, d, e, f, g, h]) {
                *sum = *sum + R::splat(*weight) * value;
            }
        }
        for (to, sum) in to.iter_mut().zip(sums).take(biases.len()) {
            // For slopes from zero to one.
            *to = sum.max(slope * sum);
        }
    }
}

/// Layers one after the other, from `scratch.here` to `scratch.here`.
#[inline(always)]
fn run<R: Real>(layers: &[Layer<'_>], scratch: &mut Scratch<R>) {
    for layer in layers {
        dense(layer, &scratch.here, &mut scratch.there);
        core::mem::swap(&mut scratch.here, &mut scratch.there);
    }
}

impl Network<'_> {
    /// Outputs, in their units, from inputs in theirs; what was not clipped is the second array.
    #[inline(always)]
    pub(crate) fn forward<R: Real>(
        &self,
        inputs: &[R; MAX_INPUTS],
        scratch: &mut Scratch<R>,
    ) -> ([R; MAX_OUTPUTS], [R; MAX_OUTPUTS]) {
        let (first, second) = self.layers();
        let mut scaled = *inputs;
        for (value, range) in scaled.iter_mut().zip(self.inputs) {
            *value = value.over(R::splat(range.scale));
        }
        let count = self.inputs.len();
        copy(&scaled, &mut scratch.here, count);
        run(first, scratch);
        let mut sums = [R::splat(0.0); MAX_OUTPUTS];
        copy(&scratch.here, &mut sums, self.outputs.len());
        if !second.is_empty() {
            copy(&scaled, &mut scratch.here, count);
            copy(&sums, scratch.here.get_mut(count..).unwrap_or_default(), self.outputs.len());
            run(second, scratch);
            for (sum, &correction) in sums.iter_mut().zip(&scratch.here) {
                *sum = *sum + correction;
            }
        }
        let mut clipped = sums;
        for ((sum, clipped), range) in sums.iter_mut().zip(&mut clipped).zip(self.outputs) {
            *sum = *sum * R::splat(range.scale);
            *clipped = sum.max(R::splat(range.least)).min(R::splat(range.most));
        }
        (clipped, sums)
    }

    /// Outputs, in their units and clipped, of one vertex. Inputs that are not given count as zero.
    pub fn predict(&self, inputs: &[f32], outputs: &mut [f32]) {
        let mut padded = [0.0; MAX_INPUTS];
        copy(inputs, &mut padded, MAX_INPUTS);
        let (clipped, _) = self.forward::<f32>(&padded, &mut Scratch::new());
        copy(&clipped, outputs, self.outputs.len());
    }
}

#[inline(always)]
fn copy<R: Copy>(from: &[R], to: &mut [R], count: usize) {
    for (to, &from) in to.iter_mut().zip(from).take(count) {
        *to = from;
    }
}
