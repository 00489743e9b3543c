//! The passes over the nodes of a step, several nodes side by side: with a lattice one before it moves and one after, in
//! the order of its cells, so that what a cell sums or moves stays in registers; without one both at once.

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use super::cells::{Cell, CellSum, PARTS, Within, moved_by};
use super::damper::Rough;
use super::estimate::{Defect, Defects};
use super::frames::Rotation;
use super::lattice::{LatticeNode, MAX_FUNCTIONS};
use super::node::Scaling;
use super::report::HeldBack;
use super::vectors::{NodeTables, frame_of};
use super::{LARGEST_KICK, LEAST_SHARE, NODE_GROWTH, RECOVERY};
use crate::lanes::{BLOCK, Chosen, Following, Kernel, NodeVector, Real, Rows, axes, dispatch};
use crate::scene::NodeInertia;
use crate::tled::{Step, Sums, Totals};

/// The functions' rotations out of the frames of the bounds, by padded rows; those beyond do not turn.
pub(super) type Turns = [[[f32; 4]; 3]; MAX_FUNCTIONS + 1];

const STILL: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

pub(super) fn turns(rotations: &[Rotation], functions: usize) -> Turns {
    let mut turns = [STILL; MAX_FUNCTIONS + 1];
    for (turn, Rotation(rows)) in turns.iter_mut().zip(rotations).take(functions) {
        *turn = rows.map(|[x, y, z]| [x, y, z, 0.0]);
    }
    turns
}

/// The sums of a row of a block, of which there is one a lane: their part, and the lane.
#[inline(always)]
fn of_row<R: Real, T>(parts: &[T; PARTS], row: usize, lane_of: impl Fn(usize) -> usize) -> (&T, usize) {
    (&parts[row / R::COUNT % PARTS], lane_of(row % R::COUNT))
}

/// What both passes read.
#[derive(Clone, Copy)]
pub(super) struct Given<'a> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    /// None without a lattice.
    pub(super) places: &'a [LatticeNode],
}

/// Nodes side by side.
#[derive(Clone, Copy)]
struct Nodes<R> {
    /// Ones along free axes.
    free: [R; 3],
    mass: R,
    force: [R; 3],
    /// The bound that the forces brought along, N/m.
    bound: R,
    increment: [R; 3],
}

impl Given<'_> {
    #[inline(always)]
    fn read<R: Real>(&self, rows: impl Rows, force: &[NodeVector]) -> Nodes<R> {
        let [ix, iy, iz, mass] = rows.read::<R>(must_cast_slice(self.inertia));
        let [fx, fy, fz, bound] = rows.read::<R>(must_cast_slice(force));
        let [vx, vy, vz, _] = rows.read::<R>(must_cast_slice(self.increment));
        let free = [ix.positive(), iy.positive(), iz.positive()];
        Nodes { free, mass, force: [fx, fy, fz], bound, increment: [vx, vy, vz] }
    }

    /// The nodes that come `first` and on in the order of the cells, and where they are.
    #[inline(always)]
    fn in_order<R: Real>(&self, first: usize) -> Option<(Chosen, Within<'_, R>)> {
        let places = self.places.get(first..first + R::COUNT)?;
        let [x, y, z, numbers] = R::from_rows(|lane| places.get(lane).map_or([0.0; 4], LatticeNode::row));
        let mut rows = [0; BLOCK];
        for (lane, row) in rows.iter_mut().enumerate().take(R::COUNT) {
            *row = numbers.lane(lane).to_bits();
        }
        let ends = [places.first()?.cell(), places.last()?.cell()];
        Some((Chosen::below::<R>(rows, self.places.len())?, Within { position: [x, y, z], ends, places }))
    }
}

/// How much of its inverse inertia each node may use, where that alone takes it (its next increment without the
/// lattice's part, into `next`), and the lattice's share of its residual, in sums of the cells. Gives who was held back
/// and the largest growth.
pub(super) struct Prepare<'a, 'b> {
    pub(super) given: Given<'a>,
    /// What the velocities are multiplied by.
    pub(super) brake: f32,
    pub(super) turns: &'a Turns,
    pub(super) force: &'a [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
    pub(super) cells: &'a mut [Cell],
    /// Gets sums of the momentum, for a damped step.
    pub(super) momentum: Option<&'a mut [Cell]>,
}

