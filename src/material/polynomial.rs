//! Reduced polynomial law of second order `W(x) = c x + e x^2`, `U(J) = d (J - 1)^2` (Yeoh 1993 without its third term;
//! neo-Hookean with stiffening). Constants in Pa.

use super::{Constant, Law, MAX_CONSTANTS, Potential, Values};
use crate::simd::Real;

/// Constants of the reduced polynomial law, Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Polynomial<R = f32> {
    /// Half the shear modulus at rest, Pa.
    pub c: R,
    /// Stiffening, Pa.
    pub e: R,
    /// Half the bulk modulus, Pa.
    pub d: R,
}

impl<R: Real> Potential<R> for Polynomial<R> {
    #[inline(always)]
    fn of([c, e, d, _]: [R; MAX_CONSTANTS]) -> Self {
        Self { c, e, d }
    }
    #[inline(always)]
    fn distortion_slope(&self, x: R) -> R {
        (self.e + self.e).fused(x, self.c)
    }
    #[inline(always)]
    fn distortion_curvature(&self, _x: R, _slope: R) -> R {
        self.e + self.e
    }
    #[inline(always)]
    fn bulk_modulus(&self) -> R {
        self.d + self.d
    }
}

impl Law for Polynomial {
    type Wide<R: Real> = Polynomial<R>;

    fn name(&self) -> &'static str {
        "polynomial"
    }

    fn constants(&self) -> &'static [Constant] {
        &[
        Constant { name: "c", unit: "Pa" },
        Constant { name: "e", unit: "Pa" },
        Constant { name: "d", unit: "Pa" },
    ]
    }

    fn operations(&self) -> u32 {
        5
    }

    #[inline(always)]
    fn with(&self, values: Values) -> Self {
        Self::of(values)
    }

    #[inline(always)]
    fn values(&self) -> Values {
        [self.c, self.e, self.d, 0.0]
    }

    fn energy(&self, x: f64, j: f64) -> f64 {
        let (c, e, d) = (f64::from(self.c), f64::from(self.e), f64::from(self.d));
        (c + e * x) * x + d * j * j
    }
}
