//! The dense matrices of a lattice over one storage of the caller, and what its cells sum on the way to them. `S` is the lattice's
//! inertia with what the step adds, `G` that of the nodes as the lattice sees it, `X = S^-1 - G^-1` what a step applies
//! ([`super::refresh`] has the cycle in which they are computed).

use bytemuck::must_cast_slice_mut;

use super::assembly::CellSums;
use super::cells::Cell;
use super::dense::{self, mirror, stride, sweep};
use super::lattice::Lattice;

/// The dense matrices of a lattice, and what its cells sum.
pub(super) struct Matrices<'a> {
    /// `X`, what a step applies.
    pub(super) applied: &'a mut [f32],
    /// `S` of `X`, not inverted.
    pub(super) kept: &'a mut [f32],
    /// The next `S`.
    pub(super) next: &'a mut [f32],
    /// The next `G`.
    pub(super) fine: &'a mut [f32],
    /// Of a damped step.
    pub(super) damped: Option<DampedMatrices<'a>>,
    /// For the passes over the nodes.
    pub(super) cells: &'a mut [Cell],
    pub(super) sums: &'a mut [CellSums],
}

/// What a damped step has beside.
pub(super) struct DampedMatrices<'a> {
    /// `S^-1` in use.
    pub(super) inverse: &'a mut [f32],
    /// The mass in `S`, `(1 + k) Mc`, in use and next.
    pub(super) mass: &'a mut [f32],
    pub(super) next_mass: &'a mut [f32],
    /// The inverse of `G` with each node's inertia the mean over its axes, in use and next: one number for two functions,
    /// and none that turns.
    pub(super) mean: &'a mut [f32],
    pub(super) next_mean: &'a mut [f32],
    /// Sums of the momentum, then what of the increments is smooth.
    pub(super) momentum: &'a mut [Cell],
}

/// Functions of as many unknowns each as [`sweep`] takes at once, for one unknown each of `functions`.
pub(super) const fn thirds(functions: usize) -> usize {
    functions.div_ceil(3)
}

/// Numbers of a [`Cell`] and of its sums.
const CELL_NUMBERS: usize = size_of::<Cell>() / size_of::<f32>();
const SUM_NUMBERS: usize = size_of::<CellSums>() / size_of::<f32>();

/// Numbers that the matrices of a lattice with this many cells and functions need.
pub(super) const fn numbers_for(cells: usize, functions: usize, damped: bool) -> usize {
    let (matrices, per_cell) = if damped { (7, 2 * CELL_NUMBERS) } else { (4, CELL_NUMBERS) };
    let sums = (per_cell + SUM_NUMBERS).saturating_mul(summing(cells, functions));
    let means = if damped { 2 * 3 * thirds(functions) * stride(thirds(functions)) } else { 0 };
    sums.saturating_add(matrices * 3 * functions * stride(functions) + means)
}

/// Cells that sum something: none where no function is left.
const fn summing(cells: usize, functions: usize) -> usize {
    if functions > 0 { cells } else { 0 }
}

impl<'a> Matrices<'a> {
    pub(super) fn split(dense: &'a mut [f32], lattice: &Lattice, damped: bool) -> Option<Self> {
        let functions = lattice.functions();
        let one = 3 * functions * stride(functions);
        let (applied, rest) = dense.split_at_mut_checked(one)?;
        let (kept, rest) = rest.split_at_mut_checked(one)?;
        let (next, rest) = rest.split_at_mut_checked(one)?;
        let (fine, rest) = rest.split_at_mut_checked(one)?;
        let count = summing(lattice.cell_count(), functions);
        let (cells, rest) = rest.split_at_mut_checked(CELL_NUMBERS * count)?;
        let (sums, rest) = rest.split_at_mut_checked(SUM_NUMBERS * count)?;
        let cells = must_cast_slice_mut(cells.as_chunks_mut::<CELL_NUMBERS>().0);
        let sums = must_cast_slice_mut(sums.as_chunks_mut::<SUM_NUMBERS>().0);
        let damped = if damped {
            let third = 3 * thirds(functions) * stride(thirds(functions));
            let (inverse, rest) = rest.split_at_mut_checked(one)?;
            let (mass, rest) = rest.split_at_mut_checked(one)?;
            let (next_mass, rest) = rest.split_at_mut_checked(one)?;
            let (mean, rest) = rest.split_at_mut_checked(third)?;
            let (next_mean, rest) = rest.split_at_mut_checked(third)?;
            let momentum = rest.get_mut(..CELL_NUMBERS * count)?;
            let momentum = must_cast_slice_mut(momentum.as_chunks_mut::<CELL_NUMBERS>().0);
            Some(DampedMatrices { inverse, mass, next_mass, mean, next_mean, momentum })
        } else {
            None
        };
        Some(Self { applied, kept, next, fine, damped, cells, sums })
    }
}

/// The inverse of the mean over the axes of `G`, of which the lower triangle is there. Whether it could be inverted.
pub(super) fn invert_means(means: &mut [f32], inertia: &[f32], functions: usize, stride: usize) -> bool {
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
