//! Clusters of the elements of a body: those of a cell of the lattice, of one tissue, that touch held nodes or do not.
//! Within a cluster the tangents are taken to be the same, so the coarse stiffness needs only their sum and the second
//! moments of the gradients of the lattice's functions at rest,
//!
//! ```text
//! Q[c,d,I,J] = 1 / V sum_e V_e G_ec,I G_ed,J,   G_ec = sum_a w_c(a) g_a
//! ```
//! over the free nodes `a` of the elements, with the eight functions of the cluster's own cell, continued beyond it: so
//! linear motion stays linear, and only functions of one cell are coupled. Where nodes are held along some axes only, a
//! function has several gradients, and there are moments for each pair of them.
//!
//! With nodal strain the energy is that of patches, which have the mean gradients of their elements, and a stabilising
//! energy for what the mean does not see. By convexity it is at most that of the elements with the patches' tangents.
//!
//! The tangents are those of the elements or patches of some tiles, always the same ones: all on small meshes.

use core::ops::Range;

use crate::element::{Axes, ElementMaterial, ElementTile, NodeInertia, PatchTile};
use crate::mesh::partition::MAX_PARTITIONS;
use crate::scene::SceneView;
use crate::simd::TILE;
use bytemuck::{Pod, Zeroable};

use super::lattice::{Lattice, LatticeNode, eight_weights, node_place};

/// Pairs of the eight functions of a cell, the first not before the second.
pub(super) const PAIRS: usize = 36;

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

    /// Makes the sum over all functions zero, which it is but for rounding where none is held: a translation shall meet
    /// no resistance even where that of volume is a hundred thousand times the inertia.
    fn balance(&mut self) {
        let mut sums = [[0.0f32; 9]; 8];
        for_each_pair(|pair, c, d| {
            for (entry, value) in self.of_pair(pair).into_iter().enumerate() {
                sums[c][entry] += value;
                if c != d {
                    sums[d][3 * (entry % 3) + entry / 3] += value;
                }
            }
        });
        for_each_pair(|pair, c, d| {
            for entry in (0..9).filter(|_| c == d) {
                self.add(pair, entry, -0.5 * (sums[c][entry] + sums[c][3 * (entry % 3) + entry / 3]));
            }
        });
    }

    fn add(&mut self, pair: usize, entry: usize, value: f32) {
        self.0[pair / 8 % PAIRS.div_ceil(8)][entry % 9][pair % 8] += value;
    }
}

/// Bit of clusters with a node that motions may move.
const MOVES: u8 = 8;

/// One cluster.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Cluster {
    pub(super) cell: u32,
    tissue: u16,
    /// How its nodes are held: see [`Hold`].
    hold: u8,
    /// Bits of the axes x and y, y and z, z and x, if some node is held along one of the two, and [`MOVES`].
    differs: u8,
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
    fn is_held_still(&self) -> bool {
        self.hold != Hold::Nowhere as u8 && self.differs & MOVES == 0
    }

    /// For each axis the number of its gradients: axes along which the same nodes are held have the same.
    pub(super) const fn gradients(&self) -> [usize; 3] {
        let [xy, yz, zx] = [self.differs & 1 != 0, self.differs & 2 != 0, self.differs & 4 != 0];
        let y = if xy { 1 } else { 0 };
        [
            0,
            y,
            if !zx {
                0
            } else if !yz {
                y
            } else {
                y + 1
            },
        ]
    }

    /// How many gradients it has, with moments for each pair.
    pub(super) const fn gradient_count(&self) -> usize {
        let [_, y, z] = self.gradients();
        1 + if y > z { y } else { z }
    }

    /// Its sets of moments.
    pub(super) const fn sets(&self) -> Range<usize> {
        let count = self.gradient_count();
        self.first_set as usize..self.first_set as usize + count * count
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
#[derive(Clone, Copy, Debug, Eq, Ord, PartialEq, PartialOrd)]
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
    /// The tiles of elements that touch a node that motions may move, as many as there are, then [`NO_TILE`].
    pub(super) moved: &'a mut [u32],
    /// The sampled pieces, cluster by cluster: number of the tile among the sampled ones times [`TILE`] plus place.
    pub(super) members: &'a mut [u32],
}

