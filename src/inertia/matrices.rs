//! The matrices of a lattice (kg, inverses 1/kg) and the sums of its cells, in the caller's storage. `S` is the inertia
//! of the lattice's motion, with the inertia that the step adds; `G` is the nodes' inertia projected to the
//! lattice. [`super::refresh`] computes their inverses in cycles.

use bytemuck::must_cast_slice_mut;

use super::cells::CellPolynomial;
use super::dense::{invert, row_length, stride};
use super::lattice::Lattice;
use super::nodal_sums::FunctionInertia;
use super::projected_inertia::CellSums;
use crate::copy::copy;

/// The matrices of a lattice, and the sums of its cells.
pub(super) struct Matrices<'a> {
    /// `S^-1` in use, and the next `S`, then its inverse.
    pub(super) coarse_inverse: &'a mut [f32],
    pub(super) next_coarse: &'a mut [f32],
    /// `G^-1` in use, if any, and the next `G`, then its inverse.
    pub(super) fine_inverse: &'a mut [f32],
    pub(super) next_fine: &'a mut [f32],
    /// The inverse of the bound of `G` in use, and the next bound, for each function.
    pub(super) bound_inverse: &'a mut [FunctionInertia],
    pub(super) next_bound: &'a mut [FunctionInertia],
    /// `Mc` and its inverse, one after the other for each axis, with one unknown a function. They are constant, as is
    /// the following.
    pub(super) mass: &'a mut [f32],
    pub(super) mass_inverse: &'a mut [f32],
    /// The stiffness of the stabilising energy of nodal strain, with the factor `s_c D^2 / 4`; laid out as `Mc`, empty
    /// for others.
    pub(super) stabilising: &'a mut [f32],
    /// See [`super::transport`].
    pub(super) edge_inverse: &'a mut [f32],
    /// Used by the passes over the nodes: sums of the residual, later the lattice's motion; the motion that the nodes'
    /// own inertia gives to the lattice; sums of the momentum, later the smooth part of the increments.
    pub(super) cells: &'a mut [CellPolynomial],
    pub(super) fine_cells: &'a mut [CellPolynomial],
    pub(super) smooth_cells: &'a mut [CellPolynomial],
    /// Used by the assembly of `G`.
    pub(super) sums: &'a mut [CellSums],
}

/// Floats of a [`CellPolynomial`], of [`CellSums`] and of a [`FunctionInertia`].
const POLYNOMIAL_FLOATS: usize = size_of::<CellPolynomial>() / size_of::<f32>();
const SUM_FLOATS: usize = size_of::<CellSums>() / size_of::<f32>();
const INERTIA_FLOATS: usize = size_of::<FunctionInertia>() / size_of::<f32>();

/// Floats of a matrix with three unknowns a function, and of one with one.
const fn matrix_floats(functions: usize) -> [usize; 2] {
    [3 * functions * stride(functions), functions * row_length(functions)]
}

/// Floats of storage for a lattice with this many cells and functions, on a scene with nodal strain or without.
pub(super) const fn floats_for(cells: usize, functions: usize, nodal_strain: bool) -> usize {
    let [matrix, scalar_matrix] = matrix_floats(functions);
    let scalar_matrices = if nodal_strain { 10 } else { 7 };
    let sums = (3 * POLYNOMIAL_FLOATS + SUM_FLOATS).saturating_mul(cells_with_sums(cells, functions));
    sums.saturating_add(4 * matrix + scalar_matrices * scalar_matrix + 2 * INERTIA_FLOATS * functions)
}

/// Number of cells with sums: none if there are no functions.
const fn cells_with_sums(cells: usize, functions: usize) -> usize {
    if functions > 0 { cells } else { 0 }
}

impl<'a> Matrices<'a> {
    pub(super) fn split(dense: &'a mut [f32], lattice: &Lattice, nodal_strain: bool) -> Option<Self> {
        let [matrix, scalar_matrix] = matrix_floats(lattice.functions());
        let count = cells_with_sums(lattice.cell_count(), lattice.functions());
        let (coarse_inverse, rest) = dense.split_at_mut_checked(matrix)?;
        let (next_coarse, rest) = rest.split_at_mut_checked(matrix)?;
        let (fine_inverse, rest) = rest.split_at_mut_checked(matrix)?;
        let (next_fine, rest) = rest.split_at_mut_checked(matrix)?;
        let (mass, rest) = rest.split_at_mut_checked(3 * scalar_matrix)?;
        let (mass_inverse, rest) = rest.split_at_mut_checked(3 * scalar_matrix)?;
        let stabilising = if nodal_strain { 3 * scalar_matrix } else { 0 };
        let (stabilising, rest) = rest.split_at_mut_checked(stabilising)?;
        let (edge_inverse, rest) = rest.split_at_mut_checked(scalar_matrix)?;
        let (cells, rest) = split_polynomials(rest, count)?;
        let (fine_cells, rest) = split_polynomials(rest, count)?;
        let (smooth_cells, rest) = split_polynomials(rest, count)?;
        let (sums, rest) = rest.split_at_mut_checked(SUM_FLOATS * count)?;
        let sums = must_cast_slice_mut(sums.as_chunks_mut::<SUM_FLOATS>().0);
        let inertia = rest.get_mut(..2 * INERTIA_FLOATS * lattice.functions())?;
        let inertia: &mut [FunctionInertia] = must_cast_slice_mut(inertia.as_chunks_mut::<INERTIA_FLOATS>().0);
        let (bound_inverse, next_bound) = inertia.split_at_mut_checked(lattice.functions())?;
        Some(Self {
            coarse_inverse,
            fine_inverse,
            next_coarse,
            next_fine,
            mass,
            mass_inverse,
            stabilising,
            edge_inverse,
            cells,
            fine_cells,
            smooth_cells,
            bound_inverse,
            next_bound,
            sums,
        })
    }
}

fn split_polynomials(floats: &mut [f32], count: usize) -> Option<(&mut [CellPolynomial], &mut [f32])> {
    let (polynomials, rest) = floats.split_at_mut_checked(POLYNOMIAL_FLOATS * count)?;
    Some((must_cast_slice_mut(polynomials.as_chunks_mut::<POLYNOMIAL_FLOATS>().0), rest))
}

/// The matrix of each axis.
pub(super) fn of_axes(matrices: &[f32]) -> [&[f32]; 3] {
    let size = matrices.len() / 3;
    let mut parts = matrices.chunks_exact(size.max(1));
    [(); 3].map(|()| parts.next().unwrap_or_default())
}

/// Computes the inverses of such matrices from their lower triangles. Gives whether they could be inverted.
pub(super) fn invert_axes(inverses: &mut [f32], matrices: &[f32], functions: usize) -> bool {
    copy(inverses, matrices);
    let size = inverses.len() / 3;
    let mut parts = inverses.chunks_exact_mut(size.max(1));
    parts.by_ref().fold(true, |sound, matrix| sound & invert(matrix, functions, row_length(functions)))
}
