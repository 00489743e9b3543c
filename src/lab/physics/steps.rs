//! The ways to take steps that are compared: exact ones at nine tenths of the critical step, long ones far above it,
//! and backward Euler at steps of milliseconds as most packages have it ([`implicit`]), which is of linear tetrahedra
//! only.

use supple::inertia::{self, Cells, LargeStep};
use supple::loads::Loads;
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

use super::specimen::Setup;
use crate::LabError;
use crate::implicit::{self, Rule};
use crate::method::Prepared;

/// A way to take steps.
#[derive(Clone, Copy)]
pub(super) struct Steps {
    /// For the tables.
    pub(super) name: &'static str,
    pub(super) kind: Kind,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Exact,
    /// Steps over the critical one.
    Long(f32),
    /// Steps in s.
    BackwardEuler(f32),
}

pub(super) const EXACT: Steps = Steps { name: "exact", kind: Kind::Exact };
pub(super) const LONG_20: Steps = Steps { name: "long 20x", kind: Kind::Long(20.0) };
pub(super) const LONG_100: Steps = Steps { name: "long 100x", kind: Kind::Long(100.0) };
/// A frame of 60 a second, and parts of it.
pub(super) const BACKWARD_EULER: [Steps; 3] = [
    Steps { name: "backward Euler 1 ms", kind: Kind::BackwardEuler(1e-3) },
    Steps { name: "backward Euler 5 ms", kind: Kind::BackwardEuler(5e-3) },
    Steps { name: "backward Euler 16.7 ms", kind: Kind::BackwardEuler(1.0 / 60.0) },
];
/// How shapes at rest are reached.
pub(super) const TO_REST: [Steps; 2] = [EXACT, LONG_20];

/// Share of the critical step that exact steps take: tissue stiffens on the way.
const SAFETY: f32 = 0.9;

/// Takes steps until a time, s.
pub(super) type Advance<'a> = Box<dyn FnMut(&mut VecState, &Loads<'_>, f64) -> Result<(), LabError> + 'a>;

impl Setup<'_> {
    /// What takes steps with `damping` (1/s) from a state, by the critical step there.
    pub(super) fn advance(&self, state: &mut VecState, damping: f32) -> Result<Advance<'_>, LabError> {
        let Self { case, scene, points, steps } = *self;
        let critical = tled::critical_step(scene, state).ok_or(LabError::NoCriticalStep { scene: case })?;
        let seconds = match steps.kind {
            Kind::Exact => SAFETY * critical.seconds,
            Kind::Long(multiple) => multiple * critical.seconds,
            Kind::BackwardEuler(seconds) => seconds,
        };
        let step = Step::unchecked(seconds, damping)?;
        let mut prepared = match steps.kind {
            Kind::Exact => Prepared::Exact(step),
            Kind::Long(_) => {
                let method = inertia::Method::new(Cells::Suggested);
                let large = LargeStep::prepare_in_vec(method, scene.view(), points, state.view(), step)?;
                Prepared::Long(Box::new(large), damping)
            }
            Kind::BackwardEuler(_) => implicit::prepare(Rule::BackwardEuler, scene.view(), state, seconds, damping),
        };
        Ok(Box::new(move |state, loads, until| {
            while state.time() < until {
                let (status, _) = prepared.advance(seconds, scene.view(), loads, state)?;
                LabError::if_refused(case, status)?;
            }
            Ok(())
        }))
    }
}
