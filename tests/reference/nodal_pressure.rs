//! Tetrahedra with average nodal pressure in float64, from their definition: energy `sum_e V_e W(F_e) + sum_a V_a
//! U(J_a)` with `J_a = sum_e (V_e / 4) J_e / V_a`, the sums for each tissue by itself (Bonet & Burton 1998; Joldes,
//! Wittek & Miller 2009).

use super::tensor::{Mat3, Vec3, apply, cross, determinant, from_fn};
use super::{Law, Mesh};

/// A body of several tissues: for each element the index of its law.
pub struct Tissues<'a> {
    pub mesh: &'a Mesh,
    pub laws: &'a [Law],
    pub of_element: &'a [usize],
}

impl Tissues<'_> {
    /// `J_a - 1` of node and tissue, with the volume that it is a mean over.
    fn nodal(&self, j: &[f64]) -> Vec<Vec<(f64, f64)>> {
        let mut sums = vec![vec![(0.0, 0.0); self.laws.len()]; self.mesh.points.len()];
        for (e, (tet, volume)) in self.mesh.tets.iter().zip(self.mesh.volumes()).enumerate() {
            for &node in tet {
                let sum = &mut sums[node][self.of_element[e]];
                sum.0 += 0.25 * volume * j[e];
                sum.1 += 0.25 * volume;
            }
        }
        for sum in sums.iter_mut().flatten() {
            sum.0 /= sum.1.max(f64::MIN_POSITIVE);
        }
        sums
    }

    fn changes(&self, u: &[Vec3]) -> Vec<f64> {
        self.mesh.deformation_gradients(u).iter().map(|f| determinant(f) - 1.0).collect()
    }

    /// Strain energy, J.
    pub fn energy(&self, u: &[Vec3]) -> f64 {
        let gradients = self.mesh.deformation_gradients(u);
        let mut energy = 0.0;
        for (e, (f, volume)) in gradients.iter().zip(self.mesh.volumes()).enumerate() {
            let law = &self.laws[self.of_element[e]];
            energy += volume * (law.energy(f) - law.d() * (determinant(f) - 1.0).powi(2));
        }
        for node in self.nodal(&self.changes(u)) {
            for ((j, volume), law) in node.iter().zip(self.laws) {
                energy += volume * law.d() * j * j;
            }
        }
        energy
    }

    /// Forces of the elements on the nodes, N.
    pub fn forces(&self, u: &[Vec3]) -> Vec<Vec3> {
        let nodal = self.nodal(&self.changes(u));
        let gradients = self.mesh.deformation_gradients(u);
        let mut forces = vec![[0.0; 3]; u.len()];
        for (e, (element, f)) in self.mesh.elements().iter().zip(&gradients).enumerate() {
            let (tissue, tet) = (self.of_element[e], self.mesh.tets[e]);
            let law = &self.laws[tissue];
            let mean = tet.iter().map(|&node| 2.0 * law.d() * nodal[node][tissue].0).sum::<f64>() / 4.0;
            let own = 2.0 * law.d() * (determinant(f) - 1.0);
            let (p, c) = (law.first_piola(f), [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])]);
            let stress: Mat3 = from_fn(|i, j| p[i][j] + (mean - own) * c[i][j]);
            for (node, gradient) in tet.into_iter().zip(element.gradients) {
                let force = apply(&stress, gradient);
                for (sum, force) in forces[node].iter_mut().zip(force) {
                    *sum -= element.volume * force;
                }
            }
        }
        forces
    }
}
