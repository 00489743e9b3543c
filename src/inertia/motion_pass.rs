//! The pass over the nodes that computes the next increments, vectorised: by the nodes' own inertia, as far as their
//! share of it allows, and by the lattice's motion. It damps rough motion. Gives sums for the energy balance and the
//! damper, and over the nodes that were held back. With a lattice it takes the nodes in the order of the cells, so that
//! the coefficients of a cell stay in registers.

use core::ops::Range;

use bytemuck::{must_cast_slice, must_cast_slice_mut};
use glam::Vec4;

use super::cells::{CellPolynomial, VECTORS_PER_TILE, motion_at};
use super::damper::RoughMotion;
use super::frames::Rotation;
use super::lattice::{LatticeNode, MAX_FUNCTIONS, rank_of};
use super::pass_input::{NodeValues, PassInput};
use super::report::HeldBack;
use super::{LARGEST_MOVE, LEAST_SHARE, NODE_GROWTH, RECOVERY};
use crate::padding;
use crate::simd::{Contiguous, Kernel, NodeVector, Real, Rows, TILE, dispatch};
use crate::step::{Moving, Sums, Totals, moved};

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
fn sums_of_row<R: Real, T>(sums: &[T; VECTORS_PER_TILE], row: usize) -> (&T, usize) {
    (&sums[row / R::COUNT % VECTORS_PER_TILE], R::lane_of_row(row % R::COUNT))
}

/// Sums over held-back nodes, vectorised.
#[derive(Clone, Copy)]
struct HeldSums<R> {
    /// Number of held-back nodes, and sum of the unused shares of their inverse inertia.
    held: R,
    unused: R,
    /// The least share.
    least: R,
}

impl<R: Real> HeldSums<R> {
    #[inline(always)]
    fn new() -> Self {
        Self { held: R::splat(0.0), unused: R::splat(0.0), least: R::splat(1.0) }
    }

    /// Adds the shares of a vector of nodes.
    #[inline(always)]
    fn add(&mut self, share: R) {
        let unused = R::splat(1.0) - share;
        self.held = self.held + unused.positive();
        self.unused = self.unused + unused;
        self.least = share.min(self.least);
    }

    /// The sums; `rest` is for the nodes after the last whole tile.
    #[inline(always)]
    fn total(sums: &[Self; VECTORS_PER_TILE], rest: &HeldSums<f32>) -> HeldBack {
        let mut held_back = HeldBack::NONE;
        for row in 0..TILE {
            let (sums, lane) = sums_of_row::<R, _>(sums, row);
            held_back.add(sums.held.lane(lane), sums.unused.lane(lane), sums.least.lane(lane));
        }
        held_back.add(rest.held, rest.unused, rest.least);
        held_back
    }
}

/// The smooth part of the last increment, and the share of the rest, the rough part, that is removed.
pub(super) struct RoughDamping<'a> {
    pub(super) smooth: &'a [CellPolynomial],
    pub(super) share: f32,
}

/// The motion of the lattice in a step.
pub(super) struct LatticeMotion<'a> {
    /// Added to the increments of the nodes.
    pub(super) cells: &'a [CellPolynomial],
    /// `W G^-1 W^T r`: the smooth part of what the nodes' own inertia would give.
    pub(super) fine: &'a [CellPolynomial],
    /// Damping of rough motion, if any.
    pub(super) damped: Option<RoughDamping<'a>>,
    /// Whether there is a motion of the lattice: if not, the step is one of mass scaling.
    pub(super) in_use: bool,
}

/// The same at a vector of nodes.
struct MotionAt<R> {
    coarse: [R; 3],
    fine: [R; 3],
    smooth: [R; 3],
}

/// The tables of the nodes of some consecutive ranks.
pub(super) struct MotionTables<'a> {
    pub(super) inverse_diagonal: &'a [NodeVector],
    pub(super) inverse_off_diagonal: &'a mut [NodeVector],
    /// Their fourth components receive the shares before the step.
    pub(super) sum_off_diagonal: &'a mut [NodeVector],
    pub(super) next_increment: &'a mut [NodeVector],
    pub(super) rough: &'a mut [NodeVector],
    pub(super) rough_before: &'a mut [NodeVector],
}