/// Room for clusters of each cell, without several tissues one for each [`Hold`].
const CLUSTERS: usize = 3;
/// Room for their moments, for each cell and further ones: of a body with few cells nearly all may be needed.
const SETS: [usize; 2] = [6, 6];
/// Room for sampled tiles, for each cell and further ones.
const TILES: [usize; 2] = [2, 32];

/// How much of each there can be.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClusterRoom {
    pub(super) clusters: usize,
    pub(super) sets: usize,
    pub(super) tiles: usize,
    /// Tiles of elements.
    pub(super) moved: usize,
}

impl ClusterRoom {
    /// For this many cells, elements and patches with nodal strain, or fewer.
    pub(super) const fn new(cells: usize, [elements, patches]: [usize; 2]) -> Self {
        // Of each group of a partition the last tile may be partly empty.
        const fn tiles_of(pieces: usize) -> usize {
            pieces.div_ceil(TILE).saturating_add(2 * MAX_PARTITIONS)
        }
        let (all, tiles) = (
            tiles_of(if patches > 0 { patches } else { elements }),
            cells.saturating_mul(TILES[0]).saturating_add(TILES[1]),
        );
        Self {
            clusters: cells.saturating_mul(CLUSTERS),
            sets: cells.saturating_mul(SETS[0]).saturating_add(SETS[1]),
            tiles: if all < tiles { all } else { tiles },
            moved: tiles_of(elements),
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

/// An element, as its place in the scene's tables.
#[derive(Clone, Copy)]
pub(super) struct Piece<'a> {
    tile: &'a ElementTile,
    lane: usize,
}

impl<'a> Piece<'a> {
    /// The elements of a tile.
    pub(super) fn of_tile(tile: &'a ElementTile) -> impl Iterator<Item = Self> {
        (0..TILE).map(move |lane| Self { tile, lane }).filter(|piece| piece.volume() > 0.0)
    }

    /// Its place in its tile.
    pub(super) const fn lane(&self) -> usize {
        self.lane
    }

    fn element(&self) -> usize {
        self.tile.element(self.lane)
    }

    /// m^3.
    pub(super) fn volume(&self) -> f32 {
        self.tile.volume(self.lane)
    }

    /// Its nodes.
    pub(super) fn nodes(&self) -> [usize; 4] {
        [0, 1, 2, 3].map(|corner| self.tile.node(corner, self.lane))
    }

    /// The gradients of their functions, 1/m.
    pub(super) fn gradients(&self) -> [[f32; 3]; 4] {
        let mut gradients = [[0.0; 3]; 4];
        for corner in 0..3 {
            for axis in 0..3 {
                gradients[corner + 1][axis] = self.tile.gradient_of(corner, axis, self.lane);
                gradients[0][axis] -= gradients[corner + 1][axis];
            }
        }
        gradients
    }

    /// The cell of its centre.
    pub(super) fn cell(&self, lattice: &Lattice, places: &[LatticeNode]) -> usize {
        let mut position = [0.0; 3];
        for node in self.nodes() {
            let place = node_place(places, node).copied().unwrap_or_default();
            position.iter_mut().zip(lattice.position(&place)).for_each(|(sum, at)| *sum += 0.25 * at);
        }
        lattice.cell_at(position)
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
    /// Tissues and how nodes are held are not told apart: for scenes with too many of them.
    pub(super) is_merged: bool,
}

impl<M: ElementMaterial> ClusterInput<'_, M> {
    /// `G_ec` of an element, for the functions of a cell.
    pub(super) fn gradients(&self, piece: &Piece<'_>, cell: usize) -> FunctionGradients {
        let mut gradients = [[[0.0; 3]; 8]; 3];
        for (node, gradient) in piece.nodes().into_iter().zip(piece.gradients()) {
            self.add_gradient(&mut gradients, cell, node, gradient);
        }
        gradients
    }

    /// Adds what a node with this gradient in a piece, 1/m, brings to the gradients of a cell's functions.
    fn add_gradient(&self, gradients: &mut FunctionGradients, cell: usize, node: usize, gradient: [f32; 3]) {
        let place = node_place(self.places, node).copied().unwrap_or_default();
        let weights = eight_weights(self.lattice.within(cell, &place));
        let free = self.scene.inertia.get(node).map_or([0.0; 3], |inertia| inertia.free().truncate().to_array());
        for (gradients, free) in gradients.iter_mut().zip(free) {
            for (sum, weight) in gradients.iter_mut().zip(weights) {
                sum.iter_mut().zip(gradient).for_each(|(sum, along)| *sum += free * weight * along);
            }
        }
    }

    /// How the nodes of an element, or those that a patch calls with, are held.
    fn hold(&self, each_node: impl FnOnce(&mut dyn FnMut(usize))) -> Hold {
        let mut hold = if self.is_merged { Hold::Partly } else { Hold::Nowhere };
        each_node(&mut |node| {
            hold = hold.max(match self.scene.inertia.get(node).map_or(0, NodeInertia::held_count) {
                0 => Hold::Nowhere,
                3 => Hold::Fully,
                _ => Hold::Partly,
            });
        });
        hold
    }

    fn hold_of(&self, piece: &Piece<'_>) -> Hold {
        self.hold(|with| piece.nodes().into_iter().for_each(with))
    }

    fn hold_of_patch(&self, tile: &PatchTile, lane: usize) -> Hold {
        self.hold(|with| tile.each_gradient(self.scene.patches.neighbours_of(tile), lane, |node, _| with(node)))
    }

    /// `G` of a patch.
    fn patch_gradients(&self, tile: &PatchTile, lane: usize, cell: usize) -> FunctionGradients {
        let mut gradients = [[[0.0; 3]; 8]; 3];
        let inverse = 1.0 / tile.volume(lane);
        tile.each_gradient(self.scene.patches.neighbours_of(tile), lane, |node, gradient| {
            let gradient = (inverse * gradient).as_vec3().to_array();
            self.add_gradient(&mut gradients, cell, node, gradient);
        });
        gradients
    }

    /// Calls with each patch at supports that stand still, its cluster and its volume.
    fn each_held_patch(
        &self,
        heads: &[u32],
        all: &mut [Cluster],
        mut with: impl FnMut(&mut Cluster, &PatchTile, usize, f32),
    ) {
        for (index, tile) in self.scene.patches.tiles().iter().enumerate() {
            for lane in 0..TILE {
                let cluster = self.cluster_of_tangent(index, lane, all, heads);
                if let Some((cluster, volume)) = cluster
                    && let Some(cluster) = all.get_mut(cluster).filter(|cluster| cluster.is_held_still())
                {
                    with(cluster, tile, lane, volume);
                }
            }
        }
    }

    /// Adds the moments of patches at supports that stand still, and writes their volumes in place of the sampled ones:
    /// the mean of a patch is softer than its elements where some of their nodes are held.
    fn add_patches(&self, heads: &[u32], all: &mut [Cluster], moments: &mut [PairMatrices]) {
        self.each_held_patch(heads, all, |cluster, tile, lane, volume| {
            cluster.sampled += volume;
            let of_axes = self.patch_gradients(tile, lane, cluster.cell as usize);
            add_to_sets(cluster, moments, &of_axes, volume);
        });
    }

    fn tissue(&self, element: usize) -> u16 {
        if self.is_merged { 0 } else { self.scene.material.laws().tissue(element) }
    }

    /// Makes the clusters. `None` if there is no room.
    pub(super) fn write(&self, clusters: &mut Clusters<'_>) -> Option<ClusterCounts> {
        clusters.heads.fill(0);
        let mut count = 0;
        for piece in self.scene.tiles.iter().flat_map(Piece::of_tile) {
            let cell = piece.cell(self.lattice, self.places);
            let index = match self.find(&piece, cell, clusters.all, clusters.heads) {
                Some(index) => index,
                None => {
                    let (tissue, hold) = (self.tissue(piece.element()), self.hold_of(&piece) as u8);
                    let head = clusters.heads.get_mut(cell)?;
                    let cell = cell as u32;
                    *clusters.all.get_mut(count)? = Cluster { cell, tissue, hold, next: *head, ..Cluster::default() };
                    count += 1;
                    *head = count as u32;
                    count - 1
                }
            };
            let cluster = clusters.all.get_mut(index)?;
            cluster.volume += piece.volume();
            for node in piece.nodes() {
                let [x, y, z] = [0, 1, 2].map(|axis| self.scene.held(node).has(axis));
                let moves = if self.scene.movable(node) == Axes::NONE { 0 } else { MOVES };
                cluster.differs |= u8::from(x != y) | u8::from(y != z) << 1 | u8::from(z != x) << 2 | moves;
            }
        }
        let mut sets = 0;
        for cluster in clusters.all.iter_mut().take(count) {
            cluster.first_set = sets as u32;
            sets = cluster.sets().end;
        }
        clusters.moments.get_mut(..sets)?.fill(PairMatrices::ZERO);
        let all = clusters.all.get_mut(..count)?;
        if self.scene.element().is_nodal_strain() {
            self.add_patches(clusters.heads, all, clusters.moments);
        }
        for piece in self.scene.tiles.iter().flat_map(Piece::of_tile) {
            let cell = piece.cell(self.lattice, self.places);
            let cluster = clusters.all.get(self.find(&piece, cell, clusters.all, clusters.heads)?)?;
            if cluster.sampled > 0.0 {
                continue;
            }
            add_to_sets(cluster, clusters.moments, &self.gradients(&piece, cell), piece.volume());
        }
        for cluster in clusters.all.iter_mut().take(count).filter(|cluster| cluster.sampled > 0.0) {
            (cluster.volume, cluster.sampled) = (cluster.sampled, 0.0);
        }
        for cluster in clusters.all.get(..count).unwrap_or_default() {
            let is_free = cluster.hold == Hold::Nowhere as u8;
            for moments in clusters.moments.get_mut(cluster.sets()).unwrap_or_default() {
                if is_free {
                    moments.balance();
                }
                moments.0.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|value| *value /= cluster.volume);
            }
        }
        self.list_moved(clusters);
        let tiles = self.sample(clusters, count)?;
        Some(ClusterCounts { clusters: count, tiles, is_merged: self.is_merged })
    }

    /// Lists the tiles at supports that motions may move.
    fn list_moved(&self, clusters: &mut Clusters<'_>) {
        let moves = |node: usize| self.scene.movable(node) != Axes::NONE;
        let tiles = self.scene.tiles.iter().enumerate();
        let moved = tiles.filter(|(_, tile)| Piece::of_tile(tile).any(|piece| piece.nodes().into_iter().any(moves)));
        clusters.moved.fill(NO_TILE);
        clusters.moved.iter_mut().zip(moved).for_each(|(place, (tile, _))| *place = tile as u32);
    }

    /// Chooses the tiles: every one, or one of some; and further ones for clusters that have few. Lists the sampled
    /// pieces of each cluster.
    fn sample(&self, clusters: &mut Clusters<'_>, count: usize) -> Option<usize> {
        let Clusters { all, heads, tiles, members, .. } = clusters;
        let all = all.get_mut(..count)?;
        let (most, of_scene) = (tiles.len(), self.tiles_with_tangents());
        // A part of the room is for clusters that a regular sample misses.
        let spacing = if of_scene <= most { 1 } else { of_scene.div_ceil((most - most / 4).max(1)).max(1) };
        let mut chosen = 0;
        for tile in (0..of_scene).step_by(spacing) {
            *tiles.get_mut(chosen)? = tile as u32;
            chosen += 1;
            self.enter(tile, all, heads);
        }
        for tile in (0..of_scene).filter(|tile| tile % spacing != 0) {
            let misses = (0..TILE).any(|lane| {
                let index = self.cluster_of_tangent(tile, lane, all, heads);
                index.and_then(|(index, _)| all.get(index)).is_some_and(|cluster| cluster.count < LEAST_SAMPLED)
            });
            if misses && chosen < most {
                *tiles.get_mut(chosen)? = tile as u32;
                chosen += 1;
                self.enter(tile, all, heads);
            }
        }
        let mut first = 0;
        for cluster in all.iter_mut() {
            cluster.first = first;
            first += cluster.count;
            cluster.count = 0;
        }
        for (place, &tile) in tiles.iter().take(chosen).enumerate() {
            for lane in 0..TILE {
                let Some((index, _)) = self.cluster_of_tangent(tile as usize, lane, all, heads) else { continue };
                let cluster = all.get_mut(index)?;
                *members.get_mut((cluster.first + cluster.count) as usize)? = (place * TILE + lane) as u32;
                cluster.count += 1;
            }
        }
        // What has no sampled piece of its own takes those of another cluster, of its cell and tissue if there is one.
        for index in 0..count {
            let own = *all.get(index)?;
            if own.count > 0 {
                continue;
            }
            let like = |other: &Cluster| (other.cell != own.cell, other.tissue != own.tissue);
            let others = all.iter().filter(|other| other.count > 0);
            let donor = *others.min_by_key(|other| like(other))?;
            let cluster = all.get_mut(index)?;
            (cluster.first, cluster.count, cluster.sampled) = (donor.first, donor.count, donor.sampled);
        }
        Some(chosen)
    }

    /// Counts the pieces of a tile as sampled.
    fn enter(&self, tile: usize, all: &mut [Cluster], heads: &[u32]) {
        for lane in 0..TILE {
            if let Some((index, volume)) = self.cluster_of_tangent(tile, lane, all, heads)
                && let Some(cluster) = all.get_mut(index)
            {
                cluster.count += 1;
                cluster.sampled += volume;
            }
        }
    }

    /// How many tiles of tangents a scene has.
    fn tiles_with_tangents(&self) -> usize {
        let Self { scene, .. } = self;
        if scene.element().is_nodal_strain() { scene.patches.tiles().len() } else { scene.tiles.len() }
    }

    /// The cluster and the volume (m^3) of the tangent of a place of a tile: of an element, or of a patch.
    fn cluster_of_tangent(&self, tile: usize, lane: usize, all: &[Cluster], heads: &[u32]) -> Option<(usize, f32)> {
        let Self { scene, lattice, places, .. } = *self;
        if !scene.element().is_nodal_strain() {
            let piece = Piece { tile: scene.tiles.get(tile)?, lane };
            let cell = piece.cell(lattice, places);
            let index = (piece.volume() > 0.0).then(|| self.find(&piece, cell, all, heads))??;
            return Some((index, piece.volume()));
        }
        let tile = scene.patches.tiles().get(tile).filter(|tile| tile.volume(lane) > 0.0)?;
        let (node, tissue) = (tile.node(lane), self.tissue(tile.element(lane)));
        let (cell, hold) = (node_place(places, node)?.cell(), self.hold_of_patch(tile, lane));
        let unlike = |cluster: &Cluster| (cluster.tissue != tissue, cluster.hold != hold as u8);
        let of_cell = clusters_of(all, heads.get(cell).copied()?);
        let (index, _) = of_cell.min_by_key(|(_, cluster)| unlike(cluster))?;
        Some((index, tile.volume(lane) as f32))
    }

    /// The cluster of an element in a cell.
    pub(super) fn find(&self, piece: &Piece<'_>, cell: usize, all: &[Cluster], heads: &[u32]) -> Option<usize> {
        let (tissue, hold) = (self.tissue(piece.element()), self.hold_of(piece) as u8);
        let mut of_cell = clusters_of(all, heads.get(cell).copied()?);
        of_cell.find(|(_, cluster)| cluster.tissue == tissue && cluster.hold == hold).map(|(index, _)| index)
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

fn add_to_sets(cluster: &Cluster, moments: &mut [PairMatrices], of_axes: &FunctionGradients, volume: f32) {
    let (numbers, each) = (cluster.gradients(), cluster.gradient_count());
    let axis_of = |number: usize| numbers.iter().position(|&other| other == number).unwrap_or(0);
    for (set, moments) in moments.get_mut(cluster.sets()).unwrap_or_default().iter_mut().enumerate() {
        let [first, second] = [set / each, set % each].map(|number| &of_axes[axis_of(number) % 3]);
        add_moments(moments, volume, [first, second]);
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
