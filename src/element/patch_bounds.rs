//! Bound of the stiffness of tetrahedra with nodal strain ([`super::patch_forces`]) by a matrix for each node, in
//! 1/s^2, for the critical step: that of [`super::critical_bounds`] with patches in the place of elements,
//!
//! ```text
//! V_a d2Psi(F_a)[dF_a, dF_a] <= sum_b v_b . D_b v_b,   dF_a = sum_b v_b (c_ab / V_a)^T,   c_aa = -sum_b c_ab
//! ```
//! by Cauchy-Schwarz over the node and its neighbours, with weights of the nodes as in [`super::NodalVolumeBounds`]. Of
//! the stabilising energy the part `-s mu |dF_a|^2` lowers the isotropic term; the other one is a graph Laplacian,
//! whose rows are bounded by their absolute values.

use crate::material::{Law, LawState, Laws};
use crate::simd::{Gather, Kernel, NodeVector, Piece, Real, ScatterBuffer, TILE, TileNodes, dot};

use super::NodeInertia;
use super::critical_bounds::{Image, NodeMatrices, Terms};
use super::deformation::{Deformation, Vector};
use super::patch::{Neighbours, PatchTile, Patches};
use super::patch_deformation::PatchDeformations;
use super::patch_forces::modulus_of;
use super::symmetric::Symmetric;
use super::tile::vector_at;

/// The kernel that adds the bounds of all patches to the matrices of their nodes.
pub struct PatchBounds<'a, 'b, L> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) patches: Patches<'a>,
    pub(crate) inertia: &'a [NodeInertia],
    /// Rows that begin with the weight of each node.
    pub(crate) weights: &'a [NodeVector],
    pub(crate) sums: &'a mut NodeMatrices<'b>,
}

impl<L: Law> Kernel for PatchBounds<'_, '_, L> {
    type Output = ();

    const SELDOM: bool = true;
    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        match R::COUNT {
            16 => add_all::<R, L, 1>(self),
            8 => add_all::<R, L, 2>(self),
            4 => add_all::<R, L, 4>(self),
            _ => add_all::<R, L, TILE>(self),
        }
    }
}

/// What a vector of patches gives to its nodes.
#[derive(Clone, Copy)]
struct Bound<R> {
    deformation: Deformation<R>,
    terms: Terms<R>,
    /// Of the stabilising energy, Pa.
    modulus: R,
    /// Of all gradients: weighted sums of the lengths of their images under `C`, `E` and `X`, and of their own.
    lengths: [R; 4],
    /// Factor of the product of the lengths of two gradients.
    isotropic: R,
    /// Root of one over the volume.
    root: R,
    /// Gradient of the own node, and what its Laplacian adds to it.
    own: Vector<R>,
    laplacian: R,
}

#[inline(always)]
fn add_all<R: Real, L: Law, const PARTS: usize>(kernel: PatchBounds<'_, '_, L>) {
    let PatchBounds { laws, patches, inertia, weights, sums } = kernel;
    // The first three components of a node's inertia are its inverse masses.
    let inertia: Gather<'_> = Gather::new(bytemuck::must_cast_slice::<NodeInertia, NodeVector>(inertia));
    let weights = Gather::new(weights);
    for tile in patches.tiles {
        let neighbours = patches.neighbours_of(tile);
        let mut bounds = [Bound::<R>::none(); PARTS];
        let displacement = Gather::new(sums.zx_in_padding);
        let mut deformations = [Deformation::new([[R::splat(0.0); 3]; 3]); PARTS];
        R::run_piece(PatchDeformations { tile, neighbours, displacement, deformations: &mut deformations });
        // A loop, because the compiler may leave closures over vectors as function calls.
        for (part, (bound, deformation)) in bounds.iter_mut().zip(&deformations).enumerate() {
            let law = laws.widen(|lane| tile.element(part * R::COUNT + lane));
            let local = LawState::new::<L>(&law, deformation.invariants);
            bound.deformation = *deformation;
            bound.terms = Terms::new::<L>(&law, &local, deformation);
            bound.modulus = modulus_of::<R, L>(&law);
        }
        let (bounds, sums) = (&mut bounds, &mut *sums);
        R::run_piece(AddBounds { tile, neighbours, inertia, weights, bounds, sums });
    }
}

