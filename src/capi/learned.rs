//! The learned step for C: a network moves the state after a lead-in of exact steps, and with fallback a step that
//! energy does not explain is undone ([`crate::learned`]). Times in s.

use core::ffi::c_void;

use crate::learned::{LearnedModel, LearnedReport, LearnedView, vectors_for};
use crate::material::Law;
use crate::mlp::Network;
use crate::state::{NodeVector, StateView};
use crate::step::{Status, Step};
use crate::tled;

use super::SUPPLE_NONE;
use super::loads::{CallLoads, supple_loads};
use super::memory::{self, Arrays, Head, Layout, Object, Place, lasting_bytes, magic, one, place_for, same_abi};
use super::scene::{OpenScene, check_choice, supple_scene, supple_tissue};
use super::state::{opened_of, supple_state};
use super::status::{Answer, status_of, supple_error, supple_status};
use super::step::{HostThreads, answer, reported, supple_report, supple_threads, take_steps, worse};
use supple_status::*;

/// Share of the vertices outside what training has seen beyond which a step is remarked upon.
pub(super) const MUCH_OUTSIDE: f32 = 0.01;

/// What a learned step needs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_learned_config {
    /// sizeof(supple_learned_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// 1: a learned step that diverges, or has more kinetic energy than loads and supports explain, is undone and exact
    /// steps take its place and that of some more, before the network is tried again. 0: the caller decides by status
    /// and report. 1 needs memory for two vectors a node more.
    pub fallback: u32,
    /// 0.
    pub reserved: u32,
    /// A weight file, at a multiple of 4 bytes, better of 64. It is used where it is, without a copy: it must stay,
    /// unchanged, as long as the object is used.
    pub weights: *const c_void,
    /// Its bytes; what lies behind the file is ignored.
    pub weights_bytes: usize,
}

/// A network, and what it keeps for each node of one state. One thread at a time. It may be copied with memcpy; copies
/// use the same weights.
#[repr(C, align(64))]
pub struct supple_learned {
    head: Head,
    nodes: u32,
    pub(super) model: LearnedModel<'static>,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_learned {
    const MAGIC: [u8; 8] = magic(b'N');
    const FRONT: usize = 2048;
}

/// Bytes before the arrays of a learned step.
pub const SUPPLE_LEARNED_FRONT: usize = 2048;
const _: () = assert!(SUPPLE_LEARNED_FRONT == <supple_learned as Object>::FRONT);

/// What a network was trained for, and what a prediction costs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_learned_facts {
    /// Length of a learned step, s.
    pub seconds: f32,
    /// Damping of the training, 1/s; the state's step must have the same.
    pub damping: f32,
    /// Law of the training, SUPPLE_NEO_HOOKEAN and so on; in another tissue the network's error is not known.
    pub law: u32,
    /// Its constants and density, as in a scene.
    pub tissue: supple_tissue,
    /// Length of the exact step that it learned from, s.
    pub exact_seconds: f32,
    /// Multiplications with additions of one node's prediction.
    pub multiply_adds: u64,
    /// How often exact steps have taken the place of learned ones since the object was prepared or reset.
    pub fell_back: u32,
    /// Elements of the training, SUPPLE_LINEAR and so on; in a scene of others the network's error is not known.
    pub element: u32,
}

fn layout(nodes: u32, fallback: bool) -> Layout {
    Layout::of::<supple_learned>().and::<NodeVector>(vectors_for(nodes as usize, fallback))
}

/// Bytes of memory that learned steps of so many nodes need, with fallback (1) or without (0). SUPPLE_LEARNED_SIZE is
/// the same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_learned_size(nodes: u32, fallback: u32) -> usize {
    layout(nodes, fallback != 0).bytes()
}

