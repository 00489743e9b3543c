//! Where a triangle of the surface is nearest to an instrument, or deepest inside it: the least signed distance over
//! the triangle. For spheres and capsules in closed form (Ericson 2005, 5.1.5 and 5.1.9): the nearest point to the
//! centre, or to the ends of the axis, or on an edge. For fields by a pattern search in barycentric coordinates (Hooke
//! & Jeeves 1961) with steps of 1/4 to 1/256 of an edge, at most 337 distances: it may miss a dent that is smaller than
//! a triangle.
//!
//! A capsule that lies along a triangle is as deep over a length. A push at one point of it would turn the triangle until
//! the other end is the deepest, and back: friction is lost, and nothing comes to rest. So a triangle has two points, which
//! are the deepest of the capsule when it is turned by a small angle to either end: both ends of the length, until the
//! triangle is tilted by more than this angle, when the one that jumps has long ceased to be pushed.

use glam::Vec3;

use super::shape::Shape;
use super::{Meeting, Placed};

/// Parts of an edge that are told apart.
const PARTS: i32 = 2048;
const FIRST_STEP: i32 = 512;
const LAST_STEP: i32 = 8;
/// The tangent of the angle by which a capsule is turned, to either end, to find the two points of a triangle.
const TURN: f32 = 0.03;
/// A point that a capsule pushes stays where it is if it would move by no more parts: along the axis rounding alone would
/// tell where it is.
const PLAY: i32 = 2;
/// Moves of a length before it is halved.
const MOVES: usize = 4;

/// Changes of the weights: along the edges, and across them.
const DIRECTIONS: [[i32; 3]; 12] = [
    [-1, 1, 0],
    [0, -1, 1],
    [1, 0, -1],
    [1, -1, 0],
    [0, 1, -1],
    [-1, 0, 1],
    [-2, 1, 1],
    [1, -2, 1],
    [1, 1, -2],
    [2, -1, -1],
    [-1, 2, -1],
    [-1, -1, 2],
];

/// A point of a triangle as the weights of its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TrianglePoint([i32; 3]);

impl TrianglePoint {
    /// The first corner. Of a place that is a node, the node.
    pub(crate) const CORNER: Self = Self([PARTS, 0, 0]);
    const MIDDLE: Self = Self([PARTS - 2 * (PARTS / 3), PARTS / 3, PARTS / 3]);

    /// From the weights of the second and the third corner.
    pub(crate) fn from_weights(weights: [f32; 2]) -> Self {
        let [b, c] = weights.map(|weight| (weight * PARTS as f32) as i32);
        Self([PARTS - b - c, b, c])
    }

    /// The nearest that can be told apart.
    fn rounded([_, b, c]: [f32; 3]) -> Self {
        let b = ((b * PARTS as f32 + 0.5) as i32).clamp(0, PARTS);
        let c = ((c * PARTS as f32 + 0.5) as i32).clamp(0, PARTS - b);
        Self([PARTS - b - c, b, c])
    }

    pub(crate) fn weights(self) -> [f32; 3] {
        self.0.map(|part| part as f32 / PARTS as f32)
    }

    /// The mean of what its corners have.
    pub(crate) fn mean(self, corners: [Vec3; 3]) -> Vec3 {
        let ([a, b, c], [x, y, z]) = (self.weights(), corners);
        a * x + b * y + c * z
    }

    /// Whether another point is as good.
    pub(crate) fn is_near(self, other: Self) -> bool {
        self.0.into_iter().zip(other.0).all(|(a, b)| (a - b).abs() <= PLAY)
    }

    pub(crate) fn is_corner(self) -> bool {
        self.0.contains(&PARTS)
    }

    /// As one number, exact.
    pub(crate) fn packed(self) -> f32 {
        let [_, b, c] = self.0;
        (b * 2 * PARTS + c) as f32
    }

    /// From the number.
    pub(crate) fn unpacked(packed: f32) -> Self {
        let all = (packed as i32).clamp(0, 2 * PARTS * PARTS + PARTS);
        let b = (all / (2 * PARTS)).min(PARTS);
        let c = (all % (2 * PARTS)).min(PARTS - b);
        Self([PARTS - b - c, b, c])
    }

    /// As far in a direction as the triangle goes, and at most by so many parts.
    fn moved(self, direction: [i32; 3], parts: i32) -> Self {
        let room = self.0.into_iter().zip(direction).filter(|(_, change)| *change < 0);
        let parts = room.fold(parts, |parts, (weight, change)| parts.min(weight / -change));
        let [[a, b, c], [x, y, z]] = [self.0, direction];
        Self([a + parts * x, b + parts * y, c + parts * z])
    }
}

