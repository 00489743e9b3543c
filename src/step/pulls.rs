//! Pulls in an exact step, and in one to rest ([`crate::pulls`]).

use glam::{Vec3, Vec4};

use super::{Step, StepMethod, Trial};
use crate::element::ElementMaterial;
use crate::pulls::{Pull, Pulls};
use crate::simd::NodeVector;

/// The most that a pull moves its point in an exact step, as a share of the size of a node's tissue.
pub(crate) const MOST_WAY: f32 = 0.02;
/// Tissue that moves as a whole may gather speed beyond that: by how much more than by itself, and than its force in the step before
/// would, a pull may move its point, as shares of that. A twentieth holds back every second frame of moving points (`supple-lab pulls`).
const MOST_GAIN: [f32; 2] = [4.0, 1.0];
/// A pull is held back where this share of its force and more is left out.
const LEFT_OUT: f32 = 0.1;
/// Times that the pulls are solved for one after the other, and the change, as a share of the largest force squared, below
/// which they are not again.
const SWEEPS: usize = 3;
const SETTLED: f32 = 1e-4;

/// A pulled point in a step.
struct Point {
    /// Its displacement, m.
    here: Vec3,
    /// How it moves in the step, and in that before, m.
    next: Vec3,
    last: Vec3,
    /// How far it moves under a force, m/N for each axis.
    compliance: Vec3,
}

impl<M: ElementMaterial> Trial<'_, M> {
    /// Adds the forces of pulls ([`crate::pulls`]) in an exact step to the total forces; none moves its point by more than a share
    /// `most_way` of the size of a node's tissue. Gives their work, J.
    #[inline(never)]
    pub(crate) fn pull(&mut self, step: &Step, method: &impl StepMethod<M>, most_way: f32) -> f32 {
        let Some(pulls) = self.loads.pulls() else { return 0.0 };
        let start = self.progress.time;
        let mut sweep = 0;
        for (force, _) in self.pulls.iter_mut().zip(pulls.pulls()).filter(|(_, pull)| !pull.acts()) {
            *force = NodeVector::ZERO;
        }
        loop {
            let (mut changed, mut all, mut work) = (0.0f32, 0.0f32, 0.0);
            self.held_pulls = 0;
            for (index, pull) in pulls.acting() {
                // At first those of the step before.
                let (kept, now) = (at(self.pulls, index), if sweep == 0 { Vec3::ZERO } else { at(self.pulls, index) });
                let point = self.pulled_point(pulls, pull, (step, method));
                let [late, next, last] = point.shares(pull.stiffness);
                let time = start + f64::from(late * step.seconds());
                let gap = (pull.target(time) - pull.unmoved()) - (point.here + next * point.next - last * point.last);
                let wanted = pull.force(gap, now, next * point.compliance) - now;
                let first = pulls.nodes_of(pull).first();
                let volume = first.map_or(0.0, |pulled| self.scene.node_volume(pulled.node as usize));
                let change = point.without_tearing(wanted, kept - now, most_way * most_way * most_way * volume);
                let left_out = (wanted - change).length_squared();
                self.held_pulls += u32::from(left_out > LEFT_OUT * LEFT_OUT * (now + wanted).length_squared());
                (changed, all) = (changed.max(change.length_squared()), all.max(now.length_squared()));
                work += 0.5 * now.dot(point.next + point.last);
                if sweep < SWEEPS && (sweep == 0 || change != Vec3::ZERO) {
                    self.add_pull(pulls, pull, (index, now + change), change);
                }
            }
            // The last sweep only sums up what the pulls do.
            if sweep == SWEEPS || (sweep > 0 && changed <= SETTLED * all) {
                return work;
            }
            sweep += 1;
        }
    }

    /// Adds the forces of pulls on tissue that stands still where it is.
    pub(crate) fn pull_at_rest(&mut self) {
        let Some(pulls) = self.loads.pulls() else { return };
        self.pulls.fill(NodeVector::ZERO);
        for (index, pull) in pulls.acting() {
            let gap = (pull.target(self.progress.time) - pull.unmoved()) - self.moved_mean(pulls, pull);
            let force = pull.force(gap, Vec3::ZERO, Vec3::ZERO);
            self.add_pull(pulls, pull, (index, force), force);
        }
    }

    /// Whether the state has room for the forces of pulls.
    pub(crate) fn has_room_for_pulls(&self) -> bool {
        self.loads.pulls().is_none_or(|pulls| pulls.pulls().len() <= self.pulls.len())
    }

    fn add_pull(&mut self, pulls: &Pulls<'_>, pull: &Pull, (index, force): (usize, Vec3), change: Vec3) {
        if let Some(place) = self.pulls.get_mut(index) {
            place.0 = force.extend(0.0).to_array();
        }
        let change = change.extend(0.0);
        for pulled in pulls.nodes_of(pull) {
            if let Some(force) = self.force.get_mut(pulled.node as usize) {
                force.0 = (Vec4::from(force.0) + pulled.weight * change).to_array();
            }
        }
    }

    /// The mean displacement of the nodes of a pull, m.
    pub(crate) fn moved_mean(&self, pulls: &Pulls<'_>, pull: &Pull) -> Vec3 {
        pulls.mean(pull, |node| at(self.displacement, node) + at(self.remainder, node))
    }

    fn pulled_point(&self, pulls: &Pulls<'_>, pull: &Pull, (step, method): (&Step, &impl StepMethod<M>)) -> Point {
        let [mut here, mut next, mut last, mut compliance] = [Vec4::ZERO; 4];
        let (keep, push) = (step.keep() * step.carry(), step.push());
        for pulled in pulls.nodes_of(pull) {
            let (node, weight) = (pulled.node as usize, pulled.weight);
            let vectors = (self.displacement.get(node), self.remainder.get(node), self.increment.get(node));
            let (Some(displacement), Some(remainder), Some(increment)) = vectors else { continue };
            let (Some(inertia), Some(force)) = (self.scene.inertia.get(node), self.force.get(node)) else { continue };
            let [x, y, z] = method.inertia_of(node, inertia).inverse;
            let (inverse, increment) = (Vec4::new(x, y, z, 0.0), Vec4::from(increment.0));
            let moved = keep * increment + push * (inverse * Vec4::from(force.0));
            here += weight * (Vec4::from(displacement.0) + Vec4::from(remainder.0));
            // A held axis moves as in the step before.
            next += weight * Vec4::select(inverse.cmpgt(Vec4::ZERO), moved, increment);
            last += weight * increment;
            compliance += (weight * weight) * inverse;
        }
        let [here, next, last, compliance] = [here, next, last, push * compliance].map(Vec4::truncate);
        Point { here, next, last, compliance }
    }
}

