//! The two passes over the nodes of a step with a lattice, several nodes side by side: before the lattice moves and
//! after. Nodes that follow each other are mostly in the same cell, whose functions are then at hand.

use super::assembly::free;
use super::frames::Rotation;
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS};
use super::node::Scaling;
use super::report::HeldBack;
use super::vectors::NodeTables;
use super::{LARGEST_KICK, NODE_GROWTH};
use crate::lanes::{Gather, Kernel, Lanes, NodeVector, Real, rows};
use crate::scene::NodeInertia;
use crate::tled::Step;

/// Rotations by rows.
pub(super) type Turns = [NodeVector; 3 * (MAX_FUNCTIONS + 1)];

pub(super) fn turns(rotations: &[Rotation; MAX_FUNCTIONS + 1]) -> Turns {
    let mut turns = [NodeVector::ZERO; 3 * (MAX_FUNCTIONS + 1)];
    for (rows, rotation) in turns.as_chunks_mut::<3>().0.iter_mut().zip(rotations) {
        for (row, [x, y, z]) in rows.iter_mut().zip(rotation.0) {
            row.0 = [x, y, z, 0.0];
        }
    }
    turns
}

/// What both passes read.
#[derive(Clone, Copy)]
pub(super) struct Nodes<'a> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) turns: &'a Turns,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) force: &'a [NodeVector],
}

/// Some nodes side by side.
struct Chunk<R> {
    mass: R,
    free: [R; 3],
    force: [R; 3],
    scalar: R,
    /// Rotation by rows.
    turn: [[R; 3]; 3],
    /// The inverse inertia: `xx, yy, zz, made for` and `xy, yz, zx, share`.
    diagonal: [R; 4],
    beside: [R; 4],
}

impl Nodes<'_> {
    #[inline(always)]
    fn chunk<R: Real>(&self, first: usize, tables: &NodeTables<'_>) -> Option<Chunk<R>> {
        let node = |lane: usize| first + lane;
        let inertia = Gather::new(bytemuck::must_cast_slice(self.inertia))?;
        let [x, y, z, mass] = inertia.read_all(node);
        let [fx, fy, fz, scalar] = Gather::new(self.force)?.read_all(node);
        let turns = Gather::new(self.turns)?;
        let row = |row: usize| {
            turns.read_lanes::<R>(|lane| {
                3 * self.places.get(first + lane).map_or(MAX_FUNCTIONS, LatticeNode::frame) + row
            })
        };
        Some(Chunk {
            mass,
            free: [x.positive(), y.positive(), z.positive()],
            force: [fx, fy, fz],
            scalar,
            turn: [row(0), row(1), row(2)],
            diagonal: Gather::new(tables.inverse_diagonal)?.read_all(node),
            beside: Gather::new(tables.inverse_beside)?.read_all(node),
        })
    }

    /// `D^2 f - 2 k m du` on the free axes, kg m.
    #[inline(always)]
    fn residual<R: Real>(&self, at: &Chunk<R>, velocity: [R; 3]) -> [R; 3] {
        let square = R::splat(self.step.seconds() * self.step.seconds());
        let loss = R::splat(2.0 * self.scaling.k) * at.mass;
        let mut residual = [R::splat(0.0); 3];
        for axis in 0..3 {
            residual[axis] = at.free[axis] * (square * at.force[axis] - loss * velocity[axis]);
        }
        residual
    }
}

impl<R: Real> Chunk<R> {
    /// The inverse inertia times a vector of the world, in the frames of the bounds.
    #[inline(always)]
    fn moved(&self, [x, y, z]: [R; 3]) -> [R; 3] {
        let [a, b, c] = self.turn;
        let (p, q, r) =
            (a[0] * x + b[0] * y + c[0] * z, a[1] * x + b[1] * y + c[1] * z, a[2] * x + b[2] * y + c[2] * z);
        let ([xx, yy, zz, _], [xy, yz, zx, _]) = (self.diagonal, self.beside);
        [xx * p + xy * q + zx * r, xy * p + yy * q + yz * r, zx * p + yz * q + zz * r]
    }

    /// Back into the world.
    #[inline(always)]
    fn out(&self, [x, y, z]: [R; 3]) -> [R; 3] {
        let [a, b, c] = self.turn;
        [a[0] * x + a[1] * y + a[2] * z, b[0] * x + b[1] * y + b[2] * z, c[0] * x + c[1] * y + c[2] * z]
    }
}

/// How much of its inverse inertia each node may use, where that alone takes it (its next increment without the
/// lattice's part, into `next`), and the lattice's share of its residual. Gives who was held back and the largest
/// growth.
pub(super) struct Prepare<'a, 'b> {
    pub(super) nodes: Nodes<'a>,
    /// What the velocities are multiplied by.
    pub(super) brake: f32,
    pub(super) increment: &'a [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
    pub(super) restricted: &'a mut CoarseVectors,
}

impl Kernel for Prepare<'_, '_> {
    type Output = (HeldBack, f32);

