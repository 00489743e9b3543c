//! Clusters of the pieces of a body, its elements or with nodal strain its patches: those of a cell of the lattice, of
//! one tissue, that touch held nodes or do not. Within a cluster the tangents are taken to be the same, so the coarse
//! stiffness needs only their sum and the second moments of the gradients of the lattice's functions at rest,
//!
//! ```text
//! Q[c,d,I,J] = 1 / V sum_e V_e G_ec,I G_ed,J,   G_ec = sum_a w_c(a) g_a
//! ```
//! over the free nodes `a` of the pieces, with the eight functions of the cluster's own cell, continued beyond it: so
//! linear motion stays linear, and only functions of one cell are coupled. Where nodes are held along some axes only, a
//! function has a gradient for each axis, and there are moments for each pair of axes.
//!
//! The tangents are those of the pieces of some tiles, always the same ones: all on small meshes.

use core::ops::Range;

use bytemuck::{Pod, Zeroable};
use crate::element::{Axes, ElementMaterial, ElementTile, PatchTile, stabilising_modulus};
use crate::mesh::partition::MAX_PARTITIONS;
use crate::scene::SceneView;
use crate::simd::TILE;

use super::coarse_stiffness::AxisMatrices;
use super::lattice::{Lattice, LatticeNode, eight_weights, node_place};

/// Pairs of the eight functions of a cell, the first not before the second.
pub(super) const PAIRS: usize = 36;
/// Sets of moments of a cluster with nodes that are held along some axes only: one for each pair of axes.
const SETS_OF_AXES: usize = 9;

/// The entries `3 i + j` of the 3 x 3 matrices of all pairs, in vectors of eight pairs.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct PairMatrices(pub(super) [[[f32; 8]; 9]; PAIRS.div_ceil(8)]);

impl PairMatrices {
    pub(super) const ZERO: Self = Self([[[0.0; 8]; 9]; PAIRS.div_ceil(8)]);

    /// The entries of a pair.
    #[inline(always)]
    pub(super) fn of_pair(&self, pair: usize) -> [f32; 9] {
        self.0[pair / 8 % PAIRS.div_ceil(8)].map(|entries| entries[pair % 8])
    }

    fn add(&mut self, pair: usize, entry: usize, value: f32) {
        self.0[pair / 8 % PAIRS.div_ceil(8)][entry % 9][pair % 8] += value;
    }
}

/// One cluster.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Cluster {
    pub(super) cell: u32,
    tissue: u16,
    /// How its nodes are held: see [`Hold`].
    hold: u16,
    /// Its moments, among all.
    first_set: u32,
    /// Its sampled pieces: those of [`Clusters::members`] from this one on, and how many.
    first: u32,
    count: u32,
    /// One more than the next cluster of the same cell.
    next: u32,
    /// Its volume and that of its sampled pieces, m^3.
    pub(super) volume: f32,
    sampled: f32,
}

impl Cluster {
    /// Whether it has moments for each pair of axes.
    pub(super) const fn is_by_axis(&self) -> bool {
        self.hold == Hold::Partly as u16
    }

    /// Its sets of moments.
    pub(super) const fn sets(&self) -> Range<usize> {
        let count = if self.is_by_axis() { SETS_OF_AXES } else { 1 };
        self.first_set as usize..self.first_set as usize + count
    }

    /// Where its sampled pieces are listed.
    pub(super) const fn members(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }

    /// What tangents of its sampled pieces have to be multiplied by to stand for all.
    pub(super) fn factor(&self) -> f32 {
        if self.sampled > 0.0 { self.volume / self.sampled } else { 0.0 }
    }
}

/// The clusters of a cell, with their numbers.
pub(super) fn clusters_of(all: &[Cluster], head: u32) -> impl Iterator<Item = (usize, &Cluster)> {
    let of = move |number: u32| {
        let index = (number as usize).checked_sub(1)?;
        Some((index, all.get(index)?))
    };
    core::iter::successors(of(head), move |(_, cluster)| of(cluster.next))
}

/// How the nodes of a piece are held.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
enum Hold {
    Nowhere,
    /// Some are held along all axes.
    Fully,
    /// Some are held along some axes only.
    Partly,
}

