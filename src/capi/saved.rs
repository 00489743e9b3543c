//! A state as bytes that may lie in a file: little endian, with a version and a checksum.

use core::ffi::c_void;
use core::{ptr, slice};

use bytemuck::{Pod, Zeroable, bytes_of, must_cast_slice};

use crate::copy::copy;
use crate::state::{MOVED_VECTORS, NodeVector, Progress};
use crate::step::{EnergyBalance, EnergyCycle, Step};

use super::memory::{self, array, place_for};
use super::state::{supple_state, vectors};
use super::status::{Answer, mismatch, short, status_of, supple_error, supple_status};
use super::vectors::overlap;
use supple_status::*;

const MAGIC: [u8; 8] = *b"SUPPLE-M";
const VERSION: u32 = 3;

/// Before displacements, their remainders and increments, four floats each.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Front {
    magic: [u8; 8],
    version: u32,
    /// CRC-32 of all that follows.
    checksum: u32,
    nodes: u32,
    /// That the increments span, s.
    last_step: f32,
    /// Zero without a step.
    step_seconds: f32,
    step_damping: f32,
    time: f64,
    steps: u64,
    energy_balance: [f64; 8],
    energy_cycle: [f64; 4],
}

/// Of the front's bytes those that the checksum covers begin here.
const CHECKED: usize = 16;
const FRONT: usize = size_of::<Front>();

/// Bytes that a saved state of so many nodes has.
#[unsafe(no_mangle)]
pub extern "C" fn supple_saved_size(nodes: u32) -> usize {
    (nodes as usize)
        .checked_mul(MOVED_VECTORS * size_of::<NodeVector>())
        .and_then(|bytes| bytes.checked_add(FRONT))
        .unwrap_or(0)
}

/// Saves a state with its step to `to`, at any address.
///
/// @param bytes room there: supple_saved_size at least.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_save(state: *const supple_state, to: *mut c_void, bytes: usize) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let save = || unsafe {
        let object = memory::read(state)?;
        let to = place_for(to.cast::<u8>())?;
        let needed = supple_saved_size(object.nodes);
        if bytes < needed {
            return Err(short(bytes, needed));
        }
        if overlap(state.cast(), memory::bytes_of(state), to.cast(), needed) {
            return Err(supple_error::from(SUPPLE_E_OVERLAP));
        }
        let progress = &object.progress;
        let EnergyBalance { start, work, dissipated, corrected, kinetic, uncertainty, peak, heat, cycle } =
            *progress.energy_balance();
        let step = object.step().ok();
        let mut front = Front {
            magic: MAGIC,
            version: VERSION,
            checksum: 0,
            nodes: object.nodes,
            last_step: progress.last_step(),
            step_seconds: step.map_or(0.0, |step| step.seconds()),
            step_damping: step.map_or(0.0, |step| step.damping()),
            time: progress.time(),
            steps: progress.steps(),
            energy_balance: [start, work, dissipated, corrected, kinetic, uncertainty, peak, heat],
            energy_cycle: [cycle.next.into(), cycle.strain, cycle.kinetic, cycle.work],
        };
        let to = slice::from_raw_parts_mut(to, needed);
        let [displacements, remainders, increments, _] = vectors(state)?;
        let (first, rest) = to.split_at_mut_checked(FRONT).ok_or(short(bytes, needed))?;
        let places = rest.chunks_exact_mut(size_of_val(displacements).max(1));
        for (place, vectors) in places.zip([displacements, remainders, increments]) {
            copy(place, must_cast_slice(vectors));
        }
        front.checksum = checksum(&front, rest);
        copy(first, bytes_of(&front));
        Ok(SUPPLE_OK)
    };
    status_of(save())
}

/// Restores a saved state, from any address, into one prepared for the same scene: with exact steps it goes on as the
/// saved one would have, to the bit; with nodal strain unless an element was crushed within the last 16 steps, which
/// the restored state may see some steps sooner. Forces are zero until the next step. A saved state with a time, a
/// displacement or an increment that is not finite, or with a time before the start, is refused: SUPPLE_E_NOT_FINITE.
/// The first step of a supple_large computes its inertia anew, and a supple_learned needs a new lead-in; for the same
/// bits with these, copy their objects with memcpy as well.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_restore(state: *mut supple_state, from: *const c_void, bytes: usize) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let restore = || unsafe {
        let nodes = memory::change(state)?.nodes;
        let from = array(from.cast::<u8>(), bytes)?;
        let (first, rest) = from.split_at_checked(FRONT).ok_or(short(bytes, FRONT))?;
        let front = ptr::read_unaligned(first.as_ptr().cast::<Front>());
        if front.magic != MAGIC {
            return Err(SUPPLE_E_NOT_SAVED.into());
        }
        if front.version != VERSION {
            return Err(supple_error::from(SUPPLE_E_SAVED_VERSION).value(front.version.into(), VERSION.into()));
        }
        if front.nodes != nodes {
            return Err(mismatch(front.nodes as usize, nodes as usize));
        }
        let needed = supple_saved_size(nodes);
        let rest = rest.get(..needed - FRONT).ok_or(short(bytes, needed))?;
        if checksum(&front, rest) != front.checksum {
            return Err(SUPPLE_E_SAVED_CHECKSUM.into());
        }
        check_finite(&front, rest)?;
        let (object, mut arrays) = memory::open(state)?;
        let Front { time, steps, last_step, step_seconds, step_damping, .. } = front;
        let [start, work, dissipated, corrected, kinetic, uncertainty, peak, heat] = front.energy_balance;
        let [next, strain, largest, of_cycle] = front.energy_cycle;
        let cycle = EnergyCycle { next: next as u32, strain, kinetic: largest, work: of_cycle };
        let energy_balance =
            EnergyBalance { start, work, dissipated, corrected, kinetic, uncertainty, peak, heat, cycle };
        object.progress = Progress::resumed(time, steps, last_step, energy_balance);
        object.set_step(Step::unchecked(step_seconds, step_damping).ok());
        let mut vectors = |bytes: &[u8]| {
            let vectors = arrays.change::<NodeVector>(nodes as usize);
            for (vector, bytes) in vectors.iter_mut().zip(bytes.as_chunks().0) {
                *vector = bytemuck::pod_read_unaligned::<NodeVector>(bytes as &[u8; 16]);
            }
            vectors
        };
        for saved in rest.chunks_exact((rest.len() / MOVED_VECTORS).max(1)) {
            vectors(saved);
        }
        vectors(&[]).fill(NodeVector::ZERO);
        Ok(SUPPLE_OK)
    };
    status_of(restore())
}

/// That a step can have left these numbers. Others have been made, with the right checksum.
fn check_finite(front: &Front, rest: &[u8]) -> Answer<()> {
    let (components, _) = rest.as_chunks::<4>();
    // The fourth of each vector is padding.
    let three = |vector: &[[u8; 4]]| vector.iter().take(3).all(|&bytes| f32::from_le_bytes(bytes).is_finite());
    let vectors = components.chunks(4).all(three);
    let length = front.last_step.is_finite() && front.last_step >= 0.0;
    let time = front.time.is_finite() && front.time >= 0.0;
    if vectors && length && time { Ok(()) } else { Err(SUPPLE_E_NOT_FINITE.into()) }
}

fn checksum(front: &Front, rest: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(bytes_of(front).get(CHECKED..).unwrap_or_default());
    hasher.update(rest);
    hasher.finalize()
}
