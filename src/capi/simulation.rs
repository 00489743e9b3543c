//! A simulation for C: scene, state, loads, instruments, steps and guard in one memory, moved on by a frame at a time
//! ([`crate::simulation`]).

use core::ffi::c_void;
use core::mem::take;
use core::ptr;

use crate::copy::copy;
use crate::guard::{EVERY, EVERY_LEARNED, vectors_at_most as guard_vectors, vectors_for};
use crate::inertia::{Cells, vectors_at_most};
use crate::learned::LearnedReport;
use crate::material::Element;
use crate::mlp::Network;
use crate::simulation::{Clock, Event, ExactSteps, LONG_STEPS, LONGEST_STEPS, Lead, Mover, usual_tolerance};
use crate::state::NodeVector;
use crate::step::{CriticalStep, Status, Step, Work};
use crate::tled::{Pace, vectors_for_pace};

use super::SUPPLE_NONE;
use super::adaptive::{self, supple_adaptive, supple_adaptive_init};
use super::contact::{CallContact, Felt, supple_contact, supple_contact_init, supple_contact_size};
use super::fibres::{fibres_of, supple_fibres_size};
use super::guard::{self, supple_estimate, supple_guard, supple_guard_config, supple_guard_init};
use super::large::{self, LargeRequest, supple_large, supple_large_config, supple_large_init};
use super::learned::{
    self, MUCH_OUTSIDE, supple_learned, supple_learned_config, supple_learned_init, supple_learned_size,
};
use super::loads::{CallLoads, supple_loads, supple_loads_init, supple_loads_size, supple_set_contact};
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, lasting_bytes, magic, one, place_for, same_abi};
use super::prony::{series_of, supple_prony_size, supple_relaxation_size};
use super::scene::{
    OpenScene, check_choice, supple_patches_size, supple_scene, supple_scene_config, supple_scene_init,
    supple_scene_size,
};
use super::state::{critical_step, opened_of, supple_state, supple_state_init, supple_state_size};
use super::status::{Answer, Quantity, negative, short, status_of, supple_error, supple_status};
use super::step::{HostThreads, Reported, answer, reported, supple_report, supple_threads, worse};
use super::surface::supple_surface;
use supple_status::*;

/// Exact steps of nine tenths of the critical step, which is looked at again while tissue stiffens.
pub const SUPPLE_STEPS_EXACT: u32 = 0;
/// Equal steps beyond the critical one, and a guard that estimates their error.
pub const SUPPLE_STEPS_LONG: u32 = 1;
/// Exact and long steps whose length keeps the error below a tolerance.
pub const SUPPLE_STEPS_AUTO: u32 = 2;
/// A lead-in of exact steps, then those of a network, with exact ones wherever energy or the guard does not believe it.
pub const SUPPLE_STEPS_LEARNED: u32 = 3;

/// How a scene is moved, and what there shall be room for. supple_default_settings fills it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_settings {
    /// sizeof(supple_settings).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// SUPPLE_STEPS_EXACT and so on.
    pub steps: u32,
    /// Length of the steps, s; 0: chosen. Of long steps at most so much, 20 critical steps unless given; of exact
    /// ones, a network's included, at most so much, nine tenths of the critical step unless given, and shorter where
    /// the critical step falls while they are taken: above the critical step of the state as it is they are refused
    /// (SUPPLE_E_UNSTABLE); of SUPPLE_STEPS_AUTO the longest, 100 critical steps unless given.
    pub seconds: f32,
    /// Damping proportional to mass, 1/s, zero or more. A network has that of its training.
    pub damping: f32,
    /// Mean error of the nodes that you accept, m; 0: chosen. What SUPPLE_STEPS_AUTO keeps, half a millimetre or less in
    /// bodies below 10 cm unless given, and what a guard calls inexact, a fifth of the motion unless given.
    pub tolerance: f32,
    /// 1: a guard estimates the error of long and of learned steps. 0: nothing does.
    pub guard: u32,
    /// 1: exact steps take the place of learned ones that are not to be believed. 0: the call stops there.
    pub fallback: u32,
    /// Seconds of exact steps before a network takes over.
    pub lead_in: f64,
    /// Cells of the lattice of long steps along x, y, z; zeros: chosen for the scene.
    pub cells: [u32; 3],
    /// The most work that a call of supple_sim_advance takes, in exact steps; a long or a learned one counts four, and
    /// is taken while any is left. 0: as much as it takes. When it is spent the call ends with SUPPLE_BEHIND, and the next goes on
    /// from there.
    pub most_steps: u32,
    /// Most forces on nodes that the loads will have.
    pub forces: u32,
    /// Most motions.
    pub motions: u32,
    /// Most nodes that instruments hold at once.
    pub grips: u32,
    /// What instruments can touch; no nodes: there are none. Copied.
    pub surface: supple_surface,
    /// Of learned steps the weight file, at a multiple of 4 bytes, better of 64. It is used where it is and must stay.
    /// Others do not read it.
    pub weights: *const c_void,
    /// Its bytes; 0 with NULL.
    pub weights_bytes: usize,
}

