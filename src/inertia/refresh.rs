//! The refresh of bounds, nodal inertia (kg) and coarse inertia, distributed over the steps of a cycle. A cycle has up
//! to five stages. A step does a part of its work that grows with the rate of deformation, at most all of it. The
//! refresh only uses states after accepted steps.
//!
//! ```text
//! elements   D_a (bound) and S = (1 + k) Mc + s_c D^2 / 4 Kc
//! nodes      N_a and a bound of G (nodal_sums.rs); in slow motion G in sums of the cells (projected_inertia.rs)
//! cells      in slow motion G from those sums
//! inversions in slow motion G^-1, then S^-1; all is in use from then on
//! ```
//! In fast motion the bound replaces `G`, as a cycle may take only a few steps. Mass scaling has only the first two
//! stages. An inverse is in use only if it
//! is sound (inversion.rs).

use super::assembly::{Assembly, BATCH, ElementTangent};
use super::dense::stride;
use super::frames::{Frames, Rotation};
use super::inversion::Inversion;
use super::lattice::{Lattice, LatticeNode, rank_of};
use super::matrices::{Matrices, invert_axes};
use super::nodal_strain::{self, write_stabilising};
use super::nodal_sums::{self, FunctionInertia, add_mass, fill_held_axes, write_mass};
use super::node::Scaling;
use super::node_refresh::{NODE_BATCH, NodeBatch};
use super::node_tables::NodeTables;
use super::projected_inertia::{CellSums, add_cell};
use super::report::AddedInertiaSums;
use super::transport::invert_edges;
use super::{DRAG_AT_WHOLE_CYCLES, DRAG_OF_ADDED, LARGEST_DRAG};
use crate::copy::copy;
use crate::element::{ElementMaterial, ElementTile, MatrixSums, OwnPressure, TileBounds, TileTangents, tile_bounds};
use crate::scene::SceneView;
use crate::simd::{Gather, NodeVector, Scatter, TILE};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Elements,
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
    /// Cost of the work that is due now, and cost of the work of a cycle.
    due: i64,
    cost: i64,
    /// The share of a cycle that the motion of the last step asks for; may exceed one.
    pace: f32,
    /// Largest number of steps of a cycle, and whether one has ended.
    steps: u32,
    ended: bool,
    /// Stiffness of volume and of shear: of the present cycle, and of the last complete one.
    next_stiffness: Stiffness,
    stiffness: Stiffness,
    /// Nothing is in use yet that belongs to this motion.
    first_cycle: bool,
    pub(super) frames: Frames,
    /// Step count of the state for which the frames were computed.
    frames_at: Option<u64>,
    /// The inversions of this cycle.
    inversion: Inversion,
    /// Whether those of the matrices in use were.
    pub(super) lattice_in_use: bool,
    /// Added inertia: sums of the present cycle, and of the last complete one.
    next_added: AddedInertiaSums,
    pub(super) added: AddedInertiaSums,
    /// Whether the present cycle is slow enough for `G`, and whether `G` is in use, else its bound.
    slow: bool,
    pub(super) fine_in_use: bool,
}

/// Measured costs of a tile, of a tile without a lattice, of both with patches of nodal strain, of a cell and of a
/// node. The unit is the time of a floating-point operation of a pivot.
const TILE_COST: i64 = 47_000;
const TILE_UNCOUPLED_COST: i64 = 18_000;
const PATCH_TILE_COST: i64 = 600_000;
const PATCH_TILE_UNCOUPLED_COST: i64 = 30_000;
const CELL_COST: i64 = 16_000;
const NODE_COST: i64 = 1_500;

/// Tiles of a batch.
const BATCH_TILES: usize = BATCH / TILE;

/// Cost of a tile.
const fn tile_cost(functions: usize) -> i64 {
    if functions > 0 { TILE_COST } else { TILE_UNCOUPLED_COST }
}

/// Cost of a tile of patches.
const fn patch_tile_cost(functions: usize) -> i64 {
    if functions > 0 { PATCH_TILE_COST } else { PATCH_TILE_UNCOUPLED_COST }
}