impl Placed<'_> {
    /// The point of a triangle that will be nearest to the instrument at the end of the step, and its meeting, from
    /// where its corners will be, m: of a capsule that is turned a little to one end, the second one to the other. None
    /// if that is not a number.
    pub(crate) fn meet_triangle(&self, corners: [Vec3; 3], second: bool) -> Option<(TrianglePoint, Meeting)> {
        let in_shape = corners.map(|corner| self.end.in_shape(corner));
        let point = match self.instrument.shape {
            Shape::Sphere { .. } => TrianglePoint::rounded(nearest_to_point(Vec3::ZERO, in_shape)),
            Shape::Capsule { length, .. } => {
                let [a, b, c] = in_shape;
                let turn = if second { -TURN } else { TURN };
                let lowered = (b - a).cross(c - a).normalize_or_zero() * turn;
                let ends = [-0.5, 0.5].map(|end| (Vec3::Z + lowered) * (end * length));
                TrianglePoint::rounded(nearest_to_segment(ends, in_shape))
            }
            shape @ (Shape::Field(_) | Shape::Plane) => searched(|point| shape.nearest(point.mean(in_shape)).0),
        };
        Some((point, self.meet(point.mean(corners))?))
    }

    /// Whether triangles have a second point.
    pub(crate) fn has_second_points(&self) -> bool {
        matches!(self.instrument.shape, Shape::Capsule { .. })
    }

    /// Whether the point of a triangle is the nearest of all, and not only of those that were looked at.
    pub(crate) fn finds_nearest(&self) -> bool {
        !matches!(self.instrument.shape, Shape::Field(_))
    }
}

/// The point of the least gap (m) by a pattern search.
fn searched(gap: impl Fn(TrianglePoint) -> f32) -> TrianglePoint {
    let mut best = (gap(TrianglePoint::MIDDLE), TrianglePoint::MIDDLE);
    let mut step = FIRST_STEP;
    while step >= LAST_STEP {
        for _ in 0..MOVES {
            let mut next = best;
            for direction in DIRECTIONS {
                let point = best.1.moved(direction, step);
                let gap = gap(point);
                if gap < next.0 {
                    next = (gap, point);
                }
            }
            if next.1 == best.1 {
                break;
            }
            best = next;
        }
        step /= 2;
    }
    best.1
}

/// The weights of the corners at the point of a triangle that is nearest to a point.
fn nearest_to_point(point: Vec3, [a, b, c]: [Vec3; 3]) -> [f32; 3] {
    let (ab, ac) = (b - a, c - a);
    let along = |from: Vec3| [ab.dot(point - from), ac.dot(point - from)];
    let [[d1, d2], [d3, d4], [d5, d6]] = [a, b, c].map(along);
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let [opposite_a, opposite_b, opposite_c] = [d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2];
    if opposite_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let share = d1 / (d1 - d3);
        return [1.0 - share, share, 0.0];
    }
    if opposite_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let share = d2 / (d2 - d6);
        return [1.0 - share, 0.0, share];
    }
    let (from_b, from_c) = (d4 - d3, d5 - d6);
    if opposite_a <= 0.0 && from_b >= 0.0 && from_c >= 0.0 {
        let share = from_b / (from_b + from_c);
        return [0.0, 1.0 - share, share];
    }
    let sum = opposite_a + opposite_b + opposite_c;
    [opposite_a / sum, opposite_b / sum, opposite_c / sum]
}

/// The same nearest to a segment: at one of its ends, on an edge, or where it goes through the triangle.
fn nearest_to_segment(ends: [Vec3; 2], corners: [Vec3; 3]) -> [f32; 3] {
    let [a, b, c] = corners;
    let [from, to] = ends.map(|end| nearest_to_point(end, corners));
    let edge = |one: Vec3, other: Vec3| nearest_on_edge(ends, [one, other]);
    let [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)];
    let all = [from, to, [1.0 - ab, ab, 0.0], [0.0, 1.0 - bc, bc], [ca, 0.0, 1.0 - ca]];
    let distance = |weights: &[f32; 3]| {
        let [u, v, w] = *weights;
        let point = u * a + v * b + w * c;
        point.distance_squared(ends[0] + (ends[1] - ends[0]) * share_along(point, ends))
    };
    let mut best = (f32::INFINITY, from);
    for weights in all.into_iter().chain(crossing(ends, corners)) {
        let distance = distance(&weights);
        if distance < best.0 {
            best = (distance, weights);
        }
    }
    best.1
}

/// Which share of a segment lies before its nearest point to `point`.
fn share_along(point: Vec3, [from, to]: [Vec3; 2]) -> f32 {
    let way = to - from;
    let square = way.length_squared();
    if square > 0.0 { ((point - from).dot(way) / square).clamp(0.0, 1.0) } else { 0.0 }
}

