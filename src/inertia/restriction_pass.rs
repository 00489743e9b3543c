//! The pass over the nodes before the lattice's motion is computed, vectorised: residual, momentum and scalar bound of
//! each node, added to the sums of the cells. It takes the nodes in the order of the cells, so that the sums of a cell stay in
//! registers.

use core::ops::Range;

use super::cells::{CellAccumulator, CellSlots};
use super::pass_input::{NodeValues, PassInput};
use crate::simd::{Contiguous, Kernel, NodeVector, Real, TILE, dispatch};

/// Inputs and sums of the pass.
pub(super) struct RestrictionPass<'a> {
    pub(super) input: PassInput<'a>,
    /// Ranks of the nodes.
    pub(super) ranks: Range<usize>,
    pub(super) force: &'a [NodeVector],
    pub(super) residual: CellSlots<'a>,
    pub(super) momentum: CellSlots<'a>,
}

impl RestrictionPass<'_> {
    /// The largest component of an increment, m. Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> f32 {
        dispatch(self)
    }
}

/// The largest component of the increments of a vector of nodes, and of those before.
#[inline(always)]
fn largest<R: Real>(before: R, nodes: &NodeValues<R>) -> R {
    let [x, y, z] = nodes.increment;
    x.abs().max(y.abs()).max(z.abs()).max(before)
}

impl Kernel for RestrictionPass<'_> {
    type Output = f32;

    // There are sums for two vectors of a tile.
    const EIGHT: bool = true;

    #[inline(always)]
    fn run<R: Real>(mut self) -> f32 {
        let input = self.input;
        let Range { start, end } = self.ranks;
        let whole = end - (end - start) % TILE;
        let mut most = R::splat(0.0);
        let mut residual_sums = CellAccumulator::new(self.residual.first);
        let mut momentum_sums = CellAccumulator::new(self.momentum.first);
        for first in (start..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let rank = first + vector * R::COUNT;
                let Some((rows, places)) = input.in_order::<R>(rank) else {
                    continue;
                };
                let nodes = input.read::<R>(rows, self.force);
                most = largest(most, &nodes);
                momentum_sums.add(&mut self.momentum, &places, vector, nodes.momentum(), R::splat(0.0));
                residual_sums.add(&mut self.residual, &places, vector, input.residual(&nodes), nodes.bound);
            }
        }
        residual_sums.flush(&mut self.residual);
        momentum_sums.flush(&mut self.momentum);
        let mut all = 0.0;
        for rank in whole..end {
            let Some(place) = input.places.get(rank) else {
                continue;
            };
            let nodes = input.read::<f32>(Contiguous(place.node()), self.force);
            all = largest(all, &nodes);
            if let Some(cell) = self.momentum.get_mut(place.cell()) {
                cell.add(place, nodes.momentum(), 0.0);
            }
            if let Some(cell) = self.residual.get_mut(place.cell()) {
                cell.add(place, input.residual(&nodes), nodes.bound);
            }
        }
        for lane in 0..R::COUNT {
            all = f32::max(most.lane(lane), all);
        }
        all
    }
}
