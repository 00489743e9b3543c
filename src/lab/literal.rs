//! The laws as the paper prints them (Meister et al. 2018, section 2): functions of `I1 - 3`, where those of the
//! library are of `I1bar - 3`. `W = W(I1 - 3) + d (J - 1)^2`, `P = 2 W' F + 2 d (J - 1) cof F`, in float64. At rest
//! they have a residual stress `2 W'(0)`, so a free body shrinks until its volume resists. The paper's `d (J - 1)` is a
//! misprint: no state would be in equilibrium. Pa.

use glam::{DMat3, DVec3};
use supple::material::{Exponential, NeoHookean};

/// The paper's neo-Hookean constants.
pub const PAPER: LiteralLaw = LiteralLaw::NeoHookean(NeoHookean { c: 500.0, d: 25_000.0 });

/// A law as the paper prints it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LiteralLaw {
    /// `W = c (I1 - 3)`.
    NeoHookean(NeoHookean<f64>),
    /// `W = a / (2 b) (exp(b (I1 - 3)) - 1)`.
    Exponential(Exponential<f64>),
}

impl LiteralLaw {
    /// Strain energy of a volume of one, J/m^3, at the deformation gradient `f`.
    #[must_use]
    pub fn energy(&self, f: DMat3) -> f64 {
        let (x, change) = (invariant(f) - 3.0, f.determinant() - 1.0);
        match self {
            Self::NeoHookean(NeoHookean { c, d }) => c * x + d * change * change,
            Self::Exponential(Exponential { a, b, d }) => 0.5 * a / b * (b * x).exp_m1() + d * change * change,
        }
    }

    /// First Piola-Kirchhoff stress, Pa, at the deformation gradient `f`.
    #[must_use]
    pub fn stress(&self, f: DMat3) -> DMat3 {
        let x = invariant(f) - 3.0;
        let (slope, d) = match self {
            Self::NeoHookean(NeoHookean { c, d }) => (*c, d),
            Self::Exponential(Exponential { a, b, d }) => (0.5 * a * (b * x).exp(), d),
        };
        let j = f.determinant();
        f * (2.0 * slope) + f.inverse().transpose() * (2.0 * d * (j - 1.0) * j)
    }

    /// Volume of a free body at rest over that without stress, by bisection between a half and one.
    #[must_use]
    pub fn volume_at_rest(&self) -> f64 {
        let (mut low, mut high) = (0.5_f64, 1.0_f64);
        // To the last digit.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let pulls = self.stress(DMat3::from_diagonal(DVec3::splat(middle.cbrt()))).x_axis.x > 0.0;
            if pulls { high = middle } else { low = middle }
        }
        high
    }
}

/// `I1`.
fn invariant(f: DMat3) -> f64 {
    f.x_axis.length_squared() + f.y_axis.length_squared() + f.z_axis.length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAWS: [LiteralLaw; 2] = [PAPER, LiteralLaw::Exponential(Exponential { a: 59.0, b: 8.023, d: 60_000.0 })];

    #[test]
    fn stress_is_the_derivative_of_the_energy() {
        let f = DMat3::from_cols_array(&[1.1, 0.05, -0.1, 0.2, 0.9, 0.1, 0.0, -0.15, 1.05]);
        for law in LAWS {
            let stress = law.stress(f).to_cols_array();
            for (entry, stress) in stress.into_iter().enumerate() {
                let moved = |by: f64| {
                    let mut entries = f.to_cols_array();
                    entries[entry] += by;
                    law.energy(DMat3::from_cols_array(&entries))
                };
                let numeric = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                assert!((numeric - stress).abs() < 1e-4 * stress.abs().max(1.0), "{law:?}: {numeric} {stress}");
            }
        }
    }

    /// About `W'(0) / d` less.
    #[test]
    fn a_free_body_shrinks() {
        let volumes = LAWS.map(|law| law.volume_at_rest());
        println!("{volumes:?}");
        assert!((volumes[0] - 0.979_864).abs() < 1e-6 && (volumes[1] - 0.999_512).abs() < 1e-6);
    }
}
