//! A mass-scaled, multilevel or damped step as one object: a method, prepared for a scene and a step length, in the
//! caller's storage.

use core::mem::MaybeUninit;

use bytemuck::must_cast_slice_mut;
use glam::{DMat3, DVec3};

use crate::element::{ElementMaterial, ElementTile};
use crate::loads::Loads;
use crate::material::Element;
use crate::scene::SceneView;
use crate::simd::{Contiguous, NodeVector};
use crate::state::{Moment, Progress, StateView};
use crate::step::{CallingThread, Status, Step, Threads, nodal_volumes};

use super::cell_boxes::sort_by_box;
use super::damper::RoughMotion;
use super::lattice::{Grid, Lattice, LatticeNode, node_at, rank_of, sort_by_cell};
use super::matrices::Matrices;
use super::method::{Cells, Method, largest_grid, vectors_for_lattice, vectors_of_order, vectors_of_places};
use super::node::{Scaling, half_damping};
use super::node_tables::{NodeTables, read_matrices};
use super::refresh::{Refresh, RefreshInput};
use super::{
    COARSE, CYCLE, CYCLE_STEPS, FINE, FINE_WITHOUT_LATTICE, InertiaError, LATTICE_CYCLE_STEPS, Report, node_tables,
};

/// A prepared step without its storage; it may be moved in memory.
#[derive(Clone, Debug)]
pub struct LargeModel<'w> {
    pub(super) nodes: usize,
    pub(super) elements: usize,
    pub(super) element: Element,
    /// Elements that touch a node that motions may move: the first ones in the order.
    pub(super) moved_elements: usize,
    /// Checksum of the scene.
    scene: u32,
    /// The state after the latest step, or at the preparation: inertia belongs to it.
    pub(super) moment: Moment,
    pub(super) method: Method<'w>,
    /// Rough motion in the latest damped step.
    pub(super) rough: RoughMotion,
    /// The next step, at most as long as the one that it was prepared for.
    pub(super) step: Step,
    prepared: Step,
    /// Inertia in use is that of another length of step.
    pub(super) is_for_other_step: bool,
    pub(super) lattice: Lattice,
    pub(super) refresh: Refresh,
    pub(super) scaling: Scaling,
    /// The least share of its inverse inertia that a node used in the latest step.
    pub(super) least_share: f32,
    pub(super) report: Report,
}

/// The storage of a prepared step.
pub(super) struct Storage<'a> {
    pub(super) tables: NodeTables<'a>,
    pub(super) places: &'a mut [LatticeNode],
    /// The elements in the order of their boxes of cells (`assembly.rs`); empty without a lattice, and with nodal
    /// strain.
    pub(super) order: &'a mut [u32],
    pub(super) matrices: Matrices<'a>,
}

impl<'a> Storage<'a> {
    /// None if `storage` is shorter than [`vectors_for_lattice`].
    pub(super) fn split(
        storage: &'a mut [NodeVector],
        element: Element,
        [nodes, elements]: [usize; 2],
        lattice: &Lattice,
        damped: bool,
    ) -> Option<Self> {
        let (tables, rest) = storage.split_at_mut_checked(node_tables::vectors_for(nodes, damped))?;
        let tables = NodeTables::split(tables, nodes)?;
        let has_lattice = lattice.functions() > 0;
        let places = if has_lattice { vectors_of_places(nodes) } else { 0 };
        let (places, rest) = rest.split_at_mut_checked(places)?;
        let places: &mut [[LatticeNode; 2]] = must_cast_slice_mut(places.as_chunks_mut::<3>().0);
        let places = places.as_flattened_mut().get_mut(..if has_lattice { nodes } else { 0 })?;
        let order = if has_lattice { vectors_of_order(element, elements) } else { 0 };
        let (order, rest) = rest.split_at_mut_checked(order)?;
        let order: &mut [u32] = must_cast_slice_mut(order);
        let order = order.get_mut(..elements.min(order.len()))?;
        let matrices = Matrices::split(must_cast_slice_mut(rest), lattice, element.is_nodal_strain())?;
        Some(Self { tables, places, order, matrices })
    }
}

