//! Steps beyond the critical one for C.

use core::ffi::c_void;
use core::mem::MaybeUninit;

use crate::inertia::{Cells, LargeModel, Method, vectors_for_lattice};
use crate::state::NodeVector;
use crate::step::Step;

use super::loads::{CallLoads, supple_loads};
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, one, place_for, same_abi};
use super::scene::{OpenScene, supple_scene};
use super::state::{opened_of, supple_state};
use super::status::{Answer, supple_error, supple_status};
use super::step::{HostThreads, answer, reported, supple_report, supple_threads, take_steps};
use supple_status::*;

/// Points that a lattice may have.
pub const SUPPLE_LATTICE_POINTS: u32 = 1024;
/// Functions that a lattice may have.
pub const SUPPLE_LATTICE_FUNCTIONS: u32 = 240;
const _: () = assert!(SUPPLE_LATTICE_POINTS as usize == crate::inertia::MAX_POINTS);
const _: () = assert!(SUPPLE_LATTICE_FUNCTIONS as usize == crate::inertia::MAX_FUNCTIONS);

/// What steps beyond the critical one need. Inertia is raised where they would be unstable, smooth motion keeps its true
/// inertia through a coarse lattice, and what the lattice does not carry is damped.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_large_config {
    /// sizeof(supple_large_config).
    pub struct_size: u32,
    /// SUPPLE_ABI.
    pub abi: u32,
    /// Length of a step, s.
    pub seconds: f32,
    /// Damping proportional to mass, 1/s, zero or more. That of supple_step_config is not used here: give the same
    /// value twice if both kinds of steps move a state.
    pub damping: f32,
    /// Cells of the lattice along x, y, z; zeros: chosen for the scene.
    pub cells: [u32; 3],
}

/// Inertia for steps of one length, whose stiff part is computed anew where tissue deforms. One thread at a time. It may be copied with
/// memcpy together with its state.
#[repr(C, align(64))]
pub struct supple_large {
    head: Head,
    nodes: u32,
    /// In its storage.
    vectors: usize,
    model: LargeModel,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_large {
    const MAGIC: [u8; 8] = magic(b'I');
    const FRONT: usize = 10240;
}

/// Bytes before the arrays of a supple_large.
pub const SUPPLE_LARGE_FRONT: usize = 10240;
const _: () = assert!(SUPPLE_LARGE_FRONT == <supple_large as Object>::FRONT);

/// A configuration, checked against a scene with these points.
pub(super) struct LargeRequest<'a> {
    pub(super) config: &'a supple_large_config,
    pub(super) points: &'a [[f32; 3]],
    cells: Cells,
    /// In the storage.
    pub(super) vectors: usize,
}

impl<'a> LargeRequest<'a> {
    /// # Safety
    /// As at [`supple_large_size`].
    pub(super) unsafe fn of(
        open: &OpenScene<'_>,
        points: *const f32,
        config: *const supple_large_config,
    ) -> Answer<Self> {
        // SAFETY: the caller's promise.
        let (config, points) = unsafe {
            let config = one(config)?;
            same_abi::<supple_large_config>(config.struct_size, config.abi)?;
            (config, array(points.cast::<[f32; 3]>(), open.node_count())?)
        };
        let cells = if config.cells == [0; 3] { Cells::Suggested } else { Cells::Given(config.cells) };
        let scene = open.view();
        let grid = cells.grid(scene, points)?;
        let vectors = vectors_for_lattice(scene.element(), scene.node_count(), scene.element_count(), grid);
        Ok(Self { config, points, cells, vectors })
    }

    pub(super) const fn method(&self) -> Method {
        Method::new(self.cells)
    }
}

pub(super) fn layout(vectors: usize) -> Layout {
    Layout::of::<supple_large>().and::<NodeVector>(vectors)
}

