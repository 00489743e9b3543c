//! Dense symmetric matrices of the lattice functions (three unknowns a function): inverted in place, applied
//! by rows. Plain loops without rearranged sums, so every instruction set gives the same bits.

use crate::lanes::{Kernel, Real, dispatch};

/// Length of a row of a matrix for `functions` functions: three numbers each, one spare (a block is
/// written four wide) and a multiple of eight.
pub(super) const fn stride(functions: usize) -> usize {
    (3 * functions + 1).div_ceil(8) * 8
}

/// Copies the lower triangle of `size` rows to the upper one.
pub(super) fn mirror(matrix: &mut [f32], size: usize, stride: usize) {
    for row in 1..size {
        for column in 0..row {
            let value = matrix.get(row * stride + column).copied().unwrap_or(0.0);
            if let Some(place) = matrix.get_mut(column * stride + row) {
                *place = value;
            }
        }
    }
}

/// One pivot of the Gauss-Jordan inversion in place of a symmetric positive definite matrix; after all of
/// them it holds the inverse. No row is exchanged: none has to be for a positive definite matrix. Returns
/// whether the pivot was positive and finite.
pub(super) fn eliminate(matrix: &mut [f32], size: usize, stride: usize, pivot: usize) -> bool {
    let Some(diagonal) = matrix.get_mut(pivot * stride + pivot) else {
        return false;
    };
    let inverse = 1.0 / *diagonal;
    if !(*diagonal > 0.0 && inverse.is_finite()) {
        return false;
    }
    *diagonal = 1.0;
    dispatch(Eliminate { matrix, size, stride, pivot, inverse });
    true
}

struct Eliminate<'a> {
    matrix: &'a mut [f32],
    size: usize,
    stride: usize,
    pivot: usize,
    inverse: f32,
}

impl Kernel for Eliminate<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        let Some((before, rest)) = self.matrix.split_at_mut_checked(self.pivot * self.stride) else {
            return;
        };
        let Some((row, after)) = rest.split_at_mut_checked(self.stride) else {
            return;
        };
        for value in row.iter_mut() {
            *value *= self.inverse;
        }
        let after_rows = self.size.saturating_sub(self.pivot + 1);
        let others =
            before.chunks_exact_mut(self.stride).chain(after.chunks_exact_mut(self.stride).take(after_rows));
        for other in others {
            let Some(place) = other.get_mut(self.pivot) else {
                return;
            };
            let factor = *place;
            *place = 0.0;
            for (value, row) in other.iter_mut().zip(row.iter()) {
                *value -= factor * row;
            }
        }
    }
}

/// `out = A x` for a symmetric matrix of `x.len()` rows; `out` is as long as a row.
pub(super) fn apply(matrix: &[f32], stride: usize, x: &[f32], out: &mut [f32]) {
    dispatch(Apply { matrix, stride, x, out });
}

struct Apply<'a> {
    matrix: &'a [f32],
    stride: usize,
    x: &'a [f32],
    out: &'a mut [f32],
}

impl Kernel for Apply<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        self.out.fill(0.0);
        for (row, &x) in self.matrix.chunks_exact(self.stride).zip(self.x) {
            for (out, entry) in self.out.iter_mut().zip(row) {
                *out += entry * x;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{apply, eliminate, mirror, stride};

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
        mirror(&mut matrix, SIZE, stride);
        let original = matrix.clone();
        for pivot in 0..SIZE {
            assert!(eliminate(&mut matrix, SIZE, stride, pivot));
        }
        let x: Vec<f32> = (0..SIZE).map(|i| (i as f32 * 0.7).sin()).collect();
        let (mut image, mut back) = (vec![0.0; stride], vec![0.0; stride]);
        apply(&matrix, stride, &x, &mut image);
        apply(&original, stride, &image[..SIZE], &mut back);
        let worst = (0..SIZE).map(|i| (back[i] - x[i]).abs()).fold(0.0, f32::max);
        println!("A (A^-1 x) is off by {worst:.1e} at a condition of 1e5");
        assert!(worst < 2e-2);
        matrix[0] = -1.0;
        assert!(!eliminate(&mut matrix, SIZE, stride, 0));
    }
}
