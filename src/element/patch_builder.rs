//! Builds the tables of patches ([`super::patch`]) in rows that the caller lends, without a heap: their first rows
//! become the tables, their last ones hold lists meanwhile. Time goes with `e log k` for `e` elements, `k` of them
//! around a node. Sums are taken in float64 in the order of the element tables, gradients in 1/m, volumes in m^3.

use bytemuck::{must_cast_mut, must_cast_slice_mut};
use glam::DVec3;

use super::ElementTile;
use super::fibres::{FibreTile, MeanDirections};
use super::patch::{Neighbours, PatchLayout, PatchRow, PatchTile, ROW_WORDS};
use crate::heap_sort::sort;
use crate::mesh::partition::{Partitions, most_groups};
use crate::simd::TILE;

/// Most neighbours of a node that [`patch_rows_for`] counts on.
const USUAL_NEIGHBOURS: usize = 48;

/// Rows of patches ([`PatchRow`], 320 bytes each) that are enough for a body of nodal strain with so many nodes,
/// elements and tissues where the elements of a tissue around a node are joined by faces, and no node has more than 48
/// neighbours. Meshes of organs take half of it; a scene tells how many it takes, and how many it needs where these are
/// too few.
#[must_use]
pub const fn patch_rows_for(nodes: usize, elements: usize, tissues: usize) -> usize {
    let corners = elements.saturating_mul(4);
    let patches = patches_for(nodes, elements, tissues);
    let groups = most_groups(elements);
    // k elements that are joined by faces have k + 2 nodes around their common one at most. Of each tile the patch with
    // the most neighbours counts. Those of the tile before have as many or more, but the first tile of a group has none
    // before.
    let neighbours = patches.saturating_mul(2).saturating_add(corners).div_ceil(TILE);
    let tables = 1 + patches / TILE + groups + neighbours + groups * least(USUAL_NEIGHBOURS, nodes);
    tables + Lists { nodes, corners, patches, around_node: 2 * USUAL_NEIGHBOURS }.rows()
}

/// No fewer patches than any body of so many has.
const fn patches_for(nodes: usize, elements: usize, tissues: usize) -> usize {
    least(nodes.saturating_mul(tissues), elements.saturating_mul(4))
}

/// No fewer tiles of patches than any body of so many has: the last of each group may be partly empty.
pub(crate) const fn patch_tiles_for(nodes: usize, elements: usize, tissues: usize) -> usize {
    patches_for(nodes, elements, tissues) / TILE + most_groups(elements)
}

const fn least(a: usize, b: usize) -> usize {
    if a < b { a } else { b }
}

/// Lengths of the lists that the builder keeps.
struct Lists {
    nodes: usize,
    /// Corners of all elements.
    corners: usize,
    patches: usize,
    /// Most elements around a node.
    around_node: usize,
}

impl Lists {
    const fn rows(&self) -> usize {
        rows_of_halves(self.nodes)
            + rows_of_halves(self.corners)
            + rows_of(self.patches)
            + rows_of(3 * self.around_node)
    }
}

/// Rows that hold so many `u64`.
const fn rows_of(words: usize) -> usize {
    words.div_ceil(ROW_WORDS)
}

/// Rows that hold so many `u32`.
const fn rows_of_halves(halves: usize) -> usize {
    rows_of(halves.div_ceil(2))
}

/// Takes a list of `count` words from the end of the rows.
fn take<'a>(rows: &mut &'a mut [PatchRow], count: usize) -> Option<&'a mut [u64]> {
    let first = rows.len().checked_sub(rows_of(count))?;
    let (rest, taken) = core::mem::take(rows).split_at_mut_checked(first)?;
    *rows = rest;
    must_cast_slice_mut::<PatchRow, u64>(taken).get_mut(..count)
}

/// The same of `u32`.
fn take_halves<'a>(rows: &mut &'a mut [PatchRow], count: usize) -> Option<&'a mut [u32]> {
    must_cast_slice_mut::<u64, u32>(take(rows, count.div_ceil(2))?).get_mut(..count)
}

/// What patches are built from. Corners of elements are numbered: four for each place of each tile.
pub(crate) struct PatchBuilder<'a, F, D> {
    pub(crate) nodes: usize,
    pub(crate) elements: usize,
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) partitions: &'a Partitions,
    /// How many tissues there may be.
    pub(crate) tissues: usize,
    /// The tissue of an element of the mesh.
    pub(crate) region: F,
    /// Unit vectors along the fibres of an element of the mesh.
    pub(crate) directions: D,
}

/// An element around a node: its tile and place, and which of its corners the node is.
#[derive(Clone, Copy)]
struct Corner<'a> {
    tile: &'a ElementTile,
    lane: usize,
    corner: usize,
}

