//! The inertia of a node for a step `D` (s) beyond its critical step. With `X = s D^2 / 4 sum_e D_a` (kg, from the
//! bounds `D_a` of `src/element/stiffness_bound.rs`) and the largest eigenvalue `lambda` of `X`:
//!
//! ```text
//! N = m I + (1 - m / lambda) X   if lambda > m,   m I if not
//! ```
//! `N >= X` and `N >= m I`. In directions in which the node is soft, `N` is almost its mass; a node that is stable
//! anyway gets no added inertia. The map is continuous in `X`, so inertia does not jump while the tissue moves.
//!
//! **Damping** acts on the true mass, at the middle of the step. With `k = mu D / 2` the residual is
//! `D^2 f - 2 k m du`, and it is divided by the inertia `N + k (1 + k) m`. This gives
//! `N (du+ - du) + k m (du+ + du) = D^2 f` for the nodes, and a margin for the lattice's part.
//!
//! **What is conserved while inertia changes.** With a lattice, velocities are kept, and with them all momentum; the
//! lattice's drag and the damper take what changes of inertia add. Without a lattice, smooth motion has the inertia of
//! the nodes too. As long as `N` is constant, a stable step conserves `1/2 v^T N v` plus strain energy, up to terms of
//! the order of the step. If `N` grew and shrank in turn with the velocity kept, that would add energy. So where `N`
//! grows, the velocity is scaled down to keep `v^T N v`. In slow motion this would damp too much, so half of the energy
//! that damping took meanwhile is given back ([`GIVEN_BACK`]); the sum of both is still a loss.

use crate::element::symmetric::Symmetric;
use crate::simd::Real;
use crate::step::Step;

/// Share of the energy taken by damping that a growing inertia may give back.
const GIVEN_BACK: f32 = 0.5;

/// Constants of a step, the same for all nodes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scaling {
    /// `s D^2 / 4`, s^2.
    pub(super) weight: f32,
    /// `k = mu D / 2`.
    pub(super) k: f32,
    /// Inertia added for damping, as a multiple of the mass: `k`, or `k (1 + k)` with a lattice.
    pub(super) reserve: f32,
    /// `2 mu` times the time of a cycle.
    pub(super) loss: f32,
    /// `s_c D^2 / 4`, s^2.
    pub(super) coarse_weight: f32,
}

/// `k = mu D / 2` of a step.
pub(super) fn half_damping(step: &Step) -> f32 {
    0.5 * step.damping() * step.seconds()
}

/// The new inertia of a vector of nodes.
pub(super) struct NewInertia<R> {
    /// `(N + reserve m)^-1` on the free axes, 1/kg.
    pub(super) inverse: Symmetric<R>,
    /// `N + reserve m` with zero rows at held axes, kg.
    pub(super) inertia: Symmetric<R>,
    /// Added inertia, mean over the three axes, as a multiple of the node's mass.
    pub(super) added: R,
}

/// The inverse of a matrix on the free axes, where `free` is positive; zeros at held axes.
#[inline(always)]
pub(super) fn inverse_on_free<R: Real>(mut matrix: Symmetric<R>, free: [R; 3]) -> Symmetric<R> {
    let (one, [x, y, z]) = (R::splat(1.0), free);
    matrix.xx = x.choose(matrix.xx, one);
    matrix.yy = y.choose(matrix.yy, one);
    matrix.zz = z.choose(matrix.zz, one);
    matrix.inverse().on_free(free)
}

/// The inertia from the summed bounds (N/m) of the nodes' elements; `free` is positive along free axes.
#[inline(always)]
pub(super) fn new_inertia<R: Real>(free: [R; 3], mass: R, stiffness: Symmetric<R>, scaling: &Scaling) -> NewInertia<R> {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let needed = stiffness.scaled(R::splat(scaling.weight)).on_free(free);
    let largest = needed.largest_eigenvalue();
    let factor = (largest - mass).choose(one - mass.divide(largest), zero);
    let scaled = needed.scaled_plus(factor, mass).on_free(free);
    let added = (factor * needed.trace()).divide(R::splat(3.0) * mass);
    let inertia = scaled.scaled_plus(one, R::splat(scaling.reserve) * mass).on_free(free);
    let inverse = inverse_on_free(inertia, free);
    NewInertia { inverse, inertia, added }
}

/// `v^T A v`.
#[inline(always)]
fn quadratic_form<R: Real>(matrix: &Symmetric<R>, v: [R; 3]) -> R {
    let [x, y, z] = matrix.times(v);
    x * v[0] + y * v[1] + z * v[2]
}

/// The factor by which the velocities of a vector of nodes are scaled down where their inertia grows, from the inverse
/// in use so far and the velocity in its frame, and from the new inertia and the velocity in that frame.
#[inline(always)]
pub(super) fn velocity_factor<R: Real>(
    free: [R; 3],
    mass: R,
    (old_inverse, old_velocity): (Symmetric<R>, [R; 3]),
    (inertia, velocity): (&Symmetric<R>, [R; 3]),
    scaling: &Scaling,
) -> R {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let old_inertia = inverse_on_free(old_inverse, free);
    let mut square = zero;
    for axis in 0..3 {
        square = square + free[axis].choose(velocity[axis] * velocity[axis], zero);
    }
    let reserve = R::splat(scaling.reserve) * mass * square;
    let energy = quadratic_form(inertia, velocity) - reserve;
    let old_energy = quadratic_form(&old_inertia, old_velocity) - reserve;
    // Allowed beyond the old energy: rounding, and a share of what damping took.
    let given_back = R::splat(GIVEN_BACK * scaling.loss) * mass * square;
    let excess = energy - (old_energy * R::splat(1.0 + 1e-5) + given_back);
    let allowed = (old_energy + given_back).divide(energy).max(zero).root();
    excess.choose(energy.choose(allowed, one), one)
}