/// The clusters of a scene, in the caller's storage.
pub(super) struct Clusters<'a> {
    pub(super) all: &'a mut [Cluster],
    /// Their moments.
    pub(super) moments: &'a mut [PairMatrices],
    /// For each cell one more than its first cluster, or zero.
    pub(super) heads: &'a mut [u32],
    /// The sampled tiles.
    pub(super) tiles: &'a mut [u32],
    /// The tiles of pieces that touch a node that motions may move, and of elements; as many as there are, then
    /// [`NO_TILE`].
    pub(super) moved: &'a mut [u32],
    pub(super) moved_elements: &'a mut [u32],
    /// The sampled pieces, cluster by cluster: number of the tile among the sampled ones times [`TILE`] plus place.
    pub(super) members: &'a mut [u32],
}

/// Room for clusters of each cell, without several tissues one for each [`Hold`].
const CLUSTERS: usize = 3;
/// Room for their moments.
const SETS: usize = 2 + SETS_OF_AXES;
/// Room for sampled tiles, for each cell and further ones.
const TILES: [usize; 2] = [2, 32];

/// How much of each there can be.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClusterRoom {
    pub(super) clusters: usize,
    pub(super) sets: usize,
    pub(super) tiles: usize,
    /// Tiles of pieces, and of elements.
    pub(super) moved: [usize; 2],
}

impl ClusterRoom {
    /// For this many cells, elements and patches with nodal strain, or fewer.
    pub(super) const fn new(cells: usize, [elements, patches]: [usize; 2]) -> Self {
        // Of each group of a partition the last tile may be partly empty.
        const fn tiles_of(pieces: usize) -> usize {
            pieces.div_ceil(TILE).saturating_add(2 * MAX_PARTITIONS)
        }
        let (all, tiles) = (tiles_of(if patches > 0 { patches } else { elements }), cells.saturating_mul(TILES[0]).saturating_add(TILES[1]));
        Self {
            clusters: cells.saturating_mul(CLUSTERS),
            sets: cells.saturating_mul(SETS),
            tiles: if all < tiles { all } else { tiles },
            moved: [all, if patches > 0 { tiles_of(elements) } else { 0 }],
        }
    }
}

/// How many clusters and sampled tiles a scene has.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ClusterCounts {
    pub(super) clusters: usize,
    pub(super) tiles: usize,
    /// See [`ClusterInput::is_merged`].
    pub(super) is_merged: bool,
}

/// A piece: an element or a patch.
#[derive(Clone, Copy)]
pub(super) enum Piece<'a, M> {
    Element(&'a ElementTile, usize),
    Patch(SceneView<'a, M>, &'a PatchTile, usize),
}

impl<'a, M: ElementMaterial> Piece<'a, M> {
    /// The pieces of tile `tile` of a scene.
    pub(super) fn of_tile(scene: SceneView<'a, M>, tile: usize) -> impl Iterator<Item = (usize, Self)> {
        let elements = if scene.element().is_nodal_strain() { usize::MAX } else { tile };
        let patches = Self::patches(scene, if elements == tile { usize::MAX } else { tile });
        Self::elements(scene, elements).chain(patches)
    }

    /// The elements of a tile.
    pub(super) fn elements(scene: SceneView<'a, M>, tile: usize) -> impl Iterator<Item = (usize, Self)> {
        let tile = scene.tiles.get(tile);
        (0..TILE).filter_map(move |lane| {
            Some((lane, Self::Element(tile.filter(|tile| tile.volume::<f32>(lane) > 0.0)?, lane)))
        })
    }

    fn patches(scene: SceneView<'a, M>, tile: usize) -> impl Iterator<Item = (usize, Self)> {
        let tile = scene.patches.tiles().get(tile);
        (0..TILE).filter_map(move |lane| {
            Some((lane, Self::Patch(scene, tile.filter(|tile| tile.volume(lane) > 0.0)?, lane)))
        })
    }

    /// How many tiles of pieces a scene has.
    pub(super) fn tiles(scene: SceneView<'a, M>) -> usize {
        if scene.element().is_nodal_strain() { scene.patches.tiles().len() } else { scene.tiles.len() }
    }

