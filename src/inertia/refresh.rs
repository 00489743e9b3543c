//! The refresh of bounds, inertia and coarse inertia, spread over steps: a cycle of five stages (elements,
//! cells, nodes, two inversions), each step taking an equal part of the whole cycle's work. It only ever looks at
//! the state after an accepted step.
//!
//! ```text
//! elements   D_a (bound) and s_c D^2 / 4 Kc, most of it in sums of the lattice's cells
//! cells      S = those sums
//! nodes      N_a; S += (1 + k) Mc, G = W^T (N + reserve m) W, p = W^T (N + reserve m) v
//! inversions G^-1, then S^-1; N_a and X = S^-1 - G^-1 are in use from then on
//! ```
//! The coarse part of the velocity is `c = G^-1 p`, its energy `c^T S c`. As for the nodes
//! ([`super::node`]), a change of `S` may not add energy: `c` is scaled down to what it had.

use super::assembly::{Assembly, Element, NO_SLOTS, NodeMatrices, NodeSums};
use super::bound::{Bound, MatrixBeside};
use super::dense::{Row, apply, mirror, stride, sweep};
use super::frames::{Frames, Rotation, turn};
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS, restrict};
use super::node::{Scaling, renew};
use super::report::Tally;
use super::vectors::NodeTables;
use super::{COARSE, FINE};
use crate::lanes::{BLOCK, Gather, Kernel, NodeVector, Real, Scatter, dispatch};
use crate::material::{Law, Local, Material};
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::tled::Deformation;

/// The four dense matrices of a lattice.
pub(super) struct Matrices<'a> {
    /// `X`, what a step applies.
    pub(super) applied: &'a mut [f32],
    /// `S` of `X`, not inverted.
    kept: &'a mut [f32],
    /// The next `S`.
    next: &'a mut [f32],
    /// The next `G`; before, the sums of the cells.
    fine: &'a mut [f32],
}

/// Numbers that the matrices of a lattice with this many functions need.
pub(super) const fn numbers_for(functions: usize) -> usize {
    4 * 3 * functions * stride(functions)
}

impl<'a> Matrices<'a> {
    pub(super) fn split(dense: &'a mut [f32], functions: usize) -> Option<Self> {
        let one = 3 * functions * stride(functions);
        let (applied, rest) = dense.split_at_mut_checked(one)?;
        let (kept, rest) = rest.split_at_mut_checked(one)?;
        let (next, rest) = rest.split_at_mut_checked(one)?;
        Some(Self { applied, kept, next, fine: rest.get_mut(..one)? })
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Elements,
    Cells,
    Nodes,
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
    /// Coarse velocity to be taken away by the next step, m a step.
    pub(super) correction: CoarseVectors,
    momentum: CoarseVectors,
    /// Share of `X` in the last step, and what the velocities have to be multiplied by in the next one.
    share: f32,
    pub(super) brake: f32,
    sound: bool,
    tally: Tally,
    /// Of the last whole cycle.
    pub(super) published: Tally,
}

/// Nodes that are done together.
const TOGETHER: usize = 8;

/// Cost of a block, a cell, a node and a number of a row that is mirrored, in floating-point operations of a pivot
/// that take as long (measured).
const BLOCK_COST: i64 = 36_000;
const CELL_COST: i64 = 3_000;
const NODE_COST: i64 = 4_000;
const ROW_COST: i64 = 12;

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
    /// `s_c D^2 / 4`, s^2.
    pub(super) coarse_weight: f32,
}