/// A scene in motion with all that it needs. One thread at a time. A copy by memcpy, to memory that is aligned to
/// SUPPLE_ALIGN, goes on as the original would, to the bit; it has the memory that is in use, and supple_sim_set refuses
/// steps that need more (SUPPLE_E_SHORT).
#[repr(C, align(64))]
pub struct supple_sim {
    head: Head,
    nodes: u32,
    /// Where the objects are, bytes from the beginning; zero: there is none.
    scene: usize,
    state: usize,
    loads: usize,
    contact: usize,
    /// Where the steps are.
    place_of_steps: usize,
    /// The end of all.
    end: usize,
    /// The address that the contact of the loads was set at.
    address: usize,
    clock: Clock,
    /// Of a call.
    work: Work,
    prepared: Prepared,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_sim {
    const MAGIC: [u8; 8] = magic(b'X');
    const FRONT: usize = 256;
}

/// What moves a simulation, with places of objects in its memory.
#[derive(Clone, Copy)]
enum Prepared {
    /// They were refused.
    None,
    Exact(Exact),
    Long {
        steps: usize,
        guard: usize,
    },
    Auto(usize),
    Learned {
        steps: usize,
        exact: Exact,
        lead: Lead,
        guard: usize,
    },
}

#[derive(Clone, Copy)]
struct Exact {
    pace: Pace,
    damping: f32,
    /// Where its vectors are, and how many.
    kept: usize,
    vectors: usize,
}

/// The objects of a simulation, for all functions that take them.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_sim_objects {
    /// What is simulated.
    pub scene: *const supple_scene,
    /// What moves: to be read, saved, reset, restored.
    pub state: *mut supple_state,
    /// What acts: gravity, forces and motions are set there, between two calls as you like.
    pub loads: *mut supple_loads,
    /// The instruments; NULL without a surface.
    pub contact: *mut supple_contact,
    /// The network of SUPPLE_STEPS_LEARNED, to be described or remarked upon; else NULL.
    pub learned: *const supple_learned,
    /// Of the memory that was handed to supple_sim_setup so many bytes are in use: fewer than supple_sim_size.
    pub bytes: usize,
}

impl supple_sim_objects {
    /// None yet.
    pub(super) const NONE: Self = Self {
        scene: ptr::null(),
        state: ptr::null_mut(),
        loads: ptr::null_mut(),
        contact: ptr::null_mut(),
        learned: ptr::null(),
        bytes: 0,
    };
}

/// What a call of supple_sim_advance came to.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_sim_report {
    /// As of all calls that take steps; its steps are those taken, of all kinds.
    pub call: supple_report,
    /// Exact steps taken.
    pub exact: u32,
    /// Steps beyond the critical one.
    pub long_steps: u32,
    /// Those of a network.
    pub learned: u32,
    /// Steps that were computed and not taken, or taken back.
    pub undone: u32,
    /// What is missing to the end of the call where the work was spent before it, s; else 0.
    pub missing: f64,
    /// The shortest and the longest step taken, s.
    pub shortest: f32,
    pub longest: f32,
    /// The estimate of the error at the end, by the guard or by SUPPLE_STEPS_AUTO.
    pub estimate: supple_estimate,
}

impl Reported for supple_sim_report {
    const NOTHING: Self = Self {
        call: supple_report::NOTHING,
        exact: 0,
        long_steps: 0,
        learned: 0,
        undone: 0,
        missing: 0.0,
        shortest: 0.0,
        longest: 0.0,
        estimate: guard::estimated(None),
    };

    fn error(&mut self) -> &mut supple_error {
        &mut self.call.error
    }
}

