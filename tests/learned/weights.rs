//! Weight files: what is written is read back, from memory of the host and without a copy; every damage
//! is refused with an error of its own; version 1 stays readable for good.

use std::path::Path;

use proptest::prelude::*;
use supple::mlp::{Description, Int8Description, Network, Parameters, WeightError, write, write_int8};
use supple::simd::Level;

use crate::level_guard;
use crate::networks::{Memory, described, int8, predicted, uniform};

/// Largest difference of outputs from the reference over their scales.
fn apart(description: &Description<'_>, inputs: &[f32], outputs: &[f32]) -> f64 {
    let wanted = predicted(description, inputs);
    let differences = outputs.iter().zip(wanted).zip(&description.outputs);
    differences
        .map(|((&output, wanted), range)| (f64::from(output) - wanted).abs() / f64::from(range.scale))
        .fold(0.0, f64::max)
}

/// The same of a prediction for one vertex.
fn off(description: &Description<'_>, network: &Network<'_>, inputs: &[f32]) -> f64 {
    let mut outputs = vec![0.0; description.outputs.len()];
    network.predict(inputs, &mut outputs);
    apart(description, inputs, &outputs)
}

/// Many vertices at once, at every level: each agrees with float64, its bits do not depend on its neighbours, and an
/// incomplete row is left as it is.
#[test]
fn rows_agree_with_float64_and_do_not_see_their_neighbours() {
    let _guard = level_guard();
    let levels: Vec<_> = Level::available().collect();
    let each = levels.iter().rev().map(|&level| (level, 33));
    for (level, hidden) in each.chain([(levels[0], 64), (levels[0], 1)]) {
        assert!(Level::force(level));
        let description = described(&[7, hidden, hidden, 3], &[10, 32, 3], 11);
        let memory = Memory::of(&write(&description).unwrap());
        let network = Network::parse(memory.bytes()).unwrap();
        let mut random = uniform(6);
        let inputs: Vec<f32> = (0..45 * 7 + 3).map(|at| 2.0 * description.inputs[at % 7].scale * random()).collect();
        let mut outputs = vec![-1e9; 46 * 3];
        network.predict_rows(&inputs, &mut outputs);
        let worst = (0..45)
            .map(|row| apart(&description, &inputs[7 * row..7 * row + 7], &outputs[3 * row..3 * row + 3]))
            .fold(0.0, f64::max);
        println!("{level:?}, {hidden} wide: off by {worst:.1e} of the outputs' scale");
        assert!(worst < 1e-5);
        assert!(outputs[45 * 3..].iter().all(|&output| output == -1e9));
        for (first, count) in [(0, 1), (44, 1), (3, 20), (1, 44)] {
            let mut few = vec![0.0; count * 3];
            network.predict_rows(&inputs[7 * first..7 * (first + count)], &mut few);
            assert_eq!(few, outputs[3 * first..3 * (first + count)]);
        }
    }
}

