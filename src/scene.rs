//! What is simulated, computed once from a mesh: element tables in blocks of [`BLOCK`] elements (node
//! numbers, shape function gradients in 1/m, rest volumes in m^3), lumped masses (kg; a quarter of
//! `rho V` of each element to each of its nodes) and which axes of which nodes are held.
//!
//! Memory is the caller's: arrays for a [`FixedScene`] (also in a `static`), slices, or vectors on a host.

use core::fmt;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec4};

use crate::chains::Numbered;
use crate::chunks::{Chunks, Seats, most_blocks};
use crate::lanes::{BLOCK, BlockNodes, Real};
use crate::material::{Law, Laws, Material, releasable_energy};
use crate::mesh::{Mesh, MeshError, gradients, volume};
use crate::symmetric::Symmetric;

/// Coordinate axes, as a set.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub struct Axes(u8);

impl Axes {
    /// Along x.
    pub const X: Self = Self(1);
    /// Along y.
    pub const Y: Self = Self(2);
    /// Along z.
    pub const Z: Self = Self(4);
    /// All three.
    pub const XYZ: Self = Self(7);
    /// None.
    pub const NONE: Self = Self(0);

    /// Axes in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether axis 0, 1 or 2 (x, y, z) is in the set.
    #[must_use]
    pub const fn has(self, axis: usize) -> bool {
        axis < 3 && self.0 >> axis & 1 == 1
    }
}

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

/// Why a scene could not be built. The scene is empty afterwards.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum BuildError {
    /// The mesh is not sound.
    Mesh(MeshError),
    /// More nodes than the scene has room for.
    NodeCapacity {
        /// Nodes of the mesh.
        needed: usize,
        /// Room.
        capacity: usize,
    },
    /// More blocks of elements than the scene has room for.
    BlockCapacity {
        /// Blocks needed, of [`BLOCK`] elements each.
        needed: usize,
        /// Room.
        capacity: usize,
    },
    /// A support names a node that is not there.
    SupportNode {
        /// Position in the list of supports.
        support: usize,
        /// The node it names.
        node: u32,
        /// Nodes in the mesh.
        nodes: usize,
    },
    /// The material names no tissue for an element.
    NoTissue {
        /// The element.
        element: usize,
    },
    /// A constant of the law is not a finite positive number.
    Constant {
        /// The element.
        element: usize,
        /// The constant.
        name: &'static str,
        /// Its value.
        value: f32,
    },
    /// A density is not a finite positive number.
    Density {
        /// The element.
        element: usize,
        /// The density, kg/m^3.
        value: f32,
    },
    /// Every element has four fixed nodes, so nothing can move.
    NothingMoves,
}

impl From<MeshError> for BuildError {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

impl fmt::Display for BuildError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Mesh(error) => error.fmt(f),
            Self::NodeCapacity { needed, capacity } => {
                write!(f, "the mesh has {needed} nodes, the scene has room for {capacity}")
            }
            Self::BlockCapacity { needed, capacity } => write!(
                f,
                "the mesh needs {needed} blocks of {BLOCK} elements, the scene has room for {capacity}"
            ),
            Self::SupportNode { support, node, nodes } => {
                write!(f, "support {support}: node {node} does not exist, the mesh has {nodes} nodes")
            }
            Self::NoTissue { element } => write!(f, "element {element}: the material names no tissue"),
            Self::Constant { element, name, value } => {
                write!(
                    f,
                    "element {element}: constant {name} is {value}, it must be a finite positive number"
                )
            }
            Self::Density { element, value } => {
                write!(f, "element {element}: density is {value} kg/m^3, it must be a finite positive number")
            }
            Self::NothingMoves => write!(f, "all nodes of all elements are fixed, so nothing can move"),
        }
    }
}

impl core::error::Error for BuildError {}

