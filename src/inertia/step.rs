//! One step with scaled inertia: forces, the fine part of every node with its share of the lattice's force,
//! the lattice's motion, the account, and only then the state.

use glam::Vec4;

use crate::lanes::NodeVector;
use crate::loads::Loads;
use crate::material::{Law, Material};
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::state::State;
use crate::tled::{Divergence, Entry, InternalForces, Status, culprit, external_forces, follow_motions};

use super::bound::ScalarBeside;
use super::cells::{Cell, prolong, restrict};
use super::damper::{Damper, Rough};
use super::dense::{Row, apply, stride};
use super::estimate::dot;
use super::frames::{Rotation, turn};
use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS};
use super::matrices::{DampedMatrices, Matrices, thirds};
use super::passes::{Alone, Calm, Follow, Given, Prepare, Settle, turns};
use super::refresh::{Refresh, Sources, from_numbers, to_numbers};
use super::vectors::NodeTables;
use super::{COARSE_GROWTH, Core, Inertia, LARGEST_KICK, Storage};

/// More of all nodes' inverse inertia unused than this, or less of the lattice's motion used, makes a step
/// [`Status::Limited`].
const MUCH_UNUSED: f32 = 0.05;
const LITTLE_MOTION: f32 = 0.5;

/// Takes one step of the length that the inertia was prepared for. Every call does the same work, one
/// force evaluation and what the lattice needs. `Mismatch` if the inertia was not prepared for this scene.
pub fn step<M, N, B, S, V, W, D>(
    scene: &Scene<M, N, B>,
    loads: &Loads<'_>,
    state: &mut State<S>,
    inertia: &mut Inertia<V, W, D>,
) -> Status
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    V: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    W: AsRef<[LatticeNode]> + AsMut<[LatticeNode]>,
    D: AsRef<[f32]> + AsMut<[f32]>,
{
    damped_step(scene, loads, state, inertia, None)
}

/// [`step()`] with rough motion damped as `damper` says, if there is one and the inertia is [`Inertia::damped`].
pub fn damped_step<M, N, B, S, V, W, D>(
    scene: &Scene<M, N, B>,
    loads: &Loads<'_>,
    state: &mut State<S>,
    inertia: &mut Inertia<V, W, D>,
    damper: Option<&Damper<'_>>,
) -> Status
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    V: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    W: AsRef<[LatticeNode]> + AsMut<[LatticeNode]>,
    D: AsRef<[f32]> + AsMut<[f32]>,
{
    let Inertia { vectors, places, dense, core } = inertia;
    let storage = Storage { vectors: vectors.as_mut(), places: places.as_mut(), dense: dense.as_mut() };
    core.step(scene, loads, state, storage, damper)
}

impl Core {
    /// [`damped_step`].
    pub(crate) fn step<M, N, B, S>(
        &mut self,
        scene: &Scene<M, N, B>,
        loads: &Loads<'_>,
        state: &mut State<S>,
        storage: Storage<'_>,
        damper: Option<&Damper<'_>>,
    ) -> Status
    where
        M: Material,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
        S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
    {
        let nodes = scene.node_count();
        let room = state.capacity();
        let mismatch = Status::Mismatch { nodes, room: if room < self.nodes { room } else { self.nodes } };
        let Storage { vectors, places, dense } = storage;
        let Self { step, lattice, refresh, scaling, estimate, report, nodes: prepared, damped, rough } = self;
        let State { displacement, increment, force, time, steps, dt, ledger, extremes: seen } = state;
        let (Some(step), Some(displacement), Some(increment), Some(force), Some(mut tables)) = (
            step.filter(|_| *prepared == nodes),
            displacement.as_mut().get_mut(..nodes),
            increment.as_mut().get_mut(..nodes),
            force.as_mut().get_mut(..nodes),
            NodeTables::split(vectors, nodes),
        ) else {
            return mismatch;
        };
        if nodes == 0 || loads.nodes().is_some_and(|checked| checked != nodes) {
            return mismatch;
        }
        let step = step.carried_from(*dt);
        let nodal = scene.inertia();
        let mut account = *ledger;
        if *steps == 0 {
            account.start = account.start.max(scene.releasable_energy());
        }

        external_forces(force, 0, nodal, loads, *time);
        let external = dot(force, displacement);
        let functions = lattice.functions();
        let no_lattice = functions == 0;
        let extremes =
            M::Law::forces_and_bounds(InternalForces::of(scene, displacement, force, ScalarBeside));

        let places = if no_lattice { &[] } else { places.get(..nodes).unwrap_or_default() };
        let Some(mut matrices) = Matrices::split(dense, lattice, *damped && lattice.functions() > 0) else {
            return mismatch;
        };
        let mut coarse_share = 1.0;
        // Without a lattice there is nothing to tell rough from smooth by.
        let damper = damper.filter(|_| refresh.lattice_in_use && !no_lattice);
        let damping = damper.map_or(0.0, |damper| step.carry() * damper.share(rough, scaling.k));
        refresh.look(displacement, *steps);
        let turns = &turns(&refresh.frames.of_bounds, refresh.frames.functions());
        let given = Given { step: &step, scaling, inertia: nodal, displacement, increment, places };
        let (brake, tables) = (refresh.brake, &mut tables);
        let (held_back, totals, defects, found);
        if no_lattice {
            (held_back, totals, defects) = Alone { given, brake, turns, force, tables }.dispatched();
            found = Rough::NONE;
        } else {
            let cells = &mut *matrices.cells;
            let momentum = matrices.damped.as_mut().map(|damped| &mut *damped.momentum);
            let growth;
            (held_back, growth) =
                Prepare { given, brake, turns, force, tables, cells, momentum }.dispatched();
            if growth > COARSE_GROWTH {
                coarse_share = COARSE_GROWTH / growth;
            }
            coarse_share = coarse_motion(&mut matrices, lattice, coarse_share, refresh);
            let cells = &*matrices.cells;
            let damped = matrices.damped.as_mut().filter(|_| refresh.lattice_in_use);
            let smooth = damped.and_then(|damped| smooth_motion(damped, lattice, increment));
            let damped = smooth.map(|smooth| Calm { smooth, share: damping });
            (totals, defects, found) = Settle { given, cells, damped, force, tables }.dispatched();
        }

        let tables_next: &[NodeVector] = tables.next;
        let next = |node: usize, _: &NodeInertia, _: &NodeVector, _: &NodeVector| {
            let [x, y, z, _] = tables_next.get(node).copied().unwrap_or_default().0;
            [x, y, z, 0.0]
        };
        let entry = Entry::of_totals(&totals, loads, &step)
            .with_forces(loads, nodal, increment, force, *time, next)
            .with_motions(loads, displacement, increment, force, *time, &step);
        let entered = match entry.entered(account, &step) {
            Ok(entered) => entered,
            Err(cause) => {
                let node = culprit(nodal, increment, force, &step, next);
                return Status::Diverged(Divergence { time: *time, node, cause });
            }
        };

        (*ledger, *seen) = (entered, extremes);
        *rough = found;
        estimate.advance(&defects, external, nodes, scaling.k, step.seconds() * step.seconds());
        Follow { next: tables.next, displacement, increment }.dispatched();
        *dt = step.seconds();
        *time += f64::from(step.seconds());
        *steps += 1;
        follow_motions(loads, displacement, increment, *time);
        refresh.correction = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
        refresh.share(coarse_share);
        let sources = Sources { scene, displacement, increment, lattice, places, scaling };
        refresh.advance(*steps, sources, tables, &mut matrices);
        *report = refresh.published.report(held_back.nodes, coarse_share, estimate.error());
        report.damping = damping;
        let held = held_back.unused > MUCH_UNUSED * nodes as f32 || coarse_share < LITTLE_MOTION;
        extremes.status(ledger, held)
    }
}

