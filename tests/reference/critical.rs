//! The largest stable step of central differences, `2 / omega_max`, where `omega_max^2` is the largest
//! eigenvalue of `M^-1 K(u)` on the free degrees of freedom and `K = d f_int / du`.
//!
//! `K` is never assembled: `K v` is `V (A : grad v) grad N_a` summed over the elements. The eigenvalue comes
//! from Lanczos with full reorthogonalisation on `M^-1/2 K M^-1/2` (Golub & Van Loan, Matrix Computations,
//! ch. 10). `K` may be indefinite; wanted is the largest positive eigenvalue. Mass-proportional damping does
//! not change the limit.

use super::law::Law;
use super::mesh::{Element, Mesh};
use super::tensor::{Mat9, Vec3, apply, from_fn};

/// Relative accuracy of `omega_max^2`.
const TOLERANCE: f64 = 1e-6;
/// More Lanczos vectors than any mesh of the tests needs.
const MAX_VECTORS: usize = 2000;

/// `K(u) v` in N, for `v` in m.
pub fn tangent_product(mesh: &Mesh, law: &Law, u: &[Vec3], v: &[Vec3]) -> Vec<Vec3> {
    let elements = mesh.elements();
    product(&elements, &tangents(&elements, law, u), v)
}

fn tangents(elements: &[Element], law: &Law, u: &[Vec3]) -> Vec<Mat9> {
    elements.iter().map(|e| law.tangent(&e.deformation_gradient(u))).collect()
}

fn product(elements: &[Element], tangents: &[Mat9], v: &[Vec3]) -> Vec<Vec3> {
    let mut force = vec![[0.0; 3]; v.len()];
    for (element, tangent) in elements.iter().zip(tangents) {
        let df = element.displacement_gradient(v);
        let dp = from_fn(|i, j| (0..9).map(|column| tangent[3 * i + j][column] * df[column / 3][column % 3]).sum());
        for (node, gradient) in element.nodes.iter().zip(element.gradients) {
            let f = apply(&dp, gradient);
            for axis in 0..3 {
                force[*node][axis] += element.volume * f[axis];
            }
        }
    }
    force
}

/// `2 / omega_max` in s at the displacements `u`, to a relative accuracy of 1e-6; infinite where `K` has no
/// positive eigenvalue. Prescribed degrees of freedom count as fixed. Panics if Lanczos does not converge.
pub fn critical_step(mesh: &Mesh, law: &Law, density: f64, u: &[Vec3], fixed: &[[bool; 3]]) -> f64 {
    let elements = mesh.elements();
    let tangents = tangents(&elements, law, u);
    let mass = mesh.lumped_mass(density);
    // M^-1/2, zero on the fixed degrees of freedom.
    let scale: Vec<Vec3> =
        (mass.iter().zip(fixed)).map(|(m, held)| held.map(|h| if h { 0.0 } else { 1.0 / m.sqrt() })).collect();
    let scaled = |v: &[Vec3]| -> Vec<Vec3> {
        v.iter().zip(&scale).map(|(v, s)| std::array::from_fn(|axis| v[axis] * s[axis])).collect()
    };
    let free = scale.iter().flatten().filter(|s| **s > 0.0).count();
    if free == 0 {
        return f64::INFINITY;
    }

    let mut start = seed(u.len());
    for (x, s) in start.iter_mut().flatten().zip(scale.iter().flatten()) {
        *x *= f64::from(*s > 0.0);
    }
    let lambda = largest_eigenvalue(start, free, |v| scaled(&product(&elements, &tangents, &scaled(v))));
    if lambda > 0.0 { 2.0 / lambda.sqrt() } else { f64::INFINITY }
}

/// A start vector with something of every mode: a linear congruential generator (Knuth's MMIX constants).
fn seed(nodes: usize) -> Vec<Vec3> {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    (0..nodes).map(|_| [random(), random(), random()]).collect()
}

fn inner(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| x * y).sum()
}

/// Largest eigenvalue of a symmetric operator on a space of `dimension`, by Lanczos.
fn largest_eigenvalue(start: Vec<Vec3>, dimension: usize, operator: impl Fn(&[Vec3]) -> Vec<Vec3>) -> f64 {
    let normalised = |mut v: Vec<Vec3>, norm: f64| {
        v.iter_mut().flatten().for_each(|x| *x /= norm);
        v
    };
    let norm = inner(&start, &start).sqrt();
    let mut basis = vec![normalised(start, norm)];
    let (mut diagonal, mut off_diagonal) = (Vec::new(), Vec::new());
    loop {
        let mut w = operator(&basis[basis.len() - 1]);
        diagonal.push(inner(&w, &basis[basis.len() - 1]));
        // Gram-Schmidt against the whole basis, twice.
        for q in basis.iter().chain(basis.iter()) {
            let c = inner(&w, q);
            for (x, y) in w.iter_mut().flatten().zip(q.iter().flatten()) {
                *x -= c * y;
            }
        }
        let beta = inner(&w, &w).sqrt();
        let (lambda, last) = largest_of_tridiagonal(&diagonal, &off_diagonal);
        // |beta last| bounds the distance from lambda to an eigenvalue.
        if (beta * last).abs() <= TOLERANCE * lambda.abs() || basis.len() == dimension {
            return lambda;
        }
        assert!(basis.len() < MAX_VECTORS, "Lanczos: {lambda:e} not converged, residual {:e}", beta * last);
        off_diagonal.push(beta);
        basis.push(normalised(w, beta));
    }
}

/// Largest eigenvalue of a symmetric tridiagonal matrix and the last entry of its unit eigenvector: bisection
/// on the number of eigenvalues above, then inverse iteration.
fn largest_of_tridiagonal(diagonal: &[f64], off_diagonal: &[f64]) -> (f64, f64) {
    let n = diagonal.len();
    // Off-diagonal entry left of row i; off(n) = 0 is right of the last row.
    let off = |i: usize| {
        if i == 0 || i == n { 0.0 } else { off_diagonal[i - 1] }
    };
    let radius = |i: usize| off(i).abs() + off(i + 1).abs();
    let mut high = (0..n).map(|i| diagonal[i] + radius(i)).fold(f64::NEG_INFINITY, f64::max);
    let mut low = (0..n).map(|i| diagonal[i] - radius(i)).fold(f64::INFINITY, f64::min);

    // All pivots of LDL^T of T - x I are negative exactly where x is above the spectrum.
    let above_spectrum = |x: f64| {
        let mut pivot = -1.0;
        (0..n).all(|i| {
            pivot = diagonal[i] - x - off(i).powi(2) / pivot;
            pivot < 0.0
        })
    };
    let width = 1e-14 * high.abs().max(low.abs());
    high += 2.0 * width;
    while high - low > width {
        let middle = 0.5 * (low + high);
        if above_spectrum(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }

    // T - high I is negative definite, so elimination needs no pivoting.
    let mut y = vec![1.0; n];
    for _ in 0..4 {
        let mut pivot = vec![0.0; n];
        for i in 0..n {
            pivot[i] = diagonal[i] - high;
            if i > 0 {
                let factor = off(i) / pivot[i - 1];
                pivot[i] -= factor * off(i);
                y[i] -= factor * y[i - 1];
            }
        }
        for i in (0..n).rev() {
            let right = if i + 1 < n { off(i + 1) * y[i + 1] } else { 0.0 };
            y[i] = (y[i] - right) / pivot[i];
        }
        let norm = y.iter().map(|x| x * x).sum::<f64>().sqrt();
        y.iter_mut().for_each(|x| *x /= norm);
    }
    (high, y[n - 1])
}
