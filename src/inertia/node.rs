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

use crate::scene::NodeInertia;
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

/// A node's inertia as it is used.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Node {
    /// `(N + reserve m)^-1` on the free axes, 1/kg.
    pub(super) inverse: Symmetric,
    /// Share of it in use: below one where a node is held back.
    pub(super) share: f32,
}

/// What became of a node.
pub(super) struct Renewed {
    pub(super) inverse: Symmetric,
    /// `N + reserve m` with zero rows at held axes, kg.
    pub(super) inertia: Symmetric,
    /// What the velocity has to be multiplied by.
    pub(super) velocity: f32,
    /// Mean added inertia over the three axes, in masses of the node.
    pub(super) added: f32,
}

fn form(matrix: &Symmetric, v: [f32; 3]) -> f32 {
    let [x, y, z] = matrix.times(v);
    x * v[0] + y * v[1] + z * v[2]
}

/// A diagonal of ones where the axis is held, so that the rest can be inverted.
fn with_held(mut matrix: Symmetric, inverse: [f32; 3]) -> Symmetric {
    for (entry, inverse) in [&mut matrix.xx, &mut matrix.yy, &mut matrix.zz].into_iter().zip(inverse) {
        if inverse <= 0.0 {
            *entry = 1.0;
        }
    }
    matrix
}

/// The inertia from the summed bounds (N/m) of the node's elements. `old` is the inverse in use so far and the
/// velocity in its frame, nothing at the start.
#[inline(always)]
pub(super) fn renew(
    at: &NodeInertia,
    stiffness: Symmetric,
    old: Option<(Symmetric, [f32; 3])>,
    velocity: [f32; 3],
    scaling: &Scaling,
) -> Renewed {
    let mass = at.mass;
    let needed = stiffness.scaled(scaling.weight).on_free(at.inverse);
    let largest = needed.largest_eigenvalue();
    let factor = if largest > mass { 1.0 - mass / largest } else { 0.0 };
    let scaled = needed.scaled_plus(factor, mass).on_free(at.inverse);
    let added = factor * needed.trace() / (3.0 * mass);

    let mut keep = 1.0;
    if let Some((old, old_velocity)) = old {
        // The inertia before, from the inverse that was in use.
        let before = with_held(old, at.inverse).inverse().on_free(at.inverse);
        let reserve = scaling.reserve * mass;
        let square: f32 =
            velocity.iter().zip(at.inverse).map(|(v, i)| if i > 0.0 { v * v } else { 0.0 }).sum();
        let energy = form(&scaled, velocity);
        let had = form(&before, old_velocity) - reserve * square;
        // What rounding may be, and what damping takes.
        let given = GIVEN_BACK * scaling.loss * mass * square;
        if energy > had * (1.0 + 1e-5) + given && energy > 0.0 {
            let allowed = (had + given) / energy;
            keep = if allowed > 0.0 { libm::sqrtf(allowed) } else { 0.0 };
        }
    }
    let inertia = scaled.scaled_plus(1.0, scaling.reserve * mass).on_free(at.inverse);
    let inverse = with_held(inertia, at.inverse).inverse().on_free(at.inverse);
    Renewed { inverse, inertia, velocity: keep, added }
}
