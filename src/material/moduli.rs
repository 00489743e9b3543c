//! Elastic moduli at rest, Pa: what the constants of a law mean at small strain. With `W` and `U` of the module's head
//! the shear modulus is `mu = 2 W'(0)` and the bulk modulus `K = U''(1)`.

use super::{Law, Potential};

/// Moduli of linear elasticity, Pa.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moduli {
    /// `mu`.
    pub shear: f64,
    /// `K`.
    pub bulk: f64,
}

impl Moduli {
    /// Of a law at rest.
    #[must_use]
    pub fn of<L: Law>(law: &L) -> Self {
        let law = law.splat::<f32>();
        Self { shear: 2.0 * f64::from(law.distortion_slope(0.0)), bulk: f64::from(law.bulk_modulus()) }
    }

    /// Young's modulus `E`, Pa.
    #[must_use]
    pub fn young(&self) -> f64 {
        let Self { shear, bulk } = *self;
        9.0 * bulk * shear / (3.0 * bulk + shear)
    }

    /// Poisson's ratio `nu`: near 0.5 tissue hardly changes its volume.
    #[must_use]
    pub fn poisson_ratio(&self) -> f64 {
        let Self { shear, bulk } = *self;
        (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Exponential, NeoHookean};

    /// A bar of the silicone of a real beam: E 263,824 Pa, nu 0.499. `W = c x` and `U = d j^2`, so that `mu = 2 c`, `K
    /// = 2 d`.
    #[test]
    fn constants_of_silicone_give_its_measured_moduli() {
        let (young, nu) = (263_824.0, 0.499);
        let (shear, bulk): (f64, f64) = (young / (2.0 * (1.0 + nu)), young / (3.0 * (1.0 - 2.0 * nu)));
        let law = NeoHookean { c: (0.5 * shear) as f32, d: (0.5 * bulk) as f32 };
        let moduli = Moduli::of(&law);
        println!("E {:.1} Pa, nu {:.5}", moduli.young(), moduli.poisson_ratio());
        assert!((moduli.young() / young - 1.0).abs() < 1e-6);
        assert!((moduli.poisson_ratio() - nu).abs() < 1e-6);
    }

    /// The paper's tissue: `W = a / (2 b) (exp(b x) - 1)` has `mu = a`.
    #[test]
    fn the_papers_tissue_hardly_changes_its_volume() {
        let moduli = Moduli::of(&Exponential { a: 59.0, b: 8.023, d: 60_000.0 });
        println!("mu {} Pa, K {} Pa, nu {:.5}", moduli.shear, moduli.bulk, moduli.poisson_ratio());
        assert!((moduli.poisson_ratio() - 0.4998).abs() < 1e-4);
    }
}
