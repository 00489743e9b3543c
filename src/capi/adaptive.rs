//! Adaptive steps for C: they choose their length so that their error stays below a tolerance ([`crate::adaptive`]).
//! Lengths in m, times in s.

use core::ffi::c_void;
use core::mem::MaybeUninit;

use crate::adaptive::{AdaptiveView, Chooser, Request, StorageParts, Taken, vectors_with};
use crate::guard::{Watch, second_run};
use crate::inertia::LargeModel;
use crate::state::{NodeVector, StateView};
use crate::step::{Step, Work};

use super::guard::{estimated, supple_estimate};
use super::large::{LargeRequest, storage, supple_large_config};
use super::loads::{CallLoads, supple_loads};
use super::memory::{self, Head, Layout, Object, Place, magic, place_for, place_if_wanted};
use super::scene::{OpenScene, supple_scene};
use super::state::{opened_of, supple_state};
use super::status::{Answer, Quantity, negative, supple_error, supple_status};
use super::step::{HostThreads, answer, reported, supple_report, supple_threads};
use supple_status::*;

/// What a call of supple_adaptive_advance took.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_adaptive_report {
    /// Exact steps, those included that were undone.
    pub exact: u32,
    /// Steps beyond the critical one.
    pub large: u32,
    /// Changes of the length of the steps; each costs about a cycle of steps.
    pub changes: u32,
    /// Length of the next steps, s.
    pub next_seconds: f32,
    /// Estimate of the error at the end.
    pub estimate: supple_estimate,
}

/// Steps that choose their length. One thread at a time. It may be copied with memcpy together with its state.
#[repr(C, align(64))]
pub struct supple_adaptive {
    head: Head,
    nodes: u32,
    /// In its storage.
    vectors: usize,
    chooser: Chooser,
    watch: Watch,
    first: LargeModel,
    second: LargeModel,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_adaptive {
    const MAGIC: [u8; 8] = magic(b'A');
    const FRONT: usize = 20480;
}

pub(super) fn layout(vectors: usize) -> Layout {
    Layout::of::<supple_adaptive>().and::<NodeVector>(vectors)
}

/// Vectors of the storage.
pub(super) fn vectors_of(open: &OpenScene<'_>, request: &LargeRequest<'_>) -> Answer<usize> {
    Ok(vectors_with(request.vectors, open.view(), request.points)?)
}

/// Writes how many bytes of memory a supple_adaptive needs for a scene; it depends on the lattice.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param config of the steps beyond the critical one.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_adaptive_size(
    scene: *const supple_scene,
    points: *const f32,
    config: *const supple_large_config,
    bytes: *mut usize,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let size = || unsafe {
        let (open, bytes) = (OpenScene::of(scene)?, place_for(bytes)?);
        let request = LargeRequest::of(&open, points, config)?;
        bytes.write(layout(vectors_of(&open, &request)?).bytes());
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(size(), error) }
}

