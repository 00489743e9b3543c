//! The refresh of bounds, nodal inertia (kg) and coarse inertia, distributed over the steps of a cycle. A cycle has six
//! stages, and each step does an equal part of the work of the whole cycle. The refresh only uses states after accepted
//! steps.
//!
//! ```text
//! elements   D_a (bound) and s_c D^2 / 4 Kc, most of it in sums of the lattice's cells
//! cells      S = those sums
//! nodes      N_a, Mc and G = W^T (N + reserve m) W in sums of the cells, p = W^T (N + reserve m) v
//! cells      S += (1 + k) Mc, G
//! inversions G^-1, then S^-1; N_a and X = S^-1 - G^-1 are in use from then on
//! ```
//! Mass scaling has only two stages, `D_a` of the elements and `N_a` of the nodes. The coarse part of the velocity is
//! `c = G^-1 p`, its energy `c^T S c`. As for the nodes ([`super::node`]), a change of `S` must not add energy: `c` is
//! scaled down to the energy that it had.

use super::assembly::{Assembly, CellMatrices, CoarseInertia};
use super::dense::{Row, apply, mirror, stride, sweep};
use super::frames::{Frames, Rotation, rotate};
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS};
use super::matrices::{Matrices, copy, invert_mean};
use super::node::Scaling;
use super::node_refresh::{NODE_BATCH, NodeBatch};
use super::node_tables::NodeTables;
use super::report::AddedInertiaSums;
use super::{COARSE, FINE};
use crate::element::{ElementLaw, ElementMaterial, MatrixSums, TileBounds};
use crate::scene::SceneView;
use crate::simd::{Gather, NodeVector, Scatter, TILE};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Elements,
    ElementCells,
    Nodes,
    NodeCells,
    InvertFine,
    InvertCoarse,
}

/// The state of the cycle, and its results for the steps.
#[derive(Clone, Debug)]
pub(super) struct Refresh {
    stage: Stage,
    /// Pieces of work done in this stage: tiles, cells, batches of nodes, or functions and rows of a matrix.
    done: usize,
    /// Cost of the work that is due now, and cost of the work of a step.
    due: i64,
    cost_per_step: i64,
    /// Steps of a cycle.
    steps: u32,
    /// This is the first cycle: nothing is in use yet.
    first_cycle: bool,
    pub(super) frames: Frames,
    /// Step count of the state for which the frames were computed.
    frames_at: Option<u64>,
    /// Coarse velocity that the next step removes, m a step.
    pub(super) correction: CoarseVectors,
    /// `p`.
    momentum: CoarseVectors,
    /// Share of `X` that the last step used, and the factor of the velocities in the next step.
    share: f32,
    pub(super) velocity_scale: f32,
    /// Whether all inversions of this cycle were accurate.
    sound: bool,
    /// Whether those of the matrices in use were.
    pub(super) lattice_in_use: bool,
    /// Added inertia: sums of the present cycle, and of the last complete one.
    next_added: AddedInertiaSums,
    pub(super) added: AddedInertiaSums,
}

/// Measured costs of a tile, of a tile without a lattice, of a cell, of a node, and of an entry of a row that is
/// mirrored. The unit is the time of a floating-point operation of a pivot.
const TILE_COST: i64 = 47_000;
const TILE_UNCOUPLED_COST: i64 = 18_000;
const CELL_COST: i64 = 16_000;
const NODE_COST: i64 = 1_500;
const ROW_COST: i64 = 12;

/// Cost of a tile.
const fn tile_cost(functions: usize) -> i64 {
    if functions > 0 { TILE_COST } else { TILE_UNCOUPLED_COST }
}

/// Allowance for rounding in sums over the lattice.
const SLACK: f32 = 1e-3;

/// A fall of the share of `X` reduces the velocities only below this share.
const SMALL_SHARE: f32 = 0.5;
/// Largest relative error of a sound inverse.
const LARGEST_ERROR: f32 = 0.05;

const NO_VECTORS: CoarseVectors = [NodeVector::ZERO; MAX_FUNCTIONS + 1];

/// Inputs of a refresh, and the increments, which it may scale.
pub(super) struct RefreshInput<'a, M> {
    pub(super) scene: SceneView<'a, M>,
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a mut [NodeVector],
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) scaling: &'a Scaling,
}

impl<M> RefreshInput<'_, M> {
    /// The assembly of the coarse stiffness.
    fn assembly<'a>(
        &'a self,
        matrix: &'a mut [f32],
        sums: &'a mut [CellMatrices],
        stride: usize,
    ) -> Assembly<'a> {
        Assembly {
            lattice: self.lattice,
            nodes: self.places,
            inertia: self.scene.inertia,
            matrix,
            stride,
            sums,
        }
    }
}

