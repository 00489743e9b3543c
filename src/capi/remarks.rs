//! Does a scene look as if a unit or a number was mistaken, for C ([`crate::plausibility`]).

use core::ffi::{CStr, c_char};

use crate::plausibility::{self, Proportions, Remark};

use super::SUPPLE_NONE;
use super::learned::supple_learned;
use super::loads::{CallLoads, supple_loads};
use super::memory::{self, array, place_for};
use super::scene::{OpenScene, supple_scene};
use super::status::{status_of, supple_status};
use supple_status::*;

/// The body's box has a diagonal of `value` m: are its points in metres?
pub const SUPPLE_REMARK_SIZE: u32 = 1;
/// The body has a mass of `value` kg.
pub const SUPPLE_REMARK_MASS: u32 = 2;
/// Tissue `index` has a density of `value` kg/m^3, not about 1000.
pub const SUPPLE_REMARK_DENSITY: u32 = 3;
/// Tissue `index` has a Young's modulus of `value` Pa at rest, not 1e3 to 1e5.
pub const SUPPLE_REMARK_STIFFNESS: u32 = 4;
/// Tissue `index` has a Poisson's ratio of `value` at rest, not 0.3 to 0.4999: are its constants in the right order?
pub const SUPPLE_REMARK_POISSON_RATIO: u32 = 5;
/// Gravity is `value` m/s^2, not 9.81.
pub const SUPPLE_REMARK_GRAVITY: u32 = 6;
/// Forces add up to `value` N, the body would be crushed by `limit` N.
pub const SUPPLE_REMARK_FORCES: u32 = 7;
/// Motion `index` goes `value` m, farther than the body is large (`limit`, m).
pub const SUPPLE_REMARK_WAY: u32 = 8;
/// Motion `index` has a speed of `value` m/s along its ramp, above that of shear waves in the softest tissue (`limit`,
/// m/s).
pub const SUPPLE_REMARK_SPEED: u32 = 9;
/// Supports are of nodes far from each other: are they counted from one? The first node is 0.
pub const SUPPLE_REMARK_COUNTED_FROM_ONE: u32 = 10;
/// The network learned from another law, other constants or density, or other elements: its error here is not known.
pub const SUPPLE_REMARK_OTHER_TISSUE: u32 = 11;
/// Instrument `index` is `value` m thick, and edges of the surface are longer: it passes between the nodes, or feels
/// too little. Give supple_surface its triangles.
pub const SUPPLE_REMARK_THIN: u32 = 12;
/// All nodes of pull `index` are held: it moves nothing.
pub const SUPPLE_REMARK_HELD_PULL: u32 = 13;

/// Instrument `index` starts within the body, where it touches nothing and pushes the surface from within: let its path
/// begin outside.
pub const SUPPLE_REMARK_INSIDE: u32 = 14;
/// Instrument `index` stays `value` m away from the body, which is `limit` m across: is its pose in metres?
pub const SUPPLE_REMARK_FAR: u32 = 15;
/// The target of pull `index` is `value` m away from its point, the body `limit` m across: is it in metres?
pub const SUPPLE_REMARK_FAR_TARGET: u32 = 16;

/// What does not look right. Numbers that have no meaning are 0, an index SUPPLE_NONE.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_remark {
    /// SUPPLE_REMARK_SIZE and so on.
    pub kind: u32,
    /// Entry of the list that it is about.
    pub index: u32,
    pub value: f64,
    pub limit: f64,
}

impl supple_remark {
    const fn of(index: u32, remark: Remark) -> Self {
        let (kind, index, value, limit) = match remark {
            Remark::Size(metre) => (SUPPLE_REMARK_SIZE, SUPPLE_NONE, metre, 0.0),
            Remark::Mass(kilogram) => (SUPPLE_REMARK_MASS, SUPPLE_NONE, kilogram, 0.0),
            Remark::Density(density) => (SUPPLE_REMARK_DENSITY, index, density as f64, 0.0),
            Remark::Stiffness(pascal) => (SUPPLE_REMARK_STIFFNESS, index, pascal, 0.0),
            Remark::PoissonRatio(ratio) => (SUPPLE_REMARK_POISSON_RATIO, index, ratio, 0.0),
            Remark::Gravity(size) => (SUPPLE_REMARK_GRAVITY, SUPPLE_NONE, size, 0.0),
            Remark::Forces { newton, bearable } => (SUPPLE_REMARK_FORCES, SUPPLE_NONE, newton, bearable),
            Remark::Way { metre, diagonal } => (SUPPLE_REMARK_WAY, index, metre, diagonal),
            // Motions without a ramp go evenly over a call.
            Remark::Jump(metre) => (SUPPLE_REMARK_WAY, index, metre, 0.0),
            Remark::Speed { speed, waves, .. } => (SUPPLE_REMARK_SPEED, index, speed, waves),
            Remark::CountedFromOne => (SUPPLE_REMARK_COUNTED_FROM_ONE, SUPPLE_NONE, 0.0, 0.0),
            Remark::OtherTissue => (SUPPLE_REMARK_OTHER_TISSUE, SUPPLE_NONE, 0.0, 0.0),
            Remark::Thin(thickness) => (SUPPLE_REMARK_THIN, index, thickness as f64, 0.0),
            Remark::Inside => (SUPPLE_REMARK_INSIDE, index, 0.0, 0.0),
            Remark::HeldPull => (SUPPLE_REMARK_HELD_PULL, index, 0.0, 0.0),
            Remark::Far { metre, diagonal } => (SUPPLE_REMARK_FAR, index, metre, diagonal),
            Remark::FarTarget { metre, diagonal } => (SUPPLE_REMARK_FAR_TARGET, index, metre, diagonal),
        };
        Self { kind, index, value, limit }
    }
}

