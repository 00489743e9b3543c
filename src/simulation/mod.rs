//! A scene that moves on by a frame at a time: one object for the method, its steps, the critical step that is renewed
//! on the way, the guard, and the fallback of learned steps.
//!
//! [`Simulation`] owns all of it on a host with a heap. A [`Mover`] is the same loop over memory of the caller, which a
//! host without a heap and the C API use; it needs nothing that the modules below do not have, and every host takes its
//! steps through it.
//!
//! | method | what a call of `advance` takes |
//! |---|---|
//! | [`Method::Exact`] | steps of nine tenths of the critical step, which is looked at again while tissue stiffens; or of one length |
//! | [`Method::Long`] | equal steps of at most one length beyond the critical step, and a guard |
//! | [`Method::Auto`] | exact and long steps whose length keeps the error below a tolerance |
//! | [`Method::Learned`] | a lead-in of exact steps, then a network's, with exact ones wherever energy or the guard does not believe it |
//!
//! All but learned steps end where the call says, to a millionth of its span; these end at the nearest of the network's
//! steps. Prescribed motions without a ramp go evenly over the call.

mod clock;
#[cfg(feature = "std")]
mod exchange;
mod mover;
#[cfg(feature = "std")]
mod owned;
#[cfg(any(feature = "std", feature = "capi-neo-hookean"))]
mod remembered;
mod report;
#[cfg(feature = "std")]
mod settle;

pub use clock::Clock;
pub use mover::{Event, ExactSteps, Lead, Mover, StepKind};
#[cfg(feature = "std")]
pub use owned::{Simulation, SimulationError};
#[cfg(feature = "capi-neo-hookean")]
pub(crate) use remembered::carry;
pub use report::Report;

use crate::inertia;
use crate::mlp::Network;
#[cfg(feature = "std")]
use crate::step::{CriticalStep, Step, Work};
#[cfg(feature = "std")]
use crate::tled::Pace;

/// How a scene is moved.
#[derive(Clone, Debug, Default)]
// A network's tables stand where the method stands: there is no heap to put them on.
#[allow(clippy::large_enum_variant)]
pub enum Method<'w> {
    /// Exact steps ([`crate::tled`]).
    #[default]
    Exact,
    /// Steps beyond the critical one ([`crate::inertia`]), of [`Settings::step`] at most.
    Long(inertia::Method),
    /// Steps that choose their length ([`crate::adaptive`]) for [`Settings::tolerance`].
    Auto(inertia::Method),
    /// Learned steps ([`crate::learned`]).
    Learned {
        /// The network.
        network: Network<'w>,
        /// Exact steps before it takes over, s: 0.3 in the paper (Meister et al. 2018, section 3).
        lead_in: f64,
        /// Whether exact steps take the place of those that are not believed.
        fallback: bool,
    },
}

/// What a simulation is told once.
#[derive(Clone, Debug)]
pub struct Settings<'w> {
    /// How the scene is moved.
    pub method: Method<'w>,
    /// Length of the steps, s: of long ones at most so much, 20 times the critical step unless given; of exact ones, a
    /// network's included, at most so much, nine tenths of the critical step unless given, and shorter where the
    /// critical step falls; of steps that choose their length the longest, a hundred critical steps unless given.
    pub step: Option<f32>,
    /// Damping in proportion to mass, 1/s. A network has that of its training.
    pub damping: f32,
    /// Mean error of the nodes that is accepted, m: what steps that choose their length keep, half a millimetre or less
    /// in bodies below 10 cm unless given, and what a guard calls inexact.
    pub tolerance: Option<f32>,
    /// Whether a guard estimates the error of long and of learned steps.
    pub guard: bool,
    /// The most work that a call of `advance` takes, in exact steps (a long or a learned one counts four, and is taken
    /// while any is left): when it is spent the call ends with [`Status::Behind`](crate::step::Status::Behind), and the next goes on from there. As much
    /// as it takes unless given.
    pub most_steps: Option<u32>,
    /// Whether a given length of exact steps may be above the critical step: for experiments.
    pub unchecked: bool,
}

impl Default for Settings<'_> {
    /// Exact steps without damping.
    fn default() -> Self {
        Self {
            method: Method::Exact,
            step: None,
            damping: 0.0,
            tolerance: None,
            guard: true,
            most_steps: None,
            unchecked: false,
        }
    }
}

impl Settings<'_> {
    /// Before anything is changed for them.
    #[cfg(feature = "std")]
    fn check(&self, critical: CriticalStep) -> Result<(), SimulationError> {
        if let Some(metres) = self.tolerance.filter(|metres| !(*metres > 0.0 && metres.is_finite())) {
            return Err(SimulationError::Tolerance(metres));
        }
        let seconds = self.step.unwrap_or(critical.seconds);
        match self.method {
            Method::Exact | Method::Learned { .. } if !self.unchecked => {
                _ = Pace::of(self.step, self.damping, critical)?
            }
            _ => _ = Step::unchecked(seconds, self.damping)?,
        }
        Ok(())
    }

    /// Of a call.
    #[cfg(feature = "std")]
    fn work(&self) -> Work {
        self.most_steps.map_or(Work::UNBOUNDED, Work::of)
    }
}

/// Long steps over the critical step unless a length is given.
pub const LONG_STEPS: f32 = 20.0;
/// The longest steps of [`Method::Auto`] over the critical step unless a length is given.
pub const LONGEST_STEPS: f32 = 100.0;

/// Mean error of the nodes (m) that [`Method::Auto`] accepts in a body with these points at rest (m) unless the host
/// says otherwise: half a millimetre, in bodies below 10 cm 0.005 of the diagonal of their box.
#[must_use]
pub fn usual_tolerance(points: &[[f32; 3]]) -> f32 {
    let square: f32 = inertia::size_of(points).iter().map(|side| side * side).sum();
    f32::min(0.0005, 0.005 * libm::sqrtf(square))
}
