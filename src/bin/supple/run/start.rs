//! A simulation at rest: what moves the scene, and the length of its steps. All that can be refused is refused here.

use supple::guard::{self, Allowed, Guard};
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::{NodeVector, VecState};
use supple::step::{CriticalStep, Step};
use supple::tled::{self, Pace};

use super::adaptive::AdaptiveRun;
use super::exact::{Automatic, ExactSteps, Motion};
use super::large::{PreparedStep, grid, prepare};
use super::learned::LearnedRun;
use super::outcome::Outcome;
use crate::problem::Problem;
use crate::scene::setup::Setup;
use crate::scene::timing::StepChoice;

/// What moves a scene.
pub(crate) enum Mover<'a> {
    Exact(ExactSteps),
    /// Mass-scaled, multilevel or damped steps.
    Large(Box<PreparedStep>),
    Learned(Box<LearnedRun<'a>>),
    Adaptive(Box<AdaptiveRun>),
}

impl Mover<'_> {
    /// Moves on by one interval: a step of `seconds`, or one of a network.
    pub(crate) fn advance(
        &mut self,
        motion: &Motion<'_>,
        state: &mut VecState,
        outcome: &mut Outcome,
        seconds: f32,
    ) -> Result<(), Problem> {
        match self {
            Self::Exact(steps) => {
                steps.advance(motion, state, outcome, seconds);
                Ok(())
            }
            Self::Learned(learned) => learned.advance(motion, state, outcome),
            Self::Adaptive(adaptive) => {
                adaptive.advance(motion, state, outcome, seconds);
                Ok(())
            }
            Self::Large(large) => {
                let status = large.step(motion.scene, &motion.loads, state.view());
                if let Some(trace) = &mut outcome.large {
                    trace.enter(large.report());
                }
                outcome.enter(status, &state.view());
                Ok(())
            }
        }
    }

    /// Whether the latest interval was of exact steps that lead a network, which have no error.
    pub(crate) fn is_leading(&self) -> bool {
        matches!(self, Self::Learned(learned) if learned.is_leading())
    }

    /// The length of fixed exact steps (s), while they move the scene.
    pub(crate) fn fixed_exact_seconds(&self) -> Option<f32> {
        match self {
            Self::Exact(ExactSteps::Fixed(step)) => Some(step.seconds()),
            Self::Learned(learned) => learned.fixed_exact_seconds(),
            _ => None,
        }
    }
}

/// Longest adaptive step that is tried unless the scene file says otherwise, over the critical one.
const LONGEST: f32 = 100.0;

/// A simulation at rest.
pub(crate) struct Start<'a> {
    pub(crate) at_rest: CriticalStep,
    /// The step that was asked for, with a network the exact one.
    pub(crate) step: Step,
    pub(crate) mover: Mover<'a>,
    /// Of steps beyond the critical one.
    pub(crate) guard: Option<Guard<Vec<NodeVector>>>,
}

