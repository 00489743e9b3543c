//! Tables over the nodes in the caller's storage: five vectors of four floats for each node, seven for a damped step.
//! Those that a step reads are in the order of the cells, in which it takes the nodes ([`super::lattice::rank_of`]);
//! the sums over elements are in the order of the nodes.
//!
//! A step changes shares and rough motion before it is known whether it will be taken, and keeps what they were for the
//! case that it is not ([`NodeTables::take_back`]).

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use super::lattice::{LatticeNode, node_at};
use crate::copy::copy;
use crate::element::symmetric::Symmetric;
use crate::padding;
use crate::simd::{NodeVector, Real, Rows};

/// Vectors of the tables of `nodes` nodes.
pub(super) const fn vectors_for(nodes: usize, damped: bool) -> usize {
    nodes.saturating_mul(if damped { 7 } else { 5 })
}

pub(super) struct NodeTables<'a> {
    /// `xx, yy, zz` of the inverse inertia in use (1/kg), and the scalar bound from which it was computed (N/m).
    pub(super) inverse_diagonal: &'a mut [NodeVector],
    /// `xy, yz, zx` of the inverse inertia, and the share of it that the node may use (below one if it is held back).
    pub(super) inverse_off_diagonal: &'a mut [NodeVector],
    /// Sums of the elements' bounds (N/m), later the next inverse inertia; the same layout, in the order of the nodes.
    /// There is no sum of shares: while a step is computed its place has the shares before it, in the order of the
    /// cells.
    pub(super) sum_diagonal: &'a mut [NodeVector],
    pub(super) sum_off_diagonal: &'a mut [NodeVector],
    /// The next increment of each node, m. The fourth component is the least height of its elements, m, with the frame
    /// of the node in its last eight bits ([`crate::padding`]).
    pub(super) next_increment: &'a mut [NodeVector],
    /// Rough part of each node's last increment, m, for a damped step; else empty. Then the same before the step.
    pub(super) rough: &'a mut [NodeVector],
    pub(super) rough_before: &'a mut [NodeVector],
}

impl<'a> NodeTables<'a> {
    pub(super) fn split(vectors: &'a mut [NodeVector], nodes: usize) -> Option<Self> {
        let (inverse_diagonal, rest) = vectors.split_at_mut_checked(nodes)?;
        let (inverse_off_diagonal, rest) = rest.split_at_mut_checked(nodes)?;
        let (sum_diagonal, rest) = rest.split_at_mut_checked(nodes)?;
        let (sum_off_diagonal, rest) = rest.split_at_mut_checked(nodes)?;
        let (next_increment, rest) = rest.split_at_mut_checked(nodes)?;
        let (rough, rough_before) = rest.split_at_mut_checked(nodes).unwrap_or_default();
        Some(Self {
            inverse_diagonal,
            inverse_off_diagonal,
            sum_diagonal,
            sum_off_diagonal,
            next_increment,
            rough,
            rough_before: rough_before.get_mut(..nodes).unwrap_or_default(),
        })
    }

    pub(super) fn clear_sums(&mut self) {
        self.sum_diagonal.fill(NodeVector::ZERO);
        self.sum_off_diagonal.fill(NodeVector::ZERO);
    }

    /// Sets the height (m) and the frame, below 256, of the node of a rank.
    pub(super) fn set_node(&mut self, rank: usize, height: f32, frame: usize) {
        if let Some(vector) = self.next_increment.get_mut(rank) {
            vector.0[3] = padding::with_frame(height, frame);
        }
    }

    /// The frame of the node of a rank.
    #[inline(always)]
    pub(super) fn frame(&self, rank: usize) -> usize {
        self.next_increment.get(rank).map_or(0, |vector| padding::frame_of(vector.0[3]))
    }

    /// Shares, and rough motion if the step has changed it, as they were before a step that is not taken.
    pub(super) fn take_back(&mut self, rough: bool) {
        for (inverse, before) in self.inverse_off_diagonal.iter_mut().zip(&*self.sum_off_diagonal) {
            inverse.0[3] = before.0[3];
        }
        if rough {
            copy(self.rough, self.rough_before);
        }
    }

    /// Puts the next inverses into use. The shares are kept; in the first cycle they are set to one.
    pub(super) fn put_in_use(&mut self, places: &[LatticeNode], first: bool) {
        let next_of = |sums: &[NodeVector], rank| sums.get(node_at(places, rank)).copied().unwrap_or_default();
        for (rank, inverse) in self.inverse_diagonal.iter_mut().enumerate() {
            *inverse = next_of(self.sum_diagonal, rank);
        }
        for (rank, inverse) in self.inverse_off_diagonal.iter_mut().enumerate() {
            let share = if first { 1.0 } else { inverse.0[3] };
            let [xy, yz, zx, _] = next_of(self.sum_off_diagonal, rank).0;
            inverse.0 = [xy, yz, zx, share];
        }
    }
}

/// Reads the matrices of a vector of nodes, and the fourth components of both tables.
#[inline(always)]
pub(super) fn read_matrices<R: Real>(
    rows: impl Rows,
    diagonal: &[NodeVector],
    off_diagonal: &[NodeVector],
) -> (Symmetric<R>, [R; 2]) {
    let [xx, yy, zz, fourth] = rows.read::<R>(must_cast_slice(diagonal));
    let [xy, yz, zx, last] = rows.read::<R>(must_cast_slice(off_diagonal));
    (Symmetric { xx, yy, zz, xy, yz, zx }, [fourth, last])
}

/// Writes what [`read_matrices`] reads.
#[inline(always)]
pub(super) fn write_matrices<R: Real>(
    rows: impl Rows,
    diagonal: &mut [NodeVector],
    off_diagonal: &mut [NodeVector],
    &Symmetric { xx, yy, zz, xy, yz, zx }: &Symmetric<R>,
    [fourth, last]: [R; 2],
) {
    rows.write(must_cast_slice_mut(diagonal), [xx, yy, zz, fourth]);
    rows.write(must_cast_slice_mut(off_diagonal), [xy, yz, zx, last]);
}
