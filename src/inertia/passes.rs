//! The passes over the nodes of a step, vectorised. With a lattice there are two, one before and one after the
//! lattice's motion is computed. They take the nodes in the order of the cells, so that sums and coefficients of a cell
//! stay in registers. Without a lattice both are done in one pass.

use bytemuck::{must_cast_slice, must_cast_slice_mut};

use super::cells::{CellAccumulator, CellPolynomial, NodesInCells, VECTORS_PER_TILE, motion_at};
use super::damper::RoughMotion;
use super::estimate::{DefectSums, DefectTotals};
use super::frames::Rotation;
use super::lattice::{LatticeNode, MAX_FUNCTIONS};
use super::node::Scaling;
use super::node_tables::NodeTables;
use super::report::HeldBack;
use super::{LARGEST_MOVE, LEAST_SHARE, NODE_GROWTH, RECOVERY};
use crate::element::NodeInertia;
use crate::padding;
use crate::simd::{Contiguous, Indexed, Kernel, NodeVector, Real, Rows, TILE, axes, dispatch};
use crate::step::{Step, Sums, Totals};

/// For each frame the rotation from the frame of the bounds to the world, as padded rows; the identity for frames that
/// are not used.
pub(super) type RotationTable = [[[f32; 4]; 3]; MAX_FUNCTIONS + 1];

const IDENTITY: [[f32; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];

pub(super) fn rotation_table(rotations: &[Rotation], functions: usize) -> RotationTable {
    let mut table = [IDENTITY; MAX_FUNCTIONS + 1];
    for (padded, Rotation(rows)) in table.iter_mut().zip(rotations).take(functions) {
        *padded = rows.map(|[x, y, z]| [x, y, z, 0.0]);
    }
    table
}

/// The vector of sums, and the lane in it, that belong to a row of a tile.
#[inline(always)]
fn sums_of_row<R: Real, T>(
    sums: &[T; VECTORS_PER_TILE],
    row: usize,
    lane_of_row: impl Fn(usize) -> usize,
) -> (&T, usize) {
    (&sums[row / R::COUNT % VECTORS_PER_TILE], lane_of_row(row % R::COUNT))
}

/// Inputs of all passes.
#[derive(Clone, Copy)]
pub(super) struct PassInput<'a> {
    pub(super) step: &'a Step,
    pub(super) scaling: &'a Scaling,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    /// Empty without a lattice.
    pub(super) places: &'a [LatticeNode],
}

/// Values of a vector of nodes.
#[derive(Clone, Copy)]
struct NodeValues<R> {
    /// Ones along free axes.
    free: [R; 3],
    mass: R,
    force: [R; 3],
    /// Scalar stiffness bound, from the fourth component of the force, N/m.
    bound: R,
    increment: [R; 3],
}

impl PassInput<'_> {
    #[inline(always)]
    fn read<R: Real>(&self, rows: impl Rows, force: &[NodeVector]) -> NodeValues<R> {
        let [ix, iy, iz, mass] = rows.read::<R>(must_cast_slice(self.inertia));
        let [fx, fy, fz, bound] = rows.read::<R>(must_cast_slice(force));
        let [vx, vy, vz, _] = rows.read::<R>(must_cast_slice(self.increment));
        let free = [ix.positive(), iy.positive(), iz.positive()];
        NodeValues { free, mass, force: [fx, fy, fz], bound, increment: [vx, vy, vz] }
    }

    /// The nodes from index `first` on in the order of the cells: their rows in the tables, and their places.
    #[inline(always)]
    fn in_order<R: Real>(&self, first: usize) -> Option<(Indexed, NodesInCells<'_, R>)> {
        let places = self.places.get(first..first + R::COUNT)?;
        let [x, y, z, nodes] = R::from_rows(|lane| places.get(lane).map_or([0.0; 4], LatticeNode::row));
        let mut rows = [0; TILE];
        for (lane, row) in rows.iter_mut().enumerate().take(R::COUNT) {
            *row = padding::to_index(nodes.lane(lane));
        }
        let ends = [places.first()?.cell(), places.last()?.cell()];
        Some((
            Indexed::below::<R>(rows, self.places.len())?,
            NodesInCells { position: [x, y, z], ends, places },
        ))
    }
}

