//! The exact step for C, on the calling thread or on threads of the host.

use core::ffi::c_void;
use core::ptr;
use core::sync::atomic::{AtomicBool, Ordering};

use crate::loads::Loads;
use crate::state::{Progress, StateView};
use crate::step::{Cause, Divergence, EnergyBalance, MOST_PARTS, Status, Threads};
use crate::tled;

use super::SUPPLE_NONE;
use super::loads::{CallLoads, supple_loads};
use super::memory::{self, one, place_for};
use super::scene::{OpenScene, supple_scene};
use super::state::{opened_of, supple_state};
use super::status::{Answer, mismatch, supple_error, supple_status};
use supple_status::*;

/// Most parts of a step.
pub const SUPPLE_MOST_PARTS: u32 = 8;
const _: () = assert!(SUPPLE_MOST_PARTS as usize == MOST_PARTS);

/// Computes part `part` of what `work` stands for. It may be called from any thread, once for each part; a second call
/// for the same part does nothing.
pub type supple_part = unsafe extern "C" fn(work: *const c_void, part: u32);

/// Threads of the host. A step calls `each` two to four times: it shall call `part(work, p)` for every `p` below
/// `parts`, on whichever threads, at the same time or not, and return when all those calls have. Parts share nothing,
/// and the result does not depend on where they run, to the bit. What `each` leaves out is computed when it has
/// returned. It must return: no exception and no longjmp may leave it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_threads {
    /// Handed to `each`.
    pub context: *mut c_void,
    /// Parts that a step shall be cut into; there will be SUPPLE_MOST_PARTS at most, and fewer if the scene is small.
    pub parts: u32,
    /// See above.
    pub each: Option<unsafe extern "C" fn(context: *mut c_void, part: supple_part, work: *const c_void, parts: u32)>,
}

/// What became of the steps of a call, and what stopped it. Every call that takes steps writes all of it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_report {
    /// Simulated time at the end, s; of a step that was not taken, at its start; zero, and all else as if there had
    /// been no step, if the call was refused before its first.
    pub time: f64,
    /// Kinetic energy at the latest step, J.
    pub kinetic: f64,
    /// The most energy that loads and supports ever gave, J.
    pub available: f64,
    /// Steps taken by this call.
    pub steps: u32,
    /// The node at which a step diverged, else SUPPLE_NONE.
    pub node: u32,
    /// Smallest volume of an element over its volume at rest, at the start of any of the steps: below 0.1 the law went
    /// on along its tangent.
    pub least_volume_ratio: f32,
    /// Largest exponent over its cap, of the exponential law: above 1 the law went on along its tangent.
    pub saturation: f32,
    /// Kinetic energy beyond the energy balance, as a share of the most that was ever in it; above 0 it is remarked
    /// upon.
    pub energy_excess: f32,
    /// Learned steps: the largest share of the free vertices whose prediction was clipped.
    pub clipped: f32,
    /// Learned steps: the largest share with an input outside what training has seen.
    pub outside: f32,
    /// Long steps: mean over the nodes of the inertia added, in masses of the node.
    pub added_mass: f32,
    /// Long steps: most nodes that were held back in a step. Exact steps: pulls that are held back at the end of the call, or have been in
    /// the 128 steps before, if it was for more than five steps in a row.
    pub held_back: u32,
    /// Long steps: the least share of the lattice's motion that was used in a step; below 0.5 it is
    /// remarked upon.
    pub lattice_share: f32,
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
        error: supple_error::NONE,
    };

    /// Enters a step.
    pub(super) fn enter(&mut self, status: &Status, progress: &Progress) {
        if status.is_taken() {
            self.steps += 1;
            self.least_volume_ratio = self.least_volume_ratio.min(progress.least_volume_ratio());
            self.saturation = self.saturation.max(progress.saturation());
        }
        match *status {
            Status::Limited { energy_excess, .. } => {
                self.energy_excess = self.energy_excess.max(energy_excess);
            }
            Status::Diverged(Divergence { node, .. }) => self.node = node,
            _ => {}
        }
    }

    /// Time and energy at the end of the call.
    pub(super) fn close(&mut self, progress: &Progress) {
        let EnergyBalance { kinetic, peak, .. } = *progress.energy_balance();
        (self.time, self.kinetic, self.available) = (progress.time(), kinetic, peak);
        self.held_back = self.held_back.max(progress.pulls_held_back());
    }
}

/// The status of a step for C, or why it was not taken.
pub(super) fn answer(status: &Status) -> Answer<supple_status> {
    match *status {
        Status::Ok => Ok(SUPPLE_OK),
        Status::Limited { .. } => Ok(SUPPLE_LIMITED),
        Status::Inexact { .. } => Ok(SUPPLE_INEXACT),
        Status::Behind { .. } => Ok(SUPPLE_BEHIND),
        Status::Diverged(Divergence { node, cause, .. }) => Err(match cause {
            Cause::NotFinite => supple_error::from(SUPPLE_E_DIVERGED).node(node),
            Cause::Instrument { index, metre, most } => {
                supple_error::from(SUPPLE_E_DIVERGED_INSTRUMENT).at(index).node(node).value(metre.into(), most.into())
            }
            Cause::NoContact => SUPPLE_E_NO_CONTACT.into(),
            Cause::NoPulls => SUPPLE_E_NO_PULLS.into(),
            Cause::NoRelaxation | Cause::NoFibres => SUPPLE_E_NO_RELAXATION.into(),
            Cause::Energy { kinetic, available } => {
                supple_error::from(SUPPLE_E_DIVERGED_ENERGY).node(node).value(kinetic, available)
            }
            Cause::Force { index, newton, size } => {
                supple_error::from(SUPPLE_E_DIVERGED_FORCE).at(index).node(node).value(newton.into(), size.into())
            }
            Cause::Pressure { surface, pascal, size } => {
                supple_error::from(SUPPLE_E_DIVERGED_PRESSURE).at(surface).node(node).value(pascal.into(), size.into())
            }
            Cause::Motion { metre, size } => {
                supple_error::from(SUPPLE_E_DIVERGED_MOTION).node(node).value(metre.into(), size.into())
            }
        }),
        Status::Mismatch { nodes, room } => Err(mismatch(room, nodes)),
    }
}

