//! The adaptive step: the host says which mean error of the nodes it accepts (m), and the step chooses its length while
//! it runs, as long as possible and as short as needed, down to the exact step.
//!
//! Its lengths are the longest one that the host allows, usually a frame's time, and halves of it down to six times the
//! critical step; below, there are exact steps. A [`crate::guard`] estimates the error; its second run takes the steps
//! of the next longer length, so that it also knows what that length would do. `control.rs` decides after each
//! comparison. A change of length computes all inertia anew in the next step and changes neither displacements nor
//! velocities.
//!
//! What instruments and targets of pulls are going to do in a step is known beforehand: where one begins to move far, exact steps
//! meet it. What begins within a step without that, as a support or a force that the host changes, shows when it is over.
//!
//! What a span of time costs is bounded: it is never cut in more steps than exact ones need, and between two
//! comparisons the length changes once at most. No step makes an error undone that is there already: where the estimate
//! exceeds the tolerance the status is [`Status::Inexact`], until the body has forgotten the error.

mod control;

use core::ops::Add;

use crate::element::ElementMaterial;
use crate::guard::{self, Allowed, Estimate, GuardView, Watch, judged};
use crate::inertia::{InertiaError, LargeModel, Method, Report, vectors_for as vectors_for_method};
use crate::loads::{Loads, LoadsOverTime};
use crate::material::Material;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::{Moment, StateView};
use crate::step::{CallingThread, Status, Step, Threads, Work, extreme_lengths};
use crate::tled::{self, Approach, Pace, vectors_for_pace};
use control::Control;

/// Least length of a step beyond the critical one, over the critical step.
const LEAST_MULTIPLE: f32 = 6.0;
/// Relative error of times that are sums of steps.
const ROUNDING: f64 = 1e-6;

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Mean error of the nodes that is accepted, m.
    pub tolerance: f32,
    /// The longest step, and damping.
    pub longest: Step,
}

/// Vectors of storage that adaptive steps of a method need on a scene with these `points` (m).
pub fn vectors_for<M: Material>(
    method: &Method,
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
) -> Result<usize, InertiaError> {
    vectors_with(vectors_for_method(method, scene, points)?, scene, points)
}

/// The same for a method that needs so many.
pub(crate) fn vectors_with<M: Material>(
    of_method: usize,
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
) -> Result<usize, InertiaError> {
    Ok(vectors_for_pace(scene.node_count(), scene.memory_vectors()) + of_method + guard::vectors_for(scene, points)?)
}

/// What chooses the length of the steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chooser {
    request: Request,
    control: Control,
    /// Of exact steps.
    pace: Pace,
    nodes: usize,
    /// Vectors of what tissue remembers.
    memory: usize,
    /// Vectors of the first run's inertia.
    vectors: usize,
    /// At the end of the latest call.
    moment: Option<Moment>,
}

/// Adaptive steps without their storage; they may be moved in memory.
#[derive(Clone, Debug)]
pub struct AdaptiveModel {
    chooser: Chooser,
    first: LargeModel,
    second: LargeModel,
    watch: Watch,
}

impl AdaptiveModel {
    /// Adaptive steps of this method from the present state, for a scene with these `points` (m) at rest. They begin as
    /// exact ones. `storage` of [`vectors_for`] vectors is overwritten.
    pub fn prepare<M: ElementMaterial>(
        method: Method,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        mut state: StateView<'_>,
        request: Request,
        storage: &mut [NodeVector],
    ) -> Result<Self, InertiaError> {
        let chooser = Chooser::new(&method, scene, points, state.reborrow(), request)?;
        let StorageParts { first, second, .. } = chooser.checked(storage, scene, points)?;
        let mut of_first =
            chooser.with_longest(|step| LargeModel::prepare(method, scene, points, state.reborrow(), step, first))?;
        let step = chooser.shortest()?;
        of_first.change_step(step);
        let (of_second, watch) = Watch::prepare(scene, points, state, step, 1, second, |mut state, step, storage| {
            let mut model = chooser.with_longest(|step| {
                LargeModel::prepare(guard::second_run(), scene, points, state.reborrow(), step, storage)
            })?;
            model.change_step(step);
            Ok(model)
        })?;
        Ok(Self { first: of_first, second: of_second, watch: chooser.allowing(watch), chooser })
    }

