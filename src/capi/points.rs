//! Points that follow the tissue, for C ([`crate::points`]).

use core::ffi::c_void;

use crate::mesh::{Mesh, Winding};
use crate::points::{
    FollowedPoint, PointError, check, check_places, locate, words_for, write_positions, write_velocities,
};

use super::memory::{self, array, place_for, place_if_wanted};
use super::state::{supple_state, vectors};
use super::status::{Answer, short, supple_error, supple_status};
use super::vectors::overlap;
use supple_status::*;

/// A point that follows the tissue. It may be copied and kept as bytes; it belongs to the mesh that it was located in.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_followed_point {
    /// Where it is at rest, m.
    pub rest: [f32; 3],
    /// The tetrahedron that holds it, or the nearest one.
    pub element: u32,
    /// The nodes of the element.
    pub nodes: [u32; 4],
    /// How much of each node's displacement is the point's: from 0 to 1, 1 in sum. Of a point outside those of the
    /// nearest point of the element.
    pub weights: [f32; 4],
    /// From the element at rest, m; 0 inside.
    pub distance: f32,
}

const _: () = assert!(
    size_of::<supple_followed_point>() == size_of::<FollowedPoint>()
        && align_of::<supple_followed_point>() == align_of::<FollowedPoint>()
        && core::mem::offset_of!(supple_followed_point, weights) == core::mem::offset_of!(FollowedPoint, weights)
);

/// Bytes of memory that supple_locate needs for a mesh of so many elements: some 20 to 32 for each; 0 if there is no such
/// size.
#[unsafe(no_mangle)]
pub extern "C" fn supple_locate_size(elements: u32) -> usize {
    words_for(elements as usize).checked_mul(size_of::<u32>()).unwrap_or(0)
}

/// Locates places in the mesh at rest, for supple_follow: the element that holds each, or the nearest one with the
/// distance, which tells you whether you meant that place. 100,000 elements and thousands of places take some tens of
/// milliseconds, those inside less.
///
/// @param points of all `nodes` of the scene at rest, m, three coordinates each.
/// @param tetrahedra four nodes of each of `elements`, of either winding.
/// @param places three coordinates of each of `count` places, m.
/// @param memory of `bytes`, supple_locate_size at least, aligned to 4; free again afterwards.
/// @param located receives `count` points.
/// @param error may be NULL; of SUPPLE_E_NOT_FINITE index is that of a place, or with node that of a point of the mesh.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_locate(
    points: *const f32,
    nodes: u32,
    tetrahedra: *const u32,
    elements: u32,
    places: *const f32,
    count: u32,
    memory: *mut c_void,
    bytes: usize,
    located: *mut supple_followed_point,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let find = || unsafe {
        let mesh = mesh_of(points, nodes, tetrahedra, elements)?;
        let places = array(places.cast::<[f32; 3]>(), count as usize)?;
        let needed = supple_locate_size(elements);
        if bytes < needed {
            return Err(short(bytes, needed));
        }
        check_places(places)?;
        let memory = place_for(memory.cast::<u32>())?;
        if places.is_empty() {
            return Ok(SUPPLE_OK);
        }
        let located = place_for(located.cast::<FollowedPoint>())?;
        let [points, tetrahedra] = reads_of(&mesh);
        apart([extent(memory, needed / 4), extent(located, places.len())], [points, tetrahedra, extent_of(places)])?;
        let count = needed / size_of::<u32>();
        locate(&mesh, places, room(memory, count), room(located, places.len()))?;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(find(), error) }
}