/// Writes settings for exact steps without damping, a guard and a fallback for other steps that are chosen, and no room
/// for forces, motions and instruments.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_default_settings(settings: *mut supple_settings) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let fill = || unsafe {
        place_for(settings)?.write(supple_settings {
            struct_size: size_of::<supple_settings>() as u32,
            abi: super::SUPPLE_ABI,
            steps: SUPPLE_STEPS_EXACT,
            seconds: 0.0,
            damping: 0.0,
            tolerance: 0.0,
            guard: 1,
            fallback: 1,
            lead_in: 0.3,
            cells: [0; 3],
            most_steps: 0,
            forces: 0,
            motions: 0,
            grips: 0,
            surface: supple_surface { nodes: ptr::null(), triangles: ptr::null(), node_count: 0, triangle_count: 0 },
            weights: ptr::null(),
            weights_bytes: 0,
        });
        Ok(SUPPLE_OK)
    };
    status_of(fill())
}

/// Writes how many bytes of memory are enough for a simulation. supple_sim_describe tells how many it takes.
///
/// @param body what it will be built from; of it the numbers of nodes, elements and tissues, the element and how tissues
/// relax are looked at.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_size(
    body: *const supple_scene_config,
    settings: *const supple_settings,
    bytes: *mut usize,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let size = || unsafe {
        let ((body, settings), bytes) = (given(body, settings)?, place_for(bytes)?);
        bytes.write(size_of_all(body, settings)?);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(size(), error) }
}

/// Builds a scene, at rest, with loads, instruments and steps, in `memory` of at least supple_sim_size bytes, aligned to
/// SUPPLE_ALIGN. It takes as long as some steps. What is given is copied, but for the weights.
///
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_setup(
    memory: *mut c_void,
    bytes: usize,
    body: *const supple_scene_config,
    settings: *const supple_settings,
    sim: *mut *mut supple_sim,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller: weights stay as long as the object is used.
    let setup = || unsafe {
        let ((body, settings), sim) = (given(body, settings)?, place_for(sim)?);
        let made = build(memory, bytes, body, settings).map_err(|error| match error.status {
            // So far of one of its objects alone.
            SUPPLE_E_SHORT => size_of_all(body, settings).map_or(error, |needed| short(bytes, needed)),
            _ => error,
        })?;
        sim.write(made);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(setup(), error) }
}

/// Other steps from now on, in the same memory; the motion goes on as it is. After long steps their forces are computed once
/// more, under the loads and instruments as they are, which pulls and contact then tell. To be called as well where lengths are
/// chosen, so that they fit a state that was reset, restored, or moved by other functions. What there is room for stays
/// as it was at supple_sim_setup. Where the scene itself refuses the steps (SUPPLE_E_LATTICE, SUPPLE_E_TOO_STIFF) there
/// are none until the next call.
///
/// @param error may be NULL; SUPPLE_E_SHORT: the memory is enough for the former steps only.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_set(
    sim: *mut supple_sim,
    settings: *const supple_settings,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller: weights stay as long as the object is used.
    let set = || unsafe {
        let settings = one(settings)?;
        settings.check()?;
        prepare(sim, settings)?;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Writes where the objects of a simulation are. They stay there as long as it does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_describe(sim: *mut supple_sim, objects: *mut supple_sim_objects) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let describe = || unsafe {
        let objects = place_for(objects)?;
        objects.write(objects_of(sim)?);
        Ok(SUPPLE_OK)
    };
    status_of(describe())
}

/// Moves on by `seconds`, usually a frame, under the loads and instruments, and ends there to a millionth of it; learned
/// steps end at the nearest of the network's. A span shorter than a sixteenth of the last step is left to the next call.
/// Motions without a ramp go evenly over the call. Where a step is refused the status says why, and the state is that
/// before it; the next call begins there and is no longer for it.
///
/// @param threads NULL: the calling thread alone.
/// @param report may be NULL; is written whatever the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_advance(
    sim: *mut supple_sim,
    seconds: f64,
    threads: *const supple_threads,
    report: *mut supple_sim_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let advance = |report: &mut supple_sim_report| unsafe {
        let objects = objects_of(sim)?;
        if !(seconds.is_finite() && seconds > 0.0) {
            return Err(supple_error::from(SUPPLE_E_NEGATIVE).value(seconds, 0.0));
        }
        let open = OpenScene::of(objects.scene)?;
        let mut loads = CallLoads::of(objects.loads, &open)?;
        let threads = HostThreads::of(threads)?;
        let mut state = loads.attached(opened_of(&open, objects.state)?);
        let CallLoads { of_call, contact, .. } = &mut loads;
        let supple_sim { clock, prepared, work, .. } = &mut *sim;
        let until = clock.end_of_call(state.time(), seconds);
        let mut watched = Watched { call: supple_report::NOTHING, contact, mark: None };
        let mover = prepared.mover(sim)?;
        let taken = mover.advance(until, open.view(), of_call, state.reborrow(), *work, &threads, &mut |event| {
            watched.enter(&event);
        });
        clock.ended(state.time(), taken.as_ref().map_or(Status::Ok, |report| report.status));
        let call = watched.call;
        *report = supple_sim_report { call, ..supple_sim_report::NOTHING };
        report.call.close(&state);
        let taken = taken?;
        report.call.steps = taken.steps();
        (report.exact, report.long_steps, report.learned) = (taken.exact, taken.long, taken.learned);
        report.undone = taken.undone;
        [report.shortest, report.longest] = taken.seconds;
        report.estimate = guard::estimated(taken.estimate);
        if let Status::Behind { seconds } = taken.status {
            report.missing = seconds;
        }
        let remark = answer(&taken.status)?;
        let outside = if call.outside > MUCH_OUTSIDE { SUPPLE_OUTSIDE } else { SUPPLE_OK };
        let fell_back = if taken.fell_back { SUPPLE_FELL_BACK } else { SUPPLE_OK };
        Ok(worse(remark, worse(outside, fell_back)))
    };
    // SAFETY: as above.
    unsafe { reported(report, advance) }
}