/// Prepares adaptive steps, from the state as it is, in `memory` of at least supple_adaptive_size bytes, aligned to
/// SUPPLE_ALIGN. It takes as long as some steps. They begin as exact steps.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param config of the steps beyond the critical one; its `seconds` are those of the longest step, usually a frame.
/// @param tolerance the mean error of the nodes that you accept, m.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_adaptive_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    state: *mut supple_state,
    points: *const f32,
    config: *const supple_large_config,
    tolerance: f32,
    adaptive: *mut *mut supple_adaptive,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let init = || unsafe {
        let (open, adaptive) = (OpenScene::of(scene)?, place_for(adaptive)?);
        let mut state = opened_of(&open, state)?;
        let request = LargeRequest::of(&open, points, config)?;
        if !(tolerance.is_finite() && tolerance > 0.0) {
            return Err(negative(Quantity::Tolerance, tolerance.into()));
        }
        let longest = Step::unchecked(request.config.seconds, request.config.damping)?;
        let asked = Request { tolerance, longest };
        let method = request.method();
        let vectors = vectors_of(&open, &request)?;
        let place = Place::new(memory, bytes, layout(vectors))?;
        let nodes = open.node_count() as u32;
        let storage = storage(place.arrays::<supple_adaptive>(), vectors);
        let object = place.object::<supple_adaptive>();
        // Of 57 kB each: they are made where they stay, not on the stack.
        let [first, second] = [&raw mut (*object).first, &raw mut (*object).second]
            .map(|model| &mut *model.cast::<MaybeUninit<LargeModel>>());
        let points = request.points;
        let scene = open.view();
        let chooser = Chooser::new(&method, scene, points, state.reborrow(), asked)?;
        let StorageParts { first: of_first, second: of_second, .. } = chooser.checked(storage, scene, points)?;
        let step = chooser.shortest()?;
        chooser.with_longest(|longest| {
            let model = LargeModel::prepare_in(first, method, scene, points, state.reborrow(), longest, of_first)?;
            model.change_step(step);
            Ok(())
        })?;
        let prepare = |mut state: StateView<'_>, step, storage: &mut [NodeVector]| {
            chooser.with_longest(|longest| {
                let model =
                    LargeModel::prepare_in(second, second_run(), scene, points, state.reborrow(), longest, storage)?;
                model.change_step(step);
                Ok(())
            })
        };
        let ((), watch) = Watch::prepare(scene, points, state, step, 1, of_second, prepare)?;
        (&raw mut (*object).chooser).write(chooser);
        (&raw mut (*object).watch).write(chooser.allowing(watch));
        (&raw mut (*object).nodes).write(nodes);
        (&raw mut (*object).vectors).write(vectors);
        (&raw mut (*object).head).write(place.head::<supple_adaptive>());
        adaptive.write(object);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// The steps in an object, with their storage.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn opened<'a>(object: *mut supple_adaptive) -> Answer<AdaptiveView<'a>> {
    // SAFETY: the caller's promise.
    unsafe {
        let (supple_adaptive { vectors, chooser, watch, first, second, .. }, arrays) = memory::open(object)?;
        Ok(AdaptiveView { chooser, first, second, watch, storage: storage(arrays, *vectors) })
    }
}

/// Moves on by `seconds`, usually a frame, and ends there exactly. SUPPLE_INEXACT if the estimate of the error exceeded
/// the tolerance at any step: steps become shorter at once, down to exact ones, but an error that is there stays until
/// the body has forgotten it. A step that is not to be believed is taken again with shorter ones; where exact ones are
/// not either, the state is that before it, and the status tells.
///
/// @param loads what acts; NULL: nothing, supports stand still. Motions without a ramp go evenly over the call.
/// @param threads NULL: the calling thread alone.
/// @param report may be NULL; is written whatever the status.
/// @param taken may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_adaptive_advance(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    adaptive: *mut supple_adaptive,
    seconds: f32,
    threads: *const supple_threads,
    report: *mut supple_report,
    taken: *mut supple_adaptive_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let advance = |report: &mut supple_report| unsafe {
        let open = OpenScene::of(scene)?;
        let mut loads = CallLoads::of(loads, &open)?;
        open.fits(memory::read(state.cast_const())?.nodes)?;
        open.fits(memory::read(adaptive.cast_const())?.nodes)?;
        let AdaptiveView { chooser, first, second, watch, storage } = opened(adaptive)?;
        // Also refuses what is no number.
        let span = Step::unchecked(seconds, 0.0)?;
        let threads = HostThreads::of(threads)?;
        let written = place_if_wanted(taken)?;
        let mut state = loads.attached(opened_of(&open, state)?);
        let view = AdaptiveView { chooser: &mut *chooser, first, second, watch: &mut *watch, storage };
        let mut work = Work::UNBOUNDED;
        let (status, Taken { exact, large, changes, .. }) =
            view.advance(span.seconds(), &mut work, open.view(), &mut loads.of_call, state.reborrow(), &threads);
        loads.enter(state.touches());
        let status = status.at_end(&state);
        report.enter(&status, &state);
        report.steps = exact + large;
        report.close(&state);
        if let Some(place) = written {
            let (next_seconds, estimate) = (chooser.seconds(), estimated(chooser.estimate(watch)));
            place.write(supple_adaptive_report { exact, large, changes, next_seconds, estimate });
        }
        answer(&status)
    };
    // SAFETY: as above.
    unsafe { reported(report, advance) }
}