    #[inline(always)]
    fn run<R: Real>(self) -> (HeldBack, f32) {
        let Self { nodes, brake, increment, tables, restricted } = self;
        let (one, weight) = (R::splat(1.0), R::splat(nodes.scaling.weight));
        let square = R::splat(nodes.step.seconds() * nodes.step.seconds());
        let carry = R::splat(brake * nodes.step.carry());
        let (mut held_back, mut largest) = (HeldBack::NONE, one);
        let mut cell = Cell::new();
        for first in (0..nodes.inertia.len()).step_by(R::COUNT) {
            let (Some(at), Some(increment), Some(next)) =
                (nodes.chunk::<R>(first, tables), Gather::new(increment), Gather::new(tables.next))
            else {
                break;
            };
            let [x, y, z] = increment.read_lanes::<R>(|lane| first + lane);
            let [_, _, _, height] = next.read_all::<R>(|lane| first + lane);
            // How far its bound has grown, as far as that matters beside its mass.
            let growth = (at.mass + weight * at.scalar).over(at.mass + weight * at.diagonal[3]);
            largest = growth.max(largest);
            let [fx, fy, fz] = at.force;
            let [p, q, r] = at.moved([square * fx, square * fy, square * fz]);
            let length = (p * p + q * q + r * r).root();
            // Comparisons with NaN keep the second.
            let share = R::splat(NODE_GROWTH).over(growth).min(one);
            let share = (R::splat(LARGEST_KICK) * height).over(length).min(share);
            let before = at.beside[3];
            let keep = share.over(before).min(one).root() * carry;
            let velocity = [keep * x, keep * y, keep * z];
            let [rx, ry, rz] = nodes.residual(&at, velocity);
            let fine = at.out(at.moved([rx, ry, rz]));
            let alone = |axis: usize| velocity[axis] + share * fine[axis];
            let next = rows([alone(0), alone(1), alone(2), height]);
            let residual = rows([rx, ry, rz, share]);
            let places = nodes.places.get(first..).unwrap_or_default();
            let into = tables.next.iter_mut().zip(tables.inverse_beside.iter_mut()).skip(first);
            let lanes = next.iter().zip(&residual).take(R::COUNT);
            for ((place, (next_into, beside)), (next, residual)) in places.iter().zip(into).zip(lanes) {
                let share = residual[3];
                next_into.0 = *next;
                beside.0[3] = share;
                held_back.add(share);
                if !cell.is(place) {
                    cell.flush(restricted);
                    cell.enter(nodes.lattice, place);
                }
                // Four wide; the sums of the shares are of no use.
                for (sum, weight) in cell.vectors.iter_mut().zip(place.eight_weights()) {
                    *sum = (Lanes(*sum) + Lanes([weight; 4]) * Lanes(*residual)).0;
                }
            }
        }
        cell.flush(restricted);
        let mut growth = 1.0;
        for lane in 0..R::COUNT {
            growth = largest.lane(lane).max(growth);
        }
        (held_back, growth)
    }
}

/// Adds what the lattice moves to the next increments, in `next`, and takes the bounds out of the forces' fourth
/// component.
pub(super) struct Move<'a, 'b> {
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    pub(super) inertia: &'a [NodeInertia],
    pub(super) force: &'a mut [NodeVector],
    pub(super) solution: &'a CoarseVectors,
    pub(super) tables: &'a mut NodeTables<'b>,
}

impl Kernel for Move<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        let mut cell = Cell::new();
        let nodes = self.places.iter().zip(self.inertia).zip(self.force).zip(self.tables.next.iter_mut());
        for (((place, inertia), force), next) in nodes {
            if !cell.is(place) {
                cell.enter(self.lattice, place);
                cell.read(self.solution);
            }
            let [x, y, z, height] = next.0;
            let mut moved = Lanes([x, y, z, 0.0]);
            let mut coarse = Lanes([0.0; 4]);
            for (&vector, weight) in cell.vectors.iter().zip(place.eight_weights()) {
                coarse = coarse + Lanes(vector) * Lanes([weight; 4]);
            }
            moved = Lanes(free(inertia.inverse)) * (moved + coarse);
            let Lanes([x, y, z, _]) = moved;
            next.0 = [x, y, z, height];
            force.0[3] = 0.0;
        }
    }
}

/// The cell of the node at hand, with the vectors of its functions.
struct Cell {
    cell: Option<[u8; 3]>,
    functions: [usize; 8],
    vectors: [[f32; 4]; 8],
}

impl Cell {
    #[inline(always)]
    fn new() -> Self {
        Self { cell: None, functions: [MAX_FUNCTIONS; 8], vectors: [[0.0; 4]; 8] }
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

    /// Adds the vectors to those of all functions.
    #[inline(always)]
    fn flush(&mut self, sums: &mut CoarseVectors) {
        for (vector, &function) in self.vectors.iter_mut().zip(&self.functions) {
            if let Some(sum) = sums.get_mut(function) {
                for (sum, component) in sum.0.iter_mut().zip(*vector) {
                    *sum += component;
                }
            }
            *vector = [0.0; 4];
        }
    }

    #[inline(always)]
    fn read(&mut self, from: &CoarseVectors) {
        for (vector, &function) in self.vectors.iter_mut().zip(&self.functions) {
            *vector = from.get(function).copied().unwrap_or_default().0;
        }
    }
}