    /// An element of the mesh in it.
    fn element(&self) -> usize {
        match self {
            Self::Element(tile, lane) => tile.element(*lane),
            Self::Patch(_, tile, lane) => tile.element(*lane),
        }
    }

    /// m^3.
    pub(super) fn volume(&self) -> f32 {
        match self {
            Self::Element(tile, lane) => tile.volume(*lane),
            Self::Patch(_, tile, lane) => tile.volume(*lane) as f32,
        }
    }

    /// Modulus of the stabilising energy of an element with nodal strain, Pa.
    pub(super) fn stabilising_modulus(&self, scene: SceneView<'a, M>) -> f32 {
        stabilising_modulus(&scene.material.laws().of(self.element())) as f32
    }

    /// Calls `visit` with its nodes and the gradients of their functions, 1/m.
    pub(super) fn each_node(&self, mut visit: impl FnMut(usize, [f32; 3])) {
        match self {
            Self::Element(tile, lane) => {
                let mut own = [0.0; 3];
                for corner in 0..3 {
                    let gradient = [0, 1, 2].map(|axis| tile.gradient_of(corner, axis, *lane));
                    own.iter_mut().zip(gradient).for_each(|(own, along)| *own -= along);
                    visit(tile.node(corner + 1, *lane), gradient);
                }
                visit(tile.node(0, *lane), own);
            }
            Self::Patch(scene, tile, lane) => {
                for (node, gradient, _) in tile.gradients(scene.patches.neighbours_of(tile), *lane) {
                    visit(node, gradient);
                }
            }
        }
    }

    /// The cell of its centre: that of the element, or the patch's own node.
    pub(super) fn cell(&self, lattice: &Lattice, places: &[LatticeNode]) -> usize {
        let place = |node: usize| node_place(places, node).copied().unwrap_or_default();
        match self {
            Self::Element(tile, lane) => {
                let mut position = [0.0; 3];
                for at in (0..4).map(|corner| lattice.position(&place(tile.node(corner, *lane)))) {
                    position.iter_mut().zip(at).for_each(|(sum, at)| *sum += 0.25 * at);
                }
                lattice.whole_cell(position)
            }
            Self::Patch(_, tile, lane) => place(tile.node(*lane)).cell(),
        }
    }
}

/// The gradients of a cell's eight functions in a piece, 1/m, for motion along each axis.
pub(super) type FunctionGradients = [[[f32; 3]; 8]; 3];

/// What clusters are made from.
#[derive(Clone, Copy)]
pub(super) struct ClusterInput<'a, M> {
    pub(super) scene: SceneView<'a, M>,
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    /// Tissues are not told apart: for scenes with too many of them.
    pub(super) is_merged: bool,
}