impl supple_settings {
    /// What can be said without a scene.
    pub(super) fn check(&self) -> Answer<()> {
        same_abi::<Self>(self.struct_size, self.abi)?;
        let none = SUPPLE_NONE as usize;
        check_choice(none, self.steps, SUPPLE_STEPS_LEARNED)?;
        check_choice(none, self.guard, 1)?;
        check_choice(none, self.fallback, 1)?;
        for (quantity, value) in [(Quantity::Tolerance, f64::from(self.tolerance)), (Quantity::Time, self.lead_in)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(negative(quantity, value));
            }
        }
        // A length of zero is none that is given.
        Step::unchecked(if self.seconds == 0.0 { 1.0 } else { self.seconds }, self.damping)?;
        Ok(())
    }

    fn given_seconds(&self) -> Option<f32> {
        (self.seconds != 0.0).then_some(self.seconds)
    }

    fn is_guarded(&self) -> bool {
        self.guard == 1 && matches!(self.steps, SUPPLE_STEPS_LONG | SUPPLE_STEPS_LEARNED)
    }

    /// Of long steps whose longest has so many seconds.
    fn large(&self, seconds: f32) -> supple_large_config {
        supple_large_config {
            struct_size: size_of::<supple_large_config>() as u32,
            abi: self.abi,
            seconds,
            damping: self.damping,
            cells: self.cells,
        }
    }

    const fn learned(&self) -> supple_learned_config {
        let Self { fallback, weights, weights_bytes, .. } = *self;
        let struct_size = size_of::<supple_learned_config>() as u32;
        supple_learned_config { struct_size, abi: self.abi, fallback, reserved: 0, weights, weights_bytes }
    }
}

/// What a simulation is made from, checked as far as it can be without a scene.
///
/// # Safety
/// If not NULL, both lead to such a structure.
unsafe fn given<'a>(
    body: *const supple_scene_config,
    settings: *const supple_settings,
) -> Answer<(&'a supple_scene_config, &'a supple_settings)> {
    // SAFETY: the caller's promise.
    let (body, settings) = unsafe { (one(body)?, one(settings)?) };
    settings.check()?;
    same_abi::<supple_scene_config>(body.struct_size, body.abi)?;
    Ok((body, settings))
}

