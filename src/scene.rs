//! What is simulated, computed once from a mesh: the tables of its elements ([`ElementTile`]), lumped masses (kg; a
//! quarter of `rho V` of each element to each of its nodes) and which axes of which nodes are held.
//!
//! A [`SceneView`] borrows all that, and every step works on one. Who owns the memory chooses: [`VecScene`] on a host
//! with a heap (feature `std`), [`FixedScene`] for a fixed capacity, which may be a `static`, or memory of any kind
//! through [`SceneFacts::build`].

mod build_error;
mod constants;
mod fibres;
mod memory;
mod owned;
#[cfg(feature = "std")]
mod wall;

use core::ops::{Deref, Range};

use glam::{DMat3, DVec3};

use crate::checksum::OfTables;
use crate::element::{
    ElementFields, ElementMaterial, ElementTile, Elements, FibreTangent, FibreTile, MOST_ELEMENTS, MoreEnergy,
    NodeInertia, PatchBuilder, PatchRow, Patches, Remembered, VolumeRows, element_energy, element_fields, patch_energy,
    stabilising_energy,
};
use crate::material::{Element, Law, Laws, Material, Moduli};
use crate::mesh::partition::{PartitionLayout, Partitions, most_tiles};
use crate::mesh::strips::Numbered;
use crate::mesh::{Mesh, MeshError, volume};
use crate::simd::{NodeVector, TILE};

pub use crate::element::{Axes, patch_rows_for};
pub use build_error::BuildError;
pub use fibres::fibre_tiles_for;
use fibres::{check_directions, directions_of, families_of, write_directions};
pub use memory::memory_vectors_for;
use memory::terms_of;
pub use owned::{FixedScene, FixedTables, Scene, SceneTables};
#[cfg(any(feature = "std", test))]
pub use owned::{VecScene, VecTables};
#[cfg(feature = "std")]
pub use wall::{Wall, WallError};

/// A node that does not move freely along some axes: it stands still, or follows a
/// [`Motion`](crate::loads::Motion).
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct Support {
    /// The node.
    pub node: u32,
    /// Held axes.
    pub axes: Axes,
    /// Whether motions may be prescribed along these axes. An element whose four nodes all stand still is
    /// left out of the scene; one that can be moved is not.
    pub moves: bool,
}

impl Support {
    /// The node stands still.
    #[must_use]
    pub const fn fixed(node: u32) -> Self {
        Self { node, axes: Axes::XYZ, moves: false }
    }

    /// The node follows prescribed motions.
    #[must_use]
    pub const fn moved(node: u32) -> Self {
        Self { node, axes: Axes::XYZ, moves: true }
    }
}

/// Tiles that are enough for any `elements` elements.
#[must_use]
pub const fn tiles_for(elements: usize) -> usize {
    most_tiles(elements)
}

/// How many tissues the elements of a material may be of.
pub(crate) fn tissue_count(material: &impl Material) -> usize {
    match material.laws() {
        Laws::One(_) => 1,
        Laws::Regions { tissues, .. } => tissues.len(),
    }
}

/// Of all tables, to tell scenes of the same size apart.
fn checksum(element: Element, nodes: &[NodeInertia], tiles: &[ElementTile]) -> u32 {
    let mut sum = OfTables::new();
    sum.update(&element.code().to_le_bytes());
    sum.update(bytemuck::must_cast_slice(nodes));
    sum.update(bytemuck::must_cast_slice(tiles));
    sum.number()
}

/// Sizes, mass and partitions of a scene: all that is known of it apart from its tables.
#[derive(Clone, Copy, Debug)]
pub struct SceneFacts {
    node_count: usize,
    element_count: usize,
    partitions: Partitions,
    patch_rows: usize,
    mass: f64,
    rounding_energy: f64,
    checksum: u32,
    /// Whether a node's mass may be more than that of the tissue around it.
    has_point_masses: bool,
    /// Terms of the tissue that relaxes with most.
    terms: usize,
    /// Families of directions that the fibres of the tissues need.
    families: usize,
}