impl<'a> Start<'a> {
    pub(crate) fn new(
        setup: &'a Setup,
        scene: SceneView<'_, VecMaterial>,
        state: &mut VecState,
        unchecked: bool,
    ) -> Result<Self, Problem> {
        let at_rest = critical(scene, state)?;
        let step = first_step(setup, at_rest, unchecked)?;
        let exact = match setup.time.step {
            StepChoice::Auto => ExactSteps::Automatic(Automatic::at_rest(at_rest, scene.node_count())),
            _ => ExactSteps::Fixed(step),
        };
        let mover = match (&setup.time.method, &setup.learned) {
            (Some(method), _) if setup.time.is_adaptive => {
                Mover::Adaptive(Box::new(AdaptiveRun::new(method, setup, scene, state, step)?))
            }
            (Some(method), _) => {
                grid(setup, scene, method)?;
                Mover::Large(Box::new(prepare(method, setup, scene, state, step)?))
            }
            (None, Some(choice)) => {
                Mover::Learned(Box::new(LearnedRun::new(choice, scene.node_count(), exact)?))
            }
            (None, None) => Mover::Exact(exact),
        };
        let guard = match &mover {
            Mover::Exact(_) | Mover::Adaptive(_) => None,
            Mover::Large(_) => Some((step.seconds(), guard::EVERY)),
            Mover::Learned(learned) => Some((learned.seconds(), guard::EVERY_LEARNED)),
        };
        let guard = guard.map(|(seconds, every)| {
            let step = Step::unchecked(seconds, setup.damping).map_err(Problem::of)?;
            Guard::prepare_in_vec(scene, &setup.body.local, state.view(), step, every)
                .map(|guard| match setup.time.tolerance {
                    Some(metres) => guard.allowing(Allowed::Metres(metres)),
                    None => guard,
                })
                .map_err(|error| Problem(format!("{}: {error}", setup.body.name)))
        });
        let guard = guard.transpose()?;
        Ok(Self { at_rest, step, mover, guard })
    }
}

/// The step that the scene file asks for. The exact step is refused above the critical one unless `unchecked`.
pub(crate) fn first_step(setup: &Setup, at_rest: CriticalStep, unchecked: bool) -> Result<Step, Problem> {
    let time = &setup.time;
    let is_exact = time.method.is_none();
    let seconds = match time.step {
        StepChoice::Seconds(seconds) => seconds,
        StepChoice::Multiple(multiple) => multiple * at_rest.seconds,
        StepChoice::Auto if time.is_adaptive => {
            (LONGEST * at_rest.seconds).min((time.end / f64::from(time.frames)) as f32)
        }
        StepChoice::Auto => Pace::SHARE * at_rest.seconds,
    };
    // An interval of a network is a whole number of exact steps.
    let seconds = match (&setup.learned, time.step) {
        (None, _) | (_, StepChoice::Auto) => seconds,
        (Some(learned), _) => learned.exact_seconds(seconds, time)?,
    };
    let step = if unchecked || !is_exact {
        Step::unchecked(seconds, setup.damping)
    } else {
        Step::new(seconds, setup.damping, at_rest)
    };
    let step = step.map_err(|error| {
        let advice = if is_exact {
            "; shorten it, write step = \"auto\", unchecked with --unchecked, or go beyond with method = \"multilevel\""
        } else {
            ""
        };
        Problem(format!("{}: {error}{advice}", time.step_at))
    })?;
    if matches!(time.step, StepChoice::Auto) && !time.is_adaptive {
        return Ok(step);
    }
    time.check_length(seconds)?;
    if setup.learned.is_some() {
        return Ok(step);
    }
    Step::unchecked(fitted(seconds, time.end, time.frames), setup.damping).map_err(Problem::of)
}

/// The longest step, at most `seconds`, of which whole numbers reach the frames and the end (s) but for rounding; only the
/// end, if there are more frames than steps.
fn fitted(seconds: f32, end: f64, frames: u32) -> f32 {
    let longest = f64::from(seconds);
    let between_frames = end / f64::from(frames);
    let interval = if between_frames < longest { end } else { between_frames };
    // `seconds` may have been rounded down.
    let count = whole_steps(interval, longest * (1.0 + f64::from(f32::EPSILON)));
    ((interval / count) as f32).min(seconds)
}

/// The least number of equal steps, each at most `longest` (s), that make up a span (s).
fn whole_steps(span: f64, longest: f64) -> f64 {
    (span / longest).ceil().max(1.0)
}

/// The bound of the critical step at the state, or a problem: there is none for a state that is not finite.
pub(crate) fn critical(
    scene: SceneView<'_, VecMaterial>,
    state: &mut VecState,
) -> Result<CriticalStep, Problem> {
    tled::critical_step(&scene, state)
        .ok_or_else(|| Problem("the stiffness of some element is not a finite number".into()))
}