impl<'w> LargeModel<'w> {
    /// Computes the inertia for `step` from the present state, for a scene with these `points` (m) at rest. It takes as
    /// long as a few steps, with a lattice as long as a cycle of steps. `storage` of [`super::vectors_for`] vectors is
    /// overwritten.
    pub fn prepare<M: ElementMaterial>(
        method: Method<'w>,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        storage: &mut [NodeVector],
    ) -> Result<Self, InertiaError> {
        let grid = checked_grid(&method, scene, points)?;
        let mut model = Self::new(method, scene, step, grid);
        model.first_cycles(grid, scene, points, state, storage)?;
        Ok(model)
    }

    /// The same where the model shall stay, for hosts with little stack: a model has 38 kB.
    pub fn prepare_in<'m, M: ElementMaterial>(
        place: &'m mut MaybeUninit<Self>,
        method: Method<'w>,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        storage: &mut [NodeVector],
    ) -> Result<&'m mut Self, InertiaError> {
        let grid = checked_grid(&method, scene, points)?;
        let model = place.write(Self::new(method, scene, step, grid));
        model.first_cycles(grid, scene, points, state, storage)?;
        Ok(model)
    }

    /// The first cycle, with coarser lattices as long as single precision cannot invert the matrices of a suggested
    /// one.
    fn first_cycles<M: ElementMaterial>(
        &mut self,
        mut grid: Grid,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        mut state: StateView<'_>,
        storage: &mut [NodeVector],
    ) -> Result<(), InertiaError> {
        loop {
            let answer = self.first_cycle(grid, scene, points, state.reborrow(), storage);
            if !matches!(answer, Err(InertiaError::Singular { .. })) || self.method.cells() != Some(Cells::Suggested) {
                return answer;
            }
            let coarser = largest_grid(scene, points, grid.functions);
            if coarser.functions == 0 {
                return answer;
            }
            grid = coarser;
            self.lattice = Lattice::NONE;
            self.refresh = Self::refresh_of(scene, self.step, grid);
        }
    }

    fn refresh_of<M: ElementMaterial>(scene: SceneView<'_, M>, step: Step, grid: Grid) -> Refresh {
        let cells = grid.cells.iter().map(|&count| count as usize).product();
        Refresh::new(cycle(step, grid.functions > 0), scene, grid.functions, cells)
    }

    /// A model without its lattice. Always inlined: it is made where it stays.
    #[inline(always)]
    fn new<M: ElementMaterial>(method: Method<'w>, scene: SceneView<'_, M>, step: Step, grid: Grid) -> Self {
        let (nodes, has_lattice) = (scene.node_count(), grid.functions > 0);
        Self {
            nodes,
            elements: scene.element_count(),
            element: scene.element(),
            moved_elements: 0,
            scene: scene.checksum(),
            moment: Progress::START.moment(),
            method,
            rough: RoughMotion::NONE,
            step,
            prepared: step,
            is_for_other_step: false,
            scaling: scaling(step, has_lattice),
            refresh: Self::refresh_of(scene, step, grid),
            lattice: Lattice::NONE,
            least_share: 1.0,
            report: Report::NONE,
        }
    }

    /// Makes the lattice, chooses the frames, and computes all bounds and inertia.
    fn first_cycle<M: ElementMaterial>(
        &mut self,
        grid: Grid,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        storage: &mut [NodeVector],
    ) -> Result<(), InertiaError> {
        if grid.cells != [0; 3] {
            self.lattice.set(grid.cells, points, scene.inertia)?;
        }
        let check = |kind, needed, capacity| {
            if capacity < needed { Err(InertiaError::Capacity { kind, needed, capacity }) } else { Ok(()) }
        };
        let (damped, capacity) = (self.method.damper().is_some(), storage.len());
        let needed = vectors_for_lattice(scene.element(), self.nodes, self.elements, grid, damped);
        check("vectors", needed, capacity)?;
        check("nodes in the state", self.nodes, state.capacity_for(scene.element()))?;
        storage.fill(NodeVector::ZERO);
        let Some(Storage { mut tables, places, order, mut matrices }) =
            Storage::split(storage, scene.element(), [self.nodes, self.elements], &self.lattice, damped)
        else {
            return Err(InertiaError::Capacity { kind: "vectors", needed, capacity });
        };
        write_heights(scene, &mut tables);
        self.choose_frames(scene, points, &mut tables, places)?;
        if !scene.element().is_nodal_strain() {
            self.moved_elements = sort_by_box(order, scene, &self.lattice, places);
        }
        let StateView { displacement, increment, volume, progress, .. } = state;
        self.moment = progress.moment();
        let nodes = self.nodes;
        let displacement = displacement.get(..nodes).unwrap_or_default();
        nodal_volumes(scene, displacement, &[], volume, &CallingThread);
        let input = RefreshInput {
            scene,
            displacement,
            volume,
            increment: increment.get_mut(..nodes).unwrap_or_default(),
            lattice: &self.lattice,
            places,
            order,
            scaling: &self.scaling,
        };
        self.refresh.whole_cycle(input, &mut tables, &mut matrices);
        self.report = self.refresh.added.report(0, 1.0);
        let unbounded = (0..nodes).find(|&node| {
            let at = Contiguous(rank_of(places, node));
            let (inverse, [scalar, _]) = read_matrices::<f32>(at, tables.inverse_diagonal, tables.inverse_off_diagonal);
            !(inverse.trace().is_finite() && scalar.is_finite())
        });
        match unbounded {
            Some(node) => Err(InertiaError::NotFinite { node: node as u32 }),
            None if self.lattice.functions() > 0 && !self.refresh.lattice_in_use => {
                Err(InertiaError::Singular { cells: self.lattice.cells() })
            }
            None => Ok(()),
        }
    }

    /// Chooses the frames and those of the nodes, and writes the places of the nodes, sorted by cell, if there is a
    /// lattice. Not inlined: the first cycle does without its stack.
    #[inline(never)]
    fn choose_frames<M>(
        &mut self,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        tables: &mut NodeTables<'_>,
        places: &mut [LatticeNode],
    ) -> Result<(), InertiaError> {
        let mut of_frames = Lattice::NONE;
        let lattice = if self.lattice.functions() > 0 {
            &self.lattice
        } else {
            // Mass scaling has a lattice only to define frames.
            let Grid { cells, functions } = largest_grid(scene, points, usize::MAX);
            let cells = if functions > 0 { cells } else { [1; 3] };
            of_frames.set(cells, points, scene.inertia)?;
            &of_frames
        };
        self.refresh.frames.choose(lattice, points);
        // The frame of a node goes with its height until its rank is known.
        for (node, (&point, inertia)) in points.iter().zip(scene.inertia).enumerate() {
            let place = lattice.place(point);
            if let Some(sums) = tables.sum_diagonal.get_mut(node) {
                sums.0[1] = lattice.frame(&place, inertia) as f32;
            }
            if let Some(to) = places.get_mut(node) {
                *to = place;
            }
        }
        sort_by_cell(places);
        for rank in 0..scene.node_count() {
            let [height, frame, ..] = tables.sum_diagonal.get(node_at(places, rank)).copied().unwrap_or_default().0;
            tables.set_node(rank, height, frame as usize);
        }
        Ok(())
    }

    /// Whether it was prepared for this scene.
    pub(super) fn is_for<M>(&self, scene: SceneView<'_, M>) -> bool {
        self.nodes == scene.node_count() && self.elements == scene.element_count() && self.scene == scene.checksum()
    }

    /// Report of the latest step, or of the preparation.
    #[must_use]
    pub const fn report(&self) -> &Report {
        &self.report
    }

    /// The longest step that its inertia makes stable, s: that which it was prepared for.
    #[must_use]
    pub const fn longest(&self) -> f32 {
        self.prepared.seconds()
    }

    /// Length of the next steps, s: at most the one that it was prepared for, which is the longest that its inertia
    /// makes stable. A shorter step has the inertia of that one, so it is less accurate than one that was prepared for
    /// its own length. To be changed now and then: central differences whose step changes all the time gain energy
    /// (Skeel 1993).
    pub fn set_seconds(&mut self, seconds: f32) -> Result<(), InertiaError> {
        let most = self.prepared.seconds();
        match Step::unchecked(seconds, self.prepared.damping()) {
            Ok(step) if seconds <= most => {
                self.step = step;
                Ok(())
            }
            _ => Err(InertiaError::Step { seconds, most }),
        }
    }

    /// Goes over to steps of another length, longer or shorter. The next step computes all inertia anew, which takes as
    /// long as a cycle of steps. With steps so long that single precision cannot invert the lattice's matrices the
    /// steps are those of mass scaling, with a [`Report::coarse_share`] of zero, and [`Status::Limited`].
    pub fn change_step(&mut self, step: Step) {
        let has_lattice = self.lattice.functions() > 0;
        (self.step, self.prepared) = (step, step);
        self.scaling = scaling(step, has_lattice);
        self.refresh.set_steps(cycle(step, has_lattice));
        self.is_for_other_step = true;
    }

    /// The clock of the state has been set since the latest step: inertia still belongs to it.
    pub(crate) const fn is_at(&mut self, progress: &Progress) {
        self.moment = progress.moment();
    }

    /// The lattice.
    #[must_use]
    pub const fn grid(&self) -> Grid {
        Grid { cells: self.lattice.cells(), functions: self.lattice.functions() }
    }

    /// Largest number of steps of a cycle, in which all bounds and inertia are renewed: 256 with a lattice, and sooner
    /// while the tissue deforms fast; without one those of 0.04 s, but at least 4 and at most 64.
    #[must_use]
    pub const fn cycle(&self) -> u32 {
        self.refresh.steps()
    }

    /// The model with the storage in which it was prepared.
    pub const fn with_storage<'a>(&'a mut self, storage: &'a mut [NodeVector]) -> LargeView<'a, 'w> {
        LargeView { model: self, storage }
    }
}

