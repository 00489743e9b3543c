//! The matrices of a lattice (kg, factors of them) and the sums of its cells, in the caller's storage.

use bytemuck::{AnyBitPattern, NoUninit, try_cast_slice_mut};
use glam::Vec4;

use super::band::{Band, Row, factorise, solve};
use super::cells::CellPolynomial;
use super::clusters::{Cluster, ClusterInput, ClusterRoom, Clusters, PairMatrices, for_each_pair};
use super::coarse_stiffness::{AxisMatrices, ClusterTangent};
use super::frames::{FrameNodes, Frames, Matrix};
use super::lattice::{CoarseVectors, Grid, Lattice, LatticeNode, MAX_FUNCTIONS};
use super::renewal::Renewal;
use super::transport::factorise_edges;
use crate::element::{ElementMaterial, NodeInertia, Tangent};
use crate::scene::SceneView;
use crate::simd::{NodeVector, TILE};

/// The extents of the matrices of a lattice: three unknowns for each function, and one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bands {
    pub(super) vectors: Band,
    pub(super) scalars: Band,
}

impl Bands {
    pub(super) const NONE: Self = Self { vectors: Band::NONE, scalars: Band::NONE };

    pub(super) fn new(lattice: &Lattice) -> Self {
        Self { vectors: Band::new(lattice, 3), scalars: Band::new(lattice, 1) }
    }
}

/// The matrices, the sums of the cells and the clusters.
pub(super) struct Matrices<'a> {
    /// The factor of `S`; room for its computation.
    pub(super) factor: &'a mut [f32],
    pub(super) scratch: &'a mut [f32],
    /// The factors of `Mc`, one after the other for each axis. Constant, as is the following.
    pub(super) mass_factors: &'a mut [f32],
    /// See [`super::transport`].
    pub(super) edge_factor: &'a mut [f32],
    pub(super) frames: Frames<'a>,
    /// `(1 + k) Mc + E` of each cell.
    pub(super) inertia: &'a mut [AxisMatrices],
    /// The stiffness of each cell.
    pub(super) stiffness: &'a mut [PairMatrices],
    /// Sums of the nodes' scalar bounds in each cell when that was computed, N/m.
    pub(super) bounds: &'a mut [f32],
    pub(super) clusters: Clusters<'a>,
    /// Of the sampled tiles, and of the clusters.
    pub(super) tangents: &'a mut [Tangent],
    pub(super) of_clusters: &'a mut [ClusterTangent],
    /// Used by the passes over the nodes: sums of the residual, later the lattice's motion; sums of the momentum, later
    /// the smooth part of the increments.
    pub(super) cells: &'a mut [CellPolynomial],
    pub(super) smooth_cells: &'a mut [CellPolynomial],
}

/// Vectors of `count` values of a type.
const fn vectors_of<T>(count: usize) -> usize {
    count.saturating_mul(size_of::<T>()).div_ceil(size_of::<NodeVector>())
}

/// Vectors of storage for a lattice on a scene of this many elements, and patches with nodal strain, or fewer.
pub(super) fn vectors_for(grid: Grid, pieces: [usize; 2]) -> usize {
    let cells = grid.cell_count();
    let room = ClusterRoom::new(cells, pieces);
    let band = Band::most_floats(grid.cells, grid.functions, 3);
    let scalar_band = Band::most_floats(grid.cells, grid.functions, 1);
    [
        vectors_of::<f32>(band),
        vectors_of::<f32>(Band::most_scratch_floats(grid.functions)),
        vectors_of::<f32>(scalar_band.saturating_mul(3)),
        vectors_of::<f32>(scalar_band),
        vectors_of::<FrameNodes>(grid.functions),
        4 * vectors_of::<Matrix>(grid.functions),
        vectors_of::<AxisMatrices>(cells),
        vectors_of::<PairMatrices>(cells),
        vectors_of::<f32>(cells),
        vectors_of::<Cluster>(room.clusters),
        vectors_of::<PairMatrices>(room.sets),
        vectors_of::<u32>(cells),
        vectors_of::<u32>(room.tiles),
        vectors_of::<u32>(room.moved),
        vectors_of::<u32>(room.tiles.saturating_mul(TILE)),
        vectors_of::<Tangent>(room.tiles.saturating_mul(TILE)),
        vectors_of::<ClusterTangent>(room.clusters),
        2 * vectors_of::<CellPolynomial>(cells),
    ]
    .into_iter()
    .fold(0, usize::saturating_add)
}

