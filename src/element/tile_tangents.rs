//! What a coarse stiffness needs to know of the tangents of a tile of elements: bounds that rotations do not feel
//! ([`super::stiffness_bound`]).

use bytemuck::{Pod, Zeroable};

use crate::material::{Law, LawState, Laws};
use crate::simd::{Gather, Kernel, NodeVector, Piece, Real, TILE};

use super::deformation::Deformation;
use super::pressure::{MeanPressure, OwnPressure, Pressure, ReadTile};
use super::stiffness_bound::{Coefficients, spatial_bound};
use super::{ElementTile, VolumeRows};

pub struct ElementTangents<'a, L, P = OwnPressure> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) pressure: P,
    pub(crate) tile: &'a ElementTile,
    pub(crate) displacement: Gather<'a>,
    /// Factor of the tangents, s^2.
    pub(crate) weight: f32,
}

impl<'a, L: Law> ElementTangents<'a, L> {
    /// With the pressures that follow from the volumes of the nodes.
    pub(crate) fn with_nodal_volumes(self, rows: &'a [NodeVector]) -> ElementTangents<'a, L, MeanPressure<'a>> {
        let Self { laws, tile, displacement, weight, .. } = self;
        let pressure = MeanPressure::new(VolumeRows { rows, several_tissues: laws.has_several_tissues() });
        ElementTangents { laws, pressure, tile, displacement, weight }
    }
}

/// The bound of the tangent of an element, or of a patch with nodal strain, for the motion of a lattice.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Tangent {
    /// Columns of the matrix that takes a material gradient to its image: of `F^-T`, or of `C` in a crushed element.
    pub(crate) columns: [[f32; 4]; 3],
    /// Factors with `weight V` (kg m^2): of the product of the gradients, of the outer product of the images, of that
    /// of the images exchanged; and one if the first is a product of images, zero if one of material gradients.
    pub(crate) factors: [f32; 4],
}

/// Those of a tile.
pub(crate) type TileTangents = [Tangent; TILE];

/// Least volume ratio of an element that is not crushed.
const LEAST_VOLUME: f32 = 0.2;

impl<L: Law, P: Pressure> Kernel for ElementTangents<'_, L, P> {
    type Output = TileTangents;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> TileTangents {
        let Self { laws, pressure, tile, displacement, weight } = self;
        let mut tangents = [Tangent::default(); TILE];
        for first in (0..TILE).step_by(R::COUNT) {
            // By reference: a copy would take a kilobyte of stack.
            let (deformation, change) = &R::run_piece(ReadTile::<R, P>::new(tile, first, displacement, pressure));
            let law = laws.widen(|lane| tile.element(first + lane));
            let local = LawState::with_volume_change::<L>(&law, deformation.invariants, *change);
            let coefficients = &Coefficients::new::<L>(&law, &local);
            let weight = tile.volume::<R>(first) * R::splat(weight);
            let tangents = tangents.get_mut(first..first + R::COUNT).unwrap_or_default();
            R::run_piece(WriteTangents { weight, deformation, coefficients, tangents });
        }
        tangents
    }
}

/// Writes the tangents of a vector of elements or patches.
pub(super) struct WriteTangents<'a, R> {
    /// kg m^2 / Pa.
    pub(super) weight: R,
    pub(super) deformation: &'a Deformation<R>,
    pub(super) coefficients: &'a Coefficients<R>,
    pub(super) tangents: &'a mut [Tangent],
}

impl<R: Real> Piece for WriteTangents<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { weight, deformation, coefficients, tangents } = self;
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let volume_ratio = one + deformation.invariants.j;
        let sound = volume_ratio - R::splat(LEAST_VOLUME);
        let spatial = spatial_bound(coefficients, deformation);
        let (iso, volume) = coefficients.bound(deformation);
        let half = R::splat(0.5) * spatial.shear;
        let factors = [
            weight * sound.choose(half + spatial.stress, iso),
            weight * sound.choose(spatial.volume, volume),
            weight * sound.choose(half, zero),
            sound.choose(one, zero),
        ];
        R::to_rows(factors, |lane, factors| {
            if let Some(tangent) = tangents.get_mut(lane) {
                tangent.factors = factors;
            }
        });
        let scale = sound.choose(one.divide(volume_ratio), one);
        for column in 0..3 {
            let image = [0, 1, 2].map(|row| scale * deformation.cofactor(row, column));
            R::to_rows([image[0], image[1], image[2], zero], |lane, image| {
                if let Some(tangent) = tangents.get_mut(lane) {
                    tangent.columns[column] = image;
                }
            });
        }
    }
}
