//! Bounds of the elements' tangent stiffness for the critical step, in 1/s^2 (mass-weighted).
//!
//! The bound needs no iteration. Every term of an element's tangent is a quadratic form, bounded by one that couples no
//! two nodes: a 3 x 3 matrix `D_a` for each node. Then `omega_max^2 <= max_a lambda_max(sum_e D_a^e)` of the
//! mass-weighted matrices. With the variation `dF = sum_a v_a (x) ga`:
//!
//! ```text
//! P        = p1 F + pJ C,   C = cof F,   E = F - C (zero at rest),   X = dx/dF
//! dF:A:dF  = p1 |dF|^2 + pJ dF:(dC/dF):dF              geometric: K_ab = p1 (ga.gb) I + pJ [F (ga x gb)]x
//!          + W'' (X:dF)^2                              stiffening of the law
//!          + (U'' + W' (4 g' + g'' I1)) (C:dF)^2       volume
//!          + 4 W' g' (C:dF) (E:dF)                     coupling, split by 2 x y <= r x^2 + y^2 / r
//! (C:dF)^2 = (sum_a (C ga).va)^2 <= (sum_b |C gb|) sum_a va.(C ga)(C ga).va / |C ga|      Cauchy-Schwarz
//! ```
//! The geometric part is small in nearly incompressible tissue. It is bounded by its row sums, with
//! `|K_ab| = sqrt(p1^2 (ga.gb)^2 + pJ^2 |F (ga x gb)|^2)`, rounded up by at most 8 %. The other parts keep the
//! directions of `C ga`: compared with row sums of norms (Gershgorin) the step is up to `sqrt 3` times as large.
//!
//! With nodal pressure ([`super::pressure`]) the energy of volume is `sum_a V_a U(J_a)`. As `J_a` is a mean of the
//! `J_e`, with weights `V_e / 4`, the square of its variation is at most the mean of theirs (Cauchy-Schwarz): `sum_a
//! V_a U''(J_a) (dJ_a)^2 <= sum_e V_e (sum_{a in e} U''(J_a) / 4) (C:dF)^2`. So the terms above hold with the means of
//! `U'` and `U''` over the nodes of an element. Where all elements are of one tissue, [`super::nodal_volume_bounds`]
//! bounds the energy of volume closer.
//!
//! No term is left out, so the bound holds for any state, inverted elements included.

use crate::material::{Law, LawState, Laws};
use crate::simd::{Gather, Kernel, NodeVector, Piece, Real, Scatter, ScatterBuffer, TILE, TileNodes, dot};

use super::barrier::Barrier;
use super::deformation::{Deformation, Vector};
use super::pressure::{OwnPressure, Pressure, ReadTile};
use super::symmetric::Symmetric;
use super::{ElementTile, NodeInertia};

/// Symmetric 3 x 3 matrices of the nodes, 1/s^2. Two of the six entries are in the padding of other vectors
/// ([`crate::padding`]).
pub(crate) struct NodeMatrices<'a> {
    pub(crate) xx_yy_zz_xy: &'a mut [NodeVector],
    pub(crate) yz_in_padding: &'a mut [NodeVector],
    pub(crate) zx_in_padding: &'a mut [NodeVector],
}

