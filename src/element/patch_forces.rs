//! Internal forces (N) of tetrahedra with stabilised nodal strain: all energy is taken at the patches of the nodes
//! ([`super::patch`]), and what their mean does not see is held by a quadratic energy with the share `s` of the shear
//! modulus at rest,
//!
//! ```text
//! E = sum_a V_a Psi(F_a) + s mu / 2 (sum_e V_e |H_e|^2 - sum_a V_a |H_a|^2),   F_a = I + H_a
//! ```
//! whose bracket is the sum over the patches of the variance of `H_e` (Puso & Solberg 2006 stabilise in the same way,
//! with another energy). With `P_a = dPsi/dF(F_a) - s mu H_a` a patch gives its neighbour `b` the force `-P_a c_ab`,
//! and its own node the opposite and `s mu sum_b k_ab (u_b - u_a)`, `k_ab = -sum_e V_e g_a . g_b`. Crushed elements add
//! an energy of their own ([`super::barrier`]).

use core::ops::Range;

use crate::material::{AnyLaw, Law, LawState, Laws, Potential};
use crate::simd::{Gather, Kernel, NodeVector, Piece, Real, Scatter, ScatterBuffer, TILE, dot};

use super::deformation::{Deformation, Matrix, Vector};
use super::extension::{Extension, NoExtension};
use super::internal_forces::{ElementVisitor, Extremes};
use super::patch::{Neighbours, PatchTile, Patches};
use super::patch_deformation::{GradientLengths, gradient};
use super::stiffness_bound::{Coefficients, scalar_bound_of_patches};
use super::tile::vector_at;

/// Share of the shear modulus at rest in the stabilising energy. Less follows bending on coarse meshes more closely and
/// is too soft on fine ones; below 0.2 rough motion is hardly held.
pub(crate) const STABILISATION: f32 = 0.4;

/// The kernel that adds internal forces to the nodes of some partitions, and what the visitor asks for.
pub struct PatchForces<'a, L, V, K = NoExtension> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) patches: Patches<'a>,
    pub(crate) partitions: Range<usize>,
    pub(crate) displacement: &'a [NodeVector],
    /// What rounding has left out of the displacements, or nothing.
    pub(crate) remainder: &'a [NodeVector],
    pub(crate) force: Scatter<'a>,
    pub(crate) visitor: V,
    pub(crate) extension: K,
}

impl<'a, L: Law + Into<AnyLaw>, V> PatchForces<'a, L, V> {
    /// The same with what the stress has besides that of the law.
    pub(crate) fn with_extension<K>(self, extension: K) -> PatchForces<'a, AnyLaw, V, K> {
        let Self { laws, patches, partitions, displacement, remainder, force, visitor, extension: NoExtension } = self;
        PatchForces { laws: laws.any(), patches, partitions, displacement, remainder, force, visitor, extension }
    }
}

impl<L: Law, V: ElementVisitor, K: Extension> Kernel for PatchForces<'_, L, V, K> {
    type Output = Extremes<f32>;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> Extremes<f32> {
        // Vectors in a tile.
        match R::COUNT {
            16 => add_all::<R, L, V, K, 1>(self),
            8 => add_all::<R, L, V, K, 2>(self),
            4 => add_all::<R, L, V, K, 4>(self),
            _ => add_all::<R, L, V, K, TILE>(self),
        }
    }
}

#[inline(always)]
fn add_all<R: Real, L: Law, V: ElementVisitor, K: Extension, const PARTS: usize>(
    kernel: PatchForces<'_, L, V, K>,
) -> Extremes<f32> {
    let PatchForces { laws, patches, partitions, displacement, remainder, mut force, visitor, mut extension } = kernel;
    let moved = [displacement, remainder].map(Gather::new);
    let mut extremes = Extremes::<R>::none();
    for tile in patches.touching(partitions) {
        let neighbours = patches.neighbours_of(tile);
        let mut stresses = [Stress::<R>::zero(); PARTS];
        for (part, stress) in stresses.iter_mut().enumerate() {
            let (first, asked) = (part * R::COUNT, (visitor.bounds(), &mut extension));
            *stress = stress_of::<R, L, K>(&laws, tile, neighbours, first, moved, asked, &mut extremes);
        }
        scatter::<R, PARTS>(tile, neighbours, stresses, visitor.bounds(), &mut force);
    }
    if K::EXTENDS {
        extremes.saturation = extremes.saturation.max(R::splat(extension.saturation()));
    }
    Extremes::none().merged_with(&extremes)
}

/// Modulus of the stabilising energy, Pa, with `mu = 2 W'(0)`.
#[inline(always)]
pub(super) fn modulus_of<R: Real, L: Law>(law: &L::Wide<R>) -> R {
    R::splat(2.0 * STABILISATION) * law.distortion_slope(R::splat(0.0))
}

