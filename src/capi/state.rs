//! What moves, for C: displacements, their last increments, forces, time, and the step that moves them.

use core::ffi::c_void;

use crate::material::Element;
use crate::state::{NodeVector, Progress, StateView};
use crate::step::{CriticalStep, Step};
use crate::tled;

use super::memory::{self, Arrays, Head, Layout, Object, Place, magic, one, place_for, place_if_wanted, same_abi};
use super::scene::{OpenScene, supple_scene};
use super::status::{Answer, mismatch, status_of, supple_error, supple_status};
use supple_status::*;

/// What moves. One thread at a time. It may be copied with memcpy, to any memory aligned to SUPPLE_ALIGN, and the copy
/// goes on as the original would, to the bit.
#[repr(C, align(64))]
pub struct supple_state {
    head: Head,
    pub(super) nodes: u32,
    /// Of the scene that it was prepared for.
    element: Element,
    /// Vectors of what tissue remembers, both copies, and a checksum of the tables that they belong to.
    remembered: u32,
    tables: u32,
    /// Of the step; zero without one.
    step_seconds: f32,
    step_damping: f32,
    pub(super) progress: Progress,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_state {
    const MAGIC: [u8; 8] = magic(b'M');
    const FRONT: usize = 192;
}

/// Bytes before the arrays of a state.
pub const SUPPLE_STATE_FRONT: usize = 192;
const _: () = assert!(SUPPLE_STATE_FRONT == <supple_state as Object>::FRONT);

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
    /// Damping proportional to mass, 1/s, zero or more. Learned steps use it as well; a supple_large has its own, in
    /// supple_large_config.
    pub damping: f32,
}

/// Volume ratios of the nodes, or weights for the critical step, which linear elements do not need.
const fn volumes(nodes: u32, element: Element) -> usize {
    match element {
        Element::Linear => 0,
        _ => nodes as usize,
    }
}

/// With room for so many vectors of what tissue remembers.
fn layout(nodes: u32, element: Element, remembered: usize) -> Layout {
    let volumes = volumes(nodes, element);
    let nodes = nodes as usize;
    Layout::of::<supple_state>()
        .and::<NodeVector>(nodes)
        .and::<NodeVector>(nodes)
        .and::<NodeVector>(nodes)
        .and::<NodeVector>(nodes)
        .and::<NodeVector>(volumes)
        .and::<NodeVector>(remembered)
}

/// Bytes of memory that the state of so many nodes needs; zero for an element that there is not. SUPPLE_STATE_SIZE is
/// the same as a constant. With tissue that relaxes it needs supple_relaxation_size bytes more.
///
/// @param element of the scene: SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
#[unsafe(no_mangle)]
pub extern "C" fn supple_state_size(nodes: u32, element: u32) -> usize {
    Element::of_code(element).map_or(0, |element| layout(nodes, element, 0).bytes())
}

/// Prepares the state of a scene, at rest, in `memory` of at least supple_state_size bytes, with tissue that relaxes and
/// supple_relaxation_size, aligned to SUPPLE_ALIGN.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    state: *mut *mut supple_state,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let init = || unsafe {
        let (open, state) = (OpenScene::of(scene)?, place_for(state)?);
        let nodes = open.node_count() as u32;
        let element = open.element();
        let [room, remembered] = open.remembers();
        let place = Place::new(memory, bytes, layout(nodes, element, room))?;
        let mut progress = Progress::START;
        let tables = open.view().memory_checksum();
        view(place.arrays::<supple_state>(), nodes, element, remembered, &mut progress).reset();
        state.write(place.put(|head| supple_state {
            head,
            nodes,
            element,
            remembered: remembered as u32,
            tables,
            step_seconds: 0.0,
            step_damping: 0.0,
            progress,
        }));
        Ok(SUPPLE_OK)
    };
    status_of(init())
}

/// Puts a state back to rest at time zero; tissue that relaxes remembers nothing. Its step stays. The first step of a supple_large computes its inertia anew;
/// a supple_learned needs supple_learned_reset and a new lead-in.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_reset(state: *mut supple_state) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let reset = || unsafe {
        opened(state)?.reset();
        Ok(SUPPLE_OK)
    };
    status_of(reset())
}

