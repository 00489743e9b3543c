//! What became of a simulation: figures that are taken down step by step.

use std::time::Duration;

use supple::adaptive::Taken;
use supple::guard::Estimate;
use supple::inertia::{self, Grid, LargeModel};
use supple::learned::{Fallback, LearnedModel, LearnedReport};
use supple::material::J_FLOOR;
use supple::simulation::Report;
use supple::state::{StateView, VecState};
use supple::step::{CriticalStep, Divergence, Status};
use supple::tled::Settled;

use super::followed::FollowedPoints;
use super::pulled::PulledPoints;
use super::reactions::Reactions;
use crate::weight_file::describe_step;

/// Steps that are not exact: elements were beyond the range of their law, there was energy that the balance does not
/// explain, or motion was held back.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    pub(crate) steps: u64,
    /// s.
    pub(crate) first_time: f64,
    pub(crate) least_volume_ratio: f32,
    pub(crate) saturation: f32,
    pub(crate) energy_excess: f32,
    /// Steps for no other cause than motion that was held back, of long steps or of pulls.
    pub(crate) held_back: u64,
}

impl Limits {
    const NONE: Self =
        Self { steps: 0, first_time: 0.0, least_volume_ratio: 1.0, saturation: 0.0, energy_excess: 0.0, held_back: 0 };

    /// Enters a step that led to this time, s.
    fn enter(&mut self, time: f64) -> &mut Self {
        if self.steps == 0 {
            self.first_time = time;
        }
        self.steps += 1;
        self
    }
}

/// What was known at a frame.
#[derive(Clone, Copy)]
pub(crate) struct FrameTrace {
    /// s.
    pub(crate) time: f64,
    /// Mean and largest displacement of the nodes, m.
    pub(crate) mean: f64,
    pub(crate) largest: f64,
    /// The error by the guard's estimate.
    pub(crate) estimate: Option<Estimate>,
}

/// What became of a simulation.
pub(crate) struct Outcome {
    pub(crate) at_rest: CriticalStep,
    /// The smallest bound seen at a frame, with its time.
    pub(crate) least: (CriticalStep, f64),
    /// Shortest and longest step taken, s.
    pub(crate) steps: (f32, f32),
    /// Steps computed, those undone included.
    pub(crate) computed: u64,
    /// Time spent in steps, looks at the critical step and the guard included.
    pub(crate) spent: Duration,
    /// That of the guard.
    pub(crate) guarding: Duration,
    pub(crate) limits: Limits,
    pub(crate) divergence: Option<Divergence>,
    /// The first frame at which a fixed step was above the bound, s.
    pub(crate) above_from: Option<f64>,
    /// With steps beyond the critical one.
    pub(crate) large: Option<LargeTrace>,
    /// With a network.
    pub(crate) learned: Option<LearnedTrace>,
    /// With steps that choose their length.
    pub(crate) adaptive: Option<AdaptiveTrace>,
    /// With steps beyond the critical one.
    pub(crate) guard: Option<GuardTrace>,
    /// With instruments.
    pub(crate) reactions: Reactions,
    /// With pulls.
    pub(crate) pulls: PulledPoints,
    /// With points.
    pub(crate) points: FollowedPoints,
    pub(crate) frames: Vec<FrameTrace>,
    /// Where the body was brought to rest before it moved.
    pub(crate) settled: Option<Settled>,
}

impl Outcome {
    /// Before the first step, which is `seconds` long.
    pub(crate) fn new(at_rest: CriticalStep, seconds: f32) -> Self {
        Self {
            at_rest,
            least: (at_rest, 0.0),
            steps: (seconds, seconds),
            computed: 0,
            spent: Duration::ZERO,
            guarding: Duration::ZERO,
            limits: Limits::NONE,
            divergence: None,
            above_from: None,
            large: None,
            learned: None,
            adaptive: None,
            guard: None,
            reactions: Reactions::NONE,
            pulls: PulledPoints::default(),
            points: FollowedPoints::default(),
            frames: vec![],
            settled: None,
        }
    }