/// Largest number of steps of a cycle. Without a lattice nothing measures how fast the tissue deforms.
fn cycle(step: Step, has_lattice: bool) -> u32 {
    let (least, most) = CYCLE_STEPS;
    if has_lattice { LATTICE_CYCLE_STEPS } else { ((CYCLE / step.seconds()) as u32).clamp(least, most) }
}

fn scaling(step: Step, has_lattice: bool) -> Scaling {
    let (dt, damping) = (step.seconds(), step.damping());
    let k = half_damping(&step);
    let fine = if has_lattice { FINE } else { FINE_WITHOUT_LATTICE };
    Scaling {
        weight: 0.25 * fine * dt * dt,
        k,
        reserve: if has_lattice { k * (1.0 + k) } else { k },
        loss: 2.0 * damping * dt * cycle(step, has_lattice) as f32,
        coarse_weight: 0.25 * COARSE * dt * dt,
    }
}

/// A prepared step with borrowed storage.
#[derive(Debug)]
pub struct LargeView<'a, 'w> {
    pub(super) model: &'a mut LargeModel<'w>,
    pub(super) storage: &'a mut [NodeVector],
}

/// A prepared step with storage `S` of the caller.
#[derive(Clone, Debug)]
pub struct LargeStep<'w, S> {
    model: LargeModel<'w>,
    storage: S,
}

