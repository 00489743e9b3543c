//! Triangles of the surface in a step, which instruments touch at the point that is deepest in them: the push `p` there
//! is a force `w_i p` on each corner, with the barycentric weights `w_i`, and the point moves by the mean of its
//! corners. As triangles share nodes, exact steps find the pushes on both by projected Gauss-Seidel, from those of the step before
//! on: the points that are deepest are then those of where the tissue will be, and tissue at rest stays. A bounded number of
//! sweeps goes over
//!
//! ```text
//! p <- projection of  p - m r / c,   1/m = sum w_i^2 / m_i
//! ```
//! onto the pushes that friction allows, with the way `r` (m) that is left and `c` (s^2) as for a node. Long steps
//! solve for them together with the nodes ([`crate::contact`]).

use glam::Vec3;

use super::contact::{axes, predicted, seconds_outward};
use super::{Step, StepMethod, Totals, Trial};
use crate::contact::{
    Contact, ContactMemory, MOST_INSTRUMENTS, Meeting, Placed, Surface, Touch, TouchedPoint, TrianglePoint,
};
use crate::element::ElementMaterial;
use crate::simd::NodeVector;

/// Sweeps over the nodes and triangles that touch, at most. With 8, a capsule along 20 of them kept soft tissue in motion
/// for good (7e-7 J; 24: 6e-11 J).
const SWEEPS: usize = 24;
/// They end earlier where a sweep moves no point by more than this share of what the pushes move one.
const SETTLED: f32 = 1e-4;
/// Least share of a normal, squared, along which supports let a point move.
const LEAST_SHARE: f32 = 1e-6;

/// Where the corners of a triangle will be, and how far they move in the step, m; a node three times.
pub(super) struct Candidate {
    pub(super) corners: [Vec3; 3],
    pub(super) next: [Vec3; 3],
    pub(super) is_triangle: bool,
    pub(super) is_second: bool,
}

/// Which instrument a node or triangle is nearest to, with the point and its meeting, and a distance (m) that it has
/// from all.
pub(super) struct Nearest {
    pub(super) distance: f32,
    pub(super) met: Option<(usize, TrianglePoint, Meeting)>,
}

impl Candidate {
    /// The farthest that a corner moves, m.
    pub(super) fn farthest(&self) -> f32 {
        self.next.iter().fold(0.0, |most: f32, next| most.max(next.length()))
    }

