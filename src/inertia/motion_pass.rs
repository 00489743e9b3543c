//! The pass over the nodes that computes the next increments, vectorised: by the nodes' own inertia, as far as their
//! share of it allows, and by the lattice's motion. It damps rough motion. Gives sums for the energy balance and of
//! rough motion, and over the nodes that were held back. With a lattice it takes the nodes in the order of the cells, so that
//! the coefficients of a cell stay in registers.

use core::ops::Range;

use bytemuck::{must_cast_slice, must_cast_slice_mut};
use glam::Vec4;

use super::cells::{CellPolynomial, VECTORS_PER_TILE, motion_at};
use super::lattice::{LatticeNode, rank_of};
use super::pass_input::{NodeValues, PassInput};
use super::report::HeldBack;
use super::rough_motion::RoughMotion;
use crate::simd::{Contiguous, Kernel, NodeVector, Real, Rows, TILE, dispatch};
use crate::step::{Moving, Sums, Totals, moved};

/// The vector of sums, and the lane in it, that belong to a row of a tile.
#[inline(always)]
fn sums_of_row<R: Real, T>(sums: &[T; VECTORS_PER_TILE], row: usize) -> (&T, usize) {
    (&sums[row / R::COUNT % VECTORS_PER_TILE], R::lane_of_row(row % R::COUNT))
}

/// Sums over held-back nodes, vectorised.
#[derive(Clone, Copy)]
struct HeldSums<R> {
    /// Number of held-back nodes, and sum of the unused shares of their inverse inertia.
    held: R,
    unused: R,
}

impl<R: Real> HeldSums<R> {
    #[inline(always)]
    fn new() -> Self {
        Self { held: R::splat(0.0), unused: R::splat(0.0) }
    }

    /// Adds the shares of a vector of nodes.
    #[inline(always)]
    fn add(&mut self, share: R) {
        let unused = R::splat(1.0) - share;
        self.held = self.held + unused.positive();
        self.unused = self.unused + unused;
    }

    /// The sums; `rest` is for the nodes after the last whole tile.
    #[inline(always)]
    fn total(sums: &[Self; VECTORS_PER_TILE], rest: &HeldSums<f32>) -> HeldBack {
        let mut held_back = HeldBack::NONE;
        for row in 0..TILE {
            let (sums, lane) = sums_of_row::<R, _>(sums, row);
            held_back.add(sums.held.lane(lane), sums.unused.lane(lane));
        }
        held_back.add(rest.held, rest.unused);
        held_back
    }
}

/// The motion of the lattice in a step.
pub(super) struct LatticeMotion<'a> {
    /// Added to the increments of the nodes.
    pub(super) cells: &'a [CellPolynomial],
    /// What nodes do of a motion of the body by themselves.
    pub(super) own_share: f32,
    /// The smooth part of the last increment, if rough motion can be told from it.
    pub(super) smooth: Option<&'a [CellPolynomial]>,
    /// The share of the rest, the rough part, that is removed.
    pub(super) removed: f32,
}

/// The tables of the nodes of some consecutive ranks.
pub(super) struct MotionTables<'a> {
    pub(super) next_increment: &'a mut [NodeVector],
    pub(super) rough: &'a mut [NodeVector],
    pub(super) rough_before: &'a mut [NodeVector],
}

/// Inputs and tables of the pass.
pub(super) struct MotionPass<'a> {
    pub(super) input: PassInput<'a>,
    pub(super) lattice: &'a LatticeMotion<'a>,
    /// Ranks of the nodes.
    pub(super) ranks: Range<usize>,
    pub(super) force: &'a [NodeVector],
    pub(super) tables: MotionTables<'a>,
}

/// Result of [`MotionPass`].
#[derive(Clone, Copy)]
pub(super) struct PassTotals {
    pub(super) totals: Totals,
    pub(super) rough: RoughMotion,
    pub(super) held_back: HeldBack,
}

/// Sums for each axis, vectorised over nodes.
#[derive(Clone, Copy)]
pub(super) struct AxisSums<R> {
    sums: [Sums<R>; 3],
    /// In the order of [`RoughMotion::add`].
    rough: [R; 2],
}

impl<R: Real> AxisSums<R> {
    #[inline(always)]
    pub(super) fn new(input: &PassInput<'_>) -> Self {
        Self { sums: [Sums::new(input.step, R::splat); 3], rough: [R::splat(0.0); 2] }
    }

    /// Adds nodes with their next increments.
    #[inline(always)]
    pub(super) fn add(&mut self, nodes: &NodeValues<R>, next: [R; 4]) {
        for axis in 0..3 {
            let (free, increment, force, next) =
                (nodes.free[axis], nodes.increment[axis], nodes.force[axis], next[axis]);
            self.sums[axis].add(nodes.mass, free, increment, force, next);
        }
    }

    #[inline(always)]
    pub(super) fn total(sums: &[Self; VECTORS_PER_TILE], rest: &AxisSums<f32>, held_back: HeldBack) -> PassTotals {
        let (mut totals, mut rough) = (Totals::NONE, RoughMotion::NONE);
        for row in 0..TILE {
            let (sums, lane) = sums_of_row::<R, _>(sums, row);
            let ([a, b, c], [square, change]) = (&sums.sums, &sums.rough);
            totals.add_axes(&[a.at(lane), b.at(lane), c.at(lane)]);
            rough.add([square.lane(lane), change.lane(lane)]);
        }
        totals.add_axes(&rest.sums);
        rough.add(rest.rough);
        PassTotals { totals, rough, held_back }
    }
}

impl MotionPass<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> PassTotals {
        dispatch(self)
    }
}