impl<'w, S: AsMut<[NodeVector]>> LargeStep<'w, S> {
    /// See [`LargeModel::prepare`].
    pub fn prepare<M: ElementMaterial>(
        method: Method<'w>,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        mut storage: S,
    ) -> Result<Self, InertiaError> {
        let model = LargeModel::prepare(method, scene, points, state, step, storage.as_mut())?;
        Ok(Self { model, storage })
    }

    /// The model and its storage, to be changed.
    pub fn parts(&mut self) -> (&mut LargeModel<'w>, &mut [NodeVector]) {
        (&mut self.model, self.storage.as_mut())
    }

    /// The model: report and sizes.
    pub const fn model(&self) -> &LargeModel<'w> {
        &self.model
    }

    /// Report of the latest step, or of the preparation.
    pub const fn report(&self) -> &Report {
        &self.model.report
    }

    /// See [`LargeModel::set_seconds`].
    pub fn set_seconds(&mut self, seconds: f32) -> Result<(), InertiaError> {
        self.model.set_seconds(seconds)
    }

    /// See [`LargeModel::change_step`].
    pub fn change_step(&mut self, step: Step) {
        self.model.change_step(step);
    }

    /// See [`LargeView::shorten`].
    pub fn shorten<M: ElementMaterial>(
        &mut self,
        seconds: f32,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
    ) -> Status {
        self.model.with_storage(self.storage.as_mut()).shorten(seconds, scene, loads, state, &CallingThread)
    }

    /// Takes one step of the length for which it was prepared, or that was set since ([`LargeModel::set_seconds`]).
    /// Every call does the same work: one force evaluation and that of the lattice; more while the tissue deforms fast,
    /// and for the elements at supports that change their speed, at most a whole cycle. In a state that another step
    /// has moved, that was reset or restored, the first step computes all inertia anew. `Mismatch` with room for no
    /// node if it was prepared for another scene.
    pub fn step<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
    ) -> Status {
        self.model.with_storage(self.storage.as_mut()).step(scene, loads, state)
    }

    /// See [`LargeView::step_in_parts`].
    pub fn step_in_parts<M: ElementMaterial>(
        &mut self,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: StateView<'_>,
        threads: &impl Threads,
    ) -> Status {
        self.model.with_storage(self.storage.as_mut()).step_in_parts(scene, loads, state, threads)
    }
}

