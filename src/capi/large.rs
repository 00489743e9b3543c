//! Steps beyond the critical one for C: mass-scaled, multilevel, damped.

use core::ffi::c_void;

use crate::inertia::{
    Core, Damper, LatticeNode, Storage, damped_numbers_for, damped_vectors_for, lattice_functions,
    numbers_for, suggested_damped_lattice, suggested_lattice, vectors_for,
};
use crate::mlp::Network;
use crate::state::NodeVector;
use crate::tled::{Status, Step};

use super::SUPPLE_NONE;
use super::loads::{Acting, belongs, supple_loads};
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, one, place_for, same_abi};
use super::scene::{AnyScene, carved, check_choice, supple_scene, with_scene};
use super::state::{View, supple_state};
use super::status::{Answer, supple_error, supple_status};
use super::step::{reported, supple_report, taken};
use supple_status::*;

/// Inertia is raised where the step would be unstable.
pub const SUPPLE_MASS_SCALED: u32 = 0;
/// The same, and smooth motion keeps its true inertia through a coarse lattice.
pub const SUPPLE_MULTILEVEL: u32 = 1;
/// The same, and a small network damps what the lattice does not carry. From 20 times the critical step on the most exact.
pub const SUPPLE_DAMPED: u32 = 2;

/// Points that a lattice may have.
pub const SUPPLE_LATTICE_POINTS: u32 = 1024;
/// Functions that a lattice may have.
pub const SUPPLE_LATTICE_FUNCTIONS: u32 = 128;
const _: () = assert!(SUPPLE_LATTICE_POINTS as usize == crate::inertia::MAX_POINTS);
const _: () = assert!(SUPPLE_LATTICE_FUNCTIONS as usize == crate::inertia::MAX_FUNCTIONS);

/// What large steps need.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_large_config {
    /// sizeof(supple_large_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// SUPPLE_MASS_SCALED, SUPPLE_MULTILEVEL or SUPPLE_DAMPED.
    pub method: u32,
    /// Length of a step, s.
    pub seconds: f32,
    /// Damping proportional to mass, 1/s, zero or more.
    pub damping: f32,
    /// Cells of the lattice along x, y, z; zeros: chosen for the scene. Not used by SUPPLE_MASS_SCALED.
    pub cells: [u32; 3],
    /// For SUPPLE_DAMPED the weight file of a damper, at a multiple of 4 bytes. It is used where it is and must stay. NULL otherwise.
    pub weights: *const c_void,
    /// Its bytes.
    pub weights_bytes: usize,
}

/// Inertia for steps of one length, computed anew a little in each step. One thread at a time. It may be copied with memcpy
/// together with its state.
#[repr(C, align(64))]
pub struct supple_large {
    head: Head,
    nodes: u32,
    sizes: Sizes,
    damper: Option<Damper<'static>>,
    core: Core,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_large {
    const MAGIC: [u8; 8] = magic(b'I');
    const FRONT: usize = 40960;
}

/// Bytes before the arrays of large steps.
pub const SUPPLE_LARGE_FRONT: usize = 40960;
const _: () = assert!(SUPPLE_LARGE_FRONT == <supple_large as Object>::FRONT);

/// Entries of the storage.
#[derive(Clone, Copy)]
struct Sizes {
    cells: [u32; 3],
    vectors: usize,
    places: usize,
    numbers: usize,
}

impl Sizes {
    fn of(scene: &AnyScene<'_>, points: &[[f32; 3]], config: &supple_large_config) -> Answer<Self> {
        let nodes = with_scene!(scene, scene => scene.node_count());
        let damped = config.method == SUPPLE_DAMPED;
        let vectors = match config.method {
            SUPPLE_MASS_SCALED => {
                return Ok(Self { cells: [0; 3], vectors: vectors_for(nodes), places: 0, numbers: 0 });
            }
            SUPPLE_MULTILEVEL => vectors_for(nodes),
            _ => damped_vectors_for(nodes),
        };
        let (cells, functions) = if config.cells == [0; 3] {
            with_scene!(scene, scene => {
                if damped { suggested_damped_lattice(scene, points) } else { suggested_lattice(scene, points) }
            })
        } else {
            let cells = config.cells;
            (cells, with_scene!(scene, scene => lattice_functions(scene, points, cells)?))
        };
        let numbers = if damped { damped_numbers_for } else { numbers_for };
        Ok(Self { cells, vectors, places: nodes, numbers: numbers(cells, functions) })
    }