impl<M, N, B> Sources<'_, M, N, B>
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
{
    fn assembly<'a>(&'a self, matrix: &'a mut [f32], cells: &'a mut [f32], stride: usize) -> Assembly<'a> {
        Assembly {
            lattice: self.lattice,
            nodes: self.places,
            inertia: self.scene.inertia(),
            matrix,
            stride,
            cells: cells.as_chunks_mut().0,
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
        correction: NO_VECTORS,
        momentum: NO_VECTORS,
        share: 1.0,
        brake: 1.0,
        sound: true,
        tally: Tally::NEW,
        published: Tally::NEW,
    };

    /// A cycle of `steps` steps over a scene with this many blocks and nodes.
    pub(super) fn over(steps: u32, blocks: usize, nodes: usize, functions: usize, cells: usize) -> Self {
        let whole = blocks as i64 * BLOCK_COST
            + cells as i64 * CELL_COST
            + nodes.next_multiple_of(TOGETHER) as i64 * NODE_COST
            + 6 * functions as i64 * (pivot_cost(functions) + row_cost(functions));
        Self { per_step: whole / i64::from(steps) + 1, steps, ..Self::NEW }
    }

    pub(super) const fn steps(&self) -> u32 {
        self.steps
    }

    /// One step's part of the cycle.
    pub(super) fn advance<M, N, B>(
        &mut self,
        mut from: Sources<'_, M, N, B>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
    ) where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        self.credit += self.per_step;
        self.frames.look(from.displacement);
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
                    matrices.fine.fill(0.0);
                    self.frames.start_cycle();
                }
                self.elements(from, tables, matrices, at, stride);
                if self.done >= from.scene.blocks().len() {
                    self.enter(Stage::Cells);
                }
                BLOCK_COST
            }
            Stage::Cells => {
                from.assembly(matrices.next, matrices.fine, stride).add_cell(at);
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
                self.nodes(from, tables, matrices, at * TOGETHER, stride);
                if self.done * TOGETHER >= from.scene.node_count() {
                    self.enter(Stage::Fine);
                }
                TOGETHER as i64 * NODE_COST
            }
            Stage::Fine => {
                if at < size {
                    self.sound &= sweep(matrices.fine, size, stride, at);
                    return pivot_cost(functions);
                }
                mirror(matrices.fine, stride, at - size, -1.0);
                mirror(matrices.next, stride, at - size, 1.0);
                if self.done >= 2 * size {
                    self.keep_energy(matrices, size, stride);
                    self.enter(Stage::Next);
                }
                row_cost(functions)
            }
            Stage::Next => {
                if at < size {
                    self.sound &= sweep(matrices.next, size, stride, at);
                    return pivot_cost(functions);
                }
                mirror(matrices.next, stride, at - size, -1.0);
                if self.done >= 2 * size {
                    self.sound &= self.inverted(matrices, size, stride);
                    tables.put_in_use(self.first);
                    self.put_in_use(matrices);
                    self.enter(Stage::Elements);
                }
                row_cost(functions)
            }
        }
    }

    fn enter(&mut self, stage: Stage) {
        self.stage = stage;
        self.done = 0;
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
        let (Some(displacement), Some(diagonal), Some(beside)) = (
            Gather::new(from.displacement),
            Scatter::new(tables.sum_diagonal),
            Scatter::new(tables.sum_beside),
        ) else {
            return;
        };
        let Some(block) = from.scene.blocks().get(at) else {
            return;
        };
        let assembly = from.assembly(matrices.next, matrices.fine, stride);
        let sums = MatrixBeside { diagonal, beside };
        let material = from.scene.material();
        let frames = &self.frames;
        let weight = from.coarse_weight;
        dispatch(OneBlock { material, block, displacement, sums, assembly, frames, weight });
    }

    /// Some nodes, from `first` on.
    fn nodes<M, N, B>(
        &mut self,
        from: &mut Sources<'_, M, N, B>,
        tables: &mut NodeTables<'_>,
        matrices: &mut Matrices<'_>,
        first: usize,
        stride: usize,
    ) where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        let Self { frames, tally, momentum, first: first_cycle, .. } = self;
        let Sources { scene, increment, lattice, places, scaling, .. } = from;
        let into = NodeMatrices { lattice, inertia: matrices.fine, mass: matrices.next, stride };
        let first_cycle = *first_cycle;
        let inertia = scene.inertia();
        dispatch(SomeNodes {
            inertia,
            increment,
            places,
            scaling,
            frames,
            tally,
            momentum,
            tables,
            into,
            first,
            first_cycle,
        });
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
        matrices.kept.copy_from_slice(matrices.next);
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
        self.frames.end_cycle();
        self.published = self.tally;
        self.tally = Tally::NEW;
        self.sound = true;
        self.first = false;
    }
}

/// A multiplication and an addition for each number of the lower triangle.
fn pivot_cost(functions: usize) -> i64 {
    (3 * functions * stride(functions)) as i64
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
    places: &'a [LatticeNode],
    scaling: &'a Scaling,
    frames: &'a Frames,
    tally: &'a mut Tally,
    momentum: &'a mut CoarseVectors,
    tables: &'a mut NodeTables<'b>,
    into: NodeMatrices<'a>,
    first: usize,
    /// Nothing is in use yet.
    first_cycle: bool,
}

