//! An upper bound of an element's tangent stiffness, without iteration and for every state, inverted elements included:
//! `dF:A:dF <= iso |dF|^2 + volume (C:dF)^2` (Pa), with `A = dP/dF` and `C = cof F`.
//!
//! With `P = p1 F + pJ C`, `E = F - C` (zero at rest), `e = E:dF`, `c = C:dF`:
//!
//! ```text
//! dF:A:dF = p1 |dF|^2 + pJ dF:(dC/dF):dF                                     geometric
//!         + (U'' + W' (4 g' + g'' I1)) c^2 + 4 W' g' c e + W'' (xf e + (xf + xc) c)^2
//! xf = 2 g,  xc = g' I1
//! ```
//! **Geometric part.** The extreme eigenvalues of the map `dF -> dC` are roots of `m^3 - I1 m - 2 J = 0`. With
//! `q = I1 / 3` and `m = r sqrt q`, the largest `r` is a concave function of `J / q^(3/2)`. So it is below the tangents
//! of that function, here those at `r = 2` (F a multiple of a rotation) and at `r = 5/4` (F nearly a multiple of a
//! reflection). The smallest eigenvalue is minus the largest at `-J`. So the geometric part is at most
//! `p1 + min(16/9 t + 2/9 u, 125/54 t + 32/27 u)` with `t = |pJ| sqrt q`, `u = pJ J / q`. At rest this is 2.13 p1; the
//! exact value is 2 p1.
//!
//! **Other terms**, `q_cc c^2 + 2 q_ce c e + q_ee e^2`. The mixed term is split by
//! `2 |q_ce c e| <= eta c^2 + q_ce^2 / eta e^2`, and `e^2 <= |E|^2 |dF|^2`. The value `eta = 4/5 |q_ce| |E| / |C|` is
//! near the optimum. Where `E` is small, `eta` is at least a fiftieth of the volume stiffness, which adds little to
//! `volume` and keeps the contribution to `iso` small.
//!
//! **A bound that rotations do not feel**, for the motion of a lattice. With `L = dF F^-1 = D + Omega`, `b = F F^T` and
//! the Kirchhoff stress `tau = p1 b + pJ J I`, of which `t` is the largest eigenvalue, the geometric part is
//! `p1 tr(L b L^T) + pJ J ((tr L)^2 - tr L^2)`. In the principal axes of `b` each pair of axes has the quadratic form
//!
//! ```text
//! d^2 (tau_i + tau_j - 4 pJ J) + w^2 (tau_i + tau_j) + 2 (tau_j - tau_i) d w      d = D_ij, w = Omega_ij
//! ```
//! and `2 |d w| <= d^2 + w^2` gives `(t - 2 pJ J) |D|^2 + max(t, 0) |Omega|^2 + pJ J (tr D)^2`. A rotation of an
//! element without tension costs nothing. The other terms have `c = J tr D` and `e = (b - J I):D`, and are split as
//! above. At rest this is exactly linear elasticity. In a crushed element `F^-1` is too large: there the first bound is
//! used.
//!
//! **Scalar bound.** Between refreshes a step only needs to know how far stiffness has grown. It uses a value (N/m)
//! that no eigenvalue of the four matrices exceeds, and that takes neither roots nor divisions:
//!
//! ```text
//! V lambda_G (p1 + |pJ| (I1 + 3) / 3 + (q_ee + 5/4 |q_ce|) |E|^2 + (3/2 (q_cc + floor) + 5/4 |q_ce|) |C|^2)
//! ```
//! with 0 in place of a negative `q_cc`, and with the least `eta` as `floor`. Proof: `|J| <= q^(3/2)`, so the geometric
//! part without `p1` is at most `2 |pJ| sqrt q <= |pJ| (q + 1)`. `x_a sum_b x_b <= 3/2 sum_b x_b^2` for four values, so
//! the largest eigenvalue is at most `V lambda_G (iso + 3/2 volume |C|^2)`. The two parts of the mixed term add up to
//! at most `(5/4 + 3/2 4/5) |q_ce| |E| |C| + 3/2 floor |C|^2`. `|C|^2` and `|E|^2` are bounded by the invariants.

use crate::material::{Invariants, Law, LawState};
use crate::simd::Real;

use super::ElementTile;
use super::barrier::Barrier;
use super::deformation::Deformation;
use super::internal_forces::ElementVisitor;

/// The parts of the bound that depend on the invariants alone, Pa.
#[derive(Clone, Copy)]
pub(super) struct Coefficients<R> {
    /// `p1` and `pJ`.
    p1: R,
    p_j: R,
    /// `q_cc`, `q_ce`, `q_ee`.
    cc: R,
    ce: R,
    ee: R,
    /// The least `eta`.
    floor: R,
}

/// The least `eta`, divided by the volume stiffness.
const FLOOR: f32 = 0.02;

/// `eta |C| / (|q_ce| |E|)`.
const SPLIT: f32 = 0.8;

