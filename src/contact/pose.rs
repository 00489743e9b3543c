//! Where an instrument is: position (m) and rotation, and its way from one pose to another.

use glam::{Quat, Vec3};

/// Position and rotation of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Of its centre, m.
    pub position: [f32; 3],
    /// Unit quaternion `x, y, z, w`: it turns the axes of the shape into those of the scene. Any length but zero will
    /// do.
    pub rotation: [f32; 4],
}

impl Pose {
    /// Not turned.
    #[must_use]
    pub const fn at(position: [f32; 3]) -> Self {
        Self { position, rotation: [0.0, 0.0, 0.0, 1.0] }
    }

    /// With the shape's `z` axis along `direction`, not turned if that is zero.
    #[must_use]
    pub fn along(position: [f32; 3], direction: [f32; 3]) -> Self {
        match Vec3::from_array(direction).try_normalize() {
            Some(unit) => Self { position, rotation: Quat::from_rotation_arc(Vec3::Z, unit).to_array() },
            None => Self::at(position),
        }
    }

    /// Numbers, and a rotation that has a length.
    pub(super) fn is_valid(&self) -> bool {
        let square = Quat::from_array(self.rotation).length_squared();
        self.position.iter().all(|component| component.is_finite()) && square.is_finite() && square > 1e-12
    }
}

/// A pose as the step uses it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    pub(super) position: Vec3,
    pub(super) rotation: Quat,
}

impl Placement {
    /// The pose after this share of the way: positions on a line, rotations on the shorter arc.
    pub(super) fn between(from: &Pose, to: &Pose, share: f32) -> Self {
        let [a, b] = [from, to].map(|pose| Quat::from_array(pose.rotation).normalize());
        let [start, end] = [from, to].map(|pose| Vec3::from_array(pose.position));
        let b = if a.dot(b) < 0.0 { -b } else { b };
        // Exact at both ends, where a difference would round.
        let position = start * (1.0 - share) + end * share;
        // Without rounding where it does not turn.
        let rotation = if a == b { a } else { (a * (1.0 - share) + b * share).normalize() };
        Self { position, rotation }
    }

    /// A point of the scene in the axes of the shape.
    pub(super) fn in_shape(&self, point: Vec3) -> Vec3 {
        self.rotation.inverse() * (point - self.position)
    }

    /// A direction of the shape in the axes of the scene.
    pub(super) fn turned(&self, direction: Vec3) -> Vec3 {
        self.rotation * direction
    }
}