impl SceneFacts {
    /// Of a scene that has not been built.
    pub const EMPTY: Self = Self {
        node_count: 0,
        element_count: 0,
        partitions: Partitions::NONE,
        patch_rows: 0,
        mass: 0.0,
        rounding_energy: 0.0,
        checksum: 0,
        has_point_masses: false,
        terms: 0,
        families: 0,
    };

    /// Builds a scene in memory of the caller, `nodes`, `tiles` ([`tiles_for`]), for nodal strain `patches`
    /// ([`patch_rows_for`]; none otherwise) and for tissue with fibres `fibres` ([`fibre_tiles_for`]), from a mesh, what it
    /// is made of, and its supports; a node may be listed more than once. Allocates nothing.
    pub fn build<M: Material>(
        material: &M,
        mesh: &Mesh<'_>,
        supports: impl Iterator<Item = Support>,
        nodes: &mut [NodeInertia],
        tiles: &mut [ElementTile],
        patches: &mut [PatchRow],
        fibres: &mut [FibreTile],
    ) -> Result<Self, BuildError> {
        let mut facts = Self::without_patches(material, mesh, supports, nodes, tiles)?;
        if material.element().is_nodal_strain() {
            facts.build_patches(material, tiles, patches, fibres)?;
        } else if facts.families > 0 {
            write_directions(material, tiles.get(..facts.tile_count()).unwrap_or_default(), fibres)?;
        }
        Ok(facts)
    }

    fn build_patches(
        &mut self,
        material: &impl Material,
        tiles: &[ElementTile],
        rows: &mut [PatchRow],
        fibres: &mut [FibreTile],
    ) -> Result<(), BuildError> {
        let families = self.families;
        let builder = PatchBuilder {
            nodes: self.node_count,
            elements: self.element_count,
            tiles: tiles.get(..self.tile_count()).unwrap_or_default(),
            partitions: &self.partitions,
            tissues: tissue_count(material),
            region: |element| material.region(element),
            directions: |element| directions_of(material, element),
        };
        let capacity = fibres.len();
        let fibres = if families > 0 { fibres } else { &mut [] };
        let built = builder.build(rows, fibres);
        self.patch_rows = built.map_err(|needed| BuildError::PatchCapacity { needed, capacity: rows.len() })?;
        let needed = Patches::of(rows).tiles().len();
        if families > 0 && needed > capacity { Err(BuildError::FibreCapacity { needed, capacity }) } else { Ok(()) }
    }

    fn without_patches<M: Material>(
        material: &M,
        mesh: &Mesh<'_>,
        supports: impl Iterator<Item = Support>,
        nodes: &mut [NodeInertia],
        tiles: &mut [ElementTile],
    ) -> Result<Self, BuildError> {
        let needed = mesh.points().len();
        let capacity = nodes.len();
        let Some(nodes) = nodes.get_mut(..needed) else {
            return Err(BuildError::NodeCapacity { needed, capacity });
        };
        if mesh.element_count() > MOST_ELEMENTS {
            return Err(BuildError::ElementCount { elements: mesh.element_count(), most: MOST_ELEMENTS });
        }
        check_directions(material, mesh.all_tets().count())?;
        nodes.fill(NodeInertia::EMPTY);
        mark_supports(nodes, supports)?;
        if mesh.has_removed() {
            mark_alone(nodes, mesh);
        }
        if material.element() != Element::Linear {
            mark_neighbours(nodes, mesh);
        }
        let still =
            |tet: [u32; 4]| tet.iter().all(|&node| nodes.get(node as usize).is_some_and(NodeInertia::is_left_out));
        let elements = mesh.elements().filter(|&(_, nodes)| !still(nodes));
        let elements = elements.map(|(element, nodes)| Numbered { element, nodes });
        let mut layout = PartitionLayout::of(nodes.len(), elements.clone());
        let partitions = *layout.partitions();
        let (needed, capacity) = (partitions.tiles(), tiles.len());
        if needed == 0 {
            return Err(BuildError::NothingMoves);
        }
        let Some(tiles) = tiles.get_mut(..needed) else {
            return Err(BuildError::TileCapacity { needed, capacity });
        };
        tiles.fill(ElementTile::EMPTY);
        let mut element_count = 0;
        for strip in partitions.strips(elements) {
            layout.place(&strip, |element, (tile, lane)| {
                if let Some(tile) = tiles.get_mut(tile) {
                    tile.write(lane, element, mesh.corners(element.nodes));
                    element_count += 1;
                }
            });
        }
        if material.element().is_nodal_pressure() && material.laws().has_several_tissues() {
            find_slots(material, mesh, nodes, tiles);
        }
        let (mass, rounding_energy) = lump_masses(material, mesh, nodes)?;
        let checksum = checksum(material.element(), nodes, tiles);
        Ok(Self {
            node_count: nodes.len(),
            element_count,
            partitions,
            patch_rows: 0,
            mass,
            rounding_energy,
            checksum,
            has_point_masses: false,
            terms: terms_of(material),
            families: families_of(material),
        })
    }

