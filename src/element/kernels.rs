//! The loops over elements, compiled with this crate for each law of the list and each instruction-set level: nothing in them is
//! generic, so that no other crate compiles them again. Each is linked only where it is used.

#[cfg(any(feature = "std", test))]
use crate::material::{AnyLaw, Element, Exponential, Literal, NeoHookean, NodalPressure, NodalStrain};
use crate::material::{Law, for_each_law};
use crate::simd::{NodeVector, dispatch};

use super::{
    CriticalBounds, ElementMaterial, Extremes, InternalForces, MeanPressure, NoVisitor, PatchBounds,
    PatchForces, PatchTileBounds, ScalarBound, TileBounds, TileTangents,
};

/// A law with its kernels.
pub trait ElementLaw: Law {
    /// Internal forces.
    #[doc(hidden)]
    fn forces(kernel: InternalForces<'_, Self, NoVisitor>) -> Extremes<f32>;
    /// The same with the scalar stiffness bound of each element.
    #[doc(hidden)]
    fn forces_and_bounds(kernel: InternalForces<'_, Self, ScalarBound>) -> Extremes<f32>;
    /// Internal forces with nodal pressure.
    #[doc(hidden)]
    fn nodal_pressure_forces(kernel: InternalForces<'_, Self, NoVisitor, MeanPressure<'_>>) -> Extremes<f32>;
    /// The same with the scalar stiffness bound of each element.
    #[doc(hidden)]
    fn nodal_pressure_forces_and_bounds(
        kernel: InternalForces<'_, Self, ScalarBound, MeanPressure<'_>>,
    ) -> Extremes<f32>;
    /// Internal forces with nodal strain.
    #[doc(hidden)]
    fn patch_forces(kernel: PatchForces<'_, Self, NoVisitor>) -> Extremes<f32>;
    /// The same with scalar stiffness bounds.
    #[doc(hidden)]
    fn patch_forces_and_bounds(kernel: PatchForces<'_, Self, ScalarBound>) -> Extremes<f32>;
    /// Bounds for the critical step with nodal strain.
    #[doc(hidden)]
    fn patch_bounds(kernel: PatchBounds<'_, '_, Self>);
    /// Bounds for the critical step.
    #[doc(hidden)]
    fn critical_bounds(kernel: CriticalBounds<'_, '_, Self>);
    /// The same with nodal pressure.
    #[doc(hidden)]
    fn nodal_pressure_critical_bounds(kernel: CriticalBounds<'_, '_, Self, MeanPressure<'_>>);
    /// Stiffness bounds of one tile.
    #[doc(hidden)]
    fn tile_bounds(kernel: TileBounds<'_, Self>) -> TileTangents;
    /// The same with nodal pressure.
    #[doc(hidden)]
    fn nodal_pressure_tile_bounds(kernel: TileBounds<'_, Self, MeanPressure<'_>>) -> TileTangents;
    /// Stiffness bounds of one tile of patches.
    #[doc(hidden)]
    fn patch_tile_bounds(kernel: PatchTileBounds<'_, Self>) -> TileTangents;
}

/// [`ElementLaw::tile_bounds`] for a material, from the volumes of the nodes where it needs them.
pub(crate) fn tile_bounds<M: ElementMaterial>(
    kernel: TileBounds<'_, M::Law>,
    rows: &[NodeVector],
) -> TileTangents {
    if M::ELEMENT.is_nodal_pressure() {
        M::Law::nodal_pressure_tile_bounds(kernel.with_nodal_volumes(rows))
    } else {
        M::Law::tile_bounds(kernel)
    }
}

/// A visitor with which the internal forces of every law are compiled.
pub(crate) trait ForcesVisitor<L: ElementLaw>: Copy + Sync {
    fn forces(kernel: InternalForces<'_, L, Self>) -> Extremes<f32>;
    fn nodal_pressure_forces(kernel: InternalForces<'_, L, Self, MeanPressure<'_>>) -> Extremes<f32>;
    fn patch_forces(kernel: PatchForces<'_, L, Self>) -> Extremes<f32>;
}

impl<L: ElementLaw> ForcesVisitor<L> for NoVisitor {
    fn forces(kernel: InternalForces<'_, L, Self>) -> Extremes<f32> {
        L::forces(kernel)
    }

    fn nodal_pressure_forces(kernel: InternalForces<'_, L, Self, MeanPressure<'_>>) -> Extremes<f32> {
        L::nodal_pressure_forces(kernel)
    }

    fn patch_forces(kernel: PatchForces<'_, L, Self>) -> Extremes<f32> {
        L::patch_forces(kernel)
    }
}

impl<L: ElementLaw> ForcesVisitor<L> for ScalarBound {
    fn forces(kernel: InternalForces<'_, L, Self>) -> Extremes<f32> {
        L::forces_and_bounds(kernel)
    }

    fn nodal_pressure_forces(kernel: InternalForces<'_, L, Self, MeanPressure<'_>>) -> Extremes<f32> {
        L::nodal_pressure_forces_and_bounds(kernel)
    }

    fn patch_forces(kernel: PatchForces<'_, L, Self>) -> Extremes<f32> {
        L::patch_forces_and_bounds(kernel)
    }
}

macro_rules! kernels {
    ($($variant:ident: $law:ty,)*) => {
        $(
            impl ElementLaw for $law {
                #[inline(never)]
                fn forces(kernel: InternalForces<'_, Self, NoVisitor>) -> Extremes<f32> {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn forces_and_bounds(kernel: InternalForces<'_, Self, ScalarBound>) -> Extremes<f32> {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn nodal_pressure_forces(
                    kernel: InternalForces<'_, Self, NoVisitor, MeanPressure<'_>>,
                ) -> Extremes<f32> {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn nodal_pressure_forces_and_bounds(
                    kernel: InternalForces<'_, Self, ScalarBound, MeanPressure<'_>>,
                ) -> Extremes<f32> {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn patch_forces(kernel: PatchForces<'_, Self, NoVisitor>) -> Extremes<f32> {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn patch_forces_and_bounds(kernel: PatchForces<'_, Self, ScalarBound>) -> Extremes<f32> {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn patch_bounds(kernel: PatchBounds<'_, '_, Self>) {
                    dispatch(kernel);
                }
                #[inline(never)]
                fn critical_bounds(kernel: CriticalBounds<'_, '_, Self>) {
                    dispatch(kernel);
                }
                #[inline(never)]
                fn nodal_pressure_critical_bounds(kernel: CriticalBounds<'_, '_, Self, MeanPressure<'_>>) {
                    dispatch(kernel);
                }
                #[inline(never)]
                fn nodal_pressure_tile_bounds(
                    kernel: TileBounds<'_, Self, MeanPressure<'_>>,
                ) -> TileTangents {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn patch_tile_bounds(kernel: PatchTileBounds<'_, Self>) -> TileTangents {
                    dispatch(kernel)
                }
                #[inline(never)]
                fn tile_bounds(kernel: TileBounds<'_, Self>) -> TileTangents {
                    dispatch(kernel)
                }
            }
        )*
    };
}
for_each_law!(kernels);

// Who has no operating system does not compare with the paper's figures, and need not compile these.
#[cfg(any(feature = "std", test))]
kernels! {
    LiteralNeoHookean: Literal<NeoHookean>,
    LiteralExponential: Literal<Exponential>,
}

/// Work that is compiled once for each law.
#[cfg(any(feature = "std", test))]
pub trait LawWork {
    /// What it gives.
    type Output;
    /// Does it with the type of the law; the constants may come from elsewhere.
    fn run<L: ElementLaw>(self, law: L) -> Self::Output;
}

macro_rules! with_any_law {
    ($($variant:ident: $law:ty,)*) => {
        /// Does `work` with a law that is known only when a file has named it.
        #[cfg(any(feature = "std", test))]
        pub fn with_law<W: LawWork>(law: AnyLaw, work: W) -> W::Output {
            match law {
                $(AnyLaw::$variant(law) => work.run(law),)*
                AnyLaw::LiteralNeoHookean(law) => work.run(law),
                AnyLaw::LiteralExponential(law) => work.run(law),
            }
        }
    };
}
for_each_law!(with_any_law);

/// Work that is compiled once for each kind of material.
#[cfg(any(feature = "std", test))]
pub trait MaterialWork {
    /// What it gives.
    type Output;
    /// Does it with a material.
    fn run<M: ElementMaterial>(self, material: M) -> Self::Output;
}

/// Does `work` with a material in tetrahedra that are known only when a file has named them.
#[cfg(any(feature = "std", test))]
pub fn with_element<M: ElementMaterial, W: MaterialWork>(
    element: Element,
    material: M,
    work: W,
) -> W::Output {
    match element {
        Element::Linear => work.run(material),
        Element::NodalPressure => work.run(NodalPressure(material)),
        Element::NodalStrain => work.run(NodalStrain(material)),
    }
}
