//! The exact step for C, alone or on threads of the host.

use core::ffi::c_void;
use core::ptr;
use core::sync::atomic::{AtomicBool, Ordering};

use crate::ledger::Ledger;
use crate::state::{NodeVector, State};
use crate::threads::{MOST_PARTS, Threads};
use crate::tled::{self, Cause, Divergence, Status};

use super::SUPPLE_NONE;
use super::loads::{Acting, belongs, supple_loads};
use super::memory::{self, one, place_for};
use super::scene::{carved, supple_scene, with_scene};
use super::state::{View, step_of, supple_state};
use super::status::{Answer, mismatch, supple_error, supple_status};
use supple_status::*;

/// Most parts of a step.
pub const SUPPLE_MOST_PARTS: u32 = 8;
const _: () = assert!(SUPPLE_MOST_PARTS as usize == MOST_PARTS);

/// Computes part `part` of what `work` stands for. It may be called from any thread, once for each part; a second call for the
/// same part does nothing.
pub type supple_part = unsafe extern "C" fn(work: *const c_void, part: u32);

/// Threads of the host. A step calls `each` twice: it shall call `part(work, p)` for every `p` below `parts`, on
/// whichever threads, side by side or not, and return when all those calls have. Parts share nothing, and the result does not
/// depend on where they run, to the bit. What `each` leaves out is computed when it has returned. It must return: no exception and
/// no longjmp may leave it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_threads {
    /// Handed to `each`.
    pub context: *mut c_void,
    /// Parts that a step shall be cut into; there will be SUPPLE_MOST_PARTS at most, and fewer if the scene is small.
    pub parts: u32,
    /// See above.
    pub each: Option<
        unsafe extern "C" fn(context: *mut c_void, part: supple_part, work: *const c_void, parts: u32),
    >,
}

/// What the steps of a call found, and what stopped it. Every call that takes steps writes all of it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_report {
    /// Simulated time at the end, s; of a step that was not taken, at its start; zero, and all else as if there had been no step, if
    /// the call was refused before its first.
    pub time: f64,
    /// Kinetic energy at the latest step, J.
    pub kinetic: f64,
    /// The most energy that loads and supports ever gave, J.
    pub available: f64,
    /// Steps taken by this call.
    pub steps: u32,
    /// The node at which a step diverged, else SUPPLE_NONE.
    pub node: u32,
    /// Smallest volume of an element over its volume at rest, at the start of any of the steps: below 0.1 the law went on along
    /// its tangent.
    pub least_volume_ratio: f32,
    /// Largest exponent over its cap, of the exponential law: above 1 the law went on along its tangent.
    pub saturation: f32,
    /// Kinetic energy beyond the account, as a share of the most that was ever in it; above 0 it is remarked upon.
    pub energy_excess: f32,
    /// Learned steps: the largest share of the free vertices whose prediction was clipped.
    pub clipped: f32,
    /// Learned steps: the largest share with an input outside what training has seen.
    pub outside: f32,
    /// Large steps: mean over the nodes of the inertia added, in masses of the node.
    pub added_mass: f32,
    /// Large steps: most nodes that were held back in a step.
    pub held_back: u32,
    /// Large steps with a lattice: the least share of its motion that was used in a step; below 0.5 it is remarked upon.
    pub lattice_share: f32,
    /// Large steps: estimate of the error so far, m, mean over the nodes; it tells the scale and is no bound.
    pub error_estimate: f32,
    /// What stopped the call, with place and value; status SUPPLE_OK if nothing did.
    pub error: supple_error,
}

impl supple_report {
    pub(super) const NOTHING: Self = Self {
        time: 0.0,
        kinetic: 0.0,
        available: 0.0,
        steps: 0,
        node: SUPPLE_NONE,
        least_volume_ratio: 1.0,
        saturation: 0.0,
        energy_excess: 0.0,
        clipped: 0.0,
        outside: 0.0,
        added_mass: 0.0,
        held_back: 0,
        lattice_share: 1.0,
        error_estimate: 0.0,
        error: supple_error::NONE,
    };

    /// Enters a step; what it found if it was not taken.
    pub(super) fn enter<S>(&mut self, status: &Status, state: &State<S>) -> Answer<supple_status> {
        if let Status::Ok | Status::Limited { .. } = status {
            self.steps += 1;
            self.least_volume_ratio = self.least_volume_ratio.min(state.least_volume_ratio());
            self.saturation = self.saturation.max(state.saturation());
        }
        match *status {
            Status::Ok => Ok(SUPPLE_OK),
            Status::Limited { energy_excess, .. } => {
                self.energy_excess = self.energy_excess.max(energy_excess);
                Ok(SUPPLE_LIMITED)
            }
            Status::Diverged(Divergence { node, cause, .. }) => {
                self.node = node;
                Err(match cause {
                    Cause::NotFinite => supple_error::from(SUPPLE_E_DIVERGED).node(node),
                    Cause::Energy { kinetic, available } => {
                        supple_error::from(SUPPLE_E_DIVERGED_ENERGY).node(node).value(kinetic, available)
                    }
                })
            }
            Status::Mismatch { nodes, room } => Err(mismatch(room, nodes)),
        }
    }

    /// When it is, and the account.
    pub(super) fn close<S>(&mut self, state: &State<S>) {
        let Ledger { kinetic, peak, .. } = *state.ledger();
        (self.time, self.kinetic, self.available) = (state.time(), kinetic, peak);
    }
}

/// The worse of two remarks.
pub(super) fn worse(a: supple_status, b: supple_status) -> supple_status {
    if (b as i32) > a as i32 { b } else { a }
}

