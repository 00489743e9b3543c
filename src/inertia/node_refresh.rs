//! The next inertia (kg) of a batch of nodes, vectorised: from the summed bounds (N/m) of their elements to the inverse
//! inertia ([`super::node`]), and to the sums of the lattice's functions. Without a
//! lattice, velocities are scaled down where inertia grows.

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use super::frames::{Frames, Rotation};
use super::lattice::{Lattice, LatticeNode, node_at};
use super::nodal_sums::{FunctionInertia, add_inertia};
use super::node::{Scaling, new_inertia, velocity_factor};
use super::node_tables::{NodeTables, read_matrices, write_matrices};
use super::projected_inertia::CellSums;
use super::report::AddedInertiaSums;
use crate::element::NodeInertia;
use crate::element::symmetric::Symmetric;
use crate::simd::{Indexed, Kernel, NodeVector, Real, Rows, TILE, dispatch};

/// Nodes of a batch.
pub(super) const NODE_BATCH: usize = 8;

/// A batch of nodes whose next inertia is computed.
pub(super) struct NodeBatch<'a, 'b> {
    pub(super) inertia: &'a [NodeInertia],
    /// The velocities to scale down, with the frames of the nodes; none with a lattice, or where no inertia is in use
    /// yet.
    pub(super) moving: Option<(&'a mut [NodeVector], &'a Frames)>,
    pub(super) lattice: &'a Lattice,
    /// Empty without a lattice.
    pub(super) places: &'a [LatticeNode],
    pub(super) scaling: &'a Scaling,
    pub(super) added: &'a mut AddedInertiaSums,
    pub(super) tables: &'a mut NodeTables<'b>,
    /// Sums of the nodes' inertia for each function.
    pub(super) bounds: &'a mut [FunctionInertia],
    /// The same for each cell; may be empty.
    pub(super) sums: &'a mut [CellSums],
    /// The first node of the batch.
    pub(super) first: usize,
}

impl NodeBatch<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) {
        dispatch(self);
    }
}

impl Kernel for NodeBatch<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(mut self) {
        let (first, count) = (self.first, self.inertia.len());
        // Places after the last node repeat it.
        let (mut ranks, mut rows) = ([0; TILE], [0; TILE]);
        for (lane, (rank, row)) in ranks.iter_mut().zip(&mut rows).enumerate().take(NODE_BATCH) {
            let at = (first + lane).min(count.saturating_sub(1));
            (*rank, *row) = (at as u32, node_at(self.places, at) as u32);
        }
        let checked = |rows| Indexed::below::<R>(rows, count);
        if let (Some(rows), Some(ranks)) = (checked(rows), checked(ranks)) {
            self.refresh::<R::Width8, R>(rows, ranks, count - first.min(count));
        }
    }
}

impl NodeBatch<'_, '_> {
    /// Computes the next inertia of the nodes in these rows, with these ranks, of which `left` are not repeated. `W` is
    /// the widest vector of the level.
    #[inline(always)]
    fn refresh<R: Real, W: Real>(&mut self, rows: Indexed, ranks: Indexed, left: usize) {
        const { assert!(R::COUNT == NODE_BATCH) };
        let Self { inertia, moving, lattice, places, scaling, added, tables, bounds, sums, .. } = self;
        let [x, y, z, mass] = rows.read::<R>(must_cast_slice(inertia));
        let (stiffness, [scalar, _]) = read_matrices(rows, tables.sum_diagonal, tables.sum_off_diagonal);
        let free = [x, y, z];
        let new = new_inertia(free, mass, stiffness, scaling);
        if let Some((increment, frames)) = moving {
            let [vx, vy, vz, padding] = rows.read::<R>(must_cast_slice(increment));
            let velocity = [vx, vy, vz];
            let in_frames = |rotation: &dyn Fn(usize) -> Rotation| {
                let mut rotations = [Rotation::NONE; NODE_BATCH];
                for (lane, of_lane) in rotations.iter_mut().enumerate() {
                    *of_lane = rotation(tables.frame(ranks.index::<R>(lane)));
                }
                to_frames(&rotations, velocity)
            };
            let old = read_matrices(ranks, tables.inverse_diagonal, tables.inverse_off_diagonal).0;
            let factor = velocity_factor(
                free,
                mass,
                (old, in_frames(&|frame| frames.since_bounds(frame))),
                (&new.inertia, in_frames(&|frame| frames.since_start(frame))),
                scaling,
            );
            let mut kept = velocity;
            for axis in 0..3 {
                kept[axis] = free[axis].choose(velocity[axis] * factor, velocity[axis]);
            }
            rows.write(must_cast_slice_mut(increment), [kept[0], kept[1], kept[2], padding]);
        }
        let fourth = [scalar, R::splat(0.0)];
        write_matrices(rows, tables.sum_diagonal, tables.sum_off_diagonal, &new.inverse, fourth);
        for lane in 0..left.min(R::COUNT) {
            added.add(rows.index::<R>(lane), new.added.lane(lane));
        }

        if places.is_empty() {
            return;
        }
        for lane in 0..left.min(R::COUNT) {
            let Some(place) = places.get(ranks.index::<R>(lane)) else {
                continue;
            };
            let Symmetric { xx, yy, zz, xy, yz, zx } = new.inertia;
            let of = |entry: R| entry.lane(lane);
            let matrix = Symmetric { xx: of(xx), yy: of(yy), zz: of(zz), xy: of(xy), yz: of(yz), zx: of(zx) };
            add_inertia(bounds, lattice, place, &matrix);
            if let Some(sums) = sums.get_mut(place.cell()) {
                sums.add_node::<W>(place, &matrix);
            }
        }
    }
}

/// The vectors of a vector of nodes in their frames.
#[inline(always)]
fn to_frames<R: Real>(rotations: &[Rotation; NODE_BATCH], vectors: [R; 3]) -> [R; 3] {
    let mut local = [R::splat(0.0); 3];
    for (row, along) in vectors.into_iter().enumerate() {
        for column in 0..3 {
            let entry = R::from_fn(|lane| rotations[lane % NODE_BATCH].0[row][column]);
            local[column] = local[column] + entry * along;
        }
    }
    local
}
