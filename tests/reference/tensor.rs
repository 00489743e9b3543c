//! Vectors and 3 x 3 matrices, row first: `m[i][j]` is row `i`, column `j`.

/// A vector in space.
pub type Vec3 = [f64; 3];
/// A second-order tensor.
pub type Mat3 = [[f64; 3]; 3];
/// A fourth-order tensor as a matrix: entry `(3 i + J, 3 k + L)` is `A_iJkL`.
pub type Mat9 = [[f64; 9]; 9];

/// The unit tensor.
pub const IDENTITY: Mat3 = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// A tensor from a formula for its entries.
pub fn from_fn(entry: impl Fn(usize, usize) -> f64) -> Mat3 {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// `det A`.
pub fn determinant(a: &Mat3) -> f64 {
    dot(a[0], cross(a[1], a[2]))
}

/// `A^T`.
pub fn transpose(a: &Mat3) -> Mat3 {
    from_fn(|i, j| a[j][i])
}

/// `A^-1`, the transposed cofactors over the determinant; not finite where `det A = 0`.
pub fn inverse(a: &Mat3) -> Mat3 {
    let cofactor = [cross(a[1], a[2]), cross(a[2], a[0]), cross(a[0], a[1])];
    let det = determinant(a);
    from_fn(|i, j| cofactor[j][i] / det)
}

/// `A B`.
pub fn product(a: &Mat3, b: &Mat3) -> Mat3 {
    from_fn(|i, j| (0..3).map(|k| a[i][k] * b[k][j]).sum())
}

/// `A x`.
pub fn apply(a: &Mat3, x: Vec3) -> Vec3 {
    [dot(a[0], x), dot(a[1], x), dot(a[2], x)]
}

/// `A : B`, the sum of the products of the entries.
pub fn contraction(a: &Mat3, b: &Mat3) -> f64 {
    (0..3).map(|i| dot(a[i], b[i])).sum()
}

/// Largest absolute entry.
pub fn max_abs(a: &Mat3) -> f64 {
    a.iter().flatten().fold(0.0, |m, x| x.abs().max(m))
}

/// Rotation about `axis` (any length) by `angle` in radians (Rodrigues).
pub fn rotation(axis: Vec3, angle: f64) -> Mat3 {
    let length = dot(axis, axis).sqrt();
    let [x, y, z] = axis.map(|a| a / length);
    let skew = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]];
    let square = product(&skew, &skew);
    from_fn(|i, j| IDENTITY[i][j] + angle.sin() * skew[i][j] + (1.0 - angle.cos()) * square[i][j])
}

/// `a . b`.
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `a x b`.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a - b`.
pub fn difference(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
