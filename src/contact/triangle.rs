//! Where a triangle of the surface is nearest to an instrument, or deepest inside it: the least signed distance over the triangle, by a
//! pattern search in barycentric coordinates (Hooke & Jeeves 1961) with steps of 1/4 to 1/256 of an edge. For spheres and capsules, whose
//! distance is convex, that is the least of all; a field may have several dents. The work is bounded: at most 337 distances.

use glam::Vec3;

use super::{Meeting, Placed};

/// Parts of an edge that are told apart.
const PARTS: i32 = 256;
const FIRST_STEP: i32 = 64;
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
    const MIDDLE: Self = Self([86, 85, 85]);

    /// From the weights of the second and the third corner.
    pub(crate) fn from_weights(weights: [f32; 2]) -> Self {
        let [b, c] = weights.map(|weight| (weight * PARTS as f32) as i32);
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
    /// The point of a triangle that will be nearest to the instrument at the end of the step, and its meeting, from where its corners will be,
    /// m. None if that is not a number.
    pub(crate) fn meet_triangle(&self, corners: [Vec3; 3]) -> Option<(TrianglePoint, Meeting)> {
        let in_shape = corners.map(|corner| self.end.in_shape(corner));
        let gap = |point: TrianglePoint| self.instrument.shape.nearest(point.mean(in_shape)).0;
        let mut best = (gap(TrianglePoint::MIDDLE), TrianglePoint::MIDDLE);
        let mut step = FIRST_STEP;
        while step > 0 {
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
        Some((best.1, self.meet(best.1.mean(corners))?))
    }
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

    /// Against the least distance on a fine grid of points, for capsules that lie across, beside and on end.
    #[test]
    fn the_nearest_point_is_as_near_as_the_best_of_a_fine_grid() {
        let mut seed = 1u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32 - 0.5
        };
        let mut worst = 0.0f32;
        for _ in 0..300 {
            let corners = [(); 3].map(|()| Vec3::new(random(), random(), 0.3 * random()) * 0.01);
            let direction = [random(), random(), random()];
            let at = [0.01, 0.01, 0.003].map(|size| size * random());
            let capsule = Shape::Capsule { radius: 5e-4, length: 0.006 };
            let instrument = Instrument::resting(capsule, Pose::along(at, direction));
            let placed = Placed::new(&instrument, [0.0, 0.0]);
            let (_, found) = placed.meet_triangle(corners).expect("numbers");
            let mut least = f32::INFINITY;
            for b in 0..=100 {
                for c in 0..=100 - b {
                    let weights = [100 - b - c, b, c].map(|weight| weight as f32 / 100.0);
                    let point = (0..3).map(|corner| weights[corner] * corners[corner]).sum();
                    least = least.min(placed.meet(point).expect("a number").gap);
                }
            }
            worst = worst.max(found.gap - least);
        }
        println!("at most {:.2} um farther than the best of 5151 points", 1e6 * worst);
        assert!(worst < 2e-5, "{worst}");
    }
}
