//! Tractions for C: forces per area, turned into forces on nodes ([`crate::loads::traction`]).

use super::loads::supple_force;
use super::memory::{self, array, one, place_for};
use super::status::{short, supple_error, supple_status};
use supple_status::*;

/// Writes the forces of a uniform traction on triangles of the boundary at rest, three for each, for supple_set_forces
/// among others: a third of traction times area to each corner. Their direction stays while the body moves. Where elements are
/// removed they go on to act on the nodes that are left: make them again, of the triangles that are left.
///
/// @param points of all `nodes` of the scene at rest, m, three coordinates each.
/// @param triangles three nodes of each of `count` triangles, as of supple_boundary.
/// @param pascal three components, Pa.
/// @param ramp seconds from the start of the simulation over which the forces grow to their full size, zero or more.
/// @param forces room for `room` of them, three times `count` at least.
/// @param error may be NULL; index is that of a triangle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_traction(
    points: *const f32,
    nodes: u32,
    triangles: *const u32,
    count: u32,
    pascal: *const f32,
    ramp: f32,
    forces: *mut supple_force,
    room: usize,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let make = || unsafe {
        let points = array(points.cast::<[f32; 3]>(), nodes as usize)?;
        let triangles = array(triangles.cast::<[u32; 3]>(), count as usize)?;
        let pascal = *one(pascal.cast::<[f32; 3]>())?;
        let needed = 3 * triangles.len();
        if room < needed {
            return Err(short(room, needed));
        }
        let made = || crate::loads::traction(points, triangles, pascal, ramp);
        for force in made() {
            force?;
        }
        for (place, force) in made().flatten().enumerate() {
            let crate::loads::NodalForce { node, newton, ramp } = force;
            place_for(forces)?.add(place).write(supple_force { node, newton, ramp });
        }
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(make(), error) }
}
