//! A simulation from rest to its end: steps, frames at even intervals, what became of it.
//!
//! `step = "auto"` takes a share of the critical step, which falls as tissue stiffens: it is asked for anew
//! every few steps, and steps after which it turns out to be shorter than they were are undone and taken
//! again in halves. A sudden load on one node needs that: one step may stiffen its elements tenfold.
//!
//! With `[surrogate]` a network takes over (learned.rs); the same step leads.

use std::time::{Duration, Instant};

use supple::loads::Loads;
use supple::material::{J_FLOOR, Material};
use supple::tled::{self, CriticalStep, Divergence, Status, Step};

use crate::large_steps::{Grid, HostInertia, Trace};
use crate::learned::{LearnedRun, LearnedTrace};
use crate::prepare::{HostScene, HostState, Setup};
use crate::scene_file::Problem;
use crate::timing::{Method, StepChoice};

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

/// Steps with elements beyond the range of their law, with energy the account does not explain, or held back.
#[derive(Clone, Copy, Default)]
pub(crate) struct Limits {
    pub(crate) steps: u64,
    pub(crate) first_time: f64,
    pub(crate) least_volume_ratio: f32,
    pub(crate) saturation: f32,
    pub(crate) energy_excess: f32,
    /// Steps for no other cause than motion that was held back.
    pub(crate) held_back: u64,
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
    /// Time spent in steps, looks at the critical step included.
    pub(crate) spent: Duration,
    pub(crate) limits: Limits,
    pub(crate) divergence: Option<Divergence>,
    /// The first frame at which a fixed step was above the bound.
    pub(crate) above_from: Option<f64>,
    /// What the inertia did, with a method that has one.
    pub(crate) trace: Option<Trace>,
    /// What the network did, with one.
    pub(crate) learned: Option<LearnedTrace>,
}

/// The step that the scene file asks for. The exact step is refused above the critical one unless the user
/// insists.
pub(crate) fn first_step(setup: &Setup, at_rest: CriticalStep, insist: bool) -> Result<Step, Problem> {
    let time = &setup.time;
    let exact = time.method == Method::Tled;
    let seconds = match time.step {
        StepChoice::Seconds(seconds) => seconds,
        StepChoice::Multiple(multiple) => multiple * at_rest.seconds,
        StepChoice::Auto => SHARE * at_rest.seconds,
    };
    // An interval of a network is a whole number of exact steps.
    let seconds = match (&setup.learned, time.step) {
        (None, _) | (_, StepChoice::Auto) => seconds,
        (Some(learned), _) => learned.exact_seconds(setup, seconds)?,
    };
    let step = if insist || !exact {
        Step::insist(seconds, setup.damping)
    } else {
        Step::new(seconds, setup.damping, at_rest)
    };
    let step = step.map_err(|error| {
        let advice = if exact {
            "; shorten it, write step = \"auto\", insist with --insist, or go beyond with method = \"multilevel\""
        } else {
            ""
        };
        Problem(format!("{}: {error}{advice}", time.step_at))
    })?;
    if !matches!(time.step, StepChoice::Auto) {
        time.check_length(seconds)?;
    }
    Ok(step)
}

/// The bound at the state, or a problem: there is none for a state that is not finite.
pub(crate) fn critical<M: Material>(
    scene: &HostScene<M>,
    state: &mut HostState,
) -> Result<CriticalStep, Problem> {
    tled::critical_step(scene, state)
        .ok_or_else(|| Problem("the stiffness of some element is not a finite number".into()))
}

/// A simulation at rest: everything that can be refused has been.
pub(crate) struct Start<'a> {
    at_rest: CriticalStep,
    step: Step,
    inertia: Option<HostInertia>,
    learned: Option<LearnedRun<'a>>,
}

impl<'a> Start<'a> {
    pub(crate) fn new<M: Material>(
        setup: &'a Setup,
        scene: &HostScene<M>,
        state: &mut HostState,
        insist: bool,
    ) -> Result<Self, Problem> {
        let at_rest = critical(scene, state)?;
        let step = first_step(setup, at_rest, insist)?;
        let inertia = if setup.time.method == Method::Tled {
            None
        } else {
            let inertia = Grid::wanted(setup, scene)?.prepare(setup, scene, state, step);
            Some(inertia.map_err(|error| Problem(format!("{}: {error}", setup.body.name)))?)
        };
        let learned = match &setup.learned {
            Some(learned) => Some(LearnedRun::new(learned, scene.node_count())?),
            None => None,
        };
        Ok(Self { at_rest, step, inertia, learned })
    }
}

