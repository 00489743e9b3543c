//! A simulation from rest to its end: steps, frames at even intervals, what became of it.

use std::time::{Duration, Instant};

use supple::loads::Loads;
use supple::material::Material;
use supple::tled::{self, CriticalStep, Divergence, Status, Step};

use crate::prepare::{HostScene, HostState, Setup, StepChoice};
use crate::scene_file::Problem;

/// With `step = "auto"`: steps between two looks at the critical step, and the share of it taken.
const STEPS_BETWEEN_LOOKS: u32 = 50;
const SHARE: f32 = 0.9;

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
                    let bound = critical(scene, state)?;
                    let remaining = target - state.time();
                    let count = (remaining / f64::from(SHARE * bound.seconds)).ceil().max(1.0);
                    step = Step::insist((remaining / count) as f32, setup.damping)
                        .map_err(|error| Problem(error.to_string()))?;
                    outcome.steps.0 = outcome.steps.0.min(step.seconds());
                    outcome.steps.1 = outcome.steps.1.max(step.seconds());
                    for _ in 0..(count as u64).min(u64::from(STEPS_BETWEEN_LOOKS)) {
                        if outcome.divergence.is_none() {
                            take(scene, &loads, state, &step, &mut outcome);
                        }
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
