//! Networks in eight bits from networks in float32, by what passes through them on samples of their inputs (post-training
//! quantisation, Jacob et al. 2018, Nagel et al. 2021).
//!
//! Layer by layer the samples go through both networks at once. Weights are rounded with a scale for each output,
//!
//! ```text
//! w_oi = round(W_oi / scale_o),   scale_o = max_i |W_oi| / 127
//! ```
//! and what that does to the outputs is taken back where nothing is rounded: biases make up for the mean (bias correction), and
//! the last layer of a part, if it is in float32, is fitted anew to what the float32 network predicts, by least squares.
//! A sample whose prediction is `y`, in standard deviations, counts as `1 / (1 + y^2)`: motion that is fast or rough must stay right
//! in proportion, or a roll-out rings, but must not decide about slow motion.

use core::fmt;
use std::vec;
use std::vec::Vec;

use super::{Activation, Description, Int8Description, Layer, Network, Numbers, WeightError};

/// Samples that are looked at, at most.
const ENOUGH: usize = 16_000;
/// Activations that may stand for zero; the more, the smaller may the largest negative input be.
const ZEROS: [u8; 5] = [8, 16, 32, 64, 128];
/// What keeps a fit from using differences that samples hardly show, of the mean square of what it fits by.
const RIDGE: f64 = 1e-6;

/// Why a network is not quantised.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum QuantiseError {
    /// A layer is of eight bits already.
    Int8 {
        /// Which, from zero.
        layer: usize,
    },
    /// There are no whole rows of samples.
    NoSamples,
    /// A sample is not finite somewhere in the network.
    NotFinite {
        /// The layer it goes into, from zero.
        layer: usize,
    },
    /// The file would not be usable.
    Weights(WeightError),
}

impl fmt::Display for QuantiseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Int8 { layer } => write!(f, "layer {layer} is of eight bits already"),
            Self::NoSamples => write!(f, "there are no samples to quantise by"),
            Self::NotFinite { layer } => write!(f, "the samples are not finite before layer {layer}"),
            Self::Weights(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for QuantiseError {}

impl From<WeightError> for QuantiseError {
    fn from(error: WeightError) -> Self {
        Self::Weights(error)
    }
}

/// A quantised network, for [`super::write_int8`].
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised<'w> {
    /// The network with its new biases and last layers.
    pub description: Description<'w>,
    /// Its layers of eight bits.
    pub layers: Vec<Option<Int8Description>>,
    /// Root mean square difference of what each layer hands on from what it ought to, over the standard deviation of that; of
    /// the samples, as they count. That is what it does in float32, and of the last layer what is still to be corrected as well.
    pub errors: Vec<f64>,
}

/// Samples by rows, as they leave a layer.
#[derive(Clone)]
struct Flow {
    width: usize,
    /// In the float32 network.
    exact: Vec<f64>,
    /// In the quantised one.
    found: Vec<f64>,
}

/// Quantises by samples, rows of as many numbers as the network has inputs, in their units. The layers of `float`, counted through
/// both parts, stay in float32.
pub fn quantise<'w>(
    network: &Network<'w>,
    samples: &[f32],
    float: &[usize],
) -> Result<Quantised<'w>, QuantiseError> {
    let (first, second) = network.layers();
    if let Some(layer) = first.iter().chain(second).position(Layer::is_int8) {
        return Err(QuantiseError::Int8 { layer });
    }
    let (wide, high) = (network.inputs().len().max(1), network.outputs().len().max(1));
    if samples.len() < wide {
        return Err(QuantiseError::NoSamples);
    }
    if samples.iter().any(|number| !number.is_finite()) {
        return Err(QuantiseError::NotFinite { layer: 0 });
    }
    let every = (samples.len() / wide).div_ceil(ENOUGH);
    let rows: Vec<f32> = samples.chunks_exact(wide).step_by(every).flatten().copied().collect();
    let mut predicted = vec![0.0; rows.len() / wide * high];
    network.predict_rows(&rows, &mut predicted);
    let counts = |row: &[f32]| {
        let scaled = row.iter().zip(network.outputs()).map(|(y, range)| f64::from(y / range.scale));
        1.0 / (1.0 + scaled.map(|y| y * y).sum::<f64>())
    };
    let counts: Vec<f64> = predicted.chunks_exact(high).map(counts).collect();
    let scaled = |row: &[f32]| -> Vec<f64> {
        row.iter().zip(network.inputs()).map(|(x, range)| f64::from(x / range.scale)).collect()
    };
    let scaled: Vec<f64> = rows.chunks_exact(wide).flat_map(scaled).collect();
    let mut quantised =
        Quantised { description: Description::of(network), layers: Vec::new(), errors: Vec::new() };
    let start = Flow { width: wide, exact: scaled.clone(), found: scaled.clone() };
    let one = part(first, start, None, (float, &counts), &mut quantised)?;
    if !second.is_empty() {
        let both = |predicted: &[f64]| -> Vec<f64> {
            let rows = scaled.chunks_exact(wide).zip(predicted.chunks_exact(high));
            rows.flat_map(|(x, p)| x.iter().chain(p).copied()).collect()
        };
        let start = Flow { width: wide + high, exact: both(&one.exact), found: both(&one.found) };
        part(second, start, Some(&one), (float, &counts), &mut quantised)?;
    }
    Ok(quantised)
}

