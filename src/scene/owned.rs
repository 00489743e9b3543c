//! Scenes that own their tables: with a fixed capacity, in a `static` if wanted, or on a host with a heap.

use core::ops::Deref;

use super::{AsScene, BuildError, SceneFacts, SceneView, Support};
#[cfg(any(feature = "std", test))]
use super::{fibre_tiles_for, fibres::write_directions, patch_rows_for, tiles_for, tissue_count};
use crate::element::{ElementMaterial, ElementTile, FibreTile, NodeInertia, PatchRow};
use crate::material::Material;
use crate::mesh::Mesh;

/// Memory for the tables of a scene.
pub trait SceneTables {
    /// Nodes and tiles.
    fn tables(&self) -> (&[NodeInertia], &[ElementTile]);
    /// Rows of patches of materials with nodal strain.
    fn patches(&self) -> &[PatchRow] {
        &[]
    }
    /// Directions of fibres.
    fn fibres(&self) -> &[FibreTile] {
        &[]
    }
}

/// A scene that owns its tables.
#[derive(Clone, Debug)]
pub struct Scene<M, S> {
    pub(super) material: M,
    pub(super) tables: S,
    pub(super) facts: SceneFacts,
}

impl<M, S> Deref for Scene<M, S> {
    type Target = SceneFacts;

    fn deref(&self) -> &SceneFacts {
        &self.facts
    }
}

impl<M, S: SceneTables> Scene<M, S> {
    /// The scene.
    pub fn view(&self) -> SceneView<'_, M> {
        let (nodes, tiles) = self.tables.tables();
        SceneView::new(&self.material, nodes, tiles, self.tables.patches(), self.tables.fibres(), &self.facts)
    }
}

impl<M: ElementMaterial, S: SceneTables> AsScene for Scene<M, S> {
    type Material = M;

    fn as_scene(&self) -> SceneView<'_, M> {
        self.view()
    }
}

/// Tables for at most `N` nodes, `T` tiles of elements, `P` rows of patches and `F` tiles of directions of fibres.
#[derive(Clone, Debug)]
pub struct FixedTables<const N: usize, const T: usize, const P: usize = 0, const F: usize = 0> {
    nodes: heapless::Vec<NodeInertia, N>,
    tiles: heapless::Vec<ElementTile, T>,
    /// Arrays, of which none takes no bytes.
    patches: [PatchRow; P],
    fibres: [FibreTile; F],
}

impl<const N: usize, const T: usize, const P: usize, const F: usize> SceneTables for FixedTables<N, T, P, F> {
    fn tables(&self) -> (&[NodeInertia], &[ElementTile]) {
        (&self.nodes, &self.tiles)
    }

    fn patches(&self) -> &[PatchRow] {
        &self.patches
    }

    fn fibres(&self) -> &[FibreTile] {
        &self.fibres
    }
}

/// A scene of at most `N` nodes and `T` tiles of elements ([`tiles_for`](super::tiles_for)), with nodal strain of at
/// most `P` rows of patches ([`patch_rows_for`](super::patch_rows_for)), with fibres of at most `F` tiles of directions
/// ([`fibre_tiles_for`](super::fibre_tiles_for)), which may be a `static`.
pub type FixedScene<M, const N: usize, const T: usize, const P: usize = 0, const F: usize = 0> =
    Scene<M, FixedTables<N, T, P, F>>;

impl<M, const N: usize, const T: usize, const P: usize, const F: usize> FixedScene<M, N, T, P, F> {
    /// An empty scene.
    pub const fn new(material: M) -> Self {
        let tables = FixedTables {
            nodes: heapless::Vec::new(),
            tiles: heapless::Vec::new(),
            patches: [PatchRow::EMPTY; P],
            fibres: [FibreTile::EMPTY; F],
        };
        Self { material, tables, facts: SceneFacts::EMPTY }
    }
}

impl<M: Material, const N: usize, const T: usize, const P: usize, const F: usize> FixedScene<M, N, T, P, F> {
    /// Builds the scene in place from a mesh and its supports; a node may be listed more than once.
    /// On an error the scene is empty.
    pub fn build(&mut self, mesh: &Mesh<'_>, supports: &[Support]) -> Result<(), BuildError> {
        let Self { material, tables: FixedTables { nodes, tiles, patches, fibres }, facts } = self;
        *facts = SceneFacts::EMPTY;
        // All of it: what is too little is told with what is needed.
        let _ = nodes.resize(N, NodeInertia::EMPTY);
        let _ = tiles.resize(T, ElementTile::EMPTY);
        *facts = SceneFacts::build(material, mesh, supports.iter().copied(), nodes, tiles, patches, fibres)?;
        nodes.truncate(facts.node_count);
        tiles.truncate(facts.tile_count());
        Ok(())
    }
}

