//! Stiffness bounds of one tile of patches with nodal strain, as [`super::tile_bounds`] has them of elements: matrices
//! `D_b` of the nodes (N/m), in the frames of the patches' own nodes, and what a coarse stiffness needs to know of each
//! patch. With `dF_a = sum_b v_b (c_ab / V_a)^T` the bound of [`super::stiffness_bound`] gives, by Cauchy-Schwarz,
//!
//! ```text
//! D_b = (iso |c_ab| sum_d |c_ad| I + volume (sum_d |C c_ad|) (C c_ab)(C c_ab)^T / |C c_ab|) / V_a
//! ```
//! and the own node gets `s mu sum_b (k_ab + |k_ab|) I` from the stabilising energy, the sum of the absolute values of
//! its row. That energy is not in the tangents, as it does not change with the state.

use crate::material::{Law, LawState, Laws};
use crate::simd::{Gather, Kernel, Piece, Real, ScatterBuffer, TILE, dot};

use super::deformation::{Deformation, Matrix, Vector};
use super::patch::{Neighbours, PatchTile};
use super::patch_deformation::{GradientLengths, PatchDeformations};
use super::patch_forces::modulus_of;
use super::stiffness_bound::{Bound, Coefficients, MatrixSums};
use super::tile::vector_at;
use super::tile_bounds::{Rotation, TileTangents, cofactor_in_frames};

pub struct PatchTileBounds<'a, L> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) tile: &'a PatchTile,
    pub(crate) neighbours: &'a [Neighbours],
    pub(crate) displacement: Gather<'a>,
    pub(crate) sums: MatrixSums<'a>,
    /// From the frame of each patch's node to the world.
    pub(crate) rotations: &'a [Rotation; TILE],
    /// Factor of the tangents, s^2; zero if nobody needs them.
    pub(crate) weight: f32,
}

impl<L: Law> Kernel for PatchTileBounds<'_, L> {
    type Output = TileTangents;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> TileTangents {
        match R::COUNT {
            16 => bound_all::<R, L, 1>(self),
            8 => bound_all::<R, L, 2>(self),
            4 => bound_all::<R, L, 4>(self),
            _ => bound_all::<R, L, TILE>(self),
        }
    }
}

/// What the nodes of a vector of patches get.
#[derive(Clone, Copy)]
struct Shares<R> {
    deformation: Deformation<R>,
    coefficients: Coefficients<R>,
    /// Of the stabilising energy, Pa.
    modulus: R,
    /// `C` in the frames.
    cofactor: Matrix<R>,
    /// Factors of `|c_ab|` and of the outer product of `C c_ab` over its length, and of `|c_ab|` in the scalar bound,
    /// N/m^3.
    isotropic: R,
    volume: R,
    scalar: R,
    /// Gradient of the own node (m^2), and what the stabilising energy adds to it, N/m.
    own: Vector<R>,
    own_couplings: R,
}

#[inline(always)]
fn bound_all<R: Real, L: Law, const PARTS: usize>(kernel: PatchTileBounds<'_, L>) -> TileTangents {
    let PatchTileBounds { laws, tile, neighbours, displacement, sums, rotations, weight } = kernel;
    let mut tangents = TileTangents::NONE;
    let mut shares = [Shares::<R>::none(); PARTS];
    let mut deformations = [Deformation::new([[R::splat(0.0); 3]; 3]); PARTS];
    R::run_piece(PatchDeformations { tile, neighbours, displacement, deformations: &mut deformations });
    for (part, (shares, deformation)) in shares.iter_mut().zip(&deformations).enumerate() {
        let law = laws.widen(|lane| tile.element(part * R::COUNT + lane));
        let local = LawState::new::<L>(&law, deformation.invariants);
        shares.deformation = *deformation;
        shares.coefficients = Coefficients::new::<L>(&law, &local);
        shares.modulus = modulus_of::<R, L>(&law);
    }
    let (shares, tangents_out) = (&mut shares, &mut tangents);
    R::run_piece(AddBounds { tile, neighbours, rotations, weight, shares, sums, tangents: tangents_out });
    tangents
}

/// Adds the bounds of the patches of a tile, of which deformation and coefficients are known.
struct AddBounds<'a, 'b, R, const PARTS: usize> {
    tile: &'a PatchTile,
    neighbours: &'a [Neighbours],
    rotations: &'a [Rotation; TILE],
    weight: f32,
    shares: &'a mut [Shares<R>; PARTS],
    sums: MatrixSums<'b>,
    tangents: &'a mut TileTangents,
}