/// Change of the lattice's shape within which a cycle has to end, for tissue that is as stiff in volume as in shear.
const LARGEST_CHANGE: f32 = 0.8;

/// Least sensitivity to a change of shape: the stiffness changes with the shape for any tissue.
const LEAST_SENSITIVITY: f32 = 8.0;

/// Share of a cycle in a step above which `G` is replaced by its bound.
const SLOW: f32 = 0.5;

/// Sums over the elements of the bounds of volume and shear stiffness, kg.
#[derive(Clone, Copy, Debug)]
struct Stiffness {
    volume: f32,
    shear: f32,
}

impl Stiffness {
    const NONE: Self = Self { volume: 0.0, shear: 0.0 };

    fn add(&mut self, tangents: &TileTangents) {
        for [_, outer, exchanged, _] in tangents.factors {
            self.volume += outer;
            self.shear += 2.0 * exchanged;
        }
    }

    /// How much sooner bounds are out of date than with equal stiffness of volume and shear. A change `e` of shape
    /// gives motion without change of volume a share `e^2` of the stiffness of volume.
    fn sensitivity(&self) -> f32 {
        libm::sqrtf(1.0 + self.volume / self.shear.max(f32::MIN_POSITIVE))
    }
}

/// Inputs of a refresh.
pub(super) struct RefreshInput<'a, M> {
    pub(super) scene: SceneView<'a, M>,
    pub(super) displacement: &'a [NodeVector],
    /// Of the nodes, for materials with nodal pressure.
    pub(super) volume: &'a [NodeVector],
    pub(super) increment: &'a mut [NodeVector],
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) order: &'a [u32],
    pub(super) scaling: &'a Scaling,
}

impl<M> RefreshInput<'_, M> {
    /// The assembly of the coarse stiffness.
    pub(super) fn assembly<'a>(&'a self, matrix: &'a mut [f32], stride: usize) -> Assembly<'a> {
        Assembly { lattice: self.lattice, nodes: self.places, inertia: self.scene.inertia, matrix, stride }
    }
}

impl Refresh {
    pub(super) const NEW: Self = Self {
        stage: Stage::Elements,
        done: 0,
        due: 0,
        cost: 0,
        pace: 0.0,
        steps: 1,
        ended: false,
        next_stiffness: Stiffness::NONE,
        stiffness: Stiffness::NONE,
        first_cycle: true,
        frames: Frames::NONE,
        frames_at: None,
        inversion: Inversion::NEW,
        lattice_in_use: false,
        next_added: AddedInertiaSums::NEW,
        added: AddedInertiaSums::NEW,
        slow: true,
        fine_in_use: true,
    };

    /// Cycles of `steps` steps for a scene, and a lattice with this many functions and cells.
    pub(super) fn new<M: ElementMaterial>(steps: u32, scene: SceneView<'_, M>, functions: usize, cells: usize) -> Self {
        let (nodes, tiles) = (scene.node_count(), scene.tiles.len());
        let bounds = if scene.element().is_nodal_strain() {
            scene.patches.tiles().len() as i64 * patch_tile_cost(functions)
        } else {
            tiles.next_multiple_of(BATCH_TILES) as i64 * tile_cost(functions)
        };
        let whole = bounds
            + nodes.next_multiple_of(NODE_BATCH) as i64 * NODE_COST
            + cells as i64 * CELL_COST
            + 2 * Inversion::cost(functions);
        Self { cost: whole, steps, ..Self::NEW }
    }

    pub(super) const fn set_steps(&mut self, steps: u32) {
        self.steps = steps;
    }

    pub(super) const fn steps(&self) -> u32 {
        self.steps
    }

    /// The share of the last increment's unresolved deformation of the lattice that a step removes. Deformation is fed
    /// by `S` changing while velocities are kept, so the share follows the rate of that change.
    pub(super) fn drag(&self) -> f32 {
        (DRAG_OF_ADDED * self.added.mean()).max(DRAG_AT_WHOLE_CYCLES * self.pace).min(LARGEST_DRAG)
    }