/// Takes `count` values.
fn take<'a, T: AnyBitPattern + NoUninit>(from: &mut &'a mut [NodeVector], count: usize) -> Option<&'a mut [T]> {
    let vectors = from.split_off_mut(..vectors_of::<T>(count))?;
    let floats: &mut [f32] = try_cast_slice_mut(vectors).ok()?;
    try_cast_slice_mut(floats.get_mut(..count * (size_of::<T>() / size_of::<f32>()))?).ok()
}

impl<'a> Matrices<'a> {
    pub(super) fn split(
        mut rest: &'a mut [NodeVector],
        lattice: &Lattice,
        bands: &Bands,
        pieces: [usize; 2],
    ) -> Option<Self> {
        let (rest, cells, functions) = (&mut rest, lattice.cell_count(), lattice.functions());
        let room = ClusterRoom::new(cells, pieces);
        Some(Self {
            factor: take(rest, bands.vectors.floats())?,
            scratch: take(rest, bands.vectors.scratch_floats())?,
            mass_factors: take(rest, 3 * bands.scalars.floats())?,
            edge_factor: take(rest, bands.scalars.floats())?,
            frames: Frames {
                nodes: take(rest, functions)?,
                latest: take(rest, functions)?,
                in_latest_step: take(rest, functions)?,
                of_stiffness: take(rest, functions)?,
                since_stiffness: take(rest, functions)?,
            },
            inertia: take(rest, cells)?,
            stiffness: take(rest, cells)?,
            bounds: take(rest, cells)?,
            clusters: Clusters {
                all: take(rest, room.clusters)?,
                moments: take(rest, room.sets)?,
                heads: take(rest, cells)?,
                tiles: take(rest, room.tiles)?,
                moved: take(rest, room.moved)?,
                members: take(rest, TILE * room.tiles)?,
            },
            tangents: take(rest, TILE * room.tiles)?,
            of_clusters: take(rest, room.clusters)?,
            cells: take(rest, cells)?,
            smooth_cells: take(rest, cells)?,
        })
    }

    /// Writes what does not change with the state, for a scene whose nodes have these places: clusters, and the factors of
    /// `Mc` and of the edges. Gives whether these could be factorised.
    pub(super) fn write_constants<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        lattice: &Lattice,
        places: &[LatticeNode],
        renewal: &mut Renewal,
    ) -> bool {
        let input = ClusterInput { scene, lattice, places, is_merged: false };
        let merged = ClusterInput { is_merged: true, ..input };
        let counts = input.write(&mut self.clusters).or_else(|| merged.write(&mut self.clusters));
        let Some(counts) = counts else { return false };
        (renewal.clusters, renewal.tiles, renewal.is_merged) = (counts.clusters, counts.tiles, counts.is_merged);
        self.inertia.fill([[0.0; 4]; _]);
        for place in places {
            if let Some(inertia) = scene.inertia.get(place.node()) {
                add_node(self.inertia, place, inertia, inertia.mass);
            }
        }
        let Self { scratch, mass_factors, edge_factor, inertia, .. } = self;
        let band = &renewal.bands.scalars;
        let mut is_sound = true;
        for (axis, factor) in mass_factors.chunks_exact_mut(band.floats().max(1)).enumerate() {
            band.clear(factor);
            for (cell, matrices) in inertia.iter().enumerate() {
                let functions = lattice.functions_of(cell);
                for_each_pair(|pair, c, d| {
                    let value = matrices[pair % matrices.len()][axis % 4];
                    for_each_product(lattice, functions[c], functions[d], |row, column, weight| {
                        if let Some(entry) = factor.get_mut(band.at(row, column)) {
                            *entry += weight * value;
                        }
                    });
                });
            }
            is_sound &= factorise(band, factor, scratch);
        }
        is_sound && factorise_edges(band, edge_factor, scratch, lattice, &held_shares(scene, lattice, places))
    }

    /// Writes `((1 + k) Mc + E) x` for vectors of the functions.
    #[inline(never)]
    pub(super) fn times_inertia(&self, lattice: &Lattice, x: &CoarseVectors, out: &mut CoarseVectors) {
        out.fill(NodeVector::ZERO);
        for (cell, matrices) in self.inertia.iter().enumerate() {
            let functions = lattice.functions_of(cell);
            let mut at = [Vec4::ZERO; 8];
            for (at, &function) in at.iter_mut().zip(&functions) {
                *at = x.get(function).map_or(Vec4::ZERO, |x| Vec4::from(x.0));
            }
            for (&function, pairs) in functions.iter().zip(&PAIR_OF) {
                let mut sum = Vec4::ZERO;
                for (&at, &pair) in at.iter().zip(pairs) {
                    sum += Vec4::from(matrices[pair]) * at;
                }
                if let Some(NodeVector(out)) = out.get_mut(function).filter(|_| lattice.moves(function)) {
                    *out = (Vec4::from(*out) + sum).to_array();
                }
            }
        }
    }

    /// Replaces vectors of the functions by `Mc^-1` times them.
    #[inline(never)]
    pub(super) fn divide_by_mass(&self, band: &Band, vectors: &mut CoarseVectors, lattice: &Lattice) {
        lattice.fold(vectors);
        let functions = lattice.functions();
        let mut factors = self.mass_factors.chunks_exact(band.floats().max(1));
        let mut row: Row = [0.0; _];
        for axis in 0..3 {
            for (value, vector) in row.iter_mut().zip(&*vectors).take(functions) {
                *value = vector.0[axis];
            }
            solve(band, factors.next().unwrap_or_default(), &mut [&mut row]);
            for (value, vector) in row.iter().zip(&mut *vectors).take(functions) {
                vector.0[axis] = *value;
            }
        }
        lattice.expand(vectors);
    }
}

