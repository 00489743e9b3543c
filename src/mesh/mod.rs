//! A checked tetrahedral mesh, borrowed from the caller, and the structured bar of the paper. Coordinates are float32,
//! in metres; they are accurate only if the origin is near the body.

#[cfg_attr(not(feature = "capi-neo-hookean"), allow(dead_code))]
mod boundary;
pub(crate) mod partition;
mod renumbering;
pub(crate) mod strips;

#[cfg(any(feature = "std", test))]
pub use boundary::boundary;
#[cfg(feature = "capi-neo-hookean")]
pub(crate) use boundary::boundary_in;
pub(crate) use boundary::faces;
#[cfg(any(feature = "std", test))]
pub(crate) use boundary::in_order;
#[cfg(feature = "std")]
pub use boundary::{Overlap, overlap};
pub use renumbering::renumber;
pub(crate) use renumbering::{BITS as CURVE_BITS, every_third_bit};

use core::fmt;

use glam::DVec3;

/// Least volume of an element over the cube of its longest edge. Below, the element is degenerate: its shape function
/// gradients would have fewer than three correct digits in float32.
pub const DEGENERATE: f64 = 1e-6;

/// What to do with elements whose volume comes out negative.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Winding {
    /// Positive volume is required: `(x1 - x0) . ((x2 - x0) x (x3 - x0)) > 0`.
    Checked,
    /// Nodes of elements with negative volume are reordered; meshers do not agree on the sign.
    Normalised,
}

/// Why a mesh was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum MeshError {
    /// There is no node or no element.
    Empty,
    /// An element names a node that is not there.
    IndexOutOfRange {
        /// The element.
        element: usize,
        /// The index it names.
        node: u32,
        /// Nodes in the mesh.
        nodes: usize,
    },
    /// An element names a node twice.
    RepeatedNode {
        /// The element.
        element: usize,
        /// The node.
        node: u32,
    },
    /// A coordinate is NaN or infinite.
    NotFinite {
        /// The node.
        node: usize,
        /// 0, 1, 2 for x, y, z.
        axis: usize,
        /// The coordinate.
        value: f32,
    },
    /// An element is flat: its volume is less than [`DEGENERATE`] times its longest edge cubed.
    Degenerate {
        /// The element.
        element: usize,
        /// Its volume, m^3.
        volume: f64,
        /// Its longest edge, m.
        longest_edge: f64,
    },
    /// An element has negative volume and [`Winding::Checked`] was asked for.
    Inverted {
        /// The element.
        element: usize,
        /// Its volume, m^3.
        volume: f64,
    },
    /// A table of node numbers does not have one place for each node.
    Table {
        /// Its places.
        places: usize,
        /// Nodes in the mesh.
        nodes: usize,
    },
    /// A node belongs to no element, so it has no mass.
    UnusedNode {
        /// The node.
        node: usize,
    },
    /// There is not one mark of removal for each element.
    Marks {
        /// Marks.
        marks: usize,
        /// Elements of the mesh.
        elements: usize,
    },
}

impl fmt::Display for MeshError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Empty => write!(f, "the mesh has no elements"),
            Self::IndexOutOfRange { element, node, nodes } => {
                write!(f, "element {element}: node {node} does not exist, the mesh has {nodes} nodes")
            }
            Self::RepeatedNode { element, node } => write!(f, "element {element}: node {node} appears twice"),
            Self::NotFinite { node, axis, value } => {
                let axis = ["x", "y", "z"].get(axis).copied().unwrap_or("?");
                write!(f, "node {node}: coordinate {axis} is {value}")
            }
            Self::Degenerate { element, volume, longest_edge } => write!(
                f,
                "element {element}: degenerate, volume {volume:.2e} m^3 with a longest edge of {:.3} mm",
                longest_edge * 1e3
            ),
            Self::Inverted { element, volume } => write!(f, "element {element}: volume {volume:.2e} m^3"),
            Self::Table { places, nodes } => {
                write!(f, "a table of node numbers has {places} places, the mesh has {nodes} nodes")
            }
            Self::UnusedNode { node } => write!(f, "node {node} belongs to no element"),
            Self::Marks { marks, elements } => {
                write!(f, "{marks} marks of removed elements, the mesh has {elements} elements")
            }
        }
    }
}

