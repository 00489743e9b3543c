//! One mass-scaled, multilevel or damped step: forces with scalar bounds; the motion of every node by its own inertia,
//! and its contribution to the lattice; the lattice's motion; its addition to the nodes. After an accepted step, one
//! part of the refresh.

use glam::Vec4;

use crate::element::{ElementLaw, ElementMaterial, InternalForces, NodeInertia, ScalarBound};
use crate::loads::Loads;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::{Computed, Status, Step, StepMethod, Trial, external_forces};

use super::cells::{CellPolynomial, prolong, restrict};
use super::damper::RoughMotion;
use super::dense::{Row, apply, stride};
use super::estimate::{DefectTotals, dot};
use super::frames::{Rotation, rotate};
use super::large_step::{LargeModel, LargeView, Storage};
use super::lattice::{Lattice, MAX_FUNCTIONS};
use super::matrices::{DampedMatrices, Matrices, thirds};
use super::passes::{
    ApplyIncrements, CorrectionPass, FinePass, PassInput, RoughDamping, UncoupledPass, rotation_table,
};
use super::refresh::{Refresh, RefreshInput, from_components, to_components};
use super::report::HeldBack;
use super::{COARSE_GROWTH, LARGEST_MOVE};

/// A step is [`Status::Limited`] if more than this share of the inverse inertia of all nodes is not used, or less than
/// this share of the lattice's motion is used.
const LARGEST_UNUSED: f32 = 0.05;
const LEAST_COARSE_SHARE: f32 = 0.5;

impl LargeView<'_, '_> {
    /// See [`super::LargeStep::step`].
    pub fn step<M: ElementMaterial>(
        self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
    ) -> Status {
        let Self { model, storage } = self;
        let nodes = model.nodes;
        let mismatch = Status::Mismatch { nodes: scene.node_count(), room: nodes.min(state.capacity()) };
        let damped = model.method.damper().is_some();
        let Some(storage) = Storage::split(storage, nodes, &model.lattice, damped) else {
            return mismatch;
        };
        if nodes != scene.node_count() {
            return mismatch;
        }
        let step = model.step.carried_from(state.dt);
        match Trial::begin(scene, loads, state, nodes) {
            Ok(trial) => trial.take(&step, &mut InertiaStep::new(&step, model, storage)),
            Err(refused) => refused,
        }
    }
}

/// A step that is being computed, with its results.
struct InertiaStep<'a, 'w> {
    step: &'a Step,
    model: &'a mut LargeModel<'w>,
    storage: Storage<'a>,
    /// Displacement times external force, J.
    external: f32,
    held_back: HeldBack,
    defects: DefectTotals,
    rough: RoughMotion,
    coarse_share: f32,
    damping: f32,
}

impl<'a, 'w> InertiaStep<'a, 'w> {
    fn new(step: &'a Step, model: &'a mut LargeModel<'w>, storage: Storage<'a>) -> Self {
        Self {
            step,
            model,
            storage,
            external: 0.0,
            held_back: HeldBack::NONE,
            defects: DefectTotals::default(),
            rough: RoughMotion::NONE,
            coarse_share: 1.0,
            damping: 0.0,
        }
    }
}

impl<M: ElementMaterial> StepMethod<M> for InertiaStep<'_, '_> {
    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed {
        let Self { step, model, storage: Storage { tables, places, matrices }, .. } = self;
        let LargeModel { lattice, refresh, scaling, rough, method, .. } = &mut **model;
        let Trial { scene, loads, displacement, increment, force, progress } = trial;
        let (inertia, force): (_, &mut [NodeVector]) = (scene.inertia, force);
        external_forces(force, 0, inertia, loads, progress.time);
        self.external = dot(force, displacement);
        let has_lattice = lattice.functions() > 0;
        let extremes = M::Law::forces_and_bounds(InternalForces::of_all(
            scene.elements(),
            displacement,
            force,
            ScalarBound,
        ));

        // Without a lattice there is no distinction of smooth and rough motion.
        let damper = method.damper().filter(|_| refresh.lattice_in_use && has_lattice);
        self.damping = damper.map_or(0.0, |damper| step.carry() * damper.share(rough, scaling.k));
        refresh.update_frames(displacement, progress.steps);
        let rotations = &rotation_table(&refresh.frames.of_bounds, refresh.frames.functions());
        let input = PassInput { step, scaling, inertia, displacement, increment, places };
        let velocity_scale = refresh.velocity_scale;
        let totals;
        if has_lattice {
            let cells = &mut *matrices.cells;
            let momentum = matrices.damped.as_mut().map(|damped| &mut *damped.momentum);
            let growth;
            (self.held_back, growth) =
                FinePass { input, velocity_scale, rotations, force, tables, cells, momentum }.dispatched();
            let allowed = if growth > COARSE_GROWTH { COARSE_GROWTH / growth } else { 1.0 };
            self.coarse_share = coarse_motion(matrices, lattice, allowed, refresh);
            let cells = &*matrices.cells;
            let damped = matrices.damped.as_mut().filter(|_| refresh.lattice_in_use);
            let smooth = damped.and_then(|damped| smooth_motion(damped, lattice, increment));
            let damped = smooth.map(|smooth| RoughDamping { smooth, share: self.damping });
            (totals, self.defects, self.rough) =
                CorrectionPass { input, cells, damped, force, tables }.dispatched();
        } else {
            (self.held_back, totals, self.defects) =
                UncoupledPass { input, velocity_scale, rotations, force, tables }.dispatched();
        }
        Computed { totals, extremes }
    }

