//! The two passes over the nodes of a step with a lattice, before the lattice moves and after, several nodes side by side.
//! What they have to do with the lattice goes node by node, to and from the cell that the node is in.

use bytemuck::{Pod, Zeroable, must_cast, must_cast_ref, must_cast_slice, must_cast_slice_mut};
use glam::Vec4;

use super::damper::Rough;
use super::estimate::{Defect, Defects};
use super::frames::Rotation;
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS};
use super::node::Scaling;
use super::report::HeldBack;
use super::vectors::NodeTables;
use super::{LARGEST_KICK, NODE_GROWTH, RECOVERY};
use crate::lanes::{BLOCK, Kernel, NodeVector, Real, dispatch, read_rows, write_rows};
use crate::scene::NodeInertia;
use crate::tled::{Step, Sums, Totals};

/// The functions' rotations out of the frames of the bounds, by padded rows, and one that does not turn for nodes that no
/// function moves.
pub(super) type Turns = [[[f32; 4]; 3]; MAX_FUNCTIONS + 1];

const STILL: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

pub(super) fn turns(rotations: &[Rotation], functions: usize) -> Turns {
    let mut turns = [STILL; MAX_FUNCTIONS + 1];
    for (turn, Rotation(rows)) in turns.iter_mut().zip(rotations).take(functions) {
        *turn = rows.map(|[x, y, z]| [x, y, z, 0.0]);
    }
    turns
}

/// How much of its inverse inertia each node may use, where that alone takes it (its next increment without the
/// lattice's part, into `next`), and the lattice's share of its residual, in sums of the cells. Gives who was held back
/// and the largest growth.
pub(super) struct Prepare<'a, 'b> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    /// What the velocities are multiplied by.
    pub(super) brake: f32,
    pub(super) places: &'a [LatticeNode],
    pub(super) turns: &'a Turns,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) force: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
    pub(super) cells: &'a mut [Cell],
    /// Gets sums of the momentum, for a damped step.
    pub(super) momentum: Option<&'a mut [Cell]>,
}

/// Inverse inertia, 1/kg, and determinant of its correlations below which a node is as heavy as can be.
const LEAST_INVERSE: f32 = 1e-30;
const LEAST_DETERMINANT: f32 = 1e-6;

/// What is found on the way, node by node in lanes.
struct Found<R> {
    /// One over the largest growth.
    least: R,
    /// How many nodes are held back, and what they do not use of their inverse inertia.
    held: R,
    unused: R,
}

impl<R: Real> Found<R> {
    #[inline(always)]
    fn nothing() -> Self {
        Self { least: R::splat(1.0), held: R::splat(0.0), unused: R::splat(0.0) }
    }
}

impl Prepare<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> (HeldBack, f32) {
        dispatch(self)
    }
}

impl Kernel for Prepare<'_, '_> {
    type Output = (HeldBack, f32);

    #[inline(always)]
    fn run<R: Real>(self) -> Self::Output {
        self.all::<R::Eight>()
    }
}

impl Prepare<'_, '_> {
    #[inline(always)]
    fn all<R: Real>(mut self) -> (HeldBack, f32) {
        self.cells.fill(Cell::EMPTY);
        if let Some(momentum) = &mut self.momentum {
            momentum.fill(Cell::EMPTY);
        }
        let nodes = self.inertia.len();
        let whole = nodes - nodes % R::COUNT;
        let mut found = Found::<R>::nothing();
        for first in (0..whole).step_by(R::COUNT) {
            self.nodes::<R, R>(first, &mut found);
        }
        let mut rest = Found::<f32>::nothing();
        for node in whole..nodes {
            self.nodes::<f32, R>(node, &mut rest);
        }
        let mut held_back = HeldBack::NONE;
        for lane in 0..R::COUNT {
            rest.least = found.least.lane(lane).min(rest.least);
            held_back.add(found.held.lane(lane), found.unused.lane(lane));
        }
        held_back.add(rest.held, rest.unused);
        (held_back, 1.0 / rest.least)
    }

