//! A simulation from rest to its end: steps, frames at even intervals, what became of it.
//!
//! `step = "auto"` takes a share of the critical step, which falls as tissue stiffens: it is asked for anew
//! every few steps, and steps after which it turns out to be shorter than they were are undone and taken
//! again in halves. A sudden load on one node needs that: one step may stiffen its elements tenfold.

use std::time::{Duration, Instant};

use supple::loads::Loads;
use supple::material::Material;
use supple::tled::{self, CriticalStep, Divergence, Status, Step};

use crate::prepare::{HostScene, HostState, Setup, StepChoice};
use crate::scene_file::Problem;

/// With `step = "auto"`: most steps between two looks at the critical step, and the share of it taken.
const STEPS_BETWEEN_LOOKS: u32 = 50;
const SHARE: f32 = 0.9;
/// By which share the critical step may fall between two looks.
const FALL: f32 = 0.03;
/// By which share per step an automatic step grows after it had to shrink. Slowly: steps that change in time
/// with the motion feed energy into it (Skeel 1993, "Variable step size destabilizes the
/// Stoermer/leapfrog/Verlet method").
const GROWTH: f32 = 0.002;
/// Share of the critical step at rest below which an automatic step is not halved any further.
const SHORTEST: f32 = 1e-4;

/// Where `step = "auto"` stands.
struct Pace {
    /// The step may be this long, s.
    longest: f32,
    /// The critical step at the last look, s.
    critical: f32,
    /// Steps to the next look.
    steps: u32,
}

/// Steps with elements beyond the range of their law, or with energy the account does not explain.
#[derive(Clone, Copy, Default)]
pub(crate) struct Limits {
    pub(crate) steps: u64,
    pub(crate) first_time: f64,
    pub(crate) least_volume_ratio: f32,
    pub(crate) saturation: f32,
    pub(crate) energy_excess: f32,
}

/// What became of a simulation.
pub(crate) struct Outcome {
    pub(crate) at_rest: CriticalStep,
    /// The smallest bound seen at a frame, with its time.
    pub(crate) least: (CriticalStep, f64),
    /// Shortest and longest step taken, s.
    pub(crate) steps: (f32, f32),
    /// Time spent in steps, looks at the critical step included.
    pub(crate) spent: Duration,
    pub(crate) limits: Limits,
    pub(crate) divergence: Option<Divergence>,
    /// The first frame at which a fixed step was above the bound.
    pub(crate) above_from: Option<f64>,
}

/// Refuses a step above the critical one unless the user insists.
pub(crate) fn first_step(setup: &Setup, at_rest: CriticalStep, insist: bool) -> Result<Step, Problem> {
    let wanted = match setup.step {
        StepChoice::Seconds(seconds) => seconds,
        StepChoice::Auto => SHARE * at_rest.seconds,
    };
    let step =
        if insist { Step::insist(wanted, setup.damping) } else { Step::new(wanted, setup.damping, at_rest) };
    step.map_err(|error| {
        Problem(format!(
            "{}: {error}; shorten it, write step = \"auto\", or insist with --insist",
            setup.body.name
        ))
    })
}

/// The bound at the state, or a problem: there is none for a state that is not finite.
pub(crate) fn critical<M: Material>(
    scene: &HostScene<M>,
    state: &mut HostState,
) -> Result<CriticalStep, Problem> {
    tled::critical_step(scene, state)
        .ok_or_else(|| Problem("the stiffness of some element is not a finite number".into()))
}

