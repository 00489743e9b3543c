//! Patches: each node with the elements around it, of one tissue. The displacement gradient of a patch is the mean over its elements,
//!
//! ```text
//! H_a = (1 / V_a) sum_b (u_b - u_a) c_ab^T,   c_ab = sum_{e with a, b} V_e / 4 g_b,   V_a = sum_e V_e / 4
//! ```
//! with the gradients `g_b` (1/m) of the shape functions (Dohrmann et al. 2000, "Node-based uniform strain elements"). Tables of
//! [`TILE`] patches as a structure of arrays, and one of their neighbours after the other.

use core::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3};

use super::internal_forces::operations;
use crate::material::Law;
use crate::mesh::partition::MAX_PARTITIONS;
use crate::simd::{Real, TILE, TileNodes};

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
    #[cfg(any(feature = "std", test))]
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
    pub(crate) fn gradient(
        &self,
        neighbours: &[Neighbours],
        lane: usize,
        at: impl Fn(usize) -> DVec3,
    ) -> DMat3 {
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
    #[cfg(feature = "std")]
    pub(crate) fn each_gradient(
        &self,
        neighbours: &[Neighbours],
        lane: usize,
        mut with: impl FnMut(usize, DVec3),
    ) {
        let mut own = DVec3::ZERO;
        for neighbour in neighbours {
            let gradient = DVec3::from_array(neighbour.gradients.map(|row| f64::from(row[lane % TILE])));
            own -= gradient;
            with(neighbour.nodes[lane % TILE] as usize, gradient);
        }
        with(self.nodes[lane % TILE] as usize, own);
    }

    /// Node of the patch at place `lane`.
    #[cfg(feature = "std")]
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
    #[inline(always)]
    pub(super) fn nodes_below<R: Real>(&self, count: usize) -> Option<TileNodes<'_, 1>> {
        TileNodes::in_range::<R>([&self.nodes], 0, count)
    }
}

/// Where the patches of each partition are: first those with all neighbours in it, then those with some in later ones.
#[derive(Clone, Copy, Debug)]
pub struct PatchLayout {
    /// For each group the tile after its last one.
    pub(super) ends: [u32; 2 * MAX_PARTITIONS],
    /// For each partition the last one that its patches have nodes in.
    pub(super) reach: [u8; MAX_PARTITIONS],
}

impl PatchLayout {
    /// Of a scene without patches.
    pub const NONE: Self = Self { ends: [0; 2 * MAX_PARTITIONS], reach: [0; MAX_PARTITIONS] };
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

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(self.tiles) + size_of_val(self.neighbours)
    }

    /// Floating-point operations of internal forces: 51 for a neighbour, and for a patch those of an element with other kinematics,
    /// places without a patch included.
    pub(crate) fn operations<L: Law>(&self) -> u64 {
        let of_patch = u64::from(operations::<L>()) - (63 + 65 + 12) + 9 + 18 + 6;
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
        let groups =
            earlier.map(|partition| 2 * partition + 1).chain(2 * partitions.start..2 * partitions.end);
        let start = move |group: usize| {
            group.checked_sub(1).and_then(|last| self.layout.ends.get(last)).map_or(0, |&end| end as usize)
        };
        groups.flat_map(move |group| self.tiles.get(start(group)..start(group + 1)).unwrap_or_default())
    }

    /// Every patch, as its place.
    pub(crate) fn places(self) -> impl Iterator<Item = (&'a PatchTile, usize)> {
        let places = self.tiles.iter().flat_map(|tile| (0..TILE).map(move |lane| (tile, lane)));
        places.filter(|(tile, lane)| tile.volumes[*lane] > 0.0)
    }
}

#[cfg(any(feature = "std", test))]
pub use build::VecPatches;

#[cfg(any(feature = "std", test))]
mod build {
    use std::vec::Vec;

    use super::{MAX_PARTITIONS, Neighbours, PatchLayout, PatchTile, Patches, TILE};
    use crate::element::ElementTile;
    use crate::mesh::partition::Partitions;

    /// Patches on a host with a heap.
    #[derive(Clone, Debug)]
    pub struct VecPatches {
        tiles: Vec<PatchTile>,
        neighbours: Vec<Neighbours>,
        layout: PatchLayout,
    }

    /// A patch with its neighbours: node, `c_ab`, coupling.
    struct Patch {
        node: u32,
        element: u32,
        volume: f64,
        neighbours: Vec<(u32, [f64; 3], f64)>,
        /// First and last partition of its nodes.
        span: (usize, usize),
    }

    impl VecPatches {
        /// No patches.
        pub(crate) const fn none() -> Self {
            Self { tiles: Vec::new(), neighbours: Vec::new(), layout: PatchLayout::NONE }
        }

        pub(crate) fn view(&self) -> Patches<'_> {
            Patches { tiles: &self.tiles, neighbours: &self.neighbours, layout: &self.layout }
        }