/// Never less than what the objects take.
///
/// # Safety
/// As at [`supple_sim_size`].
unsafe fn size_of_all(body: &supple_scene_config, settings: &supple_settings) -> Answer<usize> {
    let &supple_scene_config { nodes, elements, tissues, .. } = body;
    // SAFETY: the caller's promise.
    let ((series, terms), (fibres, _)) = unsafe { (series_of(body)?, fibres_of(body)?) };
    let remembered = supple_relaxation_size(nodes, elements, tissues, body.element, terms as u32);
    let of_memory = remembered / size_of::<NodeVector>();
    let element = Element::of_code(body.element).unwrap_or_default();
    let patches = if element.is_nodal_strain() { supple_patches_size(nodes, elements, tissues) } else { 0 };
    let surface = &settings.surface;
    let contact = match surface.node_count {
        0 => 0,
        count => supple_contact_size(count, surface.triangle_count, settings.grips),
    };
    let (node_count, element_count) = (nodes as usize, elements as usize);
    let cells = if settings.cells == [0; 3] { Cells::Suggested } else { Cells::Given(settings.cells) };
    let of_method = vectors_at_most(element, node_count, element_count, cells);
    let of_guard = guard_vectors(element, node_count, element_count).saturating_add(of_memory);
    let of_pace = vectors_for_pace(node_count, of_memory);
    let arrays = |count| Layout::of::<supple_sim>().and::<NodeVector>(count).bytes();
    let steps = match settings.steps {
        SUPPLE_STEPS_EXACT => arrays(of_pace),
        SUPPLE_STEPS_LONG => large::layout(of_method).bytes(),
        SUPPLE_STEPS_AUTO => adaptive::layout(of_pace.saturating_add(of_method).saturating_add(of_guard)).bytes(),
        _ => supple_learned_size(nodes, settings.fallback).saturating_add(arrays(of_pace)),
    };
    let guard = if settings.is_guarded() { guard::layout(of_guard).bytes() } else { 0 };
    let sizes = [
        layout(nodes).bytes(),
        supple_scene_size(nodes, elements, tissues),
        if series.is_empty() { 0 } else { supple_prony_size(tissues) },
        if fibres.is_empty() { 0 } else { supple_fibres_size(nodes, elements, tissues, body.element) },
        patches,
        supple_state_size(nodes, body.element),
        remembered,
        supple_loads_size(settings.forces, settings.motions),
        contact,
        steps,
        guard,
    ];
    // Patches end anywhere.
    Ok(sizes.into_iter().fold(memory::SUPPLE_ALIGN, usize::saturating_add))
}

/// The front, and the points of the scene at rest.
fn layout(nodes: u32) -> Layout {
    Layout::of::<supple_sim>().and::<[f32; 3]>(nodes as usize)
}

/// Memory for one object after the other.
struct Room {
    start: *mut u8,
    used: usize,
    bytes: usize,
}

impl Room {
    /// Prepares an object behind the others, if it is wanted. Gives its place.
    ///
    /// # Safety
    /// `init` writes the pointer to the object of so many bytes that it prepares in the memory that it is given.
    unsafe fn take<T: Object>(
        &mut self,
        init: impl FnOnce(*mut c_void, usize, *mut *mut T, *mut supple_error) -> supple_status,
    ) -> Answer<usize> {
        let (mut made, mut error) = (ptr::null_mut(), supple_error::NONE);
        let place = self.used;
        // SAFETY: within the memory.
        let here = unsafe { self.start.add(place) };
        let status = init(here.cast(), self.bytes.saturating_sub(place), &raw mut made, &raw mut error);
        if (status as i32) < 0 {
            // Some functions tell no more than the status.
            return Err(if error.status == SUPPLE_OK { status.into() } else { error });
        }
        // SAFETY: it is an object now.
        self.used += unsafe { memory::bytes_of(made) };
        Ok(place)
    }

    /// So many vectors behind the others. Gives their place.
    fn vectors(&mut self, count: usize) -> Answer<usize> {
        let place = self.used;
        let end = place + (count * size_of::<NodeVector>()).next_multiple_of(memory::SUPPLE_ALIGN);
        if end > self.bytes {
            return Err(short(self.bytes, end));
        }
        self.used = end;
        Ok(place)
    }
}

/// # Safety
/// As at [`supple_sim_setup`].
unsafe fn build(
    memory: *mut c_void,
    bytes: usize,
    body: &supple_scene_config,
    settings: &supple_settings,
) -> Answer<*mut supple_sim> {
    // SAFETY: the caller's promise; each object is prepared in memory of its own.
    unsafe {
        let nodes = body.nodes;
        let given = array(body.points.cast::<[f32; 3]>(), nodes as usize)?;
        let front = layout(nodes);
        let place = Place::new(memory, bytes, front)?;
        copy(place.arrays::<supple_sim>().change::<[f32; 3]>(given.len()), given);
        let start = place.object::<supple_sim>().cast::<u8>();
        let points = given.as_ptr().cast::<f32>();
        let mut room = Room { start, used: front.bytes(), bytes };
        let at = |place: usize| start.add(place);
        let scene = room.take(|memory, bytes, made, error| supple_scene_init(memory, bytes, body, made, error))?;
        let scene_object = at(scene).cast::<supple_scene>().cast_const();
        let state = room.take(|memory, bytes, made, _| supple_state_init(memory, bytes, scene_object, made))?;
        let &supple_settings { forces, motions, grips, surface, .. } = settings;
        let loads =
            room.take(|memory, bytes, made, _| supple_loads_init(memory, bytes, scene_object, forces, motions, made))?;
        let mut contact = 0;
        if surface.node_count > 0 {
            contact = room.take(|memory, bytes, made, error| {
                supple_contact_init(memory, bytes, scene_object, points, &raw const surface, grips, made, error)
            })?;
            match supple_set_contact(at(loads).cast(), at(contact).cast()) {
                SUPPLE_OK => {}
                refused => return Err(refused.into()),
            }
        }
        let (place_of_steps, end, address) = (room.used, room.used, start.addr());
        let (clock, work, prepared) = (Clock::default(), Work::UNBOUNDED, Prepared::None);
        let sim = place.put(|head| supple_sim {
            head: head.of_bytes(bytes),
            nodes,
            scene,
            state,
            loads,
            contact,
            place_of_steps,
            end,
            address,
            clock,
            work,
            prepared,
        });
        if let Err(error) = prepare(sim, settings) {
            // From now on the memory holds none.
            place.arrays::<supple_sim>();
            return Err(error);
        }
        Ok(sim)
    }
}

