//! Instruments in mass-scaled, multilevel and damped steps. A push on a node moves it by its own inertia, and all nodes
//! by the lattice's: `B = D^2 (M^-1 + W (S^-1 - G^-1) W^T)` with the inertia and the shares of this step (`super`). The
//! pushes of the step before act as forces from the start, so a push that stays the same moves the lattice as any other
//! force does; what remains to be found is their change ([`crate::contact::solve`]). The pushes are forces on the
//! tissue and contain no inertia that the step adds.

use glam::Vec3;

use super::cells::prolong;
use super::coarse_motion::CoarseSpace;
use super::large_step::Storage;
use super::lattice::LatticeNode;
use super::lattice::{CoarseVectors, MAX_FUNCTIONS, node_place, rank_of};
use super::local_response::{ListedFunctions, LocalResponse, MOST_LISTED};
use super::matrices::Matrices;
use super::motion_pass::{RotationTable, rotation_table};
use super::node_tables::NodeTables;
use super::parts::NodeParts;
use super::pass_input::{PassInput, ResidualFactors};
use super::step::InertiaStep;
use crate::contact::{Compliance, SolverRoom, Surface, TouchedPoint, directions, solve};
use crate::element::{ElementMaterial, NodeInertia};
use crate::padding;
use crate::simd::NodeVector;
use crate::step::{Threads, Totals, Trial};

/// `B` of a step.
struct StepCompliance<'a, 'm> {
    tables: &'a mut NodeTables<'m>,
    places: &'a [LatticeNode],
    inertia: &'a [NodeInertia],
    rotations: &'a RotationTable,
    /// `D^2` for forces, s^2.
    square: f32,
    /// The lattice, its matrices and the shares of `S^-1` and `G^-1`, if it is in use.
    lattice: Option<(CoarseSpace<'a>, &'a Matrices<'m>, [f32; 2])>,
    /// The functions that move the nodes, and the answer of the lattice between them, if they are few.
    listed: ListedFunctions,
    local: Option<LocalResponse<'a>>,
    surface: Surface<'a>,
    /// Sums of the vectors for each node of the surface, where triangles share nodes; else empty.
    sums: &'a mut [NodeVector],
}

impl StepCompliance<'_, '_> {
    /// Ones along the free axes of a node.
    fn free(&self, node: usize) -> Vec3 {
        self.inertia.get(node).map_or(Vec3::ZERO, |inertia| inertia.free().truncate())
    }

    /// The motion of a node by its own inertia, m.
    fn own(&self, node: usize, force: Vec3) -> Vec3 {
        let (rank, free) = (rank_of(self.places, node), self.free(node));
        let row = |table: &[NodeVector]| row(table, rank);
        let frame = padding::frame_of(row(self.tables.next_increment)[3]);
        let rotation = self.rotations[frame.min(MAX_FUNCTIONS)].map(|[x, y, z, _]| Vec3::new(x, y, z));
        let [x, y, z] = rotation;
        let residual = free * force * self.square;
        let turned = x * residual.x + y * residual.y + z * residual.z;
        let [xx, yy, zz, _] = row(self.tables.inverse_diagonal);
        let [xy, yz, zx, share] = row(self.tables.inverse_off_diagonal);
        let moved = Vec3::new(
            turned.dot(Vec3::new(xx, xy, zx)),
            turned.dot(Vec3::new(xy, yy, yz)),
            turned.dot(Vec3::new(zx, yz, zz)),
        );
        free * share * Vec3::new(x.dot(moved), y.dot(moved), z.dot(moved))
    }

    /// Sums over the nodes of their vectors (N), for each function: kg m.
    fn add_sums(&self, points: &[TouchedPoint], mut sum: impl FnMut(usize, Vec3)) {
        let Some((space, ..)) = &self.lattice else { return };
        for touched in points {
            for (node, share) in touched.corners() {
                let residual = self.free(node) * Vec3::from_array(touched.vector) * (share * self.square);
                let Some(place) = node_place(self.places, node) else { continue };
                for (function, weight) in space.lattice.weights(place) {
                    sum(function, weight * residual);
                }
            }
        }
    }

    /// The motion of the lattice by the vectors of the nodes. None without one.
    fn coarse(&self, points: &[TouchedPoint]) -> Option<CoarseVectors> {
        let (space, matrices, shares) = self.lattice.as_ref()?;
        let mut sums = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
        self.add_sums(points, |function, residual| {
            if let Some(NodeVector([x, y, z, _])) = sums.get_mut(function) {
                (*x, *y, *z) = (*x + residual.x, *y + residual.y, *z + residual.z);
            }
        });
        Some(space.response(matrices, &sums, self.listed.functions(), *shares))
    }

    /// The lattice's motion at a node, m, from that of its functions.
    fn at(&self, node: usize, moved: impl Fn(usize) -> Vec3) -> Vec3 {
        let (Some((space, ..)), Some(place)) = (&self.lattice, node_place(self.places, node)) else {
            return Vec3::ZERO;
        };
        let weights = space.lattice.weights(place).into_iter().filter(|each| each.0 < MAX_FUNCTIONS);
        self.free(node) * weights.map(|(function, weight)| weight * moved(function)).sum::<Vec3>()
    }

    /// Replaces the vectors of the points (N) by their motions by the inertia of their nodes and that of the lattice.
    fn replace(&self, points: &mut [TouchedPoint], moved: impl Fn(usize) -> Vec3) {
        for touched in points {
            let vector = Vec3::from_array(touched.vector);
            let places = self.surface.corner_places(touched.place as usize);
            let motions = touched.corners().zip(places).map(|((node, share), place)| {
                let force = self.sums.get(place).map_or(vector, |sum| sum.to_array().into());
                share * (self.own(node, force) + self.at(node, &moved))
            });
            touched.vector = motions.sum::<Vec3>().to_array();
        }
    }

