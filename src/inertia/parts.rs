//! The passes over the nodes of a step (`restriction_pass.rs`, `motion_pass.rs`) in parts, one for each thread of the
//! host (`src/step/threads.rs`). Sums are taken for each partition of the scene (`src/mesh/partition.rs`), which has as
//! many ranks as nodes. They are added in the order of the partitions, so the bits do not depend on the number of
//! threads.

use core::array::from_fn;
use core::ops::Range;

use super::added_motion::AddedMotion;
use super::cells::{CellPolynomial, CellSlots};
use super::lattice::LatticeNode;
use super::motion_pass::{LatticeMotion, MotionPass, MotionTables, PassTotals, apply_increments};
use super::node_tables::NodeTables;
use super::pass_input::PassInput;
use super::report::HeldBack;
use super::restriction_pass::RestrictionPass;
use super::rough_motion::RoughMotion;
use crate::mesh::partition::{MAX_PARTITIONS, MOST_PARTS, Partitions};
use crate::simd::NodeVector;
use crate::step::threads::take;
use crate::step::{Moving, Threads, Totals, move_in_parts};

/// The parts of a step: partitions of the nodes, and who computes them.
pub(super) struct NodeParts<'a, T> {
    pub(super) partitions: &'a Partitions,
    pub(super) threads: &'a T,
}

/// What a partition adds to its first cell, of residual and momentum, and its extremes.
#[derive(Clone, Copy)]
struct Restricted {
    heads: [CellPolynomial; 2],
    largest: f32,
}

impl Restricted {
    fn none() -> Self {
        Self { heads: [CellPolynomial::ZERO; 2], largest: 0.0 }
    }
}

/// The partitions of one thread, their cells from `from` on, and results for each partition.
struct RestrictionPart<'a> {
    partitions: Range<usize>,
    from: usize,
    residual: &'a mut [CellPolynomial],
    momentum: &'a mut [CellPolynomial],
    results: &'a mut [Restricted],
}

struct MotionPart<'a> {
    partitions: Range<usize>,
    next_increment: &'a mut [NodeVector],
    rough: &'a mut [NodeVector],
    rough_before: &'a mut [NodeVector],
    results: &'a mut [PassTotals],
}

