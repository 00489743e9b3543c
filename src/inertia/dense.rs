//! Dense symmetric matrices of the lattice functions, with three unknowns a function: inverted in place, applied by
//! rows. The order of sums does not depend on the instruction set, so every one gives the same bits.

use super::lattice::MAX_FUNCTIONS;
use crate::simd::{Kernel, Portable, Real, dispatch};

/// The length of a row is a multiple of this.
const WIDTH: usize = 8;

/// Length of the longest row.
const ROW: usize = stride(MAX_FUNCTIONS);

/// A row of a matrix, or a vector of unknowns; entries beyond the functions in use are zero.
pub(super) type Row = [f32; ROW];

/// Length of a row of a matrix for this many functions: three entries for each, one more because submatrices are
/// written with four columns, rounded up to a multiple of eight.
pub(super) const fn stride(functions: usize) -> usize {
    (3 * functions + 1).div_ceil(WIDTH) * WIDTH
}

/// Multiplies a row up to the diagonal by `factor`, and copies it to the column.
pub(super) fn mirror(matrix: &mut [f32], stride: usize, row: usize, factor: f32) {
    for column in 0..=row {
        let value = factor * matrix.get(row * stride + column).copied().unwrap_or(0.0);
        for place in [row * stride + column, column * stride + row] {
            if let Some(place) = matrix.get_mut(place) {
                *place = value;
            }
        }
    }
}

/// Three pivots, those of one function, of the inversion in place of a symmetric positive definite matrix by the sweep
/// operator. It works on the lower triangle, which after all pivots holds minus that of the inverse. A positive
/// definite matrix needs no exchange of rows. Returns whether the pivots were positive and finite; if not, the matrix
/// is unchanged.
pub(super) fn sweep(matrix: &mut [f32], size: usize, stride: usize, function: usize) -> bool {
    dispatch(Sweep { matrix, size, stride, first: 3 * function })
}

struct Sweep<'a> {
    matrix: &'a mut [f32],
    size: usize,
    stride: usize,
    first: usize,
}

/// `row -= factor line`, in whole vectors up to the one with column `last`.
#[inline(always)]
fn subtract(row: &mut [f32], factor: f32, line: &Row, last: usize) {
    let factor = Portable([factor; WIDTH]);
    let vectors = row.as_chunks_mut::<WIDTH>().0.iter_mut().zip(line.as_chunks::<WIDTH>().0);
    for (value, &line) in vectors.take(last / WIDTH + 1) {
        *value = (Portable(*value) - factor * Portable(line)).0;
    }
}

