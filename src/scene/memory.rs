//! What tissue that relaxes remembers ([`crate::element`]): how much of it a state of a scene keeps, and where.

use core::ops::Range;

use super::{SceneFacts, SceneView, fibre_tiles_for};
use crate::element::{Series, VECTORS_OF_TERM};
use crate::material::{Element, Material, Prony};

/// No fewer than [`SceneView::memory_vectors`] of any scene of so many nodes, elements and tissues, none of which
/// relaxes with more `terms`.
#[must_use]
pub const fn memory_vectors_for(
    element: Element,
    nodes: usize,
    elements: usize,
    tissues: usize,
    terms: usize,
) -> usize {
    let tiles = fibre_tiles_for(element, nodes, elements, tissues);
    tiles.saturating_mul(2 * VECTORS_OF_TERM).saturating_mul(terms)
}

/// Terms of the tissue that relaxes with most.
pub(super) fn terms_of(material: &impl Material) -> usize {
    material.prony().iter().map(Prony::terms).max().unwrap_or(0)
}

impl SceneFacts {
    /// Terms of the tissue that relaxes with most.
    pub(crate) const fn terms(&self) -> usize {
        self.terms
    }
}

impl<'a, M: Material> SceneView<'a, M> {
    /// Tiles of what relaxes: elements, or with nodal strain patches.
    pub(crate) fn relaxing_tiles(&self) -> usize {
        if self.element().is_nodal_strain() { self.patches.tiles().len() } else { self.tiles.len() }
    }

    /// The same of the elements or patches whose first partition is one of these.
    pub(crate) fn relaxing_tiles_of(&self, partitions: &Range<usize>) -> Range<usize> {
        let patches = self.element().is_nodal_strain();
        if patches { self.patches.tiles_of(partitions) } else { self.facts.partitions.tiles_of(partitions) }
    }

    /// Vectors of the memory of a tile, one copy.
    pub(crate) fn vectors_of_tile(&self) -> usize {
        // Without a look at the facts where no tissue can relax: its kernels are then left out.
        if self.material.prony().is_empty() { 0 } else { VECTORS_OF_TERM * self.facts.terms }
    }

    /// Vectors that a state keeps for tissue that relaxes ([`StateView::remembering`](crate::state::StateView::remembering)).
    #[must_use]
    pub fn memory_vectors(&self) -> usize {
        2 * self.relaxing_tiles() * self.vectors_of_tile()
    }

    /// A checksum of what relaxes, in its order: memory of a state stays where it is in a scene with the same.
    #[cfg(any(feature = "std", feature = "capi-neo-hookean", test))]
    pub(crate) fn memory_checksum(&self) -> u32 {
        let mut sum = crate::checksum::OfTables::new();
        if self.memory_vectors() > 0 {
            match self.element().is_nodal_strain() {
                true => self.patches.tiles().iter().for_each(|tile| sum.update(bytemuck::bytes_of(tile))),
                false => sum.update(bytemuck::must_cast_slice(self.tiles)),
            }
        }
        sum.number()
    }

    /// How tissue relaxes from the middle of the last step to that of the next, in step `step`; nothing if none does.
    pub(crate) fn series(&self, halves: [f32; 2], step: u64) -> Option<Series<'a>> {
        if self.vectors_of_tile() == 0 {
            return None;
        }
        let of_element = self.tissues_of_elements();
        Some(Series { tissues: self.material.prony(), of_element, terms: self.facts.terms, halves, step })
    }
}
