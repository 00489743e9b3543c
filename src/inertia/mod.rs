//! Steps beyond the limit of stability, without a network: inertia is raised where a step `D` would be
//! unstable, and smooth motion is given its true inertia back through a coarse lattice. One force evaluation a
//! step, as in the exact one.
//!
//! Two methods share the code: *mass scaling* (no lattice) and *multilevel inertia* (with a lattice). Bounds and coarse
//! inertia are renewed in cycles, an equal part each step. Precedent: selective mass scaling (Olovsson et al. 2005), reciprocal mass matrices
//! (Tkachuk & Bischoff 2015).
//!
//! # The step
//!
//! ```text
//! r   = D^2 f - 2 k m du                            k = mu D / 2
//! du+ = du + M^-1 r + W (S^-1 - G^-1) W^T r         M = N + reserve m      (node.rs)
//! S   = (1 + k) Mc + s_c D^2 / 4 Kc,  G = W^T M W                          (assembly.rs)
//! ```
//! `N >= s D^2 / 4 sum_e D_a`, the elements' bound (`bound.rs`). The operator is symmetric, and positive: with
//! `du = W c + y` and `W^T M y = 0` its inverse is `c^T S c + y^T M y`.
//!
//! # Why it is stable
//!
//! Central differences with the operator `B` are stable while `lambda_max(B K) < 4 / D^2`. As `G` is positive,
//! `B <= M^-1 + W S^-1 W^T`, and the largest eigenvalue of a sum of products with `K` is at most the sum of
//! theirs:
//!
//! ```text
//! lambda_max(B K) <= lambda_max(M^-1 K) + lambda_max(S^-1 W^T K W) <= 4 / D^2 (1 / s + 1 / s_c)
//! ```
//! The first because `K <= sum_e D_a <= 4 / (s D^2) N`, the second because `W^T K W <= Kc`: both are made from the same bound of
//! each element's tangent, for any mesh, support, material and state. With `s` = 1.35 and `s_c` = 6 the
//! bracket is 0.907: it allows the stiffness of a node to grow by 5 % and that of the lattice's motion by 33 %
//! while a cycle lasts. What a refresh lags behind is met in two ways. Bounds have directions, and tissue
//! turns: they are kept in frames that turn with it (`frames.rs`; without them a free body that has turned by
//! 15 degrees is unstable at 20 times its limit). Mass scaling has a lattice for these frames alone. Where tissue stiffens more than allowed, the step is held back:
//! each step computes a scalar bound of every element, which rides along with the forces; a node whose sum has grown
//! beyond its allowance gets the inverse inertia divided by the growth, and the lattice's part is multiplied by
//! `1.33 / growth`. `G` may lag behind without harm: it does not appear in the bound. Between refreshes this is
//! a safeguard, not a proof: what a bound's direction changes by beyond the rotation of its frame is left to the margin.
//! Without a lattice all of the bracket is the nodes': with `s` = 1.1 it is 0.91, and 0.955 where a node has grown by 5 %.
//! A cycle lasts 0.04 s, short beside the motions of hands and breath, but at least 16 and at most 64 steps.
//!
//! A linear bound says nothing about a step that is large against the law's own range. So the forces of one step may
//! not move a node from rest by more than a fiftieth of the least height of its elements ([`Report::held_back`]), nor
//! strain a cell of the lattice by more than that ([`Report::coarse_share`]). And float32 cannot invert what is too
//! ill-conditioned: an inverse that does not give back what it was solved for is not used, and the nodes move alone
//! until the next cycle. What is conserved when inertia changes is stated in `node.rs`.
//! If a step goes wrong all the same, the energy account says so and the step is not taken.
//!
//! # What it costs
//!
//! Accuracy: motion that neither has its true inertia nor is carried by the lattice lags behind. [`Report`]
//! says how much inertia was added, and where, and estimates the error in metres (`estimate.rs`). Memory:
//! [`vectors_for`], one [`LatticeNode`] a node and [`numbers_for`] the lattice.