/// The worse of two remarks.
pub(super) fn worse(a: supple_status, b: supple_status) -> supple_status {
    if (b as i32) > a as i32 { b } else { a }
}

/// Takes `count` exact steps. Stops at the first that is not to be believed: that one is not taken, the state is as
/// before it, and the status tells.
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
    let step = |report: &mut supple_report| unsafe {
        let open = OpenScene::of(scene)?;
        let mut loads = CallLoads::of(loads, &open)?;
        open.fits(memory::read(state.cast_const())?.nodes)?;
        let step = (*state).step()?;
        let threads = HostThreads::of(threads)?;
        let mut state = loads.attached(opened_of(&open, state)?);
        let count = count.into();
        let status = take_steps(count, count, &mut state, &mut loads, report, |loads, state| {
            tled::step_in_parts(open.view(), loads, state, &step, &threads)
        });
        report.close(&state);
        answer(&status)
    };
    // SAFETY: as above.
    unsafe { reported(report, step) }
}

/// Takes `count` steps, or until one is refused; motions go evenly over all `left` that the call still takes. Gives the
/// worst status.
pub(super) fn take_steps(
    count: u64,
    left: u64,
    state: &mut StateView<'_>,
    loads: &mut CallLoads<'_>,
    report: &mut supple_report,
    mut step: impl FnMut(&Loads<'_>, StateView<'_>) -> Status,
) -> Status {
    let mut worst = Status::Ok;
    for done in 0..count {
        let status = step(&loads.of_next_step(state, left - done), state.reborrow());
        loads.enter(state.touches());
        report.enter(&status, state);
        match status {
            Status::Ok => {}
            taken if taken.is_taken() => worst = taken,
            refused => return refused,
        }
    }
    worst.at_end(state)
}

/// A report of a call that takes steps.
pub(super) trait Reported {
    /// Of a call that took none.
    const NOTHING: Self;

    /// What stopped the call.
    fn error(&mut self) -> &mut supple_error;
}

impl Reported for supple_report {
    const NOTHING: Self = Self::NOTHING;

    fn error(&mut self) -> &mut supple_error {
        &mut self.error
    }
}

/// Does `work`, and writes its report, with what stopped it, to `report`, if that is not NULL.
///
/// # Safety
/// If not NULL, `report` leads to memory for one.
pub(super) unsafe fn reported<R: Reported>(
    report: *mut R,
    work: impl FnOnce(&mut R) -> Answer<supple_status>,
) -> supple_status {
    let mut written = R::NOTHING;
    if report.is_null() {
        return work(&mut written).unwrap_or_else(|error| error.status);
    }
    // SAFETY: the caller's promise.
    let report = match unsafe { place_for(report) } {
        Ok(report) => report,
        Err(error) => return error.status,
    };
    let answer = work(&mut written);
    *written.error() = answer.err().unwrap_or(supple_error::NONE);
    // SAFETY: aligned, and there.
    unsafe { report.write(written) };
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

/// Parts that threads of the host compute: the work, where the parts are, and which have been begun.
struct SharedParts<'a, T, F> {
    work: &'a F,
    first: *mut T,
    begun: [AtomicBool; MOST_PARTS],
    count: usize,
}

impl<T, F: Fn(&mut T)> SharedParts<'_, T, F> {
    fn run(&self, part: usize) {
        if self.begun.get(part).is_none_or(|begun| part >= self.count || begun.swap(true, Ordering::AcqRel)) {
            return;
        }
        // SAFETY: below the count, and nobody else has it: it was not begun before.
        (self.work)(unsafe { &mut *self.first.add(part) });
    }
}

/// # Safety
/// `work` leads to shared parts of these types.
unsafe extern "C" fn run_part<T, F: Fn(&mut T)>(work: *const c_void, part: u32) {
    // SAFETY: the caller's promise.
    if let Some(shared) = unsafe { work.cast::<SharedParts<'_, T, F>>().as_ref() } {
        shared.run(part as usize);
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
        let shared = SharedParts {
            work: &work,
            first: parts.as_mut_ptr(),
            begun: [const { AtomicBool::new(false) }; MOST_PARTS],
            count,
        };
        call_host(each, context, &shared, count);
        // Nothing is lost if the host forgets a part.
        (0..count).for_each(|part| shared.run(part));
    }
}

/// Calls the host. Parts are `Send` and the work is `Sync`: they may run on its threads.
fn call_host<T, F: Fn(&mut T)>(
    each: unsafe extern "C" fn(*mut c_void, supple_part, *const c_void, u32),
    context: *mut c_void,
    shared: &SharedParts<'_, T, F>,
    count: usize,
) {
    // SAFETY: what the header asks of the host: it returns when all calls have, so that the parts outlive them.
    unsafe { each(context, run_part::<T, F>, ptr::from_ref(shared).cast(), count as u32) };
}
