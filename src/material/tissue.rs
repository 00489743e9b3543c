//! What the elements of a mesh are made of: one tissue for all, or one of several for each element.

use super::{AnyLaw, Directions, Fibres, Law, Prony, Values};
use crate::simd::{Real, TILE};

/// A law with a density.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Tissue<L> {
    /// The hyperelastic law with its constants.
    pub law: L,
    /// Density at rest, kg/m^3.
    pub density: f32,
}

/// The numbers of a [`Tissue`], whose law is known from elsewhere: an entry of [`Regions`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct TissueValues {
    /// Constants of the law ([`Law::values`]).
    pub constants: Values,
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
    /// Linear tetrahedra, each with the pressure of its own volume. They lock, that is bend too little, where tissue
    /// hardly changes its volume (a Poisson's ratio above 0.45 or so).
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

    /// The element of a [`Element::code`].
    #[must_use]
    pub fn of_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|element| element.code() == code)
    }

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
    #[inline(always)]
    fn element(&self) -> Element {
        Element::Linear
    }

    /// The tissue of mesh element `element`, or nothing where the material names none.
    fn tissue(&self, element: usize) -> Option<Tissue<Self::Law>>;

    /// The law, with the constants of each element.
    fn laws(&self) -> Laws<'_, Self::Law>;

    /// Index of the tissue of mesh element `element`. With [`NodalPressure`] the volume around a node is averaged over
    /// the elements of one index, so that no pressure is smeared across where tissues meet.
    fn region(&self, _element: usize) -> u16 {
        0
    }

    /// How the tissues relax, by index; those that are not listed do not.
    #[inline(always)]
    fn prony(&self) -> &[Prony] {
        &[]
    }

    /// The fibres of the tissues, by index; those that are not listed have none.
    #[inline(always)]
    fn fibres(&self) -> &[Fibres] {
        &[]
    }

    /// The directions of the fibres by mesh element, which a scene is built with.
    #[inline(always)]
    fn directions(&self) -> &[Directions] {
        &[]
    }
}

/// The same material in tetrahedra with average nodal pressure (Bonet & Burton 1998; for TLED with several tissues
/// Joldes, Wittek & Miller 2009), which do not lock where tissue hardly changes its volume: see [`crate::element`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodalPressure<M>(pub M);

/// The same material in tetrahedra with stabilised nodal strain, which bend as they should on coarse meshes: all energy
/// is taken at the nodes, from the mean displacement gradient of the elements of one tissue around them, and a
/// quadratic energy holds what the mean does not see (Dohrmann et al. 2000; Puso & Solberg 2006). Elements that are
/// crushed to less than half of their volume, as at clamped edges, resist by an energy of their own:
///
/// ```text
/// E = sum_a V_a Psi(F_a) + s mu / 2 (sum_e V_e |H_e|^2 - sum_a V_a |H_a|^2) + sum_e V_e mu / 6 I1_e h(J_e)
/// F_a = I + H_a,   H_a = (1 / V_a) sum_{e with a} V_e / 4 H_e,   s = 0.4,   mu = 2 W'(0)
/// h(J) = 1.5 (0.5 - J)^2 / (0.5 J) for J < 0.5, along its tangent below 0.15; else 0
/// ```
/// Laws that stiffen much are too soft under strains above a half, as neither energy of elements stiffens.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodalStrain<M>(pub M);

/// The same material in other tetrahedra.
macro_rules! other_elements {
    ($($element:ident,)*) => {
        $(
            impl<M: Material> Material for $element<M> {
                type Law = M::Law;

                #[inline(always)]
                fn element(&self) -> Element {
                    Element::$element
                }

                fn tissue(&self, element: usize) -> Option<Tissue<M::Law>> {
                    self.0.tissue(element)
                }

                fn laws(&self) -> Laws<'_, M::Law> {
                    self.0.laws()
                }

                fn region(&self, element: usize) -> u16 {
                    self.0.region(element)
                }

                #[inline(always)]
                fn prony(&self) -> &[Prony] {
                    self.0.prony()
                }

                #[inline(always)]
                fn fibres(&self) -> &[Fibres] {
                    self.0.fibres()
                }

                #[inline(always)]
                fn directions(&self) -> &[Directions] {
                    self.0.directions()
                }
            }
        )*
    };
}
other_elements!(NodalPressure, NodalStrain,);