#[test]
fn the_papers_network_agrees_with_float64() {
    let description = described(&[7, 256, 256, 128, 64, 32, 3], &[10, 64, 64, 64, 3], 3);
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    assert_eq!(network.multiply_adds(), 119_456);
    let mut random = uniform(5);
    let worst = (0..200)
        .map(|_| {
            let inputs: Vec<f32> = description.inputs.iter().map(|range| 2.0 * range.scale * random()).collect();
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
        let mut random = uniform(seed ^ 9);
        let x: Vec<f32> = description.inputs.iter().map(|range| 2.0 * range.scale * random()).collect();
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
    for (layer, described) in first.iter().chain(second).zip(description.first.iter().chain(&description.second)) {
        let Parameters::Float { weights, biases } = layer.parameters else { panic!("not float32") };
        assert_eq!(weights, described.weights);
        assert_eq!(biases, described.biases);
        assert_eq!(layer.activation, described.activation);
        // In the host's memory, aligned for vectors.
        let start = memory.bytes().as_ptr_range();
        assert!(start.contains(&weights.as_ptr().cast()));
        assert_eq!(weights.as_ptr() as usize % 64, 0);
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

/// int8 are the two hidden layers of the first part and the first of the second.
fn mixed(seed: u32) -> (Description<'static>, Vec<Option<Int8Description>>) {
    let description = described(&[7, 9, 6, 5, 3], &[10, 5, 3], seed);
    let layers = int8(&description, |layer| [1, 2, 4].contains(&layer), seed ^ 1);
    (description, layers)
}

/// A file that was written when version 3 came to be.
#[test]
fn the_golden_file_of_version_3_is_what_is_written_today() {
    let (description, int8) = mixed(2026);
    let bytes = write_int8(&description, &int8).unwrap();
    let path = Path::new("tests/data/golden-v3.weights");
    if std::env::var_os("SUPPLE_WRITE_GOLDEN").is_some() {
        std::fs::write(path, &bytes).unwrap();
    }
    let golden = std::fs::read(path).unwrap();
    assert!(golden == bytes, "the format has changed: it needs a new version");
    let memory = Memory::of(&golden);
    let network = Network::parse(memory.bytes()).unwrap();
    assert!(network.has_int8());
    let mut outputs = [0.0; 3];
    network.predict(&[0.1, -0.2, 0.3, 0.4, -0.5, 0.6, 0.7], &mut outputs);
    println!("{outputs:?} {:?}", outputs.map(f32::to_bits));
    assert_eq!(outputs.map(f32::to_bits), GOLDEN_3);
}

const GOLDEN_3: [u32; 3] = [3_173_610_590, 3_209_884_224, 1_057_101_192];

#[test]
fn int8_layers_are_read_back_without_a_copy() {
    let (description, written) = mixed(1);
    let memory = Memory::of(&write_int8(&description, &written).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let (first, second) = network.layers();
    let described = description.first.iter().chain(&description.second);
    for ((layer, described), written) in first.iter().chain(second).zip(described).zip(&written) {
        assert_eq!(layer.is_int8(), written.is_some());
        let (Parameters::Int8(stored), Some(written)) = (layer.parameters, written) else {
            continue;
        };
        let groups = layer.inputs.div_ceil(4);
        for (at, &weight) in written.weights.iter().enumerate() {
            let (output, input) = (at / layer.inputs, at % layer.inputs);
            let tile = stored.weights[output / 8 * groups + input / 4];
            assert_eq!(tile[output % 8][input % 4], weight);
        }
        assert_eq!(stored.biases[..layer.outputs], described.biases);
        assert_eq!(stored.scales[..layer.outputs], written.scales);
        assert_eq!(stored.zero, written.zero);
        for (start, weights) in stored.starts.iter().zip(written.weights.chunks(layer.inputs)) {
            let sum: i32 = weights.iter().map(|&weight| i32::from(weight)).sum();
            assert_eq!(*start, -i32::from(written.zero) * sum);
        }
        assert_eq!(layer.activation, described.activation);
        assert!(memory.bytes().as_ptr_range().contains(&stored.weights.as_ptr().cast()));
        assert_eq!(stored.weights.as_ptr() as usize % 64, 0);
    }
}

#[test]
fn every_damage_is_refused() {
    let (description, int8) = mixed(1);
    damage(&Memory::of(&write(&described(&[7, 9, 3], &[10, 5, 3], 1)).unwrap()));
    damage(&Memory::of(&write_int8(&description, &int8).unwrap()));
}

fn damage(memory: &Memory) {
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
    // What follows the file does not matter: it may be part of a larger image.
    let mut longer = memory.clone();
    longer.length += 5;
    assert!(Network::parse(longer.bytes()).is_ok());
}

/// Edited, with the checksum mended: each field has an error of its own, with its place and value.
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
    refused(8, whole(2), "version 2 of the weight format; this library reads 1 and 3");
    refused(8, whole(4), "version 4 of the weight format; this library reads 1 and 3");
    refused(12, whole(100), "the length is 100");
    refused(20, whole(33), "the number of inputs is 33");
    refused(20, whole(0), "the number of inputs is 0");
    refused(24, whole(9), "the number of outputs is 9");
    refused(28, whole(17), "the number of layers is 17");
    refused(32, whole(5), "the number of layers of the first part is 5");
    refused(36, whole(40), "the law is 40");
    refused(40, real(-1.0), "a is -1");
    refused(44, real(f32::NAN), "b is NaN");
    refused(48, real(0.0), "d is 0");
    refused(56, real(f32::INFINITY), "the density is inf");
    refused(60, real(-0.5), "the damping is -0.5");
    refused(64, real(0.0), "the step is 0");
    refused(68, real(f32::NAN), "the exact step is NaN");
    refused(72, whole(5_000), "the recipe, 9 bytes from byte 5000 on, is not text in the file");
    refused(76, whole(u32::MAX), "the recipe, 4294967295 bytes from byte 1472 on, is not text in the file");
    refused(112, whole(2), "the unit of force is 2");
    refused(116, whole(3), "the element is 3");
    refused(120, whole(1), "a reserved byte is 1");
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

/// The same of int8 layers.
#[test]
fn every_wrong_field_of_int8_layers_has_its_own_error() {
    let (description, int8) = mixed(1);
    let memory = Memory::of(&write_int8(&description, &int8).unwrap());
    let word = |at: usize| u32::from_le_bytes(memory.bytes()[at..at + 4].try_into().unwrap()) as usize;
    // After 240 bytes and ten ranges: seven entries of 48 bytes, of which layers 1, 2 and 4 are int8.
    let entry = |layer: usize| 360 + 48 * layer;
    let error_of = |at: usize, value: [u8; 4]| {
        let error = Network::parse(memory.with(at, value).bytes()).unwrap_err();
        println!("{error}");
        error.to_string()
    };
    let refused = |at: usize, value: [u8; 4], text: &str| assert_eq!(error_of(at, value), text);
    let whole = |value: u32| value.to_le_bytes();
    let real = |value: f32| value.to_le_bytes();
    let (weights, biases) = (word(entry(1) + 20), word(entry(1) + 24));
    let (starts, scales) = (word(entry(1) + 32), word(entry(1) + 36));
    let start = i32::from_le_bytes(memory.bytes()[starts..starts + 4].try_into().unwrap());

    refused(entry(1) + 16, whole(2), "layer 1: the precision is 2");
    refused(entry(1) + 44, whole(9), "layer 1: the reserved field is 9");
    refused(entry(0) + 32, whole(64), "layer 0: the offset of the sums' starts is 64");
    refused(entry(0) + 36, whole(64), "layer 0: the offset of the scales is 64");
    refused(entry(0) + 40, whole(64), "layer 0: the activation for zero is 64");
    refused(entry(1) + 40, whole(0), "layer 1: the activation for zero is 0");
    refused(entry(1) + 40, whole(255), "layer 1: the activation for zero is 255");
    refused(entry(1) + 40, whole(257), "layer 1: the activation for zero is 257");
    refused(entry(1) + 32, whole(0), "layer 1: the offset of the sums' starts is 0");
    refused(entry(1) + 36, whole(7), "layer 1: the offset of the scales is 7");
    refused(entry(1) + 20, whole(68), "layer 1: the offset of the weights is 68");
    refused(entry(1) + 24, whole(68), "layer 1: the offset of the biases is 68");
    // A float32 layer has no int8 tables.
    assert!(error_of(entry(1) + 16, whole(0)).starts_with("layer 1: "));

    refused(weights, [0x80, 0, 0, 0], &format!("layer 1: a weight, at byte {weights}, is -128"));
    // The last group of nine inputs has one, the only tile six of eight outputs.
    let padding = |at: usize| format!("layer 1: byte {at} belongs to no input or output and is not zero");
    refused(weights + 64, [0, 5, 0, 0], &padding(weights + 65));
    refused(weights + 24, [5, 0, 0, 0], &padding(weights + 24));
    refused(biases + 24, real(1.0), &padding(biases + 24));
    refused(scales + 24, real(1.0), &padding(scales + 24));
    let text = format!("layer 1: the start of a sum, at byte {starts}, is {}", start + 1);
    refused(starts, (start + 1).to_le_bytes(), &text);
    let text = format!("layer 1: the start of a sum, at byte {}, is 1", starts + 24);
    refused(starts + 24, whole(1), &text);
    refused(scales, real(0.0), &format!("layer 1: an output's scale, at byte {scales}, is 0"));
    refused(scales, real(-1.0), &format!("layer 1: an output's scale, at byte {scales}, is -1"));
    refused(scales, real(f32::NAN), &format!("layer 1: the number at byte {scales} is not finite"));
    refused(biases, real(f32::INFINITY), &format!("layer 1: the number at byte {biases} is not finite"));
}
