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
use crate::material::{Law, Local, Potential};
use crate::scene::ElementBlock;
use crate::tled::{Beside, Deformation};

/// The parts of the bound that depend on the invariants alone, Pa: `iso = geometric + stiffening |E|^2`.
#[derive(Clone, Copy)]
struct Coefficients<R> {
    geometric: R,
    stiffening: R,
    volume: R,
}

/// `eta` over the volume stiffness.
const SPLIT: f32 = 0.02;

impl<R: Real> Coefficients<R> {
    #[inline(always)]
    fn new<L: Law>(law: &L::Wide<R>, local: &Local<R>) -> Self {
        let (zero, two, four) = (R::splat(0.0), R::splat(2.0), R::splat(4.0));
        let at = local.at;
        let i1 = at.i + R::splat(3.0);
        let (slope, stiffening, [g, dg, ddg]) =
            (local.slope, local.stiffening::<L>(law), local.volume_factor());
        let (x_f, x_c) = (two * g, dg * i1);
        let along = x_f + x_c;
        let bulk = law.volume_curvature(at.j);
        let p1 = two * slope * g;
        let p_j = law.volume_slope(at.j) + slope * x_c;

        let cc = bulk + slope * (four * dg + ddg * i1) + stiffening * along * along;
        let ce = two * slope * dg + stiffening * x_f * along;
        let ee = stiffening * x_f * x_f;
        let eta = R::splat(SPLIT) * (bulk + p1 + ce.abs());
        // ce / eta first: its square may be beyond float32 where the law is at its cap.
        let mixed = ce * ce.over(eta);
        Self {
            geometric: p1 + p_j.abs() * (i1 + R::splat(3.0)) * R::splat(1.0 / 3.0),
            stiffening: ee + mixed,
            volume: (cc + eta).max(zero),
        }
    }
}

/// A number (N/m) that no eigenvalue of an element's four matrices exceeds, from the invariants `i = I1 - 3` and
/// `j = J - 1` alone: `|C|^2 <= I1^2 / 3`, and `|E|^2 = I1 + |C|^2 - 6 J` with it.
#[inline(always)]
fn scalar_bound<R: Real, L: Law>(
    law: &L::Wide<R>,
    block: &ElementBlock,
    first: usize,
    local: &Local<R>,
) -> R {
    let coefficients = Coefficients::<R>::new::<L>(law, local);
    let (at, three) = (local.at, R::splat(3.0));
    let square = at.i * at.i * R::splat(1.0 / 3.0);
    let cofactor = three + (at.i + at.i) + square;
    let distortion = three * at.i + square - R::splat(6.0) * at.j;
    let iso = coefficients.geometric + coefficients.stiffening * distortion.max(R::splat(0.0));
    let spread = block.volume::<R>(first) * block.spread::<R>(first);
    spread * (iso + R::splat(4.0) * coefficients.volume * cofactor)
}

/// `iso` and `volume` of a chunk of elements, Pa.
#[derive(Clone, Copy)]
pub(super) struct Bound<R> {
    pub(super) iso: R,
    pub(super) volume: R,
    /// [`scalar_bound`], N/m.
    scalar: R,
}

impl<R: Real> Bound<R> {
    #[inline(always)]
    pub(super) fn new<L: Law>(
        law: &L::Wide<R>,
        block: &ElementBlock,
        first: usize,
        deformation: &Deformation<R>,
        local: &Local<R>,
    ) -> Self {
        let coefficients = Coefficients::<R>::new::<L>(law, local);
        let mut distortion = R::splat(0.0);
        for i in 0..3 {
            for j in 0..3 {
                let e = deformation.distortion(i, j);
                distortion = distortion + e * e;
            }
        }
        Self {
            iso: coefficients.geometric + coefficients.stiffening * distortion,
            volume: coefficients.volume,
            scalar: scalar_bound::<R, L>(law, block, first, local),
        }
    }
}

/// Puts [`scalar_bound`] into the fourth component of the forces of the elements' nodes.
pub(super) struct ScalarBeside;

impl Beside for ScalarBeside {
    #[inline(always)]
    fn see<R: Real, L: Law>(
        &mut self,
        law: &L::Wide<R>,
        block: &ElementBlock,
        first: usize,
        _: &Deformation<R>,
        local: &Local<R>,
    ) -> R {
        scalar_bound::<R, L>(law, block, first, local)
    }
}

/// Adds the matrices `D_a` of each element to the sums of its nodes: `xx, yy, zz` with [`scalar_bound`] as
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
        local: &Local<R>,
    ) -> R {
        let bound = Bound::<R>::new::<L>(law, block, first, deformation, local);
        self.add(&bound, block, first, &cofactor(deformation))
    }
}

/// `C` by rows.
#[inline(always)]
pub(super) fn cofactor<R: Real>(deformation: &Deformation<R>) -> [[R; 3]; 3] {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| deformation.cofactor(i, j)))
}

impl MatrixBeside<'_> {
    /// `cofactor` may be turned into another frame.
    #[inline(always)]
    pub(super) fn add<R: Real>(
        &mut self,
        bound: &Bound<R>,
        block: &ElementBlock,
        first: usize,
        cofactor: &[[R; 3]; 3],
    ) -> R {
        let volume = block.volume::<R>(first);
        let isotropic = volume * bound.iso * block.spread::<R>(first);
        let weight = volume * bound.volume * R::splat(4.0);
        let mut images = [[R::splat(0.0); 3]; 4];
        for corner in 0..3 {
            let gradient = [0, 1, 2].map(|axis| block.gradient::<R>(corner, axis, first));
            for i in 0..3 {
                let c = &cofactor[i];
                images[corner + 1][i] = c[0] * gradient[0] + c[1] * gradient[1] + c[2] * gradient[2];
                images[0][i] = images[0][i] - images[corner + 1][i];
            }
        }
        for (corner, [x, y, z]) in images.into_iter().enumerate() {
            let node = |lane: usize| block.node(corner, first + lane);
            let (wx, wy, wz) = (weight * x, weight * y, weight * z);
            let diagonal = [isotropic + wx * x, isotropic + wy * y, isotropic + wz * z, bound.scalar];
            self.diagonal.add_lanes(node, diagonal);
            self.beside.add_lanes(node, [wx * y, wy * z, wz * x, R::splat(0.0)]);
        }
        bound.scalar
    }
}
