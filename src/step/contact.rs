//! Instruments in a step ([`crate::contact`]): the pushes on the nodes that would be inside one, and what these change in the sums
//! over the nodes.

use glam::Vec3;

use super::{Cause, Step, StepMethod, Totals, Trial};
use crate::contact::{Contact, Meeting, Placed, Touch};
use crate::element::{ElementMaterial, NodeInertia};
use crate::simd::NodeVector;

/// Share of a node's own tissue by which an instrument may move it in a step.
const MOST_OF_SIZE: f32 = 0.5;

/// A node in the way of an instrument, with all that moves it.
struct Met {
    node: usize,
    inertia: NodeInertia,
    increment: NodeVector,
    force: NodeVector,
    next: [f32; 4],
    meeting: Meeting,
}

impl<M: ElementMaterial> Trial<'_, M> {
    /// Adds the pushes to the forces, for methods whose next increment of a node follows from its force and its mass alone. The step is
    /// refused if an instrument is too fast, or so far inside the body that it would throw a node.
    pub(crate) fn meet_instruments(&mut self, step: &Step, method: &impl StepMethod<M>, totals: &mut Totals) {
        let Some(contact) = self.loads.contact() else { return };
        self.touches.fill(Touch::NONE);
        for (index, placed) in self.placed(contact, step).enumerate() {
            let mut touch = Touch::NONE;
            let refusal = |[metre, most]: [f32; 2]| Cause::Instrument { index, metre, most };
            if let Some(lengths) = placed.too_fast() {
                let node = contact.surface().nodes().first().map_or(0, |entry| entry.node);
                self.refused.get_or_insert((node, refusal(lengths)));
                return;
            }
            let friction = placed.instrument.friction;
            for entry in contact.surface().nodes() {
                let Some(met) = self.met(entry.node as usize, entry.rest, &placed, method) else { continue };
                let (metre, most) = (-met.meeting.gap, MOST_OF_SIZE * self.size_at(met.node));
                if metre > most {
                    self.refused.get_or_insert((entry.node, refusal([metre, most])));
                    return;
                }
                let push = met.push(step, friction);
                let mut force = met.force;
                for (sum, push) in force.0.iter_mut().zip(push.to_array()) {
                    *sum += push;
                }
                if let Some(place) = self.force.get_mut(met.node) {
                    *place = force;
                }
                let next = method.next_increment(met.node, &met.inertia, &met.increment, &force);
                totals.change(step, &met.inertia, &met.increment, [&met.force, &force], [&met.next, &next]);
                let ways = [next, met.increment.0].map(|[x, y, z, _]| Vec3::new(x, y, z));
                let way = 0.5 * (ways[0] + ways[1]);
                totals.add_work(push.dot(way));
                touch.add(push, met.meeting.arm, -met.meeting.gap, [way, met.meeting.carried]);
            }
            if let Some(place) = self.touches.get_mut(index) {
                *place = touch;
            }
        }
    }

    fn placed<'c>(
        &self,
        contact: &Contact<'c>,
        step: &Step,
    ) -> impl Iterator<Item = Placed<'c>> + use<'c, M> {
        let start = self.progress.time;
        let times = [start, start + f64::from(step.seconds())];
        contact.instruments().iter().map(move |instrument| Placed::new(instrument, times))
    }

    fn met(
        &self,
        node: usize,
        rest: [f32; 3],
        placed: &Placed<'_>,
        method: &impl StepMethod<M>,
    ) -> Option<Met> {
        let inertia = *self.scene.inertia.get(node)?;
        let [increment, force] = [*self.increment.get(node)?, *self.force.get(node)?];
        let next = method.next_increment(node, &inertia, &increment, &force);
        let displacement = self.displacement.get(node)?.0;
        let point = [0, 1, 2].map(|axis| rest[axis] + (displacement[axis] + next[axis]));
        let meeting = placed.meet(Vec3::from_array(point))?;
        let is_free = inertia.inverse.iter().any(|&inverse| inverse > 0.0);
        is_free.then_some(Met { node, inertia, increment, force, next, meeting })
    }
}

impl Met {
    /// The push, N, along free axes.
    fn push(&self, step: &Step, friction: f32) -> Vec3 {
        let Self { inertia, next, meeting, .. } = self;
        let free = Vec3::from_array(inertia.inverse.map(|inverse| if inverse > 0.0 { 1.0 } else { 0.0 }));
        // A node that supports guide along a plane or a line is moved within it.
        let normal = free * meeting.normal;
        let square = normal.length_squared();
        if square < 1e-6 {
            return Vec3::ZERO;
        }
        let out = -meeting.gap / square;
        let [x, y, z, _] = *next;
        let slip = free * (Vec3::new(x, y, z) - meeting.carried);
        let slip = slip - normal * (slip.dot(normal) / square);
        let (length, most) = (slip.length(), friction * out * libm::sqrtf(square));
        let held = if length > most { most / length } else { 1.0 };
        (out * normal - held * slip) * (inertia.mass / step.push())
    }
}
