//! The learned step (Meister et al. 2018, section 2): a network predicts each vertex's acceleration for a step `D` that
//! is 10 to 100 times longer than the exact one may be.
//!
//! ```text
//! v = (u(t) - u(t-D)) / D,  f = f_e - K u                 the vertex's state, in its local frame (frame.rs)
//! a = network(u, |v|, f)                                  clipped to what training has seen
//! u(t+D) - u(t) = u(t) - u(t-D) + D^2 a                   increments: 2 u - u(t-D) would round away the motion
//! ```
//! Velocity and acceleration are differences over `D`, so exact steps have to come first: in the lead-in
//! ([`LearnedStep::lead`], 0.3 s in the paper) the frames follow their motion over each `D`, and the first learned step
//! goes on from there. A state that has not moved yet needs no lead-in.
//!
//! The network knows nothing of energy. What it does is entered in the same energy balance as every other step
//! ([`crate::step::EnergyBalance`]): with several times more kinetic energy than loads and supports have ever given the
//! step is refused. With fallback a step is undone that has more kinetic energy than the balance explains at all,
//! moves a node by more than half the size of its tissue, or leaves an element inside out, and exact steps take its
//! place for some intervals, while the frames follow as in the lead-in. Then the network is tried again. Each fallback
//! lasts twice as long as the last one, up to [`LONGEST_WAIT`] intervals, until there have been many more learned steps
//! than that without one. An attempt that is undone after exact steps leaves their motion as it was, to the bit.

pub mod frame;
mod method;
mod predict;

#[cfg(feature = "train")]
pub(crate) use predict::VertexInput;
pub use predict::{FEATURES, PREDICTED};

use core::fmt;

use bytemuck::{Pod, Zeroable, must_cast_slice_mut};
use glam::Vec4;

use crate::element::{ElementMaterial, Look};
use crate::loads::Loads;
use crate::mlp::Network;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::{AsState, MOVED_VECTORS, Moment, Progress, StateView};
use crate::step::{CallingThread, MOST_OF_SIZE, Status, Step, Threads, Trial};
use crate::tled;
use frame::Frame;
use method::Learned;

/// What the learned step keeps for each vertex: its frame, and its next increment while a step is computed.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Vertex {
    frame: Frame,
    /// m. In a lead-in the displacement at the start of the interval, and after it the increment over the interval.
    next: NodeVector,
}

impl Vertex {
    /// In the world's axes.
    const NEW: Self = Self { frame: Frame::WORLD, next: NodeVector::ZERO };

    /// Notes where the vertex is: displacement and what rounding has left out of it, m.
    fn begin_interval(&mut self, NodeVector([x, y, z, _]): NodeVector, remainder: NodeVector) {
        let [of_x, of_y, of_z] = remainder.to_array();
        self.next = NodeVector([x, y, z, of_x]);
        self.frame.keep([of_y, of_z]);
    }

    /// The increment from there, m; the frame follows it.
    fn end_interval(&mut self, displacement: NodeVector, remainder: NodeVector) {
        let ([x, y, z, of_x], [of_y, of_z]) = (self.next.0, self.frame.take_kept());
        let [before, left_before] = [Vec4::new(x, y, z, 0.0), Vec4::new(of_x, of_y, of_z, 0.0)];
        let [after, left] = [displacement, remainder].map(|vector| Vec4::from(vector.0));
        self.next = NodeVector(((after - before) + (left - left_before)).to_array());
        self.frame.follow(self.next.to_array());
    }
}

/// Most exact steps in one of the network's: with more a call would not end in any time that matters.
const MOST_EXACT_STEPS: u32 = 65_536;

/// Of the network's intervals those that exact steps take at the first fallback and at most.
pub const FIRST_WAIT: u32 = 8;
/// See [`FIRST_WAIT`].
pub const LONGEST_WAIT: u32 = 1024;
/// Learned steps over the intervals of the next fallback after which that is as short as the first.
const CALM: u32 = 8;

/// Vectors in the storage of a [`Vertex`].
const VERTEX_VECTORS: usize = size_of::<Vertex>() / size_of::<NodeVector>();

/// Vectors of storage that learned steps of so many nodes need, with fallback or without.
#[must_use]
pub const fn vectors_for(nodes: usize, fallback: bool) -> usize {
    (VERTEX_VECTORS + if fallback { MOVED_VECTORS } else { 0 }).saturating_mul(nodes)
}

