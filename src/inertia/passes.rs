//! The two passes over the nodes of a step with a lattice, the axes of a node side by side: before the lattice moves
//! and after. Nodes that follow each other are mostly in the same cell, whose functions are then at hand.

use glam::{Vec4, Vec4Swizzles};

use super::estimate::Defect;
use super::frames::Rotation;
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS};
use super::node::Scaling;
use super::report::HeldBack;
use super::vectors::NodeTables;
use super::{LARGEST_KICK, NODE_GROWTH};
use crate::lanes::{Kernel, NodeVector, Real};
use crate::scene::NodeInertia;
use crate::tled::{Step, Sums};

/// A rotation out of the frame of the bounds, as four-wide rows and columns.
#[derive(Clone, Copy)]
pub(super) struct Turn {
    rows: [Vec4; 3],
    columns: [Vec4; 3],
}

pub(super) type Turns = [Turn; MAX_FUNCTIONS + 1];

/// Those of the functions, and none for nodes that no function moves.
pub(super) fn turns(rotations: &[Rotation], functions: usize) -> Turns {
    let turn = |Rotation([a, b, c]): &Rotation| Turn {
        rows: [a, b, c].map(|[x, y, z]| Vec4::new(*x, *y, *z, 0.0)),
        columns: [0, 1, 2].map(|axis| Vec4::new(a[axis], b[axis], c[axis], 0.0)),
    };
    let mut turns = [turn(&Rotation::NONE); MAX_FUNCTIONS + 1];
    for (place, rotation) in turns.iter_mut().zip(rotations).take(functions) {
        *place = turn(rotation);
    }
    turns
}

/// `sum_j v_j vectors_j`.
#[inline(always)]
fn combined(vectors: &[Vec4; 3], v: Vec4) -> Vec4 {
    vectors[0] * v.xxxx() + vectors[1] * v.yyyy() + vectors[2] * v.zzzz()
}

/// A symmetric matrix as `xx, yy, zz` and `xy, yz, zx` times a vector whose fourth number is zero.
#[inline(always)]
fn times(diagonal: Vec4, beside: Vec4, v: Vec4) -> Vec4 {
    diagonal * v + beside.xxzw() * v.yxxw() + beside.zyyw() * v.zzyw()
}

/// How much of its inverse inertia each node may use, where that alone takes it (its next increment without the
/// lattice's part, into `next`), and the lattice's share of its residual. Gives who was held back and the largest
/// growth.
pub(super) struct Prepare<'a, 'b> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    /// What the velocities are multiplied by.
    pub(super) brake: f32,
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) turns: &'a Turns,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) force: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
    pub(super) restricted: &'a mut CoarseVectors,
}

impl Kernel for Prepare<'_, '_> {
    type Output = (HeldBack, f32);

    #[inline(always)]
    fn run<R: Real>(self) -> (HeldBack, f32) {
        let Self { scaling, restricted, .. } = self;
        let square = self.step.seconds() * self.step.seconds();
        let carry = self.brake * self.step.carry();
        let NodeTables { inverse_diagonal, inverse_beside, next, .. } = self.tables;
        let (mut held_back, mut least) = (HeldBack::NONE, 1.0);
        let mut cell = Cell::new();
        let state = self.inertia.iter().zip(self.force).zip(self.increment).zip(self.places);
        let tables = inverse_diagonal.iter().zip(inverse_beside.iter_mut()).zip(next.iter_mut());
        for ((((inertia, force), increment), place), ((diagonal, beside), next)) in state.zip(tables) {
            let [_, _, _, bound] = force.0;
            let [_, _, _, bound_before] = diagonal.0;
            let [_, _, _, share_before] = beside.0;
            let [_, _, _, height] = next.0;
            let Some(turn) = self.turns.get(place.frame()) else {
                continue;
            };
            let (old_diagonal, old_beside) = (Vec4::from(diagonal.0), Vec4::from(beside.0));
            let (force, increment) = (Vec4::from(force.0), Vec4::from(increment.0));
            let loss = 2.0 * scaling.k * inertia.mass * carry;
            let residual = inertia.free() * (square * force - loss * increment);
            let alone = times(old_diagonal, old_beside, combined(&turn.rows, residual));

            // One over how far its bound has grown, as far as that matters beside its mass.
            let grown =
                (inertia.mass + scaling.weight * bound_before) / (inertia.mass + scaling.weight * bound);
            least = if grown < least { grown } else { least };
            let mut share = if NODE_GROWTH * grown < 1.0 { NODE_GROWTH * grown } else { 1.0 };
            let [x, y, z, _] = alone.to_array();
            let kick = x * x + y * y + z * z;
            let most = LARGEST_KICK * height;
            if share * share * kick > most * most {
                share = most / libm::sqrtf(kick);
            }
            let mut keep = carry;
            if share < share_before {
                keep *= libm::sqrtf(share / share_before);
            }
            held_back.add(share);
            beside.0[3] = share;

            let fine = combined(&turn.columns, alone);
            next.0 = (keep * increment + share * fine).with_w(height).to_array();

            if !cell.is(place) {
                cell.flush(restricted);
                cell.enter(self.lattice, place);
            }
            cell.add(place, residual);
        }
        cell.flush(restricted);
        (held_back, 1.0 / least)
    }
}