impl Point {
    /// How far into the step a pull of this stiffness takes the force, as a share of it, and the shares of the next and of the last
    /// motion of the point in where it takes it.
    fn shares(&self, stiffness: f32) -> [f32; 3] {
        let late = 1.0 - 1.0 / (1.0 + stiffness * self.compliance.max_element());
        [late, 0.25 + 0.75 * late, 0.25 - 0.25 * late]
    }

    /// The change of a force, or as much of it as moves the point no farther than tissue can follow in a step, the edge of
    /// this volume (m^3), or little farther than it moves by itself and than the `kept` change (N) would.
    fn without_tearing(&self, change: Vec3, kept: Vec3, volume: f32) -> Vec3 {
        let (free, way) = (self.next, self.compliance * change);
        let square = (free + way).length_squared();
        // Without a root where there is nothing to be done, as this is for every pull in every step.
        if square * square * square <= volume * volume || square <= free.length_squared() {
            return change;
        }
        let edge = libm::cbrtf(volume);
        let (own, before) = (free.length(), (free + self.compliance * kept).length());
        let [of_own, of_before] = MOST_GAIN.map(|share| share * edge);
        let most = edge.max(own.max(f32::min(own + of_own, before + of_before)));
        // |free + share way| = most
        let (product, length) = (free.dot(way), way.length_squared());
        let rest = product * product + length * (most * most - free.length_squared()).max(0.0);
        let share = (libm::sqrtf(rest) - product) / length;
        share.clamp(0.0, 1.0) * change
    }
}

fn at(vectors: &[NodeVector], node: usize) -> Vec3 {
    vectors.get(node).copied().unwrap_or_default().to_array().into()
}
