//! Pushes of instruments on many nodes and points of triangles that move each other, as in steps with a lattice. With
//! the compliance `B` (m/N, symmetric and positive), the pushes `p` (N), and where the nodes would be relative to the
//! instruments without a change of them, `r` (m):
//!
//! ```text
//! minimise 1/2 dp^T B dp + r^T dp    with  p_n >= 0,  |p_t| <= mu p_n
//! ```
//! by accelerated projected gradients (Mazhar et al. 2015) from the pushes of the step before, a bounded number of
//! times. Each node has a scale, the inverse root of its own compliance, so that light and heavy nodes converge alike.
//! The cone of friction is taken at the present `p_n`, so that a node that slips is not lifted.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::triangle::TrianglePoint;

/// Iterations, and those that estimate the largest eigenvalue before. With 14, where an instrument holds 45 nodes or presses
/// 121, what was left of each step's error kept tissue in motion for good (0.15 mm and 30 mm/s; 30 iterations: 4e-6 mm).
const ITERATIONS: usize = 40;
const POWER_ITERATIONS: usize = 5;
/// The estimate is from below.
const SAFETY: f32 = 1.15;
/// They end earlier where one changes the scaled pushes by less than this share, squared.
const SETTLED: f32 = 1e-10;

/// The friction of a node that an instrument holds: any push will do.
pub(crate) const HELD: f32 = f32::INFINITY;

/// A node, or a point of a triangle, that may touch an instrument in this step.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct TouchedPoint {
    /// Force of the instrument, N.
    pub(crate) push: [f32; 3],
    /// Its place in the surface.
    pub(crate) place: u32,
    pub(crate) normal: [f32; 3],
    /// Distance without a change of the pushes, m.
    pub(crate) gap: f32,
    /// Position relative to where it should be: distance along the normal, slip across, m.
    pub(crate) relative: [f32; 3],
    /// Square root of an inverse compliance, (N/m)^(1/2).
    pub(crate) scale: f32,
    /// The vector that the compliance is applied to, N; later the motion, m.
    pub(crate) vector: [f32; 3],
    pub(crate) instrument: u32,
    /// The push of the iteration with momentum.
    pub(crate) ahead: [f32; 3],
    pub(crate) friction: f32,
    /// The push of the step before, N.
    pub(crate) before: [f32; 3],
    /// The corners of the triangle; the node three times.
    pub(crate) nodes: [u32; 3],
    /// Weights of the second and the third one.
    pub(crate) weights: [f32; 2],
}

/// How nodes move by pushes.
pub(crate) trait Compliance {
    /// Replaces the vector of each node (N) by its motion (m).
    fn apply(&mut self, nodes: &mut [TouchedPoint]);
}

impl TouchedPoint {
    /// The point of the triangle.
    pub(crate) fn point(&self) -> TrianglePoint {
        TrianglePoint::from_weights(self.weights)
    }

    pub(crate) fn set_point(&mut self, point: TrianglePoint) {
        let [_, b, c] = point.weights();
        self.weights = [b, c];
    }

    /// The weights of its corners.
    pub(crate) fn shares(&self) -> [f32; 3] {
        let [b, c] = self.weights;
        [1.0 - b - c, b, c]
    }

    /// The nodes that a push moves, with their weights.
    pub(crate) fn corners(&self) -> impl Iterator<Item = (usize, f32)> + use<> {
        // Where only the first one has weight, the others are not even read.
        let count = if self.weights == [0.0; 2] { 1 } else { 3 };
        self.nodes.into_iter().zip(self.shares()).take(count).map(|(node, weight)| (node as usize, weight))
    }

    /// The corner that is nearest.
    pub(crate) fn node(&self) -> u32 {
        let ([x, y, z], [a, b, c]) = (self.nodes, self.shares());
        if a >= b && a >= c {
            x
        } else if b >= c {
            y
        } else {
            z
        }
    }

    /// The nearest push that an instrument can exert, N.
    pub(crate) fn projected(&self, push: Vec3) -> Vec3 {
        if self.friction == HELD {
            return push;
        }
        let normal = Vec3::from_array(self.normal);
        let pressing = push.dot(normal);
        if pressing.is_nan() || pressing <= 0.0 {
            return Vec3::ZERO;
        }
        let along = push - pressing * normal;
        let (length, most) = (along.length(), self.friction * pressing);
        pressing * normal + if length > most { along * (most / length) } else { along }
    }
}

/// Directions that together span all: the normal, and two across.
pub(crate) fn directions(normal: Vec3) -> [Vec3; 3] {
    let (a, b) = normal.any_orthonormal_pair();
    [normal, a, b]
}

/// A start of the power iteration that has some of every motion, those across the normals too.
fn start(index: usize, normal: Vec3) -> Vec3 {
    let [normal, a, b] = directions(normal);
    let turn = index as f32;
    normal + 0.7 * (libm::cosf(turn) * a + libm::sinf(turn) * b) + 0.3 * a
}

/// Solves for the pushes.
pub(crate) fn solve(nodes: &mut [TouchedPoint], compliance: &mut impl Compliance) {
    let mut largest = 0.0;
    for (index, node) in nodes.iter_mut().enumerate() {
        node.ahead = start(index, Vec3::from_array(node.normal)).to_array();
    }
    for _ in 0..POWER_ITERATIONS {
        let mut square = 0.0;
        for node in &mut *nodes {
            square += Vec3::from_array(node.ahead).length_squared();
            node.vector = (Vec3::from_array(node.ahead) * node.scale).to_array();
        }
        compliance.apply(nodes);
        let mut image = 0.0;
        for node in &mut *nodes {
            let moved = Vec3::from_array(node.vector) * node.scale;
            image += moved.length_squared();
            node.ahead = moved.to_array();
        }
        let growth = libm::sqrtf(image / square);
        if !growth.is_finite() || growth <= 0.0 {
            return;
        }
        largest = growth.max(largest);
        let inverse = 1.0 / libm::sqrtf(image);
        for node in &mut *nodes {
            node.ahead = (Vec3::from_array(node.ahead) * inverse).to_array();
        }
    }
    let rate = 1.0 / (SAFETY * largest);
    for node in &mut *nodes {
        node.ahead = node.push;
    }
    let mut theta = 1.0f32;
    for _ in 0..ITERATIONS {
        for node in &mut *nodes {
            node.vector = (Vec3::from_array(node.ahead) - Vec3::from_array(node.before)).to_array();
        }
        compliance.apply(nodes);
        let next = 0.5 * theta * (libm::sqrtf(theta * theta + 4.0) - theta);
        let momentum = theta * (1.0 - theta) / (theta * theta + next);
        let (mut uphill, mut changed, mut all) = (0.0, 0.0, 0.0);
        for node in &mut *nodes {
            let slope = Vec3::from_array(node.vector) + Vec3::from_array(node.relative);
            let ahead = Vec3::from_array(node.ahead);
            let push = node.projected(ahead - slope * (rate * node.scale * node.scale));
            let change = push - Vec3::from_array(node.push);
            uphill += slope.dot(change);
            let weight = 1.0 / (node.scale * node.scale);
            changed += weight * change.length_squared();
            all += weight * push.length_squared();
            node.push = push.to_array();
            node.ahead = (push + momentum * change).to_array();
        }
        if changed <= SETTLED * all {
            return;
        }
        // Momentum that leads uphill begins anew (O'Donoghue & Candes 2015).
        theta = next;
        if uphill > 0.0 {
            theta = 1.0;
            for node in &mut *nodes {
                node.ahead = node.push;
            }
        }
    }
}
