//! The pass over the nodes that adds a further motion of the lattice, that by the pushes of instruments (`contact.rs`),
//! to the next increments, vectorised. Gives the sums of all nodes for the energy balance anew.

use core::ops::Range;

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use super::cells::{CellPolynomial, VECTORS_PER_TILE, motion_at};
use super::motion_pass::AxisSums;
use super::pass_input::PassInput;
use super::report::HeldBack;
use crate::simd::{Contiguous, Kernel, NodeVector, Real, Rows, TILE, dispatch};
use crate::step::Totals;

/// Inputs of the pass.
pub(super) struct AddedMotion<'a> {
    pub(super) input: PassInput<'a>,
    pub(super) cells: &'a [CellPolynomial],
    /// Ranks of the nodes.
    pub(super) ranks: Range<usize>,
    pub(super) force: &'a [NodeVector],
    /// Of the nodes of these ranks.
    pub(super) next: &'a mut [NodeVector],
}

impl AddedMotion<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> Totals {
        dispatch(self)
    }

    #[inline(always)]
    fn nodes<R: Real>(&mut self, at: Contiguous, rows: impl Rows, moved: [R; 3], sums: &mut AxisSums<R>) {
        let nodes = self.input.read::<R>(rows, self.force);
        let mut next = at.read::<R>(must_cast_slice(self.next));
        for axis in 0..3 {
            next[axis] = nodes.free[axis].fused(moved[axis], next[axis]);
        }
        sums.add(&nodes, next);
        at.write(must_cast_slice_mut(self.next), next);
    }
}

impl Kernel for AddedMotion<'_> {
    type Output = Totals;

    // There are sums for two vectors of a tile.
    const EIGHT: bool = true;

    #[inline(always)]
    fn run<R: Real>(mut self) -> Totals {
        let (input, cells) = (self.input, self.cells);
        let Range { start, end } = self.ranks;
        let whole = end - (end - start) % TILE;
        let mut sums = [AxisSums::<R>::new(&input); VECTORS_PER_TILE];
        for first in (start..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let rank = first + vector * R::COUNT;
                if let Some((rows, places)) = input.in_order::<R>(rank) {
                    let moved = motion_at(cells, &places);
                    self.nodes(Contiguous(rank - start), rows, moved, &mut sums[vector % VECTORS_PER_TILE]);
                }
            }
        }
        let mut rest = AxisSums::new(&input);
        for rank in whole..end {
            if let Some(place) = input.places.get(rank) {
                let moved = cells.get(place.cell()).map_or([0.0; 3], |cell| cell.at(place.within()));
                self.nodes::<f32>(Contiguous(rank - start), Contiguous(place.node()), moved, &mut rest);
            }
        }
        AxisSums::total(&sums, &rest, HeldBack::NONE).totals
    }
}
