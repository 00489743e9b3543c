//! The force on an instrument between two frames, for a host's haptic loop: `f(x) = f0 + K (x - x0)` with the position
//! `x0` and the force `f0` of the latest frame, and a stiffness `K` that follows the frames by symmetric secant updates
//! (Powell 1970):
//!
//! ```text
//! r = df - K dx,   K <- K + (r dx^T + dx r^T) / dx^2 - (r dx) dx dx^T / dx^4
//! ```
//! It keeps no more than it has seen: along directions in which the instrument has not moved yet, `K` is zero. Each
//! frame tells how far the prediction was off.

use glam::{Mat3, Vec3};

/// Motions below it tell nothing of a stiffness, m.
const LEAST_MOTION: f32 = 1e-6;

/// Force and stiffness at an instrument.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct LocalForce {
    /// Position of the instrument in the latest frame, m.
    pub position: [f32; 3],
    /// Force of the tissue on the instrument there, N.
    pub force: [f32; 3],
    /// Its change with the position, N/m, symmetric.
    pub stiffness: [[f32; 3]; 3],
    /// How far the force that was predicted for the latest frame was off, N.
    pub error: f32,
    /// How far off it would have been to hold the force of the frame before, N.
    pub hold_error: f32,
}

impl LocalForce {
    /// Before the first frame.
    pub const NEW: Self =
        Self { position: [0.0; 3], force: [0.0; 3], stiffness: [[0.0; 3]; 3], error: 0.0, hold_error: 0.0 };

    /// Takes the position (m) and the force (N) of a new frame ([`Touch::force`](super::Touch::force)). Without a force
    /// all is forgotten.
    pub fn follow(&mut self, position: [f32; 3], force: [f32; 3]) {
        let (here, now) = (Vec3::from_array(position), Vec3::from_array(force));
        let before = Vec3::from_array(self.force);
        let error = Vec3::from_array(self.at(position)).distance(now);
        let hold_error = before.distance(now);
        let mut stiffness = Mat3::from_cols_array_2d(&self.stiffness);
        let motion = here - Vec3::from_array(self.position);
        if now == Vec3::ZERO || before == Vec3::ZERO {
            // The force began or ended within the frame.
            stiffness = Mat3::ZERO;
        } else if motion.length() > LEAST_MOTION {
            let mut change = now - before;
            let square = motion.length_squared();
            // A spring answers against its motion.
            change -= motion * (change.dot(motion).max(0.0) / square);
            let rest = (change - stiffness * motion) / square;
            let outer = |a: Vec3, b: Vec3| Mat3::from_cols(a * b.x, a * b.y, a * b.z);
            stiffness += outer(rest, motion) + outer(motion, rest);
            stiffness -= outer(motion, motion) * (rest.dot(motion) / square);
        }
        *self = Self { position, force, stiffness: stiffness.to_cols_array_2d(), error, hold_error };
    }

    /// The force (N) at a position (m) before the next frame. Zero where it would pull.
    #[must_use]
    pub fn at(&self, position: [f32; 3]) -> [f32; 3] {
        let force = Vec3::from_array(self.force);
        let motion = Vec3::from_array(position) - Vec3::from_array(self.position);
        let there = force + Mat3::from_cols_array_2d(&self.stiffness) * motion;
        if there.dot(force) > 0.0 { there.to_array() } else { [0.0; 3] }
    }
}