/// Tables of [`BLOCK`] elements, structure of arrays. The elements of a block come from as many parts of the mesh: neighbours
/// share nodes, and adding their forces one after the other would wait for each sum to reach memory. Places without an
/// element have volume zero and name nodes of another, to which they add zero.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct ElementBlock {
    /// Node numbers.
    nodes: [[u32; BLOCK]; 4],
    /// Shape function gradients of nodes 1, 2, 3 along x, y, z, 1/m.
    gradients: [[[f32; BLOCK]; 3]; 3],
    /// Rest volumes, m^3.
    volumes: [f32; BLOCK],
    /// The mesh's number of each element.
    elements: [u32; BLOCK],
    /// Largest eigenvalue of `sum_a ga ga^T` over the four shape function gradients, 1/m^2.
    spreads: [f32; BLOCK],
}

impl ElementBlock {
    /// A block without elements.
    pub const EMPTY: Self = Self {
        nodes: [[0; BLOCK]; 4],
        gradients: [[[0.0; BLOCK]; 3]; 3],
        volumes: [0.0; BLOCK],
        elements: [0; BLOCK],
        spreads: [0.0; BLOCK],
    };

    /// Node `corner` (0 to 3) of the element in `lane`.
    #[inline(always)]
    pub(crate) fn node(&self, corner: usize, lane: usize) -> usize {
        self.nodes[corner % 4][lane % BLOCK] as usize
    }

    /// The nodes, by corner and lane.
    #[inline(always)]
    pub(crate) fn nodes(&self) -> [&[u32; BLOCK]; 4] {
        self.nodes.each_ref()
    }

    /// The nodes, if all are below `count`.
    #[inline(always)]
    pub(crate) fn nodes_below<R: Real>(&self, count: usize) -> Option<BlockNodes<'_, 4>> {
        BlockNodes::among::<R>(self.nodes(), 0, count)
    }

    /// The mesh's number of the element in `lane`.
    #[inline(always)]
    pub(crate) fn element(&self, lane: usize) -> usize {
        self.elements[lane % BLOCK] as usize
    }

    /// Gradient component of shape functions 1 to 3 (`corner` 0 to 2) for lanes from `first` on, 1/m.
    #[inline(always)]
    pub(crate) fn gradient<R: Real>(&self, corner: usize, axis: usize, first: usize) -> R {
        lanes(&self.gradients[corner][axis], first)
    }

    /// All components of one, 1/m.
    #[inline(always)]
    pub(crate) fn gradients<R: Real>(&self, corner: usize, first: usize) -> [R; 3] {
        [self.gradient(corner, 0, first), self.gradient(corner, 1, first), self.gradient(corner, 2, first)]
    }

    /// One gradient component of one element, 1/m.
    #[inline(always)]
    pub(crate) fn gradient_of(&self, corner: usize, axis: usize, lane: usize) -> f32 {
        self.gradients[corner % 3][axis % 3][lane % BLOCK]
    }

    /// Largest eigenvalue of `sum_a ga ga^T` for lanes from `first` on, 1/m^2.
    #[inline(always)]
    pub(crate) fn spread<R: Real>(&self, first: usize) -> R {
        lanes(&self.spreads, first)
    }

    /// Rest volumes for lanes from `first` on, m^3.
    #[inline(always)]
    pub(crate) fn volume<R: Real>(&self, first: usize) -> R {
        lanes(&self.volumes, first)
    }
}

/// The vector of a block's numbers that begins with lane `first`.
#[inline(always)]
fn lanes<R: Real>(of: &[f32; BLOCK], first: usize) -> R {
    // What is so anyway, for the compiler to see that no index is beyond the end.
    let vectors = (BLOCK / R::COUNT).max(1);
    let first = first / R::COUNT % vectors * R::COUNT;
    R::from_fn(|lane| of[(first + lane) % BLOCK])
}

/// Mass of a node (kg) and its inverse along each axis (1/kg), zero along held ones.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct NodeInertia {
    pub(crate) inverse: [f32; 3],
    pub(crate) mass: f32,
}

impl NodeInertia {
    /// A node without mass.
    pub const EMPTY: Self = Self { inverse: [0.0; 3], mass: 0.0 };