    /// Sums at each node the vectors of the points that it carries, N.
    fn sum_at_nodes(&mut self, points: &[TouchedPoint]) {
        if self.sums.is_empty() {
            return;
        }
        for place in points.iter().flat_map(|each| self.surface.corner_places(each.place as usize)) {
            if let Some(sum) = self.sums.get_mut(place) {
                *sum = NodeVector::ZERO;
            }
        }
        for touched in points {
            let places = self.surface.corner_places(touched.place as usize);
            for (place, share) in places.into_iter().zip(touched.shares()) {
                if let Some(NodeVector(sum)) = self.sums.get_mut(place) {
                    sum.iter_mut().zip(touched.vector).for_each(|(sum, vector)| *sum += share * vector);
                }
            }
        }
    }

    /// The motion of a point by the inertia of its nodes, m.
    fn own_of_point(&self, point: &TouchedPoint, force: Vec3) -> Vec3 {
        point.corners().map(|(node, share)| share * self.own(node, share * force)).sum()
    }
}

impl Compliance for StepCompliance<'_, '_> {
    fn apply(&mut self, nodes: &mut [TouchedPoint]) {
        self.sum_at_nodes(nodes);
        let Some((space, ..)) = &self.lattice else { return self.replace(nodes, |_| Vec3::ZERO) };
        let Some(local) = &self.local else {
            let moved = self.coarse(nodes).unwrap_or([NodeVector::ZERO; _]);
            return self.replace(nodes, |function| moved.get(function).copied().unwrap_or_default().to_array().into());
        };
        let mut sums = [Vec3::ZERO; MOST_LISTED];
        self.add_sums(nodes, |function, residual| {
            if let Some(sum) = self.listed.place(function).and_then(|place| sums.get_mut(place)) {
                *sum += residual;
            }
        });
        local.answer(&mut sums, &self.listed, space);
        self.replace(nodes, |function| {
            self.listed.place(function).and_then(|place| sums.get(place)).copied().unwrap_or_default()
        });
    }
}

impl<T: Threads> InertiaStep<'_, '_, T> {
    /// Finds the pushes of this step, and what they change: forces, next increments and the sums over the nodes.
    #[inline(never)]
    pub(super) fn meet_instruments<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>, totals: &mut Totals) {
        let Some(contact) = trial.loads.contact() else { return };
        let Self { threads, step, model, storage: Storage { tables, places, matrices, .. }, response, .. } = self;
        trial.find_touched(contact, step, tables.next_increment, |node| rank_of(places, node));
        if trial.touched == 0 {
            trial.report_touches(contact, step, totals, |_| [0.0; 4]);
            return;
        }
        let inertia = trial.scene.inertia;
        let rotations = &rotation_table(&model.refresh.frames.of_bounds, model.refresh.frames.functions());
        let square = ResidualFactors::new(step, model, trial.progress).square();
        let space = CoarseSpace { lattice: &model.lattice, refresh: &model.refresh };
        let lattice = response.map(|shares| (space, &*matrices, shares));
        let SolverRoom { touched, local: room, sums } = trial.solver_room();
        let listed = ListedFunctions::of(touched, places, &model.lattice);
        let local = lattice
            .as_ref()
            .and_then(|(space, matrices, shares)| LocalResponse::gathered(room, &listed, space, matrices, *shares));
        let surface = contact.surface();
        let mut compliance =
            StepCompliance { tables, places, inertia, rotations, square, lattice, listed, local, surface, sums };
        // What the lattice adds is nearly the same at all points of an instrument, and the scale only makes light and
        // heavy ones alike.
        let (mut instrument, mut coarse) = (u32::MAX, 0.0);
        for each in &mut *touched {
            let [normal, a, b] = directions(Vec3::from_array(each.normal));
            let own = compliance.own_of_point(each, normal);
            if each.instrument != instrument {
                each.vector = normal.to_array();
                compliance.apply(core::slice::from_mut(each));
                (instrument, coarse) = (each.instrument, (Vec3::from_array(each.vector) - own).length());
            }
            let across = [a, b].map(|axis| compliance.own_of_point(each, axis).length());
            let most = across.into_iter().fold(own.length() + coarse, f32::max);
            each.scale = if most > 0.0 { 1.0 / libm::sqrtf(most) } else { 0.0 };
        }
        solve(touched, &mut compliance);
        for each in &mut *touched {
            each.vector = (Vec3::from_array(each.push) - Vec3::from_array(each.before)).to_array();
        }
        let moved = compliance.coarse(touched);
        for (each, (node, share)) in touched.iter().flat_map(|each| each.corners().map(move |at| (each, at))) {
            let change = compliance.own(node, share * Vec3::from_array(each.vector));
            if let Some(next) = compliance.tables.next_increment.get_mut(rank_of(places, node)) {
                next.0.iter_mut().zip(change.to_array()).for_each(|(next, moved)| *next += moved);
            }
        }
        prolong(&moved.unwrap_or([NodeVector::ZERO; _]), &model.lattice, matrices.cells);
        trial.add_changes_of_pushes();
        let residual = ResidualFactors::new(step, model, trial.progress);
        let Trial { scene, increment, force, .. } = trial;
        let input = PassInput { step, scaling: &model.scaling, residual, inertia, increment, places };
        let parts = NodeParts { partitions: scene.elements().partitions, threads: *threads };
        totals.replace_sums(&parts.add_motion(input, matrices.cells, force, tables.next_increment));
        trial.report_touches(contact, step, totals, |node| row(tables.next_increment, rank_of(places, node)));
    }
}

fn row(table: &[NodeVector], rank: usize) -> [f32; 4] {
    table.get(rank).copied().unwrap_or_default().0
}
