//! Exact steps whose length follows the critical step, which falls as tissue stiffens. It is asked for anew every few
//! steps, and steps after which it turns out to be shorter than they were are undone and taken again in halves: a
//! sudden load on one node may stiffen its elements tenfold in one step.

use bytemuck::must_cast_slice_mut;

use crate::copy::copy;
use crate::element::{ElementMaterial, Extremes};
use crate::loads::{Loads, LoadsOverTime};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::{CriticalStep, Status, Step, Threads};

use super::critical::{Weights, critical};
use super::step_in_parts;

/// By which share the critical step may fall between two looks.
const FALL: f32 = 0.05;
/// Change of the critical step after which the weights of its bound are chosen anew.
const STALE: f32 = 0.05;
/// Relative fall of the least volume ratio, or rise of the saturation, after which the critical step is looked at at
/// once.
const SQUEEZE: f32 = 0.1;
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
    /// The critical step for which the weights of its bound were chosen, s; zero before the first look.
    weighed: f32,
    /// The least volume ratio less one and the largest saturation between the last two looks.
    extremes: Extremes<f32>,
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

/// Vectors of storage for a state of so many nodes, to undo steps and to look at the critical step.
#[must_use]
pub const fn vectors_for_pace(nodes: usize) -> usize {
    2 * nodes + nodes.div_ceil(4)
}

impl Pace {
    /// Share of the critical step that is taken.
    pub const SHARE: f32 = 0.9;
    /// Most steps between two looks at the critical step.
    pub const STEPS_BETWEEN_LOOKS: u32 = 256;

    /// Steps of [`Pace::SHARE`] of a critical step at first.
    #[must_use]
    pub const fn new(critical: CriticalStep) -> Self {
        let CriticalStep { seconds, .. } = critical;
        Self {
            shortest: (SHORTEST * seconds).max(LEAST),
            longest: Self::SHARE * seconds,
            critical: seconds,
            steps: 1,
            weighed: 0.0,
            extremes: Extremes::REST,
        }
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
        let (displacement, kept) = kept.split_at_mut(nodes.min(kept.len()));
        let (increment, weights) = kept.split_at_mut(nodes.min(kept.len()));
        copy(displacement, state.displacement);
        copy(increment, state.increment);
        let progress = *state.progress;
        let count = whole.min(f64::from(self.steps)) as u32;
        let (mut refused, mut taken, mut extremes) = (None, 0, Extremes::none());
        while taken < count {
            let of_step = loads.of_step(&state, seconds, (whole as u32).saturating_sub(taken));
            let status = step_in_parts(scene, &of_step, state.reborrow(), &step, threads);
            enter(status, &of_step, &state);
            if !status.is_taken() {
                refused = Some(status);
                break;
            }
            taken += 1;
            extremes = extremes.merged_with(&state.extremes);
            if is_squeezed(&extremes, &self.extremes) {
                break;
            }
        }
        let now = self.look(scene, state.reborrow(), must_cast_slice_mut(weights));
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
        let steps = (FALL / fall * taken.max(1) as f32) as u32;
        self.steps = steps.min(2 * self.steps).clamp(1, Self::STEPS_BETWEEN_LOOKS);
        // No shorter than is of use: a state without a critical step is refused by the step itself.
        self.longest = (self.longest * (1.0 + GROWTH * taken as f32)).min(Self::SHARE * now).max(self.shortest);
        (self.critical, self.extremes) = (now, extremes);
        refused.map_or(Approach::Taken { seconds }, Approach::Refused)
    }

    /// The critical step at the state (s), zero if there is none. `weights` are those of the last look.
    fn look<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        mut state: StateView<'_>,
        weights: &mut [f32],
    ) -> f32 {
        let mut with = |chosen: bool| {
            let of_nodes = &mut *weights;
            critical(scene, state.reborrow(), &mut Weights { of_nodes, chosen }).map_or(0.0, |bound| bound.seconds)
        };
        if self.weighed > 0.0 {
            let now = with(true);
            if (now / self.weighed - 1.0).abs() <= STALE {
                return now;
            }
        }
        self.weighed = with(false);
        self.weighed
    }
}

/// Whether elements are squeezed much more, or nearer to the end of their law, than they were.
fn is_squeezed(now: &Extremes<f32>, before: &Extremes<f32>) -> bool {
    1.0 + now.least_change < (1.0 - SQUEEZE) * (1.0 + before.least_change)
        || now.saturation > before.saturation + SQUEEZE
}

/// The least number of equal steps, each at most `longest` (s), that make up a span (s).
fn whole_steps(span: f64, longest: f64) -> f64 {
    libm::ceil(span / longest).max(1.0)
}
