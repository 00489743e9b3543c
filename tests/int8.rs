//! Layers of eight bits: every instruction set gives the bits of what is written down here in plain loops, and the rule
//! that makes an activation of a sum is the exact one. What a file's numbers stand for, in float64, is as near as
//! rounding allows.

use std::sync::Mutex;

use proptest::prelude::*;
use supple::lanes::Level;
use supple::mlp::{
    Activation, Description, Int8Description, Layer, LayerDescription, Network, Numbers, Outputs,
    OutputsDescription, Requantise, write_int8,
};

#[path = "support/networks.rs"]
mod networks;

use networks::{Memory, described, int8, numbers};

/// The level is the whole process's.
static LEVEL: Mutex<()> = Mutex::new(());

/// All that this processor has.
fn levels() -> Vec<Level> {
    Level::available().collect()
}

/// What a layer hands on.
enum Handed {
    Floats(Vec<f32>),
    Bytes(Vec<u8>),
}

/// A layer in float32, each operation rounded by itself.
fn float(layer: &LayerDescription, x: &[f32]) -> Vec<f32> {
    let rows = layer.weights.chunks(layer.inputs).zip(&layer.biases);
    rows.map(|(row, &bias)| row.iter().zip(x).fold(bias, |sum, (&w, &x)| w * x + sum))
        .map(|sum| activated(layer.activation, sum))
        .collect()
}

fn activated(activation: Activation, value: f32) -> f32 {
    match activation {
        Activation::LeakyRelu { slope } if value < 0.0 => slope * value,
        _ => value,
    }
}

/// The sums of a layer, and what becomes of them.
fn eight(layer: &LayerDescription, int8: &Int8Description, from: Handed) -> Handed {
    let bytes = match (from, &int8.quantise) {
        (Handed::Floats(x), Some(by)) => {
            let quantised = x.iter().zip(by).map(|(x, by)| {
                let clamped = (x * by.inverse).clamp(-by.zero, 255.0 - by.zero);
                (f64::from(clamped) + f64::from(by.zero)).round_ties_even() as u8
            });
            quantised.collect()
        }
        (Handed::Bytes(bytes), None) => bytes,
        _ => panic!("layers do not fit"),
    };
    let rows = int8.weights.chunks(layer.inputs).zip(&int8.biases);
    let sums: Vec<i64> = rows
        .map(|(row, &bias)| {
            let products = row.iter().zip(&bytes).map(|(&w, &q)| i64::from(w) * i64::from(q));
            i64::from(bias) + products.sum::<i64>()
        })
        .collect();
    match &int8.outputs {
        OutputsDescription::Requantised(by) => {
            Handed::Bytes(sums.iter().zip(by).map(|(&sum, by)| exactly(*by, sum)).collect())
        }
        OutputsDescription::Float(scales) => {
            let floats = sums.iter().zip(scales).map(|(&sum, scale)| sum as f32 * scale);
            Handed::Floats(floats.map(|value| activated(layer.activation, value)).collect())
        }
    }
}

/// The rule of `weights/FORMAT.md`, in numbers that nothing can overflow.
fn exactly(by: Requantise, sum: i64) -> u8 {
    let shifted = i128::from(sum).div_euclid(1 << by.shift);
    let kept = shifted.clamp(-32_768, 32_767);
    let times = |factor: i16| (2 * kept * i128::from(factor) + 32_768).div_euclid(65_536);
    let q = i128::from(by.zero) + if kept > 0 { times(by.positive) } else { times(by.negative) };
    q.clamp(0, 255) as u8
}

fn part(layers: &[LayerDescription], int8: &[Option<Int8Description>], x: Vec<f32>) -> Vec<f32> {
    let handed =
        layers.iter().zip(int8).fold(Handed::Floats(x), |handed, (layer, int8)| match (int8, handed) {
            (Some(int8), handed) => eight(layer, int8, handed),
            (None, Handed::Floats(x)) => Handed::Floats(float(layer, &x)),
            (None, Handed::Bytes(_)) => panic!("layers do not fit"),
        });
    match handed {
        Handed::Floats(floats) => floats,
        Handed::Bytes(_) => panic!("the last layer hands on floats"),
    }
}