/// Lower limit of `|C|^2` and `I1 / 3` where they are divisors.
const LEAST: f32 = 1e-6;

/// The same for the bound that rotations do not feel: near the optimum, as `(tr D)^2 <= 3 |D|^2`.
const SPATIAL_SPLIT: f32 = 0.6;

/// Upper bound of `x_a sum_b x_b` over the sum of the squares of four values.
const WEIGHT: f32 = 1.5;

/// Half of `1 / SPLIT + WEIGHT SPLIT`, rounded up.
const MIXED: f32 = 1.25;

impl<R: Real> Coefficients<R> {
    #[inline(always)]
    pub(super) fn new<L: Law>(law: &L::Wide<R>, local: &LawState<R>) -> Self {
        let four = R::splat(4.0);
        let at = local.at;
        let i1 = at.i + R::splat(3.0);
        let (slope, stiffening, [g, dg, ddg]) = (local.slope, local.stiffening::<L>(law), local.volume_factor());
        let (x_f, x_c) = (g + g, dg * i1);
        let along = x_f + x_c;
        let bulk = local.bulk;
        let p1 = slope * x_f;
        let p_j = slope.fused(x_c, local.pressure);

        let (stiff_c, stiff_f) = (stiffening * along, stiffening * x_f);
        let cc = stiff_c.fused(along, slope.fused(ddg.fused(i1, four * dg), bulk));
        let ce = stiff_f.fused(along, slope * (dg + dg));
        let ee = stiff_f * x_f;
        Self { p1, p_j, cc, ce, ee, floor: R::splat(FLOOR) * (bulk + p1 + ce.abs()) }
    }

    /// Of crushed elements with nodal strain.
    #[inline(always)]
    pub(super) fn of_barrier(barrier: &Barrier<R>, at: Invariants<R>) -> Self {
        let (slope, [h, dh, ddh]) = (barrier.slope, barrier.factor);
        let i1 = at.i + R::splat(3.0);
        let (p1, ce) = (slope * (h + h), slope * (dh + dh));
        let cc = slope * ddh.fused(i1, R::splat(4.0) * dh);
        // Not zero where nothing is crushed yet, as it is a divisor.
        let floor = (R::splat(FLOOR) * (p1 + ce.abs())).max(R::splat(f32::MIN_POSITIVE));
        Self { p1, p_j: slope * dh * i1, cc, ce, ee: R::splat(0.0), floor }
    }

    /// With `modulus |dF|^2` taken off.
    #[inline(always)]
    pub(super) fn less(self, modulus: R) -> Self {
        Self { p1: self.p1 - modulus, ..self }
    }

    /// Bound of the geometric part, Pa.
    #[inline(always)]
    fn geometric(&self, at: Invariants<R>) -> R {
        // Raising q is safe: the roots grow with it.
        let q = (at.i * R::splat(1.0 / 3.0) + R::splat(1.0)).max(R::splat(LEAST));
        let (t, u) = (self.p_j.abs() * q.root(), (self.p_j + self.p_j * at.j).divide(q));
        let sphere = R::splat(16.0 / 9.0) * t + R::splat(2.0 / 9.0) * u;
        let inverted = R::splat(125.0 / 54.0) * t + R::splat(32.0 / 27.0) * u;
        self.p1 + sphere.min(inverted)
    }

    /// `iso` and `volume`, Pa.
    #[inline(always)]
    pub(super) fn bound(&self, deformation: &Deformation<R>) -> (R, R) {
        let [distortion, cofactor] = squares(deformation);
        self.split(deformation.invariants, distortion, cofactor)
    }

    /// The same from `distortion` `|E|^2` and `cofactor` `|C|^2`.
    #[inline(always)]
    fn split(&self, at: Invariants<R>, distortion: R, cofactor: R) -> (R, R) {
        let ratio = distortion.divide(cofactor.max(R::splat(LEAST))).root();
        let eta = (R::splat(SPLIT) * self.ce.abs() * ratio).max(self.floor);
        // ce / eta first: ce^2 may overflow where the law is at its cap.
        let mixed = self.ce * self.ce.divide(eta);
        (self.geometric(at) + (self.ee + mixed) * distortion, (self.cc + eta).max(R::splat(0.0)))
    }
}

/// An upper bound (N/m) of the eigenvalues of an element's four matrices, from the invariants `i = I1 - 3` and
/// `j = J - 1` alone: `|C|^2 <= I1^2 / 3`, and with it `|E|^2 = I1 + |C|^2 - 6 J`. `scale` (m) is `V lambda_G`.
#[inline(always)]
pub(super) fn scalar_bound<R: Real>(coefficients: &Coefficients<R>, at: Invariants<R>, scale: R) -> R {
    let (zero, third) = (R::splat(0.0), R::splat(1.0 / 3.0));
    let i1 = at.i + R::splat(3.0);
    let cofactor = i1 * i1 * third;
    let distortion = (i1 + cofactor) - R::splat(6.0) * (at.j + R::splat(1.0));
    let &Coefficients { p1, p_j, cc, ce, ee, floor } = coefficients;
    let geometric = p_j.abs().fused(i1.fused(third, R::splat(1.0)), p1);
    let rest = ee.fused(distortion, geometric);
    let rest = (R::splat(MIXED) * ce.abs()).fused(distortion + cofactor, rest);
    scale * (R::splat(WEIGHT) * (cc.max(zero) + floor)).fused(cofactor, rest)
}

