//! Dense symmetric matrices of the lattice functions, with three unknowns a function: inverted in place, applied by
//! rows.

use super::lattice::{CoarseVectors, MAX_FUNCTIONS};
use crate::simd::{Kernel, Real, dispatch};

/// The length of a row is a multiple of this.
const WIDTH: usize = 16;

/// Length of the longest row.
const ROW: usize = stride(MAX_FUNCTIONS);

/// A row of a matrix, or a vector of unknowns; entries beyond the functions in use are zero.
pub(super) type Row = [f32; ROW];

/// Length of a row of a matrix for this many functions: three entries for each, one more because submatrices are
/// written with four columns, rounded up to whole vectors.
pub(super) const fn stride(functions: usize) -> usize {
    row_length(3 * functions + 1)
}

/// This many columns, rounded up to whole vectors.
pub(super) const fn row_length(columns: usize) -> usize {
    columns.div_ceil(WIDTH) * WIDTH
}

/// The components of vectors, three for each function.
pub(super) fn to_components(vectors: &CoarseVectors) -> Row {
    let mut components = [0.0; _];
    for (three, vector) in components.as_chunks_mut::<3>().0.iter_mut().zip(vectors) {
        *three = vector.to_array();
    }
    components
}

/// Sets vectors from their components, as many as there are.
pub(super) fn from_components(components: &[f32], vectors: &mut CoarseVectors) {
    for (&[x, y, z], vector) in components.as_chunks::<3>().0.iter().zip(vectors) {
        vector.0 = [x, y, z, 0.0];
    }
}

/// Inverts a symmetric positive definite matrix in place, from its lower triangle. Gives whether it could be inverted.
pub(super) fn invert(matrix: &mut [f32], size: usize, stride: usize) -> bool {
    let sound = (0..sweeps(size)).fold(true, |sound, index| sound & sweep(matrix, size, stride, index));
    (0..size).for_each(|row| mirror(matrix, stride, row, -1.0));
    sound
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

/// Unknowns that one step of an inversion eliminates.
pub(super) const PIVOTS: usize = 12;

/// Steps of the inversion of a matrix with `size` unknowns.
pub(super) const fn sweeps(size: usize) -> usize {
    size.div_ceil(PIVOTS)
}

/// Step `index` of the inversion in place of a symmetric positive definite matrix by the sweep operator, with
/// [`PIVOTS`] pivots at a time. It works on the lower triangle, which after all steps holds minus that of the inverse.
/// What is above the diagonal is overwritten. A positive definite matrix needs no exchange of rows. Returns whether the
/// pivots were positive and finite; if not, the matrix is unchanged.
pub(super) fn sweep(matrix: &mut [f32], size: usize, stride: usize, index: usize) -> bool {
    dispatch(Sweep { matrix, size, stride, first: index * PIVOTS })
}

struct Sweep<'a> {
    matrix: &'a mut [f32],
    size: usize,
    stride: usize,
    first: usize,
}

/// The pivots' rows in some columns: in their own ones a matrix with padded rows.
type Panel = [[f32; WIDTH]; PIVOTS];

/// `L d L^T` of the pivots' symmetric matrix: `L` without the ones on the diagonal, `L^-1`, and the inverses of the
/// `d`.
struct Factors {
    lower: Panel,
    inverse: Panel,
    inverse_diagonal: [f32; PIVOTS],
}

impl Factors {
    /// None if a pivot is not positive and finite.
    #[inline(always)]
    fn new(mut matrix: Panel) -> Option<Self> {
        let mut inverse = [[0.0; WIDTH]; PIVOTS];
        let mut inverse_diagonal = [0.0; PIVOTS];
        for k in 0..PIVOTS {
            inverse[k][k] = 1.0;
        }
        for k in 0..PIVOTS {
            let (mut line, inverse_line) = (matrix[k], inverse[k]);
            inverse_diagonal[k] = 1.0 / line[k];
            if !(line[k] > 0.0 && inverse_diagonal[k].is_finite()) {
                return None;
            }
            // What is left of the diagonal belongs to `L`.
            line[..k].fill(0.0);
            for m in k + 1..PIVOTS {
                let factor = matrix[m][k] * inverse_diagonal[k];
                subtract_times(&mut matrix[m], factor, &line);
                subtract_times(&mut inverse[m], factor, &inverse_line);
                matrix[m][k] = factor;
            }
        }
        Some(Self { lower: matrix, inverse, inverse_diagonal })
    }

