//! What acts on a scene, for C: forces, motions and gravity, which the host changes between steps as it likes.

use core::ffi::c_void;
use core::ptr;

use crate::contact::Touch;
use crate::copy::copy;
use crate::loads::{Loads, LoadsOfCall, LoadsOverTime, Motion, NodalForce};
use crate::state::StateView;

use super::contact::{CallContact, supple_contact};
use super::memory::{self, Head, Layout, Object, Place, array, magic, place_for};
use super::pressure::{self, supple_pressure};
use super::pulls::{CallPulls, supple_pulls};
use super::scene::{OpenScene, axes_of, check_axes, supple_scene};
use super::status::{Answer, mismatch, status_of, supple_error, supple_status};
use supple_status::*;

/// A force on one node. Forces on the same node add up.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_force {
    /// From zero.
    pub node: u32,
    /// Full force, N.
    pub newton: [f32; 3],
    /// Seconds from the start of the simulation over which it grows to that, zero or more.
    pub ramp: f32,
}

/// A displacement that one node follows along axes on which a support that moves holds it. Of several for
/// the same axis the last one holds.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_motion {
    /// From zero.
    pub node: u32,
    /// Axes that follow, at least one: 1 for x, 2 for y, 4 for z, or their sum.
    pub axes: u32,
    /// Full displacement from rest, m.
    pub metre: [f32; 3],
    /// Seconds from the start of the simulation over which it grows to that. Zero: it is reached at the end of the next
    /// call that takes steps, evenly from where the node is, which is what a host that follows an instrument wants.
    pub ramp: f32,
}

/// What acts on a scene. One thread at a time; a call that takes steps changes it as well.
#[repr(C, align(64))]
pub struct supple_loads {
    head: Head,
    /// Of the scene.
    nodes: u32,
    force_room: u32,
    motion_room: u32,
    forces: u32,
    motions: u32,
    gravity: [f32; 3],
    contact: *mut supple_contact,
    pulls: *mut supple_pulls,
    pressure: *const supple_pressure,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_loads {
    const MAGIC: [u8; 8] = magic(b'L');
    const FRONT: usize = 128;
}

impl supple_loads {
    pub(super) const fn nodes(&self) -> u32 {
        self.nodes
    }

    pub(super) const fn contact(&self) -> *mut supple_contact {
        self.contact
    }

    pub(super) const fn set_pressure(&mut self, pressure: *const supple_pressure) {
        self.pressure = pressure;
    }

    pub(super) const fn set_contact(&mut self, contact: *mut supple_contact) {
        self.contact = contact;
    }

    pub(super) const fn pulls(&self) -> *mut supple_pulls {
        self.pulls
    }

    pub(super) const fn set_pulls(&mut self, pulls: *mut supple_pulls) {
        self.pulls = pulls;
    }
}

/// Bytes before the arrays of loads.
pub const SUPPLE_LOADS_FRONT: usize = 128;
const _: () = assert!(SUPPLE_LOADS_FRONT == <supple_loads as Object>::FRONT);

fn layout(forces: u32, motions: u32) -> Layout {
    // Motions twice: as they are asked for, and where they are in the next step.
    Layout::of::<supple_loads>()
        .and::<NodalForce>(forces as usize)
        .and::<Motion>(motions as usize)
        .and::<Motion>(motions as usize)
}

/// Bytes of memory that loads need with room for so many forces and motions. SUPPLE_LOADS_SIZE is the same as a
/// constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_loads_size(forces: u32, motions: u32) -> usize {
    layout(forces, motions).bytes()
}

/// Prepares loads for a scene in `memory` of at least supple_loads_size bytes, aligned to SUPPLE_ALIGN: none yet,
/// with room for so many forces and motions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_loads_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    forces: u32,
    motions: u32,
    loads: *mut *mut supple_loads,
) -> supple_status {
    // SAFETY: what the header asks of the caller, here and below.
    let init = || unsafe {
        let (open, loads) = (OpenScene::of(scene)?, place_for(loads)?);
        let nodes = open.node_count() as u32;
        let place = Place::new(memory, bytes, layout(forces, motions))?;
        loads.write(place.put(|head| supple_loads {
            head,
            nodes,
            force_room: forces,
            motion_room: motions,
            forces: 0,
            motions: 0,
            gravity: [0.0; 3],
            contact: ptr::null_mut(),
            pulls: ptr::null_mut(),
            pressure: ptr::null(),
        }));
        Ok(SUPPLE_OK)
    };
    status_of(init())
}