impl NodeMatrices<'_> {
    pub(crate) fn clear(&mut self) {
        self.xx_yy_zz_xy.fill(NodeVector::ZERO);
        for vectors in [&mut *self.yz_in_padding, &mut *self.zx_in_padding] {
            for vector in vectors {
                vector.0[3] = 0.0;
            }
        }
    }

    /// Writes the matrix of a node.
    pub(super) fn set(&mut self, node: usize, matrix: Symmetric) {
        let Symmetric { xx, yy, zz, xy, yz, zx } = matrix;
        if let Some(vector) = self.xx_yy_zz_xy.get_mut(node) {
            vector.0 = [xx, yy, zz, xy];
        }
        if let Some(vector) = self.yz_in_padding.get_mut(node) {
            vector.0[3] = yz;
        }
        if let Some(vector) = self.zx_in_padding.get_mut(node) {
            vector.0[3] = zx;
        }
    }

    /// Adds matrices to the nodes at the corners of a vector of elements.
    #[inline(always)]
    pub(super) fn add_corners<R: Real, const N: usize>(
        &mut self,
        nodes: &TileNodes<'_, N>,
        first: usize,
        matrices: [Symmetric<R>; N],
        [first_four_buffer, fifth_buffer, sixth_buffer]: &mut [ScatterBuffer<N>; 3],
    ) {
        let zero = R::splat(0.0);
        let (mut first_four, mut fifth, mut sixth) = ([[zero; 4]; N], [[zero; 4]; N], [[zero; 4]; N]);
        for corner in 0..N {
            let Symmetric { xx, yy, zz, xy, yz, zx } = matrices[corner];
            first_four[corner] = [xx, yy, zz, xy];
            (fifth[corner][3], sixth[corner][3]) = (yz, zx);
        }
        Scatter::new(self.xx_yy_zz_xy).add_corners(nodes, first, first_four, first_four_buffer);
        Scatter::new(self.yz_in_padding).add_corners(nodes, first, fifth, fifth_buffer);
        Scatter::new(self.zx_in_padding).add_corners(nodes, first, sixth, sixth_buffer);
    }

    /// The sum of the diagonal of the node's matrix, 1/s^2: no eigenvalue is larger.
    pub(crate) fn trace(&self, node: usize) -> f32 {
        let [xx, yy, zz, _] = self.xx_yy_zz_xy.get(node).copied().unwrap_or_default().0;
        xx + yy + zz
    }

    /// A close upper bound of the largest eigenvalue of the node's matrix on its free axes, 1/s^2.
    pub(crate) fn largest_eigenvalue(&self, node: usize, inverse: [f32; 3]) -> f32 {
        let read = |vectors: &[NodeVector]| vectors.get(node).copied().unwrap_or_default().0;
        let [xx, yy, zz, xy] = read(self.xx_yy_zz_xy);
        let (yz, zx) = (read(self.yz_in_padding)[3], read(self.zx_in_padding)[3]);
        Symmetric { xx, yy, zz, xy, yz, zx }.on_free(inverse).largest_eigenvalue()
    }
}

/// The kernel that adds the bounds of all elements to the matrices of their nodes.
pub struct CriticalBounds<'a, 'b, L, P = OwnPressure> {
    pub(crate) laws: Laws<'a, L>,
    pub(crate) pressure: P,
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) inertia: &'a [NodeInertia],
    /// Whether the volume term is added, which nodes may bound closer ([`super::NodalVolumeBounds`]).
    pub(crate) with_volume: bool,
    pub(crate) sums: &'a mut NodeMatrices<'b>,
}

impl<L: Law, P: Pressure> Kernel for CriticalBounds<'_, '_, L, P> {
    type Output = ();

    const SELDOM: bool = true;
    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        // The first three components of a node's inertia are its inverse masses.
        let inertia = Gather::new(bytemuck::must_cast_slice(self.inertia));
        for tile in self.tiles {
            let mut buffers = [ScatterBuffer::NONE; 3];
            for first in (0..TILE).step_by(R::COUNT) {
                let displacement = Gather::new(self.sums.zx_in_padding);
                let read = ReadTile::<R, P>::new(tile, first, displacement, self.pressure);
                // By reference: a copy would take a kilobyte of stack.
                let (deformation, change) = &R::run_piece(read);
                let law = self.laws.widen(|lane| tile.element(first + lane));
                let mut local = LawState::with_volume_change::<L>(&law, deformation.invariants, *change);
                if !self.with_volume {
                    local.bulk = R::splat(0.0);
                }
                let terms = &Terms::new::<L>(&law, &local, deformation);
                let (sums, buffers) = (&mut *self.sums, &mut buffers);
                R::run_piece(AddBounds { tile, first, deformation, terms, inertia, sums, buffers });
            }
        }
    }
}