    /// Computes the frames, unless that was done for this state, which has taken `steps` steps.
    pub(super) fn update_frames(&mut self, displacement: &[NodeVector], steps: u64) {
        if self.frames_at != Some(steps) {
            self.frames.update(displacement);
            self.frames_at = Some(steps);
        }
    }

    /// Does one step's part of the cycle, after step number `steps`, in which the shape of the lattice has changed by
    /// `change` (strain, or rad of bending): the faster the tissue deforms, the more of the cycle. Where one step is
    /// more than bounds can be out of date, it does a whole cycle from the start.
    pub(super) fn advance<M: ElementMaterial>(
        &mut self,
        steps: u64,
        change: f32,
        mut input: RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) {
        self.update_frames(input.displacement, steps);
        let pace = change * self.stiffness.sensitivity().max(LEAST_SENSITIVITY) / LARGEST_CHANGE;
        self.pace = pace;
        if self.stage == Stage::Elements {
            self.slow = pace < SLOW;
        }
        if pace < 1.0 {
            self.due += (pace.max(1.0 / self.steps as f32) * self.cost as f32) as i64 + 1;
            while self.due > 0 {
                self.due -= self.work(&mut input, tables, matrices);
            }
        } else {
            self.slow = false;
            self.restart(input, tables, matrices);
        }
    }

    /// Does a whole cycle at once, from the start.
    pub(super) fn restart<M: ElementMaterial>(
        &mut self,
        mut input: RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) {
        self.due = 0;
        self.enter(Stage::Elements);
        self.ended = false;
        while !self.ended {
            self.work(&mut input, tables, matrices);
        }
    }

    /// Does the whole first cycle at once.
    pub(super) fn whole_cycle<M: ElementMaterial>(
        &mut self,
        mut input: RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) {
        let (lattice, functions) = (input.lattice, input.lattice.functions());
        if functions > 0 {
            write_mass(matrices.mass, lattice, input.places, input.scene.inertia);
            self.inversion.sound &= invert_axes(matrices.mass_inverse, matrices.mass, functions);
            self.inversion.sound &= invert_edges(matrices.edge_inverse, lattice);
            if input.scene.element().is_nodal_strain() {
                write_stabilising(matrices.stabilising, matrices.next_coarse, &input);
            }
        }
        self.frames.update(input.displacement);
        while self.first_cycle {
            self.work(&mut input, tables, matrices);
        }
    }

    /// Does a whole cycle at once for a state that does not follow from the last one.
    pub(super) fn renew<M: ElementMaterial>(
        &mut self,
        mut input: RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) {
        // Twice: no rotation in the latest step.
        self.frames.update(input.displacement);
        self.frames.update(input.displacement);
        self.frames_at = None;
        (self.due, self.pace) = (0, 0.0);
        (self.first_cycle, self.slow) = (true, true);
        self.enter(Stage::Elements);
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
        if at == 0 && self.stage == Stage::Elements {
            self.start_cycle(input, tables, matrices);
        }
        match self.stage {
            Stage::Elements if input.scene.element().is_nodal_strain() => self.add_patches(input, tables, matrices, at),
            Stage::Elements => self.add_elements(input, tables, matrices, at),
            Stage::Nodes => self.add_nodes(input, tables, matrices, at),
            Stage::NodeCells => self.add_node_cell(input, matrices, at),
            Stage::InvertFine => self.invert_fine(input, matrices, at),
            Stage::InvertCoarse => self.invert_coarse(input, tables, matrices, at),
        }
    }