/// Inverse inertia, 1/kg, and determinant of its correlations below which a node is as heavy as can be.
const LEAST_INVERSE: f32 = 1e-30;
const LEAST_DETERMINANT: f32 = 1e-6;

/// What is found on the way, node by node in lanes.
#[derive(Clone, Copy)]
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

    /// Who was held back and the largest growth, with the nodes that were left over.
    #[inline(always)]
    fn total(
        parts: &[Self; PARTS],
        lane_of: impl Fn(usize) -> usize,
        mut rest: Found<f32>,
    ) -> (HeldBack, f32) {
        let mut held_back = HeldBack::NONE;
        for row in 0..BLOCK {
            let (found, lane) = of_row::<R, _>(parts, row, &lane_of);
            rest.least = found.least.lane(lane).min(rest.least);
            held_back.add(found.held.lane(lane), found.unused.lane(lane));
        }
        held_back.add(rest.held, rest.unused);
        (held_back, 1.0 / rest.least)
    }
}

/// What a node is moved by alone, what the lattice gets of it, and its inverse inertia.
struct Prepared<R> {
    /// The next increment without the lattice's part, and the least height of the node's elements.
    next: [R; 4],
    residual: [R; 3],
    inverse: [R; 6],
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
    fn run<R: Real>(mut self) -> Self::Output {
        let given = self.given;
        let nodes = given.inertia.len().min(given.places.len());
        let whole = nodes - nodes % BLOCK;
        let mut found = [Found::<R>::nothing(); PARTS];
        self.cells.fill(Cell::EMPTY);
        let mut forces = CellSum::new();
        let mut moving = CellSum::new();
        if let Some(momentum) = &mut self.momentum {
            momentum.fill(Cell::EMPTY);
        }
        for first in (0..whole).step_by(BLOCK) {
            for part in 0..BLOCK / R::COUNT {
                let Some((rows, within)) = given.in_order::<R>(first + part * R::COUNT) else {
                    continue;
                };
                let nodes = self.given.read::<R>(rows, self.force);
                let prepared = self.nodes(rows, &nodes, &mut found[part % PARTS]);
                rows.write(must_cast_slice_mut(self.tables.next), prepared.next);
                if let Some(momentum) = &mut self.momentum {
                    moving.add(momentum, &within, part, momentum_of(&nodes, prepared.inverse));
                }
                forces.add(self.cells, &within, part, prepared.residual);
            }
        }
        forces.flush(self.cells);
        if let Some(momentum) = &mut self.momentum {
            moving.flush(momentum);
        }
        let mut rest = Found::nothing();
        for at in whole..nodes {
            let Some(place) = self.given.places.get(at) else {
                continue;
            };
            let rows = Following(place.node());
            let nodes = self.given.read::<f32>(rows, self.force);
            let prepared = self.nodes(rows, &nodes, &mut rest);
            rows.write(must_cast_slice_mut(self.tables.next), prepared.next);
            if let Some(cell) = self.momentum.as_mut().and_then(|cells| cells.get_mut(place.cell())) {
                cell.add(place, momentum_of(&nodes, prepared.inverse));
            }
            if let Some(cell) = self.cells.get_mut(place.cell()) {
                cell.add(place, prepared.residual);
            }
        }
        Found::total(&found, |row| row, rest)
    }
}