    /// How it went, in a word: the worst there was.
    pub(crate) fn status(&self) -> &'static str {
        let fell_back = self.learned.as_ref().is_some_and(|trace| trace.fell_back.is_some());
        let inexact = self.guard.is_some_and(|guard| guard.inexact > 0);
        match (&self.divergence, self.limits.steps) {
            (Some(_), _) => "diverged",
            (None, _) if fell_back => "fell back",
            (None, 1..) => "limited",
            (None, 0) if inexact => "inexact",
            (None, 0) => "ok",
        }
    }

    /// Takes down a frame.
    pub(crate) fn enter_frame(&mut self, state: &VecState) {
        let squares = state
            .displacements()
            .iter()
            .map(|vector| vector.to_array().iter().map(|component| f64::from(*component).powi(2)).sum::<f64>());
        let (sum, largest) =
            squares.map(f64::sqrt).fold((0.0, 0.0_f64), |(sum, largest), length| (sum + length, largest.max(length)));
        let mean = sum / state.displacements().len().max(1) as f64;
        let estimate = self.guard.and_then(|guard| guard.latest);
        self.frames.push(FrameTrace { time: state.time(), mean, largest, estimate });
    }

    /// Takes down what a call ended with.
    pub(crate) fn enter_end(&mut self, state: &VecState) {
        if state.pulls_held_back() > 0 {
            self.limits.enter(state.time()).held_back += 1;
        }
    }

    /// Takes down what a step said that led to `state`.
    pub(crate) fn enter(&mut self, status: Status, state: &StateView<'_>) {
        if status.is_taken() {
            self.reactions.enter(state);
        }
        match status {
            Status::Limited { least_volume_ratio, saturation, energy_excess } => {
                let limits = self.limits.enter(state.time());
                limits.least_volume_ratio = limits.least_volume_ratio.min(least_volume_ratio);
                limits.saturation = limits.saturation.max(saturation);
                limits.energy_excess = limits.energy_excess.max(energy_excess);
                let within = least_volume_ratio >= J_FLOOR && saturation <= 1.0 && energy_excess <= 0.0;
                limits.held_back += u64::from(within);
            }
            Status::Diverged(divergence) => self.divergence = Some(divergence),
            // The state and the loads are this scene's own, so they match.
            _ => {}
        }
    }
}

/// What steps beyond the critical one did.
#[derive(Clone, Copy)]
pub(crate) struct LargeTrace {
    pub(crate) grid: Grid,
    /// After the latest step.
    pub(crate) report: inertia::Report,
    /// Steps in which nodes were held back, and the most nodes at once.
    pub(crate) steps_held_back: u64,
    pub(crate) most_held_back: u32,
    pub(crate) least_coarse_share: f32,
    /// Largest share of the rough motion that was taken away in a step.
    pub(crate) most_damping: f32,
}

impl LargeTrace {
    pub(crate) const fn new(model: &LargeModel) -> Self {
        Self {
            grid: model.grid(),
            report: *model.report(),
            steps_held_back: 0,
            most_held_back: 0,
            least_coarse_share: 1.0,
            most_damping: 0.0,
        }
    }

    /// Takes down the report of a step.
    pub(crate) fn enter(&mut self, report: &inertia::Report) {
        self.report = *report;
        self.steps_held_back += u64::from(report.held_back > 0);
        self.most_held_back = self.most_held_back.max(report.held_back);
        self.least_coarse_share = self.least_coarse_share.min(report.coarse_share);
        self.most_damping = self.most_damping.max(report.damping);
    }
}

/// What adaptive steps did.
#[derive(Clone, Copy)]
pub(crate) struct AdaptiveTrace {
    /// m.
    pub(crate) tolerance: f32,
    pub(crate) taken: Taken,
}

impl AdaptiveTrace {
    pub(crate) fn new(tolerance: f32) -> Self {
        Self { tolerance, taken: Taken::default() }
    }