/// One part, which has to correct what is left of `before`, the part in front of it.
fn part<'w>(
    layers: &[Layer<'_>],
    mut flow: Flow,
    before: Option<&Flow>,
    (float, counts): (&[usize], &[f64]),
    quantised: &mut Quantised<'w>,
) -> Result<Flow, QuantiseError> {
    let start = quantised.layers.len();
    for (at, layer) in layers.iter().enumerate() {
        let number = start + at;
        if flow.found.iter().any(|number| !number.is_finite()) {
            return Err(QuantiseError::NotFinite { layer: number });
        }
        let Numbers::Float { weights, biases } = layer.numbers else {
            return Err(QuantiseError::Int8 { layer: number });
        };
        let mut wanted = dense(weights, biases, &flow.exact, flow.width);
        let last = at + 1 == layers.len() && layer.activation == Activation::Linear;
        if let (true, Some(before)) = (last, before) {
            for (wanted, (exact, found)) in wanted.iter_mut().zip(before.exact.iter().zip(&before.found)) {
                *wanted += exact - found;
            }
        }
        let eight = (!float.contains(&number)).then(|| eight(layer, weights, &flow.found, counts));
        let description = &mut quantised.description;
        let described = description.first.iter_mut().chain(&mut description.second).nth(number);
        let mut found = match &eight {
            Some((int8, activations)) => int8_dense(int8, biases, activations, flow.width),
            None => dense(weights, biases, &flow.found, flow.width),
        };
        if let Some(described) = described {
            let left: Vec<f64> = wanted.iter().zip(&found).map(|(wanted, found)| wanted - found).collect();
            if eight.is_some() {
                for (output, bias) in described.biases.iter_mut().enumerate() {
                    let off = mean(left.iter().skip(output).step_by(layer.outputs).copied(), counts);
                    *bias += off as f32;
                    found.iter_mut().skip(output).step_by(layer.outputs).for_each(|sum| *sum += off);
                }
            } else if last && quantised.layers.iter().skip(start).any(Option::is_some) {
                let changes = fitted(&flow.found, flow.width, &left, layer.outputs, counts);
                let rows = described.weights.chunks_mut(flow.width).zip(&mut described.biases);
                for ((weights, bias), changes) in rows.zip(&changes) {
                    for (number, change) in weights.iter_mut().chain([bias]).zip(changes) {
                        *number += *change as f32;
                    }
                }
                found = dense(&described.weights, &described.biases, &flow.found, flow.width);
            }
        }
        let activated = |sums: Vec<f64>| sums.into_iter().map(|sum| act(layer.activation, sum)).collect();
        flow = Flow { width: layer.outputs, exact: activated(wanted), found: activated(found) };
        quantised.layers.push(eight.map(|(int8, _)| int8));
        quantised.errors.push(error(&flow, counts));
    }
    Ok(flow)
}

fn act(activation: Activation, sum: f64) -> f64 {
    if sum < 0.0 { f64::from(activation.slope()) * sum } else { sum }
}

/// Sums of every sample.
fn dense(weights: &[f32], biases: &[f32], samples: &[f64], wide: usize) -> Vec<f64> {
    let mut sums = Vec::with_capacity(samples.len() / wide.max(1) * biases.len());
    for row in samples.chunks_exact(wide) {
        sums.extend(weights.chunks_exact(wide).zip(biases).map(|(weights, &bias)| {
            f64::from(bias) + weights.iter().zip(row).map(|(&w, x)| f64::from(w) * x).sum::<f64>()
        }));
    }
    sums
}

/// The same in eight bits.
fn int8_dense(int8: &Int8Description, biases: &[f32], (words, steps): &Activations, wide: usize) -> Vec<f64> {
    let zero = i32::from(int8.zero);
    let mut sums = Vec::with_capacity(steps.len() * biases.len());
    for (row, step) in words.chunks_exact(wide).zip(steps) {
        let rows = int8.weights.chunks_exact(wide).zip(&int8.scales).zip(biases);
        sums.extend(rows.map(|((weights, &scale), &bias)| {
            let sum: i32 = weights.iter().zip(row).map(|(&w, &q)| i32::from(w) * (i32::from(q) - zero)).sum();
            f64::from(sum) * f64::from(scale) * step + f64::from(bias)
        }));
    }
    sums
}

