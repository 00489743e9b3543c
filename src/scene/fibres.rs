//! Fibres in a scene ([`crate::material::Fibres`]): the directions of its elements, or with nodal strain of its patches,
//! in the order of its tables.

use glam::DVec3;

use super::{BuildError, SceneFacts, SceneView, tiles_for};
use crate::element::{ElementTile, FibreTile, Fibrous, patch_tiles_for, unit_directions};
use crate::material::{Element, Fibres, Material};
use crate::simd::TILE;

/// Tiles of directions ([`FibreTile`]) that are enough for any scene of so many nodes, elements and tissues.
#[must_use]
pub const fn fibre_tiles_for(element: Element, nodes: usize, elements: usize, tissues: usize) -> usize {
    match element {
        Element::NodalStrain => patch_tiles_for(nodes, elements, tissues),
        _ => tiles_for(elements),
    }
}

/// Families of directions that the tissues need.
pub(super) fn families_of(material: &impl Material) -> usize {
    material.fibres().iter().map(Fibres::families).max().unwrap_or(0)
}

/// Unit vectors along the fibres of mesh element `element`, zeros where its tissue has none.
pub(super) fn directions_of(material: &impl Material, element: usize) -> [DVec3; 2] {
    // Another tissue may need a second direction, which has been checked where the element's own does.
    let given = material.directions().get(element);
    given.and_then(|given| unit_directions(given, 1)).unwrap_or_default()
}

/// That there are directions wherever fibres are.
pub(super) fn check_directions(material: &impl Material, elements: usize) -> Result<(), BuildError> {
    let (fibres, directions) = (material.fibres(), material.directions());
    if families_of(material) == 0 {
        return Ok(());
    }
    if directions.len() != elements {
        return Err(BuildError::DirectionCount { directions: directions.len(), elements });
    }
    for (element, given) in directions.iter().enumerate() {
        let families = fibres.get(usize::from(material.region(element))).map_or(0, Fibres::families);
        if families > 0 && unit_directions(given, families).is_none() {
            return Err(BuildError::Direction { element, fibre: given.fibre, sheet: given.sheet });
        }
    }
    Ok(())
}

/// Writes the directions of the elements in the order of their tiles.
pub(super) fn write_directions(
    material: &impl Material,
    tiles: &[ElementTile],
    fibres: &mut [FibreTile],
) -> Result<(), BuildError> {
    let (needed, capacity) = (tiles.len(), fibres.len());
    let Some(fibres) = fibres.get_mut(..needed) else { return Err(BuildError::FibreCapacity { needed, capacity }) };
    for (tile, fibres) in tiles.iter().zip(fibres) {
        *fibres = FibreTile::EMPTY;
        (0..TILE).for_each(|lane| fibres.write(lane, directions_of(material, tile.element(lane))));
    }
    Ok(())
}

impl SceneFacts {
    /// Families of directions that the fibres of the tissues need: none, one or both.
    pub(crate) const fn families(&self) -> usize {
        self.families
    }
}

impl<'a, M: Material> SceneView<'a, M> {
    /// The fibres; nothing if no tissue has any.
    #[inline]
    pub(crate) fn fibrous(&self) -> Option<Fibrous<'a>> {
        // Without a look at the facts where no tissue can have any: their kernels are then left out.
        if self.material.fibres().is_empty() || self.facts.families == 0 {
            return None;
        }
        let (tissues, families) = (self.material.fibres(), self.facts.families);
        Some(Fibrous { tissues, of_element: self.tissues_of_elements(), tiles: self.fibres, families })
    }
}
