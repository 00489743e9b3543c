//! Weight files: what is written is read back, from memory that the host owns and without a copy; every damage
//! is refused with an error of its own; version 1 stays readable for good.

use std::cell::Cell;
use std::path::Path;

use proptest::prelude::*;
use supple::mlp::{
    Activation, Description, LayerDescription, Network, Range, TrainedLaw, WeightError, write,
};

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([u8; 64]);

/// Bytes at a multiple of 64, as a mapped file would be.
#[derive(Clone)]
struct Memory {
    lines: Vec<Line>,
    length: usize,
}

impl Memory {
    fn of(bytes: &[u8]) -> Self {
        let mut lines = vec![Line([0; 64]); bytes.len().div_ceil(64) + 1];
        bytemuck::cast_slice_mut::<_, u8>(&mut lines)[..bytes.len()].copy_from_slice(bytes);
        Self { lines, length: bytes.len() }
    }

    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.lines)[..self.length]
    }

    fn bytes_mut(&mut self) -> &mut [u8] {
        &mut bytemuck::cast_slice_mut(&mut self.lines)[..self.length]
    }

    /// Sets four bytes and mends the checksum, as somebody would who edits a file.
    fn with(&self, at: usize, value: [u8; 4]) -> Self {
        let mut edited = self.clone();
        edited.bytes_mut()[at..at + 4].copy_from_slice(&value);
        let checksum = crc32fast::hash(&edited.bytes()[20..]);
        edited.bytes_mut()[16..20].copy_from_slice(&checksum.to_le_bytes());
        edited
    }
}

/// Numbers from -1 to 1 from a fixed sequence.
fn numbers(seed: u32) -> impl FnMut() -> f32 {
    let state = Cell::new(seed);
    move || {
        state.set(state.get().wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
        (state.get() >> 8) as f32 / 8_388_608.0 - 1.0
    }
}

fn layer(inputs: usize, outputs: usize, activation: Activation, next: &mut impl FnMut() -> f32) -> LayerDescription {
    let scale = (3.0 / inputs as f32).sqrt();
    LayerDescription {
        inputs,
        activation,
        weights: (0..inputs * outputs).map(|_| scale * next()).collect(),
        biases: (0..outputs).map(|_| 0.1 * next()).collect(),
    }
}

fn part(widths: &[usize], next: &mut impl FnMut() -> f32) -> Vec<LayerDescription> {
    let last = widths.len() - 2;
    (0..=last)
        .map(|at| {
            let activation =
                if at == last { Activation::Linear } else { Activation::LeakyRelu { slope: 0.01 } };
            layer(widths[at], widths[at + 1], activation, next)
        })
        .collect()
}

fn described(first: &[usize], second: &[usize], seed: u32) -> Description<'static> {
    let mut next = numbers(seed);
    let range = |scale: f32| Range { scale, least: -3.0 * scale, most: 4.0 * scale };
    Description {
        inputs: (0..first[0]).map(|at| range(0.5 + at as f32)).collect(),
        outputs: (0..*first.last().unwrap()).map(|at| range(2.0 + at as f32)).collect(),
        first: part(first, &mut next),
        second: if second.is_empty() { Vec::new() } else { part(second, &mut next) },
        law: TrainedLaw::Exponential { a: 59.0, b: 8.023, d: 60_000.0, literal: false },
        density: 1000.0,
        damping: 20.0,
        step: 3e-4,
        exact_step: 3e-5,
        recipe: "seed = 1\n",
        recipe_hash: [7; 32],
    }
}

