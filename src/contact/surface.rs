//! What instruments can touch: nodes of the boundary, given once, and the triangles between them where an instrument is
//! thinner than edges are long.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::ContactError;
use crate::scattered::scattered;

/// A node that instruments can touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceNode {
    /// Where it is at rest, m.
    pub rest: [f32; 3],
    /// Its number.
    pub node: u32,
}

/// What instruments can touch, checked. Without triangles an instrument passes between nodes: spheres and capsules
/// should then have a radius of at least the length of the surface's edges.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    nodes: &'a [SurfaceNode],
    triangles: &'a [[u32; 3]],
    scene_nodes: usize,
}

impl<'a> Surface<'a> {
    /// Nothing.
    pub(crate) const NONE: Self = Self { nodes: &[], triangles: &[], scene_nodes: 0 };

    /// Checks the nodes against a scene of so many.
    pub fn new(nodes: &'a [SurfaceNode], scene_nodes: usize) -> Result<Self, ContactError> {
        for (place, entry) in nodes.iter().enumerate() {
            if entry.node as usize >= scene_nodes {
                return Err(ContactError::Node { place, node: entry.node, nodes: scene_nodes });
            }
            if entry.rest.iter().any(|component| !component.is_finite()) {
                return Err(ContactError::Point { place, node: entry.node });
            }
        }
        Ok(Self { nodes, triangles: &[], scene_nodes })
    }

    /// The same with triangles, as places of their corners in the list of nodes: instruments of any size but planes,
    /// which have no use for them, are met between nodes too. Steps need room for pushes
    /// ([`StateView::pushing`](crate::state::StateView::pushing)).
    pub fn with_triangles(self, triangles: &'a [[u32; 3]]) -> Result<Self, ContactError> {
        for (triangle, corners) in triangles.iter().enumerate() {
            let [a, b, c] = *corners;
            let nodes = self.nodes.len();
            let place = corners.iter().copied().find(|&place| place as usize >= nodes);
            if let Some(place) = place.or((a == b || b == c || c == a).then_some(a)) {
                return Err(ContactError::Triangle { triangle, place, nodes });
            }
        }
        Ok(Self { triangles, ..self })
    }

    /// Nodes of the scene that it was checked against.
    pub(crate) const fn scene_nodes(&self) -> usize {
        self.scene_nodes
    }

    /// The nodes.
    #[must_use]
    pub const fn nodes(&self) -> &'a [SurfaceNode] {
        self.nodes
    }

    /// The triangles.
    #[must_use]
    pub const fn triangles(&self) -> &'a [[u32; 3]] {
        self.triangles
    }

    /// Each node has a place, and after them each triangle two: those of its first points, then those of its second.
    pub(crate) const fn places(&self) -> usize {
        places(self.nodes.len(), self.triangles.len())
    }

    /// Whether a place is that of the second point of a triangle.
    pub(crate) const fn is_second(&self, place: usize) -> bool {
        place >= self.nodes.len() + self.triangles.len()
    }

    /// The places of the corners of a triangle; of a node three times its own.
    pub(crate) fn corner_places(&self, place: usize) -> [usize; 3] {
        let first = if self.is_second(place) { place - self.triangles.len() } else { place };
        let triangle = first.checked_sub(self.nodes.len()).and_then(|triangle| self.triangles.get(triangle));
        triangle.map_or([place; 3], |corners| corners.map(|corner| corner as usize))
    }

    /// The corners of a triangle; a node three times.
    pub(crate) fn corners(&self, place: usize) -> Option<[SurfaceNode; 3]> {
        let [a, b, c] = self.corner_places(place).map(|corner| self.nodes.get(corner).copied());
        Some([a?, b?, c?])
    }
}

/// Places of a surface of so many nodes and triangles.
pub(super) const fn places(nodes: usize, triangles: usize) -> usize {
    nodes.saturating_add(triangles.saturating_mul(2))
}

/// Whether an instrument of this [thickness](super::Shape::thickness), m, passes between the nodes of a surface, whose
/// triangles it then needs: whether one of its edges is longer. `faces` are these triangles, or all faces of all
/// elements of the body, of which those inside come twice and cancel each other.
pub fn passes_between(points: &[[f32; 3]], faces: impl IntoIterator<Item = [u32; 3]>, thickness: f32) -> bool {
    let point = |node: u32| points.get(node as usize).map(|&point| Vec3::from_array(point));
    // Of the faces with a longer edge, combined so that the same nodes in any order cancel.
    let mut left = 0;
    for face in faces {
        let [Some(a), Some(b), Some(c)] = face.map(point) else { continue };
        if (b - a).length().max((c - b).length()).max((a - c).length()) > thickness {
            let [a, b, c] = face.map(|node| scattered(u64::from(node) + 1));
            left ^= scattered(a.wrapping_add(b).wrapping_add(c));
        }
    }
    left != 0
}

/// The nodes of the boundary of a mesh ([`crate::mesh::boundary`]), in increasing order.
#[cfg(any(feature = "std", test))]
#[must_use]
pub fn boundary(mesh: &crate::mesh::Mesh<'_>) -> std::vec::Vec<SurfaceNode> {
    let mut nodes = crate::mesh::boundary(mesh.tets()).into_flattened();
    nodes.sort_unstable();
    nodes.dedup();
    let entry = |node| mesh.points().get(node as usize).map(|&rest| SurfaceNode { rest, node });
    nodes.into_iter().filter_map(entry).collect()
}

/// The triangles of the boundary of a mesh as places in the list of its nodes that [`boundary`] gives.
#[cfg(any(feature = "std", test))]
#[must_use]
pub fn boundary_triangles(mesh: &crate::mesh::Mesh<'_>, nodes: &[SurfaceNode]) -> std::vec::Vec<[u32; 3]> {
    let place = |node: u32| nodes.binary_search_by_key(&node, |entry| entry.node).ok().map(|place| place as u32);
    let places = |[a, b, c]: [u32; 3]| Some([place(a)?, place(b)?, place(c)?]);
    crate::mesh::boundary(mesh.tets()).into_iter().filter_map(places).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Bar, faces};

    /// Cells of 10 mm: edges of the surface are at most their diagonal long, 14.1 mm, but there are edges of 17.3 mm
    /// inside.
    #[test]
    fn edges_inside_the_body_do_not_count() {
        let bar = Bar { size: [0.03; 3], cells: [3; 3] };
        let points: std::vec::Vec<_> = bar.points().collect();
        let all = || bar.tets().flat_map(faces);
        let surface = crate::mesh::boundary(bar.tets());
        for (thickness, passes) in [(0.0099, true), (0.0141, true), (0.0143, false), (f32::INFINITY, false)] {
            assert_eq!(passes_between(&points, all(), thickness), passes, "{thickness}");
            assert_eq!(passes_between(&points, surface.iter().copied(), thickness), passes, "{thickness}");
        }
    }
}