impl Refresh {
    pub(super) const NEW: Self = Self {
        stage: Stage::Elements,
        done: 0,
        due: 0,
        cost_per_step: 0,
        steps: 1,
        first_cycle: true,
        frames: Frames::NONE,
        frames_at: None,
        correction: NO_VECTORS,
        momentum: NO_VECTORS,
        share: 1.0,
        velocity_scale: 1.0,
        sound: true,
        lattice_in_use: false,
        next_added: AddedInertiaSums::NEW,
        added: AddedInertiaSums::NEW,
    };

    /// Cycles of `steps` steps for a scene with this many tiles and nodes, and a lattice with this many functions and
    /// cells.
    pub(super) fn new(steps: u32, tiles: usize, nodes: usize, functions: usize, cells: usize) -> Self {
        let whole = tiles as i64 * tile_cost(functions)
            + 2 * cells as i64 * CELL_COST
            + nodes.next_multiple_of(NODE_BATCH) as i64 * NODE_COST
            + 2 * functions as i64 * (pivots_cost(functions) + 3 * row_cost(functions));
        Self { cost_per_step: whole / i64::from(steps.max(1)) + 1, steps, ..Self::NEW }
    }

    pub(super) const fn steps(&self) -> u32 {
        self.steps
    }

    /// Computes the frames, unless that was done for this state, which has taken `steps` steps.
    pub(super) fn update_frames(&mut self, displacement: &[NodeVector], steps: u64) {
        if self.frames_at != Some(steps) {
            self.frames.update(displacement);
            self.frames_at = Some(steps);
        }
    }

    /// Does one step's part of the cycle, after step number `steps`.
    pub(super) fn advance<M: ElementMaterial>(
        &mut self,
        steps: u64,
        mut input: RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) {
        self.due += self.cost_per_step;
        self.update_frames(input.displacement, steps);
        while self.due > 0 {
            self.due -= self.work(&mut input, tables, matrices);
        }
    }

    /// Does the whole first cycle at once.
    pub(super) fn whole_cycle<M: ElementMaterial>(
        &mut self,
        mut input: RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) {
        self.frames.update(input.displacement);
        while self.first_cycle {
            self.work(&mut input, tables, matrices);
        }
    }

    /// Does the next piece of work. Gives its cost.
    fn work<M: ElementMaterial>(
        &mut self,
        input: &mut RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) -> i64 {
        let at = self.done;
        self.done += 1;
        match self.stage {
            Stage::Elements => self.add_elements(input, tables, matrices, at),
            Stage::ElementCells => self.add_element_cell(input, matrices, at),
            Stage::Nodes => self.add_nodes(input, tables, matrices, at),
            Stage::NodeCells => self.add_node_cell(input, matrices, at),
            Stage::InvertFine => self.invert_fine(input, matrices, at),
            Stage::InvertCoarse => self.invert_coarse(input, tables, matrices, at),
        }
    }

    /// The bounds of the elements of tile `at`.
    fn add_elements<M: ElementMaterial>(
        &mut self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        let functions = input.lattice.functions();
        if at == 0 {
            tables.clear_sums();
            matrices.next_coarse.fill(0.0);
            matrices.sums.fill(CellMatrices::NONE);
            self.frames.start_cycle();
        }
        self.add_tile(input, tables, matrices, at);
        if self.done >= input.scene.tiles.len() {
            self.enter(if functions > 0 { Stage::ElementCells } else { Stage::Nodes });
        }
        tile_cost(functions)
    }

    /// The sums over elements of cell `at`, added to the next `S`.
    fn add_element_cell<M>(
        &mut self,
        input: &RefreshInput<'_, M>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        let stride = stride(input.lattice.functions());
        input.assembly(matrices.next_coarse, matrices.sums, stride).add_cell(at);
        if self.done >= input.lattice.cell_count() {
            self.enter(Stage::Nodes);
        }
        CELL_COST
    }

    /// The inertia of batch `at` of the nodes.
    fn add_nodes<M: ElementMaterial>(
        &mut self,
        input: &mut RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        if at == 0 {
            matrices.next_fine.fill(0.0);
            self.momentum = NO_VECTORS;
        }
        self.refresh_nodes(input, tables, matrices, at * NODE_BATCH);
        if self.done * NODE_BATCH >= input.scene.node_count() {
            if input.lattice.functions() > 0 {
                self.enter(Stage::NodeCells);
            } else {
                self.end(tables, matrices);
            }
        }
        NODE_BATCH as i64 * NODE_COST
    }

