//! May a step be believed? A *second run* moves the same body by long steps, several times as long as those of the
//! first run, under the same loads. The distance between the two runs estimates the error of the first:
//! the second is the less accurate one, so the distance is mostly an error of its own. That holds on bodies, materials
//! and loads that nobody has tuned anything on, and for every method: exact steps above their critical one,
//! long and learned ones. A frozen body shows, because the second run's lattice has the true
//! inertia of smooth motion.
//!
//! Step doubling (Hairer, Norsett & Wanner 1993, II.4) takes the difference as the leading term of an error of known
//! order. Here it is taken as it is, times [`ESTIMATE`]: the order lies between one and four, depending on what motion
//! the step resolves, and extrapolation with a measured order was less certain than none. How often the truth is
//! larger: `docs/accuracy.md`.
//!
//! Comparisons take place at each of the first three steps, where the second run takes two steps in one of the first,
//! after two steps more, after three more, and so on up to what the caller says ([`EVERY`]). A guard costs such a
//! step in each comparison, and memory for a second state and the second run's inertia ([`vectors_for`]). A scene
//! without a guard pays nothing, and knows nothing of its error.
//!
//! A guard leaves a mark in the state at each call. Steps keep it, and a copy has it, so that a state with the mark has
//! come from where the guard has seen it last, in whatever steps; any other begins a new second run. So a state has one
//! guard at a time.

mod compare;
mod estimate;

pub use estimate::{Allowed, Estimate};
pub(crate) use estimate::{exceeds, judged};

use crate::copy::copy;
use crate::element::ElementMaterial;
use crate::inertia::{self, Cells, InertiaError, LargeModel, Method, vectors_for as vectors_for_method};
use crate::loads::Loads;
use crate::material::{Element, Material};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::{Mark, Progress, StateView};
use crate::step::{CallingThread, Status, Step, Threads};
use compare::{compare, mean_length};
use estimate::Envelope;

/// Steps of the first run in one of the second, where nothing speaks for another number. With more, a guard costs less
/// and calls more right steps inexact.
pub const EVERY: u32 = 3;
/// The same for learned steps: their error does not grow with their length, and they take far more time than a
/// long step.
pub const EVERY_LEARNED: u32 = 1;
/// The estimate over the distance of the two runs.
pub const ESTIMATE: f32 = 2.0;

/// A body whose kinetic energy has become so many times the largest at the latest comparisons, and which in one step moves by
/// more than is allowed for an error, is compared at once: something has begun to act of which they know nothing. That
/// energy is taken to fall by [`FADES`] from one comparison to the next.
const SUDDEN: f64 = 4.0;
const FADES: f64 = 0.5;
/// Lengths of its steps by which the second run may be behind the first.
const MOST_BEHIND: f64 = 2.0;
/// Relative error of times that are sums of steps.
const ROUNDING: f64 = 1e-4;

/// How many times the impulse by which pushes grow in a step is uncertain. Measured, 100 presses of bodies that may give
/// way: 2 leaves 7 of 396 runs silently wrong, 2.5 leaves 1, 3 leaves 3 and doubts more.
const UNCERTAIN: f32 = 2.5;
/// Most times that the second run has pushes which fall.
const MOST_TIMES: f32 = 4.0;

/// How the second run steps.
pub(crate) fn second_run() -> Method {
    Method::new(Cells::Suggested)
}

/// Vectors of storage that a guard needs on a scene with these `points` (m).
pub fn vectors_for<M: Material>(scene: SceneView<'_, M>, points: &[[f32; 3]]) -> Result<usize, InertiaError> {
    let of_state = vectors_of_state(scene.element(), scene.node_count()) + scene.memory_vectors();
    Ok(of_state + vectors_for_method(&second_run(), scene, points)?)
}

/// No fewer than a guard needs on any scene of so many nodes and elements whose tissue does not relax.
#[must_use]
pub fn vectors_at_most(element: Element, nodes: usize, elements: usize) -> usize {
    vectors_of_state(element, nodes).saturating_add(inertia::vectors_at_most(
        element,
        nodes,
        elements,
        Cells::Suggested,
    ))
}

/// Displacements, increments and forces; volumes for elements that have them.
const fn vectors_of_state(element: Element, nodes: usize) -> usize {
    if matches!(element, Element::Linear) { 4 * nodes } else { 5 * nodes }
}

/// A guard without its storage; it may be moved in memory.
#[derive(Clone, Debug)]
pub struct GuardModel {
    second: LargeModel,
    watch: Watch,
}

