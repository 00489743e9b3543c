//! Neo-Hookean law `W(x) = c x`, `U(J) = d (J - 1)^2` (Meister et al. 2018, section 3; with `c = mu / 2`,
//! `d = kappa / 2` the law of NiftySim and DJ-TLED). Constants in Pa.

use super::{Constant, Law, MAX_CONSTANTS, Potential, Values};
use crate::simd::Real;

/// Constants of the neo-Hookean law: half the shear modulus and half the bulk modulus, Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NeoHookean<R = f32> {
    /// Half the shear modulus, Pa.
    pub c: R,
    /// Half the bulk modulus, Pa.
    pub d: R,
}

impl<R: Real> Potential<R> for NeoHookean<R> {
    #[inline(always)]
    fn of([c, d, ..]: [R; MAX_CONSTANTS]) -> Self {
        Self { c, d }
    }
    #[inline(always)]
    fn distortion_slope(&self, _x: R) -> R {
        self.c
    }
    #[inline(always)]
    fn distortion_curvature(&self, _x: R, _slope: R) -> R {
        R::splat(0.0)
    }
    #[inline(always)]
    fn bulk_modulus(&self) -> R {
        self.d + self.d
    }
}

impl Law for NeoHookean {
    type Wide<R: Real> = NeoHookean<R>;

    fn name(&self) -> &'static str {
        "neo-hookean"
    }

    fn constants(&self) -> &'static [Constant] {
        &[Constant { name: "c", unit: "Pa" }, Constant { name: "d", unit: "Pa" }]
    }

    fn operations(&self) -> u32 {
        2
    }

    #[inline(always)]
    fn with(&self, values: Values) -> Self {
        Self::of(values)
    }

    #[inline(always)]
    fn values(&self) -> Values {
        [self.c, self.d, 0.0, 0.0]
    }

    fn energy(&self, x: f64, j: f64) -> f64 {
        f64::from(self.c) * x + f64::from(self.d) * j * j
    }
}
