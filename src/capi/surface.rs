//! What instruments can touch, as a C host gives it: numbers of nodes and of the corners of triangles, checked and
//! turned into the entries of a [`crate::contact::Surface`]; and how a host finds them: the boundary of its mesh, and
//! whether an instrument needs triangles.

use crate::contact::{SurfaceNode, passes_between};
use crate::mesh::{boundary_in, faces};

use super::contact::{checked, supple_instrument};
use super::memory::{self, array, place_for};
use super::status::{Answer, short, status_of, supple_error, supple_status};
use super::vectors::overlap;
use supple_status::*;

/// What instruments can touch.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_surface {
    /// Numbers of the nodes, those of the boundary; NULL: the first `node_count` nodes, all of them with the scene's
    /// number.
    pub nodes: *const u32,
    /// Numbers of the three nodes of each triangle between these nodes, where an instrument is thinner than edges are
    /// long (supple_needs_triangles); else NULL.
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
    is_sorted: bool,
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
            let is_sorted = numbers.is_some_and(|list| list.windows(2).all(|pair| pair.first() < pair.last()));
            Ok(Self { points, numbers, is_sorted, node_count, triangles })
        }
    }

    /// Whether all its nodes are the scene's, and all corners its own and nodes of elements: a triangle with one that is not would be
    /// touched where there is no tissue.
    pub(super) fn check(&self, is_alone: impl Fn(usize) -> bool) -> Answer<()> {
        (0..self.node_count as usize).try_for_each(|index| self.node(index).map(|_| ()))?;
        for (index, corners) in self.triangles.iter().enumerate() {
            self.corners(index)?;
            if let Some(&node) = corners.iter().find(|node| is_alone(**node as usize)) {
                return Err(supple_error::from(SUPPLE_E_MESH_UNUSED_NODE).at(index).node(node));
            }
        }
        Ok(())
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
                Some(list) if self.is_sorted => list.binary_search(&node).ok().map(|place| place as u32),
                Some(list) => list.iter().position(|&number| number == node).map(|place| place as u32),
            };
            place.ok_or_else(|| refused(node))
        };
        Ok([place(a)?, place(b)?, place(c)?])
    }
}

/// Writes the triangles of the boundary of a mesh, which belong to one element only, seen from outside: three nodes
/// each.
///
/// @param tetrahedra four nodes of each element, from zero. Of an element with a negative volume the triangles are seen from
/// within, and a pressure on them pulls: turn such elements before, also where the scene is built with
/// SUPPLE_WINDING_NORMALISED, which does not change this array. Leave out those that are removed: the cut is part of the
/// boundary of the others.
/// @param triangles room for `room` of them; four for each element are needed while they are found.
/// @param count receives how many at the beginning are of the boundary.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_boundary(
    tetrahedra: *const u32,
    elements: u32,
    triangles: *mut u32,
    room: usize,
    count: *mut u32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let find = || unsafe {
        let tetrahedra = array(tetrahedra.cast::<[u32; 4]>(), elements as usize)?;
        let (triangles, count) = (place_for(triangles.cast::<[u32; 3]>())?, place_for(count)?);
        let needed = 4 * tetrahedra.len();
        if room < needed {
            return Err(short(room, needed));
        }
        let all = tetrahedra.iter().flat_map(|&nodes| faces(nodes));
        let (from, to) = (tetrahedra.as_ptr().cast(), triangles.cast());
        if overlap(from, size_of_val(tetrahedra), to, needed.saturating_mul(12)) {
            return Err(SUPPLE_E_OVERLAP.into());
        }
        for (place, face) in all.enumerate() {
            triangles.add(place).write(face);
        }
        let found = boundary_in(core::slice::from_raw_parts_mut(triangles, needed));
        count.write(found as u32);
        Ok(SUPPLE_OK)
    };
    status_of(find())
}

/// Writes whether one of these instruments passes between the nodes of a surface, since it is not as thick as the
/// longest edge of its triangles is long: `*needed` is 1 if supple_surface has to have these triangles, else 0. A
/// sphere and a capsule are as thick as their radius, a field as its deepest point is deep.
///
/// @param points of all `nodes` of the scene at rest, m, three coordinates each.
/// @param triangles `count` triangles of the boundary, as of supple_boundary.
/// @param error may be NULL; index is that of an instrument.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_needs_triangles(
    points: *const f32,
    nodes: u32,
    triangles: *const u32,
    count: u32,
    instruments: *const supple_instrument,
    instrument_count: u32,
    needed: *mut u32,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let tell = || unsafe {
        let points = array(points.cast::<[f32; 3]>(), nodes as usize)?;
        let triangles = array(triangles.cast::<[u32; 3]>(), count as usize)?;
        let (instruments, needed) = (array(instruments, instrument_count as usize)?, place_for(needed)?);
        let mut thinnest = f32::INFINITY;
        for (index, instrument) in instruments.iter().enumerate() {
            thinnest = thinnest.min(checked(instrument, index)?.shape.thickness());
        }
        needed.write(passes_between(points, triangles.iter().copied(), thinnest).into());
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(tell(), error) }
}