/// Writes what in a scene looks as if a unit or a number was mistaken; it can be simulated all the same. To be called
/// once, before the first step. It takes as long as some steps.
///
/// @param points the points that the scene was built from, three coordinates each.
/// @param loads NULL: nothing is said of loads, and of instruments that touch what they act on.
/// @param learned NULL: nothing is said of a network.
/// @param remarks receives the first of them; may be NULL if `room` is 0.
/// @param room in `remarks`.
/// @param count how many there are, which may be more than there is room for.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_remarks(
    scene: *const supple_scene,
    points: *const f32,
    loads: *mut supple_loads,
    learned: *const supple_learned,
    remarks: *mut supple_remark,
    room: u32,
    count: *mut u32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let tell = || unsafe {
        let (open, count) = (OpenScene::of(scene)?, place_for(count)?);
        let points = array(points.cast::<[f32; 3]>(), open.node_count())?;
        let recipe = if learned.is_null() { None } else { Some(memory::read(learned)?.model.network().recipe()) };
        let loads = CallLoads::of(loads, &open)?;
        let first = if room == 0 { remarks } else { place_for(remarks)? };
        let mut told = 0;
        let mut say = |index: usize, remark| {
            if told < room {
                first.add(told as usize).write(supple_remark::of(index as u32, remark));
            }
            told = told.saturating_add(1);
        };
        let (scene, asked) = (open.view(), loads.of_call.asked());
        plausibility::of_body(scene, points, &mut say);
        plausibility::of_gravity(asked.gravity()).into_iter().for_each(|remark| say(0, remark));
        let body = Proportions::of(scene, points);
        body.of_forces(asked.forces()).into_iter().for_each(|remark| say(0, remark));
        for (index, motion) in asked.motions().iter().enumerate() {
            body.of_motion(motion).into_iter().for_each(|remark| say(index, remark));
        }
        #[cfg(feature = "contact")]
        if let Some(touching) = &loads.contact {
            plausibility::of_contact(scene, points, &touching.contact, &mut say);
        }
        if let Some(pulls) = asked.pulls() {
            plausibility::of_pulls(scene, points, pulls, &mut say);
        }
        let network = recipe.and_then(|recipe| plausibility::of_network(scene, recipe));
        network.into_iter().for_each(|remark| say(0, remark));
        count.write(told);
        Ok(SUPPLE_OK)
    };
    status_of(tell())
}

/// What a remark means, a few English words for people; "?" for a number that is none.
#[unsafe(no_mangle)]
pub extern "C" fn supple_remark_text(kind: u32) -> *const c_char {
    let text: &CStr = match kind {
        SUPPLE_REMARK_SIZE => c"an unusual size of the body: are its points in metres?",
        SUPPLE_REMARK_MASS => c"an unusual mass of the body: are its points in metres?",
        SUPPLE_REMARK_DENSITY => c"an unusual density: tissue has about 1000 kg/m^3",
        SUPPLE_REMARK_STIFFNESS => c"an unusual Young's modulus: soft tissue has 1e3 to 1e5 Pa",
        SUPPLE_REMARK_POISSON_RATIO => c"an unusual Poisson's ratio: are the constants of the law in the right order?",
        SUPPLE_REMARK_GRAVITY => c"an unusual gravity: that of the earth is 9.81 m/s^2",
        SUPPLE_REMARK_FORCES => c"forces that would crush the body: are they in newtons?",
        SUPPLE_REMARK_WAY => c"a motion farther than the body is large: is it in metres?",
        SUPPLE_REMARK_SPEED => c"a motion faster than shear waves in the tissue: a longer ramp is slower",
        SUPPLE_REMARK_COUNTED_FROM_ONE => {
            c"supports of nodes far from each other: are nodes counted from one? The first is 0"
        }
        SUPPLE_REMARK_OTHER_TISSUE => c"a network that learned from other tissue: its error here is not known",
        SUPPLE_REMARK_THIN => {
            c"an instrument thinner than edges of the surface are long: it needs the surface's triangles"
        }
        SUPPLE_REMARK_INSIDE => c"an instrument that starts within the body: let its path begin outside",
        SUPPLE_REMARK_FAR => c"an instrument far away from the body: is it in metres?",
        SUPPLE_REMARK_FAR_TARGET => c"a pull to a target far away from its point: is it in metres?",
        SUPPLE_REMARK_HELD_PULL => c"a pull all of whose nodes are held: it moves nothing",
        _ => c"?",
    };
    text.as_ptr()
}