/// The constants of each element, as the element loops want them.
#[derive(Clone, Copy, Debug)]
pub enum Laws<'a, L> {
    /// The same everywhere.
    One(L),
    /// By element.
    Regions {
        /// Which law; its own constants count where none are listed, and a scene with such elements cannot be built.
        law: L,
        /// The constants of the tissues.
        tissues: &'a [TissueValues],
        /// For each element of the mesh the index of its tissue.
        of_element: &'a [u16],
    },
}

/// The tissue of mesh element `element`, if there is one.
#[inline(always)]
fn tissue_of<'a>(tissues: &'a [TissueValues], of_element: &[u16], element: usize) -> Option<&'a TissueValues> {
    tissues.get(usize::from(*of_element.get(element)?))
}

impl<'a, L: Law> Laws<'a, L> {
    /// Which law, with the constants of some tissue.
    pub(crate) const fn law(&self) -> L {
        match *self {
            Self::One(law) | Self::Regions { law, .. } => law,
        }
    }

    /// Whether elements may be of different tissues.
    #[inline(always)]
    pub(crate) const fn has_several_tissues(&self) -> bool {
        matches!(self, Self::Regions { .. })
    }

    /// The tissue of mesh element `element`.
    pub(crate) fn tissue(&self, element: usize) -> u16 {
        match *self {
            Self::One(_) => 0,
            Self::Regions { of_element, .. } => of_element.get(element).copied().unwrap_or_default(),
        }
    }

    /// The same, for kernels that are compiled for no law of their own.
    pub(crate) fn any(self) -> Laws<'a, AnyLaw>
    where
        L: Into<AnyLaw>,
    {
        match self {
            Self::One(law) => Laws::One(law.into()),
            Self::Regions { law, tissues, of_element } => Laws::Regions { law: law.into(), tissues, of_element },
        }
    }

    /// The constants of mesh element `element`.
    #[must_use]
    #[inline(always)]
    pub fn of(&self, element: usize) -> L {
        match *self {
            Self::One(law) => law,
            Self::Regions { law, tissues, of_element } => {
                tissue_of(tissues, of_element, element).map_or(law, |tissue| law.with(tissue.constants))
            }
        }
    }

    /// Lane `l` takes the constants of element `element(l)`.
    #[inline(always)]
    pub(crate) fn widen<R: Real>(&self, element: impl Fn(usize) -> usize) -> L::Wide<R> {
        match *self {
            Self::One(law) => law.splat(),
            Self::Regions { law, tissues, of_element } => {
                // Each element is looked up once, not for each constant. Vectors come in pairs.
                let mut rows = [law.values(); 2 * TILE];
                for (lane, row) in rows.iter_mut().enumerate().take(R::COUNT) {
                    if let Some(tissue) = tissue_of(tissues, of_element, element(lane)) {
                        *row = tissue.constants;
                    }
                }
                law.widen(core::array::from_fn(|constant| R::from_fn(|lane| rows[lane % rows.len()][constant])))
            }
        }
    }
}

impl<L: Law> Tissue<L> {
    /// Without the law itself: an entry of [`Regions`].
    #[must_use]
    pub fn values(&self) -> TissueValues {
        TissueValues { constants: self.law.values(), density: self.density }
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

/// Several tissues of one law in one mesh: element `e` is of tissue `tissues[of_element[e]]`. With as many tissues as
/// elements each element has its own constants.
#[derive(Clone, Copy, Debug)]
pub struct Regions<'a, L> {
    /// Which law; its own constants are not used.
    pub law: L,
    /// The tissues: see [`Tissue::values`].
    pub tissues: &'a [TissueValues],
    /// For each element of the mesh the index of its tissue.
    pub of_element: &'a [u16],
}

impl<L: Law> Material for Regions<'_, L> {
    type Law = L;

    fn tissue(&self, element: usize) -> Option<Tissue<L>> {
        let &TissueValues { constants, density } = tissue_of(self.tissues, self.of_element, element)?;
        Some(Tissue { law: self.law.with(constants), density })
    }

    fn laws(&self) -> Laws<'_, L> {
        let Self { law, tissues, of_element } = *self;
        Laws::Regions { law, tissues, of_element }
    }

    fn region(&self, element: usize) -> u16 {
        self.of_element.get(element).copied().unwrap_or_default()
    }
}

