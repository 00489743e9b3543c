//! What moves, for C: displacements, their last increments, forces, time, and the step that moves them.

use core::ffi::c_void;

use crate::ledger::Ledger;
use crate::state::{NodeVector, State};
use crate::tled::{self, Step};

use super::loads::belongs;
use super::memory::{
    self, Arrays, Head, Layout, Object, Place, magic, one, place_for, place_if_wanted, same_abi,
};
use super::scene::{carved, supple_scene, with_scene};
use super::status::{Answer, supple_error, supple_status};
use supple_status::*;

/// What moves. One thread at a time. It may be copied with memcpy, to any memory aligned to SUPPLE_ALIGN, and the copy goes on as
/// the original would, to the bit.
#[repr(C, align(64))]
pub struct supple_state {
    head: Head,
    pub(super) nodes: u32,
    has_step: bool,
    pub(super) moment: Moment,
    step: Step,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_state {
    const MAGIC: [u8; 8] = magic(b'M');
    const FRONT: usize = 128;
}

/// Bytes before the arrays of a state.
pub const SUPPLE_STATE_FRONT: usize = 128;
const _: () = assert!(SUPPLE_STATE_FRONT == <supple_state as Object>::FRONT);

/// When it is, and the energy account.
#[derive(Clone, Copy)]
pub(super) struct Moment {
    pub(super) time: f64,
    pub(super) steps: u64,
    pub(super) dt: f32,
    pub(super) ledger: Ledger,
}

impl Moment {
    pub(super) fn of<S>(&State { time, steps, dt, ledger, .. }: &State<S>) -> Self {
        Self { time, steps, dt, ledger }
    }

    pub(super) fn put<S>(self, state: &mut State<S>) {
        let Self { time, steps, dt, ledger } = self;
        (state.time, state.steps, state.dt, state.ledger) = (time, steps, dt, ledger);
    }
}

/// The step, and how motion is damped.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_step_config {
    /// sizeof(supple_step_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// Length of a step, s: at most the critical step.
    pub seconds: f32,
    /// Damping proportional to mass, 1/s, zero or more.
    pub damping: f32,
}

fn layout(nodes: u32) -> Layout {
    let nodes = nodes as usize;
    Layout::of::<supple_state>().and::<NodeVector>(nodes).and::<NodeVector>(nodes).and::<NodeVector>(nodes)
}

/// Bytes of memory that the state of so many nodes needs. SUPPLE_STATE_SIZE is the same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_state_size(nodes: u32) -> usize {
    layout(nodes).bytes()
}

/// Prepares the state of a scene, at rest, in `memory` of at least supple_state_size bytes, aligned to SUPPLE_ALIGN.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    state: *mut *mut supple_state,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let init = || unsafe {
        let (any, state) = (carved(scene)?, place_for(state)?);
        let nodes = with_scene!(any, scene => scene.node_count() as u32);
        let place = Place::new(memory, bytes, layout(nodes))?;
        let step = Step::insist(1.0, 0.0)?;
        let moment = Moment { time: 0.0, steps: 0, dt: 0.0, ledger: Ledger::NEW };
        let object = place.put(|head| supple_state { head, nodes, has_step: false, moment, step });
        View::of(object).state.reset();
        place.done::<supple_state>();
        state.write(object);
        Ok(SUPPLE_OK)
    };
    init().unwrap_or_else(|error: supple_error| error.status)
}

/// Puts a state back to rest at time zero. Its step stays. Large steps have to be prepared again, learned ones reset and led.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_reset(state: *mut supple_state) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let reset = || unsafe {
        memory::is(state.cast_const())?;
        View::of(state).with(State::reset);
        Ok(SUPPLE_OK)
    };
    reset().unwrap_or_else(|error: supple_error| error.status)
}