impl<T: Threads> NodeParts<'_, T> {
    /// Writes the cells' sums of residual, with those of the scalar bounds, and momentum. Gives the largest component of an
    /// increment, m. Not inlined: the lattice's motion does without its stack.
    #[inline(never)]
    pub(super) fn restrict(
        &self,
        input: PassInput<'_>,
        force: &[NodeVector],
        residual: &mut [CellPolynomial],
        momentum: &mut [CellPolynomial],
    ) -> f32 {
        residual.fill(CellPolynomial::ZERO);
        momentum.fill(CellPolynomial::ZERO);
        let mut results = [Restricted::none(); MAX_PARTITIONS];
        let (all, count) = (self.partitions, self.count());
        let (mut rest, mut cells) = (&mut results[..], (&mut *residual, &mut *momentum));
        let mut end = 0;
        let mut parts: [_; MOST_PARTS] = from_fn(|part| {
            let partitions = all.part(part, count);
            let mine = cells_of(&all.nodes(&partitions), input.places);
            // The first cell, whose sum is separate, may be the last one of the part before.
            let from = (mine.start + 1).max(end);
            take(&mut cells.0, from - end);
            take(&mut cells.1, from - end);
            end = mine.end.max(from);
            let (residual, momentum) = (take(&mut cells.0, end - from), take(&mut cells.1, end - from));
            let results = take(&mut rest, partitions.len());
            RestrictionPart { partitions, from, residual, momentum, results }
        });
        self.threads.each(parts.get_mut(..count).unwrap_or_default(), |part| {
            for (partition, result) in part.partitions.clone().zip(&mut *part.results) {
                let (ranks, from) = (all.nodes(&(partition..partition + 1)), part.from);
                let first = cells_of(&ranks, input.places).start;
                let [residual, momentum] = &mut result.heads;
                let residual = CellSlots { first, head: residual, from, rest: &mut *part.residual };
                let momentum = CellSlots { first, head: momentum, from, rest: &mut *part.momentum };
                result.largest = RestrictionPass { input, ranks, force, residual, momentum }.dispatched();
            }
        });
        let mut largest = 0.0;
        for (partition, result) in all.all().zip(&results) {
            let first = cells_of(&all.nodes(&(partition..partition + 1)), input.places).start;
            for (cells, head) in [&mut *residual, &mut *momentum].into_iter().zip(&result.heads) {
                if let Some(cell) = cells.get_mut(first) {
                    cell.add_sums(head);
                }
            }
            largest = f32::max(result.largest, largest);
        }
        largest
    }

    /// Writes the next increments.
    pub(super) fn move_nodes(
        &self,
        input: PassInput<'_>,
        lattice: &LatticeMotion<'_>,
        force: &[NodeVector],
        tables: &mut NodeTables<'_>,
    ) -> PassTotals {
        let mut results = [PassTotals::NONE; MAX_PARTITIONS];
        let NodeTables { next_increment, rough, rough_before, .. } = tables;
        let (mut next, mut rest) = (&mut **next_increment, &mut results[..]);
        let (mut rough, mut before) = (&mut **rough, &mut **rough_before);
        let (all, count) = (self.partitions, self.count());
        let mut parts: [_; MOST_PARTS] = from_fn(|part| {
            let partitions = all.part(part, count);
            let nodes = all.nodes(&partitions).len();
            MotionPart {
                next_increment: take(&mut next, nodes),
                rough: take(&mut rough, nodes),
                rough_before: take(&mut before, nodes),
                results: take(&mut rest, partitions.len()),
                partitions,
            }
        });
        self.threads.each(parts.get_mut(..count).unwrap_or_default(), |part| {
            let mut next = &mut *part.next_increment;
            let (mut rough, mut before) = (&mut *part.rough, &mut *part.rough_before);
            for (partition, result) in part.partitions.clone().zip(&mut *part.results) {
                let ranks = all.nodes(&(partition..partition + 1));
                let nodes = ranks.len();
                let tables = MotionTables {
                    next_increment: take(&mut next, nodes),
                    rough: take(&mut rough, nodes),
                    rough_before: take(&mut before, nodes),
                };
                *result = MotionPass { input, lattice, ranks, force, tables }.dispatched();
            }
        });
        PassTotals::of_all(results.get(all.all()).unwrap_or_default())
    }

    /// Adds a motion of the lattice to the next increments. Gives the sums of all nodes.
    pub(super) fn add_motion(
        &self,
        input: PassInput<'_>,
        cells: &[CellPolynomial],
        force: &[NodeVector],
        mut next: &mut [NodeVector],
    ) -> Totals {
        let mut results = [Totals::NONE; MAX_PARTITIONS];
        let (all, count, mut rest) = (self.partitions, self.count(), &mut results[..]);
        let mut parts: [_; MOST_PARTS] = from_fn(|part| {
            let partitions = all.part(part, count);
            let next = take(&mut next, all.nodes(&partitions).len());
            (take(&mut rest, partitions.len()), next, partitions)
        });
        self.threads.each(parts.get_mut(..count).unwrap_or_default(), |(results, next, partitions)| {
            let mut next = &mut **next;
            for (partition, result) in partitions.clone().zip(&mut **results) {
                let ranks = all.nodes(&(partition..partition + 1));
                let next = take(&mut next, ranks.len());
                *result = AddedMotion { input, cells, ranks, force, next }.dispatched();
            }
        });
        Totals::of_all(results.get(all.all()).unwrap_or_default())
    }

    /// Moves the nodes by their next increments.
    pub(super) fn apply_increments(&self, places: &[LatticeNode], next: &[NodeVector], moving: Moving<'_>) {
        move_in_parts(self.partitions, moving, self.threads, |nodes, moving| {
            apply_increments(nodes.start, places, next, moving);
        });
    }

    fn count(&self) -> usize {
        self.partitions.parts(self.threads.parts())
    }
}

/// The cells of the nodes of some ranks.
fn cells_of(ranks: &Range<usize>, places: &[LatticeNode]) -> Range<usize> {
    let cell = |rank: usize| places.get(rank).map_or(0, LatticeNode::cell);
    if ranks.is_empty() { 0..0 } else { cell(ranks.start)..cell(ranks.end - 1) + 1 }
}

impl PassTotals {
    const NONE: Self = Self { totals: Totals::NONE, rough: RoughMotion::NONE, held_back: HeldBack::NONE };

    /// The totals of all partitions.
    fn of_all(partitions: &[Self]) -> Self {
        let mut all = Self { totals: Totals::of_all(partitions.iter().map(|each| &each.totals)), ..Self::NONE };
        for each in partitions {
            all.rough.merge(&each.rough);
            all.held_back.merge(&each.held_back);
        }
        all
    }
}
