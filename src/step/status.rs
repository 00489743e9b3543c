//! What became of a step: taken, taken but not exact, or refused, with the node at which it went wrong.

use super::{Cause, EnergyBalance};
use crate::element::Extremes;
use crate::material::J_FLOOR;
use crate::state::Progress;

/// What became of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "a step that diverged has not moved the state"]
#[non_exhaustive]
pub enum Status {
    /// The step was taken.
    Ok,
    /// The step was taken, but is not exact: some elements are beyond the range of their law (squeezed below
    /// [`J_FLOOR`](crate::material::J_FLOOR) or stretched beyond the exponent cap, where the law goes on along its
    /// tangent), or there is more kinetic energy than the energy balance explains ([`EnergyBalance`]). For a step with
    /// scaled inertia also: much of the motion was held back ([`crate::inertia::Report`]). Of a call: pulls are held back for long at
    /// its end, or have been lately ([`Progress::pulls_held_back`]).
    Limited {
        /// Smallest volume ratio of an element.
        least_volume_ratio: f32,
        /// Largest exponent over its cap; above 1 the cap was hit.
        saturation: f32,
        /// Kinetic energy beyond the energy balance, as a share of the most that was ever in it; zero if none.
        energy_excess: f32,
    },
    /// The step was taken, but its error is estimated to be more than is allowed. Only a [`crate::guard`] says so.
    Inexact {
        /// Estimate of the mean error of the nodes, m.
        error: f32,
        /// What is allowed, m.
        allowed: f32,
    },
    /// Steps were taken, but the work that a call may take ([`super::Work`]) is spent before its end.
    Behind {
        /// What is missing to the end of the call, s.
        seconds: f64,
    },
    /// The step was not taken and the state is as before.
    Diverged(Divergence),
    /// The step was not taken: the state has room for fewer nodes than the scene, or the loads were
    /// checked against a scene with another number of nodes.
    Mismatch {
        /// Nodes of the scene.
        nodes: usize,
        /// Nodes that the state has room for.
        room: usize,
    },
}

/// Where and when a simulation stopped being believable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// Start of the refused step, s.
    pub time: f64,
    /// The first node that is not finite, or else the one with the most kinetic energy.
    pub node: u32,
    /// What was wrong.
    pub cause: Cause,
}

impl Status {
    /// Of a step that was taken, from its extremes; `limited` if it held back much of the motion.
    pub(crate) fn of_taken(extremes: &Extremes<f32>, energy_balance: &EnergyBalance, limited: bool) -> Self {
        let least_volume_ratio = 1.0 + extremes.least_change;
        let (saturation, energy_excess) = (extremes.saturation, energy_balance.excess() as f32);
        if limited || least_volume_ratio < J_FLOOR || saturation > 1.0 || energy_excess > 0.0 {
            return Self::Limited { least_volume_ratio, saturation, energy_excess };
        }
        Self::Ok
    }

    /// The status of a call whose steps say this and lead there: limited also if pulls are held back
    /// for long at its end, or have been lately.
    pub(crate) fn at_end(self, progress: &Progress) -> Self {
        if self == Self::Ok && progress.pulls_held_back() > 0 {
            return Self::of_taken(&progress.extremes, &progress.energy_balance, true);
        }
        self
    }

    /// The status of two steps, this one and a `later`: the later, unless that is `Ok`, or `Inexact` after `Limited`. A
    /// refusal or what is missing ends a call, so that it is the last there.
    pub fn worse(self, later: Self) -> Self {
        match (self, later) {
            (_, Self::Ok) => self,
            (Self::Limited { .. }, Self::Inexact { .. }) => self,
            _ => later,
        }
    }

    /// Whether the step was taken.
    #[must_use]
    pub const fn is_taken(&self) -> bool {
        matches!(self, Self::Ok | Self::Limited { .. } | Self::Inexact { .. } | Self::Behind { .. })
    }

    /// Whether a step was refused because tissue and an instrument come too near in it.
    pub(crate) const fn is_too_far(self) -> bool {
        matches!(self, Self::Diverged(Divergence { cause: Cause::Instrument { .. }, .. }))
    }

    /// Whether the energy balance does not explain the step, taken or not.
    #[must_use]
    pub const fn is_unexplained(&self) -> bool {
        match self {
            Self::Diverged(_) => true,
            Self::Limited { energy_excess, .. } => *energy_excess > 0.0,
            _ => false,
        }
    }
}