/// Takes `count` exact steps. Stops at the first that is not to be believed: that one is not taken, the state is as before it,
/// and the status tells.
///
/// @param loads what acts; NULL: nothing, supports stand still.
/// @param threads NULL: the calling thread alone.
/// @param report may be NULL; is written whatever the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_step(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    count: u32,
    threads: *const supple_threads,
    report: *mut supple_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let step = |found: &mut supple_report| unsafe {
        let any = carved(scene)?;
        let mut acting = Acting::of(loads, &any)?;
        let object = memory::change(state)?;
        belongs(object.nodes, &any)?;
        let step = step_of(object)?;
        let threads = HostThreads::of(threads)?;
        View::of(state).with(|state| {
            let answer = with_scene!(&any, scene => taken(count, count, state, &mut acting, found, |loads, state| {
                tled::step_in_parts(scene, loads, state, &step, &threads)
            }));
            found.close(state);
            answer
        })
    };
    // SAFETY: as above.
    unsafe { reported(report, step) }
}

/// Takes `count` steps, or until one is refused; motions go evenly over all `left` that the call takes.
pub(super) fn taken<'a>(
    count: u32,
    left: u32,
    state: &mut State<&'a mut [NodeVector]>,
    acting: &mut Acting<'_>,
    found: &mut supple_report,
    mut step: impl FnMut(&crate::loads::Loads<'_>, &mut State<&'a mut [NodeVector]>) -> Status,
) -> Answer<supple_status> {
    let mut worst = SUPPLE_OK;
    for done in 0..count {
        let loads = acting.next(state.displacements(), left - done);
        let status = step(&loads, state);
        worst = worse(worst, found.enter(&status, state)?);
    }
    Ok(worst)
}

/// Has `work` done, and writes what it found and what stopped it to `report`, if that is not NULL.
///
/// # Safety
/// If not NULL, `report` leads to memory for one.
pub(super) unsafe fn reported(
    report: *mut supple_report,
    work: impl FnOnce(&mut supple_report) -> Answer<supple_status>,
) -> supple_status {
    let mut found = supple_report::NOTHING;
    if report.is_null() {
        return work(&mut found).unwrap_or_else(|error| error.status);
    }
    // SAFETY: the caller's promise.
    let report = match unsafe { place_for(report) } {
        Ok(report) => report,
        Err(error) => return error.status,
    };
    let answer = work(&mut found);
    found.error = answer.err().unwrap_or(supple_error::NONE);
    // SAFETY: aligned, and there.
    unsafe { report.write(found) };
    answer.unwrap_or_else(|error| error.status)
}

/// Threads of the host, or none.
pub(super) struct HostThreads(Option<supple_threads>);

impl HostThreads {
    /// # Safety
    /// If not NULL, `threads` leads to one, whose function does as it says.
    pub(super) unsafe fn of(threads: *const supple_threads) -> Answer<Self> {
        if threads.is_null() {
            return Ok(Self(None));
        }
        // SAFETY: the caller's promise.
        let threads = *unsafe { one(threads)? };
        if threads.each.is_none() {
            return Err(SUPPLE_E_NULL.into());
        }
        Ok(Self(Some(threads)))
    }
}

/// Parts on their way to the host's threads: what to do, where, and what has been begun.
struct Errand<'a, T, F> {
    work: &'a F,
    first: *mut T,
    begun: [AtomicBool; MOST_PARTS],
    count: usize,
}

impl<T, F: Fn(&mut T)> Errand<'_, T, F> {
    fn run(&self, part: usize) {
        if self.begun.get(part).is_none_or(|begun| part >= self.count || begun.swap(true, Ordering::AcqRel)) {
            return;
        }
        // SAFETY: below the count, and nobody else has it: it was not begun before.
        (self.work)(unsafe { &mut *self.first.add(part) });
    }
}

/// # Safety
/// `work` leads to an errand.
unsafe extern "C" fn run_part<T, F: Fn(&mut T)>(work: *const c_void, part: u32) {
    // SAFETY: the caller's promise.
    if let Some(errand) = unsafe { work.cast::<Errand<'_, T, F>>().as_ref() } {
        errand.run(part as usize);
    }
}

impl Threads for HostThreads {
    fn parts(&self) -> usize {
        self.0.map_or(1, |threads| threads.parts as usize)
    }

    fn each<T: Send>(&self, parts: &mut [T], work: impl Fn(&mut T) + Sync) {
        let Some(supple_threads { context, each: Some(each), .. }) = self.0 else {
            return parts.iter_mut().for_each(work);
        };
        let count = parts.len().min(MOST_PARTS);
        let errand = Errand {
            work: &work,
            first: parts.as_mut_ptr(),
            begun: [const { AtomicBool::new(false) }; 8],
            count,
        };
        hand_out(each, context, &errand, count);
        // Nothing is lost if the host forgets a part.
        (0..count).for_each(|part| errand.run(part));
    }
}

/// Calls the host. Parts are `Send` and the work is `Sync`: they may run on its threads.
fn hand_out<T, F: Fn(&mut T)>(
    each: unsafe extern "C" fn(*mut c_void, supple_part, *const c_void, u32),
    context: *mut c_void,
    errand: &Errand<'_, T, F>,
    count: usize,
) {
    // SAFETY: what the header asks of the host: it returns when all calls have, so that the errand outlives them.
    unsafe { each(context, run_part::<T, F>, ptr::from_ref(errand).cast(), count as u32) };
}
