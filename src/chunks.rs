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

/// Blocks needed for that many elements, however they fall into groups and pairs: each group may end with two blocks of
/// pairs and one of single elements that are not full.
pub(crate) const fn most_blocks(elements: usize) -> usize {
    let groups = 2 * chunks_for(elements) - 1;
    let most = elements.div_ceil(BLOCK) + 3 * groups - 1;
    if most < elements { most } else { elements }
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
    /// Pairs and single elements of each group, in that order.
    units: [[[u32; 2]; 2]; MAX_CHUNKS],
    taken: [[[u32; 2]; 2]; MAX_CHUNKS],
}

/// Blocks and lane of a unit; those of a pair stand one behind the other.
pub(crate) struct Seat {
    pub(crate) block: usize,
    pub(crate) lane: usize,
}

impl Seats {
    /// For the units that the elements of a scene make.
    pub(crate) fn of(nodes: usize, elements: impl Iterator<Item = Numbered> + Clone) -> Self {
        let count = chunks_for(elements.clone().count());
        let size = nodes.div_ceil(count).next_multiple_of(TOGETHER);
        let chunks = Chunks { count, size, nodes, ..Chunks::NONE };
        let none = [[[0; 2]; 2]; MAX_CHUNKS];
        let mut seats = Self { chunks, units: none, taken: none };
        for unit in chunks.units(elements) {
            let (nodes, single) = of_unit(&unit);
            let (first, last) = chunks.span(nodes);
            let out = usize::from(last > first);
            if let (Some(units), Some(reach)) =
                (seats.units.get_mut(first), seats.chunks.reach.get_mut(first))
            {
                units[out % 2][single % 2] += 1;
                *reach = (*reach).max(last as u8);
            }
        }
        let mut end = 0;
        for (ends, units) in seats.chunks.ends.iter_mut().zip(seats.units) {
            *ends = units.map(|[pairs, single]| {
                end += 2 * pairs.div_ceil(BLOCK as u32) + single.div_ceil(BLOCK as u32);
                end
            });
        }
        seats
    }

    /// The chunks.
    pub(crate) const fn chunks(&self) -> &Chunks {
        &self.chunks
    }

    /// The place of the next unit. A lane has consecutive ones of its group: neighbours share nodes, and in one
    /// block the sums at these would wait for each other on their way through memory.
    pub(crate) fn next(&mut self, unit: &Unit) -> Option<Seat> {
        let (nodes, single) = of_unit(unit);
        let (first, last) = self.chunks.span(nodes);
        let group = usize::from(last > first);
        let start = self.chunks.group(first, group).start;
        let [pairs, singles] =
            self.units.get(first)?[group % 2].map(|units| (units as usize).div_ceil(BLOCK));
        let taken = &mut self.taken.get_mut(first)?[group % 2][single % 2];
        let place = *taken as usize;
        *taken += 1;
        let blocks = if single == 0 { pairs } else { singles };
        let lane = place.checked_div(blocks)?;
        let row = place - lane * blocks;
        Some(Seat { block: start + if single == 0 { 2 * row } else { 2 * pairs + row }, lane })
    }
}

/// Nodes that tell the group of a unit, and 0 for a pair, 1 for a single element.
fn of_unit(unit: &Unit) -> ([u32; 4], usize) {
    match unit {
        Unit::One(one) => (one.nodes, 1),
        Unit::Two([one, _]) => (one.nodes, 0),
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
            let Seat { block, lane } = seats.next(&unit).unwrap();
            match unit {
                Unit::One(one) => places[one.element] = (block, lane),
                Unit::Two(both) => {
                    both.iter().enumerate().for_each(|(at, one)| places[one.element] = (block + at, lane));
                }
            }
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
