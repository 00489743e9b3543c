//! How far off the motion is because of the inertia that was added. What the scaling absorbs of a node's force,
//! `d = f - mu m v - m a`, drives the error: `M e'' + mu M e' + K e = d` to first order. It is followed along one
//! shape, the displacement `u`, with the stiffness of its secant: `e = x u / rms(u)`,
//!
//! ```text
//! x'' + mu x' + (-u.f_int / u.M u) x = rms(u) (u.d) / (u.M u)
//! ```
//! The velocity would be a worse shape: its short waves are far stiffer than the error's.
//! Work over all nodes, supports as well, so that a support that moves the body bears its stiffness.

use glam::Vec4;

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
    let mut sums = Vec4::ZERO;
    for (a, b) in a.iter().zip(b) {
        sums += Vec4::from(a.0) * Vec4::from(b.0);
    }
    along_axes(sums)
}

/// The fourth numbers of a node's vectors mean something else.
fn along_axes(sums: Vec4) -> f32 {
    sums.x + sums.y + sums.z
}

/// Sums over the nodes of a step, before its displacement changes.
pub(super) struct Defect {
    k: f32,
    carry: f32,
    square: f32,
    nodes: u32,
    defect: Vec4,
    mass: Vec4,
    length: Vec4,
    total: Vec4,
}

impl Defect {
    pub(super) fn new(step: &Step, scaling: &Scaling) -> Self {
        let square = step.seconds() * step.seconds();
        let [defect, mass, length, total] = [Vec4::ZERO; 4];
        Self { k: scaling.k, carry: step.carry(), square, nodes: 0, defect, mass, length, total }
    }

    /// Adds a node: displacement, its increments, and total force.
    #[inline(always)]
    pub(super) fn add(&mut self, at: &NodeInertia, u: Vec4, increment: Vec4, force: Vec4, next: Vec4) {
        // D^2 d = D^2 f - k m (du+ + du) - m (du+ - du).
        let taken = at.mass * ((1.0 + self.k) * next - (1.0 - self.k) * self.carry * increment);
        let free = at.free() * u;
        self.nodes += 1;
        self.defect += free * (self.square * force - taken);
        self.mass += free * (at.mass * u);
        self.length += u * u;
        self.total += u * force;
    }
}

impl Estimate {
    pub(super) const NONE: Self = Self { now: 0.0, before: 0.0 };

    /// The error, m.
    pub(super) fn error(&self) -> f32 {
        ACROSS * if self.now < 0.0 { -self.now } else { self.now }
    }

    /// One step on. `external` is displacement times external force, J.
    pub(super) fn advance(&mut self, sums: &Defect, external: f32) {
        let (k, square) = (sums.k, sums.square);
        let [defect, mass, length, total] = [sums.defect, sums.mass, sums.length, sums.total].map(along_axes);
        if mass <= 0.0 {
            return;
        }
        // Implicit: whatever the stiffness, the estimate does not ring.
        let internal = external - total;
        let stiffness = if internal > 0.0 { square * internal / mass } else { 0.0 };
        let push = libm::sqrtf(length / sums.nodes as f32) * defect / mass;
        let next = (push + 2.0 * self.now - (1.0 - k) * self.before) / (1.0 + k + stiffness);
        *self = Self { now: next, before: self.now };
    }
}
