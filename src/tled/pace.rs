//! Exact steps whose length follows the critical step, which falls as tissue stiffens. It is asked for anew every few
//! steps, and steps after which it turns out to be shorter than they were are undone and taken again in halves: a
//! sudden load on one node may stiffen its elements tenfold in one step.

use crate::copy::copy;
use crate::element::ElementMaterial;
use crate::loads::{Loads, LoadsOverTime};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::{CriticalStep, Status, Step, Threads};

use super::{critical_step, step_in_parts};

/// By which share the critical step may fall between two looks.
const FALL: f32 = 0.03;
/// By which share per step a step grows after it had to shrink. Slowly: steps that change in time with the motion feed
/// energy into it (Skeel 1993, "Variable step size destabilizes the Stoermer/leapfrog/Verlet method").
const GROWTH: f32 = 0.002;
/// Share of the first critical step below which a step is not halved any further.
const SHORTEST: f32 = 1e-4;
/// The same in seconds: [`Step::unchecked`] takes no shorter ones, and a span is cut in steps of half of it or more.
const LEAST: f32 = 4e-18;

/// How long exact steps may be at present.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    shortest: f32,
    /// The step may be this long, s.
    longest: f32,
    /// The critical step at the last look, s.
    critical: f32,
    /// Steps to the next look.
    steps: u32,
}

/// What became of some steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Approach {
    /// Some were taken.
    Taken {
        /// Their length, s.
        seconds: f32,
    },
    /// None was taken: the span is shorter than any step.
    TooShort,
    /// They were too long: the state is as before.
    Undone,
    /// The step of this length (s) is refused, and a shorter one is of no use.
    Refused(Status),
}

/// Vectors of storage for a state of so many nodes, to undo steps.
#[must_use]
pub const fn vectors_for_pace(nodes: usize) -> usize {
    2 * nodes
}

impl Pace {
    /// Share of the critical step that is taken.
    pub const SHARE: f32 = 0.9;
    /// Most steps between two looks at the critical step.
    pub const STEPS_BETWEEN_LOOKS: u32 = 50;

    /// Steps of [`Pace::SHARE`] of a critical step at first.
    #[must_use]
    pub const fn new(critical: CriticalStep) -> Self {
        let CriticalStep { seconds, .. } = critical;
        Self { shortest: (SHORTEST * seconds).max(LEAST), longest: Self::SHARE * seconds, critical: seconds, steps: 1 }
    }

    /// The longest step at present, s.
    #[must_use]
    pub const fn seconds(&self) -> f32 {
        self.longest
    }

    /// The critical step is to be looked at after the next step: other steps have moved the state.
    pub const fn look_soon(&mut self) {
        self.steps = 1;
    }

    /// Takes steps until the next look at the critical step, of a length of which whole numbers make up `left` seconds,
    /// and no more of them than that. `enter` is called after each step. `kept` are [`vectors_for_pace`] vectors.
    #[allow(clippy::too_many_arguments)]
    pub fn approach<M: ElementMaterial>(
        &mut self,
        left: f64,
        damping: f32,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        mut state: StateView<'_>,
        kept: &mut [NodeVector],
        threads: &impl Threads,
        mut enter: impl FnMut(Status, &Loads<'_>, &StateView<'_>),
    ) -> Approach {
        let whole = whole_steps(left, f64::from(self.longest));
        let Ok(step) = Step::unchecked((left / whole) as f32, damping) else {
            return Approach::TooShort;
        };
        let seconds = step.seconds();
        let nodes = scene.node_count();
        let (displacement, increment) = kept.split_at_mut(nodes.min(kept.len()));
        copy(displacement, state.displacement);
        copy(increment, state.increment);
        let progress = *state.progress;
        let count = whole.min(f64::from(self.steps)) as u32;
        let mut refused = None;
        for done in 0..count {
            let of_step = loads.of_step(&state, seconds, (whole as u32).saturating_sub(done));
            let status = step_in_parts(scene, &of_step, state.reborrow(), &step, threads);
            enter(status, &of_step, &state);
            if !status.is_taken() {
                refused = Some(status);
                break;
            }
        }
        let now = critical_step(&scene, &mut state).map_or(0.0, |bound| bound.seconds);
        let outrun = refused.is_some() || seconds > now;
        if outrun && seconds > self.shortest {
            copy(state.displacement, displacement);
            copy(state.increment, increment);
            *state.progress = progress;
            (self.longest, self.steps) = (0.5 * seconds, 1);
            return Approach::Undone;
        }
        // Look more often while the critical step falls fast.
        let fall = (1.0 - now / self.critical).max(0.0);
        let steps = (FALL / fall * self.steps as f32) as u32;
        self.steps = steps.min(2 * self.steps).clamp(1, Self::STEPS_BETWEEN_LOOKS);
        // No shorter than is of use: a state without a critical step is refused by the step itself.
        self.longest = (self.longest * (1.0 + GROWTH * count as f32)).min(Self::SHARE * now).max(self.shortest);
        self.critical = now;
        refused.map_or(Approach::Taken { seconds }, Approach::Refused)
    }
}

/// The least number of equal steps, each at most `longest` (s), that make up a span (s).
fn whole_steps(span: f64, longest: f64) -> f64 {
    libm::ceil(span / longest).max(1.0)
}
