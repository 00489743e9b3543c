//! Estimate of the error of the motion (m) that added inertia causes. The part of a node's force that the added
//! inertia absorbs, the defect `d = f - mu m v - m a` (N), drives the error `e`: `M e'' + mu M e' + K e = d` to first
//! order. The error is assumed to have one shape, the displacement `u`, with its secant stiffness: `e = x u / rms(u)`,
//!
//! ```text
//! x'' + mu x' + (-u.f_int / u.M u) x = rms(u) (u.d) / (u.M u)
//! ```
//! The velocity would be a worse shape, because its short waves are much stiffer than the error. The scalar products
//! are over all nodes, supports included, so that the stiffness at a moving support is included.

use super::node::Scaling;
use crate::loads::{Loads, ramp_factor};
use crate::simd::{NodeVector, Real};
use crate::step::{Addends, Step};

/// Mean error of the nodes over `x`. There are errors in other directions than the displacement: the median of this
/// ratio over the laboratory's scenes, methods and steps is two.
const ACROSS: f32 = 2.0;

/// The error `x` along the displacement, root mean square over the nodes, m: after the latest step and the one before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ErrorEstimate {
    now: f32,
    before: f32,
    /// Length of the body, m: the forces of crushed elements would give any value.
    largest: f32,
}

/// Sums over the nodes of a step along one axis, taken before displacements change.
#[derive(Clone, Copy)]
pub(super) struct DefectSums<V> {
    /// `D^2`, s^2.
    square: V,
    /// `1 + k`, and `1 - k` times the ratio of this step to the last one.
    ahead: V,
    behind: V,
    /// `u.d D^2`, kg m^2.
    defect: V,
    /// `u.M u`, kg m^2.
    mass: V,
    /// `u.u`, m^2.
    length: V,
    /// `u.f`, J.
    total: V,
    /// `M u`, kg m.
    moment: V,
}

impl<V: Addends> DefectSums<V> {
    /// Zero sums; `square` is `D^2`, and `splat` turns a value into a vector.
    #[inline(always)]
    pub(super) fn new(step: &Step, scaling: &Scaling, square: f32, splat: impl Fn(f32) -> V) -> Self {
        let k = scaling.k;
        let values = [square, 1.0 + k, (1.0 - k) * step.carry(), 0.0];
        let [square, ahead, behind, zero] = values.map(splat);
        Self { square, ahead, behind, defect: zero, mass: zero, length: zero, total: zero, moment: zero }
    }

    /// The sums of one lane.
    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> DefectSums<f32>
    where
        V: Real,
    {
        DefectSums {
            square: self.square.lane(lane),
            ahead: self.ahead.lane(lane),
            behind: self.behind.lane(lane),
            defect: self.defect.lane(lane),
            mass: self.mass.lane(lane),
            length: self.length.lane(lane),
            total: self.total.lane(lane),
            moment: self.moment.lane(lane),
        }
    }

    /// Adds nodes: masses, ones for free axes, displacements, increments, total forces and next increments.
    #[inline(always)]
    pub(super) fn add(&mut self, mass: V, free: V, u: V, increment: V, force: V, next: V) {
        // D^2 d = D^2 f - k m (du+ + du) - m (du+ - du).
        let taken = mass * (self.ahead * next - self.behind * increment);
        let (along, moment) = (free * u, mass * u);
        self.defect = self.defect + along * (self.square * force - taken);
        self.mass = self.mass + along * moment;
        self.length = self.length + u * u;
        self.total = self.total + u * force;
        self.moment = self.moment + moment;
    }
}

/// The sums of [`DefectSums`] over all nodes and axes.
#[derive(Clone, Copy)]
pub(super) struct DefectTotals {
    defect: f32,
    mass: f32,
    length: f32,
    total: f32,
    /// Along each axis.
    moment: [f32; 3],
}

impl DefectTotals {
    pub(super) const NONE: Self = Self { defect: 0.0, mass: 0.0, length: 0.0, total: 0.0, moment: [0.0; 3] };

    /// Adds the sums of each axis.
    pub(super) fn add_axes(&mut self, sums: &[DefectSums<f32>; 3]) {
        for (sums, moment) in sums.iter().zip(&mut self.moment) {
            self.defect += sums.defect;
            self.mass += sums.mass;
            self.length += sums.length;
            self.total += sums.total;
            *moment += sums.moment;
        }
    }

    /// Adds those of other nodes.
    pub(super) fn add(&mut self, other: &Self) {
        self.defect += other.defect;
        self.mass += other.mass;
        self.length += other.length;
        self.total += other.total;
        for (moment, other) in self.moment.iter_mut().zip(other.moment) {
            *moment += other;
        }
    }

    /// Displacement times the external force at a time (s), J.
    fn external(&self, loads: &Loads<'_>, time: f64, displacement: &[NodeVector]) -> f32 {
        let mut work = dot(self.moment, loads.gravity());
        for load in loads.forces() {
            let u = displacement.get(load.node as usize).copied().unwrap_or_default();
            work += ramp_factor(time, load.ramp) * dot(u.to_array(), load.newton);
        }
        work
    }
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl ErrorEstimate {
    /// No error yet; it is never estimated above `largest`, m.
    pub(super) const fn new(largest: f32) -> Self {
        Self { now: 0.0, before: 0.0, largest }
    }

    /// No error yet, of the same body.
    pub(super) const fn cleared(&self) -> Self {
        Self::new(self.largest)
    }

    /// The error, m.
    pub(super) fn error(&self) -> f32 {
        ACROSS * if self.now < 0.0 { -self.now } else { self.now }
    }

    /// Advances by a step with `D^2 = square`, from the displacements (m) and the loads at its start (`time`, s).
    pub(super) fn advance(
        &mut self,
        totals: &DefectTotals,
        loads: &Loads<'_>,
        time: f64,
        displacement: &[NodeVector],
        k: f32,
        square: f32,
    ) {
        if totals.mass <= 0.0 {
            return;
        }
        // An implicit step: the estimate is stable for any stiffness.
        let internal = totals.external(loads, time, displacement) - totals.total;
        let stiffness = if internal > 0.0 { square * internal / totals.mass } else { 0.0 };
        let push = libm::sqrtf(totals.length / displacement.len() as f32) * totals.defect / totals.mass;
        let next = (push + 2.0 * self.now - (1.0 - k) * self.before) / (1.0 + k + stiffness);
        let next = next.max(-self.largest).min(self.largest);
        *self = Self { now: next, before: self.now, ..*self };
    }
}