impl<R: Real, const PARTS: usize> Piece for AddBounds<'_, '_, R, PARTS> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { tile, neighbours, rotations, weight, shares, mut sums, tangents } = self;
        for (part, shares) in shares.iter_mut().enumerate() {
            shares.sum(tile, neighbours, part * R::COUNT, rotations, weight, tangents);
        }
        for neighbour in neighbours {
            add(&mut sums, &neighbour.nodes, Some(neighbour), shares);
        }
        add(&mut sums, &tile.nodes, None, shares);
    }
}

/// Adds the matrices of a neighbour of each patch, or of its own node, in the order of the places whatever the width of
/// a vector.
#[inline(always)]
fn add<R: Real, const PARTS: usize>(
    sums: &mut MatrixSums<'_>,
    nodes: &[u32; TILE],
    neighbour: Option<&Neighbours>,
    shares: &[Shares<R>; PARTS],
) {
    let Some(nodes) = sums.diagonal.checked::<R, 1>([nodes]) else { return };
    let mut buffers = [ScatterBuffer::NONE; 2];
    for (part, shares) in shares.iter().enumerate() {
        let first = part * R::COUNT;
        let (gradient, more) = match neighbour {
            Some(neighbour) => (neighbour.gradient(first), R::splat(0.0)),
            None => (shares.own, shares.own_couplings),
        };
        let [diagonal, off_diagonal] = shares.matrix(gradient, more);
        sums.diagonal.add_corners(&nodes, first, [diagonal], &mut buffers[0]);
        sums.off_diagonal.add_corners(&nodes, first, [off_diagonal], &mut buffers[1]);
    }
}

impl<R: Real> Shares<R> {
    #[inline(always)]
    fn none() -> Self {
        let zero = R::splat(0.0);
        Self {
            deformation: Deformation::new([[zero; 3]; 3]),
            coefficients: Coefficients::zero(),
            modulus: zero,
            cofactor: [[zero; 3]; 3],
            isotropic: zero,
            volume: zero,
            scalar: zero,
            own: [zero; 3],
            own_couplings: zero,
        }
    }

    /// Computes the factors from deformation and coefficients, and writes the tangents.
    #[inline(always)]
    fn sum(
        &mut self,
        tile: &PatchTile,
        neighbours: &[Neighbours],
        first: usize,
        rotations: &[Rotation; TILE],
        weight: f32,
        tangents: &mut TileTangents,
    ) {
        let inverse = vector_at::<R>(&tile.inverse_volumes, first);
        let lengths = GradientLengths::<R>::of(neighbours, first);
        let scale = inverse * lengths.sum;
        let bound = Bound::of_patches(self.coefficients, &self.deformation, self.modulus, scale);
        self.cofactor = cofactor_in_frames(rotations, first, &self.deformation);
        if weight != 0.0 {
            let weight = vector_at::<R>(&tile.volumes, first) * R::splat(weight);
            tangents.write(first, weight, &bound, &self.deformation, &self.cofactor, Some(self.modulus));
        }
        self.isotropic = bound.iso * scale;
        self.scalar = bound.scalar;
        self.own_couplings = self.modulus * lengths.couplings;
        let mut images = R::splat(0.0);
        for neighbour in neighbours {
            let gradient = neighbour.gradient::<R>(first);
            images = images + self.image(gradient).1;
            for axis in 0..3 {
                self.own[axis] = self.own[axis] - gradient[axis];
            }
        }
        images = images + self.image(self.own).1;
        self.volume = inverse * bound.volume * images;
    }

    /// Image of a gradient under `C`, and its length.
    #[inline(always)]
    fn image(&self, gradient: Vector<R>) -> (Vector<R>, R) {
        let mut image = [R::splat(0.0); 3];
        for (image, row) in image.iter_mut().zip(&self.cofactor) {
            *image = dot(*row, gradient);
        }
        (image, dot(image, image).root())
    }

    /// What the node with this gradient gets, with more along all axes: diagonal and scalar bound, and the other
    /// entries.
    #[inline(always)]
    fn matrix(&self, gradient: Vector<R>, more: R) -> [[R; 4]; 2] {
        let length = dot(gradient, gradient).root();
        let ([x, y, z], image) = self.image(gradient);
        // Avoids 0 / 0; a length below this limit contributes nothing.
        let inverse = R::splat(1.0).divide(image.max(R::splat(1e-30)));
        let isotropic = self.isotropic.fused(length, more);
        let (wx, wy, wz) = (self.volume * x, self.volume * y, self.volume * z);
        let (x, y, z) = (inverse * x, inverse * y, inverse * z);
        let scalar = self.scalar.fused(length, more);
        [[isotropic + wx * x, isotropic + wy * y, isotropic + wz * z, scalar], [wx * y, wy * z, wz * x, R::splat(0.0)]]
    }
}
