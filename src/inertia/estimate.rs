//! How far off the motion is because of the inertia that was added. What the scaling absorbs of a node's force,
//! `d = f - mu m v - m a`, drives the error: `M e'' + mu M e' + K e = d` to first order. It is followed along one
//! shape, the displacement `u`, with the stiffness of its secant: `e = x u / rms(u)`,
//!
//! ```text
//! x'' + mu x' + (-u.f_int / u.M u) x = rms(u) (u.d) / (u.M u)
//! ```
//! The velocity would be a worse shape: its short waves are far stiffer than the error's.
//! Work over all nodes, supports as well, so that a support that moves the body bears its stiffness.

use super::assembly::free;
use super::node::Scaling;
use crate::lanes::NodeVector;
use crate::scene::NodeInertia;
use crate::tled::Step;

/// The error across the displacement is about as large again as that along it: over the laboratory's scenes,
/// methods and steps the median of `x` over the mean error of the nodes is a half.
const ACROSS: f32 = 2.0;

/// The error along the displacement, root mean square over the nodes, m: now and a step ago.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    now: f32,
    before: f32,
}

/// Sum over the nodes in a fixed order, whatever the instruction set.
pub(super) fn dot(a: &[NodeVector], b: &[NodeVector]) -> f32 {
    let mut sums = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for (axis, sum) in sums.iter_mut().enumerate().take(3) {
            *sum += a.0[axis] * b.0[axis];
        }
    }
    sums.iter().sum()
}

/// A step before its displacement changes.
pub(super) struct Moving<'a> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    pub(super) force: &'a [NodeVector],
    pub(super) next: &'a [NodeVector],
    /// Displacement times external force, J.
    pub(super) external: f32,
}

impl Estimate {
    pub(super) const NONE: Self = Self { now: 0.0, before: 0.0 };

    /// The error, m.
    pub(super) fn error(&self) -> f32 {
        ACROSS * if self.now < 0.0 { -self.now } else { self.now }
    }

    /// One step on.
    #[inline(always)]
    pub(super) fn advance(&mut self, at: &Moving<'_>) {
        let (k, carry) = (at.scaling.k, at.step.carry());
        let square = at.step.seconds() * at.step.seconds();
        let [mut defect, mut mass, mut length, mut total] = [[0.0f32; 4]; 4];
        let nodes = at.inertia.iter().zip(at.displacement).zip(at.increment).zip(at.force).zip(at.next);
        for ((((inertia, u), increment), force), next) in nodes {
            let free = free(inertia.inverse);
            for axis in 0..4 {
                let (u, before) = (u.0[axis], carry * increment.0[axis]);
                // D^2 d = D^2 f - k m (du+ + du) - m (du+ - du).
                let taken = inertia.mass * ((1.0 + k) * next.0[axis] - (1.0 - k) * before);
                defect[axis] += free[axis] * u * (square * force.0[axis] - taken);
                mass[axis] += free[axis] * inertia.mass * u * u;
                length[axis] += u * u;
                total[axis] += u * force.0[axis];
            }
        }
        let [defect, mass, length, total] = [defect, mass, length, total].map(|[x, y, z, _]| x + y + z);
        if mass <= 0.0 {
            return;
        }
        // Implicit: whatever the stiffness, the estimate does not ring.
        let internal = at.external - total;
        let stiffness = if internal > 0.0 { square * internal / mass } else { 0.0 };
        let push = libm::sqrtf(length / at.inertia.len() as f32) * defect / mass;
        let next = (push + 2.0 * self.now - (1.0 - k) * self.before) / (1.0 + k + stiffness);
        *self = Self { now: next, before: self.now };
    }
}