/// Adds the matrices of the patches of a tile, of which deformation and terms are known.
struct AddBounds<'a, 'b, R, const PARTS: usize> {
    tile: &'a PatchTile,
    neighbours: &'a [Neighbours],
    inertia: Gather<'a>,
    weights: Gather<'a>,
    bounds: &'a mut [Bound<R>; PARTS],
    sums: &'a mut NodeMatrices<'b>,
}

impl<R: Real, const PARTS: usize> Piece for AddBounds<'_, '_, R, PARTS> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { tile, neighbours, inertia, weights, bounds, sums } = self;
        let below = inertia.count().min(weights.count());
        // Loops, because the compiler may leave closures over vectors as function calls.
        for (part, bound) in bounds.iter_mut().enumerate() {
            bound.sum(tile, neighbours, part * R::COUNT, (inertia, weights));
        }
        for neighbour in neighbours {
            let mut buffers = [ScatterBuffer::NONE; 3];
            let Some(nodes) = neighbour.nodes_below::<R>(below) else { return };
            for (part, bound) in bounds.iter().enumerate() {
                let first = part * R::COUNT;
                let weighted = weighted_gradient(neighbour, first, &nodes, bound.root, inertia);
                let [weight, ..] = weights.read_nodes::<R, 1>(&nodes, 0, first);
                let matrix = bound.matrix(weighted, weight, R::splat(0.0));
                sums.add_corners(&nodes, first, [matrix], &mut buffers);
            }
        }
        let mut buffers = [ScatterBuffer::NONE; 3];
        let Some(nodes) = tile.nodes_below::<R>(below) else { return };
        for (part, bound) in bounds.iter().enumerate() {
            let [weight, ..] = weights.read_nodes::<R, 1>(&nodes, 0, part * R::COUNT);
            let matrix = bound.matrix(bound.own, weight, bound.laplacian);
            sums.add_corners(&nodes, part * R::COUNT, [matrix], &mut buffers);
        }
    }
}

/// Root of the largest inverse mass of a node along its axes.
#[inline(always)]
pub(super) fn mass_root<R: Real>(nodes: &TileNodes<'_, 1>, first: usize, inertia: Gather<'_>) -> R {
    let [x, y, z] = inertia.read_nodes::<R, 1>(nodes, 0, first);
    x.max(y).max(z).max(R::splat(0.0)).sqrt()
}

/// `c_ab / sqrt(V_a m_b)`.
#[inline(always)]
pub(super) fn weighted_gradient<R: Real>(
    neighbour: &Neighbours,
    first: usize,
    nodes: &TileNodes<'_, 1>,
    root: R,
    inertia: Gather<'_>,
) -> Vector<R> {
    let factor = root * mass_root::<R>(nodes, first, inertia);
    let [x, y, z] = neighbour.gradient::<R>(first);
    [factor * x, factor * y, factor * z]
}

impl<R: Real> Bound<R> {
    #[inline(always)]
    fn none() -> Self {
        let zero = R::splat(0.0);
        let terms = Terms { p1: zero, p_j: zero, stiffening: zero, volume: zero, coupling: zero, x_f: zero, x_c: zero };
        Self {
            deformation: Deformation::new([[zero; 3]; 3]),
            terms,
            modulus: zero,
            lengths: [zero; 4],
            isotropic: zero,
            root: zero,
            own: [zero; 3],
            laplacian: zero,
        }
    }

