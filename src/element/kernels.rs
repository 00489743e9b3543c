//! The loops over elements. For a law that is known only at run time ([`AnyLaw`]) they are compiled with this crate,
//! once for each instruction-set level: each batch of elements looks which law it is. For one law of the list alone
//! they are compiled where a typed program uses them, without the question. Either is linked only where it is used.

use crate::material::{AnyLaw, Element, Law, for_each_law};
use crate::simd::{NodeVector, dispatch};

use super::internal_forces::ElementVisitor;
use super::{
    CriticalBounds, ElementTangents, Extended, Extremes, InternalForces, MaybeBound, MeanPressure, NoVisitor,
    OwnPressure, PatchBounds, PatchForces, PatchTangents, ScalarBound, TileTangents,
};

/// The list of loops: `for_each_kernel!(each first..)` calls `each!` with `first..` and then with their names,
/// arguments and results.
macro_rules! for_each_kernel {
    ($each:ident $($first:tt)*) => {
        $each! {
            $($first)*
            /// Internal forces.
            forces(InternalForces<'_, Self, NoVisitor>) -> Extremes<f32>;
            /// The same with the scalar stiffness bound of each element.
            forces_and_bounds(InternalForces<'_, Self, ScalarBound>) -> Extremes<f32>;
            /// Internal forces with nodal pressure.
            nodal_pressure_forces(InternalForces<'_, Self, NoVisitor, MeanPressure<'_>>) -> Extremes<f32>;
            /// The same with the scalar stiffness bound of each element.
            nodal_pressure_forces_and_bounds(InternalForces<'_, Self, ScalarBound, MeanPressure<'_>>) -> Extremes<f32>;
            /// Internal forces with nodal strain.
            patch_forces(PatchForces<'_, Self, NoVisitor>) -> Extremes<f32>;
            /// The same with scalar stiffness bounds.
            patch_forces_and_bounds(PatchForces<'_, Self, ScalarBound>) -> Extremes<f32>;
            /// Bounds for the critical step with nodal strain.
            patch_bounds(PatchBounds<'_, '_, Self>) -> ();
            /// Bounds for the critical step.
            critical_bounds(CriticalBounds<'_, '_, Self>) -> ();
            /// The same with nodal pressure.
            nodal_pressure_critical_bounds(CriticalBounds<'_, '_, Self, MeanPressure<'_>>) -> ();
            /// Tangents of one tile.
            tangents(ElementTangents<'_, Self>) -> TileTangents;
            /// The same with nodal pressure.
            nodal_pressure_tangents(ElementTangents<'_, Self, MeanPressure<'_>>) -> TileTangents;
            /// Tangents of one tile of patches.
            patch_tangents(PatchTangents<'_, Self>) -> TileTangents;
        }
    };
}

macro_rules! declare {
    ($($(#[$doc:meta])* $name:ident($kernel:ty) -> $output:ty;)*) => {
        /// A law with its loops over elements.
        pub trait ElementLaw: Law + Into<AnyLaw> {
            $(
                $(#[$doc])*
                #[doc(hidden)]
                fn $name(kernel: $kernel) -> $output;
            )*
        }
    };
}
for_each_kernel!(declare);

macro_rules! implement {
    ([$law:ty, #[$inlining:meta]] $($(#[$doc:meta])* $name:ident($kernel:ty) -> $output:ty;)*) => {
        impl ElementLaw for $law {
            $(
                #[$inlining]
                fn $name(kernel: $kernel) -> $output {
                    dispatch(kernel)
                }
            )*
        }
    };
    ($($variant:ident: $law:ty,)*) => {
        $(for_each_kernel! { implement [$law, #[inline]] })*
    };
}
for_each_law!(implement);
for_each_kernel! { implement [AnyLaw, #[inline(never)]] }

/// [`ElementLaw::tangents`] for elements, from the volumes of the nodes where these need them.
pub(crate) fn tangents<L: ElementLaw>(
    element: Element,
    kernel: ElementTangents<'_, L>,
    rows: &[NodeVector],
) -> TileTangents {
    if element.is_nodal_pressure() {
        L::nodal_pressure_tangents(kernel.with_nodal_volumes(rows))
    } else {
        L::tangents(kernel)
    }
}

/// Internal forces of tissue with fibres or that relaxes: compiled once, for a law that is known at run time.
#[inline(never)]
pub(crate) fn extended_forces(
    kernel: InternalForces<'_, AnyLaw, MaybeBound, OwnPressure, Extended<'_>>,
) -> Extremes<f32> {
    dispatch(kernel)
}

/// The same with nodal pressure.
#[inline(never)]
pub(crate) fn extended_nodal_pressure_forces(
    kernel: InternalForces<'_, AnyLaw, MaybeBound, MeanPressure<'_>, Extended<'_>>,
) -> Extremes<f32> {
    dispatch(kernel)
}

/// The same with nodal strain.
#[inline(never)]
pub(crate) fn extended_patch_forces(kernel: PatchForces<'_, AnyLaw, MaybeBound, Extended<'_>>) -> Extremes<f32> {
    dispatch(kernel)
}

/// A visitor with which the internal forces of every law are compiled.
pub(crate) trait ForcesVisitor<L: ElementLaw>: ElementVisitor + Copy + Sync {
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
