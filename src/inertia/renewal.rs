//! When the inertia of the lattice's motion, `S`, is computed anew, and how: from the tangents of the sampled pieces
//! (`clusters.rs`, `coarse_stiffness.rs`) at the start of the step that needs it, all at once. That is due where the
//! lattice has been strained and bent by [`LARGEST_CHANGE`] since, or where tissue has stiffened. All else is constant, and
//! computed anew for a state that does not follow from the last one.

use glam::Vec4;

use super::band::factorise;
use super::cells::CellPolynomial;
use super::clusters::{ClusterInput, Clusters, Piece};
use super::coarse_stiffness::{ClusterTangent, add_cell, add_tangent, tangent_of, write_cell};
use super::frames::Frames;
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_POINTS, node_at};
use super::matrices::{Bands, Matrices, add_node};
use super::node::Scaling;
use super::node_tables::NodeTables;
use super::pulls::PullsInUse;
use super::report::AddedInertia;
use super::{COARSE_GROWTH, DRAG_AT_LARGEST_CHANGE, DRAG_OF_ADDED, LARGEST_DRAG};
use crate::element::{
    CrushedTangents, ElementLaw, ElementMaterial, ElementTangents, OwnPressure, PatchTangents, ScalarBound, Tangent,
    add_fibre_tangents, add_patch_fibre_tangents, each_bounded, tangents,
};
use crate::mesh::partition::MOST_PARTS;
use crate::scene::SceneView;
use crate::simd::{Gather, NodeVector, TILE};
use crate::step::threads::take;
use crate::step::{Threads, internal_forces};

/// Change of the lattice's shape within which `S` is used, at the least sensitivity.
const LARGEST_CHANGE: f32 = 0.08;

/// Change of the lattice's shape in one step at which drag is full, for tissue that is as stiff in volume as in shear.
const LARGEST_CHANGE_OF_STEP: f32 = 0.8;
/// Least part of a cell's motion that is left to the lattice: where nodes take their true inertia, there is none.
const LEAST_REST: f32 = 1e-5;
/// Least sensitivity to a change of shape: the stiffness changes with the shape for any tissue.
const LEAST_SENSITIVITY: f32 = 8.0;

/// The state of the renewal, and its results for the steps.
#[derive(Clone, Debug)]
pub(super) struct Renewal {
    pub(super) bands: Bands,
    /// Clusters and sampled tiles.
    pub(super) clusters: usize,
    pub(super) tiles: usize,
    /// See [`super::clusters::ClusterInput::is_merged`].
    pub(super) is_merged: bool,
    /// Step count of the state for which the frames were computed.
    frames_at: Option<u64>,
    /// The lattice's motion since `S` was computed (m), and how far its shape has changed.
    moved: CoarseVectors,
    changed: f32,
    /// Drag of the last step's change of shape.
    pace: f32,
    /// How much sooner the stiffness of shear changes than with equal stiffness of volume and shear. A change `e` of
    /// shape gives motion without change of volume a share `e^2` of the stiffness of volume.
    pub(super) sensitivity: f32,
    /// Whether `S` could be factorised: if not, the lattice is not used.
    pub(super) lattice_in_use: bool,
    pub(super) added: AddedInertia,
    /// What nodes do of a motion of the body by themselves.
    pub(super) own_share: f32,
    /// Sum of the inertia of the lattice's motion, if no support holds the body, kg.
    pub(super) free_inertia: Option<f32>,
    pub(super) pulls: PullsInUse,
}

/// What `S` is computed from.
pub(super) struct RenewalInput<'a, M> {
    pub(super) scene: SceneView<'a, M>,
    pub(super) displacement: &'a [NodeVector],
    /// See [`write_volumes`](crate::step::write_volumes).
    pub(super) volume: &'a [NodeVector],
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) scaling: &'a Scaling,
}

impl<M> Clone for RenewalInput<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for RenewalInput<'_, M> {}

impl Renewal {
    pub(super) const NEW: Self = Self {
        bands: Bands::NONE,
        clusters: 0,
        tiles: 0,
        is_merged: false,
        frames_at: None,
        moved: [NodeVector::ZERO; _],
        changed: 0.0,
        pace: 0.0,
        sensitivity: LEAST_SENSITIVITY,
        lattice_in_use: false,
        added: AddedInertia::NONE,
        own_share: 0.0,
        free_inertia: None,
        pulls: PullsInUse::NONE,
    };

    /// The share of the last increment's unresolved deformation of the lattice that a step removes. Deformation is fed
    /// by `S` changing while velocities are kept, so the share follows the rate of that change.
    pub(super) fn drag(&self) -> f32 {
        let of_shear = LEAST_SENSITIVITY / self.sensitivity;
        (of_shear * of_shear * DRAG_OF_ADDED * self.added.mean)
            .max(DRAG_AT_LARGEST_CHANGE * self.pace)
            .min(LARGEST_DRAG)
    }