    /// The nearest instrument. A triangle is searched if it can be nearer than `margin` (m); one that was pushed keeps
    /// its point.
    pub(super) fn nearest(
        &self,
        found: &TouchedPoint,
        placed: &[Placed<'_>],
        (margin, pushed): (f32, bool),
    ) -> Nearest {
        let mut nearest = Nearest { distance: f32::INFINITY, met: None };
        for (index, placed) in placed.iter().enumerate() {
            let (distance, met) = if self.is_triangle {
                self.nearest_point(pushed.then(|| found.point()), placed, margin)
            } else {
                let Some(meeting) = placed.meet(self.corners[0]) else { continue };
                (placed.least_distance(&meeting), Some((TrianglePoint::CORNER, meeting)))
            };
            nearest.distance = nearest.distance.min(distance);
            if let Some((point, meeting)) = met
                && nearest.met.as_ref().is_none_or(|(_, _, nearest)| meeting.gap < nearest.gap)
            {
                nearest.met = Some((index, point, meeting));
            }
        }
        nearest
    }

    /// A distance (m) that the triangle has from an instrument, and its nearest point if that may be nearer than
    /// `margin` (m), or the point that was pushed.
    fn nearest_point(
        &self,
        pushed: Option<TrianglePoint>,
        placed: &Placed<'_>,
        margin: f32,
    ) -> (f32, Option<(TrianglePoint, Meeting)>) {
        // A plane reaches the corners first.
        if placed.is_plane() || (self.is_second && !placed.has_second_points()) {
            return (f32::INFINITY, None);
        }
        if let Some(point) = pushed {
            return (f32::NEG_INFINITY, placed.meet(point.mean(self.corners)).map(|meeting| (point, meeting)));
        }
        let [a, b, c] = self.corners;
        let middle = (a + b + c) / 3.0;
        let reach = self.corners.iter().fold(0.0, |most: f32, corner| most.max(corner.distance(middle)));
        let Some(meeting) = placed.meet(middle) else { return (f32::NEG_INFINITY, None) };
        let distance = placed.least_distance(&meeting) - reach;
        if distance > margin {
            return (distance, None);
        }
        let Some((point, meeting)) = placed.meet_triangle(self.corners, self.is_second) else {
            return (f32::NEG_INFINITY, None);
        };
        // The point is rounded, and that of a turned capsule: an edge is at most twice as long as the reach.
        let distance = if placed.finds_nearest() { distance.max(meeting.gap - reach / 12.0) } else { distance };
        // At a corner it is the node that is touched.
        (distance, Some((point, meeting)).filter(|(point, _)| !point.is_corner()))
    }
}

/// The nodes that carry a push on a place of the surface, with their shares.
pub(super) fn corners_of(
    surface: &Surface<'_>,
    place: usize,
    push: &NodeVector,
) -> impl Iterator<Item = (usize, f32)> + use<> {
    let nodes = surface.corners(place).unwrap_or_default().map(|corner| corner.node as usize);
    let point = if place < surface.nodes().len() { TrianglePoint::CORNER } else { TrianglePoint::unpacked(push.0[3]) };
    let carries = |push: &NodeVector| axes(push.0) != Vec3::ZERO;
    let count = if !carries(push) {
        0
    } else if point == TrianglePoint::CORNER {
        1
    } else {
        3
    };
    nodes.into_iter().zip(point.weights()).take(count)
}

impl<M: ElementMaterial> Trial<'_, M> {
    /// Finds anew at which point a triangle that was pushed in the step before is nearest to an instrument, if it goes
    /// on as it did.
    pub(super) fn follow_triangles(&mut self, step: &Step) {
        let Some(contact) = self.loads.contact().filter(|contact| !contact.surface().triangles().is_empty()) else {
            return;
        };
        let (surface, placed) = (contact.surface(), &*contact.placed(self.progress.time, step.seconds()));
        let Self { pushes, progress, displacement, increment, .. } = self;
        let Some(mut memory) = ContactMemory::split(pushes, &surface) else { return };
        memory.forget_if_other(progress);
        let row = |vectors: &[NodeVector], node: u32| vectors.get(node as usize).copied().unwrap_or_default();
        let after = |node: crate::contact::SurfaceNode| {
            predicted(node.rest, &row(displacement, node.node), row(increment, node.node).0)
        };
        let mut from = surface.nodes().len();
        while let Some(place) = memory.next_in_reach(from, f32::MIN) {
            from = place + 1;
            let Some(push) = memory.before.get_mut(place).filter(|push| axes(push.0) != Vec3::ZERO) else {
                continue;
            };
            // Next to a grip nothing else is pushed.
            if contact.is_gripped(place) {
                *push = NodeVector::ZERO;
                continue;
            }
            let Some(corners) = surface.corners(place).map(|corners| corners.map(after)) else { continue };
            let (second, before) = (surface.is_second(place), TrianglePoint::unpacked(push.0[3]));
            let met = placed.iter().filter(|placed| !placed.is_plane() && (!second || placed.has_second_points()));
            let points = met.filter_map(|placed| Some((placed, placed.meet_triangle(corners, second)?)));
            let nearest = points.min_by(|(_, (_, a)), (_, (_, b))| a.gap.total_cmp(&b.gap));
            if let Some((placed, (point, _))) = nearest
                && !(placed.has_second_points() && point.is_near(before))
            {
                push.0[3] = point.packed();
            }
        }
    }

    /// Adds the pushes of the step before to the forces. Gives how far that moves a node at the most, m.
    pub(super) fn push_as_before(
        &mut self,
        contact: &Contact<'_>,
        (step, method): (&Step, &impl StepMethod<M>),
        totals: &mut Totals,
    ) -> f32 {
        self.follow_triangles(step);
        let (surface, mut from, mut moved) = (contact.surface(), 0, 0.0f32);
        while let Some(place) = self.memory().and_then(|memory| memory.next_in_reach(from, f32::MIN)) {
            from = place + 1;
            // A grip holds its node anew.
            if contact.is_gripped(place) {
                continue;
            }
            let push = self.memory().and_then(|memory| memory.before.get(place).copied()).unwrap_or_default();
            for (node, share) in corners_of(&surface, place, &push) {
                let before = axes(self.next_of(node, method));
                if let Some(next) = self.add_force(node, share * axes(push.0), (step, method), totals) {
                    moved = moved.max(axes(next).distance(before));
                }
            }
        }
        moved
    }