    fn next_increment(&self, node: usize, _: &NodeInertia, _: &NodeVector, _: &NodeVector) -> [f32; 4] {
        let [x, y, z, _] = self.storage.tables.next_increment.get(node).copied().unwrap_or_default().0;
        [x, y, z, 0.0]
    }

    fn advance(&mut self, trial: &mut Trial<'_, M>) {
        let (step, model) = (self.step, &mut *self.model);
        let square = step.seconds() * step.seconds();
        model.rough = self.rough;
        model.estimate.advance(&self.defects, self.external, model.nodes, model.scaling.k, square);
        let Trial { displacement, increment, .. } = trial;
        ApplyIncrements { next: self.storage.tables.next_increment, displacement, increment }.dispatched();
    }

    fn finish(&mut self, trial: &mut Trial<'_, M>) -> bool {
        let Self { model, storage: Storage { tables, places, matrices }, held_back, coarse_share, .. } = self;
        let LargeModel { lattice, refresh, scaling, estimate, report, nodes, .. } = &mut **model;
        refresh.correction = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
        refresh.set_share(*coarse_share);
        let Trial { scene, displacement, increment, progress, .. } = trial;
        let input = RefreshInput { scene: *scene, displacement, increment, lattice, places, scaling };
        refresh.advance(progress.steps, input, tables, matrices);
        *report = refresh.added.report(held_back.nodes, *coarse_share, estimate.error());
        report.damping = self.damping;
        held_back.unused > LARGEST_UNUSED * *nodes as f32 || *coarse_share < LEAST_COARSE_SHARE
    }
}

/// Largest ratio of a vector of the smooth motion to the largest increment. It may exceed one, because lattice points
/// may lie outside the body.
const LARGEST_SMOOTH: f32 = 10.0;

/// Turns the cells' sums of momentum into the smooth part of the increments, `W G^-1 W^T M du`. None if the result is
/// implausible: `G` is up to a cycle old, and `M` may have changed much since, where an element was crushed.
fn smooth_motion<'a>(
    damped: &'a mut DampedMatrices<'_>,
    lattice: &Lattice,
    increment: &[NodeVector],
) -> Option<&'a [CellPolynomial]> {
    let functions = lattice.functions();
    let momentum = restrict(damped.momentum, lattice);
    let mut smooth = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    let rows = damped.mean_inverse.chunks_exact(stride(thirds(functions)).max(1));
    for (smooth, row) in smooth.iter_mut().zip(rows).take(functions) {
        let products = row.iter().zip(&momentum).take(functions);
        let sum: Vec4 = products.map(|(entry, momentum)| *entry * Vec4::from(momentum.0)).sum();
        smooth.0 = sum.to_array();
    }
    let largest = increment.iter().fold(Vec4::ZERO, |most, du| most.max(Vec4::from(du.0).abs()));
    let limit = Vec4::splat(LARGEST_SMOOTH * largest.max_element());
    if !smooth.iter().all(|vector| Vec4::from(vector.0).abs().cmple(limit).all()) {
        return None;
    }
    prolong(&smooth, lattice, damped.momentum);
    Some(damped.momentum)
}

/// Turns the cells' sums of the residual `r` into the lattice's motion: `share (S^-1 - G^-1) W^T r` minus the
/// correction after a change of `S`. Reduces the share if the forces of one step would strain a cell by more than
/// [`LARGEST_MOVE`], and returns it. A damped step uses the second-order operator instead of `S^-1` (`damper.rs`).
fn coarse_motion(matrices: &mut Matrices<'_>, lattice: &Lattice, mut share: f32, refresh: &Refresh) -> f32 {
    let functions = lattice.functions();
    let (size, stride) = (3 * functions, stride(functions));
    let mut restricted = restrict(matrices.cells, lattice);
    rotate(&mut restricted, &refresh.frames.of_bounds, Rotation::in_frame);
    let forces = to_components(&restricted);
    let times = |matrix: &[f32], row: &Row| apply(matrix, stride, row.get(..size).unwrap_or_default());
    let mut moved = times(matrices.applied, &forces);
    if let Some(damped) = matrices.damped.as_mut().filter(|_| refresh.lattice_in_use) {
        // `A S^-1 g` as `g - M S^-1 g`: where elements are crushed `A` is so large that products with it overflow.
        let first = times(damped.inverse, &forces);
        let mut absorbed = forces;
        for (absorbed, passed) in absorbed.iter_mut().zip(times(damped.mass, &first)) {
            *absorbed -= passed;
        }
        let second = times(damped.inverse, &absorbed);
        for (moved, more) in moved.iter_mut().zip(times(damped.inverse, &times(damped.mass, &second))) {
            *moved += more;
        }
    }
    let mut solution = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    from_components(moved.get(..size).unwrap_or_default(), &mut solution);
    rotate(&mut solution, &refresh.frames.of_bounds, Rotation::in_world);
    let strain = lattice.largest_strain(&solution);
    if share * strain > LARGEST_MOVE {
        share = LARGEST_MOVE / strain;
    }
    for (solution, correction) in solution.iter_mut().zip(&refresh.correction) {
        for (value, correction) in solution.0.iter_mut().zip(correction.0) {
            *value = share * *value - correction;
        }
    }
    prolong(&solution, lattice, matrices.cells);
    share
}
