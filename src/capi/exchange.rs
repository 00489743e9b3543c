//! Tissue that changes while it moves, for C: another scene of the same nodes, and other constants.

use core::slice::{from_mut, from_ref};

use crate::copy::copy;
use crate::material::TissueValues;
use crate::simulation::carry;
use crate::tled;

use super::contact::supple_contact_carry_on;
use super::loads::{can_take_over, supple_set_contact, take_over};
use super::memory::{self, array, bytes_of, one};
use super::pulls::let_go_of_removed;
use super::scene::{OpenScene, set_tissues, supple_scene, supple_tissue};
use super::simulation::{keep_steps, objects_of, points_of, prepare, supple_settings, supple_sim, supple_sim_objects};
use super::state::{opened_of, remember_in, supple_state};
use super::status::{Answer, mismatch, status_of, supple_error, supple_status};
use super::vectors::overlap;
use supple_status::*;

/// Lets a state go on in a scene that has taken the place of another one of the same nodes and kind of element: without
/// some elements, with other tissues. Displacements, velocities and time stay, so what stays of the tissue keeps its
/// momentum; the energy balance begins anew. All that was prepared for the former scene, apart from loads and contact,
/// must be prepared again, and the step be set. It takes as long as an exact step or two. Tissue that relaxes goes on where
/// all elements and patches are as before, in scenes with other constants, densities or supports; elsewhere it begins as if
/// nothing had been deformed so far (supple_sim_carry_on does not). SUPPLE_E_NO_RELAXATION: the state has too little memory
/// for what it must remember, as the former scene had fewer terms or tissues.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_state_carry_on(scene: *const supple_scene, state: *mut supple_state) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let go_on = || unsafe {
        let open = OpenScene::of(scene)?;
        remember_in(&open, state)?;
        let state_of_scene = opened_of(&open, state)?;
        let capacity = state_of_scene.capacity();
        if !tled::carry_on_in(open.view(), state_of_scene) {
            return Err(mismatch(capacity, open.node_count()));
        }
        memory::change(state)?.set_step(None);
        Ok(SUPPLE_OK)
    };
    status_of(go_on())
}

/// Gives the tissues of a scene other constants, without building it anew: it takes a pass over its elements, and all or
/// nothing is changed. Nobody may use the scene meanwhile. Call supple_state_carry_on for each of its states.
///
/// @param tissues as many as the scene has, of the same densities, which are checked (SUPPLE_E_MISMATCH).
/// @param error may be NULL; index is that of an element.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_tissues(
    scene: *mut supple_scene,
    tissues: *const supple_tissue,
    count: u32,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        memory::is(scene.cast_const())?;
        set_tissues(scene, given(tissues, count)?)?;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// The same for a simulation, which goes on with them: for an ablation call it in some twenty stages. Prepare the scene
/// with a tissue of its own for each region that will change. The motion goes on as it is, and the energy balance begins
/// anew.
///
/// @param settings NULL: the steps stay as they are, but for what follows from the constants, which takes as long as some
/// exact steps; not with SUPPLE_STEPS_AUTO (SUPPLE_E_NULL). Else as at supple_sim_set, to prepare them anew, which takes
/// some hundred exact steps where they are longer, and is best at the end of an ablation. Where the scene with the new
/// tissues refuses its steps (SUPPLE_E_LATTICE, SUPPLE_E_TOO_STIFF) there are none until the next call.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_set_tissues(
    sim: *mut supple_sim,
    tissues: *const supple_tissue,
    count: u32,
    settings: *const supple_settings,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let supple_sim_objects { scene, state, .. } = objects_of(sim)?;
        let change = || {
            set_tissues(scene.cast_mut(), given(tissues, count)?)?;
            let open = OpenScene::of(scene)?;
            tled::carry_on_in(open.view(), opened_of(&open, state)?);
            Ok(())
        };
        if settings.is_null() {
            keep_steps(sim, change)?;
            return Ok(SUPPLE_OK);
        }
        let settings = one(settings)?;
        settings.check()?;
        change()?;
        prepare(sim, settings)?;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(set(), error) }
}