/// Sets gravity, three components, m/s^2.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_gravity(loads: *mut supple_loads, gravity: *const f32) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let loads = memory::change(loads)?;
        let gravity = *memory::one(gravity.cast::<[f32; 3]>())?;
        if !gravity.iter().all(|component| component.is_finite()) {
            return Err(SUPPLE_E_NOT_FINITE.into());
        }
        loads.gravity = gravity;
        Ok(SUPPLE_OK)
    };
    status_of(set())
}

/// Replaces all forces by `count` others, which are copied; none with a count of zero.
///
/// @param error may be NULL; index is that of a force.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_forces(
    loads: *mut supple_loads,
    forces: *const supple_force,
    count: u32,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let (object, mut arrays) = memory::open(loads)?;
        let given = array(forces, count as usize)?;
        room_for(count, object.force_room)?;
        let forces = given.iter().map(|&supple_force { node, newton, ramp }| NodalForce { node, newton, ramp });
        for (index, force) in forces.clone().enumerate() {
            force.check(index, object.nodes as usize)?;
        }
        // Whatever was there is overwritten, never read.
        let room = arrays.change::<NodalForce>(object.force_room as usize);
        room.iter_mut().zip(forces).for_each(|(place, force)| *place = force);
        object.forces = count;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Replaces all motions by `count` others, which are copied; none with a count of zero: moved nodes then stay where
/// they are.
///
/// @param error may be NULL; index is that of a motion.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_motions(
    loads: *mut supple_loads,
    scene: *const supple_scene,
    motions: *const supple_motion,
    count: u32,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let (object, mut arrays) = memory::open(loads)?;
        let open = OpenScene::of(scene)?;
        let given = array(motions, count as usize)?;
        open.fits(object.nodes)?;
        room_for(count, object.motion_room)?;
        let motions = given.iter().map(|&supple_motion { node, axes, metre, ramp }| Motion {
            node,
            axes: axes_of(axes),
            metre,
            ramp,
        });
        for (index, (motion, given)) in motions.clone().zip(given).enumerate() {
            check_axes(index, given.axes)?;
            let movable = open.view().movable(motion.node as usize);
            motion.check(index, object.nodes as usize, movable)?;
        }
        arrays.change::<NodalForce>(object.force_room as usize);
        for (place, motion) in arrays.change::<Motion>(object.motion_room as usize).iter_mut().zip(motions) {
            *place = motion;
        }
        object.motions = count;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Lets the instruments of a contact touch what these loads act on, as long as both are there; NULL: none do. Learned
/// steps refuse loads with instruments, and a library without the feature `contact` refuses them here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_contact(loads: *mut supple_loads, contact: *mut supple_contact) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let loads = memory::change(loads)?;
        if !contact.is_null() {
            if !cfg!(feature = "contact") {
                return Err(SUPPLE_E_NO_CONTACT.into());
            }
            let nodes = memory::read(contact.cast_const())?.nodes();
            if nodes != loads.nodes() {
                return Err(mismatch(nodes as usize, loads.nodes() as usize));
            }
        }
        loads.set_contact(contact);
        Ok(SUPPLE_OK)
    };
    status_of(set())
}

/// That the loads of another scene of the same nodes can be those of `scene`, which has `loads`.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn can_take_over(
    loads: *mut supple_loads,
    from: *mut supple_loads,
    scene: &OpenScene<'_>,
) -> Answer<()> {
    // SAFETY: the caller's promise; entries up to the counts were written.
    unsafe {
        let object = memory::change(loads)?;
        let (old, mut arrays) = memory::open(from)?;
        scene.fits(old.nodes)?;
        scene.fits(object.nodes)?;
        room_for(old.forces, object.force_room)?;
        room_for(old.motions, object.motion_room)?;
        CallPulls::of(old.pulls, scene)?;
        arrays.change_first::<NodalForce>(0, old.force_room as usize);
        let motions = arrays.change_first::<Motion>(old.motions as usize, old.motion_room as usize);
        for (index, motion) in motions.iter().enumerate() {
            motion.check(index, scene.node_count(), scene.view().movable(motion.node as usize))?;
        }
        Ok(())
    }
}

