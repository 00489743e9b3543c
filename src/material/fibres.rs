//! Fibres: an energy of their stretch, and of the shear between two families of them, which is added to that of any
//! law (Holzapfel & Ogden 2009, "Constitutive modelling of passive myocardium", equation 5.38). With the directions `f`
//! and `s` at rest, `C = F^T F` and `g = J^(-2/3)`,
//!
//! ```text
//! sum_i a_i / (2 b_i) (exp(b_i x_i^2) - 1),   x_f = <g f.Cf - 1>,  x_s = <g s.Cs - 1>,  x_fs = g f.Cs
//! ```
//! `<x>` is `x` in tension and zero else, so that the stress begins from zero. Constants `a` in Pa, `b` without unit.
//! With the exponential law and all three terms this is the law of Holzapfel & Ogden with its eight constants; with the
//! first term any law becomes transversely isotropic. The exponent is capped as that of [`super::Exponential`].

use core::fmt;

use super::EXPONENT_CAP;
use crate::simd::Real;

/// Terms of the energy: of the first family, of the second one, and of the shear between them.
pub const FIBRE_TERMS: usize = 3;

/// The names of the terms, in scene files and for people.
pub const FIBRE_NAMES: [&str; FIBRE_TERMS] = ["fibres", "sheets", "coupling"];

/// The fibres of a tissue, or [none](Self::NONE).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Fibres {
    /// `a` (Pa), zero for no term, and `b`.
    terms: [[f32; 2]; FIBRE_TERMS],
}

/// A constant of fibres that cannot be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FibreError {
    /// Its term.
    pub term: usize,
    /// 0 for `a`, 1 for `b`.
    pub constant: usize,
    /// Its value.
    pub value: f32,
}

impl fmt::Display for FibreError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = FIBRE_NAMES.get(self.term).copied().unwrap_or_default();
        let what = if self.constant == 0 { "stiffness a (Pa)" } else { "exponent b" };
        write!(f, "the {what} of {name} is {}: it must be a finite positive number", self.value)
    }
}

impl core::error::Error for FibreError {}

impl Fibres {
    /// Tissue without fibres.
    pub const NONE: Self = Self { terms: [[0.0; 2]; FIBRE_TERMS] };

    /// From `[a, b]` of the first family, of the second one, and of the shear between both; nothing for no such term.
    pub fn new(terms: [Option<[f32; 2]>; FIBRE_TERMS]) -> Result<Self, FibreError> {
        for (term, constants) in terms.iter().enumerate() {
            for (constant, &value) in constants.iter().flatten().enumerate() {
                if !(value.is_finite() && value > 0.0) {
                    return Err(FibreError { term, constant, value });
                }
            }
        }
        Ok(Self { terms: terms.map(Option::unwrap_or_default) })
    }

    /// `[a, b]` of each term; zeros for one that is not there.
    #[must_use]
    pub const fn terms(&self) -> [[f32; 2]; FIBRE_TERMS] {
        self.terms
    }

    /// Whether there are any.
    #[must_use]
    pub fn are_there(&self) -> bool {
        self.terms.iter().any(|[a, _]| *a > 0.0)
    }

    /// How many families of directions they need: none, the first one, or both.
    #[must_use]
    pub fn families(&self) -> usize {
        let [_, sheets, coupling] = self.terms.map(|[a, _]| a > 0.0);
        if sheets || coupling { 2 } else { usize::from(self.are_there()) }
    }

    /// The first and the second derivative of the energy of each term, Pa, in float64.
    pub(crate) fn slopes(&self, invariants: [f64; FIBRE_TERMS]) -> [[f64; 2]; FIBRE_TERMS] {
        core::array::from_fn(|term| {
            let ([a, b], x) = (self.terms[term].map(f64::from), invariants[term]);
            if a <= 0.0 || term < 2 && x <= 0.0 {
                return [0.0; 2];
            }
            let (exponent, cap) = (b * x * x, f64::from(EXPONENT_CAP));
            if exponent > cap {
                let stiffness = a * libm::exp(cap);
                return [stiffness * x, stiffness];
            }
            let stiffness = a * libm::exp(exponent);
            [stiffness * x, stiffness * (1.0 + 2.0 * exponent)]
        })
    }

    /// The energy density (J/m^3) at `g f.Cf - 1`, `g s.Cs - 1` and `g f.Cs`.
    pub(crate) fn energy(&self, invariants: [f64; FIBRE_TERMS]) -> f64 {
        let terms = self.terms.iter().zip(invariants).enumerate();
        terms.map(|(term, (&[a, b], x))| FibreTerm { a, b }.energy(if term < 2 && x < 0.0 { 0.0 } else { x })).sum()
    }
}

/// For people.
impl fmt::Display for Fibres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let terms = self.terms.iter().zip(FIBRE_NAMES).filter(|([a, _], _)| *a > 0.0);
        for (place, ([a, b], name)) in terms.enumerate() {
            write!(f, "{}{name} a {a} Pa, b {b}", if place > 0 { ", " } else { "" })?;
        }
        Ok(())
    }
}

/// One term of the energy, for scalars or vectors.
#[derive(Clone, Copy)]
pub(crate) struct FibreTerm<R> {
    pub(crate) a: R,
    pub(crate) b: R,
}

impl<R: Real> FibreTerm<R> {
    /// `b x^2`, and its exponential where it is not above the cap.
    #[inline(always)]
    fn exponent(&self, x: R) -> [R; 2] {
        let exponent = self.b * (x * x);
        [exponent, exponent.min(R::splat(EXPONENT_CAP)).exp()]
    }

    /// The derivative of the energy by `x`, Pa, and how close it is to where the law is continued: above 1 it is beyond.
    #[inline(always)]
    pub(crate) fn slope(&self, x: R) -> [R; 2] {
        let [exponent, exponential] = self.exponent(x);
        [(self.a * x) * exponential, exponent * R::splat(1.0 / EXPONENT_CAP)]
    }

    /// The first derivative, Pa, and no less than the second one.
    #[inline(always)]
    pub(crate) fn slope_and_curvature(&self, x: R) -> [R; 2] {
        let [exponent, exponential] = self.exponent(x);
        let stiffness = self.a * exponential;
        let exponent = exponent.min(R::splat(EXPONENT_CAP));
        [stiffness * x, stiffness * (exponent + exponent + R::splat(1.0))]
    }
}

impl FibreTerm<f32> {
    fn energy(&self, x: f64) -> f64 {
        let [a, b, cap] = [self.a, self.b, EXPONENT_CAP].map(f64::from);
        if a <= 0.0 {
            return 0.0;
        }
        let exponent = b * x * x;
        let inside = exponent.min(cap);
        // Beyond the cap the slope is a x e^cap.
        a / (2.0 * b) * (libm::expm1(inside) + (exponent - inside) * libm::exp(inside))
    }
}

/// The directions of fibres in an element at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Directions {
    /// Along the first family, of any length but zero.
    pub fibre: [f32; 3],
    /// Along the second one; its part along the first is taken off. Not read where no tissue has such a term.
    pub sheet: [f32; 3],
}
