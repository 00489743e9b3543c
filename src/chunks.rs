//! How a scene is cut, for threads and for caches. Nodes are cut by their numbers into chunks of equal size. Elements stand in
//! groups: those whose nodes all are in chunk 0, those that reach from chunk 0 into later ones, those within chunk 1, and so on.
//! A thread that has some of the chunks takes the elements that touch them and adds to its own nodes only: nothing is
//! shared, each node sums its elements in the order of the groups, and so the bits are the same however many threads there
//! are. Only elements that reach from one thread's chunks into another's are computed twice.
//!
//! Meshes whose neighbours have distant numbers gain nothing: all their elements reach far.

use core::ops::Range;

use crate::lanes::BLOCK;
use crate::pairs::{Numbered, Unit, units};
use crate::threads::MOST_PARTS;

/// Most chunks of a scene: 1, 2, 3, 4, 6, 8, 12 or 24 threads have equal shares.
pub(crate) const MAX_CHUNKS: usize = 24;

/// Elements a chunk is worth having for: smaller scenes are cut into fewer.
const CHUNK_ELEMENTS: usize = 1536;

/// Chunks have a multiple of so many nodes: what the widest passes over nodes take at once.
const TOGETHER: usize = 32;

/// Chunks of a scene with that many elements.
const fn chunks_for(elements: usize) -> usize {
    let chunks = elements / CHUNK_ELEMENTS;
    if chunks < 1 {
        1
    } else if chunks > MAX_CHUNKS {
        MAX_CHUNKS
    } else {
        chunks
    }
}

/// Blocks needed for that many elements, however they fall into groups: each may end with a block that is not full.
pub(crate) const fn most_blocks(elements: usize) -> usize {
    let groups = 2 * chunks_for(elements) - 1;
    elements.div_ceil(BLOCK) + groups - 1
}

/// Where the chunks of a scene begin and end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunks {
    count: usize,
    /// Nodes of each chunk, the last ones may have fewer.
    size: usize,
    nodes: usize,
    /// Blocks before the end of the elements within each chunk, and of those that reach out of it.
    ends: [[u32; 2]; MAX_CHUNKS],
    /// The last chunk that they reach.
    reach: [u8; MAX_CHUNKS],
}

impl Chunks {
    pub(crate) const NONE: Self =
        Self { count: 0, size: TOGETHER, nodes: 0, ends: [[0; 2]; MAX_CHUNKS], reach: [0; MAX_CHUNKS] };

    /// Pairs and single elements; those of a pair are in the same group.
    pub(crate) fn units(&self, elements: impl Iterator<Item = Numbered>) -> impl Iterator<Item = Unit> {
        let chunks = *self;
        units(elements, move |nodes| chunks.span(nodes))
    }

    /// First and last chunk of an element's nodes.
    fn span(&self, element: [u32; 4]) -> (usize, usize) {
        let chunks = element.map(|node| (node as usize).checked_div(self.size).unwrap_or(0));
        chunks.into_iter().fold((usize::MAX, 0), |(first, last), chunk| (first.min(chunk), last.max(chunk)))
    }

    /// Parts to cut the scene into for a host that asks for `parts`.
    pub(crate) fn parts(&self, parts: usize) -> usize {
        parts.clamp(1, MOST_PARTS).min(self.count)
    }

    /// Chunks of part `part` of `parts`, none of one that is not there.
    pub(crate) fn part(&self, part: usize, parts: usize) -> Range<usize> {
        let start = |part: usize| (part * self.count).checked_div(parts).unwrap_or(0).min(self.count);
        start(part)..start(part + 1)
    }

    /// All of them.
    pub(crate) const fn all(&self) -> Range<usize> {
        0..self.count
    }

    /// Nodes of chunks.
    pub(crate) fn nodes(&self, chunks: &Range<usize>) -> Range<usize> {
        let start = |chunk: usize| (chunk * self.size).min(self.nodes);
        start(chunks.start)..start(chunks.end)
    }

    /// The blocks with all elements that touch chunks, in their order, and some that do not.
    pub(crate) fn touching(&self, chunks: Range<usize>) -> impl Iterator<Item = Range<usize>> {
        let before = (0..chunks.start).filter(move |&chunk| {
            self.reach.get(chunk).is_some_and(|&reach| usize::from(reach) >= chunks.start)
        });
        let own = self.group(chunks.start, 0).start..self.end(chunks.end.saturating_sub(1), 1);
        before.map(|chunk| self.group(chunk, 1)).chain(core::iter::once(own))
    }

    /// Blocks of all elements.
    pub(crate) const fn blocks(&self) -> usize {
        self.ends[MAX_CHUNKS - 1][1] as usize
    }

    /// Blocks before the end of a chunk's elements: of those within it (0), or of those that reach out of it too (1).
    fn end(&self, chunk: usize, group: usize) -> usize {
        self.ends.get(chunk).map_or(0, |ends| ends[group % 2] as usize)
    }

    /// Blocks of one group.
    fn group(&self, chunk: usize, group: usize) -> Range<usize> {
        let start = match (chunk, group) {
            (_, 1) => self.end(chunk, 0),
            (0, _) => 0,
            _ => self.end(chunk - 1, 1),
        };
        start..self.end(chunk, group)
    }
}

/// Gives each element its place.
pub(crate) struct Seats {
    chunks: Chunks,
    groups: [[Group; 2]; MAX_CHUNKS],
}

/// Elements of one group: first pairs that fill blocks, then single elements, among them what is left of the pairs.
#[derive(Clone, Copy, Default)]
struct Group {
    pairs: usize,
    singles: usize,
    taken_pairs: usize,
    taken_singles: usize,
}

