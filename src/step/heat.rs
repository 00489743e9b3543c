//! What rounding of the displacements (m) gives to vibrations, J. Forces at a displacement that is wrong by half the
//! distance of two floats are wrong by that times the stiffness: a noise that is another in each step of a moving node.
//! In a step of `dt` it changes velocities by some `2^-24 u / dt` where the step is near the critical one, so that
//!
//! ```text
//! n sum_a m_a / 2 (2^-24 u_a / dt)^2
//! ```
//! collects in `n` steps, as many as damping lets act together. It is little in soft tissue, but a free and undamped
//! fragment of cartilage that a small force moves by 4 mm in two million steps has several times the energy of its
//! drift. Forces at displacements with their remainders ([`super::moved`]) leave nothing of it. They take longer, so
//! that they are computed only where the noise could be told from an inexact step.

use glam::Vec4;

use crate::element::NodeInertia;
use crate::simd::NodeVector;

use super::Step;

/// Steps from one estimate to the next.
pub(super) const EVERY: u64 = 64;
/// The most that act together, without damping.
const MOST_STEPS: f64 = 1e6;
/// Relative rounding of a float.
const ROUNDING: f64 = 1.0 / (1 << 24) as f64;

/// The estimate, more rather than less.
pub(super) fn of_rounding(step: &Step, inertia: &[NodeInertia], displacement: &[NodeVector]) -> f64 {
    let mut sum = Vec4::ZERO;
    for (inertia, displacement) in inertia.iter().zip(displacement) {
        let at = Vec4::from(displacement.0);
        sum += inertia.mass * (at * at);
    }
    let [x, y, z, _] = sum.to_array().map(f64::from);
    let [seconds, damping] = [step.seconds(), step.damping()].map(f64::from);
    let speed = ROUNDING / seconds;
    0.5 * (x + y + z) * speed * speed * MOST_STEPS.min(1.0 / (2.0 * damping * seconds))
}