/// Writes how many bytes of memory a supple_large needs for a scene; it depends on the lattice. For cells that you give
/// SUPPLE_LARGE_SIZE is never less.
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
        let (open, bytes) = (OpenScene::of(scene)?, place_for(bytes)?);
        bytes.write(layout(LargeRequest::of(&open, points, config)?.vectors).bytes());
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(size(), error) }
}

/// Prepares steps beyond the critical one, from the state as it is, in `memory` of at least supple_large_size bytes,
/// aligned to SUPPLE_ALIGN. It takes as long as some steps.
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
        let (open, large) = (OpenScene::of(scene)?, place_for(large)?);
        let state = opened_of(&open, state)?;
        let request = LargeRequest::of(&open, points, config)?;
        let method = request.method();
        let step = Step::unchecked(request.config.seconds, request.config.damping)?;
        let LargeRequest { points, vectors, .. } = request;
        let place = Place::new(memory, bytes, layout(vectors))?;
        let nodes = open.node_count() as u32;
        let storage = storage(place.arrays::<supple_large>(), vectors);
        let object = place.object::<supple_large>();
        // Of 57 kB: it is made where it stays, not on the stack.
        let model = &mut *(&raw mut (*object).model).cast::<MaybeUninit<_>>();
        LargeModel::prepare_in(model, method, open.view(), points, state, step, storage)?;
        (&raw mut (*object).nodes).write(nodes);
        (&raw mut (*object).vectors).write(vectors);
        (&raw mut (*object).head).write(place.head::<supple_large>());
        large.write(object);
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// The steps in an object, with their storage.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn opened<'a>(object: *mut supple_large) -> Answer<(&'a mut LargeModel, &'a mut [NodeVector])> {
    // SAFETY: the caller's promise.
    unsafe {
        let (supple_large { vectors, model, .. }, arrays) = memory::open(object)?;
        Ok((model, storage(arrays, *vectors)))
    }
}

/// # Safety
/// The arrays are those of an object with so many vectors, and nobody else uses them.
pub(super) unsafe fn storage<'a>(mut arrays: Arrays, vectors: usize) -> &'a mut [NodeVector] {
    // SAFETY: the caller's promise. Any bits are vectors.
    unsafe { arrays.change(vectors) }
}

/// Takes `count` steps of the prepared length. Stops at the first that is not to be believed: that one is
/// not taken, the state is as before it, and the status tells. They need no supple_set_step.
///
/// @param loads what acts; NULL: nothing, supports stand still.
/// @param threads NULL: the calling thread alone. The lattice's factorisation runs on that one in any case.
/// @param report may be NULL; is written whatever the status.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_large_step(
    scene: *const supple_scene,
    loads: *mut supple_loads,
    state: *mut supple_state,
    large: *mut supple_large,
    count: u32,
    threads: *const supple_threads,
    report: *mut supple_report,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let step = |report: &mut supple_report| unsafe {
        let open = OpenScene::of(scene)?;
        let mut loads = CallLoads::of(loads, &open)?;
        open.fits(memory::read(state.cast_const())?.nodes)?;
        open.fits(memory::read(large.cast_const())?.nodes)?;
        let (model, storage) = opened(large)?;
        let threads = HostThreads::of(threads)?;
        let mut state = loads.attached(opened_of(&open, state)?);
        let count = count.into();
        let (mut held_back, mut lattice_share) = (0, 1.0);
        let status = take_steps(count, count, &mut state, &mut loads, report, |loads, state| {
            let status = model.with_storage(storage).step_in_parts(open.view(), loads, state, &threads);
            // What was refused has no report of its own.
            if status.is_taken() {
                held_back = held_back.max(model.report().held_back);
                lattice_share = f32::min(lattice_share, model.report().coarse_share);
            }
            status
        });
        report.close(&state);
        (report.held_back, report.added_mass) = (held_back, model.report().added_mean);
        report.lattice_share = lattice_share;
        answer(&status)
    };
    // SAFETY: as above.
    unsafe { reported(report, step) }
}
