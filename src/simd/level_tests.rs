//! Vector operations of this processor's level give the bits of the scalar operations, also for zeros of both signs,
//! infinities and subnormal values. A NaN only has to be a NaN again.

extern crate std;
use std::println;

use super::int8::Whole;
use super::level::at_current_level;
use super::{Kernel, Level, Real};

const VALUES: [f32; 16] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    f32::NAN,
    0.3,
    -7.25,
    f32::INFINITY,
    f32::NEG_INFINITY,
    1e-40,
    -1e-40,
    f32::MIN_POSITIVE,
    f32::MAX,
    -f32::MAX,
    1.000_000_1,
    12_345.678,
];

struct Operations;

impl Kernel for Operations {
    type Output = usize;

    fn run<R: Real>(self) -> usize {
        let mut checked = 0;
        let mut same = |name: &str, vector: R, scalar: &dyn Fn(usize) -> f32| {
            for lane in 0..R::COUNT {
                let (vectorised, scalar) = (vector.lane(lane), scalar(lane));
                let both_nan = vectorised.is_nan() && scalar.is_nan();
                assert!(
                    both_nan || vectorised.to_bits() == scalar.to_bits(),
                    "{name}: {vectorised:e} in lane {lane}, {scalar:e} from scalar code"
                );
                checked += 1;
            }
        };
        for shift in 0..VALUES.len() {
            for offset in [0, 8] {
                let x = |lane: usize| VALUES[(lane + offset) % VALUES.len()];
                let y = |lane: usize| VALUES[(lane + offset + shift) % VALUES.len()];
                // Positive and normal values.
                let z = |lane: usize| 1e-30 * 1e4f32.powi((lane + shift) as i32 % 15) * (1.0 + 0.1 * lane as f32);
                let (a, b, c) = (R::from_fn(x), R::from_fn(y), R::from_fn(z));
                same("+", a + b, &|l| x(l) + y(l));
                same("-", a - b, &|l| x(l) - y(l));
                same("*", a * b, &|l| x(l) * y(l));
                same("negative", -a, &|l| -x(l));
                same("divide", a.divide(b), &|l| x(l) / y(l));
                same("max", a.max(b), &|l| if x(l) > y(l) { x(l) } else { y(l) });
                same("min", a.min(b), &|l| if x(l) < y(l) { x(l) } else { y(l) });
                same("choose", a.choose(b, c), &|l| if x(l) > 0.0 { y(l) } else { z(l) });
                same("positive", a.positive(), &|l| f32::from(u8::from(x(l) > 0.0)));
                same("abs", a.abs(), &|l| x(l).abs());
                same("root", a.root(), &|l| libm::sqrtf(x(l)));
                same("sqrt", Real::sqrt(c), &|l| Real::sqrt(z(l)));
                // These use fused operations; their errors are tested in `functions`.
                if cfg!(feature = "deterministic") {
                    same("exp", a.exp(), &|l| Real::exp(x(l)));
                    same("inverse_cbrt", c.inverse_cbrt(), &|l| z(l).inverse_cbrt());
                }
                for lane in (0..R::COUNT).filter(|&lane| z(lane).is_finite()) {
                    let exact = f64::from(z(lane)).powf(-1.0 / 3.0);
                    let off = (f64::from(c.inverse_cbrt().lane(lane)) / exact - 1.0).abs();
                    assert!(off < 2e-7, "inverse_cbrt of {:e} is off by {off:.1e}", z(lane));
                }
                let rows = R::from_rows(|lane| [x(lane), y(lane), z(lane), lane as f32]);
                same("column 0", rows[0], &x);
                same("column 1", rows[1], &y);
                same("column 2", rows[2], &z);
                same("column 3", rows[3], &|l| l as f32);
                R::to_rows([c, c + c, -c, R::splat(3.0)], |lane, row| {
                    assert_eq!(row, [z(lane), z(lane) + z(lane), -z(lane), 3.0], "row {lane}");
                });
                let mut tile = [[0.0; 4]; 16];
                for (row, values) in tile.iter_mut().enumerate() {
                    *values = [0.0, 1.0, 2.0, 3.0].map(|column| 4.0 * row as f32 + column);
                }
                let columns = R::from_consecutive_rows(&tile[..R::COUNT]);
                let mut back = [[0.0; 4]; 16];
                R::to_consecutive_rows(columns, &mut back[..R::COUNT]);
                for row in 0..R::COUNT {
                    assert_eq!(columns.map(|column| column.lane(R::lane_of_row(row))), tile[row], "row {row}");
                    assert_eq!(back[row], tile[row], "row {row} back");
                }
            }
        }
        checked
    }
}

#[test]
fn vector_operations_give_the_bits_of_scalar_ones() {
    let checked = at_current_level(Operations);
    println!("{:?}: {checked} results", Level::current());
    assert!(checked > 1000);
}

/// Integer vectors for activations and weights of every size, compared with plain loops.
struct Integers;

impl Kernel for Integers {
    type Output = usize;

    fn run<R: Real>(self) -> usize {
        let mut seed = 5u32;
        let mut random = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            seed >> 8
        };
        let mut checked = 0;
        for round in 0..2_000 {
            // Bytes are the lowest ones of floats.
            let mut bytes = [[0u32; 16]; 4];
            bytes.as_flattened_mut().fill_with(|| if round % 5 == 0 { 255 * (random() % 2) } else { random() % 256 });
            let words =
                R::Whole::low_bytes(bytes.map(|bytes| R::from_fn(|lane| f32::from_bits(0x4b40_0000 | bytes[lane]))));
            let biases = [(); 4].map(|()| (random() << 8 ^ random()) as i32 >> (random() % 28 + 1));
            let weights = [[(); 4]; 4].map(|four| {
                four.map(|()| if round % 7 == 0 { [-128, 127][random() as usize % 2] } else { random() as i8 })
            });
            let sums = [0, 1, 2, 3].map(|output| R::Whole::splat(biases[output]).dot(words, weights[output]));
            for lane in 0..R::COUNT {
                for output in 0..4 {
                    let products =
                        bytes.iter().zip(weights[output]).map(|(bytes, weight)| bytes[lane] as i32 * i32::from(weight));
                    let sum = biases[output] + products.sum::<i32>();
                    assert_eq!(sums[output].numbers().lane(lane), sum as f32, "sum {output} in lane {lane}");
                    checked += 1;
                }
            }
        }
        checked
    }
}

#[test]
fn integer_vectors_give_the_results_of_plain_loops() {
    let checked = at_current_level(Integers);
    println!("{:?}: {checked} results", Level::current());
    assert!(checked > 10_000);
}