impl core::error::Error for MeshError {}

/// Checks that coordinates are finite and that elements name existing nodes.
pub(crate) fn in_range(points: &[[f32; 3]], tets: &[[u32; 4]]) -> Result<(), MeshError> {
    for (node, point) in points.iter().enumerate() {
        for (axis, &value) in point.iter().enumerate() {
            if !value.is_finite() {
                return Err(MeshError::NotFinite { node, axis, value });
            }
        }
    }
    for (element, tet) in tets.iter().enumerate() {
        if let Some(&node) = tet.iter().find(|&&node| node as usize >= points.len()) {
            return Err(MeshError::IndexOutOfRange { element, node, nodes: points.len() });
        }
    }
    Ok(())
}

/// A checked tetrahedral mesh: indices in range, four different nodes for each element, finite coordinates, positive
/// volumes. Nodes without an element are found only when a scene is built, because that needs memory for each node.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    points: &'a [[f32; 3]],
    tets: &'a [[u32; 4]],
    turned: usize,
    /// For each element whether it is removed; empty: none is.
    removed: &'a [bool],
}

impl<'a> Mesh<'a> {
    /// Checks the mesh. Nodes and elements in errors are counted from zero.
    pub fn new(points: &'a [[f32; 3]], tets: &'a [[u32; 4]], winding: Winding) -> Result<Self, MeshError> {
        if points.is_empty() || tets.is_empty() {
            return Err(MeshError::Empty);
        }
        in_range(points, tets)?;
        let mut turned = 0;
        for (element, tet) in tets.iter().enumerate() {
            for (k, &node) in tet.iter().enumerate() {
                if tet.iter().take(k).any(|&other| other == node) {
                    return Err(MeshError::RepeatedNode { element, node });
                }
            }
            let corners = tet.map(|node| corner(points, node));
            let (volume, longest_edge) = (volume(corners), longest_edge(corners));
            if volume.abs() < DEGENERATE * longest_edge * longest_edge * longest_edge || volume == 0.0 {
                return Err(MeshError::Degenerate { element, volume, longest_edge });
            }
            if volume < 0.0 {
                match winding {
                    Winding::Checked => return Err(MeshError::Inverted { element, volume }),
                    Winding::Normalised => turned += 1,
                }
            }
        }
        Ok(Self { points, tets, turned, removed: &[] })
    }

    /// The same mesh without the elements that are marked, as after a resection. Nodes and elements keep their numbers;
    /// nodes without an element left are held where they are in scenes of it, and have no mass to speak of. No marks:
    /// nothing is removed.
    pub fn without(self, removed: &'a [bool]) -> Result<Self, MeshError> {
        let (marks, elements) = (removed.len(), self.tets.len());
        match removed {
            [] => Ok(Self { removed, ..self }),
            _ if marks != elements => Err(MeshError::Marks { marks, elements }),
            _ if removed.iter().all(|&is_removed| is_removed) => Err(MeshError::Empty),
            _ => Ok(Self { removed, ..self }),
        }
    }