/// Stops all motion: nodes, time and what tissue remembers stay as they are, velocities are zero, and the energy balance
/// begins with the strain energy. To go on after SUPPLE_E_DIVERGED_ENERGY from a state that was not saved before. A supple_learned
/// needs a new lead-in.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_stop(scene: *const supple_scene, state: *mut supple_state) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let stop = || unsafe {
        let open = OpenScene::of(scene)?;
        let mut state = opened_of(&open, state)?;
        let has_room = tled::stop(&open.view(), &mut state);
        if has_room { Ok(SUPPLE_OK) } else { Err(mismatch(state.capacity(), open.node_count())) }
    };
    status_of(stop())
}

/// Writes a bound on the stable step at the state's displacements, s: never above the exact limit. It takes as long as
/// some six steps, with nodal pressure some twenty, with nodal strain some thirty; tissue that is deformed is stiffer,
/// so ask again from time to time.
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
        let open = OpenScene::of(scene)?;
        let mut state = opened_of(&open, state)?;
        let (seconds, node) = (place_for(seconds)?, place_if_wanted(node)?);
        let critical = critical_step(&open, &mut state)?;
        seconds.write(critical.seconds);
        if let Some(node) = node {
            node.write(critical.node);
        }
        Ok(SUPPLE_OK)
    };
    status_of(find())
}

pub(super) fn critical_step(open: &OpenScene<'_>, state: &mut StateView<'_>) -> Answer<CriticalStep> {
    let critical = tled::critical_step(&open.view(), state);
    critical.ok_or_else(|| {
        let error = supple_error::from(SUPPLE_E_TOO_STIFF);
        open.stiffest(state.reborrow()).map_or(error, |node| error.node(node))
    })
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
        let (open, config) = (OpenScene::of(scene)?, *one(config)?);
        same_abi::<supple_step_config>(config.struct_size, config.abi)?;
        let mut view = opened_of(&open, state)?;
        // What is no step at all is told before anything is computed.
        Step::unchecked(config.seconds, config.damping)?;
        let critical = critical_step(&open, &mut view)?;
        let step = Step::new(config.seconds, config.damping, critical)?;
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
        let progress = &memory::read(state)?.progress;
        let (seconds, steps) = (place_if_wanted(seconds)?, place_if_wanted(steps)?);
        if let Some(seconds) = seconds {
            seconds.write(progress.time());
        }
        if let Some(steps) = steps {
            steps.write(progress.steps());
        }
        Ok(SUPPLE_OK)
    };
    status_of(tell())
}

impl supple_state {
    /// The step that was set.
    pub(super) fn step(&self) -> Answer<Step> {
        if self.step_seconds > 0.0 {
            Ok(Step::unchecked(self.step_seconds, self.step_damping)?)
        } else {
            Err(SUPPLE_E_NO_STEP.into())
        }
    }

    pub(super) fn set_step(&mut self, step: Option<Step>) {
        [self.step_seconds, self.step_damping] = step.map_or([0.0; 2], |step| [step.seconds(), step.damping()]);
    }

    /// Bytes of what tissue remembers, one copy.
    pub(super) const fn remembered_bytes(&self) -> usize {
        self.remembered as usize / 2 * size_of::<NodeVector>()
    }
}

/// Makes room for what the tissue of another scene remembers: it stays where it is in the same tables, else nothing has
/// been deformed so far.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn remember_in(open: &OpenScene<'_>, object: *mut supple_state) -> Answer<()> {
    // SAFETY: the caller's promise.
    unsafe {
        fits(open, object)?;
        let &supple_state { nodes, element, remembered, tables, .. } = &*object;
        let ([_, needed], checksum) = (open.remembers(), open.view().memory_checksum());
        if needed == remembered as usize && checksum == tables {
            return Ok(());
        }
        let room = memory::bytes_of(object.cast_const()).saturating_sub(layout(nodes, element, 0).bytes());
        if needed * size_of::<NodeVector>() > room {
            return Err(other_tissue(room, needed * size_of::<NodeVector>()));
        }
        ((*object).remembered, (*object).tables) = (needed as u32, checksum);
        opened(object)?.forget();
        Ok(())
    }
}