/// What a vector of patches gives to its nodes.
#[derive(Clone, Copy)]
struct Stress<R> {
    /// `P_a`, Pa.
    p: Matrix<R>,
    /// Stabilising force on the own node, N.
    own: Vector<R>,
    /// Stiffness bound of a neighbour over the length of its `c_ab`, N/m^3, and that of the own node, N/m; zero if
    /// nobody asks.
    scalar: R,
    own_scalar: R,
}

impl<R: Real> Stress<R> {
    #[inline(always)]
    fn zero() -> Self {
        let zero = R::splat(0.0);
        Self { p: [[zero; 3]; 3], own: [zero; 3], scalar: zero, own_scalar: zero }
    }
}

#[inline(always)]
fn stress_of<R: Real, L: Law, K: Extension>(
    laws: &Laws<'_, L>,
    tile: &PatchTile,
    neighbours: &[Neighbours],
    first: usize,
    moved: [Gather<'_>; 2],
    (bounds, extension): (bool, &mut K),
    extremes: &mut Extremes<R>,
) -> Stress<R> {
    let (h, pull) = gradient::<R>(tile, neighbours, first, moved);
    let deformation = Deformation::new(h);
    let law = laws.widen(|lane| tile.element(first + lane));
    let local = LawState::new::<L>(&law, deformation.invariants);
    let response = local.response();
    extremes.least_change = deformation.invariants.j.min(extremes.least_change);
    extremes.saturation = response.saturation.max(extremes.saturation);
    let modulus = modulus_of::<R, L>(&law);
    let stabilising = extension.stabilising(modulus, |lane| tile.element(first + lane));
    let (deformation, scalars, of_law) = (&deformation, [response.p1, response.s], K::of_law(&local));
    let stress = Extend { tile, first, deformation, scalars, of_law, bounds, extension };
    let (mut p, bound) = if K::EXTENDS { R::run_piece(stress) } else { stress.run() };
    for i in 0..3 {
        for j in 0..3 {
            p[i][j] = p[i][j] - stabilising * h[i][j];
        }
    }
    let own = [stabilising * pull[0], stabilising * pull[1], stabilising * pull[2]];
    let stress = Stress { p, own, ..Stress::zero() };
    if !bounds {
        return stress;
    }
    let lengths = GradientLengths::<R>::of(neighbours, first);
    let scale = lengths.sum * vector_at::<R>(&tile.inverse_volumes, first);
    let coefficients = Coefficients::new::<L>(&law, &local).less(modulus);
    let mut scalar = scalar_bound_of_patches(&coefficients, deformation, scale);
    if K::EXTENDS {
        scalar = scale.fused(bound, scalar);
    }
    Stress { scalar, own_scalar: scalar.fused(lengths.own, modulus * lengths.couplings), ..stress }
}

/// The stress of a vector of patches and what the scalar stiffness bound gains (Pa), if it is asked for.
struct Extend<'a, 'b, R: Real, K: Extension> {
    tile: &'a PatchTile,
    first: usize,
    deformation: &'b Deformation<R>,
    scalars: [R; 2],
    of_law: K::Local<R>,
    bounds: bool,
    extension: &'b mut K,
}

impl<R: Real, K: Extension> Piece for Extend<'_, '_, R, K> {
    type Output = (Matrix<R>, R);

    #[inline(always)]
    fn run(self) -> (Matrix<R>, R) {
        let Self { tile, first, deformation, scalars, of_law, bounds, extension } = self;
        let (place, element) = ((tile, first), |lane| tile.element(first + lane));
        let (h, invariants) = (&deformation.h, deformation.invariants);
        let (prepared, bound) = extension.prepare(place, element, h, invariants, bounds, &of_law);
        (extension.stress(place, element, deformation, scalars, &of_law, &prepared), bound)
    }
}

/// Adds the forces of a tile, neighbour by neighbour, those of the patches in the order of their places whatever the
/// width of a vector.
#[inline(always)]
fn scatter<R: Real, const PARTS: usize>(
    tile: &PatchTile,
    neighbours: &[Neighbours],
    mut stresses: [Stress<R>; PARTS],
    bounds: bool,
    force: &mut Scatter<'_>,
) {
    let zero = R::splat(0.0);
    for neighbour in neighbours {
        let mut buffer = ScatterBuffer::NONE;
        let nodes = force.checked::<R, 1>([&neighbour.nodes]);
        for (part, stress) in stresses.iter_mut().enumerate() {
            let first = part * R::COUNT;
            let gradient = neighbour.gradient::<R>(first);
            let mut row = [zero; 4];
            if bounds {
                row[3] = stress.scalar * dot(gradient, gradient).root();
            }
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
        let row = [x, y, z, stress.own_scalar];
        match &nodes {
            Some(nodes) => force.add_corners(nodes, part * R::COUNT, [row], &mut buffer),
            None => force.add_present([&tile.nodes], part * R::COUNT, [row]),
        }
    }
}
