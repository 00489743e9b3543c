//! What an element tells about itself, in float64: volume ratio, von Mises stress (Pa); and its strain energy (J).
//! For display and for the energy balance, not for the step.

use glam::{DMat3, DVec3};

use super::barrier;
use super::patch_forces::STABILISATION;
use super::{ElementTile, Fibrous, PatchTile, Patches, Remembered, VolumeRows};
use crate::material::{Invariants, Law, Potential, energy_density, response};
use crate::simd::NodeVector;

/// State of one element, of its own deformation: also with nodal strain, whose forces follow from the means around the
/// nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementFields {
    /// The mesh's number of the element.
    pub element: usize,
    /// Volume over volume at rest, `J`.
    pub volume_ratio: f64,
    /// Von Mises stress of the Cauchy stress `P F^T / J`, Pa; NaN for an element without positive volume. That of the law:
    /// tissue that relaxes has less.
    pub von_mises: f64,
}

/// The displacement gradient of the element at place `lane` of a tile, from the displacements of nodes.
fn gradient_of(tile: &ElementTile, lane: usize, at: impl Fn(usize) -> DVec3) -> DMat3 {
    let mut h = DMat3::ZERO;
    for corner in 0..3 {
        let gradient = DVec3::from_array([0, 1, 2].map(|axis| f64::from(tile.gradient_of(corner, axis, lane))));
        let along = at(tile.node(corner + 1, lane)) - at(tile.node(0, lane));
        h += DMat3::from_cols(along * gradient.x, along * gradient.y, along * gradient.z);
    }
    h
}

/// `I1 - 3`, `J - 1` and `H:H` of a displacement gradient `H`.
pub(crate) fn invariants(h: DMat3) -> (f64, f64, f64) {
    let trace = h.x_axis.x + h.y_axis.y + h.z_axis.z;
    let square = h.x_axis.length_squared() + h.y_axis.length_squared() + h.z_axis.length_squared();
    // Sum of the principal minors of H, so that J - 1 keeps its digits at small strain.
    let minors = h.x_axis.x * h.y_axis.y - h.x_axis.y * h.y_axis.x + h.y_axis.y * h.z_axis.z - h.y_axis.z * h.z_axis.y
        + h.x_axis.x * h.z_axis.z
        - h.x_axis.z * h.z_axis.x;
    (2.0 * trace + square, trace + minors + h.determinant(), square)
}

/// Displacements of nodes, m.
fn displacements(vectors: &[NodeVector]) -> impl Fn(usize) -> DVec3 {
    |node| DVec3::from_array(vectors.get(node).copied().unwrap_or_default().to_array().map(f64::from))
}

/// What adds to the energy of a law.
#[derive(Clone, Copy)]
pub(crate) struct MoreEnergy<'a> {
    /// The fibres, if there are any.
    pub(crate) fibres: Option<Fibrous<'a>>,
    /// What tissue that relaxes remembers.
    pub(crate) remembered: Option<Remembered<'a>>,
}

impl MoreEnergy<'_> {
    /// The density of the energy of what is at a place of a tile and belongs to a mesh element, at a displacement gradient
    /// with these [`invariants`], J/m^3.
    fn density<L: Law>(&self, law: &L, place: [usize; 2], element: usize, h: DMat3, [i, j]: [f64; 2]) -> f64 {
        let of_fibres = self.fibres.map_or(0.0, |fibres| fibres.energy_density(place, element, h));
        let of_past = self.remembered.map_or(0.0, |of| of.energy_density(law, place, element, h, self.fibres));
        energy_density(law, i, j) + of_fibres + of_past
    }
}

/// Strain energy of an element, J, with the volumes of its nodes if it has nodal pressure.
pub(crate) fn element_energy<L: Law>(
    law: &L,
    (tile, place): (&ElementTile, [usize; 2]),
    displacement: &[NodeVector],
    volumes: Option<VolumeRows<'_>>,
    more: MoreEnergy<'_>,
) -> f64 {
    let [_, lane] = place;
    let h = gradient_of(tile, lane, displacements(displacement));
    let (i, j, _) = invariants(h);
    let of_nodes = volumes.map_or(0.0, |volumes| volume_energy_difference(law, tile, lane, j, volumes));
    more.density(law, place, tile.element(lane), h, [i, j]) * f64::from(tile.volume::<f32>(lane)) + of_nodes
}

/// Volume over volume at rest of the element at place `lane` of a tile, under the given displacements (m).
#[cfg(feature = "std")]
pub(crate) fn volume_ratio(tile: &ElementTile, lane: usize, displacement: &[NodeVector]) -> f64 {
    1.0 + invariants(gradient_of(tile, lane, displacements(displacement))).1
}