/// Shape function gradients at the corners for a bound of `M^-1/2 K M^-1/2`: multiplied by the square root of volume
/// over nodal mass, m^(1/2) kg^(-1/2); and the square root of the volume. This stays in the range of float32, and gives
/// a closer bound where light nodes have heavy neighbours. Nodes that are held along all axes have an infinite mass.
#[inline(always)]
pub(super) fn mass_weighted_gradients<R: Real>(
    tile: &ElementTile,
    first: usize,
    nodes: &TileNodes<'_, 4>,
    inertia: Gather<'_>,
) -> ([Vector<R>; 4], R) {
    let mut gradients = [[R::splat(0.0); 3]; 4];
    for corner in 1..4 {
        gradients[corner] = tile.gradients(corner - 1, first);
    }
    for axis in 0..3 {
        gradients[0][axis] = -(gradients[1][axis] + gradients[2][axis] + gradients[3][axis]);
    }
    let volume = tile.volume::<R>(first).sqrt();
    for (corner, gradient) in gradients.iter_mut().enumerate() {
        let [x, y, z] = inertia.read_nodes::<R, 4>(nodes, corner, first);
        let root = x.max(y).max(z).max(R::splat(0.0)).sqrt() * volume;
        *gradient = [gradient[0] * root, gradient[1] * root, gradient[2] * root];
    }
    (gradients, volume)
}

/// Adds the matrices of a vector of elements to the sums ([`mass_weighted_gradients`]).
pub(super) struct AddBounds<'a, 'b, R> {
    pub(super) tile: &'a ElementTile,
    pub(super) first: usize,
    pub(super) deformation: &'a Deformation<R>,
    pub(super) terms: &'a Terms<R>,
    pub(super) inertia: Gather<'a>,
    pub(super) sums: &'a mut NodeMatrices<'b>,
    pub(super) buffers: &'a mut [ScatterBuffer<4>; 3],
}

impl<R: Real> Piece for AddBounds<'_, '_, R> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        add_bounds(self);
    }
}

#[inline(always)]
fn add_bounds<R: Real>(part: AddBounds<'_, '_, R>) {
    let AddBounds { tile, first, deformation, terms, inertia, sums, buffers } = part;
    let Some(nodes) = tile.nodes_below::<R>(sums.zx_in_padding.len()) else {
        return;
    };
    let (gradients, _) = mass_weighted_gradients(tile, first, &nodes, inertia);
    // No closures over vectors from here on: the compiler may leave them as function calls, even for one addition.
    let [g0, g1, g2, g3] = gradients;
    let images = [
        terms.images(deformation, g0),
        terms.images(deformation, g1),
        terms.images(deformation, g2),
        terms.images(deformation, g3),
    ];
    let [i0, i1, i2, i3] = &images;
    let weight_c = terms.volume * (i0.c.length + i1.c.length + i2.c.length + i3.c.length);
    let weight_e = terms.coupling * (i0.e.length + i1.e.length + i2.e.length + i3.e.length);
    let weight_x = terms.stiffening * (i0.x.length + i1.x.length + i2.x.length + i3.x.length);

    let mut row_sums = [R::splat(0.0); 4];
    for a in 0..4 {
        row_sums[a] = row_sums[a] + terms.geometric(&images[a], &images[a]);
        for b in 0..a {
            let norm = terms.geometric(&images[a], &images[b]);
            row_sums[a] = row_sums[a] + norm;
            row_sums[b] = row_sums[b] + norm;
        }
    }
    let zero = R::splat(0.0);
    let mut matrices = [Symmetric { xx: zero, yy: zero, zz: zero, xy: zero, yz: zero, zx: zero }; 4];
    for corner in 0..4 {
        let isotropic = row_sums[corner];
        let image = &images[corner];
        matrices[corner] = Symmetric {
            xx: image.entry([weight_c, weight_e, weight_x], 0, 0) + isotropic,
            yy: image.entry([weight_c, weight_e, weight_x], 1, 1) + isotropic,
            zz: image.entry([weight_c, weight_e, weight_x], 2, 2) + isotropic,
            xy: image.entry([weight_c, weight_e, weight_x], 0, 1),
            yz: image.entry([weight_c, weight_e, weight_x], 1, 2),
            zx: image.entry([weight_c, weight_e, weight_x], 2, 0),
        };
    }
    sums.add_corners(&nodes, first, matrices, buffers);
}

/// Magnitudes of the terms of the tangent, Pa.
#[derive(Clone, Copy)]
pub(super) struct Terms<R> {
    pub(super) p1: R,
    pub(super) p_j: R,
    pub(super) stiffening: R,
    /// Factor of `(C:dF)^2`, its part of the coupling included.
    pub(super) volume: R,
    /// Factor of `(E:dF)^2`: the other part of the coupling.
    pub(super) coupling: R,
    /// Factors in `X = x_f F + x_c C`.
    pub(super) x_f: R,
    pub(super) x_c: R,
}

