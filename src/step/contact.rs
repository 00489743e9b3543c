//! Instruments in a step ([`crate::contact`]): the pushes on the nodes that would be inside one, and what these change
//! in the sums over the nodes.

use glam::Vec3;

use super::cause::MOST_OF_SIZE;
use super::triangles::{Candidate, Nearest, corners_of};
use super::{Cause, Step, StepMethod, Totals, Trial};
use crate::contact::{
    Contact, ContactMemory, ContactPoint, Grip, HELD, MOST_INSTRUMENTS, Meeting, Placed, SolverRoom, Surface, Touch,
    TouchedPoint, TrianglePoint, largest_component, vectors_to_push,
};
use crate::element::{ElementMaterial, NodeInertia};
use crate::simd::NodeVector;

/// Nodes that an instrument may touch within a step are those nearer than so many times the farthest motion of a node
/// and of an instrument.
const NEAR: f32 = 2.0;

/// A node with all that moves it, and its way to an instrument.
struct Met {
    node: usize,
    inertia: NodeInertia,
    increment: NodeVector,
    next: [f32; 4],
    meeting: Meeting,
    /// Where an instrument holds it, from where it would be, m.
    way: Vec3,
}

impl<M: ElementMaterial> Trial<'_, M> {
    /// Adds the pushes to the forces, for methods whose next increment of a node follows from its force and its mass
    /// alone. The step is refused if an instrument is too fast, or so far inside the body that it would throw a node.
    pub(crate) fn meet_instruments(&mut self, step: &Step, method: &impl StepMethod<M>, totals: &mut Totals) {
        let Some(contact) = self.loads.contact() else { return };
        self.clear_touches();
        self.touched = 0;
        let placed = &*contact.placed(self.progress.time, step.seconds());
        if self.refuses_speed(contact, placed) {
            return;
        }
        let (surface, farthest) = (contact.surface().nodes(), totals.farthest);
        // With triangles, nodes are solved for together with these, beginning from the pushes of the step before.
        let has_triangles = !contact.surface().triangles().is_empty();
        let mut moved = if has_triangles { self.push_as_before(contact, (step, method), totals) } else { 0.0 };
        let alone = if has_triangles { 0 } else { surface.len() };
        let Self { pushes, progress, .. } = self;
        let limit = ContactMemory::split(pushes, &contact.surface())
            .map(|mut memory| memory.begin(progress, placed, farthest, 0.0));
        let mut touches = [Touch::default(); MOST_INSTRUMENTS];
        let seconds = seconds_outward(step, method);
        let mut from = 0;
        while let Some(place) = self.next_in_reach(from, limit).filter(|&place| place < alone) {
            from = place + 1;
            let Some(entry) = surface.get(place).filter(|_| !contact.is_gripped(place)) else { continue };
            let (mut distance, mut pushes, mut way) = (f32::INFINITY, Vec3::ZERO, 0.0);
            for ((index, placed), touch) in placed.iter().enumerate().zip(&mut touches) {
                let Some(met) = self.met(entry.node as usize, entry.rest, placed, method) else { continue };
                distance = distance.min(placed.least_distance(&met.meeting) - axes(met.next).length());
                let gap = met.meeting.gap_to_close(axes(met.next) - met.meeting.carried, seconds);
                if gap < 0.0 && met.meeting.gap < 0.0 && met.is_free() {
                    if self.refuses_depth((index, placed), entry.node, &met.meeting, axes(met.next)) {
                        return;
                    }
                    let push = met.push(step, gap, placed.instrument.friction);
                    pushes += push;
                    way += self.push(&met, push, (step, index, method), totals, touch);
                }
            }
            moved = moved.max(way);
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
            // Where it was is where the instrument held it, or the grip is of another place.
            let carried = met.meeting.carried;
            if self.refuses_grip(index, entry.node, [met.way + axes(met.next) - carried, carried]) {
                return;
            }
            let push = met.hold(step);
            moved = moved.max(self.push(&met, push, (step, index, method), totals, touch));
            self.keep_push(place, entry.node, f32::NEG_INFINITY, push);
        }
        if has_triangles {
            let limit = limit.map(|limit| limit + moved);
            self.meet_triangles(contact, (step, method), placed, (totals, &mut touches), limit);
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
            self.add_touched(TouchedPoint {
                place: place as u32,
                nodes: [node; 3],
                push,
                before,
                ..TouchedPoint::default()
            });
        }
    }

    /// Pushes a node with a force, N. Gives how far that moves it, m.
    fn push(
        &mut self,
        met: &Met,
        push: Vec3,
        (step, instrument, method): (&Step, usize, &impl StepMethod<M>),
        totals: &mut Totals,
        touch: &mut Touch,
    ) -> f32 {
        let Some(next) = self.add_force(met.node, push, (step, method), totals) else { return 0.0 };
        let way = mean(next, met.increment.0);
        totals.add_work(push.dot(way));
        let depth = if met.meeting.normal == Vec3::ZERO { 0.0 } else { -met.meeting.gap };
        touch.add(push, met.meeting.arm, depth, [way, met.meeting.carried]);
        let position = met.meeting.point;
        self.list(met.node as u32, instrument as u32, [position, met.meeting.normal, push], depth);
        axes(next).distance(axes(met.next))
    }

    /// Adds a force (N) to a node, and what it changes to the sums. Gives the next increment, m.
    pub(super) fn add_force(
        &mut self,
        node: usize,
        added: Vec3,
        (step, method): (&Step, &impl StepMethod<M>),
        totals: &mut Totals,
    ) -> Option<[f32; 4]> {
        let (inertia, increment) = (self.scene.inertia.get(node)?, self.increment.get(node)?);
        let force = self.force.get_mut(node)?;
        let before = *force;
        for (sum, added) in force.0.iter_mut().zip(added.to_array()) {
            *sum += added;
        }
        let nexts = [&before, &*force].map(|force| method.next_increment(node, inertia, increment, force));
        totals.change(step, &method.inertia_of(node, inertia), increment, [&before, &*force], [&nexts[0], &nexts[1]]);
        Some(nexts[1])
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
        let surface = self.surface();
        self.pushes.len() >= vectors_to_push(surface.nodes().len(), surface.triangles().len())
    }

    /// What the instruments of the loads can touch.
    pub(crate) fn surface(&self) -> Surface<'_> {
        self.loads.contact().map_or(Surface::NONE, Contact::surface)
    }

    /// What the state keeps for instruments, if it has the room.
    pub(super) fn memory(&mut self) -> Option<ContactMemory<'_>> {
        let surface = self.loads.contact()?.surface();
        ContactMemory::split(self.pushes, &surface)
    }

    /// The next place of the surface that instruments may reach: any, where the state keeps nothing.
    pub(super) fn next_in_reach(&mut self, from: usize, limit: Option<f32>) -> Option<usize> {
        let places = self.surface().places();
        match (self.memory(), limit) {
            (Some(memory), Some(limit)) => memory.next_in_reach(from, limit),
            _ => (from < places).then_some(from),
        }
    }

    /// The points that may touch in this step, and room to solve for their pushes.
    pub(crate) fn solver_room(&mut self) -> SolverRoom<'_> {
        self.solver_room_and_forces().0
    }

    /// The same, with the forces on the nodes.
    pub(crate) fn solver_room_and_forces(&mut self) -> (SolverRoom<'_>, &[NodeVector]) {
        let Self { loads, pushes, force, touched: count, .. } = self;
        let memory = loads.contact().and_then(|contact| ContactMemory::split(pushes, &contact.surface()));
        let room = memory.map(|memory| memory.room).unwrap_or_default();
        (SolverRoom { touched: room.touched.get_mut(..*count).unwrap_or_default(), ..room }, force)
    }

    /// Adds the pushes of the step before to the forces, or those of another run.
    pub(crate) fn add_pushes_before(&mut self, step: &Step) {
        self.follow_triangles(step);
        let Self { pushes, force, loads, progress, .. } = self;
        let mut add = |surface: &Surface<'_>, place: usize, push: &NodeVector, times: f32| {
            for (node, share) in corners_of(surface, place, push) {
                let share = times * share;
                if let Some(NodeVector([x, y, z, _])) = force.get_mut(node) {
                    let [a, b, c, _] = push.0;
                    (*x, *y, *z) = (*x + share * a, *y + share * b, *z + share * c);
                }
            }
        };
        if let Some((surface, pushes, times)) = loads.given_pushes() {
            pushes.iter().enumerate().for_each(|(place, push)| add(&surface, place, push, times));
        }
        let Some(surface) = loads.contact().map(Contact::surface) else { return };
        let Some(mut memory) = ContactMemory::split(pushes, &surface) else { return };
        memory.forget_if_other(progress);
        memory.pushed().for_each(|(place, push)| add(&surface, place, push, 1.0));
    }

    /// Enters the work of the pushes of another run.
    pub(crate) fn add_work_of_given(&self, totals: &mut Totals, next: impl Fn(usize) -> [f32; 4]) {
        let Some((surface, pushes, times)) = self.loads.given_pushes() else { return };
        for (place, push) in pushes.iter().enumerate() {
            if axes(push.0) != Vec3::ZERO {
                for (node, share) in corners_of(&surface, place, push) {
                    let last = self.increment.get(node).copied().unwrap_or_default().0;
                    totals.add_work(times * share * axes(push.0).dot(mean(next(node), last)));
                }
            }
        }
    }

    /// Lists the nodes and points of triangles that are in the way of an instrument, near it, or were pushed in the
    /// step before. `row` is the place of a node in the next increments.
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
        let surface = contact.surface();
        let Self { pushes, progress, .. } = self;
        let Some(mut memory) = ContactMemory::split(pushes, &surface) else { return };
        let limit = memory.begin(progress, placed, farthest, margin);
        let next = |node| next.get(row(node)).copied().unwrap_or_default().0;
        let mut from = 0;
        while let Some(place) = self.next_in_reach(from, Some(limit)) {
            from = place + 1;
            if contact.is_gripped(place) {
                continue;
            }
            let Some(mut found) = self.found(&surface, place) else { continue };
            let candidate = self.candidate(&surface, &found, &next);
            let pushed = found.before != [0.0; 3];
            let Nearest { distance, met } = candidate.nearest(&found, placed, (margin, pushed));
            if let Some(mut memory) = self.memory() {
                memory.note(place, distance - candidate.farthest());
            }
            match met {
                Some((index, point, meeting)) if meeting.gap < margin || pushed => {
                    found.set_point(point);
                    let slip = point.mean(candidate.next);
                    let at = placed.get(index).map(|placed| (index, placed));
                    if at.is_some_and(|at| self.refuses_depth(at, found.node(), &meeting, slip)) {
                        self.touched = 0;
                        return;
                    }
                    found.relative = meeting.relative(slip - meeting.carried, step.seconds()).to_array();
                    (found.normal, found.gap) = (meeting.normal.to_array(), meeting.gap);
                    found.friction = placed.get(index).map_or(0.0, |placed| placed.instrument.friction);
                    found.instrument = index as u32;
                }
                _ if !pushed => continue,
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
            let Some(placed) = placed.get(index) else { continue };
            if let Some(mut memory) = self.memory() {
                memory.note(place, f32::NEG_INFINITY);
            }
            let Some(mut found) = self.found(&surface, place) else { continue };
            let (candidate, held) = (self.candidate(&surface, &found, &next), placed.held(grip.point));
            let relative = candidate.corners[0] - held;
            let carried = placed.carried(held);
            if self.refuses_grip(index, found.node(), [relative - candidate.next[0] + carried, carried]) {
                self.touched = 0;
                return;
            }
            (found.normal, found.relative) = (Vec3::Z.to_array(), relative.to_array());
            (found.friction, found.instrument) = (HELD, grip.instrument);
            self.add_touched(found);
        }
    }

    pub(super) fn add_touched(&mut self, found: TouchedPoint) {
        let at = self.touched;
        if let Some(room) = self.memory().and_then(|memory| memory.room.touched.get_mut(at)) {
            *room = found;
            self.touched += 1;
        }
    }

    /// A place of the surface with its push of the step before. None where supports hold it.
    pub(super) fn found(&mut self, surface: &Surface<'_>, place: usize) -> Option<TouchedPoint> {
        let nodes = surface.corners(place)?.map(|corner| corner.node);
        let is_held = |node: &u32| {
            let inertia = self.scene.inertia.get(*node as usize);
            inertia.is_none_or(|inertia| inertia.inverse.iter().all(|&inverse| inverse <= 0.0))
        };
        if nodes.iter().all(is_held) {
            return None;
        }
        let kept = self.memory()?.before.get(place).copied().unwrap_or_default();
        let before = kept.to_array();
        let mut found = TouchedPoint { place: place as u32, nodes, push: before, before, ..TouchedPoint::default() };
        if place >= surface.nodes().len() {
            found.set_point(TrianglePoint::unpacked(kept.0[3]));
        }
        Some(found)
    }

    /// Where the corners of a place will be, and how they move, m.
    pub(super) fn candidate(
        &self,
        surface: &Surface<'_>,
        found: &TouchedPoint,
        next: &impl Fn(usize) -> [f32; 4],
    ) -> Candidate {
        let place = found.place as usize;
        let corners = surface.corners(place).unwrap_or_default();
        let next = corners.map(|corner| next(corner.node as usize));
        let here = corners.map(|corner| self.displacement.get(corner.node as usize).copied().unwrap_or_default());
        Candidate {
            corners: [0, 1, 2].map(|corner| predicted(corners[corner].rest, &here[corner], next[corner])),
            next: next.map(axes),
            is_triangle: place >= surface.nodes().len(),
            is_second: surface.is_second(place),
        }
    }

    /// Adds the changes of the pushes (N) to the forces.
    pub(crate) fn add_changes_of_pushes(&mut self) {
        let Self { pushes, force, touched, loads, .. } = self;
        let Some(surface) = loads.contact().map(Contact::surface) else { return };
        let Some(memory) = ContactMemory::split(pushes, &surface) else { return };
        for each in memory.room.touched.iter().take(*touched) {
            for (node, share) in each.corners() {
                if let Some(force) = force.get_mut(node) {
                    for axis in 0..3 {
                        force.0[axis] += share * (each.push[axis] - each.before[axis]);
                    }
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
            let Some(&each) = self.solver_room().touched.get(at) else { continue };
            if each.push != [0.0; 3] {
                let moved = self.moved_point(&each, &contact.surface(), &next);
                let touch = self.touches.get_mut(each.instrument as usize);
                each.report(moved, placed, touch, totals);
                self.list_push(&each, moved);
            }
        }
    }

    /// How far a point moves, as the mean of the increments before and after, and where it will be, m.
    pub(super) fn moved_point(
        &self,
        each: &TouchedPoint,
        surface: &Surface<'_>,
        next: &impl Fn(usize) -> [f32; 4],
    ) -> [Vec3; 2] {
        let last = |node: usize| self.increment.get(node).copied().unwrap_or_default().0;
        let way = each.corners().map(|(node, share)| share * mean(next(node), last(node))).sum();
        [way, each.point().mean(self.candidate(surface, each, next).corners)]
    }

    /// Tells the host of a push.
    pub(super) fn list_push(&mut self, each: &TouchedPoint, [_, point]: [Vec3; 2]) {
        let normal = if each.friction == HELD { Vec3::ZERO } else { Vec3::from_array(each.normal) };
        self.list(each.node(), each.instrument, [point, normal, Vec3::from_array(each.push)], -each.gap);
    }

    /// Keeps the pushes: the step is accepted, and the progress that of its end.
    pub(super) fn accept_pushes(&mut self) {
        let Self { pushes, progress, loads, touched, .. } = self;
        if let Some(contact) = loads.contact()
            && let Some(mut memory) = ContactMemory::split(pushes, &contact.surface())
        {
            memory.accept(*touched);
            memory.set_moment(progress);
        }
    }

    /// Refuses the step if an instrument moves too far in it, near the tissue.
    fn refuses_speed(&mut self, contact: &Contact<'_>, placed: &[Placed<'_>]) -> bool {
        for (index, placed) in placed.iter().enumerate() {
            let metres = [placed.way(), placed.thickness()];
            // Few are so fast that the tissue is looked at.
            if metres[0] > metres[1] && !placed.passes_by(self.bounds_of_surface(contact)) {
                let node = contact.surface().nodes().first().map_or(0, |entry| entry.node);
                return self.refuses(index, node, metres);
            }
        }
        false
    }

    /// The box around the surface now, and where it goes to, m.
    fn bounds_of_surface(&self, contact: &Contact<'_>) -> [Vec3; 2] {
        let mut bounds = [Vec3::INFINITY, Vec3::NEG_INFINITY];
        for entry in contact.surface().nodes() {
            let row = |vectors: &[NodeVector]| vectors.get(entry.node as usize).copied().unwrap_or_default();
            let (displacement, increment) = (row(self.displacement), row(self.increment));
            for times in [0.0, NEAR] {
                let point = predicted(entry.rest, &displacement, increment.0.map(|component| times * component));
                bounds = [bounds[0].min(point), bounds[1].max(point)];
            }
        }
        bounds
    }

    /// Refuses the step if a point that moves by `way` (m) was so far inside an instrument before it that it would be
    /// thrown, or comes so much nearer in the step that it would be pushed through the tissue around it, or be on the
    /// other side of the instrument.
    pub(super) fn refuses_depth(
        &mut self,
        (index, placed): (usize, &Placed<'_>),
        node: u32,
        meeting: &Meeting,
        way: Vec3,
    ) -> bool {
        let (size, approach) = (self.scene.node_size(node as usize), meeting.approach(way));
        self.refuses(index, node, [approach, placed.thickness().min(size)])
            || self.refuses(index, node, [-meeting.gap - approach, MOST_OF_SIZE * size])
    }

    /// Refuses the step if a node was so far from where an instrument held it that it would be thrown, or is carried
    /// through the tissue around it, m.
    fn refuses_grip(&mut self, index: usize, node: u32, [before, carried]: [Vec3; 2]) -> bool {
        let size = self.scene.node_size(node as usize);
        self.refuses(index, node, [carried.length(), size])
            || self.refuses(index, node, [before.length(), MOST_OF_SIZE * size])
    }

    /// Refuses the step if a length (m) to an instrument is more than the most that is possible.
    fn refuses(&mut self, index: usize, node: u32, [metre, most]: [f32; 2]) -> bool {
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
        let (held, point) = (placed.held(grip.point), predicted(rest, self.displacement.get(node)?, met.next));
        let (arm, carried) = (placed.arm(held), placed.carried(held));
        met.meeting = Meeting { gap: point.distance(held), normal: Vec3::ZERO, arm, carried, point: held };
        met.way = held - point;
        Some(met)
    }

    fn met(&self, node: usize, rest: [f32; 3], placed: &Placed<'_>, method: &impl StepMethod<M>) -> Option<Met> {
        let inertia = *self.scene.inertia.get(node)?;
        let increment = *self.increment.get(node)?;
        let next = method.next_increment(node, &inertia, &increment, self.force.get(node)?);
        let meeting = placed.meet(predicted(rest, self.displacement.get(node)?, next))?;
        let inertia = method.inertia_of(node, &inertia);
        Some(Met { node, inertia, increment, next, meeting, way: Vec3::ZERO })
    }
}

impl TouchedPoint {
    /// Tells the instrument, and the energy balance, of the push on a point that moves by `way` to `point`, m.
    pub(super) fn report(
        &self,
        [way, point]: [Vec3; 2],
        placed: &[Placed<'_>],
        touch: Option<&mut Touch>,
        totals: &mut Totals,
    ) {
        let push = Vec3::from_array(self.push);
        totals.add_work(push.dot(way));
        if let (Some(placed), Some(touch)) = (placed.get(self.instrument as usize), touch) {
            touch.add(push, placed.arm(point), -self.gap, [way, placed.carried(point)]);
        }
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

    /// The push that closes a gap (m), N, along free axes.
    fn push(&self, step: &Step, gap: f32, friction: f32) -> Vec3 {
        let Self { inertia, next, meeting, .. } = self;
        let free = self.free();
        // A node that supports guide along a plane or a line is moved within it.
        let normal = free * meeting.normal;
        let square = normal.length_squared();
        if square < 1e-6 {
            return Vec3::ZERO;
        }
        let out = -gap / square;
        let slip = free * (axes(*next) - meeting.carried);
        let slip = slip - normal * (slip.dot(normal) / square);
        let (length, most) = (slip.length(), friction * out * libm::sqrtf(square));
        let held = if length > most { most / length } else { 1.0 };
        (out * normal - held * slip) * (inertia.mass / step.push())
    }
}

/// The seconds in which tissue goes out of instruments: there is no time where it is only brought to rest.
pub(super) fn seconds_outward<M: ElementMaterial, S: StepMethod<M>>(step: &Step, _: &S) -> f32 {
    if S::IS_RELAXED { f32::INFINITY } else { step.seconds() }
}

pub(super) fn axes([x, y, z, _]: [f32; 4]) -> Vec3 {
    Vec3::new(x, y, z)
}

/// The mean of the increments before and after, m: what pushes do work along.
pub(super) fn mean(next: [f32; 4], last: [f32; 4]) -> Vec3 {
    0.5 * (axes(next) + axes(last))
}

/// Where a node will be at the end of the step, m.
pub(super) fn predicted(rest: [f32; 3], displacement: &NodeVector, next: [f32; 4]) -> Vec3 {
    Vec3::from_array(rest) + (axes(displacement.0) + axes(next))
}
