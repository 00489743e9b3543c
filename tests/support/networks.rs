//! Networks for tests: random ones, the same in float64, and memory that holds their files as a host would.

#![allow(dead_code, unreachable_pub)]

use std::cell::Cell;

use supple::material::{Element, Exponential};
use supple::mlp::{Activation, Description, ForceInput, Int8Description, LayerDescription, Range};

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([u8; 64]);

/// Bytes at a multiple of 64, as a mapped file would be.
#[derive(Clone)]
pub struct Memory {
    lines: Vec<Line>,
    pub length: usize,
}

impl Memory {
    pub fn of(bytes: &[u8]) -> Self {
        let mut lines = vec![Line([0; 64]); bytes.len().div_ceil(64) + 1];
        bytemuck::cast_slice_mut::<_, u8>(&mut lines)[..bytes.len()].copy_from_slice(bytes);
        Self { lines, length: bytes.len() }
    }

    pub fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.lines)[..self.length]
    }

    pub fn bytes_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.length]
    }

    /// Sets four bytes and mends the checksum, as somebody who edits a file would.
    pub fn with(&self, at: usize, value: [u8; 4]) -> Self {
        let mut edited = self.clone();
        edited.bytes_mut()[at..at + 4].copy_from_slice(&value);
        let checksum = crc32fast::hash(&edited.bytes()[20..]);
        edited.bytes_mut()[16..20].copy_from_slice(&checksum.to_le_bytes());
        edited
    }
}

/// Values from -1 to 1 from a fixed sequence.
pub fn uniform(seed: u32) -> impl FnMut() -> f32 {
    let state = Cell::new(seed);
    move || {
        state.set(state.get().wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
        (state.get() >> 8) as f32 / 8_388_608.0 - 1.0
    }
}

fn layer(inputs: usize, outputs: usize, activation: Activation, random: &mut impl FnMut() -> f32) -> LayerDescription {
    let scale = (3.0 / inputs as f32).sqrt();
    LayerDescription {
        inputs,
        activation,
        weights: (0..inputs * outputs).map(|_| scale * random()).collect(),
        biases: (0..outputs).map(|_| 0.1 * random()).collect(),
    }
}

fn part(widths: &[usize], random: &mut impl FnMut() -> f32) -> Vec<LayerDescription> {
    let last = widths.len() - 2;
    (0..=last)
        .map(|at| {
            let activation = if at == last { Activation::Linear } else { Activation::LeakyRelu { slope: 0.01 } };
            layer(widths[at], widths[at + 1], activation, random)
        })
        .collect()
}

/// A random network of these widths, its recipe that of the paper's tissue at ten times its step.
pub fn described(first: &[usize], second: &[usize], seed: u32) -> Description<'static> {
    let mut random = uniform(seed);
    let range = |scale: f32| Range { scale, least: -3.0 * scale, most: 4.0 * scale };
    Description {
        inputs: (0..first[0]).map(|at| range(0.5 + at as f32)).collect(),
        outputs: (0..*first.last().unwrap()).map(|at| range(2.0 + at as f32)).collect(),
        first: part(first, &mut random),
        second: if second.is_empty() { Vec::new() } else { part(second, &mut random) },
        law: Exponential { a: 59.0, b: 8.023, d: 60_000.0 }.into(),
        density: 1000.0,
        element: Element::Linear,
        damping: 20.0,
        step: 3e-4,
        exact_step: 3e-5,
        force: ForceInput::Newton,
        recipe: "seed = 1\n",
        recipe_hash: [7; 32],
    }
}

/// The same network in float64, as textbooks have it.
pub fn predicted(network: &Description<'_>, inputs: &[f32]) -> Vec<f64> {
    let dense = |layer: &LayerDescription, x: &[f64]| -> Vec<f64> {
        let rows = layer.weights.chunks(layer.inputs).zip(&layer.biases);
        rows.map(|(row, &bias)| {
            let sum = f64::from(bias) + row.iter().zip(x).map(|(&w, x)| f64::from(w) * x).sum::<f64>();
            match layer.activation {
                Activation::LeakyRelu { slope } if sum < 0.0 => f64::from(slope) * sum,
                _ => sum,
            }
        })
        .collect()
    };
    let x: Vec<f64> =
        inputs.iter().zip(&network.inputs).map(|(&x, range)| f64::from(x) / f64::from(range.scale)).collect();
    let p = network.first.iter().fold(x.clone(), |x, layer| dense(layer, &x));
    let both: Vec<f64> = x.iter().chain(&p).copied().collect();
    let correction = network.second.iter().fold(both, |x, layer| dense(layer, &x));
    let zero = vec![0.0; p.len()];
    let correction = if network.second.is_empty() { zero } else { correction };
    p.iter()
        .zip(correction)
        .zip(&network.outputs)
        .map(|((p, correction), range)| {
            let value = (p + correction) * f64::from(range.scale);
            value.clamp(f64::from(range.least), f64::from(range.most))
        })
        .collect()
}

/// A network whose one output is always `value`.
pub fn constant(inputs: usize, value: f32) -> Memory {
    let range = Range { scale: 1.0, least: -100.0, most: 100.0 };
    let output =
        LayerDescription { inputs, activation: Activation::Linear, weights: vec![0.0; inputs], biases: vec![value] };
    let network = Description {
        inputs: vec![range; inputs],
        outputs: vec![range],
        first: vec![output],
        second: Vec::new(),
        ..described(&[1, 1], &[], 1)
    };
    Memory::of(&supple::mlp::write(&network).unwrap())
}

/// Random int8 weights for the layers that `wanted` names, with any zero.
pub fn int8(description: &Description<'_>, wanted: impl Fn(usize) -> bool, seed: u32) -> Vec<Option<Int8Description>> {
    let mut random = uniform(seed);
    let layers = description.first.iter().chain(&description.second).enumerate();
    let described = |(at, layer): (usize, &LayerDescription)| {
        let spread = 127.0 * (layer.inputs as f32).sqrt();
        let described = Int8Description {
            zero: (128.0 + 126.0 * random()) as u8,
            weights: (0..layer.weights.len()).map(|_| (127.0 * random()).round() as i8).collect(),
            scales: (0..layer.biases.len()).map(|_| (1.5 + random()) / spread).collect(),
        };
        wanted(at).then_some(described)
    };
    layers.map(described).collect()
}