    /// `L^-1` times a panel.
    #[inline(always)]
    fn eliminate<R: Real>(&self, panel: &mut Panel) {
        for first in (0..WIDTH).step_by(R::COUNT) {
            let mut rows = panel_rows::<R>(panel, first);
            for k in 0..PIVOTS {
                for m in k + 1..PIVOTS {
                    rows[m] = R::splat(-self.lower[m][k]).fused(rows[k], rows[m]);
                }
            }
            write_panel_rows(panel, first, &rows);
        }
    }

    /// `L^-T d^-1` times a panel.
    #[inline(always)]
    fn substitute<R: Real>(&self, panel: &mut Panel) {
        for first in (0..WIDTH).step_by(R::COUNT) {
            let mut rows = panel_rows::<R>(panel, first);
            for k in 0..PIVOTS {
                rows[k] = R::splat(self.inverse_diagonal[k]) * rows[k];
            }
            for k in (0..PIVOTS).rev() {
                for m in 0..k {
                    rows[m] = R::splat(-self.lower[k][m]).fused(rows[k], rows[m]);
                }
            }
            write_panel_rows(panel, first, &rows);
        }
    }

    /// `d^-1 x`.
    #[inline(always)]
    fn scaled(&self, mut x: [f32; PIVOTS]) -> [f32; PIVOTS] {
        for (x, inverse) in x.iter_mut().zip(self.inverse_diagonal) {
            *x *= inverse;
        }
        x
    }
}

// Loops, because the compiler may leave closures as function calls.
#[inline(always)]
fn panel_rows<R: Real>(panel: &Panel, first: usize) -> [R; PIVOTS] {
    let mut rows = [R::splat(0.0); PIVOTS];
    for k in 0..PIVOTS {
        rows[k] = R::from_fn(|lane| panel[k][(first + lane) % WIDTH]);
    }
    rows
}

#[inline(always)]
fn write_panel_rows<R: Real>(panel: &mut Panel, first: usize, rows: &[R; PIVOTS]) {
    for k in 0..PIVOTS {
        for lane in 0..R::COUNT {
            panel[k][(first + lane) % WIDTH] = rows[k].lane(lane);
        }
    }
}

/// `row -= factor line`.
#[inline(always)]
fn subtract_times(row: &mut [f32], factor: f32, line: &[f32]) {
    for (value, line) in row.iter_mut().zip(line) {
        *value -= factor * line;
    }
}

/// `row -= sum_k factor_k line_k`, in the panels up to the one with column `last`.
#[inline(always)]
fn subtract<R: Real>(row: &mut [f32], factors: &[f32; PIVOTS], panels: &[Panel], last: usize) {
    let columns = row.as_chunks_mut::<WIDTH>().0.iter_mut().zip(panels);
    for (values, panel) in columns.take(last / WIDTH + 1) {
        for first in (0..WIDTH).step_by(R::COUNT) {
            let mut sum = R::from_fn(|lane| values[(first + lane) % WIDTH]);
            for k in 0..PIVOTS {
                let line = R::from_fn(|lane| panel[k][(first + lane) % WIDTH]);
                sum = R::splat(-factors[k]).fused(line, sum);
            }
            for lane in 0..R::COUNT {
                values[(first + lane) % WIDTH] = sum.lane(lane);
            }
        }
    }
}

/// The pivots' entries in one column.
#[inline(always)]
fn column_of(panels: &[Panel], column: usize) -> [f32; PIVOTS] {
    let mut entries = [0.0; PIVOTS];
    if let Some(panel) = panels.get(column / WIDTH) {
        for (entry, row) in entries.iter_mut().zip(panel) {
            *entry = row[column % WIDTH];
        }
    }
    entries
}

