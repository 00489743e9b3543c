//! A bound of an element's tangent stiffness that takes no iteration and holds for every state, inverted
//! elements included: `dF:A:dF <= iso |dF|^2 + volume (C:dF)^2`, with `A = dP/dF` and `C = cof F`.
//!
//! With `P = p1 F + pJ C`, `E = F - C` (zero at rest), `e = E:dF`, `c = C:dF`:
//!
//! ```text
//! dF:A:dF = p1 |dF|^2 + pJ dF:(dC/dF):dF                                     geometric
//!         + (U'' + W' (4 g' + g'' I1)) c^2 + 4 W' g' c e + W'' (xf e + (xf + xc) c)^2
//! xf = 2 g,  xc = g' I1
//! ```
//! The map `dF -> dC` has eigenvalues of at most `2 / sqrt 3 |F|` (its trace is zero and the trace of its
//! square `4 |F|^2`), and `sqrt I1 <= (I1 + 3) / (2 sqrt 3)`: so the geometric part is at most
//! `p1 + |pJ| (I1 + 3) / 3`. In the rest, `q_cc c^2 + 2 q_ce c e + q_ee e^2`, the mixed term is split by
//! `2 c e <= eta / q c^2 + q / eta e^2`, and `e^2 <= |E|^2 |dF|^2`. `eta`, a fiftieth of the volume stiffness, adds
//! as much to `volume` and keeps the share of `iso` small while `E` is.
//!
//! With `dF = sum_a v_a (x) ga` and `(sum of four)^2 <= 4 sum of squares`, the element's tangent is at most
//! block diagonal, one 3 x 3 matrix (N/m) a node:
//!
//! ```text
//! D_a = V (iso lambda_G I + 4 volume (C ga)(C ga)^T),   lambda_G = lambda_max(sum_a ga ga^T)
//! ```

use crate::lanes::{Real, Scatter};
use crate::material::{Law, Potential, VolumeFactor};
use crate::scene::ElementBlock;
use crate::tled::{Beside, Deformation};

/// `iso` and `volume` of a chunk of elements, Pa.
#[derive(Clone, Copy)]
pub(super) struct Bound<R> {
    pub(super) iso: R,
    pub(super) volume: R,
    /// `|C|^2`.
    cofactor_square: R,
}

/// `eta` over the volume stiffness.
const SPLIT: f32 = 0.02;

impl<R: Real> Bound<R> {
    #[inline(always)]
    pub(super) fn new<L: Law>(law: &L::Wide<R>, deformation: &Deformation<R>) -> Self {
        let at = deformation.invariants;
        let (zero, two, four) = (R::splat(0.0), R::splat(2.0), R::splat(4.0));
        let i1 = at.i + R::splat(3.0);
        let (slope, stiffening, g, dg, ddg) = if L::ISOCHORIC {
            let factor = VolumeFactor::new(at);
            (
                law.distortion_slope(factor.x),
                law.distortion_curvature(factor.x),
                factor.g,
                factor.slope,
                factor.curvature(),
            )
        } else {
            (law.distortion_slope(at.i), law.distortion_curvature(at.i), R::splat(1.0), zero, zero)
        };
        let stiffening = stiffening.max(zero);
        let (x_f, x_c) = (two * g, dg * i1);
        let along = x_f + x_c;
        let bulk = law.volume_curvature(at.j);
        let p1 = two * slope * g;
        let p_j = law.volume_slope(at.j) + slope * x_c;

        let cc = bulk + slope * (four * dg + ddg * i1) + stiffening * along * along;
        let ce = two * slope * dg + stiffening * x_f * along;
        let ee = stiffening * x_f * x_f;
        let eta = R::splat(SPLIT) * (bulk + p1 + ce.abs());
        let (mut distortion, mut cofactor) = (zero, zero);
        for i in 0..3 {
            for j in 0..3 {
                let (e, c) = (deformation.distortion(i, j), deformation.cofactor(i, j));
                distortion = distortion + e * e;
                cofactor = cofactor + c * c;
            }
        }
        // ce / eta first: its square may be beyond float32 where the law is at its cap.
        let mixed = ce * ce.zip(eta, |ce, eta| ce / eta);
        let geometric = p1 + p_j.abs() * (i1 + R::splat(3.0)) * R::splat(1.0 / 3.0);
        Self {
            iso: geometric + (ee + mixed) * distortion,
            volume: (cc + eta).max(zero),
            cofactor_square: cofactor,
        }
    }

    /// A number (N/m) that no eigenvalue of the element's four matrices exceeds.
    #[inline(always)]
    fn scalar(&self, block: &ElementBlock, first: usize) -> R {
        let spread = block.volume::<R>(first) * block.spread::<R>(first);
        spread * (self.iso + R::splat(4.0) * self.volume * self.cofactor_square)
    }
}

/// Puts the scalar bound of each element into the fourth component of its nodes' forces.
pub(super) struct ScalarBeside;

impl Beside for ScalarBeside {
    #[inline(always)]
    fn see<R: Real, L: Law>(
        &mut self,
        law: &L::Wide<R>,
        block: &ElementBlock,
        first: usize,
        deformation: &Deformation<R>,
    ) -> R {
        Bound::<R>::new::<L>(law, deformation).scalar(block, first)
    }
}

/// Adds the matrices `D_a` of each element to the sums of its nodes: `xx, yy, zz` with the scalar bound as
/// fourth number, and `xy, yz, zx`.
pub(super) struct MatrixBeside<'a> {
    pub(super) diagonal: Scatter<'a>,
    pub(super) beside: Scatter<'a>,
}

impl Beside for MatrixBeside<'_> {
    #[inline(always)]
    fn see<R: Real, L: Law>(
        &mut self,
        law: &L::Wide<R>,
        block: &ElementBlock,
        first: usize,
        deformation: &Deformation<R>,
    ) -> R {
        self.add(&Bound::<R>::new::<L>(law, deformation), block, first, deformation)
    }
}

impl MatrixBeside<'_> {
    #[inline(always)]
    pub(super) fn add<R: Real>(
        &mut self,
        bound: &Bound<R>,
        block: &ElementBlock,
        first: usize,
        deformation: &Deformation<R>,
    ) -> R {
        let scalar = bound.scalar(block, first);
        let volume = block.volume::<R>(first);
        let isotropic = volume * bound.iso * block.spread::<R>(first);
        let weight = volume * bound.volume * R::splat(4.0);
        let mut images = [[R::splat(0.0); 3]; 4];
        for corner in 0..3 {
            let gradient = [0, 1, 2].map(|axis| block.gradient::<R>(corner, axis, first));
            for i in 0..3 {
                let c = |j: usize| deformation.cofactor(i, j);
                images[corner + 1][i] = c(0) * gradient[0] + c(1) * gradient[1] + c(2) * gradient[2];
                images[0][i] = images[0][i] - images[corner + 1][i];
            }
        }
        for (corner, [x, y, z]) in images.into_iter().enumerate() {
            let node = |lane: usize| block.node(corner, first + lane);
            let (wx, wy, wz) = (weight * x, weight * y, weight * z);
            let diagonal = [isotropic + wx * x, isotropic + wy * y, isotropic + wz * z, scalar];
            self.diagonal.add_lanes(node, diagonal);
            self.beside.add_lanes(node, [wx * y, wy * z, wz * x, R::splat(0.0)]);
        }
        scalar
    }
}