    fn layout(&self) -> Layout {
        let Self { vectors, places, numbers, .. } = *self;
        Layout::of::<supple_large>().and::<NodeVector>(vectors).and::<LatticeNode>(places).and::<f32>(numbers)
    }
}

/// A configuration that makes sense, and the scene's points.
///
/// # Safety
/// As at [`supple_large_size`].
unsafe fn checked<'a>(
    any: &AnyScene<'_>,
    points: *const f32,
    config: *const supple_large_config,
) -> Answer<(&'a [[f32; 3]], &'a supple_large_config, Sizes)> {
    // SAFETY: the caller's promise.
    unsafe {
        let config = one(config)?;
        same_abi::<supple_large_config>(config.struct_size, config.abi)?;
        check_choice(SUPPLE_NONE as usize, config.method, SUPPLE_DAMPED)?;
        let nodes = with_scene!(any, scene => scene.node_count());
        let points = array(points.cast::<[f32; 3]>(), nodes)?;
        Ok((points, config, Sizes::of(any, points, config)?))
    }
}

/// Writes how many bytes of memory large steps of a scene need; it depends on the lattice. For cells that you give SUPPLE_LARGE_SIZE is
/// never less.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_large_size(
    scene: *const supple_scene,
    points: *const f32,
    config: *const supple_large_config,
    bytes: *mut usize,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let size = || unsafe {
        let (any, bytes) = (carved(scene)?, place_for(bytes)?);
        let (_, _, sizes) = checked(&any, points, config)?;
        bytes.write(sizes.layout().bytes());
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(size(), error) }
}

/// Prepares large steps from the state as it is, in `memory` of at least supple_large_size bytes, aligned to SUPPLE_ALIGN. It
/// takes as long as some steps.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_large_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    state: *mut supple_state,
    points: *const f32,
    config: *const supple_large_config,
    large: *mut *mut supple_large,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller: weights stay as long as the object is used.
    let init = || unsafe {
        let (any, large) = (carved(scene)?, place_for(large)?);
        belongs(memory::change(state)?.nodes, &any)?;
        let (points, config, sizes) = checked(&any, points, config)?;
        let damper = if config.method == SUPPLE_DAMPED {
            if config.weights.is_null() {
                return Err(SUPPLE_E_NULL.into());
            }
            let weights: &'static [u8] = array(config.weights.cast(), config.weights_bytes)?;
            Some(Damper::over(Network::parse(weights)?)?)
        } else {
            None
        };
        let step = Step::insist(config.seconds, config.damping)?;
        let place = Place::new(memory, bytes, sizes.layout())?;
        let nodes = with_scene!(&any, scene => scene.node_count() as u32);
        let core = if damper.is_some() { Core::DAMPED } else { Core::NEW };
        let object = place.put(|head| supple_large { head, nodes, sizes, damper, core });
        let storage = clean(storage(object));
        let core = &mut (*object).core;
        View::of(state).with(|state| {
            with_scene!(&any, scene => core.prepare(scene, points, state, step, sizes.cells, storage))
        })?;
        place.done::<supple_large>();
        large.write(object);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// # Safety
/// `object` has been put or is one, and nobody else uses it.
unsafe fn storage<'a>(object: *mut supple_large) -> Storage<'a> {
    // SAFETY: the caller's promise. Any bits are vectors, places and numbers.
    unsafe {
        let Sizes { vectors, places, numbers, .. } = (*object).sizes;
        let mut arrays = Arrays::behind(object.cast_const());
        Storage {
            vectors: arrays.next::<NodeVector>(vectors),
            places: arrays.next::<LatticeNode>(places),
            dense: arrays.next::<f32>(numbers),
        }
    }
}

fn clean(storage: Storage<'_>) -> Storage<'_> {
    storage.vectors.fill(NodeVector::ZERO);
    storage.places.fill(LatticeNode::EMPTY);
    storage.dense.fill(0.0);
    storage
}

/// Takes `count` large steps. Stops at the first that is not to be believed: that one is not taken, the state is as before it,
/// and the status tells. They run on the calling thread alone, and need no supple_set_step.
///
/// @param loads what acts; NULL: nothing, supports stand still.
/// @param report may be NULL; is written whatever the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_large_step(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    large: *mut supple_large,
    count: u32,
    report: *mut supple_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let step = |found: &mut supple_report| unsafe {
        let any = carved(scene)?;
        let mut acting = Acting::of(loads, &any)?;
        belongs(memory::change(state)?.nodes, &any)?;
        belongs(memory::change(large)?.nodes, &any)?;
        let (core, damper) = (&mut (*large).core, (*large).damper.as_ref());
        View::of(state).with(|state| {
            let (mut held_back, mut lattice_share) = (0, 1.0);
            let answer = with_scene!(&any, scene => taken(count, count, state, &mut acting, found, |loads, state| {
                let status = core.step(scene, loads, state, storage(large), damper);
                // What was refused has no report of its own.
                if let Status::Ok | Status::Limited { .. } = status {
                    held_back = held_back.max(core.report().held_back);
                    lattice_share = f32::min(lattice_share, core.report().coarse_share);
                }
                status
            }));
            found.close(state);
            (found.held_back, found.added_mass) = (held_back, core.report().added_mean);
            (found.lattice_share, found.error_estimate) = (lattice_share, core.report().error);
            answer
        })
    };
    // SAFETY: as above.
    unsafe { reported(report, step) }
}