/// The state has so many bytes for what tissue remembers.
fn other_tissue(bytes: usize, needed: usize) -> supple_error {
    supple_error::from(SUPPLE_E_NO_RELAXATION).value(bytes as f64, needed as f64)
}

/// # Safety
/// The arrays are those of a state of so many nodes, and nobody else uses them.
unsafe fn view<'a>(
    mut arrays: Arrays,
    nodes: u32,
    element: Element,
    remembered: usize,
    progress: &'a mut Progress,
) -> StateView<'a> {
    // SAFETY: the caller's promise. Any bits are vectors.
    let [displacements, remainders, increments, forces] = [(); 4].map(|()| unsafe { arrays.change(nodes as usize) });
    // SAFETY: as above.
    let (volumes, memory) = unsafe { (arrays.change(volumes(nodes, element)), arrays.change(remembered)) };
    StateView::new(displacements, remainders, increments, forces, volumes, progress).remembering(memory)
}

/// The state in an object, whose other fields may be used meanwhile.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn opened<'a>(object: *mut supple_state) -> Answer<StateView<'a>> {
    // SAFETY: the caller's promise.
    unsafe {
        memory::is(object.cast_const())?;
        let (nodes, element, remembered) = ((*object).nodes, (*object).element, (*object).remembered as usize);
        Ok(view(Arrays::behind(object.cast_const()), nodes, element, remembered, &mut (*object).progress))
    }
}

/// The same, of a state that was prepared for a scene of these nodes and elements, whose tissue remembers as much.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn opened_of<'a>(open: &OpenScene<'_>, object: *mut supple_state) -> Answer<StateView<'a>> {
    // SAFETY: the caller's promise.
    unsafe {
        fits(open, object)?;
        let (remembered, [_, needed]) = ((*object).remembered as usize, open.remembers());
        if remembered != needed {
            return Err(other_tissue(remembered * size_of::<NodeVector>(), needed * size_of::<NodeVector>()));
        }
        opened(object)
    }
}

/// That a state was prepared for a scene of these nodes and elements.
///
/// # Safety
/// As at [`memory::read`].
unsafe fn fits(open: &OpenScene<'_>, object: *const supple_state) -> Answer<()> {
    // SAFETY: the caller's promise.
    let &supple_state { nodes, element, .. } = unsafe { memory::read(object)? };
    open.fits(nodes)?;
    if element != open.element() {
        let (own, scene) = (f64::from(element.code()), f64::from(open.element().code()));
        return Err(supple_error::from(SUPPLE_E_ELEMENT).value(own, scene));
    }
    Ok(())
}

/// Displacements, their remainders, increments and forces of a state.
///
/// # Safety
/// As at [`memory::read`].
pub(super) unsafe fn vectors<'a>(object: *const supple_state) -> Answer<[&'a [NodeVector]; 4]> {
    // SAFETY: the caller's promise.
    unsafe {
        let nodes = memory::read(object)?.nodes as usize;
        let mut arrays = Arrays::behind(object);
        Ok([(); 4].map(|()| arrays.read(nodes)))
    }
}

/// What tissue remembers at the moment of a state.
///
/// # Safety
/// As at [`memory::read`].
pub(super) unsafe fn remembered<'a>(object: *const supple_state) -> Answer<&'a [NodeVector]> {
    // SAFETY: the caller's promise.
    unsafe {
        let &supple_state { nodes, element, remembered, ref progress, .. } = memory::read(object)?;
        let mut arrays = Arrays::behind(object);
        for count in [nodes as usize, nodes as usize, nodes as usize, nodes as usize, volumes(nodes, element)] {
            arrays.read::<NodeVector>(count);
        }
        let all = arrays.read::<NodeVector>(remembered as usize);
        let (first, second) = all.split_at(all.len() / 2);
        Ok(if progress.second { second } else { first })
    }
}