/// The image of a shape function gradient under a matrix: the vector, its length and the inverse of the length.
pub(super) struct Image<R> {
    pub(super) vector: Vector<R>,
    pub(super) length: R,
    inverse: R,
}

impl<R: Real> Image<R> {
    #[inline(always)]
    pub(super) fn new(vector: Vector<R>) -> Self {
        let length = dot(vector, vector).sqrt();
        let inverse = R::splat(1.0).divide(length + R::splat(f32::MIN_POSITIVE));
        Self { vector, length, inverse }
    }

    /// Of `g` under `C`.
    #[inline(always)]
    pub(super) fn of_cofactor(deformation: &Deformation<R>, gradient: Vector<R>) -> Self {
        let mut c = [R::splat(0.0); 3];
        for (i, component) in c.iter_mut().enumerate() {
            for (j, &along) in gradient.iter().enumerate() {
                *component = *component + deformation.cofactor(i, j) * along;
            }
        }
        Self::new(c)
    }

    /// `weight v v^T / |v|`.
    #[inline(always)]
    pub(super) fn matrix(&self, weight: R) -> Symmetric<R> {
        Symmetric {
            xx: self.entry(weight, 0, 0),
            yy: self.entry(weight, 1, 1),
            zz: self.entry(weight, 2, 2),
            xy: self.entry(weight, 0, 1),
            yz: self.entry(weight, 1, 2),
            zx: self.entry(weight, 2, 0),
        }
    }

    #[inline(always)]
    fn entry(&self, weight: R, i: usize, j: usize) -> R {
        (self.inverse * self.vector[i]) * (weight * self.vector[j])
    }
}

/// A shape function gradient `g` with its images `C g`, `E g`, `X g` and the matrix of `b -> F (g x b)`.
struct Images<R> {
    gradient: Vector<R>,
    cross: [[R; 3]; 3],
    c: Image<R>,
    e: Image<R>,
    x: Image<R>,
}

impl<R: Real> Images<R> {
    /// The sum of [`Image::entry`] over the three images.
    #[inline(always)]
    fn entry(&self, [weight_c, weight_e, weight_x]: [R; 3], i: usize, j: usize) -> R {
        self.c.entry(weight_c, i, j) + self.e.entry(weight_e, i, j) + self.x.entry(weight_x, i, j)
    }
}

impl<R: Real> Terms<R> {
    #[inline(always)]
    pub(super) fn new<L: Law>(law: &L::Wide<R>, local: &LawState<R>, deformation: &Deformation<R>) -> Self {
        let stiffening = local.stiffening::<L>(law);
        Self::of((local.slope, local.volume_factor()), [local.bulk, local.pressure, stiffening], deformation)
    }

    /// Of crushed elements.
    #[inline(always)]
    pub(super) fn of_barrier(barrier: &Barrier<R>, deformation: &Deformation<R>) -> Self {
        Self::of((barrier.slope, barrier.factor), [R::splat(0.0); 3], deformation)
    }

    /// From `W'`, from `g` with its derivatives, and from `U''`, `U'` and `W''`.
    #[inline(always)]
    fn of(
        (slope, [g, dg, ddg]): (R, [R; 3]),
        [bulk, pressure, stiffening]: [R; 3],
        deformation: &Deformation<R>,
    ) -> Self {
        let (zero, two) = (R::splat(0.0), R::splat(2.0));
        let i1 = deformation.invariants.i + R::splat(3.0);
        let volume = bulk + slope * (R::splat(4.0) * dg + ddg * i1);
        // 4 W' g' (C:dF)(E:dF), split with r = |E| / |C|.
        let coupling = (two * slope * dg).abs();
        let (mut c, mut e) = (zero, zero);
        for i in 0..3 {
            for j in 0..3 {
                c = c + deformation.cofactor(i, j) * deformation.cofactor(i, j);
                e = e + deformation.distortion(i, j) * deformation.distortion(i, j);
            }
        }
        let tiny = R::splat(1e-12);
        let ratio = (e + tiny).divide(c + tiny).sqrt();
        Self {
            p1: two * slope * g,
            p_j: pressure + slope * dg * i1,
            stiffening,
            volume: (volume + coupling * ratio).max(zero),
            coupling: coupling.divide(ratio),
            x_f: two * g,
            x_c: dg * i1,
        }
    }

