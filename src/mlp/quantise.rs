//! Networks in eight bits from networks in float32, by what passes through them on samples of their inputs (post-training
//! quantisation, Jacob et al. 2018, Nagel et al. 2021).
//!
//! All samples go through the float32 network to find the range of every activation: forces have heavy tails, and what a few thousand
//! samples leave out would be cut off. Layer by layer some of the samples then go through both networks at once. An activation `x` of
//! channel `c` is `a_c (q - z_c)` and covers its range; a weight is `s_o w` over the activation it meets:
//!
//! ```text
//! sum_c W_oc x_c + b_o = s_o (sum_c w_oc q_c + B_o),   w_oc = round(W_oc a_c / s_o),   s_o = max_c |W_oc a_c| / 127
//! ```
//! `B_o` is chosen so that the sums' mean over the samples is that of the float32 network: what rounding and the layers before did
//! to it is taken back (bias correction).

use core::fmt;
use std::vec;
use std::vec::Vec;

use super::int8::Quantise;
use super::{
    Activation, Int8Description, Layer, Network, Numbers, OutputsDescription, Requantise, WeightError,
};

/// Least factor of positive sums: below, the slope of negative ones would be rounded too much.
const FACTOR: f64 = 2048.0;
/// Samples that the mean of each sum is taken over, at most; ranges are those of all.
const MEANS: usize = 8_000;

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

/// A quantised network's numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    /// For [`super::write_int8`].
    pub layers: Vec<Option<Int8Description>>,
    /// Root mean square difference of what each layer hands on from what it does in float32, over the standard deviation of
    /// that; of the samples.
    pub errors: Vec<f64>,
}

/// Samples by rows, as they leave a layer.
struct Flow {
    width: usize,
    /// In the float32 network.
    exact: Vec<f64>,
    /// In the quantised one.
    found: Vec<f64>,
    /// The same as activations, if a layer of eight bits hands them on, with the steps and zeros of the channels.
    words: Option<(Vec<u8>, Vec<Step>)>,
}

/// Of an activation: `x = size (q - zero)`.
#[derive(Clone, Copy)]
struct Step {
    size: f64,
    zero: f64,
}

/// Least and most number of a channel.
type Range = [f64; 2];

/// Quantises by samples, rows of as many numbers as the network has inputs, in their units. The layers of `float`, counted through
/// both parts, stay in float32.
pub fn quantise(network: &Network<'_>, samples: &[f32], float: &[usize]) -> Result<Quantised, QuantiseError> {
    let (first, second) = network.layers();
    if let Some(layer) = first.iter().chain(second).position(Layer::is_int8) {
        return Err(QuantiseError::Int8 { layer });
    }
    let wide = network.inputs().len().max(1);
    if samples.len() < wide {
        return Err(QuantiseError::NoSamples);
    }
    let ranges = ranges(network, samples)?;
    let every = (samples.len() / wide).div_ceil(MEANS).max(1);
    let scaled: Vec<f64> = samples
        .chunks_exact(wide)
        .step_by(every)
        .flat_map(|row| row.iter().zip(network.inputs()).map(|(x, range)| f64::from(x / range.scale)))
        .collect();
    let mut quantised = Quantised { layers: Vec::new(), errors: Vec::new() };
    let start = Flow { width: wide, exact: scaled.clone(), found: scaled.clone(), words: None };
    let predicted = part(first, start, float, &ranges, &mut quantised)?;
    if !second.is_empty() {
        // The correction sees what the quantised first part predicts.
        let rows = scaled.chunks_exact(wide).zip(predicted.found.chunks_exact(predicted.width));
        let both: Vec<f64> = rows.flat_map(|(x, p)| x.iter().chain(p).copied()).collect();
        let start = Flow { width: wide + predicted.width, exact: both.clone(), found: both, words: None };
        part(second, start, float, &ranges, &mut quantised)?;
    }
    Ok(quantised)
}