/// What a guard knows apart from the second run's inertia.
#[derive(Clone, Debug)]
pub(crate) struct Watch {
    progress: Progress,
    nodes: usize,
    /// Longest time between two comparisons, s.
    longest: f32,
    /// Time to the next comparison, s.
    interval: f32,
    /// What the guard has left in the state that it has seen last.
    seen: Option<Mark>,
    envelope: Envelope,
    pushes: Pushes,
    /// The largest kinetic energy of the first run at the latest comparisons, J.
    kinetic: f64,
    /// Whether the first run takes exact steps at present.
    is_exact: bool,
}

impl GuardModel {
    /// A guard for steps of `step`, from the present state, for a scene with these `points` (m) at rest; the second
    /// run's steps are `every` times as long, or fewer where that is longer than single precision allows. `storage` of
    /// [`vectors_for`] vectors is overwritten.
    pub fn prepare<M: ElementMaterial>(
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        every: u32,
        storage: &mut [NodeVector],
    ) -> Result<Self, InertiaError> {
        let (second, watch) = Watch::prepare(scene, points, state, step, every, storage, |state, step, storage| {
            LargeModel::prepare(second_run(), scene, points, state, step, storage)
        })?;
        Ok(Self { second, watch })
    }

    /// What errors are allowed before a step is [`Status::Inexact`].
    pub const fn allow(&mut self, allowed: Allowed) {
        self.watch.allow(allowed);
    }

    /// Estimate of the error of the first run; none before the first comparison.
    #[must_use]
    pub fn estimate(&self) -> Option<Estimate> {
        self.watch.estimate()
    }

    /// The model with the storage in which it was prepared.
    pub const fn with_storage<'a>(&'a mut self, storage: &'a mut [NodeVector]) -> GuardView<'a> {
        GuardView { second: &mut self.second, watch: &mut self.watch, storage }
    }
}

impl Watch {
    /// See [`GuardModel::prepare`]. `second` prepares the second run.
    pub(crate) fn prepare<M: ElementMaterial, T>(
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        mut state: StateView<'_>,
        step: Step,
        every: u32,
        storage: &mut [NodeVector],
        mut second: impl FnMut(StateView<'_>, Step, &mut [NodeVector]) -> Result<T, InertiaError>,
    ) -> Result<(T, Self), InertiaError> {
        let nodes = scene.node_count();
        let mut progress = Progress::START;
        let (needed, capacity) = (vectors_for(scene, points)?, storage.len());
        let Some((mut copied, of_second)) = split(scene, storage, nodes, &mut progress).filter(|_| capacity >= needed)
        else {
            return Err(InertiaError::Capacity { kind: "vectors", needed, capacity });
        };
        start_from(&state, &mut copied);
        let mut every = every.max(1);
        let (second, longest) = loop {
            let seconds = every as f32 * step.seconds();
            let longest =
                Step::unchecked(seconds, step.damping()).map_err(|_| InertiaError::Step { seconds, most: f32::MAX })?;
            match second(state.reborrow(), longest, of_second) {
                Ok(second) => break (second, longest),
                // The step is too long for single precision.
                Err(InertiaError::Singular { .. }) if every > 1 => every /= 2,
                Err(error) => return Err(error),
            }
        };
        let seen = Some(state.progress.mark());
        let envelope = Envelope::new(points);
        Ok((
            second,
            Self {
                progress,
                nodes,
                longest: longest.seconds(),
                interval: 0.0,
                seen,
                envelope,
                pushes: Pushes::default(),
                kinetic: 0.0,
                is_exact: false,
            },
        ))
    }

    /// Compares at the next call, though no step has been taken since the last.
    pub(crate) const fn compare_next(&mut self) {
        self.interval = 0.0;
    }

    /// Whether the first run takes exact steps from now on.
    pub(crate) const fn follow_exact_steps(&mut self, is_exact: bool) {
        self.is_exact = is_exact;
    }

    /// The second run starts from the state at the next call.
    pub(crate) const fn begin_anew(&mut self) {
        self.seen = None;
    }

    /// Whether a state has come from where the guard has seen it last.
    pub(crate) fn follows(&self, progress: &Progress) -> bool {
        self.seen.is_some() && self.seen == progress.seen
    }

    /// The first run takes exact steps: it has no error in its first steps from rest.
    pub(crate) const fn start_is_exact(&mut self) {
        self.envelope.start_is_exact();
    }

    /// Distance of the two runs at the latest comparison, m.
    pub(crate) const fn distance(&self) -> f32 {
        self.envelope.distance()
    }

    /// The longest steps of the second run, s.
    pub(crate) const fn longest(&self) -> f32 {
        self.longest
    }

    /// How many comparisons there were.
    pub(crate) const fn comparisons(&self) -> u32 {
        self.envelope.comparisons()
    }

    /// See [`GuardModel::allow`].
    pub(crate) const fn allow(&mut self, allowed: Allowed) {
        self.envelope.allowed = allowed;
    }

    /// See [`GuardModel::estimate`].
    pub(crate) fn estimate(&self) -> Option<Estimate> {
        self.envelope.estimate()
    }
}

/// A guard with borrowed storage.
#[derive(Debug)]
pub struct GuardView<'a> {
    pub(crate) second: &'a mut LargeModel,
    pub(crate) watch: &'a mut Watch,
    pub(crate) storage: &'a mut [NodeVector],
}

