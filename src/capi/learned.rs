//! The learned step for C: the exact step leads, a network takes over, and what it does that energy does not explain may be
//! undone.

use core::ffi::c_void;

use crate::mlp::{Network, TrainedLaw};
use crate::state::{NodeVector, State};
use crate::surrogate::{self, Surrogate, SurrogateReport, Vertex};
use crate::tled::{self, Status, Step};

use super::SUPPLE_NONE;
use super::loads::{Acting, belongs, supple_loads};
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, one, place_for, same_abi};
use super::scene::{
    AnyScene, SUPPLE_EXPONENTIAL, SUPPLE_NEO_HOOKEAN, carved, check_choice, supple_scene, supple_tissue,
    with_scene,
};
use super::state::{Moment, View, step_of, supple_state};
use super::status::{Answer, supple_error, supple_status};
use super::step::{HostThreads, reported, supple_report, supple_threads, taken, worse};
use supple_status::*;

/// Share of the vertices outside what training has seen beyond which a step is remarked upon.
const MUCH_OUTSIDE: f32 = 0.01;

/// What a learned step needs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_learned_config {
    /// sizeof(supple_learned_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// 1: a learned step that diverges, or has more kinetic energy than loads and supports explain, is undone and the exact
    /// step takes over for good. 0: the caller decides by status and report. Needs memory for two vectors a node.
    pub fallback: u32,
    /// 0.
    pub reserved: u32,
    /// A weight file, at a multiple of 4 bytes, better of 64. It is used where it is, without a copy: it must stay, unchanged, as long as
    /// the object is used.
    pub weights: *const c_void,
    /// Its bytes; what lies behind the file is ignored.
    pub weights_bytes: usize,
}

/// A network, and what it keeps for each node of one state. One thread at a time. It may be copied with memcpy; copies use the
/// same weights.
#[repr(C, align(64))]
pub struct supple_learned {
    head: Head,
    nodes: u32,
    fallback: bool,
    fell_back: bool,
    /// Steps of the state when the exact step last led or the network last moved it; nothing before.
    led: Option<u64>,
    surrogate: Surrogate<'static, ()>,
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
    /// Law of the training, SUPPLE_NEO_HOOKEAN or SUPPLE_EXPONENTIAL; in another tissue the network's error is not known.
    pub law: u32,
    /// Its constants and density, as in a scene.
    pub tissue: supple_tissue,
    /// Length of the exact step that it learned from, s.
    pub exact_seconds: f32,
    /// Multiplications with additions of one node's prediction.
    pub multiply_adds: u64,
    /// Whether the exact step has taken over for good.
    pub fell_back: u32,
}

fn layout(nodes: u32, fallback: u32) -> Layout {
    let nodes = nodes as usize;
    let copies = if fallback == 0 { 0 } else { nodes };
    Layout::of::<supple_learned>().and::<Vertex>(nodes).and::<NodeVector>(copies).and::<NodeVector>(copies)
}

/// Bytes of memory that learned steps of so many nodes need, with fallback (1) or without (0). SUPPLE_LEARNED_SIZE is the
/// same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_learned_size(nodes: u32, fallback: u32) -> usize {
    layout(nodes, fallback).bytes()
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
        let (any, config, learned) = (carved(scene)?, one(config)?, place_for(learned)?);
        same_abi::<supple_learned_config>(config.struct_size, config.abi)?;
        check_choice(SUPPLE_NONE as usize, config.fallback, 1)?;
        check_choice(SUPPLE_NONE as usize, config.reserved, 0)?;
        let weights: &'static [u8] = match config.weights.is_null() {
            true => return Err(SUPPLE_E_NULL.into()),
            false => array(config.weights.cast(), config.weights_bytes)?,
        };
        let surrogate = Surrogate::over(Network::parse(weights)?, ())?;
        let nodes = with_scene!(any, scene => scene.node_count() as u32);
        let place = Place::new(memory, bytes, layout(nodes, config.fallback))?;
        let fallback = config.fallback == 1;
        let object = place.put(|head| supple_learned {
            head,
            nodes,
            fallback,
            fell_back: false,
            led: None,
            surrogate,
        });
        vertices(object).fill(Vertex::NEW);
        place.done::<supple_learned>();
        learned.write(object);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// # Safety
/// `object` has been put or is one, and nobody else uses it.
unsafe fn vertices<'a>(object: *mut supple_learned) -> &'a mut [Vertex] {
    // SAFETY: the caller's promise. Any bits are vertices.
    unsafe { Arrays::behind(object.cast_const()).next((*object).nodes as usize) }
}

