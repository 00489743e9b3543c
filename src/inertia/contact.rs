//! Instruments in long steps. A push on a node moves it by its own inertia, and all nodes by the lattice's:
//! `B = D^2 (N^-1 + W S^-1 W^T)` with the inertia of this step (`super`). The pushes of the step before act as forces
//! from the start, so a push that stays the same moves the lattice as any other force does; what remains to be found is
//! their change ([`crate::contact::solve`]). The pushes are forces on the tissue and contain no inertia that the step
//! adds.

use glam::Vec3;

use super::cells::prolong;
use super::coarse_motion::CoarseSpace;
use super::coarse_room::CoarseRoom;
use super::large_step::Storage;
use super::lattice::LatticeNode;
use super::lattice::{CoarseVectors, MAX_FUNCTIONS, node_place, rank_of};
use super::local_response::{ListedFunctions, LocalResponse, MOST_LISTED};
use super::node::Scaling;
use super::node_tables::NodeTables;
use super::parts::NodeParts;
use super::pass_input::{PassInput, ResidualFactors};
use super::step::InertiaStep;
use crate::contact::{Compliance, SolverRoom, Surface, TouchedPoint, directions, solve};
use crate::element::{ElementMaterial, NodeInertia};
use crate::simd::NodeVector;
use crate::step::{Threads, Totals, Trial};

/// Nodes and what moves them in a step.
#[derive(Clone, Copy)]
struct MovedNodes<'a, 'm> {
    places: &'a [LatticeNode],
    inertia: &'a [NodeInertia],
    /// `D^2` for forces, s^2.
    square: f32,
    /// The lattice and the share of `S^-1`, if it is in use.
    lattice: Option<(CoarseSpace<'a, 'm>, f32)>,
}

impl MovedNodes<'_, '_> {
    /// Ones along the free axes of a node.
    fn free(&self, node: usize) -> Vec3 {
        self.inertia.get(node).map_or(Vec3::ZERO, |inertia| inertia.free().truncate())
    }

    /// Sums over the nodes of their vectors (N), for each function: kg m.
    fn add_sums(&self, points: &[TouchedPoint], mut sum: impl FnMut(usize, Vec3)) {
        let Some((space, _)) = &self.lattice else { return };
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

    /// The lattice's motion at a node, m, from that of its functions.
    fn at(&self, node: usize, moved: impl Fn(usize) -> Vec3) -> Vec3 {
        let (Some((space, _)), Some(place)) = (&self.lattice, node_place(self.places, node)) else {
            return Vec3::ZERO;
        };
        let weights = space.lattice.weights(place).into_iter().filter(|each| each.0 < MAX_FUNCTIONS);
        self.free(node) * weights.map(|(function, weight)| weight * moved(function)).sum::<Vec3>()
    }
}

/// `B` of a step.
struct StepCompliance<'a, 'm> {
    nodes: MovedNodes<'a, 'm>,
    tables: &'a mut NodeTables<'m>,
    /// With the scalar bounds of the nodes.
    force: &'a [NodeVector],
    scaling: &'a Scaling,
    /// The motion of the lattice's functions.
    moved: &'a mut CoarseVectors,
    /// The functions that move the nodes, and the answer of the lattice between them, if they are few.
    listed: ListedFunctions,
    local: Option<LocalResponse<'a>>,
    surface: Surface<'a>,
    /// Sums of the vectors for each node of the surface, where triangles share nodes; else empty.
    sums: &'a mut [NodeVector],
}

impl StepCompliance<'_, '_> {
    /// The motion of a node by its own inertia, m.
    fn own(&self, node: usize, force: Vec3) -> Vec3 {
        let closeness = row(self.tables.next_increment, rank_of(self.nodes.places, node))[3];
        let mass = self.nodes.inertia.get(node).map_or(0.0, |inertia| inertia.mass);
        let inertia = self.scaling.inertia(mass, closeness * row(self.force, node)[3]);
        self.nodes.free(node) * force * (self.nodes.square / inertia)
    }

