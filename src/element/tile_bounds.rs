//! Stiffness bounds of one tile of elements, in the frames of their first nodes: the matrices `D_a` go to the sums of
//! the nodes (N/m), what a coarse stiffness needs to know of each element comes back.

use crate::material::{Law, LawState, Laws};
use crate::simd::{Gather, Kernel, NodeVector, Piece, Real, ScatterBuffer, TILE, write_rows};

use super::deformation::{Deformation, Matrix};
use super::pressure::{MeanPressure, OwnPressure, Pressure, ReadTile};
use super::stiffness_bound::{Bound, Coefficients, MatrixSums};
use super::{ElementTile, VolumeRows};

/// A 3 x 3 matrix by rows.
pub(crate) type Rotation = [[f32; 3]; 3];

pub struct TileBounds<'a, L, P = OwnPressure> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) pressure: P,
    pub(crate) tile: &'a ElementTile,
    pub(crate) displacement: Gather<'a>,
    pub(crate) sums: MatrixSums<'a>,
    /// From the frame of each element's first node to the world.
    pub(crate) rotations: &'a [Rotation; TILE],
    /// Factor of the tangents, s^2; zero if nobody needs them.
    pub(crate) weight: f32,
}

impl<'a, L: Law> TileBounds<'a, L> {
    /// With the pressures that follow from the volumes of the nodes.
    pub(crate) fn with_nodal_volumes(self, rows: &'a [NodeVector]) -> TileBounds<'a, L, MeanPressure<'a>> {
        let Self { laws, tile, displacement, sums, rotations, weight, .. } = self;
        let pressure = MeanPressure::new(VolumeRows { rows, several_tissues: laws.has_several_tissues() });
        TileBounds { laws, pressure, tile, displacement, sums, rotations, weight }
    }
}

/// Bounds of the tangents of a tile's elements for the motion of a lattice, each in the frame of its first node.
pub struct TileTangents {
    /// Columns of the matrix that takes a material gradient to its image: of `F^-T`, or of `C` in a crushed element.
    pub(crate) columns: [[[f32; 4]; TILE]; 3],
    /// Factors with `weight V` (kg m^2): of the product of the gradients, of the outer product of the images, of that
    /// of the images exchanged; and one if the first is a product of images, zero if one of material gradients.
    pub(crate) factors: [[f32; 4]; TILE],
}

impl TileTangents {
    pub(super) const NONE: Self = Self { columns: [[[0.0; 4]; TILE]; 3], factors: [[0.0; 4]; TILE] };
}

/// Least volume ratio of an element that is not crushed.
const LEAST_VOLUME: f32 = 0.2;

impl<L: Law, P: Pressure> Kernel for TileBounds<'_, L, P> {
    type Output = TileTangents;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> TileTangents {
        let Self { laws, pressure, tile, displacement, mut sums, rotations, weight } = self;
        let mut tangents = TileTangents::NONE;
        let mut buffer = [ScatterBuffer::NONE; 2];
        for first in (0..TILE).step_by(R::COUNT) {
            // By reference: a copy would take a kilobyte of stack.
            let (deformation, change) = &R::run_piece(ReadTile::<R, P>::new(tile, first, displacement, pressure));
            let law = laws.widen(|lane| tile.element(first + lane));
            let local = LawState::with_volume_change::<L>(&law, deformation.invariants, *change);
            R::run_piece(AddBounds {
                tile,
                first,
                deformation,
                coefficients: &Coefficients::new::<L>(&law, &local),
                rotations,
                weight,
                sums: &mut sums,
                buffer: &mut buffer,
                tangents: &mut tangents,
            });
        }
        tangents
    }
}

/// The bounds of the elements from place `first` on.
pub(super) struct AddBounds<'a, 'b, R> {
    pub(super) tile: &'a ElementTile,
    pub(super) first: usize,
    pub(super) deformation: &'a Deformation<R>,
    pub(super) coefficients: &'a Coefficients<R>,
    pub(super) rotations: &'a [Rotation; TILE],
    pub(super) weight: f32,
    pub(super) sums: &'a mut MatrixSums<'b>,
    pub(super) buffer: &'a mut [ScatterBuffer<4>; 2],
    pub(super) tangents: &'a mut TileTangents,
}

impl<R: Real> Piece for AddBounds<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { tile, first, deformation, coefficients, rotations, weight, sums, buffer, tangents } = self;
        let bound = Bound::of(*coefficients, tile, first, deformation);
        let cofactor = cofactor_in_frames(rotations, first, deformation);
        sums.add(&bound, tile, first, &cofactor, buffer);
        if weight != 0.0 {
            let weight = tile.volume::<R>(first) * R::splat(weight);
            tangents.write(first, weight, &bound, deformation, &cofactor, None);
        }
    }
}

/// `C` in the frame of the first node of each element from place `first` on, or of the node of each patch.
#[inline(always)]
pub(super) fn cofactor_in_frames<R: Real>(
    rotations: &[Rotation; TILE],
    first: usize,
    deformation: &Deformation<R>,
) -> Matrix<R> {
    let mut cofactor = [[R::splat(0.0); 3]; 3];
    for i in 0..3 {
        for k in 0..3 {
            let along = R::from_fn(|lane| rotations[(first + lane) % TILE][k][i]);
            for j in 0..3 {
                cofactor[i][j] = cofactor[i][j] + along * deformation.cofactor(k, j);
            }
        }
    }
    cofactor
}

impl TileTangents {
    /// Writes the tangents from place `first` on, with `weight` (kg m^2 / Pa) as a factor, from their bounds and
    /// `cofactor`, `C` in the frames. For `modulus` see [`Bound::spatial`].
    #[inline(always)]
    pub(super) fn write<R: Real>(
        &mut self,
        first: usize,
        weight: R,
        bound: &Bound<R>,
        deformation: &Deformation<R>,
        cofactor: &Matrix<R>,
        modulus: Option<R>,
    ) {
        let (zero, one) = (R::splat(0.0), R::splat(1.0));
        let volume_ratio = one + deformation.invariants.j;
        let sound = volume_ratio - R::splat(LEAST_VOLUME);
        let spatial = bound.spatial(deformation, modulus);
        let half = R::splat(0.5) * spatial.shear;
        let factors = [
            weight * sound.choose(half + spatial.stress, bound.iso),
            weight * sound.choose(spatial.volume, bound.volume),
            weight * sound.choose(half, zero),
            sound.choose(one, zero),
        ];
        write_rows(&mut self.factors, first, factors);
        let scale = sound.choose(one.divide(volume_ratio), one);
        for (j, column) in self.columns.iter_mut().enumerate() {
            let [x, y, z] = cofactor.map(|row| scale * row[j]);
            write_rows(column, first, [x, y, z, zero]);
        }
    }
}