mod assembly;
#[cfg(test)]
mod assembly_tests;
mod block;
mod bound;
#[cfg(test)]
mod bound_tests;
mod cells;
mod damper;
mod dense;
mod estimate;
mod frames;
mod lattice;
mod matrices;
mod node;
mod passes;
mod refresh;
mod report;
mod step;
mod vectors;

pub use damper::{Damper, DamperError};
pub use lattice::{LatticeNode, MAX_FUNCTIONS, MAX_POINTS};
pub use report::Report;
pub use step::{damped_step, step};
pub use vectors::{damped_vectors_for, vectors_for};

use core::fmt;

use crate::lanes::{Following, NodeVector};
use crate::material::Material;
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::state::State;
use crate::tled::Step;

pub(crate) use block::OneBlock;
pub(crate) use bound::ScalarBeside;
use damper::Rough;
use estimate::Estimate;
use lattice::Lattice;
use matrices::Matrices;
use node::Scaling;
use refresh::{Refresh, Sources};
use vectors::{NodeTables, read_matrices};

/// `s` of mass scaling alone: `NODE_GROWTH`, and as much again for how bounds turn within a cycle.
const FINE_ALONE: f32 = 1.1;
/// `s` and `s_c` with a lattice.
const FINE: f32 = 1.35;
const COARSE: f32 = 6.0;
/// How far the stiffness of a node may grow before it is held back.
const NODE_GROWTH: f32 = 1.05;
/// How far that of the lattice's motion may grow: `NODE_GROWTH / FINE + COARSE_GROWTH / COARSE = 1`.
const COARSE_GROWTH: f32 = COARSE * (1.0 - NODE_GROWTH / FINE);
/// Largest part of an element that a node's force may move it by in one step from rest.
const LARGEST_KICK: f32 = 0.02;
/// How much faster from step to step what is held back may move again.
const RECOVERY: f32 = 1.05;
/// What it starts from at least: nothing would never grow.
const LEAST_SHARE: f32 = 1e-6;
/// Time of a refresh cycle, s: short beside the motions of hands and breath, which stiffen and turn tissue.
const CYCLE: f32 = 0.04;
/// Fewest and most steps of a cycle.
const CYCLE_STEPS: (f32, f32) = (16.0, 64.0);

/// Numbers that a lattice of these cells along x, y, z with this many functions ([`lattice_functions`]) needs.
#[must_use]
pub const fn numbers_for(cells: [u32; 3], functions: usize) -> usize {
    let [x, y, z] = cells;
    let cells = (x as usize).saturating_mul(y as usize).saturating_mul(z as usize);
    matrices::numbers_for(cells, functions, false)
}

/// The same for [`Inertia::damped`].
#[must_use]
pub const fn damped_numbers_for(cells: [u32; 3], functions: usize) -> usize {
    let [x, y, z] = cells;
    let cells = (x as usize).saturating_mul(y as usize).saturating_mul(z as usize);
    matrices::numbers_for(cells, functions, true)
}

/// Why an inertia could not be prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum InertiaError {
    /// Less room than the scene or the lattice needs.
    Capacity {
        /// "vectors", "lattice nodes", "numbers" or "nodes in the state".
        kind: &'static str,
        /// How many are needed.
        needed: usize,
        /// Room.
        capacity: usize,
    },
    /// A lattice has no cell along some axis or more than [`MAX_POINTS`] points.
    Cells {
        /// Cells along x, y, z.
        cells: [u32; 3],
    },
    /// A lattice has more than [`MAX_FUNCTIONS`] functions.
    Functions {
        /// Cells along x, y, z.
        cells: [u32; 3],
    },
    /// Other points than the scene was built from.
    Points {
        /// Points given.
        points: usize,
        /// Nodes of the scene.
        nodes: usize,
    },
    /// The state is not finite, or so stiff that no step can be bounded.
    NotFinite {
        /// The first such node.
        node: u32,
    },
}