/// Tissues in tetrahedra, which are known only when the program runs, as is the law: because a file or a host has named
/// them. All that steps are made of is compiled once for this; the loops over elements are those of each law.
#[derive(Clone, Copy, Debug)]
pub struct AnyMaterial<'a, L = AnyLaw> {
    /// Which tetrahedra.
    pub element: Element,
    /// Which law all tissues have; its own constants are not used.
    pub law: L,
    /// One tissue for all elements, or several.
    pub tissues: &'a [TissueValues],
    /// For each element of the mesh the index of its tissue; not read where there is only one.
    pub of_element: &'a [u16],
    /// How the tissues relax, by index; those that are not listed do not.
    pub prony: &'a [Prony],
    /// The fibres of the tissues, by index; those that are not listed have none.
    pub fibres: &'a [Fibres],
    /// Their directions, by mesh element: read when a scene is built.
    pub directions: &'a [Directions],
}

impl<'a, L: Law> AnyMaterial<'a, L> {
    const fn regions(&self) -> Regions<'a, L> {
        let Self { law, tissues, of_element, .. } = *self;
        Regions { law, tissues, of_element }
    }

    pub(crate) fn laws_of_all(&self) -> Laws<'a, L> {
        let Self { law, tissues, of_element, .. } = *self;
        match tissues {
            [only] => Laws::One(law.with(only.constants)),
            _ => Laws::Regions { law, tissues, of_element },
        }
    }
}

impl<L: Law> Material for AnyMaterial<'_, L> {
    type Law = L;

    #[inline]
    fn element(&self) -> Element {
        self.element
    }

    fn tissue(&self, element: usize) -> Option<Tissue<L>> {
        match self.tissues {
            &[TissueValues { constants, density }] => Some(Tissue { law: self.law.with(constants), density }),
            _ => self.regions().tissue(element),
        }
    }

    fn laws(&self) -> Laws<'_, L> {
        self.laws_of_all()
    }

    fn region(&self, element: usize) -> u16 {
        if self.tissues.len() == 1 { 0 } else { self.regions().region(element) }
    }

    #[inline]
    fn prony(&self) -> &[Prony] {
        self.prony
    }

    #[inline]
    fn fibres(&self) -> &[Fibres] {
        self.fibres
    }

    #[inline]
    fn directions(&self) -> &[Directions] {
        self.directions
    }
}

/// [`AnyMaterial`] that owns its tissues.
#[cfg(feature = "std")]
#[derive(Clone, Debug)]
pub struct VecMaterial {
    /// Which tetrahedra.
    pub element: Element,
    /// See [`AnyMaterial::law`].
    pub law: AnyLaw,
    /// See [`AnyMaterial::tissues`].
    pub tissues: std::vec::Vec<TissueValues>,
    /// See [`AnyMaterial::of_element`].
    pub of_element: std::vec::Vec<u16>,
    /// See [`AnyMaterial::prony`].
    pub prony: std::vec::Vec<Prony>,
    /// See [`AnyMaterial::fibres`].
    pub fibres: std::vec::Vec<Fibres>,
    /// See [`AnyMaterial::directions`].
    pub directions: std::vec::Vec<Directions>,
}

#[cfg(feature = "std")]
impl VecMaterial {
    /// One tissue for all elements.
    pub fn one(element: Element, law: impl Into<AnyLaw>, density: f32) -> Self {
        let law = law.into();
        let tissues = std::vec![Tissue { law, density }.values()];
        let (of_element, prony) = (std::vec::Vec::new(), std::vec::Vec::new());
        let (fibres, directions) = (std::vec::Vec::new(), std::vec::Vec::new());
        Self { element, law, tissues, of_element, prony, fibres, directions }
    }

    fn view(&self) -> AnyMaterial<'_> {
        let Self { element, law, tissues, of_element, prony, fibres, directions } = self;
        AnyMaterial { element: *element, law: *law, tissues, of_element, prony, fibres, directions }
    }
}

#[cfg(feature = "std")]
impl Material for VecMaterial {
    type Law = AnyLaw;

    #[inline]
    fn element(&self) -> Element {
        self.element
    }

    fn tissue(&self, element: usize) -> Option<Tissue<AnyLaw>> {
        self.view().tissue(element)
    }

    fn laws(&self) -> Laws<'_, AnyLaw> {
        self.view().laws_of_all()
    }

    fn region(&self, element: usize) -> u16 {
        self.view().region(element)
    }

    #[inline]
    fn prony(&self) -> &[Prony] {
        &self.prony
    }

    #[inline]
    fn fibres(&self) -> &[Fibres] {
        &self.fibres
    }

    #[inline]
    fn directions(&self) -> &[Directions] {
        &self.directions
    }
}
