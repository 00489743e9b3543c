//! Exact steps, of one length or of an automatic one.
//!
//! `step = "auto"` takes a share of the critical step, which falls as tissue stiffens: it is asked for anew
//! every few steps, and steps after which it turns out to be shorter than they were are undone and taken
//! again in halves. A sudden load on one node needs that: one step may stiffen its elements tenfold.

use supple::element::ElementMaterial;
use supple::loads::Loads;
use supple::scene::SceneView;
use supple::state::VecState;
use supple::step::{CriticalStep, Step};
use supple::tled;

use super::outcome::Outcome;
use crate::problem::Problem;

/// Most steps between two looks at the critical step.
pub(crate) const STEPS_BETWEEN_LOOKS: u32 = 50;
/// Share of the critical step that an automatic one takes.
pub(crate) const SHARE: f32 = 0.9;
/// By which share the critical step may fall between two looks.
const FALL: f32 = 0.03;
/// By which share per step an automatic step grows after it had to shrink. Slowly: steps that change in time
/// with the motion feed energy into it (Skeel 1993, "Variable step size destabilizes the
/// Stoermer/leapfrog/Verlet method").
const GROWTH: f32 = 0.002;
/// Share of the critical step at rest below which an automatic step is not halved any further.
const SHORTEST: f32 = 1e-4;

/// What a scene moves under.
#[derive(Clone, Copy)]
pub(crate) struct Motion<'a, M> {
    pub(crate) scene: SceneView<'a, M>,
    pub(crate) loads: &'a Loads<'a>,
    /// 1/s.
    pub(crate) damping: f32,
    /// s.
    pub(crate) end: f64,
    /// Is told the time now and then, s.
    pub(crate) tick: &'a dyn Fn(f64),
}

/// How exact steps are taken.
pub(crate) enum ExactSteps {
    Fixed(Step),
    Automatic(Pace),
}

impl ExactSteps {
    /// The first step's length, s.
    pub(crate) fn seconds(&self) -> f32 {
        match self {
            Self::Fixed(step) => step.seconds(),
            Self::Automatic(pace) => pace.first,
        }
    }

    /// Moves on by `seconds`, a whole number of fixed steps, or until a step diverges.
    pub(crate) fn advance<M: ElementMaterial>(
        &mut self,
        motion: &Motion<'_, M>,
        state: &mut VecState,
        outcome: &mut Outcome,
        seconds: f32,
    ) -> Result<(), Problem> {
        match self {
            Self::Automatic(pace) => pace.reach(motion, state, outcome, state.time() + f64::from(seconds)),
            Self::Fixed(step) => {
                take(motion, state, outcome, step, (seconds / step.seconds()).round() as u32);
                Ok(())
            }
        }
    }
}

/// Where automatic steps stand.
pub(crate) struct Pace {
    /// The length at rest, s.
    first: f32,
    /// The step may be this long, s.
    longest: f32,
    /// The critical step at the last look, s.
    critical: f32,
    /// Steps to the next look.
    steps: u32,
}

impl Pace {
    pub(crate) fn at_rest(critical: CriticalStep) -> Self {
        let first = SHARE * critical.seconds;
        Self { first, longest: first, critical: critical.seconds, steps: 1 }
    }

    /// Moves on to a time (s), or until a step diverges.
    pub(crate) fn reach<M: ElementMaterial>(
        &mut self,
        motion: &Motion<'_, M>,
        state: &mut VecState,
        outcome: &mut Outcome,
        target: f64,
    ) -> Result<(), Problem> {
        // A remainder of rounding is no step.
        while target - state.time() > 1e-9 * motion.end && outcome.divergence.is_none() {
            (motion.tick)(state.time());
            self.approach(motion, state, outcome, target)?;
        }
        Ok(())
    }

    /// Some steps towards `target`, or none if they were too long.
    fn approach<M: ElementMaterial>(
        &mut self,
        motion: &Motion<'_, M>,
        state: &mut VecState,
        outcome: &mut Outcome,
        target: f64,
    ) -> Result<(), Problem> {
        let remaining = target - state.time();
        let count = whole_steps(remaining, f64::from(self.longest));
        let step = Step::unchecked((remaining / count) as f32, motion.damping).map_err(Problem::of)?;
        let before = (state.clone(), outcome.limits);
        let count = count.min(f64::from(self.steps)) as u32;
        take(motion, state, outcome, &step, count);
        let now = tled::critical_step(&motion.scene, state).map_or(0.0, |bound| bound.seconds);
        let outrun = outcome.divergence.is_some() || step.seconds() > now;
        if outrun && step.seconds() > SHORTEST * outcome.at_rest.seconds {
            (*state, outcome.limits) = before;
            outcome.divergence = None;
            (self.longest, self.steps) = (0.5 * step.seconds(), 1);
        } else {
            let (shortest, longest) = &mut outcome.steps;
            (*shortest, *longest) = (shortest.min(step.seconds()), longest.max(step.seconds()));
            // Look more often while the critical step falls fast.
            let fall = (1.0 - now / self.critical).max(0.0);
            let steps = (FALL / fall * self.steps as f32) as u32;
            self.steps = steps.min(2 * self.steps).clamp(1, STEPS_BETWEEN_LOOKS);
            self.longest = (self.longest * (1.0 + GROWTH * count as f32)).min(SHARE * now);
            self.critical = now;
        }
        Ok(())
    }
}

/// The least number of equal steps, each at most `longest` (s), that make up a span (s).
pub(crate) fn whole_steps(span: f64, longest: f64) -> f64 {
    (span / longest).ceil().max(1.0)
}

/// Takes so many exact steps, or until one diverges.
fn take<M: ElementMaterial>(
    motion: &Motion<'_, M>,
    state: &mut VecState,
    outcome: &mut Outcome,
    step: &Step,
    count: u32,
) {
    for _ in 0..count {
        if outcome.divergence.is_none() {
            let status = tled::step(&motion.scene, motion.loads, state, step);
            outcome.enter(status, state);
        }
    }
}