/// `V lambda_G` of the elements from place `first` of a tile on, m.
#[inline(always)]
pub(super) fn scale_of<R: Real>(tile: &ElementTile, first: usize) -> R {
    tile.volume::<R>(first) * tile.gradient_eigenvalue::<R>(first)
}

/// `|E|^2` and `|C|^2`.
#[inline(always)]
fn squares<R: Real>(deformation: &Deformation<R>) -> [R; 2] {
    let [mut distortion, mut cofactor] = [R::splat(0.0); 2];
    for i in 0..3 {
        for j in 0..3 {
            let (e, c) = (deformation.distortion(i, j), deformation.cofactor(i, j));
            distortion = distortion + e * e;
            cofactor = cofactor + c * c;
        }
    }
    [distortion, cofactor]
}

/// The bound that rotations do not feel, Pa: of `|D|^2`, `(tr D)^2` and `|L|^2`, with `L = dF F^-1` and `D` its
/// symmetric part.
#[derive(Clone, Copy)]
pub(super) struct SpatialBound<R> {
    pub(super) shear: R,
    pub(super) volume: R,
    pub(super) stress: R,
}

/// The scalar bound of patches with nodal strain, N/m^3 for each length of `c_ab`: as there are fewer of them than
/// elements, a close one, `scale (iso + volume |C|^2)`, with `scale` in m. `coefficients` are without the stabilising
/// energy.
#[inline(always)]
pub(super) fn scalar_bound_of_patches<R: Real>(
    coefficients: &Coefficients<R>,
    deformation: &Deformation<R>,
    scale: R,
) -> R {
    let [distortion, cofactor] = squares(deformation);
    let (iso, volume) = coefficients.split(deformation.invariants, distortion, cofactor);
    scale * volume.fused(cofactor, iso.max(R::splat(0.0)))
}

/// The bound that rotations do not feel; only for elements that are not crushed.
#[inline(always)]
pub(super) fn spatial_bound<R: Real>(coefficients: &Coefficients<R>, deformation: &Deformation<R>) -> SpatialBound<R> {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let &Coefficients { p1, p_j, cc, ce, ee, .. } = coefficients;
    let volume_ratio = one + deformation.invariants.j;
    let b = deformation.left_cauchy_green();
    let pressure = p_j * volume_ratio;
    let tension = p1.fused(b.largest_eigenvalue(), pressure);
    let stress = tension.max(zero);
    let difference = b.scaled_plus(one, -volume_ratio);
    let square = difference.xx * difference.xx
        + difference.yy * difference.yy
        + difference.zz * difference.zz
        + R::splat(2.0)
            * (difference.xy * difference.xy + difference.yz * difference.yz + difference.zx * difference.zx);
    let mixed = ce.abs() * square.root() * volume_ratio;
    let shear = ((tension - stress) - (pressure + pressure)).max(zero);
    SpatialBound {
        shear: shear + ee * square + R::splat(1.0 / SPATIAL_SPLIT) * mixed,
        volume: (pressure + cc * volume_ratio * volume_ratio + R::splat(SPATIAL_SPLIT) * mixed).max(zero),
        stress,
    }
}

/// Adds [`scalar_bound`] to the fourth component of the forces of each element's nodes.
#[derive(Clone, Copy)]
pub struct ScalarBound;

impl ElementVisitor for ScalarBound {
    #[inline(always)]
    fn bounds(&self) -> bool {
        true
    }

    #[inline(always)]
    fn visit<R: Real, L: Law>(
        &mut self,
        law: &L::Wide<R>,
        tile: &ElementTile,
        first: usize,
        _: &Deformation<R>,
        local: &LawState<R>,
    ) -> R {
        scalar_bound(&Coefficients::<R>::new::<L>(law, local), local.at, scale_of(tile, first))
    }
}

/// The same if it is true, else nothing: known at run time, so that loops that are seldom used are compiled once.
#[derive(Clone, Copy)]
pub(crate) struct MaybeBound(pub(crate) bool);

impl ElementVisitor for MaybeBound {
    #[inline(always)]
    fn bounds(&self) -> bool {
        self.0
    }

    #[inline(always)]
    fn visit<R: Real, L: Law>(
        &mut self,
        law: &L::Wide<R>,
        tile: &ElementTile,
        first: usize,
        deformation: &Deformation<R>,
        local: &LawState<R>,
    ) -> R {
        if self.0 { ScalarBound.visit::<R, L>(law, tile, first, deformation, local) } else { R::splat(0.0) }
    }
}
