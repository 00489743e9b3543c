//! One mass-scaled, multilevel or damped step: forces with scalar bounds; the motion of every node by its own inertia,
//! and its contribution to the lattice; the lattice's motion; its addition to the nodes. After an accepted step, one
//! part of the refresh.

use glam::Vec4;

use crate::element::{ElementMaterial, NodeInertia, ScalarBound};
use crate::loads::Loads;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::{
    CallingThread, Computed, Forcing, Moving, Status, Step, StepMethod, Threads, Totals, Trial, nodal_volumes,
};

use super::cells::{prolong, restrict};
use super::coarse_motion::{CoarseMotion, CoarseSpace, MotionResult, removed_share};
use super::damper::RoughMotion;
use super::dense::{apply_by_axis, from_components, to_components};
use super::large_step::{LargeModel, LargeView, Storage};
use super::lattice::{CoarseVectors, Lattice, rank_of};
use super::matrices::{Matrices, of_axes};
use super::motion_pass::{LatticeMotion, PassTotals, RoughDamping, rotation_table};
use super::node::half_damping;
use super::parts::NodeParts;
use super::pass_input::{PassInput, ResidualFactors};
use super::refresh::RefreshInput;
use super::report::HeldBack;
use super::supports::MovingSupports;
use super::{COARSE_GROWTH, LARGEST_STRAIN, LARGEST_STRAIN_OF_PATCHES, NODE_GROWTH};

/// A step is [`Status::Limited`] if more than this share of the inverse inertia of all nodes is not used, or less than
/// this share of the lattice's motion is used.
const LARGEST_UNUSED: f32 = 0.05;
const LEAST_COARSE_SHARE: f32 = 0.8;

impl LargeView<'_, '_> {
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

impl<'a, 'w> LargeView<'a, 'w> {
    /// The model and the parts of its storage, if they are for this scene.
    pub(super) fn opened<M>(
        self,
        scene: SceneView<'_, M>,
        state: &StateView<'_>,
    ) -> Result<(&'a mut LargeModel<'w>, Storage<'a>), Status> {
        let Self { model, storage } = self;
        let nodes = model.nodes;
        let mismatch = |room| Status::Mismatch { nodes: scene.node_count(), room };
        let damped = model.method.damper().is_some();
        let storage = Storage::split(storage, model.element, [nodes, model.elements], &model.lattice, damped)
            .ok_or_else(|| mismatch(nodes.min(state.capacity())))?;
        if model.is_for(scene) { Ok((model, storage)) } else { Err(mismatch(0)) }
    }
}

/// A step that is being computed, with its results.
pub(super) struct InertiaStep<'a, 'w, T> {
    pub(super) threads: &'a T,
    pub(super) step: &'a Step,
    pub(super) model: &'a mut LargeModel<'w>,
    pub(super) storage: Storage<'a>,
    held_back: HeldBack,
    rough: RoughMotion,
    /// Whether the table of rough motion is that of this step.
    rough_written: bool,
    coarse_share: f32,
    damping: f32,
    /// Change of the lattice's shape by the last increment.
    change: f32,
    /// The shares of `S^-1` and `G^-1` in this step, if the lattice is in use.
    pub(super) response: Option<[f32; 2]>,
}

impl<'a, 'w, T> InertiaStep<'a, 'w, T> {
    pub(super) fn new(step: &'a Step, model: &'a mut LargeModel<'w>, storage: Storage<'a>, threads: &'a T) -> Self {
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
            change: 0.0,
            response: None,
        }
    }
}

impl<M: ElementMaterial, T: Threads> StepMethod<M> for InertiaStep<'_, '_, T> {
    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed {
        self.renew_if_stale(trial);
        let Trial { scene, loads, displacement, remainder, is_heated, force, volume, progress, .. } = &mut *trial;
        let forcing = Forcing {
            scene: *scene,
            visitor: ScalarBound,
            displacement,
            remainder,
            is_heated: *is_heated,
            loads,
            progress,
            look_cycle: 1,
        };
        let (_, extremes) = forcing.in_parts(volume, force, &mut [], self.threads, |_, _, _: &mut [()]| ());
        self.model.refresh.update_frames(displacement, progress.steps);
        trial.add_pushes_before(self.step);
        let moved = self.move_lattice(trial);
        let mut totals = self.move_nodes(trial, moved);
        // Without instruments not even its stack is used.
        if trial.loads.contact().is_some() {
            self.meet_instruments(trial, &mut totals);
        }
        let Storage { tables, places, .. } = &self.storage;
        trial.add_work_of_given(&mut totals, |node| {
            tables.next_increment.get(rank_of(places, node)).copied().unwrap_or_default().0
        });
        Computed { totals, extremes }
    }

