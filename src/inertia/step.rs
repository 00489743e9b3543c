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
    CallingThread, Computed, Forcing, Status, Step, StepMethod, Threads, Totals, Trial, nodal_volumes,
};

use super::cells::{prolong, restrict};
use super::damper::RoughMotion;
use super::dense::{Row, apply, apply_by_axis, apply_to_two, from_components, stride, to_components};
use super::frames::{Rotation, rotate};
use super::large_step::{LargeModel, LargeView, Storage};
use super::lattice::{CoarseVectors, Lattice, MAX_FUNCTIONS, rank_of};
use super::matrices::{Matrices, of_axes};
use super::motion_pass::{LatticeMotion, PassTotals, RoughDamping, rotation_table};
use super::nodal_sums;
use super::node::{Scaling, half_damping};
use super::parts::NodeParts;
use super::pass_input::{PassInput, ResidualFactors};
use super::refresh::{Refresh, RefreshInput};
use super::report::HeldBack;
use super::supports::{MovingSupports, Pull};
use super::transport::turned_part;
use super::{COARSE_GROWTH, LARGEST_STRAIN, LARGEST_STRAIN_OF_PATCHES, NODE_GROWTH};

/// A step is [`Status::Limited`] if more than this share of the inverse inertia of all nodes is not used, or less than
/// this share of the lattice's motion is used.
const LARGEST_UNUSED: f32 = 0.05;
const LEAST_COARSE_SHARE: f32 = 0.8;

impl LargeView<'_, '_> {
    /// See [`super::LargeStep::step`].
    pub fn step<M: ElementMaterial>(
        self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
    ) -> Status {
        self.step_in_parts(scene, loads, state, &CallingThread)
    }

    /// The same step, to the bit, on several threads of the host: the work on elements and nodes, not the inversions and the
    /// assembly of a cycle.
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
    threads: &'a T,
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
    pub(super) fn new(
        step: &'a Step,
        model: &'a mut LargeModel<'w>,
        storage: Storage<'a>,
        threads: &'a T,
    ) -> Self {
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
        let Trial { scene, loads, displacement, force, volume, progress, .. } = &mut *trial;
        let forcing = Forcing { scene: *scene, visitor: ScalarBound, displacement, loads, progress };
        let (_, extremes) = forcing.in_parts(volume, force, &mut [], self.threads, |_, _, _: &mut [()]| ());
        self.model.refresh.update_frames(displacement, progress.steps);
        trial.add_pushes_before();
        let moved = self.move_lattice(trial);
        let mut totals = self.move_nodes(trial, moved);
        // Without instruments not even its stack is used.
        if trial.loads.contact().is_some() {
            self.meet_instruments(trial, &mut totals);
        }
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
        trial.has_room_for_pushes()
    }

    fn refuse(&mut self) {
        self.storage.tables.take_back(self.rough_written);
    }

    fn advance(&mut self, trial: &mut Trial<'_, M>) {
        let model = &mut *self.model;
        model.rough = self.rough;
        let Trial { scene, displacement, increment, .. } = trial;
        let Storage { tables, places, .. } = &self.storage;
        node_parts(scene, self.threads).apply_increments(
            places,
            tables.next_increment,
            displacement,
            increment,
        );
    }

