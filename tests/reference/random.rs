//! Pseudo-random numbers and deformation gradients that reach every branch of the laws.

use super::law::{EXPONENT_CAP, J_MIN, Law};
use super::tensor::{IDENTITY, Mat3, Vec3, determinant, from_fn, product, rotation};

/// Pseudo-random numbers in (-1, 1).
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// The next one.
    pub fn next(&mut self) -> f64 {
        // SplitMix64 (Steele, Lea, Flood 2014).
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64 * 2.0 - 1.0
    }

    /// Three of them.
    pub fn vector(&mut self) -> Vec3 {
        [self.next(), self.next(), self.next()]
    }

    /// Nine of them.
    pub fn matrix(&mut self) -> Mat3 {
        [self.vector(), self.vector(), self.vector()]
    }

    /// A rotated stretch with a little noise.
    pub fn deformation(&mut self, stretch: Vec3) -> Mat3 {
        let q = rotation(self.vector(), 3.0 * self.next());
        let noise = self.matrix();
        product(&q, &from_fn(|i, j| IDENTITY[i][j] * stretch[i] + 0.05 * noise[i][j]))
    }
}

/// Named deformation gradients: moderate (J in 0.6 .. 1.6), crushed and inverted (J < J_MIN), above the cap
/// of the exponent.
pub fn deformations() -> Vec<(&'static str, Mat3)> {
    let mut random = Random(7);
    let mut cases = Vec::new();
    while cases.len() < 20 {
        let stretch = random.vector().map(|x| 1.0 + 0.4 * x);
        let f = random.deformation(stretch);
        if (0.6..1.6).contains(&determinant(&f)) {
            cases.push(("J in 0.6 .. 1.6", f));
        }
    }
    for _ in 0..5 {
        cases.push(("crushed", random.deformation([0.3, 0.5, 0.4])));
        cases.push(("inverted", random.deformation([-0.4, 0.9, 1.1])));
        cases.push(("above the cap", random.deformation([3.0, 0.6, 0.6])));
    }
    for (name, f) in &cases {
        let j = determinant(f);
        match *name {
            "crushed" => assert!(0.0 < j && j < J_MIN, "{j}"),
            "inverted" => assert!(j < 0.0, "{j}"),
            "above the cap" => assert!(8.023 * Law::PAPER.strain_measure(f) > EXPONENT_CAP),
            _ => {}
        }
    }
    cases
}