impl<M: ElementMaterial> ClusterInput<'_, M> {
    /// `G_ec` of a piece, for the functions of a cell.
    pub(super) fn gradients(&self, piece: &Piece<'_, M>, cell: usize) -> FunctionGradients {
        let mut gradients = [[[0.0; 3]; 8]; 3];
        piece.each_node(|node, gradient| {
            let place = node_place(self.places, node).copied().unwrap_or_default();
            let weights = eight_weights(self.lattice.within(cell, &place));
            let free = self.scene.inertia.get(node).map_or([0.0; 3], |inertia| inertia.free().truncate().to_array());
            for (gradients, free) in gradients.iter_mut().zip(free) {
                for (sum, weight) in gradients.iter_mut().zip(weights) {
                    sum.iter_mut().zip(gradient).for_each(|(sum, along)| *sum += free * weight * along);
                }
            }
        });
        gradients
    }

    fn hold(&self, piece: &Piece<'_, M>) -> Hold {
        let mut hold = Hold::Nowhere;
        piece.each_node(|node, _| {
            let held = self.scene.inertia.get(node).map_or(0, |inertia| inertia.held_count());
            match held {
                0 => {}
                3 if hold == Hold::Partly => {}
                3 => hold = Hold::Fully,
                _ => hold = Hold::Partly,
            }
        });
        hold
    }

    fn tissue(&self, piece: &Piece<'_, M>) -> u16 {
        if self.is_merged { 0 } else { self.scene.material.laws().tissue(piece.element()) }
    }

    /// Makes the clusters. `None` if there is no room.
    pub(super) fn write(&self, clusters: &mut Clusters<'_>) -> Option<ClusterCounts> {
        clusters.heads.fill(0);
        let (mut count, mut sets) = (0, 0);
        let tiles = Piece::tiles(self.scene);
        for (_, piece) in (0..tiles).flat_map(|tile| Piece::of_tile(self.scene, tile)) {
            let cell = self.cell(&piece);
            let index = match self.find(&piece, cell, clusters.all, clusters.heads) {
                Some(index) => index,
                None => {
                    let (tissue, hold) = (self.tissue(&piece), self.hold(&piece));
                    let head = clusters.heads.get_mut(cell)?;
                    let place = clusters.all.get_mut(count)?;
                    let (cell, first_set) = (cell as u32, sets as u32);
                    *place = Cluster { cell, tissue, hold: hold as u16, first_set, next: *head, ..Cluster::default() };
                    sets += if hold == Hold::Partly { SETS_OF_AXES } else { 1 };
                    clusters.moments.get_mut(first_set as usize..sets)?.fill(PairMatrices::ZERO);
                    count += 1;
                    *head = count as u32;
                    count - 1
                }
            };
            let cluster = clusters.all.get_mut(index)?;
            let volume = piece.volume();
            cluster.volume += volume;
            let gradients = self.gradients(&piece, cell);
            let first = cluster.first_set as usize;
            if cluster.is_by_axis() {
                for (set, (i, j)) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).enumerate() {
                    add_moments(clusters.moments.get_mut(first + set)?, volume, [&gradients[i], &gradients[j]]);
                }
            } else {
                add_moments(clusters.moments.get_mut(first)?, volume, [&gradients[0]; 2]);
            }
        }
        for cluster in clusters.all.get(..count).unwrap_or_default() {
            for moments in clusters.moments.get_mut(cluster.sets()).unwrap_or_default() {
                moments.0.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|value| *value /= cluster.volume);
            }
        }
        self.list_moved(clusters);
        let sampled = self.sample(clusters, count)?;
        Some(ClusterCounts { clusters: count, tiles: sampled, is_merged: self.is_merged })
    }

    /// Lists the tiles at supports that motions may move.
    fn list_moved(&self, clusters: &mut Clusters<'_>) {
        let moves = |piece: &Piece<'_, M>| {
            let mut moves = false;
            piece.each_node(|node, _| moves |= self.scene.movable(node) != Axes::NONE);
            moves
        };
        let of_pieces = (0..Piece::tiles(self.scene))
            .filter(|tile| Piece::of_tile(self.scene, *tile).any(|(_, piece)| moves(&piece)));
        let of_elements = (0..self.scene.tiles.len())
            .filter(|tile| Piece::elements(self.scene, *tile).any(|(_, piece)| moves(&piece)));
        clusters.moved.fill(NO_TILE);
        clusters.moved_elements.fill(NO_TILE);
        clusters.moved.iter_mut().zip(of_pieces).for_each(|(place, tile)| *place = tile as u32);
        clusters.moved_elements.iter_mut().zip(of_elements).for_each(|(place, tile)| *place = tile as u32);
    }

    /// Chooses the tiles: every one, or one of some; and further ones for clusters that have none.
    fn sample(&self, clusters: &mut Clusters<'_>, count: usize) -> Option<usize> {
        let Clusters { all, heads, tiles, members, .. } = clusters;
        let (most, of_scene) = (tiles.len(), Piece::tiles(self.scene));
        // A part of the room is for clusters that a regular sample misses.
        let spacing = if of_scene <= most { 1 } else { of_scene.div_ceil(most - most / 4) };
        let mut chosen = 0;
        for tile in (0..of_scene).step_by(spacing) {
            *tiles.get_mut(chosen)? = tile as u32;
            chosen += 1;
            self.enter(tile, all, heads);
        }
        for tile in (0..of_scene).filter(|tile| tile % spacing != 0) {
            let misses = Piece::of_tile(self.scene, tile).any(|(_, piece)| {
                let index = self.find(&piece, self.cell(&piece), all, heads);
                index.and_then(|index| all.get(index)).is_some_and(|cluster| cluster.count < LEAST_SAMPLED)
            });
            if misses && chosen < most {
                *tiles.get_mut(chosen)? = tile as u32;
                chosen += 1;
                self.enter(tile, all, heads);
            }
        }
        let mut first = 0;
        for cluster in all.iter_mut().take(count) {
            cluster.first = first;
            first += cluster.count;
            cluster.count = 0;
        }
        for (place, &tile) in tiles.iter().take(chosen).enumerate() {
            for (lane, piece) in Piece::of_tile(self.scene, tile as usize) {
                let cluster = all.get_mut(self.find(&piece, self.cell(&piece), all, heads)?)?;
                *members.get_mut((cluster.first + cluster.count) as usize)? = (place * TILE + lane) as u32;
                cluster.count += 1;
            }
        }
        Some(chosen)
    }

    /// Counts the pieces of a tile as sampled.
    fn enter(&self, tile: usize, all: &mut [Cluster], heads: &[u32]) {
        for (_, piece) in Piece::of_tile(self.scene, tile) {
            let index = self.find(&piece, self.cell(&piece), all, heads);
            if let Some(cluster) = index.and_then(|index| all.get_mut(index)) {
                cluster.count += 1;
                cluster.sampled += piece.volume();
            }
        }
    }

    fn cell(&self, piece: &Piece<'_, M>) -> usize {
        piece.cell(self.lattice, self.places)
    }

    /// The cluster of a piece in a cell.
    pub(super) fn find(&self, piece: &Piece<'_, M>, cell: usize, all: &[Cluster], heads: &[u32]) -> Option<usize> {
        let (tissue, hold) = (self.tissue(piece), self.hold(piece) as u16);
        let mut next = heads.get(cell).copied()?;
        // Each has another number than the others, so this ends.
        while let Some(index) = (next as usize).checked_sub(1) {
            let cluster = all.get(index)?;
            if cluster.tissue == tissue && cluster.hold == hold {
                return Some(index);
            }
            next = cluster.next;
        }
        None
    }
}

