//! The nodes that instruments can touch: those of the boundary, given once.

use bytemuck::{Pod, Zeroable};

use super::ContactError;

/// A node that instruments can touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceNode {
    /// Where it is at rest, m.
    pub rest: [f32; 3],
    /// Its number.
    pub node: u32,
}

/// The nodes that instruments can touch, checked. An instrument passes between nodes: spheres and capsules should have a radius
/// of at least the length of the surface's edges.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    nodes: &'a [SurfaceNode],
    scene_nodes: usize,
}

impl<'a> Surface<'a> {
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
        Ok(Self { nodes, scene_nodes })
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