/// Tables of as many nodes and elements as there are.
#[cfg(any(feature = "std", test))]
#[derive(Clone, Debug)]
pub struct VecTables {
    nodes: std::vec::Vec<NodeInertia>,
    tiles: std::vec::Vec<ElementTile>,
    patches: std::vec::Vec<PatchRow>,
    fibres: std::vec::Vec<FibreTile>,
    /// Point masses, kg, with their nodes.
    masses: std::vec::Vec<(usize, f32)>,
}

#[cfg(any(feature = "std", test))]
impl SceneTables for VecTables {
    fn tables(&self) -> (&[NodeInertia], &[ElementTile]) {
        (&self.nodes, &self.tiles)
    }

    fn patches(&self) -> &[PatchRow] {
        &self.patches
    }

    fn fibres(&self) -> &[FibreTile] {
        &self.fibres
    }
}

/// A scene on a host with a heap.
#[cfg(any(feature = "std", test))]
pub type VecScene<M> = Scene<M, VecTables>;

#[cfg(any(feature = "std", test))]
impl<M: Material> VecScene<M> {
    /// Builds a scene from a mesh, what it is made of, and its supports; a node may be listed more than once.
    // Not inlined: other crates use the one that is compiled here.
    #[inline(never)]
    pub fn build(material: M, mesh: &Mesh<'_>, supports: &[Support]) -> Result<Self, BuildError> {
        let mut nodes = std::vec![NodeInertia::EMPTY; mesh.points().len()];
        let mut tiles = std::vec![ElementTile::EMPTY; tiles_for(mesh.element_count())];
        let supports = supports.iter().copied();
        let mut facts = SceneFacts::without_patches(&material, mesh, supports, &mut nodes, &mut tiles)?;
        tiles.truncate(facts.tile_count());
        let (mut patches, mut fibres) = (std::vec::Vec::new(), std::vec::Vec::new());
        let tissues = tissue_count(&material);
        if facts.families > 0 {
            let tiles = fibre_tiles_for(material.element(), nodes.len(), facts.element_count, tissues);
            fibres.resize(tiles, FibreTile::EMPTY);
        }
        if material.element().is_nodal_strain() {
            let mut rows = patch_rows_for(nodes.len(), facts.element_count, tissues);
            loop {
                patches.resize(rows, PatchRow::EMPTY);
                match facts.build_patches(&material, &tiles, &mut patches, &mut fibres) {
                    Ok(()) => break,
                    Err(BuildError::PatchCapacity { needed, .. }) if needed > rows => rows = needed,
                    Err(error) => return Err(error),
                }
            }
            patches.truncate(facts.patch_rows);
            patches.shrink_to_fit();
        } else if facts.families > 0 {
            write_directions(&material, &tiles, &mut fibres)?;
        }
        Ok(Self { material, tables: VecTables { nodes, tiles, patches, fibres, masses: std::vec![] }, facts })
    }
}

#[cfg(feature = "std")]
impl<M> VecScene<M> {
    /// Adds a point mass (kg, not negative) to a node, which inertia, gravity and damping act on as on tissue. One whose elements
    /// are all removed carries none.
    pub fn add_mass(&mut self, node: usize, kilogram: f32) -> Result<(), BuildError> {
        let nodes = self.tables.nodes.len();
        let Some(inertia) = self.tables.nodes.get_mut(node).filter(|_| kilogram >= 0.0 && kilogram.is_finite()) else {
            return Err(BuildError::PointMass { node, nodes, kilogram });
        };
        if !inertia.is_alone() {
            inertia.add_mass(kilogram);
            (self.facts.has_point_masses, self.facts.mass) = (true, self.facts.mass + f64::from(kilogram));
            self.tables.masses.push((node, kilogram));
        }
        Ok(())
    }

    /// A scene of the same nodes and supports, of another material and without some elements. Point masses stay.
    pub(crate) fn exchanged(&self, material: M, mesh: &Mesh<'_>) -> Result<Self, BuildError>
    where
        M: Material,
    {
        let supports = std::vec::Vec::from_iter(self.view().supports());
        let mut scene = Self::build(material, mesh, &supports)?;
        for &(node, kilogram) in &self.tables.masses {
            scene.add_mass(node, kilogram)?;
        }
        Ok(scene)
    }
}
