//! Instruments in a step ([`crate::contact`]): the pushes on the nodes that would be inside one, and what these change in the sums
//! over the nodes.

use glam::Vec3;

use super::cause::MOST_OF_SIZE;
use super::{Cause, Step, StepMethod, Totals, Trial};
use crate::contact::{
    Contact, ContactMemory, ContactPoint, Grip, HELD, MOST_INSTRUMENTS, Meeting, Placed, Touch, TouchedNode,
    largest_component, vectors_to_push,
};
use crate::element::{ElementMaterial, NodeInertia};
use crate::simd::NodeVector;

/// Nodes that an instrument may touch within a step are those nearer than so many times the farthest motion of a node and of an
/// instrument.
const NEAR: f32 = 2.0;

/// A node with all that moves it, and its way to an instrument.
struct Met {
    node: usize,
    inertia: NodeInertia,
    increment: NodeVector,
    force: NodeVector,
    next: [f32; 4],
    meeting: Meeting,
    /// Where an instrument holds it, from where it would be, m.
    way: Vec3,
}

impl<M: ElementMaterial> Trial<'_, M> {
    /// Adds the pushes to the forces, for methods whose next increment of a node follows from its force and its mass alone. The step is
    /// refused if an instrument is too fast, or so far inside the body that it would throw a node.
    pub(crate) fn meet_instruments(&mut self, step: &Step, method: &impl StepMethod<M>, totals: &mut Totals) {
        let Some(contact) = self.loads.contact() else { return };
        self.clear_touches();
        self.touched = 0;
        let placed = &*contact.placed(self.progress.time, step.seconds());
        if self.refuses_speed(contact, placed) {
            return;
        }
        let Self { pushes, progress, .. } = self;
        let surface = contact.surface().nodes();
        let farthest = totals.farthest;
        let limit = ContactMemory::split(pushes, surface.len())
            .map(|mut memory| memory.begin(progress, placed, farthest, 0.0));
        let mut touches = [Touch::default(); MOST_INSTRUMENTS];
        let mut from = 0;
        while let Some(place) = self.next_in_reach(surface.len(), from, limit) {
            from = place + 1;
            let Some(entry) = surface.get(place).filter(|_| !contact.is_gripped(place)) else { continue };
            let (mut distance, mut pushes) = (f32::INFINITY, Vec3::ZERO);
            for ((index, placed), touch) in placed.iter().enumerate().zip(&mut touches) {
                let Some(met) = self.met(entry.node as usize, entry.rest, placed, method) else { continue };
                distance = distance.min(placed.least_distance(&met.meeting) - axes(met.next).length());
                if met.meeting.gap < 0.0 && met.is_free() {
                    if self.refuses_depth(index, entry.node, -met.meeting.gap) {
                        return;
                    }
                    let push = met.push(step, placed.instrument.friction);
                    pushes += push;
                    self.push(&met, push, (step, index, method), totals, touch);
                }
            }
            self.keep_push(place, entry.node, distance, pushes);
        }
        for grip in contact.grips() {
            let (place, index) = (grip.place as usize, grip.instrument as usize);
            let (Some(entry), Some(placed), Some(touch)) =
                (surface.get(place), placed.get(index), touches.get_mut(index))
            else {
                continue;
            };
            let Some(met) = self.gripped(entry.node as usize, entry.rest, placed, (grip, method)) else {
                continue;
            };
            if self.refuses_depth(index, entry.node, met.meeting.gap) {
                return;
            }
            let push = met.hold(step);
            self.push(&met, push, (step, index, method), totals, touch);
            self.keep_push(place, entry.node, f32::NEG_INFINITY, push);
        }
        for (to, touch) in self.touches.iter_mut().zip(touches) {
            *to = touch;
        }
    }

    /// Notes how far a node is from all instruments (m), and its push (N) for the steps that follow.
    fn keep_push(&mut self, place: usize, node: u32, distance: f32, push: Vec3) {
        let Some(mut memory) = self.memory() else { return };
        memory.note(place, distance);
        let before = memory.before.get(place).copied().unwrap_or_default().to_array();
        if push != Vec3::ZERO || before != [0.0; 3] {
            let push = push.to_array();
            self.add_touched(TouchedNode {
                place: place as u32,
                node,
                push,
                before,
                ..TouchedNode::default()
            });
        }
    }

    /// Pushes a node with a force, N.
    fn push(
        &mut self,
        met: &Met,
        push: Vec3,
        (step, instrument, method): (&Step, usize, &impl StepMethod<M>),
        totals: &mut Totals,
        touch: &mut Touch,
    ) {
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
        let depth = if met.meeting.normal == Vec3::ZERO { 0.0 } else { -met.meeting.gap };
        touch.add(push, met.meeting.arm, depth, [way, met.meeting.carried]);
        let position = met.meeting.point;
        self.list(met.node as u32, instrument as u32, [position, met.meeting.normal, push], depth);
    }

    /// Nothing touches.
    pub(super) fn clear_touches(&mut self) {
        self.touches.fill(Touch::default());
        self.points.fill(ContactPoint::default());
        self.listed = 0;
    }

    /// Tells the host where an instrument pushes: position, normal and force.
    fn list(&mut self, node: u32, instrument: u32, [position, normal, force]: [Vec3; 3], depth: f32) {
        if let Some(point) = self.points.get_mut(self.listed) {
            let [position, normal, force] = [position, normal, force].map(|vector| vector.to_array());
            *point = ContactPoint { position, normal, force, depth, node, instrument };
            self.listed += 1;
        }
    }

    /// Whether the state has room for pushes.
    pub(crate) fn has_room_for_pushes(&self) -> bool {
        self.pushes.len() >= vectors_to_push(self.surface_len())
    }

    fn surface_len(&self) -> usize {
        self.loads.contact().map_or(0, |contact| contact.surface().nodes().len())
    }

    /// What the state keeps for instruments, if it has the room.
    fn memory(&mut self) -> Option<ContactMemory<'_>> {
        let nodes = self.surface_len();
        ContactMemory::split(self.pushes, nodes)
    }

    /// The next node of the surface that instruments may reach: any, where the state keeps nothing.
    fn next_in_reach(&mut self, nodes: usize, from: usize, limit: Option<f32>) -> Option<usize> {
        match (self.memory(), limit) {
            (Some(memory), Some(limit)) => memory.next_in_reach(from, limit),
            _ => (from < nodes).then_some(from),
        }
    }

    /// The nodes that may touch in this step, and room for the answer of a lattice.
    pub(crate) fn touched_nodes(&mut self) -> (&mut [TouchedNode], &mut [f32]) {
        let count = self.touched;
        match self.memory() {
            Some(memory) => (memory.touched.get_mut(..count).unwrap_or_default(), memory.local),
            None => Default::default(),
        }
    }

    /// Adds the pushes of the step before to the forces, or those of another run.
    pub(crate) fn add_pushes_before(&mut self) {
        let Self { pushes, force, loads, progress, .. } = self;
        let mut add = |node: u32, push: &NodeVector| {
            if let Some(NodeVector([x, y, z, _])) = force.get_mut(node as usize) {
                (*x, *y, *z) = (*x + push.0[0], *y + push.0[1], *z + push.0[2]);
            }
        };
        if let Some((surface, pushes)) = loads.given_pushes() {
            surface.nodes().iter().zip(pushes).for_each(|(entry, push)| add(entry.node, push));
        }
        let Some(contact) = loads.contact() else { return };
        let surface = contact.surface().nodes();
        let Some(mut memory) = ContactMemory::split(pushes, surface.len()) else { return };
        memory.forget_if_other(progress);
        for (place, push) in memory.pushed() {
            if let Some(entry) = surface.get(place) {
                add(entry.node, push);
            }
        }
    }

    /// Enters the work of the pushes of another run.
    pub(crate) fn add_work_of_given(&self, totals: &mut Totals, next: impl Fn(usize) -> [f32; 4]) {
        let Some((surface, pushes)) = self.loads.given_pushes() else { return };
        for (entry, push) in surface.nodes().iter().zip(pushes) {
            if *push != NodeVector::ZERO {
                let node = entry.node as usize;
                let last = self.increment.get(node).copied().unwrap_or_default().0;
                totals.add_work(axes(push.0).dot(mean(next(node), last)));
            }
        }
    }

    /// Lists the nodes that are in the way of an instrument, near it, or were pushed in the step before. `row` is the place of a node
    /// in the next increments.
    pub(crate) fn find_touched(
        &mut self,
        contact: &Contact<'_>,
        step: &Step,
        next: &[NodeVector],
        row: impl Fn(usize) -> usize,
    ) {
        self.touched = 0;
        let placed = &*contact.placed(self.progress.time, step.seconds());
        if self.refuses_speed(contact, placed) {
            return;
        }
        let farthest = [&*self.increment, next].map(largest_component);
        let way = placed.iter().fold(0.0, |most: f32, placed| most.max(placed.way()));
        let margin = NEAR * (farthest[1] + way);
        let surface = contact.surface().nodes();
        let Self { pushes, progress, .. } = self;
        let Some(mut memory) = ContactMemory::split(pushes, surface.len()) else { return };
        let limit = memory.begin(progress, placed, farthest, margin);
        let mut from = 0;
        while let Some(place) = self.next_in_reach(surface.len(), from, Some(limit)) {
            from = place + 1;
            let Some(entry) = surface.get(place).filter(|_| !contact.is_gripped(place)) else { continue };
            let node = entry.node as usize;
            let next = next.get(row(node)).copied().unwrap_or_default().0;
            let Some(mut found) = self.found(place, entry.node) else { continue };
            let point = predicted(entry.rest, self.displacement.get(node).unwrap_or(&NodeVector::ZERO), next);
            let (mut nearest, mut distance): (Option<(usize, Meeting)>, f32) = (None, f32::INFINITY);
            for (index, placed) in placed.iter().enumerate() {
                let Some(meeting) = placed.meet(point) else { continue };
                distance = distance.min(placed.least_distance(&meeting));
                if nearest.as_ref().is_none_or(|(_, nearest)| meeting.gap < nearest.gap) {
                    found.friction = placed.instrument.friction;
                    nearest = Some((index, meeting));
                }
            }
            if let Some(mut memory) = self.memory() {
                memory.note(place, distance - axes(next).length());
            }
            match nearest {
                Some((index, meeting)) if meeting.gap < margin || found.before != [0.0; 3] => {
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
                _ if found.before == [0.0; 3] => continue,
                // All instruments are gone: no push.
                _ => {
                    let normal = Vec3::from_array(found.before).normalize_or(Vec3::Z).to_array();
                    (found.normal, found.relative, found.gap) = (normal, normal, 1.0);
                }
            }
            self.add_touched(found);
        }
        for grip in contact.grips() {
            let (place, index) = (grip.place as usize, grip.instrument as usize);
            let (Some(entry), Some(placed)) = (surface.get(place), placed.get(index)) else { continue };
            if let Some(mut memory) = self.memory() {
                memory.note(place, f32::NEG_INFINITY);
            }
            let Some(mut found) = self.found(place, entry.node) else { continue };
            let node = entry.node as usize;
            let next = next.get(row(node)).copied().unwrap_or_default().0;
            let point = predicted(entry.rest, self.displacement.get(node).unwrap_or(&NodeVector::ZERO), next);
            let relative = point - placed.held(grip.point);
            if self.refuses_depth(index, entry.node, relative.length()) {
                self.touched = 0;
                return;
            }
            (found.normal, found.relative) = (Vec3::Z.to_array(), relative.to_array());
            (found.friction, found.instrument) = (HELD, grip.instrument);
            self.add_touched(found);
        }
    }

    fn add_touched(&mut self, found: TouchedNode) {
        let at = self.touched;
        if let Some(room) = self.memory().and_then(|memory| memory.touched.get_mut(at)) {
            *room = found;
            self.touched += 1;
        }
    }

    /// A node of the surface with its push of the step before. None where supports hold it.
    fn found(&mut self, place: usize, node: u32) -> Option<TouchedNode> {
        let inertia = self.scene.inertia.get(node as usize)?;
        if inertia.inverse.iter().all(|&inverse| inverse <= 0.0) {
            return None;
        }
        let before = self.memory()?.before.get(place).copied().unwrap_or_default().to_array();
        Some(TouchedNode { place: place as u32, node, push: before, before, ..TouchedNode::default() })
    }

    /// Adds the changes of the pushes (N) to the forces.
    pub(crate) fn add_changes_of_pushes(&mut self) {
        let (nodes, count) = (self.surface_len(), self.touched);
        let Self { pushes, force, .. } = self;
        let Some(memory) = ContactMemory::split(pushes, nodes) else { return };
        for each in memory.touched.iter().take(count) {
            if let Some(force) = force.get_mut(each.node as usize) {
                for axis in 0..3 {
                    force.0[axis] += each.push[axis] - each.before[axis];
                }
            }
        }
    }

    /// Tells the instruments what they feel, and the energy balance what they do.
    pub(crate) fn report_touches(
        &mut self,
        contact: &Contact<'_>,
        step: &Step,
        totals: &mut Totals,
        next: impl Fn(usize) -> [f32; 4],
    ) {
        self.clear_touches();
        let placed = &*contact.placed(self.progress.time, step.seconds());
        for at in 0..self.touched {
            let Some(&each) = self.touched_nodes().0.get(at) else { continue };
            let (index, node, push) =
                (each.instrument as usize, each.node as usize, Vec3::from_array(each.push));
            if push == Vec3::ZERO {
                continue;
            }
            let way = mean(next(node), self.increment.get(node).copied().unwrap_or_default().0);
            totals.add_work(push.dot(way));
            let Some(placed) = placed.get(index) else { continue };
            let rest =
                contact.surface().nodes().get(each.place as usize).map_or([0.0; 3], |entry| entry.rest);
            let here = self.displacement.get(node).copied().unwrap_or_default();
            let point = predicted(rest, &here, next(node));
            if let Some(touch) = self.touches.get_mut(index) {
                touch.add(push, placed.arm(point), -each.gap, [way, placed.carried(point)]);
            }
            let normal = if each.friction == HELD { Vec3::ZERO } else { Vec3::from_array(each.normal) };
            self.list(each.node, each.instrument, [point, normal, push], -each.gap);
        }
    }

    /// Keeps the pushes: the step is accepted, and the progress that of its end.
    pub(super) fn accept_pushes(&mut self) {
        let (touched, nodes) = (self.touched, self.surface_len());
        let Self { pushes, progress, loads, .. } = self;
        if loads.contact().is_some()
            && let Some(mut memory) = ContactMemory::split(pushes, nodes)
        {
            memory.accept(touched);
            memory.set_moment(progress);
        }
    }

    /// Refuses the step if an instrument moves too far in it.
    fn refuses_speed(&mut self, contact: &Contact<'_>, placed: &[Placed<'_>]) -> bool {
        for (index, placed) in placed.iter().enumerate() {
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

    /// A node with its way to where an instrument holds it.
    fn gripped(
        &self,
        node: usize,
        rest: [f32; 3],
        placed: &Placed<'_>,
        (grip, method): (&Grip, &impl StepMethod<M>),
    ) -> Option<Met> {
        let mut met = self.met(node, rest, placed, method)?;
        let (held, point) =
            (placed.held(grip.point), predicted(rest, self.displacement.get(node)?, met.next));
        let (arm, carried) = (placed.arm(held), placed.carried(held));
        met.meeting = Meeting { gap: point.distance(held), normal: Vec3::ZERO, arm, carried, point: held };
        met.way = held - point;
        Some(met)
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
        let meeting = placed.meet(predicted(rest, self.displacement.get(node)?, next))?;
        Some(Met { node, inertia, increment, force, next, meeting, way: Vec3::ZERO })
    }
}

impl Met {
    /// Whether it can move at all.
    fn is_free(&self) -> bool {
        self.inertia.inverse.iter().any(|&inverse| inverse > 0.0)
    }

    /// The force that takes it where it is held, N, along free axes.
    fn hold(&self, step: &Step) -> Vec3 {
        self.free() * self.way * (self.inertia.mass / step.push())
    }

    /// Ones along free axes.
    fn free(&self) -> Vec3 {
        Vec3::from_array(self.inertia.inverse.map(|inverse| if inverse > 0.0 { 1.0 } else { 0.0 }))
    }

    /// The push, N, along free axes.
    fn push(&self, step: &Step, friction: f32) -> Vec3 {
        let Self { inertia, next, meeting, .. } = self;
        let free = self.free();
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
