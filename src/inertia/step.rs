//! One long step: forces with scalar bounds; the motion of every node by its own inertia, and its contribution to the
//! lattice; the lattice's stiffness anew if that is due; its motion, and its addition to the nodes.

use glam::Vec4;

use crate::element::{ElementMaterial, LOOK_CYCLE_OF_LONG, NodeInertia, ScalarBound};
use crate::loads::Loads;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::{
    CallingThread, Computed, Moving, Status, Step, StepMethod, Threads, TotalForces, Totals, Trial, write_volumes,
};

use super::cells::{prolong, restrict};
use super::clusters::ClusterInput;
use super::coarse_motion::{CoarseMotion, CoarseSpace, MotionResult, removed_share};
use super::coarse_room::CoarseRoom;
use super::large_step::{LargeModel, LargeView, Storage};
use super::lattice::{CoarseVectors, Lattice, rank_of};
use super::matrices::{Bands, Matrices};
use super::motion_pass::{LatticeMotion, PassTotals};
use super::parts::NodeParts;
use super::pass_input::{PassInput, ResidualFactors};
use super::pulls;
use super::renewal::RenewalInput;
use super::report::HeldBack;
use super::rough_motion::RoughMotion;
use super::supports::MovingSupports;
use super::{ADDED_AT_LARGEST_STRAIN, LARGEST_STRAIN, LARGEST_STRAIN_OF_PATCHES, LEAST_STRAIN_SHARE};

/// A step is [`Status::Limited`] if more than this share of the inverse inertia of all nodes is not used, or less than
/// this share of the lattice's motion is used.
const LARGEST_UNUSED: f32 = 0.05;
const LEAST_COARSE_SHARE: f32 = 0.8;
/// Times the last step beyond which a step calms what that has left ([`LargeModel::follow`]).
const MUCH_LONGER: f32 = 2.0;

impl LargeView<'_> {
    /// See [`super::LargeStep::step`].
    pub fn step<M: ElementMaterial>(self, scene: SceneView<'_, M>, loads: &Loads<'_>, state: StateView<'_>) -> Status {
        self.step_in_parts(scene, loads, state, &CallingThread)
    }

    /// The same step, to the bit, on several threads of the host: the work on elements and nodes, not the inversions
    /// and the assembly of a cycle.
    pub fn step_in_parts<M: ElementMaterial>(
        self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
        threads: &impl Threads,
    ) -> Status {
        let (model, storage) = match self.opened(scene, &state) {
            Ok(opened) => opened,
            Err(mismatch) => return mismatch,
        };
        let step = model.step.carried_from(state.dt);
        match Trial::begin(scene, loads, state, model.nodes) {
            Ok(trial) => trial.take(&step, &mut InertiaStep::new(&step, model, storage, threads)),
            Err(refused) => refused,
        }
    }
}

impl<'a> LargeView<'a> {
    /// The model and the parts of its storage, if they are for this scene.
    pub(super) fn opened<M>(
        self,
        scene: SceneView<'_, M>,
        state: &StateView<'_>,
    ) -> Result<(&'a mut LargeModel, Storage<'a>), Status> {
        let Self { model, storage } = self;
        let nodes = model.nodes;
        let mismatch = |room| Status::Mismatch { nodes: scene.node_count(), room };
        let storage =
            Storage::split(storage, model.element, [nodes, model.elements], &model.lattice, &model.renewal.bands)
                .ok_or_else(|| mismatch(nodes.min(state.capacity())))?;
        if model.is_for(scene) { Ok((model, storage)) } else { Err(mismatch(0)) }
    }
}

/// A step that is being computed, with its results.
pub(super) struct InertiaStep<'a, T> {
    pub(super) threads: &'a T,
    pub(super) step: &'a Step,
    pub(super) model: &'a mut LargeModel,
    pub(super) storage: Storage<'a>,
    held_back: HeldBack,
    rough: RoughMotion,
    /// Whether the table of rough motion is that of this step.
    rough_written: bool,
    coarse_share: f32,
    damping: f32,
    /// See [`LargeModel::owed`], after this step.
    owed: f32,
    /// The share of `S^-1` in this step, if the lattice is in use.
    pub(super) response: Option<f32>,
}

impl<'a, T> InertiaStep<'a, T> {
    pub(super) fn new(step: &'a Step, model: &'a mut LargeModel, storage: Storage<'a>, threads: &'a T) -> Self {
        Self {
            threads,
            step,
            model,
            storage,
            held_back: HeldBack::NONE,
            rough: RoughMotion::NONE,
            rough_written: false,
            coarse_share: 1.0,
            damping: 0.0,
            owed: 0.0,
            response: None,
        }
    }
}