/// For a motion from rest: frames as at the start, the network has not been led, the exact step has not taken over.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_reset(learned: *mut supple_learned) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let reset = || unsafe {
        let object = memory::change(learned)?;
        (object.led, object.fell_back) = (None, false);
        vertices(learned).fill(Vertex::NEW);
        Ok(SUPPLE_OK)
    };
    reset().unwrap_or_else(|error: supple_error| error.status)
}

/// Writes what a network was trained for.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_learned_describe(
    learned: *const supple_learned,
    facts: *mut supple_learned_facts,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let tell = || unsafe {
        let (object, facts) = (memory::read(learned)?, place_for(facts)?);
        let recipe = object.surrogate.recipe();
        let (law, constants) = match recipe.law {
            TrainedLaw::NeoHookean { c, d, .. } => (SUPPLE_NEO_HOOKEAN, [c, d, 0.0]),
            TrainedLaw::Exponential { a, b, d, .. } => (SUPPLE_EXPONENTIAL, [a, b, d]),
        };
        facts.write(supple_learned_facts {
            seconds: recipe.step,
            damping: recipe.damping,
            law,
            tissue: supple_tissue { constants, density: recipe.density },
            exact_seconds: recipe.exact_step,
            multiply_adds: object.surrogate.multiply_adds() as u64,
            fell_back: object.fell_back.into(),
        });
        Ok(SUPPLE_OK)
    };
    tell().unwrap_or_else(|error: supple_error| error.status)
}

/// What both calls work with.
struct Parts<'a> {
    any: AnyScene<'a>,
    acting: Acting<'a>,
    object: &'a mut supple_learned,
    vertices: &'a mut [Vertex],
    /// Displacements and increments from before a step, with fallback.
    copies: [&'a mut [NodeVector]; 2],
    view: View<'a>,
    exact: Step,
    /// Exact steps in one of the network's.
    ratio: u32,
    threads: HostThreads,
    found: &'a mut supple_report,
}

impl<'a> Parts<'a> {
    /// # Safety
    /// As at [`supple_learned_step`].
    unsafe fn of(
        scene: *const supple_scene,
        loads: *mut supple_loads,
        state: *mut supple_state,
        learned: *mut supple_learned,
        threads: *const supple_threads,
        found: &'a mut supple_report,
    ) -> Answer<Self> {
        // SAFETY: the caller's promise.
        unsafe {
            let any = carved(scene)?;
            let acting = Acting::of(loads, &any)?;
            let moved = memory::change(state)?;
            belongs(moved.nodes, &any)?;
            let (object, mut arrays) = memory::open(learned)?;
            belongs(object.nodes, &any)?;
            let threads = HostThreads::of(threads)?;
            let exact = step_of(moved)?;
            let recipe = object.surrogate.recipe();
            if (exact.damping() - recipe.damping).abs() > 1e-6 * recipe.damping {
                let wrong = supple_error::from(SUPPLE_E_DAMPING);
                return Err(wrong.value(exact.damping().into(), recipe.damping.into()));
            }
            let ratio = recipe.step / exact.seconds() + 0.5;
            let whole = ratio as u32;
            if whole < 1 || (whole as f32 * exact.seconds() - recipe.step).abs() > 1e-4 * recipe.step {
                let wrong = supple_error::from(SUPPLE_E_STEP_RATIO);
                return Err(wrong.value(recipe.step.into(), exact.seconds().into()));
            }
            let nodes = object.nodes as usize;
            let vertices = arrays.next::<Vertex>(nodes);
            let copies = if object.fallback { nodes } else { 0 };
            let copies = [arrays.next::<NodeVector>(copies), arrays.next::<NodeVector>(copies)];
            let view = View::of(state);
            Ok(Self { any, acting, object, vertices, copies, view, exact, ratio: whole, threads, found })
        }
    }

    /// Takes the exact steps of one of the network's. Motions go evenly over all `left` of the network's steps.
    fn exact_steps(&mut self, left: u32) -> Answer<supple_status> {
        let Self { any, acting, view, exact, ratio, threads, found, .. } = self;
        let left = left.saturating_mul(*ratio);
        view.with(|state| {
            with_scene!(&*any, scene => taken(*ratio, left, state, acting, found, |loads, state| {
                tled::step_in_parts(scene, loads, state, exact, &*threads)
            }))
        })
    }

    /// Exact steps, with frames that follow.
    fn lead(&mut self, left: u32) -> Answer<supple_status> {
        for (vertex, &displacement) in self.vertices.iter_mut().zip(self.view.state.displacements()) {
            vertex.remember(displacement);
        }
        self.object.led = None;
        let answer = self.exact_steps(left)?;
        for (vertex, &displacement) in self.vertices.iter_mut().zip(self.view.state.displacements()) {
            vertex.follow_since(displacement);
        }
        self.object.led = Some(self.view.state.steps());
        Ok(answer)
    }

