//! Tetrahedra with stabilised nodal strain in float64, from their definition: energy `sum_a V_a W(F_a) + s mu / 2 sum_a
//! sum_{e with a} (V_e / 4) |F_e - F_a|^2` with `F_a = sum_e (V_e / 4) F_e / V_a`, the sums for each tissue by itself,
//! `s` 0.4 and `mu` the shear modulus at rest (Dohrmann et al. 2000; Puso & Solberg 2006). Each element that is crushed
//! below `J0 = 0.5` adds `V_e mu / 6 (F:F) h(J)`, `h = 1.5 (J0 - J)^2 / (J0 J)`, along its tangent below `J = 0.15`.

use super::nodal_pressure::Tissues;
use super::tensor::{IDENTITY, Mat3, Vec3, apply, cross, determinant, from_fn};

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

/// `h(J)` and `h'(J)` of crushed elements.
fn barrier(j: f64) -> (f64, f64) {
    let (onset, floor) = (0.5, 0.15);
    let h = |j: f64| 1.5 * (onset - j).powi(2) / (onset * j);
    let slope = |j: f64| 1.5 * (1.0 / onset - onset / (j * j));
    if j >= onset {
        (0.0, 0.0)
    } else if j > floor {
        (h(j), slope(j))
    } else {
        (h(floor) + slope(floor) * (j - floor), slope(floor))
    }
}

/// The stress by which a crushed element resists, Pa, from the shear modulus at rest, Pa.
pub fn barrier_stress(shear: f64, f: &Mat3) -> Mat3 {
    let (h, slope) = barrier(determinant(f));
    let cofactor = [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])];
    from_fn(|i, j| shear / 6.0 * (2.0 * h * f[i][j] + slope * square(f) * cofactor[i][j]))
}

fn square(f: &Mat3) -> f64 {
    f.iter().flatten().map(|x| x * x).sum()
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
            let square = square(&from_fn(|i, j| gradients[e][i][j] - mean[i][j]));
            energy += 0.5 * modulus(body, tissue) * 0.25 * volume * square;
        }
        let (h, _) = barrier(determinant(&gradients[e]));
        energy += volume * modulus(body, tissue) / SHARE / 6.0 * square(&gradients[e]) * h;
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
        let own = barrier_stress(stabilising / SHARE, &gradients[e]);
        let stress: Mat3 = from_fn(|i, j| 0.25 * stresses.iter().map(|p| p[i][j]).sum::<f64>() + own[i][j]);
        for (node, gradient) in tet.iter().zip(element.gradients) {
            let force = apply(&stress, gradient);
            for (sum, force) in forces[*node].iter_mut().zip(force) {
                *sum -= element.volume * force;
            }
        }
    }
    forces
}