    /// The nodes from `first` on, side by side; `C` holds eight numbers.
    #[inline(always)]
    fn nodes<R: Real, C: Real>(&mut self, first: usize, found: &mut Found<R>) {
        let step = self.step.seconds();
        let carry = self.brake * self.step.carry();
        let NodeTables { inverse_diagonal, inverse_beside, next, .. } = &mut *self.tables;
        let places = self.places.get(first..first + R::COUNT).unwrap_or_default();

        let [ix, iy, iz, mass] = read_rows::<R>(must_cast_slice(self.inertia), first);
        let [fx, fy, fz, bound] = read_rows::<R>(must_cast_slice(self.force), first);
        let [vx, vy, vz, _] = read_rows::<R>(must_cast_slice(self.increment), first);
        let loss = R::splat(2.0 * self.scaling.k * carry) * mass;
        let square = R::splat(step * step);
        let residual = |inverse: R, f: R, v: R| inverse.positive() * (square * f - loss * v);
        let (rx, ry, rz) = (residual(ix, fx, vx), residual(iy, fy, vy), residual(iz, fz, vz));

        let mut turns = [&STILL; BLOCK];
        for (turn, place) in turns.iter_mut().zip(places) {
            *turn = self.turns.get(place.frame()).unwrap_or(&STILL);
        }
        let turn = [
            R::from_rows(|lane| turns[lane % BLOCK][0]),
            R::from_rows(|lane| turns[lane % BLOCK][1]),
            R::from_rows(|lane| turns[lane % BLOCK][2]),
        ];
        let back = |axis: usize| turn[0][axis] * rx + turn[1][axis] * ry + turn[2][axis] * rz;
        let (bx, by, bz) = (back(0), back(1), back(2));
        let [xx, yy, zz, bound_before] = read_rows::<R>(must_cast_slice(inverse_diagonal), first);
        let [xy, yz, zx, share_before] = read_rows::<R>(must_cast_slice(inverse_beside), first);
        let alone = [xx * bx + xy * by + zx * bz, xy * bx + yy * by + yz * bz, zx * bx + yz * by + zz * bz];

        // One over how far its bound has grown, as far as that matters beside its mass.
        let weight = R::splat(self.scaling.weight);
        let grown = (mass + weight * bound_before).over(mass + weight * bound);
        let [_, _, _, height] = read_rows::<R>(must_cast_slice(next), first);
        let kick = (alone[0] * alone[0] + alone[1] * alone[1] + alone[2] * alone[2]).root();
        let one = R::splat(1.0);
        let most = (R::splat(LARGEST_KICK) * height).over(kick);
        // Who is let go and held back in turn would be braked each time: back to one only slowly.
        let share = (R::splat(NODE_GROWTH) * grown).min(one).min(most).min(R::splat(RECOVERY) * share_before);
        let keep = R::splat(carry) * share.over(share_before).min(one).root();

        let out = |row: usize| turn[row][0] * alone[0] + turn[row][1] * alone[1] + turn[row][2] * alone[2];
        let moved =
            [keep * vx + share * out(0), keep * vy + share * out(1), keep * vz + share * out(2), height];
        write_rows(must_cast_slice_mut(next), first, moved);
        write_rows(must_cast_slice_mut(inverse_beside), first, [xy, yz, zx, share]);
        found.least = grown.min(found.least);
        let unused = one - share;
        found.unused = found.unused + unused;
        found.held = found.held + unused.positive();

        if let Some(momentum) = &mut self.momentum {
            // The mean of `M` over the axes, from its inverse, with one where an axis is held. By way of the correlations
            // `p, q, r`: beside a crushed element the inverse is so small that products of it are zero.
            let (fx, fy, fz) = (ix.positive(), iy.positive(), iz.positive());
            let least = R::splat(LEAST_INVERSE);
            let (a, b, c) =
                ((xx + (one - fx)).max(least), (yy + (one - fy)).max(least), (zz + (one - fz)).max(least));
            let (ra, rb, rc) = (a.root(), b.root(), c.root());
            let (p, q, r) = (xy.over(ra * rb), yz.over(rb * rc), zx.over(rc * ra));
            let (pp, qq, rr) = (p * p, q * q, r * r);
            let determinant = one + R::splat(2.0) * p * q * r - pp - qq - rr;
            let sum = (fx * (one - qq)).over(a) + (fy * (one - rr)).over(b) + (fz * (one - pp)).over(c);
            let mean = R::splat(1.0 / 3.0) * sum.over(determinant.max(R::splat(LEAST_DETERMINANT)));
            add_to::<R, C>(momentum, places, [mean * vx, mean * vy, mean * vz]);
        }
        add_to::<R, C>(self.cells, places, [rx, ry, rz]);
    }
}

/// What of the last increment is smooth, and the share of the rest that is taken away.
pub(super) struct Calm<'a> {
    pub(super) smooth: &'a [Cell],
    pub(super) share: f32,
}

