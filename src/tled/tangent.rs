//! An element's stress and tangent in float64, `P = p1 F + pJ C`, `dP = p1 dF + dp1 F + dpJ C + pJ dC` with the
//! cofactor matrix `C` of the deformation gradient `F`: for tools and tests. SI units.

use core::array::from_fn;

use glam::{DMat3, DVec3};

use crate::element::{ElementTile, FibreTangent, barrier_factor, barrier_modulus, cofactor, inner, outer, place_in};
use crate::material::{Invariants, Law, Material, Potential, VolumeFactor};
use crate::scene::SceneView;
use crate::simd::NodeVector;

/// One element at given displacements: its stress and the derivative of it.
pub struct ElementTangent {
    /// The element's nodes.
    pub nodes: [usize; 4],
    gradients: [DVec3; 4],
    volume: f64,
    pub(super) at: LawTangent,
}

/// The stress of a law at a deformation gradient, and the derivative of it.
pub(super) struct LawTangent {
    f: DMat3,
    cofactor: DMat3,
    /// `p1`, `pJ`, `W''`, `2 W' g'`, `U'' + W' g'' I1`.
    p1: f64,
    p_j: f64,
    stiffening: f64,
    coupling: f64,
    bulk: f64,
    /// Bulk modulus of the law.
    bulk_modulus: f64,
    /// `J - 1`.
    pub(super) change: f64,
    /// `dx/dF = x_f F + x_c C`.
    x_f: f64,
    x_c: f64,
    /// Of the fibres, if there are any.
    fibres: Option<FibreTangent>,
}

/// The elements of a scene at displacements (m) of its nodes, in the order of its tables, each by itself: with nodal
/// pressure and nodal strain its neighbours do not count.
pub fn element_tangents<M: Material>(
    scene: SceneView<'_, M>,
    displacement: impl Fn(usize) -> [f64; 3],
) -> impl Iterator<Item = ElementTangent> {
    scene
        .places()
        .map(move |(tile, lane)| ElementTangent::new(scene, tile, lane, |node| DVec3::from_array(displacement(node))))
}

impl ElementTangent {
    /// Of the element in a lane of a tile, at the displacements (m) of all nodes.
    pub(super) fn of<M: Material>(
        scene: SceneView<'_, M>,
        tile: &ElementTile,
        lane: usize,
        displacement: &[NodeVector],
    ) -> Self {
        let at = |node: usize| {
            let [x, y, z] = displacement[node].to_array().map(f64::from);
            DVec3::new(x, y, z)
        };
        Self::new(scene, tile, lane, at)
    }

    /// The same with displacements in float64.
    fn new<M: Material>(
        scene: SceneView<'_, M>,
        tile: &ElementTile,
        lane: usize,
        displacement: impl Fn(usize) -> DVec3,
    ) -> Self {
        let law = scene.material.laws().of(tile.element(lane));
        let nodes = [0, 1, 2, 3].map(|corner| tile.node(corner, lane));
        let slopes = [0, 1, 2]
            .map(|corner| DVec3::from_array([0, 1, 2].map(|axis| f64::from(tile.gradient::<f32>(corner, axis, lane)))));
        let gradients = [-(slopes[0] + slopes[1] + slopes[2]), slopes[0], slopes[1], slopes[2]];
        let mut h = DMat3::ZERO;
        for (&node, gradient) in nodes.iter().zip(gradients) {
            h += outer(displacement(node), gradient);
        }
        let volume = f64::from(tile.volume::<f32>(lane));
        let of_elements = scene.fibrous().filter(|_| !scene.element().is_nodal_strain());
        let fibres = of_elements.map(|of| of.tangent([place_in(scene.tiles, tile), lane], tile.element(lane), h));
        Self { nodes, gradients, volume, at: LawTangent::new(&law, h, fibres) }
    }

    /// The same with the pressure at another `J - 1`, and without the stiffness of its change.
    pub(super) fn with_change(mut self, change: f64) -> Self {
        self.at.p_j += self.at.bulk_modulus * (change - self.at.change);
        self.at.bulk -= self.at.bulk_modulus;
        self
    }

    /// A quarter of the volume, m^3.
    pub(super) fn quarter(&self) -> f64 {
        0.25 * self.volume
    }