    /// Node coordinates, m.
    #[must_use]
    pub fn points(&self) -> &'a [[f32; 3]] {
        self.points
    }

    /// Number of elements, removed ones too.
    #[must_use]
    pub fn element_count(&self) -> usize {
        self.tets.len()
    }

    /// Number of elements whose nodes were reordered for a positive volume.
    #[must_use]
    pub fn turned(&self) -> usize {
        self.turned
    }

    /// Nodes of each element that is not removed, in an order that gives a positive volume.
    pub fn tets(&self) -> impl Iterator<Item = [u32; 4]> + Clone + 'a {
        self.elements().map(|(_, tet)| tet)
    }

    /// The same with the numbers of the elements.
    pub(crate) fn elements(&self) -> impl Iterator<Item = (usize, [u32; 4])> + Clone + 'a {
        let mesh = *self;
        self.all_tets().enumerate().filter(move |&(element, _)| !mesh.is_removed(element))
    }

    /// Removed ones too.
    pub(crate) fn all_tets(&self) -> impl Iterator<Item = [u32; 4]> + Clone + 'a {
        let points = self.points;
        self.tets.iter().map(move |&[a, b, c, d]| {
            let tet = [a, b, c, d];
            if volume(tet.map(|node| corner(points, node))) < 0.0 { [a, c, b, d] } else { tet }
        })
    }

    /// The nodes of an element in the order in which they were given; zeros for one that does not exist.
    pub(crate) fn given(&self, element: u32) -> [u32; 4] {
        self.tets.get(element as usize).copied().unwrap_or_default()
    }

    /// The nodes of all elements in the order in which they were given.
    #[cfg(feature = "capi-neo-hookean")]
    pub(crate) fn all_given(&self) -> &'a [[u32; 4]] {
        self.tets
    }

    pub(crate) fn is_removed(&self, element: usize) -> bool {
        self.removed.get(element).is_some_and(|&is_removed| is_removed)
    }

    /// Whether some elements may be removed.
    pub(crate) const fn has_removed(&self) -> bool {
        !self.removed.is_empty()
    }

    /// Corners of an element, m, in float64.
    pub(crate) fn corners(&self, tet: [u32; 4]) -> [DVec3; 4] {
        tet.map(|node| corner(self.points, node))
    }
}

fn corner(points: &[[f32; 3]], node: u32) -> DVec3 {
    let [x, y, z] = points.get(node as usize).copied().unwrap_or_default();
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// Signed volume, m^3.
pub(crate) fn volume([x0, x1, x2, x3]: [DVec3; 4]) -> f64 {
    (x1 - x0).dot((x2 - x0).cross(x3 - x0)) / 6.0
}

/// Longest edge, m.
pub(crate) fn longest_edge([x0, x1, x2, x3]: [DVec3; 4]) -> f64 {
    let squares = [x1 - x0, x2 - x0, x3 - x0, x2 - x1, x3 - x1, x3 - x2].map(DVec3::length_squared);
    libm::sqrt(squares.into_iter().fold(0.0, f64::max))
}

/// Gradients of the shape functions of nodes 1, 2, 3 (1/m; node 0 has minus their sum) and the volume (m^3).
pub(crate) fn gradients([x0, x1, x2, x3]: [DVec3; 4]) -> ([DVec3; 3], f64) {
    let (a, b, c) = (x1 - x0, x2 - x0, x3 - x0);
    let determinant = a.dot(b.cross(c));
    ([b.cross(c) / determinant, c.cross(a) / determinant, a.cross(b) / determinant], determinant / 6.0)
}

/// A box of `cells[0] x cells[1] x cells[2]` cells, each cut in six Kuhn tetrahedra around its diagonal.
/// Node `i + (nx + 1) (j + (ny + 1) k)` is at the `i`-th, `j`-th, `k`-th grid plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// Edge lengths, m.
    pub size: [f32; 3],
    /// Cells along x, y, z, each at least one.
    pub cells: [u32; 3],
}

impl Bar {
    /// The paper's bar: 50 x 50 x 100 mm, 1,458 nodes, 6,528 tetrahedra.
    pub const PAPER: Self = Self { size: [0.05, 0.05, 0.1], cells: [8, 8, 17] };

    /// Number of nodes.
    #[must_use]
    pub const fn node_count(&self) -> usize {
        let [nx, ny, nz] = self.cells;
        let layer = (nx as usize).saturating_add(1).saturating_mul((ny as usize).saturating_add(1));
        layer.saturating_mul((nz as usize).saturating_add(1))
    }

    /// Number of tetrahedra.
    #[must_use]
    pub const fn element_count(&self) -> usize {
        let [nx, ny, nz] = self.cells;
        (nx as usize).saturating_mul(ny as usize).saturating_mul(nz as usize).saturating_mul(6)
    }

    /// Index of the node at grid planes `i, j, k`; wraps around in a bar of more than 2^32 nodes.
    #[must_use]
    pub const fn node(&self, i: u32, j: u32, k: u32) -> u32 {
        let [nx, ny, _] = self.cells;
        let row = j.wrapping_add(ny.wrapping_add(1).wrapping_mul(k));
        i.wrapping_add(nx.wrapping_add(1).wrapping_mul(row))
    }

