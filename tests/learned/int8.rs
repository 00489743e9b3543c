//! int8 layers: every instruction-set level gives the bits of the plain loops here, and these are as near to what a
//! file means in float64 as rounding allows.

use proptest::prelude::*;
use supple::mlp::quantise::quantise;
use supple::mlp::{
    Activation, Description, Int8Description, Layer, LayerDescription, Network, Parameters, write, write_int8,
};
use supple::simd::Level;

use crate::level_guard;
use crate::networks::{Memory, described, int8, uniform};

/// All that this processor has.
fn levels() -> Vec<Level> {
    Level::available().collect()
}

/// A float32 layer, each operation rounded by itself.
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

/// The same in int8, as `weights/FORMAT.md` has it; sums in integers that cannot overflow.
fn quantised(layer: &LayerDescription, int8: &Int8Description, x: &[f32]) -> Vec<f32> {
    let (up, down) = (f32::from(255 - int8.zero), f32::from(int8.zero));
    let most = x.iter().fold(2f32.powi(-100), |most, &x| if x > most { x } else { most });
    let least = x.iter().fold(0.0, |least, &x| if x < least { x } else { least });
    let below = least * -(up / down);
    let most = if most > below { most } else { below };
    let (inverse, step) = (up / most, most / up);
    let byte = |x: &f32| {
        let scaled = x * inverse;
        let scaled = if scaled > -down { scaled } else { -down };
        let q = (f64::from(scaled) + f64::from(down)).round_ties_even();
        assert!((0.0..=255.0).contains(&q));
        q as i64
    };
    let bytes: Vec<i64> = x.iter().map(byte).collect();
    let rows = int8.weights.chunks(layer.inputs).zip(&int8.scales).zip(&layer.biases);
    rows.map(|((row, scale), bias)| {
        let sum: i64 = row.iter().zip(&bytes).map(|(&w, q)| i64::from(w) * (q - i64::from(int8.zero))).sum();
        activated(layer.activation, sum as f32 * (scale * step) + bias)
    })
    .collect()
}