impl Kernel for SomeNodes<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(mut self) {
        let mut sums = NodeSums::NONE;
        let nodes = self.inertia.iter().zip(self.increment.iter_mut()).zip(self.places).enumerate();
        for (node, ((inertia, increment), place)) in nodes.skip(self.first).take(TOGETHER) {
            let (stiffness, scalar) = self.tables.summed(node);
            let velocity = increment.to_array();
            let turned = self.frames.since_start(place.frame()).back(velocity);
            let before = self.frames.since_bounds(place.frame()).back(velocity);
            let old = (!self.first_cycle).then(|| (self.tables.node(node).0.inverse, before));
            let renewed = renew(inertia, stiffness, old, turned, self.scaling);
            self.tables.set_next(node, &renewed.inverse, scalar);
            self.tally.add(node, renewed.added);
            // A held axis follows its support and has no inertia here.
            let mut mass = [0.0; 3];
            for axis in 0..3 {
                if inertia.inverse[axis] > 0.0 {
                    increment.0[axis] *= renewed.velocity;
                    mass[axis] = inertia.mass * (1.0 + self.scaling.k);
                }
            }
            let [x, y, z] = renewed.inertia.times(turned.map(|v| v * renewed.velocity));
            restrict(&self.into.lattice.weights(place), [x, y, z, 0.0], self.momentum);
            sums.add(place, &renewed.inertia, mass, &mut self.into);
        }
        sums.flush(&mut self.into);
    }
}

struct OneBlock<'a, M> {
    material: &'a M,
    block: &'a ElementBlock,
    displacement: Gather<'a>,
    sums: MatrixBeside<'a>,
    assembly: Assembly<'a>,
    frames: &'a Frames,
    weight: f32,
}

impl<M: Material> Kernel for OneBlock<'_, M> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(mut self) {
        let mut slots = NO_SLOTS;
        let block = self.block;
        // The elements one by one, once they have been computed side by side.
        let (mut iso, mut volume) = ([0.0f32; BLOCK], [0.0f32; BLOCK]);
        let mut columns = [[[0.0f32; BLOCK]; 3]; 3];
        let mut turned = [Rotation::NONE; BLOCK];
        for (lane, turned) in turned.iter_mut().enumerate() {
            // C in the frame of the element's first node.
            let place = self.assembly.nodes.get(block.node(0, lane));
            *turned = self.frames.since_start(place.map_or(MAX_FUNCTIONS, LatticeNode::frame));
        }
        for first in (0..BLOCK).step_by(R::COUNT) {
            let law = M::Law::widen(|lane| self.material.law(block.element(first + lane)));
            let deformation = Deformation::<R>::of_block(block, first, self.displacement);
            let local = Local::new::<M::Law>(&law, deformation.invariants);
            let bound = Bound::<R>::new::<M::Law>(&law, block, first, &deformation, &local);
            let mut cofactor = [[R::splat(0.0); 3]; 3];
            for i in 0..3 {
                for k in 0..3 {
                    let along = R::from_fn(|lane| turned[(first + lane) % BLOCK].0[k][i]);
                    for j in 0..3 {
                        cofactor[i][j] = cofactor[i][j] + along * deformation.cofactor(k, j);
                    }
                }
            }
            self.sums.add(&bound, block, first, &cofactor);
            let weight = block.volume::<R>(first) * R::splat(self.weight);
            let (wide_iso, wide_volume) = (weight * bound.iso, weight * bound.volume);
            for lane in 0..R::COUNT {
                let at = (first + lane) % BLOCK;
                iso[at] = wide_iso.lane(lane);
                volume[at] = wide_volume.lane(lane);
                for i in 0..3 {
                    for j in 0..3 {
                        columns[j][i][at] = cofactor[i][j].lane(lane);
                    }
                }
            }
        }
        for lane in 0..BLOCK {
            let mut gradients = [[0.0; 3]; 4];
            for corner in 0..3 {
                for axis in 0..3 {
                    gradients[corner + 1][axis] = block.gradient_of(corner, axis, lane);
                    gradients[0][axis] -= gradients[corner + 1][axis];
                }
            }
            let mut cofactor = [[0.0; 4]; 3];
            for j in 0..3 {
                for i in 0..3 {
                    cofactor[j][i] = columns[j][i][lane];
                }
            }
            let nodes = [0, 1, 2, 3].map(|corner| block.node(corner, lane));
            let element = Element { nodes, gradients, iso: iso[lane], volume: volume[lane], cofactor };
            if !self.assembly.add_in_cell::<R>(&element) {
                self.assembly.add_element(&element, &mut slots);
            }
        }
    }
}
