//! Hyperelastic laws. A law is two scalar functions: the energy of distortion `W(x)` and of volume
//! `U(J)`, in Pa (J/m^3), with `x = I1bar - 3`, `I1bar = J^(-2/3) I1` (isochoric, stress-free at rest).
//! The paper (Meister et al. 2018, section 2) prints `x = I1 - 3`, which leaves a residual stress at rest.
//!
//! The first Piola-Kirchhoff stress is `P = p1 (F - cof F) + s cof F`, with `p1 = 2 W' g`,
//! `s = p1 + dPsi/dJ` and `g = J^(-2/3)`. `F - cof F` and `s` are both small at small strain and both are
//! computed from `grad u` without subtracting near-equal numbers, which the textbook form
//! `p1 F + pJ cof F` does: in float32 it loses five digits at a strain of 1e-3.
//!
//! Every function is finite for every `F`: below [`J_FLOOR`] the factor `g` goes on along its tangent,
//! so an inverted element is pushed back with a force that is still minus the gradient of the energy.
//!
//! A new law is one short file with a [`Potential`] and a [`Law`] (`neo_hookean.rs` is the example) and one line in the
//! list of laws below; scene files, weight files, the C API, the laboratory and the kernels of [`crate::element`] read
//! that list.

/// The list of laws, a file and a type each. The position in the list is the law's number in C and in weight files: a
/// line never moves. `for_each_law!(each first..)` calls `each!` with `first..`, then with the variant of [`AnyLaw`]
/// and the type of each law.
macro_rules! for_each_law {
    (@ $use:ident [$($given:tt)*]) => {
        $crate::material::for_each_law! {
            @ $use [$($given)*]
            neo_hookean NeoHookean,
            exponential Exponential,
            polynomial Polynomial,
        }
    };
    (@ modules [] $($file:ident $law:ident,)+) => {
        $(
            mod $file;
            pub use $file::$law;
        )+
    };
    (@ types [$each:ident $($first:tt)*] $($file:ident $law:ident,)+) => {
        $each! { $($first)* $($law: $crate::material::$law,)+ }
    };
    ($each:ident $($first:tt)*) => {
        $crate::material::for_each_law! { @ types [$each $($first)*] }
    };
}
pub(crate) use for_each_law;

for_each_law! { @ modules [] }
mod any;
mod fibres;
mod moduli;
mod prony;
mod response;
mod tissue;

pub use any::AnyLaw;
pub use exponential::EXPONENT_CAP;
pub(crate) use fibres::FibreTerm;
pub use fibres::{Directions, FIBRE_NAMES, FIBRE_TERMS, FibreError, Fibres};
pub use moduli::Moduli;
#[cfg(feature = "capi-neo-hookean")]
pub(crate) use prony::{LONGEST, MOST_SHARE, SHORTEST};
pub use prony::{MOST_TERMS, Prony, PronyError};
pub use response::{Invariants, Response};
pub(crate) use response::{LawState, VolumeFactor, energy_density, response, response_operations};
#[cfg(feature = "std")]
pub use tissue::VecMaterial;
pub use tissue::{AnyMaterial, Element, Laws, Material, NodalPressure, NodalStrain, Regions, Tissue, TissueValues};

use crate::simd::Real;

/// Volume ratio below which `J^(-2/3)` is continued along its tangent.
pub const J_FLOOR: f32 = 0.1;

/// Most constants that a law has.
pub const MAX_CONSTANTS: usize = 4;

/// A constant of a law.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct Constant {
    /// Its name in scene files and weight files.
    pub name: &'static str,
    /// Its unit, empty for a pure number.
    pub unit: &'static str,
}

/// A law whose constants are scalars or vectors, one number for each element.
pub trait Potential<R: Real>: Copy {
    /// With these constants, in the order of [`Law::constants`]; the rest is ignored.
    fn of(constants: [R; MAX_CONSTANTS]) -> Self;
    /// `W'(x)`, Pa.
    fn distortion_slope(&self, x: R) -> R;
    /// `W''(x)`, Pa, given `slope = W'(x)`: the two usually share their costly part.
    fn distortion_curvature(&self, x: R, slope: R) -> R;
    /// `k`, Pa, of the energy of volume `U(J) = k (J - 1)^2 / 2`.
    fn bulk_modulus(&self) -> R;
    /// How close `x` comes to the range where the law is continued to keep it finite: above 1 it is beyond.
    #[inline(always)]
    fn saturation(&self, _x: R) -> R {
        R::splat(0.0)
    }
    /// `W'(x)`, the saturation and `k`, which loops over elements ask for together.
    #[doc(hidden)]
    #[inline(always)]
    fn at(&self, x: R) -> [R; 3] {
        [self.distortion_slope(x), self.saturation(x), self.bulk_modulus()]
    }
}

/// The constants of a law by themselves, in the order of [`Law::constants`]; the rest is zero.
pub type Values = [f32; MAX_CONSTANTS];

/// A hyperelastic law with its constants for one element.
pub trait Law: Copy + Default + Send + Sync {
    /// The same law with a vector for each constant.
    type Wide<R: Real>: Potential<R>;

    /// Its name in scene files and weight files.
    fn name(&self) -> &'static str;

    /// Its constants, in the order of [`Law::values`]; each must be a finite positive number.
    fn constants(&self) -> &'static [Constant];

    /// Floating-point operations of `W'(x)` and `U'(J)` for one element.
    fn operations(&self) -> u32;

    /// The same law with these constants; those beyond [`Law::constants`] are ignored.
    #[must_use]
    fn with(&self, values: Values) -> Self;

    /// The values of its constants.
    fn values(&self) -> Values;

    /// The same law with vectors of these constants.
    #[inline(always)]
    fn widen<R: Real>(&self, constants: [R; MAX_CONSTANTS]) -> Self::Wide<R> {
        Self::Wide::of(constants)
    }

    /// The same law for any number of elements alike.
    #[inline(always)]
    fn splat<R: Real>(&self) -> Self::Wide<R> {
        self.widen(self.values().map(R::splat))
    }

    /// `W(x) + U(1 + j)` in float64, J/m^3, zero at rest.
    fn energy(&self, x: f64, j: f64) -> f64;

    /// The first constant that is not usable (not a finite positive number), by name and value.
    fn unusable_constant(&self) -> Option<(&'static str, f32)> {
        let constants = self.constants().iter().zip(self.values());
        let unusable = constants.into_iter().find(|(_, value)| !(value.is_finite() && *value > 0.0));
        unusable.map(|(constant, value)| (constant.name, value))
    }
}