impl Prepare<'_, '_> {
    #[inline(always)]
    fn nodes<R: Real>(&mut self, rows: impl Rows, nodes: &Nodes<R>, found: &mut Found<R>) -> Prepared<R> {
        let Given { step, scaling, .. } = self.given;
        let carry = self.brake * step.carry();
        let NodeTables { inverse_diagonal, inverse_beside, next, .. } = &mut *self.tables;
        let &Nodes { free, mass, force, bound, increment: [vx, vy, vz] } = nodes;

        let loss = R::splat(2.0 * scaling.k * carry) * mass;
        let square = R::splat(step.seconds() * step.seconds());
        let rx = free[0] * (square * force[0] - loss * vx);
        let ry = free[1] * (square * force[1] - loss * vy);
        let rz = free[2] * (square * force[2] - loss * vz);

        let [_, _, _, height] = rows.read::<R>(must_cast_slice(next));
        // The number of the frame is in the last bits, see `NodeTables`.
        let turn = |lane: usize| {
            let frame = frame_of(&NodeVector([0.0, 0.0, 0.0, height.lane(lane)]));
            &self.turns[frame.min(MAX_FUNCTIONS)]
        };
        let turn = [
            R::from_rows(|lane| turn(lane)[0]),
            R::from_rows(|lane| turn(lane)[1]),
            R::from_rows(|lane| turn(lane)[2]),
        ];
        let bx = turn[0][0] * rx + turn[1][0] * ry + turn[2][0] * rz;
        let by = turn[0][1] * rx + turn[1][1] * ry + turn[2][1] * rz;
        let bz = turn[0][2] * rx + turn[1][2] * ry + turn[2][2] * rz;
        let [xx, yy, zz, bound_before] = rows.read::<R>(must_cast_slice(inverse_diagonal));
        let [xy, yz, zx, share_before] = rows.read::<R>(must_cast_slice(inverse_beside));
        let alone = [xx * bx + xy * by + zx * bz, xy * bx + yy * by + yz * bz, zx * bx + yz * by + zz * bz];

        // One over how far its bound has grown, as far as that matters beside its mass.
        let weight = R::splat(scaling.weight);
        let grown = (mass + weight * bound_before).over(mass + weight * bound);
        let kick = (alone[0] * alone[0] + alone[1] * alone[1] + alone[2] * alone[2]).root();
        let one = R::splat(1.0);
        let most = (R::splat(LARGEST_KICK) * height).over(kick);
        // Who is let go and held back in turn would be braked each time: back to one only slowly.
        let share = (R::splat(NODE_GROWTH) * grown).min(one).min(most).min(R::splat(RECOVERY) * share_before);
        let keep = R::splat(carry) * share.over(share_before).min(one).root();
        let kept = share.max(R::splat(LEAST_SHARE));
        rows.write(must_cast_slice_mut(inverse_beside), [xy, yz, zx, kept]);
        found.least = grown.min(found.least);
        let unused = one - share;
        found.unused = found.unused + unused;
        found.held = found.held + unused.positive();

        let mut moved = [keep * vx, keep * vy, keep * vz, height];
        for row in 0..3 {
            let out = turn[row][0] * alone[0] + turn[row][1] * alone[1] + turn[row][2] * alone[2];
            moved[row] = moved[row] + share * out;
        }
        Prepared { next: moved, residual: [rx, ry, rz], inverse: [xx, yy, zz, xy, yz, zx] }
    }
}

/// The momentum of nodes, with the mean of `M` over the axes, from its inverse, with one where an axis is held. By way of the
/// correlations `p, q, r`: beside a crushed element the inverse is so small that products of it are zero.
#[inline(always)]
fn momentum_of<R: Real>(nodes: &Nodes<R>, [xx, yy, zz, xy, yz, zx]: [R; 6]) -> [R; 3] {
    let (one, least) = (R::splat(1.0), R::splat(LEAST_INVERSE));
    let [fx, fy, fz] = nodes.free;
    let (a, b, c) =
        ((xx + (one - fx)).max(least), (yy + (one - fy)).max(least), (zz + (one - fz)).max(least));
    let (ra, rb, rc) = (a.root(), b.root(), c.root());
    let (p, q, r) = (xy.over(ra * rb), yz.over(rb * rc), zx.over(rc * ra));
    let (pp, qq, rr) = (p * p, q * q, r * r);
    let determinant = one + R::splat(2.0) * p * q * r - pp - qq - rr;
    let sum = (fx * (one - qq)).over(a) + (fy * (one - rr)).over(b) + (fz * (one - pp)).over(c);
    let mean = R::splat(1.0 / 3.0) * sum.over(determinant.max(R::splat(LEAST_DETERMINANT)));
    let [vx, vy, vz] = nodes.increment;
    [mean * vx, mean * vy, mean * vz]
}

/// What of the last increment is smooth, and the share of the rest that is taken away.
pub(super) struct Calm<'a> {
    pub(super) smooth: &'a [Cell],
    pub(super) share: f32,
}

/// Adds what the lattice moves to the next increments, in `next`, and takes the bounds out of the forces' fourth
/// component. Gives what the step enters in the energy account and in the estimate of the error.
pub(super) struct Settle<'a, 'b> {
    pub(super) given: Given<'a>,
    /// What the lattice moves.
    pub(super) cells: &'a [Cell],
    /// How rough motion is damped.
    pub(super) damped: Option<Calm<'a>>,
    pub(super) force: &'a mut [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
}

/// Sums for each axis.
#[derive(Clone, Copy)]
struct AxisSums<R> {
    sums: [Sums<R>; 3],
    defects: [Defect<R>; 3],
    rough: [R; 4],
}