/// The pass before the lattice's motion. For each node: the share of its inverse inertia that it may use; its next
/// increment without the lattice's part; and its residual, summed over the cells for the lattice. Gives sums over the
/// nodes that were held back, and the largest growth of a bound.
pub(super) struct FinePass<'a, 'b> {
    pub(super) input: PassInput<'a>,
    /// Factor of the velocities.
    pub(super) velocity_scale: f32,
    pub(super) rotations: &'a RotationTable,
    pub(super) force: &'a [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
    pub(super) cells: &'a mut [CellPolynomial],
    /// Receives sums of the momentum in a damped step.
    pub(super) momentum: Option<&'a mut [CellPolynomial]>,
}

/// Lower limits of the inverse inertia of a node, 1/kg, and of the determinant of its correlations.
const LEAST_INVERSE: f32 = 1e-30;
const LEAST_DETERMINANT: f32 = 1e-6;

/// Growth of the bounds and held-back nodes, vectorised.
#[derive(Clone, Copy)]
struct GrowthSums<R> {
    /// The inverse of the largest growth.
    inverse_growth: R,
    /// Number of held-back nodes, and sum of the unused shares of their inverse inertia.
    held: R,
    unused: R,
}

impl<R: Real> GrowthSums<R> {
    #[inline(always)]
    fn new() -> Self {
        Self { inverse_growth: R::splat(1.0), held: R::splat(0.0), unused: R::splat(0.0) }
    }

    /// The held-back nodes and the largest growth; `rest` is for the nodes after the last whole tile.
    #[inline(always)]
    fn total(
        sums: &[Self; VECTORS_PER_TILE],
        lane_of_row: impl Fn(usize) -> usize,
        mut rest: GrowthSums<f32>,
    ) -> (HeldBack, f32) {
        let mut held_back = HeldBack::NONE;
        for row in 0..TILE {
            let (sums, lane) = sums_of_row::<R, _>(sums, row, &lane_of_row);
            rest.inverse_growth = sums.inverse_growth.lane(lane).min(rest.inverse_growth);
            held_back.add(sums.held.lane(lane), sums.unused.lane(lane));
        }
        held_back.add(rest.held, rest.unused);
        (held_back, 1.0 / rest.inverse_growth)
    }
}

/// Result of [`FinePass`] for a vector of nodes.
struct FineResult<R> {
    /// The next increment without the lattice's part, and the least height of the node's elements.
    next: [R; 4],
    /// The residual for the lattice.
    residual: [R; 3],
    /// The inverse inertia.
    inverse: [R; 6],
}

impl FinePass<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> (HeldBack, f32) {
        dispatch(self)
    }
}

impl Kernel for FinePass<'_, '_> {
    type Output = (HeldBack, f32);

    #[inline(always)]
    fn run<R: Real>(mut self) -> Self::Output {
        let input = self.input;
        let nodes = input.inertia.len().min(input.places.len());
        let whole = nodes - nodes % TILE;
        let mut growth = [GrowthSums::<R>::new(); VECTORS_PER_TILE];
        self.cells.fill(CellPolynomial::ZERO);
        let mut residual_sums = CellAccumulator::new();
        let mut momentum_sums = CellAccumulator::new();
        if let Some(momentum) = &mut self.momentum {
            momentum.fill(CellPolynomial::ZERO);
        }
        for first in (0..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let Some((rows, places)) = input.in_order::<R>(first + vector * R::COUNT) else {
                    continue;
                };
                let nodes = self.input.read::<R>(rows, self.force);
                let fine = self.nodes(rows, &nodes, &mut growth[vector % VECTORS_PER_TILE]);
                rows.write(must_cast_slice_mut(self.tables.next_increment), fine.next);
                if let Some(momentum) = &mut self.momentum {
                    momentum_sums.add(momentum, &places, vector, momentum_of(&nodes, fine.inverse));
                }
                residual_sums.add(self.cells, &places, vector, fine.residual);
            }
        }
        residual_sums.flush(self.cells);
        if let Some(momentum) = &mut self.momentum {
            momentum_sums.flush(momentum);
        }
        let mut rest = GrowthSums::new();
        for at in whole..nodes {
            let Some(place) = self.input.places.get(at) else {
                continue;
            };
            let rows = Contiguous(place.node());
            let nodes = self.input.read::<f32>(rows, self.force);
            let fine = self.nodes(rows, &nodes, &mut rest);
            rows.write(must_cast_slice_mut(self.tables.next_increment), fine.next);
            if let Some(cell) = self.momentum.as_mut().and_then(|cells| cells.get_mut(place.cell())) {
                cell.add(place, momentum_of(&nodes, fine.inverse));
            }
            if let Some(cell) = self.cells.get_mut(place.cell()) {
                cell.add(place, fine.residual);
            }
        }
        GrowthSums::total(&growth, |row| row, rest)
    }
}