impl Kernel for Sweep<'_> {
    type Output = bool;

    /// A sweep with the pivots `P` and `A_PP = L d L^T` subtracts `l_i^T d^-1 l_j` with `l = L^-1 A_P` from each entry
    /// `A_ij` of other rows and columns, sets the pivots' rows and columns to `L^-T d^-1 l`, and `A_PP` to its negative
    /// inverse. Rows in which the pivots' columns are zero stay as they are, so a banded matrix takes less.
    #[inline(always)]
    fn run<R: Real>(self) -> bool {
        let Self { matrix, size, stride, first } = self;
        let count = PIVOTS.min(size.saturating_sub(first));
        let next = first + count;
        let Some((before, rest)) = matrix.split_at_mut_checked(first * stride) else {
            return false;
        };
        let Some((pivots, after)) = rest.split_at_mut_checked(count * stride) else {
            return false;
        };
        let (length, rows_after) = (stride.max(1), size.saturating_sub(next));
        let mut pivots_matrix = [[0.0; WIDTH]; PIVOTS];
        for k in 0..PIVOTS {
            pivots_matrix[k][k] = 1.0;
        }
        for (row, line) in pivots.chunks_exact(length).enumerate().take(PIVOTS) {
            for (column, &value) in line.iter().skip(first).enumerate().take(row + 1) {
                pivots_matrix[row][column % WIDTH] = value;
                pivots_matrix[column % PIVOTS][row] = value;
            }
        }
        let Some(factors) = Factors::new(pivots_matrix) else {
            return false;
        };
        let mut panels = [[[0.0; WIDTH]; PIVOTS]; ROW / WIDTH];
        for (k, line) in pivots.chunks_exact(length).enumerate() {
            for (panel, values) in panels.iter_mut().zip(line.as_chunks::<WIDTH>().0).take(next / WIDTH + 1) {
                panel[k % PIVOTS] = *values;
            }
        }
        for (index, row) in after.chunks_exact(length).enumerate().take(rows_after) {
            let (index, values) = (next + index, row.iter().skip(first));
            if let Some(panel) = panels.get_mut(index / WIDTH) {
                panel.iter_mut().zip(values).take(count).for_each(|(line, &value)| line[index % WIDTH] = value);
            }
        }
        let used = size.div_ceil(WIDTH);
        panels.iter_mut().take(used).for_each(|panel| factors.eliminate::<R>(panel));
        for (index, row) in before.chunks_exact_mut(length).enumerate() {
            let entries = column_of(&panels, index);
            if entries != [0.0; PIVOTS] {
                subtract::<R>(row, &factors.scaled(entries), &panels, index);
            }
        }
        for (index, row) in after.chunks_exact_mut(length).enumerate().take(rows_after) {
            let entries = column_of(&panels, next + index);
            if entries != [0.0; PIVOTS] {
                subtract::<R>(row, &factors.scaled(entries), &panels, next + index);
            }
        }
        panels.iter_mut().take(used).for_each(|panel| factors.substitute::<R>(panel));
        for (index, row) in after.chunks_exact_mut(length).enumerate().take(rows_after) {
            let values = column_of(&panels, next + index);
            row.iter_mut().skip(first).zip(values).take(count).for_each(|(place, value)| *place = value);
        }
        let mut inverse = factors.inverse;
        factors.substitute::<R>(&mut inverse);
        for (k, line) in pivots.chunks_exact_mut(length).enumerate().take(PIVOTS) {
            let columns = line.as_chunks_mut::<WIDTH>().0.iter_mut().zip(&panels);
            columns.take(first.div_ceil(WIDTH)).for_each(|(values, panel)| *values = panel[k]);
            let diagonal = line.iter_mut().skip(first).zip(inverse[k]);
            diagonal.take(k + 1).for_each(|(place, value)| *place = -value);
        }
        true
    }
}

/// `A x` for a symmetric matrix with as many rows as `x` has components.
pub(super) fn apply(matrix: &[f32], stride: usize, x: &[f32], out: &mut Row) {
    dispatch(Apply { matrix, stride, x: [x], out: [out] });
}