    /// Mean error of the nodes that is accepted, m.
    #[must_use]
    pub const fn tolerance(&self) -> f32 {
        self.chooser.request.tolerance
    }

    /// Length of the next steps, s.
    #[must_use]
    pub fn seconds(&self) -> f32 {
        self.chooser.seconds()
    }

    /// See [`crate::guard::GuardModel::estimate`].
    #[must_use]
    pub fn estimate(&self) -> Option<Estimate> {
        self.chooser.estimate(&self.watch)
    }

    /// Report of the latest step beyond the critical one.
    #[must_use]
    pub const fn report(&self) -> &Report {
        self.first.report()
    }

    /// The model with the storage in which it was prepared.
    pub const fn with_storage<'a>(&'a mut self, storage: &'a mut [NodeVector]) -> AdaptiveView<'a> {
        let Self { chooser, first, second, watch } = self;
        AdaptiveView { chooser, first, second, watch, storage }
    }
}

impl Chooser {
    pub(crate) fn new<M: ElementMaterial>(
        method: &Method,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        mut state: StateView<'_>,
        request: Request,
    ) -> Result<Self, InertiaError> {
        let critical = tled::critical_step(&scene, &mut state).ok_or(InertiaError::NotFinite { node: 0 })?;
        let lengths = control::lengths(request.longest.seconds() / (LEAST_MULTIPLE * critical.seconds));
        Ok(Self {
            control: Control::new(request.tolerance, lengths, request.longest.damping()),
            pace: Pace::new(critical),
            nodes: scene.node_count(),
            memory: scene.memory_vectors(),
            vectors: vectors_for_method(method, scene, points)?,
            request,
            moment: None,
        })
    }

    /// The parts of a storage that is large enough.
    pub(crate) fn checked<'a, M: Material>(
        &self,
        storage: &'a mut [NodeVector],
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
    ) -> Result<StorageParts<'a>, InertiaError> {
        let (needed, capacity) = (vectors_with(self.vectors, scene, points)?, storage.len());
        let error = InertiaError::Capacity { kind: "vectors", needed, capacity };
        if capacity < needed { Err(error) } else { self.parts(storage).ok_or(error) }
    }

    fn parts<'a>(&self, storage: &'a mut [NodeVector]) -> Option<StorageParts<'a>> {
        let (kept, rest) = storage.split_at_mut_checked(vectors_for_pace(self.nodes, self.memory))?;
        let (first, second) = rest.split_at_mut_checked(self.vectors)?;
        Some(StorageParts { kept, first, second })
    }

    /// The shortest step beyond the critical one.
    pub(crate) fn shortest(&self) -> Result<Step, InertiaError> {
        self.step_of(self.control.lengths().saturating_sub(1))
    }

    /// Prepares inertia with the longest step that single precision allows: a lattice that is stable in it is stable in
    /// shorter ones.
    pub(crate) fn with_longest<T>(
        &self,
        mut prepare: impl FnMut(Step) -> Result<T, InertiaError>,
    ) -> Result<T, InertiaError> {
        let mut halvings = 0;
        loop {
            match prepare(self.step_of(halvings)?) {
                Err(InertiaError::Singular { .. }) if halvings + 1 < self.control.lengths() => halvings += 1,
                answer => return answer,
            }
        }
    }

    /// Judges by the tolerance.
    pub(crate) const fn allowing(&self, mut watch: Watch) -> Watch {
        watch.start_is_exact();
        watch.allow(Allowed::Metres(self.request.tolerance));
        watch
    }

    /// The step after so many halvings.
    fn step_of(&self, halvings: u32) -> Result<Step, InertiaError> {
        let (longest, seconds) = (self.request.longest, self.seconds_of(halvings));
        Step::unchecked(seconds, longest.damping()).map_err(|_| InertiaError::Step { seconds, most: longest.seconds() })
    }

    pub(crate) fn seconds(&self) -> f32 {
        self.control.halvings().map_or(self.pace.seconds(), |halvings| self.seconds_of(halvings))
    }

    fn seconds_of(&self, halvings: u32) -> f32 {
        self.request.longest.seconds() * libm::exp2f(-(halvings as f32))
    }

    /// Exact steps have no error of their own; what steps before them have left behind is forgotten with time.
    pub(crate) fn estimate(&self, watch: &Watch) -> Option<Estimate> {
        if self.control.halvings().is_some() {
            return watch.estimate();
        }
        let [mean, largest] = self.control.left_behind();
        let node = watch.estimate().map_or(0, |estimate| estimate.node);
        Some(Estimate { mean, largest, node, allowed: self.request.tolerance })
    }
}