impl Corner<'_> {
    fn node(&self) -> usize {
        self.tile.node(self.corner, self.lane)
    }

    /// m^3.
    fn volume(&self) -> f64 {
        f64::from(self.tile.volume::<f32>(self.lane))
    }

    /// Of the shape function of a corner, 1/m.
    fn gradient(&self, corner: usize) -> [f64; 3] {
        let at = |corner: usize, axis: usize| f64::from(self.tile.gradient_of(corner, axis, self.lane));
        [0, 1, 2].map(|axis| match corner {
            0 => -(at(0, axis) + at(1, axis) + at(2, axis)),
            _ => at(corner - 1, axis),
        })
    }
}

impl<F: Fn(usize) -> u16, D: Fn(usize) -> [DVec3; 2]> PatchBuilder<'_, F, D> {
    /// Fills `rows` with the patches of all nodes, one for each tissue of a node, and gives how many rows these take.
    /// Else how many rows are enough: exactly as many as are needed, if there was room to count them; what
    /// [`patch_rows_for`] tells, if there was not even room for the nodes.
    /// Writes the mean directions of fibres to as many tiles as there are.
    pub(crate) fn build(&self, rows: &mut [PatchRow], fibres: &mut [FibreTile]) -> Result<usize, usize> {
        let mut free = &mut *rows;
        let Some(ends) = take_halves(&mut free, self.nodes) else {
            return Err(patch_rows_for(self.nodes, self.elements, self.tissues));
        };
        let most = self.count_corners(ends);
        let mut lists = self.most_lists(most);
        let around = take_halves(&mut free, lists.corners);
        let (Some(around), Some(pairs)) = (around, take(&mut free, 3 * most)) else {
            return Err(lists.rows() + self.most_rows(&lists));
        };
        self.find_corners(ends, around, pairs);
        let around = &*around;
        let patches = self.patches(around).count();
        let Some(order) = take(&mut free, patches) else {
            return Err(lists.rows() + self.most_rows(&lists));
        };
        lists.patches = patches;
        self.sort_patches(around, order, pairs);
        let (mut tiles, mut neighbours) = (0, 0);
        for members in tiles_of(order) {
            tiles += 1;
            neighbours += members.first().map_or(0, |&key| neighbours_in(key));
        }
        let taken = 1 + tiles + neighbours;
        let Some((layout, rest)) = free.get_mut(..taken).and_then(|rows| rows.split_first_mut()) else {
            return Err(taken + lists.rows());
        };
        let (tiles, neighbours) = rest.split_at_mut_checked(tiles).unwrap_or_default();
        let (tiles, neighbours) = (must_cast_slice_mut(tiles), must_cast_slice_mut(neighbours));
        self.write_fibres(around, order, fibres);
        *must_cast_mut(layout) = self.write(around, order, pairs, tiles, neighbours);
        Ok(taken)
    }

    fn corner(&self, number: u32) -> Option<Corner<'_>> {
        let number = number as usize;
        let tile = self.tiles.get(number / (4 * TILE))?;
        Some(Corner { tile, lane: number / 4 % TILE, corner: number % 4 })
    }

    /// All corners with their numbers, in the order of the tables.
    fn corners(&self) -> impl Iterator<Item = (u32, Corner<'_>)> {
        let numbers = (0..(4 * TILE * self.tiles.len()) as u32).map(|number| (number, self.corner(number)));
        let corners = numbers.filter_map(|(number, corner)| Some((number, corner?)));
        corners.filter(|(_, corner)| corner.volume() > 0.0)
    }

    /// Lists that are long enough where so many elements are around a node at most.
    fn most_lists(&self, around_node: usize) -> Lists {
        let corners = 4 * self.elements;
        let patches = least(self.nodes.saturating_mul(self.tissues), corners);
        Lists { nodes: self.nodes, corners, patches, around_node }
    }

    /// Rows that are enough for the tables of any mesh: with three neighbours for each corner.
    fn most_rows(&self, lists: &Lists) -> usize {
        let groups = most_groups(self.elements);
        let neighbours = (3 * lists.corners).div_ceil(TILE) + groups * 3 * lists.around_node;
        1 + lists.patches / TILE + groups + neighbours
    }

    /// Counts the corners of each node, and gives where the corners of each one begin in a list of all, and how many a
    /// node has at most.
    fn count_corners(&self, starts: &mut [u32]) -> usize {
        starts.fill(0);
        for (_, corner) in self.corners() {
            if let Some(count) = starts.get_mut(corner.node()) {
                *count += 1;
            }
        }
        let (mut sum, mut most) = (0, 0);
        for start in starts {
            most = most.max(*start as usize);
            (sum, *start) = (sum + *start, sum);
        }
        most
    }

    /// Lists the corners of each node, those of a tissue after each other. `starts` become the ends.
    fn find_corners(&self, starts: &mut [u32], around: &mut [u32], sorted: &mut [u64]) {
        for (number, corner) in self.corners() {
            let Some(start) = starts.get_mut(corner.node()) else { continue };
            if let Some(place) = around.get_mut(*start as usize) {
                *place = number;
            }
            *start += 1;
        }
        let mut rest = around;
        let mut first = 0;
        // One tissue's are sorted already.
        for &end in starts.iter().filter(|_| self.tissues > 1) {
            let (of_node, others) =
                core::mem::take(&mut rest).split_at_mut_checked((end - first) as usize).unwrap_or_default();
            (rest, first) = (others, end);
            let sorted = sorted.get_mut(..of_node.len()).unwrap_or_default();
            for (key, &number) in sorted.iter_mut().zip(&*of_node) {
                *key = u64::from(self.region_of(number)) << 32 | u64::from(number);
            }
            sort(sorted, |key| key);
            for (number, &key) in of_node.iter_mut().zip(&*sorted) {
                *number = key as u32;
            }
        }
    }

    fn region_of(&self, number: u32) -> u16 {
        match self.corner(number) {
            Some(corner) if self.tissues > 1 => (self.region)(corner.tile.element(corner.lane)),
            _ => 0,
        }
    }

    /// The patch that begins at a place of the list of corners: the corners of its elements.
    fn patch<'b>(&self, around: &'b [u32], first: usize) -> &'b [u32] {
        let rest = around.get(first..).unwrap_or_default();
        let of = |number: u32| (self.corner(number).map(|corner| corner.node()), self.region_of(number));
        let Some(own) = rest.first().map(|&number| of(number)) else { return rest };
        let count = rest.iter().take_while(|&&number| of(number) == own).count();
        rest.get(..count).unwrap_or_default()
    }

    /// Every patch, with its place in the list of corners.
    fn patches<'b>(&self, around: &'b [u32]) -> impl Iterator<Item = (usize, &'b [u32])> {
        let mut next = 0;
        core::iter::from_fn(move || {
            let (first, patch) = (next, self.patch(around, next));
            next += patch.len();
            (!patch.is_empty()).then_some((first, patch))
        })
    }

    /// For each element of a patch and each of its other nodes that node, and where it was found; by nodes, then in the
    /// order of the elements.
    fn pairs<'b>(&self, patch: &[u32], pairs: &'b mut [u64]) -> &'b [u64] {
        let mut count = 0;
        for (index, &number) in patch.iter().enumerate() {
            let Some(own) = self.corner(number) else { continue };
            for other in (0..4).filter(|&other| other != own.corner) {
                if let Some(pair) = pairs.get_mut(count) {
                    *pair = (own.tile.node(other, own.lane) as u64) << 32 | (4 * index + other) as u64;
                    count += 1;
                }
            }
        }
        let pairs = pairs.get_mut(..count).unwrap_or_default();
        sort(pairs, |pair| pair);
        pairs
    }

    /// Fills `order` with a number for each patch, from the first to the last in the tables: those of a group together,
    /// and in it those with as many neighbours.
    fn sort_patches(&self, around: &[u32], order: &mut [u64], pairs: &mut [u64]) {
        for (key, (first, patch)) in order.iter_mut().zip(self.patches(around)) {
            let own = patch.first().and_then(|&number| self.corner(number)).map_or(0, |own| own.node());
            let of_own = self.partitions.of_node(own);
            let (mut count, mut from, mut to, mut last) = (0, of_own, of_own, None);
            for pair in self.pairs(patch, pairs) {
                let node = (pair >> 32) as usize;
                let partition = self.partitions.of_node(node);
                (from, to) = (from.min(partition), to.max(partition));
                count += usize::from(last != Some(node));
                last = Some(node);
            }
            *key = key_of(2 * from + usize::from(to > from), count, first);
        }
        sort(order, |key| key);
    }

    fn write(
        &self,
        around: &[u32],
        order: &[u64],
        pairs: &mut [u64],
        tiles: &mut [PatchTile],
        neighbours: &mut [Neighbours],
    ) -> PatchLayout {
        let mut layout = PatchLayout::NONE;
        (layout.tiles, layout.neighbours) = (tiles.len() as u32, neighbours.len() as u32);
        let mut first = 0;
        for (index, (tile, members)) in tiles.iter_mut().zip(tiles_of(order)).enumerate() {
            let group = members.first().map_or(0, |&key| group_of(key));
            let count = members.first().map_or(0, |&key| neighbours_in(key));
            let rows = neighbours.get_mut(first..first + count).unwrap_or_default();
            *tile = self.write_tile(around, members, pairs, rows);
            (tile.first, tile.count) = (first as u32, count as u32);
            first += count;
            let reach = tile.nodes.iter().chain(rows.iter().flat_map(|row| &row.nodes));
            let reach = reach.map(|&node| self.partitions.of_node(node as usize)).fold(0, usize::max);
            if let Some(place) = layout.reach.get_mut(group / 2) {
                *place = (*place).max(reach as u8);
            }
            // Also of the groups after it, unless these have tiles of their own.
            layout.ends.iter_mut().skip(group).for_each(|end| *end = index as u32 + 1);
        }
        layout
    }

    fn write_fibres(&self, around: &[u32], order: &[u64], fibres: &mut [FibreTile]) {
        for (tile, members) in fibres.iter_mut().zip(tiles_of(order)) {
            *tile = FibreTile::EMPTY;
            for (lane, &key) in members.iter().enumerate() {
                let mut mean = MeanDirections::NONE;
                for corner in self.patch(around, first_of(key)).iter().filter_map(|&number| self.corner(number)) {
                    mean.add((self.directions)(corner.tile.element(corner.lane)), corner.volume());
                }
                tile.write(lane, mean.directions());
            }
        }
    }

    fn write_tile(&self, around: &[u32], members: &[u64], pairs: &mut [u64], rows: &mut [Neighbours]) -> PatchTile {
        let mut tile = PatchTile::EMPTY;
        for lane in 0..TILE {
            // Places without a patch name the first one's node and element.
            let Some(&key) = members.get(lane).or(members.first()) else { continue };
            let patch = self.patch(around, first_of(key));
            let mut volume = 0.0;
            for corner in patch.iter().filter_map(|&number| self.corner(number)) {
                volume += 0.25 * corner.volume();
                tile.nodes[lane] = corner.node() as u32;
                tile.elements[lane] = corner.tile.element(corner.lane) as u32;
            }
            if lane < members.len() {
                tile.volumes[lane] = volume as f32;
                tile.inverse_volumes[lane] = (1.0 / volume) as f32;
            }
        }
        rows.fill(Neighbours { nodes: tile.nodes, gradients: [[0.0; TILE]; 3], couplings: [0.0; TILE] });
        for (lane, &key) in members.iter().enumerate() {
            self.write_neighbours(self.patch(around, first_of(key)), lane, pairs, rows);
        }
        tile
    }

    /// Writes the neighbours of a patch to place `lane` of the rows.
    fn write_neighbours(&self, patch: &[u32], lane: usize, pairs: &mut [u64], rows: &mut [Neighbours]) {
        let mut rows = rows.iter_mut();
        let mut pairs = self.pairs(patch, pairs).iter().peekable();
        while let (Some(&&pair), Some(row)) = (pairs.peek(), rows.next()) {
            let node = pair >> 32;
            let (mut gradient, mut coupling) = ([0.0; 3], 0.0);
            while let Some(pair) = pairs.next_if(|&&other| other >> 32 == node) {
                let (index, other) = ((*pair as u32 / 4) as usize, (pair % 4) as usize);
                let Some(own) = patch.get(index).and_then(|&number| self.corner(number)) else { continue };
                let (volume, of_own, of_other) = (own.volume(), own.gradient(own.corner), own.gradient(other));
                for axis in 0..3 {
                    gradient[axis] += 0.25 * volume * of_other[axis];
                    coupling -= volume * of_other[axis] * of_own[axis];
                }
            }
            row.nodes[lane % TILE] = node as u32;
            for axis in 0..3 {
                row.gradients[axis][lane % TILE] = gradient[axis] as f32;
            }
            row.couplings[lane % TILE] = coupling as f32;
        }
    }
}

/// Bits of the number of a patch's neighbours and of its place in the list of corners: there are fewer than `2^26`.
const BITS: u32 = 26;
const MASK: u64 = (1 << BITS) - 1;

/// The number by which patches are sorted: by groups, those with many neighbours first, in the order of their nodes and
/// tissues.
fn key_of(group: usize, neighbours: usize, first: usize) -> u64 {
    (group as u64) << (2 * BITS) | ((MASK - neighbours as u64) & MASK) << BITS | first as u64 & MASK
}

fn group_of(key: u64) -> usize {
    (key >> (2 * BITS)) as usize
}

fn neighbours_in(key: u64) -> usize {
    (MASK - (key >> BITS & MASK)) as usize
}

fn first_of(key: u64) -> usize {
    (key & MASK) as usize
}

/// The patches of each tile: of one group, the last ones of a group perhaps fewer than [`TILE`].
fn tiles_of(order: &[u64]) -> impl Iterator<Item = &[u64]> {
    let mut rest = order;
    core::iter::from_fn(move || {
        let group = group_of(*rest.first()?);
        let count = rest.iter().take(TILE).take_while(|&&key| group_of(key) == group).count();
        let (members, others) = rest.split_at_checked(count)?;
        rest = others;
        Some(members)
    })
}