/// Adds what the lattice moves to the next increments, in `next`, and takes the bounds out of the forces' fourth
/// component. Gives what the step enters in the energy account and in the estimate of the error.
pub(super) struct Settle<'a, 'b> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) places: &'a [LatticeNode],
    /// What the lattice moves.
    pub(super) cells: &'a [Cell],
    /// How rough motion is damped.
    pub(super) damped: Option<Calm<'a>>,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    pub(super) force: &'a mut [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
}

/// Sums for each axis.
type AxisSums<R> = ([Sums<R>; 3], [Defect<R>; 3], [R; 4]);

impl Settle<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> (Totals, Defects, Rough) {
        dispatch(self)
    }
}

impl Kernel for Settle<'_, '_> {
    type Output = (Totals, Defects, Rough);

    #[inline(always)]
    fn run<R: Real>(self) -> Self::Output {
        self.all::<R::Eight>()
    }
}

impl Settle<'_, '_> {
    #[inline(always)]
    fn all<R: Real>(mut self) -> (Totals, Defects, Rough) {
        let nodes = self.inertia.len();
        let whole = nodes - nodes % R::COUNT;
        let mut sums = self.none::<R>();
        for first in (0..whole).step_by(R::COUNT) {
            self.nodes::<R, R>(first, &mut sums);
        }
        let mut rest = self.none::<f32>();
        for node in whole..nodes {
            self.nodes::<f32, R>(node, &mut rest);
        }
        let (mut totals, mut defects) = (Totals::default(), Defects::default());
        totals.add_lanes(&sums.0);
        totals.add_lanes(&rest.0);
        defects.add_lanes(&sums.1);
        defects.add_lanes(&rest.1);
        let mut rough = Rough::NONE;
        rough.add_lanes(&sums.2);
        rough.add_lanes(&rest.2);
        (totals, defects, rough)
    }

    #[inline(always)]
    fn none<R: Real>(&self) -> AxisSums<R> {
        let defects = [Defect::new(self.step, self.scaling, R::splat); 3];
        ([Sums::new(self.step, R::splat); 3], defects, [R::splat(0.0); 4])
    }

    /// The nodes from `first` on, side by side; `C` holds eight numbers.
    #[inline(always)]
    fn nodes<R: Real, C: Real>(&mut self, first: usize, (sums, defects, rough): &mut AxisSums<R>) {
        let places = self.places.get(first..first + R::COUNT).unwrap_or_default();
        let coarse = at_nodes::<R, C>(self.cells, places);
        let alone = read_rows::<R>(must_cast_slice(self.tables.next), first);
        let [ix, iy, iz, mass] = read_rows::<R>(must_cast_slice(self.inertia), first);
        let free = [ix.positive(), iy.positive(), iz.positive()];
        let force = read_rows::<R>(must_cast_slice(self.force), first);
        let increment = read_rows::<R>(must_cast_slice(self.increment), first);
        let displacement = read_rows::<R>(must_cast_slice(self.displacement), first);
        let mut moved = alone;
        let mut taken = [R::splat(0.0); 3];
        if let Some(calm) = &self.damped {
            let smooth = at_nodes::<R, C>(calm.smooth, places);
            let mut before = read_rows::<R>(must_cast_slice(self.tables.rough), first);
            let [square, change, both, whole] = rough;
            for axis in 0..3 {
                let here = free[axis] * (increment[axis] - smooth[axis]);
                let difference = here - before[axis];
                *square = *square + mass * here * here;
                *change = *change + mass * difference * difference;
                *both = *both + mass * here * difference;
                *whole = *whole + mass * free[axis] * increment[axis] * increment[axis];
                // A crushed body may have no such number.
                taken[axis] = if calm.share > 0.0 { R::splat(calm.share) * here } else { taken[axis] };
                before[axis] = here;
            }
            write_rows(must_cast_slice_mut(self.tables.rough), first, before);
        }
        for axis in 0..3 {
            moved[axis] = free[axis] * (alone[axis] + coarse[axis]) - taken[axis];
            let (free, increment, force, next) = (free[axis], increment[axis], force[axis], moved[axis]);
            sums[axis].add(mass, free, increment, force, next);
            defects[axis].add(mass, free, displacement[axis], increment, force, next);
        }
        write_rows(must_cast_slice_mut(self.tables.next), first, moved);
        let [x, y, z, _] = force;
        write_rows(must_cast_slice_mut(self.force), first, [x, y, z, R::splat(0.0)]);
    }
}