/// Why a network cannot move a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LearnedError {
    /// It does not have the inputs and outputs of the learned step.
    Shape {
        /// Its inputs.
        inputs: usize,
        /// Its outputs.
        outputs: usize,
    },
    /// The exact step has another damping than the training.
    Damping {
        /// That of the exact step, 1/s.
        exact: f32,
        /// That of the training, 1/s.
        trained: f32,
    },
    /// The network's step is no whole number of exact steps, or of more than 65,536.
    StepRatio {
        /// The exact step, s.
        exact: f32,
        /// The network's, s.
        learned: f32,
    },
    /// The state has moved by steps that neither the lead-in nor this network took.
    NotLed {
        /// Steps that the state has taken.
        steps: u64,
    },
}

impl fmt::Display for LearnedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Shape { inputs, outputs } => write!(
                f,
                "a network of {inputs} inputs and {outputs} outputs; the learned step needs {FEATURES} and {PREDICTED}"
            ),
            Self::Damping { exact, trained } => {
                write!(f, "damping is {exact} 1/s, the network learned a motion damped by {trained} 1/s")
            }
            Self::StepRatio { exact, learned } => {
                write!(
                    f,
                    "the network's step of {learned} s is no whole number of exact steps of {exact} s, at most {MOST_EXACT_STEPS}"
                )
            }
            Self::NotLed { steps } => write!(
                f,
                "after {steps} steps the network does not know the motion: a lead-in of exact steps is needed"
            ),
        }
    }
}

impl core::error::Error for LearnedError {}

/// What the latest step found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LearnedReport {
    /// Share of the free vertices whose predicted acceleration was clipped.
    pub clipped: f32,
    /// Share of the free vertices with an input outside what training has seen.
    pub outside: f32,
}

/// When and why exact steps took the place of learned ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fallback {
    /// Start of the step that was undone, s.
    pub time: f64,
    /// What became of it.
    pub status: Status,
}

/// Who moves the state next, with fallback.
#[derive(Clone, Copy, Debug)]
struct Turns {
    /// The latest fallback.
    latest: Option<Fallback>,
    /// How many there were.
    count: u32,
    /// Intervals that exact steps have yet to take.
    exact: u32,
    /// Those after the next fallback.
    wait: u32,
    /// Learned steps since the latest fallback.
    learned: u32,
}

impl Turns {
    const NEW: Self = Self { latest: None, count: 0, exact: 0, wait: FIRST_WAIT, learned: 0 };

    /// The latest step may not be believed, be it a learned one or an exact one that followed another.
    fn fall_back(&mut self, time: f64, status: Status) {
        if self.count > 0 && self.learned == 0 {
            // The same fallback goes on.
            self.exact = self.exact.max(1);
        } else {
            self.undo(time, status);
        }
    }

    /// A learned step is undone.
    fn undo(&mut self, time: f64, status: Status) {
        self.latest = Some(Fallback { time, status });
        self.count = self.count.saturating_add(1);
        (self.exact, self.learned) = (self.wait, 0);
        self.wait = (2 * self.wait).min(LONGEST_WAIT);
    }

    /// A learned step has been taken.
    fn enter_learned(&mut self) {
        self.learned = self.learned.saturating_add(1);
        if self.learned >= CALM * self.wait {
            self.wait = FIRST_WAIT;
        }
    }
}

/// A learned step apart from its storage: position independent, and the same for every scene.
#[derive(Clone, Debug)]
pub struct LearnedModel<'w> {
    network: Network<'w>,
    step: Step,
    /// Whether an unexplained step is undone.
    undoes: bool,
    turns: Turns,
    /// The state when a lead-in or a learned step ended last.
    led: Option<Moment>,
    report: LearnedReport,
}

impl<'w> LearnedModel<'w> {
    /// Step length and damping are those of the training.
    pub fn new(network: Network<'w>, fallback: bool) -> Result<Self, LearnedError> {
        let (inputs, outputs) = (network.inputs().len(), network.outputs().len());
        let recipe = network.recipe();
        // The weight file has been checked: its step is a positive number.
        match Step::unchecked(recipe.step, recipe.damping) {
            Ok(step) if inputs == FEATURES && outputs == PREDICTED => Ok(Self {
                network,
                step,
                undoes: fallback,
                turns: Turns::NEW,
                led: None,
                report: LearnedReport::default(),
            }),
            _ => Err(LearnedError::Shape { inputs, outputs }),
        }
    }