impl FinePass<'_, '_> {
    #[inline(always)]
    fn nodes<R: Real>(
        &mut self,
        rows: impl Rows,
        nodes: &NodeValues<R>,
        growth: &mut GrowthSums<R>,
    ) -> FineResult<R> {
        let PassInput { step, scaling, .. } = self.input;
        let carry = self.velocity_scale * step.carry();
        let NodeTables { inverse_diagonal, inverse_off_diagonal, next_increment, .. } = &mut *self.tables;
        let &NodeValues { free, mass, force, bound, increment: [vx, vy, vz] } = nodes;

        let loss = R::splat(2.0 * scaling.k * carry) * mass;
        let square = R::splat(step.seconds() * step.seconds());
        let rx = free[0] * (square * force[0] - loss * vx);
        let ry = free[1] * (square * force[1] - loss * vy);
        let rz = free[2] * (square * force[2] - loss * vz);

        let [_, _, _, height] = rows.read::<R>(must_cast_slice(next_increment));
        // The frame is in the last bits of the height, see `NodeTables`.
        let rotation = |lane: usize| {
            let frame = padding::frame_of(height.lane(lane));
            &self.rotations[frame.min(MAX_FUNCTIONS)]
        };
        let rotation = [
            R::from_rows(|lane| rotation(lane)[0]),
            R::from_rows(|lane| rotation(lane)[1]),
            R::from_rows(|lane| rotation(lane)[2]),
        ];
        let bx = rotation[0][0] * rx + rotation[1][0] * ry + rotation[2][0] * rz;
        let by = rotation[0][1] * rx + rotation[1][1] * ry + rotation[2][1] * rz;
        let bz = rotation[0][2] * rx + rotation[1][2] * ry + rotation[2][2] * rz;
        let [xx, yy, zz, bound_before] = rows.read::<R>(must_cast_slice(inverse_diagonal));
        let [xy, yz, zx, share_before] = rows.read::<R>(must_cast_slice(inverse_off_diagonal));
        let own = [xx * bx + xy * by + zx * bz, xy * bx + yy * by + yz * bz, zx * bx + yz * by + zz * bz];

        // The inverse of the growth of the bound, with the mass added to both, because growth below the mass is
        // harmless.
        let weight = R::splat(scaling.weight);
        let inverse_growth = (mass + weight * bound_before).divide(mass + weight * bound);
        let distance = (own[0] * own[0] + own[1] * own[1] + own[2] * own[2]).root();
        let one = R::splat(1.0);
        let limit = (R::splat(LARGEST_MOVE) * height).divide(distance);
        // The share recovers only slowly, because each fall of it slows the node down.
        let share = (R::splat(NODE_GROWTH) * inverse_growth)
            .min(one)
            .min(limit)
            .min(R::splat(RECOVERY) * share_before);
        let keep = R::splat(carry) * share.divide(share_before).min(one).root();
        let kept = share.max(R::splat(LEAST_SHARE));
        rows.write(must_cast_slice_mut(inverse_off_diagonal), [xy, yz, zx, kept]);
        growth.inverse_growth = inverse_growth.min(growth.inverse_growth);
        let unused = one - share;
        growth.unused = growth.unused + unused;
        growth.held = growth.held + unused.positive();

        let mut moved = [keep * vx, keep * vy, keep * vz, height];
        for row in 0..3 {
            let along = rotation[row][0] * own[0] + rotation[row][1] * own[1] + rotation[row][2] * own[2];
            moved[row] = moved[row] + share * along;
        }
        FineResult { next: moved, residual: [rx, ry, rz], inverse: [xx, yy, zz, xy, yz, zx] }
    }
}

