//! Learned steps of a scene. Time goes in intervals of the network's step `D`: first those of the lead-in, in each of which the exact
//! step of `[time]` takes as many steps as it needs, then one learned step each. With fallback exact steps take the place of those
//! that energy does not explain, or whose error is too large by the guard's estimate.

use std::time::Instant;

use supple::learned::{LearnedStep, Undone};
use supple::state::{NodeVector, VecState};
use supple::step::{CallingThread, Status};

use super::exact::{ExactSteps, Motion};
use super::outcome::{LearnedTrace, Outcome};
use crate::problem::Problem;
use crate::scene::learned::LearnedChoice;
use crate::weight_file::describe_step;

/// Learned steps on their way.
pub(crate) struct LearnedRun<'a> {
    step: LearnedStep<'a, Vec<NodeVector>>,
    exact: ExactSteps,
    /// Intervals so far, and in the lead-in.
    interval: u64,
    lead_in: u64,
    pub(crate) trace: LearnedTrace,
}

impl<'a> LearnedRun<'a> {
    pub(crate) fn new(choice: &'a LearnedChoice, nodes: usize, exact: ExactSteps) -> Result<Self, Problem> {
        let step = choice.step(nodes, choice.fallback)?;
        let model = step.model();
        let trace = LearnedTrace::new(model.seconds(), describe_step(model.network()));
        Ok(Self { lead_in: model.intervals(choice.burn_in), step, exact, interval: 0, trace })
    }

    /// The learned step, s.
    pub(crate) const fn seconds(&self) -> f32 {
        self.trace.seconds
    }

    /// Whether the latest interval was one of the lead-in, whose exact steps have no error.
    pub(crate) const fn is_leading(&self) -> bool {
        self.interval <= self.lead_in
    }

    /// The length of fixed exact steps (s), while they move the scene.
    pub(crate) fn fixed_exact_seconds(&self) -> Option<f32> {
        let is_exact = self.interval < self.lead_in || self.step.model().is_exact_next();
        match &self.exact {
            ExactSteps::Fixed(step) if is_exact => Some(step.seconds()),
            _ => None,
        }
    }

    /// Moves on by one interval, or until a step diverges.
    pub(crate) fn advance(
        &mut self,
        motion: &Motion<'_>,
        state: &mut VecState,
        outcome: &mut Outcome,
    ) -> Result<(), Problem> {
        self.interval += 1;
        let seconds = self.trace.seconds;
        if self.interval <= self.lead_in {
            self.exact_interval(motion, state, outcome);
            return Ok(());
        }
        if self.step.model().is_exact_next() {
            self.trace.exact_intervals += 1;
            self.exact_interval(motion, state, outcome);
            return Ok(());
        }
        self.trace.from.get_or_insert(state.time());
        let exact_seconds = self.exact.seconds();
        let clock = Instant::now();
        let tried = self.step.view().try_step(
            motion.scene,
            &motion.loads,
            &mut state.view(),
            exact_seconds,
            &CallingThread,
        );
        self.trace.enter(self.step.model().report(), clock.elapsed());
        match tried.map_err(Problem::of)? {
            Ok(status) => {
                outcome.steps.1 = outcome.steps.1.max(seconds);
                outcome.enter(status, &state.view());
            }
            Err(Undone) => {
                self.trace.enter_fallback(self.step.model());
                self.trace.exact_intervals += 1;
                outcome.computed += 1;
                self.exact_interval(motion, state, outcome);
            }
        }
        Ok(())
    }

    /// Exact steps are next, because the guard calls the latest interval inexact. Nothing changes without fallback.
    pub(crate) fn fall_back(&mut self, time: f64, status: Status) {
        if self.interval > self.lead_in {
            self.step.fall_back(time, status);
            self.trace.enter_fallback(self.step.model());
        }
    }

    /// Exact steps while the frames follow.
    fn exact_interval(&mut self, motion: &Motion<'_>, state: &mut VecState, outcome: &mut Outcome) {
        // A step that diverged is in the outcome, which ends the run.
        let _ = self.step.view().lead_interval(state, |state| {
            self.exact.advance(motion, state, outcome, self.trace.seconds);
            outcome.divergence.map_or(Status::Ok, Status::Diverged)
        });
    }
}
