//! Post-training quantisation of float32 networks to int8 (Jacob et al. 2018, Nagel et al. 2021), calibrated by samples
//! of their inputs.
//!
//! The samples pass through both networks, layer by layer. Weights are rounded with a scale for each output,
//!
//! ```text
//! w_oi = round(W_oi / scale_o),   scale_o = max_i |W_oi| / 127
//! ```
//! and biases are corrected by the mean error that this makes (bias correction). The last layer of a part, if it stays
//! in float32, is fitted anew to the float32 network's predictions, by least squares. A sample whose prediction is `y`,
//! in standard deviations, has the weight `1 / (1 + y^2)`: a relative error for fast and rough motion, without which
//! roll-outs ring, an absolute one for slow motion.

use core::fmt;
use std::vec;
use std::vec::Vec;

use super::{Activation, Description, Int8Description, Layer, Network, Parameters, WeightError};

/// Most samples that are used.
const MOST_SAMPLES: usize = 16_000;
/// Activations that may stand for zero; the more, the smaller may the largest negative input be.
const ZEROS: [u8; 5] = [8, 16, 32, 64, 128];
/// Ridge of the least-squares fit, over the mean square of its inputs.
const RIDGE: f64 = 1e-6;

/// Why a network is not quantised.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum QuantiseError {
    /// A layer is in int8 already.
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
            Self::Int8 { layer } => write!(f, "layer {layer} is in int8 already"),
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
    /// Its layers in int8.
    pub layers: Vec<Option<Int8Description>>,
    /// Root mean square error of each layer's activations over their standard deviation, over the weighted samples.
    /// Exact are those of the float32 network; the last layer of the second part has to correct the error of the first
    /// as well.
    pub errors: Vec<f64>,
}

/// Activations of the samples behind a layer, by rows.
#[derive(Clone)]
struct Activations {
    width: usize,
    /// In the float32 network.
    exact: Vec<f64>,
    /// In the quantised one.
    rounded: Vec<f64>,
}

/// Quantises by samples, rows of the network's inputs in their units. The layers of `float`, counted through both
/// parts, stay in float32.
pub fn quantise<'w>(network: &Network<'w>, samples: &[f32], float: &[usize]) -> Result<Quantised<'w>, QuantiseError> {
    let (first, second) = network.layers();
    if let Some(layer) = first.iter().chain(second).position(Layer::is_int8) {
        return Err(QuantiseError::Int8 { layer });
    }
    let (wide, high) = (network.inputs().len().max(1), network.outputs().len().max(1));
    if samples.len() < wide {
        return Err(QuantiseError::NoSamples);
    }
    if samples.iter().any(|value| !value.is_finite()) {
        return Err(QuantiseError::NotFinite { layer: 0 });
    }
    let every = (samples.len() / wide).div_ceil(MOST_SAMPLES);
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
    let mut quantised = Quantised { description: Description::of(network), layers: Vec::new(), errors: Vec::new() };
    let start = Activations { width: wide, exact: scaled.clone(), rounded: scaled.clone() };
    let one = part(first, start, None, (float, &counts), &mut quantised)?;
    if !second.is_empty() {
        let both = |predicted: &[f64]| -> Vec<f64> {
            let rows = scaled.chunks_exact(wide).zip(predicted.chunks_exact(high));
            rows.flat_map(|(x, p)| x.iter().chain(p).copied()).collect()
        };
        let start = Activations { width: wide + high, exact: both(&one.exact), rounded: both(&one.rounded) };
        part(second, start, Some(&one), (float, &counts), &mut quantised)?;
    }
    Ok(quantised)
}

