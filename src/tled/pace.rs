//! Exact steps whose length follows the critical step, which falls as tissue stiffens. It is asked for anew every few
//! steps, and steps after which it turns out to be shorter than they were are undone and taken again in halves: a
//! sudden load on one node may stiffen its elements tenfold in one step.

use bytemuck::must_cast_slice_mut;

use crate::copy::copy;
use crate::element::{ElementMaterial, Extremes};
use crate::loads::{Loads, LoadsOverTime};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::{MOVED_VECTORS, Moment, StateView};
use crate::step::{CriticalStep, ROUNDING, Status, Step, StepError, Threads, Work, equal_steps};

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
    /// It never is longer than this, s, nor than this share of the critical step.
    most: f32,
    share: f32,
    /// The critical step at the last look, s.
    critical: f32,
    /// Steps from the last look to the next, and those of them that earlier calls have taken.
    steps: u32,
    taken: u32,
    /// The state that the last steps have left, where their span was to end, s, and their length, s.
    moment: Option<Moment>,
    end: f64,
    length: f32,
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

/// Vectors of storage for a state of so many nodes whose tissue remembers `memory` vectors
/// ([`SceneView::memory_vectors`]), to undo steps, to look at the critical step, and to keep the forces of the latest
/// step meanwhile.
#[must_use]
pub const fn vectors_for_pace(nodes: usize, memory: usize) -> usize {
    (MOVED_VECTORS + 1) * nodes + nodes.div_ceil(4) + memory / 2
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
            most: f32::INFINITY,
            share: Self::SHARE,
            critical: seconds,
            steps: 1,
            taken: 0,
            moment: None,
            end: 0.0,
            length: 0.0,
            weighed: 0.0,
            extremes: Extremes::REST,
        }
    }

    /// The same, or steps of so many seconds where they are given, shorter ones where the critical step falls. Refused
    /// if they are above it, and with a damping (1/s) that cannot be one.
    pub fn of(seconds: Option<f32>, damping: f32, critical: CriticalStep) -> Result<Self, StepError> {
        let pace = Self::new(critical);
        let Some(seconds) = seconds else { return Step::unchecked(pace.longest, damping).map(|_| pace) };
        let share = Self::SHARE.max(seconds / critical.seconds);
        Step::new(seconds, damping, critical).map(|_| Self { longest: seconds, most: seconds, share, ..pace })
    }

    /// The longest step at present, s.
    #[must_use]
    pub const fn seconds(&self) -> f32 {
        self.longest
    }

    /// The critical step is to be looked at after the next step: other steps have moved the state.
    pub const fn look_soon(&mut self) {
        (self.steps, self.taken) = (1, 0);
    }

    /// Takes steps until the next look at the critical step, of a length of which whole numbers make up `left` seconds,
    /// and no more of them than that or than there is work for. `enter` is called after each step. `kept` are
    /// [`vectors_for_pace`] vectors.
    #[allow(clippy::too_many_arguments)]
    pub fn approach<M: ElementMaterial>(
        &mut self,
        left: f64,
        damping: f32,
        work: Work,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        mut state: StateView<'_>,
        kept: &mut [NodeVector],
        threads: &impl Threads,
        mut enter: impl FnMut(Status, &Loads<'_>, StateView<'_>),
    ) -> Approach {
        let (whole, seconds) = self.steps_to(state.time() + left, left);
        let Ok(step) = Step::unchecked(seconds, damping) else {
            return Approach::TooShort;
        };
        if self.moment != Some(state.moment()) {
            self.look_soon();
        }
        let nodes = scene.node_count();
        let saved = MOVED_VECTORS * nodes + scene.memory_vectors() / 2;
        let (before, kept) = kept.split_at_mut(saved.min(kept.len()));
        let (force, weights) = kept.split_at_mut(nodes.min(kept.len()));
        state.save(nodes, before);
        let progress = *state.progress;
        let count = whole.min(self.steps.saturating_sub(self.taken)).min(work.left().max(1));
        let (mut refused, mut taken, mut extremes, mut squeezed) = (None, 0, Extremes::none(), false);
        while taken < count && !squeezed {
            let of_step = loads.of_step(&state, seconds, whole.saturating_sub(taken));
            let status = step_in_parts(scene, &of_step, state.reborrow(), &step, threads);
            enter(status, &of_step, state.reborrow());
            if !status.is_taken() {
                refused = Some(status);
                break;
            }
            taken += 1;
            extremes = extremes.merged_with(&state.extremes);
            squeezed = is_squeezed(&extremes, &self.extremes);
        }
        self.taken += taken;
        if refused.is_none() && self.taken < self.steps && !squeezed {
            // The call ends, and steps go on in the next.
            self.moment = Some(state.moment());
            return Approach::Taken { seconds };
        }
        copy(force, state.force);
        let now = self.look(scene, state.reborrow(), must_cast_slice_mut(weights));
        // The look has used them as scratch.
        copy(state.force, force);
        // An instrument that is too fast for an exact step is too fast for any: a jump.
        let jumps = refused.is_some_and(Status::is_too_far);
        let outrun = (refused.is_some() && !jumps) || seconds > now;
        if outrun && seconds > self.shortest {
            *state.progress = progress;
            state.restore(nodes, before);
            self.longest = 0.5 * seconds;
            self.look_soon();
            self.moment = Some(state.moment());
            return Approach::Undone;
        }
        // Look more often while the critical step falls fast.
        let fall = (1.0 - now / self.critical).max(0.0);
        let steps = (FALL / fall * self.taken.max(1) as f32) as u32;
        self.steps = steps.min(2 * self.steps).clamp(1, Self::STEPS_BETWEEN_LOOKS);
        // No shorter than is of use: a state without a critical step is refused by the step itself.
        let grown = self.longest * (1.0 + GROWTH * self.taken as f32);
        self.longest = grown.min(self.share * now).min(self.most).max(self.shortest);
        (self.critical, self.extremes, self.taken) = (now, extremes, 0);
        self.moment = Some(state.moment());
        refused.map_or(Approach::Taken { seconds }, Approach::Refused)
    }

    /// How many steps make up `left` seconds until `end` (s), and their length: that of the steps before if these were
    /// to end there too, without a new rounding.
    fn steps_to(&mut self, end: f64, left: f64) -> (u32, f32) {
        let (whole, seconds) = equal_steps(left, self.longest);
        let goes_on = (end - self.end).abs() < 0.5 * left && (seconds / self.length - 1.0).abs() < ROUNDING as f32;
        (self.end, self.length) = (end, if goes_on { self.length } else { seconds });
        (whole, self.length)
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