/// How many times larger than the largest increment what is smooth of them may be: functions that are cut off by the body's
/// surface reach beyond it.
const SMOOTH: f32 = 10.0;

/// The cells' sums of momentum become what of the increments is smooth, `W G^-1 W^T M du`. Nothing where that cannot be: `G`
/// is a cycle old, and where an element has been crushed since, `M` is another.
fn smooth_motion<'a>(
    damped: &'a mut DampedMatrices<'_>,
    lattice: &Lattice,
    increment: &[NodeVector],
) -> Option<&'a [Cell]> {
    let functions = lattice.functions();
    let momentum = restrict(damped.momentum, lattice);
    let mut smooth = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    let rows = damped.mean.chunks_exact(stride(thirds(functions)).max(1));
    for (smooth, row) in smooth.iter_mut().zip(rows).take(functions) {
        let products = row.iter().zip(&momentum).take(functions);
        let sum: Vec4 = products.map(|(entry, momentum)| *entry * Vec4::from(momentum.0)).sum();
        smooth.0 = sum.to_array();
    }
    let largest = increment.iter().fold(Vec4::ZERO, |most, du| most.max(Vec4::from(du.0).abs()));
    let most = Vec4::splat(SMOOTH * largest.max_element());
    if !smooth.iter().all(|vector| Vec4::from(vector.0).abs().cmple(most).all()) {
        return None;
    }
    prolong(&smooth, lattice, damped.momentum);
    Some(damped.momentum)
}

/// `share (S^-1 - G^-1) W^T r` less the correction that a change of `S` asked for, from the cells' sums of `r` to what
/// they move. The share falls where the forces of one step would strain a cell by more than [`LARGEST_KICK`]. With a
/// damped inertia `S^-1` goes to second order.
fn coarse_motion(matrices: &mut Matrices<'_>, lattice: &Lattice, mut share: f32, refresh: &Refresh) -> f32 {
    let functions = lattice.functions();
    let (size, stride) = (3 * functions, stride(functions));
    let mut restricted = restrict(matrices.cells, lattice);
    turn(&mut restricted, &refresh.frames.of_bounds, Rotation::back);
    let forces = to_numbers(&restricted);
    let times = |matrix: &[f32], row: &Row| apply(matrix, stride, row.get(..size).unwrap_or_default());
    let mut moved = times(matrices.applied, &forces);
    if let Some(damped) = matrices.damped.as_mut().filter(|_| refresh.lattice_in_use) {
        // `A S^-1 g = g - M S^-1 g`: where elements are crushed `A` is too large for products with it.
        let first = times(damped.inverse, &forces);
        let mut absorbed = forces;
        for (absorbed, kept) in absorbed.iter_mut().zip(times(damped.mass, &first)) {
            *absorbed -= kept;
        }
        let second = times(damped.inverse, &absorbed);
        for (moved, more) in moved.iter_mut().zip(times(damped.inverse, &times(damped.mass, &second))) {
            *moved += more;
        }
    }
    let mut solution = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    from_numbers(moved.get(..size).unwrap_or_default(), &mut solution);
    turn(&mut solution, &refresh.frames.of_bounds, Rotation::out);
    let strain = lattice.largest_strain(&solution);
    if share * strain > LARGEST_KICK {
        share = LARGEST_KICK / strain;
    }
    for (solution, correction) in solution.iter_mut().zip(&refresh.correction) {
        for (value, correction) in solution.0.iter_mut().zip(correction.0) {
            *value = share * *value - correction;
        }
    }
    prolong(&solution, lattice, matrices.cells);
    share
}