/// One part, which has to correct what is left of `before`, the part in front of it.
fn part<'w>(
    layers: &[Layer<'_>],
    mut flow: Activations,
    before: Option<&Activations>,
    (float, counts): (&[usize], &[f64]),
    quantised: &mut Quantised<'w>,
) -> Result<Activations, QuantiseError> {
    let start = quantised.layers.len();
    for (at, layer) in layers.iter().enumerate() {
        let number = start + at;
        if flow.rounded.iter().any(|value| !value.is_finite()) {
            return Err(QuantiseError::NotFinite { layer: number });
        }
        let Parameters::Float { weights, biases } = layer.parameters else {
            return Err(QuantiseError::Int8 { layer: number });
        };
        let mut wanted = dense(weights, biases, &flow.exact, flow.width);
        let last = at + 1 == layers.len() && layer.activation == Activation::Linear;
        if let (true, Some(before)) = (last, before) {
            for (wanted, (exact, rounded)) in wanted.iter_mut().zip(before.exact.iter().zip(&before.rounded)) {
                *wanted += exact - rounded;
            }
        }
        let int8 = (!float.contains(&number)).then(|| quantised_layer(layer, weights, &flow.rounded, counts));
        let description = &mut quantised.description;
        let described = description.first.iter_mut().chain(&mut description.second).nth(number);
        let mut rounded = match &int8 {
            Some((int8, activations)) => int8_dense(int8, biases, activations, flow.width),
            None => dense(weights, biases, &flow.rounded, flow.width),
        };
        if let Some(described) = described {
            let left: Vec<f64> = wanted.iter().zip(&rounded).map(|(wanted, rounded)| wanted - rounded).collect();
            if int8.is_some() {
                for (output, bias) in described.biases.iter_mut().enumerate() {
                    let off = mean(left.iter().skip(output).step_by(layer.outputs).copied(), counts);
                    *bias += off as f32;
                    rounded.iter_mut().skip(output).step_by(layer.outputs).for_each(|sum| *sum += off);
                }
            } else if last && quantised.layers.iter().skip(start).any(Option::is_some) {
                let changes = fitted(&flow.rounded, flow.width, &left, layer.outputs, counts);
                let rows = described.weights.chunks_mut(flow.width).zip(&mut described.biases);
                for ((weights, bias), changes) in rows.zip(&changes) {
                    for (value, change) in weights.iter_mut().chain([bias]).zip(changes) {
                        *value += *change as f32;
                    }
                }
                rounded = dense(&described.weights, &described.biases, &flow.rounded, flow.width);
            }
        }
        let activated = |sums: Vec<f64>| sums.into_iter().map(|sum| act(layer.activation, sum)).collect();
        flow = Activations { width: layer.outputs, exact: activated(wanted), rounded: activated(rounded) };
        quantised.layers.push(int8.map(|(int8, _)| int8));
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

/// The same in int8.
fn int8_dense(int8: &Int8Description, biases: &[f32], (words, steps): &Words, wide: usize) -> Vec<f64> {
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

/// Weighted by `counts`.
fn mean(values: impl Iterator<Item = f64>, counts: &[f64]) -> f64 {
    let weighted = values.zip(counts).fold((0.0, 0.0), |(sum, all), (value, count)| (sum + count * value, all + count));
    weighted.0 / weighted.1.max(f64::MIN_POSITIVE)
}

/// See [`Quantised::errors`].
fn error(flow: &Activations, counts: &[f64]) -> f64 {
    let squares = |channel: usize| {
        let column =
            |values: &'_ [f64]| -> Vec<f64> { values.iter().skip(channel).step_by(flow.width).copied().collect() };
        let (exact, rounded) = (column(&flow.exact), column(&flow.rounded));
        let centre = mean(exact.iter().copied(), counts);
        let off = exact.iter().zip(&rounded).map(|(a, b)| (a - b).powi(2));
        (mean(off, counts), mean(exact.iter().map(|value| (value - centre).powi(2)), counts))
    };
    let (off, of) = (0..flow.width).map(squares).fold((0.0, 0.0), |(off, of), (a, b)| (off + a, of + b));
    if of > 0.0 { (off / of).sqrt() } else { 0.0 }
}

/// Quantised activations by rows, and the step of each row.
type Words = (Vec<u8>, Vec<f64>);

/// A layer in int8, and the quantised activations before it.
fn quantised_layer(layer: &Layer<'_>, weights: &[f32], samples: &[f64], counts: &[f64]) -> (Int8Description, Words) {
    let rows = || samples.chunks_exact(layer.inputs);
    // The zero with the shortest steps.
    let mean_square = |&zero: &u8| mean(rows().map(|row| step(row, zero).powi(2)), counts);
    let zero = ZEROS.into_iter().min_by(|a, b| mean_square(a).total_cmp(&mean_square(b))).unwrap_or(128);
    let steps: Vec<f64> = rows().map(|row| step(row, zero)).collect();
    let words = rows()
        .zip(&steps)
        .flat_map(|(row, step)| row.iter().map(move |x| (x / step + f64::from(zero)).round_ties_even() as u8));
    let words = words.collect();
    let (mut rounded, mut scales) = (Vec::with_capacity(weights.len()), Vec::with_capacity(layer.outputs));
    for row in weights.chunks_exact(layer.inputs) {
        let scale = (row.iter().fold(0.0f32, |most, weight| most.max(weight.abs())) / 127.0).max(1e-30);
        rounded.extend(row.iter().map(|weight| (weight / scale).round() as i8));
        scales.push(scale);
    }
    (Int8Description { zero, weights: rounded, scales }, (words, steps))
}

/// The step that a row's largest activation needs.
fn step(row: &[f64], zero: u8) -> f64 {
    let (up, down) = (f64::from(u8::MAX - zero), f64::from(zero));
    row.iter().fold(1e-30, |most: f64, &x| most.max(x / up).max(-x / down))
}

/// Changes of the weights, and last of the bias, of each output that add `left` to its sums: least squares.
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
    // Gaussian elimination; the ridge keeps pivots from zero, unless all inputs are zero.
    for k in 0..n {
        let (above, below) = products.split_at_mut((k + 1) * n);
        let pivot = &above[k * n..];
        for (i, line) in below.chunks_exact_mut(n).enumerate() {
            let factor = line[k] / pivot[k].max(f64::MIN_POSITIVE);
            line[k..].iter_mut().zip(&pivot[k..]).for_each(|(value, above)| *value -= factor * above);
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