/// The whole network.
fn predicted(network: &Description<'_>, int8: &[Option<Int8Description>], inputs: &[f32]) -> Vec<f32> {
    let (one, two) = int8.split_at(network.first.len());
    let x: Vec<f32> = inputs.iter().zip(&network.inputs).map(|(x, range)| x / range.scale).collect();
    let mut p = part(&network.first, one, x.clone());
    if !network.second.is_empty() {
        let both = x.iter().chain(&p).copied().collect();
        for (p, correction) in p.iter_mut().zip(part(&network.second, two, both)) {
            *p += correction;
        }
    }
    let outputs = p.iter().zip(&network.outputs);
    outputs.map(|(p, range)| (p * range.scale).clamp(range.least, range.most)).collect()
}

fn bits(numbers: &[f32]) -> Vec<u32> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

/// Every level against the plain loops, for many vertices and for one.
fn compare(description: &Description<'_>, int8: &[Option<Int8Description>], rows: usize, seed: u32) {
    let memory = Memory::of(&write_int8(description, int8).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let (wide, high) = (description.inputs.len(), description.outputs.len());
    let mut next = numbers(seed);
    let inputs: Vec<f32> =
        (0..rows * wide).map(|at| 3.0 * description.inputs[at % wide].scale * next()).collect();
    let wanted: Vec<f32> =
        inputs.chunks(wide).flat_map(|inputs| predicted(description, int8, inputs)).collect();
    let _alone = LEVEL.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let before = Level::current();
    for level in levels() {
        assert!(Level::force(level));
        let mut found = vec![0.0; rows * high];
        network.predict_rows(&inputs, &mut found);
        assert_eq!(bits(&found), bits(&wanted), "{level:?}");
    }
    assert!(Level::force(before));
    let mut found = vec![0.0; high];
    network.predict(&inputs[..wide], &mut found);
    assert_eq!(bits(&found), bits(&wanted[..high]), "one vertex");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_level_gives_the_bits_of_plain_loops(
        inputs in 1usize..20,
        outputs in 1usize..8,
        hidden in prop::collection::vec(1usize..80, 0..5),
        corrected in any::<bool>(),
        correction in prop::collection::vec(1usize..40, 0..3),
        which in any::<u16>(),
        rows in 1usize..70,
        seed in any::<u32>(),
    ) {
        let first: Vec<_> = [inputs].into_iter().chain(hidden).chain([outputs]).collect();
        let second: Vec<_> = [inputs + outputs].into_iter().chain(correction).chain([outputs]).collect();
        let description = described(&first, if corrected { &second } else { &[] }, seed);
        let layers = description.first.len() + description.second.len();
        // One of them at least.
        let which = usize::from(which) | 1 << (seed as usize % layers);
        let int8 = int8(&description, |layer| which >> layer & 1 == 1, seed ^ 3);
        compare(&description, &int8, rows, seed ^ 9);
    }

    #[test]
    fn requantisation_is_the_written_rule(
        positive in 0..=i16::MAX,
        share in 0.0..=1.0f64,
        zero in any::<i16>(),
        shift in 0i16..=30,
        sum in any::<i32>(),
        bits in 0u32..32,
    ) {
        let negative = (share * f64::from(positive)) as i16;
        let by = Requantise { positive, negative, zero, shift };
        // Of every size.
        for sum in [sum, sum >> bits, i32::MAX, i32::MIN, 0] {
            prop_assert_eq!(by.apply(sum), exactly(by, sum.into()));
        }
    }
}

/// As wide as layers may be, with the largest sums: 256 inputs of 255 times 127.
#[test]
fn the_largest_sums_are_exact() {
    for sign in [1, -1] {
        let description = described(&[7, 256, 256, 256, 3], &[10, 256, 3], 4);
        let mut int8 = int8(&description, |layer| layer != 0, 5);
        for layer in int8.iter_mut().flatten() {
            layer.weights.fill(sign * 127);
            layer.biases.fill(0);
            if let OutputsDescription::Requantised(table) = &mut layer.outputs {
                // Everything comes out as 255 again, or as zero.
                table.fill(Requantise { positive: 32_767, negative: 32_767, zero: 0, shift: 4 });
            }
        }
        compare(&description, &int8, 40, 6);
    }
}

/// Inputs that are no numbers, or none that a layer can hold.
#[test]
fn odd_inputs_give_the_same_bits_everywhere() {
    let description = described(&[7, 20, 20, 3], &[], 4);
    let int8 = int8(&description, |layer| layer != 0, 5);
    let memory = Memory::of(&write_int8(&description, &int8).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -0.0, 1e-45, 3e38];
    let mut next = numbers(3);
    let inputs: Vec<f32> = (0..7 * 60).map(|at| if next() > 0.6 { odd[at % 7] } else { next() }).collect();
    let _alone = LEVEL.lock().unwrap();
    let mut results = Vec::new();
    for level in levels() {
        assert!(Level::force(level));
        let mut found = vec![0.0; 3 * 60];
        network.predict_rows(&inputs, &mut found);
        assert!(found.iter().all(|number| number.is_finite()));
        results.push(bits(&found));
    }
    assert!(results.windows(2).all(|pair| pair[0] == pair[1]));
}

/// What a number would be if nothing were rounded to whole ones, and how far what is computed may be from it.
#[derive(Clone, Copy)]
struct Meant {
    value: f64,
    within: f64,
}

/// Half of what stands between two float32 numbers, of their size.
const UNIT: f64 = 1.0 / 16_777_216.0;

impl Meant {
    /// After so many operations in float32 whose results are up to `size`, and one more for what `within` adds to it.
    fn rounded(self, operations: usize, size: f64) -> Self {
        let units = (operations + 1) as f64 * UNIT;
        Self { within: self.within + units * (size + self.within) + f64::from(f32::MIN_POSITIVE), ..self }
    }
    /// The rule of a function that never changes by more than `factor` times what its argument does.
    fn through(self, factor: f64, f: impl Fn(f64) -> f64) -> Self {
        Self { value: f(self.value), within: factor * self.within }
    }
    fn float(self, activation: Activation) -> Self {
        let slope = f64::from(match activation {
            Activation::LeakyRelu { slope } => slope,
            Activation::Linear => 1.0,
        });
        let activated = self.through(1.0, |value| value.max(slope * value));
        activated.rounded(1, activated.value.abs())
    }
    /// Rounded to a whole number and within 0 to 255, where two numbers are not further apart.
    fn byte(self) -> Self {
        let byte = self.through(1.0, |value| value.clamp(0.0, 255.0));
        Self { within: (byte.within + 0.5).min(255.0), ..byte }
    }
}

/// Of weights that are taken as they are: `bias + sum w x`, and how large its parts may be.
fn sum(bias: f64, row: impl Iterator<Item = f64>, x: &[Meant]) -> (Meant, f64) {
    let start = (Meant { value: bias, within: 0.0 }, bias.abs());
    row.zip(x).fold(start, |(sum, size), (w, x)| {
        let sum = Meant { value: sum.value + w * x.value, within: sum.within + w.abs() * x.within };
        (sum, size + w.abs() * (x.value.abs() + x.within))
    })
}

/// A layer as the file has it.
fn meant(layer: &Layer<'_>, x: &[Meant]) -> Vec<Meant> {
    let int8 = match layer.numbers {
        Numbers::Float { weights, biases } => {
            let rows = weights.chunks(layer.inputs).zip(biases);
            let sums = rows.map(|(row, &bias)| sum(bias.into(), row.iter().map(|&w| w.into()), x));
            let rounded = sums.map(|(sum, size)| sum.rounded(2 * layer.inputs, size));
            return rounded.map(|sum| sum.float(layer.activation)).collect();
        }
        Numbers::Int8(int8) => int8,
    };
    let quantised = int8.quantise.map(|table| {
        let bytes = x.iter().zip(table).map(|(x, by)| {
            let (inverse, zero) = (f64::from(by.inverse), f64::from(by.zero));
            // Clamped between the two operations, beyond which rounding does not grow.
            let product = x.through(inverse, |x| (x * inverse).clamp(-zero, 255.0 - zero));
            product.rounded(1, 255.0 + zero.abs()).through(1.0, |product| product + zero).byte()
        });
        bytes.collect::<Vec<_>>()
    });
    let bytes = quantised.as_deref().unwrap_or(x);
    let groups = layer.inputs.div_ceil(4);
    let sums = (0..layer.outputs).map(|output| {
        let tiles = int8.weights.iter().skip(output / 8 * groups).take(groups);
        let row = tiles.flat_map(|tile| tile[output % 8]).map(f64::from);
        // In whole numbers, so nothing is rounded.
        sum(int8.biases[output].into(), row, bytes).0
    });
    match int8.outputs {
        Outputs::Requantised(table) => {
            let bytes = sums.zip(table).map(|(sum, by)| {
                // A half of the smallest bit that is kept stands in the bias; dropping the others takes one away on average.
                let (bit, half) = (f64::from(1 << by.shift), if by.shift > 0 { 0.5 } else { 0.0 });
                let mut kept = sum.through(1.0 / bit, |sum| (sum / bit - half).clamp(-32_768.0, 32_767.0));
                kept.within += half;
                let [positive, negative] = [by.positive, by.negative].map(|by| f64::from(by) / 32_768.0);
                let result = kept.through(positive, |kept| {
                    f64::max(positive * kept, negative * kept) + f64::from(by.zero)
                });
                result.byte()
            });
            bytes.collect()
        }
        Outputs::Float(scales) => {
            let floats = sums.zip(scales).map(|(sum, &scale)| {
                let scaled = sum.through(scale.into(), |sum| sum * f64::from(scale));
                scaled.rounded(2, scaled.value.abs()).float(layer.activation)
            });
            floats.collect()
        }
    }
}

/// The whole network's.
fn predicted_as_meant(network: &Network<'_>, inputs: &[f32]) -> Vec<Meant> {
    let x = inputs.iter().zip(network.inputs()).map(|(&x, range)| {
        let value = f64::from(x) / f64::from(range.scale);
        Meant { value, within: 0.0 }.rounded(1, value.abs())
    });
    let x: Vec<_> = x.collect();
    let (first, second) = network.layers();
    let p = first.iter().fold(x.clone(), |x, layer| meant(layer, &x));
    let both: Vec<_> = x.iter().chain(&p).copied().collect();
    let corrections = second.iter().fold(both, |x, layer| meant(layer, &x));
    let outputs = p.iter().zip(network.outputs()).enumerate().map(|(at, (p, range))| {
        let mut sum = *p;
        if !second.is_empty() {
            sum = Meant { value: p.value + corrections[at].value, within: p.within + corrections[at].within };
        }
        let (scale, least, most) = (f64::from(range.scale), f64::from(range.least), f64::from(range.most));
        let product = sum.rounded(1, sum.value.abs()).through(scale, |sum| sum * scale);
        product.rounded(1, product.value.abs()).through(1.0, |product| product.clamp(least, most))
    });
    outputs.collect()
}

/// Rounding of activations is all that parts a network of eight bits from its numbers' own meaning: half a step of each,
/// and what the layers after it make of that at most.
#[test]
fn networks_are_what_their_numbers_mean_within_rounding() {
    // Layers of eight bits, and how near the bound must come to say something, of the outputs' spread.
    let networks: [(&[usize], &[usize], u32, f64); 5] = [
        (&[7, 40, 3], &[], 0b01, 0.02),
        (&[7, 40, 3], &[], 0b10, 0.01),
        (&[7, 24, 3], &[], 0b11, 0.03),
        (&[7, 20, 20, 3], &[10, 12, 3], 0b01_010, 0.03),
        (&[7, 30, 20, 20, 3], &[10, 16, 3], 0b11_1110, 0.5),
    ];
    for (first, second, which, telling) in networks {
        let (mut farthest, mut bound, mut spread, mut used) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..20 {
            let description = described(first, second, seed);
            let int8 = int8(&description, |layer| which >> layer & 1 == 1, seed ^ 3);
            let memory = Memory::of(&write_int8(&description, &int8).unwrap());
            let network = Network::parse(memory.bytes()).unwrap();
            let mut next = numbers(seed ^ 9);
            for _ in 0..50 {
                let inputs: Vec<_> =
                    description.inputs.iter().map(|range| 2.0 * range.scale * next()).collect();
                let mut found = [0.0; 3];
                network.predict(&inputs, &mut found);
                let meant = predicted_as_meant(&network, &inputs);
                for ((found, meant), range) in found.into_iter().zip(meant).zip(network.outputs()) {
                    let scale = f64::from(range.scale);
                    let apart = (f64::from(found) - meant.value).abs();
                    assert!(
                        apart <= meant.within,
                        "{first:?} {which:b}: {found} is {apart} from {}",
                        meant.value
                    );
                    farthest = f64::max(farthest, apart / scale);
                    bound = f64::max(bound, meant.within / scale);
                    used = f64::max(used, apart / meant.within);
                    spread = f64::max(spread, meant.value.abs() / scale);
                }
            }
        }
        println!(
            "{first:?} {second:?} {which:b}: {farthest:.4} apart, within {bound:.4} ({used:.2}), of {spread:.2}"
        );
        assert!(bound <= telling * spread && used > 0.0);
    }
}
