//! What moves a scene, over memory of whoever owns it: the loop of every host.

use super::Report;
use crate::adaptive::AdaptiveView;
use crate::element::ElementMaterial;
use crate::guard::{Estimate, GuardView, judged};
use crate::inertia::{self, LargeModel};
use crate::learned::{LearnedError, LearnedReport, LearnedView, Undone};
use crate::loads::{Loads, LoadsOverTime};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::{Progress, StateView};
use crate::step::{Cause, Divergence, MOST_OF_SIZE, ROUNDING, Status, Step, Threads, Work, equal_steps};
use crate::tled::{self, Approach, Pace};

/// How often a long step is halved that tissue or an instrument is too fast for.
const MOST_HALVINGS: u32 = 3;

/// What moves a scene, borrowed for a call.
#[derive(Debug)]
// They stand in memory of the caller for as long as a call.
#[allow(clippy::large_enum_variant)]
pub enum Mover<'a, 'w> {
    /// Exact steps.
    Exact(ExactSteps<'a>),
    /// Steps beyond the critical one, with the storage in which they were prepared, and what estimates their error.
    Long(&'a mut LargeModel, &'a mut [NodeVector], Option<GuardView<'a>>),
    /// Steps that choose their length.
    Auto(AdaptiveView<'a>),
    /// Learned steps, the exact ones that lead them, and what estimates their error.
    Learned(LearnedView<'a, 'w>, ExactSteps<'a>, &'a mut Lead, Option<GuardView<'a>>),
}

/// How exact steps are taken.
#[derive(Debug)]
pub enum ExactSteps<'a> {
    /// Of at most this length.
    Fixed(Step),
    /// Of nine tenths of the critical step at the moment, with [`tled::vectors_for_pace`] vectors to undo steps.
    Paced {
        /// Their length at present.
        pace: &'a mut Pace,
        /// To undo them.
        kept: &'a mut [NodeVector],
        /// 1/s.
        damping: f32,
    },
}

/// How long exact steps lead before a network takes over. They lead again where the state was reset or restored.
#[derive(Clone, Copy, Debug)]
pub struct Lead {
    /// Of the network's intervals, in all and still to come.
    all: u64,
    left: u64,
}

impl Lead {
    /// Of so many of the network's intervals ([`crate::learned::LearnedModel::intervals`]).
    #[must_use]
    pub const fn new(intervals: u64) -> Self {
        Self { all: intervals, left: intervals }
    }
}

/// What a step was.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum StepKind {
    /// An exact one.
    Exact,
    /// One beyond the critical step.
    Long,
    /// A span of steps that choose their length.
    Auto,
    /// A network's.
    Learned,
}

/// What happens in a call, for hosts that watch each step.
#[derive(Debug)]
pub enum Event<'a> {
    /// Exact steps begin at this time (s) that may be taken back.
    Tries(f64),
    /// They are taken back.
    TakenBack,
    /// A network's step begins at this time, s.
    Predicts(f64),
    /// What it found; exact steps follow in its place if it was taken back.
    Predicted(LearnedReport),
    /// What the step beyond the critical one that follows did to inertia.
    Raised(inertia::Report),
    /// A step, or a refusal; the state is that after it.
    Step(StepKind, Status, &'a StateView<'a>),
    /// What is known of the error after a step.
    Judged(Status, Option<Estimate>, &'a StateView<'a>),
}

/// A call.
struct Call<'c, L, T, W> {
    loads: &'c mut L,
    threads: &'c T,
    watch: &'c mut W,
    report: Report,
    work: Work,
}

/// A span shorter than this share of the last step is left to the next call: what an instrument or a lattice does to nodes in
/// one step, a step that is far shorter would turn into velocities.
const SHORTEST: f64 = 1.0 / 16.0;

