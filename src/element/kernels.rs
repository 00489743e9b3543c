//! The loops over elements, compiled with this crate for each law of the list and each instruction-set level: nothing in them is
//! generic, so that no other crate compiles them again. Each is linked only where it is used. Where the law is known only at run
//! time ([`AnyLaw`]) a call looks once which it is.

use crate::material::{AnyLaw, Element, Law, for_each_law};
use crate::simd::{NodeVector, dispatch};

use super::{
    CriticalBounds, Extremes, InternalForces, MeanPressure, NoVisitor, PatchBounds, PatchForces,
    PatchTileBounds, ScalarBound, TileBounds, TileTangents,
};

/// The list of loops: `for_each_kernel!(each first..)` calls `each!` with `first..` and then with their names, arguments and results.
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
            /// Stiffness bounds of one tile.
            tile_bounds(TileBounds<'_, Self>) -> TileTangents;
            /// The same with nodal pressure.
            nodal_pressure_tile_bounds(TileBounds<'_, Self, MeanPressure<'_>>) -> TileTangents;
            /// Stiffness bounds of one tile of patches.
            patch_tile_bounds(PatchTileBounds<'_, Self>) -> TileTangents;
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

macro_rules! compile {
    ([$law:ty] $($(#[$doc:meta])* $name:ident($kernel:ty) -> $output:ty;)*) => {
        impl ElementLaw for $law {
            $(
                #[inline(never)]
                fn $name(kernel: $kernel) -> $output {
                    dispatch(kernel)
                }
            )*
        }
    };
    ($($variant:ident: $law:ty,)*) => {
        $(for_each_kernel! { compile [$law] })*
    };
}
for_each_law!(compile);

/// Goes on with the loop of the law that it is.
macro_rules! choose {
    ($kernel:ident $name:ident {$($variant:ident: $law:ty,)*}) => {
        match $kernel.laws().law() {
            $(AnyLaw::$variant(law) => <$law>::$name($kernel.of_law(law)),)*
        }
    };
    (among $laws:tt $($(#[$doc:meta])* $name:ident($kernel:ty) -> $output:ty;)*) => {
        impl ElementLaw for AnyLaw {
            $(
                fn $name(kernel: $kernel) -> $output {
                    choose! { kernel $name $laws }
                }
            )*
        }
    };
    ($($list:tt)*) => {
        for_each_kernel! { choose among {$($list)*} }
    };
}
for_each_law!(choose);

/// [`ElementLaw::tile_bounds`] for elements, from the volumes of the nodes where these need them.
pub(crate) fn tile_bounds<L: ElementLaw>(
    element: Element,
    kernel: TileBounds<'_, L>,
    rows: &[NodeVector],
) -> TileTangents {
    if element.is_nodal_pressure() {
        L::nodal_pressure_tile_bounds(kernel.with_nodal_volumes(rows))
    } else {
        L::tile_bounds(kernel)
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