    /// Change of `J` with displacements `v` (m) of its nodes.
    pub(super) fn change_by(&self, vector: [DVec3; 4]) -> f64 {
        self.gradients.iter().zip(vector).map(|(gradient, vector)| (self.at.cofactor * *gradient).dot(vector)).sum()
    }

    /// Forces (N) on its nodes, with minus sign, from a change of the `J` at which the pressure is taken.
    pub(super) fn forces_of_change(&self, change: f64) -> [DVec3; 4] {
        let pressure = self.at.bulk_modulus * change;
        self.gradients.map(|gradient| self.at.cofactor * gradient * (pressure * self.volume))
    }

    /// Change of the displacement gradient with displacements `v` (m) of its nodes.
    pub(super) fn gradient_by(&self, vector: [DVec3; 4]) -> DMat3 {
        vector.into_iter().zip(self.gradients).fold(DMat3::ZERO, |sum, (v, g)| sum + outer(v, g))
    }

    /// Forces (N) on its nodes, with minus sign, from a stress (Pa).
    pub(super) fn forces_of_stress(&self, stress: DMat3) -> [DVec3; 4] {
        self.gradients.map(|gradient| stress * gradient * self.volume)
    }

    /// Forces with which the element acts on its nodes, N.
    #[must_use]
    pub fn forces(&self) -> [[f64; 3]; 4] {
        self.forces_of_stress(-self.at.stress()).map(|force| force.to_array())
    }

    /// `K v`, N, for displacements `v` (m) of its nodes.
    pub(super) fn product(&self, vector: [DVec3; 4]) -> [DVec3; 4] {
        self.forces_of_stress(self.at.stress_by(self.gradient_by(vector)))
    }

    /// The parts of `K`, N/m, by rows and columns of nodes. With `a = F g`, `c = C g`, `y = x_f a + x_c c` for the
    /// gradient `g` of each node: `p1 g_i.g_j + W'' y_i y_j^T + coupling (a_i c_j^T + c_i a_j^T) + bulk c_i c_j^T - pJ
    /// [F (g_i x g_j)]_x`, times the volume. Each part is given as its columns.
    #[must_use]
    pub fn stiffness(&self) -> [[[[f64; 3]; 3]; 4]; 4] {
        let LawTangent { f, cofactor, p1, p_j, stiffening, coupling, bulk, x_f, x_c, fibres, .. } = self.at;
        let along_f = self.gradients.map(|gradient| f * gradient);
        let along_c = self.gradients.map(|gradient| cofactor * gradient);
        from_fn(|i| {
            let (a, c) = (along_f[i], along_c[i]);
            let y = (a * x_f + c * x_c) * stiffening;
            from_fn(|j| {
                let (b, d) = (along_f[j], along_c[j]);
                let turning = f * self.gradients[i].cross(self.gradients[j]) * p_j;
                let sum = DMat3::from_diagonal(DVec3::splat(p1 * self.gradients[i].dot(self.gradients[j])))
                    + outer(y, b * x_f + d * x_c)
                    + outer(a * coupling + c * bulk, d)
                    + outer(c * coupling, b)
                    - cross_matrix(turning)
                    + fibres.map_or(DMat3::ZERO, |fibres| {
                        let along = |axis: DVec3| fibres.stress_by(outer(axis, self.gradients[j])) * self.gradients[i];
                        DMat3::from_cols(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
                    });
                (sum * self.volume).to_cols_array_2d()
            })
        })
    }
}

impl LawTangent {
    /// At the displacement gradient `h`.
    pub(super) fn new<L: Law>(law: &L, h: DMat3, fibres: Option<FibreTangent>) -> Self {
        let f = DMat3::IDENTITY + h;
        let cofactor = cofactor(f);
        let square = inner(f, f);
        let volume_ratio = f.determinant();
        let at = Invariants { i: (square - 3.0) as f32, j: (volume_ratio - 1.0) as f32 };
        let wide = law_at(law);
        let slope = |x: f32| f64::from(wide.distortion_slope(x));
        let curvature = |x: f32| f64::from(wide.distortion_curvature(x, wide.distortion_slope(x)));
        let (bulk_modulus, change) = (f64::from(wide.bulk_modulus()), volume_ratio - 1.0);
        let factor = VolumeFactor::new(at);
        let (g, slope_g, curvature_g) = (f64::from(factor.g), f64::from(factor.slope), f64::from(factor.curvature()));
        Self {
            f,
            cofactor,
            p1: 2.0 * slope(factor.x) * g,
            p_j: bulk_modulus * change + slope(factor.x) * slope_g * square,
            stiffening: curvature(factor.x),
            coupling: 2.0 * slope(factor.x) * slope_g,
            bulk: bulk_modulus + slope(factor.x) * curvature_g * square,
            bulk_modulus,
            change,
            x_f: 2.0 * g,
            x_c: slope_g * square,
            fibres,
        }
    }