/// The same network in float64, as one would write it down.
fn reference(network: &Description<'_>, inputs: &[f32]) -> Vec<f64> {
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

/// Largest difference from the reference over the outputs' scales.
fn off(description: &Description<'_>, network: &Network<'_>, inputs: &[f32]) -> f64 {
    let mut outputs = vec![0.0; description.outputs.len()];
    network.predict(inputs, &mut outputs);
    let wanted = reference(description, inputs);
    let differences = outputs.iter().zip(wanted).zip(&description.outputs);
    differences
        .map(|((&found, wanted), range)| (f64::from(found) - wanted).abs() / f64::from(range.scale))
        .fold(0.0, f64::max)
}

#[test]
fn the_papers_network_agrees_with_float64() {
    let description = described(&[7, 256, 256, 128, 64, 32, 3], &[10, 64, 64, 64, 3], 3);
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    assert_eq!(network.multiply_adds(), 119_456);
    let mut next = numbers(5);
    let worst = (0..200)
        .map(|_| {
            let inputs: Vec<f32> = description.inputs.iter().map(|range| 2.0 * range.scale * next()).collect();
            off(&description, &network, &inputs)
        })
        .fold(0.0, f64::max);
    println!("{} bytes; off by {worst:.1e} of the outputs' scale", memory.length);
    assert!(worst < 1e-5);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_stack_of_layers_agrees_with_float64(
        inputs in 1usize..20,
        outputs in 1usize..8,
        hidden in prop::collection::vec(1usize..60, 0..4),
        corrected in any::<bool>(),
        correction in prop::collection::vec(1usize..40, 0..3),
        seed in any::<u32>(),
    ) {
        let first: Vec<_> = [inputs].into_iter().chain(hidden).chain([outputs]).collect();
        let second: Vec<_> = [inputs + outputs].into_iter().chain(correction).chain([outputs]).collect();
        let description = described(&first, if corrected { &second } else { &[] }, seed);
        let memory = Memory::of(&write(&description).unwrap());
        let network = Network::parse(memory.bytes()).unwrap();
        let mut next = numbers(seed ^ 9);
        let x: Vec<f32> = description.inputs.iter().map(|range| 2.0 * range.scale * next()).collect();
        prop_assert!(off(&description, &network, &x) < 1e-5);
    }
}

#[test]
fn what_is_written_is_read_back_without_a_copy() {
    let description = described(&[7, 20, 3], &[10, 12, 3], 1);
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    assert_eq!(network.inputs(), description.inputs);
    assert_eq!(network.outputs(), description.outputs);
    let (first, second) = network.layers();
    assert_eq!((first.len(), second.len()), (2, 2));
    for (layer, described) in
        first.iter().chain(second).zip(description.first.iter().chain(&description.second))
    {
        assert_eq!(layer.weights, described.weights);
        assert_eq!(layer.biases, described.biases);
        assert_eq!(layer.activation, described.activation);
        // In the host's memory, where vectors like it.
        let start = memory.bytes().as_ptr_range();
        assert!(start.contains(&layer.weights.as_ptr().cast()));
        assert_eq!(layer.weights.as_ptr() as usize % 64, 0);
    }
    let recipe = network.recipe();
    assert_eq!((recipe.text, recipe.hash), (description.recipe, description.recipe_hash));
    assert_eq!((recipe.law, recipe.step, recipe.exact_step), (description.law, 3e-4, 3e-5));
    assert_eq!((recipe.density, recipe.damping), (1000.0, 20.0));
}

/// A file that was written when version 1 came to be.
#[test]
fn the_golden_file_is_what_is_written_today() {
    let description = described(&[7, 9, 3], &[10, 5, 3], 2018);
    let bytes = write(&description).unwrap();
    let path = Path::new("tests/data/golden-v1.weights");
    if std::env::var_os("SUPPLE_WRITE_GOLDEN").is_some() {
        std::fs::write(path, &bytes).unwrap();
    }
    let golden = std::fs::read(path).unwrap();
    assert!(golden == bytes, "the format has changed: it needs a new version");
    let memory = Memory::of(&golden);
    let mut outputs = [0.0; 3];
    Network::parse(memory.bytes()).unwrap().predict(&[0.1, -0.2, 0.3, 0.4, -0.5, 0.6, 0.7], &mut outputs);
    println!("{outputs:?}");
    assert_eq!(outputs.map(f32::to_bits), GOLDEN);
}

const GOLDEN: [u32; 3] = [1_049_510_499, 1_030_333_892, 3_196_632_681];

#[test]
fn every_damage_is_refused() {
    let memory = Memory::of(&write(&described(&[7, 9, 3], &[10, 5, 3], 1)).unwrap());
    for at in 0..memory.length {
        for bit in [0x01, 0x80] {
            let mut damaged = memory.clone();
            damaged.bytes_mut()[at] ^= bit;
            assert!(Network::parse(damaged.bytes()).is_err(), "byte {at}");
        }
    }
    for length in 0..memory.length {
        let error = Network::parse(&memory.bytes()[..length]).unwrap_err();
        assert!(matches!(error, WeightError::Short { bytes, .. } if bytes == length), "{length}: {error}");
    }
    // What follows the file does not matter: it may stand in a larger image.
    let mut longer = memory.clone();
    longer.length += 5;
    assert!(Network::parse(longer.bytes()).is_ok());
}

/// Edited by somebody who mends the checksum: each field has an error of its own, with its place and value.
#[test]
fn every_wrong_field_has_its_own_error() {
    let memory = Memory::of(&write(&described(&[7, 9, 3], &[10, 5, 3], 1)).unwrap());
    let refused = |at: usize, value: [u8; 4], text: &str| {
        let error = Network::parse(memory.with(at, value).bytes()).unwrap_err();
        println!("{error}");
        assert_eq!(error.to_string(), text);
    };
    let whole = |value: u32| value.to_le_bytes();
    let real = |value: f32| value.to_le_bytes();
    let mut unaligned = Memory::of(&[0; 4096]);
    unaligned.bytes_mut()[1..=memory.length].copy_from_slice(memory.bytes());
    assert_eq!(Network::parse(&unaligned.bytes()[1..]).unwrap_err(), WeightError::Misaligned);
    let mut damaged = memory.clone();
    damaged.bytes_mut()[600] ^= 4;
    let error = Network::parse(damaged.bytes()).unwrap_err();
    assert!(matches!(error, WeightError::Checksum { .. }));
    assert!(error.to_string().ends_with("it is damaged"), "{error}");

    refused(4, *b"E-X ", "it does not begin with SUPPLE-W: not a weight file");
    refused(8, whole(2), "version 2 of the weight format; this library reads 1");
    refused(12, whole(100), "the length is 100");
    refused(20, whole(33), "the number of inputs is 33");
    refused(20, whole(0), "the number of inputs is 0");
    refused(24, whole(9), "the number of outputs is 9");
    refused(28, whole(17), "the number of layers is 17");
    refused(32, whole(5), "the number of layers of the first part is 5");
    refused(36, whole(4), "the law is 4");
    refused(40, real(-1.0), "a is -1");
    refused(44, real(f32::NAN), "b is NaN");
    refused(48, real(0.0), "d is 0");
    refused(56, real(f32::INFINITY), "the density is inf");
    refused(60, real(-0.5), "the damping is -0.5");
    refused(64, real(0.0), "the step is 0");
    refused(68, real(f32::NAN), "the exact step is NaN");
    refused(72, whole(5_000), "the recipe, 9 bytes from byte 5000 on, is not text in the file");
    refused(76, whole(u32::MAX), "the recipe, 4294967295 bytes from byte 1472 on, is not text in the file");
    refused(112, whole(1), "a reserved byte is 1");
    refused(240, real(0.0), "input 0: scale 0, range -1.5 to 2");
    refused(264 + 4, real(f32::NAN), "input 2: scale 2.5, range NaN to 10");
    refused(324 + 8, real(-7.0), "output 0: scale 2, range -6 to -7");
    refused(360, whole(8), "layer 0: the number of inputs is 8");
    refused(364, whole(257), "layer 0: the number of outputs is 257");
    refused(364, whole(10), "layer 1: the number of inputs is 9");
    refused(392 + 4, whole(4), "layer 1: the number of outputs is 4");
    refused(424, whole(7), "layer 2: the number of inputs is 7");
    refused(368, whole(2), "layer 0: the activation is 2");
    refused(372, real(1.5), "layer 0: slope is 1.5, it must be from 0 to 1");
    refused(376, whole(1), "layer 0: the precision is 1");
    refused(380, whole(516), "layer 0: the offset of the weights is 516");
    refused(380, whole(1_472), "1481 bytes, a weight file needs 1724");
    refused(384, whole(64), "layer 0: the offset of the biases is 64");
    refused(388, whole(3), "layer 0: the reserved field is 3");
    refused(512 + 8, real(f32::NAN), "layer 0: the number at byte 520 is not finite");
}
