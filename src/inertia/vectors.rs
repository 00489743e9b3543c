//! What the inertia keeps for each node, in five vectors of four numbers over one storage of the caller, six for a damped
//! step.

use super::node::Node;
use crate::lanes::NodeVector;
use crate::symmetric::Symmetric;

/// Vectors that the inertia of `nodes` nodes needs.
#[must_use]
pub const fn vectors_for(nodes: usize) -> usize {
    5 * nodes
}

/// The same for [`super::Inertia::damped`].
#[must_use]
pub const fn damped_vectors_for(nodes: usize) -> usize {
    6 * nodes
}

pub(super) struct NodeTables<'a> {
    /// `xx, yy, zz` of the inverse inertia in use (1/kg) and the scalar bound it was made for (N/m).
    pub(super) inverse_diagonal: &'a mut [NodeVector],
    /// `xy, yz, zx`, and the share of it in use.
    pub(super) inverse_beside: &'a mut [NodeVector],
    /// Sums of the elements' bounds, N/m, laid out like the inverse.
    pub(super) sum_diagonal: &'a mut [NodeVector],
    pub(super) sum_beside: &'a mut [NodeVector],
    /// The next increment of each node, m; the fourth number is the least height of its elements, m.
    pub(super) next: &'a mut [NodeVector],
    /// Rough part of each node's last increment, m, for a damped step; else nothing.
    pub(super) rough: &'a mut [NodeVector],
}

impl<'a> NodeTables<'a> {
    pub(super) fn split(vectors: &'a mut [NodeVector], nodes: usize) -> Option<Self> {
        let (inverse_diagonal, rest) = vectors.split_at_mut_checked(nodes)?;
        let (inverse_beside, rest) = rest.split_at_mut_checked(nodes)?;
        let (sum_diagonal, rest) = rest.split_at_mut_checked(nodes)?;
        let (sum_beside, rest) = rest.split_at_mut_checked(nodes)?;
        let (next, rest) = rest.split_at_mut_checked(nodes)?;
        Some(Self {
            inverse_diagonal,
            inverse_beside,
            sum_diagonal,
            sum_beside,
            next,
            rough: rest.get_mut(..nodes).unwrap_or_default(),
        })
    }

    pub(super) fn clear_sums(&mut self) {
        self.sum_diagonal.fill(NodeVector::ZERO);
        self.sum_beside.fill(NodeVector::ZERO);
    }

    /// Summed matrix and scalar of a node, N/m.
    #[inline(always)]
    pub(super) fn summed(&self, node: usize) -> (Symmetric, f32) {
        joined(self.sum_diagonal, self.sum_beside, node).0
    }

    /// The inverse inertia in use and the scalar bound it was made for.
    #[inline(always)]
    pub(super) fn node(&self, node: usize) -> (Node, f32) {
        let ((inverse, scalar), share) = joined(self.inverse_diagonal, self.inverse_beside, node);
        (Node { inverse, share }, scalar)
    }

    #[inline(always)]
    pub(super) fn set(&mut self, node: usize, inverse: &Symmetric, scalar: f32, share: f32) {
        part(self.inverse_diagonal, self.inverse_beside, node, inverse, (scalar, share));
    }

    /// Puts a node's next inverse and the scalar it is made for where its sums were.
    #[inline(always)]
    pub(super) fn set_next(&mut self, node: usize, inverse: &Symmetric, scalar: f32) {
        part(self.sum_diagonal, self.sum_beside, node, inverse, (scalar, 0.0));
    }

    /// The next inverses are in use from now on; shares stay, and are one at the start.
    pub(super) fn put_in_use(&mut self, first: bool) {
        for (inverse, next) in self.inverse_diagonal.iter_mut().zip(&*self.sum_diagonal) {
            *inverse = *next;
        }
        for (inverse, next) in self.inverse_beside.iter_mut().zip(&*self.sum_beside) {
            let share = if first { 1.0 } else { inverse.0[3] };
            let [xy, yz, zx, _] = next.0;
            inverse.0 = [xy, yz, zx, share];
        }
    }
}

#[inline(always)]
fn joined(diagonal: &[NodeVector], beside: &[NodeVector], node: usize) -> ((Symmetric, f32), f32) {
    let [xx, yy, zz, fourth] = diagonal.get(node).copied().unwrap_or_default().0;
    let [xy, yz, zx, last] = beside.get(node).copied().unwrap_or_default().0;
    ((Symmetric { xx, yy, zz, xy, yz, zx }, fourth), last)
}

/// What [`joined`] reads, with the two fourth numbers.
#[inline(always)]
fn part(
    diagonal: &mut [NodeVector],
    beside: &mut [NodeVector],
    node: usize,
    matrix: &Symmetric,
    (fourth, last): (f32, f32),
) {
    if let (Some(diagonal), Some(beside)) = (diagonal.get_mut(node), beside.get_mut(node)) {
        diagonal.0 = [matrix.xx, matrix.yy, matrix.zz, fourth];
        beside.0 = [matrix.xy, matrix.yz, matrix.zx, last];
    }
}