    /// The sums over nodes of cell `at`, added to the next `S` and `G`.
    fn add_node_cell<M>(
        &mut self,
        input: &RefreshInput<'_, M>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        let lattice = input.lattice;
        let mass_only = match &mut matrices.damped {
            Some(damped) => &mut *damped.next_mass,
            None => &mut [],
        };
        if at == 0 {
            mass_only.fill(0.0);
        }
        let (inertia, mass) = (&mut *matrices.next_fine, &mut *matrices.next_coarse);
        if let Some(sums) = matrices.sums.get_mut(at) {
            let (momenta, stride) = (&mut self.momentum, stride(lattice.functions()));
            CoarseInertia { lattice, inertia, mass, mass_only, momenta, stride }.add_cell(at, sums);
        }
        if self.done >= lattice.cell_count() {
            self.enter(Stage::InvertFine);
        }
        CELL_COST
    }

    /// A part of the inversion of the next `G`: three pivots, later one row.
    fn invert_fine<M>(&mut self, input: &RefreshInput<'_, M>, matrices: &mut Matrices<'_>, at: usize) -> i64 {
        let functions = input.lattice.functions();
        let (size, stride) = (3 * functions, stride(functions));
        if let Some(damped) = matrices.damped.as_mut().filter(|_| at == 0) {
            self.sound &= invert_mean(damped.next_mean_inverse, matrices.next_fine, functions, stride);
        }
        if at < functions {
            self.sound &= sweep(matrices.next_fine, size, stride, at);
            return pivots_cost(functions);
        }
        let row = at - functions;
        mirror(matrices.next_fine, stride, row, -1.0);
        mirror(matrices.next_coarse, stride, row, 1.0);
        if let Some(damped) = &mut matrices.damped {
            mirror(damped.next_mass, stride, row, 1.0);
        }
        if row + 1 == size {
            self.keep_energy(matrices, size, stride);
            self.enter(Stage::InvertCoarse);
        }
        row_cost(functions)
    }

    /// A part of the inversion of the next `S`: three pivots, later one row.
    fn invert_coarse<M>(
        &mut self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        let functions = input.lattice.functions();
        let (size, stride) = (3 * functions, stride(functions));
        if at < functions {
            self.sound &= sweep(matrices.next_coarse, size, stride, at);
            return pivots_cost(functions);
        }
        let row = at - functions;
        mirror(matrices.next_coarse, stride, row, -1.0);
        if row + 1 == size {
            self.sound &= self.inverse_is_accurate(matrices, size, stride);
            self.end(tables, matrices);
        }
        row_cost(functions)
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.done = 0;
    }

    /// Ends the cycle: its results are in use from now on.
    fn end(&mut self, tables: &mut NodeTables<'_>, matrices: &mut Matrices<'_>) {
        tables.put_in_use(self.first_cycle);
        self.put_in_use(matrices);
        self.enter(Stage::Elements);
    }

    /// Adds the bounds of the elements of tile `at` to the sums of nodes and lattice.
    fn add_tile<M: ElementMaterial>(
        &self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) {
        let displacement = Gather::new(input.displacement);
        let Some(tile) = input.scene.tiles.get(at) else {
            return;
        };
        let has_lattice = input.lattice.functions() > 0;
        let mut rotations = [Rotation::NONE.0; TILE];
        for (lane, rotation) in rotations.iter_mut().enumerate() {
            *rotation = self.frames.since_start(tables.frame(tile.node(0, lane))).0;
        }
        let diagonal = Scatter::new(tables.sum_diagonal);
        let sums = MatrixSums { diagonal, off_diagonal: Scatter::new(tables.sum_off_diagonal) };
        let laws = input.scene.material.laws();
        let weight = if has_lattice { input.scaling.coarse_weight } else { 0.0 };
        let rotations = &rotations;
        let tangents = M::Law::tile_bounds(TileBounds { laws, tile, displacement, sums, rotations, weight });
        if has_lattice {
            let stride = stride(input.lattice.functions());
            input.assembly(matrices.next_coarse, matrices.sums, stride).add_tile(tile, &tangents);
        }
    }

    /// Computes the next inertia of a batch of nodes, from node `first` on.
    fn refresh_nodes<M: ElementMaterial>(
        &mut self,
        input: &mut RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        first: usize,
    ) {
        let Self { frames, next_added: added, first_cycle, .. } = self;
        let RefreshInput { scene, increment, lattice, places, scaling, .. } = input;
        let sums = &mut *matrices.sums;
        let first_cycle = *first_cycle;
        let inertia = scene.inertia;
        let places = if lattice.functions() > 0 { *places } else { &[] };
        NodeBatch { inertia, increment, places, scaling, frames, added, tables, sums, first, first_cycle }
            .dispatched();
    }