impl Group {
    /// Rows of blocks with pairs and of blocks with single elements.
    const fn rows(&self) -> (usize, usize) {
        let pairs = self.pairs / BLOCK;
        (pairs, (self.singles + 2 * (self.pairs - pairs * BLOCK)).div_ceil(BLOCK))
    }
}

impl Seats {
    /// For the units that the elements of a scene make.
    pub(crate) fn of(nodes: usize, elements: impl Iterator<Item = Numbered> + Clone) -> Self {
        let count = chunks_for(elements.clone().count());
        let size = nodes.div_ceil(count).next_multiple_of(TOGETHER);
        let chunks = Chunks { count, size, nodes, ..Chunks::NONE };
        let mut seats = Self { chunks, groups: [[Group::default(); 2]; MAX_CHUNKS] };
        for unit in chunks.units(elements) {
            let (first, last) = chunks.span(unit.nodes());
            let out = usize::from(last > first);
            if let (Some(groups), Some(reach)) =
                (seats.groups.get_mut(first), seats.chunks.reach.get_mut(first))
            {
                match unit {
                    Unit::One(_) => groups[out % 2].singles += 1,
                    Unit::Two(_) => groups[out % 2].pairs += 1,
                }
                *reach = (*reach).max(last as u8);
            }
        }
        let mut end = 0;
        for (ends, groups) in seats.chunks.ends.iter_mut().zip(&seats.groups) {
            for (place, group) in ends.iter_mut().zip(groups) {
                let (pairs, singles) = group.rows();
                end += (2 * pairs + singles) as u32;
                *place = end;
            }
        }
        seats
    }

    /// The chunks.
    pub(crate) const fn chunks(&self) -> &Chunks {
        &self.chunks
    }

    /// Hands the elements of the next unit to their places, block and lane. A lane has consecutive ones of its group: neighbours share nodes,
    /// and in one block the sums at these would wait for each other on their way through memory.
    pub(crate) fn place(&mut self, unit: Unit, mut at: impl FnMut(Numbered, (usize, usize))) {
        let (first, last) = self.chunks.span(unit.nodes());
        let out = usize::from(last > first);
        let start = self.chunks.group(first, out).start;
        let Some(groups) = self.groups.get_mut(first) else { return };
        let group = &mut groups[out % 2];
        let (pairs, singles) = group.rows();
        if let Unit::Two([one, other]) = unit {
            let place = group.taken_pairs;
            if place < pairs * BLOCK {
                group.taken_pairs += 1;
                let lane = place.checked_div(pairs).unwrap_or(0);
                let block = start + 2 * (place - lane * pairs);
                at(one, (block, lane));
                at(other, (block + 1, lane));
                return;
            }
        }
        for element in unit.elements() {
            let place = group.taken_singles;
            group.taken_singles += 1;
            let lane = place.checked_div(singles).unwrap_or(0);
            let block = start + 2 * pairs + (place - lane * singles);
            at(element, (block, lane));
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use proptest::prelude::*;

    /// Blocks and lanes of all elements, by element.
    fn seats(nodes: usize, elements: &[[u32; 4]]) -> (Chunks, Vec<(usize, usize)>) {
        let numbered = elements.iter().enumerate();
        let numbered = numbered.map(|(element, &nodes)| Numbered { element, nodes });
        let mut seats = Seats::of(nodes, numbered.clone());
        let chunks = *seats.chunks();
        let mut places = std::vec![(usize::MAX, 0); elements.len()];
        for unit in chunks.units(numbered) {
            seats.place(unit, |one, place| places[one.element] = place);
        }
        (chunks, places)
    }

    proptest! {
        /// Whatever the numbers, and however many nodes an element's own are apart.
        #[test]
        fn every_part_sees_each_element_that_touches_it_once(
            nodes in 4_usize..3_000, count in 1_usize..12_000, apart in 1_u32..3_000, parts in 1_usize..12,
        ) {
            let number = |at: usize| (at as u32).wrapping_mul(2_654_435_761) >> 8;
            let elements: Vec<[u32; 4]> = (0..count)
                .map(|e| {
                    let first = number(4 * e) % nodes as u32;
                    [0, 1, 2, 3].map(|corner| (first + number(4 * e + corner) % apart) % nodes as u32)
                })
                .collect();
            let (chunks, seats) = seats(nodes, &elements);
            prop_assert!(chunks.blocks() <= most_blocks(count));
            let mut taken: Vec<_> = seats.clone();
            taken.sort_unstable();
            taken.dedup();
            prop_assert_eq!(taken.len(), count, "two elements in one place");

            let parts = chunks.parts(parts);
            let mut next = 0;
            for part in 0..parts {
                let mine = chunks.part(part, parts);
                let own = chunks.nodes(&mine);
                prop_assert_eq!(own.start, next);
                next = own.end;
                let mut visits = std::vec![0; chunks.blocks()];
                let mut last = 0;
                for blocks in chunks.touching(mine) {
                    prop_assert!(blocks.start >= last, "not in the order of the groups");
                    last = blocks.end;
                    visits[blocks].iter_mut().for_each(|visits| *visits += 1);
                }
                prop_assert!(visits.iter().all(|&visits| visits <= 1));
                for (element, (block, _)) in elements.iter().zip(&seats) {
                    let touches = element.iter().any(|&node| own.contains(&(node as usize)));
                    prop_assert!(!touches || visits[*block] == 1);
                }
            }
            prop_assert_eq!(next, nodes);
        }
    }
}
