//! The learned step (Meister et al. 2018, section 2): a network predicts each vertex's acceleration for a step `D` that is
//! 10 to 100 times longer than the exact one may be.
//!
//! ```text
//! v = (u(t) - u(t-D)) / D,  f = f_e - K u                 the vertex's state, in its local frame (frame.rs)
//! a = network(u, |v|, f)                                  clipped to what training has seen
//! u(t+D) - u(t) = u(t) - u(t-D) + D^2 a                   increments: 2 u - u(t-D) would round away the motion
//! ```
//! Velocity and acceleration are differences over `D`: before the first learned step the state's last increment must
//! span `D` ([`State::span`]). In the paper the exact step leads for the first 0.3 s, with frames that follow the motion
//! over each `D` ([`Surrogate::follow`]).
//!
//! The network knows nothing of energy. What it does is entered in the same account as every other step
//! ([`crate::Ledger`]): with several times more kinetic energy than loads and supports have ever given the step is refused.

use core::fmt;
use core::ops::Range;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use crate::frame::{Axes, Frame};
use crate::lanes::{Kernel, NodeVector, Real, dispatch, dot};
use crate::loads::Loads;
use crate::material::Material;
#[cfg(feature = "capi-neo-hookean")]
use crate::mlp::Recipe;
use crate::mlp::{ForceInput, MAX_INPUTS, Network, Scratch};
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::state::State;
use crate::threads::{Alone, Threads};
use crate::tled::{
    Divergence, Entry, Forcing, Status, Step, Sums, Totals, culprit, follow_motions, move_in_parts,
};

/// Numbers that go into the network for each vertex, and that come out.
pub const FEATURES: usize = 7;
/// See [`FEATURES`].
pub const PREDICTED: usize = 3;

/// What the learned step keeps for each vertex: its frame, and its next increment while a step is computed.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    frame: Frame,
    /// m.
    next: NodeVector,
}

impl Vertex {
    /// In the world's axes.
    pub const NEW: Self = Self { frame: Frame::WORLD, next: NodeVector::ZERO };
}

/// What the network sees of vertices side by side: displacement (m), speed (m/s) and force (N, or m/s^2) in their frames.
pub(crate) struct Seen<R> {
    /// m.
    pub(crate) displacement: [R; 3],
    /// m/s.
    pub(crate) speed: R,
    /// N.
    pub(crate) force: [R; 3],
    /// Lumped, kg.
    pub(crate) mass: R,
}

impl<R: Real> Seen<R> {
    #[inline(always)]
    pub(crate) fn features(&self, axes: &Axes<R>, input: ForceInput) -> [R; FEATURES] {
        let force = match input {
            ForceInput::Newton => self.force,
            // A vertex of no element has no mass, and no force.
            ForceInput::PerMass => {
                let mass = self.mass.choose(self.mass, R::splat(1.0));
                let [x, y, z] = self.force;
                [x.over(mass), y.over(mass), z.over(mass)]
            }
        };
        let ([a, b, c], [d, e, f]) = (axes.local(self.displacement), axes.local(force));
        [a, b, c, self.speed, d, e, f]
    }
}

/// Why a network cannot move a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SurrogateError {
    /// It does not have the inputs and outputs of the learned step.
    Shape {
        /// Its inputs.
        inputs: usize,
        /// Its outputs.
        outputs: usize,
    },
}

impl fmt::Display for SurrogateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Shape { inputs, outputs } => write!(
                f,
                "a network of {inputs} inputs and {outputs} outputs; the learned step needs {FEATURES} and {PREDICTED}"
            ),
        }
    }
}

impl core::error::Error for SurrogateError {}

/// What the latest step found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SurrogateReport {
    /// Share of the free vertices whose predicted acceleration was clipped.
    pub clipped: f32,
    /// Share of the free vertices with an input outside what training has seen.
    pub outside: f32,
}

/// A network, and what it keeps for each vertex in storage `V` of the caller.
#[derive(Clone, Debug)]
pub struct Surrogate<'w, V> {
    network: Network<'w>,
    vertices: V,
    step: Step,
    report: SurrogateReport,
}

impl<'w, V> Surrogate<'w, V> {
    /// A learned step with frames as `vertices` have them ([`Vertex::NEW`] at the start of a motion). Step length and damping
    /// are those of the training.
    pub fn over(network: Network<'w>, vertices: V) -> Result<Self, SurrogateError> {
        let (inputs, outputs) = (network.inputs().len(), network.outputs().len());
        let recipe = network.recipe();
        // The weight file has been checked: its step is a positive number.
        let step = Step::insist(recipe.step, recipe.damping);
        match step {
            Ok(step) if inputs == FEATURES && outputs == PREDICTED => {
                Ok(Self { network, vertices, step, report: SurrogateReport::default() })
            }
            _ => Err(SurrogateError::Shape { inputs, outputs }),
        }
    }

