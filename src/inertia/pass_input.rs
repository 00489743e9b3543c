//! What the passes over the nodes of a step read: values of a vector of nodes, their residual and momentum. The nodes are
//! taken in the order of the lattice's cells.

use bytemuck::must_cast_slice;

use super::cells::NodesInCells;
use super::coarse_motion::removed_share;
use super::large_step::LargeModel;
use super::lattice::LatticeNode;
use super::node::{Scaling, half_damping};
use super::rough_motion;
use crate::element::NodeInertia;
use crate::padding;
use crate::simd::{Indexed, NodeVector, Real, Rows, TILE};
use crate::state::Progress;
use crate::step::Step;

/// Longest time for which a force acts in a step, over the step: inertia makes the step stable for one. What is more after a longer
/// step acts in those that follow ([`LargeModel::owed`]): a body that falls would lose it.
const LONGEST_SPAN: f32 = 1.25;

/// Factors of the residual of a node, `D^2 f - 2 k m du`.
#[derive(Clone, Copy)]
pub(super) struct ResidualFactors {
    /// `D (h + D) / 2` after a step of `h`, s^2: a force acts from the middle of the last step to that of the next one.
    /// In the first step it has acted from the start on.
    square: f32,
    /// `2 k`, times the ratio of the step to the last one.
    loss: f32,
    /// What steps afterwards owe, s.
    owed: f32,
}

impl ResidualFactors {
    /// The factor of forces, s^2.
    pub(super) const fn square(&self) -> f32 {
        self.square
    }

    /// Those of a step with the inertia of one that may be longer. Inertia contains `1 + k` times the mass: in a
    /// shorter step, with a smaller `k`, the residual is larger by the ratio of both. Where the balance does not
    /// explain the motion it is smaller ([`super`]).
    pub(super) fn new(step: &Step, model: &LargeModel, progress: &Progress) -> Self {
        let k = half_damping(step);
        let removed = removed_share(progress.energy_balance.allowed_share());
        let stable = (2.0 - removed.max(rough_motion::MOST)) / (2.0 - rough_motion::MOST);
        let ratio = stable * (1.0 + model.scaling.k) / (1.0 + k);
        let due = 0.5 * (1.0 + 1.0 / step.carry()) + model.owed / step.seconds();
        let (span, owed) = if progress.steps == 0 {
            (0.5, 0.0)
        } else {
            let span = due.min(LONGEST_SPAN);
            (span, step.seconds() * (due - span))
        };
        // Damping acts as long as forces do, so that a steady fall stays one where steps change.
        let (square, loss) = (step.seconds() * step.seconds(), 2.0 * k * step.carry());
        Self { square: ratio * span * square, loss: ratio * span * loss, owed }
    }

    /// The time (s) for which forces have yet to act after the step ([`LargeModel::owed`]).
    pub(super) const fn owed(&self) -> f32 {
        self.owed
    }
}

/// Inputs of all passes.
#[derive(Clone, Copy)]
pub(super) struct PassInput<'a> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) residual: ResidualFactors,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) increment: &'a [NodeVector],
    pub(super) places: &'a [LatticeNode],
}

/// Values of a vector of nodes.
#[derive(Clone, Copy)]
pub(super) struct NodeValues<R> {
    /// Ones along free axes.
    pub(super) free: [R; 3],
    pub(super) mass: R,
    pub(super) force: [R; 3],
    /// Scalar stiffness bound, from the fourth component of the force, N/m.
    pub(super) bound: R,
    pub(super) increment: [R; 3],
}

impl PassInput<'_> {
    #[inline(always)]
    pub(super) fn read<R: Real>(&self, rows: impl Rows, force: &[NodeVector]) -> NodeValues<R> {
        let [ix, iy, iz, mass] = rows.read::<R>(must_cast_slice(self.inertia));
        let [fx, fy, fz, bound] = rows.read::<R>(must_cast_slice(force));
        let [vx, vy, vz, _] = rows.read::<R>(must_cast_slice(self.increment));
        let free = [ix.positive(), iy.positive(), iz.positive()];
        NodeValues { free, mass, force: [fx, fy, fz], bound, increment: [vx, vy, vz] }
    }

    /// The nodes from rank `first` on: their rows in scene and state, and their places.
    #[inline(always)]
    pub(super) fn in_order<R: Real>(&self, first: usize) -> Option<(Indexed, NodesInCells<'_, R>)> {
        let places = self.places.get(first..first + R::COUNT)?;
        let place = |lane| places.get(R::row_of_lane(lane));
        let [x, y, z, nodes] = R::from_rows(|lane| place(lane).map_or([0.0; 4], LatticeNode::row));
        let mut rows = [0; TILE];
        for (lane, row) in rows.iter_mut().enumerate().take(R::COUNT) {
            *row = padding::to_index(nodes.lane(lane));
        }
        let ends = [places.first()?.cell(), places.last()?.cell()];
        Some((Indexed::below::<R>(rows, self.places.len())?, NodesInCells { position: [x, y, z], ends, places }))
    }

    /// `D^2 f - 2 k m du`, kg m.
    #[inline(always)]
    pub(super) fn residual<R: Real>(&self, nodes: &NodeValues<R>) -> [R; 3] {
        let &NodeValues { free, mass, force: [fx, fy, fz], increment: [vx, vy, vz], .. } = nodes;
        let ResidualFactors { square, loss, .. } = self.residual;
        let (square, loss) = (R::splat(square), R::splat(loss) * mass);
        [free[0] * (square * fx - loss * vx), free[1] * (square * fy - loss * vy), free[2] * (square * fz - loss * vz)]
    }
}

impl<R: Real> NodeValues<R> {
    /// The momentum of free axes times the step, kg m.
    #[inline(always)]
    pub(super) fn momentum(&self) -> [R; 3] {
        let [vx, vy, vz] = self.increment;
        let [x, y, z] = self.free;
        [self.mass * x * vx, self.mass * y * vy, self.mass * z * vz]
    }
}