    #[inline(always)]
    fn images(&self, deformation: &Deformation<R>, gradient: Vector<R>) -> Images<R> {
        let zero = [R::splat(0.0); 3];
        let (mut c, mut e, mut x) = (zero, zero, zero);
        for i in 0..3 {
            for (j, &component) in gradient.iter().enumerate() {
                c[i] = c[i] + deformation.cofactor(i, j) * component;
                e[i] = e[i] + deformation.distortion(i, j) * component;
            }
            x[i] = self.x_f * (e[i] + c[i]) + self.x_c * c[i];
        }
        let cross = cross_matrix(deformation, gradient);
        Images { gradient, cross, c: Image::new(c), e: Image::new(e), x: Image::new(x) }
    }

    /// Upper bound of `|K_ab|` of the geometric part, 1/s^2. The root of a sum of squares would overflow for a law at
    /// its cap. Instead, for `p >= q >= 0`, `sqrt(p^2 + q^2) <= p + (sqrt 2 - 1) q`.
    #[inline(always)]
    fn geometric(&self, a: &Images<R>, b: &Images<R>) -> R {
        let g = b.gradient;
        let along = (self.p1 * dot(a.gradient, g)).abs();
        let [x, y, z] = a.cross;
        let cross = [dot(x, g), dot(y, g), dot(z, g)];
        let across = self.p_j.abs() * dot(cross, cross).sqrt();
        along.max(across) + along.min(across) * R::splat(core::f32::consts::SQRT_2 - 1.0)
    }
}

/// The matrix of `b -> F (a x b)`.
#[inline(always)]
fn cross_matrix<R: Real>(deformation: &Deformation<R>, a: Vector<R>) -> [[R; 3]; 3] {
    let mut matrix = [[R::splat(0.0); 3]; 3];
    for (i, row) in matrix.iter_mut().enumerate() {
        let f0 = deformation.distortion(i, 0) + deformation.cofactor(i, 0);
        let f1 = deformation.distortion(i, 1) + deformation.cofactor(i, 1);
        let f2 = deformation.distortion(i, 2) + deformation.cofactor(i, 2);
        *row = [a[2] * f1 - a[1] * f2, a[0] * f2 - a[2] * f0, a[1] * f0 - a[0] * f1];
    }
    matrix
}

#[cfg(test)]
mod tests {
    use std::{vec, vec::Vec};

    use super::*;
    use crate::material::Material;
    use crate::material::NeoHookean;
    use crate::mesh::Bar;
    use crate::scene::test_scene::scene_of;
    use crate::simd::Baseline;

    #[test]
    fn scalar_code_gives_the_bits_of_vectorised_code() {
        let law = NeoHookean { c: 1_500.0, d: 60_000.0 };
        let (points, scene) = scene_of(law, Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 5] });
        let results = [false, true].map(|scalar| {
            let bent = |&[x, y, z]: &[f32; 3]| NodeVector([0.9 * z * z, 0.2 * x - 0.1 * y, 4.0 * x * z, 0.0]);
            let mut displacement: Vec<_> = points.iter().map(bent).collect();
            let mut first = vec![NodeVector::ZERO; points.len()];
            let mut second = first.clone();
            let mut sums =
                NodeMatrices { xx_yy_zz_xy: &mut first, yz_in_padding: &mut second, zx_in_padding: &mut displacement };
            let scene = scene.view();
            let (laws, tiles, inertia) = (scene.material.laws(), scene.tiles, scene.inertia);
            let kernel =
                CriticalBounds { laws, pressure: OwnPressure, tiles, inertia, with_volume: true, sums: &mut sums };
            if scalar {
                kernel.run_scalar()
            } else {
                kernel.run::<Baseline>()
            }
            [first, second, displacement].concat().into_iter().map(|vector| vector.0.map(f32::to_bits)).collect()
        });
        let [vectorised, scalar]: [Vec<[u32; 4]>; 2] = results;
        assert!(scalar == vectorised && scalar.iter().any(|sums| sums[0] != 0));
    }
}
