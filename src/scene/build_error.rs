//! What can be wrong with a mesh, its supports, its material or the memory that a scene is built in, with place and
//! value.

use core::fmt;

use crate::mesh::MeshError;
use crate::simd::TILE;

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
    /// More tiles of elements than the scene has room for.
    TileCapacity {
        /// Tiles needed, of [`TILE`] elements each.
        needed: usize,
        /// Room.
        capacity: usize,
    },
    /// More elements than a scene can number.
    ElementCount {
        /// Elements of the mesh.
        elements: usize,
        /// Most of them.
        most: usize,
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
    /// More rows of patches, for tetrahedra with nodal strain, than the scene has room for.
    PatchCapacity {
        /// Rows that are enough ([`PatchRow`](crate::element::PatchRow)): exactly as many as are needed, if there was
        /// room to count them; what [`patch_rows_for`](super::patch_rows_for) tells, if there was not even room for the
        /// nodes.
        needed: usize,
        /// Room.
        capacity: usize,
    },
    /// More tiles of directions of fibres than the scene has room for.
    FibreCapacity {
        /// Tiles needed ([`FibreTile`](crate::element::FibreTile)).
        needed: usize,
        /// Room.
        capacity: usize,
    },
    /// There are not as many directions of fibres as elements.
    DirectionCount {
        /// Directions given.
        directions: usize,
        /// Elements of the mesh.
        elements: usize,
    },
    /// A point mass that cannot be.
    PointMass {
        /// The node.
        node: usize,
        /// Nodes of the mesh.
        nodes: usize,
        /// The mass, kg.
        kilogram: f32,
    },
    /// The directions of the fibres in an element are no directions, or both the same.
    Direction {
        /// The element.
        element: usize,
        /// Along the first family.
        fibre: [f32; 3],
        /// Along the second one.
        sheet: [f32; 3],
    },
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
            Self::TileCapacity { needed, capacity } => {
                write!(f, "the mesh needs {needed} tiles of {TILE} elements, the scene has room for {capacity}")
            }
            Self::ElementCount { elements, most } => {
                write!(f, "the mesh has {elements} elements, a scene can have {most}")
            }
            Self::SupportNode { support, node, nodes } => {
                write!(f, "support {support}: node {node} does not exist, the mesh has {nodes} nodes")
            }
            Self::NoTissue { element } => write!(f, "element {element}: the material names no tissue"),
            Self::Constant { element, name, value } => {
                write!(f, "element {element}: constant {name} is {value}, it must be a finite positive number")
            }
            Self::Density { element, value } => {
                write!(f, "element {element}: density is {value} kg/m^3, it must be a finite positive number")
            }
            Self::PatchCapacity { needed, capacity } => {
                write!(f, "{needed} rows of patches are enough for nodal strain, the scene has room for {capacity}")
            }
            Self::FibreCapacity { needed, capacity } => {
                write!(f, "the fibres need {needed} tiles of directions, the scene has room for {capacity}")
            }
            Self::DirectionCount { directions, elements } => {
                write!(f, "{directions} directions of fibres for {elements} elements: give one for each element")
            }
            Self::PointMass { node, nodes, kilogram } => {
                write!(
                    f,
                    "a point mass of {kilogram} kg at node {node} of {nodes}: it must be a finite number, zero or more"
                )
            }
            Self::Direction { element, fibre: [a, b, c], sheet: [d, e, g] } => write!(
                f,
                "element {element}: fibres along ({a}, {b}, {c}) and sheets along ({d}, {e}, {g}): give vectors that are not zero \
                 and not parallel"
            ),
            Self::NothingMoves => write!(f, "all nodes of all elements are fixed, so nothing can move"),
        }
    }
}

impl core::error::Error for BuildError {}