impl Kernel for MotionPass<'_> {
    type Output = PassTotals;

    // There are sums for two vectors of a tile.
    const EIGHT: bool = true;

    #[inline(always)]
    fn run<R: Real>(mut self) -> PassTotals {
        let (input, lattice) = (self.input, self.lattice);
        let Range { start, end } = self.ranks;
        let whole = end - (end - start) % TILE;
        let mut sums = [AxisSums::<R>::new(&input); VECTORS_PER_TILE];
        let mut held = [HeldSums::<R>::new(); VECTORS_PER_TILE];
        for first in (start..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let rank = first + vector * R::COUNT;
                let Some((rows, places)) = input.in_order::<R>(rank) else {
                    continue;
                };
                let smooth = lattice.smooth.map_or([R::splat(0.0); 3], |smooth| motion_at(smooth, &places));
                let moved = [motion_at(lattice.cells, &places), smooth];
                let index = vector % VECTORS_PER_TILE;
                self.nodes(Contiguous(rank - start), rows, moved, &mut sums[index], &mut held[index]);
            }
        }
        let (mut rest, mut rest_held) = (AxisSums::new(&input), HeldSums::new());
        for rank in whole..end {
            let Some(place) = input.places.get(rank) else {
                continue;
            };
            let at =
                |cells: &[CellPolynomial]| cells.get(place.cell()).map_or([0.0; 3], |cell| cell.at(place.within()));
            let moved = [at(lattice.cells), lattice.smooth.map_or([0.0; 3], at)];
            self.nodes::<f32>(Contiguous(rank - start), Contiguous(place.node()), moved, &mut rest, &mut rest_held);
        }
        AxisSums::total(&sums, &rest, HeldSums::total(&held, &rest_held))
    }
}

impl MotionPass<'_> {
    /// Computes a vector of nodes: `at` are their rows in the tables, `rows` those in scene and state.
    #[inline(always)]
    fn nodes<R: Real>(
        &mut self,
        at: Contiguous,
        rows: impl Rows,
        [coarse, smooth]: [[R; 3]; 2],
        sums: &mut AxisSums<R>,
        held: &mut HeldSums<R>,
    ) {
        let nodes = self.input.read::<R>(rows, self.force);
        let NodeValues { free, mass, increment, bound, .. } = nodes;
        let [_, _, _, closeness] = at.read::<R>(must_cast_slice(self.tables.next_increment));
        let before = at.read::<R>(must_cast_slice(self.tables.rough));
        at.write(must_cast_slice_mut(self.tables.rough_before), before);
        let scaling = self.input.scaling;
        let inertia = scaling.inertia(mass, closeness * bound);
        let (inverse, own_share) = (R::splat(1.0).divide(inertia), scaling.own_share(mass, inertia));
        let mut own = self.input.residual(&nodes);
        // What the node would do relative to its surroundings, as far as not by its true inertia: of their motion it does
        // its own share where forces are new, and theirs where tissue has yielded to the difference.
        let (mut along, mut square) = (R::splat(0.0), R::splat(f32::MIN_POSITIVE));
        for axis in 0..3 {
            own[axis] = inverse * own[axis];
            along = along + own[axis] * coarse[axis];
            square = square + coarse[axis] * coarse[axis];
        }
        let theirs = R::splat(self.lattice.own_share);
        let ratio = |share: R| share.divide((R::splat(1.0) - theirs).max(R::splat(f32::MIN_POSITIVE)));
        let [one, other] = [ratio(own_share), ratio(theirs)];
        let with_them = along.divide(square).max(one.min(other)).min(one.max(other));
        let mut square = R::splat(0.0);
        for axis in 0..3 {
            let relative = (R::splat(1.0) - own_share) * (own[axis] - free[axis] * with_them * coarse[axis]);
            square = relative.fused(relative, square);
        }
        let share = before[3].divide(square.root()).min(R::splat(1.0));
        held.add(share);
        let carry = R::splat(self.input.step.carry());
        let mut next = [closeness; 4];
        for axis in 0..3 {
            let moved = carry.fused(increment[axis], share.fused(own[axis], coarse[axis]));
            next[axis] = free[axis] * moved;
        }
        if self.lattice.smooth.is_some() {
            let mut rough = before;
            let [square, change] = &mut sums.rough;
            for axis in 0..3 {
                let here = free[axis] * (increment[axis] - smooth[axis]);
                let difference = here - before[axis];
                *square = *square + mass * here * here;
                *change = *change + mass * difference * difference;
                // In a crushed body `here` may be infinite or NaN; with a share of zero it must not be used.
                if self.lattice.removed > 0.0 {
                    next[axis] = next[axis] - R::splat(self.lattice.removed) * here;
                }
                rough[axis] = here;
            }
            at.write(must_cast_slice_mut(self.tables.rough), rough);
        }
        sums.add(&nodes, next);
        at.write(must_cast_slice_mut(self.tables.next_increment), next);
    }
}

/// Moves some consecutive nodes by their next increments.
pub(super) fn apply_increments(first: usize, places: &[LatticeNode], next: &[NodeVector], moving: Moving<'_>) {
    let Moving { displacement, remainder, increment } = moving;
    // The fourth component is no increment.
    let axes = Vec4::new(1.0, 1.0, 1.0, 0.0).cmpgt(Vec4::ZERO);
    for (node, ((displacement, remainder), increment)) in
        (first..).zip(displacement.iter_mut().zip(remainder).zip(increment))
    {
        let next = next.get(rank_of(places, node)).copied().unwrap_or_default();
        let next = Vec4::select(axes, Vec4::from(next.0), Vec4::ZERO);
        let sum = moved(displacement.0.into(), remainder.0.into(), next);
        [displacement.0, remainder.0] = sum.map(|sum| sum.to_array());
        increment.0 = next.to_array();
    }
}
