//! Exponential law `W(x) = a / (2 b) (exp(b x) - 1)`, `U(J) = d (J - 1)^2` (Meister et al. 2018, section 2,
//! after Holzapfel & Ogden 2009). `a` and `d` in Pa, `b` without unit.
//!
//! In float32 `exp` overflows at 88. The exponent is capped at [`EXPONENT_CAP`]; beyond it `W` goes on
//! along its tangent, and the step says [`Limited`](crate::step::Status::Limited).

use super::{Constant, Law, MAX_CONSTANTS, Potential, Values};
use crate::simd::Real;

/// Largest exponent `b x` before the law is continued along its tangent.
pub const EXPONENT_CAP: f32 = 40.0;

/// Constants of the exponential law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exponential<R = f32> {
    /// Shear modulus at rest, Pa.
    pub a: R,
    /// Stiffening, without unit.
    pub b: R,
    /// Half the bulk modulus, Pa.
    pub d: R,
}

impl<R: Real> Exponential<R> {
    #[inline(always)]
    fn capped_exp(&self, x: R) -> R {
        (self.b * x).min(R::splat(EXPONENT_CAP)).exp()
    }
}

impl<R: Real> Potential<R> for Exponential<R> {
    #[inline(always)]
    fn of([a, b, d, _]: [R; MAX_CONSTANTS]) -> Self {
        Self { a, b, d }
    }
    #[inline(always)]
    fn distortion_slope(&self, x: R) -> R {
        R::splat(0.5) * self.a * self.capped_exp(x)
    }
    #[inline(always)]
    fn distortion_curvature(&self, _x: R, slope: R) -> R {
        // The tangent beyond the cap has none, but a bound may not drop at the cap.
        self.b * slope
    }
    #[inline(always)]
    fn bulk_modulus(&self) -> R {
        self.d + self.d
    }
    #[inline(always)]
    fn saturation(&self, x: R) -> R {
        self.b * x * R::splat(1.0 / EXPONENT_CAP)
    }
}

impl Law for Exponential {
    type Wide<R: Real> = Exponential<R>;

    fn name(&self) -> &'static str {
        "exponential"
    }

    fn constants(&self) -> &'static [Constant] {
        &[
        Constant { name: "a", unit: "Pa" },
        Constant { name: "b", unit: "" },
        Constant { name: "d", unit: "Pa" },
    ]
    }

    fn operations(&self) -> u32 {
        32
    }

    #[inline(always)]
    fn with(&self, values: Values) -> Self {
        Self::of(values)
    }

    #[inline(always)]
    fn values(&self) -> Values {
        [self.a, self.b, self.d, 0.0]
    }

    fn energy(&self, x: f64, j: f64) -> f64 {
        let (a, b, d) = (f64::from(self.a), f64::from(self.b), f64::from(self.d));
        let cap = f64::from(EXPONENT_CAP);
        let exponent = b * x;
        let inside = if exponent < cap { exponent } else { cap };
        let growth = libm::expm1(inside) + (exponent - inside) * libm::exp(inside);
        a / (2.0 * b) * growth + d * j * j
    }
}
