//! The force (N) by which some supports, an instrument for example, act on the tissue.
//!
//! At a held node the tissue pulls with its internal force, and that is what exact steps say. After steps beyond the
//! critical one it is not: raised inertia holds the nodes around a support back, so that the elements there are
//! strained too much. But the balance of momentum holds for every set of nodes. With weights `w` that are 1 at the
//! supports in question, 0 at all others and anything between, the supports' force is
//!
//! ```text
//! R = sum_i w_i (m_i a_i + mu m_i v_i - f_i)          f_i: loads and internal forces
//! ```
//! where free nodes add nothing in exact motion. In long steps they add the force that their raised inertia takes, so
//! that only the error of smooth motion is left. Were `w` the displacements of tissue in equilibrium when the supports
//! move by one, small errors of other displacements would not change the sum, as there `K w = 0`. Here `w` is harmonic
//! on the graph of the mesh, which is close to it and needs neither law nor solver.
//!
//! `a` is the change of momentum since the last call, so the answer is the mean force over that time. Its difference
//! from the same sum over the supports alone tells how far the step is from resolving the force ([`Force::spread`]).

use core::fmt;

use glam::{DVec3, Vec3, Vec4};

use crate::element::Axes;
use crate::material::Material;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::is_damping;

/// Most passes over the mesh that compute the weights, and the largest change of a weight after which none follows.
const MOST_PASSES: u32 = 512;
const SETTLED: f32 = 1e-4;
/// Part of the force above which its spread says that it is not resolved.
const LARGEST_SPREAD: f32 = 0.25;

/// Vectors of storage that the reaction of a scene of so many nodes needs.
#[must_use]
pub const fn vectors_for(nodes: usize) -> usize {
    nodes
}

/// Why a reaction could not be prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ReactionError {
    /// Less storage than [`vectors_for`].
    Capacity {
        /// Vectors needed.
        needed: usize,
        /// Vectors given.
        capacity: usize,
    },
    /// A list without nodes.
    Empty,
    /// A node that does not exist.
    Node {
        /// Position in the list.
        index: usize,
        /// The node it names.
        node: u32,
        /// Nodes in the scene.
        nodes: usize,
    },
    /// A node without a held axis.
    NotHeld {
        /// Position in the list.
        index: usize,
        /// The node.
        node: u32,
    },
    /// A damping that is negative or not finite.
    Damping {
        /// 1/s.
        damping: f32,
    },
}

impl fmt::Display for ReactionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Capacity { needed, capacity } => {
                write!(f, "the reaction needs {needed} vectors, there is room for {capacity}")
            }
            Self::Empty => write!(f, "a reaction of no nodes: list the supports that act"),
            Self::Node { index, node, nodes } => {
                write!(f, "support {index}: node {node} does not exist, the scene has {nodes} nodes")
            }
            Self::NotHeld { index, node } => {
                write!(f, "support {index}: no axis of node {node} is held by the scene")
            }
            Self::Damping { damping } => write!(f, "the damping is {damping} 1/s, it must be zero or more"),
        }
    }
}

impl core::error::Error for ReactionError {}

/// A force on the tissue, the mean over the time between two calls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Force {
    /// N.
    pub newton: [f32; 3],
    /// How far the force at the supports alone is from it, N: zero for steps that resolve the motion around them.
    pub spread: f32,
}

impl Force {
    fn is_finite(&self) -> bool {
        Vec3::from(self.newton).is_finite() && self.spread.is_finite()
    }

    /// Whether the steps resolve the force: the spread is at most a quarter of it.
    #[must_use]
    pub fn is_resolved(&self) -> bool {
        self.spread <= LARGEST_SPREAD * Vec3::from(self.newton).length()
    }
}

/// Sums over the nodes.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    /// `sum w m v`, N s.
    momentum: DVec3,
    /// `sum w f`, N.
    force: DVec3,
}

/// What is known from a call.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time: f64,
    steps: u64,
    weighted: Sums,
    /// Over the supports alone.
    alone: Sums,
}

/// A reaction without its storage; it may be moved in memory.
#[derive(Clone, Debug)]
pub struct ReactionModel {
    nodes: usize,
    /// The checksum of the scene.
    scene: u32,
    damping: f32,
    last: Option<Sample>,
    force: Option<Force>,
}

