//! A state as bytes that may lie in a file: little endian, with a version and a checksum.

use core::ffi::c_void;
use core::{ptr, slice};

use bytemuck::{Pod, Zeroable, bytes_of, must_cast_slice};

use crate::checksum::crc_32_of;
use crate::copy::copy;
use crate::state::{MOVED_VECTORS, NodeVector, Progress};
use crate::step::{EnergyBalance, EnergyCycle, Step};

use super::memory::{self, array, place_for};
use super::state::{opened, remembered, supple_state, vectors};
use super::status::{Answer, mismatch, short, status_of, supple_error, supple_status};
use super::vectors::overlap;
use supple_status::*;

const MAGIC: [u8; 8] = *b"SUPPLE-M";
const VERSION: u32 = 3;
/// Of tissue that relaxes.
const VERSION_THAT_REMEMBERS: u32 = 4;

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

/// Behind the vectors, before what tissue that relaxes remembers.
#[derive(Clone, Copy, Default, Pod, Zeroable)]
#[repr(C)]
struct Remembered {
    /// Of that.
    bytes: u64,
    /// How long before the state it is, s.
    half: f32,
    padding: u32,
}

const REMEMBERED: usize = size_of::<Remembered>();

/// Of the front's bytes those that the checksum covers begin here.
const CHECKED: usize = 16;
const FRONT: usize = size_of::<Front>();

/// Bytes that a saved state of so many nodes has. With tissue that relaxes it has more: supple_state_saved_size.
#[unsafe(no_mangle)]
pub extern "C" fn supple_saved_size(nodes: u32) -> usize {
    (nodes as usize)
        .checked_mul(MOVED_VECTORS * size_of::<NodeVector>())
        .and_then(|bytes| bytes.checked_add(FRONT))
        .unwrap_or(0)
}

/// Writes how many bytes a state has when it is saved.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_saved_size(state: *const supple_state, bytes: *mut usize) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let size = || unsafe {
        place_for(bytes)?.write(saved_size(memory::read(state)?));
        Ok(SUPPLE_OK)
    };
    status_of(size())
}

fn saved_size(object: &supple_state) -> usize {
    let vectors = supple_saved_size(object.nodes);
    match object.remembered_bytes() {
        0 => vectors,
        remembered => vectors.saturating_add(REMEMBERED + remembered),
    }
}

/// Saves a state with its step to `to`, at any address.
///
/// @param bytes room there: supple_state_saved_size at least, which is supple_saved_size where no tissue relaxes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_save(state: *const supple_state, to: *mut c_void, bytes: usize) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let save = || unsafe {
        let object = memory::read(state)?;
        let to = place_for(to.cast::<u8>())?;
        let needed = saved_size(object);
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
            version: if object.remembered_bytes() > 0 { VERSION_THAT_REMEMBERS } else { VERSION },
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
        let of_vector = size_of_val(displacements);
        let (moved, of_past) = rest.split_at_mut_checked(MOVED_VECTORS * of_vector).ok_or(short(bytes, needed))?;
        let places = moved.chunks_exact_mut(of_vector.max(1));
        for (place, vectors) in places.zip([displacements, remainders, increments]) {
            copy(place, must_cast_slice(vectors));
        }
        if let Some((front, place)) = of_past.split_at_mut_checked(REMEMBERED) {
            let past = Remembered { bytes: object.remembered_bytes() as u64, half: progress.half, padding: 0 };
            copy(front, bytes_of(&past));
            copy(place, must_cast_slice(remembered(state)?));
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
/// displacement or an increment that is not finite, or with a time before the start, is refused: SUPPLE_E_NOT_FINITE. So
/// is one of a scene whose tissue remembers more or less: SUPPLE_E_MISMATCH.
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
        let newest = VERSION_THAT_REMEMBERS;
        if !(VERSION..=newest).contains(&front.version) {
            return Err(supple_error::from(SUPPLE_E_SAVED_VERSION).value(front.version.into(), newest.into()));
        }
        if front.nodes != nodes {
            return Err(mismatch(front.nodes as usize, nodes as usize));
        }
        let moved = supple_saved_size(nodes) - FRONT;
        let past = match rest.get(moved..).and_then(|rest| rest.first_chunk::<REMEMBERED>()) {
            _ if front.version == VERSION => Remembered::default(),
            Some(past) => bytemuck::pod_read_unaligned(past),
            None => return Err(short(bytes, FRONT + moved + REMEMBERED)),
        };
        let object = memory::read(state.cast_const())?;
        if past.bytes != object.remembered_bytes() as u64 {
            return Err(mismatch(past.bytes as usize, object.remembered_bytes()));
        }
        let needed = saved_size(object);
        let rest = rest.get(..needed - FRONT).ok_or(short(bytes, needed))?;
        if checksum(&front, rest) != front.checksum {
            return Err(SUPPLE_E_SAVED_CHECKSUM.into());
        }
        let (rest, of_past) = rest.split_at_checked(moved).ok_or(short(bytes, needed))?;
        let remembered = of_past.get(REMEMBERED..).unwrap_or_default();
        check_finite(&front, rest, &past, remembered)?;
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
        if !remembered.is_empty() {
            let mut opened = opened(state)?;
            opened.progress.half = past.half;
            let [now, _] = opened.copies_of_memory();
            for (vector, bytes) in now.iter_mut().zip(remembered.as_chunks().0) {
                *vector = bytemuck::pod_read_unaligned::<NodeVector>(bytes as &[u8; 16]);
            }
        }
        Ok(SUPPLE_OK)
    };
    status_of(restore())
}

/// That a step can have left these numbers. Others have been made, with the right checksum.
fn check_finite(front: &Front, rest: &[u8], past: &Remembered, remembered: &[u8]) -> Answer<()> {
    let (components, _) = rest.as_chunks::<4>();
    // The fourth of each vector is padding.
    let three = |vector: &[[u8; 4]]| vector.iter().take(3).all(|&bytes| f32::from_le_bytes(bytes).is_finite());
    let vectors = components.chunks(4).all(three);
    let length = front.last_step.is_finite() && front.last_step >= 0.0;
    let time = front.time.is_finite() && front.time >= 0.0;
    let remembers = remembered.as_chunks().0.iter().all(|&bytes| f32::from_le_bytes(bytes).is_finite());
    let remembers = remembers && past.half.is_finite() && past.half >= 0.0;
    if vectors && length && time && remembers { Ok(()) } else { Err(SUPPLE_E_NOT_FINITE.into()) }
}

fn checksum(front: &Front, rest: &[u8]) -> u32 {
    crc_32_of([bytes_of(front).get(CHECKED..).unwrap_or_default(), rest])
}