    /// Computes the frames, unless that was done for this state, which has taken `steps` steps.
    pub(super) fn update_frames(&mut self, frames: &mut Frames<'_>, displacement: &[NodeVector], steps: u64) {
        if self.frames_at != Some(steps) {
            frames.update(displacement);
            self.frames_at = Some(steps);
        }
    }

    /// Enters the lattice's part of a step's increments, m.
    pub(super) fn enter(&mut self, increments: &CoarseVectors, lattice: &Lattice, frames: &Frames<'_>) {
        self.pulls.enter();
        for (sum, increment) in self.moved.iter_mut().zip(increments) {
            sum.0 = (Vec4::from(sum.0) + Vec4::from(increment.0)).to_array();
        }
        let rotations = frames.since_rest();
        let strain = lattice.largest_strain(increments, rotations);
        self.pace = strain * self.sensitivity / LARGEST_CHANGE_OF_STEP;
        let bending = lattice.largest_bending(|function| frames.since_stiffness(function));
        self.changed = lattice.largest_strain(&self.moved, rotations) + bending;
    }

    /// Computes `S` anew if that is due, when the cells have the sums of the nodes' scalar bounds, or as pulls ask for it.
    pub(super) fn renew_if_due<M: ElementMaterial>(
        &mut self,
        input: RenewalInput<'_, M>,
        others_pull: bool,
        matrices: &mut Matrices<'_>,
        threads: &impl Threads,
    ) {
        let Matrices { bounds, cells, .. } = matrices;
        let mut now = bounds.iter_mut().zip(cells.iter().map(CellPolynomial::values));
        let stiffened = now.any(|(before, now)| now > COARSE_GROWTH * *before);
        // Not by a motion that is no number.
        let has_changed = self.changed * self.sensitivity > LARGEST_CHANGE * LEAST_SENSITIVITY;
        if self.lattice_in_use && !has_changed && !stiffened && !others_pull {
            return;
        }
        bounds.iter_mut().zip(cells.iter()).for_each(|(before, cell)| *before = cell.values());
        self.renew(input, matrices, threads);
    }

    /// Computes `S`.
    #[inline(never)]
    fn renew<M: ElementMaterial>(
        &mut self,
        input: RenewalInput<'_, M>,
        matrices: &mut Matrices<'_>,
        threads: &impl Threads,
    ) {
        let Matrices { factor, scratch, frames, inertia, stiffness, clusters, tangents, of_clusters, .. } = matrices;
        let tiles = clusters.tiles.get(..self.tiles).unwrap_or_default();
        write_tangents(input, tiles, tangents, threads);
        self.sensitivity = sensitivity(tangents.get(..TILE * tiles.len()).unwrap_or_default()).max(LEAST_SENSITIVITY);
        let clusters = &*clusters;
        each_in_parts(of_clusters.get_mut(..self.clusters).unwrap_or_default(), threads, |index, tangent| {
            if let Some(cluster) = clusters.all.get(index) {
                *tangent = tangent_of(cluster, clusters.members, tangents);
            }
        });
        if input.scene.element().is_nodal_strain() {
            add_crushed(input, clusters, self.is_merged, of_clusters);
        }
        each_in_parts(stiffness, threads, |cell, matrices| write_cell(clusters, of_clusters, cell, matrices));
        let (lattice, band) = (input.lattice, &self.bands.vectors);
        band.clear(factor);
        for (cell, (stiffness, inertia)) in stiffness.iter().zip(&**inertia).enumerate() {
            add_cell(band, factor, stiffness, inertia, lattice, cell);
        }
        self.pulls.add_to(band, factor, input.scaling.coarse_weight);
        self.lattice_in_use = factorise(band, factor, scratch);
        (self.moved, self.changed) = ([NodeVector::ZERO; _], 0.0);
        frames.start_stiffness();
    }

