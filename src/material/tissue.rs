//! What the elements of a mesh are made of: one tissue for all, or one of several for each element.

use super::Law;
use crate::simd::Real;

/// A law with a density.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tissue<L> {
    /// The hyperelastic law with its constants.
    pub law: L,
    /// Density at rest, kg/m^3.
    pub density: f32,
}

/// Which tetrahedra a scene is made of.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
#[cfg_attr(
    any(feature = "safetensors", feature = "train"),
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Element {
    /// Linear tetrahedra, each with the pressure of its own volume. They lock, that is bend too little, where tissue hardly
    /// changes its volume (a Poisson's ratio above 0.45 or so).
    #[default]
    Linear,
    /// The same with the mean of the nodes' pressures: see [`NodalPressure`].
    NodalPressure,
    /// Stresses from the mean strain around each node: see [`NodalStrain`].
    NodalStrain,
}

impl Element {
    /// Every element.
    pub const ALL: [Self; 3] = [Self::Linear, Self::NodalPressure, Self::NodalStrain];

    /// Its name in scene files, recipes and results.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::NodalPressure => "nodal-pressure",
            Self::NodalStrain => "nodal-strain",
        }
    }

    pub(crate) const fn is_nodal_pressure(self) -> bool {
        matches!(self, Self::NodalPressure)
    }

    pub(crate) const fn is_nodal_strain(self) -> bool {
        matches!(self, Self::NodalStrain)
    }

    /// Its number in weight files and in C.
    #[must_use]
    pub const fn code(self) -> u32 {
        self as u32
    }
}

/// The tissue of each element. A scene with one [`Tissue`] does not pay for the choice.
pub trait Material: Sync {
    /// The law all elements share; its constants may differ.
    type Law: Law;

    /// Which tetrahedra: with [`NodalPressure`] around a material those.
    const ELEMENT: Element = Element::Linear;

    /// The tissue of mesh element `element`, or nothing where the material names none.
    fn tissue(&self, element: usize) -> Option<Tissue<Self::Law>>;

    /// The constants of all elements.
    fn laws(&self) -> Laws<'_, Self::Law>;

    /// Index of the tissue of mesh element `element`. With [`NodalPressure`] the volume around a node is averaged over the
    /// elements of one index, so that no pressure is smeared across where tissues meet.
    fn region(&self, _element: usize) -> u16 {
        0
    }
}

/// The same material in tetrahedra with average nodal pressure (Bonet & Burton 1998; for TLED with several tissues Joldes,
/// Wittek & Miller 2009), which do not lock where tissue hardly changes its volume: see [`crate::element`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodalPressure<M>(pub M);

impl<M: Material> Material for NodalPressure<M> {
    type Law = M::Law;

    const ELEMENT: Element = Element::NodalPressure;

    fn tissue(&self, element: usize) -> Option<Tissue<M::Law>> {
        self.0.tissue(element)
    }

    fn laws(&self) -> Laws<'_, M::Law> {
        self.0.laws()
    }

    fn region(&self, element: usize) -> u16 {
        self.0.region(element)
    }
}

/// The same material in tetrahedra with stabilised nodal strain, which bend as they should on coarse meshes: all energy is taken at the
/// nodes, from the mean displacement gradient of the elements of one tissue around them, and a quadratic energy holds what the mean
/// does not see (Dohrmann et al. 2000; Puso & Solberg 2006). Under strains above a half elements at sharp edges may
/// turn inside out, and laws that stiffen much are too soft there.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodalStrain<M>(pub M);

impl<M: Material> Material for NodalStrain<M> {
    type Law = M::Law;

    const ELEMENT: Element = Element::NodalStrain;

    fn tissue(&self, element: usize) -> Option<Tissue<M::Law>> {
        self.0.tissue(element)
    }

    fn laws(&self) -> Laws<'_, M::Law> {
        self.0.laws()
    }

    fn region(&self, element: usize) -> u16 {
        self.0.region(element)
    }
}

/// The constants of each element, as the element loops want them.
#[derive(Clone, Copy, Debug)]
pub enum Laws<'a, L> {
    /// The same everywhere.
    One(L),
    /// By element.
    Regions {
        /// The tissues.
        tissues: &'a [Tissue<L>],
        /// For each element of the mesh the index of its tissue.
        of_element: &'a [u16],
        /// Of elements that the material does not name; a scene with such cannot be built.
        beyond: L,
    },
}

impl<L: Law> Laws<'_, L> {
    /// Whether elements may be of different tissues.
    #[inline(always)]
    pub(crate) const fn differ(&self) -> bool {
        matches!(self, Self::Regions { .. })
    }

    /// The constants of mesh element `element`.
    #[must_use]
    #[inline(always)]
    pub fn of(&self, element: usize) -> L {
        match *self {
            Self::One(law) => law,
            Self::Regions { tissues, of_element, beyond } => {
                let tissue = of_element.get(element).and_then(|&index| tissues.get(usize::from(index)));
                tissue.map_or(beyond, |tissue| tissue.law)
            }
        }
    }

    /// Lane `l` takes the constants of element `element(l)`.
    #[inline(always)]
    pub(crate) fn widen<R: Real>(&self, element: impl Fn(usize) -> usize) -> L::Wide<R> {
        match *self {
            Self::One(law) => L::widen(|_| law),
            Self::Regions { .. } => L::widen(|lane| self.of(element(lane))),
        }
    }
}

impl<L: Law> Material for Tissue<L> {
    type Law = L;

    fn tissue(&self, _element: usize) -> Option<Self> {
        Some(*self)
    }

    fn laws(&self) -> Laws<'_, L> {
        Laws::One(self.law)
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

    fn laws(&self) -> Laws<'_, L> {
        Laws::Regions { tissues: self.tissues, of_element: self.of_element, beyond: L::default() }
    }

    fn region(&self, element: usize) -> u16 {
        self.of_element.get(element).copied().unwrap_or_default()
    }
}