impl fmt::Display for InertiaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Capacity { kind, needed, capacity } => {
                write!(f, "the inertia needs {needed} {kind}, there is room for {capacity}")
            }
            Self::Cells { cells: [x, y, z] } => write!(
                f,
                "a lattice of {x} x {y} x {z} cells: each must be at least 1, with at most {MAX_POINTS} points"
            ),
            Self::Functions { cells: [x, y, z] } => {
                write!(f, "a lattice of {x} x {y} x {z} cells has more than {MAX_FUNCTIONS} functions")
            }
            Self::Points { points, nodes } => {
                write!(f, "{points} points for a scene of {nodes} nodes")
            }
            Self::NotFinite { node } => write!(f, "node {node}: its stiffness is not a finite number"),
        }
    }
}

impl core::error::Error for InertiaError {}

/// The inertia of a scene for one step length over storage of the caller: `V` for [`vectors_for`] the
/// nodes, `W` for a [`LatticeNode`] each, `D` for [`numbers_for`] the lattice (both empty without a lattice).
#[derive(Clone, Debug)]
pub struct Inertia<V, W, D> {
    vectors: V,
    places: W,
    dense: D,
    core: Core,
}

/// What an inertia is apart from its storage.
#[derive(Clone, Debug)]
pub(crate) struct Core {
    nodes: usize,
    /// For [`damped_step`].
    damped: bool,
    /// What the latest damped step found.
    rough: Rough,
    step: Option<Step>,
    lattice: Lattice,
    refresh: Refresh,
    scaling: Scaling,
    estimate: Estimate,
    report: Report,
}

/// Mass scaling alone.
pub type MassScaling<V> = Inertia<V, [LatticeNode; 0], [f32; 0]>;

impl<V> MassScaling<V> {
    /// Over the given vectors; [`Inertia::prepare`] comes next.
    pub const fn scaling_over(vectors: V) -> Self {
        Self::over(vectors, [], [])
    }
}

impl<V, W, D> Inertia<V, W, D> {
    /// Over the given storage; [`Inertia::prepare`] comes next.
    pub const fn over(vectors: V, places: W, dense: D) -> Self {
        Self { vectors, places, dense, core: Core::NEW }
    }

    /// The same for [`damped_step`]: the lattice's motion follows the law to second order (`damper.rs`). Needs
    /// [`damped_vectors_for`] and [`damped_numbers_for`] as many.
    #[must_use]
    pub const fn damped(mut self) -> Self {
        self.core.damped = true;
        self
    }

    /// What the latest step, or the preparation, found.
    pub const fn report(&self) -> &Report {
        self.core.report()
    }

    /// Cells of the lattice along each axis, zeros without one.
    #[must_use]
    pub const fn cells(&self) -> [u32; 3] {
        self.core.lattice.cells()
    }

    /// Steps in which the inertia of a lattice is computed anew, evenly: those of 0.04 s, at least 16 and at most 64.
    #[must_use]
    pub const fn cycle(&self) -> u32 {
        self.core.refresh.steps()
    }

    /// Functions of the lattice: those that support or body leave something to move.
    #[must_use]
    pub const fn functions(&self) -> usize {
        self.core.lattice.functions()
    }
}

/// The storage of an inertia.
pub(crate) struct Storage<'a> {
    pub(crate) vectors: &'a mut [NodeVector],
    pub(crate) places: &'a mut [LatticeNode],
    pub(crate) dense: &'a mut [f32],
}

/// The largest near-cubic lattice whose cost stays a small part of the step's: with `n = 3` unknowns a function, `n^3` at
/// most 400 times the elements. Also
/// gives its number of functions, for [`numbers_for`]. No cells if not even one would do.
#[must_use]
pub fn suggested_lattice<M, N, B>(scene: &Scene<M, N, B>, points: &[[f32; 3]]) -> ([u32; 3], usize)
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    largest_lattice(scene, points, 400)
}

/// The same for [`Inertia::damped`]: up to 700 times the elements, since a finer lattice pays once rough motion
/// is damped.
#[must_use]
pub fn suggested_damped_lattice<M, N, B>(scene: &Scene<M, N, B>, points: &[[f32; 3]]) -> ([u32; 3], usize)
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    largest_lattice(scene, points, 700)
}