impl<M: ElementMaterial, T: Threads> StepMethod<M> for InertiaStep<'_, T> {
    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed {
        self.renew_if_stale(trial);
        let TotalForces { forcing, volume, force, after, .. } = trial.forcing(ScalarBound, LOOK_CYCLE_OF_LONG);
        let (_, extremes) = forcing.in_parts(volume, force, &mut [], after, self.threads, |_, _, _: &mut [()]| ());
        let frames = &mut self.storage.matrices.frames;
        self.model.renewal.update_frames(frames, trial.displacement, trial.progress.steps);
        trial.add_pushes_before(self.step);
        pulls::add_pulls(trial, self.step, &self.storage.tables, (&self.model.lattice, self.storage.places));
        let moved = self.move_lattice(trial);
        let mut totals = self.move_nodes(trial, &moved);
        // Without instruments not even its stack is used.
        if trial.loads.contact().is_some() {
            self.meet_instruments(trial, &mut totals);
        }
        let Storage { tables, places, .. } = &self.storage;
        let next = |node| tables.next_increment.get(rank_of(places, node)).copied().unwrap_or_default().0;
        trial.add_work_of_given(&mut totals, next);
        pulls::add_work(trial, self.step, &self.model.lattice, &mut totals, next);
        Computed { totals, extremes }
    }

    fn next_increment(&self, node: usize, _: &NodeInertia, _: &NodeVector, _: &NodeVector) -> [f32; 4] {
        let Storage { tables, places, .. } = &self.storage;
        let [x, y, z, _] = tables.next_increment.get(rank_of(places, node)).copied().unwrap_or_default().0;
        [x, y, z, 0.0]
    }

    fn added_inertia(&self) -> f32 {
        self.model.renewal.added.mean
    }

    fn meets_instruments(&self, trial: &Trial<'_, M>) -> bool {
        trial.has_room_for_pushes()
    }

    fn refuse(&mut self) {
        self.storage.tables.take_back(self.rough_written);
    }

    fn advance(&mut self, trial: &mut Trial<'_, M>) {
        let model = &mut *self.model;
        model.rough = self.rough;
        let Trial { scene, displacement, remainder, increment, .. } = trial;
        let moving = Moving { displacement, remainder, increment };
        let Storage { tables, places, .. } = &self.storage;
        node_parts(scene, self.threads).apply_increments(places, tables.next_increment, moving);
    }

    #[inline(never)]
    fn finish(&mut self, trial: &mut Trial<'_, M>) -> bool {
        let Self { model, storage, held_back, coarse_share, .. } = self;
        let LargeModel { lattice, renewal, report, nodes, moment, loads, owed, calms, has_stepped, .. } = &mut **model;
        (*moment, *loads, *owed) = (trial.progress.moment(), trial.loads.mark(), self.owed);
        (*calms, *has_stepped) = (false, true);
        renewal.enter(storage.room.part, lattice, &storage.matrices.frames);
        *report = renewal.added.report(held_back.nodes, *coarse_share, self.damping);
        held_back.unused > LARGEST_UNUSED * *nodes as f32 || *coarse_share < LEAST_COARSE_SHARE
    }
}

fn node_parts<'a, M: ElementMaterial, T>(scene: &SceneView<'a, M>, threads: &'a T) -> NodeParts<'a, T> {
    NodeParts { partitions: scene.elements().partitions, threads }
}

/// What a step does with the lattice, apart from its motion.
struct MovedLattice {
    /// Whether rough motion of the nodes can be told from smooth motion.
    has_smooth: bool,
    /// Share of the rough motion that is removed.
    removed: f32,
    /// Work of the supports on the lattice, J.
    work: f32,
}