/// Fields of the element at place `lane` of a tile, under the given displacements (m), and with a stress `F B F^T` (Pa)
/// that fibres add in it at a displacement gradient.
pub(crate) fn element_fields<L: Law>(
    law: &L,
    tile: &ElementTile,
    lane: usize,
    displacement: &[NodeVector],
    of_fibres: impl Fn(DMat3) -> DMat3,
) -> ElementFields {
    let h = gradient_of(tile, lane, displacements(displacement));
    let f = DMat3::IDENTITY + h;
    let (i, j, _) = invariants(h);

    // The deviator of P F^T needs only p1 F F^T: cof(F) F^T = J I.
    let wide = law.splat::<f32>();
    let p1 = f64::from(response::<f32, L>(&wide, Invariants { i: i as f32, j: j as f32 }).p1);
    let b = f * f.transpose() * p1 + of_fibres(h);
    let mean = (b.x_axis.x + b.y_axis.y + b.z_axis.z) / 3.0;
    let deviator = b - DMat3::from_diagonal(DVec3::splat(mean));
    let square = deviator.x_axis.length_squared() + deviator.y_axis.length_squared() + deviator.z_axis.length_squared();
    let volume_ratio = 1.0 + j;
    let von_mises = if volume_ratio > 0.0 { libm::sqrt(1.5 * square) / volume_ratio } else { f64::NAN };
    ElementFields { element: tile.element(lane), volume_ratio, von_mises }
}

/// Pressure at a corner of an element, Pa, positive where tissue is compressed: `-U'` at the volume ratio that its
/// energy of volume is taken at, the node's with nodal pressure ([`super::pressure`]) and the element's own in linear
/// tetrahedra.
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
    -f64::from(law.splat::<f32>().bulk_modulus() * change)
}

/// What the energy (J) of an element changes by when its energy of volume is that of its nodes ([`super::pressure`]).
fn volume_energy_difference<L: Law>(
    law: &L,
    tile: &ElementTile,
    lane: usize,
    own_change: f64,
    volumes: VolumeRows<'_>,
) -> f64 {
    let own = law.energy(0.0, own_change);
    let corners = (0..4).map(|corner| {
        let change = volumes.change(tile.node(corner, lane), tile.slot(corner, lane));
        change.map_or(0.0, |change| law.energy(0.0, f64::from(change)) - own)
    });
    0.25 * f64::from(tile.volume::<f32>(lane)) * corners.sum::<f64>()
}

/// Modulus of the stabilising energy of nodal strain, `s mu`, Pa, with the shear modulus `mu = 2 W'(0)` at rest.
pub(crate) fn stabilising_modulus<L: Law>(law: &L) -> f64 {
    2.0 * f64::from(STABILISATION) * f64::from(law.splat::<f32>().distortion_slope(0.0))
}

/// What a patch adds to the strain energy of tetrahedra with nodal strain, J ([`super::patch_forces`]).
pub(crate) fn patch_energy<L: Law>(
    law: &L,
    patches: Patches<'_>,
    (tile, place): (&PatchTile, [usize; 2]),
    displacement: &[NodeVector],
    more: MoreEnergy<'_>,
) -> f64 {
    let [_, lane] = place;
    let h = tile.gradient(patches.neighbours_of(tile), lane, displacements(displacement));
    let (i, j, square) = invariants(h);
    let modulus = stabilising_modulus(law) * stays(more.remembered, tile.element(lane));
    tile.volume(lane) * (more.density(law, place, tile.element(lane), h, [i, j]) - 0.5 * modulus * square)
}

/// What an element adds to it, J: where it is crushed also the energy of [`super::barrier`].
pub(crate) fn stabilising_energy<L: Law>(
    law: &L,
    tile: &ElementTile,
    lane: usize,
    displacement: &[NodeVector],
    remembered: Option<Remembered<'_>>,
) -> f64 {
    let modulus = stabilising_modulus(law) * stays(remembered, tile.element(lane));
    let (i, j, square) = invariants(gradient_of(tile, lane, displacements(displacement)));
    f64::from(tile.volume::<f32>(lane)) * (0.5 * modulus * square + barrier::energy_density(law, i, j))
}

/// The share of the stabilising modulus that stays.
fn stays(remembered: Option<Remembered<'_>>, element: usize) -> f64 {
    remembered.map_or(1.0, |of| of.series.stabilising(element).into())
}
