//! The force on an instrument between two frames, for C ([`crate::contact::LocalForce`]).

use crate::contact::LocalForce;

use super::memory::{one, place_for};
use super::status::{status_of, supple_status};
use supple_status::*;

/// The force on an instrument between two frames, for a haptic loop: supple_local_force_follow after each frame,
/// supple_local_force_at as often as you like, on any thread, on a copy. Begin with all zero.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_local_force {
    /// Of the instrument in the latest frame, m.
    pub position: [f32; 3],
    /// Force of the tissue on it there, N.
    pub force: [f32; 3],
    /// Change of the force with the position, N/m, symmetric: force = force + stiffness (position - position in the
    /// frame).
    pub stiffness: [[f32; 3]; 3],
    /// How far the force that was predicted for the latest frame was off, N.
    pub error: f32,
    /// How far off it would have been to hold the force of the frame before, N.
    pub hold_error: f32,
}

/// Takes the position (m) and the force (N) of a new frame, as of supple_read_touch.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_local_force_follow(
    model: *mut supple_local_force,
    position: *const f32,
    force: *const f32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let follow = || unsafe {
        let [position, force] = [*one(position.cast::<[f32; 3]>())?, *one(force.cast::<[f32; 3]>())?];
        if position.iter().chain(&force).any(|component| !component.is_finite()) {
            return Err(SUPPLE_E_NOT_FINITE.into());
        }
        let place = place_for(model)?;
        let mut local = local_force(&place.read());
        local.follow(position, force);
        let LocalForce { position, force, stiffness, error, hold_error } = local;
        place.write(supple_local_force { position, force, stiffness, error, hold_error });
        Ok(SUPPLE_OK)
    };
    status_of(follow())
}

/// Writes the force (N) at a position (m) before the next frame.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_local_force_at(
    model: *const supple_local_force,
    position: *const f32,
    force: *mut f32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let at = || unsafe {
        let (model, position) = (one(model)?, one(position.cast::<[f32; 3]>())?);
        place_for(force.cast::<[f32; 3]>())?.write(local_force(model).at(*position));
        Ok(SUPPLE_OK)
    };
    status_of(at())
}

fn local_force(model: &supple_local_force) -> LocalForce {
    let &supple_local_force { position, force, stiffness, error, hold_error } = model;
    LocalForce { position, force, stiffness, error, hold_error }
}