/// Of samples that count so much.
fn mean(values: impl Iterator<Item = f64>, counts: &[f64]) -> f64 {
    let weighted =
        values.zip(counts).fold((0.0, 0.0), |(sum, all), (value, count)| (sum + count * value, all + count));
    weighted.0 / weighted.1.max(f64::MIN_POSITIVE)
}

/// See [`Quantised::errors`].
fn error(flow: &Flow, counts: &[f64]) -> f64 {
    let squares = |channel: usize| {
        let column = |values: &'_ [f64]| -> Vec<f64> {
            values.iter().skip(channel).step_by(flow.width).copied().collect()
        };
        let (exact, found) = (column(&flow.exact), column(&flow.found));
        let centre = mean(exact.iter().copied(), counts);
        let off = exact.iter().zip(&found).map(|(a, b)| (a - b).powi(2));
        (mean(off, counts), mean(exact.iter().map(|value| (value - centre).powi(2)), counts))
    };
    let (off, of) = (0..flow.width).map(squares).fold((0.0, 0.0), |(off, of), (a, b)| (off + a, of + b));
    if of > 0.0 { (off / of).sqrt() } else { 0.0 }
}

/// Activations by rows, and what a step of each row is.
type Activations = (Vec<u8>, Vec<f64>);

/// A layer in eight bits, and its activations on the samples.
fn eight(
    layer: &Layer<'_>,
    weights: &[f32],
    samples: &[f64],
    counts: &[f64],
) -> (Int8Description, Activations) {
    let rows = || samples.chunks_exact(layer.inputs);
    // The one with which steps are shortest.
    let worth = |&zero: &u8| mean(rows().map(|row| step(row, zero).powi(2)), counts);
    let zero = ZEROS.into_iter().min_by(|a, b| worth(a).total_cmp(&worth(b))).unwrap_or(128);
    let steps: Vec<f64> = rows().map(|row| step(row, zero)).collect();
    let words = rows().zip(&steps).flat_map(|(row, step)| {
        row.iter().map(move |x| (x / step + f64::from(zero)).round_ties_even() as u8)
    });
    let words = words.collect();
    let (mut rounded, mut scales) = (Vec::with_capacity(weights.len()), Vec::with_capacity(layer.outputs));
    for row in weights.chunks_exact(layer.inputs) {
        let scale = (row.iter().fold(0.0f32, |most, weight| most.max(weight.abs())) / 127.0).max(1e-30);
        rounded.extend(row.iter().map(|weight| (weight / scale).round() as i8));
        scales.push(scale);
    }
    (Int8Description { zero, weights: rounded, scales }, (words, steps))
}

/// As wide as a row needs it.
fn step(row: &[f64], zero: u8) -> f64 {
    let (up, down) = (f64::from(u8::MAX - zero), f64::from(zero));
    row.iter().fold(1e-30, |most: f64, &x| most.max(x / up).max(-x / down))
}

/// What has to be added to weights and bias, the last, of each output for sums that are `left` larger: least squares.
fn fitted(samples: &[f64], wide: usize, left: &[f64], high: usize, counts: &[f64]) -> Vec<Vec<f64>> {
    let n = wide + 1;
    let (mut products, mut sides) = (vec![0.0; n * n], vec![vec![0.0; n]; high]);
    let mut by = vec![1.0; n];
    for ((row, left), count) in samples.chunks_exact(wide).zip(left.chunks_exact(high)).zip(counts) {
        by[..wide].copy_from_slice(row);
        for (line, x) in products.chunks_exact_mut(n).zip(&by) {
            line.iter_mut().zip(&by).for_each(|(product, y)| *product += count * x * y);
        }
        for (side, left) in sides.iter_mut().zip(left) {
            side.iter_mut().zip(&by).for_each(|(side, x)| *side += count * x * left);
        }
    }
    let trace: f64 = products.iter().step_by(n + 1).sum();
    products.iter_mut().step_by(n + 1).for_each(|square| *square += RIDGE * trace / n as f64);
    // Elimination; with the ridge no pivot is zero but where there is nothing to fit by.
    for k in 0..n {
        let (above, below) = products.split_at_mut((k + 1) * n);
        let pivot = &above[k * n..];
        for (i, line) in below.chunks_exact_mut(n).enumerate() {
            let factor = line[k] / pivot[k].max(f64::MIN_POSITIVE);
            line[k..].iter_mut().zip(&pivot[k..]).for_each(|(number, above)| *number -= factor * above);
            sides.iter_mut().for_each(|side| side[k + 1 + i] -= factor * side[k]);
        }
    }
    for side in &mut sides {
        for k in (0..n).rev() {
            let line = &products[k * n..(k + 1) * n];
            let known: f64 = line[k + 1..].iter().zip(&side[k + 1..]).map(|(a, b)| a * b).sum();
            side[k] = (side[k] - known) / line[k].max(f64::MIN_POSITIVE);
        }
    }
    sides
}