/// Prepares learned steps of a scene in `memory` of at least supple_learned_size bytes, aligned to SUPPLE_ALIGN.
///
/// @param error may be NULL; index is that of a layer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    config: *const supple_learned_config,
    learned: *mut *mut supple_learned,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller: weights stay as long as the object is used.
    let init = || unsafe {
        let (open, config, learned) = (OpenScene::of(scene)?, one(config)?, place_for(learned)?);
        same_abi::<supple_learned_config>(config.struct_size, config.abi)?;
        check_choice(SUPPLE_NONE as usize, config.fallback, 1)?;
        check_choice(SUPPLE_NONE as usize, config.reserved, 0)?;
        let fallback = config.fallback == 1;
        let weights = lasting_bytes(config.weights, config.weights_bytes)?;
        let mut model = LearnedModel::new(Network::parse(weights)?, fallback)?;
        let nodes = open.node_count() as u32;
        let place = Place::new(memory, bytes, layout(nodes, fallback))?;
        model.with_storage(storage(place.arrays::<supple_learned>(), nodes, fallback)).reset();
        learned.write(place.put(|head| supple_learned { head, nodes, model }));
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// # Safety
/// The arrays are those of learned steps of so many nodes, and nobody else uses them.
unsafe fn storage<'a>(mut arrays: Arrays, nodes: u32, fallback: bool) -> &'a mut [NodeVector] {
    // SAFETY: the caller's promise. Any bits are vectors.
    unsafe { arrays.change(vectors_for(nodes as usize, fallback)) }
}

/// The steps in an object, with their storage.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn opened<'a>(object: *mut supple_learned) -> Answer<LearnedView<'a, 'static>> {
    // SAFETY: the caller's promise.
    unsafe {
        let (supple_learned { nodes, model, .. }, arrays) = memory::open(object)?;
        let fallback = model.undoes();
        Ok(model.with_storage(storage(arrays, *nodes, fallback)))
    }
}

/// For a motion from rest: frames as at the start, no lead-in yet, nothing has been undone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_reset(learned: *mut supple_learned) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let reset = || unsafe {
        opened(learned)?.reset();
        Ok(SUPPLE_OK)
    };
    status_of(reset())
}

/// Writes what a network was trained for.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_describe(
    learned: *const supple_learned,
    facts: *mut supple_learned_facts,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let describe = || unsafe {
        let (object, facts) = (memory::read(learned)?, place_for(facts)?);
        let network = object.model.network();
        let recipe = network.recipe();
        facts.write(supple_learned_facts {
            seconds: recipe.step,
            damping: recipe.damping,
            law: recipe.law.code() / 2,
            tissue: supple_tissue { constants: recipe.law.values(), density: recipe.density },
            exact_seconds: recipe.exact_step,
            multiply_adds: network.multiply_adds() as u64,
            fell_back: object.model.fallbacks(),
            element: recipe.element.code(),
        });
        Ok(SUPPLE_OK)
    };
    status_of(describe())
}

/// What a call that takes learned steps, or a lead-in, works with.
struct Call<'a> {
    open: OpenScene<'a>,
    loads: CallLoads<'a>,
    model: &'a mut LearnedModel<'static>,
    storage: &'a mut [NodeVector],
    state: StateView<'a>,
    exact: Step,
    /// Exact steps in one of the network's.
    ratio: u32,
    threads: HostThreads,
    report: &'a mut supple_report,
}

impl<'a> Call<'a> {
    /// # Safety
    /// As at [`supple_learned_step`].
    unsafe fn of(
        scene: *const supple_scene,
        loads: *mut supple_loads,
        state: *mut supple_state,
        learned: *mut supple_learned,
        threads: *const supple_threads,
        report: &'a mut supple_report,
    ) -> Answer<Self> {
        // SAFETY: the caller's promise.
        unsafe {
            let open = OpenScene::of(scene)?;
            let loads = CallLoads::of(loads, &open)?;
            open.fits(memory::read(state.cast_const())?.nodes)?;
            let (supple_learned { nodes, model, .. }, arrays) = memory::open(learned)?;
            open.fits(*nodes)?;
            let threads = HostThreads::of(threads)?;
            let exact = (*state).step()?;
            let ratio = model.exact_steps(&exact)?;
            let storage = storage(arrays, *nodes, model.undoes());
            let state = opened_of(&open, state)?;
            Ok(Self { open, loads, model, storage, state, exact, ratio, threads, report })
        }
    }

    /// Exact steps while the frames follow, as long as one of the network's steps. Motions go evenly over all `left` of
    /// these.
    fn lead(&mut self, left: u64) -> Answer<supple_status> {
        let Self { open, loads, model, storage, state, exact, ratio, threads, report } = self;
        let status = model
            .with_storage(storage)
            .lead_interval(state, |state| exact_steps((open, exact, threads), *ratio, left, state, loads, report));
        answer(&status)
    }

