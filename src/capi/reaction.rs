//! The force by which supports act on the tissue, for C ([`crate::reaction`]). Forces in N.

use core::ffi::c_void;

use crate::reaction::{ReactionModel, vectors_for};
use crate::state::NodeVector;

use super::large::storage;
use super::memory::{self, Head, Layout, Object, Place, array, magic, place_for};
use super::scene::{OpenScene, supple_scene};
use super::state::{opened_of, supple_state};
use super::status::{status_of, supple_error, supple_status};
use supple_status::*;

/// The force by which supports act on the tissue, the mean since the last call of supple_reaction_follow, N.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_reaction_force {
    /// 1 if there is a force; 0 at the first call, after a reset or a restore, and where it is no finite number: the
    /// other fields mean nothing.
    pub known: u32,
    /// 1 if the steps resolve it: `spread` is at most a quarter of it. 0: do not use it.
    pub resolved: u32,
    pub newton: [f32; 3],
    /// How far the force at the supports alone is from it.
    pub spread: f32,
}

/// The reaction of some supports. It may be copied with memcpy together with its state.
#[repr(C, align(64))]
pub struct supple_reaction {
    head: Head,
    model: ReactionModel,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_reaction {
    const MAGIC: [u8; 8] = magic(b'R');
    const FRONT: usize = 256;
}

fn layout(nodes: usize) -> Layout {
    Layout::of::<supple_reaction>().and::<NodeVector>(vectors_for(nodes))
}

/// Bytes of memory that a supple_reaction needs for a scene of so many nodes; 0 if there is no such size.
#[unsafe(no_mangle)]
pub extern "C" fn supple_reaction_size(nodes: u32) -> usize {
    layout(nodes as usize).bytes()
}

/// Prepares the reaction of some supports in `memory` of at least supple_reaction_size bytes, aligned to SUPPLE_ALIGN.
/// It takes as long as some hundred steps.
///
/// @param supports numbers of nodes that the scene holds, an instrument's for example.
/// @param count how many, at least 1.
/// @param damping of the steps, 1/s.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_reaction_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    supports: *const u32,
    count: usize,
    damping: f32,
    reaction: *mut *mut supple_reaction,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let init = || unsafe {
        let (open, reaction) = (OpenScene::of(scene)?, place_for(reaction)?);
        let supports = array(supports, count)?;
        let nodes = open.node_count();
        let place = Place::new(memory, bytes, layout(nodes))?;
        let storage = storage(place.arrays::<supple_reaction>(), vectors_for(nodes));
        let model = ReactionModel::prepare(open.view(), supports, damping, storage)?;
        reaction.write(place.put(|head| supple_reaction { head, model }));
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// Writes the mean force by which the supports have acted since the last call. To be called before the first step and
/// after each frame's steps, of any kind.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_reaction_follow(
    scene: *const supple_scene,
    state: *mut supple_state,
    reaction: *mut supple_reaction,
    force: *mut supple_reaction_force,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let follow = || unsafe {
        let (open, place) = (OpenScene::of(scene)?, place_for(force)?);
        let (supple_reaction { model, .. }, arrays) = memory::open(reaction)?;
        if !model.is_for(open.view()) {
            return Err(SUPPLE_E_MISMATCH.into());
        }
        let storage = storage(arrays, vectors_for(open.node_count()));
        let state = opened_of(&open, state)?;
        let force = model.follow(open.view(), &state, storage);
        place.write(match force {
            Some(force) => supple_reaction_force {
                known: 1,
                resolved: force.is_resolved().into(),
                newton: force.newton,
                spread: force.spread,
            },
            None => supple_reaction_force { known: 0, resolved: 0, newton: [0.0; 3], spread: 0.0 },
        });
        Ok(SUPPLE_OK)
    };
    status_of(follow())
}