        /// The patches of all nodes, one for each tissue of a node; `region` is the tissue of an element of the mesh. Not generic: compiled
        /// once, not for each material.
        pub(crate) fn build(
            nodes: usize,
            tiles: &[ElementTile],
            partitions: &Partitions,
            region: &dyn Fn(usize) -> u16,
        ) -> Self {
            let mut patches = patches(nodes, tiles, region);
            for patch in &mut patches {
                let of = |node: u32| partitions.of_node(node as usize);
                let all = patch.neighbours.iter().map(|(node, ..)| of(*node)).chain([of(patch.node)]);
                patch.span = all.fold((usize::MAX, 0), |(first, last), at| (first.min(at), last.max(at)));
            }
            // Those with as many neighbours next to each other.
            patches.sort_by_key(|patch| {
                let (first, last) = patch.span;
                (first, last > first, core::cmp::Reverse(patch.neighbours.len()), patch.node)
            });
            let mut built = Self::none();
            for group in 0..2 * MAX_PARTITIONS {
                let is_in =
                    |patch: &&Patch| 2 * patch.span.0 + usize::from(patch.span.1 > patch.span.0) == group;
                let first = patches.partition_point(|patch| {
                    2 * patch.span.0 + usize::from(patch.span.1 > patch.span.0) < group
                });
                let members: Vec<&Patch> = patches[first..].iter().take_while(is_in).collect();
                for patch in &members {
                    let reach = &mut built.layout.reach[patch.span.0];
                    *reach = (*reach).max(patch.span.1 as u8);
                }
                members.chunks(TILE).for_each(|members| built.push(members));
                built.layout.ends[group] = built.tiles.len() as u32;
            }
            built
        }

        fn push(&mut self, members: &[&Patch]) {
            let count = members.iter().map(|patch| patch.neighbours.len()).max().unwrap_or(0);
            let mut tile =
                PatchTile { first: self.neighbours.len() as u32, count: count as u32, ..PatchTile::EMPTY };
            for lane in 0..TILE {
                // Places without a patch name the first one's node and element.
                let patch = members.get(lane).unwrap_or(&members[0]);
                (tile.nodes[lane], tile.elements[lane]) = (patch.node, patch.element);
            }
            for (lane, patch) in members.iter().enumerate() {
                tile.volumes[lane] = patch.volume as f32;
                tile.inverse_volumes[lane] = (1.0 / patch.volume) as f32;
            }
            for index in 0..count {
                let mut entry =
                    Neighbours { nodes: tile.nodes, gradients: [[0.0; TILE]; 3], couplings: [0.0; TILE] };
                for (lane, patch) in members.iter().enumerate() {
                    let Some((node, gradient, coupling)) = patch.neighbours.get(index) else { continue };
                    entry.nodes[lane] = *node;
                    for axis in 0..3 {
                        entry.gradients[axis][lane] = gradient[axis] as f32;
                    }
                    entry.couplings[lane] = *coupling as f32;
                }
                self.neighbours.push(entry);
            }
            self.tiles.push(tile);
        }
    }

    /// The patches in the order of their nodes.
    fn patches(nodes: usize, tiles: &[ElementTile], region: &dyn Fn(usize) -> u16) -> Vec<Patch> {
        let places = || {
            let places = tiles.iter().flat_map(|tile| (0..TILE).map(move |lane| (tile, lane)));
            places.filter(|(tile, lane)| tile.volume::<f32>(*lane) > 0.0)
        };
        // The elements of each node, one list after the other.
        let mut starts = std::vec![0_usize; nodes + 1];
        for (tile, lane) in places() {
            (0..4).for_each(|corner| starts[tile.node(corner, lane) + 1] += 1);
        }
        for node in 0..nodes {
            starts[node + 1] += starts[node];
        }
        let mut filled = starts.clone();
        let mut elements = std::vec![(0_u16, 0_usize, 0_usize); starts[nodes]];
        for (index, tile) in tiles.iter().enumerate() {
            for lane in (0..TILE).filter(|&lane| tile.volume::<f32>(lane) > 0.0) {
                for corner in 0..4 {
                    let at = &mut filled[tile.node(corner, lane)];
                    elements[*at] = (region(tile.element(lane)), index, lane);
                    *at += 1;
                }
            }
        }
        let mut patches = Vec::with_capacity(nodes);
        for node in 0..nodes {
            let around = &mut elements[starts[node]..starts[node + 1]];
            around.sort_unstable();
            for around in around.chunk_by(|one, other| one.0 == other.0) {
                let around = around.iter().map(|&(_, tile, lane)| (&tiles[tile], lane));
                patches.extend(patch(node as u32, around));
            }
        }
        patches
    }

    fn patch<'a>(node: u32, around: impl Iterator<Item = (&'a ElementTile, usize)>) -> Option<Patch> {
        let mut patch = Patch { node, element: 0, volume: 0.0, neighbours: Vec::new(), span: (0, 0) };
        for (tile, lane) in around {
            patch.element = tile.element(lane) as u32;
            let volume = f64::from(tile.volume::<f32>(lane));
            patch.volume += 0.25 * volume;
            let gradient = |corner: usize| -> [f64; 3] {
                let at = |corner: usize, axis: usize| f64::from(tile.gradient_of(corner, axis, lane));
                core::array::from_fn(|axis| match corner {
                    0 => -(at(0, axis) + at(1, axis) + at(2, axis)),
                    _ => at(corner - 1, axis),
                })
            };
            let own = (0..4).find(|&corner| tile.node(corner, lane) == node as usize)?;
            let own_gradient = gradient(own);
            for corner in (0..4).filter(|&corner| corner != own) {
                let (other, gradient) = (tile.node(corner, lane) as u32, gradient(corner));
                let place = patch.neighbours.binary_search_by_key(&other, |(node, ..)| *node);
                let place = place.unwrap_or_else(|place| {
                    patch.neighbours.insert(place, (other, [0.0; 3], 0.0));
                    place
                });
                let (_, sum, coupling) = &mut patch.neighbours[place];
                for axis in 0..3 {
                    sum[axis] += 0.25 * volume * gradient[axis];
                    *coupling -= volume * gradient[axis] * own_gradient[axis];
                }
            }
        }
        (patch.volume > 0.0).then_some(patch)
    }
}