    /// The network.
    #[must_use]
    pub const fn network(&self) -> &Network<'w> {
        &self.network
    }

    /// The step, s.
    #[must_use]
    pub const fn seconds(&self) -> f32 {
        self.step.seconds()
    }

    /// What the latest learned step found.
    #[must_use]
    pub const fn report(&self) -> &LearnedReport {
        &self.report
    }

    /// The latest step that was undone.
    #[must_use]
    pub const fn fell_back(&self) -> Option<&Fallback> {
        self.turns.latest.as_ref()
    }

    /// How often exact steps have taken the place of learned ones.
    #[must_use]
    pub const fn fallbacks(&self) -> u32 {
        self.turns.count
    }

    /// Whether exact steps take the next of the network's intervals.
    #[must_use]
    pub const fn is_exact_next(&self) -> bool {
        self.turns.exact > 0
    }

    /// Exact steps take the next interval, and after a learned step as many as after one that is undone, because of
    /// what the host knows of the latest step: a [`crate::guard`] that calls it inexact. Without fallback nothing
    /// changes.
    pub fn fall_back(&mut self, time: f64, status: Status) {
        if self.undoes {
            self.turns.fall_back(time, status);
        }
    }

    /// Whether the latest steps of a state were a lead-in or learned ones.
    #[must_use]
    pub fn is_led(&self, progress: &Progress) -> bool {
        self.led == Some(progress.moment())
    }

    /// Whether steps can be taken back.
    #[must_use]
    pub const fn undoes(&self) -> bool {
        self.undoes
    }

    /// Exact steps in one of the network's.
    pub fn exact_steps(&self, exact: &Step) -> Result<u32, LearnedError> {
        let recipe = self.network.recipe();
        if (exact.damping() - recipe.damping).abs() > 1e-6 * recipe.damping {
            return Err(LearnedError::Damping { exact: exact.damping(), trained: recipe.damping });
        }
        let count = (recipe.step / exact.seconds() + 0.5) as u32;
        if !(1..=MOST_EXACT_STEPS).contains(&count)
            || (count as f32 * exact.seconds() - recipe.step).abs() > 1e-4 * recipe.step
        {
            return Err(LearnedError::StepRatio { exact: exact.seconds(), learned: recipe.step });
        }
        Ok(count)
    }

    /// Learned steps in a lead-in of `seconds`.
    #[must_use]
    pub fn intervals(&self, seconds: f64) -> u64 {
        libm::round(seconds / f64::from(self.seconds())) as u64
    }

    /// With its storage, [`vectors_for`] the nodes.
    pub const fn with_storage<'a>(&'a mut self, storage: &'a mut [NodeVector]) -> LearnedView<'a, 'w> {
        LearnedView { model: self, storage }
    }
}

/// A learned step with storage `S` of the caller for what it keeps of each vertex: [`vectors_for`] the nodes.
#[derive(Clone, Debug)]
pub struct LearnedStep<'w, S> {
    model: LearnedModel<'w>,
    storage: S,
}

impl<'w, S: AsMut<[NodeVector]>> LearnedStep<'w, S> {
    /// For a motion from rest; `storage` is overwritten.
    pub fn new(network: Network<'w>, fallback: bool, storage: S) -> Result<Self, LearnedError> {
        let mut learned = Self { model: LearnedModel::new(network, fallback)?, storage };
        learned.view().reset();
        Ok(learned)
    }

    /// What it is apart from its storage.
    pub const fn model(&self) -> &LearnedModel<'w> {
        &self.model
    }

    /// The lead-in on the calling thread: see [`LearnedView::lead`].
    pub fn lead<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
        lead_in: (&Step, f64),
    ) -> Result<Status, LearnedError> {
        self.view().lead(scene, loads, state, lead_in, &CallingThread)
    }

    /// A step on the calling thread: see [`LearnedView::step`].
    pub fn step<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
        exact: &Step,
    ) -> Result<Status, LearnedError> {
        self.view().step(scene, loads, state, exact, &CallingThread)
    }

    /// See [`LearnedModel::fall_back`].
    pub fn fall_back(&mut self, time: f64, status: Status) {
        self.model.fall_back(time, status);
    }

    /// The learned step, whatever its storage.
    pub fn view(&mut self) -> LearnedView<'_, 'w> {
        self.model.with_storage(self.storage.as_mut())
    }
}

