//! Tetrahedra with stabilised nodal strain in float64, from their definition: energy `sum_a V_a W(F_a) + s mu / 2 sum_a
//! sum_{e with a} (V_e / 4) |F_e - F_a|^2` with `F_a = sum_e (V_e / 4) F_e / V_a`, the sums for each tissue by itself,
//! `s` 0.4 and `mu` the shear modulus at rest (Dohrmann et al. 2000; Puso & Solberg 2006).

use super::nodal_pressure::Tissues;
use super::tensor::{IDENTITY, Mat3, Vec3, apply, determinant, from_fn};

const SHARE: f64 = 0.4;

/// For each node and tissue the mean deformation gradient and the volume that it is a mean over.
fn means(body: &Tissues<'_>, gradients: &[Mat3]) -> Vec<Vec<(Mat3, f64)>> {
    let mut sums = vec![vec![([[0.0; 3]; 3], 0.0); body.laws.len()]; body.mesh.points.len()];
    for (e, (tet, volume)) in body.mesh.tets.iter().zip(body.mesh.volumes()).enumerate() {
        for &node in tet {
            let (sum, whole) = &mut sums[node][body.of_element[e]];
            *sum = from_fn(|i, j| sum[i][j] + 0.25 * volume * gradients[e][i][j]);
            *whole += 0.25 * volume;
        }
    }
    for (mean, volume) in sums.iter_mut().flatten() {
        *mean = if *volume > 0.0 { from_fn(|i, j| mean[i][j] / *volume) } else { IDENTITY };
    }
    sums
}

fn modulus(body: &Tissues<'_>, tissue: usize) -> f64 {
    let [_, slope, _] = body.laws[tissue].shape_response(0.0);
    SHARE * 2.0 * slope
}

/// Strain energy, J.
pub fn energy(body: &Tissues<'_>, u: &[Vec3]) -> f64 {
    let gradients = body.mesh.deformation_gradients(u);
    let means = means(body, &gradients);
    let mut energy = 0.0;
    for node in &means {
        for ((f, volume), law) in node.iter().zip(body.laws) {
            energy += volume * law.energy(f);
        }
    }
    for (e, (tet, volume)) in body.mesh.tets.iter().zip(body.mesh.volumes()).enumerate() {
        let tissue = body.of_element[e];
        for &node in tet {
            let (mean, _) = means[node][tissue];
            let square: f64 = (0..9).map(|k| (gradients[e][k / 3][k % 3] - mean[k / 3][k % 3]).powi(2)).sum();
            energy += 0.5 * modulus(body, tissue) * 0.25 * volume * square;
        }
    }
    energy
}

/// The least volume ratio of the mean deformation around a node.
pub fn least_nodal_ratio(body: &Tissues<'_>, u: &[Vec3]) -> f64 {
    let means = means(body, &body.mesh.deformation_gradients(u));
    means.iter().flatten().map(|(f, _)| determinant(f)).fold(f64::INFINITY, f64::min)
}

/// Forces of the elements on the nodes, N.
pub fn forces(body: &Tissues<'_>, u: &[Vec3]) -> Vec<Vec3> {
    let gradients = body.mesh.deformation_gradients(u);
    let means = means(body, &gradients);
    let mut forces = vec![[0.0; 3]; u.len()];
    for (e, (tet, element)) in body.mesh.tets.iter().zip(body.mesh.elements()).enumerate() {
        let tissue = body.of_element[e];
        let stabilising = modulus(body, tissue);
        // Each of its nodes has a quarter of the element's volume. The derivative of the mean in the stabilising energy
        // is zero.
        let stresses = tet.map(|node| {
            let (mean, _) = means[node][tissue];
            let p = body.laws[tissue].first_piola(&mean);
            from_fn(|i, j| p[i][j] + stabilising * (gradients[e][i][j] - mean[i][j]))
        });
        let stress: Mat3 = from_fn(|i, j| 0.25 * stresses.iter().map(|p| p[i][j]).sum::<f64>());
        for (node, gradient) in tet.iter().zip(element.gradients) {
            let force = apply(&stress, gradient);
            for (sum, force) in forces[*node].iter_mut().zip(force) {
                *sum -= element.volume * force;
            }
        }
    }
    forces
}
