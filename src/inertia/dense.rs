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

/// One pivot of the inversion in place of a symmetric positive definite matrix by the sweep operator, on its lower
/// triangle alone; after all of them that is minus the inverse's. No row is exchanged: none has to be for a positive
/// definite matrix. Returns whether the pivot was positive and finite.
pub(super) fn sweep(matrix: &mut [f32], size: usize, stride: usize, pivot: usize) -> bool {
    let diagonal = matrix.get(pivot * stride + pivot).copied().unwrap_or(0.0);
    let inverse = 1.0 / diagonal;
    if !(diagonal > 0.0 && inverse.is_finite()) {
        return false;
    }
    dispatch(Sweep { matrix, size, stride, pivot, inverse });
    true
}

struct Sweep<'a> {
    matrix: &'a mut [f32],
    size: usize,
    stride: usize,
    pivot: usize,
    inverse: f32,
}

impl Kernel for Sweep<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { matrix, size, stride, pivot, inverse } = self;
        // The pivot's row, and its column below.
        let mut line: Row = [0.0; ROW];
        let rows = || matrix.chunks_exact(stride).take(size).enumerate();
        for ((index, row), place) in rows().zip(&mut line) {
            let at = if index < pivot { matrix.get(pivot * stride + index) } else { row.get(pivot) };
            *place = at.copied().unwrap_or(0.0);
        }
        for (index, row) in matrix.chunks_exact_mut(stride).take(size).enumerate() {
            if index == pivot {
                for value in row.iter_mut().take(pivot) {
                    *value *= inverse;
                }
            } else {
                let factor = line.get(index).copied().unwrap_or(0.0) * inverse;
                // Whole vectors; what lies above the diagonal is never read.
                let vectors = row.as_chunks_mut::<LANES>().0.iter_mut().zip(line.as_chunks::<LANES>().0);
                let factors = Lanes([factor; LANES]);
                for (value, &line) in vectors.take(index / LANES + 1) {
                    *value = (Lanes(*value) - factors * Lanes(line)).0;
                }
                if index > pivot
                    && let Some(place) = row.get_mut(pivot)
                {
                    *place = factor;
                }
            }
        }
        if let Some(diagonal) = matrix.get_mut(pivot * stride + pivot) {
            *diagonal = -inverse;
        }
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
        for (row, &x) in self.matrix.chunks_exact(self.stride).zip(self.x) {
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
        for pivot in 0..SIZE {
            assert!(sweep(&mut matrix, SIZE, stride, pivot));
        }
        (0..SIZE).for_each(|row| mirror(&mut matrix, stride, row, -1.0));
        let x: Vec<f32> = (0..SIZE).map(|i| (i as f32 * 0.7).sin()).collect();
        let image = apply(&matrix, stride, &x);
        let back = apply(&original, stride, &image[..SIZE]);
        let worst = (0..SIZE).map(|i| (back[i] - x[i]).abs()).fold(0.0, f32::max);
        println!("A (A^-1 x) is off by {worst:.1e} at a condition of 1e5");
        assert!(worst < 2e-2);
        matrix[0] = -1.0;
        assert!(!sweep(&mut matrix, SIZE, stride, 0));
    }
}
