//! Pressure that follows the surface, for C ([`crate::pressure`]).

use core::ffi::c_void;

use crate::heap_sort;
use crate::loads::LoadError;
use crate::pressure::{PressedTriangle, Pressure, SurfacePressure};

use super::loads::supple_loads;
use super::memory::{self, Arrays, Head, Layout, Object, Place, array, magic, place_for, place_if_wanted};
use super::scene::{OpenScene, supple_scene};
use super::state::{supple_state, vectors};
use super::status::{Answer, mismatch, status_of, supple_error, supple_status};
use supple_status::*;

/// Pressures on surfaces of a body, which follow them as they move. One thread at a time. It may be copied with memcpy.
#[repr(C, align(64))]
pub struct supple_pressure {
    head: Head,
    /// Of the scene.
    nodes: u32,
    triangles: u32,
    surfaces: u32,
}

// SAFETY: `repr(C)`, begins with a head.
unsafe impl Object for supple_pressure {
    const MAGIC: [u8; 8] = magic(b'P');
    const FRONT: usize = 64;
}

/// Bytes before the arrays of pressures.
pub const SUPPLE_PRESSURE_FRONT: usize = 64;
const _: () = assert!(SUPPLE_PRESSURE_FRONT == <supple_pressure as Object>::FRONT);

const fn layout(triangles: u32, surfaces: u32) -> Layout {
    Layout::of::<supple_pressure>().and::<PressedTriangle>(triangles as usize).and::<SurfacePressure>(surfaces as usize)
}

/// Bytes of memory that pressures on so many triangles and surfaces need. SUPPLE_PRESSURE_SIZE is the same as a
/// constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_pressure_size(triangles: u32, surfaces: u32) -> usize {
    layout(triangles, surfaces).bytes()
}

/// Prepares pressures, zero yet, in `memory` of at least supple_pressure_size bytes, aligned to SUPPLE_ALIGN.
///
/// @param points the points that the scene was built from, three coordinates each (SUPPLE_E_POINTS).
/// @param triangles three nodes of each of `count` triangles, as of supple_boundary: seen from outside of the tissue
/// counter-clockwise.
/// @param surface_of the surface of each triangle, from zero; NULL: all are of surface 0.
/// @param surfaces how many there are, each with a pressure of its own.
/// @param error may be NULL; index is that of a triangle, of SUPPLE_E_POINTS that of an element.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_pressure_init(
    memory: *mut c_void,
    bytes: usize,
    scene: *const supple_scene,
    points: *const f32,
    triangles: *const u32,
    surface_of: *const u32,
    count: u32,
    surfaces: u32,
    pressure: *mut *mut supple_pressure,
    error: *mut supple_error,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let init = || unsafe {
        let (open, pressure) = (OpenScene::of(scene)?, place_for(pressure)?);
        let nodes = open.node_count();
        let points = array(points.cast::<[f32; 3]>(), nodes)?;
        let triangles = array(triangles.cast::<[u32; 3]>(), count as usize)?;
        let surface_of = if surface_of.is_null() { &[] } else { array(surface_of, count as usize)? };
        let made = || {
            triangles.iter().enumerate().map(|(index, &corners)| {
                let surface = surface_of.get(index).copied().unwrap_or(0);
                if surface >= surfaces {
                    return Err(LoadError::Surface { index, surface, surfaces: surfaces as usize });
                }
                PressedTriangle::new(points, index, corners, surface)
            })
        };
        for triangle in made() {
            triangle?;
        }
        open.has_points(points)?;
        let place = Place::new(memory, bytes, layout(count, surfaces))?;
        let mut arrays = place.arrays::<supple_pressure>();
        let room = arrays.change::<PressedTriangle>(count as usize);
        room.iter_mut().zip(made().flatten()).for_each(|(place, triangle)| *place = triangle);
        // Each change of the surface costs a sum over its triangles. An order that the host has chosen stays.
        if !room.is_sorted_by_key(|triangle| triangle.surface()) {
            heap_sort::sort(room, |triangle| (triangle.surface(), triangle.nodes()));
        }
        arrays.change::<SurfacePressure>(surfaces as usize).fill(SurfacePressure::default());
        let nodes = nodes as u32;
        pressure.write(place.put(|head| supple_pressure { head, nodes, triangles: count, surfaces }));
        Ok(SUPPLE_OK)
    };
    // SAFETY: as above.
    unsafe { memory::answered(init(), error) }
}

/// Sets the pressure on a surface, between two calls as you like.
///
/// @param pascal Pa: positive where it presses the tissue, from outside or from within a cavity.
/// @param ramp seconds from the start of the simulation over which it grows to that, zero or more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_pressure_set(
    pressure: *mut supple_pressure,
    surface: u32,
    pascal: f32,
    ramp: f32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    unsafe { change(pressure, surface, |old| SurfacePressure { pascal, ramp, ..old }) }
}