#[cfg(any(feature = "std", test))]
impl<'w> LargeStep<'w, std::vec::Vec<NodeVector>> {
    /// The same with storage from the heap.
    pub fn prepare_in_vec<M: ElementMaterial>(
        method: Method<'w>,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
    ) -> Result<Self, InertiaError> {
        let storage = std::vec![NodeVector::ZERO; super::vectors_for(&method, scene, points)?];
        Self::prepare(method, scene, points, state, step, storage)
    }
}

/// The lattice of a method, and that the points are those of the scene.
fn checked_grid<M: ElementMaterial>(
    method: &Method<'_>,
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
) -> Result<Grid, InertiaError> {
    let nodes = scene.node_count();
    if points.len() != nodes {
        return Err(InertiaError::Points { points: points.len(), nodes });
    }
    let other = scene.places().find(|&(tile, lane)| !has_edges_of(tile, lane, points));
    if let Some((tile, lane)) = other {
        return Err(InertiaError::OtherPoints { element: tile.element(lane) });
    }
    method.grid(scene, points)
}

/// Whether an element has the edges between these points (m): `sum_a (x_a - x_0) ga^T` is one.
fn has_edges_of(tile: &ElementTile, lane: usize, points: &[[f32; 3]]) -> bool {
    // Slivers come near it by rounding.
    const MOST: f64 = 0.05;
    let at = |corner| {
        points.get(tile.node(corner, lane)).map(|point| DVec3::from_array(point.map(f64::from))).unwrap_or_default()
    };
    let origin = at(0);
    let mut sum = DMat3::IDENTITY * -1.0;
    for corner in 0..3 {
        let gradient = [0, 1, 2].map(|axis| f64::from(tile.gradient_of(corner, axis, lane)));
        let edge = at(corner + 1) - origin;
        sum += DMat3::from_cols(edge * gradient[0], edge * gradient[1], edge * gradient[2]);
    }
    sum.abs_diff_eq(DMat3::ZERO, MOST)
}

/// Writes the least height `1 / |ga|` (m) among the elements of each node to the node's first sum.
fn write_heights<M>(scene: SceneView<'_, M>, tables: &mut NodeTables<'_>) {
    // First the largest |ga|^2, then the height.
    let heights = &mut *tables.sum_diagonal;
    heights.fill(NodeVector::ZERO);
    for (tile, lane) in scene.places() {
        let slopes = [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| tile.gradient_of(corner, axis, lane)));
        let origin = [0, 1, 2].map(|axis| slopes[0][axis] + slopes[1][axis] + slopes[2][axis]);
        for (corner, [x, y, z]) in [origin, slopes[0], slopes[1], slopes[2]].into_iter().enumerate() {
            if let Some(node) = heights.get_mut(tile.node(corner, lane)) {
                let square = x * x + y * y + z * z;
                node.0[0] = if square > node.0[0] { square } else { node.0[0] };
            }
        }
    }
    for node in heights.iter_mut() {
        node.0[0] = if node.0[0] > 0.0 { 1.0 / libm::sqrtf(node.0[0]) } else { f32::MAX };
    }
}
