//! Displacements, positions, velocities and forces out of a state, for C: where they are, or copied.

use core::ffi::c_void;

use crate::state::NodeVector;

use super::memory::{self, array, place_for};
use super::state::{Field, field, supple_state};
use super::status::{Answer, short, supple_error, supple_status};
use supple_status::*;

/// Vectors where they are, without a copy: three floats each, `stride` bytes apart.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_vectors {
    /// The first component of the first vector.
    pub first: *const f32,
    /// Bytes from one vector to the next.
    pub stride: usize,
    /// Vectors, one for each node.
    pub count: u32,
}

/// Tells where the displacements of a state are, m. They stay there for as long as the state does; read them between calls that
/// change it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_displacements(
    state: *const supple_state,
    vectors: *mut supple_vectors,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let find = || unsafe {
        let found = field(state, Field::Displacement)?;
        let vectors = place_for(vectors)?;
        let (first, count) = (found.as_ptr().cast(), found.len() as u32);
        vectors.write(supple_vectors { first, stride: size_of::<NodeVector>(), count });
        Ok(SUPPLE_OK)
    };
    find().unwrap_or_else(|error: supple_error| error.status)
}

/// Copies the displacement of each node, m, to three floats each.
///
/// @param floats room in `out`: three times the nodes at least.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_copy_displacements(
    state: *const supple_state,
    out: *mut f32,
    floats: usize,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    unsafe { copy(state, Field::Displacement, out, floats, |_, vector| vector) }
}

/// Copies where each node is, m: the point at rest with its displacement.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param floats room in `out`: three times the nodes at least. `out` may not be `points`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_copy_positions(
    state: *const supple_state,
    points: *const f32,
    out: *mut f32,
    floats: usize,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let points = || unsafe {
        let nodes = memory::read(state)?.nodes as usize;
        let points = array(points.cast::<[f32; 3]>(), nodes)?;
        if overlap(points.as_ptr().cast(), size_of_val(points), out.cast(), floats.saturating_mul(4)) {
            return Err(supple_error::from(SUPPLE_E_OVERLAP));
        }
        Ok(points)
    };
    match points() {
        // SAFETY: as above.
        Ok(points) => unsafe {
            copy(state, Field::Displacement, out, floats, |node, [x, y, z]| {
                let [px, py, pz] = points.get(node).copied().unwrap_or_default();
                [px + x, py + y, pz + z]
            })
        },
        Err(error) => error.status,
    }
}

/// Copies the velocity of each node over the latest step, m/s.
///
/// @param floats room in `out`: three times the nodes at least.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_copy_velocities(
    state: *const supple_state,
    out: *mut f32,
    floats: usize,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let dt = match unsafe { memory::read(state) } {
        Ok(object) => object.moment.dt,
        Err(error) => return error.status,
    };
    let velocity =
        |_, increment: [f32; 3]| if dt > 0.0 { increment.map(|component| component / dt) } else { [0.0; 3] };
    // SAFETY: as above.
    unsafe { copy(state, Field::Increment, out, floats, velocity) }
}

/// Copies the total force on each node at the start of the latest step, also of one that was refused, N: that of the loads with that of the tissue. At held
/// nodes it is what presses on the support, and so what a hand that holds the instrument feels, apart from the inertia of a moved
/// one; the support presses back with the opposite. Zero after supple_critical_step or supple_set_step, also where these refuse what they
/// computed, until the next step.
///
/// @param floats room in `out`: three times the nodes at least.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_copy_forces(
    state: *const supple_state,
    out: *mut f32,
    floats: usize,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    unsafe { copy(state, Field::Force, out, floats, |_, vector| vector) }
}

/// # Safety
/// If not NULL, `state` is as [`memory::read`] needs it and `out` leads to room for `floats` numbers.
unsafe fn copy(
    state: *const supple_state,
    what: Field,
    out: *mut f32,
    floats: usize,
    vector: impl Fn(usize, [f32; 3]) -> [f32; 3],
) -> supple_status {
    // SAFETY: the caller's promise.
    let copy = || unsafe {
        let from = field(state, what)?;
        let out = place_for(out)?;
        let needed = 3 * from.len();
        if floats < needed {
            return Err(short(floats, needed));
        }
        let bytes = memory::bytes_of(state);
        if overlap(state.cast(), bytes, out.cast(), 4 * needed) {
            return Err(supple_error::from(SUPPLE_E_OVERLAP));
        }
        let out = core::slice::from_raw_parts_mut(out.cast::<[f32; 3]>(), from.len());
        for (node, (out, from)) in out.iter_mut().zip(from).enumerate() {
            *out = vector(node, from.to_array());
        }
        Ok(SUPPLE_OK)
    };
    let answer: Answer<supple_status> = copy();
    answer.unwrap_or_else(|error| error.status)
}

/// Whether two pieces of memory have bytes in common.
pub(super) fn overlap(a: *const c_void, a_bytes: usize, b: *const c_void, b_bytes: usize) -> bool {
    let (a, b) = (a.addr(), b.addr());
    a < b.saturating_add(b_bytes) && b < a.saturating_add(a_bytes)
}