impl supple_sim {
    pub(super) const fn clock(&self) -> Clock {
        self.clock
    }

    pub(super) const fn set_clock(&mut self, clock: Clock) {
        self.clock = clock;
    }
}

/// Lets the steps go on as they are with other constants of the tissues, which `change` sets: exact ones look at the
/// critical step again, long ones compute their inertia anew. Those that choose their length are refused first.
///
/// # Safety
/// As at [`supple_sim_set`]; `change` leaves the steps alone.
pub(super) unsafe fn keep_steps(sim: *mut supple_sim, change: impl FnOnce() -> Answer<()>) -> Answer<()> {
    // SAFETY: the caller's promise; objects lie where they were put.
    unsafe {
        match &mut (*sim).prepared {
            Prepared::None => return Err(SUPPLE_E_NO_STEP.into()),
            Prepared::Auto(_) => return Err(SUPPLE_E_NULL.into()),
            Prepared::Exact(exact) | Prepared::Learned { exact, .. } => {
                change()?;
                exact.pace.look_soon();
            }
            Prepared::Long { steps, .. } => {
                let (model, _) = large::opened(sim.cast::<u8>().add(*steps).cast())?;
                change()?;
                model.renew_soon();
            }
        }
        Ok(())
    }
}

/// The points of its scene at rest, m.
///
/// # Safety
/// As at [`memory::read`]; it is a simulation.
pub(super) unsafe fn points_of<'a>(sim: *const supple_sim) -> &'a [[f32; 3]] {
    // SAFETY: the caller's promise.
    unsafe { Arrays::behind(sim).read((*sim).nodes as usize) }
}

/// The objects.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn objects_of(sim: *mut supple_sim) -> Answer<supple_sim_objects> {
    // SAFETY: the caller's promise; objects lie where they were put.
    unsafe {
        memory::is(sim.cast_const())?;
        let at = |place: usize| sim.cast::<u8>().add(place);
        let &supple_sim { scene, state, loads, contact, end, address, ref prepared, .. } = &*sim;
        let learned = match prepared {
            Prepared::Learned { steps, .. } => at(*steps).cast::<supple_learned>().cast_const(),
            _ => ptr::null(),
        };
        let objects = supple_sim_objects {
            scene: at(scene).cast::<supple_scene>().cast_const(),
            state: at(state).cast(),
            loads: at(loads).cast(),
            contact: if contact > 0 { at(contact).cast() } else { ptr::null_mut() },
            learned,
            bytes: end,
        };
        if address != sim.addr() {
            // A copy has instruments of its own.
            let loads = memory::change(objects.loads)?;
            if contact > 0 && loads.contact().addr() == address + contact {
                loads.set_contact(objects.contact);
            }
            // Of how much memory there is behind it nothing is known.
            ((*sim).head, (*sim).address) = ((*sim).head.of_bytes(end), sim.addr());
        }
        Ok(objects)
    }
}

/// Prepares the steps.
///
/// # Safety
/// As at [`supple_sim_set`].
pub(super) unsafe fn prepare(sim: *mut supple_sim, settings: &supple_settings) -> Answer<()> {
    // SAFETY: the caller's promise.
    unsafe {
        let supple_sim_objects { scene, state, .. } = objects_of(sim)?;
        let points = Arrays::behind(sim.cast_const()).read::<[f32; 3]>((*sim).nodes as usize);
        let open = OpenScene::of(scene)?;
        let critical = critical_step(&open, &mut opened_of(&open, state)?)?;
        let needed = needed(settings, critical, &open, points)?;
        let (steps, bytes) = ((*sim).place_of_steps, memory::bytes_of(sim.cast_const()));
        if bytes.saturating_sub(steps) < needed {
            return Err(short(bytes, steps + needed));
        }
        if settings.steps != SUPPLE_STEPS_LONG {
            end_long_steps(sim, &open, critical)?;
        }
        let mut room = Room { start: sim.cast(), used: steps, bytes };
        (*sim).prepared = Prepared::None;
        let of_pace = vectors_for_pace(points.len(), open.view().memory_vectors());
        let made = made(settings, critical, &mut room, (scene, state), points, of_pace)?;
        ((*sim).prepared, (*sim).end) = (made, room.used);
        (*sim).work = if settings.most_steps == 0 { Work::UNBOUNDED } else { Work::of(settings.most_steps) };
        Ok(())
    }
}

