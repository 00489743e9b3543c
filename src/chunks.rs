//! How a scene is cut, for threads and for caches. Nodes are cut by their numbers into chunks of equal size. Elements stand in
//! groups: those whose nodes all are in chunk 0, those that reach from chunk 0 into later ones, those within chunk 1, and so on.
//! A thread that has some of the chunks takes the elements that touch them and adds to its own nodes only: nothing is
//! shared, each node sums its elements in the order of the groups, and so the bits are the same however many threads there
//! are. Only elements that reach from one thread's chunks into another's are computed twice.
//!
//! Meshes whose neighbours have distant numbers gain nothing: all their elements reach far.

use core::ops::Range;

use crate::chains::{Chain, LONGEST, Numbered, chains};
use crate::lanes::BLOCK;
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

/// What blocks hold of a chunk's elements, in their order: those within it, and those that reach out of it into later chunks;
/// of each first the longest chains that fill blocks, one block for each element of a chain, then shorter ones.
const KINDS: usize = 2 * LONGEST;

/// Where the chunks of a scene begin and end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunks {
    count: usize,
    /// Nodes of each chunk, the last ones may have fewer.
    size: usize,
    nodes: usize,
    /// Blocks before the end of each kind of elements of each chunk.
    ends: [u32; KINDS * MAX_CHUNKS],
    /// The last chunk that they reach.
    reach: [u8; MAX_CHUNKS],
}

impl Chunks {
    pub(crate) const NONE: Self =
        Self { count: 0, size: TOGETHER, nodes: 0, ends: [0; KINDS * MAX_CHUNKS], reach: [0; MAX_CHUNKS] };

    /// All elements in chains; those of a chain are in the same group.
    pub(crate) fn chains(&self, elements: impl Iterator<Item = Numbered>) -> impl Iterator<Item = Chain> {
        let chunks = *self;
        chains(elements, move |nodes| chunks.span(nodes))
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

    /// The blocks with all elements that touch chunks, in their order, and some that do not; and how long the chains in them are.
    pub(crate) fn touching(&self, chunks: Range<usize>) -> impl Iterator<Item = (Range<usize>, usize)> {
        let before = (0..chunks.start).filter(move |&chunk| {
            self.reach.get(chunk).is_some_and(|&reach| usize::from(reach) >= chunks.start)
        });
        let reaching = before.flat_map(|chunk| KINDS * chunk + LONGEST..KINDS * (chunk + 1));
        let own = KINDS * chunks.start..KINDS * chunks.end;
        reaching.chain(own).map(|kind| (self.start(kind)..self.start(kind + 1), LONGEST - kind % LONGEST))
    }

    /// Blocks of all elements.
    pub(crate) fn blocks(&self) -> usize {
        self.start(self.ends.len())
    }

    /// Blocks before those of a chunk's kind of elements, by the number of all kinds of the chunks before it and its own.
    fn start(&self, kind: usize) -> usize {
        kind.checked_sub(1).and_then(|before| self.ends.get(before)).map_or(0, |&end| end as usize)
    }
}

/// Gives each element its place.
pub(crate) struct Seats {
    chunks: Chunks,
    /// Within each chunk, and reaching out of it.
    groups: [[Group; 2]; MAX_CHUNKS],
}

/// Chains of one group, by their length, the longest first, and how many have been given places.
#[derive(Clone, Copy, Default)]
struct Group {
    chains: [usize; LONGEST],
    taken: [usize; LONGEST],
}

impl Group {
    /// Rows of blocks for each length: of chains that fill them, and in the end of single elements, among them what is left
    /// of chains.
    fn rows(&self) -> [usize; LONGEST] {
        let [threes, twos, ones] = self.chains;
        let (three_rows, threes) = (threes / BLOCK, threes % BLOCK);
        let (two_rows, twos) = ((twos + threes) / BLOCK, (twos + threes) % BLOCK);
        [three_rows, two_rows, (ones + threes + 2 * twos).div_ceil(BLOCK)]
    }
}

/// Row and lane of the next place, of so many rows. A lane has consecutive elements: neighbours share nodes, and in one block
/// the sums at these would wait for each other on their way through memory.
fn next_place(taken: &mut usize, rows: usize) -> (usize, usize) {
    let lane = taken.checked_div(rows).unwrap_or(0);
    let row = *taken - lane * rows;
    *taken += 1;
    (row, lane)
}

impl Seats {
    /// For the chains that the elements of a scene make.
    pub(crate) fn of(nodes: usize, elements: impl Iterator<Item = Numbered> + Clone) -> Self {
        let count = chunks_for(elements.clone().count());
        let size = nodes.div_ceil(count).next_multiple_of(TOGETHER);
        let chunks = Chunks { count, size, nodes, ..Chunks::NONE };
        let mut seats = Self { chunks, groups: [[Group::default(); 2]; MAX_CHUNKS] };
        for chain in chunks.chains(elements) {
            let length = chain.elements().len();
            let Some((_, (first, last), group)) = seats.group(&chain) else { continue };
            if let Some(count) = group.chains.get_mut(LONGEST - length) {
                *count += 1;
            }
            if let Some(reach) = seats.chunks.reach.get_mut(first) {
                *reach = (*reach).max(last as u8);
            }
        }
        let mut end = 0;
        let ends = seats.chunks.ends.as_chunks_mut::<LONGEST>().0;
        for (ends, group) in ends.iter_mut().zip(seats.groups.as_flattened()) {
            for ((place, rows), length) in ends.iter_mut().zip(group.rows()).zip((1..=LONGEST).rev()) {
                end += (rows * length) as u32;
                *place = end;
            }
        }
        seats
    }

    /// The chunks.
    pub(crate) const fn chunks(&self) -> &Chunks {
        &self.chunks
    }

    /// The group of a chain, with its number and with the first and the last chunk of its nodes.
    fn group(&mut self, chain: &Chain) -> Option<(usize, (usize, usize), &mut Group)> {
        let (first, last) = self.chunks.span(chain.elements().first()?.nodes);
        let number = 2 * first + usize::from(last > first);
        self.groups.as_flattened_mut().get_mut(number).map(|group| (number, (first, last), group))
    }

    /// Hands the elements of the next chain to their places, block and lane.
    pub(crate) fn place(&mut self, chain: &Chain, mut at: impl FnMut(Numbered, (usize, usize))) {
        let chunks = self.chunks;
        let Some((number, _, group)) = self.group(chain) else { return };
        let rows = group.rows();
        let mut rest = chain.elements();
        while !rest.is_empty() {
            // As long a part of the chain as there is still a place for.
            let kind = (LONGEST - rest.len()..LONGEST - 1)
                .find(|&kind| group.taken[kind % LONGEST] < rows[kind % LONGEST] * BLOCK)
                .unwrap_or(LONGEST - 1);
            let Some((placed, others)) = rest.split_at_checked(LONGEST - kind) else { return };
            rest = others;
            let (row, lane) = next_place(&mut group.taken[kind % LONGEST], rows[kind % LONGEST]);
            let block = chunks.start(LONGEST * number + kind) + row * placed.len();
            for (beside, &element) in placed.iter().enumerate() {
                at(element, (block + beside, lane));
            }
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
        for chain in chunks.chains(numbered) {
            seats.place(&chain, |one, place| places[one.element] = place);
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
                for (blocks, _) in chunks.touching(mine) {
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