fn part(layers: &[LayerDescription], int8: &[Option<Int8Description>], x: Vec<f32>) -> Vec<f32> {
    layers.iter().zip(int8).fold(x, |x, (layer, int8)| match int8 {
        Some(int8) => quantised(layer, int8, &x),
        None => float(layer, &x),
    })
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

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Every level against the plain loops, for many vertices and for one.
fn compare(description: &Description<'_>, int8: &[Option<Int8Description>], rows: usize, seed: u32) {
    let memory = Memory::of(&write_int8(description, int8).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let (wide, high) = (description.inputs.len(), description.outputs.len());
    let mut random = uniform(seed);
    let inputs: Vec<f32> = (0..rows * wide).map(|at| 3.0 * description.inputs[at % wide].scale * random()).collect();
    let wanted: Vec<f32> = inputs.chunks(wide).flat_map(|inputs| predicted(description, int8, inputs)).collect();
    let _guard = level_guard();
    let before = Level::current();
    for level in levels() {
        assert!(Level::force(level));
        let mut outputs = vec![0.0; rows * high];
        network.predict_rows(&inputs, &mut outputs);
        assert_eq!(bits(&outputs), bits(&wanted), "{level:?}");
    }
    assert!(Level::force(before));
    let mut outputs = vec![0.0; high];
    network.predict(&inputs[..wide], &mut outputs);
    assert_eq!(bits(&outputs), bits(&wanted[..high]), "one vertex");
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
}

/// As wide as layers may be, with the largest sums: 256 inputs of 255 times 127.
#[test]
fn the_largest_sums_are_exact() {
    for (sign, zero) in [(1, 1), (-1, 1), (1, 254), (-1, 254)] {
        let description = described(&[7, 256, 256, 256, 3], &[10, 256, 3], 4);
        let mut int8 = int8(&description, |layer| layer != 0, 5);
        for layer in int8.iter_mut().flatten() {
            layer.zero = zero;
            layer.weights.fill(sign * 127);
        }
        compare(&description, &int8, 40, 6);
    }
}

/// Inputs that are not finite, or beyond what a layer can hold.
#[test]
fn odd_inputs_give_the_same_bits_everywhere() {
    let description = described(&[7, 20, 20, 3], &[], 4);
    let int8 = int8(&description, |layer| layer != 0, 5);
    let memory = Memory::of(&write_int8(&description, &int8).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -0.0, 1e-45, 3e38];
    let mut random = uniform(3);
    let inputs: Vec<f32> = (0..7 * 60).map(|at| if random() > 0.6 { odd[at % 7] } else { random() }).collect();
    let _guard = level_guard();
    let mut results = Vec::new();
    for level in levels() {
        assert!(Level::force(level));
        let mut outputs = vec![0.0; 3 * 60];
        network.predict_rows(&inputs, &mut outputs);
        assert!(outputs.iter().all(|output| output.is_finite()));
        results.push(bits(&outputs));
    }
    assert!(results.windows(2).all(|pair| pair[0] == pair[1]));
}

/// What a value would be if nothing were rounded to integers, and how far the computed one may be from it.
#[derive(Clone, Copy)]
struct Meant {
    value: f64,
    within: f64,
}

/// Half the distance of neighbouring floats, over their size.
const UNIT: f64 = 1.0 / 16_777_216.0;

impl Meant {
    /// After so many float32 operations whose results are up to `size`, and one more for what `within` adds to it.
    fn rounded(self, operations: usize, size: f64) -> Self {
        let units = (operations + 1) as f64 * UNIT;
        Self { within: self.within + units * (size + self.within) + f64::from(f32::MIN_POSITIVE), ..self }
    }
    /// After a function that never changes by more than `factor` times what its argument does.
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
}

/// `bias + sum w x` with exact weights, and how large its addends may be.
fn sum(bias: f64, row: impl Iterator<Item = f64>, x: &[Meant]) -> (Meant, f64) {
    let start = (Meant { value: bias, within: 0.0 }, bias.abs());
    row.zip(x).fold(start, |(sum, size), (w, x)| {
        let sum = Meant { value: sum.value + w * x.value, within: sum.within + w.abs() * x.within };
        (sum, size + w.abs() * (x.value.abs() + x.within))
    })
}

/// A layer as the file has it.
fn meant(layer: &Layer<'_>, x: &[Meant]) -> Vec<Meant> {
    let int8 = match layer.parameters {
        Parameters::Float { weights, biases } => {
            let rows = weights.chunks(layer.inputs).zip(biases);
            let sums = rows.map(|(row, &bias)| sum(bias.into(), row.iter().map(|&w| w.into()), x));
            let rounded = sums.map(|(sum, size)| sum.rounded(2 * layer.inputs, size));
            return rounded.map(|sum| sum.float(layer.activation)).collect();
        }
        Parameters::Int8(int8) => int8,
    };
    // Half a step, of the longest that there may be, is all that an input is off; and rounding of a few operations.
    let (up, down) = (f64::from(255 - int8.zero), f64::from(int8.zero));
    let step = x.iter().fold(0.0, |step: f64, x| step.max((x.value + x.within) / up).max((x.within - x.value) / down));
    let rounded: Vec<Meant> =
        x.iter().map(|x| Meant { within: x.within + (0.5 + 255.0 * 8.0 * UNIT) * step, ..*x }).collect();
    let groups = layer.inputs.div_ceil(4);
    let sums = (0..layer.outputs).map(|output| {
        let tiles = int8.weights.iter().skip(output / 8 * groups).take(groups);
        let scale = f64::from(int8.scales[output]);
        let row = tiles.flat_map(|tile| tile[output % 8]).map(|weight| scale * f64::from(weight));
        let (sum, size) = sum(int8.biases[output].into(), row, &rounded);
        sum.rounded(5, size).float(layer.activation)
    });
    sums.collect()
}

/// The whole network as the file has it.
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

/// Only the rounding of activations separates an int8 network from what its weights mean: half a step of each, and at
/// most what the layers after it make of that.
#[test]
fn networks_are_what_their_weights_mean_within_rounding() {
    // Which layers are int8, and how small the bound must be to say something, over the outputs' spread.
    let networks: [(&[usize], &[usize], u32, f64); 5] = [
        (&[7, 40, 3], &[], 0b01, 0.04),
        (&[7, 40, 3], &[], 0b10, 0.05),
        (&[7, 24, 3], &[], 0b11, 0.09),
        (&[7, 20, 20, 3], &[10, 12, 3], 0b01_010, 0.3),
        (&[7, 20, 20, 3], &[], 0b110, 0.5),
    ];
    for (first, second, which, telling) in networks {
        let (mut farthest, mut bound, mut spread, mut used) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..20 {
            let description = described(first, second, seed);
            let mut int8 = int8(&description, |layer| which >> layer & 1 == 1, seed ^ 3);
            // Elsewhere steps are as wide as they may be, and the bound says nothing.
            int8.iter_mut().flatten().for_each(|layer| layer.zero = 128);
            let memory = Memory::of(&write_int8(&description, &int8).unwrap());
            let network = Network::parse(memory.bytes()).unwrap();
            let mut random = uniform(seed ^ 9);
            for _ in 0..50 {
                let inputs: Vec<_> = description.inputs.iter().map(|range| 2.0 * range.scale * random()).collect();
                let mut outputs = [0.0; 3];
                network.predict(&inputs, &mut outputs);
                let meant = predicted_as_meant(&network, &inputs);
                for ((output, meant), range) in outputs.into_iter().zip(meant).zip(network.outputs()) {
                    let scale = f64::from(range.scale);
                    let apart = (f64::from(output) - meant.value).abs();
                    assert!(apart <= meant.within, "{first:?} {which:b}: {output} is {apart} from {}", meant.value);
                    farthest = f64::max(farthest, apart / scale);
                    bound = f64::max(bound, meant.within / scale);
                    used = f64::max(used, apart / meant.within);
                    spread = f64::max(spread, meant.value.abs() / scale);
                }
            }
        }
        println!("{first:?} {second:?} {which:b}: {farthest:.4} apart, within {bound:.4} ({used:.2}), of {spread:.2}");
        assert!(bound <= telling * spread && used > 0.0);
    }
}

/// The difference of a network and the same quantised, on unseen samples times `scale`, over the spread of the outputs.
fn lost(description: &Description<'_>, scale: f32) -> f64 {
    let memory = Memory::of(&write(description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let mut random = uniform(77);
    let wide = description.inputs.len();
    // Most of it slow, some of it thirty times as fast.
    let mut samples = |rows: usize| -> Vec<f32> {
        (0..rows * wide)
            .map(|at| {
                let size = if (at / wide).is_multiple_of(10) { 30.0 } else { 1.0 };
                0.1 * size * description.inputs[at % wide].scale * random()
            })
            .collect()
    };
    let (seen, unseen) = (samples(4_000), samples(1_000));
    let last = description.first.len() - 1;
    let quantised = quantise(&network, &seen, &[0, last, last + 1, last + description.second.len()]).unwrap();
    let int8 = Memory::of(&write_int8(&quantised.description, &quantised.layers).unwrap());
    let int8 = Network::parse(int8.bytes()).unwrap();
    let inputs: Vec<f32> = unseen.iter().map(|x| scale * x).collect();
    let (mut exact, mut rounded) = (vec![0.0; 3_000], vec![0.0; 3_000]);
    network.predict_rows(&inputs, &mut exact);
    int8.predict_rows(&inputs, &mut rounded);
    let mean = |output: usize| exact.iter().skip(output).step_by(3).sum::<f32>() / 1_000.0;
    let means = [mean(0), mean(1), mean(2)];
    let square = |values: &mut dyn Iterator<Item = f32>| values.map(|x| f64::from(x * x)).sum::<f64>();
    let off = square(&mut exact.iter().zip(&rounded).map(|(a, b)| a - b));
    let of = square(&mut exact.iter().enumerate().map(|(at, x)| x - means[at % 3]));
    (off / of).sqrt()
}

/// Far beyond the samples, as in a roll-out that rings, the error is the same share: nothing is cut off. Neither is
/// what hardly moves.
#[test]
fn quantised_networks_are_exact_in_proportion() {
    let mut description = described(&[7, 64, 64, 3], &[10, 32, 32, 3], 8);
    for range in &mut description.outputs {
        (range.least, range.most) = (-1e6, 1e6);
    }
    for (scale, most) in [(0.1, 0.05), (1.0, 0.02), (100.0, 0.05)] {
        let lost = lost(&description, scale);
        println!("{scale} times the samples: {lost:.4} of the spread lost");
        assert!(lost < most);
    }
}
