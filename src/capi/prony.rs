//! How tissue relaxes, for C: series of terms, and the memory that they take.

use crate::material::{Element, LONGEST, MOST_SHARE, MOST_TERMS, Prony, PronyError, SHORTEST};
use crate::scene::memory_vectors_for;
use crate::state::NodeVector;

use super::memory::{self, array};
use super::scene::{EXTENDS, supple_scene_config, tissues_of};
use super::status::{Answer, supple_error, supple_status};
use supple_status::*;

/// How a tissue relaxes: a Prony series of at most three terms. Of the stress that changes the shape, term `i` relaxes the
/// share `share[i]` with the time `seconds[i]`; pressure does not relax. The constants of the law are those of a motion
/// that is over before anything relaxes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct supple_prony {
    /// Positive, at most 0.99 in sum; 0: no such term.
    pub share: [f32; 3],
    /// From 1e-6 to 1e6 s; ignored where the share is 0.
    pub seconds: [f32; 3],
}
const _: () = assert!(size_of::<supple_prony>() == size_of::<Prony>());

/// Bytes of memory that a scene with tissue that relaxes needs more than supple_scene_size. SUPPLE_PRONY_SIZE is the same
/// as a constant.
#[unsafe(no_mangle)]
pub extern "C" fn supple_prony_size(tissues: u32) -> usize {
    let series = (tissues as usize).checked_mul(size_of::<Prony>());
    series.and_then(|bytes| bytes.checked_next_multiple_of(memory::SUPPLE_ALIGN)).unwrap_or(0)
}

/// Bytes of memory that the state of a scene with tissue that relaxes needs more than supple_state_size, for what the
/// tissue remembers. SUPPLE_RELAXATION_SIZE is the same as a constant.
///
/// @param element SUPPLE_LINEAR, SUPPLE_NODAL_PRESSURE or SUPPLE_NODAL_STRAIN.
/// @param terms of the tissue that has most: 1 to 3.
#[unsafe(no_mangle)]
pub extern "C" fn supple_relaxation_size(nodes: u32, elements: u32, tissues: u32, element: u32, terms: u32) -> usize {
    let [nodes, elements, tissues, terms] = [nodes, elements, tissues, terms].map(|count| count as usize);
    let vectors = |element| memory_vectors_for(element, nodes, elements, tissues, terms.min(MOST_TERMS));
    Element::of_code(element).map_or(0, vectors).checked_mul(size_of::<NodeVector>()).unwrap_or(0)
}

/// The series of the tissues, and how many terms the one with most has; none where no tissue relaxes.
///
/// # Safety
/// The arrays are there, as the header asks.
pub(super) unsafe fn series_of(config: &supple_scene_config) -> Answer<(&[supple_prony], usize)> {
    if config.prony.is_null() {
        return Ok((&[], 0));
    }
    let tissues = tissues_of(config)?;
    // SAFETY: the caller's promise.
    let given = unsafe { array(config.prony, tissues as usize)? };
    let mut most = 0;
    for (tissue, series) in given.iter().enumerate() {
        most = most.max(prony_of(tissue, series)?.terms());
    }
    Ok(if most == 0 { (&[], 0) } else { (given, most) })
}

/// The series of a tissue.
pub(super) fn prony_of(tissue: usize, given: &supple_prony) -> Answer<Prony> {
    let terms = given.share.into_iter().zip(given.seconds).enumerate().filter(|(_, (share, _))| *share != 0.0);
    let (mut found, mut places, mut count) = ([[0.0; 2]; MOST_TERMS], [0; MOST_TERMS], 0);
    for ((term, at), (place, (share, seconds))) in found.iter_mut().zip(&mut places).zip(terms) {
        (*term, *at, count) = ([share, seconds], place, count + 1);
    }
    if !EXTENDS && count > 0 {
        return Err(supple_error::from(SUPPLE_E_CHOICE).at(tissue).value(count as f64, 0.0));
    }
    Prony::new(found.get(..count).unwrap_or_default()).map_err(|error| {
        let is = |status: supple_status| supple_error::from(status).at(tissue);
        let place = |term: usize| places.get(term).copied().unwrap_or_default();
        match error {
            PronyError::Share { term, value } => {
                is(SUPPLE_E_RELAXATION_SHARE).axis(place(term)).value(value.into(), MOST_SHARE.into())
            }
            PronyError::Seconds { term, value } => {
                let limit = if value > LONGEST { LONGEST } else { SHORTEST };
                is(SUPPLE_E_RELAXATION_TIME).axis(place(term)).value(value.into(), limit.into())
            }
            PronyError::Sum { value } => is(SUPPLE_E_RELAXATION_SHARE).value(value.into(), MOST_SHARE.into()),
            PronyError::Count { terms } => is(SUPPLE_E_CAPACITY).value(terms as f64, MOST_TERMS as f64),
        }
    })
}
