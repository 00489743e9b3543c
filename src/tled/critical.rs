//! The largest stable step: central differences are stable while `dt < 2 / omega_max`, with `omega_max^2`
//! the largest eigenvalue of `M^-1 K(u)` and `K` the tangent stiffness at the current displacement. Lumped
//! damping does not lower the limit, as it is taken at the middle of the step.
//!
//! The bound needs no iteration: every term of an element's tangent is a quadratic form that is bounded
//! by a block-diagonal one, a 3 x 3 matrix `D_a` for each node; then
//! `omega_max^2 <= max_a lambda_max(sum_e D_a^e)` of the mass-weighted matrices. With the variation `dF = sum_a v_a (x) ga`:
//!
//! ```text
//! P        = p1 F + pJ C,   C = cof F,   E = F - C (zero at rest),   X = dx/dF
//! dF:A:dF  = p1 |dF|^2 + pJ dF:(dC/dF):dF              geometric: K_ab = p1 (ga.gb) I + pJ [F (ga x gb)]x
//!          + W'' (X:dF)^2                              stiffening of the law
//!          + (U'' + W' (4 g' + g'' I1)) (C:dF)^2       volume
//!          + 4 W' g' (C:dF) (E:dF)                     coupling, split by 2 x y <= r x^2 + y^2 / r
//! (C:dF)^2 = (sum_a (C ga).va)^2 <= (sum_b |C gb|) sum_a va.(C ga)(C ga).va / |C ga|      Cauchy-Schwarz
//! ```
//! The geometric part, small in nearly incompressible tissue, is bounded by its row sums, with
//! `|K_ab| = sqrt(p1^2 (ga.gb)^2 + pJ^2 |F (ga x gb)|^2)`, rounded up by at most 8 %. Keeping the directions of `C ga` is worth a
//! factor of up to `sqrt 3` in the step against row sums of norms (Gershgorin).
//!
//! No term is left out, so the bound holds for any state, inverted elements included.

use crate::lanes::{BLOCK, Gather, Kernel, Real, Scatter, Waiting, dot};
use crate::material::{Law, Laws, Local, Material, Potential};
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::state::{NodeVector, State};
use crate::symmetric::Symmetric;

use super::element::{Deformation, Vector};

/// A bound on the stable step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CriticalStep {
    /// Steps up to this many seconds are stable.
    pub seconds: f32,
    /// The node that sets it.
    pub node: u32,
}

/// Relative rounding of the sums; the bound is lowered by it.
const ROUNDING: f32 = 1e-5;

/// A bound on the stable step at the state's displacement (at rest for a fresh one), never above the
/// exact limit. It takes as long as some six steps and may be called between any two steps. The state's forces and
/// the padding of its vectors serve as scratch. Nothing if the state is too small for the scene or not finite.
pub fn critical_step<M, N, B, S>(scene: &Scene<M, N, B>, state: &mut State<S>) -> Option<CriticalStep>
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
{
    let count = scene.node_count();
    let displacement = state.displacement.as_mut().get_mut(..count)?;
    let increment = state.increment.as_mut().get_mut(..count)?;
    let force = state.force.as_mut().get_mut(..count)?;
    let mut sums = Sums { xx_yy_zz_xy: force, yz_in_padding: increment, zx_in_padding: displacement };
    sums.clear();
    let (laws, blocks, inertia) = (scene.material().laws(), scene.blocks(), scene.inertia());
    M::Law::critical_bounds(CriticalBounds { laws, blocks, inertia, sums: &mut sums });
    let mut largest = (0.0, 0);
    let mut finite = true;
    for (node, inertia) in scene.inertia().iter().enumerate() {
        let rate = sums.largest_eigenvalue(node, inertia.inverse);
        finite &= rate.is_finite();
        if rate > largest.0 {
            largest = (rate, node as u32);
        }
    }
    sums.clear();
    let seconds = 2.0 / libm::sqrtf(largest.0) * (1.0 - ROUNDING);
    finite.then_some(CriticalStep { seconds, node: largest.1 })
}

/// Symmetric 3 x 3 matrices of the nodes, 1/s^2.
struct Sums<'a> {
    xx_yy_zz_xy: &'a mut [NodeVector],
    yz_in_padding: &'a mut [NodeVector],
    zx_in_padding: &'a mut [NodeVector],
}

impl Sums<'_> {
    fn clear(&mut self) {
        self.xx_yy_zz_xy.fill(NodeVector::ZERO);
        for vectors in [&mut *self.yz_in_padding, &mut *self.zx_in_padding] {
            for vector in vectors {
                vector.0[3] = 0.0;
            }
        }
    }

    /// A close upper bound of the largest eigenvalue of the node's matrix on its free axes, 1/s^2.
    fn largest_eigenvalue(&self, node: usize, inverse: [f32; 3]) -> f32 {
        let read = |vectors: &[NodeVector]| vectors.get(node).copied().unwrap_or_default().0;
        let [xx, yy, zz, xy] = read(self.xx_yy_zz_xy);
        let (yz, zx) = (read(self.yz_in_padding)[3], read(self.zx_in_padding)[3]);
        Symmetric { xx, yy, zz, xy, yz, zx }.on_free(inverse).largest_eigenvalue()
    }
}