    /// Ones along free axes; the fourth number is zero.
    #[inline(always)]
    pub(crate) fn free(&self) -> Vec4 {
        let [x, y, z] = self.inverse;
        Vec4::select(Vec4::new(x, y, z, 0.0).cmpgt(Vec4::ZERO), Vec4::ONE, Vec4::ZERO)
    }
}

/// The elements of a scene with their laws.
#[derive(Clone, Copy)]
pub(crate) struct Elements<'a, L> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) blocks: &'a [ElementBlock],
    pub(crate) chunks: &'a Chunks,
}

/// Blocks that are enough for any `elements` elements.
#[must_use]
pub const fn blocks_for(elements: usize) -> usize {
    most_blocks(elements)
}

/// A scene over storage `N` for the nodes and `B` for the blocks of elements.
#[derive(Clone, Debug)]
pub struct Scene<M, N, B> {
    material: M,
    nodes: N,
    blocks: B,
    built: Built,
}

/// What was found when a scene was built, apart from its tables.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Built {
    node_count: usize,
    element_count: usize,
    chunks: Chunks,
    mass: f64,
    releasable_energy: f64,
}

impl Built {
    pub(crate) const NOTHING: Self =
        Self { node_count: 0, element_count: 0, chunks: Chunks::NONE, mass: 0.0, releasable_energy: 0.0 };
}

/// A scene with room for `N` nodes and `B` blocks of elements ([`blocks_for`]), which may be a `static`.
pub type FixedScene<M, const N: usize, const B: usize> = Scene<M, [NodeInertia; N], [ElementBlock; B]>;

impl<M, const N: usize, const B: usize> FixedScene<M, N, B> {
    /// An empty scene.
    pub const fn new(material: M) -> Self {
        Self::over(material, [NodeInertia::EMPTY; N], [ElementBlock::EMPTY; B])
    }
}

impl<M, N, B> Scene<M, N, B> {
    /// An empty scene over the given storage.
    pub const fn over(material: M, nodes: N, blocks: B) -> Self {
        Self { material, nodes, blocks, built: Built::NOTHING }
    }

    /// A scene that was built before, over the storage that it was built in.
    #[cfg(feature = "capi-neo-hookean")]
    pub(crate) const fn again(material: M, nodes: N, blocks: B, built: Built) -> Self {
        Self { material, nodes, blocks, built }
    }

    /// What was found when it was built.
    #[cfg(feature = "capi-neo-hookean")]
    pub(crate) const fn built(&self) -> &Built {
        &self.built
    }

    /// The material.
    pub const fn material(&self) -> &M {
        &self.material
    }

    /// Number of nodes.
    #[must_use]
    pub const fn node_count(&self) -> usize {
        self.built.node_count
    }

    /// Number of elements that take part; those with four fixed nodes were left out.
    #[must_use]
    pub const fn element_count(&self) -> usize {
        self.built.element_count
    }

    /// Total mass, kg.
    #[must_use]
    pub const fn mass(&self) -> f64 {
        self.built.mass
    }

    /// Energy that the material can release from rest, J; zero for the isochoric laws.
    pub(crate) const fn releasable_energy(&self) -> f64 {
        self.built.releasable_energy
    }
}

impl<M: Material, N: AsRef<[NodeInertia]>, B: AsRef<[ElementBlock]>> Scene<M, N, B> {
    /// Inertia of each node.
    #[inline(always)]
    pub(crate) fn inertia(&self) -> &[NodeInertia] {
        self.nodes.as_ref().get(..self.built.node_count).unwrap_or_default()
    }

    /// Blocks of elements in use.
    #[inline(always)]
    pub(crate) fn blocks(&self) -> &[ElementBlock] {
        self.blocks.as_ref().get(..self.built.chunks.blocks()).unwrap_or_default()
    }

