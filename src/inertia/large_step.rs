//! A long step as one object: a method, prepared for a scene and a step length, in the caller's storage.

use core::mem::MaybeUninit;

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use crate::element::{ElementMaterial, ScalarBound};
use crate::loads::{LoadMark, Loads};
use crate::material::Element;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::{Moment, Progress, StateView};
use crate::step::{CallingThread, Status, Step, Threads, internal_forces, nodal_volumes, write_volumes};
use crate::tled::each_rate;

use super::coarse_motion::CoarseSpace;
use super::coarse_room::CoarseRoom;
use super::lattice::{Grid, Lattice, LatticeNode, node_at, sort_by_cell};
use super::layout::Layout;
use super::matrices::{Bands, Matrices};
use super::method::{Cells, Method, largest_grid, pieces, vectors_for_lattice, vectors_of_places};
use super::node::{Scaling, half_damping};
use super::node_tables::NodeTables;
use super::renewal::{Renewal, RenewalInput};
use super::rest_check::{FEWEST, MOST_RATIO, RestCheck, longer_step, stiffening};
use super::rough_motion::RoughMotion;
use super::{COARSE, FINE, InertiaError, LARGEST_MOVE, Report, node_tables};

/// Share of its length that a step may be shortened by calls and keep the inertia of that length.
const SAME_INERTIA: f32 = 0.7;

/// A prepared step without its storage; it may be moved in memory.
#[derive(Clone, Debug)]
pub struct LargeModel {
    pub(super) nodes: usize,
    pub(super) elements: usize,
    pub(super) element: Element,
    /// Checksum of the scene.
    scene: u32,
    /// The state after the latest step, or at the preparation: inertia belongs to it.
    pub(super) moment: Moment,
    /// Loads in the latest step.
    pub(super) loads: LoadMark,
    pub(super) method: Method,
    /// Rough motion in the latest damped step.
    pub(super) rough: RoughMotion,
    /// The next step, at most as long as the one that it was prepared for.
    pub(super) step: Step,
    prepared: Step,
    /// Time (s) between the latest steps for which forces have yet to act: each may act for little more than a step, which is
    /// less than there is after one that was much longer.
    pub(super) owed: f32,
    /// Whether the next step calms rough motion that much shorter ones have left ([`LargeModel::follow`]).
    pub(super) calms: bool,
    pub(super) has_stepped: bool,
    /// What the stiffness in `S` is multiplied by, in steps up to the first one (s) and in longer ones
    /// ([`super::rest_check`]).
    stiffening: [f32; 2],
    first: f32,
    /// Length of the steps of the latest call, s; zero before the first.
    asked: f32,
    /// Inertia in use is that of another length of step.
    pub(super) is_for_other_step: bool,
    pub(super) lattice: Lattice,
    pub(super) renewal: Renewal,
    pub(super) scaling: Scaling,
    pub(super) report: Report,
}

/// The storage of a prepared step.
pub(super) struct Storage<'a> {
    pub(super) tables: NodeTables<'a>,
    pub(super) places: &'a mut [LatticeNode],
    pub(super) matrices: Matrices<'a>,
    pub(super) room: CoarseRoom<'a>,
}

impl<'a> Storage<'a> {
    /// None if `storage` is shorter than [`super::vectors_for_lattice`].
    pub(super) fn split(
        storage: &'a mut [NodeVector],
        element: Element,
        [nodes, elements]: [usize; 2],
        lattice: &Lattice,
        bands: &Bands,
    ) -> Option<Self> {
        let (room, rest) = CoarseRoom::split(storage)?;
        let (tables, rest) = rest.split_at_mut_checked(node_tables::vectors_for(nodes))?;
        let tables = NodeTables::split(tables, nodes)?;
        let (places, rest) = rest.split_at_mut_checked(vectors_of_places(nodes))?;
        let places: &mut [[LatticeNode; 2]] = must_cast_slice_mut(places.as_chunks_mut::<3>().0);
        let places = places.as_flattened_mut().get_mut(..nodes)?;
        let matrices = Matrices::split(rest, lattice, bands, pieces(element, nodes, elements))?;
        Some(Self { tables, places, matrices, room })
    }
}