fn largest_lattice<M, N, B>(
    scene: &Scene<M, N, B>,
    points: &[[f32; 3]],
    multiply_adds: u64,
) -> ([u32; 3], usize)
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    let mut best = ([0; 3], 0);
    for cells in (1..64).flat_map(|parts| lattice::near_cubic(points, parts)) {
        let Ok(lattice) = Lattice::new(cells, points, scene.inertia()) else {
            break;
        };
        let functions = lattice.functions();
        let unknowns = 3 * functions as u64;
        if functions > best.1
            && unknowns * unknowns * unknowns <= multiply_adds * scene.element_count() as u64
        {
            best = (cells, functions);
        }
    }
    best
}

/// Functions that a lattice of these cells has on the scene.
pub fn lattice_functions<M, N, B>(
    scene: &Scene<M, N, B>,
    points: &[[f32; 3]],
    cells: [u32; 3],
) -> Result<usize, InertiaError>
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    Ok(Lattice::new(cells, points, scene.inertia())?.functions())
}

impl<V, W, D> Inertia<V, W, D>
where
    V: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    W: AsRef<[LatticeNode]> + AsMut<[LatticeNode]>,
    D: AsRef<[f32]> + AsMut<[f32]>,
{
    /// Computes the inertia for steps of `step` from the state as it is, with a lattice of `cells` along each
    /// axis (zeros for mass scaling alone) around the scene's `points` at rest. Takes a few force evaluations, and for a
    /// lattice about as many as a cycle of steps. On an error no step can be taken.
    pub fn prepare<M, N, B, S>(
        &mut self,
        scene: &Scene<M, N, B>,
        points: &[[f32; 3]],
        state: &mut State<S>,
        step: Step,
        cells: [u32; 3],
    ) -> Result<(), InertiaError>
    where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
        S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    {
        let Self { vectors, places, dense, core } = self;
        let storage = Storage { vectors: vectors.as_mut(), places: places.as_mut(), dense: dense.as_mut() };
        core.prepare(scene, points, state, step, cells, storage)
    }
}

impl Core {
    pub(crate) const NEW: Self = Self {
        nodes: 0,
        damped: false,
        rough: Rough::NONE,
        step: None,
        lattice: Lattice::NONE,
        refresh: Refresh::NEW,
        scaling: Scaling { weight: 0.0, k: 0.0, reserve: 0.0, loss: 0.0, coarse_weight: 0.0 },
        estimate: Estimate::NONE,
        report: Report::NONE,
    };

    /// Of [`Inertia::damped`].
    #[cfg(feature = "capi-neo-hookean")]
    pub(crate) const DAMPED: Self = Self { damped: true, ..Self::NEW };

    pub(crate) const fn report(&self) -> &Report {
        &self.report
    }

