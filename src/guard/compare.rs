//! The distance between two runs of a body, and how far it has moved: means and maxima over the nodes, m.

use glam::Vec4;

use crate::simd::NodeVector;

/// What a comparison found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Comparison {
    /// Mean distance of the nodes, m.
    pub(super) mean: f32,
    /// The largest, m, and its node.
    pub(super) largest: f32,
    pub(super) node: u32,
    /// Mean displacement of the nodes, of the run that moved farther, m.
    pub(super) motion: f32,
}

/// Far enough that the square of no displacement is infinite.
const FAR: f32 = 1.0 / (1u128 << 70) as f32;

/// Compares the displacements (m) of so many nodes. What it finds is finite if they are.
pub(super) fn compare(nodes: usize, first: &[NodeVector], second: &[NodeVector]) -> Comparison {
    let near = scaled(1.0, nodes, first, second);
    if near.mean.is_finite() && near.largest.is_finite() && near.motion.is_finite() {
        return near;
    }
    // Squares overflow long before distances.
    let far = scaled(FAR, nodes, first, second);
    let [mean, largest] = [far.mean, far.largest].map(|length| finite(length / FAR));
    // Without a number nothing has moved: what is allowed is a share of the motion.
    let motion = finite((far.motion / FAR).max(0.0));
    Comparison { mean, largest, motion, ..far }
}

/// The mean length of so many vectors.
pub(super) fn mean_length(nodes: usize, vectors: &[NodeVector]) -> f32 {
    let lengths = vectors.iter().take(nodes).map(|vector| Vec4::from(vector.0).truncate().length());
    lengths.sum::<f32>() / nodes.max(1) as f32
}

/// The same, or the largest number instead of infinity or of what is no number, which are no reason to be content.
pub(super) const fn finite(value: f32) -> f32 {
    if value.is_nan() || value == f32::INFINITY { f32::MAX } else { value }
}

/// Compares displacements times `scale`.
fn scaled(scale: f32, nodes: usize, first: &[NodeVector], second: &[NodeVector]) -> Comparison {
    let axes = Vec4::new(scale, scale, scale, 0.0);
    let (mut sum, mut motions, mut largest, mut at) = (0.0, [0.0; 2], 0.0, 0);
    let pairs = first.iter().zip(second).take(nodes);
    for (node, (first, second)) in pairs.enumerate() {
        let (first, second) = (axes * Vec4::from(first.0), axes * Vec4::from(second.0));
        let square = (first - second).length_squared();
        sum += libm::sqrtf(square);
        motions[0] += first.length();
        motions[1] += second.length();
        if square > largest {
            (largest, at) = (square, node as u32);
        }
    }
    let share = 1.0 / nodes.max(1) as f32;
    Comparison {
        mean: share * sum,
        largest: libm::sqrtf(largest),
        node: at,
        motion: share * motions[0].max(motions[1]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_finite_where_their_squares_are_not() {
        for (far, expected) in [(1e30, 1e30), (3e38, f32::MAX)] {
            let first = [NodeVector([far, far, 0.0, 0.0]), NodeVector::ZERO];
            let second = [NodeVector([-far, far, 0.0, 0.0]), NodeVector::ZERO];
            let Comparison { mean, largest, node, motion } = compare(2, &first, &second);
            assert!((mean / expected - 1.0).abs() < 0.2 && largest.is_finite() && largest >= mean, "{mean}");
            assert!((motion / far - 0.5 * 2.0_f32.sqrt()).abs() < 1e-5 && node == 0, "{motion}");
        }
    }

    #[test]
    fn means_and_maxima_leave_out_the_fourth_component() {
        let first = [NodeVector([0.003, 0.0, 0.004, 9.0]), NodeVector([0.0, 0.001, 0.0, 7.0])];
        let second = [NodeVector([0.003, 0.0, 0.004, 1.0]), NodeVector([0.0, 0.004, 0.004, 2.0])];
        let Comparison { mean, largest, node, motion } = compare(2, &first, &second);
        assert!((mean - 0.0025).abs() < 1e-8 && (largest - 0.005).abs() < 1e-8 && node == 1);
        assert!((motion - 0.5 * (0.005 + 0.0056568)).abs() < 1e-7, "{motion}");
    }
}