/// For each function the share of its nodes that some support holds.
#[inline(never)]
fn held_shares<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    lattice: &Lattice,
    places: &[LatticeNode],
) -> [f32; MAX_FUNCTIONS] {
    let mut sums = [[0.0f32; 2]; MAX_FUNCTIONS];
    for place in places {
        let is_held = scene.inertia.get(place.node()).is_some_and(|inertia| inertia.held_count() > 0);
        for (function, weight) in lattice.weights(place) {
            // Not those of light points, whose parts in a function may be negative.
            if let Some([held, all]) = sums.get_mut(function).filter(|_| !lattice.is_light(function)) {
                *all += weight;
                *held += if is_held { weight } else { 0.0 };
            }
        }
    }
    sums.map(|[held, all]| if all > 0.0 { held / all } else { 0.0 })
}

/// The pair of two of the eight functions of a cell.
const PAIR_OF: [[usize; 8]; 8] = {
    let mut pairs = [[0; 8]; 8];
    let mut c = 0;
    while c < 8 {
        let mut d = 0;
        while d < 8 {
            pairs[c][d] = if c >= d { c * (c + 1) / 2 + d } else { d * (d + 1) / 2 + c };
            d += 1;
        }
        c += 1;
    }
    pairs
};

/// What a held axis counts, as a share: where few or none of a function's nodes are free, no motion of the lattice is
/// without inertia.
const HELD: f32 = 1e-4;

/// Adds a node's value (kg) for each axis times the products of its weights.
#[inline(always)]
pub(super) fn add_node(matrices: &mut [AxisMatrices], place: &LatticeNode, inertia: &NodeInertia, value: f32) {
    let Some(matrices) = matrices.get_mut(place.cell()) else { return };
    let weights = place.eight_weights();
    let free = (value * inertia.free().max(Vec4::splat(HELD))).to_array();
    for_each_pair(|pair, c, d| {
        let product = weights[c] * weights[d];
        let at = pair % matrices.len();
        for axis in 0..4 {
            matrices[at][axis] += product * free[axis];
        }
    });
}

/// Calls `add` with row, column and weight of what a value of two numbers of a cell, the second not after the first,
/// adds to the lower triangle of a symmetric matrix of the functions.
#[inline(always)]
pub(super) fn for_each_product(lattice: &Lattice, first: usize, second: usize, mut add: impl FnMut(usize, usize, f32)) {
    if !lattice.moves(first) || !lattice.moves(second) {
        return;
    }
    if !lattice.is_light(first) && !lattice.is_light(second) {
        return add(first.max(second), first.min(second), 1.0);
    }
    lattice.each_function(first, |a, weight| {
        lattice.each_function(second, |b, other| {
            // Of two different numbers, the products with the two in turn meet on the diagonal.
            let twice = if a == b && first != second { 2.0 } else { 1.0 };
            if first != second || b <= a {
                add(a.max(b), a.min(b), twice * weight * other);
            }
        });
    });
}
