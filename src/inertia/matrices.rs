//! The dense matrices of a lattice (kg, inverses 1/kg) and the sums of its cells, in the caller's storage. `S` is the
//! inertia of the lattice's motion, with the inertia that the step adds; `G = W^T M W` is the nodes' inertia projected
//! to the lattice; `X = S^-1 - G^-1` is applied in each step. [`super::refresh`] computes them in cycles.

use bytemuck::must_cast_slice_mut;

use super::assembly::CellMatrices;
use super::cells::CellPolynomial;
use super::dense::{self, mirror, stride, sweep};
use super::lattice::Lattice;

/// The dense matrices of a lattice, and the sums of its cells.
pub(super) struct Matrices<'a> {
    /// `X` in use.
    pub(super) applied: &'a mut [f32],
    /// `S` in use; while the next one is inverted, that one.
    pub(super) coarse: &'a mut [f32],
    /// The next `S`, then its inverse.
    pub(super) next_coarse: &'a mut [f32],
    /// The next `G`, then its inverse.
    pub(super) next_fine: &'a mut [f32],
    /// Further matrices of a damped step.
    pub(super) damped: Option<DampedMatrices<'a>>,
    /// Used by the passes over the nodes.
    pub(super) cells: &'a mut [CellPolynomial],
    pub(super) sums: &'a mut [CellMatrices],
}

/// Further matrices of a damped step.
pub(super) struct DampedMatrices<'a> {
    /// `S^-1` in use.
    pub(super) inverse: &'a mut [f32],
    /// The mass in `S`, `(1 + k) Mc`, in use and next.
    pub(super) mass: &'a mut [f32],
    pub(super) next_mass: &'a mut [f32],
    /// The inverse of `G` for nodal inertia that is the mean over its axes, in use and next: one entry for two
    /// functions, and independent of rotations.
    pub(super) mean_inverse: &'a mut [f32],
    pub(super) next_mean_inverse: &'a mut [f32],
    /// Sums of the momentum, then the smooth part of the increments.
    pub(super) momentum: &'a mut [CellPolynomial],
}

/// Number of sweeps, of three unknowns each, for a matrix with one unknown a function.
pub(super) const fn thirds(functions: usize) -> usize {
    functions.div_ceil(3)
}

/// Floats of a [`CellPolynomial`] and of [`CellMatrices`].
const POLYNOMIAL_FLOATS: usize = size_of::<CellPolynomial>() / size_of::<f32>();
const SUM_FLOATS: usize = size_of::<CellMatrices>() / size_of::<f32>();

/// Floats of storage for a lattice with this many cells and functions.
pub(super) const fn floats_for(cells: usize, functions: usize, damped: bool) -> usize {
    let (matrices, per_cell) = if damped { (7, 2 * POLYNOMIAL_FLOATS) } else { (4, POLYNOMIAL_FLOATS) };
    let sums = (per_cell + SUM_FLOATS).saturating_mul(cells_with_sums(cells, functions));
    let means = if damped { 2 * 3 * thirds(functions) * stride(thirds(functions)) } else { 0 };
    sums.saturating_add(matrices * 3 * functions * stride(functions) + means)
}

/// Number of cells with sums: none if there are no functions.
const fn cells_with_sums(cells: usize, functions: usize) -> usize {
    if functions > 0 { cells } else { 0 }
}

impl<'a> Matrices<'a> {
    pub(super) fn split(dense: &'a mut [f32], lattice: &Lattice, damped: bool) -> Option<Self> {
        let functions = lattice.functions();
        let matrix = 3 * functions * stride(functions);
        let (applied, rest) = dense.split_at_mut_checked(matrix)?;
        let (coarse, rest) = rest.split_at_mut_checked(matrix)?;
        let (next_coarse, rest) = rest.split_at_mut_checked(matrix)?;
        let (next_fine, rest) = rest.split_at_mut_checked(matrix)?;
        let count = cells_with_sums(lattice.cell_count(), functions);
        let (cells, rest) = rest.split_at_mut_checked(POLYNOMIAL_FLOATS * count)?;
        let (sums, rest) = rest.split_at_mut_checked(SUM_FLOATS * count)?;
        let cells = must_cast_slice_mut(cells.as_chunks_mut::<POLYNOMIAL_FLOATS>().0);
        let sums = must_cast_slice_mut(sums.as_chunks_mut::<SUM_FLOATS>().0);
        let damped = if damped {
            let mean_matrix = 3 * thirds(functions) * stride(thirds(functions));
            let (inverse, rest) = rest.split_at_mut_checked(matrix)?;
            let (mass, rest) = rest.split_at_mut_checked(matrix)?;
            let (next_mass, rest) = rest.split_at_mut_checked(matrix)?;
            let (mean_inverse, rest) = rest.split_at_mut_checked(mean_matrix)?;
            let (next_mean_inverse, rest) = rest.split_at_mut_checked(mean_matrix)?;
            let momentum = rest.get_mut(..POLYNOMIAL_FLOATS * count)?;
            let momentum = must_cast_slice_mut(momentum.as_chunks_mut::<POLYNOMIAL_FLOATS>().0);
            Some(DampedMatrices { inverse, mass, next_mass, mean_inverse, next_mean_inverse, momentum })
        } else {
            None
        };
        Some(Self { applied, coarse, next_coarse, next_fine, damped, cells, sums })
    }
}

/// Computes the inverse of the mean over the axes of `G`, from the lower triangle of `G`. Gives whether it could be
/// inverted.
pub(super) fn invert_mean(means: &mut [f32], inertia: &[f32], functions: usize, stride: usize) -> bool {
    let (size, row_length) = (3 * thirds(functions), dense::stride(thirds(functions)));
    let at = |row: usize, column: usize| inertia.get(row * stride + column).copied().unwrap_or(0.0);
    for (row, means) in means.chunks_exact_mut(row_length.max(1)).enumerate() {
        for (column, mean) in means.iter_mut().enumerate().take(row + 1) {
            let sum: f32 = (0..3).map(|axis| at(3 * row + axis, 3 * column + axis)).sum();
            *mean = if row < functions { sum / 3.0 } else { f32::from(u8::from(row == column)) };
        }
    }
    let sound =
        (0..thirds(functions)).fold(true, |sound, three| sound & sweep(means, size, row_length, three));
    (0..size).for_each(|row| mirror(means, row_length, row, -1.0));
    sound
}

pub(super) fn copy(to: &mut [f32], from: &[f32]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}