/// Runs to the end or to divergence. `frame` is called at rest and after each interval, `tick` with the time
/// now and then.
pub(crate) fn run<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    state: &mut HostState,
    insist: bool,
    tick: impl Fn(f64),
    mut frame: impl FnMut(&HostScene<M>, &HostState) -> Result<(), Problem>,
) -> Result<Outcome, Problem> {
    let loads = Loads::new(scene, setup.gravity, &setup.forces, &setup.motions)
        .map_err(|error| Problem(error.to_string()))?;
    let at_rest = critical(scene, state)?;
    let mut step = first_step(setup, at_rest, insist)?;
    let mut outcome = Outcome {
        at_rest,
        least: (at_rest, 0.0),
        steps: (step.seconds(), step.seconds()),
        spent: Duration::ZERO,
        limits: Limits { least_volume_ratio: 1.0, ..Limits::default() },
        divergence: None,
        above_from: None,
    };
    let mut pace = Pace { longest: SHARE * at_rest.seconds, critical: at_rest.seconds, steps: 1 };
    frame(scene, state)?;
    let total = (setup.end / f64::from(step.seconds())).round().max(1.0) as u64;
    for index in 1..=setup.frames {
        let share = f64::from(index) / f64::from(setup.frames);
        let start = Instant::now();
        match setup.step {
            StepChoice::Seconds(_) => {
                let target = (total as f64 * share).round() as u64;
                while state.steps() < target && outcome.divergence.is_none() {
                    take(scene, &loads, state, &step, &mut outcome);
                    if state.steps().is_multiple_of(u64::from(STEPS_BETWEEN_LOOKS)) {
                        tick(state.time());
                    }
                }
            }
            StepChoice::Auto => {
                let target = setup.end * share;
                // A remainder of rounding is no step.
                while target - state.time() > 1e-9 * setup.end && outcome.divergence.is_none() {
                    tick(state.time());
                    let remaining = target - state.time();
                    let count = (remaining / f64::from(pace.longest)).ceil().max(1.0);
                    step = Step::insist((remaining / count) as f32, setup.damping)
                        .map_err(|error| Problem(error.to_string()))?;
                    let before = (state.clone(), outcome.limits);
                    let count = count.min(f64::from(pace.steps)) as u32;
                    for _ in 0..count {
                        if outcome.divergence.is_none() {
                            take(scene, &loads, state, &step, &mut outcome);
                        }
                    }
                    let now = tled::critical_step(scene, state).map_or(0.0, |bound| bound.seconds);
                    let outrun = outcome.divergence.is_some() || step.seconds() > now;
                    if outrun && step.seconds() > SHORTEST * at_rest.seconds {
                        (*state, outcome.limits) = before;
                        outcome.divergence = None;
                        (pace.longest, pace.steps) = (0.5 * step.seconds(), 1);
                    } else {
                        outcome.steps.0 = outcome.steps.0.min(step.seconds());
                        outcome.steps.1 = outcome.steps.1.max(step.seconds());
                        // Look more often while the critical step falls fast.
                        let fall = (1.0 - now / pace.critical).max(0.0);
                        let calm = (FALL / fall * pace.steps as f32) as u32;
                        pace.steps = calm.min(2 * pace.steps).clamp(1, STEPS_BETWEEN_LOOKS);
                        pace.longest = (pace.longest * (1.0 + GROWTH * count as f32)).min(SHARE * now);
                        pace.critical = now;
                    }
                }
            }
        }
        outcome.spent += start.elapsed();
        if outcome.divergence.is_some() {
            break;
        }
        let bound = critical(scene, state)?;
        if bound.seconds < outcome.least.0.seconds {
            outcome.least = (bound, state.time());
        }
        if step.seconds() > bound.seconds && matches!(setup.step, StepChoice::Seconds(_)) {
            outcome.above_from.get_or_insert(state.time());
        }
        frame(scene, state)?;
    }
    Ok(outcome)
}

fn take<M: Material>(
    scene: &HostScene<M>,
    loads: &Loads<'_>,
    state: &mut HostState,
    step: &Step,
    outcome: &mut Outcome,
) {
    match tled::step(scene, loads, state, step) {
        Status::Limited { least_volume_ratio, saturation, energy_excess } => {
            let limits = &mut outcome.limits;
            if limits.steps == 0 {
                limits.first_time = state.time();
            }
            limits.steps += 1;
            limits.least_volume_ratio = limits.least_volume_ratio.min(least_volume_ratio);
            limits.saturation = limits.saturation.max(saturation);
            limits.energy_excess = limits.energy_excess.max(energy_excess);
        }
        Status::Diverged(divergence) => outcome.divergence = Some(divergence),
        // The state and the loads are this scene's own, so they match.
        _ => {}
    }
}
