//! The refresh of bounds, inertia and coarse inertia, spread over steps: a cycle of six stages (elements,
//! cells, nodes, cells, two inversions), each step taking an equal part of the whole cycle's work. It only ever looks at
//! the state after an accepted step.
//!
//! ```text
//! elements   D_a (bound) and s_c D^2 / 4 Kc, most of it in sums of the lattice's cells
//! cells      S = those sums
//! nodes      N_a, Mc and G = W^T (N + reserve m) W in sums of the cells, p = W^T (N + reserve m) v
//! cells      S += (1 + k) Mc, G
//! inversions G^-1, then S^-1; N_a and X = S^-1 - G^-1 are in use from then on
//! ```
//! Mass scaling has the elements' `D_a` and the nodes' `N_a` alone.
//! The coarse part of the velocity is `c = G^-1 p`, its energy `c^T S c`. As for the nodes
//! ([`super::node`]), a change of `S` may not add energy: `c` is scaled down to what it had.

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use super::assembly::{Assembly, CellSums, NodeMatrices};
use super::block::OneBlock;
use super::bound::MatrixSums;
use super::dense::{Row, apply, mirror, stride, sweep};
use super::frames::{Frames, Rotation, turn};
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS, place_of};
use super::matrices::{Matrices, copy, invert_means};
use super::node::{Scaling, renew};
use super::report::Tally;
use super::vectors::{NodeTables, read_matrices, write_matrices};
use super::{COARSE, FINE};
use crate::lanes::{BLOCK, Chosen, Gather, Kernel, NodeVector, Real, Rows, Scatter, dispatch};
use crate::material::{Law, Material};
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::symmetric::Symmetric;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Elements,
    ElementCells,
    Nodes,
    NodeCells,
    Fine,
    Next,
}

/// Where the cycle is, and what it hands to the step.
#[derive(Clone, Debug)]
pub(super) struct Refresh {
    stage: Stage,
    /// Blocks, nodes or pivots done in this stage.
    done: usize,
    credit: i64,
    per_step: i64,
    steps: u32,
    /// Nothing has been computed yet.
    first: bool,
    pub(super) frames: Frames,
    /// Steps of the state that the frames last looked at.
    seen: Option<u64>,
    /// Coarse velocity to be taken away by the next step, m a step.
    pub(super) correction: CoarseVectors,
    momentum: CoarseVectors,
    /// Share of `X` in the last step, and what the velocities have to be multiplied by in the next one.
    share: f32,
    pub(super) brake: f32,
    sound: bool,
    /// What is in use was sound.
    pub(super) lattice_in_use: bool,
    tally: Tally,
    /// Of the last whole cycle.
    pub(super) published: Tally,
}

/// Nodes that are done together.
const TOGETHER: usize = 8;

/// Cost of a block, one without a lattice, a cell, a node and a number of a row that is mirrored, in floating-point operations of a pivot
/// that take as long (measured).
const BLOCK_COST: i64 = 47_000;
const BLOCK_ALONE_COST: i64 = 18_000;
const CELL_COST: i64 = 16_000;
const NODE_COST: i64 = 1_500;
const ROW_COST: i64 = 12;

/// Cost of a block.
const fn block_cost(functions: usize) -> i64 {
    if functions > 0 { BLOCK_COST } else { BLOCK_ALONE_COST }
}

/// Rounding in sums over the lattice.
const SLACK: f32 = 1e-3;

/// Share of `X` below which a smaller one brakes.
const BRAKED: f32 = 0.5;
/// Largest error of an inverse.
const UNSOUND: f32 = 0.05;

const NO_VECTORS: CoarseVectors = [NodeVector::ZERO; MAX_FUNCTIONS + 1];

/// What a refresh reads, and the velocities that it may scale.
pub(super) struct Sources<'a, M, N, B> {
    pub(super) scene: &'a Scene<M, N, B>,
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a mut [NodeVector],
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) scaling: &'a Scaling,
}

