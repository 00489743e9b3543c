//! Instruments in a step ([`crate::contact`]): the pushes on the nodes that would be inside one, and what these change in the sums
//! over the nodes.

use bytemuck::must_cast_slice_mut;
use glam::Vec3;

use super::cause::MOST_OF_SIZE;
use super::{Cause, Step, StepMethod, Totals, Trial};
use crate::contact::{Contact, Meeting, Placed, Touch, TouchedNode, VECTORS_OF_TOUCHED, vectors_to_push};
use crate::element::{ElementMaterial, NodeInertia};
use crate::simd::NodeVector;

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
        self.touches.fill(Touch::default());
        if self.refuses_speed(contact, step) {
            return;
        }
        for (index, placed) in self.placed(contact, step).enumerate() {
            let mut touch = Touch::default();
            let friction = placed.instrument.friction;
            for entry in contact.surface().nodes() {
                let Some(met) = self.met(entry.node as usize, entry.rest, &placed, method) else { continue };
                if self.refuses_depth(index, entry.node, -met.meeting.gap) {
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
                let way = mean(next, met.increment.0);
                totals.add_work(push.dot(way));
                touch.add(push, met.meeting.arm, -met.meeting.gap, [way, met.meeting.carried]);
            }
            if let Some(place) = self.touches.get_mut(index) {
                *place = touch;
            }
        }
    }

    /// Whether the state has room for pushes.
    pub(crate) fn has_room_for_pushes(&self) -> bool {
        let nodes = self.loads.contact().map_or(0, |contact| contact.surface().nodes().len());
        self.pushes.len() >= vectors_to_push(nodes)
    }

    /// The pushes of the step before on the nodes of the surface, and room for the nodes that touch.
    fn split_pushes(&mut self) -> (&mut [NodeVector], &mut [TouchedNode]) {
        let nodes = self.loads.contact().map_or(0, |contact| contact.surface().nodes().len());
        let Some((before, rest)) = self.pushes.split_at_mut_checked(nodes) else { return Default::default() };
        let touched: &mut [TouchedNode] = must_cast_slice_mut(rest.as_chunks_mut::<VECTORS_OF_TOUCHED>().0);
        (before, touched)
    }

    /// The nodes that may touch in this step.
    pub(crate) fn touched_nodes(&mut self) -> &mut [TouchedNode] {
        let count = self.touched;
        self.split_pushes().1.get_mut(..count).unwrap_or_default()
    }

    /// Adds the pushes of the step before to the forces.
    pub(crate) fn add_pushes_before(&mut self) {
        let Some(contact) = self.loads.contact() else { return };
        let Self { pushes, force, .. } = self;
        for (entry, push) in contact.surface().nodes().iter().zip(&**pushes) {
            if let Some(NodeVector([x, y, z, _])) = force.get_mut(entry.node as usize) {
                (*x, *y, *z) = (*x + push.0[0], *y + push.0[1], *z + push.0[2]);
            }
        }
    }

    /// Lists the nodes that are in the way of an instrument, near it, or were pushed in the step before.
    pub(crate) fn find_touched(
        &mut self,
        contact: &Contact<'_>,
        step: &Step,
        next: impl Fn(usize) -> [f32; 4],
    ) {
        let surface = contact.surface().nodes();
        let mut farthest = 0.0f32;
        for entry in surface {
            let [x, y, z, _] = next(entry.node as usize);
            farthest = farthest.max(x.abs()).max(y.abs()).max(z.abs());
        }
        self.touched = 0;
        if self.refuses_speed(contact, step) {
            return;
        }
        for (place, entry) in surface.iter().enumerate() {
            let node = entry.node as usize;
            let (Some(displacement), Some(inertia)) =
                (self.displacement.get(node), self.scene.inertia.get(node))
            else {
                continue;
            };
            if inertia.inverse.iter().all(|&inverse| inverse <= 0.0) {
                continue;
            }
            let next = next(node);
            let point = predicted(entry.rest, displacement, next);
            let before = self.split_pushes().0.get(place).copied().unwrap_or_default().to_array();
            let mut found = TouchedNode {
                place: place as u32,
                node: entry.node,
                push: before,
                before,
                ..TouchedNode::default()
            };
            let mut nearest: Option<(usize, Meeting)> = None;
            for (index, placed) in self.placed(contact, step).enumerate() {
                let meeting = placed.meet(point, 2.0 * farthest);
                if let Some(meeting) = meeting.filter(|m| nearest.as_ref().is_none_or(|(_, n)| m.gap < n.gap))
                {
                    found.friction = placed.instrument.friction;
                    nearest = Some((index, meeting));
                }
            }
            match nearest {
                Some((index, meeting)) => {
                    if self.refuses_depth(index, entry.node, -meeting.gap) {
                        self.touched = 0;
                        return;
                    }
                    let slip = axes(next) - meeting.carried;
                    let across = slip - slip.dot(meeting.normal) * meeting.normal;
                    found.relative = (meeting.gap * meeting.normal + across).to_array();
                    (found.normal, found.gap) = (meeting.normal.to_array(), meeting.gap);
                    found.instrument = index as u32;
                }
                None if before == [0.0; 3] => continue,
                // Far from all: no push.
                None => {
                    let normal = Vec3::from_array(before).normalize_or(Vec3::Z).to_array();
                    (found.normal, found.relative, found.gap) = (normal, normal, 1.0);
                }
            }
            let at = self.touched;
            if let Some(room) = self.split_pushes().1.get_mut(at) {
                *room = found;
                self.touched += 1;
            }
        }
    }

    /// Changes the next increment of a node (m) and the force on it (N), with their sums.
    pub(crate) fn move_next(
        &mut self,
        node: usize,
        step: &Step,
        moved: [f32; 3],
        push: [f32; 3],
        next: &mut [f32; 4],
        totals: &mut Totals,
    ) {
        let (Some(inertia), Some(increment), Some(force)) =
            (self.scene.inertia.get(node), self.increment.get(node), self.force.get_mut(node))
        else {
            return;
        };
        let (next_before, force_before) = (*next, *force);
        for axis in 0..3 {
            next[axis] += if inertia.inverse[axis] > 0.0 { moved[axis] } else { 0.0 };
            force.0[axis] += push[axis];
        }
        totals.change(step, inertia, increment, [&force_before, force], [&next_before, next]);
    }

    /// Tells the instruments what they feel, and the energy balance what they do.
    pub(crate) fn report_touches(
        &mut self,
        contact: &Contact<'_>,
        step: &Step,
        totals: &mut Totals,
        next: impl Fn(usize) -> [f32; 4],
    ) {
        self.touches.fill(Touch::default());
        for at in 0..self.touched {
            let Some(&each) = self.touched_nodes().get(at) else { continue };
            let (index, node, push) =
                (each.instrument as usize, each.node as usize, Vec3::from_array(each.push));
            if push == Vec3::ZERO {
                continue;
            }
            let way = mean(next(node), self.increment.get(node).copied().unwrap_or_default().0);
            totals.add_work(push.dot(way));
            let Some(placed) = self.placed(contact, step).nth(index) else { continue };
            let rest =
                contact.surface().nodes().get(each.place as usize).map_or([0.0; 3], |entry| entry.rest);
            let here = self.displacement.get(node).copied().unwrap_or_default();
            let point = predicted(rest, &here, next(node));
            if let Some(touch) = self.touches.get_mut(index) {
                touch.add(push, placed.arm(point), -each.gap, [way, placed.carried(point)]);
            }
        }
    }

    /// Keeps the pushes: the step is accepted.
    pub(super) fn accept_pushes(&mut self) {
        let count = self.touched;
        let (before, touched) = self.split_pushes();
        before.fill(NodeVector::ZERO);
        for each in touched.iter().take(count) {
            if let Some(place) = before.get_mut(each.place as usize) {
                let [x, y, z] = each.push;
                place.0 = [x, y, z, 0.0];
            }
        }
    }

    /// Refuses the step if an instrument moves too far in it.
    fn refuses_speed(&mut self, contact: &Contact<'_>, step: &Step) -> bool {
        for (index, placed) in self.placed(contact, step).enumerate() {
            if let Some([metre, most]) = placed.too_fast() {
                let node = contact.surface().nodes().first().map_or(0, |entry| entry.node);
                self.refused.get_or_insert((node, Cause::Instrument { index, metre, most }));
                return true;
            }
        }
        false
    }

    /// Refuses the step if a node is so far inside an instrument (m) that it would be thrown.
    fn refuses_depth(&mut self, index: usize, node: u32, metre: f32) -> bool {
        let most = MOST_OF_SIZE * self.size_at(node as usize);
        if metre > most {
            self.refused.get_or_insert((node, Cause::Instrument { index, metre, most }));
        }
        metre > most
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
        let meeting = placed.meet(predicted(rest, self.displacement.get(node)?, next), 0.0)?;
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
        let slip = free * (axes(*next) - meeting.carried);
        let slip = slip - normal * (slip.dot(normal) / square);
        let (length, most) = (slip.length(), friction * out * libm::sqrtf(square));
        let held = if length > most { most / length } else { 1.0 };
        (out * normal - held * slip) * (inertia.mass / step.push())
    }
}

fn axes([x, y, z, _]: [f32; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}

/// The mean of the increments before and after, m: what pushes do work along.
fn mean(next: [f32; 4], last: [f32; 4]) -> Vec3 {
    0.5 * (axes(next) + axes(last))
}

/// Where a node will be at the end of the step, m.
fn predicted(rest: [f32; 3], displacement: &NodeVector, next: [f32; 4]) -> Vec3 {
    Vec3::from_array(rest) + (axes(displacement.0) + axes(next))
}
