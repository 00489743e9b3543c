//! A simulation from rest to its end: steps, frames at even intervals, what became of it.

pub(crate) mod followed;
pub(crate) mod outcome;
pub(crate) mod pulled;
pub(crate) mod reactions;
pub(crate) mod start;

use std::time::Instant;

use supple::loads::Loads;
use supple::simulation::{Event, Report, Simulation, StepKind};
use supple::step::Status;
use supple::tled::Pace;

use crate::problem::Problem;
use crate::scene::setup::Setup;
use followed::FollowedPoints;
use outcome::{AdaptiveTrace, LargeTrace, LearnedTrace, Outcome};
use reactions::{Mark, Reactions};
use start::Start;

/// Steps are single precision: their sum may miss a time by this share of the whole.
const ROUNDING: f64 = 1e-7;

/// Steps after which a body is left where it is on its way to rest.
const MOST_STEPS_TO_SETTLE: u32 = 50_000;

/// Runs to the end or to divergence. `frame` is called at rest and after each interval between frames, `tick` with the
/// time (s) now and then.
pub(crate) fn run<'a>(
    setup: &'a Setup,
    start: Start<'a>,
    tick: &'a dyn Fn(f64),
    frame: &mut dyn FnMut(&mut Simulation<'_>) -> Result<(), Problem>,
) -> Result<(Simulation<'a>, Outcome), Problem> {
    let step = start.step;
    let mut running = Running::begin(setup, start, tick)?;
    let (time, simulation) = (&setup.time, &running.simulation);
    // Time goes in even intervals, each one step or one of a network, unless steps set their own pace.
    let interval = simulation.learned_step().map_or(step.seconds(), |learned| learned.seconds());
    let total = (time.end / f64::from(interval)).round().max(1.0) as u64;
    let is_auto = simulation.auto_step().is_some();
    let is_even = !(is_auto || time.sets_own_pace() && setup.learned.is_none());
    // No two frames of one state.
    let frames = if is_even { total.min(time.frames.into()) } else { time.frames.into() };
    running.outcome.enter_frame(running.simulation.state());
    running.read_points()?;
    frame(&mut running.simulation)?;
    let frames = if running.outcome.divergence.is_some() { 0 } else { frames };
    for index in 1..=frames {
        let share = index as f64 / frames as f64;
        let clock = Instant::now();
        if is_even {
            let target = (total as f64 * share).round() as u64;
            running.take_until(target, interval)?;
        } else {
            // Adaptive steps are judged at least so often.
            running.reach(time.end * share, if is_auto { f64::from(interval) } else { f64::INFINITY })?;
        }
        running.outcome.spent += clock.elapsed();
        if running.outcome.divergence.is_some() {
            break;
        }
        running.look()?;
        frame(&mut running.simulation)?;
    }
    Ok((running.simulation, running.outcome))
}

/// A simulation on its way.
pub(crate) struct Running<'a> {
    setup: &'a Setup,
    pub(crate) simulation: Simulation<'a>,
    /// Without instruments and pulls.
    loads: Loads<'a>,
    /// The most force of each pull, N.
    limits: Vec<f32>,
    pub(crate) outcome: Outcome,
    /// Is told the time now and then, s.
    tick: &'a dyn Fn(f64),
    /// Intervals of even length so far.
    taken: u64,
}

impl<'a> Running<'a> {
    /// At the start: settled, where the scene asks for it.
    pub(crate) fn begin(setup: &'a Setup, start: Start<'a>, tick: &'a dyn Fn(f64)) -> Result<Self, Problem> {
        let Start { at_rest, step, simulation } = start;
        let mut outcome = Outcome::new(at_rest, step.seconds());
        outcome.points = FollowedPoints::new(&setup.points);
        outcome.reactions = Reactions::new(setup.instruments.all.len(), &setup.time);
        outcome.large = simulation.long_step().map(|large| LargeTrace::new(large.model()));
        outcome.learned = simulation.learned_step().map(LearnedTrace::new);
        if simulation.auto_step().is_some() {
            // They begin as exact ones.
            outcome.steps.0 = outcome.steps.0.min(Pace::SHARE * at_rest.seconds);
            outcome.steps.1 = outcome.steps.0;
        }
        let loads = setup.loads(simulation.scene())?;
        let limits = setup.pulls.limit(simulation.scene().view());
        let mut running = Self { setup, simulation, loads, limits, outcome, tick, taken: 0 };
        if let Some(metre) = setup.time.settle {
            running.settle(metre)?;
        }
        Ok(running)
    }

    /// To rest to within so many metres, under the loads of the start.
    fn settle(&mut self, metre: f32) -> Result<(), Problem> {
        let rounding = self.rounding();
        let Self { setup, simulation, loads, limits, outcome, .. } = self;
        let (instruments, pulls) = (setup.instruments.at(rounding), setup.pulls.at(rounding, limits));
        let mut loads = setup.acting(*loads, &instruments, &pulls)?;
        let settled = simulation.settle_under(metre, MOST_STEPS_TO_SETTLE, &mut loads).map_err(Problem::of)?;
        outcome.settled = Some(settled);
        if let Status::Diverged(divergence) = settled.status {
            outcome.divergence = Some(divergence);
        }
        Ok(())
    }

    /// Intervals of so many seconds, until there have been as many.
    fn take_until(&mut self, target: u64, seconds: f32) -> Result<(), Problem> {
        while self.taken < target && self.outcome.divergence.is_none() {
            self.taken += 1;
            let now = self.simulation.state().time();
            self.advance(now + f64::from(seconds))?;
            if self.taken.is_multiple_of(Pace::STEPS_BETWEEN_LOOKS.into()) {
                (self.tick)(now);
            }
        }
        Ok(())
    }