impl<R: Real> AxisSums<R> {
    #[inline(always)]
    fn none(given: &Given<'_>) -> Self {
        let defects = [Defect::new(given.step, given.scaling, R::splat); 3];
        Self { sums: [Sums::new(given.step, R::splat); 3], defects, rough: [R::splat(0.0); 4] }
    }

    /// Adds nodes and where they go next.
    #[inline(always)]
    fn add(&mut self, nodes: &Nodes<R>, displacement: [R; 4], next: [R; 4]) {
        for axis in 0..3 {
            let (free, increment, force, next) =
                (nodes.free[axis], nodes.increment[axis], nodes.force[axis], next[axis]);
            self.sums[axis].add(nodes.mass, free, increment, force, next);
            self.defects[axis].add(nodes.mass, free, displacement[axis], increment, force, next);
        }
    }

    #[inline(always)]
    fn total(
        parts: &[Self; PARTS],
        lane_of: impl Fn(usize) -> usize,
        rest: &AxisSums<f32>,
    ) -> (Totals, Defects, Rough) {
        let (mut totals, mut defects, mut rough) = (Totals::default(), Defects::default(), Rough::NONE);
        for row in 0..BLOCK {
            let (part, lane) = of_row::<R, _>(parts, row, &lane_of);
            let ([a, b, c], [d, e, f], [g, h, i, j]) = (&part.sums, &part.defects, &part.rough);
            totals.add_axes(&[a.at(lane), b.at(lane), c.at(lane)]);
            defects.add_axes(&[d.at(lane), e.at(lane), f.at(lane)]);
            rough.add([g.lane(lane), h.lane(lane), i.lane(lane), j.lane(lane)]);
        }
        totals.add_axes(&rest.sums);
        defects.add_axes(&rest.defects);
        rough.add(rest.rough);
        (totals, defects, rough)
    }
}

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
    fn run<R: Real>(mut self) -> Self::Output {
        let given = self.given;
        let nodes = given.inertia.len().min(given.places.len());
        let whole = nodes - nodes % BLOCK;
        let mut sums = [AxisSums::<R>::none(&self.given); PARTS];
        for first in (0..whole).step_by(BLOCK) {
            for part in 0..BLOCK / R::COUNT {
                let Some((rows, within)) = given.in_order::<R>(first + part * R::COUNT) else {
                    continue;
                };
                let coarse = moved_by(self.cells, &within);
                let mut smooth = [R::splat(0.0); 3];
                if let Some(calm) = &self.damped {
                    smooth = moved_by(calm.smooth, &within);
                }
                self.nodes(rows, coarse, smooth, &mut sums[part % PARTS]);
            }
        }
        let mut rest = AxisSums::none(&self.given);
        for at in whole..nodes {
            let Some(place) = self.given.places.get(at) else {
                continue;
            };
            let rows = Following(place.node());
            let at =
                |cells: &[Cell]| cells.get(place.cell()).map_or([0.0; 3], |cell| cell.at(place.within()));
            let smooth = self.damped.as_ref().map_or([0.0; 3], |calm| at(calm.smooth));
            self.nodes(rows, at(self.cells), smooth, &mut rest);
        }
        AxisSums::total(&sums, |row| row, &rest)
    }
}

impl Settle<'_, '_> {
    #[inline(always)]
    fn nodes<R: Real>(&mut self, rows: impl Rows, coarse: [R; 3], smooth: [R; 3], sums: &mut AxisSums<R>) {
        let nodes = self.given.read::<R>(rows, self.force);
        let Nodes { free, mass, force: [fx, fy, fz], increment, .. } = nodes;
        let displacement = rows.read::<R>(must_cast_slice(self.given.displacement));
        let mut moved = rows.read::<R>(must_cast_slice(self.tables.next));
        let mut taken = [R::splat(0.0); 3];
        if let Some(calm) = &self.damped {
            let mut before = rows.read::<R>(must_cast_slice(self.tables.rough));
            let [square, change, both, whole] = &mut sums.rough;
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
            rows.write(must_cast_slice_mut(self.tables.rough), before);
        }
        for axis in 0..3 {
            moved[axis] = free[axis] * (moved[axis] + coarse[axis]) - taken[axis];
        }
        sums.add(&nodes, displacement, moved);
        rows.write(must_cast_slice_mut(self.tables.next), moved);
        rows.write(must_cast_slice_mut(self.force), [fx, fy, fz, R::splat(0.0)]);
    }
}