impl<M, N, B> Sources<'_, M, N, B>
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    fn assembly<'a>(
        &'a self,
        matrix: &'a mut [f32],
        sums: &'a mut [CellSums],
        stride: usize,
    ) -> Assembly<'a> {
        Assembly {
            lattice: self.lattice,
            nodes: self.places,
            inertia: self.scene.inertia(),
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
        credit: 0,
        per_step: 0,
        steps: 1,
        first: true,
        frames: Frames::NONE,
        seen: None,
        correction: NO_VECTORS,
        momentum: NO_VECTORS,
        share: 1.0,
        brake: 1.0,
        sound: true,
        lattice_in_use: false,
        tally: Tally::NEW,
        published: Tally::NEW,
    };

    /// A cycle of `steps` steps over a scene with this many blocks and nodes.
    pub(super) fn over(steps: u32, blocks: usize, nodes: usize, functions: usize, cells: usize) -> Self {
        let whole = blocks as i64 * block_cost(functions)
            + 2 * cells as i64 * CELL_COST
            + nodes.next_multiple_of(TOGETHER) as i64 * NODE_COST
            + 2 * functions as i64 * (pivots_cost(functions) + 3 * row_cost(functions));
        Self { per_step: whole / i64::from(steps.max(1)) + 1, steps, ..Self::NEW }
    }

    pub(super) const fn steps(&self) -> u32 {
        self.steps
    }

    /// Looks where the frames are, if the state has moved since: `steps` is how many it has taken.
    pub(super) fn look(&mut self, displacement: &[NodeVector], steps: u64) {
        if self.seen != Some(steps) {
            self.frames.look(displacement);
            self.seen = Some(steps);
        }
    }

    /// One step's part of the cycle, after step number `steps`.
    pub(super) fn advance<M, N, B>(
        &mut self,
        steps: u64,
        mut from: Sources<'_, M, N, B>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        self.credit += self.per_step;
        self.look(from.displacement, steps);
        while self.credit > 0 {
            self.credit -= self.work(&mut from, tables, matrices);
        }
    }

    /// A whole cycle at once.
    pub(super) fn complete<M, N, B>(
        &mut self,
        mut from: Sources<'_, M, N, B>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        self.frames.look(from.displacement);
        while self.first {
            self.work(&mut from, tables, matrices);
        }
    }

    /// The next piece of work, with its cost.
    fn work<M, N, B>(
        &mut self,
        from: &mut Sources<'_, M, N, B>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) -> i64
    where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        let functions = from.lattice.functions();
        let (size, stride) = (3 * functions, stride(functions));
        let at = self.done;
        self.done += 1;
        match self.stage {
            Stage::Elements => {
                if at == 0 {
                    tables.clear_sums();
                    matrices.next.fill(0.0);
                    matrices.sums.fill(CellSums::NONE);
                    self.frames.start_cycle();
                }
                self.elements(from, tables, matrices, at, stride);
                if self.done >= from.scene.blocks().len() {
                    self.enter(if functions > 0 { Stage::ElementCells } else { Stage::Nodes });
                }
                block_cost(functions)
            }
            Stage::ElementCells => {
                from.assembly(matrices.next, matrices.sums, stride).add_cell(at);
                if self.done >= from.lattice.cell_count() {
                    self.enter(Stage::Nodes);
                }
                CELL_COST
            }
            Stage::Nodes => {
                if at == 0 {
                    matrices.fine.fill(0.0);
                    self.momentum = NO_VECTORS;
                }
                self.nodes(from, tables, matrices, at * TOGETHER);
                if self.done * TOGETHER >= from.scene.node_count() {
                    if functions > 0 {
                        self.enter(Stage::NodeCells);
                    } else {
                        self.end(tables, matrices);
                    }
                }
                TOGETHER as i64 * NODE_COST
            }
            Stage::NodeCells => {
                let mass_alone = match &mut matrices.damped {
                    Some(damped) => &mut *damped.next_mass,
                    None => &mut [],
                };
                if at == 0 {
                    mass_alone.fill(0.0);
                }
                let (inertia, mass) = (&mut *matrices.fine, &mut *matrices.next);
                if let Some(sums) = matrices.sums.get_mut(at) {
                    NodeMatrices {
                        lattice: from.lattice,
                        inertia,
                        mass,
                        mass_alone,
                        momenta: &mut self.momentum,
                        stride,
                    }
                    .add_cell(at, sums);
                }
                if self.done >= from.lattice.cell_count() {
                    self.enter(Stage::Fine);
                }
                CELL_COST
            }
            Stage::Fine => {
                if let Some(damped) = matrices.damped.as_mut().filter(|_| at == 0) {
                    self.sound &= invert_means(damped.next_mean, matrices.fine, functions, stride);
                }
                if at < functions {
                    self.sound &= sweep(matrices.fine, size, stride, at);
                    return pivots_cost(functions);
                }
                let at = at - functions;
                mirror(matrices.fine, stride, at, -1.0);
                mirror(matrices.next, stride, at, 1.0);
                if let Some(damped) = &mut matrices.damped {
                    mirror(damped.next_mass, stride, at, 1.0);
                }
                if at + 1 == size {
                    self.keep_energy(matrices, size, stride);
                    self.enter(Stage::Next);
                }
                row_cost(functions)
            }
            Stage::Next => {
                if at < functions {
                    self.sound &= sweep(matrices.next, size, stride, at);
                    return pivots_cost(functions);
                }
                let at = at - functions;
                mirror(matrices.next, stride, at, -1.0);
                if at + 1 == size {
                    self.sound &= self.inverted(matrices, size, stride);
                    self.end(tables, matrices);
                }
                row_cost(functions)
            }
        }
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.done = 0;
    }

    /// What the cycle has computed is in use from now on.
    fn end(&mut self, tables: &mut NodeTables<'_>, matrices: &mut Matrices<'_>) {
        tables.put_in_use(self.first);
        self.put_in_use(matrices);
        self.enter(Stage::Elements);
    }

    fn elements<M, N, B>(
        &self,
        from: &Sources<'_, M, N, B>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        at: usize,
        stride: usize,
    ) where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        let displacement = Gather::new(from.displacement);
        let (diagonal, beside) = (Scatter::new(tables.sum_diagonal), Scatter::new(tables.sum_beside));
        let Some(block) = from.scene.blocks().get(at) else {
            return;
        };
        let lattice = from.lattice.functions() > 0;
        let assembly = lattice.then(|| from.assembly(matrices.next, matrices.sums, stride));
        let (sums, next) = (MatrixSums { diagonal, beside }, &*tables.next);
        let laws = from.scene.material().laws();
        let frames = &self.frames;
        let weight = from.scaling.coarse_weight;
        M::Law::bounds_of_block(OneBlock { laws, block, displacement, sums, next, assembly, frames, weight });
    }

    /// Some nodes, from `first` on.
    fn nodes<M, N, B>(
        &mut self,
        from: &mut Sources<'_, M, N, B>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        first: usize,
    ) where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        let Self { frames, tally, first: first_cycle, .. } = self;
        let Sources { scene, increment, lattice, places, scaling, .. } = from;
        let sums = &mut *matrices.sums;
        let first_cycle = *first_cycle;
        let inertia = scene.inertia();
        let places = if lattice.functions() > 0 { *places } else { &[] };
        SomeNodes { inertia, increment, places, scaling, frames, tally, tables, sums, first, first_cycle }
            .dispatched();
    }

    /// The share of `X` that a step used. A smaller one is a larger inertia of the lattice: as for the nodes no
    /// energy may come of that, and all velocities are scaled, for want of the lattice's own. Only a share that is
    /// small brakes: each fall of a large one would cost more motion than it protects.
    pub(super) fn share(&mut self, share: f32) {
        let (now, last) = (share.min(BRAKED), self.share.min(BRAKED));
        self.brake = if now < last { libm::sqrtf(now / last) } else { 1.0 };
        self.share = share;
    }

    /// What has to go from the coarse velocity so that the next `S` adds no energy. `G` is inverted,
    /// the next `S` not yet.
    fn keep_energy(&mut self, matrices: &mut Matrices<'_>, size: usize, stride: usize) {
        let momentum = to_numbers(&self.momentum);
        let momentum = momentum.get(..size).unwrap_or_default();
        let velocity = apply(matrices.fine, stride, momentum);
        let velocity = velocity.get(..size).unwrap_or_default();
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        let energy = |matrix: &[f32], velocity: &[f32]| dot(velocity, &apply(matrix, stride, velocity));
        // The velocity in the frames of `S` in use, and in the world.
        let mut world = NO_VECTORS;
        from_numbers(velocity, &mut world);
        turn(&mut world, &self.frames.of_cycle, Rotation::out);
        let mut vectors = world;
        turn(&mut vectors, &self.frames.of_bounds, Rotation::back);
        let old = to_numbers(&vectors);
        let before = energy(matrices.kept, old.get(..size).unwrap_or_default());
        let after = energy(matrices.next, velocity);
        // `S <= COARSE / FINE G`, so `c^T S c` is at most as many times `c^T p`: where it is not, `G` was too
        // ill-conditioned to be inverted. Then the velocity means nothing, and `X` will not be used.
        self.sound &= after <= dot(velocity, momentum) * (COARSE / FINE + SLACK);
        if self.sound && !self.first && after > before * (1.0 + 1e-5) && after > 0.0 {
            let lost = 1.0 - libm::sqrtf(if before > 0.0 { before / after } else { 0.0 });
            for (correction, velocity) in self.correction.iter_mut().zip(&world) {
                correction.0 = velocity.0.map(|component| lost * component);
            }
        }
        copy(matrices.kept, matrices.next);
    }

    /// Whether `S S^-1 p = p`, up to what rounding may do.
    fn inverted(&self, matrices: &Matrices<'_>, size: usize, stride: usize) -> bool {
        let momentum = to_numbers(&self.momentum);
        let momentum = momentum.get(..size).unwrap_or_default();
        let solved = apply(matrices.next, stride, momentum);
        let back = apply(matrices.kept, stride, solved.get(..size).unwrap_or_default());
        let (mut error, mut all) = (0.0, 0.0);
        for (back, momentum) in back.iter().zip(momentum) {
            error += (back - momentum) * (back - momentum);
            all += momentum * momentum;
        }
        error <= UNSOUND * UNSOUND * all
    }

    fn put_in_use(&mut self, matrices: &mut Matrices<'_>) {
        let inverses = matrices.next.iter().zip(matrices.fine.iter());
        for (applied, (next, fine)) in matrices.applied.iter_mut().zip(inverses) {
            *applied = if self.sound { next - fine } else { 0.0 };
        }
        if let Some(damped) = &mut matrices.damped {
            copy(damped.inverse, matrices.next);
            copy(damped.mass, damped.next_mass);
            copy(damped.mean, damped.next_mean);
        }
        self.lattice_in_use = self.sound;
        self.frames.end_cycle();
        self.published = self.tally;
        self.tally = Tally::NEW;
        self.sound = true;
        self.first = false;
    }
}