    /// The step, s.
    pub const fn seconds(&self) -> f32 {
        self.step.seconds()
    }

    /// What the latest step found.
    pub const fn report(&self) -> &SurrogateReport {
        &self.report
    }
}

#[cfg(feature = "capi-neo-hookean")]
impl<'w> Surrogate<'w, ()> {
    /// The same with storage for vertices.
    pub(crate) fn with<'v>(&self, vertices: &'v mut [Vertex]) -> Surrogate<'w, &'v mut [Vertex]> {
        let Self { network, step, report, .. } = *self;
        Surrogate { network, vertices, step, report }
    }

    /// What it was trained on.
    pub(crate) const fn recipe(&self) -> &Recipe<'w> {
        self.network.recipe()
    }

    /// Multiplications and additions of one prediction.
    pub(crate) fn multiply_adds(&self) -> usize {
        self.network.multiply_adds()
    }

    pub(crate) const fn set_report(&mut self, report: SurrogateReport) {
        self.report = report;
    }
}

/// A lead by the exact step, one step of the network at a time, without memory of its own: until the network takes over
/// nobody needs a vertex's next increment.
#[cfg(feature = "capi-neo-hookean")]
impl Vertex {
    /// Keeps where the node is.
    pub(crate) const fn remember(&mut self, displacement: NodeVector) {
        self.next = displacement;
    }

    /// Turns the frame with the motion since, which is kept instead.
    pub(crate) fn follow_since(&mut self, displacement: NodeVector) {
        self.next = NodeVector((Vec4::from(displacement.0) - Vec4::from(self.next.0)).to_array());
        self.frame.follow(self.next.to_array());
    }

    /// What is kept.
    pub(crate) const fn kept(&self) -> NodeVector {
        self.next
    }
}

impl<V: AsRef<[Vertex]> + AsMut<[Vertex]>> Surrogate<'_, V> {
    /// Back to the world's axes, for a motion from rest.
    pub fn reset(&mut self) {
        self.vertices.as_mut().fill(Vertex::NEW);
    }

    /// Turns the frames with a motion that another step leads: call it whenever the state's last increment spans one
    /// step of this network.
    pub fn follow<S: AsRef<[NodeVector]>>(&mut self, state: &State<S>) {
        for (vertex, increment) in self.vertices.as_mut().iter_mut().zip(state.increment.as_ref()) {
            vertex.frame.follow(increment.to_array());
        }
    }
}

/// Takes one learned step. Every call does the same work. The state's last increment must span the network's step, or
/// be that of a state at rest: if not, and if there is less room than the scene has nodes, the status is `Mismatch`.
pub fn step<M, N, B, S, V>(
    scene: &Scene<M, N, B>,
    loads: &Loads<'_>,
    state: &mut State<S>,
    surrogate: &mut Surrogate<'_, V>,
) -> Status
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    V: AsRef<[Vertex]> + AsMut<[Vertex]>,
{
    step_in_parts(scene, loads, state, surrogate, &Alone)
}

