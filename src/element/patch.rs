//! Patches: each node with the elements around it, of one tissue. The displacement gradient of a patch is the mean over
//! its elements,
//!
//! ```text
//! H_a = (1 / V_a) sum_b (u_b - u_a) c_ab^T,   c_ab = sum_{e with a, b} V_e / 4 g_b,   V_a = sum_e V_e / 4
//! ```
//! with the gradients `g_b` (1/m) of the shape functions (Dohrmann et al. 2000, "Node-based uniform strain elements").
//! Tables of [`TILE`] patches as a structure of arrays, and one of their neighbours after the other, in rows of equal
//! size, which [`super::patch_builder`] fills.

use core::ops::Range;

use bytemuck::{Pod, Zeroable, must_cast_ref, must_cast_slice};
use glam::{DMat3, DVec3};

use super::internal_forces::operations;
use super::tile::vector_at;
use crate::material::Law;
use crate::mesh::partition::MAX_PARTITIONS;
use crate::simd::{Real, TILE, TileNodes};

/// Memory for a row of the tables of patches: how many there are, then tiles of patches, then their neighbours.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct PatchRow([u64; ROW_WORDS]);

pub(super) const ROW_WORDS: usize = 40;

impl PatchRow {
    /// An empty row.
    pub const EMPTY: Self = Self([0; ROW_WORDS]);
}

/// [`TILE`] patches. Places without a patch have volume zero.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct PatchTile {
    /// The node of each patch.
    pub(super) nodes: [u32; TILE],
    /// `V_a`, m^3, and one over it.
    pub(super) volumes: [f32; TILE],
    pub(super) inverse_volumes: [f32; TILE],
    /// An element of the mesh in each patch, whose law is that of the patch.
    pub(super) elements: [u32; TILE],
    /// Places of its neighbours among all.
    pub(super) first: u32,
    pub(super) count: u32,
    padding: [u32; 14],
}

impl PatchTile {
    pub(super) const EMPTY: Self = Self {
        nodes: [0; TILE],
        volumes: [0.0; TILE],
        inverse_volumes: [0.0; TILE],
        elements: [0; TILE],
        first: 0,
        count: 0,
        padding: [0; 14],
    };

    /// `H_a` of the patch at place `lane` in float64, from its neighbours and the displacements of nodes.
    pub(crate) fn gradient(&self, neighbours: &[Neighbours], lane: usize, at: impl Fn(usize) -> DVec3) -> DMat3 {
        let mut sum = DMat3::ZERO;
        let own = at(self.nodes[lane % TILE] as usize);
        for neighbour in neighbours {
            let along = at(neighbour.nodes[lane % TILE] as usize) - own;
            let [x, y, z] = neighbour.gradients.map(|row| f64::from(row[lane % TILE]));
            sum += DMat3::from_cols(along * x, along * y, along * z);
        }
        sum * f64::from(self.inverse_volumes[lane % TILE])
    }

    /// Calls `with` with the patch's own node and its neighbours and their `c_ab`, m^2.
    pub(crate) fn each_gradient(&self, neighbours: &[Neighbours], lane: usize, mut with: impl FnMut(usize, DVec3)) {
        let mut own = DVec3::ZERO;
        for neighbour in neighbours {
            let gradient = DVec3::from_array(neighbour.gradients.map(|row| f64::from(row[lane % TILE])));
            own -= gradient;
            with(neighbour.nodes[lane % TILE] as usize, gradient);
        }
        with(self.nodes[lane % TILE] as usize, own);
    }

    /// Node of the patch at place `lane`.
    pub(crate) fn node(&self, lane: usize) -> usize {
        self.nodes[lane % TILE] as usize
    }

    /// `V_a` of the patch at place `lane`, m^3.
    pub(crate) fn volume(&self, lane: usize) -> f64 {
        f64::from(self.volumes[lane % TILE])
    }

    /// Index in the mesh of an element of the patch at place `lane`.
    #[inline(always)]
    pub(crate) fn element(&self, lane: usize) -> usize {
        self.elements[lane % TILE] as usize
    }

    #[inline(always)]
    pub(super) fn nodes_below<R: Real>(&self, count: usize) -> Option<TileNodes<'_, 1>> {
        TileNodes::in_range::<R>([&self.nodes], 0, count)
    }
}

/// A neighbour of each patch of a tile. A patch with fewer neighbours than others has itself for one, with zeros.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Neighbours {
    pub(super) nodes: [u32; TILE],
    /// `c_ab`, m^2.
    pub(super) gradients: [[f32; TILE]; 3],
    /// `-sum_e V_e g_a . g_b`, m.
    pub(super) couplings: [f32; TILE],
}