    /// Number of nodes.
    #[must_use]
    pub const fn node_count(&self) -> usize {
        self.node_count
    }

    pub(crate) const fn has_point_masses(&self) -> bool {
        self.has_point_masses
    }

    /// Number of elements that take part; those with four fixed nodes, and removed ones, were left out.
    #[must_use]
    pub const fn element_count(&self) -> usize {
        self.element_count
    }

    /// A checksum of nodes, supports, masses, elements and their kind, to tell scenes of the same size apart.
    pub(crate) const fn checksum(&self) -> u32 {
        self.checksum
    }

    /// Total mass, kg.
    #[must_use]
    pub const fn mass(&self) -> f64 {
        self.mass
    }

    /// Tiles in use.
    #[must_use]
    pub fn tile_count(&self) -> usize {
        self.partitions.tiles()
    }

    /// Rows of patches in use, for nodal strain.
    #[must_use]
    pub const fn patch_row_count(&self) -> usize {
        self.patch_rows
    }

    /// Energy that the material can release from rest, J, almost zero for the isochoric laws.
    pub(crate) const fn rounding_energy(&self) -> f64 {
        self.rounding_energy
    }
}

fn mark_supports(nodes: &mut [NodeInertia], supports: impl Iterator<Item = Support>) -> Result<(), BuildError> {
    let count = nodes.len();
    for (index, support) in supports.enumerate() {
        let Some(inertia) = nodes.get_mut(support.node as usize) else {
            return Err(BuildError::SupportNode { support: index, node: support.node, nodes: count });
        };
        inertia.mark(support.axes, support.moves);
    }
    Ok(())
}

/// Holds the nodes of which all elements are removed. One that motions may move still follows them.
fn mark_alone(nodes: &mut [NodeInertia], mesh: &Mesh<'_>) {
    for node in mesh.tets().flatten() {
        nodes.get_mut(node as usize).into_iter().for_each(NodeInertia::mark_neighbour);
    }
    for node in mesh.all_tets().flatten() {
        if let Some(inertia) = nodes.get_mut(node as usize).filter(|inertia| inertia.mass == 0.0) {
            inertia.mark(Axes::XYZ, false);
        }
    }
    nodes.iter_mut().for_each(NodeInertia::clear_mass);
}

/// Marks the nodes of all elements that can move. With nodal pressure or strain an element between fixed nodes is left
/// out only if it has none of these: it counts in the volume around them.
fn mark_neighbours(nodes: &mut [NodeInertia], mesh: &Mesh<'_>) {
    for tet in mesh.tets() {
        let fixed = |&node: &u32| nodes.get(node as usize).is_some_and(NodeInertia::is_marked_fixed);
        if tet.iter().all(fixed) {
            continue;
        }
        for node in tet {
            if let Some(inertia) = nodes.get_mut(node as usize) {
                inertia.mark_neighbour();
            }
        }
    }
}