fn part(
    layers: &[Layer<'_>],
    mut flow: Flow,
    float: &[usize],
    ranges: &[Vec<Range>],
    quantised: &mut Quantised,
) -> Result<Flow, QuantiseError> {
    let start = quantised.layers.len();
    for (at, layer) in layers.iter().enumerate() {
        let number = start + at;
        let is_int8 = |at: usize| at < layers.len() && !float.contains(&(start + at));
        if flow.found.iter().any(|number| !number.is_finite()) {
            return Err(QuantiseError::NotFinite { layer: number });
        }
        let Numbers::Float { weights, biases } = layer.numbers else {
            return Err(QuantiseError::Int8 { layer: number });
        };
        let exact = dense(weights, biases, &flow.exact, flow.width);
        let activated = exact.iter().map(|&sum| act(layer.activation, sum)).collect();
        let mut next = Flow { width: layer.outputs, exact: activated, found: Vec::new(), words: None };
        let described = if is_int8(at) {
            let seen = &ranges[number];
            let to = is_int8(at + 1).then(|| ranges[number + 1].as_slice());
            Some(eight(layer, (weights, biases), &flow, &exact, (seen, to), &mut next))
        } else {
            let sums = dense(weights, biases, &flow.found, flow.width);
            next.found = sums.into_iter().map(|sum| act(layer.activation, sum)).collect();
            None
        };
        quantised.layers.push(described);
        quantised.errors.push(error(&next));
        flow = next;
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

fn column(samples: &[f64], wide: usize, channel: usize) -> impl Iterator<Item = f64> {
    samples.iter().skip(channel).step_by(wide).copied()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
    sum / count.max(1) as f64
}

/// See [`Quantised::errors`].
fn error(flow: &Flow) -> f64 {
    let squares = |channel: usize| {
        let exact = || column(&flow.exact, flow.width, channel);
        let centre = mean(exact());
        let off = exact().zip(column(&flow.found, flow.width, channel)).map(|(a, b)| (a - b).powi(2));
        (mean(off), mean(exact().map(|value| (value - centre).powi(2))))
    };
    let (off, of) = (0..flow.width).map(squares).fold((0.0, 0.0), |(off, of), (a, b)| (off + a, of + b));
    if of > 0.0 { (off / of).sqrt() } else { 0.0 }
}

/// Of what goes into each layer of the float32 network.
fn ranges(network: &Network<'_>, samples: &[f32]) -> Result<Vec<Vec<Range>>, QuantiseError> {
    let (first, second) = network.layers();
    let wide = network.inputs().len();
    let none = |layer: &Layer<'_>| vec![[f64::INFINITY, f64::NEG_INFINITY]; layer.inputs];
    let mut ranges: Vec<Vec<Range>> = first.iter().chain(second).map(none).collect();
    let columns: Vec<Vec<f32>> = first.iter().chain(second).map(by_inputs).collect();
    let (mut row, mut next) = (Vec::new(), Vec::new());
    for sample in samples.chunks_exact(wide) {
        let scaled = || sample.iter().zip(network.inputs()).map(|(x, range)| x / range.scale);
        row.clear();
        row.extend(scaled());
        for (at, layer) in first.iter().chain(second).enumerate() {
            if at == first.len() {
                row.splice(0..0, scaled());
            }
            if row.iter().any(|x| !x.is_finite()) {
                return Err(QuantiseError::NotFinite { layer: at });
            }
            for (range, &x) in ranges[at].iter_mut().zip(&row) {
                *range = [range[0].min(x.into()), range[1].max(x.into())];
            }
            let Numbers::Float { biases, .. } = layer.numbers else { continue };
            next.clear();
            next.extend_from_slice(biases);
            for (weights, &x) in columns[at].chunks_exact(layer.outputs).zip(&row) {
                for (sum, weight) in next.iter_mut().zip(weights) {
                    *sum += weight * x;
                }
            }
            for sum in &mut next {
                *sum = sum.max(layer.activation.slope() * *sum);
            }
            core::mem::swap(&mut row, &mut next);
        }
    }
    Ok(ranges)
}

/// Weights input by input: sums of many outputs side by side are quicker, and all samples pass here.
fn by_inputs(layer: &Layer<'_>) -> Vec<f32> {
    let Numbers::Float { weights, .. } = layer.numbers else { return Vec::new() };
    (0..layer.inputs).flat_map(|input| weights.iter().skip(input).step_by(layer.inputs)).copied().collect()
}

/// A channel that never varies has a step all the same.
fn size([low, high]: Range) -> f64 {
    ((high - low) / 255.0).max(1e-6 * low.abs().max(high.abs())).max(1e-12)
}

/// A whole number of 16 bits.
fn short(number: f64) -> i16 {
    number.round().clamp(-32_768.0, 32_767.0) as i16
}

/// A layer in eight bits; what its samples become goes to `next`.
fn eight(
    layer: &Layer<'_>,
    (weights, biases): (&[f32], &[f32]),
    flow: &Flow,
    exact: &[f64],
    (seen, to): (&[Range], Option<&[Range]>),
    next: &mut Flow,
) -> Int8Description {
    let (wide, high) = (layer.inputs, layer.outputs);
    let mut quantise = None;
    let (words, steps) = match &flow.words {
        Some((words, steps)) => (words.clone(), steps.clone()),
        None => {
            let (table, words, steps) = from_floats(&flow.found, seen);
            quantise = Some(table);
            (words, steps)
        }
    };
    // Weights over the activations they meet, in whole numbers.
    let (mut rounded, mut scales) = (Vec::with_capacity(weights.len()), Vec::with_capacity(high));
    for row in weights.chunks_exact(wide) {
        let met = || row.iter().zip(&steps).map(|(&weight, step)| f64::from(weight) * step.size);
        let scale = (met().fold(0.0f64, |most, weight| most.max(weight.abs())) / 127.0).max(1e-30);
        rounded.extend(met().map(|weight| (weight / scale).round() as i8));
        scales.push(scale);
    }
    let mut sums = Vec::with_capacity(exact.len());
    for row in words.chunks_exact(wide) {
        sums.extend(
            rounded.chunks_exact(wide).map(|weights| {
                weights.iter().zip(row).map(|(&w, &q)| i32::from(w) * i32::from(q)).sum::<i32>()
            }),
        );
    }
    let wholes: Vec<i32> = (0..high)
        .map(|output| {
            let scale = scales[output];
            let lacking = mean(column(exact, high, output)) / scale
                - mean(sums.iter().skip(output).step_by(high).map(|&sum| f64::from(sum)));
            // Far beyond what 32 bits hold the file is refused; a channel that never varies stays as it was.
            if lacking.abs() < 1e9 {
                lacking.round() as i32
            } else {
                (f64::from(biases[output]) / scale) as i32
            }
        })
        .collect();
    for row in sums.chunks_exact_mut(high) {
        for (sum, bias) in row.iter_mut().zip(&wholes) {
            *sum = sum.saturating_add(*bias);
        }
    }
    let (outputs, biases) = if let Some(ranges) = to {
        to_words(layer.activation, &sums, &scales, wholes, ranges, next)
    } else {
        let scales: Vec<f32> = scales.iter().map(|&scale| scale as f32).collect();
        next.found = sums
            .chunks_exact(high)
            .flat_map(|row| row.iter().zip(&scales))
            .map(|(&sum, &scale)| act(layer.activation, f64::from(sum as f32 * scale)))
            .collect();
        (OutputsDescription::Float(scales), wholes)
    };
    Int8Description { quantise, weights: rounded, biases, outputs }
}

/// Float32 inputs as activations.
fn from_floats(found: &[f64], ranges: &[Range]) -> (Vec<Quantise>, Vec<u8>, Vec<Step>) {
    let entry = |range: &Range| {
        let inverse = (1.0 / size(*range)) as f32;
        Quantise { inverse, zero: short(-range[0] * f64::from(inverse)).into() }
    };
    let table: Vec<Quantise> = ranges.iter().map(entry).collect();
    let words =
        found.chunks_exact(table.len().max(1)).flat_map(|row| row.iter().zip(&table)).map(|(&x, by)| {
            let clamped = (x as f32 * by.inverse).clamp(-by.zero, 255.0 - by.zero);
            (f64::from(clamped) + f64::from(by.zero)).round_ties_even() as u8
        });
    let words = words.collect();
    let step = |by: &Quantise| Step { size: 1.0 / f64::from(by.inverse), zero: by.zero.into() };
    let steps = table.iter().map(step).collect();
    (table, words, steps)
}

/// How sums become activations; biases are given the half that makes the shift round to nearest.
fn to_words(
    activation: Activation,
    sums: &[i32],
    scales: &[f64],
    mut biases: Vec<i32>,
    ranges: &[Range],
    next: &mut Flow,
) -> (OutputsDescription, Vec<i32>) {
    let high = scales.len();
    let slope = f64::from(activation.slope());
    let (mut table, mut steps) = (Vec::with_capacity(high), Vec::with_capacity(high));
    for (output, ((&scale, bias), range)) in scales.iter().zip(&mut biases).zip(ranges).enumerate() {
        // Steps that one unit of the sum is.
        let ratio = scale / size(*range);
        // What is kept of the sums must not be cut off where the samples are.
        let reach = sums.iter().skip(output).step_by(high).fold(0, |most, sum| sum.abs().max(most));
        let mut shift = 0;
        while shift < 30
            && (f64::from(reach >> shift) > 32_000.0 || ratio * 32_768.0 * f64::from(1 << shift) < FACTOR)
        {
            shift += 1;
        }
        let unit = 32_768.0 * f64::from(1 << shift);
        let positive = (ratio * unit).ceil().clamp(1.0, 32_767.0);
        let negative = (slope * positive).round();
        // As whole numbers have it, a little more than was asked for.
        let step = scale * unit / positive;
        let zero = short(-range[0] / step);
        if shift > 0 {
            *bias = bias.saturating_add(1 << (shift - 1));
        }
        table.push(Requantise { positive: positive as i16, negative: negative as i16, zero, shift });
        steps.push(Step { size: step, zero: zero.into() });
    }
    let half = |by: &Requantise| if by.shift > 0 { 1 << (by.shift - 1) } else { 0 };
    let words: Vec<u8> = sums
        .chunks_exact(high)
        .flat_map(|row| row.iter().zip(&table).map(|(&sum, by)| by.apply(sum.saturating_add(half(by)))))
        .collect();
    next.found = words
        .chunks_exact(high)
        .flat_map(|row| row.iter().zip(&steps).map(|(&q, step)| step.size * (f64::from(q) - step.zero)))
        .collect();
    next.words = Some((words, steps));
    (OutputsDescription::Requantised(table), biases)
}