/// Both passes at once where there is no lattice between them.
pub(super) struct Alone<'a, 'b> {
    pub(super) given: Given<'a>,
    pub(super) brake: f32,
    pub(super) turns: &'a Turns,
    pub(super) force: &'a mut [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
}

impl Alone<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> (HeldBack, Totals, Defects) {
        dispatch(self)
    }
}

impl Kernel for Alone<'_, '_> {
    type Output = (HeldBack, Totals, Defects);

    #[inline(always)]
    fn run<R: Real>(mut self) -> Self::Output {
        let nodes = self.given.inertia.len();
        let whole = nodes - nodes % BLOCK;
        let mut found = [Found::<R>::nothing(); PARTS];
        let mut sums = [AxisSums::<R>::none(&self.given); PARTS];
        for first in (0..whole).step_by(BLOCK) {
            for part in 0..BLOCK / R::COUNT {
                let rows = Following(first + part * R::COUNT);
                self.nodes(rows, &mut found[part % PARTS], &mut sums[part % PARTS]);
            }
        }
        let (mut rest_found, mut rest) = (Found::nothing(), AxisSums::none(&self.given));
        for node in whole..nodes {
            self.nodes::<f32>(Following(node), &mut rest_found, &mut rest);
        }
        let (totals, defects, _) = AxisSums::total(&sums, R::lane_of, &rest);
        (Found::total(&found, R::lane_of, rest_found).0, totals, defects)
    }
}

impl Alone<'_, '_> {
    #[inline(always)]
    fn nodes<R: Real>(&mut self, rows: Following, found: &mut Found<R>, sums: &mut AxisSums<R>) {
        let &mut Self { given, brake, turns, .. } = self;
        let nodes = given.read::<R>(rows, self.force);
        let [fx, fy, fz] = nodes.force;
        let tables = &mut *self.tables;
        let (cells, momentum): (&mut [Cell], _) = (&mut [], None);
        let mut next = Prepare { given, brake, turns, force: &[], tables, cells, momentum }
            .nodes(rows, &nodes, found)
            .next;
        for axis in 0..3 {
            next[axis] = nodes.free[axis] * next[axis];
        }
        sums.add(&nodes, rows.read::<R>(must_cast_slice(given.displacement)), next);
        rows.write(must_cast_slice_mut(self.tables.next), next);
        rows.write(must_cast_slice_mut(self.force), [fx, fy, fz, R::splat(0.0)]);
    }
}

/// Moves the nodes by their next increments.
pub(super) struct Follow<'a> {
    pub(super) next: &'a [NodeVector],
    pub(super) displacement: &'a mut [NodeVector],
    pub(super) increment: &'a mut [NodeVector],
}

impl Follow<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) {
        dispatch(self);
    }
}

impl Kernel for Follow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        // What stands behind the axes is no increment.
        let axes = axes::<R>();
        let (next, rest) = must_cast_slice::<_, f32>(self.next).as_chunks::<BLOCK>();
        let (displacement, rest_of_displacement) =
            must_cast_slice_mut::<_, f32>(self.displacement).as_chunks_mut::<BLOCK>();
        let (increment, rest_of_increment) =
            must_cast_slice_mut::<_, f32>(self.increment).as_chunks_mut::<BLOCK>();
        for ((next, displacement), increment) in next.iter().zip(displacement).zip(increment) {
            // Put together here: two vectors are not stored at once into what may be the same.
            let (mut moved, mut there) = ([0.0; BLOCK], [0.0; BLOCK]);
            for from in (0..BLOCK).step_by(R::COUNT) {
                let of = |numbers: &[f32; BLOCK]| R::from_fn(|lane| numbers[(from + lane) % BLOCK]);
                let next = axes.choose(of(next), R::splat(0.0));
                let sum = of(displacement) + next;
                for lane in 0..R::COUNT {
                    moved[(from + lane) % BLOCK] = next.lane(lane);
                    there[(from + lane) % BLOCK] = sum.lane(lane);
                }
            }
            (*increment, *displacement) = (moved, there);
        }
        for (at, (next, (displacement, increment))) in
            rest.iter().zip(rest_of_displacement.iter_mut().zip(rest_of_increment)).enumerate()
        {
            *increment = if at % 4 == 3 { 0.0 } else { *next };
            *displacement += *increment;
        }
    }
}