/// Finds for each corner of each element which of the tissues at that node it is of ([`ElementTile::slot`]).
fn find_slots(material: &impl Material, mesh: &Mesh<'_>, nodes: &mut [NodeInertia], tiles: &mut [ElementTile]) {
    nodes.iter_mut().for_each(NodeInertia::clear_regions);
    for (element, tet) in mesh.elements() {
        for node in tet {
            if let Some(inertia) = nodes.get_mut(node as usize) {
                inertia.add_region(material.region(element));
            }
        }
    }
    for tile in tiles {
        for lane in 0..TILE {
            let region = material.region(tile.element(lane));
            let slots = [0, 1, 2, 3]
                .map(|corner| nodes.get(tile.node(corner, lane)).map_or(0, |inertia| inertia.slot_of_region(region)));
            tile.set_slots(lane, slots);
        }
    }
}

/// A strain whose energy proves nothing: rounding and the noise of a network may have put it there.
const ROUNDED_STRAIN: f64 = 1e-4;

/// Adds a quarter of each element's mass to each of its nodes, whose supports have been marked. Gives the mass (kg) and
/// the energy of a strain that is nothing but rounding (J).
fn lump_masses(material: &impl Material, mesh: &Mesh<'_>, nodes: &mut [NodeInertia]) -> Result<(f64, f64), BuildError> {
    let (mut mass, mut rounding) = (0.0, 0.0);
    nodes.iter_mut().for_each(NodeInertia::clear_mass);
    for (element, tet) in mesh.all_tets().enumerate() {
        let Some(tissue) = material.tissue(element) else {
            return Err(BuildError::NoTissue { element });
        };
        if let Some((name, value)) = tissue.law.unusable_constant() {
            return Err(BuildError::Constant { element, name, value });
        }
        if !(tissue.density.is_finite() && tissue.density > 0.0) {
            return Err(BuildError::Density { element, value: tissue.density });
        }
        if mesh.is_removed(element) {
            continue;
        }
        let volume = volume(mesh.corners(tet));
        let share = 0.25 * volume * f64::from(tissue.density);
        mass += 4.0 * share;
        rounding += volume * (0.5 * Moduli::of(&tissue.law).shear * ROUNDED_STRAIN * ROUNDED_STRAIN);
        for node in tet {
            if let Some(inertia) = nodes.get_mut(node as usize) {
                inertia.mass += share as f32;
            }
        }
    }
    if mesh.has_removed() {
        for node in mesh.all_tets().flatten() {
            nodes.get_mut(node as usize).into_iter().for_each(NodeInertia::leave_alone);
        }
    }
    for (node, inertia) in nodes.iter_mut().enumerate() {
        if inertia.mass == 0.0 {
            return Err(MeshError::UnusedNode { node }.into());
        }
        inertia.invert();
    }
    Ok((mass, rounding))
}

/// A scene over memory of whichever kind.
#[derive(Debug)]
pub struct SceneView<'a, M> {
    pub(crate) material: &'a M,
    pub(crate) inertia: &'a [NodeInertia],
    pub(crate) tiles: &'a [ElementTile],
    /// For materials with nodal strain.
    pub(crate) patches: Patches<'a>,
    /// For tissue with fibres.
    pub(crate) fibres: &'a [FibreTile],
    facts: &'a SceneFacts,
}

impl<M> Clone for SceneView<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<M> Copy for SceneView<'_, M> {}

impl<M> Deref for SceneView<'_, M> {
    type Target = SceneFacts;

    fn deref(&self) -> &SceneFacts {
        self.facts
    }
}

impl<'a, M> SceneView<'a, M> {
    /// A scene that [`SceneFacts::build`] has built in this memory.
    #[must_use]
    pub fn new(
        material: &'a M,
        nodes: &'a [NodeInertia],
        tiles: &'a [ElementTile],
        patches: &'a [PatchRow],
        fibres: &'a [FibreTile],
        facts: &'a SceneFacts,
    ) -> Self {
        Self {
            material,
            inertia: nodes.get(..facts.node_count).unwrap_or_default(),
            tiles: tiles.get(..facts.tile_count()).unwrap_or_default(),
            patches: Patches::of(patches.get(..facts.patch_rows).unwrap_or_default()),
            fibres,
            facts,
        }
    }