    /// The bounds of the elements of batch `at` of the tiles. Not inlined: inversions do without its stack.
    #[inline(never)]
    fn add_elements<M: ElementMaterial>(
        &mut self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        let functions = input.lattice.functions();
        let mut batch = [ElementTangent::NONE; BATCH];
        let mut parts = batch.chunks_exact_mut(TILE);
        for at in at * BATCH_TILES..self.done * BATCH_TILES {
            let part = parts.next().unwrap_or_default();
            if functions > 0 {
                let places = input.order.chunks(TILE).nth(at).unwrap_or_default();
                let tile = ElementTile::gather(input.scene.tiles, places);
                self.add_tile(input, tables, &tile, part.get_mut(..places.len()).unwrap_or_default());
            } else if let Some(tile) = input.scene.tiles.get(at) {
                self.add_tile(input, tables, tile, &mut []);
            }
        }
        if functions > 0 {
            let stride = stride(functions);
            let elements = input.order.len().saturating_sub(at * BATCH);
            input.assembly(matrices.next_coarse, stride).add(batch.get(..elements).unwrap_or(&batch));
        }
        let tiles = if functions > 0 { input.order.len().div_ceil(TILE) } else { input.scene.tiles.len() };
        if self.done * BATCH_TILES >= tiles {
            self.enter(Stage::Nodes);
        }
        BATCH_TILES as i64 * tile_cost(functions)
    }

    /// The bounds of tile `at` of the patches of nodal strain, and of as large a share of the elements, those that are
    /// crushed. Not inlined, as above.
    #[inline(never)]
    fn add_patches<M: ElementMaterial>(
        &mut self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        let functions = input.lattice.functions();
        let (tiles, stride) = (input.scene.patches.tiles(), stride(functions));
        if let Some(tile) = tiles.get(at) {
            let mut assembly = (functions > 0).then(|| input.assembly(matrices.next_coarse, stride));
            let tangents = nodal_strain::add_tile(input, &self.frames, tables, tile, assembly.as_mut());
            nodal_strain::add_crushed(input, &self.frames, tables, (at, tiles.len()), assembly.as_mut());
            if functions > 0 {
                self.next_stiffness.add(&tangents);
            }
        }
        if self.done >= tiles.len() {
            self.enter(Stage::Nodes);
        }
        patch_tile_cost(functions)
    }