impl GuardView<'_> {
    /// The same for a shorter time.
    pub(crate) const fn reborrow(&mut self) -> GuardView<'_> {
        GuardView { second: self.second, watch: self.watch, storage: self.storage }
    }

    /// The second run's steps become so many seconds long, where it is at the time of the first; with the loads that
    /// acted until then, if they still do.
    pub(crate) fn change_step<M: ElementMaterial>(
        self,
        step: Step,
        scene: SceneView<'_, M>,
        loads: Option<&Loads<'_>>,
        threads: &impl Threads,
    ) {
        let Self { second: large, watch, storage } = self;
        let seconds = step.seconds();
        match (split(scene, storage, watch.nodes, &mut watch.progress), loads) {
            (Some((second, of_second)), Some(loads)) => {
                let _ = large.with_storage(of_second).shorten(seconds, scene, loads, second, threads);
            }
            (Some((mut second, _)), None) if seconds < second.last_step() => second.respan(seconds),
            _ => {}
        }
        large.change_step(step);
        // A guard that is new compares in the next step all the same.
        (watch.longest, watch.interval) = (seconds, if watch.envelope.is_new() { 0.0 } else { seconds });
    }

    /// See [`Guard::follow`].
    pub fn follow<M: ElementMaterial>(
        self,
        taken: Status,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
        threads: &impl Threads,
    ) -> Status {
        let Self { second: large, watch, storage } = self;
        let Watch { progress, nodes, longest, interval, seen, envelope, pushes, kinetic, is_exact } = watch;
        let nodes = *nodes;
        if !taken.is_taken() {
            return taken;
        }
        let mismatch = Status::Mismatch { nodes: scene.node_count(), room: nodes };
        let Some((mut second, of_second)) = split(scene, storage, nodes, progress) else {
            return mismatch;
        };
        if scene.node_count() != nodes || state.capacity_for(scene.element()) < nodes {
            return mismatch;
        }
        let gone = state.time() - second.time();
        let comes_from_last = seen.is_some() && *seen == state.progress.seen;
        *seen = Some(state.progress.mark());
        // Not with a time that is no number either.
        let follows = comes_from_last && gone <= MOST_BEHIND * f64::from(*longest);
        if !follows {
            // The state was restored, reset or put, or has gone on for long without the guard.
            envelope.forget();
            // Right after a start errors are least certain.
            *interval = if envelope.is_new() { 0.0 } else { *longest };
            start_from(&state, &mut second);
            let newton = loads.with_pushes_of(&state, 1.0).sum_of_given();
            *pushes = Pushes { newton, compared: newton, ..Pushes::default() };
            *kinetic = state.energy_balance.kinetic;
            return taken;
        }
        let now = state.energy_balance.kinetic;
        let is_sudden = now > SUDDEN * *kinetic
            && !*is_exact
            && mean_length(nodes, state.increment) > envelope.allowed_at_present();
        pushes.enter(loads.with_pushes_of(&state, 1.0).sum_of_given(), gone as f32);
        if gone <= 0.0 || (gone < (1.0 - ROUNDING) * f64::from(*interval) && !is_sudden) {
            envelope.wait(gone as f32);
            return envelope.judge(taken);
        }
        // A load may have begun within a step, of which the first run's first step knows nothing.
        let is_late = gone > (1.0 + ROUNDING) * f64::from(*longest);
        let parts = if envelope.is_new() || is_sudden || is_late { 2 } else { 1 };
        *kinetic = now.max(FADES * *kinetic);
        // The instruments are the first run's: the second one has their impulse.
        let times = pushes.take(if *is_exact { *longest } else { state.last_step() }, *is_exact);
        let loads = &loads.with_pushes_of(&state, times);
        let (gone, seconds) = (gone as f32, f32::min(gone as f32 / parts as f32, *longest));
        let mut followed = large.set_seconds(seconds).is_ok();
        for _ in 0..parts {
            let large = large.with_storage(of_second);
            followed = followed && large.step_in_parts(scene, loads, second.reborrow(), threads).is_taken();
        }
        if followed {
            // Else the rounding of each step would part them in a long session.
            second.progress.time = state.time();
            large.is_at(second.progress);
            let speed = if envelope.is_new() { mean_length(nodes, state.increment) / state.last_step() } else { 0.0 };
            envelope.add(&compare(nodes, state.displacement, second.displacement), gone, speed);
            let more = if envelope.is_new() { 0.0 } else { state.last_step() };
            // Whole steps of the first run: the second run's are then of one length.
            let grown = gone + more;
            *interval = if grown <= (1.0 + ROUNDING as f32) * *longest { grown } else { gone.min(*longest) };
        } else {
            // The second run cannot follow: nothing is known but that the body has moved.
            envelope.lose(gone);
            start_from(&state, &mut second);
            *interval = state.last_step();
        }
        envelope.judge(taken)
    }
}

