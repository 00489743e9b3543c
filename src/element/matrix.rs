//! Products and the cofactors of 3 x 3 matrices in float64, for tools, tests and pictures.

use glam::{DMat3, DVec3};

/// `a b^T`.
pub(crate) fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// `A:B`.
#[cfg(feature = "std")]
pub(crate) fn inner(a: DMat3, b: DMat3) -> f64 {
    a.x_axis.dot(b.x_axis) + a.y_axis.dot(b.y_axis) + a.z_axis.dot(b.z_axis)
}

/// The cofactor matrix, quadratic in `f`: a central difference of it is its exact derivative.
pub(crate) fn cofactor(f: DMat3) -> DMat3 {
    DMat3::from_cols(f.y_axis.cross(f.z_axis), f.z_axis.cross(f.x_axis), f.x_axis.cross(f.y_axis))
}
