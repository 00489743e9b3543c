//! Fibres of tissues, for C: their constants, their directions, and the memory that they take.

use crate::element::FibreTile;
use crate::material::{Directions, Element, Fibres};
use crate::scene::fibre_tiles_for;

use super::memory::{Layout, array};
use super::scene::{EXTENDS, supple_scene, supple_scene_config, tissues_of};
use super::status::{Answer, supple_error, supple_status};
use supple_status::*;

/// The fibres of a tissue: an energy of their stretch that is added to that of the law, with up to three terms. Each has the
/// constants `a` (Pa) and `b` (no unit), in this order, both finite and positive; `a` = 0: no such term, and `b` is ignored.
/// Families of fibres resist where they are longer than at rest, not where they are shorter.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_fibres {
    /// Of the stretch along the first direction of each element: fibres.
    pub fibres: [f32; 2],
    /// Of the stretch along the second one: sheets, or a second family.
    pub sheets: [f32; 2],
    /// Of the shear between both.
    pub coupling: [f32; 2],
}
const _: () = assert!(size_of::<supple_fibres>() == size_of::<Fibres>());

/// Bytes of memory that a scene with fibres needs more than supple_scene_size; zero if there can be no such scene.
/// SUPPLE_FIBRES_SIZE is the same as a constant.
///
/// @param element SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
#[unsafe(no_mangle)]
pub extern "C" fn supple_fibres_size(nodes: u32, elements: u32, tissues: u32, element: u32) -> usize {
    let Some(element) = Element::of_code(element) else { return 0 };
    let with = with_fibres(Layout::of::<supple_scene>(), [nodes, elements, tissues], tissues, element);
    with.bytes().saturating_sub(Layout::of::<supple_scene>().bytes())
}

/// A scene with fibres of so many tissues, all or none.
pub(super) fn with_fibres(
    layout: Layout,
    [nodes, elements, tissues]: [u32; 3],
    fibres: u32,
    element: Element,
) -> Layout {
    layout.and::<Fibres>(fibres as usize).and::<FibreTile>(direction_tiles([nodes, elements, tissues], fibres, element))
}

/// Tiles of directions in a scene with fibres of so many tissues, all or none.
pub(super) const fn direction_tiles([nodes, elements, tissues]: [u32; 3], fibres: u32, element: Element) -> usize {
    if fibres == 0 { 0 } else { fibre_tiles_for(element, nodes as usize, elements as usize, tissues as usize) }
}

/// The fibres of the tissues, and the directions of the elements; neither where no tissue has fibres.
///
/// # Safety
/// The arrays are there, as the header asks.
pub(super) unsafe fn fibres_of(config: &supple_scene_config) -> Answer<(&[supple_fibres], &[Directions])> {
    if config.fibres.is_null() {
        return Ok((&[], &[]));
    }
    let tissues = tissues_of(config)?;
    // SAFETY: the caller's promise.
    let given = unsafe { array(config.fibres, tissues as usize)? };
    let mut are_there = false;
    for (tissue, fibres) in given.iter().enumerate() {
        are_there |= fibres_in(tissue, fibres)?.are_there();
    }
    if !are_there {
        return Ok((&[], &[]));
    }
    if config.directions.is_null() {
        return Err(supple_error::from(SUPPLE_E_DIRECTION).value(0.0, config.elements.into()));
    }
    // SAFETY: the caller's promise; both are six floats.
    Ok((given, unsafe { array(config.directions.cast(), config.elements as usize)? }))
}

/// The fibres of a tissue.
pub(super) fn fibres_in(tissue: usize, given: &supple_fibres) -> Answer<Fibres> {
    let terms = [given.fibres, given.sheets, given.coupling].map(|[a, b]| (a != 0.0).then_some([a, b]));
    let count = terms.iter().flatten().count();
    if !EXTENDS && count > 0 {
        return Err(supple_error::from(SUPPLE_E_CHOICE).at(tissue).value(count as f64, 0.0));
    }
    Fibres::new(terms)
        .map_err(|error| supple_error::from(SUPPLE_E_FIBRES).at(tissue).axis(error.term).value(error.value.into(), 0.0))
}