    /// Computes everything anew for a state that does not follow from the last one, or for another length of steps.
    #[inline(never)]
    pub(super) fn renew_all<M: ElementMaterial>(
        &mut self,
        input: RenewalInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        threads: &impl Threads,
    ) {
        let RenewalInput { scene, displacement, volume, places, scaling, .. } = input;
        // Twice: no rotation in the latest step.
        matrices.frames.update(displacement);
        matrices.frames.update(displacement);
        (self.frames_at, self.pace) = (None, 0.0);
        let NodeTables { next_increment, scratch, .. } = tables;
        scratch.fill(NodeVector::ZERO);
        let all = scene.elements().partitions.all();
        internal_forces(scene, all, [displacement, &[]], volume, scratch, ScalarBound, None);
        let Matrices { inertia: of_cells, bounds, .. } = matrices;
        of_cells.fill([[0.0; 4]; _]);
        let (mut sums, factor) = ([[0.0f32; 2]; MAX_POINTS], 1.0 + scaling.k);
        bounds.fill(0.0);
        self.added = AddedInertia::NONE;
        for (rank, next) in next_increment.iter().enumerate() {
            let node = node_at(places, rank);
            let (Some(place), Some(inertia)) = (places.get(rank), scene.inertia.get(node)) else { continue };
            let bound = scratch.get(node).map_or(0.0, |force| force.0[3]);
            let own = scaling.inertia(inertia.mass, bound * next.0[3]);
            if let (Some(sum), Some([mass, inertia_sum])) = (bounds.get_mut(place.cell()), sums.get_mut(place.cell())) {
                (*sum, *mass, *inertia_sum) = (*sum + bound, *mass + factor * inertia.mass, *inertia_sum + own);
            }
            if inertia.held_count() < 3 {
                self.added.add(node, (own - scaling.reserve * inertia.mass) / inertia.mass - 1.0);
            }
        }
        let mut free_inertia = Some(0.0);
        for place in places {
            let [mass, own] = sums.get(place.cell()).copied().unwrap_or_default();
            if let Some(inertia) = scene.inertia.get(place.node()) {
                let coarse = factor * inertia.mass / (1.0 - mass / own).max(LEAST_REST);
                add_node(of_cells, place, inertia, coarse);
                free_inertia = free_inertia.filter(|_| inertia.held_count() == 0).map(|sum| sum + coarse);
            }
        }
        let [mass, own] = sums.iter().fold([0.0; 2], |[a, b], [mass, own]| [a + mass, b + own]);
        (self.own_share, self.free_inertia) = (mass / own, free_inertia);
        self.added.end();
        self.renew(input, matrices, threads);
    }
}

/// How much sooner `S` is out of date than with equal stiffness of volume and shear.
fn sensitivity(tangents: &[Tangent]) -> f32 {
    let (mut volume, mut shear) = (0.0, f32::MIN_POSITIVE);
    for Tangent { factors: [_, outer, exchanged, _], .. } in tangents {
        volume += outer;
        shear += 2.0 * exchanged;
    }
    libm::sqrtf(1.0 + volume / shear)
}

/// Calls `write` with each item and its number.
fn each_in_parts<T: Send>(items: &mut [T], threads: &impl Threads, write: impl Fn(usize, &mut T) + Sync) {
    let parts = threads.parts().clamp(1, MOST_PARTS);
    let (each, mut rest) = (items.len().div_ceil(parts), items);
    let mut all: [_; MOST_PARTS] = core::array::from_fn(|part| (part * each, take(&mut rest, each)));
    threads.each(all.get_mut(..parts).unwrap_or_default(), |(first, items)| {
        (*first..).zip(&mut **items).for_each(|(index, item)| write(index, item));
    });
}

/// Adds the tangents of crushed elements with nodal strain to those of their clusters.
fn add_crushed<M: ElementMaterial>(
    input: RenewalInput<'_, M>,
    clusters: &Clusters<'_>,
    is_merged: bool,
    of_clusters: &mut [ClusterTangent],
) {
    let RenewalInput { scene, displacement, volume, lattice, places, scaling } = input;
    let (of_element, weight) = (ClusterInput { scene, lattice, places, is_merged }, scaling.coarse_weight);
    each_bounded(&scene.material.laws(), scene.tiles, volume, displacement, |crushed| {
        let tangents = CrushedTangents { crushed, displacement: Gather::new(displacement), weight }.tangents();
        for piece in Piece::of_tile(&crushed.tile) {
            let cell = piece.cell(lattice, places);
            if let Some(index) = of_element.find(&piece, cell, clusters.all, clusters.heads)
                && let Some(sum) = of_clusters.get_mut(index)
            {
                add_tangent(sum, &tangents[piece.lane() % TILE]);
            }
        }
    });
}

/// Writes the tangents of these tiles.
fn write_tangents<M: ElementMaterial>(
    input: RenewalInput<'_, M>,
    tiles: &[u32],
    rest: &mut [Tangent],
    threads: &impl Threads,
) {
    let RenewalInput { scene, displacement, volume, scaling, .. } = input;
    let (laws, weight) = (scene.material.laws(), scaling.coarse_weight);
    let displacement = Gather::new(displacement);
    each_in_parts(rest.as_chunks_mut::<TILE>().0.get_mut(..tiles.len()).unwrap_or_default(), threads, |index, rows| {
        let place = tiles.get(index).map_or(usize::MAX, |&tile| tile as usize);
        if scene.element().is_nodal_strain() {
            if let Some(tile) = scene.patches.tiles().get(place) {
                let neighbours = scene.patches.neighbours_of(tile);
                *rows = M::Law::patch_tangents(PatchTangents { laws, tile, neighbours, displacement, weight });
                if let Some(fibres) = scene.fibrous() {
                    add_patch_fibre_tangents(fibres, (place, tile, neighbours), displacement, weight, rows);
                }
            }
        } else if let Some(tile) = scene.tiles.get(place) {
            let kernel = ElementTangents { laws, pressure: OwnPressure, tile, displacement, weight };
            *rows = tangents(scene.element(), kernel, volume);
            if let Some(fibres) = scene.fibrous() {
                add_fibre_tangents(fibres, (place, tile), displacement, weight, rows);
            }
        }
    });
}
