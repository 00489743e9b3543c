//! To rest, and from displacements of the host's, for C ([`crate::tled::settle`]).

use core::ffi::c_void;
use core::slice;

use crate::state::NodeVector;
use crate::tled::{DisplacementError, SettleError, Settled, displace, settle_in_parts, vectors_to_settle};

use super::loads::{CallLoads, supple_loads};
use super::memory::{self, SUPPLE_ALIGN, array};
use super::scene::{OpenScene, supple_scene};
use super::simulation::{supple_sim, supple_sim_describe, supple_sim_objects};
use super::state::{opened_of, supple_state};
use super::status::{Answer, mismatch, short, supple_error, supple_status};
use super::step::{HostThreads, Reported, answer, reported, supple_threads, worse};
use supple_status::*;

/// What supple_settle came to.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_settled {
    /// The estimate of the largest distance of a node from where it rests, m; infinite before the body has swung once.
    pub remaining: f32,
    /// Steps that were computed.
    pub steps: u32,
    /// What stopped the call; status SUPPLE_OK if nothing did.
    pub error: supple_error,
}

impl Reported for supple_settled {
    const NOTHING: Self = Self { remaining: f32::INFINITY, steps: 0, error: supple_error::NONE };

    fn error(&mut self) -> &mut supple_error {
        &mut self.error
    }
}

impl From<SettleError> for supple_error {
    fn from(error: SettleError) -> Self {
        let bytes = |vectors: usize| vectors.saturating_mul(size_of::<NodeVector>());
        match error {
            SettleError::Metre { metre } => Self::from(SUPPLE_E_NEGATIVE).value(metre.into(), 0.0),
            SettleError::Capacity { needed, capacity } => short(bytes(capacity), bytes(needed)),
            SettleError::NotFinite => SUPPLE_E_TOO_STIFF.into(),
        }
    }
}

impl From<DisplacementError> for supple_error {
    fn from(error: DisplacementError) -> Self {
        match error {
            DisplacementError::Count { given, nodes } => mismatch(given, nodes),
            DisplacementError::Room { nodes, room } => mismatch(room, nodes),
            DisplacementError::NotFinite { node, value } => {
                Self::from(SUPPLE_E_NOT_FINITE).at(node as usize).node(node).value(value.into(), 0.0)
            }
        }
    }
}

/// Bytes of memory that supple_settle needs for a scene of so many nodes. SUPPLE_SETTLE_SIZE is the same as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_settle_size(nodes: u32) -> usize {
    vectors_to_settle(nodes as usize).saturating_mul(size_of::<NodeVector>())
}

/// Brings a body to rest: every node to within about `metre` of where it rests under these loads.
/// Loads and instruments act as at the time of the state, which stands still: ramps do not go on, motions without a ramp
/// go to where they are asked for, and tissue that relaxes has had the time. Velocities are zero afterwards, and the energy balance begins with the strain energy.
/// Steps of every kind go on from there; a guard begins anew.
///
/// SUPPLE_BEHIND: the body is not at rest after `most_steps`, or never can be, because no support holds it. The report
/// tells how much is missing, and another call goes on from there. Where a step is refused the status says why, and the
/// body stands where the steps before have brought it.
///
/// @param metre m, above zero.
/// @param most_steps at least one is taken; each takes about as long as an exact one.
/// @param threads NULL: the calling thread alone.
/// @param memory at least supple_settle_size bytes, aligned to SUPPLE_ALIGN, for the call alone.
/// @param settled may be NULL; is written whatever the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_settle(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    metre: f32,
    most_steps: u32,
    threads: *const supple_threads,
    memory: *mut c_void,
    bytes: usize,
    settled: *mut supple_settled,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let settle = |report: &mut supple_settled| unsafe {
        let open = OpenScene::of(scene)?;
        let mut loads = CallLoads::of(loads, &open)?;
        let threads = HostThreads::of(threads)?;
        let mut state = loads.attached(opened_of(&open, state)?);
        let room = scratch(memory, bytes, supple_settle_size(open.node_count() as u32))?;
        let (of_call, view) = (&mut loads.of_call, state.reborrow());
        let Settled { at_rest, remaining, steps, status } =
            settle_in_parts(open.view(), of_call, view, metre, most_steps, room, &threads)?;
        loads.enter(state.touches());
        (report.remaining, report.steps) = (remaining, steps);
        let remark = answer(&status)?;
        Ok(worse(remark, if at_rest { SUPPLE_OK } else { SUPPLE_BEHIND }))
    };
    // SAFETY: as above.
    unsafe { reported(settled, settle) }
}

/// The same of a simulation, under its loads and instruments: see supple_settle.
///
/// @param metre m, above zero.
/// @param most_steps at least one is taken; each takes about as long as an exact one.
/// @param threads NULL: the calling thread alone.
/// @param memory at least supple_settle_size bytes, aligned to SUPPLE_ALIGN, for the call alone.
/// @param settled may be NULL; is written whatever the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_settle(
    sim: *mut supple_sim,
    metre: f32,
    most_steps: u32,
    threads: *const supple_threads,
    memory: *mut c_void,
    bytes: usize,
    settled: *mut supple_settled,
) -> supple_status {
    let mut objects = supple_sim_objects::NONE;
    // SAFETY: what the header asks of the caller.
    unsafe {
        match supple_sim_describe(sim, &raw mut objects) {
            SUPPLE_OK => {
                let supple_sim_objects { scene, state, loads, .. } = objects;
                supple_settle(scene, loads, state, metre, most_steps, threads, memory, bytes, settled)
            }
            refused => reported(settled, |_: &mut supple_settled| Err(refused.into())),
        }
    }
}

/// Puts the nodes at displacements of yours, at a stop: velocities are zero, time stays, and the energy balance begins
/// with the strain energy. It counts as a step. What tissue that relaxes remembers stays. Fixed nodes keep what is given,
/// moved ones until a motion moves them. Of a simulation call supple_sim_set afterwards, so that the lengths of steps fit.
///
/// @param displacements three components of each of `nodes` nodes, m, from rest.
/// @param nodes must be that of the scene.
/// @param error may be NULL; index and node are those of a displacement that is not finite. Nothing has changed then.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_displacements(
    scene: *const supple_scene,
    state: *mut supple_state,
    displacements: *const f32,
    nodes: u32,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let open = OpenScene::of(scene)?;
        let given = array(displacements.cast::<[f32; 3]>(), nodes as usize)?;
        let mut state = opened_of(&open, state)?;
        displace(&open.view(), &mut state, given)?;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Memory of the caller for a call.
///
/// # Safety
/// If not NULL, `memory` is that of `bytes` bytes which nobody else uses meanwhile.
unsafe fn scratch<'a>(memory: *mut c_void, bytes: usize, needed: usize) -> Answer<&'a mut [NodeVector]> {
    if memory.is_null() {
        return Err(SUPPLE_E_NULL.into());
    }
    if memory.cast::<u8>().align_offset(SUPPLE_ALIGN) != 0 {
        return Err(SUPPLE_E_MISALIGNED.into());
    }
    if bytes < needed {
        return Err(short(bytes, needed));
    }
    let count = needed / size_of::<NodeVector>();
    // SAFETY: aligned, and long enough. Written before it is read: any bits are vectors.
    unsafe {
        memory.cast::<NodeVector>().write_bytes(0, count);
        Ok(slice::from_raw_parts_mut(memory.cast::<NodeVector>(), count))
    }
}