    /// What internal forces are computed from.
    pub(crate) fn elements(&self) -> Elements<'_, M::Law> {
        Elements { laws: self.material.laws(), blocks: self.blocks(), chunks: &self.built.chunks }
    }

    /// Block and lane of each element, in the order of the tables.
    pub(crate) fn places(&self) -> impl Iterator<Item = (&ElementBlock, usize)> {
        let places = self.blocks().iter().flat_map(|block| (0..BLOCK).map(move |lane| (block, lane)));
        places.filter(|(block, lane)| block.volumes[lane % BLOCK] > 0.0)
    }

    /// Mass of a node, kg; zero for a node that does not exist.
    #[must_use]
    pub fn node_mass(&self, node: usize) -> f32 {
        self.inertia().get(node).map_or(0.0, |inertia| inertia.mass)
    }

    /// Held axes of a node.
    #[must_use]
    pub fn held(&self, node: usize) -> Axes {
        self.axes_where(node, |inverse| inverse == 0.0)
    }

    /// Held axes of a node that motions may move.
    #[must_use]
    pub fn movable(&self, node: usize) -> Axes {
        self.axes_where(node, |inverse| inverse.to_bits() == MOVABLE.to_bits())
    }

    fn axes_where(&self, node: usize, is: impl Fn(f32) -> bool) -> Axes {
        let inverse = self.inertia().get(node).map_or([1.0; 3], |inertia| inertia.inverse);
        let axes = inverse.iter().enumerate().filter(|(_, value)| is(**value));
        Axes(axes.fold(0, |bits, (axis, _)| bits | 1 << axis))
    }
}

impl<M: Material, N, B> Scene<M, N, B>
where
    N: AsRef<[NodeInertia]> + AsMut<[NodeInertia]>,
    B: AsRef<[ElementBlock]> + AsMut<[ElementBlock]>,
{
    /// Builds the scene in place from a mesh and its supports; a node may be listed more than once.
    /// Allocates nothing. On an error the scene is empty.
    pub fn build(&mut self, mesh: &Mesh<'_>, supports: &[Support]) -> Result<(), BuildError> {
        self.build_from(mesh, supports.iter().copied())
    }

    /// The same with supports from wherever they come.
    pub(crate) fn build_from(
        &mut self,
        mesh: &Mesh<'_>,
        supports: impl Iterator<Item = Support>,
    ) -> Result<(), BuildError> {
        self.built = Built::NOTHING;
        self.built = self.fill(mesh, supports)?;
        Ok(())
    }

    fn fill(
        &mut self,
        mesh: &Mesh<'_>,
        supports: impl Iterator<Item = Support>,
    ) -> Result<Built, BuildError> {
        let needed = mesh.points().len();
        let capacity = self.nodes.as_ref().len();
        let Some(nodes) = self.nodes.as_mut().get_mut(..needed) else {
            return Err(BuildError::NodeCapacity { needed, capacity });
        };
        nodes.fill(NodeInertia::EMPTY);
        // Until the end `inverse` holds a mark for each axis: free, fixed or moved.
        mark_supports(nodes, supports)?;
        let still = |tet: [u32; 4]| {
            tet.iter().all(|&node| nodes.get(node as usize).is_some_and(|n| n.inverse == [FIXED; 3]))
        };
        let elements = mesh.tets().enumerate().filter(|&(_, nodes)| !still(nodes));
        let elements = elements.map(|(element, nodes)| Numbered { element, nodes });
        let mut seats = Seats::of(nodes.len(), elements.clone());
        let chunks = *seats.chunks();
        let (needed, capacity) = (chunks.blocks(), self.blocks.as_ref().len());
        if needed == 0 {
            return Err(BuildError::NothingMoves);
        }
        let Some(blocks) = self.blocks.as_mut().get_mut(..needed) else {
            return Err(BuildError::BlockCapacity { needed, capacity });
        };
        blocks.fill(ElementBlock::EMPTY);
        let mut element_count = 0;
        for chain in chunks.chains(elements) {
            seats.place(&chain, |element, (block, lane)| {
                if let Some(block) = blocks.get_mut(block) {
                    write_element(block, lane, element, mesh.corners(element.nodes));
                    element_count += 1;
                }
            });
        }

        let (mut mass, mut releasable) = (0.0, 0.0);
        for (element, tet) in mesh.tets().enumerate() {
            let Some(tissue) = self.material.tissue(element) else {
                return Err(BuildError::NoTissue { element });
            };
            if let Some((name, value)) = tissue.law.unusable_constant() {
                return Err(BuildError::Constant { element, name, value });
            }
            if !(tissue.density.is_finite() && tissue.density > 0.0) {
                return Err(BuildError::Density { element, value: tissue.density });
            }
            let corners = mesh.corners(tet);
            let share = 0.25 * volume(corners) * f64::from(tissue.density);
            mass += 4.0 * share;
            releasable += volume(corners) * releasable_energy(&tissue.law);
            for node in tet {
                if let Some(inertia) = nodes.get_mut(node as usize) {
                    inertia.mass += share as f32;
                }
            }
        }
        for (node, inertia) in nodes.iter_mut().enumerate() {
            if inertia.mass == 0.0 {
                return Err(MeshError::UnusedNode { node }.into());
            }
            let inverse = 1.0 / inertia.mass;
            inertia.inverse = inertia.inverse.map(|mark| match mark {
                FREE => inverse,
                MOVED => MOVABLE,
                _ => 0.0,
            });
        }
        Ok(Built { node_count: nodes.len(), element_count, chunks, mass, releasable_energy: releasable })
    }
}

