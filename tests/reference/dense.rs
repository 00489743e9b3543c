//! Dense symmetric matrices in float64: Cholesky factor and eigenvalues (Golub & Van Loan, Matrix Computations,
//! ch. 4 and 8), for matrices of up to a few hundred rows.

/// Rows of a square matrix.
pub type Matrix = Vec<Vec<f64>>;

/// A matrix of zeros.
pub fn zeros(size: usize) -> Matrix {
    vec![vec![0.0; size]; size]
}

/// `(A + A^T) / 2`.
pub fn symmetric_part(a: &Matrix) -> Matrix {
    let entry = |i: usize, j: usize| 0.5 * (a[i][j] + a[j][i]);
    (0..a.len()).map(|i| (0..a.len()).map(|j| entry(i, j)).collect()).collect()
}

/// The lower triangular `L` with `A = L L^T`; nothing if `A` is not positive definite.
pub fn cholesky(a: &Matrix) -> Option<Matrix> {
    let mut l = zeros(a.len());
    for i in 0..a.len() {
        for j in 0..=i {
            let sum = a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            if i != j {
                l[i][j] = sum / l[j][j];
            } else if sum > 0.0 {
                l[i][i] = sum.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(l)
}

/// `L^T A L`, whose eigenvalues are those of `L L^T A`.
pub fn congruent(l: &Matrix, a: &Matrix) -> Matrix {
    let n = a.len();
    let product = |x: &dyn Fn(usize, usize) -> f64, y: &dyn Fn(usize, usize) -> f64| -> Matrix {
        (0..n).map(|i| (0..n).map(|j| (0..n).map(|k| x(i, k) * y(k, j)).sum()).collect()).collect()
    };
    let right = product(&|i, k| a[i][k], &|k, j| l[k][j]);
    product(&|i, k| l[k][i], &|k, j| right[k][j])
}

/// `L^-1 A L^-T`, whose eigenvalues are those of `A x = lambda L L^T x`.
pub fn transformed(l: &Matrix, a: &Matrix) -> Matrix {
    let n = a.len();
    let solved = |b: &Matrix| -> Matrix {
        let mut x = b.clone();
        for row in 0..n {
            for column in 0..n {
                let sum: f64 = (0..row).map(|k| l[row][k] * x[k][column]).sum();
                x[row][column] = (x[row][column] - sum) / l[row][row];
            }
        }
        x
    };
    let transposed = |a: &Matrix| -> Matrix { (0..n).map(|i| a.iter().map(|row| row[i]).collect()).collect() };
    solved(&transposed(&solved(a)))
}

/// Eigenvalues of a symmetric matrix in ascending order, by Jacobi rotations.
pub fn eigenvalues(a: &Matrix) -> Vec<f64> {
    let mut a = symmetric_part(a);
    let n = a.len();
    let scale = a.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    for _ in 0..60 {
        let mut off = 0.0_f64;
        for p in 0..n {
            for q in p + 1..n {
                off = off.max(a[p][q].abs());
                if a[p][q].abs() <= 1e-15 * scale {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let c = 1.0 / (t * t + 1.0).sqrt();
                let s = t * c;
                for row in a.iter_mut() {
                    let (x, y) = (row[p], row[q]);
                    (row[p], row[q]) = (c * x - s * y, s * x + c * y);
                }
                let (upper, lower) = a.split_at_mut(q);
                for (x, y) in upper[p].iter_mut().zip(&mut lower[0]) {
                    (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
                }
            }
        }
        if off <= 1e-13 * scale {
            break;
        }
    }
    let mut values: Vec<f64> = (0..n).map(|i| a[i][i]).collect();
    values.sort_by(f64::total_cmp);
    values
}
