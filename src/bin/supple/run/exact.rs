//! Exact steps, of one length or of an automatic one ([`Pace`]).

use supple::loads::Loads;
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::{NodeVector, StateView, VecState};
use supple::step::{CallingThread, CriticalStep, Step};
use supple::tled::{self, Approach, Pace, vectors_for_pace};

use super::outcome::Outcome;

/// Steps are single precision: their sum may miss a time by this share of the whole.
pub(crate) const ROUNDING: f64 = 1e-7;

/// What a scene moves under.
#[derive(Clone, Copy)]
pub(crate) struct Motion<'a> {
    pub(crate) scene: SceneView<'a, VecMaterial>,
    pub(crate) loads: Loads<'a>,
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
    Automatic(Automatic),
}

impl ExactSteps {
    /// The first step's length, s.
    pub(crate) fn seconds(&self) -> f32 {
        match self {
            Self::Fixed(step) => step.seconds(),
            Self::Automatic(automatic) => automatic.first,
        }
    }

    /// Moves on by `seconds`, a whole number of fixed steps, or until a step diverges.
    pub(crate) fn advance(
        &mut self,
        motion: &Motion<'_>,
        state: &mut VecState,
        outcome: &mut Outcome,
        seconds: f32,
    ) {
        match self {
            Self::Automatic(automatic) => {
                automatic.reach(motion, state, outcome, state.time() + f64::from(seconds));
            }
            Self::Fixed(step) => {
                take(motion, state, outcome, step, (seconds / step.seconds()).round() as u32)
            }
        }
    }
}

/// Where automatic steps stand.
pub(crate) struct Automatic {
    pace: Pace,
    /// Length of the first step, s.
    first: f32,
    /// To undo steps.
    kept: Vec<NodeVector>,
}

impl Automatic {
    pub(crate) fn at_rest(critical: CriticalStep, nodes: usize) -> Self {
        let pace = Pace::new(critical);
        Self { first: pace.seconds(), pace, kept: vec![NodeVector::ZERO; vectors_for_pace(nodes)] }
    }

    /// Moves on to a time (s), or until a step diverges.
    pub(crate) fn reach(
        &mut self,
        motion: &Motion<'_>,
        state: &mut VecState,
        outcome: &mut Outcome,
        target: f64,
    ) {
        let Motion { scene, damping, mut loads, end, tick } = *motion;
        // A remainder of rounding is no step.
        while target - state.time() > ROUNDING * end && outcome.divergence.is_none() {
            tick(state.time());
            let left = target - state.time();
            let (before, mark) = (outcome.limits, outcome.reactions.mark());
            let (view, kept) = (state.view(), &mut self.kept);
            let enter = |status, _: &Loads<'_>, state: &StateView<'_>| outcome.enter(status, state);
            match self.pace.approach(left, damping, scene, &mut loads, view, kept, &CallingThread, enter) {
                Approach::Undone => {
                    (outcome.limits, outcome.divergence) = (before, None);
                    outcome.reactions.take_back(mark);
                }
                // The rest is no step.
                Approach::TooShort => return,
                Approach::Taken { seconds } => {
                    let (shortest, longest) = &mut outcome.steps;
                    (*shortest, *longest) = (shortest.min(seconds), longest.max(seconds));
                }
                Approach::Refused(_) => {}
            }
        }
    }
}

/// Takes so many exact steps, or until one diverges.
fn take(motion: &Motion<'_>, state: &mut VecState, outcome: &mut Outcome, step: &Step, count: u32) {
    for _ in 0..count {
        if outcome.divergence.is_none() {
            let status = tled::step(&motion.scene, &motion.loads, state, step);
            outcome.enter(status, &state.view());
        }
    }
}
