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

use bytemuck::{Pod, Zeroable};
use glam::{Vec3A, Vec4};

use crate::frame::Frame;
use crate::lanes::{Gather, Kernel, NodeVector, Real, Scatter, dispatch};
use crate::loads::Loads;
use crate::material::Material;
use crate::mlp::{ForceInput, MAX_INPUTS, Network, Scratch};
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::state::State;
use crate::tled::{
    Divergence, Entry, InternalForces, Nothing, Status, Step, Sums, Totals, culprit, external_forces,
    follow_motions,
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

/// What the network sees of a vertex: displacement (m), speed (m/s) and force (N, or m/s^2) in its frame.
pub(crate) struct Seen {
    /// m.
    pub(crate) displacement: Vec3A,
    /// m/s.
    pub(crate) speed: f32,
    /// N.
    pub(crate) force: Vec3A,
    /// Lumped, kg.
    pub(crate) mass: f32,
}

impl Seen {
    #[inline(always)]
    pub(crate) fn features(&self, frame: &Frame, input: ForceInput) -> [f32; FEATURES] {
        // A vertex of no element has no mass, and no force.
        let unit = if input == ForceInput::PerMass && self.mass > 0.0 { self.mass } else { 1.0 };
        let ([a, b, c], [d, e, f]) = (frame.local(self.displacement), frame.local(self.force / unit));
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

impl<V: AsRef<[Vertex]> + AsMut<[Vertex]>> Surrogate<'_, V> {
    /// Back to the world's axes, for a motion from rest.
    pub fn reset(&mut self) {
        self.vertices.as_mut().fill(Vertex::NEW);
    }

    /// Turns the frames with a motion that another step leads: call it whenever the state's last increment spans one
    /// step of this network.
    pub fn follow<S: AsRef<[NodeVector]>>(&mut self, state: &State<S>) {
        for (vertex, increment) in self.vertices.as_mut().iter_mut().zip(state.increment.as_ref()) {
            vertex.frame.follow(Vec3A::from(increment.to_array()));
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
    let nodes = scene.node_count();
    let room = state.capacity().min(surrogate.vertices.as_ref().len());
    let mismatch = Status::Mismatch { nodes, room };
    let Surrogate { network, vertices, step, report } = surrogate;
    let State { displacement, increment, force, time, steps, dt, ledger } = state;
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

    external_forces(force, inertia, loads, *time);
    let (Some(from), Some(to)) = (Gather::new(displacement), Scatter::new(force)) else {
        return mismatch;
    };
    let extremes = dispatch(InternalForces { scene, displacement: from, force: to, beside: Nothing });
    let (increments, forces) = (&*increment, &*force);
    let (totals, found) = dispatch(Predict {
        network,
        step,
        inertia,
        displacement,
        increment: increments,
        force: forces,
        vertices,
    });

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

    *ledger = entered;
    *report = found;
    for ((displacement, increment), vertex) in displacement.iter_mut().zip(&mut *increment).zip(vertices) {
        *increment = vertex.next;
        displacement.0 = (Vec4::from(displacement.0) + Vec4::from(vertex.next.0)).to_array();
    }
    *dt = step.seconds();
    *time += f64::from(step.seconds());
    *steps += 1;
    follow_motions(loads, displacement, increment, *time);
    extremes.status(ledger, false)
}

/// Frames, features, network: the next increment of every vertex.
struct Predict<'a, 'w> {
    network: &'a Network<'w>,
    step: &'a Step,
    inertia: &'a [NodeInertia],
    displacement: &'a [NodeVector],
    increment: &'a [NodeVector],
    force: &'a [NodeVector],
    vertices: &'a mut [Vertex],
}

impl Kernel for Predict<'_, '_> {
    type Output = (Totals, SurrogateReport);

    #[inline(always)]
    fn run<R: Real>(self) -> (Totals, SurrogateReport) {
        let Self { network, step, inertia, displacement, increment, force, vertices } = self;
        let (seconds, mut scratch) = (step.seconds(), Scratch::<R>::new());
        let input = network.recipe().force;
        let mut sums = Sums::new(step, Vec4::splat);
        let (mut free, mut clipped, mut outside) = (0u32, 0u32, 0u32);
        let nodes =
            inertia.chunks(R::COUNT).zip(displacement.chunks(R::COUNT)).zip(increment.chunks(R::COUNT));
        let nodes = nodes.zip(force.chunks(R::COUNT)).zip(vertices.chunks_mut(R::COUNT));
        for ((((inertia, displacement), increment), force), vertices) in nodes {
            // Features by lane, then inputs by lanes.
            let mut seen = [[0.0; FEATURES]; LANES];
            let states = displacement.iter().zip(increment).zip(force).zip(inertia);
            for ((seen, vertex), (((displacement, increment), force), inertia)) in
                seen.iter_mut().zip(&mut *vertices).zip(states)
            {
                let increment = Vec3A::from(increment.to_array());
                vertex.frame.follow(increment);
                let speed = libm::sqrtf(increment.length_squared()) / seconds;
                let [displacement, force] = [displacement, force].map(|v| Vec3A::from(v.to_array()));
                *seen =
                    Seen { displacement, speed, force, mass: inertia.mass }.features(&vertex.frame, input);
            }
            let mut inputs = [R::splat(0.0); MAX_INPUTS];
            for (feature, input) in inputs.iter_mut().enumerate().take(FEATURES) {
                *input = R::from_fn(|lane| seen[lane % LANES][feature % FEATURES]);
            }
            let (accelerations, unclipped) = network.forward(&inputs, &mut scratch);
            let [along, across, beside, ..] = accelerations;
            for (lane, vertex) in vertices.iter_mut().enumerate() {
                let (Some(inertia), Some(increment), Some(force)) =
                    (inertia.get(lane), increment.get(lane), force.get(lane))
                else {
                    continue;
                };
                let local = [along, across, beside].map(|component| component.lane(lane));
                let acceleration = vertex.frame.world(local);
                let last = Vec4::from(increment.0);
                let push = seconds * seconds * acceleration;
                let next = inertia.free() * (last + Vec4::new(push.x, push.y, push.z, 0.0));
                vertex.next.0 = next.to_array();
                sums.add(Vec4::splat(inertia.mass), inertia.free(), last, Vec4::from(force.0), next);
                if inertia.inverse.iter().any(|&inverse| inverse > 0.0) {
                    free += 1;
                    let differs = |a: &R, b: &R| a.lane(lane) != b.lane(lane);
                    clipped += u32::from(accelerations.iter().zip(&unclipped).any(|(a, b)| differs(a, b)));
                    let unseen = |(&value, range): (&f32, &crate::mlp::Range)| {
                        !(range.least <= value && value <= range.most)
                    };
                    outside += u32::from(seen[lane % LANES].iter().zip(network.inputs()).any(unseen));
                }
            }
        }
        let share = |count: u32| count as f32 / free.max(1) as f32;
        (Totals::of_axes(&sums), SurrogateReport { clipped: share(clipped), outside: share(outside) })
    }
}

/// Lanes that there are at most.
const LANES: usize = crate::lanes::BLOCK;