/// The momentum of nodes with the mean of `M` over the axes, from the inverse of `M`, which gets ones at held axes. It
/// is computed with the correlations `p, q, r`, because at a crushed element the inverse is so small that products of
/// its entries underflow.
#[inline(always)]
fn momentum_of<R: Real>(nodes: &NodeValues<R>, [xx, yy, zz, xy, yz, zx]: [R; 6]) -> [R; 3] {
    let (one, least) = (R::splat(1.0), R::splat(LEAST_INVERSE));
    let [fx, fy, fz] = nodes.free;
    let (a, b, c) =
        ((xx + (one - fx)).max(least), (yy + (one - fy)).max(least), (zz + (one - fz)).max(least));
    let (ra, rb, rc) = (a.root(), b.root(), c.root());
    let (p, q, r) = (xy.divide(ra * rb), yz.divide(rb * rc), zx.divide(rc * ra));
    let (pp, qq, rr) = (p * p, q * q, r * r);
    let determinant = one + R::splat(2.0) * p * q * r - pp - qq - rr;
    let sum = (fx * (one - qq)).divide(a) + (fy * (one - rr)).divide(b) + (fz * (one - pp)).divide(c);
    let mean = R::splat(1.0 / 3.0) * sum.divide(determinant.max(R::splat(LEAST_DETERMINANT)));
    let [vx, vy, vz] = nodes.increment;
    [mean * vx, mean * vy, mean * vz]
}

/// The smooth part of the last increment, and the share of the rest, the rough part, that is removed.
pub(super) struct RoughDamping<'a> {
    pub(super) smooth: &'a [CellPolynomial],
    pub(super) share: f32,
}

/// The pass after the lattice's motion is known: adds it to the next increments, damps rough motion, and removes the
/// bounds from the fourth component of the forces. Gives sums for the energy balance, the error estimate and the
/// damper.
pub(super) struct CorrectionPass<'a, 'b> {
    pub(super) input: PassInput<'a>,
    /// The lattice's motion.
    pub(super) cells: &'a [CellPolynomial],
    /// Damping of rough motion, if any.
    pub(super) damped: Option<RoughDamping<'a>>,
    pub(super) force: &'a mut [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
}

/// Sums for each axis, vectorised over nodes.
#[derive(Clone, Copy)]
struct AxisSums<R> {
    sums: [Sums<R>; 3],
    defects: [DefectSums<R>; 3],
    /// In the order of [`RoughMotion::add`].
    rough: [R; 4],
}

impl<R: Real> AxisSums<R> {
    #[inline(always)]
    fn new(input: &PassInput<'_>) -> Self {
        let defects = [DefectSums::new(input.step, input.scaling, R::splat); 3];
        Self { sums: [Sums::new(input.step, R::splat); 3], defects, rough: [R::splat(0.0); 4] }
    }

    /// Adds nodes with their displacements and next increments.
    #[inline(always)]
    fn add(&mut self, nodes: &NodeValues<R>, displacement: [R; 4], next: [R; 4]) {
        for axis in 0..3 {
            let (free, increment, force, next) =
                (nodes.free[axis], nodes.increment[axis], nodes.force[axis], next[axis]);
            self.sums[axis].add(nodes.mass, free, increment, force, next);
            self.defects[axis].add(nodes.mass, free, displacement[axis], increment, force, next);
        }
    }