    /// Node coordinates, m, in node order.
    pub fn points(self) -> impl Iterator<Item = [f32; 3]> {
        let [nx, ny, nz] = self.cells;
        let at = move |axis: usize, index: u32, cells: u32| {
            (f64::from(self.size[axis]) * f64::from(index) / f64::from(cells)) as f32
        };
        (0..=nz).flat_map(move |k| {
            (0..=ny).flat_map(move |j| (0..=nx).map(move |i| [at(0, i, nx), at(1, j, ny), at(2, k, nz)]))
        })
    }

    /// The tetrahedra, cell by cell, with positive volume.
    pub fn tets(self) -> impl Iterator<Item = [u32; 4]> {
        // A Kuhn tetrahedron follows the edges from corner 000 to corner 111 along the axes in one of six orders. Odd
        // orders have the opposite winding.
        const ORDERS: [([usize; 3], bool); 6] = [
            ([0, 1, 2], true),
            ([1, 2, 0], true),
            ([2, 0, 1], true),
            ([0, 2, 1], false),
            ([2, 1, 0], false),
            ([1, 0, 2], false),
        ];
        let [nx, ny, nz] = self.cells;
        let cells = (0..nz).flat_map(move |k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
        cells.flat_map(move |cell| {
            ORDERS.into_iter().map(move |(order, even)| {
                let mut at = cell;
                let mut tet = [self.node(at[0], at[1], at[2]); 4];
                for (corner, axis) in tet.iter_mut().skip(1).zip(order) {
                    at[axis] += 1;
                    *corner = self.node(at[0], at[1], at[2]);
                }
                if even { tet } else { [tet[0], tet[2], tet[1], tet[3]] }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::{format, vec::Vec};

    use super::*;

    const POINTS: [[f32; 3]; 4] = [[0.0; 3], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]];

    fn refused(points: &[[f32; 3]], tets: &[[u32; 4]]) -> std::string::String {
        format!("{}", Mesh::new(points, tets, Winding::Checked).unwrap_err())
    }

    #[test]
    fn every_bad_mesh_has_its_own_message() {
        assert_eq!(refused(&POINTS, &[]), "the mesh has no elements");
        assert_eq!(
            refused(&POINTS, &[[0, 1, 2, 3], [0, 1, 2, 4]]),
            "element 1: node 4 does not exist, the mesh has 4 nodes"
        );
        assert_eq!(refused(&POINTS, &[[0, 1, 2, 1]]), "element 0: node 1 appears twice");
        let mut points = POINTS;
        points[2][1] = f32::NAN;
        assert_eq!(refused(&points, &[[0, 1, 2, 3]]), "node 2: coordinate y is NaN");
        assert_eq!(refused(&POINTS, &[[0, 2, 1, 3]]), "element 0: volume -1.67e-7 m^3");
        let mut points = POINTS;
        points[3] = [0.005, 0.005, 1e-9];
        assert_eq!(
            refused(&points, &[[0, 1, 2, 3]]),
            "element 0: degenerate, volume 1.67e-14 m^3 with a longest edge of 14.142 mm"
        );
    }

    #[test]
    fn winding_is_normalised_on_request() {
        let mesh = Mesh::new(&POINTS, &[[0, 2, 1, 3]], Winding::Normalised).unwrap();
        assert_eq!(mesh.turned(), 1);
        let tet = mesh.tets().next().unwrap();
        assert!(volume(mesh.corners(tet)) > 0.0);
    }

    #[test]
    fn the_papers_bar_has_its_counts_and_fills_its_box() {
        let bar = Bar::PAPER;
        let points: Vec<_> = bar.points().collect();
        let tets: Vec<_> = bar.tets().collect();
        assert_eq!((points.len(), tets.len()), (1458, 6528));
        assert_eq!((bar.node_count(), bar.element_count()), (1458, 6528));
        assert_eq!(points[bar.node(8, 8, 17) as usize], [0.05, 0.05, 0.1]);
        let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
        let total: f64 = mesh.tets().map(|tet| volume(mesh.corners(tet))).sum();
        assert!((total - 2.5e-4).abs() < 1e-9);
    }
}
