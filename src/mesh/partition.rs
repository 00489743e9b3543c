//! Partition of a scene for threads and caches. Nodes are split by their indices into partitions of equal size.
//! Elements are sorted into two groups for each partition: elements whose nodes are all in it, and elements that also
//! have nodes in later partitions.
//!
//! A thread that owns some partitions computes all elements that touch them, and adds forces to its own nodes only. So
//! threads share no memory, and each node sums its elements in the order of the groups: the bits do not depend on the
//! number of threads. Only elements with nodes of two threads are computed twice. A mesh whose neighbours have distant
//! indices gains nothing, as most of its elements have nodes of several partitions; [`super::renumber`] helps.

use core::ops::Range;

use super::strips::{LONGEST, Numbered, Strip, strips};
use crate::simd::TILE;

/// Most parts into which a step can be split.
pub const MOST_PARTS: usize = 8;

/// Most partitions of a scene. 1, 2, 3, 4, 6, 8, 12 or 24 threads get equal shares of 24.
pub(crate) const MAX_PARTITIONS: usize = 24;

/// Fewest elements of a partition: smaller scenes have fewer partitions.
const PARTITION_ELEMENTS: usize = 1536;

/// The nodes of a partition are a multiple of this, what the widest loops over nodes take at once.
const NODE_MULTIPLE: usize = 32;

/// Number of partitions of a scene with that many elements.
const fn partitions_for(elements: usize) -> usize {
    let partitions = elements / PARTITION_ELEMENTS;
    if partitions < 1 {
        1
    } else if partitions > MAX_PARTITIONS {
        MAX_PARTITIONS
    } else {
        partitions
    }
}

/// Most groups of elements of a scene with that many: two for each partition, one for the last.
pub(crate) const fn most_groups(elements: usize) -> usize {
    2 * partitions_for(elements) - 1
}

/// Most tiles that this many elements can need: the last tile of each group may be partly empty.
pub(crate) const fn most_tiles(elements: usize) -> usize {
    elements.div_ceil(TILE) + most_groups(elements) - 1
}

/// Kinds of elements of a partition: for each of its two groups, strips of three, two and one elements. Tiles are in
/// this order. Strips of three take three tiles at a time, one for each element of a strip.
const KINDS: usize = 2 * LONGEST;

/// Nodes and tiles of the partitions of a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Partitions {
    count: usize,
    /// Nodes of a partition; the last ones may have fewer.
    size: usize,
    nodes: usize,
    /// For each kind of elements of each partition, the tile after its last one.
    ends: [u32; KINDS * MAX_PARTITIONS],
    /// For each partition, the last partition in which its elements have nodes.
    reach: [u8; MAX_PARTITIONS],
}

impl Partitions {
    pub(crate) const NONE: Self =
        Self { count: 0, size: NODE_MULTIPLE, nodes: 0, ends: [0; KINDS * MAX_PARTITIONS], reach: [0; MAX_PARTITIONS] };

    /// All elements in strips; the elements of a strip belong to the same group.
    pub(crate) fn strips(&self, elements: impl Iterator<Item = Numbered>) -> impl Iterator<Item = Strip> {
        let partitions = *self;
        strips(elements, move |nodes| partitions.span(nodes))
    }

    /// The partition of a node.
    pub(crate) fn of_node(&self, node: usize) -> usize {
        node.checked_div(self.size).unwrap_or(0)
    }

    /// First and last partition of an element's nodes.
    fn span(&self, nodes: [u32; 4]) -> (usize, usize) {
        let partitions = nodes.map(|node| self.of_node(node as usize));
        partitions
            .into_iter()
            .fold((usize::MAX, 0), |(first, last), partition| (first.min(partition), last.max(partition)))
    }

    /// Number of parts of a step for a host that asks for `parts`: at most one for each partition.
    pub(crate) fn parts(&self, parts: usize) -> usize {
        parts.clamp(1, MOST_PARTS).min(self.count)
    }

    /// Partitions of part `part` of `parts`; none if there is no such part.
    pub(crate) fn part(&self, part: usize, parts: usize) -> Range<usize> {
        let start = |part: usize| (part * self.count).checked_div(parts).unwrap_or(0).min(self.count);
        start(part)..start(part + 1)
    }

    /// All partitions.
    pub(crate) const fn all(&self) -> Range<usize> {
        0..self.count
    }

    /// Nodes of some partitions.
    pub(crate) fn nodes(&self, partitions: &Range<usize>) -> Range<usize> {
        let start = |partition: usize| (partition * self.size).min(self.nodes);
        start(partitions.start)..start(partitions.end)
    }