    #[inline(always)]
    fn total(
        sums: &[Self; VECTORS_PER_TILE],
        lane_of_row: impl Fn(usize) -> usize,
        rest: &AxisSums<f32>,
    ) -> (Totals, DefectTotals, RoughMotion) {
        let (mut totals, mut defects, mut rough) =
            (Totals::default(), DefectTotals::default(), RoughMotion::NONE);
        for row in 0..TILE {
            let (sums, lane) = sums_of_row::<R, _>(sums, row, &lane_of_row);
            let ([a, b, c], [d, e, f], [g, h, i, j]) = (&sums.sums, &sums.defects, &sums.rough);
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

impl CorrectionPass<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> (Totals, DefectTotals, RoughMotion) {
        dispatch(self)
    }
}

impl Kernel for CorrectionPass<'_, '_> {
    type Output = (Totals, DefectTotals, RoughMotion);

    #[inline(always)]
    fn run<R: Real>(mut self) -> Self::Output {
        let input = self.input;
        let nodes = input.inertia.len().min(input.places.len());
        let whole = nodes - nodes % TILE;
        let mut sums = [AxisSums::<R>::new(&self.input); VECTORS_PER_TILE];
        for first in (0..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let Some((rows, places)) = input.in_order::<R>(first + vector * R::COUNT) else {
                    continue;
                };
                let coarse = motion_at(self.cells, &places);
                let mut smooth = [R::splat(0.0); 3];
                if let Some(damping) = &self.damped {
                    smooth = motion_at(damping.smooth, &places);
                }
                self.nodes(rows, coarse, smooth, &mut sums[vector % VECTORS_PER_TILE]);
            }
        }
        let mut rest = AxisSums::new(&self.input);
        for at in whole..nodes {
            let Some(place) = self.input.places.get(at) else {
                continue;
            };
            let rows = Contiguous(place.node());
            let at = |cells: &[CellPolynomial]| {
                cells.get(place.cell()).map_or([0.0; 3], |cell| cell.at(place.within()))
            };
            let smooth = self.damped.as_ref().map_or([0.0; 3], |damping| at(damping.smooth));
            self.nodes(rows, at(self.cells), smooth, &mut rest);
        }
        AxisSums::total(&sums, |row| row, &rest)
    }
}

impl CorrectionPass<'_, '_> {
    #[inline(always)]
    fn nodes<R: Real>(&mut self, rows: impl Rows, coarse: [R; 3], smooth: [R; 3], sums: &mut AxisSums<R>) {
        let nodes = self.input.read::<R>(rows, self.force);
        let NodeValues { free, mass, force: [fx, fy, fz], increment, .. } = nodes;
        let displacement = rows.read::<R>(must_cast_slice(self.input.displacement));
        let mut moved = rows.read::<R>(must_cast_slice(self.tables.next_increment));
        let mut removed = [R::splat(0.0); 3];
        if let Some(damping) = &self.damped {
            let mut rough = rows.read::<R>(must_cast_slice(self.tables.rough));
            let [square, change, both, whole] = &mut sums.rough;
            for axis in 0..3 {
                let here = free[axis] * (increment[axis] - smooth[axis]);
                let difference = here - rough[axis];
                *square = *square + mass * here * here;
                *change = *change + mass * difference * difference;
                *both = *both + mass * here * difference;
                *whole = *whole + mass * free[axis] * increment[axis] * increment[axis];
                // In a crushed body `here` may be infinite or NaN; with a share of zero it must not be used.
                removed[axis] =
                    if damping.share > 0.0 { R::splat(damping.share) * here } else { removed[axis] };
                rough[axis] = here;
            }
            rows.write(must_cast_slice_mut(self.tables.rough), rough);
        }
        for axis in 0..3 {
            moved[axis] = free[axis] * (moved[axis] + coarse[axis]) - removed[axis];
        }
        sums.add(&nodes, displacement, moved);
        rows.write(must_cast_slice_mut(self.tables.next_increment), moved);
        rows.write(must_cast_slice_mut(self.force), [fx, fy, fz, R::splat(0.0)]);
    }
}

/// Both passes in one, without a lattice.
pub(super) struct UncoupledPass<'a, 'b> {
    pub(super) input: PassInput<'a>,
    pub(super) velocity_scale: f32,
    pub(super) rotations: &'a RotationTable,
    pub(super) force: &'a mut [NodeVector],
    pub(super) tables: &'a mut NodeTables<'b>,
}

impl UncoupledPass<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> (HeldBack, Totals, DefectTotals) {
        dispatch(self)
    }
}

