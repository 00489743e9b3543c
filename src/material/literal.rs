//! The laws as the paper prints them (Meister et al. 2018, section 2): functions of `I1 - 3` instead of `I1bar - 3`.

use super::{Constant, Law, MAX_CONSTANTS};
use crate::simd::Real;

/// A law as the paper prints it. At rest it has a residual
/// stress `2 W'(0)`, so a free body shrinks until the volume term balances it (about 3 % in volume for the
/// paper's neo-Hookean constants). Kept because the paper's figures came from it. Its volume term is
/// `d (J - 1)^2`: the linear `d (J - 1)` in the paper is a misprint, no state would be in equilibrium.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Literal<L>(pub L);

impl<L: LiteralName> Law for Literal<L> {
    type Wide<R: Real> = L::Wide<R>;

    const NAME: &'static str = L::LITERAL_NAME;

    const CONSTANTS: &'static [Constant] = L::CONSTANTS;

    const ISOCHORIC: bool = false;

    const OPERATIONS: u32 = L::OPERATIONS;

    fn from_constants(constants: [f32; MAX_CONSTANTS]) -> Self {
        Self(L::from_constants(constants))
    }

    fn constants(&self) -> [f32; MAX_CONSTANTS] {
        self.0.constants()
    }

    #[inline(always)]
    fn widen<R: Real>(at: impl Fn(usize) -> Self) -> Self::Wide<R> {
        L::widen(|element| at(element).0)
    }

    fn energy(&self, x: f64, j: f64) -> f64 {
        self.0.energy(x, j)
    }
}

/// A law that the paper prints.
pub trait LiteralName: Law {
    /// The name of its literal form.
    const LITERAL_NAME: &'static str;
}

impl LiteralName for super::NeoHookean {
    const LITERAL_NAME: &'static str = "neo-hookean-literal";
}

impl LiteralName for super::Exponential {
    const LITERAL_NAME: &'static str = "exponential-literal";
}