/// Lets the velocities be those at the time of the state, where long steps have brought it there.
///
/// # Safety
/// As at [`supple_sim_set`].
unsafe fn end_long_steps(sim: *mut supple_sim, open: &OpenScene<'_>, critical: CriticalStep) -> Answer<()> {
    // SAFETY: the caller's promise.
    unsafe {
        let objects = objects_of(sim)?;
        let mut loads = CallLoads::of(objects.loads, open)?;
        let mut state = loads.attached(opened_of(open, objects.state)?);
        if let Ok(mover) = (*sim).prepared.mover(sim) {
            // The calling thread alone; steps of its kind would be compiled a second time.
            let threads = HostThreads::of(ptr::null())?;
            mover.end_long_steps(critical.seconds, open.view(), &mut loads.of_call, state.reborrow(), &threads);
        }
        state.end_long_steps(critical);
        Ok(())
    }
}

/// The length of long steps, s.
fn seconds_of(settings: &supple_settings, critical: CriticalStep) -> f32 {
    let multiple = if settings.steps == SUPPLE_STEPS_AUTO { LONGEST_STEPS } else { LONG_STEPS };
    settings.given_seconds().unwrap_or(multiple * critical.seconds)
}

/// Bytes that the steps take; what is wrong with them is told before anything is changed.
///
/// # Safety
/// As at [`supple_sim_set`].
unsafe fn needed(
    settings: &supple_settings,
    critical: CriticalStep,
    open: &OpenScene<'_>,
    points: &[[f32; 3]],
) -> Answer<usize> {
    let nodes = points.len();
    // SAFETY: the caller's promise.
    unsafe {
        let large = settings.large(seconds_of(settings, critical));
        let long = || LargeRequest::of(open, points.as_ptr().cast(), &raw const large);
        let pace = vectors_for_pace(nodes, open.view().memory_vectors()) * size_of::<NodeVector>();
        let exact = |damping| Pace::of(settings.given_seconds(), damping, critical).map(|_| pace);
        let steps = match settings.steps {
            SUPPLE_STEPS_EXACT => exact(settings.damping)?,
            SUPPLE_STEPS_LONG => large::layout(long()?.vectors).bytes(),
            SUPPLE_STEPS_AUTO => adaptive::layout(adaptive::vectors_of(open, &long()?)?).bytes(),
            _ => {
                let network = Network::parse(lasting_bytes(settings.weights, settings.weights_bytes)?)?;
                supple_learned_size(nodes as u32, settings.fallback) + exact(network.recipe().damping)?
            }
        };
        let guard = match settings.is_guarded() {
            true => guard::layout(vectors_for(open.view(), points)?).bytes(),
            false => 0,
        };
        Ok(steps.next_multiple_of(memory::SUPPLE_ALIGN) + guard)
    }
}