/// StorageParts of the storage.
pub(crate) struct StorageParts<'a> {
    /// To undo exact steps.
    pub(crate) kept: &'a mut [NodeVector],
    /// Of both runs.
    pub(crate) first: &'a mut [NodeVector],
    pub(crate) second: &'a mut [NodeVector],
}

/// Adaptive steps with borrowed storage.
#[derive(Debug)]
pub struct AdaptiveView<'a> {
    pub(crate) chooser: &'a mut Chooser,
    pub(crate) first: &'a mut LargeModel,
    pub(crate) second: &'a mut LargeModel,
    pub(crate) watch: &'a mut Watch,
    pub(crate) storage: &'a mut [NodeVector],
}

/// What a span of time took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Taken {
    /// Exact steps.
    pub exact: u32,
    /// Steps beyond the critical one.
    pub large: u32,
    /// Changes of the length.
    pub changes: u32,
    /// The shortest and the longest step, s; zeros if none was taken.
    pub seconds: [f32; 2],
}

impl Add for Taken {
    type Output = Self;

    fn add(self, more: Self) -> Self {
        Self {
            exact: self.exact.saturating_add(more.exact),
            large: self.large.saturating_add(more.large),
            changes: self.changes.saturating_add(more.changes),
            seconds: extreme_lengths(self.seconds, more.seconds),
        }
    }
}