// Not inlined, like `finish`: the stack of one is free in the others.
impl<T: Threads> InertiaStep<'_, T> {
    /// Computes all inertia anew if another step has moved the state, or it was reset or restored, or if the length of
    /// steps was changed.
    #[inline(never)]
    fn renew_if_stale<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>) {
        let Self { model, threads, storage: Storage { tables, places, matrices, .. }, .. } = self;
        let LargeModel { lattice, renewal, scaling, rough, moment, owed, is_for_other_step, .. } = &mut **model;
        let Trial { scene, displacement, volume, progress, .. } = trial;
        let follows = *moment == progress.moment();
        if follows && !*is_for_other_step {
            return;
        }
        *is_for_other_step = false;
        write_volumes(*scene, displacement, volume, *threads);
        let input = RenewalInput { scene: *scene, displacement, volume, lattice, places, scaling };
        renewal.renew_all(input, tables, matrices, *threads);
        if !follows {
            (*rough, *owed) = (RoughMotion::NONE, 0.0);
            tables.clear_rough();
            *moment = progress.moment();
        }
    }

    /// Computes the motion of the lattice.
    #[inline(never)]
    fn move_lattice<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>) -> MovedLattice {
        let Self { step, model, threads, storage: Storage { tables, places, matrices, room }, .. } = self;
        let residual = ResidualFactors::new(step, model, trial.progress);
        let LargeModel { lattice, renewal, scaling, rough, method, calms, .. } = &mut **model;
        let others_pull = renewal.pulls.follow(trial.loads.pulls(), lattice, places);
        let Trial { scene, loads, displacement, increment, force, volume, progress, .. } = trial;
        let (scene, places) = (*scene, &**places);
        let input = PassInput { step, scaling, residual, inertia: scene.inertia, increment, places };
        let (cells, momentum) = (&mut *matrices.cells, &mut *matrices.smooth_cells);
        let largest = node_parts(&scene, *threads).restrict(input, force, cells, momentum);
        let CoarseRoom { motion, part, pull, scratch } = room;
        restrict(matrices.cells, lattice, motion);
        let stiffness = RenewalInput { scene, displacement, volume, lattice, places, scaling };
        renewal.renew_if_due(stiffness, others_pull, matrices, *threads);
        if !renewal.lattice_in_use {
            motion.fill(NodeVector::ZERO);
            part.fill(NodeVector::ZERO);
            prolong(motion, lattice, matrices.cells);
            self.coarse_share = 0.0;
            return MovedLattice { has_smooth: false, removed: 0.0, work: 0.0 };
        }
        let is_merged = renewal.is_merged;
        let supports = MovingSupports {
            input: ClusterInput { scene, lattice, places, is_merged },
            clusters: &matrices.clusters,
            tangents: matrices.of_clusters,
            displacement,
        };
        let pull = pull.each_mut().map(|vectors| &mut **vectors);
        let supports = supports.pull(loads, progress.time, step, increment, tables.scratch, pull);
        let has_part = write_part(matrices, lattice, &renewal.bands, largest, part);
        let carry = step.carry();
        let kept = if *calms { kept_share(carry) } else { 1.0 };
        if carry != 1.0 {
            part.iter_mut().for_each(|vector| vector.0 = (carry * Vec4::from(vector.0)).to_array());
        }
        let coarse = CoarseMotion {
            space: CoarseSpace { lattice, renewal, matrices },
            has_part,
            supports: supports.as_ref(),
            allowed: progress.energy_balance.allowed_share().min(kept),
            largest_strain: strain_share(renewal.added.mean)
                * if scene.element().is_nodal_strain() { LARGEST_STRAIN_OF_PATCHES } else { LARGEST_STRAIN },
        };
        let MotionResult { share, work } =
            coarse.compute(motion, part, scratch.each_mut().map(|vectors| &mut **vectors));
        let removed = removed_share(share.min(coarse.allowed));
        prolong(motion, lattice, matrices.cells);
        self.damping = rough.share(method.gain);
        (self.coarse_share, self.response) = (share, Some(share));
        MovedLattice {
            has_smooth: has_part,
            removed: carry * self.damping.max(removed),
            work: work / (step.seconds() * step.seconds()),
        }
    }

    /// Computes the next increments of the nodes.
    #[inline(never)]
    fn move_nodes<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>, moved: &MovedLattice) -> Totals {
        let Self { step, model, storage: Storage { tables, places, matrices, .. }, .. } = self;
        let residual = ResidualFactors::new(step, model, trial.progress);
        self.owed = residual.owed();
        let Trial { scene, increment, force, .. } = trial;
        let scaling = &model.scaling;
        let input = PassInput { step, scaling, residual, inertia: scene.inertia, increment, places };
        let smooth = moved.has_smooth.then_some(&*matrices.smooth_cells);
        let lattice =
            LatticeMotion { cells: matrices.cells, smooth, removed: moved.removed, own_share: model.renewal.own_share };
        self.rough_written = moved.has_smooth;
        let mut totals;
        PassTotals { totals, rough: self.rough, held_back: self.held_back } =
            node_parts(scene, self.threads).move_nodes(input, &lattice, force, tables);
        totals.add_work(moved.work);
        totals
    }
}

/// The share of the kinetic energy that strain rates keep in a step that is so many times as long as the last one. More inertia is
/// added, and momentum stays: of a velocity that `(h / D)^2` of the added inertia bore, that share is kept.
fn kept_share(carry: f32) -> f32 {
    let kept = if carry > MUCH_LONGER { 1.0 / (carry * carry) } else { 1.0 };
    kept * kept
}

/// Largest ratio of a vector of the smooth motion to the largest increment. It may exceed one, because lattice points
/// may lie outside the body.
const LARGEST_SMOOTH: f32 = 10.0;

/// Share of the largest strain of a step that adds so many masses, which grow with the square of its length.
fn strain_share(added: f32) -> f32 {
    libm::sqrtf(added / ADDED_AT_LARGEST_STRAIN).clamp(LEAST_STRAIN_SHARE, 1.0)
}

/// Writes the lattice's part `c = Mc^-1 W^T m du` of the increments. Turns the cells' sums of momentum into the smooth
/// part of the increments, of which `largest` is the largest component, `W` times that. To remove a share of the rest
/// changes no momentum of the lattice, so neither that of the body. Gives whether the result is plausible.
fn write_part(
    matrices: &mut Matrices<'_>,
    lattice: &Lattice,
    bands: &Bands,
    largest: f32,
    part: &mut CoarseVectors,
) -> bool {
    restrict(matrices.smooth_cells, lattice, part);
    matrices.divide_by_mass(&bands.scalars, part, lattice);
    let limit = Vec4::splat(LARGEST_SMOOTH * largest);
    if !part.iter().all(|vector| Vec4::from(vector.0).abs().cmple(limit).all()) {
        return false;
    }
    prolong(part, lattice, matrices.smooth_cells);
    true
}