    /// Of the energy that an element with nodal strain has of its own where it is crushed, at the same deformation.
    pub(super) fn of_barrier<L: Law>(&self, law: &L) -> Option<Self> {
        let [h, slope, curvature] = barrier_factor(1.0 + self.change);
        if slope == 0.0 {
            return None;
        }
        let (modulus, square) = (f64::from(barrier_modulus(law)), inner(self.f, self.f));
        Some(Self {
            p1: 2.0 * modulus * h,
            p_j: modulus * slope * square,
            stiffening: 0.0,
            coupling: 2.0 * modulus * slope,
            bulk: modulus * curvature * square,
            bulk_modulus: 0.0,
            x_f: 0.0,
            x_c: 0.0,
            fibres: None,
            ..*self
        })
    }

    /// The first Piola-Kirchhoff stress, Pa.
    fn stress(&self) -> DMat3 {
        let of_fibres = self.fibres.map_or(DMat3::ZERO, |fibres| fibres.stress());
        self.f * self.p1 + self.cofactor * self.p_j + of_fibres
    }

    /// Its change with one of the deformation gradient.
    pub(super) fn stress_by(&self, df: DMat3) -> DMat3 {
        let (f, c) = (self.f, self.cofactor);
        let (df_f, df_c) = (inner(f, df), inner(c, df));
        let dx = self.x_f * df_f + self.x_c * df_c;
        let d_cofactor = cofactor(f + df) - cofactor(f - df);
        df * self.p1
            + (f * self.x_f + c * self.x_c) * (self.stiffening * dx)
            + f * (self.coupling * df_c)
            + c * (self.coupling * df_f + self.bulk * df_c)
            + d_cofactor * (0.5 * self.p_j)
            + self.fibres.map_or(DMat3::ZERO, |fibres| fibres.stress_by(df))
    }
}

fn law_at<L: Law>(law: &L) -> L::Wide<f32> {
    law.splat()
}

/// `[a]_x`, so that `[a]_x b` is the cross product of a and b.
fn cross_matrix(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
}

#[cfg(test)]
mod tests {
    use std::println;

    use super::*;
    use crate::material::Exponential;
    use crate::mesh::Bar;
    use crate::scene::test_scene::scene_of;

    /// Both the product and the parts of the stiffness are derivatives of the forces, far from rest.
    #[test]
    fn the_tangent_is_the_derivative_of_the_forces() {
        let bar = Bar { size: [0.02, 0.03, 0.04], cells: [1, 1, 1] };
        let (_, scene) = scene_of(Exponential { a: 500.0, b: 8.0, d: 6e4 }, bar);
        let wave = |node: usize, k: f64| {
            DVec3::new((node as f64 + k).sin(), (2.0 * node as f64 + k).cos(), (3.0 * node as f64 - k).sin())
        };
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for (tile, lane) in scene.view().places() {
            let at = |t: f64| {
                ElementTangent::new(scene.view(), tile, lane, |node| 2e-3 * wave(node, 0.3) + t * wave(node, 1.1))
            };
            let tangent = at(0.0);
            // The law is evaluated in float32: a step much smaller would be lost in its rounding.
            let h = 2e-6;
            let [after, before] = [h, -h].map(|t| at(t).forces().map(DVec3::from_array));
            let directions = tangent.nodes.map(|node| wave(node, 1.1));
            let products = tangent.product(directions);
            let parts = tangent.stiffness().map(|row| row.map(|part| DMat3::from_cols_array_2d(&part)));
            for i in 0..4 {
                let numeric = (before[i] - after[i]) / (2.0 * h);
                let by_parts: DVec3 = (0..4).map(|j| parts[i][j] * directions[j]).sum();
                worst = worst.max((products[i] - numeric).length()).max((by_parts - products[i]).length() * 1e6);
                largest = largest.max(products[i].length());
            }
        }
        println!("difference {worst:.1e} of {largest:.1e} N/m");
        assert!(worst < 2e-3 * largest && largest > 1.0);
    }
}