    /// [`Inertia::prepare`].
    pub(crate) fn prepare<M, N, B, S>(
        &mut self,
        scene: &Scene<M, N, B>,
        points: &[[f32; 3]],
        state: &mut State<S>,
        step: Step,
        cells: [u32; 3],
        storage: Storage<'_>,
    ) -> Result<(), InertiaError>
    where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
        S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    {
        let Storage { vectors: all, places, dense } = storage;
        self.step = None;
        let nodes = scene.node_count();
        if points.len() != nodes {
            return Err(InertiaError::Points { points: points.len(), nodes });
        }
        let room = |kind, needed, capacity| {
            if capacity < needed { Err(InertiaError::Capacity { kind, needed, capacity }) } else { Ok(()) }
        };
        let vectors = if self.damped { damped_vectors_for } else { vectors_for };
        room("vectors", vectors(nodes), all.len())?;
        room("nodes in the state", nodes, state.capacity())?;
        self.lattice =
            if cells == [0; 3] { Lattice::NONE } else { Lattice::new(cells, points, scene.inertia())? };
        let functions = self.lattice.functions();
        if functions > 0 {
            room("lattice nodes", nodes, places.len())?;
            let numbers = if self.damped { damped_numbers_for } else { numbers_for };
            room("numbers", numbers(cells, functions), dense.len())?;
        }

        let (dt, damping) = (step.seconds(), step.damping());
        let k = 0.5 * damping * dt;
        let alone = functions == 0;
        let cycle = (CYCLE / dt).clamp(CYCLE_STEPS.0, CYCLE_STEPS.1) as u32;
        let fine = if alone { FINE_ALONE } else { FINE };
        self.scaling = Scaling {
            weight: 0.25 * fine * dt * dt,
            k,
            reserve: if alone { k } else { k * (1.0 + k) },
            loss: 2.0 * damping * dt * cycle as f32,
            coarse_weight: 0.25 * COARSE * dt * dt,
        };
        let Some(mut tables) = NodeTables::split(all, nodes) else {
            return Ok(());
        };
        write_heights(scene, &mut tables);
        let (Some(displacement), Some(increment)) =
            (state.displacement.as_ref().get(..nodes), state.increment.as_mut().get_mut(..nodes))
        else {
            return Ok(());
        };
        let cell_count = self.lattice.cell_count();
        self.refresh = Refresh::over(cycle, scene.blocks().len(), nodes, functions, cell_count);
        let turning = if alone { frames_alone(scene, points)? } else { self.lattice.clone() };
        self.refresh.frames.choose(&turning, points);
        for (node, (&point, inertia)) in points.iter().zip(scene.inertia()).enumerate() {
            let place = turning.place(point);
            tables.set_frame(node, turning.frame(&place, inertia));
            if let Some(to) = places.get_mut(node).filter(|_| !alone) {
                *to = place;
            }
        }
        if let Some(places) = places.get_mut(..nodes).filter(|_| !alone) {
            lattice::order(places);
        }
        let Some(mut matrices) = Matrices::split(dense, &self.lattice, self.damped && !alone) else {
            return Ok(());
        };
        let sources = Sources {
            scene,
            displacement,
            increment,
            lattice: &self.lattice,
            places,
            scaling: &self.scaling,
        };
        self.refresh.complete(sources, &mut tables, &mut matrices);
        self.report = self.refresh.published.report(0, 1.0, 0.0);
        let bad = (0..nodes).find(|&node| {
            let (inverse, [scalar, _]) =
                read_matrices::<f32>(Following(node), tables.inverse_diagonal, tables.inverse_beside);
            !(inverse.trace().is_finite() && scalar.is_finite())
        });
        if let Some(node) = bad {
            return Err(InertiaError::NotFinite { node: node as u32 });
        }
        self.nodes = nodes;
        tables.rough.fill(NodeVector::ZERO);
        self.rough = Rough::NONE;
        self.estimate = Estimate::NONE;
        self.step = Some(step);
        Ok(())
    }
}

/// A lattice whose functions only turn, for mass scaling alone.
fn frames_alone<M, N, B>(scene: &Scene<M, N, B>, points: &[[f32; 3]]) -> Result<Lattice, InertiaError>
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    let (cells, functions) = suggested_lattice(scene, points);
    Lattice::new(if functions > 0 { cells } else { [1; 3] }, points, scene.inertia())
}

/// Writes the least height of each node's elements, `1 / |ga|`, into the fourth number of `next`.
fn write_heights<M, N, B>(scene: &Scene<M, N, B>, tables: &mut NodeTables<'_>)
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    // First the largest |ga|^2, then the height.
    tables.next.fill(NodeVector::ZERO);
    for (block, lane) in scene.places() {
        let slopes = [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| block.gradient_of(corner, axis, lane)));
        let origin = [0, 1, 2].map(|axis| slopes[0][axis] + slopes[1][axis] + slopes[2][axis]);
        for (corner, [x, y, z]) in [origin, slopes[0], slopes[1], slopes[2]].into_iter().enumerate() {
            if let Some(node) = tables.next.get_mut(block.node(corner, lane)) {
                let square = x * x + y * y + z * z;
                node.0[3] = if square > node.0[3] { square } else { node.0[3] };
            }
        }
    }
    for node in tables.next.iter_mut() {
        node.0[3] = if node.0[3] > 0.0 { 1.0 / libm::sqrtf(node.0[3]) } else { f32::MAX };
    }
}
