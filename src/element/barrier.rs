//! The energy that keeps elements with nodal strain from turning inside out. The mean strain around nodes does not see
//! an element that is crushed at a clamped edge, so each element has an energy of its own below the volume ratio
//! [`ONSET`], exactly zero above it:
//!
//! ```text
//! E_B = sum_e V_e mu / 6 I1 h(J),   h = beta (J0 - J)^2 / (J0 J) for J < J0,   mu = 2 W'(0),  J0 = 0.5,  beta = 1.5
//! P_B = mu / 3 h F + mu / 6 I1 h' cof F,   h' = beta (1 / J0 - J0 / J^2),   h'' = 2 beta J0 / J^3
//! ```
//! Below [`FLOOR`] `h` goes on along its tangent, so that every state has a finite force that pushes back. The factor
//! `I1` makes `h` a second `g` of a law `W = mu / 6 x` ([`crate::material`]): an element that is crushed and sheared
//! resists both. With a plain `mu h` some elements of bodies that hang from a clamped face still turn inside out.
//!
//! The bounds of a law's tangent hold with `W' = mu / 6`, `W'' = U' = U'' = 0` and `(h, h', h'')` for `(g, g', g'')`
//! ([`super::critical_bounds`], [`super::stiffness_bound`]). As `h''` jumps at `J0`, elements that are near it count as
//! if they were there ([`Barrier::ahead`]).

use super::deformation::Deformation;
use crate::material::{Invariants, Law, Potential};
use crate::simd::Real;

/// Volume ratio `J0` below which an element resists.
pub(crate) const ONSET: f32 = 0.5;
/// Volume ratio below which the energy is continued along its tangent.
const FLOOR: f32 = 0.15;
/// `beta`.
const STRENGTH: f32 = 1.5;
/// Above the onset by this much an element counts in bounds as if it were there: bounds hold for many steps.
const AHEAD: f32 = 0.1;
/// Volume ratio below which an element counts in bounds.
pub(crate) const BOUNDED: f32 = ONSET + AHEAD;

/// `mu / 6` of a law, Pa.
pub(crate) fn modulus<L: Law>(law: &L) -> f32 {
    law.splat::<f32>().distortion_slope(0.0) * (1.0 / 3.0)
}

/// The energy of a vector of elements.
#[derive(Clone, Copy)]
pub(crate) struct Barrier<R> {
    /// `mu / 6`, Pa.
    pub(crate) slope: R,
    /// `h`, `h'`, `h''`.
    pub(crate) factor: [R; 3],
}

impl<R: Real> Barrier<R> {
    /// With `modulus` `mu / 6`, Pa.
    #[inline(always)]
    pub(crate) fn new(modulus: R, at: Invariants<R>) -> Self {
        Self::below(modulus, at, R::splat(ONSET))
    }

    /// The same for bounds: up to [`BOUNDED`] an element has the curvature of [`ONSET`].
    #[inline(always)]
    pub(crate) fn ahead(modulus: R, at: Invariants<R>) -> Self {
        Self::below(modulus, at, R::splat(BOUNDED))
    }

    /// With the curvature that it has just below [`ONSET`] up to the volume ratio `limit`.
    #[inline(always)]
    fn below(modulus: R, at: Invariants<R>, limit: R) -> Self {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let (onset, floor) = (R::splat(ONSET), R::splat(FLOOR));
        let j = one + at.j;
        let clamped = j.max(floor).min(onset);
        let (gap, inverse) = (onset - clamped, one.divide(clamped));
        let steep = R::splat(STRENGTH / ONSET) * (gap * inverse);
        let slope = -(steep * ((onset + clamped) * inverse));
        let h = steep * gap + slope * (j - floor).min(zero);
        let curved = (limit - j).positive() * (one - (floor - j).positive());
        let curvature = curved * (R::splat(2.0 * STRENGTH * ONSET) * (inverse * (inverse * inverse)));
        Self { slope: modulus, factor: [h, slope, curvature] }
    }

    /// First Piola-Kirchhoff stress, Pa.
    #[inline(always)]
    pub(crate) fn stress(&self, deformation: &Deformation<R>) -> [[R; 3]; 3] {
        let [h, dh, _] = self.factor;
        let p1 = (self.slope + self.slope) * h;
        let i1 = deformation.invariants.i + R::splat(3.0);
        deformation.stress(p1, p1 + self.slope * (dh * i1))
    }
}

/// Energy density in float64, J/m^3, from `I1 - 3` and `J - 1`.
pub(crate) fn energy_density<L: Law>(law: &L, i: f64, j: f64) -> f64 {
    if 1.0 + j >= f64::from(ONSET) {
        return 0.0;
    }
    let [h, ..] = factor(1.0 + j);
    f64::from(modulus(law)) * (i + 3.0) * h
}

/// `h`, `h'` and `h''` in float64, at `J`.
pub(crate) fn factor(j: f64) -> [f64; 3] {
    let (onset, floor, strength) = (f64::from(ONSET), f64::from(FLOOR), f64::from(STRENGTH));
    if j >= onset {
        return [0.0; 3];
    }
    let clamped = if j > floor { j } else { floor };
    let gap = onset - clamped;
    let slope = strength * (1.0 / onset - onset / (clamped * clamped));
    let h = strength * gap * gap / (onset * clamped) + slope * (j - clamped);
    [h, slope, if j > floor { 2.0 * strength * onset / (j * j * j) } else { 0.0 }]
}
