//! What an element tells about itself, in float64: volume ratio, von Mises stress (Pa), strain energy (J).
//! For display and for the energy balance, not for the step.

use glam::{DMat3, DVec3};

use super::{ElementTile, VolumeRows};
#[cfg(feature = "std")]
use crate::material::Potential;
use crate::material::{Invariants, Law, energy_density, response};
use crate::simd::NodeVector;

/// State of one element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementFields {
    /// The mesh's number of the element.
    pub element: usize,
    /// Volume over volume at rest, `J`.
    pub volume_ratio: f64,
    /// Von Mises stress of the Cauchy stress `P F^T / J`, Pa; NaN for an element without positive volume.
    pub von_mises: f64,
    /// Strain energy, J.
    pub energy: f64,
}

/// Fields of the element at place `lane` of a tile, under the given displacements (m).
pub(crate) fn element_fields<L: Law>(
    law: &L,
    tile: &ElementTile,
    lane: usize,
    displacement: &[NodeVector],
) -> ElementFields {
    let at = |corner: usize| {
        let [x, y, z] = displacement.get(tile.node(corner, lane)).copied().unwrap_or_default().to_array();
        DVec3::new(f64::from(x), f64::from(y), f64::from(z))
    };
    let mut h = DMat3::ZERO;
    for corner in 0..3 {
        let gradient =
            DVec3::from_array([0, 1, 2].map(|axis| f64::from(tile.gradient::<f32>(corner, axis, lane))));
        let along = at(corner + 1) - at(0);
        h += DMat3::from_cols(along * gradient.x, along * gradient.y, along * gradient.z);
    }
    let f = DMat3::IDENTITY + h;
    let trace = h.x_axis.x + h.y_axis.y + h.z_axis.z;
    let square = h.x_axis.length_squared() + h.y_axis.length_squared() + h.z_axis.length_squared();
    // Sum of the principal minors of H, so that J - 1 keeps its digits at small strain.
    let minors = h.x_axis.x * h.y_axis.y - h.x_axis.y * h.y_axis.x + h.y_axis.y * h.z_axis.z
        - h.y_axis.z * h.z_axis.y
        + h.x_axis.x * h.z_axis.z
        - h.x_axis.z * h.z_axis.x;
    let (i, j) = (2.0 * trace + square, trace + minors + h.determinant());
    let energy = energy_density(law, i, j) * f64::from(tile.volume::<f32>(lane));

    // The deviator of P F^T needs only p1 F F^T: cof(F) F^T = J I.
    let wide = L::widen::<f32>(|_| *law);
    let p1 = f64::from(response::<f32, L>(&wide, Invariants { i: i as f32, j: j as f32 }).p1);
    let b = f * f.transpose();
    let mean = (b.x_axis.x + b.y_axis.y + b.z_axis.z) / 3.0;
    let deviator = b - DMat3::from_diagonal(DVec3::splat(mean));
    let square = deviator.x_axis.length_squared()
        + deviator.y_axis.length_squared()
        + deviator.z_axis.length_squared();
    let volume_ratio = 1.0 + j;
    let von_mises = if volume_ratio > 0.0 { p1 / volume_ratio * libm::sqrt(1.5 * square) } else { f64::NAN };
    ElementFields { element: tile.element(lane), volume_ratio, von_mises, energy }
}

/// Pressure at a corner of an element, Pa, positive where tissue is compressed: `-U'` at the volume ratio that its energy of
/// volume is taken at, the node's with nodal pressure ([`super::pressure`]) and the element's own in linear tetrahedra.
#[cfg(feature = "std")]
pub(crate) fn pressure_at<L: Law>(
    law: &L,
    tile: &ElementTile,
    lane: usize,
    corner: usize,
    volume_ratio: f64,
    volumes: Option<VolumeRows<'_>>,
) -> f64 {
    let own = (volume_ratio - 1.0) as f32;
    let change = volumes.and_then(|rows| rows.change(tile.node(corner, lane), tile.slot(corner, lane)));
    let change = change.unwrap_or(own);
    -f64::from(L::widen::<f32>(|_| *law).volume_slope(change))
}

/// What the energy (J) of an element changes by when its energy of volume is that of its nodes ([`super::pressure`]).
pub(crate) fn volume_energy_difference<L: Law>(
    law: &L,
    tile: &ElementTile,
    lane: usize,
    volume_ratio: f64,
    volumes: VolumeRows<'_>,
) -> f64 {
    let own = law.energy(0.0, volume_ratio - 1.0);
    let corners = (0..4).map(|corner| {
        let change = volumes.change(tile.node(corner, lane), tile.slot(corner, lane));
        change.map_or(0.0, |change| law.energy(0.0, f64::from(change)) - own)
    });
    0.25 * f64::from(tile.volume::<f32>(lane)) * corners.sum::<f64>()
}
