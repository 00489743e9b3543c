//! Internal forces (N) of tetrahedra with stabilised nodal strain: all energy is taken at the patches of the nodes
//! ([`super::patch`]), and what their mean does not see is held by a quadratic energy with the share `s` of the shear modulus at rest,
//!
//! ```text
//! E = sum_a V_a Psi(F_a) + s mu / 2 (sum_e V_e |H_e|^2 - sum_a V_a |H_a|^2),   F_a = I + H_a
//! ```
//! whose bracket is the sum over the patches of the variance of `H_e` (Puso & Solberg 2006 stabilise in the same way, with another
//! energy). With `P_a = dPsi/dF(F_a) - s mu H_a` a patch gives its neighbour `b` the force `-P_a c_ab`, and its own node the opposite
//! and `s mu sum_b k_ab (u_b - u_a)`, `k_ab = -sum_e V_e g_a . g_b`.

use core::ops::Range;

use crate::material::{Law, LawState, Laws, Potential};
use crate::simd::{Gather, Kernel, NodeVector, Real, Scatter, ScatterBuffer, TILE, TileNodes, dot};

use super::deformation::{Deformation, Matrix, Vector};
use super::internal_forces::Extremes;
use super::patch::{Neighbours, PatchTile, Patches};
use super::tile::vector_at;

/// Share of the shear modulus at rest in the stabilising energy. Less follows bending on coarse meshes more closely and is too soft on
/// fine ones; below 0.2 rough motion is hardly held.
pub(crate) const STABILISATION: f32 = 0.4;

/// The kernel that adds internal forces to the nodes of some partitions.
pub struct PatchForces<'a, L> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) patches: Patches<'a>,
    pub(crate) partitions: Range<usize>,
    pub(crate) displacement: &'a [NodeVector],
    pub(crate) force: Scatter<'a>,
}

impl<L: Law> Kernel for PatchForces<'_, L> {
    type Output = Extremes<f32>;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> Extremes<f32> {
        // Vectors in a tile.
        match R::COUNT {
            16 => add_all::<R, L, 1>(self),
            8 => add_all::<R, L, 2>(self),
            4 => add_all::<R, L, 4>(self),
            _ => add_all::<R, L, TILE>(self),
        }
    }
}

#[inline(always)]
fn add_all<R: Real, L: Law, const PARTS: usize>(kernel: PatchForces<'_, L>) -> Extremes<f32> {
    let PatchForces { laws, patches, partitions, displacement, mut force } = kernel;
    let displacement = Gather::new(displacement);
    let mut extremes = Extremes::<R>::none();
    for tile in patches.touching(partitions) {
        let neighbours = patches.neighbours_of(tile);
        let mut stresses = [Stress::<R>::zero(); PARTS];
        for (part, stress) in stresses.iter_mut().enumerate() {
            *stress = stress_of(&laws, tile, neighbours, part * R::COUNT, displacement, &mut extremes);
        }
        scatter::<R, PARTS>(tile, neighbours, stresses, &mut force);
    }
    Extremes::none().merged_with(&extremes)
}

/// What a vector of patches gives to its nodes.
#[derive(Clone, Copy)]
struct Stress<R> {
    /// `P_a`, Pa.
    p: Matrix<R>,
    /// Stabilising force on the own node, N.
    own: Vector<R>,
}

impl<R: Real> Stress<R> {
    #[inline(always)]
    fn zero() -> Self {
        Self { p: [[R::splat(0.0); 3]; 3], own: [R::splat(0.0); 3] }
    }
}