    fn next_increment(&self, node: usize, _: &NodeInertia, _: &NodeVector, _: &NodeVector) -> [f32; 4] {
        let Storage { tables, places, .. } = &self.storage;
        let [x, y, z, _] = tables.next_increment.get(rank_of(places, node)).copied().unwrap_or_default().0;
        [x, y, z, 0.0]
    }

    fn added_inertia(&self) -> f32 {
        self.model.refresh.added.mean()
    }

    fn meets_instruments(&self, trial: &Trial<'_, M>) -> bool {
        // In mass-scaled steps an instrument would push inertia that is not there.
        self.model.lattice.functions() > 0 && trial.has_room_for_pushes()
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
        let Self { model, storage: Storage { tables, places, order, matrices }, held_back, coarse_share, .. } = self;
        let LargeModel { lattice, refresh, scaling, report, nodes, least_share, moment, .. } = &mut **model;
        *least_share = held_back.least;
        let Trial { scene, displacement, increment, volume, progress, .. } = trial;
        *moment = progress.moment();
        let input = RefreshInput { scene: *scene, displacement, volume, increment, lattice, places, order, scaling };
        refresh.advance(progress.steps, self.change, input, tables, matrices);
        *report = refresh.added.report(held_back.nodes, *coarse_share);
        report.damping = self.damping;
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
impl<T: Threads> InertiaStep<'_, '_, T> {
    /// Computes all inertia anew if another step has moved the state, or it was reset or restored, or if the length of
    /// steps was changed.
    #[inline(never)]
    fn renew_if_stale<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>) {
        let Self { model, storage: Storage { tables, places, order, matrices }, .. } = self;
        let LargeModel { lattice, refresh, scaling, rough, least_share, moment, is_for_other_step, .. } = &mut **model;
        let Trial { scene, displacement, increment, volume, progress, .. } = trial;
        let follows = *moment == progress.moment();
        if follows && !*is_for_other_step {
            return;
        }
        *is_for_other_step = false;
        nodal_volumes(*scene, displacement, &[], volume, &CallingThread);
        let input = RefreshInput { scene: *scene, displacement, volume, increment, lattice, places, order, scaling };
        if follows {
            refresh.restart(input, tables, matrices);
            return;
        }
        refresh.renew(input, tables, matrices);
        (*rough, *least_share) = (RoughMotion::NONE, 1.0);
        tables.rough.fill(NodeVector::ZERO);
        *moment = progress.moment();
    }

    /// Computes the motion of the lattice. None without one.
    #[inline(never)]
    fn move_lattice<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>) -> Option<MovedLattice> {
        let Self { step, model, storage: Storage { tables, places, order, matrices }, .. } = self;
        if model.lattice.functions() == 0 {
            return None;
        }
        let residual = ResidualFactors::new(step, model, trial.progress);
        let LargeModel { lattice, refresh, scaling, rough, method, moved_elements, least_share, .. } = &mut **model;
        let Trial { scene, loads, displacement, increment, force, volume, progress, .. } = trial;
        let supports = MovingSupports {
            scene: *scene,
            lattice,
            places,
            elements: order.get(..*moved_elements).unwrap_or_default(),
            weight: scaling.coarse_weight,
            displacement,
            volume,
        };
        let supports = supports.pull(loads, progress.time, step, increment, tables.next_increment);
        let input = PassInput { step, scaling, residual, inertia: scene.inertia, increment, places };
        let (cells, momentum) = (&mut *matrices.cells, &mut *matrices.smooth_cells);
        let extremes = node_parts(scene, self.threads).restrict(input, force, tables.inverse_diagonal, cells, momentum);
        let growth = 1.0 / extremes.inverse_growth;
        let share = if growth > COARSE_GROWTH { COARSE_GROWTH / growth } else { 1.0 };
        let smooth = smooth_motion(matrices, lattice, extremes.increment).filter(|_| refresh.lattice_in_use);
        let motion = CoarseMotion {
            space: CoarseSpace { lattice, refresh },
            second_order: method.damper().is_some(),
            k: scaling.k,
            least_share: least_share.min(NODE_GROWTH / growth),
            smooth: smooth.as_ref(),
            supports: supports.as_ref(),
            allowed: progress.energy_balance.allowed_share(),
            largest_strain: if scene.element().is_nodal_strain() { LARGEST_STRAIN_OF_PATCHES } else { LARGEST_STRAIN },
        };
        let MotionResult { share, change, work } = motion.compute(matrices, share);
        // Without a lattice in use there is no distinction of smooth and rough motion.
        let damper = method.damper().filter(|_| refresh.lattice_in_use);
        self.damping = damper.map_or(0.0, |damper| step.carry() * damper.share(rough, half_damping(step)));
        // Where bounds have grown beyond their margin they are out of date whatever the lattice does.
        self.change = if growth <= COARSE_GROWTH { change } else { f32::INFINITY };
        self.response = refresh.lattice_in_use.then_some([share, motion.least_share]);
        self.coarse_share = if refresh.lattice_in_use { share } else { 0.0 };
        Some(MovedLattice {
            has_smooth: smooth.is_some(),
            removed: self.damping.max(removed_share(share.min(motion.allowed))),
            work: work / (step.seconds() * step.seconds()),
        })
    }