    /// Sets the share of `X` that a step used. A smaller share is a larger inertia of the lattice, which must not add
    /// energy. The lattice's part of the velocity is not known in each step, so all velocities are scaled; but only at
    /// small shares, because at large ones this would remove more motion than necessary.
    pub(super) fn set_share(&mut self, share: f32) {
        let (new, old) = (share.min(SMALL_SHARE), self.share.min(SMALL_SHARE));
        self.velocity_scale = if new < old { libm::sqrtf(new / old) } else { 1.0 };
        self.share = share;
    }

    /// Computes the correction of the coarse velocity with which the next `S` adds no energy. The next `G` is inverted
    /// already, the next `S` is not.
    fn keep_energy(&mut self, matrices: &mut Matrices<'_>, size: usize, stride: usize) {
        let momentum = to_components(&self.momentum);
        let momentum = momentum.get(..size).unwrap_or_default();
        let velocity = apply(matrices.next_fine, stride, momentum);
        let velocity = velocity.get(..size).unwrap_or_default();
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        let energy = |matrix: &[f32], velocity: &[f32]| dot(velocity, &apply(matrix, stride, velocity));
        // The velocity in the world, and in the frames of `S` in use.
        let mut world = NO_VECTORS;
        from_components(velocity, &mut world);
        rotate(&mut world, &self.frames.of_cycle, Rotation::in_world);
        let mut vectors = world;
        rotate(&mut vectors, &self.frames.of_bounds, Rotation::in_frame);
        let old = to_components(&vectors);
        let before = energy(matrices.coarse, old.get(..size).unwrap_or_default());
        let after = energy(matrices.next_coarse, velocity);
        // `S <= COARSE / FINE G`, so `c^T S c <= COARSE / FINE c^T p`. If that is violated, `G` was too ill-conditioned
        // to be inverted: the velocity is meaningless, and `X` will not be used.
        self.sound &= after <= dot(velocity, momentum) * (COARSE / FINE + SLACK);
        if self.sound && !self.first_cycle && after > before * (1.0 + 1e-5) && after > 0.0 {
            let lost = 1.0 - libm::sqrtf(if before > 0.0 { before / after } else { 0.0 });
            for (correction, velocity) in self.correction.iter_mut().zip(&world) {
                correction.0 = velocity.0.map(|component| lost * component);
            }
        }
        copy(matrices.coarse, matrices.next_coarse);
    }

    /// Whether `S S^-1 p = p`, except for rounding.
    fn inverse_is_accurate(&self, matrices: &Matrices<'_>, size: usize, stride: usize) -> bool {
        let momentum = to_components(&self.momentum);
        let momentum = momentum.get(..size).unwrap_or_default();
        let solved = apply(matrices.next_coarse, stride, momentum);
        let back = apply(matrices.coarse, stride, solved.get(..size).unwrap_or_default());
        let (mut error, mut all) = (0.0, 0.0);
        for (back, momentum) in back.iter().zip(momentum) {
            error += (back - momentum) * (back - momentum);
            all += momentum * momentum;
        }
        error <= LARGEST_ERROR * LARGEST_ERROR * all
    }

    /// Puts the matrices of the cycle into use, and prepares the next cycle.
    fn put_in_use(&mut self, matrices: &mut Matrices<'_>) {
        let inverses = matrices.next_coarse.iter().zip(matrices.next_fine.iter());
        for (applied, (coarse, fine)) in matrices.applied.iter_mut().zip(inverses) {
            *applied = if self.sound { coarse - fine } else { 0.0 };
        }
        if let Some(damped) = &mut matrices.damped {
            copy(damped.inverse, matrices.next_coarse);
            copy(damped.mass, damped.next_mass);
            copy(damped.mean_inverse, damped.next_mean_inverse);
        }
        self.lattice_in_use = self.sound;
        self.frames.end_cycle();
        self.added = self.next_added;
        self.next_added = AddedInertiaSums::NEW;
        self.sound = true;
        self.first_cycle = false;
    }
}

/// Cost of three pivots: a multiplication and an addition for each entry of the lower triangle and each pivot.
fn pivots_cost(functions: usize) -> i64 {
    3 * (3 * functions * stride(functions)) as i64
}

/// Cost of a row that is mirrored.
fn row_cost(functions: usize) -> i64 {
    ROW_COST * stride(functions) as i64
}

/// The components of vectors, three for each function.
pub(super) fn to_components(vectors: &CoarseVectors) -> Row {
    let mut components = [0.0; _];
    for (three, vector) in components.as_chunks_mut::<3>().0.iter_mut().zip(vectors) {
        *three = vector.to_array();
    }
    components
}

/// Sets vectors from their components, as many as there are.
pub(super) fn from_components(components: &[f32], vectors: &mut CoarseVectors) {
    for (&[x, y, z], vector) in components.as_chunks::<3>().0.iter().zip(vectors) {
        vector.0 = [x, y, z, 0.0];
    }
}