/// Adds the bounds of all elements to the sums of their nodes.
pub struct CriticalBounds<'a, 'b, L> {
    laws: Laws<'a, L>,
    blocks: &'a [ElementBlock],
    inertia: &'a [NodeInertia],
    sums: &'a mut Sums<'b>,
}

impl<L: Law> Kernel for CriticalBounds<'_, '_, L> {
    type Output = ();

    const ONE_BY_ONE: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        // The first three numbers of a node's inertia are its inverse masses.
        let inertia = Gather::new(bytemuck::must_cast_slice(self.inertia));
        for block in self.blocks {
            let mut waiting = [Waiting::NONE; 3];
            for first in (0..BLOCK).step_by(R::COUNT) {
                let law = self.laws.widen(|lane| block.element(first + lane));
                add_bounds::<R, L>(&law, block, first, inertia, self.sums, &mut waiting);
            }
        }
    }
}

/// Adds each element's nodal matrices to the sums, all of `M^-1/2 K M^-1/2`: gradients are multiplied by the
/// root of the volume over their node's mass, which keeps float32 in range and leaves light nodes among heavy ones a closer bound. Nodes that are held
/// along all axes count as infinitely heavy.
#[inline(always)]
fn add_bounds<R: Real, L: Law>(
    law: &L::Wide<R>,
    block: &ElementBlock,
    first: usize,
    inertia: Gather<'_>,
    sums: &mut Sums<'_>,
    [of_first_four, of_fifth, of_sixth]: &mut [Waiting<4>; 3],
) {
    let displacement = Gather::new(sums.zx_in_padding);
    let Some(nodes) = block.nodes_below::<R>(displacement.count()) else {
        return;
    };
    let deformation = Deformation::<R>::of_block(block, first, displacement);
    let terms = Terms::<R>::new::<L>(law, &deformation);
    let mut gradients = [[R::splat(0.0); 3]; 4];
    for corner in 1..4 {
        gradients[corner] = block.gradients(corner - 1, first);
    }
    for axis in 0..3 {
        gradients[0][axis] = -(gradients[1][axis] + gradients[2][axis] + gradients[3][axis]);
    }
    let volume = block.volume::<R>(first).sqrt();
    for (corner, gradient) in gradients.iter_mut().enumerate() {
        let [x, y, z] = inertia.read_lanes::<R, 4>(&nodes, corner, first);
        let root = x.max(y).max(z).max(R::splat(0.0)).sqrt() * volume;
        *gradient = [gradient[0] * root, gradient[1] * root, gradient[2] * root];
    }
    // No closures over vectors from here on: those may stay calls, which do nothing but add two numbers.
    let [g0, g1, g2, g3] = gradients;
    let images = [
        terms.images(&deformation, g0),
        terms.images(&deformation, g1),
        terms.images(&deformation, g2),
        terms.images(&deformation, g3),
    ];
    let [i0, i1, i2, i3] = &images;
    let by_c = terms.volume * (i0.c.length + i1.c.length + i2.c.length + i3.c.length);
    let by_e = terms.coupling * (i0.e.length + i1.e.length + i2.e.length + i3.e.length);
    let by_x = terms.stiffening * (i0.x.length + i1.x.length + i2.x.length + i3.x.length);

    let mut rows = [R::splat(0.0); 4];
    for a in 0..4 {
        rows[a] = rows[a] + terms.geometric(&images[a], &images[a]);
        for b in 0..a {
            let norm = terms.geometric(&images[a], &images[b]);
            rows[a] = rows[a] + norm;
            rows[b] = rows[b] + norm;
        }
    }
    let zero = R::splat(0.0);
    let (mut first_four, mut fifth, mut sixth) = ([[zero; 4]; 4], [[zero; 4]; 4], [[zero; 4]; 4]);
    for corner in 0..4 {
        let isotropic = rows[corner];
        let of = &images[corner];
        first_four[corner] = [
            of.entry([by_c, by_e, by_x], 0, 0) + isotropic,
            of.entry([by_c, by_e, by_x], 1, 1) + isotropic,
            of.entry([by_c, by_e, by_x], 2, 2) + isotropic,
            of.entry([by_c, by_e, by_x], 0, 1),
        ];
        fifth[corner][3] = of.entry([by_c, by_e, by_x], 1, 2);
        sixth[corner][3] = of.entry([by_c, by_e, by_x], 2, 0);
    }
    Scatter::new(sums.xx_yy_zz_xy).add_corners(&nodes, first, first_four, of_first_four);
    Scatter::new(sums.yz_in_padding).add_corners(&nodes, first, fifth, of_fifth);
    Scatter::new(sums.zx_in_padding).add_corners(&nodes, first, sixth, of_sixth);
}

/// Magnitudes of the terms of the tangent, Pa.
struct Terms<R> {
    p1: R,
    p_j: R,
    stiffening: R,
    /// Of `(C:dF)^2`, its share of the coupling included.
    volume: R,
    /// Of `(E:dF)^2`: the other share of the coupling.
    coupling: R,
    /// `X = x_f F + x_c C`.
    x_f: R,
    x_c: R,
}