    /// The sums over the nodes of a patch, from its deformation and its terms.
    #[inline(always)]
    fn sum(
        &mut self,
        tile: &PatchTile,
        neighbours: &[Neighbours],
        first: usize,
        (inertia, weights): (Gather<'_>, Gather<'_>),
    ) {
        let zero = R::splat(0.0);
        let (h, terms, modulus) = (self.deformation.h, &self.terms, self.modulus);
        // |F g| <= (1 + |H|) |g|, and the root of p^2 + q^2 is at most p + (sqrt 2 - 1) q for p >= q >= 0.
        let square = dot(h[0], h[0]) + dot(h[1], h[1]) + dot(h[2], h[2]);
        let along = (terms.p1 - modulus).abs();
        let across = terms.p_j.abs() * (R::splat(1.0) + square.sqrt());
        self.isotropic = along.max(across) + along.min(across) * R::splat(core::f32::consts::SQRT_2 - 1.0);
        self.root = vector_at::<R>(&tile.inverse_volumes, first).sqrt();
        let own_nodes = tile.nodes_below::<R>(inertia.count()).unwrap_or(TileNodes::ALL_ZERO);
        let own_root = mass_root::<R>(&own_nodes, first, inertia);
        let [own_weight, ..] = weights.read_nodes::<R, 1>(&own_nodes, 0, first);
        let mut own = [zero; 3];
        for neighbour in neighbours {
            let nodes = neighbour.nodes_below::<R>(inertia.count()).unwrap_or(TileNodes::ALL_ZERO);
            let [weight, ..] = weights.read_nodes::<R, 1>(&nodes, 0, first);
            self.enter(weighted_gradient(neighbour, first, &nodes, self.root, inertia), weight);
            let coupling = vector_at::<R>(&neighbour.couplings, first);
            let other_root = mass_root::<R>(&nodes, first, inertia);
            let other = other_root * weight.divide(own_weight);
            self.laplacian = self.laplacian + coupling * own_root + coupling.abs() * other;
            for axis in 0..3 {
                own[axis] = own[axis] - vector_at::<R>(&neighbour.gradients[axis], first);
            }
        }
        self.laplacian = modulus * own_root * self.laplacian;
        let factor = self.root * own_root;
        self.own = [own[0] * factor, own[1] * factor, own[2] * factor];
        self.enter(self.own, own_weight);
    }

    /// Images of a gradient under `C`, `E` and `X`, and its length.
    #[inline(always)]
    fn images(&self, g: Vector<R>) -> ([Image<R>; 3], R) {
        let zero = [R::splat(0.0); 3];
        let (mut c, mut e, mut x) = (zero, zero, zero);
        for i in 0..3 {
            for (j, &component) in g.iter().enumerate() {
                c[i] = c[i] + self.deformation.cofactor(i, j) * component;
                e[i] = e[i] + self.deformation.distortion(i, j) * component;
            }
            x[i] = self.terms.x_f * (e[i] + c[i]) + self.terms.x_c * c[i];
        }
        ([Image::new(c), Image::new(e), Image::new(x)], dot(g, g).sqrt())
    }

    #[inline(always)]
    fn enter(&mut self, g: Vector<R>, weight: R) {
        let ([c, e, x], length) = self.images(g);
        let [sum_c, sum_e, sum_x, sum] = self.lengths;
        self.lengths = [
            weight.fused(c.length, sum_c),
            weight.fused(e.length, sum_e),
            weight.fused(x.length, sum_x),
            weight.fused(length, sum),
        ];
    }

    /// What the node with this gradient and weight gets, with more along all axes.
    #[inline(always)]
    fn matrix(&self, g: Vector<R>, weight: R, more: R) -> Symmetric<R> {
        let ([c, e, x], length) = self.images(g);
        let share = R::splat(1.0).divide(weight);
        let [sum_c, sum_e, sum_x, sum] = self.lengths;
        let weights = [
            share * self.terms.volume * sum_c,
            share * self.terms.coupling * sum_e,
            share * self.terms.stiffening * sum_x,
        ];
        let [c, e, x] = [c.matrix(weights[0]), e.matrix(weights[1]), x.matrix(weights[2])];
        let isotropic = share * self.isotropic * length * sum + more;
        Symmetric {
            xx: c.xx + e.xx + x.xx + isotropic,
            yy: c.yy + e.yy + x.yy + isotropic,
            zz: c.zz + e.zz + x.zz + isotropic,
            xy: c.xy + e.xy + x.xy,
            yz: c.yz + e.yz + x.yz,
            zx: c.zx + e.zx + x.zx,
        }
    }
}