    /// Ranges of tiles, in their order, that hold all elements with a node in the given partitions (and some others),
    /// with the length of their strips.
    pub(crate) fn touching(&self, partitions: Range<usize>) -> impl Iterator<Item = (Range<usize>, usize)> {
        let own = KINDS * partitions.start..KINDS * partitions.end;
        self.reaching(partitions.start)
            .flatten()
            .chain(own)
            .map(|kind| (self.start(kind)..self.start(kind + 1), LONGEST - kind % LONGEST))
    }

    /// The same tiles in as few ranges as hold no others.
    pub(crate) fn tiles_touching(&self, partitions: Range<usize>) -> impl Iterator<Item = Range<usize>> {
        let own = self.tiles_of(&partitions);
        let reaching = self.reaching(partitions.start);
        let ranges = reaching.map(|kinds| self.start(kinds.start)..self.start(kinds.end));
        ranges.chain([own])
    }

    /// For each earlier partition with elements that have nodes in partition `first` or later ones, the kinds of its
    /// elements with nodes in other partitions.
    fn reaching(&self, first: usize) -> impl Iterator<Item = Range<usize>> {
        let earlier = (0..first)
            .filter(move |&partition| self.reach.get(partition).is_some_and(|&reach| usize::from(reach) >= first));
        earlier.map(|partition| KINDS * partition + LONGEST..KINDS * (partition + 1))
    }

    /// Tiles of the elements whose first partition is one of these.
    pub(crate) fn tiles_of(&self, partitions: &Range<usize>) -> Range<usize> {
        self.start(KINDS * partitions.start)..self.start(KINDS * partitions.end)
    }

    /// Number of tiles of all elements.
    pub(crate) fn tiles(&self) -> usize {
        self.start(self.ends.len())
    }

    /// First tile of a kind of elements; `kind` counts the kinds of all partitions, [`KINDS`] for each.
    fn start(&self, kind: usize) -> usize {
        kind.checked_sub(1).and_then(|previous| self.ends.get(previous)).map_or(0, |&end| end as usize)
    }
}

/// Assigns each element to a place in a tile.
pub(crate) struct PartitionLayout {
    partitions: Partitions,
    /// For each partition, the elements within it and those with nodes in later partitions.
    groups: [[Group; 2]; MAX_PARTITIONS],
}

/// Number of strips of one group, by their length, the longest first, and number of places already assigned.
#[derive(Clone, Copy, Default)]
struct Group {
    strips: [usize; LONGEST],
    taken: [usize; LONGEST],
}

impl Group {
    /// Rows of tiles for each length of strips; a row for strips of three is three tiles. Strips that do not fill a row
    /// are split into shorter ones.
    fn rows(&self) -> [usize; LONGEST] {
        let [threes, twos, ones] = self.strips;
        let (three_rows, threes) = (threes / TILE, threes % TILE);
        let (two_rows, twos) = ((twos + threes) / TILE, (twos + threes) % TILE);
        [three_rows, two_rows, (ones + threes + 2 * twos).div_ceil(TILE)]
    }
}

/// Row and lane of the next place in a number of rows. Consecutive elements go to the same lane of consecutive rows.
/// Neighbours share nodes; in one tile the additions to a shared node would have to wait for each other.
fn next_place(taken: &mut usize, rows: usize) -> (usize, usize) {
    let lane = taken.checked_div(rows).unwrap_or(0);
    let row = *taken - lane * rows;
    *taken += 1;
    (row, lane)
}

impl PartitionLayout {
    /// A layout for the elements of a scene.
    pub(crate) fn of(nodes: usize, elements: impl Iterator<Item = Numbered> + Clone) -> Self {
        let count = partitions_for(elements.clone().count());
        let size = nodes.div_ceil(count).next_multiple_of(NODE_MULTIPLE);
        let partitions = Partitions { count, size, nodes, ..Partitions::NONE };
        let mut layout = Self { partitions, groups: [[Group::default(); 2]; MAX_PARTITIONS] };
        for strip in partitions.strips(elements) {
            let length = strip.elements().len();
            let Some((_, (first, last), group)) = layout.group(&strip) else { continue };
            if let Some(count) = group.strips.get_mut(LONGEST - length) {
                *count += 1;
            }
            if let Some(reach) = layout.partitions.reach.get_mut(first) {
                *reach = (*reach).max(last as u8);
            }
        }
        let mut end = 0;
        let ends = layout.partitions.ends.as_chunks_mut::<LONGEST>().0;
        for (ends, group) in ends.iter_mut().zip(layout.groups.as_flattened()) {
            for ((place, rows), length) in ends.iter_mut().zip(group.rows()).zip((1..=LONGEST).rev()) {
                end += (rows * length) as u32;
                *place = end;
            }
        }
        layout
    }