/// One row of the storage.
#[derive(Clone, Copy)]
struct Weight {
    weight: f32,
    /// 1 for the supports in question, 0 for free nodes, -1 for all other supports.
    kind: f32,
    /// Sum of the weights of the neighbours in all elements, and their number.
    sum: f32,
    count: f32,
}

const ASKED: f32 = 1.0;
const FREE: f32 = 0.0;
const OTHER: f32 = -1.0;

impl Weight {
    const fn of(&NodeVector([weight, kind, sum, count]): &NodeVector) -> Self {
        Self { weight, kind, sum, count }
    }

    const fn write(self, to: &mut NodeVector) {
        to.0 = [self.weight, self.kind, self.sum, self.count];
    }
}

impl ReactionModel {
    /// The reaction of these supports of a scene, for steps with this damping (1/s). It takes as long as some hundred
    /// steps. `storage` of [`vectors_for`] vectors is overwritten.
    pub fn prepare<M: Material>(
        scene: SceneView<'_, M>,
        supports: &[u32],
        damping: f32,
        storage: &mut [NodeVector],
    ) -> Result<Self, ReactionError> {
        let nodes = scene.node_count();
        let (needed, capacity) = (vectors_for(nodes), storage.len());
        let rows = storage.get_mut(..needed).ok_or(ReactionError::Capacity { needed, capacity })?;
        if !is_damping(damping) {
            return Err(ReactionError::Damping { damping });
        }
        for (row, inertia) in rows.iter_mut().zip(scene.inertia) {
            let kind = if inertia.held() == Axes::NONE { FREE } else { OTHER };
            Weight { weight: 0.0, kind, sum: 0.0, count: 0.0 }.write(row);
        }
        if supports.is_empty() {
            return Err(ReactionError::Empty);
        }
        for (index, &node) in supports.iter().enumerate() {
            match rows.get_mut(node as usize) {
                Some(row) if row.0[1] != FREE => row.0 = [1.0, ASKED, 0.0, 0.0],
                Some(_) => return Err(ReactionError::NotHeld { index, node }),
                None => return Err(ReactionError::Node { index, node, nodes }),
            }
        }
        for (tile, lane) in scene.places() {
            for corner in 0..4 {
                if let Some(NodeVector([_, _, _, count])) = rows.get_mut(tile.node(corner, lane)) {
                    *count += 3.0;
                }
            }
        }
        for _ in 0..MOST_PASSES {
            if spread_weights(scene, rows) <= SETTLED {
                break;
            }
        }
        Ok(Self { nodes, scene: scene.checksum(), damping, last: None, force: None })
    }

    /// Whether it was prepared for this scene.
    pub(crate) fn is_for<M>(&self, scene: SceneView<'_, M>) -> bool {
        self.nodes == scene.node_count() && self.scene == scene.checksum()
    }

    /// See [`Reaction::follow`].
    pub fn follow<M: Material>(
        &mut self,
        scene: SceneView<'_, M>,
        state: &StateView<'_>,
        storage: &[NodeVector],
    ) -> Option<Force> {
        if !self.is_for(scene) || state.capacity() < self.nodes || storage.len() < self.nodes {
            return None;
        }
        let (time, steps) = (state.time(), state.steps());
        if self.last.is_some_and(|last| last.steps == steps && last.time == time) {
            return self.force;
        }
        let (weighted, alone) = sums(scene, state, storage);
        let now = Sample { time, steps, weighted, alone };
        let before = self.last.replace(now).filter(|last| last.steps < steps && last.time < time);
        self.force = before.map(|before| self.between(&before, &now)).filter(Force::is_finite);
        self.force
    }

    fn between(&self, before: &Sample, now: &Sample) -> Force {
        let seconds = now.time - before.time;
        let count = (now.steps - before.steps) as f64;
        // Forces are those at the start of a step. Those in the middle of the time are between those of the last steps
        // of both calls.
        // A state at its start, restored or exchanged has none.
        let has_none = before.weighted.force == DVec3::ZERO && before.alone.force == DVec3::ZERO;
        let share = if before.steps == 0 || has_none { 1.0 } else { (count + 1.0) / (2.0 * count) };
        let of = |before: &Sums, now: &Sums| {
            let damped = 0.5 * f64::from(self.damping) * (before.momentum + now.momentum);
            let force = before.force + share * (now.force - before.force);
            (now.momentum - before.momentum) / seconds + damped - force
        };
        let newton = of(&before.weighted, &now.weighted);
        let spread = newton.distance(of(&before.alone, &now.alone));
        Force { newton: newton.as_vec3().to_array(), spread: spread as f32 }
    }
}