/// Pushes of instruments since the latest comparison: the sum of their lengths (N), its impulse, and that by which long
/// steps may be wrong (N s). Where tissue meets an instrument they end its approach at once and give little back, as
/// their inertia is far larger than that of the tissue which would spring back: the impulse by which pushes grow in a
/// step is uncertain by [`UNCERTAIN`] times itself.
#[derive(Clone, Copy, Debug, Default)]
struct Pushes {
    newton: f32,
    impulse: f32,
    /// By how much the sum grew, not counting where it fell, N.
    growth: f32,
    /// The sum at the latest comparison, N.
    compared: f32,
    /// How long the impulse has been counted, s.
    entered: f32,
}

impl Pushes {
    /// After one step or a few, so many seconds after the latest comparison.
    fn enter(&mut self, newton: f32, gone: f32) {
        self.impulse += (gone - self.entered) * newton;
        self.growth += (newton - self.newton).max(0.0);
        (self.newton, self.entered) = (newton, gone);
    }

    /// How many times the present pushes the second run has, where the first run has long steps of so many seconds; where
    /// it has exact ones, whose pushes go up and down, long steps of so many seconds would have seen the whole change.
    fn take(&mut self, seconds: f32, is_exact: bool) -> f32 {
        let growth = if is_exact { (self.newton - self.compared).max(0.0) } else { self.growth };
        let times = (self.impulse + UNCERTAIN * seconds * growth) / (self.newton * self.entered);
        *self = Self { newton: self.newton, compared: self.newton, ..Self::default() };
        if times.is_finite() { times.min(MOST_TIMES) } else { 1.0 }
    }
}

/// The second run's state and the rest of the storage.
fn split<'a, M: Material>(
    scene: SceneView<'_, M>,
    storage: &'a mut [NodeVector],
    nodes: usize,
    progress: &'a mut Progress,
) -> Option<(StateView<'a>, &'a mut [NodeVector])> {
    let (displacement, rest) = storage.split_at_mut_checked(nodes)?;
    let (remainder, rest) = rest.split_at_mut_checked(nodes)?;
    let (increment, rest) = rest.split_at_mut_checked(nodes)?;
    let (force, rest) = rest.split_at_mut_checked(nodes)?;
    let volumes = vectors_of_state(scene.element(), nodes) - 4 * nodes;
    let (volume, rest) = rest.split_at_mut_checked(volumes)?;
    let (memory, rest) = rest.split_at_mut_checked(scene.memory_vectors())?;
    let state = StateView::new(displacement, remainder, increment, force, volume, progress);
    Some((state.remembering(memory), rest))
}

/// Makes the second run start from the state of the first.
fn start_from(state: &StateView<'_>, second: &mut StateView<'_>) {
    copy(second.displacement, state.displacement);
    copy(second.remainder, state.remainder);
    copy(second.increment, state.increment);
    set(second.progress, state.progress);
    copy(second.copies_of_memory()[0], state.remembered());
}

/// Not inlined: of what two structures borrow the compiler forgets that it does not overlap, and asks the host for
/// `memmove`.
#[inline(never)]
fn set(to: &mut Progress, from: &Progress) {
    *to = *from;
}

/// A guard with storage `S` of the caller.
#[derive(Clone, Debug)]
pub struct Guard<S> {
    model: GuardModel,
    storage: S,
}