/// Runs to the end or to divergence. `frame` is called at rest and after each interval, `tick` with the time
/// now and then.
pub(crate) fn run<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    state: &mut HostState,
    start: Start<'_>,
    tick: impl Fn(f64),
    mut frame: impl FnMut(&HostScene<M>, &HostState) -> Result<(), Problem>,
) -> Result<Outcome, Problem> {
    let loads = Loads::new(scene, setup.gravity, &setup.forces, &setup.motions)
        .map_err(|error| Problem(error.to_string()))?;
    let Start { at_rest, step, mut inertia, mut learned } = start;
    let mut outcome = Outcome {
        at_rest,
        least: (at_rest, 0.0),
        steps: (step.seconds(), step.seconds()),
        computed: 0,
        spent: Duration::ZERO,
        limits: Limits { least_volume_ratio: 1.0, ..Limits::default() },
        divergence: None,
        above_from: None,
        trace: inertia.as_ref().map(Trace::new),
        learned: None,
    };
    let mut pace = Pace { longest: SHARE * at_rest.seconds, critical: at_rest.seconds, steps: 1 };
    frame(scene, state)?;
    let automatic = matches!(setup.time.step, StepChoice::Auto);
    // Time goes in even intervals, each one step or one of a network, unless the exact step alone sets its pace.
    let interval = learned.as_ref().map_or(step.seconds(), LearnedRun::seconds);
    let even = !automatic || learned.is_some();
    let total = (setup.time.end / f64::from(interval)).round().max(1.0) as u64;
    let mut taken = 0;
    // No two frames of one state.
    let frames = if even { total.min(setup.time.frames.into()) } else { setup.time.frames.into() };
    for index in 1..=frames {
        let share = index as f64 / frames as f64;
        let clock = Instant::now();
        // Automatic steps of the exact method up to a time.
        let mut reach = |state: &mut HostState, target: f64, outcome: &mut Outcome| {
            // A remainder of rounding is no step.
            while target - state.time() > 1e-9 * setup.time.end && outcome.divergence.is_none() {
                tick(state.time());
                pace.advance(setup, scene, &loads, state, target, outcome)?;
            }
            Ok::<_, Problem>(())
        };
        let target = (total as f64 * share).round() as u64;
        if !even {
            reach(state, setup.time.end * share, &mut outcome)?;
        }
        while even && taken < target && outcome.divergence.is_none() {
            taken += 1;
            match &mut learned {
                None => take(scene, &loads, state, &step, inertia.as_mut(), &mut outcome),
                Some(learned) => {
                    let exact = |state: &mut HostState, outcome: &mut Outcome| {
                        if automatic {
                            return reach(state, state.time() + f64::from(interval), outcome);
                        }
                        for _ in 0..(interval / step.seconds()).round() as u32 {
                            if outcome.divergence.is_none() {
                                take(scene, &loads, state, &step, None, outcome);
                            }
                        }
                        Ok(())
                    };
                    learned.advance(scene, &loads, state, &mut outcome, step.seconds(), exact)?;
                }
            }
            if taken % u64::from(STEPS_BETWEEN_LOOKS) == 0 {
                tick(state.time());
            }
        }
        outcome.spent += clock.elapsed();
        if outcome.divergence.is_some() {
            break;
        }
        let bound = critical(scene, state)?;
        if bound.seconds < outcome.least.0.seconds {
            outcome.least = (bound, state.time());
        }
        let exact = learned.as_ref().map_or(inertia.is_none(), LearnedRun::is_exact);
        if step.seconds() > bound.seconds && !automatic && exact {
            outcome.above_from.get_or_insert(state.time());
        }
        frame(scene, state)?;
    }
    outcome.learned = learned.map(|learned| learned.trace);
    Ok(outcome)
}

impl Pace {
    /// Some steps of an automatic length towards `target`, or none if they were too long.
    fn advance<M: Material>(
        &mut self,
        setup: &Setup,
        scene: &HostScene<M>,
        loads: &Loads<'_>,
        state: &mut HostState,
        target: f64,
        outcome: &mut Outcome,
    ) -> Result<(), Problem> {
        let remaining = target - state.time();
        let count = (remaining / f64::from(self.longest)).ceil().max(1.0);
        let step = Step::insist((remaining / count) as f32, setup.damping)
            .map_err(|error| Problem(error.to_string()))?;
        let before = (state.clone(), outcome.limits);
        let count = count.min(f64::from(self.steps)) as u32;
        for _ in 0..count {
            if outcome.divergence.is_none() {
                take(scene, loads, state, &step, None, outcome);
            }
        }
        let now = tled::critical_step(scene, state).map_or(0.0, |bound| bound.seconds);
        let outrun = outcome.divergence.is_some() || step.seconds() > now;
        if outrun && step.seconds() > SHORTEST * outcome.at_rest.seconds {
            (*state, outcome.limits) = before;
            outcome.divergence = None;
            (self.longest, self.steps) = (0.5 * step.seconds(), 1);
        } else {
            outcome.steps.0 = outcome.steps.0.min(step.seconds());
            outcome.steps.1 = outcome.steps.1.max(step.seconds());
            // Look more often while the critical step falls fast.
            let fall = (1.0 - now / self.critical).max(0.0);
            let calm = (FALL / fall * self.steps as f32) as u32;
            self.steps = calm.min(2 * self.steps).clamp(1, STEPS_BETWEEN_LOOKS);
            self.longest = (self.longest * (1.0 + GROWTH * count as f32)).min(SHARE * now);
            self.critical = now;
        }
        Ok(())
    }
}

fn take<M: Material>(
    scene: &HostScene<M>,
    loads: &Loads<'_>,
    state: &mut HostState,
    step: &Step,
    inertia: Option<&mut HostInertia>,
    outcome: &mut Outcome,
) {
    let status = match inertia {
        None => tled::step(scene, loads, state, step),
        Some(inertia) => {
            let status = inertia.step(scene, loads, state);
            if let Some(trace) = &mut outcome.trace {
                trace.add(inertia.report());
            }
            status
        }
    };
    outcome.enter(status, state);
}

impl Outcome {
    /// Takes down what a step said that led to `state`.
    pub(crate) fn enter(&mut self, status: Status, state: &HostState) {
        self.computed += 1;
        match status {
            Status::Limited { least_volume_ratio, saturation, energy_excess } => {
                let limits = &mut self.limits;
                if limits.steps == 0 {
                    limits.first_time = state.time();
                }
                limits.steps += 1;
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