/// Ends a list of tiles.
pub(super) const NO_TILE: u32 = u32::MAX;

/// Fewest sampled pieces of a cluster that has as many.
const LEAST_SAMPLED: u32 = 8;

/// Calls `visit` with each pair and its functions.
#[inline(always)]
pub(super) fn for_each_pair(mut visit: impl FnMut(usize, usize, usize)) {
    let mut pair = 0;
    for c in 0..8 {
        for d in 0..=c {
            visit(pair, c, d);
            pair += 1;
        }
    }
}

fn add_moments(moments: &mut PairMatrices, volume: f32, [first, second]: [&[[f32; 3]; 8]; 2]) {
    for_each_pair(|pair, c, d| {
        for (i, along) in first[c].into_iter().enumerate() {
            for (j, across) in second[d].into_iter().enumerate() {
                moments.add(pair, 3 * i + j, volume * along * across);
            }
        }
    });
}

impl<M: ElementMaterial> ClusterInput<'_, M> {
    /// The stiffness of the stabilising energy of nodal strain in each cell, N/m:
    /// `s mu sum_e V_e G_ec . G_ed I` over the elements.
    pub(super) fn write_stabilising(&self, cells: &mut [AxisMatrices]) {
        cells.fill([[0.0; 4]; _]);
        for (_, piece) in (0..self.scene.tiles.len()).flat_map(|tile| Piece::elements(self.scene, tile)) {
            let cell = piece.cell(self.lattice, self.places);
            let Some(matrices) = cells.get_mut(cell) else { continue };
            let gradients = self.gradients(&piece, cell);
            let weight = piece.volume() * piece.stabilising_modulus(self.scene);
            for_each_pair(|pair, c, d| {
                for (axis, gradients) in gradients.iter().enumerate() {
                    let product: f32 = gradients[c].iter().zip(gradients[d]).map(|(a, b)| a * b).sum();
                    matrices[pair % PAIRS][axis] += weight * product;
                }
            });
        }
    }
}