impl Neighbours {
    /// `c_ab` (m^2) from place `first` of the tile on.
    #[inline(always)]
    pub(super) fn gradient<R: Real>(&self, first: usize) -> [R; 3] {
        let [x, y, z] = &self.gradients;
        [vector_at(x, first), vector_at(y, first), vector_at(z, first)]
    }

    #[inline(always)]
    pub(super) fn nodes_below<R: Real>(&self, count: usize) -> Option<TileNodes<'_, 1>> {
        TileNodes::in_range::<R>([&self.nodes], 0, count)
    }
}

/// How many tiles of patches and rows of neighbours there are, and where the patches of each partition are: first those
/// with all neighbours in it, then those with some in later ones.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct PatchLayout {
    /// For each group the tile after its last one.
    pub(super) ends: [u32; 2 * MAX_PARTITIONS],
    /// For each partition the last one that its patches have nodes in.
    pub(super) reach: [u8; MAX_PARTITIONS],
    pub(super) tiles: u32,
    pub(super) neighbours: u32,
    padding: [u32; 24],
}

impl PatchLayout {
    /// Of a scene without patches.
    pub const NONE: Self =
        Self { ends: [0; 2 * MAX_PARTITIONS], reach: [0; MAX_PARTITIONS], tiles: 0, neighbours: 0, padding: [0; 24] };
}

/// The patches of a scene, none for elements that need none.
#[derive(Clone, Copy, Debug)]
pub struct Patches<'a> {
    pub(super) tiles: &'a [PatchTile],
    pub(super) neighbours: &'a [Neighbours],
    pub(super) layout: &'a PatchLayout,
}

impl<'a> Patches<'a> {
    /// No patches.
    pub const NONE: Self = Self { tiles: &[], neighbours: &[], layout: &PatchLayout::NONE };

    /// The patches in rows that a scene was built with.
    pub(crate) fn of(rows: &'a [PatchRow]) -> Self {
        let Some((layout, rest)) = rows.split_first() else { return Self::NONE };
        let layout: &PatchLayout = must_cast_ref(layout);
        let Some((tiles, rest)) = rest.split_at_checked(layout.tiles as usize) else { return Self::NONE };
        let neighbours = rest.get(..layout.neighbours as usize).unwrap_or_default();
        Self { tiles: must_cast_slice(tiles), neighbours: must_cast_slice(neighbours), layout }
    }

    /// Floating-point operations of internal forces: 51 for a neighbour, and for a patch those of an element with other
    /// kinematics, places without a patch included.
    pub(crate) fn operations<L: Law>(&self, law: &L) -> u64 {
        let of_patch = u64::from(operations(law)) - (63 + 65 + 12) + 9 + 18 + 6;
        TILE as u64 * (51 * self.neighbours.len() as u64 + of_patch * self.tiles.len() as u64)
    }

    /// The neighbours of a tile.
    #[inline(always)]
    pub(crate) fn neighbours_of(&self, tile: &PatchTile) -> &'a [Neighbours] {
        let first = tile.first as usize;
        self.neighbours.get(first..first + tile.count as usize).unwrap_or_default()
    }

    /// Tiles with a node in some partitions (and some others), in their order.
    pub(super) fn touching(self, partitions: Range<usize>) -> impl Iterator<Item = &'a PatchTile> {
        let earlier = (0..partitions.start).filter(move |&partition| {
            self.layout.reach.get(partition).is_some_and(|&reach| usize::from(reach) >= partitions.start)
        });
        let groups = earlier.map(|partition| 2 * partition + 1).chain(2 * partitions.start..2 * partitions.end);
        let start = move |group: usize| {
            group.checked_sub(1).and_then(|last| self.layout.ends.get(last)).map_or(0, |&end| end as usize)
        };
        groups.flat_map(move |group| self.tiles.get(start(group)..start(group + 1)).unwrap_or_default())
    }

    /// Tiles of the patches whose node's partition is one of these.
    pub(crate) fn tiles_of(&self, partitions: &Range<usize>) -> Range<usize> {
        let start = |partition: usize| {
            let end = (2 * partition).checked_sub(1).and_then(|last| self.layout.ends.get(last));
            end.map_or(0, |&end| end as usize)
        };
        start(partitions.start)..start(partitions.end)
    }

    /// The table of patches.
    pub(crate) const fn tiles(&self) -> &'a [PatchTile] {
        self.tiles
    }

    /// Every patch, as its place.
    #[cfg(feature = "std")]
    pub(crate) fn places(self) -> impl Iterator<Item = (&'a PatchTile, usize)> {
        let places = self.tiles.iter().flat_map(|tile| (0..TILE).map(move |lane| (tile, lane)));
        places.filter(|(tile, lane)| tile.volumes[*lane] > 0.0)
    }
}
