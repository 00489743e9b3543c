//! The two passes over the nodes of mass scaling alone: their inertia from the bounds of this state, and their motion.

use glam::Vec4;

use super::LARGEST_KICK;
use super::estimate::{Defect, Defects};
use super::node::{Scaling, renew};
use super::report::{HeldBack, Tally};
use super::vectors::NodeTables;
use crate::lanes::{Kernel, NodeVector, Real, dispatch};
use crate::scene::NodeInertia;
use crate::tled::{Step, Sums, Totals};

/// The inertia of each node, how much of it it may use, and its velocity (into `next`). Gives who was held back and
/// what was added.
pub(super) fn prepare(
    step: &Step,
    scaling: &Scaling,
    nodal: &[NodeInertia],
    increment: &[NodeVector],
    force: &mut [NodeVector],
    tables: &mut NodeTables<'_>,
) -> (HeldBack, Tally) {
    let (mut held_back, mut tally) = (HeldBack::NONE, Tally::NEW);
    let square = step.seconds() * step.seconds();
    for (node, ((inertia, increment), force)) in nodal.iter().zip(increment).zip(force).enumerate() {
        let [fx, fy, fz, scalar] = force.0;
        force.0[3] = 0.0;
        let carry = step.carry();
        let velocity = [0, 1, 2].map(|axis| carry * increment.0[axis]);
        let at = tables.node(node).0;
        let before = at.share;
        let old = Some((at.inverse, velocity));
        let renewed = renew(inertia, tables.summed(node).0, old, velocity, scaling);
        let mut keep = renewed.velocity;
        tally.add(node, renewed.added);
        // The bound is that of this state: the node has not stiffened since.
        let kick = renewed.inverse.times([fx, fy, fz].map(|force| force * square));
        let length = libm::sqrtf(kick[0] * kick[0] + kick[1] * kick[1] + kick[2] * kick[2]);
        let Some(next) = tables.next.get_mut(node) else {
            continue;
        };
        let most = LARGEST_KICK * next.0[3];
        let share = if length > most { most / length } else { 1.0 };
        if share < before {
            keep *= libm::sqrtf(share / before);
        }
        held_back.add(if share < 1.0 { 1.0 } else { 0.0 }, 1.0 - share);
        for axis in 0..3 {
            next.0[axis] = keep * velocity[axis];
        }
        tables.set(node, &renewed.inverse, scalar, share);
    }
    (held_back, tally)
}

/// `D^2 f - 2 k m du` on the free axes, kg m.
#[inline(always)]
fn residual(
    step: &Step,
    scaling: &Scaling,
    inertia: &NodeInertia,
    force: [f32; 3],
    velocity: &NodeVector,
) -> [f32; 3] {
    let square = step.seconds() * step.seconds();
    let free = inertia.free().to_array();
    [0, 1, 2]
        .map(|axis| free[axis] * (square * force[axis] - 2.0 * scaling.k * inertia.mass * velocity.0[axis]))
}

/// The next increments, in `next`, with what the step enters in the energy account and in the estimate of the error.
pub(super) struct Move<'a, 'b> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    pub(super) force: &'a [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
}

impl Move<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn moved(self) -> (Totals, Defects) {
        dispatch(self)
    }
}

impl Kernel for Move<'_, '_> {
    type Output = (Totals, Defects);

    #[inline(always)]
    fn run<R: Real>(self) -> (Totals, Defects) {
        let Self { step, scaling, tables, .. } = self;
        let mut sums = Sums::new(step, Vec4::splat);
        let mut defect = Defect::new(step, scaling, Vec4::splat);
        let nodes =
            self.inertia.iter().zip(self.displacement).zip(self.increment).zip(self.force).enumerate();
        for (node, (((inertia, displacement), increment), force)) in nodes {
            let at = tables.node(node).0;
            let Some(next) = tables.next.get_mut(node) else {
                continue;
            };
            let fine = at.inverse.times(residual(step, scaling, inertia, force.to_array(), next));
            let free = inertia.free().to_array();
            for axis in 0..3 {
                next.0[axis] = free[axis] * (next.0[axis] + at.share * fine[axis]);
            }
            let moved = Vec4::from(next.0).with_w(0.0);
            let (increment, force) = (Vec4::from(increment.0), Vec4::from(force.0));
            let (mass, free, displacement) =
                (Vec4::splat(inertia.mass), inertia.free(), Vec4::from(displacement.0));
            sums.add(mass, free, increment, force, moved);
            defect.add(mass, free, displacement, increment, force, moved);
        }
        (Totals::of_axes(&sums), Defects::of_axes(&defect))
    }
}
