//! Dense symmetric matrices of the lattice functions (three unknowns a function): inverted in place, applied
//! by rows. Plain loops without rearranged sums, so every instruction set gives the same bits.

use super::lattice::MAX_FUNCTIONS;
use crate::lanes::{Kernel, Lanes, Real, dispatch};

/// Rows are a multiple of this.
const LANES: usize = 8;

/// Numbers in the longest row.
const ROW: usize = stride(MAX_FUNCTIONS);

/// Numbers of the functions, as many as are in use.
pub(super) type Row = [f32; ROW];

/// Length of a row of a matrix for `functions` functions: three numbers each, one spare (a block is
/// written four wide) and a multiple of eight.
pub(super) const fn stride(functions: usize) -> usize {
    (3 * functions + 1).div_ceil(LANES) * LANES
}

/// Makes a row and its column `factor` times what the row holds up to the diagonal.
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
/// operator, on its lower triangle alone; after all of them that is minus the inverse's. No row is exchanged: none has
/// to be for a positive definite matrix. Returns whether the pivots were positive and finite; if not, nothing has changed.
pub(super) fn sweep(matrix: &mut [f32], size: usize, stride: usize, function: usize) -> bool {
    dispatch(Sweep { matrix, size, stride, first: 3 * function })
}

struct Sweep<'a> {
    matrix: &'a mut [f32],
    size: usize,
    stride: usize,
    first: usize,
}

/// `row -= factor line`, whole vectors up to the one that holds `last`.
#[inline(always)]
fn subtract(row: &mut [f32], factor: f32, line: &Row, last: usize) {
    let factor = Lanes([factor; LANES]);
    let vectors = row.as_chunks_mut::<LANES>().0.iter_mut().zip(line.as_chunks::<LANES>().0);
    for (value, &line) in vectors.take(last / LANES + 1) {
        *value = (Lanes(*value) - factor * Lanes(line)).0;
    }
}

impl Kernel for Sweep<'_> {
    type Output = bool;

    /// One sweep takes from each number `a_ij` of other rows and columns `a_ip a_pj / a_pp`, divides those of the pivot's row
    /// and column by `a_pp`, and puts `-1 / a_pp` in its place. The matrix is gone through once for all three: `lines` are
    /// the pivots' rows and columns as each sweep finds them.
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
                let [a, b, c] = factors.map(|factor| Lanes([factor; LANES]));
                let [one, two, three] = lines.each_ref().map(|line| line.as_chunks::<LANES>().0);
                let vectors = row.as_chunks_mut::<LANES>().0.iter_mut().zip(one).zip(two).zip(three);
                // What lies above the diagonal is never read.
                for (((value, &one), &two), &three) in vectors.take(index / LANES + 1) {
                    *value = (Lanes(*value) - a * Lanes(one) - b * Lanes(two) - c * Lanes(three)).0;
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

/// `A x` for a symmetric matrix, in the first numbers of a row; a row of `A` for each number of `x`.
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
        // Mass matrix of a chain plus a stiff rank-one part: condition 1e5.
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
