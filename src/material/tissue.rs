//! What the elements of a mesh are made of: one tissue for all, or one of several for each element.

use super::Law;

/// A law with a density.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tissue<L> {
    /// The hyperelastic law with its constants.
    pub law: L,
    /// Density at rest, kg/m^3.
    pub density: f32,
}

/// The tissue of each element. A scene with one [`Tissue`] does not pay for the choice.
pub trait Material {
    /// The law all elements share; its constants may differ.
    type Law: Law;

    /// The tissue of mesh element `element`, or nothing where the material names none.
    fn tissue(&self, element: usize) -> Option<Tissue<Self::Law>>;

    /// The constants of mesh element `element`, which [`Material::tissue`] knows.
    fn law(&self, element: usize) -> Self::Law;
}

impl<L: Law> Material for Tissue<L> {
    type Law = L;

    fn tissue(&self, _element: usize) -> Option<Self> {
        Some(*self)
    }

    #[inline(always)]
    fn law(&self, _element: usize) -> L {
        self.law
    }
}

/// Several tissues in one mesh: element `e` is of tissue `tissues[of_element[e]]`. With as many tissues as
/// elements each element has its own constants.
#[derive(Clone, Copy, Debug)]
pub struct Regions<'a, L> {
    /// The tissues.
    pub tissues: &'a [Tissue<L>],
    /// For each element of the mesh the index of its tissue.
    pub of_element: &'a [u16],
}

impl<L: Law + Default> Material for Regions<'_, L> {
    type Law = L;

    fn tissue(&self, element: usize) -> Option<Tissue<L>> {
        let index = usize::from(*self.of_element.get(element)?);
        self.tissues.get(index).copied()
    }

    #[inline(always)]
    fn law(&self, element: usize) -> L {
        // The scene was built, so every element has its tissue; the default is never reached.
        self.tissue(element).map_or_else(L::default, |tissue| tissue.law)
    }
}