/// The share of an edge before its nearest point to a segment.
fn nearest_on_edge(segment: [Vec3; 2], edge: [Vec3; 2]) -> f32 {
    let (d, e, r) = (segment[1] - segment[0], edge[1] - edge[0], segment[0] - edge[0]);
    let (dd, ee, de) = (d.length_squared(), e.length_squared(), d.dot(e));
    let square = dd * ee - de * de;
    // Parallel ones are equally near over a length, at an end of which the loop below ends.
    let at = if square > 0.0 { ((de * e.dot(r) - d.dot(r) * ee) / square).clamp(0.0, 1.0) } else { 0.5 };
    let share = share_along(segment[0] + d * at, edge);
    // The share of the segment was clamped: the nearest point on it to that of the edge is nearer still.
    let at = share_along(edge[0] + e * share, segment);
    share_along(segment[0] + d * at, edge)
}

/// Where a segment goes through a triangle.
fn crossing([from, to]: [Vec3; 2], [a, b, c]: [Vec3; 3]) -> Option<[f32; 3]> {
    let normal = (b - a).cross(c - a);
    let [before, behind] = [from, to].map(|end| normal.dot(end - a));
    if before * behind >= 0.0 {
        return None;
    }
    let point = from + (to - from) * (before / (before - behind));
    let part = |x: Vec3, y: Vec3| normal.dot((x - point).cross(y - point)) / normal.length_squared();
    let weights = [part(b, c), part(c, a), part(a, b)];
    weights.iter().all(|&weight| weight >= 0.0).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Instrument, Pose, Shape};

    /// Points of triangles survive as one number.
    #[test]
    fn a_point_is_the_same_after_it_was_packed() {
        for b in 0..=PARTS {
            for c in 0..=PARTS - b {
                let point = TrianglePoint([PARTS - b - c, b, c]);
                assert_eq!(TrianglePoint::unpacked(point.packed()), point);
            }
        }
        for odd in [f32::NAN, -1.0, f32::INFINITY, 1e9] {
            let sum: f32 = TrianglePoint::unpacked(odd).weights().iter().sum();
            assert_eq!(sum, 1.0);
        }
    }

    /// Against the least distance on a fine grid of points, for spheres and for capsules that lie across, along and on
    /// end; in closed form and by the search.
    #[test]
    fn the_nearest_point_is_as_near_as_the_best_of_a_fine_grid() {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let mut worst = [[0.0f32; 2]; 2];
        for case in 0..600 {
            let corners = [(); 3].map(|()| Vec3::new(random(), random(), 0.3 * random()) * 0.01);
            let direction = [random(), random(), random()];
            let at = [0.01, 0.01, 0.003].map(|size| size * random());
            let capsule = Shape::Capsule { radius: 5e-4, length: 0.006 };
            let shape = if case % 2 == 0 { capsule } else { Shape::Sphere { radius: 5e-4 } };
            let instrument = Instrument::resting(shape, Pose::along(at, direction));
            let placed = Placed::new(&instrument, [0.0, 0.0]);
            let gap = |weights: [f32; 3]| {
                let point = (0..3).map(|corner| weights[corner] * corners[corner]).sum();
                placed.meet(point).expect("a number").gap
            };
            let mut least = f32::INFINITY;
            for b in 0..=100 {
                for c in 0..=100 - b {
                    least = least.min(gap([100 - b - c, b, c].map(|weight| weight as f32 / 100.0)));
                }
            }
            let both = [false, true].map(|second| placed.meet_triangle(corners, second).expect("numbers").1);
            let closed = if both[0].gap < both[1].gap { &both[0] } else { &both[1] };
            let search = gap(searched(|point| gap(point.weights())).weights());
            for (worst, found) in worst[case % 2].iter_mut().zip([closed.gap, search]) {
                *worst = worst.max(found - least);
            }
        }
        let micrometres = worst.map(|each| each.map(|each| 1e6 * each));
        println!(
            "farther than the best of 5151 points, um: capsules {:.2?}, spheres {:.2?}",
            micrometres[0], micrometres[1]
        );
        // The points of a capsule are those of one that is turned a little: 0.6 % of its length.
        let [[capsule, _], [sphere, _]] = worst;
        assert!(capsule < 4e-5 && sphere < 5e-6 && worst.iter().all(|[_, search]| *search < 3e-5), "{worst:?}");
    }

    /// Corners on a line, or in one point, have a nearest point too.
    #[test]
    fn triangles_without_an_area_have_a_nearest_point() {
        let at = Vec3::new(0.001, 0.002, 0.003);
        for corners in [[at; 3], [at, 2.0 * at, 3.0 * at], [at, at, -at], [-at, at, at]] {
            for shape in [Shape::Sphere { radius: 0.001 }, Shape::Capsule { radius: 0.001, length: 0.01 }] {
                let instrument = Instrument::resting(shape, Pose::at([0.0; 3]));
                let (point, met) = Placed::new(&instrument, [0.0, 0.0]).meet_triangle(corners, false).expect("numbers");
                let least = corners.map(|corner| shape.nearest(corner).0).into_iter().fold(f32::INFINITY, f32::min);
                assert!(met.gap <= least + 1e-6, "{point:?}, {} m, {least} m", met.gap);
            }
        }
    }
}
