//! The inertia of a node for a step `D` beyond its limit. With `X = s D^2 / 4 sum_e D_a` (kg, from
//! [`super::bound`]) and `lambda` its largest eigenvalue:
//!
//! ```text
//! N = m I + (1 - m / lambda) X   if lambda > m,   m I if not
//! ```
//! `N >= X` and `N >= m I`: directions in which the node is soft keep almost their mass, and a node that needs nothing gets
//! nothing. The map is smooth in `X`, so inertia does not jump while the tissue moves.
//!
//! **Damping** keeps the true mass, at the middle of the step: with `k = mu D / 2` the residual is
//! `D^2 f - 2 k m du`, and the inertia `N + k (1 + k) m` that it is divided by makes the step
//! `N (du+ - du) + k m (du+ + du) = D^2 f` for the nodes and leaves room for what the lattice adds.
//!
//! **What is conserved while inertia changes.** A stable step keeps `1/2 v^T N v` plus strain energy up to
//! terms of the step's order, as long as `N` is constant. When `N` grows under a node that moves, neither
//! momentum nor velocity may simply be kept: growing and shrinking in turn would pump energy in. So the velocity
//! is scaled down until `v^T N v` is what it was: energy never grows by a change of inertia. When `N`
//! shrinks the velocity is kept. In slow motion the scaling would brake more than it protects; half of what damping takes
//! meanwhile is therefore given back ([`GIVEN_BACK`]), which keeps the sum of both a loss.

use crate::lanes::Real;
use crate::symmetric::Symmetric;

/// Share of the energy that damping takes which a growing inertia may give back.
const GIVEN_BACK: f32 = 0.5;

/// Constants of a step for all nodes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scaling {
    /// `s D^2 / 4`, s^2.
    pub(super) weight: f32,
    /// `k = mu D / 2`.
    pub(super) k: f32,
    /// Times the mass is added for damping: `k`, and `k (1 + k)` with a lattice.
    pub(super) reserve: f32,
    /// `2 mu` times the time since the inertia was last computed.
    pub(super) loss: f32,
    /// `s_c D^2 / 4`, s^2.
    pub(super) coarse_weight: f32,
}

/// What became of nodes side by side.
pub(super) struct Renewed<R> {
    /// `(N + reserve m)^-1` on the free axes, 1/kg.
    pub(super) inverse: Symmetric<R>,
    /// `N + reserve m` with zero rows at held axes, kg.
    pub(super) inertia: Symmetric<R>,
    /// What the velocity has to be multiplied by.
    pub(super) velocity: R,
    /// Mean added inertia over the three axes, in masses of the node.
    pub(super) added: R,
}

#[inline(always)]
fn form<R: Real>(matrix: &Symmetric<R>, v: [R; 3]) -> R {
    let [x, y, z] = matrix.times(v);
    x * v[0] + y * v[1] + z * v[2]
}

/// A diagonal of ones where the axis is held, so that the rest can be inverted.
#[inline(always)]
fn with_held<R: Real>(mut matrix: Symmetric<R>, [x, y, z]: [R; 3]) -> Symmetric<R> {
    let one = R::splat(1.0);
    matrix.xx = x.choose(matrix.xx, one);
    matrix.yy = y.choose(matrix.yy, one);
    matrix.zz = z.choose(matrix.zz, one);
    matrix
}

/// The inertia from the summed bounds (N/m) of the nodes' elements; `free` is positive along free axes. `old` is the inverse
/// in use so far and the velocity in its frame, nothing at the start.
#[inline(always)]
pub(super) fn renew<R: Real>(
    free: [R; 3],
    mass: R,
    stiffness: Symmetric<R>,
    old: Option<(Symmetric<R>, [R; 3])>,
    velocity: [R; 3],
    scaling: &Scaling,
) -> Renewed<R> {
    let (zero, one) = (R::splat(0.0), R::splat(1.0));
    let needed = stiffness.scaled(R::splat(scaling.weight)).on_free(free);
    let largest = needed.largest_eigenvalue();
    let factor = (largest - mass).choose(one - mass.over(largest), zero);
    let scaled = needed.scaled_plus(factor, mass).on_free(free);
    let added = (factor * needed.trace()).over(R::splat(3.0) * mass);
    let reserve = R::splat(scaling.reserve) * mass;

    let mut keep = one;
    if let Some((old, old_velocity)) = old {
        // The inertia before, from the inverse that was in use.
        let before = with_held(old, free).inverse().on_free(free);
        let mut square = zero;
        for axis in 0..3 {
            square = square + free[axis].choose(velocity[axis] * velocity[axis], zero);
        }
        let energy = form(&scaled, velocity);
        let had = form(&before, old_velocity) - reserve * square;
        // What rounding may be, and what damping takes.
        let given = R::splat(GIVEN_BACK * scaling.loss) * mass * square;
        let more = energy - (had * R::splat(1.0 + 1e-5) + given);
        let allowed = (had + given).over(energy).max(zero).root();
        keep = more.choose(energy.choose(allowed, one), one);
    }
    let inertia = scaled.scaled_plus(one, reserve).on_free(free);
    let inverse = with_held(inertia, free).inverse().on_free(free);
    Renewed { inverse, inertia, velocity: keep, added }
}