    /// Adds the changes of the pushes on nodes and triangles to the forces, for methods whose next increment of a node follows from
    /// its force and its mass alone.
    pub(super) fn meet_triangles(
        &mut self,
        contact: &Contact<'_>,
        (step, method): (&Step, &impl StepMethod<M>),
        placed: &[Placed<'_>],
        (totals, touches): (&mut Totals, &mut [Touch; MOST_INSTRUMENTS]),
        limit: Option<f32>,
    ) {
        let (surface, first, seconds) = (contact.surface(), self.touched, seconds_outward(step, method));
        let mut from = 0;
        while let Some(place) = self.next_in_reach(from, limit) {
            from = place + 1;
            if contact.is_gripped(place) {
                continue;
            }
            let Some(mut found) = self.found(&surface, place) else { continue };
            let candidate = self.candidate(&surface, &found, &|node| self.next_of(node, method));
            let is_pushed = found.before != [0.0; 3];
            let Nearest { distance, met } = candidate.nearest(&found, placed, (0.0, is_pushed));
            if let Some(mut memory) = self.memory() {
                memory.note(place, distance - candidate.farthest());
            }
            if let Some((index, point, meeting)) = met.filter(|(.., meeting)| meeting.gap < 0.0 || is_pushed) {
                found.set_point(point);
                let moved = point.mean(candidate.next);
                let at = placed.get(index).map(|placed| (index, placed));
                if at.is_some_and(|at| self.refuses_depth(at, found.node(), &meeting, moved)) {
                    return;
                }
                found.vector = (meeting.relative(moved - meeting.carried, seconds) - moved).to_array();
                (found.normal, found.gap) = (meeting.normal.to_array(), meeting.gap);
                found.friction = placed.get(index).map_or(0.0, |placed| placed.instrument.friction);
                found.instrument = index as u32;
            } else if is_pushed {
                // All instruments are gone: no push.
                let normal = Vec3::from_array(found.before).normalize_or(Vec3::Z);
                (found.normal, found.vector) = (normal.to_array(), normal.to_array());
            } else {
                continue;
            }
            found.scale = self.mass_at(&found, method);
            if found.scale == 0.0 {
                // Supports bear it.
                for (node, share) in found.corners() {
                    self.add_force(node, -share * Vec3::from_array(found.push), (step, method), totals);
                }
                found.push = [0.0; 3];
            }
            self.add_touched(found);
        }
        for _ in 0..SWEEPS {
            let mut most = [0.0f32; 2];
            for at in first..self.touched {
                let Some(mut each) = self.touched_at(at).filter(|each| each.scale > 0.0) else { continue };
                let moved = self.moved(&each, method);
                let way = Vec3::from_array(each.vector) + moved;
                let push = Vec3::from_array(each.push) - way * (each.scale / step.push());
                let change = each.projected(push) - Vec3::from_array(each.push);
                for (node, share) in each.corners() {
                    self.add_force(node, share * change, (step, method), totals);
                }
                each.push = (Vec3::from_array(each.push) + change).to_array();
                if let Some(place) = self.solver_room().touched.get_mut(at) {
                    *place = each;
                }
                let way = |push: Vec3| push.length() * step.push() / each.scale;
                most = [most[0].max(way(change)), most[1].max(way(Vec3::from_array(each.push)))];
            }
            if most[0] <= SETTLED * most[1] {
                break;
            }
        }
        for at in first..self.touched {
            if let Some(each) = self.touched_at(at).filter(|each| each.push != [0.0; 3]) {
                let moved = self.moved_point(&each, &surface, &|node| self.next_of(node, method));
                each.report(moved, placed, touches.get_mut(each.instrument as usize), totals);
                self.list_push(&each, moved);
            }
        }
    }

    fn touched_at(&mut self, at: usize) -> Option<TouchedPoint> {
        self.solver_room().touched.get(at).copied()
    }

    /// The mass (kg) that a push along the normal moves, as far as supports let it; zero where they do not.
    fn mass_at(&self, found: &TouchedPoint, method: &impl StepMethod<M>) -> f32 {
        let [x, y, z] = found.normal;
        let (mut inverse, mut of_free) = (0.0, 0.0);
        for (node, share) in found.corners() {
            let Some(inertia) = self.scene.inertia.get(node) else { continue };
            let inertia = method.inertia_of(node, inertia);
            let [a, b, c] = inertia.inverse.map(|inverse| inverse.max(0.0));
            inverse += share * share * (x * x * a + y * y * b + z * z * c);
            of_free += share * share / inertia.mass;
        }
        if inverse > LEAST_SHARE * of_free { 1.0 / inverse } else { 0.0 }
    }

    /// How far a point moves in the step, m.
    fn moved(&self, each: &TouchedPoint, method: &impl StepMethod<M>) -> Vec3 {
        each.corners().map(|(node, share)| share * axes(self.next_of(node, method))).sum()
    }

    /// The next increment of a node with the force of now, m.
    fn next_of(&self, node: usize, method: &impl StepMethod<M>) -> [f32; 4] {
        let of = || {
            let (inertia, increment) = (self.scene.inertia.get(node)?, self.increment.get(node)?);
            Some(method.next_increment(node, inertia, increment, self.force.get(node)?))
        };
        of().unwrap_or_default()
    }
}