/// A multiplication and an addition for each number of the lower triangle and each of three pivots.
fn pivots_cost(functions: usize) -> i64 {
    3 * (3 * functions * stride(functions)) as i64
}

fn row_cost(functions: usize) -> i64 {
    ROW_COST * stride(functions) as i64
}

/// Three numbers a function.
pub(super) fn to_numbers(vectors: &CoarseVectors) -> Row {
    let mut numbers = [0.0; _];
    for (three, vector) in numbers.as_chunks_mut::<3>().0.iter_mut().zip(vectors) {
        *three = vector.to_array();
    }
    numbers
}

/// `vectors = numbers`; vectors beyond the numbers are left as they are.
pub(super) fn from_numbers(numbers: &[f32], vectors: &mut CoarseVectors) {
    for (&[x, y, z], vector) in numbers.as_chunks::<3>().0.iter().zip(vectors) {
        vector.0 = [x, y, z, 0.0];
    }
}

struct SomeNodes<'a, 'b> {
    inertia: &'a [NodeInertia],
    increment: &'a mut [NodeVector],
    /// None without a lattice.
    places: &'a [LatticeNode],
    scaling: &'a Scaling,
    frames: &'a Frames,
    tally: &'a mut Tally,
    tables: &'a mut NodeTables<'b>,
    sums: &'a mut [CellSums],
    first: usize,
    /// Nothing is in use yet.
    first_cycle: bool,
}

