//! What instruments can touch, as a C host gives it: numbers of nodes and of the corners of triangles, checked and
//! turned into the entries of a [`crate::contact::Surface`].

use crate::contact::SurfaceNode;

use super::memory::array;
use super::status::{Answer, supple_error, supple_status::*};

/// What instruments can touch.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_surface {
    /// Numbers of the nodes, those of the boundary; NULL: the first `node_count` nodes, all of them with the scene's
    /// number.
    pub nodes: *const u32,
    /// Numbers of the three nodes of each triangle between these nodes, where an instrument is thinner than edges are
    /// long; else NULL.
    pub triangles: *const u32,
    /// How many.
    pub node_count: u32,
    /// How many.
    pub triangle_count: u32,
}

/// The surface that a host gives, and the scene's points at rest, m.
pub(super) struct Given<'a> {
    points: &'a [[f32; 3]],
    numbers: Option<&'a [u32]>,
    node_count: u32,
    triangles: &'a [[u32; 3]],
}

impl<'a> Given<'a> {
    /// # Safety
    /// The arrays are there.
    pub(super) unsafe fn new(surface: &supple_surface, points: &'a [[f32; 3]]) -> Answer<Self> {
        let &supple_surface { nodes, triangles, node_count, triangle_count } = surface;
        // SAFETY: the caller's promise.
        unsafe {
            let numbers = if nodes.is_null() { None } else { Some(array(nodes, node_count as usize)?) };
            let triangles = array(triangles.cast(), triangle_count as usize)?;
            Ok(Self { points, numbers, node_count, triangles })
        }
    }

    /// Whether all its nodes are the scene's and all corners its own.
    pub(super) fn check(&self) -> Answer<()> {
        (0..self.node_count as usize).try_for_each(|index| self.node(index).map(|_| ()))?;
        (0..self.triangles.len()).try_for_each(|index| self.corners(index).map(|_| ()))
    }

    /// The entry of a node.
    pub(super) fn node(&self, index: usize) -> Answer<SurfaceNode> {
        let node = self.numbers.map_or(index as u32, |list| list.get(index).copied().unwrap_or(u32::MAX));
        let refused = |why| supple_error::from(why).at(index).node(node);
        let Some(&rest) = self.points.get(node as usize) else {
            return Err(refused(SUPPLE_E_INDEX).value(node.into(), self.points.len() as f64));
        };
        if let Some(value) = rest.iter().find(|component| !component.is_finite()) {
            return Err(refused(SUPPLE_E_NOT_FINITE).value((*value).into(), 0.0));
        }
        Ok(SurfaceNode { rest, node })
    }

    /// The corners of a triangle as places in the list of nodes.
    pub(super) fn corners(&self, index: usize) -> Answer<[u32; 3]> {
        let [a, b, c] = self.triangles.get(index).copied().unwrap_or_default();
        let refused = |node: u32| {
            supple_error::from(SUPPLE_E_INDEX).at(index).node(node).value(node.into(), self.node_count.into())
        };
        if a == b || b == c || c == a {
            return Err(refused(if a == b { a } else { c }));
        }
        let place = |node: u32| {
            let place = match self.numbers {
                None => (node < self.node_count).then_some(node),
                Some(list) => list.iter().position(|&number| number == node).map(|place| place as u32),
            };
            place.ok_or_else(|| refused(node))
        };
        Ok([place(a)?, place(b)?, place(c)?])
    }
}