impl Mover<'_, '_> {
    /// Moves on until the time `until` (s), or to a step that is refused: the state is then that before it, and the
    /// report has the status; or until the work is spent, which the status says. `watch` is shown each step.
    #[allow(clippy::too_many_arguments)]
    // Not inlined: other crates use the one that is compiled here.
    #[inline(never)]
    pub fn advance<M: ElementMaterial>(
        self,
        until: f64,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        mut state: StateView<'_>,
        work: Work,
        threads: &impl Threads,
        watch: &mut impl FnMut(Event<'_>),
    ) -> Result<Report, LearnedError> {
        let report = Report::new(state.time());
        let mut call = Call { loads, threads, watch, report, work };
        let span = until - state.time();
        match self {
            // The last call may have ended here or beyond; a span that is no number is none either.
            mover if span.is_nan() || span <= SHORTEST * f64::from(state.last_step()) => {
                call.report.estimate = mover.estimate(&state);
                call.report.enter(still_true(state.progress, call.report.estimate));
            }
            Self::Exact(mut exact) => {
                call.exact_steps(&mut exact, span, 0.0, scene, &mut state);
            }
            Self::Long(model, storage, guard) => call.long_steps(model, storage, guard, span, scene, &mut state),
            Self::Auto(adaptive) => call.auto_steps(adaptive, span, scene, &mut state),
            Self::Learned(learned, exact, lead, guard) => {
                call.learned_steps(learned, exact, lead, guard, span, scene, &mut state)?;
            }
        }
        let missing = until - state.time();
        if call.work.is_spent() && call.report.status.is_taken() && missing > ROUNDING * span {
            call.report.enter(Status::Behind { seconds: missing });
        }
        call.report.status = call.report.status.at_end(state.progress);
        Ok(Report { time: state.time(), ..call.report })
    }
}

impl Mover<'_, '_> {
    /// What is known of the error of a state that its own steps have led to.
    fn estimate(&self, state: &StateView<'_>) -> Option<Estimate> {
        let (watch, estimate) = match self {
            Self::Long(.., Some(guard)) | Self::Learned(.., Some(guard)) => (&*guard.watch, guard.watch.estimate()),
            Self::Auto(AdaptiveView { chooser, watch, .. }) => (&**watch, chooser.estimate(watch)),
            _ => return None,
        };
        estimate.filter(|_| watch.follows(state.progress))
    }
}

/// What the last step said of a state in which no step is taken, and its estimate.
fn still_true(progress: &Progress, estimate: Option<Estimate>) -> Status {
    if progress.last_step() == 0.0 {
        return Status::Ok;
    }
    let taken = Status::of_taken(&progress.extremes, &progress.energy_balance, false);
    estimate.map_or(taken, |Estimate { mean, allowed, .. }| judged(taken, mean, allowed))
}

#[cfg(any(feature = "std", feature = "capi-neo-hookean"))]
impl Mover<'_, '_> {
    /// Steps of another kind follow, of about so many seconds: those beyond the critical one give the last increment the velocity
    /// at its end, under the loads as they are.
    pub(crate) fn end_long_steps<M: ElementMaterial>(
        self,
        seconds: f32,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        state: StateView<'_>,
        threads: &impl Threads,
    ) {
        if state.last_step() <= seconds {
            return;
        }
        let loads = loads.of_step(&state, state.last_step(), u32::MAX);
        match self {
            Self::Long(model, storage, _) => {
                let _ = model.with_storage(storage).shorten(seconds, scene, &loads, state, threads);
            }
            Self::Auto(adaptive) => adaptive.end_long_steps(seconds, scene, &loads, state, threads),
            Self::Exact(_) | Self::Learned(..) => {}
        }
    }
}

impl<L: LoadsOverTime, T: Threads, W: FnMut(Event<'_>)> Call<'_, L, T, W> {
    /// Takes exact steps for `span` seconds; the call goes on for `rest` seconds after them. Whether all were taken.
    fn exact_steps<M: ElementMaterial>(
        &mut self,
        exact: &mut ExactSteps<'_>,
        span: f64,
        rest: f64,
        scene: SceneView<'_, M>,
        state: &mut StateView<'_>,
    ) -> bool {
        let Self { loads, threads, watch, report, work } = self;
        let loads = &mut Longer { loads: &mut **loads, rest };
        match exact {
            ExactSteps::Fixed(step) => {
                let (count, seconds) = equal_steps(span, step.seconds());
                // Only a span of 1e-18 s or less: that is no step.
                let Ok(step) = Step::unchecked(seconds, step.damping()) else { return true };
                for done in 0..count {
                    if work.is_spent() {
                        return false;
                    }
                    work.exact_steps(1);
                    let loads = loads.of_step(state, seconds, count - done);
                    let status = tled::step_in_parts(scene, &loads, state.reborrow(), &step, *threads);
                    watch(Event::Step(StepKind::Exact, status, state));
                    report.enter(status);
                    if !status.is_taken() {
                        report.undone += 1;
                        return false;
                    }
                    report.exact += 1;
                    report.enter_length(seconds);
                }
                true
            }
            ExactSteps::Paced { pace, kept, damping } => {
                let until = state.time() + span;
                while until - state.time() > ROUNDING * span {
                    if work.is_spent() {
                        return false;
                    }
                    watch(Event::Tries(state.time()));
                    let (left, mut worst, mut taken) = (until - state.time(), Status::Ok, 0);
                    let enter = |status: Status, _: &Loads<'_>, state: StateView<'_>| {
                        watch(Event::Step(StepKind::Exact, status, &state));
                        worst = worst.worse(status);
                        taken += 1;
                    };
                    let (state, most) = (state.reborrow(), *work);
                    let answer = pace.approach(left, *damping, most, scene, loads, state, kept, *threads, enter);
                    work.exact_steps(taken);
                    match answer {
                        Approach::Undone => {
                            report.undone += taken;
                            watch(Event::TakenBack);
                        }
                        // The rest is no step.
                        Approach::TooShort => return true,
                        Approach::Taken { seconds } => {
                            report.enter(worst);
                            report.exact += taken;
                            report.enter_length(seconds);
                        }
                        Approach::Refused(status) => {
                            report.enter(status);
                            report.exact += taken.saturating_sub(1);
                            report.undone += 1;
                            return false;
                        }
                    }
                }
                true
            }
        }
    }

    /// The same after a network's steps. Where one is refused because of energy that these have left, the body is
    /// stopped where it is, which the status tells, and steps go on.
    fn exact_steps_after_network<M: ElementMaterial>(
        &mut self,
        exact: &mut ExactSteps<'_>,
        span: f64,
        rest: f64,
        scene: SceneView<'_, M>,
        state: &mut StateView<'_>,
    ) -> bool {
        let (before, until) = (self.report, state.time() + span);
        if self.exact_steps(exact, span, rest, scene, state) {
            return true;
        }
        let Some(told) = energy_excess(self.report.status) else { return false };
        if !tled::stop_in(scene, state.reborrow()) {
            return false;
        }
        self.report = Report { exact: self.report.exact, undone: self.report.undone, ..before };
        self.report.enter(told);
        (self.watch)(Event::TakenBack);
        self.exact_steps(exact, until - state.time(), rest, scene, state)
    }

    fn long_steps<M: ElementMaterial>(
        &mut self,
        model: &mut LargeModel,
        storage: &mut [NodeVector],
        mut guard: Option<GuardView<'_>>,
        span: f64,
        scene: SceneView<'_, M>,
        state: &mut StateView<'_>,
    ) {
        let until = state.time() + span;
        let (count, seconds) = equal_steps(span, model.first());
        if let Some(step) = model.ask(seconds) {
            if let Some(guard) = &mut guard {
                let seconds = step.seconds() * (guard.watch.longest() / model.longest());
                let loads = self.loads.of_step(state, step.seconds(), count);
                if let Ok(longer) = Step::unchecked(seconds, step.damping()) {
                    guard.reborrow().change_step(longer, scene, Some(&loads), self.threads);
                }
            }
            model.change_step(step);
        }
        model.follow(state.progress);
        let mut longest = model.longest();
        let shortest = longest / (1 << MOST_HALVINGS) as f32;
        let (mut left, mut seconds) = equal_steps(span, longest);
        while left > 0 && !self.work.is_spent() {
            self.work.long_step();
            // Only a span of 1e-18 s or less: that is no step.
            if model.set_seconds(seconds).is_err() {
                return;
            }
            let loads = self.loads.of_step(state, seconds, left);
            let status = model.with_storage(storage).step_in_parts(scene, &loads, state.reborrow(), self.threads);
            if status.is_too_far() && longest > shortest {
                self.report.undone += 1;
                longest *= 0.5;
                (left, seconds) = equal_steps(until - state.time(), longest);
                continue;
            }
            if status.is_taken() {
                (self.watch)(Event::Raised(*model.report()));
            }
            (self.watch)(Event::Step(StepKind::Long, status, state));
            self.report.enter(status);
            if !status.is_taken() {
                self.report.undone += 1;
                return;
            }
            left -= 1;
            self.report.long += 1;
            self.report.enter_length(seconds);
            if let Some(guard) = &mut guard {
                let status = guard.reborrow().follow(Status::Ok, scene, &loads, state.reborrow(), self.threads);
                self.report.estimate = guard.watch.estimate();
                (self.watch)(Event::Judged(status, self.report.estimate, state));
                self.report.enter(status);
            }
        }
    }

    fn auto_steps<M: ElementMaterial>(
        &mut self,
        adaptive: AdaptiveView<'_>,
        span: f64,
        scene: SceneView<'_, M>,
        state: &mut StateView<'_>,
    ) {
        let AdaptiveView { chooser, first, second, watch, storage } = adaptive;
        let view = AdaptiveView { chooser: &mut *chooser, first, second, watch: &mut *watch, storage };
        let work = &mut self.work;
        let (status, taken) = view.advance(span as f32, work, scene, self.loads, state.reborrow(), self.threads);
        let own = if matches!(status, Status::Inexact { .. }) { Status::Ok } else { status };
        (self.watch)(Event::Step(StepKind::Auto, own, state));
        let report = &mut self.report;
        report.estimate = chooser.estimate(watch);
        (report.exact, report.long, report.changes) = (taken.exact, taken.large, taken.changes);
        report.undone = u32::from(!status.is_taken());
        report.seconds = taken.seconds;
        (self.watch)(Event::Judged(status, report.estimate, state));
        report.enter(status);
    }

    #[allow(clippy::too_many_arguments)]
    fn learned_steps<M: ElementMaterial>(
        &mut self,
        mut learned: LearnedView<'_, '_>,
        mut exact: ExactSteps<'_>,
        lead: &mut Lead,
        mut guard: Option<GuardView<'_>>,
        span: f64,
        scene: SceneView<'_, M>,
        state: &mut StateView<'_>,
    ) -> Result<(), LearnedError> {
        let seconds = learned.model().seconds();
        let count = libm::round(span / f64::from(seconds)).clamp(0.0, f64::from(u32::MAX)) as u32;
        for done in 0..count {
            if self.work.is_spent() {
                return Ok(());
            }
            if !learned.model().is_led(state) {
                if state.last_step() == 0.0 {
                    // From rest, also after a reset: the frames have followed nothing yet.
                    learned.reset();
                    lead.left = lead.all;
                } else if lead.left < lead.all {
                    // The state was restored, or has moved without the network.
                    lead.left = lead.all;
                }
            }
            let is_leading = lead.left > 0;
            lead.left = lead.left.saturating_sub(1);
            let mut exact_next = is_leading || learned.model().is_exact_next();
            if !exact_next {
                self.work.long_step();
                let loads = self.loads.of_step(state, seconds, count - done);
                (self.watch)(Event::Predicts(state.time()));
                let tried = learned.try_step(scene, &loads, state, exact.seconds(), self.threads)?;
                (self.watch)(Event::Predicted(*learned.model().report()));
                match tried {
                    Ok(status) => {
                        (self.watch)(Event::Step(StepKind::Learned, status, state));
                        self.report.enter(status);
                        if !status.is_taken() {
                            self.report.undone += 1;
                            return Ok(());
                        }
                        self.report.learned += 1;
                        self.report.enter_length(seconds);
                    }
                    Err(Undone) => {
                        self.report.undone += 1;
                        exact_next = true;
                    }
                }
            }
            if exact_next {
                self.report.fell_back |= !is_leading;
                let rest = f64::from(count - done - 1) * f64::from(seconds);
                let (mut taken, recovers) = (true, learned.model().undoes() && !is_leading);
                // The interval is not cut: the frames of the network follow all of it.
                let mut work = core::mem::replace(&mut self.work, Work::UNBOUNDED);
                let computed = self.report.exact + self.report.undone;
                // A step that was refused is in the report.
                let _ = learned.lead_interval(state, |state| {
                    let span = f64::from(seconds);
                    taken = match recovers {
                        true => self.exact_steps_after_network(&mut exact, span, rest, scene, state),
                        false => self.exact_steps(&mut exact, span, rest, scene, state),
                    };
                    if taken { Status::Ok } else { self.report.status }
                });
                work.exact_steps((self.report.exact + self.report.undone).saturating_sub(computed));
                self.work = work;
                if !taken {
                    return Ok(());
                }
            }
            if let Some(guard) = &mut guard {
                // Moved supports are where they have come to.
                let loads = self.loads.of_step(state, seconds, u32::MAX);
                let status = guard.reborrow().follow(Status::Ok, scene, &loads, state.reborrow(), self.threads);
                self.report.estimate = guard.watch.estimate();
                // Exact steps that lead have no error.
                let status = if is_leading { Status::Ok } else { status };
                (self.watch)(Event::Judged(status, self.report.estimate, state));
                self.report.enter(status);
                let lost = if is_leading { None } else { lost_node(scene, self.report.estimate) };
                if let Some(status) = matches!(status, Status::Inexact { .. }).then_some(status).or(lost) {
                    learned.fall_back(state.time(), status);
                }
            }
        }
        Ok(())
    }
}

impl ExactSteps<'_> {
    /// The length of the next steps, s.
    fn seconds(&self) -> f32 {
        match self {
            Self::Fixed(step) => step.seconds(),
            Self::Paced { pace, .. } => pace.seconds(),
        }
    }
}

/// Whether the estimated error of a node is more than half the size of its tissue: the mean may hide one that runs
/// away. The status that says so.
fn lost_node<M: ElementMaterial>(scene: SceneView<'_, M>, estimate: Option<Estimate>) -> Option<Status> {
    let Estimate { largest, node, .. } = estimate?;
    let allowed = MOST_OF_SIZE * scene.node_size(node as usize);
    (largest > allowed).then_some(Status::Inexact { error: largest, allowed })
}

/// What to tell in place of a step that was refused because of energy that nothing gave.
fn energy_excess(status: Status) -> Option<Status> {
    let Status::Diverged(Divergence { cause: Cause::Energy { kinetic, available }, .. }) = status else { return None };
    let energy_excess = ((kinetic / available.max(f64::MIN_POSITIVE)) as f32).min(f32::MAX);
    Some(Status::Limited { least_volume_ratio: 1.0, saturation: 0.0, energy_excess })
}

/// The loads of a call that goes on for `rest` seconds after the span of these steps.
struct Longer<'l, L> {
    loads: &'l mut L,
    rest: f64,
}

impl<L: LoadsOverTime> LoadsOverTime for Longer<'_, L> {
    fn of_step(&mut self, state: &StateView<'_>, seconds: f32, left: u32) -> Loads<'_> {
        // Not one step less for a rounding.
        let more = if self.rest > 0.0 { libm::round(self.rest / f64::from(seconds)) as u32 } else { 0 };
        self.loads.of_step(state, seconds, left.saturating_add(more))
    }
}