/// A matrix applied to a shape function gradient: the vector, its length and the inverse of that.
struct Image<R> {
    vector: Vector<R>,
    length: R,
    inverse: R,
}

impl<R: Real> Image<R> {
    #[inline(always)]
    fn new(vector: Vector<R>) -> Self {
        let length = dot(vector, vector).sqrt();
        let inverse = R::splat(1.0).over(length + R::splat(f32::MIN_POSITIVE));
        Self { vector, length, inverse }
    }

    /// `weight v_i v_j / |v|`.
    #[inline(always)]
    fn entry(&self, weight: R, i: usize, j: usize) -> R {
        (self.inverse * self.vector[i]) * (weight * self.vector[j])
    }
}

/// A shape function gradient `g` with `C g`, `E g`, `X g` and the matrix of `b -> F (g x b)`.
struct Images<R> {
    gradient: Vector<R>,
    cross: [[R; 3]; 3],
    c: Image<R>,
    e: Image<R>,
    x: Image<R>,
}

impl<R: Real> Images<R> {
    /// The three [`Image::entry`]s of an entry.
    #[inline(always)]
    fn entry(&self, [by_c, by_e, by_x]: [R; 3], i: usize, j: usize) -> R {
        self.c.entry(by_c, i, j) + self.e.entry(by_e, i, j) + self.x.entry(by_x, i, j)
    }
}

impl<R: Real> Terms<R> {
    #[inline(always)]
    fn new<L: Law>(law: &L::Wide<R>, deformation: &Deformation<R>) -> Self {
        let at = deformation.invariants;
        let (zero, two) = (R::splat(0.0), R::splat(2.0));
        let local = Local::new::<L>(law, at);
        let (slope, [g, dg, ddg]) = (local.slope, local.volume_factor());
        let i1 = at.i + R::splat(3.0);
        let volume = law.volume_curvature(at.j) + slope * (R::splat(4.0) * dg + ddg * i1);
        // 4 W' g' (C:dF)(E:dF), split at r = |E| / |C|
        let coupling = (two * slope * dg).abs();
        let (mut c, mut e) = (zero, zero);
        for i in 0..3 {
            for j in 0..3 {
                c = c + deformation.cofactor(i, j) * deformation.cofactor(i, j);
                e = e + deformation.distortion(i, j) * deformation.distortion(i, j);
            }
        }
        let little = R::splat(1e-12);
        let ratio = (e + little).over(c + little).sqrt();
        Self {
            p1: two * slope * g,
            p_j: law.volume_slope(at.j) + slope * dg * i1,
            stiffening: local.stiffening::<L>(law),
            volume: (volume + coupling * ratio).max(zero),
            coupling: coupling.over(ratio),
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

    /// `|K_ab|` of the geometric part, 1/s^2. Not the root of a sum of squares, which would overflow for
    /// a law at its cap: for `p >= q >= 0`, `sqrt(p^2 + q^2) <= p + (sqrt 2 - 1) q`.
    #[inline(always)]
    fn geometric(&self, a: &Images<R>, b: &Images<R>) -> R {
        let g = b.gradient;
        let along = (self.p1 * dot(a.gradient, g)).abs();
        let [x, y, z] = a.cross;
        let turned = [dot(x, g), dot(y, g), dot(z, g)];
        let across = self.p_j.abs() * dot(turned, turned).sqrt();
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
    use crate::lanes::Lanes;
    use crate::material::NeoHookean;
    use crate::mesh::Bar;
    use crate::tled::test_scene::scene_of;

    #[test]
    fn numbers_one_by_one_give_the_bits_of_eight_side_by_side() {
        let law = NeoHookean { c: 1_500.0, d: 60_000.0 };
        let (points, scene) = scene_of(law, Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 5] });
        let found = [false, true].map(|one_by_one| {
            let bent = |&[x, y, z]: &[f32; 3]| NodeVector([0.9 * z * z, 0.2 * x - 0.1 * y, 4.0 * x * z, 0.0]);
            let mut displacement: Vec<_> = points.iter().map(bent).collect();
            let mut first = vec![NodeVector::ZERO; points.len()];
            let mut second = first.clone();
            let mut sums = Sums {
                xx_yy_zz_xy: &mut first,
                yz_in_padding: &mut second,
                zx_in_padding: &mut displacement,
            };
            let (laws, blocks, inertia) = (scene.material().laws(), scene.blocks(), scene.inertia());
            let kernel = CriticalBounds { laws, blocks, inertia, sums: &mut sums };
            if one_by_one {
                kernel.run::<f32>()
            } else {
                kernel.run::<Lanes<8>>()
            }
            [first, second, displacement]
                .concat()
                .into_iter()
                .map(|vector| vector.0.map(f32::to_bits))
                .collect()
        });
        let [eight, one]: [Vec<[u32; 4]>; 2] = found;
        assert!(one == eight && one.iter().any(|sums| sums[0] != 0));
    }
}