/// One cell of the lattice. Its trilinear functions are taken apart into the monomials `1, x, y, xy, z, xz, yz, xyz`
/// of the position within it, which take fewer operations a node: the monomials' factors, or what is to be summed with
/// them. Two vectors a row.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Cell([[f32; 8]; 4]);

impl Cell {
    pub(super) const EMPTY: Self = Self([[0.0; 8]; 4]);

    /// Adds `W^T v` of a node.
    #[inline(always)]
    fn add<R: Real>(&mut self, place: &LatticeNode, v: [f32; 4]) {
        let [x, y, z] = place.within();
        let v = R::from_fn(|lane| v[lane % 4]) * R::from_fn(|lane| if lane < 4 { 1.0 } else { x });
        let vy = v * R::splat(y);
        let z = R::splat(z);
        for (sums, v) in self.0.iter_mut().zip([v, vy, z * v, z * vy]) {
            let sum = R::from_fn(|lane| sums[lane % 8]) + v;
            for (lane, place) in sums.iter_mut().enumerate() {
                *place = sum.lane(lane);
            }
        }
    }

    /// `W x` of a node.
    #[inline(always)]
    fn at<R: Real>(&self, place: &LatticeNode) -> [f32; 4] {
        let [x, y, z] = place.within();
        let row = |row: usize| R::from_fn(|lane| self.0[row % 4][lane % 8]);
        let (a, b, c, d) = (row(0), row(1), row(2), row(3));
        let both = (a + R::splat(y) * b) + R::splat(z) * (c + R::splat(y) * d);
        [0, 1, 2, 3].map(|axis| both.lane(axis) + x * both.lane(axis + 4))
    }

    fn vectors(&self) -> [Vec4; 8] {
        let vectors: &[[f32; 4]; 8] = must_cast_ref(&self.0);
        vectors.map(Vec4::from)
    }
}

/// Adds `W^T v` of nodes side by side; `C` holds eight numbers.
#[inline(always)]
fn add_to<R: Real, C: Real>(cells: &mut [Cell], places: &[LatticeNode], [x, y, z]: [R; 3]) {
    let mut vectors = [[0.0; 4]; BLOCK];
    write_rows(&mut vectors, 0, [x, y, z, R::splat(0.0)]);
    for (place, &vector) in places.iter().zip(&vectors) {
        if let Some(cell) = cells.get_mut(place.cell()) {
            cell.add::<C>(place, vector);
        }
    }
}

/// `W x` of nodes side by side; `C` holds eight numbers.
#[inline(always)]
fn at_nodes<R: Real, C: Real>(cells: &[Cell], places: &[LatticeNode]) -> [R; 4] {
    let mut vectors = [[0.0; 4]; BLOCK];
    for (vector, place) in vectors.iter_mut().zip(places) {
        if let Some(cell) = cells.get(place.cell()) {
            *vector = cell.at::<C>(place);
        }
    }
    read_rows::<R>(&vectors, 0)
}

/// Gives the cells' sums to their functions.
pub(super) fn restrict(cells: &[Cell], lattice: &Lattice) -> CoarseVectors {
    let mut sums = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    for (number, cell) in cells.iter().enumerate() {
        let [a, b, c, d, e, f, g, h] = cell.vectors();
        let (a, c, e, g) = (a - b, c - d, e - f, g - h);
        let (a, b, e, f) = (a - c, b - d, e - g, f - h);
        for (vector, function) in
            [a - e, b - f, c - g, d - h, e, f, g, h].into_iter().zip(lattice.functions_of(number))
        {
            if let Some(sum) = sums.get_mut(function) {
                sum.0 = (Vec4::from(sum.0) + vector).to_array();
            }
        }
    }
    sums
}

/// The factors of each cell, for vectors of the functions.
pub(super) fn prolong(vectors: &CoarseVectors, lattice: &Lattice, cells: &mut [Cell]) {
    for (number, cell) in cells.iter_mut().enumerate() {
        let at = |function: usize| Vec4::from(vectors.get(function).copied().unwrap_or_default().0);
        let [a, b, c, d, e, f, g, h] = lattice.functions_of(number).map(at);
        let (b, d, f, h) = (b - a, d - c, f - e, h - g);
        let (c, d, g, h) = (c - a, d - b, g - e, h - f);
        let factors = [a, b, c, d, e - a, f - b, g - c, h - d].map(|factor| factor.to_array());
        cell.0 = must_cast(factors);
    }
}