/// Writes where points are (m), and how fast over the latest step (m/s), in a state of the mesh that they were located
/// in: some nanoseconds for each.
///
/// @param located `count` points, as of supple_locate.
/// @param positions room for three floats of each.
/// @param velocities the same; NULL if they are not wanted.
/// @param error may be NULL; index is that of a point: it follows a node that the state does not have (SUPPLE_E_INDEX), or
/// is no number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_follow(
    state: *const supple_state,
    located: *const supple_followed_point,
    count: u32,
    positions: *mut f32,
    velocities: *mut f32,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let follow = || unsafe {
        let [displacements, _, increments, _] = vectors(state)?;
        let points = array(located.cast::<FollowedPoint>(), count as usize)?;
        check(points, displacements.len())?;
        let seconds = (*state).progress.last_step();
        if points.is_empty() {
            return Ok(SUPPLE_OK);
        }
        let positions = place_for(positions.cast::<[f32; 3]>())?;
        let velocities = place_if_wanted(velocities.cast::<[f32; 3]>())?;
        let state = (state.cast(), memory::bytes_of(state));
        let fast = extent(velocities.unwrap_or(positions), velocities.map_or(0, |_| points.len()));
        apart([extent(positions, points.len()), fast], [state, extent_of(points)])?;
        write_positions(points, displacements, room(positions, points.len()));
        if let Some(velocities) = velocities {
            write_velocities(points, increments, seconds, room(velocities, points.len()));
        }
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(follow(), error) }
}

/// Memory of the host's for so many values that are only written.
///
/// # Safety
/// It is there, aligned, and nobody else uses it meanwhile.
pub(super) unsafe fn room<'a, T>(at: *mut T, count: usize) -> &'a mut [T] {
    // SAFETY: the caller's promise; any bits are numbers, and what was there is not read.
    unsafe { core::slice::from_raw_parts_mut(at, count) }
}

/// Where a piece of memory is, and its bytes.
pub(super) type Extent = (*const c_void, usize);

pub(super) const fn extent<T>(at: *const T, count: usize) -> Extent {
    (at.cast(), count.saturating_mul(size_of::<T>()))
}

pub(super) const fn extent_of<T>(array: &[T]) -> Extent {
    extent(array.as_ptr(), array.len())
}

/// The arrays of a mesh.
pub(super) fn reads_of(mesh: &Mesh<'_>) -> [Extent; 2] {
    [extent_of(mesh.points()), extent_of(mesh.all_given())]
}

/// That two pieces of memory that are written overlap neither each other nor what is read.
pub(super) fn apart<const N: usize>([a, b]: [Extent; 2], reads: [Extent; N]) -> Answer<()> {
    let meet = |(a, a_bytes): Extent, (b, b_bytes): Extent| overlap(a, a_bytes, b, b_bytes);
    let is_read = reads.into_iter().any(|read| meet(a, read) || meet(b, read));
    if is_read || meet(a, b) { Err(SUPPLE_E_OVERLAP.into()) } else { Ok(()) }
}

/// A mesh of the host's, of either winding, checked.
///
/// # Safety
/// The arrays are there.
pub(super) unsafe fn mesh_of<'a>(
    points: *const f32,
    nodes: u32,
    tetrahedra: *const u32,
    elements: u32,
) -> Answer<Mesh<'a>> {
    // SAFETY: the caller's promise.
    let (points, tetrahedra) = unsafe {
        let points = array(points.cast::<[f32; 3]>(), nodes as usize)?;
        (points, array(tetrahedra.cast::<[u32; 4]>(), elements as usize)?)
    };
    Ok(Mesh::new(points, tetrahedra, Winding::Normalised)?)
}

impl From<PointError> for supple_error {
    fn from(error: PointError) -> Self {
        let is = Self::from;
        match error {
            PointError::Mesh(error) => error.into(),
            PointError::NotFinite { index, axis, value } => {
                is(SUPPLE_E_NOT_FINITE).at(index).axis(axis).value(value.into(), 0.0)
            }
            PointError::Node { index, node, nodes } => {
                is(SUPPLE_E_INDEX).at(index).node(node).value(node.into(), nodes as f64)
            }
            PointError::Capacity { needed, capacity } => short(capacity, needed),
        }
    }
}
