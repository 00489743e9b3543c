//! The stress of a law from its two scalar functions, and its energy: `P = p1 (F - cof F) + s cof F`, with `p1 = 2 W'
//! g`, `s = p1 + dPsi/dJ` and `g = J^(-2/3)`, continued along its tangent below [`J_FLOOR`]. Pa.

use super::{J_FLOOR, Law, Potential};
use crate::simd::{Pair, Real};

/// The invariants a law sees, both zero at rest and both free of cancellation.
#[derive(Clone, Copy, Debug)]
pub struct Invariants<R> {
    /// `I1 - 3`.
    pub i: R,
    /// `J - 1`.
    pub j: R,
}

/// Scalars of the stress `P = p1 (F - cof F) + s cof F`, Pa.
#[derive(Clone, Copy, Debug)]
pub struct Response<R> {
    /// `dPsi/dI1 * 2`.
    pub p1: R,
    /// `p1 + dPsi/dJ`.
    pub s: R,
    /// [`Potential::saturation`] at this state.
    pub saturation: R,
}

/// `g(J) = J^(-2/3)` with its derivative, continued along the tangent below [`J_FLOOR`].
#[derive(Clone, Copy)]
pub(crate) struct VolumeFactor<R> {
    pub(crate) g: R,
    pub(crate) slope: R,
    /// `g - 1`, to full relative accuracy.
    pub(crate) less_one: R,
    /// `J^(-5/3)` and `J^-1` at the clamped `J`.
    fifth: R,
    inverse: R,
    /// `max(J, J_FLOOR) - 1`.
    clamped: R,
    /// `min(J - J_FLOOR, 0)`.
    below: R,
    /// `I1bar - 3`.
    pub(crate) x: R,
}

impl<R: Real> VolumeFactor<R> {
    #[inline(always)]
    pub(crate) fn new(at: Invariants<R>) -> Self {
        let one = R::splat(1.0);
        let third = R::splat(1.0 / 3.0);
        let clamped = at.j.max(R::splat(J_FLOOR - 1.0));
        let below = (at.j - R::splat(J_FLOOR - 1.0)).min(R::splat(0.0));
        let y = (one + clamped).inverse_cbrt();
        // e = y - 1 to full relative accuracy: one Newton step of (1 + j)(1 + e)^3 = 1 in terms of e.
        let e = y - one;
        let cube = e * e.fused(R::splat(3.0) + e, R::splat(3.0));
        let residual = (one + clamped).fused(cube, clamped);
        let e = e - residual * (third * y);
        let y = one + e;
        let square = y * y;
        let fifth = square * square * y;
        let slope = fifth * R::splat(-2.0 / 3.0);
        let i1 = at.i + R::splat(3.0);
        // I1bar - 3 = g (I1 - 3) + 3 (g - 1), g - 1 = e (2 + e)
        let x = square.fused(at.i, (R::splat(3.0) * e).fused(R::splat(2.0) + e, slope * below * i1));
        let less_one = slope.fused(below, e * (R::splat(2.0) + e));
        Self { g: slope.fused(below, square), slope, less_one, fifth, inverse: square * y, clamped, below, x }
    }

    /// Second derivative of `g`: zero where it is continued along its tangent.
    #[inline(always)]
    pub(crate) fn curvature(&self) -> R {
        let inside = R::splat(1.0) - (-self.below).positive();
        inside * R::splat(10.0 / 9.0) * self.fifth * self.inverse
    }
}

/// What stress and tangent share: `W'` and `g` at the given invariants.
#[derive(Clone, Copy)]
pub(crate) struct LawState<R> {
    pub(crate) at: Invariants<R>,
    factor: VolumeFactor<R>,
    /// `W'(x)`, Pa.
    pub(crate) slope: R,
    saturation: R,
    /// `U'` and `U''`, Pa: at the element's volume, or their mean over its nodes ([`super::NodalPressure`]).
    pub(crate) pressure: R,
    pub(crate) bulk: R,
}

impl<R: Real> LawState<R> {
    #[inline(always)]
    pub(crate) fn new<L: Law>(law: &L::Wide<R>, at: Invariants<R>) -> Self {
        Self::with_volume_change::<L>(law, at, at.j)
    }