    /// Places of the elements, tile and number in the tile, in the order of the tables.
    pub(crate) fn places(&self) -> impl Iterator<Item = (&'a ElementTile, usize)> + use<'a, M> {
        let places = self.tiles.iter().flat_map(|tile| (0..TILE).map(move |lane| (tile, lane)));
        places.filter(|(tile, lane)| tile.volume::<f32>(*lane) > 0.0)
    }

    /// Mass of a node, kg; almost zero for one whose elements are all removed, zero for one that does not exist.
    #[must_use]
    pub fn node_mass(&self, node: usize) -> f32 {
        self.inertia.get(node).map_or(0.0, |inertia| inertia.mass)
    }

    /// The supports that the scene was built with, and those of nodes whose elements are all removed.
    pub fn supports(&self) -> impl Iterator<Item = Support> + use<'a, M> {
        self.inertia.iter().enumerate().flat_map(|(node, inertia)| {
            let (held, moves) = (inertia.held(), inertia.movable());
            let of = move |axes: Axes, moves: bool| Support { node: node as u32, axes, moves };
            [of(held, false), of(moves, true)].into_iter().filter(|support| support.axes != Axes::NONE)
        })
    }

    /// The edge of a cube of six mean elements, m.
    pub(crate) fn edge(&self) -> f32 {
        let volume: f32 = self.places().map(|(tile, lane)| tile.volume::<f32>(lane)).sum();
        libm::cbrtf(6.0 * volume / self.element_count().max(1) as f32)
    }

    /// Whether a node belongs to no element any more ([`Mesh::without`]).
    #[must_use]
    pub fn is_alone(&self, node: usize) -> bool {
        self.inertia.get(node).is_some_and(NodeInertia::is_alone)
    }

    /// Held axes of a node.
    #[must_use]
    pub fn held(&self, node: usize) -> Axes {
        self.inertia.get(node).map_or(Axes::NONE, NodeInertia::held)
    }

    /// Held axes of a node that motions may move.
    #[must_use]
    pub fn movable(&self, node: usize) -> Axes {
        self.inertia.get(node).map_or(Axes::NONE, NodeInertia::movable)
    }
}

impl<'a, M: Material> SceneView<'a, M> {
    /// Size of a node's own tissue: the edge of a cube of its volume, m.
    pub(crate) fn node_size(&self, node: usize) -> f32 {
        libm::cbrtf(self.node_volume(node))
    }

    /// Volume of a node's own tissue, m^3.
    pub(crate) fn node_volume(&self, node: usize) -> f32 {
        self.node_mass(node) / self.density()
    }

    /// Of the first tissue, kg/m^3.
    pub(crate) fn density(&self) -> f32 {
        self.material.tissue(0).map_or(f32::INFINITY, |tissue| tissue.density)
    }

    /// The tetrahedra that it is made of.
    #[must_use]
    #[inline(always)]
    pub fn element(&self) -> Element {
        self.material.element()
    }