impl LargeModel {
    /// Computes the inertia for `step` from the present state, for a scene with these `points` (m) at rest. It takes as
    /// long as some hundreds of exact steps. `storage` of [`super::vectors_for`] vectors is overwritten. Up to eight bodies
    /// that share no node have functions of their own, as many in all as there is room for.
    pub fn prepare<M: ElementMaterial>(
        method: Method,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        storage: &mut [NodeVector],
    ) -> Result<Self, InertiaError> {
        let grid = checked_grid(&method, scene, points)?;
        let mut model = Self::new(method, scene, step);
        model.first_cycles(grid, scene, points, state, storage)?;
        Ok(model)
    }

    /// The same where the model shall stay, for hosts with little stack: a model has 10 kB.
    pub fn prepare_in<'m, M: ElementMaterial>(
        place: &'m mut MaybeUninit<Self>,
        method: Method,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
        storage: &mut [NodeVector],
    ) -> Result<&'m mut Self, InertiaError> {
        let grid = checked_grid(&method, scene, points)?;
        let model = Self::new_in(place, method, scene, step);
        model.first_cycles(grid, scene, points, state, storage)?;
        Ok(model)
    }

    /// Computes all inertia, with coarser lattices as long as single precision cannot invert the matrices of a suggested
    /// one. Bodies that share no node are set apart ([`Layout`]) where there is room for that.
    // Not inlined: other crates use the one that is compiled here.
    #[inline(never)]
    fn first_cycles<M: ElementMaterial>(
        &mut self,
        mut grid: Grid,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        mut state: StateView<'_>,
        storage: &mut [NodeVector],
    ) -> Result<(), InertiaError> {
        let (room, nodes, elements) = (storage.len(), self.nodes, self.elements);
        let fits = |grid: &Grid| vectors_for_lattice(scene.element(), nodes, elements, *grid) <= room;
        let cells = self.method.cells;
        let largest = |layout: &Layout<'_>, mut below| {
            loop {
                // A coarser one may have wider layers, and need more than there is room for.
                let grid = largest_grid(scene, layout, below);
                if grid.functions == 0 || fits(&grid) {
                    return grid;
                }
                below = grid.functions;
            }
        };
        let layout = Layout::of_bodies(scene, points, labels_in(storage));
        let is_apart = layout.bodies() > 1 && {
            let apart = match cells {
                Cells::Suggested => largest(&layout, usize::MAX),
                Cells::Given(_) => cells.grid_on(scene, &layout).unwrap_or_default(),
            };
            let is_possible = apart.functions > 0 && fits(&apart);
            if is_possible {
                grid = apart;
            }
            is_possible
        };
        loop {
            let answer = self.first_cycle(grid, scene, (points, is_apart), state.reborrow(), storage);
            if !matches!(answer, Err(InertiaError::Singular { .. })) || cells != Cells::Suggested {
                return answer;
            }
            grid = largest(&layout_of(scene, (points, is_apart), labels_in(storage)), grid.functions);
            if grid.functions == 0 {
                return answer;
            }
        }
    }

    /// A model without its lattice. Not inlined: the stack on which it may be made first is free again afterwards.
    #[inline(never)]
    fn new_in<'m, M: ElementMaterial>(
        place: &'m mut MaybeUninit<Self>,
        method: Method,
        scene: SceneView<'_, M>,
        step: Step,
    ) -> &'m mut Self {
        place.write(Self::new(method, scene, step))
    }

    fn new<M: ElementMaterial>(method: Method, scene: SceneView<'_, M>, step: Step) -> Self {
        Self {
            nodes: scene.node_count(),
            elements: scene.element_count(),
            element: scene.element(),
            scene: scene.checksum(),
            moment: Progress::START.moment(),
            loads: LoadMark::default(),
            method,
            rough: RoughMotion::NONE,
            step,
            prepared: step,
            owed: 0.0,
            calms: false,
            has_stepped: false,
            is_for_other_step: false,
            scaling: scaling_of(step, 1.0),
            stiffening: [1.0; 2],
            first: step.seconds(),
            asked: 0.0,
            renewal: Renewal::NEW,
            lattice: Lattice::NONE,
            report: Report::NONE,
        }
    }

    /// Makes the lattice on points that may be apart, and the clusters, and computes all inertia.
    fn first_cycle<M: ElementMaterial>(
        &mut self,
        grid: Grid,
        scene: SceneView<'_, M>,
        points: (&[[f32; 3]], bool),
        state: StateView<'_>,
        storage: &mut [NodeVector],
    ) -> Result<(), InertiaError> {
        self.lattice.set(grid.cells, &layout_of(scene, points, labels_in(storage)), scene.inertia)?;
        self.renewal.bands = Bands::new(&self.lattice);
        let check = |kind, needed, capacity| {
            if capacity < needed { Err(InertiaError::Capacity { kind, needed, capacity }) } else { Ok(()) }
        };
        let (capacity, nodes) = (storage.len(), self.nodes);
        let needed = vectors_for_lattice(scene.element(), nodes, self.elements, grid);
        check("vectors", needed, capacity)?;
        check("nodes in the state", nodes, state.capacity_for(scene.element()))?;
        storage.fill(NodeVector::ZERO);
        let (lattice, sizes) = (&self.lattice, [nodes, self.elements]);
        let Some(Storage { mut tables, places, mut matrices, mut room }) =
            Storage::split(storage, scene.element(), sizes, lattice, &self.renewal.bands)
        else {
            return Err(InertiaError::Capacity { kind: "vectors", needed, capacity });
        };
        lattice.write_places(&layout_of(scene, points, labels_in(tables.scratch)), places);
        sort_by_cell(places);
        write_limits(scene, places, &mut tables);
        let StateView { displacement, volume, progress, .. } = state;
        write_closeness(scene, places, volume, &mut tables);
        let singular = Err(InertiaError::Singular { cells: lattice.cells() });
        if !matrices.write_constants(scene, lattice, places, &mut self.renewal) {
            return singular;
        }
        matrices.frames.choose(lattice, places, points.0, scene.inertia);
        self.stiffening = [1.0; 2];
        let mut compared = self.step;
        for index in 0..self.stiffening.len() {
            let scaling = scaling_of(compared, 1.0);
            let rest = core::mem::take(&mut tables.more_scratch);
            rest.fill(NodeVector::ZERO);
            let input = RenewalInput { scene, displacement: rest, volume, lattice, places, scaling: &scaling };
            self.renewal.renew_all(input, &mut tables, &mut matrices, &CallingThread);
            let space = CoarseSpace { lattice, renewal: &self.renewal, matrices: &matrices };
            let (force, weight) = (&mut *tables.scratch, scaling.coarse_weight);
            let mut check = RestCheck { scene, places, space, displacement: rest, force, volume, weight };
            let ratio = if self.renewal.lattice_in_use { check.largest_ratio(&mut room) } else { 1.0 };
            rest.fill(NodeVector::ZERO);
            tables.more_scratch = rest;
            if index == 0 && ratio > MOST_RATIO && self.method.cells == Cells::Suggested && grid.functions > FEWEST {
                return singular;
            }
            self.stiffening
                .iter_mut()
                .skip(index)
                .for_each(|each| *each = each.max(stiffening(ratio, self.renewal.sensitivity)));
            let Some(longer) = longer_step(self.step, self.renewal.added.mean) else { break };
            compared = longer;
        }
        self.scaling = scaling_of(self.step, self.stiffening[0]);
        self.moment = progress.moment();
        let displacement = displacement.get(..nodes).unwrap_or_default();
        write_volumes(scene, displacement, volume, &CallingThread);
        let input = RenewalInput { scene, displacement, volume, lattice, places, scaling: &self.scaling };
        self.renewal.renew_all(input, &mut tables, &mut matrices, &CallingThread);
        self.report = self.renewal.added.report(0, 1.0, 0.0);
        let is_bounded = |node: &usize| tables.scratch.get(*node).is_some_and(|force| force.0[3].is_finite());
        match (0..nodes).find(|node| !is_bounded(node)) {
            Some(node) => Err(InertiaError::NotFinite { node: node as u32 }),
            None if !self.renewal.lattice_in_use => singular,
            None => Ok(()),
        }
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
    /// long as two steps. With steps so long that single precision cannot invert the lattice's matrices the lattice is
    /// not used, with a [`Report::coarse_share`] of zero, and [`Status::Limited`].
    pub fn change_step(&mut self, step: Step) {
        (self.step, self.prepared) = (step, step);
        let [first, longer] = self.stiffening;
        self.scaling = scaling_of(step, if step.seconds() > self.first { longer } else { first });
        self.is_for_other_step = true;
    }

    /// The longest steps that it was made for, s.
    pub(crate) const fn first(&self) -> f32 {
        self.first
    }

    /// A call asks for steps of so many seconds. Where the one before did as well, or there was none, and inertia in use is that of quite other
    /// ones, which would hold the body back: those to go over to.
    pub(crate) fn ask(&mut self, seconds: f32) -> Option<Step> {
        let is_near = |other: f32, share: f32| seconds > share * other && other > share * seconds;
        let before = core::mem::replace(&mut self.asked, seconds);
        if (before == 0.0 || is_near(before, 0.95)) && !is_near(self.longest(), SAME_INERTIA) {
            Step::unchecked(seconds, self.prepared.damping()).ok()
        } else {
            None
        }
    }

    /// Constants of the tissue have changed: the next step computes all inertia anew.
    #[cfg(any(feature = "std", feature = "capi-neo-hookean"))]
    pub(crate) const fn renew_soon(&mut self) {
        self.is_for_other_step = true;
    }

    /// A call of long steps begins at this state. Where others have brought it there, the vibrations of much shorter steps, which
    /// these do not resolve, are not carried over: as velocities of a long step they would tear the mesh.
    pub(crate) fn follow(&mut self, progress: &Progress) {
        self.calms = !self.has_stepped || self.moment != progress.moment();
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

    /// The model with the storage in which it was prepared.
    pub const fn with_storage<'a>(&'a mut self, storage: &'a mut [NodeVector]) -> LargeView<'a> {
        LargeView { model: self, storage }
    }
}

fn scaling_of(step: Step, stiffening: f32) -> Scaling {
    let (dt, k) = (step.seconds(), half_damping(&step));
    Scaling {
        weight: 0.25 * FINE * dt * dt,
        k,
        reserve: k * (1.0 + k),
        coarse_weight: 0.25 * COARSE * stiffening * dt * dt,
    }
}

/// A prepared step with borrowed storage.
#[derive(Debug)]
pub struct LargeView<'a> {
    pub(super) model: &'a mut LargeModel,
    pub(super) storage: &'a mut [NodeVector],
}