/// The same step, to the bit, on several threads of the host.
pub fn step_in_parts<M, N, B, S, V>(
    scene: &Scene<M, N, B>,
    loads: &Loads<'_>,
    state: &mut State<S>,
    surrogate: &mut Surrogate<'_, V>,
    threads: &impl Threads,
) -> Status
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    V: AsRef<[Vertex]> + AsMut<[Vertex]>,
{
    let nodes = scene.node_count();
    let room = state.capacity().min(surrogate.vertices.as_ref().len());
    let mismatch = Status::Mismatch { nodes, room };
    let Surrogate { network, vertices, step, report } = surrogate;
    let State { displacement, increment, force, time, steps, dt, ledger, extremes: seen } = state;
    let (Some(displacement), Some(increment), Some(force), Some(vertices)) = (
        displacement.as_mut().get_mut(..nodes),
        increment.as_mut().get_mut(..nodes),
        force.as_mut().get_mut(..nodes),
        vertices.as_mut().get_mut(..nodes),
    ) else {
        return mismatch;
    };
    let spans = *dt <= 0.0 || (*dt - step.seconds()).abs() <= 1e-5 * step.seconds();
    if !spans || loads.nodes().is_some_and(|checked| checked != nodes) {
        return mismatch;
    }
    let inertia = scene.inertia();
    let mut account = *ledger;
    if *steps == 0 {
        account.start = account.start.max(scene.releasable_energy());
    }

    let elements = scene.elements();
    let forcing = Forcing { elements, inertia, displacement, loads, time: *time };
    let (network, step) = (&*network, &*step);
    let predict = |nodes: Range<usize>, force: &[NodeVector], vertices: &mut [Vertex]| {
        let inertia = inertia.get(nodes.clone()).unwrap_or_default();
        let displacement = displacement.get(nodes.clone()).unwrap_or_default();
        let increment = increment.get(nodes).unwrap_or_default();
        Predict { network, step, inertia, displacement, increment, force, vertices }.dispatched()
    };
    let (found, extremes) = forcing.in_parts(force, vertices, threads, predict);
    let totals = Totals::of_all(found.iter().map(|(totals, _)| totals));

    *report = Counts::of_all(found.iter().map(|(_, counts)| counts)).report();
    let vertices = &*vertices;
    let next = |node: usize, _: &NodeInertia, _: &NodeVector, _: &NodeVector| {
        vertices.get(node).map_or([0.0; 4], |vertex| vertex.next.0)
    };
    let entry = Entry::of_totals(&totals, loads, step)
        .with_forces(loads, inertia, increment, force, *time, next)
        .with_motions(loads, displacement, increment, force, *time, step);
    let entered = match entry.entered(account, step) {
        Ok(entered) => entered,
        Err(cause) => {
            let node = culprit(inertia, increment, force, step, next);
            return Status::Diverged(Divergence { time: *time, node, cause });
        }
    };

    (*ledger, *seen) = (entered, extremes);
    move_in_parts(elements.chunks, displacement, increment, threads, |nodes, displacement, increment| {
        let vertices = vertices.get(nodes).unwrap_or_default();
        for ((displacement, increment), vertex) in displacement.iter_mut().zip(increment).zip(vertices) {
            *increment = vertex.next;
            displacement.0 = (Vec4::from(displacement.0) + Vec4::from(vertex.next.0)).to_array();
        }
    });
    *dt = step.seconds();
    *time += f64::from(step.seconds());
    *steps += 1;
    follow_motions(loads, displacement, increment, *time);
    extremes.status(ledger, false)
}

/// How many vertices are free, and of how many of these the acceleration was clipped or an input is outside.
#[derive(Clone, Copy, Default)]
struct Counts {
    free: f32,
    clipped: f32,
    outside: f32,
}

impl Counts {
    fn of_all<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        parts.fold(Self::default(), |sum, part| Self {
            free: sum.free + part.free,
            clipped: sum.clipped + part.clipped,
            outside: sum.outside + part.outside,
        })
    }

    fn report(&self) -> SurrogateReport {
        let free = self.free.max(1.0);
        SurrogateReport { clipped: self.clipped / free, outside: self.outside / free }
    }
}

/// Frames, features, network: the next increment of vertices.
struct Predict<'a, 'w> {
    network: &'a Network<'w>,
    step: &'a Step,
    inertia: &'a [NodeInertia],
    displacement: &'a [NodeVector],
    increment: &'a [NodeVector],
    force: &'a [NodeVector],
    vertices: &'a mut [Vertex],
}

impl Predict<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    fn dispatched(self) -> (Totals, Counts) {
        dispatch(self)
    }
}

impl Kernel for Predict<'_, '_> {
    type Output = (Totals, Counts);

    const ONE_BY_ONE: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> Self::Output {
        if R::MANY_REGISTERS { self.tiles::<R, 2>() } else { self.tiles::<R, 1>() }
    }
}

/// Nodes side by side, with what their step needs after the network.
#[derive(Clone, Copy)]
struct Moving<R> {
    axes: Axes<R>,
    /// Ones along free axes.
    free: [R; 3],
    mass: R,
    increment: [R; 3],
    force: [R; 3],
    /// One where an input is outside what training has seen.
    outside: R,
}

impl<R: Real> Moving<R> {
    #[inline(always)]
    fn nothing() -> Self {
        let (zero, none) = (R::splat(0.0), [R::splat(0.0); 3]);
        Self {
            axes: Axes::of(|_| Frame::WORLD),
            free: none,
            mass: zero,
            increment: none,
            force: none,
            outside: zero,
        }
    }
}

/// What is found on the way, node by node in lanes.
struct Found<R> {
    sums: [Sums<R>; 3],
    free: R,
    clipped: R,
    outside: R,
}

/// One where the two are the same number, else zero.
#[inline(always)]
fn same<R: Real>(a: R, b: R) -> R {
    (R::splat(f32::MIN_POSITIVE) - (a - b).abs()).positive()
}

/// The vectors of nodes from `first` on, zero where there are none.
#[inline(always)]
fn vectors<R: Real>(of: &[NodeVector], first: usize) -> [R; 3] {
    let [x, y, z, _] = R::from_rows(|lane| of.get(first + lane).copied().unwrap_or_default().0);
    [x, y, z]
}