    /// The tissue of each mesh element; nothing where there is one.
    fn tissues_of_elements(&self) -> &'a [u16] {
        match self.material.laws() {
            Laws::One(_) => &[],
            Laws::Regions { of_element, .. } => of_element,
        }
    }

    /// What internal forces are computed from.
    pub(crate) fn elements(&self) -> Elements<'a, M::Law> {
        Elements { laws: self.material.laws(), tiles: self.tiles, partitions: &self.facts.partitions }
    }

    /// Fields of every element, in the order of the tables, under the given displacements (m).
    pub fn element_fields(self, displacement: &'a [NodeVector]) -> impl Iterator<Item = ElementFields> + use<'a, M> {
        let laws = self.material.laws();
        let of_fibres = move |element: usize, h: DMat3| {
            let tissue = usize::from(self.material.region(element));
            let fibres = self.material.fibres().get(tissue).copied().unwrap_or_default();
            if !fibres.are_there() {
                return DMat3::ZERO;
            }
            let directions = directions_of(self.material, element);
            // Not known where a host has given them and keeps none.
            let known = directions != [DVec3::ZERO; 2];
            if known { FibreTangent::new(&fibres, directions, h).kirchhoff_stress() } else { DMat3::NAN }
        };
        self.places().map(move |(tile, lane)| {
            let element = tile.element(lane);
            element_fields(&laws.of(element), tile, lane, displacement, |h| of_fibres(element, h))
        })
    }

    /// Every element, as its place in the tables with its law.
    #[cfg(feature = "std")]
    pub(crate) fn laws_at_places(self) -> impl Iterator<Item = (&'a ElementTile, usize, M::Law)> {
        let laws = self.material.laws();
        self.places().map(move |(tile, lane)| (tile, lane, laws.of(tile.element(lane))))
    }

    /// The volumes of the nodes in rows of [`crate::element::NodalVolumes`].
    pub(crate) fn volume_rows(self, rows: &[NodeVector]) -> VolumeRows<'_> {
        VolumeRows { rows, several_tissues: self.material.laws().has_several_tissues() }
    }

    /// Strain energy under the given displacements (m), J, with the nodes' volumes where the material needs them, and of
    /// tissue that relaxes with that of what it remembers.
    pub(crate) fn strain_energy(
        self,
        displacement: &[NodeVector],
        volumes: &[NodeVector],
        memory: &[NodeVector],
    ) -> f64 {
        self.strain_energy_at(0..self.energy_places(), displacement, volumes, memory)
    }

    /// The places at which there is strain energy: of elements, and of patches around nodes.
    pub(crate) fn energy_places(&self) -> usize {
        TILE * self.energy_tiles()
    }

    fn energy_tiles(&self) -> usize {
        self.tiles.len() + if self.element().is_nodal_strain() { self.patches.tiles().len() } else { 0 }
    }

    /// Strain energy at some of the places, J. Those that follow each other are in tiles that follow each other, so
    /// that few of them lie all over the body.
    pub(crate) fn strain_energy_at(
        self,
        places: Range<usize>,
        displacement: &[NodeVector],
        volumes: &[NodeVector],
        memory: &[NodeVector],
    ) -> f64 {
        let remembered = self.series([0.0; 2], 0).map(|series| Remembered { series, memory });
        let more = MoreEnergy { fibres: self.fibrous(), remembered };
        let laws = self.material.laws();
        let volumes = self.element().is_nodal_pressure().then(|| self.volume_rows(volumes));
        let tiles = self.energy_tiles().max(1);
        let energies = places.map(|place| {
            let (at, lane) = (place % tiles, place / tiles % TILE);
            if let Some(tile) = self.tiles.get(at) {
                let law = laws.of(tile.element(lane));
                return if tile.volume::<f32>(lane) <= 0.0 {
                    0.0
                } else if self.element().is_nodal_strain() {
                    stabilising_energy(&law, tile, lane, displacement, remembered)
                } else {
                    element_energy(&law, (tile, [at, lane]), displacement, volumes, more)
                };
            }
            let patch = at - self.tiles.len();
            match self.patches.tiles().get(patch) {
                Some(tile) if tile.volume(lane) > 0.0 => {
                    let law = laws.of(tile.element(lane));
                    patch_energy(&law, self.patches, (tile, [patch, lane]), displacement, more)
                }
                _ => 0.0,
            }
        });
        energies.sum()
    }
}

/// What can be seen as a scene.
pub trait AsScene {
    /// What it is made of.
    type Material: ElementMaterial;
    /// The scene.
    fn as_scene(&self) -> SceneView<'_, Self::Material>;
}

impl<M: ElementMaterial> AsScene for SceneView<'_, M> {
    type Material = M;

    fn as_scene(&self) -> SceneView<'_, M> {
        *self
    }
}

/// A scene for unit tests of loops over elements.
#[cfg(test)]
pub(crate) mod test_scene {
    use std::vec::Vec;

    use super::VecScene;
    use crate::material::{Law, Tissue};
    use crate::mesh::{Bar, Mesh, Winding};

    /// A bar's points (m) and its scene, of water's density and without supports.
    pub(crate) fn scene_of<L: Law>(law: L, bar: Bar) -> (Vec<[f32; 3]>, VecScene<Tissue<L>>) {
        let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
        let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
        let scene = VecScene::build(Tissue { law, density: 1000.0 }, &mesh, &[]).unwrap();
        (points, scene)
    }
}