/// Inputs and tables of the pass.
pub(super) struct MotionPass<'a> {
    pub(super) input: PassInput<'a>,
    pub(super) rotations: &'a RotationTable,
    /// None without a lattice.
    pub(super) lattice: Option<&'a LatticeMotion<'a>>,
    /// Ranks of the nodes.
    pub(super) ranks: Range<usize>,
    pub(super) force: &'a [NodeVector],
    pub(super) tables: MotionTables<'a>,
}

/// The motion of a vector of nodes by their own inertia, m; the least height of their elements, m; the share of their
/// inverse inertia that was used; the factor of their velocities without a lattice ([`super::node`]).
struct OwnMotion<R> {
    own: [R; 3],
    height: R,
    share: R,
    keep: R,
}

/// Result of [`MotionPass`].
#[derive(Clone, Copy)]
pub(super) struct PassTotals {
    pub(super) totals: Totals,
    pub(super) rough: RoughMotion,
    pub(super) held_back: HeldBack,
}

/// Sums for each axis, vectorised over nodes.
#[derive(Clone, Copy)]
pub(super) struct AxisSums<R> {
    sums: [Sums<R>; 3],
    /// In the order of [`RoughMotion::add`].
    rough: [R; 4],
}

impl<R: Real> AxisSums<R> {
    #[inline(always)]
    pub(super) fn new(input: &PassInput<'_>) -> Self {
        Self { sums: [Sums::new(input.step, R::splat); 3], rough: [R::splat(0.0); 4] }
    }

    /// Adds nodes with their next increments.
    #[inline(always)]
    pub(super) fn add(&mut self, nodes: &NodeValues<R>, next: [R; 4]) {
        for axis in 0..3 {
            let (free, increment, force, next) =
                (nodes.free[axis], nodes.increment[axis], nodes.force[axis], next[axis]);
            self.sums[axis].add(nodes.mass, free, increment, force, next);
        }
    }

    #[inline(always)]
    pub(super) fn total(sums: &[Self; VECTORS_PER_TILE], rest: &AxisSums<f32>, held_back: HeldBack) -> PassTotals {
        let (mut totals, mut rough) = (Totals::NONE, RoughMotion::NONE);
        for row in 0..TILE {
            let (sums, lane) = sums_of_row::<R, _>(sums, row);
            let ([a, b, c], [d, e, f, g]) = (&sums.sums, &sums.rough);
            totals.add_axes(&[a.at(lane), b.at(lane), c.at(lane)]);
            rough.add([d.lane(lane), e.lane(lane), f.lane(lane), g.lane(lane)]);
        }
        totals.add_axes(&rest.sums);
        rough.add(rest.rough);
        PassTotals { totals, rough, held_back }
    }
}

impl MotionPass<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> PassTotals {
        dispatch(self)
    }
}

impl Kernel for MotionPass<'_> {
    type Output = PassTotals;

    #[inline(always)]
    fn run<R: Real>(mut self) -> PassTotals {
        match self.lattice {
            Some(lattice) => self.with_lattice::<R>(lattice),
            None => self.without_lattice::<R>(),
        }
    }
}