    /// One learned step, or exact ones once these have taken over.
    fn learned(&mut self, left: u32) -> Answer<supple_status> {
        if self.object.fell_back {
            return self.exact_steps(left).map(|_| SUPPLE_FELL_BACK);
        }
        let network = self.object.surrogate.seconds();
        let Self { any, acting, object, vertices, copies, view, threads, found, .. } = self;
        let (status, before) = view.with(|state| {
            if (state.dt - network).abs() > 1e-5 * network {
                // It has just been led. The exact step goes on from its own increments, the network from those of its own step.
                let kept = vertices.iter().map(Vertex::kept);
                state.increment.iter_mut().zip(kept).for_each(|(increment, kept)| *increment = kept);
                state.dt = network;
            }
            let before = object.fallback.then(|| remember(state, copies));
            let loads = acting.next(state.displacements(), left);
            let mut surrogate = object.surrogate.with(vertices);
            let status = with_scene!(&*any, scene => {
                surrogate::step_in_parts(scene, &loads, state, &mut surrogate, &*threads as &HostThreads)
            });
            object.surrogate.set_report(*surrogate.report());
            (status, before)
        });
        let SurrogateReport { clipped, outside, .. } = *self.object.surrogate.report();
        found.clipped = found.clipped.max(clipped);
        found.outside = found.outside.max(outside);
        if let Some(before) = before.filter(|_| is_unexplained(&status)) {
            self.object.fell_back = true;
            let (copies, exact) = (&self.copies, self.exact.seconds());
            self.view.with(|state| {
                restore(state, copies, before);
                state.respan(exact);
            });
            return self.exact_steps(left).map(|_| SUPPLE_FELL_BACK);
        }
        // A step that is not taken leaves what it predicted: the network cannot go on from that.
        self.object.led = None;
        let answer = found.enter(&status, &self.view.state)?;
        self.object.led = Some(self.view.state.steps());
        Ok(if outside > MUCH_OUTSIDE { worse(answer, SUPPLE_OUTSIDE) } else { answer })
    }

    /// Takes `count` steps of the network's, or as many as can be believed.
    fn each(
        mut self,
        count: u32,
        mut step: impl FnMut(&mut Self, u32) -> Answer<supple_status>,
    ) -> Answer<supple_status> {
        let answer =
            (0..count).try_fold(SUPPLE_OK, |worst, done| Ok(worse(worst, step(&mut self, count - done)?)));
        self.found.close(&self.view.state);
        answer
    }
}

/// Copies what a learned step changes.
fn remember(
    state: &State<&mut [NodeVector]>,
    [displacement, increment]: &mut [&mut [NodeVector]; 2],
) -> Moment {
    displacement.iter_mut().zip(state.displacement.iter()).for_each(|(copy, vector)| *copy = *vector);
    increment.iter_mut().zip(state.increment.iter()).for_each(|(copy, vector)| *copy = *vector);
    Moment::of(state)
}

fn restore(
    state: &mut State<&mut [NodeVector]>,
    [displacement, increment]: &[&mut [NodeVector]; 2],
    before: Moment,
) {
    state.displacement.iter_mut().zip(displacement.iter()).for_each(|(vector, copy)| *vector = *copy);
    state.increment.iter_mut().zip(increment.iter()).for_each(|(vector, copy)| *vector = *copy);
    before.put(state);
}

/// Whether energy does not explain a step.
fn is_unexplained(status: &Status) -> bool {
    match status {
        Status::Diverged(_) => true,
        Status::Limited { energy_excess, .. } => *energy_excess > 0.0,
        _ => false,
    }
}

/// Lets the exact step lead, `count` times over the length of a learned step, while the frames of the nodes follow. The network
/// can take over at the end of it. In the paper the exact step leads for 0.3 s from rest.
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
    count: u32,
    threads: *const supple_threads,
    report: *mut supple_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let lead = |found: &mut supple_report| unsafe {
        Parts::of(scene, loads, state, learned, threads, found)?.each(count, Parts::lead)
    };
    // SAFETY: as above.
    unsafe { reported(report, lead) }
}

/// Takes `count` learned steps after supple_learned_lead, or after other learned steps, of the same state. Stops at the first
/// that is not to be believed: without fallback that one is not taken, displacements and time are as before it, velocities may be
/// those of the network's own step, and the exact step has to lead again.
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
    let step = |found: &mut supple_report| unsafe {
        let parts = Parts::of(scene, loads, state, learned, threads, found)?;
        if !parts.object.fell_back && parts.object.led != Some(parts.view.state.steps()) {
            return Err(SUPPLE_E_NOT_LED.into());
        }
        parts.each(count, Parts::learned)
    };
    // SAFETY: as above.
    unsafe { reported(report, step) }
}