/// A prepared step with storage `S` of the caller.
#[derive(Clone, Debug)]
pub struct LargeStep<S> {
    model: LargeModel,
    storage: S,
}

impl<S: AsMut<[NodeVector]>> LargeStep<S> {
    /// See [`LargeModel::prepare`].
    pub fn prepare<M: ElementMaterial>(
        method: Method,
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
    pub fn parts(&mut self) -> (&mut LargeModel, &mut [NodeVector]) {
        (&mut self.model, self.storage.as_mut())
    }

    /// The model: report and sizes.
    pub const fn model(&self) -> &LargeModel {
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

    /// Takes one step of the length for which it was prepared, or that was set since ([`LargeModel::set_seconds`]):
    /// one force evaluation and the work of the lattice, whose stiffness is computed anew where the tissue deforms fast.
    /// In a state that another step has moved, that was reset or restored, the first step computes all inertia anew.
    /// `Mismatch` with room for no node if it was prepared for another scene.
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
impl LargeStep<std::vec::Vec<NodeVector>> {
    /// The same with storage from the heap.
    pub fn prepare_in_vec<M: ElementMaterial>(
        method: Method,
        scene: SceneView<'_, M>,
        points: &[[f32; 3]],
        state: StateView<'_>,
        step: Step,
    ) -> Result<Self, InertiaError> {
        let storage = std::vec![NodeVector::ZERO; super::vectors_for(&method, scene, points)?];
        Self::prepare(method, scene, points, state, step, storage)
    }
}

/// Room for a number for each node, which may be overwritten.
fn labels_in(vectors: &mut [NodeVector]) -> &mut [u32] {
    must_cast_slice_mut::<NodeVector, [u32; 4]>(vectors).as_flattened_mut()
}

/// Where nodes are for the lattice, its bodies apart or not.
fn layout_of<'a, M>(
    scene: SceneView<'_, M>,
    (points, is_apart): (&'a [[f32; 3]], bool),
    labels: &'a mut [u32],
) -> Layout<'a> {
    if is_apart { Layout::of_bodies(scene, points, labels) } else { Layout::one(points) }
}

/// The lattice of a method, and that the points are those of the scene.
fn checked_grid<M: ElementMaterial>(
    method: &Method,
    scene: SceneView<'_, M>,
    points: &[[f32; 3]],
) -> Result<Grid, InertiaError> {
    let nodes = scene.node_count();
    if points.len() != nodes {
        return Err(InertiaError::Points { points: points.len(), nodes });
    }
    let other = scene.places().find(|&(tile, lane)| !tile.has_edges_of(lane, points));
    if let Some((tile, lane)) = other {
        return Err(InertiaError::OtherPoints { element: tile.element(lane) });
    }
    let grid = method.grid(scene, points)?;
    if grid.functions > 0 { Ok(grid) } else { Err(InertiaError::TooSmall { nodes }) }
}

/// Writes how far the force of each node may move it in one step from rest, from the least height `1 / |ga|` of its
/// elements.
fn write_limits<M>(scene: SceneView<'_, M>, places: &[LatticeNode], tables: &mut NodeTables<'_>) {
    // First the largest |ga|^2.
    let squares = &mut *tables.scratch;
    squares.fill(NodeVector::ZERO);
    for (tile, lane) in scene.places() {
        let slopes = [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| tile.gradient_of(corner, axis, lane)));
        let origin = [0, 1, 2].map(|axis| slopes[0][axis] + slopes[1][axis] + slopes[2][axis]);
        for (corner, [x, y, z]) in [origin, slopes[0], slopes[1], slopes[2]].into_iter().enumerate() {
            if let Some(node) = squares.get_mut(tile.node(corner, lane)) {
                let square = x * x + y * y + z * z;
                node.0[0] = if square > node.0[0] { square } else { node.0[0] };
            }
        }
    }
    for (rank, rough) in tables.rough.iter_mut().enumerate() {
        let square = squares.get(node_at(places, rank)).map_or(0.0, |square| square.0[0]);
        rough.0[3] = if square > 0.0 { LARGEST_MOVE / libm::sqrtf(square) } else { f32::MAX };
    }
}

/// Writes `rho` of each node ([`super::node`]), from bounds at rest. `volume` is overwritten.
fn write_closeness<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    places: &[LatticeNode],
    volume: &mut [NodeVector],
    tables: &mut NodeTables<'_>,
) {
    let NodeTables { next_increment, rough, rough_before, scratch, more_scratch: units } = tables;
    for table in [&mut **next_increment, rough_before, scratch] {
        table.fill(NodeVector::ZERO);
    }
    // With unit masses a light node has no smaller share of its elements' stiffness than a heavy one.
    for (NodeVector(unit), inertia) in units.iter_mut().zip(scene.inertia) {
        let [x, y, z] = inertia.inverse.map(|inverse| if inverse > 0.0 { 1.0 } else { 0.0 });
        *unit = [x, y, z, 1.0];
    }
    let rates =
        each_rate(scene, must_cast_slice(units), [scratch, next_increment, rough_before], volume, |node, rate| {
            if let Some(rough) = rough.get_mut(node) {
                rough.0[0] = rate;
            }
        });
    let all = scene.elements().partitions.all();
    for table in [&mut **rough_before, scratch] {
        table.fill(NodeVector::ZERO);
    }
    nodal_volumes(scene, scratch, &[], volume, &CallingThread);
    internal_forces(scene, all, [scratch, &[]], volume, rough_before, ScalarBound, None);
    for (rank, next) in next_increment.iter_mut().enumerate() {
        let node = node_at(places, rank);
        let bound = rough_before.get(node).map_or(0.0, |force| force.0[3]);
        let close = rough.get(node).map_or(0.0, |rough| rough.0[0]);
        let is_close = rates.is_some() && bound > 0.0 && close < bound;
        *next = NodeVector([0.0, 0.0, 0.0, if is_close { close / bound } else { 1.0 }]);
    }
    rough.iter_mut().for_each(|rough| rough.0[0] = 0.0);
}