/// The products with two vectors of the same length, in one pass over the matrix.
pub(super) fn apply_to_two(matrix: &[f32], stride: usize, x: [&[f32]; 2], [a, b]: [&mut Row; 2]) {
    dispatch(Apply { matrix, stride, x, out: [a, b] });
}

/// `A x` for a symmetric matrix of which only the lower triangle is there.
pub(super) fn apply_lower(matrix: &[f32], stride: usize, x: &[f32]) -> Row {
    let mut out = [0.0; ROW];
    for (index, (row, &own)) in matrix.chunks_exact(stride.max(1)).zip(x).enumerate() {
        let mut sum = 0.0;
        for ((entry, other), place) in row.iter().zip(x).zip(&mut out).take(index) {
            sum += entry * other;
            *place += entry * own;
        }
        let diagonal = row.get(index).copied().unwrap_or(0.0);
        if let Some(place) = out.get_mut(index) {
            *place += sum + diagonal * own;
        }
    }
    out
}

/// The unknowns of one axis; entries beyond the functions in use are zero.
type AxisRow = [f32; MAX_FUNCTIONS];
const _: () = assert!(row_length(MAX_FUNCTIONS) == MAX_FUNCTIONS);

/// Replaces each axis of a vector of three unknowns for each function by its product with a symmetric matrix of one
/// unknown for each function.
#[inline(never)]
pub(super) fn apply_to_axes(matrix: &[f32], functions: usize, row: &mut Row) {
    let (parts, [mut x, mut y, mut z]) = (by_axis(row), [[0.0; MAX_FUNCTIONS]; 3]);
    let parts = parts.each_ref().map(|part| part.get(..functions).unwrap_or_default());
    dispatch(Apply { matrix, stride: row_length(functions), x: parts, out: [&mut x, &mut y, &mut z] });
    write_axes([&x, &y, &z], row);
}

/// The same with a matrix of its own for each axis.
#[inline(never)]
pub(super) fn apply_by_axis(matrices: [&[f32]; 3], functions: usize, row: &mut Row) {
    let (parts, [mut x, mut y, mut z]) = (by_axis(row), [[0.0; MAX_FUNCTIONS]; 3]);
    for ((matrix, part), out) in matrices.into_iter().zip(&parts).zip([&mut x, &mut y, &mut z]) {
        let part = [part.get(..functions).unwrap_or_default()];
        dispatch(Apply { matrix, stride: row_length(functions), x: part, out: [out] });
    }
    write_axes([&x, &y, &z], row);
}

/// The unknowns of each axis.
fn by_axis(x: &Row) -> [AxisRow; 3] {
    let mut parts = [[0.0; MAX_FUNCTIONS]; 3];
    let [a, b, c] = &mut parts;
    for (&[x, y, z], ((a, b), c)) in x.as_chunks::<3>().0.iter().zip(a.iter_mut().zip(b).zip(c)) {
        (*a, *b, *c) = (x, y, z);
    }
    parts
}

fn write_axes([x, y, z]: [&AxisRow; 3], row: &mut Row) {
    row.fill(0.0);
    for (vector, ((&x, &y), &z)) in row.as_chunks_mut::<3>().0.iter_mut().zip(x.iter().zip(y).zip(z)) {
        *vector = [x, y, z];
    }
}

/// Adds to `out` the product with a vector that is zero but for some functions.
#[inline(never)]
pub(super) fn apply_functions(matrix: &[f32], stride: usize, functions: &[u8], x: &Row, out: &mut Row) {
    dispatch(ApplyFunctions { matrix, stride, functions, x, out });
}

struct ApplyFunctions<'a> {
    matrix: &'a [f32],
    stride: usize,
    functions: &'a [u8],
    x: &'a Row,
    out: &'a mut Row,
}

impl Kernel for ApplyFunctions<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        for &function in self.functions {
            for index in (3 * usize::from(function)..).take(3) {
                let row = self.matrix.get(index * self.stride..(index + 1) * self.stride).unwrap_or_default();
                let x = R::splat(self.x.get(index).copied().unwrap_or(0.0));
                let columns = self.out.as_chunks_mut::<WIDTH>().0.iter_mut().zip(row.as_chunks::<WIDTH>().0);
                for (out, row) in columns {
                    for first in (0..WIDTH).step_by(R::COUNT) {
                        let value = R::from_fn(|lane| row[(first + lane) % WIDTH]);
                        let sum = x.fused(value, R::from_fn(|lane| out[(first + lane) % WIDTH]));
                        for lane in 0..R::COUNT {
                            out[(first + lane) % WIDTH] = sum.lane(lane);
                        }
                    }
                }
            }
        }
    }
}