    /// To a time (s), by steps of whatever length, along the parts of the paths of instruments and targets, in calls of so many
    /// seconds at most.
    pub(crate) fn reach(&mut self, target: f64, most: f64) -> Result<(), Problem> {
        let (mut from, rounding) = (self.simulation.state().time(), self.rounding());
        while from + rounding < target && self.outcome.divergence.is_none() {
            let now = from + rounding;
            let turn = self.setup.instruments.next_turn(now).min(self.setup.pulls.next_turn(now));
            let until = target.min(from + most).min(turn);
            self.advance_from(from, until)?;
            from = until;
        }
        Ok(())
    }

    /// Takes down where pulled and followed points are.
    fn read_points(&mut self) -> Result<(), Problem> {
        let Self { setup, simulation, limits, outcome, .. } = self;
        let state = simulation.state();
        let pulls = setup.pulls.at(state.time(), limits);
        let pulling = setup.pulls.pulling(&pulls, simulation.scene().node_count())?;
        outcome.pulls.enter(&pulling, setup.pulls.pulls, state);
        outcome.points.enter(state)
    }

    fn rounding(&self) -> f64 {
        2.0 * ROUNDING * self.setup.time.end
    }

    fn advance(&mut self, until: f64) -> Result<(), Problem> {
        self.advance_from(self.simulation.state().time(), until)
    }

    /// Moves on to a time (s) with instruments and targets on the parts of their paths that begin at `from` or before, s.
    fn advance_from(&mut self, from: f64, until: f64) -> Result<(), Problem> {
        let rounding = self.rounding();
        let Self { setup, simulation, loads, limits, outcome, tick, .. } = self;
        let (instruments, pulls) = (setup.instruments.at(from + rounding), setup.pulls.at(from + rounding, limits));
        let mut loads = setup.acting(*loads, &instruments, &pulls)?;
        let mut watched = Watched { mark: (outcome.limits, outcome.reactions.mark()), outcome, began: Instant::now() };
        let mut watch = |event: Event<'_>| {
            if let Event::Tries(time) = event {
                tick(time);
            }
            watched.enter(event);
        };
        let advanced = simulation.advance_under(until, &mut loads, &mut watch);
        let report = advanced.map_err(Problem::of)?;
        self.enter(&report);
        Ok(())
    }

    /// Takes down what a call came to.
    fn enter(&mut self, report: &Report) {
        let Self { simulation, outcome, .. } = self;
        outcome.enter_end(simulation.state());
        let [shortest, longest] = report.seconds;
        if longest > 0.0 {
            outcome.steps = (outcome.steps.0.min(shortest), outcome.steps.1.max(longest));
        }
        if let (Some(trace), Some(model)) = (&mut outcome.learned, simulation.learned_step()) {
            trace.enter_fallback(model);
            trace.exact_intervals += u64::from(report.fell_back);
        }
        if let Some(adaptive) = simulation.auto_step() {
            outcome.computed += u64::from(report.steps()).saturating_sub(1);
            let trace = outcome.adaptive.get_or_insert_with(|| AdaptiveTrace::new(adaptive.model().tolerance()));
            trace.enter(report);
        }
    }

    /// Looks at the critical step, and takes down a frame.
    fn look(&mut self) -> Result<(), Problem> {
        let bound = self.simulation.critical_step().map_err(Problem::of)?;
        let Self { setup, simulation, outcome, .. } = self;
        let time = simulation.state().time();
        if bound.seconds < outcome.least.0.seconds {
            outcome.least = (bound, time);
        }
        let is_exact = match (&setup.time.method, &setup.learned, simulation.learned_step()) {
            (None, None, _) => true,
            (_, Some(choice), Some(model)) => self.taken < model.intervals(choice.lead_in) || model.is_exact_next(),
            _ => false,
        };
        if is_exact
            && !setup.time.sets_own_pace()
            && simulation.settings().step.is_some_and(|step| step > bound.seconds)
        {
            outcome.above_from.get_or_insert(time);
        }
        outcome.enter_frame(simulation.state());
        self.read_points()
    }
}

/// The outcome during a call.
struct Watched<'a> {
    outcome: &'a mut Outcome,
    /// Before steps that may be taken back.
    mark: (outcome::Limits, Mark),
    /// When what is timed began.
    began: Instant,
}

impl Watched<'_> {
    fn enter(&mut self, event: Event<'_>) {
        let outcome = &mut *self.outcome;
        match event {
            Event::Tries(_) => self.mark = (outcome.limits, outcome.reactions.mark()),
            Event::TakenBack => {
                (outcome.limits, outcome.divergence) = (self.mark.0, None);
                outcome.reactions.take_back(&self.mark.1);
            }
            Event::Predicts(time) => {
                self.began = Instant::now();
                if let Some(trace) = &mut outcome.learned {
                    trace.from.get_or_insert(time);
                }
            }
            Event::Predicted(report) => {
                outcome.computed += 1;
                if let Some(trace) = &mut outcome.learned {
                    trace.enter(&report, self.began.elapsed());
                }
            }
            Event::Raised(report) => {
                if let Some(trace) = &mut outcome.large {
                    trace.enter(&report);
                }
            }
            Event::Step(taken, status, state) => {
                outcome.computed += u64::from(taken != StepKind::Learned);
                outcome.enter(status, state);
                self.began = Instant::now();
            }
            Event::Judged(status, estimate, state) => {
                outcome.guarding += self.began.elapsed();
                // A refused step has no error.
                let status = if status.is_taken() { status } else { Status::Ok };
                outcome.guard.get_or_insert_default().enter(status, estimate, state.time());
            }
        }
    }
}
