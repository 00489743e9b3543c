//! The pass over the nodes before the lattice's motion is computed, vectorised: residual and momentum of each node,
//! added to the sums of the cells. It takes the nodes in the order of the cells, so that the sums of a cell stay in
//! registers.

use core::ops::Range;

use bytemuck::must_cast_slice;

use super::cells::{CellAccumulator, CellSlots};
use super::pass_input::{NodeValues, PassInput};
use crate::simd::{Contiguous, Kernel, NodeVector, Real, Rows, TILE, dispatch};

/// Inputs and sums of the pass.
pub(super) struct RestrictionPass<'a> {
    pub(super) input: PassInput<'a>,
    /// Ranks of the nodes.
    pub(super) ranks: Range<usize>,
    pub(super) force: &'a [NodeVector],
    /// [`NodeTables::inverse_diagonal`].
    pub(super) inverse_diagonal: &'a [NodeVector],
    pub(super) residual: CellSlots<'a>,
    pub(super) momentum: CellSlots<'a>,
}

/// Extremes over the nodes of a [`RestrictionPass`].
#[derive(Clone, Copy)]
pub(super) struct RestrictionExtremes<R> {
    /// The inverse of the largest growth of a bound.
    pub(super) inverse_growth: R,
    /// The largest component of an increment, m.
    pub(super) increment: R,
}

impl<R: Real> RestrictionExtremes<R> {
    #[inline(always)]
    pub(super) fn none() -> Self {
        Self { inverse_growth: R::splat(1.0), increment: R::splat(0.0) }
    }

    #[inline(always)]
    pub(super) fn merged_with(self, other: Self) -> Self {
        Self {
            inverse_growth: other.inverse_growth.min(self.inverse_growth),
            increment: other.increment.max(self.increment),
        }
    }

    #[inline(always)]
    fn lane(&self, lane: usize) -> RestrictionExtremes<f32> {
        RestrictionExtremes { inverse_growth: self.inverse_growth.lane(lane), increment: self.increment.lane(lane) }
    }
}

impl RestrictionPass<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> RestrictionExtremes<f32> {
        dispatch(self)
    }

    /// The extremes so far, with those of a vector of nodes.
    #[inline(always)]
    fn with_nodes<R: Real>(
        &self,
        extremes: RestrictionExtremes<R>,
        rank: usize,
        nodes: &NodeValues<R>,
    ) -> RestrictionExtremes<R> {
        let [_, _, _, bound_before] = Contiguous(rank).read::<R>(must_cast_slice(self.inverse_diagonal));
        let [vx, vy, vz] = nodes.increment.map(R::abs);
        extremes.merged_with(RestrictionExtremes {
            inverse_growth: self.input.inverse_growth(nodes, bound_before),
            increment: vx.max(vy).max(vz),
        })
    }
}

impl Kernel for RestrictionPass<'_> {
    type Output = RestrictionExtremes<f32>;

    #[inline(always)]
    fn run<R: Real>(mut self) -> RestrictionExtremes<f32> {
        let input = self.input;
        let Range { start, end } = self.ranks;
        let whole = end - (end - start) % TILE;
        let mut extremes = RestrictionExtremes::<R>::none();
        let mut residual_sums = CellAccumulator::new(self.residual.first);
        let mut momentum_sums = CellAccumulator::new(self.momentum.first);
        for first in (start..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let rank = first + vector * R::COUNT;
                let Some((rows, places)) = input.in_order::<R>(rank) else {
                    continue;
                };
                let nodes = input.read::<R>(rows, self.force);
                extremes = self.with_nodes(extremes, rank, &nodes);
                momentum_sums.add(&mut self.momentum, &places, vector, nodes.momentum());
                residual_sums.add(&mut self.residual, &places, vector, input.residual(&nodes));
            }
        }
        residual_sums.flush(&mut self.residual);
        momentum_sums.flush(&mut self.momentum);
        let mut all = RestrictionExtremes::<f32>::none();
        for rank in whole..end {
            let Some(place) = input.places.get(rank) else {
                continue;
            };
            let nodes = input.read::<f32>(Contiguous(place.node()), self.force);
            all = self.with_nodes(all, rank, &nodes);
            if let Some(cell) = self.momentum.get_mut(place.cell()) {
                cell.add(place, nodes.momentum());
            }
            if let Some(cell) = self.residual.get_mut(place.cell()) {
                cell.add(place, input.residual(&nodes));
            }
        }
        for lane in 0..R::COUNT {
            all = all.merged_with(extremes.lane(lane));
        }
        all
    }
}
