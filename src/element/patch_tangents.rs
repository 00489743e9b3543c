//! What a coarse stiffness needs to know of the tangents of a tile of patches with nodal strain, as
//! [`super::tile_tangents`] has it of elements: without the stabilising energy, and without what that takes off the law.

use crate::material::{Law, LawState, Laws};
use crate::simd::{Gather, Kernel, Real, TILE};

use super::deformation::Deformation;
use super::patch::{Neighbours, PatchTile};
use super::patch_deformation::PatchDeformations;
use super::stiffness_bound::Coefficients;
use super::tile::vector_at;
use super::tile_tangents::{Tangent, TileTangents, WriteTangents};

pub struct PatchTangents<'a, L> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) tile: &'a PatchTile,
    pub(crate) neighbours: &'a [Neighbours],
    pub(crate) displacement: Gather<'a>,
    /// Factor of the tangents, s^2.
    pub(crate) weight: f32,
}

impl<L: Law> Kernel for PatchTangents<'_, L> {
    type Output = TileTangents;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> TileTangents {
        match R::COUNT {
            16 => all::<R, L, 1>(self),
            8 => all::<R, L, 2>(self),
            4 => all::<R, L, 4>(self),
            _ => all::<R, L, TILE>(self),
        }
    }
}

#[inline(always)]
fn all<R: Real, L: Law, const PARTS: usize>(kernel: PatchTangents<'_, L>) -> TileTangents {
    let PatchTangents { laws, tile, neighbours, displacement, weight } = kernel;
    let mut tangents = [Tangent::default(); TILE];
    let mut deformations = [Deformation::new([[R::splat(0.0); 3]; 3]); PARTS];
    R::run_piece(PatchDeformations { tile, neighbours, displacement, deformations: &mut deformations });
    for ((part, tangents), deformation) in tangents.chunks_exact_mut(R::COUNT).enumerate().zip(&deformations) {
        let first = part * R::COUNT;
        let law = laws.widen(|lane| tile.element(first + lane));
        let local = LawState::new::<L>(&law, deformation.invariants);
        let coefficients = &Coefficients::new::<L>(&law, &local);
        let weight = vector_at::<R>(&tile.volumes, first) * R::splat(weight);
        R::run_piece(WriteTangents { weight, deformation, coefficients, tangents });
    }
    tangents
}