    /// Moves the lattice by the vectors of the nodes.
    fn move_lattice(&mut self, points: &[TouchedPoint]) {
        let Self { nodes, moved, .. } = self;
        moved.fill(NodeVector::ZERO);
        nodes.add_sums(points, |function, residual| {
            if let Some(NodeVector([x, y, z, _])) = moved.get_mut(function) {
                (*x, *y, *z) = (*x + residual.x, *y + residual.y, *z + residual.z);
            }
        });
        if let Some((space, share)) = nodes.lattice {
            space.solve(moved);
            moved.iter_mut().flat_map(|vector| &mut vector.0).for_each(|value| *value *= share);
        }
    }

    /// Replaces the vectors of the points (N) by their motions by the inertia of their nodes and that of the lattice.
    fn replace(&self, points: &mut [TouchedPoint], moved: impl Fn(usize) -> Vec3) {
        for touched in points {
            let vector = Vec3::from_array(touched.vector);
            let places = self.surface.corner_places(touched.place as usize);
            let motions = touched.corners().zip(places).map(|((node, share), place)| {
                let force = self.sums.get(place).map_or(vector, |sum| sum.to_array().into());
                share * (self.own(node, force) + self.nodes.at(node, &moved))
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
        let Some((_, share)) = self.nodes.lattice else { return self.replace(nodes, |_| Vec3::ZERO) };
        let Some(local) = &self.local else {
            self.move_lattice(nodes);
            return self
                .replace(nodes, |function| self.moved.get(function).copied().unwrap_or_default().to_array().into());
        };
        let mut sums = [Vec3::ZERO; MOST_LISTED];
        self.nodes.add_sums(nodes, |function, residual| {
            if let Some(sum) = self.listed.place(function).and_then(|place| sums.get_mut(place)) {
                *sum += residual;
            }
        });
        local.answer(&mut sums);
        self.replace(nodes, |function| {
            share * self.listed.place(function).and_then(|place| sums.get(place)).copied().unwrap_or_default()
        });
    }
}

impl<T: Threads> InertiaStep<'_, T> {
    /// Finds the pushes of this step, and what they change: forces, next increments and the sums over the nodes.
    #[inline(never)]
    pub(super) fn meet_instruments<M: ElementMaterial>(&mut self, trial: &mut Trial<'_, M>, totals: &mut Totals) {
        let Some(contact) = trial.loads.contact() else { return };
        let Self { threads, step, model, storage, response, .. } = self;
        let Storage { tables, places, matrices, room: CoarseRoom { motion: moved, .. } } = storage;
        trial.find_touched(contact, step, tables.next_increment, |node| rank_of(places, node));
        if trial.touched == 0 {
            trial.report_touches(contact, step, totals, |_| [0.0; 4]);
            return;
        }
        let inertia = trial.scene.inertia;
        let square = ResidualFactors::new(step, model, trial.progress).square();
        let space = CoarseSpace { lattice: &model.lattice, renewal: &model.renewal, matrices: &*matrices };
        let lattice = response.map(|share| (space, share));
        let (SolverRoom { touched, local: room, sums }, force) = trial.solver_room_and_forces();
        let listed = ListedFunctions::of(touched, places, &model.lattice);
        let local = lattice.as_ref().and_then(|(space, _)| LocalResponse::gathered(room, &listed, space));
        let (surface, scaling) = (contact.surface(), &model.scaling);
        let nodes = MovedNodes { places, inertia, square, lattice };
        let mut compliance = StepCompliance { nodes, tables, force, scaling, moved, listed, local, surface, sums };
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
        compliance.move_lattice(touched);
        for (each, (node, share)) in touched.iter().flat_map(|each| each.corners().map(move |at| (each, at))) {
            let change = compliance.own(node, share * Vec3::from_array(each.vector));
            if let Some(next) = compliance.tables.next_increment.get_mut(rank_of(places, node)) {
                next.0.iter_mut().zip(change.to_array()).for_each(|(next, moved)| *next += moved);
            }
        }
        prolong(moved, &model.lattice, matrices.cells);
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