    /// Computes the next increments of the nodes.
    #[inline(never)]
    fn move_nodes<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>, moved: Option<MovedLattice>) -> Totals {
        let Self { step, model, storage: Storage { tables, places, matrices, .. }, .. } = self;
        let LargeModel { refresh, scaling, method, .. } = &**model;
        let residual = ResidualFactors::new(step, model, trial.progress);
        let Trial { scene, increment, force, .. } = trial;
        let input = PassInput { step, scaling, residual, inertia: scene.inertia, increment, places };
        let lattice = moved.as_ref().map(|moved| LatticeMotion {
            cells: matrices.cells,
            fine: matrices.fine_cells,
            damped: (moved.has_smooth && (method.damper().is_some() || moved.removed > 0.0))
                .then_some(RoughDamping { smooth: matrices.smooth_cells, share: moved.removed }),
            in_use: moved.has_smooth,
        });
        self.rough_written = lattice.as_ref().is_some_and(|lattice| lattice.damped.is_some());
        let rotations = &rotation_table(&refresh.frames.of_bounds, refresh.frames.functions());
        let parts = node_parts(scene, self.threads);
        let passed = parts.move_nodes(input, rotations, lattice.as_ref(), force, tables);
        let mut totals;
        PassTotals { totals, rough: self.rough, held_back: self.held_back } = passed;
        totals.add_work(moved.map_or(0.0, |moved| moved.work));
        totals
    }
}

/// Largest ratio of a vector of the smooth motion to the largest increment. It may exceed one, because lattice points
/// may lie outside the body.
const LARGEST_SMOOTH: f32 = 10.0;

/// The lattice's part `c = Mc^-1 W^T m du` of the increments. Turns the cells' sums of momentum into the smooth part of
/// the increments, of which `largest` is the largest component, `W` times that. To remove a share of the rest changes
/// no momentum of the lattice, so neither that of the body. None if the result is not plausible.
fn smooth_motion(matrices: &mut Matrices<'_>, lattice: &Lattice, largest: f32) -> Option<CoarseVectors> {
    let mut motion = restrict(matrices.smooth_cells, lattice);
    let mut components = to_components(&motion);
    apply_by_axis(of_axes(matrices.mass_inverse), lattice.functions(), &mut components);
    from_components(&components, &mut motion);
    let limit = Vec4::splat(LARGEST_SMOOTH * largest);
    if !motion.iter().all(|vector| Vec4::from(vector.0).abs().cmple(limit).all()) {
        return None;
    }
    prolong(&motion, lattice, matrices.smooth_cells);
    Some(motion)
}
