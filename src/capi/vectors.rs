//! Displacements, positions, velocities and forces out of a state, for C: where they are, or copied.

use core::ffi::c_void;

use crate::state::{NodeVector, velocity};

use super::memory::{self, array, place_for};
use super::state::{supple_state, vectors};
use super::status::{Answer, short, status_of, supple_status};
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

/// Tells where the displacements of a state are, m. They stay there for as long as the state does; read them between
/// calls that change it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_displacements(
    state: *const supple_state,
    vectors: *mut supple_vectors,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let tell = || unsafe {
        let [displacements, ..] = self::vectors(state)?;
        let (first, count) = (displacements.as_ptr().cast(), displacements.len() as u32);
        place_for(vectors)?.write(supple_vectors { first, stride: size_of::<NodeVector>(), count });
        Ok(SUPPLE_OK)
    };
    status_of(tell())
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
    let copy = || unsafe {
        let [displacements, ..] = vectors(state)?;
        copy(state, displacements, out, floats, |_, displacement| displacement)
    };
    status_of(copy())
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
    let copy = || unsafe {
        let [displacements, ..] = vectors(state)?;
        let points = array(points.cast::<[f32; 3]>(), displacements.len())?;
        if overlap(points.as_ptr().cast(), size_of_val(points), out.cast(), floats.saturating_mul(4)) {
            return Err(SUPPLE_E_OVERLAP.into());
        }
        copy(state, displacements, out, floats, |node, [x, y, z]| {
            let [px, py, pz] = points.get(node).copied().unwrap_or_default();
            [px + x, py + y, pz + z]
        })
    };
    status_of(copy())
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
    let copy = || unsafe {
        let [_, _, increments, _] = vectors(state)?;
        let seconds = (*state).progress.last_step();
        copy(state, increments, out, floats, |_, increment| velocity(increment, seconds))
    };
    status_of(copy())
}

/// Copies the total force on each node at the start of the latest step, also of one that was refused, N: that of the
/// loads with that of the tissue. At held nodes it is what presses on the support, and so what a hand that holds the
/// instrument feels, apart from the inertia of a moved one; the support presses back with the opposite. Not so after
/// steps of a supple_large: raised inertia delays the tissue, and the force is that of a shape that lags behind. Zero
/// after supple_critical_step or supple_set_step, also where these refuse what they computed, until the next step.
///
/// @param floats room in `out`: three times the nodes at least.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_copy_forces(state: *const supple_state, out: *mut f32, floats: usize) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let copy = || unsafe {
        let [.., forces] = vectors(state)?;
        copy(state, forces, out, floats, |_, force| force)
    };
    status_of(copy())
}

/// Copies vectors `from` a state, each as `change` makes it.
///
/// # Safety
/// `state` is one. If not NULL, `out` leads to room for `floats` floats.
unsafe fn copy(
    state: *const supple_state,
    from: &[NodeVector],
    out: *mut f32,
    floats: usize,
    change: impl Fn(usize, [f32; 3]) -> [f32; 3],
) -> Answer<supple_status> {
    // SAFETY: the caller's promise.
    let (out, bytes) = unsafe { (place_for(out)?, memory::bytes_of(state)) };
    let needed = 3 * from.len();
    if floats < needed {
        return Err(short(floats, needed));
    }
    if overlap(state.cast(), bytes, out.cast(), 4 * needed) {
        return Err(SUPPLE_E_OVERLAP.into());
    }
    // SAFETY: there is room, aligned for floats, which nothing here reads.
    let out = unsafe { core::slice::from_raw_parts_mut(out.cast::<[f32; 3]>(), from.len()) };
    for (node, (out, from)) in out.iter_mut().zip(from).enumerate() {
        *out = change(node, from.to_array());
    }
    Ok(SUPPLE_OK)
}

/// Whether two pieces of memory have bytes in common.
pub(super) fn overlap(a: *const c_void, a_bytes: usize, b: *const c_void, b_bytes: usize) -> bool {
    let (a, b) = (a.addr(), b.addr());
    a < b.saturating_add(b_bytes) && b < a.saturating_add(a_bytes)
}