/// Gives each free node the mean of its neighbours in all its elements: a weight never leaves 0 to 1. Gives the largest
/// change.
fn spread_weights<M>(scene: SceneView<'_, M>, rows: &mut [NodeVector]) -> f32 {
    for (tile, lane) in scene.places() {
        let nodes = [0, 1, 2, 3].map(|corner| tile.node(corner, lane));
        let weights = nodes.map(|node| rows.get(node).map_or(0.0, |row| row.0[0]));
        let sum: f32 = weights.iter().sum();
        for (node, weight) in nodes.into_iter().zip(weights) {
            if let Some(NodeVector([_, _, of_neighbours, _])) = rows.get_mut(node) {
                *of_neighbours += sum - weight;
            }
        }
    }
    let mut largest = 0.0f32;
    for row in rows {
        let Weight { weight, kind, sum, count } = Weight::of(row);
        let new = if kind == FREE && count > 0.0 { sum / count } else { weight };
        largest = largest.max((new - weight).abs());
        Weight { weight: new, kind, sum: 0.0, count }.write(row);
    }
    largest
}

/// Sums with all weights, and over the supports alone.
fn sums<M>(scene: SceneView<'_, M>, state: &StateView<'_>, rows: &[NodeVector]) -> (Sums, Sums) {
    let seconds = f64::from(state.last_step());
    let per_second = if seconds > 0.0 { 1.0 / seconds } else { 0.0 };
    let (mut weighted, mut alone) = (Sums::default(), Sums::default());
    let vectors = state.increment.iter().zip(&*state.force);
    for ((row, inertia), (increment, force)) in rows.iter().zip(scene.inertia).zip(vectors) {
        let Weight { weight, kind, .. } = Weight::of(row);
        if weight == 0.0 {
            continue;
        }
        let [increment, force] = [increment, force].map(|vector| Vec4::from(vector.0).truncate().as_dvec3());
        let momentum = f64::from(inertia.mass) * per_second * increment;
        let add = |sums: &mut Sums, weight: f64| {
            sums.momentum += weight * momentum;
            sums.force += weight * force;
        };
        add(&mut weighted, f64::from(weight));
        if kind == ASKED {
            add(&mut alone, 1.0);
        }
    }
    (weighted, alone)
}

/// The reaction of supports with storage `S` of the caller.
#[derive(Clone, Debug)]
pub struct Reaction<S> {
    model: ReactionModel,
    storage: S,
}

impl<S: AsMut<[NodeVector]> + AsRef<[NodeVector]>> Reaction<S> {
    /// See [`ReactionModel::prepare`].
    pub fn prepare<M: Material>(
        scene: SceneView<'_, M>,
        supports: &[u32],
        damping: f32,
        mut storage: S,
    ) -> Result<Self, ReactionError> {
        let model = ReactionModel::prepare(scene, supports, damping, storage.as_mut())?;
        Ok(Self { model, storage })
    }

    /// To be called after each frame's steps, of any kind, with the state that they left: the mean force since the last
    /// call. None at the first call, after a reset or a restore to an earlier time, for a scene that it was not
    /// prepared for, and where it is no finite number. Call it before the first step for a force after it. It costs a
    /// pass over the nodes.
    pub fn follow<M: Material>(&mut self, scene: SceneView<'_, M>, state: &StateView<'_>) -> Option<Force> {
        self.model.follow(scene, state, self.storage.as_ref())
    }

    /// The weights of the nodes, from 0 to 1.
    pub fn weights(&self) -> impl Iterator<Item = f32> {
        self.storage.as_ref().iter().take(self.model.nodes).map(|row| Weight::of(row).weight)
    }
}

#[cfg(any(feature = "std", test))]
impl Reaction<std::vec::Vec<NodeVector>> {
    /// The same with storage from the heap.
    pub fn prepare_in_vec<M: Material>(
        scene: SceneView<'_, M>,
        supports: &[u32],
        damping: f32,
    ) -> Result<Self, ReactionError> {
        let vectors = vectors_for(scene.node_count());
        Self::prepare(scene, supports, damping, std::vec![NodeVector::ZERO; vectors])
    }
}
