//! The inertia of a node for a step `D` (s) beyond its critical step, with the scalar bound `b` (N/m) of the stiffness of
//! its elements, which each force pass computes:
//!
//! ```text
//! N = max(m, s D^2 / 4 rho b)       rho = m lambda / b at rest
//! ```
//! `lambda` (1/s^2) is the largest eigenvalue of the node's matrix in the bound of [`crate::tled::critical_step`], which
//! is a close one, and takes longer; `rho` is at most one where the scalar bound is the wider one.
//!
//! **Damping** acts on the true mass, at the middle of the step. With `k = mu D / 2` the residual is `D^2 f - 2 k m du`,
//! and it is divided by the inertia `N + k (1 + k) m`. This gives `N (du+ - du) + k m (du+ + du) = D^2 f` for the nodes,
//! and a margin for the lattice's part.

use crate::simd::Real;
use crate::step::Step;

/// Constants of a step, the same for all nodes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scaling {
    /// `s D^2 / 4`, s^2.
    pub(super) weight: f32,
    /// `k = mu D / 2`.
    pub(super) k: f32,
    /// Inertia added for damping, as a multiple of the mass: `k (1 + k)`.
    pub(super) reserve: f32,
    /// `s_c D^2 / 4`, s^2.
    pub(super) coarse_weight: f32,
}

/// `k = mu D / 2` of a step.
pub(super) fn half_damping(step: &Step) -> f32 {
    0.5 * step.damping() * step.seconds()
}

impl Scaling {
    /// `N + k (1 + k) m` of nodes with these masses (kg) and closer bounds `rho b`, N/m.
    #[inline(always)]
    pub(super) fn inertia<R: Real>(&self, mass: R, bound: R) -> R {
        (R::splat(self.weight) * bound).max(mass) + R::splat(self.reserve) * mass
    }

    /// What a node does of a motion by itself, `t = (1 + k) m / N`.
    #[inline(always)]
    pub(super) fn own_share<R: Real>(&self, mass: R, inertia: R) -> R {
        (R::splat(1.0 + self.k) * mass).divide(inertia)
    }
}