/// Asks for the volume within a closed surface, of a body or of a cavity: in addition to its pressure there is one from
/// within, `bulk` times the share of the volume that is missing. At rest the volume is short of that by the pressure that
/// the tissue needs over `bulk`. A bulk of up to five times Young's modulus is within the margin of exact steps. A surface that
/// is open or has no triangles is refused (SUPPLE_E_OPEN_SURFACE).
///
/// @param cubic_metres m^3, above zero.
/// @param bulk Pa; 0: the volume is not asked for.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_pressure_fill(
    pressure: *mut supple_pressure,
    surface: u32,
    cubic_metres: f32,
    bulk: f32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    unsafe { change(pressure, surface, |old| SurfacePressure { volume: cubic_metres, bulk, ..old }) }
}

/// Changes the pressure of a surface.
///
/// # Safety
/// As at [`memory::change`].
unsafe fn change(
    pressure: *mut supple_pressure,
    surface: u32,
    to: impl FnOnce(SurfacePressure) -> SurfacePressure,
) -> supple_status {
    // SAFETY: the caller's promise; entries were written when it was prepared.
    let set = || unsafe {
        let (object, mut arrays) = memory::open(pressure)?;
        let triangles = arrays.change::<PressedTriangle>(object.triangles as usize);
        let surfaces = arrays.change::<SurfacePressure>(object.surfaces as usize);
        let place = surfaces.get_mut(surface as usize).ok_or(missing(surface, object.surfaces))?;
        let asked = to(*place);
        asked.check(surface as usize)?;
        if asked.bulk > 0.0 {
            check_closed(surface, triangles)?;
        }
        *place = asked;
        Ok(SUPPLE_OK)
    };
    status_of(set())
}

fn missing(surface: u32, surfaces: u32) -> supple_error {
    supple_error::from(SUPPLE_E_CAPACITY).value(surface.into(), surfaces.into())
}

/// That a surface has a volume.
fn check_closed(surface: u32, triangles: &[PressedTriangle]) -> Answer<()> {
    let index = surface as usize;
    if !triangles.iter().any(|triangle| triangle.surface() == surface) {
        return Err(LoadError::Open { index }.into());
    }
    Ok(SurfacePressure::filling(1.0, 1.0, 0.0).check_on(index, triangles)?)
}

/// Lets pressures act where these loads do, as long as both are there; NULL: none do. A copy of the loads has the same
/// pressures.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_set_pressure(
    loads: *mut supple_loads,
    pressure: *const supple_pressure,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let set = || unsafe {
        let loads = memory::change(loads)?;
        if !pressure.is_null() {
            let nodes = memory::read(pressure)?.nodes;
            if nodes != loads.nodes() {
                return Err(mismatch(nodes as usize, loads.nodes() as usize));
            }
        }
        loads.set_pressure(pressure);
        Ok(SUPPLE_OK)
    };
    status_of(set())
}

/// Writes the volume within a closed surface at the displacements of a state, of a body or of a cavity, and the pressure
/// on it at its time, with what fills it. SUPPLE_E_NOT_FINITE where nodes are so far away that this is no number.
/// SUPPLE_E_CAPACITY: there is no such surface.
///
/// @param cubic_metres may be NULL; receives the volume, m^3; NaN of a surface that is open or has no triangles.
/// @param pascal may be NULL; receives the pressure, Pa, positive where it presses the tissue.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_pressure_now(
    pressure: *const supple_pressure,
    state: *const supple_state,
    surface: u32,
    cubic_metres: *mut f64,
    pascal: *mut f32,
) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let tell = || unsafe {
        let (volume, now) = (place_if_wanted(cubic_metres)?, place_if_wanted(pascal)?);
        let ([displacement, ..], state) = (vectors(state)?, memory::read(state)?);
        let &supple_pressure { nodes: there, triangles, surfaces, .. } = memory::read(pressure)?;
        if state.nodes != there {
            return Err(mismatch(state.nodes as usize, there as usize));
        }
        if surface >= surfaces {
            return Err(missing(surface, surfaces));
        }
        let is_closed = || check_closed(surface, Arrays::behind(pressure).read(triangles as usize)).is_ok();
        let (pressure, surface) = (opened(pressure)?, surface as usize);
        let is =
            (pressure.volume(surface, displacement), pressure.pascal(surface, state.progress.time(), displacement));
        if !(is.0.is_finite() && is.1.is_finite()) {
            return Err(supple_error::from(SUPPLE_E_NOT_FINITE));
        }
        if let Some(volume) = volume {
            volume.write(if is_closed() { is.0 } else { f64::NAN });
        }
        if let Some(now) = now {
            now.write(is.1);
        }
        Ok(SUPPLE_OK)
    };
    status_of(tell())
}

/// The pressures of an object.
///
/// # Safety
/// As at [`memory::read`].
pub(super) unsafe fn opened<'a>(pressure: *const supple_pressure) -> Answer<Pressure<'a>> {
    // SAFETY: the caller's promise; entries were written when it was prepared.
    unsafe {
        let &supple_pressure { triangles, surfaces, .. } = memory::read(pressure)?;
        let mut arrays = Arrays::behind(pressure);
        let triangles = arrays.read::<PressedTriangle>(triangles as usize);
        Ok(Pressure::unchecked(triangles, arrays.read::<SurfacePressure>(surfaces as usize)))
    }
}

impl supple_pressure {
    /// Of the scene.
    pub(super) const fn nodes(&self) -> u32 {
        self.nodes
    }
}