    /// The partitions.
    pub(crate) const fn partitions(&self) -> &Partitions {
        &self.partitions
    }

    /// The group of a strip, with its index and the first and last partition of its nodes.
    fn group(&mut self, strip: &Strip) -> Option<(usize, (usize, usize), &mut Group)> {
        let (first, last) = self.partitions.span(strip.elements().first()?.nodes);
        let index = 2 * first + usize::from(last > first);
        self.groups.as_flattened_mut().get_mut(index).map(|group| (index, (first, last), group))
    }

    /// Calls `at` with each element of the next strip and its place, tile and lane.
    pub(crate) fn place(&mut self, strip: &Strip, mut at: impl FnMut(Numbered, (usize, usize))) {
        let partitions = self.partitions;
        let Some((index, _, group)) = self.group(strip) else { return };
        let rows = group.rows();
        let mut rest = strip.elements();
        while !rest.is_empty() {
            // The longest part of the strip for which a place is left.
            let kind = (LONGEST - rest.len()..LONGEST - 1)
                .find(|&kind| group.taken[kind % LONGEST] < rows[kind % LONGEST] * TILE)
                .unwrap_or(LONGEST - 1);
            let Some((placed, others)) = rest.split_at_checked(LONGEST - kind) else { return };
            rest = others;
            let (row, lane) = next_place(&mut group.taken[kind % LONGEST], rows[kind % LONGEST]);
            let tile = partitions.start(LONGEST * index + kind) + row * placed.len();
            for (offset, &element) in placed.iter().enumerate() {
                at(element, (tile + offset, lane));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use proptest::prelude::*;

    /// The partitions, and tile and lane of each element.
    fn layout(nodes: usize, elements: &[[u32; 4]]) -> (Partitions, Vec<(usize, usize)>) {
        let numbered = elements.iter().enumerate();
        let numbered = numbered.map(|(element, &nodes)| Numbered { element, nodes });
        let mut layout = PartitionLayout::of(nodes, numbered.clone());
        let partitions = *layout.partitions();
        let mut places = std::vec![(usize::MAX, 0); elements.len()];
        for strip in partitions.strips(numbered) {
            layout.place(&strip, |element, place| places[element.element] = place);
        }
        (partitions, places)
    }

    proptest! {
        /// For random nodes, at most `apart` indices from each other in an element.
        #[test]
        fn every_part_computes_each_element_that_touches_it_once(
            nodes in 4_usize..3_000, count in 1_usize..12_000, apart in 1_u32..3_000, parts in 1_usize..12,
        ) {
            let random = |at: usize| (at as u32).wrapping_mul(2_654_435_761) >> 8;
            let elements: Vec<[u32; 4]> = (0..count)
                .map(|e| {
                    let first = random(4 * e) % nodes as u32;
                    [0, 1, 2, 3].map(|corner| (first + random(4 * e + corner) % apart) % nodes as u32)
                })
                .collect();
            let (partitions, layout) = layout(nodes, &elements);
            prop_assert!(partitions.tiles() <= most_tiles(count));
            let mut taken: Vec<_> = layout.clone();
            taken.sort_unstable();
            taken.dedup();
            prop_assert_eq!(taken.len(), count, "two elements in one place");

            let parts = partitions.parts(parts);
            let mut next_node = 0;
            for part in 0..parts {
                let mine = partitions.part(part, parts);
                let own = partitions.nodes(&mine);
                prop_assert_eq!(own.start, next_node);
                next_node = own.end;
                let mut visits = std::vec![0; partitions.tiles()];
                let mut last = 0;
                for (tiles, _) in partitions.touching(mine) {
                    prop_assert!(tiles.start >= last, "not in the order of the groups");
                    last = tiles.end;
                    visits[tiles].iter_mut().for_each(|visits| *visits += 1);
                }
                prop_assert!(visits.iter().all(|&visits| visits <= 1));
                for (element, (tile, _)) in elements.iter().zip(&layout) {
                    let touches = element.iter().any(|&node| own.contains(&(node as usize)));
                    prop_assert!(!touches || visits[*tile] == 1);
                }
            }
            prop_assert_eq!(next_node, nodes);
        }
    }
}