/// A learned step over storage of whichever kind.
#[derive(Debug)]
pub struct LearnedView<'a, 'w> {
    model: &'a mut LearnedModel<'w>,
    storage: &'a mut [NodeVector],
}

/// A step that was undone: the state is as before it, and exact steps go on from there.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct Undone;

impl<'w> LearnedView<'_, 'w> {
    /// What it is apart from its storage.
    #[must_use]
    pub const fn model(&self) -> &LearnedModel<'w> {
        self.model
    }

    /// See [`LearnedModel::fall_back`].
    pub fn fall_back(&mut self, time: f64, status: Status) {
        self.model.fall_back(time, status);
    }

    /// For a motion from rest: frames as at the start, no lead-in yet, exact steps have not taken over.
    pub fn reset(&mut self) {
        self.storage.fill(NodeVector::ZERO);
        vertices(self.storage, usize::MAX).fill(Vertex::NEW);
        (self.model.turns, self.model.led) = (Turns::NEW, None);
    }

    /// The lead-in: exact steps of `exact` for as many of the network's as `seconds` have, while the frames follow.
    /// Gives the worst status, or the first of a step that was refused.
    pub fn lead<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        mut state: StateView<'_>,
        (exact, seconds): (&Step, f64),
        threads: &impl Threads,
    ) -> Result<Status, LearnedError> {
        let count = self.model.exact_steps(exact)?;
        let mut worst = Status::Ok;
        for _ in 0..self.model.intervals(seconds) {
            let status = self.lead_interval(&mut state, |state| {
                exact_steps(count, |_| tled::step_in_parts(scene, loads, state.reborrow(), exact, threads))
            });
            match status {
                Status::Ok => {}
                limited @ Status::Limited { .. } => worst = limited,
                refused => return Ok(refused),
            }
        }
        Ok(worst)
    }

    /// One interval of the lead-in, or in place of a learned step that was [`Undone`]: `exact` takes exact steps that
    /// last as long as one of the network's, while the frames follow.
    pub fn lead_interval<S: AsState>(&mut self, state: &mut S, exact: impl FnOnce(&mut S) -> Status) -> Status {
        self.model.led = None;
        let before = state.as_state();
        let vertices = vertices(self.storage, before.displacement.len());
        let at = before.displacement.iter().zip(&*before.remainder);
        for (vertex, (displacement, remainder)) in vertices.iter_mut().zip(at) {
            vertex.begin_interval(*displacement, *remainder);
        }
        let status = exact(state);
        if !status.is_taken() {
            return status;
        }
        let after = state.as_state();
        let at = after.displacement.iter().zip(&*after.remainder);
        for (vertex, (displacement, remainder)) in vertices.iter_mut().zip(at) {
            vertex.end_interval(*displacement, *remainder);
        }
        self.model.led = Some(after.moment());
        self.model.turns.exact = self.model.turns.exact.saturating_sub(1);
        status
    }

    /// Takes one learned step, or as many exact ones if it was undone or exact steps are next. Every learned step does
    /// the same work, so the most that a call can take is that and an interval of exact steps.
    pub fn step<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        mut state: StateView<'_>,
        exact: &Step,
        threads: &impl Threads,
    ) -> Result<Status, LearnedError> {
        let count = self.model.exact_steps(exact)?;
        match self.try_step(scene, loads, &mut state, exact.seconds(), threads)? {
            Ok(status) => Ok(status),
            Err(Undone) => Ok(self.lead_interval(&mut state, |state| {
                exact_steps(count, |_| tled::step_in_parts(scene, loads, state.reborrow(), exact, threads))
            })),
        }
    }

    /// Takes one learned step, if exact ones are not next; if energy does not explain it, and with fallback, it is
    /// undone. The last increment of the state then spans `exact` seconds, and the caller takes exact steps in
    /// [`LearnedView::lead_interval`]. Without fallback a first step that diverges leaves displacements and time as
    /// before it, and increments that span the network's step.
    pub fn try_step<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: &mut StateView<'_>,
        exact: f32,
        threads: &impl Threads,
    ) -> Result<Result<Status, Undone>, LearnedError> {
        if self.model.is_exact_next() {
            return Ok(Err(Undone));
        }
        let nodes = scene.node_count();
        let per_node = if self.model.undoes { VERTEX_VECTORS + MOVED_VECTORS } else { VERTEX_VECTORS };
        let room = self.storage.len() / per_node;
        if let Err(refused) = Trial::check(scene, loads, state, room) {
            return Ok(Ok(refused));
        }
        let before = *state.progress;
        let (_, saved) = self.storage.split_at_mut(self.storage.len().min(VERTEX_VECTORS * nodes));
        if self.model.undoes {
            state.save(nodes, saved);
        }
        self.take_over(state)?;
        let Self { model, storage } = self;
        let (vertex_vectors, saved) = storage.split_at_mut(storage.len().min(VERTEX_VECTORS * nodes));
        // What a refused step has predicted the network cannot go on from.
        model.led = None;
        let status = match Trial::begin(scene, loads, state.reborrow(), room) {
            Err(refused) => refused,
            Ok(trial) => {
                let LearnedModel { network, step, report, .. } = &mut **model;
                let vertices = vertices(vertex_vectors, nodes);
                trial.take(step, &mut Learned { network, step, report, vertices, threads })
            }
        };
        let wild = if model.undoes && status.is_taken() { is_wild(scene, state) } else { None };
        if model.undoes && (status.is_unexplained() || wild.is_some()) {
            model.turns.undo(before.time, wild.unwrap_or(status));
            *state.progress = before;
            state.restore(nodes, saved);
            if state.dt != exact {
                state.respan(exact);
            }
            return Ok(Err(Undone));
        }
        if status.is_taken() {
            model.led = Some(state.moment());
            model.turns.enter_learned();
        }
        Ok(Ok(status))
    }

    /// After a lead-in exact steps have their own increments; the network goes on from those of its own step.
    fn take_over(&mut self, state: &mut StateView<'_>) -> Result<(), LearnedError> {
        let seconds = self.model.seconds();
        let spans = state.dt <= 0.0 || (state.dt - seconds).abs() <= 1e-5 * seconds;
        if self.model.is_led(state) && !spans {
            let vertices = vertices(self.storage, state.increment.len());
            for (increment, vertex) in state.increment.iter_mut().zip(vertices) {
                *increment = vertex.next;
            }
            state.progress.dt = seconds;
            return Ok(());
        }
        if spans && (self.model.is_led(state) || state.dt <= 0.0) {
            return Ok(());
        }
        Err(LearnedError::NotLed { steps: state.steps })
    }
}