/// Takes over gravity, forces, motions and pulls, where [`can_take_over`], and pressures on the same surface.
///
/// # Safety
/// As at [`memory::change`].
pub(super) unsafe fn take_over(loads: *mut supple_loads, from: *mut supple_loads, same_surface: bool) -> Answer<()> {
    // SAFETY: the caller's promise; entries up to the counts were written.
    unsafe {
        let ((object, mut arrays), (old, mut before)) = (memory::open(loads)?, memory::open(from)?);
        let forces = before.change_first::<NodalForce>(old.forces as usize, old.force_room as usize);
        let motions = before.change_first::<Motion>(old.motions as usize, old.motion_room as usize);
        copy(arrays.change_first(old.forces as usize, object.force_room as usize), forces);
        copy(arrays.change_first(old.motions as usize, object.motion_room as usize), motions);
        (object.forces, object.motions, object.gravity) = (old.forces, old.motions, old.gravity);
        object.pulls = old.pulls;
        if same_surface {
            object.pressure = old.pressure;
        }
        Ok(())
    }
}

fn room_for(count: u32, room: u32) -> Answer<()> {
    if count <= room {
        return Ok(());
    }
    Err(supple_error::from(SUPPLE_E_CAPACITY).value(count.into(), room.into()))
}

/// Loads of one call that takes steps.
pub(super) struct CallLoads<'a> {
    pub(super) of_call: LoadsOfCall<'a>,
    pub(super) contact: Option<CallContact<'a>>,
    pulls: Option<CallPulls<'a>>,
}

impl<'a> CallLoads<'a> {
    /// Of an object, or none at all.
    ///
    /// # Safety
    /// As at [`memory::change`].
    pub(super) unsafe fn of(loads: *mut supple_loads, scene: &OpenScene<'_>) -> Answer<Self> {
        let nodes = scene.node_count();
        if loads.is_null() {
            let none = Loads::unchecked([0.0; 3], &[], &[], nodes);
            return Ok(Self { of_call: LoadsOfCall::new(none, &mut []), contact: None, pulls: None });
        }
        // SAFETY: the caller's promise; entries up to the counts were written.
        unsafe {
            let (object, mut arrays) = memory::open(loads)?;
            scene.fits(object.nodes)?;
            let (force_room, motion_room) = (object.force_room as usize, object.motion_room as usize);
            let forces = arrays.change_first::<NodalForce>(object.forces as usize, force_room);
            let asked = arrays.change_first::<Motion>(object.motions as usize, motion_room);
            let now = arrays.change_first::<Motion>(object.motions as usize, motion_room);
            let contact = CallContact::of(object.contact, nodes)?;
            let pulls = CallPulls::of(object.pulls, scene)?;
            let mut loads = Loads::unchecked(object.gravity, forces, asked, nodes);
            if !object.pressure.is_null() {
                scene.fits(memory::read(object.pressure)?.nodes())?;
                loads = loads.pressed_by(pressure::opened(object.pressure)?);
            }
            #[cfg(feature = "contact")]
            let loads = match &contact {
                Some(contact) if contact.has_instruments() => loads.touched_by(contact.contact),
                _ => loads,
            };
            #[cfg(feature = "contact")]
            let loads = pulls.as_ref().map_or(loads, |pulls| loads.pulled_by(pulls.pulls));
            Ok(Self { of_call: LoadsOfCall::new(loads, now), contact, pulls })
        }
    }

    /// The state with what it keeps for instruments and pulls.
    pub(super) fn attached(&mut self, state: StateView<'a>) -> StateView<'a> {
        let state = match &mut self.contact {
            Some(contact) => contact.attached(state),
            None => state,
        };
        match &mut self.pulls {
            Some(pulls) => pulls.attached(state),
            None => state,
        }
    }

    /// Enters what instruments felt in a step.
    pub(super) fn enter(&mut self, touches: &[Touch]) {
        if let Some(contact) = &mut self.contact {
            contact.enter(touches);
        }
    }

    /// Loads of the next of the `left` steps that the call still takes.
    pub(super) fn of_next_step(&mut self, state: &StateView<'_>, left: u64) -> Loads<'_> {
        self.of_call.of_step(state, 0.0, left.min(u32::MAX.into()) as u32)
    }
}
