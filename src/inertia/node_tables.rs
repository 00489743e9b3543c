//! Tables over the nodes in the caller's storage: five vectors of four floats for each node. They
//! are in the order of the cells, in which a step takes the nodes ([`super::lattice::rank_of`]).
//!
//! A step changes the rough motion before it is known whether it will be taken, and keeps what it was for the case that
//! it is not ([`NodeTables::take_back`]).

use crate::copy::copy;
use crate::simd::NodeVector;

/// Vectors of the tables of `nodes` nodes.
pub(super) const fn vectors_for(nodes: usize) -> usize {
    nodes.saturating_mul(5)
}

pub(super) struct NodeTables<'a> {
    /// The next increment of each node, m. The fourth component is what the scalar bound of the node (N/m) has to be
    /// multiplied by: it makes the bound at rest a close one ([`super::node`]).
    pub(super) next_increment: &'a mut [NodeVector],
    /// Rough part of each node's last increment, m, and largest distance by which its force may move it in one step
    /// from rest, m.
    pub(super) rough: &'a mut [NodeVector],
    /// The same before the step.
    pub(super) rough_before: &'a mut [NodeVector],
    /// For use while inertia is computed anew, and at the preparation.
    pub(super) scratch: &'a mut [NodeVector],
    pub(super) more_scratch: &'a mut [NodeVector],
}

impl<'a> NodeTables<'a> {
    pub(super) fn split(vectors: &'a mut [NodeVector], nodes: usize) -> Option<Self> {
        let (next_increment, rest) = vectors.split_at_mut_checked(nodes)?;
        let (rough, rest) = rest.split_at_mut_checked(nodes)?;
        let (rough_before, rest) = rest.split_at_mut_checked(nodes)?;
        let (scratch, rest) = rest.split_at_mut_checked(nodes)?;
        Some(Self { next_increment, rough, rough_before, scratch, more_scratch: rest.get_mut(..nodes)? })
    }

    /// Forgets the rough motion.
    pub(super) fn clear_rough(&mut self) {
        for NodeVector([x, y, z, _]) in &mut *self.rough {
            (*x, *y, *z) = (0.0, 0.0, 0.0);
        }
    }

    /// Takes rough motion back, if the step has changed it, to what it was before a step that is not taken.
    pub(super) fn take_back(&mut self, rough: bool) {
        if rough {
            copy(self.rough, self.rough_before);
        }
    }
}