/// Inverse mass of a held axis that motions may move: zero, with a sign to tell it by.
const MOVABLE: f32 = -0.0;

const FREE: f32 = 0.0;
const FIXED: f32 = 1.0;
const MOVED: f32 = 2.0;

fn mark_supports(
    nodes: &mut [NodeInertia],
    supports: impl Iterator<Item = Support>,
) -> Result<(), BuildError> {
    let count = nodes.len();
    for (index, support) in supports.enumerate() {
        let Some(inertia) = nodes.get_mut(support.node as usize) else {
            return Err(BuildError::SupportNode { support: index, node: support.node, nodes: count });
        };
        for (axis, mark) in inertia.inverse.iter_mut().enumerate() {
            if support.axes.has(axis) {
                let new = if support.moves { MOVED } else { FIXED };
                *mark = if *mark > new { *mark } else { new };
            }
        }
    }
    Ok(())
}

fn write_element(block: &mut ElementBlock, lane: usize, element: Numbered, corners: [DVec3; 4]) {
    fn set<T>(lanes: &mut [T; BLOCK], lane: usize, value: T) {
        if let Some(place) = lanes.get_mut(lane) {
            *place = value;
        }
    }
    let (slopes, volume) = gradients(corners);
    for (nodes, node) in block.nodes.iter_mut().zip(element.nodes) {
        // The first one stands in for those that do not come.
        if lane == 0 {
            nodes.fill(node);
        }
        set(nodes, lane, node);
    }
    for (components, slope) in block.gradients.iter_mut().zip(slopes) {
        for (component, value) in components.iter_mut().zip(slope.to_array()) {
            set(component, lane, value as f32);
        }
    }
    set(&mut block.volumes, lane, volume as f32);
    set(&mut block.elements, lane, element.element as u32);
    set(&mut block.spreads, lane, spread(slopes));
}

/// Largest eigenvalue of `sum_a ga ga^T` over the four gradients, not rounded down, 1/m^2.
fn spread(slopes: [DVec3; 3]) -> f32 {
    let mut sum = Symmetric::<f32>::default();
    for g in [slopes[0], slopes[1], slopes[2], -(slopes[0] + slopes[1] + slopes[2])] {
        sum.xx += (g.x * g.x) as f32;
        sum.yy += (g.y * g.y) as f32;
        sum.zz += (g.z * g.z) as f32;
        sum.xy += (g.x * g.y) as f32;
        sum.yz += (g.y * g.z) as f32;
        sum.zx += (g.z * g.x) as f32;
    }
    sum.largest_eigenvalue() * (1.0 + 1e-5)
}