    #[inline(never)]
    fn finish(&mut self, trial: &mut Trial<'_, M>) -> bool {
        let Self {
            model, storage: Storage { tables, places, order, matrices }, held_back, coarse_share, ..
        } = self;
        let LargeModel { lattice, refresh, scaling, report, nodes, least_share, moment, .. } = &mut **model;
        *least_share = held_back.least;
        let Trial { scene, displacement, increment, volume, progress, .. } = trial;
        *moment = progress.moment();
        let input =
            RefreshInput { scene: *scene, displacement, volume, increment, lattice, places, order, scaling };
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
    /// Computes all inertia anew if another step has moved the state, or it was reset or restored, or if the length of steps was changed.
    #[inline(never)]
    fn renew_if_stale<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>) {
        let Self { model, storage: Storage { tables, places, order, matrices }, .. } = self;
        let LargeModel { lattice, refresh, scaling, rough, least_share, moment, is_for_other_step, .. } =
            &mut **model;
        let Trial { scene, displacement, increment, volume, progress, .. } = trial;
        let follows = *moment == progress.moment();
        if follows && !*is_for_other_step {
            return;
        }
        *is_for_other_step = false;
        nodal_volumes(*scene, displacement, volume, &CallingThread);
        let input =
            RefreshInput { scene: *scene, displacement, volume, increment, lattice, places, order, scaling };
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
        let LargeModel { lattice, refresh, scaling, rough, method, moved_elements, least_share, .. } =
            &mut **model;
        if lattice.functions() == 0 {
            return None;
        }
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
        let residual = ResidualFactors::new(step, scaling, progress.steps == 0);
        let input = PassInput { step, scaling, residual, inertia: scene.inertia, increment, places };
        let (cells, momentum) = (&mut *matrices.cells, &mut *matrices.smooth_cells);
        let extremes =
            node_parts(scene, self.threads).restrict(input, force, tables.inverse_diagonal, cells, momentum);
        let growth = 1.0 / extremes.inverse_growth;
        let share = if growth > COARSE_GROWTH { COARSE_GROWTH / growth } else { 1.0 };
        let smooth = smooth_motion(matrices, lattice, extremes.increment).filter(|_| refresh.lattice_in_use);
        let motion = CoarseMotion {
            lattice,
            refresh,
            second_order: method.damper().is_some(),
            k: scaling.k,
            least_share: least_share.min(NODE_GROWTH / growth),
            smooth: smooth.as_ref(),
            supports: supports.as_ref(),
            allowed: progress.energy_balance.allowed_share(),
            largest_strain: if M::ELEMENT.is_nodal_strain() {
                LARGEST_STRAIN_OF_PATCHES
            } else {
                LARGEST_STRAIN
            },
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
    fn move_nodes<M: ElementMaterial>(
        &mut self,
        trial: &mut Trial<'_, M>,
        moved: Option<MovedLattice>,
    ) -> Totals {
        let Self { step, model, storage: Storage { tables, places, matrices, .. }, .. } = self;
        let LargeModel { refresh, scaling, method, .. } = &**model;
        let Trial { scene, increment, force, progress, .. } = trial;
        let residual = ResidualFactors::new(step, scaling, progress.steps == 0);
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

/// The lattice's part `c = Mc^-1 W^T m du` of the increments. Turns the cells' sums of momentum into the smooth part of the
/// increments, of which `largest` is the largest component, `W` times that. To remove a share of the rest changes no momentum of the
/// lattice, so neither that of the body. None if the result is not plausible.
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

/// Share of the strain rates that a step removes where only this share of the lattice's motion is used. There inertia is
/// about to grow by the inverse of the share; what is left has no more energy with the new inertia than it had before.
fn removed_share(share: f32) -> f32 {
    1.0 - libm::sqrtf(share)
}

/// Scalar product of two motions of the lattice.
fn inner(a: &CoarseVectors, b: &CoarseVectors) -> f32 {
    a.iter().zip(b).map(|(a, b)| Vec4::from(a.0).dot(Vec4::from(b.0))).sum()
}

/// The motion of the lattice in a step.
pub(super) struct CoarseMotion<'a> {
    pub(super) lattice: &'a Lattice,
    refresh: &'a Refresh,
    /// A damped step uses the second-order operator instead of `S^-1` (`damper.rs`).
    second_order: bool,
    /// `mu D / 2`.
    k: f32,
    /// The least share of a node: with it the operator is positive whatever the shares of the others are.
    least_share: f32,
    /// The lattice's part of the last increment.
    smooth: Option<&'a CoarseVectors>,
    /// Supports whose speed changes (`supports.rs`).
    supports: Option<&'a Pull>,
    /// The share of the kinetic energy that can have come from the loads.
    allowed: f32,
    /// Largest strain of a cell by which the forces of the step may move it from rest.
    largest_strain: f32,
}

/// How the lattice moves.
struct MotionResult {
    /// Share of the motion that is used.
    share: f32,
    /// By how much the step changes the lattice's shape.
    change: f32,
    /// Work of the supports on the lattice, times `D^2`: kg m^2.
    work: f32,
}

impl<'a> CoarseMotion<'a> {
    /// For the response to forces only.
    pub(super) const fn responding(
        lattice: &'a Lattice,
        refresh: &'a Refresh,
        scaling: &Scaling,
        least_share: f32,
    ) -> Self {
        let (smooth, supports, k) = (None, None, scaling.k);
        let (second_order, allowed, largest_strain) = (false, 1.0, LARGEST_STRAIN);
        Self { lattice, refresh, second_order, k, least_share, smooth, supports, allowed, largest_strain }
    }

    /// `share S^-1 g - least G^-1 g`.
    pub(super) fn response(
        &self,
        matrices: &Matrices<'_>,
        residual: &CoarseVectors,
        share: f32,
    ) -> CoarseVectors {
        let (forces, mut answer) = (self.in_frames(residual), [0.0; _]);
        self.times(matrices.coarse_inverse, &forces, &mut answer);
        let mut moved = self.in_world(&answer);
        for (moved, fine) in moved.iter_mut().zip(&self.fine(matrices, &forces)) {
            moved.0 = (share * Vec4::from(moved.0) - self.least_share * Vec4::from(fine.0)).to_array();
        }
        moved
    }
}

impl CoarseMotion<'_> {
    /// Turns the cells' sums of the residual `r` into the lattice's motion and what the nodes' own inertia would give to
    /// it, `G^-1 g` with `g = W^T r`. The motion is
    ///
    /// ```text
    /// share S^-1 (g - M w) + p + w - (removed T + drag T^2) c - least G^-1 g     M = (1 + k) Mc,  T = S^-1 A = 1 - S^-1 M
    /// ```
    /// with the rotation `w` of the velocities (`transport.rs`), and `p = -S^-1 A_s d` from the supports. Reduces the share
    /// if the forces of one step would strain a cell by more than `largest_strain`.
    fn compute(&self, matrices: &mut Matrices<'_>, mut share: f32) -> MotionResult {
        let Self { lattice, refresh, .. } = *self;
        let mut forces = self.forces(matrices);
        let fine = self.fine(matrices, &forces);
        let mut given = self.turned(matrices);
        let mut last = self.smooth.map_or([0.0; _], |smooth| self.in_frames(smooth));
        self.subtract_momentum(matrices, &mut forces, &given);
        let pulled = self.supports.map(|pull| self.add_pulled(matrices, pull, share, &mut given));
        let mut answer = [0.0; _];
        self.first_order(matrices, &forces, &mut answer, &mut last);
        let strained = self.in_world(&last);
        let twice = self.strained_twice(matrices, &mut last);
        if self.second_order {
            self.add_second_order(matrices, &mut forces, &mut answer);
        }
        let mut solution = self.in_world(&answer);
        let strain = lattice.largest_strain(&solution, refresh.frames.since_rest());
        if share * strain > self.largest_strain {
            share = self.largest_strain / strain;
        }
        let (removed, drag) = (removed_share(share.min(self.allowed)), refresh.drag());
        for (((solution, given), (strained, twice)), fine) in
            solution.iter_mut().zip(&given).zip(strained.iter().zip(&twice)).zip(&fine)
        {
            let [answer, given, strained, twice, fine] =
                [*solution, *given, *strained, *twice, *fine].map(|vector| Vec4::from(vector.0));
            let lost = removed * strained + drag * twice;
            solution.0 = (share * answer + given - lost - self.least_share * fine).to_array();
        }
        prolong(&solution, lattice, matrices.cells);
        prolong(&fine, lattice, matrices.fine_cells);
        for (next, last) in solution.iter_mut().zip(self.smooth.into_iter().flatten()) {
            next.0 = (Vec4::from(next.0) + Vec4::from(last.0)).to_array();
        }
        let strain = lattice.largest_strain(&solution, refresh.frames.since_rest());
        let change = strain + lattice.largest_bending(&refresh.frames);
        let work = match (self.supports, pulled) {
            (Some(pull), Some(share)) => self.work(pull, share, &solution),
            _ => 0.0,
        };
        MotionResult { share, change, work }
    }

    // The parts of the above are not inlined: the stack of one is free in the others.

    /// `g` in the frames.
    #[inline(never)]
    fn forces(&self, matrices: &Matrices<'_>) -> Row {
        self.in_frames(&restrict(matrices.cells, self.lattice))
    }

    /// `w`; zero without `c`.
    #[inline(never)]
    fn turned(&self, matrices: &Matrices<'_>) -> CoarseVectors {
        let Self { lattice, refresh, .. } = *self;
        match self.smooth {
            Some(smooth) => turned_part(smooth, lattice, &refresh.frames, matrices.edge_inverse),
            None => [NodeVector::ZERO; _],
        }
    }

    /// Subtracts `M w` from `g`.
    #[inline(never)]
    fn subtract_momentum(&self, matrices: &Matrices<'_>, forces: &mut Row, turned: &CoarseVectors) {
        let mut momentum = self.in_frames(turned);
        self.times_mass(matrices, &mut momentum);
        self.subtract(forces, &momentum);
    }

    /// Adds `p`, as far as bounds have not grown beyond their margin. Gives its share of `-S^-1 A_s d`.
    #[inline(never)]
    fn add_pulled(
        &self,
        matrices: &Matrices<'_>,
        pull: &Pull,
        mut share: f32,
        motion: &mut CoarseVectors,
    ) -> f32 {
        let mut answer = [0.0; _];
        self.times(matrices.coarse_inverse, &self.in_frames(&pull.residual), &mut answer);
        let answer = self.in_world(&answer);
        let energy = inner(&pull.residual, &answer);
        if energy > pull.energy {
            share = share.min(pull.energy / energy);
        }
        for (vector, answer) in motion.iter_mut().zip(&answer) {
            vector.0 = (Vec4::from(vector.0) + share * Vec4::from(answer.0)).to_array();
        }
        share
    }

    /// Work of this share of the supports' residual on the lattice, times `D^2`, from the lattice's part of the next
    /// increments.
    #[inline(never)]
    fn work(&self, pull: &Pull, share: f32, next: &CoarseVectors) -> f32 {
        let last = self.smooth.map_or(0.0, |smooth| inner(&pull.residual, smooth));
        0.5 * share * (inner(&pull.residual, next) + last)
    }

    /// Writes `S^-1 g`, and makes `T c` of `c`.
    #[inline(never)]
    fn first_order(&self, matrices: &Matrices<'_>, forces: &Row, answer: &mut Row, last: &mut Row) {
        let (mut momentum, mut kept) = (*last, [0.0; _]);
        self.times_mass(matrices, &mut momentum);
        let (stride, rows) =
            (stride(self.lattice.functions()), [forces, &momentum].map(|row| self.used(row)));
        apply_to_two(matrices.coarse_inverse, stride, rows, [answer, &mut kept]);
        self.subtract(last, &kept);
    }

    /// `T^2 c` in the world from `T c`, of which it makes `T^2 c` in the frames.
    #[inline(never)]
    fn strained_twice(&self, matrices: &Matrices<'_>, strained: &mut Row) -> CoarseVectors {
        let (mut momentum, mut kept) = (*strained, [0.0; _]);
        self.times_mass(matrices, &mut momentum);
        self.times(matrices.coarse_inverse, &momentum, &mut kept);
        self.subtract(strained, &kept);
        self.in_world(strained)
    }

    /// Makes the answer `S^-1 g` that of second order. What is left of `forces` is of no use.
    #[inline(never)]
    fn add_second_order(&self, matrices: &Matrices<'_>, forces: &mut Row, answer: &mut Row) {
        // `A S^-1 g` as `g - M S^-1 g`: where elements are crushed `A` is so large that products with it overflow.
        let mut passed = *answer;
        self.times_mass(matrices, &mut passed);
        self.subtract(forces, &passed);
        self.times(matrices.coarse_inverse, forces, &mut passed);
        self.times_mass(matrices, &mut passed);
        self.times(matrices.coarse_inverse, &passed, forces);
        for (answer, more) in answer.iter_mut().zip(forces) {
            *answer += *more;
        }
    }

    fn subtract(&self, row: &mut Row, other: &Row) {
        let used = 3 * self.lattice.functions();
        row.iter_mut().zip(other).take(used).for_each(|(component, other)| *component -= other);
    }

    /// Components in the frames of the bounds.
    #[inline(never)]
    fn in_frames(&self, vectors: &CoarseVectors) -> Row {
        let mut vectors = *vectors;
        rotate(&mut vectors, self.refresh.frames.of_functions(), Rotation::in_frame);
        to_components(&vectors)
    }

    /// `G^-1 g`, in fast motion with the bound of `G`.
    #[inline(never)]
    fn fine(&self, matrices: &Matrices<'_>, forces: &Row) -> CoarseVectors {
        let mut moved: Row = [0.0; _];
        if self.refresh.fine_in_use {
            self.times(matrices.fine_inverse, forces, &mut moved);
            return self.in_world(&moved);
        }
        let vectors = moved.as_chunks_mut::<3>().0.iter_mut().zip(forces.as_chunks::<3>().0);
        for ((moved, force), inverse) in vectors.zip(&*matrices.bound_inverse) {
            *moved = nodal_sums::times(inverse, *force);
        }
        self.in_world(&moved)
    }

    /// Replaces a vector by `M` times it.
    fn times_mass(&self, matrices: &Matrices<'_>, row: &mut Row) {
        apply_by_axis(of_axes(matrices.mass), self.lattice.functions(), row);
        row.iter_mut().for_each(|component| *component *= 1.0 + self.k);
    }

    fn times(&self, matrix: &[f32], row: &Row, out: &mut Row) {
        apply(matrix, stride(self.lattice.functions()), self.used(row), out);
    }

    /// The components of functions.
    fn used<'a>(&self, row: &'a Row) -> &'a [f32] {
        row.get(..3 * self.lattice.functions()).unwrap_or_default()
    }

    /// Vectors in the world from components in the frames of the bounds.
    fn in_world(&self, components: &Row) -> CoarseVectors {
        let mut vectors = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
        from_components(self.used(components), &mut vectors);
        rotate(&mut vectors, self.refresh.frames.of_functions(), Rotation::in_world);
        vectors
    }
}
