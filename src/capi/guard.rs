//! Guards for C: a second run with longer steps that estimates the error of a state ([`crate::guard`]). Lengths in m,
//! times in s.

use core::ffi::c_void;
use core::mem::MaybeUninit;

use crate::guard::{Allowed, Estimate, GuardView, Watch, second_run, vectors_for};
use crate::inertia::LargeModel;
use crate::state::NodeVector;
use crate::step::{Status, Step};

use super::SUPPLE_NONE;
use super::large::storage;
use super::loads::{CallLoads, supple_loads};
use super::memory::{self, Head, Layout, Object, Place, array, magic, one, place_for, place_if_wanted, same_abi};
use super::scene::{OpenScene, supple_scene};
use super::state::{opened_of, supple_state};
use super::status::{Answer, Quantity, negative, status_of, supple_error, supple_status};
use super::step::{HostThreads, answer, supple_threads};
use supple_status::*;

/// What a guard needs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_guard_config {
    /// sizeof(supple_guard_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// Length of the steps that are guarded, s, and their damping, 1/s.
    pub seconds: f32,
    pub damping: f32,
    /// How many times as long the second run's steps are, at least 1 and at least the number of steps between two calls
    /// of supple_guard_follow. More costs less time, about a long step in so many, and calls more right steps
    /// inexact. 3 is a good choice, the steps of a frame another; 1 for learned steps.
    pub every: u32,
    /// Mean error of the nodes that is allowed, m; 0: a fifth of the mean motion so far, where that is more than a
    /// millimetre and a hundredth of the size of the body, of a body that has moved by less than its error more than a
    /// tenth of that.
    pub tolerance: f32,
}

/// What a guard estimates, m.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_estimate {
    /// 1 if there is an estimate: after the first comparison. 0: the other fields mean nothing.
    pub known: u32,
    /// The node with the largest error.
    pub node: u32,
    /// Mean error of the nodes.
    pub mean: f32,
    /// The largest.
    pub largest: f32,
    /// What is allowed for the mean.
    pub allowed: f32,
}

/// A second run of a state. One thread at a time. It may be copied with memcpy together with its state.
#[repr(C, align(64))]
pub struct supple_guard {
    head: Head,
    nodes: u32,
    /// In its storage.
    vectors: usize,
    watch: Watch,
    second: LargeModel,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_guard {
    const MAGIC: [u8; 8] = magic(b'G');
    const FRONT: usize = 10752;
}

pub(super) fn layout(vectors: usize) -> Layout {
    Layout::of::<supple_guard>().and::<NodeVector>(vectors)
}

/// Writes how many bytes of memory a supple_guard needs for a scene.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_guard_size(
    scene: *const supple_scene,
    points: *const f32,
    bytes: *mut usize,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let size = || unsafe {
        let (open, bytes) = (OpenScene::of(scene)?, place_for(bytes)?);
        let points = array(points.cast::<[f32; 3]>(), open.node_count())?;
        let vectors = vectors_for(open.view(), points)?;
        bytes.write(layout(vectors).bytes());
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(size(), error) }
}

/// Prepares a guard, from the state as it is, in `memory` of at least supple_guard_size bytes, aligned to SUPPLE_ALIGN.
/// It takes as long as some steps.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_guard_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    state: *mut supple_state,
    points: *const f32,
    config: *const supple_guard_config,
    guard: *mut *mut supple_guard,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let init = || unsafe {
        let (open, guard) = (OpenScene::of(scene)?, place_for(guard)?);
        let state = opened_of(&open, state)?;
        let config = one(config)?;
        same_abi::<supple_guard_config>(config.struct_size, config.abi)?;
        let points = array(points.cast::<[f32; 3]>(), open.node_count())?;
        let allowed = allowed(config.tolerance)?;
        let step = Step::unchecked(config.seconds, config.damping)?;
        let vectors = vectors_for(open.view(), points)?;
        let place = Place::new(memory, bytes, layout(vectors))?;
        let nodes = open.node_count() as u32;
        let storage = storage(place.arrays::<supple_guard>(), vectors);
        let object = place.object::<supple_guard>();
        // Of 57 kB: it is made where it stays, not on the stack.
        let second = &mut *(&raw mut (*object).second).cast::<MaybeUninit<_>>();
        let prepare = |state: crate::state::StateView<'_>, step, storage: &mut [NodeVector]| {
            LargeModel::prepare_in(second, second_run(), open.view(), points, state, step, storage).map(|_| ())
        };
        let ((), mut watch) = Watch::prepare(open.view(), points, state, step, config.every, storage, prepare)?;
        watch.allow(allowed);
        (&raw mut (*object).watch).write(watch);
        (&raw mut (*object).nodes).write(nodes);
        (&raw mut (*object).vectors).write(vectors);
        (&raw mut (*object).head).write(place.head::<supple_guard>());
        guard.write(object);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// The guard in an object, with its storage.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn opened<'a>(object: *mut supple_guard) -> Answer<GuardView<'a>> {
    // SAFETY: the caller's promise.
    unsafe {
        let (supple_guard { vectors, watch, second, .. }, arrays) = memory::open(object)?;
        Ok(GuardView { second, watch, storage: storage(arrays, *vectors) })
    }
}

fn allowed(tolerance: f32) -> Answer<Allowed> {
    match tolerance {
        0.0 => Ok(Allowed::ShareOfMotion),
        metres if metres.is_finite() && metres > 0.0 => Ok(Allowed::Metres(metres)),
        other => Err(negative(Quantity::Tolerance, other.into())),
    }
}

/// To be called after each call that moves the state, with the same loads, at the latest after `every` steps of the
/// configuration. Now and then it moves the second run and compares. SUPPLE_INEXACT if the estimate exceeds what is
/// allowed. A state that has not come by steps from where this guard has seen it last (reset, restored, stopped,
/// another copy) begins a new second run from where it is. So a state has one supple_guard at a time.
///
/// @param loads as of the steps; NULL: nothing, supports stand still.
/// @param threads NULL: the calling thread alone.
/// @param estimate may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_guard_follow(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    guard: *mut supple_guard,
    threads: *const supple_threads,
    estimate: *mut supple_estimate,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let follow = || unsafe {
        let open = OpenScene::of(scene)?;
        let mut loads = CallLoads::of(loads, &open)?;
        open.fits(memory::read(state.cast_const())?.nodes)?;
        open.fits(memory::read(guard.cast_const())?.nodes)?;
        let mut view = opened(guard)?;
        let threads = HostThreads::of(threads)?;
        let written = place_if_wanted(estimate)?;
        let mut state = loads.attached(opened_of(&open, state)?);
        let loads = loads.of_next_step(&state, 1);
        let status = view.reborrow().follow(Status::Ok, open.view(), &loads, state.reborrow(), &threads);
        if let Some(place) = written {
            place.write(estimated(view.watch.estimate()));
        }
        answer(&status)
    };
    status_of(follow())
}

pub(super) const fn estimated(estimate: Option<Estimate>) -> supple_estimate {
    match estimate {
        Some(Estimate { mean, largest, node, allowed }) => supple_estimate { known: 1, node, mean, largest, allowed },
        None => supple_estimate { known: 0, node: SUPPLE_NONE, mean: 0.0, largest: 0.0, allowed: 0.0 },
    }
}