/// Lets a simulation that has just been set up go on where another one is, of a body of the same points: without some
/// elements (supple_scene_config.removed), with other tissues, another kind of element or other supports. It takes over
/// displacements, velocities, time, gravity, forces, motions, pulls, and where it has a surface the instruments with what
/// they hold; what stays of the tissue keeps its momentum and what it remembers, and the energy balance begins anew. It takes over pressures
/// where no element goes. Where some do there is none: the triangles would go on to press the surface that is gone, so set
/// one up on what is left of it, with or without the cut (supple_pressure_init, supple_set_pressure). Forces stay as they are, those
/// that supple_traction has made of triangles that are gone as well: make them again. Nodes that belong to no
/// element any more stay in all arrays, held where they are; pulls and instruments let go of them. The other simulation
/// is only read, may go on, and its memory be used for the next exchange; but the pulls are an object of both, so where it goes
/// on these have let go in it as well. What is refused changes none of this. supple_sim_setup, which takes longest, may run on another thread
/// while the other simulation goes on. This takes as long as supple_sim_set.
///
/// @param from points and kind of contact are checked (SUPPLE_E_MISMATCH); room for its forces, motions and held nodes
/// must be there (SUPPLE_E_CAPACITY).
/// @param settings those that `sim` was set up with.
/// @param error may be NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_sim_carry_on(
    sim: *mut supple_sim,
    from: *mut supple_sim,
    settings: *const supple_settings,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let go_on = || unsafe {
        let (settings, new, old) = (one(settings)?, objects_of(sim)?, objects_of(from)?);
        settings.check()?;
        if overlap(
            sim.cast_const().cast(),
            bytes_of(sim.cast_const()),
            from.cast_const().cast(),
            bytes_of(from.cast_const()),
        ) {
            return Err(supple_error::from(SUPPLE_E_OVERLAP));
        }
        same_points(points_of(sim), points_of(from))?;
        let (open, former) = (OpenScene::of(new.scene)?, OpenScene::of(old.scene)?);
        let (mut to, before) = (opened_of(&open, new.state)?, opened_of(&former, old.state)?);
        can_take_over(new.loads, old.loads, &open)?;
        let pulls = memory::read(old.loads.cast_const())?.pulls();
        if !pulls.is_null() {
            memory::is(pulls.cast_const())?;
        }
        take_over_instruments(&new, &old)?;
        let same_surface = open.view().element_count() == former.view().element_count();
        take_over(new.loads, old.loads, same_surface)?;
        copy(to.displacement, before.displacement);
        copy(to.remainder, before.remainder);
        copy(to.increment, before.increment);
        copy(from_mut(to.progress), from_ref(before.progress));
        let remembered = before.remembered();
        let [now, room] = to.copies_of_memory();
        carry((former.view(), remembered), (open.view(), now), room);
        tled::carry_on_in(open.view(), to);
        let clock = (*from).clock();
        (*sim).set_clock(clock);
        prepare(sim, settings)?;
        // In the object of both: only where nothing is refused any more.
        let_go_of_removed(pulls, &open)?;
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(go_on(), error) }
}

/// # Safety
/// The objects are those of two simulations.
unsafe fn take_over_instruments(new: &supple_sim_objects, old: &supple_sim_objects) -> Answer<()> {
    // SAFETY: the caller's promise.
    unsafe {
        let former = memory::read(old.loads.cast_const())?.contact();
        let answer = if former.is_null() {
            SUPPLE_OK
        } else if !new.contact.is_null() {
            supple_contact_carry_on(new.contact, new.scene, former)
        } else if former != old.contact {
            // The host's own goes on as it is.
            supple_set_contact(new.loads, former)
        } else {
            SUPPLE_OK
        };
        if answer == SUPPLE_OK { Ok(()) } else { Err(answer.into()) }
    }
}

fn same_points(new: &[[f32; 3]], old: &[[f32; 3]]) -> Answer<()> {
    if new.len() != old.len() {
        return Err(mismatch(new.len(), old.len()));
    }
    match new.iter().zip(old).position(|(new, old)| new != old) {
        Some(node) => Err(supple_error::from(SUPPLE_E_MISMATCH).node(node as u32)),
        None => Ok(()),
    }
}

/// # Safety
/// As at [`array()`].
unsafe fn given<'a>(tissues: *const supple_tissue, count: u32) -> Answer<&'a [TissueValues]> {
    // SAFETY: the caller's promise; both are five floats.
    unsafe { array(tissues.cast(), count as usize) }
}