impl AdaptiveView<'_> {
    /// See [`Adaptive::advance`].
    pub fn advance<M: ElementMaterial>(
        mut self,
        seconds: f32,
        work: &mut Work,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        mut state: StateView<'_>,
        threads: &impl Threads,
    ) -> (Status, Taken) {
        let end = state.time() + f64::from(seconds);
        let mut taken = Taken::default();
        let Self { chooser: Chooser { control, request, moment, .. }, watch, .. } = &mut self;
        let is_known = moment.is_none_or(|moment| moment == state.progress.moment());
        control.enter_call((1.0 + ROUNDING as f32) * seconds / request.longest.seconds());
        if control.is_far_longer_than_call() {
            watch.compare_next();
        }
        if !is_known && control.halvings().is_some() {
            // Stopped, restored or put, or moved by others: what they knew of its motion holds no longer.
            control.go_exactly([0.0; 2]);
            self.change(scene, None, state.reborrow(), threads, &mut taken);
        }
        let status = self.advance_until(end, work, scene, loads, state.reborrow(), threads, &mut taken);
        self.chooser.moment = Some(state.progress.moment());
        (status, taken)
    }

    #[allow(clippy::too_many_arguments)]
    fn advance_until<M: ElementMaterial>(
        &mut self,
        end: f64,
        work: &mut Work,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        mut state: StateView<'_>,
        threads: &impl Threads,
        taken: &mut Taken,
    ) -> Status {
        let (mut worst, seconds) = (Status::Ok, end - state.time());
        loop {
            let left = end - state.time();
            // A remainder of rounding is no step, and a span that is no number none either.
            if left.is_nan() || left <= ROUNDING * seconds || work.is_spent() {
                return worst;
            }
            let state = state.reborrow();
            let status = if self.chooser.control.halvings().is_none() {
                self.exact_steps(left, work, scene, loads, state, threads, taken)
            } else {
                self.large_steps(left, work, scene, loads, state, threads, taken)
            };
            match status {
                Ok(status) => worst = worst.worse(status),
                Err(last) => return worst.worse(last),
            }
        }
    }

    /// See [`LargeView::shorten`](crate::inertia::LargeView::shorten), of the first run.
    #[cfg(any(feature = "std", feature = "capi-neo-hookean"))]
    pub(crate) fn end_long_steps<M: ElementMaterial>(
        self,
        seconds: f32,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
        threads: &impl Threads,
    ) {
        if let Some(StorageParts { first, .. }) = self.chooser.parts(self.storage) {
            let _ = self.first.with_storage(first).shorten(seconds, scene, loads, state, threads);
        }
    }

    /// Takes exact steps until the next look at the critical step. The worst status, or that with which the span ends
    /// early.
    #[allow(clippy::too_many_arguments)]
    fn exact_steps<M: ElementMaterial>(
        &mut self,
        left: f64,
        work: &mut Work,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        mut state: StateView<'_>,
        threads: &impl Threads,
        taken: &mut Taken,
    ) -> Result<Status, Status> {
        let mismatch = Status::Mismatch { nodes: scene.node_count(), room: 0 };
        let Self { chooser, second: large, watch, storage, .. } = self;
        let Some(StorageParts { kept, second, .. }) = chooser.parts(storage) else { return Err(mismatch) };
        let Request { tolerance, longest } = chooser.request;
        let Chooser { control, pace, .. } = &mut **chooser;
        watch.follow_exact_steps(true);
        if control.begins_probe() {
            watch.begin_anew();
        }
        let (mut worst, most) = (Status::Ok, *work);
        let enter = |status: Status, loads: &Loads<'_>, state: StateView<'_>| {
            work.exact_steps(1);
            if !status.is_taken() {
                return;
            }
            taken.exact += 1;
            let seconds = state.last_step();
            taken.seconds = extreme_lengths(taken.seconds, [seconds; 2]);
            control.wait(seconds);
            control.enter_kinetic(state.energy_balance.kinetic, seconds);
            control.enter_way(loads.way(state.time() - f64::from(seconds), seconds), seconds);
            let [mean, _] = control.left_behind();
            worst = worst.worse(judged(status, mean, tolerance));
            if control.probes() {
                let before = watch.comparisons();
                let guard = GuardView { second: large, watch, storage: second };
                let _ = guard.follow(Status::Ok, scene, loads, state, threads);
                if watch.comparisons() > before {
                    control.probed(watch.distance());
                }
            }
        };
        let answer = pace.approach(left, longest.damping(), most, scene, loads, state.reborrow(), kept, threads, enter);
        match answer {
            // The rest of the span is no step.
            Approach::TooShort => Err(worst),
            Approach::Taken { .. } => {
                if control.ends_probe() {
                    let loads = loads.of_step(&state, longest.seconds(), 1);
                    self.change(scene, Some(&loads), state, threads, taken);
                }
                Ok(worst)
            }
            Approach::Undone => {
                control.rest();
                Ok(Status::Ok)
            }
            Approach::Refused(status) => Err(status),
        }
    }

    /// Takes steps of one length beyond the critical step to the end of the span, or until another length is better.
    /// The worst status, or that with which the span ends early.
    #[allow(clippy::too_many_arguments)]
    fn large_steps<M: ElementMaterial>(
        &mut self,
        left: f64,
        work: &mut Work,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        mut state: StateView<'_>,
        threads: &impl Threads,
        taken: &mut Taken,
    ) -> Result<Status, Status> {
        let mismatch = Status::Mismatch { nodes: scene.node_count(), room: 0 };
        let length = self.chooser.seconds();
        let count = libm::ceil(left / f64::from(length) * (1.0 - ROUNDING)).max(1.0);
        // No longer than was prepared, though the span is by a rounding.
        let seconds = ((left / count) as f32).min(length);
        if self.first.set_seconds(seconds).is_err() {
            // The rest of the span is no step.
            return Err(Status::Ok);
        }
        self.watch.follow_exact_steps(false);
        let (count, mut worst) = (count as u32, Status::Ok);
        for done in 0..count {
            if work.is_spent() {
                return Ok(worst);
            }
            let loads = loads.of_step(&state, seconds, count - done);
            if self.chooser.control.enter_way(loads.way(state.time(), seconds), seconds) {
                self.chooser.control.go_exactly(self.errors());
                self.change(scene, None, state, threads, taken);
                return Ok(worst);
            }
            work.long_step();
            let Some(StorageParts { first, second, .. }) = self.chooser.parts(self.storage) else {
                return Err(mismatch);
            };
            let status = self.first.with_storage(first).step_in_parts(scene, &loads, state.reborrow(), threads);
            if matches!(status, Status::Mismatch { .. }) {
                return Err(status);
            }
            if !status.is_taken() {
                // The length of the second run's steps can change only where both runs are at the same time.
                self.watch.compare_next();
            }
            let before = self.watch.comparisons();
            let guard = GuardView { second: self.second, watch: self.watch, storage: second };
            let _ = guard.follow(Status::Ok, scene, &loads, state.reborrow(), threads);
            let estimate = self.errors();
            let control = &mut self.chooser.control;
            if !status.is_taken() {
                control.refused(estimate);
                self.change(scene, None, state, threads, taken);
                return Ok(worst);
            }
            taken.large += 1;
            taken.seconds = extreme_lengths(taken.seconds, [seconds; 2]);
            control.wait(seconds);
            worst = worst.worse(judged(status, estimate[0], self.chooser.request.tolerance));
            if self.watch.comparisons() > before && control.decide(estimate) {
                self.change(scene, Some(&loads), state, threads, taken);
                return Ok(worst);
            }
        }
        Ok(worst)
    }

    /// The guard's estimates of the mean and the largest error, m.
    fn errors(&self) -> [f32; 2] {
        self.watch.estimate().map_or([0.0; 2], |estimate| [estimate.mean, estimate.largest])
    }

    /// Goes over to the length that was decided upon, with the loads that acted until now, if they still do.
    fn change<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: Option<&Loads<'_>>,
        mut state: StateView<'_>,
        threads: &impl Threads,
        taken: &mut Taken,
    ) {
        taken.changes += 1;
        let Self { chooser, first: large, second, watch, storage } = self;
        let Some(parts) = chooser.parts(storage) else { return };
        let Request { longest, .. } = chooser.request;
        let seconds = chooser.seconds();
        match loads {
            Some(loads) => {
                let _ = large.with_storage(parts.first).shorten(seconds, scene, loads, state, threads);
            }
            // Without acceleration: the load has acted for no time yet.
            None if seconds < state.last_step() => state.respan(seconds),
            None => {}
        }
        let Ok(step) = Step::unchecked(seconds, longest.damping()) else { return };
        if chooser.control.halvings().is_none() {
            chooser.pace.look_soon();
            return;
        }
        large.change_step(step);
        let longer = match chooser.control.halvings_of_second() {
            Some(halvings) => chooser.step_of(halvings).ok(),
            None => Step::unchecked(2.0 * longest.seconds(), longest.damping()).ok(),
        };
        if let Some(step) = longer {
            let guard = GuardView { second, watch, storage: parts.second };
            guard.change_step(step, scene, loads, threads);
        }
    }
}