impl Kernel for Sweep<'_> {
    type Output = bool;

    /// A sweep with pivot `p` subtracts `a_ip a_pj / a_pp` from each entry `a_ij` of other rows and columns, divides
    /// the pivot's row and column by `a_pp`, and sets `a_pp` to `-1 / a_pp`. The three sweeps are done in one pass over
    /// the matrix: `lines` are the pivots' rows and columns before each sweep.
    #[inline(always)]
    fn run<R: Real>(self) -> bool {
        let Self { matrix, size, stride, first } = self;
        let mut lines: [Row; 3] = [[0.0; ROW]; 3];
        for (index, row) in matrix.chunks_exact(stride.max(1)).take(size).enumerate() {
            for (k, line) in lines.iter_mut().enumerate() {
                let pivot = first + k;
                let at = if index < pivot { matrix.get(pivot * stride + index) } else { row.get(pivot) };
                if let (Some(place), Some(&value)) = (line.get_mut(index), at) {
                    *place = value;
                }
            }
        }
        let mut inverses = [0.0; 3];
        for (k, inverse) in inverses.iter_mut().enumerate() {
            let Some((line, later)) = lines.get_mut(k..).and_then(<[Row]>::split_first_mut) else {
                return false;
            };
            let diagonal = line.get(first + k).copied().unwrap_or(0.0);
            *inverse = 1.0 / diagonal;
            if !(diagonal > 0.0 && inverse.is_finite()) {
                return false;
            }
            for later in later {
                let factor = later.get(first + k).copied().unwrap_or(0.0) * *inverse;
                subtract(later, factor, line, size);
                if let Some(place) = later.get_mut(first + k) {
                    *place = factor;
                }
            }
        }
        let at = |k: usize, index: usize| lines[k % 3].get(index).copied().unwrap_or(0.0);
        for (index, row) in matrix.chunks_exact_mut(stride.max(1)).take(size).enumerate() {
            let factors = [0, 1, 2].map(|k| at(k, index) * inverses[k]);
            if index < first || index > first + 2 {
                let [a, b, c] = factors.map(|factor| Portable([factor; WIDTH]));
                let [one, two, three] = lines.each_ref().map(|line| line.as_chunks::<WIDTH>().0);
                let vectors = row.as_chunks_mut::<WIDTH>().0.iter_mut().zip(one).zip(two).zip(three);
                // Entries above the diagonal are never read.
                for (((value, &one), &two), &three) in vectors.take(index / WIDTH + 1) {
                    *value =
                        (Portable(*value) - a * Portable(one) - b * Portable(two) - c * Portable(three)).0;
                }
                if index > first {
                    let [a, b, c] = factors;
                    let columns = [a - b * at(1, first) - c * at(2, first), b - c * at(2, first + 1), c];
                    for (place, value) in row.iter_mut().skip(first).zip(columns) {
                        *place = value;
                    }
                }
            } else {
                let own = index - first;
                for (column, place) in row.iter_mut().enumerate().take(index + 1) {
                    let own_line = if column == index { -1.0 } else { at(own, column) };
                    let mut value = own_line * inverses[own % 3];
                    for k in own + 1..3 {
                        value -= factors[k % 3] * at(k, column);
                    }
                    *place = value;
                }
            }
        }
        true
    }
}

/// `A x` for a symmetric matrix with as many rows as `x` has components.
pub(super) fn apply(matrix: &[f32], stride: usize, x: &[f32]) -> Row {
    dispatch(Apply { matrix, stride, x })
}

struct Apply<'a> {
    matrix: &'a [f32],
    stride: usize,
    x: &'a [f32],
}

impl Kernel for Apply<'_> {
    type Output = Row;

    #[inline(always)]
    fn run<R: Real>(self) -> Row {
        let mut out = [0.0; ROW];
        for (row, &x) in self.matrix.chunks_exact(self.stride.max(1)).zip(self.x) {
            for (out, entry) in out.iter_mut().zip(row) {
                *out += entry * x;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::{apply, mirror, stride, sweep};

    #[test]
    fn inverts_a_stiff_matrix_in_place() {
        // A tridiagonal mass matrix plus a stiff rank-one part: condition 1e5.
        const FUNCTIONS: usize = 12;
        const SIZE: usize = 3 * FUNCTIONS;
        let stride = stride(FUNCTIONS);
        let mut matrix = vec![0.0f32; SIZE * stride];
        for i in 0..SIZE {
            matrix[i * stride + i] = 4.0;
            if i > 0 {
                matrix[i * stride + i - 1] = 1.0;
            }
            for j in 0..=i {
                let sign = if (i + j) % 2 == 0 { 1.0 } else { -1.0 };
                matrix[i * stride + j] += 1e4 * sign;
            }
        }
        let mut original = matrix.clone();
        (0..SIZE).for_each(|row| mirror(&mut original, stride, row, 1.0));
        for function in 0..FUNCTIONS {
            assert!(sweep(&mut matrix, SIZE, stride, function));
        }
        (0..SIZE).for_each(|row| mirror(&mut matrix, stride, row, -1.0));
        let x: Vec<f32> = (0..SIZE).map(|i| (i as f32 * 0.7).sin()).collect();
        let image = apply(&matrix, stride, &x);
        let back = apply(&original, stride, &image[..SIZE]);
        let worst = (0..SIZE).map(|i| (back[i] - x[i]).abs()).fold(0.0, f32::max);
        println!("A (A^-1 x) is off by {worst:.1e} at a condition of 1e5");
        assert!(worst < 2e-2);
        matrix[2 * stride + 2] = -1.0;
        let before = matrix.clone();
        assert!(!sweep(&mut matrix, SIZE, stride, 0));
        assert_eq!(matrix, before);
    }
}