impl Kernel for UncoupledPass<'_, '_> {
    type Output = (HeldBack, Totals, DefectTotals);

    #[inline(always)]
    fn run<R: Real>(mut self) -> Self::Output {
        let nodes = self.input.inertia.len();
        let whole = nodes - nodes % TILE;
        let mut growth = [GrowthSums::<R>::new(); VECTORS_PER_TILE];
        let mut sums = [AxisSums::<R>::new(&self.input); VECTORS_PER_TILE];
        for first in (0..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let rows = Contiguous(first + vector * R::COUNT);
                let index = vector % VECTORS_PER_TILE;
                self.nodes(rows, &mut growth[index], &mut sums[index]);
            }
        }
        let (mut rest_growth, mut rest) = (GrowthSums::new(), AxisSums::new(&self.input));
        for node in whole..nodes {
            self.nodes::<f32>(Contiguous(node), &mut rest_growth, &mut rest);
        }
        let (totals, defects, _) = AxisSums::total(&sums, R::lane_of_row, &rest);
        (GrowthSums::total(&growth, R::lane_of_row, rest_growth).0, totals, defects)
    }
}

impl UncoupledPass<'_, '_> {
    #[inline(always)]
    fn nodes<R: Real>(&mut self, rows: Contiguous, growth: &mut GrowthSums<R>, sums: &mut AxisSums<R>) {
        let &mut Self { input, velocity_scale, rotations, .. } = self;
        let nodes = input.read::<R>(rows, self.force);
        let [fx, fy, fz] = nodes.force;
        let tables = &mut *self.tables;
        let (cells, momentum): (&mut [CellPolynomial], _) = (&mut [], None);
        let mut next = FinePass { input, velocity_scale, rotations, force: &[], tables, cells, momentum }
            .nodes(rows, &nodes, growth)
            .next;
        for axis in 0..3 {
            next[axis] = nodes.free[axis] * next[axis];
        }
        sums.add(&nodes, rows.read::<R>(must_cast_slice(input.displacement)), next);
        rows.write(must_cast_slice_mut(self.tables.next_increment), next);
        rows.write(must_cast_slice_mut(self.force), [fx, fy, fz, R::splat(0.0)]);
    }
}

/// Moves the nodes by their next increments.
pub(super) struct ApplyIncrements<'a> {
    pub(super) next: &'a [NodeVector],
    pub(super) displacement: &'a mut [NodeVector],
    pub(super) increment: &'a mut [NodeVector],
}

impl ApplyIncrements<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) {
        dispatch(self);
    }
}

impl Kernel for ApplyIncrements<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        // The fourth component is no increment.
        let axes = axes::<R>();
        let (next, rest) = must_cast_slice::<_, f32>(self.next).as_chunks::<TILE>();
        let (displacement, rest_of_displacement) =
            must_cast_slice_mut::<_, f32>(self.displacement).as_chunks_mut::<TILE>();
        let (increment, rest_of_increment) =
            must_cast_slice_mut::<_, f32>(self.increment).as_chunks_mut::<TILE>();
        for ((next, displacement), increment) in next.iter().zip(displacement).zip(increment) {
            // Results are collected in local arrays: the compiler cannot know that the two tables do not overlap.
            let (mut moved, mut there) = ([0.0; TILE], [0.0; TILE]);
            for from in (0..TILE).step_by(R::COUNT) {
                let of = |values: &[f32; TILE]| R::from_fn(|lane| values[(from + lane) % TILE]);
                let next = axes.choose(of(next), R::splat(0.0));
                let sum = of(displacement) + next;
                for lane in 0..R::COUNT {
                    moved[(from + lane) % TILE] = next.lane(lane);
                    there[(from + lane) % TILE] = sum.lane(lane);
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