/// Adds what the lattice moves to the next increments, in `next`, and takes the bounds out of the forces' fourth
/// component. Gives what the step enters in the energy account and in the estimate of the error.
pub(super) struct Settle<'a, 'b> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    pub(super) force: &'a mut [NodeVector],
    pub(super) solution: &'a CoarseVectors,
    pub(super) tables: &'a mut NodeTables<'b>,
}

impl Kernel for Settle<'_, '_> {
    type Output = (Sums, Defect);

    #[inline(always)]
    fn run<R: Real>(self) -> (Sums, Defect) {
        let (mut sums, mut defect) = (Sums::NONE, Defect::new(self.step, self.scaling));
        let mut cell = Cell::new();
        let state = self.inertia.iter().zip(self.displacement).zip(self.increment).zip(self.force);
        let nodes = state.zip(self.places).zip(self.tables.next.iter_mut());
        for (((((inertia, displacement), increment), force), place), next) in nodes {
            if !cell.is(place) {
                cell.enter(self.lattice, place);
                cell.read(self.solution);
            }
            let alone = Vec4::from(next.0);
            let moved = inertia.free() * (alone + cell.at(place));
            next.0 = moved.with_w(alone.w).to_array();
            force.0[3] = 0.0;
            let (increment, force) = (Vec4::from(increment.0), Vec4::from(force.0));
            sums.add(inertia, increment, force, moved, self.step.carry());
            defect.add(inertia, Vec4::from(displacement.0), increment, force, moved);
        }
        (sums, defect)
    }
}

/// The cell of the node at hand. Its trilinear functions are taken apart into the monomials `1, x, y, xy, z, xz, yz, xyz`
/// of the position within it, which take fewer operations a node: `vectors` are the monomials' factors, or what is to be
/// summed with them.
struct Cell {
    cell: Option<[u8; 3]>,
    functions: [usize; 8],
    vectors: [Vec4; 8],
}

impl Cell {
    #[inline(always)]
    fn new() -> Self {
        Self { cell: None, functions: [MAX_FUNCTIONS; 8], vectors: [Vec4::ZERO; 8] }
    }

    #[inline(always)]
    fn is(&self, place: &LatticeNode) -> bool {
        self.cell == Some(place.cell())
    }

    #[inline(always)]
    fn enter(&mut self, lattice: &Lattice, place: &LatticeNode) {
        self.cell = Some(place.cell());
        self.functions = lattice.functions_of(place);
    }

    /// Adds `W^T v` of a node.
    #[inline(always)]
    fn add(&mut self, place: &LatticeNode, v: Vec4) {
        let [x, y, z] = place.within();
        let (vx, vy) = (x * v, y * v);
        let vxy = y * vx;
        for (sum, v) in self.vectors.iter_mut().zip([v, vx, vy, vxy, z * v, z * vx, z * vy, z * vxy]) {
            *sum += v;
        }
    }

    /// Adds the sums to those of all functions.
    #[inline(always)]
    fn flush(&mut self, sums: &mut CoarseVectors) {
        let [a, b, c, d, e, f, g, h] = self.vectors;
        let (a, c, e, g) = (a - b, c - d, e - f, g - h);
        let (a, b, e, f) = (a - c, b - d, e - g, f - h);
        self.vectors = [a - e, b - f, c - g, d - h, e, f, g, h];
        for (vector, &function) in self.vectors.iter_mut().zip(&self.functions) {
            if let Some(sum) = sums.get_mut(function) {
                sum.0 = (Vec4::from(sum.0) + *vector).to_array();
            }
            *vector = Vec4::ZERO;
        }
    }

    #[inline(always)]
    fn read(&mut self, from: &CoarseVectors) {
        for (vector, &function) in self.vectors.iter_mut().zip(&self.functions) {
            *vector = Vec4::from(from.get(function).copied().unwrap_or_default().0);
        }
        let [a, b, c, d, e, f, g, h] = self.vectors;
        let (b, d, f, h) = (b - a, d - c, f - e, h - g);
        let (c, d, g, h) = (c - a, d - b, g - e, h - f);
        self.vectors = [a, b, c, d, e - a, f - b, g - c, h - d];
    }

    /// `W x` of a node.
    #[inline(always)]
    fn at(&self, place: &LatticeNode) -> Vec4 {
        let [x, y, z] = place.within();
        let [a, b, c, d, e, f, g, h] = self.vectors;
        ((a + x * b) + y * (c + x * d)) + z * ((e + x * f) + y * (g + x * h))
    }
}
