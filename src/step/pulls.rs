//! Pulls in a step ([`crate::pulls`]).

use glam::Vec3;

use super::{Step, StepMethod, Totals, Trial};
use crate::element::ElementMaterial;
use crate::pulls::{Pull, Pulls};
use crate::simd::NodeVector;

/// The most that a pull moves its point in an exact step, as a share of the size of a node's tissue.
const MOST_WAY: f32 = 0.02;
/// Times that the pulls are solved for one after the other, and the change, as a share of the largest force squared, below which
/// they are not again.
const SWEEPS: usize = 3;
const SETTLED: f32 = 1e-6;

/// A pulled point in a step.
struct Point {
    /// How it moves in the step, and in that before, m.
    next: Vec3,
    last: Vec3,
    /// The largest component of the motion of a node, m.
    farthest: f32,
    /// How far it moves under a force, m/N for each axis.
    compliance: Vec3,
}

impl<M: ElementMaterial> Trial<'_, M> {
    /// Adds the forces of pulls at the end of the step, for methods whose next increment of a node follows from its force
    /// and its mass alone, with the factor `s` of the force over the mass (s^2).
    #[inline(never)]
    pub(crate) fn pull(&mut self, (step, factor): (&Step, f32), method: &impl StepMethod<M>, totals: &mut Totals) {
        let Some(pulls) = self.loads.pulls() else { return };
        self.pulls.fill(NodeVector::ZERO);
        for _ in 0..SWEEPS {
            let (mut changed, mut all) = (0.0f32, 0.0f32);
            for (index, pull) in pulls.acting() {
                let now = at(self.pulls, index);
                let point = self.pulled_point(pulls, pull, factor, method);
                let force =
                    self.without_tearing(pulls, pull, &point, self.force_at_end(step, pulls, pull, &point, now), now);
                let change = force - now;
                (changed, all) = (changed.max(change.length_squared()), all.max(force.length_squared()));
                if change == Vec3::ZERO {
                    continue;
                }
                if let Some(place) = self.pulls.get_mut(index) {
                    place.0 = force.extend(0.0).to_array();
                }
                for pulled in pulls.nodes_of(pull) {
                    self.add_force(pulled.node as usize, pulled.weight * change, (step, method), totals);
                }
            }
            if changed <= SETTLED * all {
                break;
            }
        }
        for (index, pull) in pulls.acting() {
            let (force, point) = (at(self.pulls, index), self.pulled_point(pulls, pull, factor, method));
            totals.add_work(0.5 * force.dot(point.next + point.last));
            totals.farthest[1] = totals.farthest[1].max(point.farthest);
        }
    }

    /// The force of a pull at the end of a step, N.
    fn force_at_end(&self, step: &Step, pulls: &Pulls<'_>, pull: &Pull, point: &Point, now: Vec3) -> Vec3 {
        let end = self.progress.time + f64::from(step.seconds());
        let moved = self.moved_mean(pulls, pull) + point.next;
        pull.force((pull.target(end) - Vec3::from_array(pull.at)) - moved, now, point.compliance)
    }

    /// The mean displacement of the nodes of a pull, m.
    pub(crate) fn moved_mean(&self, pulls: &Pulls<'_>, pull: &Pull) -> Vec3 {
        pulls.mean(pull, |node| at(self.displacement, node) + at(self.remainder, node))
    }

    fn pulled_point(&self, pulls: &Pulls<'_>, pull: &Pull, factor: f32, method: &impl StepMethod<M>) -> Point {
        let mut point = Point { next: Vec3::ZERO, last: Vec3::ZERO, farthest: 0.0, compliance: Vec3::ZERO };
        for pulled in pulls.nodes_of(pull) {
            let (node, weight) = (pulled.node as usize, pulled.weight);
            let (Some(inertia), Some(increment), Some(force)) =
                (self.scene.inertia.get(node), self.increment.get(node), self.force.get(node))
            else {
                continue;
            };
            let [x, y, z, _] = method.next_increment(node, inertia, increment, force);
            let (next, inverse) = (Vec3::new(x, y, z), Vec3::from_array(inertia.inverse));
            let last = Vec3::from_array(increment.to_array());
            // A held axis moves as in the step before.
            point.next += weight * Vec3::select(inverse.cmpgt(Vec3::ZERO), next, last);
            point.last += weight * last;
            point.farthest = point.farthest.max(next.abs().max_element());
            point.compliance += weight * weight * factor * inverse;
        }
        point
    }

    /// The force, or as much of its change from what it is now as moves the point no farther than tissue can follow in a step, or no farther than it
    /// moves by itself.
    fn without_tearing(&self, pulls: &Pulls<'_>, pull: &Pull, point: &Point, force: Vec3, now: Vec3) -> Vec3 {
        let change = force - now;
        let (free, way) = (point.next, point.compliance * change);
        let square = (free + way).length_squared();
        let nodes = pulls.nodes_of(pull).iter();
        let heaviest = nodes.fold((0, 0.0), |(node, most), pulled| {
            if pulled.weight > most { (pulled.node as usize, pulled.weight) } else { (node, most) }
        });
        let volume = self.scene.node_volume(heaviest.0);
        // Without a root where there is nothing to be done, as this is for every pull in every step.
        const CUBE: f32 = MOST_WAY * MOST_WAY * MOST_WAY;
        if square * square * square <= CUBE * CUBE * volume * volume || square <= free.length_squared() {
            return force;
        }
        let most = (MOST_WAY * self.scene.node_size(heaviest.0)).max(free.length());
        // |free + share way| = most
        let (product, length) = (free.dot(way), way.length_squared());
        let rest = product * product + length * (most * most - free.length_squared()).max(0.0);
        let share = (libm::sqrtf(rest) - product) / length;
        now + share.clamp(0.0, 1.0) * change
    }
}

fn at(vectors: &[NodeVector], node: usize) -> Vec3 {
    vectors.get(node).copied().unwrap_or_default().to_array().into()
}