    /// One learned step; or exact ones, if it was undone or these are next.
    fn step(&mut self, left: u64) -> Answer<supple_status> {
        let Self { open, loads, model, storage, state, exact, threads, report, .. } = self;
        if !model.is_exact_next() {
            let mut learned = model.with_storage(storage);
            let loads = loads.of_next_step(state, left);
            let seconds = exact.seconds();
            let tried = learned.try_step(open.view(), &loads, state, seconds, threads)?;
            let LearnedReport { clipped, outside, .. } = *model.report();
            report.clipped = report.clipped.max(clipped);
            report.outside = report.outside.max(outside);
            if let Ok(status) = tried {
                report.enter(&status, state);
                let remark = answer(&status)?;
                return Ok(if outside > MUCH_OUTSIDE { worse(remark, SUPPLE_OUTSIDE) } else { remark });
            }
        }
        self.lead(left).map(|_| SUPPLE_FELL_BACK)
    }

    /// Takes `count` steps of the network's, or as many as can be believed.
    fn each(
        mut self,
        count: u64,
        mut step: impl FnMut(&mut Self, u64) -> Answer<supple_status>,
    ) -> Answer<supple_status> {
        let answer = (0..count).try_fold(SUPPLE_OK, |worst, done| Ok(worse(worst, step(&mut self, count - done)?)));
        self.report.close(&self.state);
        answer
    }
}

/// Takes the exact steps of one of the network's. Motions go evenly over all `left` of the network's.
fn exact_steps(
    (open, exact, threads): (&OpenScene<'_>, &Step, &HostThreads),
    ratio: u32,
    left: u64,
    state: &mut StateView<'_>,
    loads: &mut CallLoads<'_>,
    report: &mut supple_report,
) -> Status {
    let (count, left) = (ratio.into(), left.saturating_mul(ratio.into()));
    take_steps(count, left, state, loads, report, |loads, state| {
        tled::step_in_parts(open.view(), loads, state, exact, threads)
    })
}

/// The lead-in: exact steps for `seconds` while the frames of the nodes follow, in the nearest whole number of the
/// network's steps (seconds of supple_learned_facts), which may be none. The network can take over at the end of it. In
/// the paper it lasts 0.3 s from rest. Motions go evenly over all of it. Seconds that are negative or not finite:
/// SUPPLE_E_NEGATIVE.
///
/// @param loads what acts; NULL: nothing, supports stand still.
/// @param threads NULL: the calling thread alone.
/// @param report may be NULL; is written whatever the status; its steps are exact ones.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_lead(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    learned: *mut supple_learned,
    seconds: f64,
    threads: *const supple_threads,
    report: *mut supple_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let lead = |report: &mut supple_report| unsafe {
        let call = Call::of(scene, loads, state, learned, threads, report)?;
        if !(seconds.is_finite() && seconds >= 0.0) {
            return Err(supple_error::from(SUPPLE_E_NEGATIVE).value(seconds, 0.0));
        }
        let count = call.model.intervals(seconds);
        call.each(count, Call::lead)
    };
    // SAFETY: as above.
    unsafe { reported(report, lead) }
}

/// Takes `count` learned steps after supple_learned_lead, or after other learned steps, of the same state. With
/// fallback a step that is not to be believed is undone, and exact steps take its place and that of the next seven,
/// where it happens again of more, before the network is tried again: SUPPLE_FELL_BACK. Without fallback the call stops
/// at the first such step: it is not taken, displacements and time are as before it, velocities may be those of the
/// network's own step, and a new lead-in is needed.
///
/// @param loads what acts; NULL: nothing, supports stand still.
/// @param threads NULL: the calling thread alone.
/// @param report may be NULL; is written whatever the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_step(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    learned: *mut supple_learned,
    count: u32,
    threads: *const supple_threads,
    report: *mut supple_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let step = |report: &mut supple_report| unsafe {
        let call = Call::of(scene, loads, state, learned, threads, report)?;
        if !call.model.is_exact_next() && !call.model.is_led(&call.state) {
            return Err(SUPPLE_E_NOT_LED.into());
        }
        call.each(count.into(), Call::step)
    };
    // SAFETY: as above.
    unsafe { reported(report, step) }
}

/// To be called whenever a supple_guard calls learned steps inexact (SUPPLE_INEXACT): with fallback exact steps take
/// the place of the next eight, where it happens again of more, before the network is tried again. Without fallback
/// nothing changes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_fall_back(
    learned: *mut supple_learned,
    state: *const supple_state,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let fall_back = || unsafe {
        let time = memory::read(state)?.progress.time();
        let (supple_learned { model, .. }, _) = memory::open(learned)?;
        model.fall_back(time, Status::Ok);
        Ok(SUPPLE_OK)
    };
    status_of(fall_back())
}