/// Adaptive steps with storage `S` of the caller.
#[derive(Clone, Debug)]
pub struct Adaptive<S> {
    model: AdaptiveModel,
    storage: S,
}

impl<S: AsMut<[NodeVector]>> Adaptive<S> {
    /// See [`AdaptiveModel::prepare`].
    pub fn prepare<M: ElementMaterial>(
        method: Method,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        request: Request,
        mut storage: S,
    ) -> Result<Self, InertiaError> {
        let model = AdaptiveModel::prepare(method, scene, points, state, request, storage.as_mut())?;
        Ok(Self { model, storage })
    }

    /// The model, for its estimate and the length of its steps.
    #[must_use]
    pub const fn model(&self) -> &AdaptiveModel {
        &self.model
    }

    /// The steps, whatever their storage.
    pub fn view(&mut self) -> AdaptiveView<'_> {
        self.model.with_storage(self.storage.as_mut())
    }

    /// Moves on by so many seconds, usually a frame, and ends there exactly. [`Status::Inexact`] if the estimate of the
    /// error exceeded the tolerance at any step. Where even exact steps are refused, the state is that of the last step
    /// that was taken.
    pub fn advance<M: ElementMaterial>(
        &mut self,
        seconds: f32,
        scene: SceneView<'_, M>,
        loads: &mut impl LoadsOverTime,
        state: StateView<'_>,
    ) -> (Status, Taken) {
        let mut work = Work::UNBOUNDED;
        self.view().advance(seconds, &mut work, scene, loads, state, &CallingThread)
    }
}

#[cfg(any(feature = "std", test))]
impl Adaptive<std::vec::Vec<NodeVector>> {
    /// The same with storage from the heap.
    pub fn prepare_in_vec<M: ElementMaterial>(
        method: Method,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        request: Request,
    ) -> Result<Self, InertiaError> {
        let vectors = vectors_for(&method, scene, points)?;
        Self::prepare(method, scene, points, state, request, std::vec![NodeVector::ZERO; vectors])
    }
}
