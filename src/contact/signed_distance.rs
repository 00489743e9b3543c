//! The signed distance to a closed surface of triangles: to the nearest point of the nearest triangle (Ericson 2005,
//! 5.1.5), with the sign of the pseudo-normal of the corner, edge or face on which that point lies (Baerentzen and
//! Aanaes 2005).
//!
//! A tree of boxes finds the triangle. It is complete, so that it needs no links: the boxes below box i are 2 i + 1 and
//! 2 i + 2.

use std::collections::HashMap;
use std::string::String;
use std::vec::Vec;

use glam::{DVec3, Vec3, Vec3A};

/// Most triangles in a box that is not divided.
const LEAF: usize = 3;
/// The ends of what a triangle shares with others: its corners and its edges.
const SHARED: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]];
/// The feature after them, which is the face.
const FACE: usize = SHARED.len();

/// A surface that answers how far points are from it.
pub(super) struct SignedDistance {
    /// The power of two that turns metres into lengths of about one, whose squares and cubes are numbers in float32
    /// too.
    scale: f32,
    /// In the order of the leaves.
    triangles: Vec<[Vec3; 3]>,
    normals: PseudoNormals,
    /// Least and greatest coordinates.
    boxes: Vec<[Vec3A; 2]>,
    /// How often the surface is halved.
    depth: u32,
}

/// Outwards at all features.
struct PseudoNormals {
    sums: Vec<Vec3>,
    /// The place of each among them, triangle by triangle.
    of: Vec<[usize; FACE + 1]>,
}

/// The nearest point so far.
struct Nearest {
    square: f32,
    triangle: usize,
    feature: usize,
    /// From the nearest point to the point.
    way: Vec3,
}

impl SignedDistance {
    /// Of triangles with these corners, m, whose normals point outwards, for points with coordinates up to `largest`
    /// (m). Triangles without an area are left out: their neighbours have their edges.
    pub(super) fn new(triangles: &[[Vec3; 3]], largest: f32) -> Result<Self, String> {
        let scale = libm::ldexpf(1.0, -libm::ilogbf(largest).clamp(-126, 126));
        let scaled = triangles.iter().map(|corners| corners.map(|corner| scale * corner));
        let mut triangles: Vec<_> = scaled.filter(|&corners| normal(corners) != DVec3::ZERO).collect();
        if triangles.is_empty() {
            return Err("no triangle has an area".into());
        }
        let leaves = triangles.len().div_ceil(LEAF).next_power_of_two();
        let depth = leaves.ilog2();
        // By rounding a nearest point may lie a little outside the box of its triangle.
        let margin = 16.0 * f32::EPSILON * scale * largest;
        let mut boxes = Vec::with_capacity(2 * leaves - 1);
        let count = triangles.len();
        let first = |leaf: usize| first_triangle(leaf, count, depth);
        let mut below = leaves;
        while below > 0 {
            for leaf in (0..leaves).step_by(below) {
                let [start, middle, end] = [leaf, leaf + below / 2, leaf + below].map(first);
                let inside = &mut triangles[start..end];
                let [low, high] = bounds(inside).map(Vec3A::from);
                boxes.push([low - margin, high + margin]);
                if below > 1 {
                    halve(inside, middle - start);
                }
            }
            below /= 2;
        }
        let normals = PseudoNormals::new(&triangles);
        Ok(Self { scale, triangles, normals, boxes, depth })
    }

    /// The distance of a point (m), below zero inside, and its nearest triangle. The search starts with the triangle
    /// `guess`, best that of a point near by.
    pub(super) fn at(&self, point: Vec3, guess: usize) -> (f32, usize) {
        let point = self.scale * point;
        let mut nearest = Nearest { square: f32::INFINITY, triangle: guess, feature: FACE, way: Vec3::ZERO };
        self.meet(guess, point, &mut nearest);
        self.search(0, point, &mut nearest);
        let Nearest { square, triangle, feature, way } = nearest;
        let distance = square.sqrt() / self.scale;
        let is_inside = way.dot(self.normals.of(triangle, feature)) <= 0.0;
        (if is_inside { -distance } else { distance }, triangle)
    }

    /// Looks through a box, the nearer half first.
    fn search(&self, index: usize, point: Vec3, nearest: &mut Nearest) {
        if let Some(leaf) = (index + 1).checked_sub(1 << self.depth) {
            let first = |leaf: usize| first_triangle(leaf, self.triangles.len(), self.depth);
            return (first(leaf)..first(leaf + 1)).for_each(|triangle| self.meet(triangle, point, nearest));
        }
        let at = Vec3A::from(point);
        let square = |index: usize| {
            let [low, high] = self.boxes[index];
            (low - at).max(at - high).max(Vec3A::ZERO).length_squared()
        };
        let mut halves = [2 * index + 1, 2 * index + 2].map(|half| (square(half), half));
        if halves[1].0 < halves[0].0 {
            halves.swap(0, 1);
        }
        for (square, half) in halves {
            if square < nearest.square {
                self.search(half, point, nearest);
            }
        }
    }