    /// Prepares sums and matrices for the bounds of a cycle.
    fn start_cycle<M>(
        &mut self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) {
        let functions = input.lattice.functions();
        tables.clear_sums();
        (self.next_stiffness, self.next_added) = (Stiffness::NONE, AddedInertiaSums::NEW);
        let factor = 1.0 + input.scaling.k;
        matrices.next_coarse.fill(0.0);
        add_mass(matrices.next_coarse, stride(functions), matrices.mass, functions, factor);
        add_mass(matrices.next_coarse, stride(functions), matrices.stabilising, functions, 1.0);
        self.frames.start_cycle();
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
            matrices.next_bound.fill(FunctionInertia::default());
            if self.slow {
                matrices.next_fine.fill(0.0);
                matrices.sums.fill(CellSums::NONE);
            }
        }
        self.refresh_nodes(input, tables, matrices, at * NODE_BATCH);
        if self.done * NODE_BATCH >= input.scene.node_count() {
            if input.lattice.functions() > 0 {
                self.enter(if self.slow { Stage::NodeCells } else { Stage::InvertCoarse });
            } else {
                self.end(input.places, tables, matrices);
            }
        }
        NODE_BATCH as i64 * NODE_COST
    }

    /// The sums over nodes of cell `at`, added to the next `G`.
    fn add_node_cell<M>(&mut self, input: &RefreshInput<'_, M>, matrices: &mut Matrices<'_>, at: usize) -> i64 {
        let lattice = input.lattice;
        if let Some(sums) = matrices.sums.get_mut(at) {
            add_cell(matrices.next_fine, stride(lattice.functions()), lattice.functions_of(at), sums);
        }
        if self.done >= lattice.cell_count() {
            self.enter(Stage::InvertFine);
        }
        CELL_COST
    }

    /// A part of the inversion of the next `G`.
    fn invert_fine<M>(&mut self, input: &RefreshInput<'_, M>, matrices: &mut Matrices<'_>, at: usize) -> i64 {
        if at == 0 {
            fill_held_axes(matrices.next_fine, matrices.mass, input.lattice.functions());
        }
        let (cost, ended) = self.inversion.advance(matrices.next_fine, matrices.mass, input.lattice.functions(), at);
        if ended {
            self.enter(Stage::InvertCoarse);
        }
        cost
    }

    /// A part of the inversion of the next `S`.
    fn invert_coarse<M>(
        &mut self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
    ) -> i64 {
        let (cost, ended) = self.inversion.advance(matrices.next_coarse, matrices.mass, input.lattice.functions(), at);
        if ended {
            self.end(input.places, tables, matrices);
        }
        cost
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.done = 0;
    }

    /// Ends the cycle: its results are in use from now on.
    fn end(&mut self, places: &[LatticeNode], tables: &mut NodeTables<'_>, matrices: &mut Matrices<'_>) {
        tables.put_in_use(places, self.first_cycle);
        self.put_in_use(matrices);
        self.enter(Stage::Elements);
    }

    /// Adds the bounds of the elements of a tile to the sums of the nodes. With a lattice, writes their tangents.
    fn add_tile<M: ElementMaterial>(
        &mut self,
        input: &RefreshInput<'_, M>,
        tables: &mut NodeTables<'_>,
        tile: &ElementTile,
        elements: &mut [ElementTangent],
    ) {
        let displacement = Gather::new(input.displacement);
        let has_lattice = input.lattice.functions() > 0;
        let mut rotations = [Rotation::NONE.0; TILE];
        for (lane, rotation) in rotations.iter_mut().enumerate() {
            let rank = rank_of(input.places, tile.node(0, lane));
            *rotation = self.frames.since_start(tables.frame(rank)).0;
        }
        let diagonal = Scatter::new(tables.sum_diagonal);
        let sums = MatrixSums { diagonal, off_diagonal: Scatter::new(tables.sum_off_diagonal) };
        let laws = input.scene.material.laws();
        let weight = if has_lattice { input.scaling.coarse_weight } else { 0.0 };
        let rotations = &rotations;
        let tangents = tile_bounds(
            input.scene.element(),
            TileBounds { laws, pressure: OwnPressure, tile, displacement, sums, rotations, weight },
            input.volume,
        );
        if has_lattice {
            self.next_stiffness.add(&tangents);
            for (lane, element) in elements.iter_mut().enumerate() {
                *element = ElementTangent::of(tile, &tangents, lane);
            }
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
        let RefreshInput { scene, increment, lattice, places, scaling, .. } = input;
        let (bounds, added) = (&mut *matrices.next_bound, &mut self.next_added);
        let sums = if self.slow { &mut *matrices.sums } else { &mut [] };
        let inertia = scene.inertia;
        let places = if lattice.functions() > 0 { *places } else { &[] };
        let moving = (!self.lattice_in_use && !self.first_cycle).then_some((&mut **increment, &self.frames));
        NodeBatch { inertia, moving, lattice, places, scaling, added, tables, bounds, sums, first }.dispatched();
    }

    /// Puts the matrices of the cycle into use, and prepares the next cycle.
    fn put_in_use(&mut self, matrices: &mut Matrices<'_>) {
        if self.inversion.sound {
            copy(matrices.coarse_inverse, matrices.next_coarse);
            nodal_sums::invert(matrices.bound_inverse, matrices.next_bound);
            if self.slow {
                copy(matrices.fine_inverse, matrices.next_fine);
            }
        } else {
            matrices.coarse_inverse.fill(0.0);
            matrices.fine_inverse.fill(0.0);
            matrices.bound_inverse.fill(FunctionInertia::default());
        }
        self.lattice_in_use = self.inversion.sound;
        self.fine_in_use = self.slow;
        self.ended = true;
        (self.stiffness, self.next_stiffness) = (self.next_stiffness, Stiffness::NONE);
        self.frames.end_cycle();
        self.added = self.next_added;
        self.next_added = AddedInertiaSums::NEW;
        self.inversion.sound = true;
        self.first_cycle = false;
    }
}