    /// Takes down what a span took.
    pub(crate) fn enter(&mut self, &Report { exact, long: large, changes, .. }: &Report) {
        self.taken = self.taken + Taken { exact, large, changes, ..Taken::default() };
    }
}

/// What a guard said of the steps.
#[derive(Clone, Copy, Default)]
pub(crate) struct GuardTrace {
    /// The latest estimate.
    pub(crate) latest: Option<Estimate>,
    /// The largest of the mean error, m.
    pub(crate) most: f32,
    /// Steps whose estimate exceeded what is allowed, the time of the first, s, and its estimate and what was allowed,
    /// m.
    pub(crate) inexact: u64,
    pub(crate) first: Option<(f64, f32, f32)>,
}

impl GuardTrace {
    /// Takes down what the guard said of a step that led to `time`, s.
    pub(crate) fn enter(&mut self, status: Status, estimate: Option<Estimate>, time: f64) {
        self.latest = estimate;
        self.most = self.most.max(estimate.map_or(0.0, |estimate| estimate.mean));
        if let Status::Inexact { error, allowed } = status {
            self.inexact += 1;
            self.first.get_or_insert((time, error, allowed));
        }
    }
}

/// What learned steps did.
pub(crate) struct LearnedTrace {
    /// Of a learned step.
    pub(crate) seconds: f32,
    /// The step in words.
    pub(crate) described: String,
    /// When the network took over, s.
    pub(crate) from: Option<f64>,
    pub(crate) steps: u64,
    spent: Duration,
    /// Sums over the steps, and the most.
    clipped: f64,
    outside: f64,
    pub(crate) most: LearnedReport,
    /// When (s) and why exact steps first took the place of learned ones.
    pub(crate) fell_back: Option<(f64, String)>,
    /// How often they did, and intervals that they took.
    pub(crate) fallbacks: u32,
    pub(crate) exact_intervals: u64,
}

impl LearnedTrace {
    pub(crate) fn new(model: &LearnedModel<'_>) -> Self {
        Self {
            seconds: model.seconds(),
            described: describe_step(model.network()),
            from: None,
            steps: 0,
            spent: Duration::ZERO,
            clipped: 0.0,
            outside: 0.0,
            most: LearnedReport::default(),
            fell_back: None,
            fallbacks: 0,
            exact_intervals: 0,
        }
    }

    /// Takes down the report of a step.
    pub(crate) fn enter(&mut self, report: &LearnedReport, spent: Duration) {
        self.steps += 1;
        self.spent += spent;
        self.clipped += f64::from(report.clipped);
        self.outside += f64::from(report.outside);
        self.most.clipped = self.most.clipped.max(report.clipped);
        self.most.outside = self.most.outside.max(report.outside);
    }

    /// Takes down that exact steps are next.
    pub(crate) fn enter_fallback(&mut self, model: &LearnedModel<'_>) {
        self.fallbacks = model.fallbacks();
        let Some(Fallback { time, status }) = model.fell_back().filter(|_| self.fell_back.is_none()) else {
            return;
        };
        let why = match *status {
            Status::Diverged(divergence) => divergence.to_string(),
            Status::Limited { energy_excess, .. } => {
                format!("exceeded what loads and supports ever gave by {:.1} %", 100.0 * energy_excess)
            }
            Status::Inexact { error, allowed } => {
                format!("may be {:.2} mm off, {:.2} mm are allowed", 1e3 * error, 1e3 * allowed)
            }
            other => format!("{other:?}"),
        };
        self.fell_back = Some((*time, why));
    }

    /// How long exact steps have moved the scene after the lead-in, s.
    pub(crate) fn exact_seconds(&self) -> f64 {
        self.exact_intervals as f64 * f64::from(self.seconds)
    }

    pub(crate) fn us_per_step(&self) -> f64 {
        1e6 * self.spent.as_secs_f64() / self.steps.max(1) as f64
    }

    /// Shares of the free vertices that were clipped and outside, on average over the steps.
    pub(crate) fn means(&self) -> (f64, f64) {
        let steps = self.steps.max(1) as f64;
        (self.clipped / steps, self.outside / steps)
    }
}