/// Most vectors of [`WIDTH`] columns; these have at least eight values.
const VECTORS: usize = 2;

/// Writes to the first columns of `out`, as many as a row has.
struct Apply<'a, const X: usize> {
    matrix: &'a [f32],
    stride: usize,
    x: [&'a [f32]; X],
    out: [&'a mut [f32]; X],
}

impl<const X: usize> Apply<'_, X> {
    /// The products in `N` times [`WIDTH`] columns from `first` on.
    #[inline(always)]
    fn columns<R: Real, const N: usize>(&mut self, first: usize) {
        let mut sums = [[[R::splat(0.0); VECTORS]; N]; X];
        for (index, row) in self.matrix.chunks_exact(self.stride.max(1)).enumerate() {
            let values = row.get(first..).unwrap_or_default().as_chunks::<WIDTH>().0.first_chunk::<N>();
            let Some(values) = values else {
                return;
            };
            for k in 0..X {
                let Some(&x) = self.x[k].get(index) else {
                    continue;
                };
                for n in 0..N {
                    for vector in 0..WIDTH / R::COUNT {
                        let value = R::from_fn(|lane| values[n][(vector * R::COUNT + lane) % WIDTH]);
                        let sum = &mut sums[k][n][vector % VECTORS];
                        *sum = R::splat(x).fused(value, *sum);
                    }
                }
            }
        }
        for (out, sums) in self.out.iter_mut().zip(&sums) {
            let out = out.get_mut(first..).unwrap_or_default().as_chunks_mut::<WIDTH>().0;
            for (out, sums) in out.iter_mut().zip(sums) {
                for vector in 0..WIDTH / R::COUNT {
                    for lane in 0..R::COUNT {
                        out[(vector * R::COUNT + lane) % WIDTH] = sums[vector % VECTORS].lane(lane);
                    }
                }
            }
        }
    }
}

impl<const X: usize> Kernel for Apply<'_, X> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(mut self) {
        let mut first = 0;
        while first < self.stride {
            if first + 4 * WIDTH <= self.stride {
                self.columns::<R, 4>(first);
                first += 4 * WIDTH;
            } else {
                self.columns::<R, 1>(first);
                first += WIDTH;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{apply, apply_lower, mirror, stride, sweep, sweeps};

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
        let lower = matrix.clone();
        let mut original = matrix.clone();
        (0..SIZE).for_each(|row| mirror(&mut original, stride, row, 1.0));
        for index in 0..sweeps(SIZE) {
            assert!(sweep(&mut matrix, SIZE, stride, index));
        }
        (0..SIZE).for_each(|row| mirror(&mut matrix, stride, row, -1.0));
        let x: Vec<f32> = (0..SIZE).map(|i| (i as f32 * 0.7).sin()).collect();
        let mut product = [0.0; super::ROW];
        apply(&original, stride, &x, &mut product);
        let lower = apply_lower(&lower, stride, &x);
        assert!((0..SIZE).all(|i| (product[i] - lower[i]).abs() < 1e-5 * product[i].abs().max(1e4)));
        let (mut image, mut back) = ([0.0; super::ROW], [0.0; super::ROW]);
        apply(&matrix, stride, &x, &mut image);
        apply(&original, stride, &image[..SIZE], &mut back);
        let worst = (0..SIZE).map(|i| (back[i] - x[i]).abs()).fold(0.0, f32::max);
        println!("A (A^-1 x) is off by {worst:.1e} at a condition of 1e5");
        assert!(worst < 2e-2);
        matrix[2 * stride + 2] = -1.0;
        let before = matrix.clone();
        assert!(!sweep(&mut matrix, SIZE, stride, 0));
        assert_eq!(matrix, before);
    }
}