impl MotionPass<'_> {
    #[inline(always)]
    fn with_lattice<R: Real>(&mut self, lattice: &LatticeMotion<'_>) -> PassTotals {
        let input = self.input;
        let Range { start, end } = self.ranks;
        let whole = end - (end - start) % TILE;
        let mut sums = [AxisSums::<R>::new(&self.input); VECTORS_PER_TILE];
        let mut held = [HeldSums::<R>::new(); VECTORS_PER_TILE];
        for first in (start..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let rank = first + vector * R::COUNT;
                let Some((rows, places)) = input.in_order::<R>(rank) else {
                    continue;
                };
                let at = |cells: &[CellPolynomial]| motion_at(cells, &places);
                let smooth = lattice.damped.as_ref().map_or([R::splat(0.0); 3], |damped| at(damped.smooth));
                let motion = MotionAt { coarse: at(lattice.cells), fine: at(lattice.fine), smooth };
                let index = vector % VECTORS_PER_TILE;
                self.nodes(Contiguous(rank - start), rows, Some(motion), &mut sums[index], &mut held[index]);
            }
        }
        let (mut rest, mut rest_held) = (AxisSums::new(&self.input), HeldSums::new());
        for rank in whole..end {
            let Some(place) = input.places.get(rank) else {
                continue;
            };
            let at =
                |cells: &[CellPolynomial]| cells.get(place.cell()).map_or([0.0; 3], |cell| cell.at(place.within()));
            let smooth = lattice.damped.as_ref().map_or([0.0; 3], |damped| at(damped.smooth));
            let motion = MotionAt { coarse: at(lattice.cells), fine: at(lattice.fine), smooth };
            self.nodes(Contiguous(rank - start), Contiguous(place.node()), Some(motion), &mut rest, &mut rest_held);
        }
        AxisSums::total(&sums, &rest, HeldSums::total(&held, &rest_held))
    }

    #[inline(always)]
    fn without_lattice<R: Real>(&mut self) -> PassTotals {
        let Range { start, end } = self.ranks;
        let whole = end - (end - start) % TILE;
        let mut sums = [AxisSums::<R>::new(&self.input); VECTORS_PER_TILE];
        let mut held = [HeldSums::<R>::new(); VECTORS_PER_TILE];
        for first in (start..whole).step_by(TILE) {
            for vector in 0..TILE / R::COUNT {
                let node = first + vector * R::COUNT;
                let index = vector % VECTORS_PER_TILE;
                self.nodes(Contiguous(node - start), Contiguous(node), None, &mut sums[index], &mut held[index]);
            }
        }
        let (mut rest, mut rest_held) = (AxisSums::new(&self.input), HeldSums::new());
        for node in whole..end {
            self.nodes::<f32>(Contiguous(node - start), Contiguous(node), None, &mut rest, &mut rest_held);
        }
        AxisSums::total(&sums, &rest, HeldSums::total(&held, &rest_held))
    }

    /// Computes a vector of nodes: `at` are their rows in the tables, `rows` those in scene and state.
    #[inline(always)]
    fn nodes<R: Real>(
        &mut self,
        at: Contiguous,
        rows: impl Rows,
        motion: Option<MotionAt<R>>,
        sums: &mut AxisSums<R>,
        held: &mut HeldSums<R>,
    ) {
        let nodes = self.input.read::<R>(rows, self.force);
        let NodeValues { free, mass, increment, .. } = nodes;
        let OwnMotion { own, height, share, keep } =
            self.own_motion(at, &nodes, motion.as_ref().map(|motion| motion.fine));
        held.add(share);
        let keep = if self.lattice.as_ref().is_some_and(|lattice| lattice.in_use) { R::splat(1.0) } else { keep };
        let carry = keep * R::splat(self.input.step.carry());
        let mut next = [height; 4];
        for axis in 0..3 {
            next[axis] = carry.fused(increment[axis], own[axis]);
        }
        if let Some(motion) = &motion {
            for axis in 0..3 {
                next[axis] = next[axis] + motion.coarse[axis];
            }
        }
        for axis in 0..3 {
            next[axis] = free[axis] * next[axis];
        }
        let damped = self.lattice.as_ref().and_then(|lattice| lattice.damped.as_ref());
        if let (Some(damping), Some(motion)) = (damped, &motion) {
            let has_table = !self.tables.rough.is_empty();
            let mut rough = [R::splat(0.0); 4];
            if has_table {
                rough = at.read::<R>(must_cast_slice(self.tables.rough));
                at.write(must_cast_slice_mut(self.tables.rough_before), rough);
            }
            let [square, change, both, whole] = &mut sums.rough;
            for axis in 0..3 {
                let here = free[axis] * (increment[axis] - motion.smooth[axis]);
                let difference = here - rough[axis];
                *square = *square + mass * here * here;
                *change = *change + mass * difference * difference;
                *both = *both + mass * here * difference;
                *whole = *whole + mass * free[axis] * increment[axis] * increment[axis];
                // In a crushed body `here` may be infinite or NaN; with a share of zero it must not be used.
                if damping.share > 0.0 {
                    next[axis] = next[axis] - R::splat(damping.share) * here;
                }
                rough[axis] = here;
            }
            if has_table {
                at.write(must_cast_slice_mut(self.tables.rough), rough);
            }
        }
        sums.add(&nodes, next);
        at.write(must_cast_slice_mut(self.tables.next_increment), next);
    }

    /// `fine` is the smooth part of that motion.
    #[inline(always)]
    fn own_motion<R: Real>(&mut self, at: Contiguous, nodes: &NodeValues<R>, fine: Option<[R; 3]>) -> OwnMotion<R> {
        let MotionTables { inverse_diagonal, inverse_off_diagonal, sum_off_diagonal, next_increment, .. } =
            &mut self.tables;
        let [rx, ry, rz] = self.input.residual(nodes);
        let [_, _, _, height] = at.read::<R>(must_cast_slice(next_increment));
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
        let [xx, yy, zz, bound_before] = at.read::<R>(must_cast_slice(inverse_diagonal));
        let [xy, yz, zx, share_before] = at.read::<R>(must_cast_slice(inverse_off_diagonal));
        let turned = [xx * bx + xy * by + zx * bz, xy * bx + yy * by + yz * bz, zx * bx + yz * by + zz * bz];
        let mut own = [R::splat(0.0); 3];
        for row in 0..3 {
            own[row] = rotation[row][0] * turned[0] + rotation[row][1] * turned[1] + rotation[row][2] * turned[2];
        }
        // What the node would do relative to the lattice.
        let mut square = R::splat(0.0);
        for axis in 0..3 {
            let relative = fine.map_or(own[axis], |fine| own[axis] - nodes.free[axis] * fine[axis]);
            square = relative.fused(relative, square);
        }
        let limit = (R::splat(LARGEST_MOVE) * height).divide(square.root());
        // The share recovers only slowly: it may have fallen for a reason that returns.
        let share = (R::splat(NODE_GROWTH) * self.input.inverse_growth(nodes, bound_before))
            .min(R::splat(1.0))
            .min(limit)
            .min(R::splat(RECOVERY) * share_before);
        let kept = share.max(R::splat(LEAST_SHARE));
        at.write(must_cast_slice_mut(inverse_off_diagonal), [xy, yz, zx, kept]);
        let [a, b, c, _] = at.read::<R>(must_cast_slice(sum_off_diagonal));
        at.write(must_cast_slice_mut(sum_off_diagonal), [a, b, c, share_before]);
        for own in &mut own {
            *own = share * *own;
        }
        let keep = share.divide(share_before).min(R::splat(1.0)).root();
        OwnMotion { own, height, share, keep }
    }
}

/// Moves some consecutive nodes by their next increments.
pub(super) fn apply_increments(first: usize, places: &[LatticeNode], next: &[NodeVector], moving: Moving<'_>) {
    let Moving { displacement, remainder, increment } = moving;
    // The fourth component is no increment.
    let axes = Vec4::new(1.0, 1.0, 1.0, 0.0).cmpgt(Vec4::ZERO);
    for (node, ((displacement, remainder), increment)) in
        (first..).zip(displacement.iter_mut().zip(remainder).zip(increment))
    {
        let next = next.get(rank_of(places, node)).copied().unwrap_or_default();
        let next = Vec4::select(axes, Vec4::from(next.0), Vec4::ZERO);
        let sum = moved(displacement.0.into(), remainder.0.into(), next);
        [displacement.0, remainder.0] = sum.map(|sum| sum.to_array());
        increment.0 = next.to_array();
    }
}
