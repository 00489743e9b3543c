//! What the inertia keeps for each node, in five vectors of four numbers over one storage of the caller, six for a damped
//! step.

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use crate::lanes::{NodeVector, Real, Rows};
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

/// The bits of a height that tell the frame.
const FRAME: u32 = 0xFF;

/// The frame that a node with this vector in `next` turns with.
#[inline(always)]
pub(super) fn frame_of(vector: &NodeVector) -> usize {
    (vector.0[3].to_bits() & FRAME) as usize
}

pub(super) struct NodeTables<'a> {
    /// `xx, yy, zz` of the inverse inertia in use (1/kg) and the scalar bound it was made for (N/m).
    pub(super) inverse_diagonal: &'a mut [NodeVector],
    /// `xy, yz, zx`, and the share of it in use.
    pub(super) inverse_beside: &'a mut [NodeVector],
    /// Sums of the elements' bounds, N/m, laid out like the inverse.
    pub(super) sum_diagonal: &'a mut [NodeVector],
    pub(super) sum_beside: &'a mut [NodeVector],
    /// The next increment of each node, m; the fourth number is the least height of its elements, m, with
    /// the number of the frame that it turns with for its last eight bits: it only tells how far is far.
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

    /// Node `node` turns with this frame, below 256; its height is there already.
    pub(super) fn set_frame(&mut self, node: usize, frame: usize) {
        if let Some(vector) = self.next.get_mut(node) {
            vector.0[3] = f32::from_bits(vector.0[3].to_bits() & !FRAME | frame as u32 & FRAME);
        }
    }

    /// The frame that a node turns with.
    #[inline(always)]
    pub(super) fn frame(&self, node: usize) -> usize {
        self.next.get(node).map_or(0, frame_of)
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

/// The matrices of nodes side by side, and the fourth numbers beside them.
#[inline(always)]
pub(super) fn read_matrices<R: Real>(
    rows: impl Rows,
    diagonal: &[NodeVector],
    beside: &[NodeVector],
) -> (Symmetric<R>, [R; 2]) {
    let [xx, yy, zz, fourth] = rows.read::<R>(must_cast_slice(diagonal));
    let [xy, yz, zx, last] = rows.read::<R>(must_cast_slice(beside));
    (Symmetric { xx, yy, zz, xy, yz, zx }, [fourth, last])
}

/// Writes what [`read_matrices`] reads.
#[inline(always)]
pub(super) fn write_matrices<R: Real>(
    rows: impl Rows,
    diagonal: &mut [NodeVector],
    beside: &mut [NodeVector],
    &Symmetric { xx, yy, zz, xy, yz, zx }: &Symmetric<R>,
    [fourth, last]: [R; 2],
) {
    rows.write(must_cast_slice_mut(diagonal), [xx, yy, zz, fourth]);
    rows.write(must_cast_slice_mut(beside), [xy, yz, zx, last]);
}