/// Writes a bound on the stable step at the state's displacements, s: never above the exact limit. It costs a few
/// steps; tissue that is deformed is stiffer, so ask again from time to time.
///
/// @param seconds receives the step, s.
/// @param node may be NULL; receives the node that sets it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_critical_step(
    scene: *const supple_scene,
    state: *mut supple_state,
    seconds: *mut f32,
    node: *mut u32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let find = || unsafe {
        let (any, object) = (carved(scene)?, memory::change(state)?);
        belongs(object.nodes, &any)?;
        let seconds = place_for(seconds)?;
        let node = place_if_wanted(node)?;
        let critical =
            View::of(state).with(|state| with_scene!(any, scene => tled::critical_step(&scene, state)));
        let critical = critical.ok_or(supple_error::from(SUPPLE_E_TOO_STIFF))?;
        seconds.write(critical.seconds);
        if let Some(node) = node {
            node.write(critical.node);
        }
        Ok(SUPPLE_OK)
    };
    find().unwrap_or_else(|error: supple_error| error.status)
}

/// Sets the exact step of a state, for all calls that follow. Refused above the critical step at the state's
/// displacements, which it computes. It may be changed at any time.
///
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_step(
    scene: *const supple_scene,
    state: *mut supple_state,
    config: *const supple_step_config,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let (any, config) = (carved(scene)?, *one(config)?);
        same_abi::<supple_step_config>(config.struct_size, config.abi)?;
        belongs(memory::change(state)?.nodes, &any)?;
        // What is no step at all is told before anything is computed.
        let step = Step::insist(config.seconds, config.damping)?;
        let critical =
            View::of(state).with(|state| with_scene!(any, scene => tled::critical_step(&scene, state)));
        let critical = critical.ok_or(supple_error::from(SUPPLE_E_TOO_STIFF))?;
        Step::new(config.seconds, config.damping, critical)?;
        memory::change(state)?.set_step(Some(step));
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Writes the simulated time, s, and how many steps have been taken; either may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_time(
    state: *const supple_state,
    seconds: *mut f64,
    steps: *mut u64,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let tell = || unsafe {
        let moment = &memory::read(state)?.moment;
        let (seconds, steps) = (place_if_wanted(seconds)?, place_if_wanted(steps)?);
        if let Some(seconds) = seconds {
            seconds.write(moment.time);
        }
        if let Some(steps) = steps {
            steps.write(moment.steps);
        }
        Ok(SUPPLE_OK)
    };
    tell().unwrap_or_else(|error: supple_error| error.status)
}

impl supple_state {
    pub(super) fn set_step(&mut self, step: Option<Step>) {
        self.has_step = step.is_some();
        self.step = step.unwrap_or(self.step);
    }
}

/// The step that was set.
pub(super) fn step_of(object: &supple_state) -> Answer<Step> {
    if object.has_step { Ok(object.step) } else { Err(SUPPLE_E_NO_STEP.into()) }
}

/// A state over the memory of its object.
pub(super) struct View<'a> {
    pub(super) state: State<&'a mut [NodeVector]>,
    moment: &'a mut Moment,
}

impl<'a> View<'a> {
    /// # Safety
    /// `object` has been put or is one, and nobody else uses it.
    pub(super) unsafe fn of(object: *mut supple_state) -> Self {
        // SAFETY: the caller's promise. Any bits are vectors.
        unsafe {
            let nodes = (*object).nodes as usize;
            let moment = &mut (*object).moment;
            let mut arrays = Arrays::behind(object.cast_const());
            let mut next = || arrays.next::<NodeVector>(nodes);
            let mut state = State::over(next(), next(), next());
            moment.put(&mut state);
            Self { state, moment }
        }
    }

    /// Does something with the state, and keeps when it is.
    pub(super) fn with<T>(&mut self, work: impl FnOnce(&mut State<&'a mut [NodeVector]>) -> T) -> T {
        let done = work(&mut self.state);
        *self.moment = Moment::of(&self.state);
        done
    }
}

/// One of a state's arrays of vectors.
#[derive(Clone, Copy)]
pub(super) enum Field {
    Displacement,
    Increment,
    Force,
}

/// # Safety
/// As at [`memory::read`].
pub(super) unsafe fn field<'a>(object: *const supple_state, field: Field) -> Answer<&'a [NodeVector]> {
    // SAFETY: the caller's promise.
    unsafe {
        let nodes = memory::read(object)?.nodes as usize;
        let mut arrays = Arrays::behind(object);
        let displacement = arrays.look(nodes);
        let increment = arrays.look(nodes);
        let force = arrays.look(nodes);
        Ok(match field {
            Field::Displacement => displacement,
            Field::Increment => increment,
            Field::Force => force,
        })
    }
}