/// Whether a step has moved a node by more than half the size of its own tissue, or left an element inside out: no
/// motion of tissue does that in a step, and energies of single elements do not show in that of the body. The status
/// that says so.
fn is_wild<M: ElementMaterial>(scene: SceneView<'_, M>, state: &StateView<'_>) -> Option<Status> {
    let leaps = state.increment.iter().take(scene.node_count()).enumerate().any(|(node, increment)| {
        let [x, y, z] = increment.to_array();
        let (square, volume) = (x * x + y * y + z * z, scene.node_volume(node));
        // Sixth powers, without a root, as this is for every node in every step.
        let most = MOST_OF_SIZE * MOST_OF_SIZE * MOST_OF_SIZE * volume;
        square * square * square > most * most
    });
    let least = 1.0 + Look::at_all(scene.tiles, state.displacement, 0.0, &mut []).see().least_change;
    let limited = Status::Limited { least_volume_ratio: least, saturation: 0.0, energy_excess: 0.0 };
    (leaps || least <= 0.0).then_some(limited)
}

/// The vertices of so many nodes, or as many as there is storage for.
fn vertices(storage: &mut [NodeVector], nodes: usize) -> &mut [Vertex] {
    let (vertices, _) = storage.as_chunks_mut::<VERTEX_VECTORS>();
    let nodes = nodes.min(vertices.len());
    must_cast_slice_mut(vertices.get_mut(..nodes).unwrap_or_default())
}

/// Takes `count` exact steps, or until one is refused. Gives the worst status.
fn exact_steps(count: u32, mut step: impl FnMut(u32) -> Status) -> Status {
    let mut worst = Status::Ok;
    for number in 0..count {
        match step(number) {
            Status::Ok => {}
            limited @ Status::Limited { .. } => worst = limited,
            refused => return refused,
        }
    }
    worst
}