impl Predict<'_, '_> {
    #[inline(always)]
    fn tiles<R: Real, const COLUMNS: usize>(mut self) -> (Totals, Counts) {
        let mut scratch = Scratch::<R, COLUMNS>::new();
        let zero = R::splat(0.0);
        let mut found =
            Found { sums: [Sums::new(self.step, R::splat); 3], free: zero, clipped: zero, outside: zero };
        for first in (0..self.inertia.len()).step_by(COLUMNS * R::COUNT) {
            let mut inputs = [[zero; COLUMNS]; MAX_INPUTS];
            // Loops and functions, no closures over vectors: those may stay calls.
            let mut moving = [Moving::nothing(); COLUMNS];
            for (column, moving) in moving.iter_mut().enumerate() {
                let features;
                (*moving, features) = self.see(first + column * R::COUNT);
                for (inputs, feature) in inputs.iter_mut().zip(features) {
                    inputs[column] = feature;
                }
            }
            let [clipped, unclipped] = self.network.forward(&inputs, &mut scratch);
            for (column, moving) in moving.iter().enumerate() {
                let (mut to, mut unclipped_to) = ([zero; 3], [zero; 3]);
                for (axis, (clipped, unclipped)) in clipped.iter().zip(&unclipped).enumerate().take(3) {
                    (to[axis], unclipped_to[axis]) = (clipped[column], unclipped[column]);
                }
                self.move_on(first + column * R::COUNT, moving, to, unclipped_to, &mut found);
            }
        }
        let mut totals = Totals::default();
        totals.add_lanes(&found.sums);
        let sum = |counts: R| (0..R::COUNT).map(|lane| counts.lane(lane)).sum::<f32>();
        let counts =
            Counts { free: sum(found.free), clipped: sum(found.clipped), outside: sum(found.outside) };
        (totals, counts)
    }

    /// The nodes from `first` on, with what the network sees of them; where there are none, without mass or freedom.
    #[inline(always)]
    fn see<R: Real>(&self, first: usize) -> (Moving<R>, [R; FEATURES]) {
        let [ix, iy, iz, mass] = R::from_rows(|lane| {
            let NodeInertia { inverse: [x, y, z], mass } =
                self.inertia.get(first + lane).copied().unwrap_or_default();
            [x, y, z, mass]
        });
        let displacement = vectors::<R>(self.displacement, first);
        let (increment, force) = (vectors::<R>(self.increment, first), vectors::<R>(self.force, first));
        let mut axes =
            Axes::of(|lane| self.vertices.get(first + lane).map_or(Frame::WORLD, |vertex| vertex.frame));
        axes.follow(increment);
        let speed = dot(increment, increment).root().over(R::splat(self.step.seconds()));
        let seen = Seen { displacement, speed, force, mass };
        let features = seen.features(&axes, self.network.recipe().force);
        let mut inside = R::splat(1.0);
        for (&value, range) in features.iter().zip(self.network.inputs()) {
            inside = inside * same(value, value.max(R::splat(range.least)).min(R::splat(range.most)));
        }
        let outside = R::splat(1.0) - inside;
        (
            Moving {
                axes,
                free: [ix.positive(), iy.positive(), iz.positive()],
                mass,
                increment,
                force,
                outside,
            },
            features,
        )
    }

    /// Their next increments, and how the report counts them.
    #[inline(always)]
    fn move_on<R: Real>(
        &mut self,
        first: usize,
        moving: &Moving<R>,
        clipped: [R; 3],
        unclipped: [R; 3],
        found: &mut Found<R>,
    ) {
        let Moving { axes, free, mass, increment, force, outside } = *moving;
        let square = R::splat(self.step.seconds() * self.step.seconds());
        let acceleration = axes.world(clipped);
        let mut next = [R::splat(0.0); 4];
        for axis in 0..3 {
            let (free, increment) = (free[axis], increment[axis]);
            next[axis] = free * (increment + square * acceleration[axis]);
            found.sums[axis].add(mass, free, increment, force[axis], next[axis]);
        }
        axes.hand_to(|lane, frame| {
            if let Some(vertex) = self.vertices.get_mut(first + lane) {
                vertex.frame = frame;
            }
        });
        R::to_rows(next, |lane, next| {
            if let Some(vertex) = self.vertices.get_mut(first + lane) {
                vertex.next.0 = next;
            }
        });
        let any = free[0].max(free[1]).max(free[2]);
        let all =
            same(clipped[0], unclipped[0]) * same(clipped[1], unclipped[1]) * same(clipped[2], unclipped[2]);
        found.free = found.free + any;
        found.clipped = found.clipped + any * (R::splat(1.0) - all);
        found.outside = found.outside + any * outside;
    }
}