/// The steps, in memory that is enough.
///
/// # Safety
/// As at [`supple_sim_set`].
unsafe fn made(
    settings: &supple_settings,
    critical: CriticalStep,
    room: &mut Room,
    (scene, state): (*const supple_scene, *mut supple_state),
    points: &[[f32; 3]],
    of_pace: usize,
) -> Answer<Prepared> {
    let seconds = seconds_of(settings, critical);
    let first = points.as_ptr().cast::<f32>();
    // SAFETY: the caller's promise.
    unsafe {
        let large = settings.large(seconds);
        let exact = |room: &mut Room, damping| {
            let pace = Pace::of(settings.given_seconds(), damping, critical)?;
            Ok::<_, supple_error>(Exact { pace, damping, kept: room.vectors(of_pace)?, vectors: of_pace })
        };
        let guarded = |room: &mut Room, seconds, damping, every| {
            if !settings.is_guarded() {
                return Ok(0);
            }
            let (struct_size, tolerance) = (size_of::<supple_guard_config>() as u32, settings.tolerance);
            let config = supple_guard_config { struct_size, abi: settings.abi, seconds, damping, every, tolerance };
            room.take::<supple_guard>(|memory, bytes, made, error| {
                supple_guard_init(memory, bytes, scene, state, first, &raw const config, made, error)
            })
        };
        Ok(match settings.steps {
            SUPPLE_STEPS_EXACT => Prepared::Exact(exact(room, settings.damping)?),
            SUPPLE_STEPS_LONG => Prepared::Long {
                steps: room.take::<supple_large>(|memory, bytes, made, error| {
                    supple_large_init(memory, bytes, scene, state, first, &raw const large, made, error)
                })?,
                guard: guarded(room, seconds, settings.damping, EVERY)?,
            },
            SUPPLE_STEPS_AUTO => {
                let given = settings.tolerance;
                let tolerance = if given > 0.0 { given } else { usual_tolerance(points) };
                Prepared::Auto(room.take::<supple_adaptive>(|memory, bytes, made, error| {
                    supple_adaptive_init(memory, bytes, scene, state, first, &raw const large, tolerance, made, error)
                })?)
            }
            _ => {
                let config = settings.learned();
                let steps = room.take::<supple_learned>(|memory, bytes, made, error| {
                    supple_learned_init(memory, bytes, scene, &raw const config, made, error)
                })?;
                let network = learned::opened(room.start.add(steps).cast())?;
                let (seconds, damping) = (network.model().seconds(), network.model().network().recipe().damping);
                let lead = Lead::new(network.model().intervals(settings.lead_in));
                let exact = exact(room, damping)?;
                Prepared::Learned { steps, exact, lead, guard: guarded(room, seconds, damping, EVERY_LEARNED)? }
            }
        })
    }
}

impl Prepared {
    /// The same, ready to move.
    ///
    /// # Safety
    /// They are those of this simulation, and nobody else uses its steps.
    unsafe fn mover<'a>(&'a mut self, sim: *mut supple_sim) -> Answer<Mover<'a, 'static>> {
        // SAFETY: the caller's promise; objects lie where they were put.
        unsafe {
            let at = |place: usize| sim.cast::<u8>().add(place);
            let exact = |Exact { pace, damping, kept, vectors }: &'a mut Exact| {
                let kept = core::slice::from_raw_parts_mut(at(*kept).cast::<NodeVector>(), *vectors);
                ExactSteps::Paced { pace, kept, damping: *damping }
            };
            let guarded = |place: usize| if place > 0 { guard::opened(at(place).cast()).map(Some) } else { Ok(None) };
            Ok(match self {
                Self::None => return Err(SUPPLE_E_NO_STEP.into()),
                Self::Exact(steps) => Mover::Exact(exact(steps)),
                Self::Long { steps, guard } => {
                    let (model, storage) = large::opened(at(*steps).cast())?;
                    Mover::Long(model, storage, guarded(*guard)?)
                }
                Self::Auto(steps) => Mover::Auto(adaptive::opened(at(*steps).cast())?),
                Self::Learned { steps, exact: steps_between, lead, guard } => {
                    let network = learned::opened(at(*steps).cast())?;
                    Mover::Learned(network, exact(steps_between), lead, guarded(*guard)?)
                }
            })
        }
    }
}

/// What is known of a call while it goes on.
struct Watched<'c, 'a> {
    call: supple_report,
    contact: &'c mut Option<CallContact<'a>>,
    /// Before steps that may be taken back.
    mark: Option<(supple_report, Felt)>,
}

impl Watched<'_, '_> {
    fn enter(&mut self, event: &Event<'_>) {
        let call = &mut self.call;
        match *event {
            Event::Tries(_) => {
                let felt = self.contact.as_ref().map_or_else(Felt::default, CallContact::felt);
                self.mark = Some((*call, felt));
            }
            Event::TakenBack => {
                if let Some((before, felt)) = take(&mut self.mark) {
                    *call = before;
                    if let Some(contact) = self.contact {
                        contact.take_back(&felt);
                    }
                }
            }
            Event::Predicts(_) | Event::Judged(..) => {}
            Event::Predicted(LearnedReport { clipped, outside, .. }) => {
                call.clipped = call.clipped.max(clipped);
                call.outside = call.outside.max(outside);
            }
            Event::Raised(ref report) => {
                call.added_mass = report.added_mean;
                call.held_back = call.held_back.max(report.held_back);
                call.lattice_share = call.lattice_share.min(report.coarse_share);
            }
            Event::Step(_, status, state) => {
                if let Some(contact) = self.contact {
                    contact.enter(state.touches());
                }
                call.enter(&status, state);
            }
        }
    }
}
