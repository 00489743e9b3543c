//! Shapes of rigid instruments, as the distance from a point to their surface (m, negative inside) and the normal
//! there.

use glam::Vec3;

use super::field::Field;

/// The shape of an instrument, in its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape<'a> {
    /// All that is below `z = 0`: a table, a plate that is larger than the body.
    Plane,
    /// A ball around the centre.
    Sphere {
        /// m.
        radius: f32,
    },
    /// A cylinder along `z` with round ends: a needle's shaft, an endoscope, a finger.
    Capsule {
        /// m.
        radius: f32,
        /// Of the cylinder between the centres of the ends, m.
        length: f32,
    },
    /// Any form.
    Field(Field<'a>),
}

impl Shape<'_> {
    /// The first size that is not one.
    pub(super) fn refused_size(&self) -> Option<(&'static str, f32)> {
        let positive = |name, value: f32| (!(value.is_finite() && value > 0.0)).then_some((name, value));
        match *self {
            Self::Plane | Self::Field(_) => None,
            Self::Sphere { radius } => positive("radius", radius),
            Self::Capsule { radius, length } => positive("radius", radius).or_else(|| positive("length", length)),
        }
    }

    /// How far it may move in one step, m: farther, and tissue could be on its other side.
    #[must_use]
    pub fn thickness(&self) -> f32 {
        match *self {
            Self::Plane => f32::INFINITY,
            Self::Sphere { radius } | Self::Capsule { radius, .. } => radius,
            Self::Field(field) => field.deepest(),
        }
    }

    /// The largest distance of a point of it from its centre, m.
    pub(super) fn extent(&self) -> f32 {
        match *self {
            Self::Plane => f32::INFINITY,
            Self::Sphere { radius } => radius,
            Self::Capsule { radius, length } => radius + 0.5 * length,
            Self::Field(field) => field.extent(),
        }
    }

    /// How much nearer than its distance tells a point may be, m: the error of interpolation between the points of a
    /// grid.
    pub(super) fn uncertainty(&self) -> f32 {
        if let Self::Field(field) = self { 2.0 * field.spacing() } else { 0.0 }
    }

    /// A number that tells it from other shapes and sizes.
    pub(super) fn number(&self) -> u32 {
        match *self {
            Self::Plane => 1,
            Self::Sphere { radius } => radius.to_bits(),
            Self::Capsule { radius, length } => radius.to_bits().rotate_left(7) ^ length.to_bits() ^ 2,
            Self::Field(field) => field.number(),
        }
    }

    /// Distance of a point, m, and the outward normal of the surface that is nearest to it.
    pub(super) fn nearest(&self, point: Vec3) -> (f32, Vec3) {
        match *self {
            Self::Plane => (point.z, Vec3::Z),
            Self::Sphere { radius } => around(point, radius),
            Self::Capsule { radius, length } => {
                let half = 0.5 * length;
                around(point - Vec3::Z * point.z.max(-half).min(half), radius)
            }
            Self::Field(field) => field.nearest(point),
        }
    }
}

/// Distance and normal of a ball around the origin; at its centre any normal is right.
fn around(point: Vec3, radius: f32) -> (f32, Vec3) {
    let length = point.length();
    (length - radius, if length > 0.0 { point / length } else { Vec3::X })
}