impl<S: AsMut<[NodeVector]>> Guard<S> {
    /// See [`GuardModel::prepare`].
    pub fn prepare<M: ElementMaterial>(
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        every: u32,
        mut storage: S,
    ) -> Result<Self, InertiaError> {
        let model = GuardModel::prepare(scene, points, state, step, every, storage.as_mut())?;
        Ok(Self { model, storage })
    }

    /// See [`GuardModel::allow`].
    #[must_use]
    pub const fn allowing(mut self, allowed: Allowed) -> Self {
        self.model.allow(allowed);
        self
    }

    /// See [`GuardModel::estimate`].
    #[must_use]
    pub fn estimate(&self) -> Option<Estimate> {
        self.model.estimate()
    }

    /// The guard, whatever its storage.
    pub fn view(&mut self) -> GuardView<'_> {
        self.model.with_storage(self.storage.as_mut())
    }

    /// To be called after each step of the first run, or after each few, with what it answered, the loads that it had
    /// and the state that it left. Every so often it moves the second run and compares. Gives that status, or
    /// [`Status::Inexact`] in place of [`Status::Ok`] if the estimate exceeds what is allowed. A state that has not
    /// come by steps from where the guard has seen it last (restored, reset, put, stopped, another copy), or has gone
    /// on for longer than a step of the second run, begins a new second run, from where it is now.
    pub fn follow<M: ElementMaterial>(
        &mut self,
        taken: Status,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
    ) -> Status {
        self.view().follow(taken, scene, loads, state, &CallingThread)
    }
}

#[cfg(any(feature = "std", test))]
impl Guard<std::vec::Vec<NodeVector>> {
    /// The same with storage from the heap.
    pub fn prepare_in_vec<M: ElementMaterial>(
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        every: u32,
    ) -> Result<Self, InertiaError> {
        let vectors = vectors_for(scene, points)?;
        Self::prepare(scene, points, state, step, every, std::vec![NodeVector::ZERO; vectors])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::NeoHookean;
    use crate::mesh::Bar;
    use crate::scene::test_scene::scene_of;
    use crate::state::VecState;
    use crate::tled;

    /// A guard may be called after each step or after a few, and a steady push is what it is.
    #[test]
    fn the_second_run_has_the_impulse_of_the_pushes() {
        let (newton, step) = (2.0, 0.01);
        for at_once in [1, 3, 6] {
            let mut pushes = Pushes { newton, compared: newton, ..Pushes::default() };
            for count in (at_once..=6).step_by(at_once) {
                pushes.enter(newton, count as f32 * step);
            }
            let times = pushes.take(step, false);
            assert!((times - 1.0).abs() < 1e-6, "{at_once} steps a call: {times}");
            // It doubles: that by which it grew counts besides, for a step.
            pushes.enter(2.0 * newton, step);
            pushes.enter(2.0 * newton, 2.0 * step);
            let times = pushes.take(step, false);
            assert!((times - (1.0 + 0.25 * UNCERTAIN)).abs() < 1e-6, "{times}");
            // Pushes of exact steps go up and down.
            for (count, newton) in [(1, 2.0), (2, 6.0), (3, 2.0), (4, 4.0)] {
                pushes.enter(newton, count as f32 * step);
            }
            let times = pushes.take(4.0 * step, true);
            assert!((times - 0.875).abs() < 1e-6, "{times}");
        }
    }

    /// A body that drifts far away, so slowly that rounding would stop it: the second run arrives where the first does.
    #[test]
    fn the_second_run_does_not_lose_slow_motion() {
        let bar = Bar { size: [0.008, 0.008, 0.016], cells: [2, 2, 4] };
        let (points, scene) = scene_of(NeoHookean { c: 2e6, d: 2e8 }, bar);
        let step = Step::unchecked(1e-6, 0.0).unwrap();
        let mut state = VecState::at_rest(scene.node_count());
        assert!(tled::start(&scene, &mut state, &step, |_| ([0.25, 0.0, 0.0], [0.004, 0.0, 0.0])));
        let mut guard = Guard::prepare_in_vec(scene.view(), &points, state.view(), step, EVERY).unwrap();
        for _ in 0..3_000 {
            let status = tled::step(&scene, &Loads::NONE, &mut state, &step);
            assert!(guard.follow(status, scene.view(), &Loads::NONE, state.view()).is_taken());
        }
        let (watch, gone) = (&guard.model.watch, state.displacements()[0].to_array()[0] - 0.25);
        std::println!("{} comparisons, {gone:e} m, {:e} m apart", watch.comparisons(), watch.distance());
        assert!(watch.comparisons() > 500 && gone > 1.1e-5 && watch.distance() < 1e-7);
    }
}