    fn meet(&self, triangle: usize, point: Vec3, nearest: &mut Nearest) {
        let (on, feature) = nearest_on(self.triangles[triangle], point);
        let way = point - on;
        let square = way.length_squared();
        if square < nearest.square {
            *nearest = Nearest { square, triangle, feature, way };
        }
    }
}

/// The first triangle of a leaf: they are shared out evenly.
fn first_triangle(leaf: usize, triangles: usize, depth: u32) -> usize {
    ((leaf as u64 * triangles as u64) >> depth) as usize
}

/// Least and greatest coordinates.
pub(super) fn bounds(triangles: &[[Vec3; 3]]) -> [Vec3; 2] {
    let low = triangles.as_flattened().iter().fold(Vec3::INFINITY, |low, &corner| low.min(corner));
    let high = triangles.as_flattened().iter().fold(Vec3::NEG_INFINITY, |high, &corner| high.max(corner));
    [low, high]
}

/// Sorts triangles into two halves along the axis that gives them the smallest boxes.
fn halve(triangles: &mut [[Vec3; 3]], middle: usize) {
    let halves = |triangles: &mut [[Vec3; 3]], axis: usize| {
        let key = |corners: &[Vec3; 3]| corners[0][axis] + corners[1][axis] + corners[2][axis];
        triangles.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)));
        let area = |triangles: &[[Vec3; 3]]| {
            let [low, high] = bounds(triangles);
            let size = high - low;
            size.dot(Vec3::new(size.y, size.z, size.x))
        };
        let (one, other) = triangles.split_at(middle);
        area(one) + area(other)
    };
    let areas = [0, 1, 2].map(|axis| halves(triangles, axis));
    let axis = Vec3::from_array(areas).min_position();
    halves(triangles, axis);
}

/// Twice the area long. In float64: of thin triangles float32 would leave the errors.
fn normal(corners: [Vec3; 3]) -> DVec3 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (b - a).cross(c - a)
}

impl PseudoNormals {
    /// Corners sum the normals around them by the angles, edges those of their two triangles. Points at the same place
    /// are one.
    fn new(triangles: &[[Vec3; 3]]) -> Self {
        let (mut sums, mut of) = (Vec::new(), Vec::with_capacity(triangles.len()));
        let mut known = HashMap::new();
        for corners in triangles {
            let normal = normal(*corners);
            let direction = normal.normalize().as_vec3();
            let mut places = [0; FACE + 1];
            for (place, [from, to]) in places.iter_mut().zip(SHARED) {
                let weight = if from == to {
                    let [at, b, c] = [0, 1, 2].map(|corner| corners[(from + corner) % 3].as_dvec3());
                    libm::atan2(normal.length(), (b - at).dot(c - at)) as f32
                } else {
                    1.0
                };
                // Without negative zeros.
                let mut ends = [from, to].map(|end| (corners[end] + 0.0).to_array().map(f32::to_bits));
                ends.sort_unstable();
                *place = *known.entry(ends).or_insert_with(|| {
                    sums.push(Vec3::ZERO);
                    sums.len() - 1
                });
                sums[*place] += weight * direction;
            }
            places[FACE] = sums.len();
            sums.push(direction);
            of.push(places);
        }
        Self { sums, of }
    }

    fn of(&self, triangle: usize, feature: usize) -> Vec3 {
        self.sums[self.of[triangle][feature]]
    }
}

/// The nearest point of a triangle and the feature on which it lies. Which edge is nearest is told by cross products,
/// which lose fewer digits than the differences of products in Ericson's text; what rounding puts outside the triangle
/// is put back.
fn nearest_on([a, b, c]: [Vec3; 3], point: Vec3) -> (Vec3, usize) {
    let [ab, ac, bc] = [b - a, c - a, c - b];
    let [from_a, from_b, from_c] = [a, b, c].map(|corner| point - corner);
    let along = |from: Vec3| [ab.dot(from), ac.dot(from)];
    let [[d1, d2], [d3, d4], [d5, d6]] = [from_a, from_b, from_c].map(along);
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, 0);
    }
    if d3 >= 0.0 && d4 <= d3 {
        return (b, 1);
    }
    if d6 >= 0.0 && d5 <= d6 {
        return (c, 2);
    }
    let normal = ab.cross(ac);
    let opposite_c = normal.dot(ab.cross(from_a));
    if opposite_c < 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / ab.length_squared()).min(1.0), 3);
    }
    let opposite_b = -normal.dot(ac.cross(from_c));
    if opposite_b < 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / ac.length_squared()).min(1.0), 5);
    }
    let opposite_a = normal.dot(bc.cross(from_b));
    if opposite_a < 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (b + bc * (bc.dot(from_b) / bc.length_squared()).clamp(0.0, 1.0), 4);
    }
    let sum = opposite_a + opposite_b + opposite_c;
    let share = (opposite_b / sum).clamp(0.0, 1.0);
    (a + ab * share + ac * (opposite_c / sum).max(0.0).min(1.0 - share), FACE)
}