    /// With the pressure at another `J - 1` than the element's own.
    #[inline(always)]
    pub(crate) fn with_volume_change<L: Law>(law: &L::Wide<R>, at: Invariants<R>, change: R) -> Self {
        let factor = VolumeFactor::new(at);
        let [slope, saturation, bulk] = law.at(factor.x);
        Self { at, factor, slope, saturation, pressure: bulk * change, bulk }
    }

    /// `W''(x)`, Pa; not negative.
    #[inline(always)]
    pub(crate) fn stiffening<L: Law>(&self, law: &L::Wide<R>) -> R {
        law.distortion_curvature(self.factor.x, self.slope).max(R::splat(0.0))
    }

    /// `g`, `g'` and `g''`.
    #[inline(always)]
    pub(crate) fn volume_factor(&self) -> [R; 3] {
        [self.factor.g, self.factor.slope, self.factor.curvature()]
    }

    /// `g - 1`.
    #[inline(always)]
    pub(crate) fn less_one(&self) -> R {
        self.factor.less_one
    }

    /// `J - 1`, no less than at [`J_FLOOR`], and `1 / J` there.
    #[inline(always)]
    pub(crate) fn clamped_volume(&self) -> [R; 2] {
        [self.factor.clamped, self.factor.inverse]
    }

    /// The stress scalars.
    #[inline(always)]
    pub(crate) fn response(&self) -> Response<R> {
        let (two, factor) = (R::splat(2.0), &self.factor);
        let slope = two * self.slope;
        // g + g' I1 / 2 = J^(-5/3) (J - 1 - (I1 - 3 + 2 below) / 3): small at small strain
        let bracket = factor.fifth * (factor.clamped - (self.at.i + two * factor.below) * R::splat(1.0 / 3.0));
        Response { p1: slope * factor.g, s: slope * bracket + self.pressure, saturation: self.saturation }
    }
}

impl<R: Real> VolumeFactor<Pair<R>> {
    #[inline(always)]
    fn split(&self) -> [VolumeFactor<R>; 2] {
        let Self { g, slope, less_one, fifth, inverse, clamped, below, x } = *self;
        [
            VolumeFactor {
                g: g.0,
                slope: slope.0,
                less_one: less_one.0,
                fifth: fifth.0,
                inverse: inverse.0,
                clamped: clamped.0,
                below: below.0,
                x: x.0,
            },
            VolumeFactor {
                g: g.1,
                slope: slope.1,
                less_one: less_one.1,
                fifth: fifth.1,
                inverse: inverse.1,
                clamped: clamped.1,
                below: below.1,
                x: x.1,
            },
        ]
    }
}

impl<R: Real> LawState<Pair<R>> {
    /// Each half by itself.
    #[inline(always)]
    pub(crate) fn split(&self) -> [LawState<R>; 2] {
        let Self { at, factor, slope, saturation, pressure, bulk } = *self;
        let [near, far] = factor.split();
        [
            LawState {
                at: Invariants { i: at.i.0, j: at.j.0 },
                factor: near,
                slope: slope.0,
                saturation: saturation.0,
                pressure: pressure.0,
                bulk: bulk.0,
            },
            LawState {
                at: Invariants { i: at.i.1, j: at.j.1 },
                factor: far,
                slope: slope.1,
                saturation: saturation.1,
                pressure: pressure.1,
                bulk: bulk.1,
            },
        ]
    }
}

/// The stress scalars of law `L` at the given invariants.
#[inline(always)]
pub(crate) fn response<R: Real, L: Law>(law: &L::Wide<R>, at: Invariants<R>) -> Response<R> {
    LawState::new::<L>(law, at).response()
}

/// Floating-point operations of [`response`] for one element, those of the law included.
pub(crate) fn response_operations<L: Law>(law: &L) -> u32 {
    // 52 for `VolumeFactor::new`, 9 to combine.
    law.operations() + 61
}

/// Energy density in float64, J/m^3, of a deformation with the given `I1 - 3` and `J - 1`.
pub(crate) fn energy_density<L: Law>(law: &L, i: f64, j: f64) -> f64 {
    let floor = f64::from(J_FLOOR);
    let volume = 1.0 + j;
    let clamped = if volume > floor { volume } else { floor };
    // g - 1 without cancellation
    let below_one = libm::expm1(-2.0 / 3.0 * libm::log1p(clamped - 1.0));
    let slope = -2.0 / 3.0 * (1.0 + below_one) / clamped;
    let x = (1.0 + below_one) * i + 3.0 * below_one + slope * (volume - clamped) * (i + 3.0);
    law.energy(x, j)
}