impl SomeNodes<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    fn dispatched(self) {
        dispatch(self);
    }
}

impl Kernel for SomeNodes<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(mut self) {
        let (first, count) = (self.first, self.inertia.len());
        // Lanes beyond the last node repeat it.
        let mut rows = [0; BLOCK];
        for (lane, row) in rows.iter_mut().enumerate().take(TOGETHER) {
            let at = (first + lane).min(count.saturating_sub(1));
            *row = self.places.get(at).map_or(at, LatticeNode::node) as u32;
        }
        if let Some(rows) = Chosen::below::<R>(rows, count) {
            self.nodes::<R::Eight, R>(rows, count - first.min(count));
        }
    }
}

impl SomeNodes<'_, '_> {
    /// Nodes side by side, as many as are left; `W` is as wide as can be.
    #[inline(always)]
    fn nodes<R: Real, W: Real>(&mut self, rows: Chosen, left: usize) {
        const { assert!(R::COUNT == TOGETHER) };
        let Self { inertia, increment, places, scaling, frames, tally, tables, sums, .. } = self;
        let [x, y, z, mass] = rows.read::<R>(must_cast_slice(inertia));
        let free = [x, y, z];
        let [vx, vy, vz, spare] = rows.read::<R>(must_cast_slice(increment));
        let velocity = [vx, vy, vz];
        let (mut since_start, mut since_bounds) = ([Rotation::NONE; TOGETHER], [Rotation::NONE; TOGETHER]);
        for (lane, (start, bounds)) in since_start.iter_mut().zip(&mut since_bounds).enumerate() {
            let frame = tables.frame(rows.number::<R>(lane));
            (*start, *bounds) = (frames.since_start(frame), frames.since_bounds(frame));
        }
        let turned = back(&since_start, velocity);
        let (stiffness, [scalar, _]) = read_matrices(rows, tables.sum_diagonal, tables.sum_beside);
        let old = (!self.first_cycle).then(|| {
            let inverse = read_matrices(rows, tables.inverse_diagonal, tables.inverse_beside).0;
            (inverse, back(&since_bounds, velocity))
        });
        let renewed = renew(free, mass, stiffness, old, turned, scaling);
        let beside = [scalar, R::splat(0.0)];
        write_matrices(rows, tables.sum_diagonal, tables.sum_beside, &renewed.inverse, beside);
        let mut kept = velocity;
        for axis in 0..3 {
            kept[axis] = free[axis].choose(velocity[axis] * renewed.velocity, velocity[axis]);
        }
        rows.write(must_cast_slice_mut(increment), [kept[0], kept[1], kept[2], spare]);
        for lane in 0..left.min(R::COUNT) {
            tally.add(rows.number::<R>(lane), renewed.added.lane(lane));
        }

        if places.is_empty() {
            return;
        }
        let [vx, vy, vz] = turned;
        let pushed =
            renewed.inertia.times([vx * renewed.velocity, vy * renewed.velocity, vz * renewed.velocity]);
        for lane in 0..left.min(R::COUNT) {
            let node = rows.number::<R>(lane);
            let (Some(place), Some(inertia)) = (place_of(places, node), inertia.get(node)) else {
                continue;
            };
            // A held axis follows its support and has no inertia here.
            let mass = inertia.free() * inertia.mass * (1.0 + scaling.k);
            let Symmetric { xx, yy, zz, xy, yz, zx } = renewed.inertia;
            let of = |entry: R| entry.lane(lane);
            let matrix = Symmetric { xx: of(xx), yy: of(yy), zz: of(zz), xy: of(xy), yz: of(yz), zx: of(zx) };
            let [x, y, z] = pushed;
            if let Some(sums) = sums.get_mut(place.cell()) {
                sums.add_node::<W>(place, &matrix, mass.truncate().to_array(), [of(x), of(y), of(z)]);
            }
        }
    }
}

/// Vectors of nodes side by side turned back into their frames.
#[inline(always)]
fn back<R: Real>(turns: &[Rotation; TOGETHER], vectors: [R; 3]) -> [R; 3] {
    let mut back = [R::splat(0.0); 3];
    for (row, along) in vectors.into_iter().enumerate() {
        for column in 0..3 {
            let entry = R::from_fn(|lane| turns[lane % TOGETHER].0[row][column]);
            back[column] = back[column] + entry * along;
        }
    }
    back
}