/// The displacement gradient of the patches from place `first` of a tile on, and `sum_b k_ab (u_b - u_a)`.
#[inline(always)]
pub(super) fn gradient<R: Real>(
    tile: &PatchTile,
    neighbours: &[Neighbours],
    first: usize,
    displacement: Gather<'_>,
) -> (Matrix<R>, Vector<R>) {
    let zero = R::splat(0.0);
    let (mut h, mut pull) = ([[zero; 3]; 3], [zero; 3]);
    let Some(nodes) = tile.nodes_below::<R>(displacement.count()) else { return (h, pull) };
    let own = displacement.read_nodes::<R, 1>(&nodes, 0, first);
    for neighbour in neighbours {
        let nodes = neighbour.nodes_below::<R>(displacement.count()).unwrap_or(TileNodes::ALL_ZERO);
        let at = displacement.read_nodes::<R, 1>(&nodes, 0, first);
        let along = [at[0] - own[0], at[1] - own[1], at[2] - own[2]];
        let coupling = vector_at::<R>(&neighbour.couplings, first);
        for i in 0..3 {
            pull[i] = along[i].fused(coupling, pull[i]);
            for j in 0..3 {
                h[i][j] = along[i].fused(vector_at(&neighbour.gradients[j], first), h[i][j]);
            }
        }
    }
    let inverse = vector_at::<R>(&tile.inverse_volumes, first);
    for row in &mut h {
        *row = [row[0] * inverse, row[1] * inverse, row[2] * inverse];
    }
    (h, pull)
}

#[inline(always)]
fn stress_of<R: Real, L: Law>(
    laws: &Laws<'_, L>,
    tile: &PatchTile,
    neighbours: &[Neighbours],
    first: usize,
    displacement: Gather<'_>,
    extremes: &mut Extremes<R>,
) -> Stress<R> {
    let (h, pull) = gradient::<R>(tile, neighbours, first, displacement);
    let deformation = Deformation::new(h);
    let law = laws.widen(|lane| tile.element(first + lane));
    let response = LawState::new::<L>(&law, deformation.invariants).response::<L>(&law);
    extremes.least_j = deformation.invariants.j.min(extremes.least_j);
    extremes.saturation = response.saturation.max(extremes.saturation);
    // mu = 2 W'(0).
    let modulus = R::splat(2.0 * STABILISATION) * law.distortion_slope(R::splat(0.0));
    let mut p = deformation.stress(response.p1, response.s);
    for i in 0..3 {
        for j in 0..3 {
            p[i][j] = p[i][j] - modulus * h[i][j];
        }
    }
    Stress { p, own: [modulus * pull[0], modulus * pull[1], modulus * pull[2]] }
}

/// Adds the forces of a tile, neighbour by neighbour, those of the patches in the order of their places whatever the width of a vector.
#[inline(always)]
fn scatter<R: Real, const PARTS: usize>(
    tile: &PatchTile,
    neighbours: &[Neighbours],
    mut stresses: [Stress<R>; PARTS],
    force: &mut Scatter<'_>,
) {
    let zero = R::splat(0.0);
    for neighbour in neighbours {
        let mut buffer = ScatterBuffer::NONE;
        let nodes = force.checked::<R, 1>([&neighbour.nodes]);
        for (part, stress) in stresses.iter_mut().enumerate() {
            let first = part * R::COUNT;
            let [x, y, z] = &neighbour.gradients;
            let gradient = [vector_at::<R>(x, first), vector_at::<R>(y, first), vector_at::<R>(z, first)];
            let mut row = [zero; 4];
            for i in 0..3 {
                let pulled = dot(stress.p[i], gradient);
                stress.own[i] = stress.own[i] + pulled;
                row[i] = -pulled;
            }
            match &nodes {
                Some(nodes) => force.add_corners(nodes, first, [row], &mut buffer),
                None => force.add_present([&neighbour.nodes], first, [row]),
            }
        }
    }
    let mut buffer = ScatterBuffer::NONE;
    let nodes = force.checked::<R, 1>([&tile.nodes]);
    for (part, stress) in stresses.iter().enumerate() {
        let [x, y, z] = stress.own;
        match &nodes {
            Some(nodes) => force.add_corners(nodes, part * R::COUNT, [[x, y, z, zero]], &mut buffer),
            None => force.add_present([&tile.nodes], part * R::COUNT, [[x, y, z, zero]]),
        }
    }
}
