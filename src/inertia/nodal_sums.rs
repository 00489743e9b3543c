//! What the nodes contribute to a lattice (kg): its mass, and a bound of their own inertia `G` projected to it.
//!
//! ```text
//! Mc = sum_a m w_c w_d I,     G_c = sum_a |w_c| (sum_d |w_d|) (N_a + reserve m I)
//! ```
//! The bound has one 3 x 3 matrix `G_c` for each function. It is above `W^T M W` with the nodes' inertia `M`, because
//! `(sum_c w_c x_c)^2 <= (sum_d |w_d|) sum_c |w_c| x_c^2`. For translations away from supports and inside the cells,
//! where weights are positive and add up to one, both are the same.

use glam::Vec4;

use super::dense::{row_length, stride};
use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS};
use super::matrices::of_axes;
use super::node::inverse_on_free;
use crate::element::NodeInertia;
use crate::element::symmetric::Symmetric;

/// A symmetric 3 x 3 matrix as `xx, yy, zz, 0` and `xy, yz, zx, 0`.
pub(super) type FunctionInertia = [[f32; 4]; 2];

/// Adds the inertia of a node, kg, with zero rows at held axes, to the functions that move it.
#[inline(always)]
pub(super) fn add_inertia(sums: &mut [FunctionInertia], lattice: &Lattice, place: &LatticeNode, inertia: &Symmetric) {
    let weights = lattice.weights(place);
    let mut total = 0.0;
    for (function, weight) in weights {
        total += if function < MAX_FUNCTIONS { weight.abs() } else { 0.0 };
    }
    let Symmetric { xx, yy, zz, xy, yz, zx } = *inertia;
    let rows = [Vec4::new(xx, yy, zz, 0.0), Vec4::new(xy, yz, zx, 0.0)];
    for (function, weight) in weights {
        if let Some(sums) = sums.get_mut(function) {
            for (sum, row) in sums.iter_mut().zip(rows) {
                *sum = (Vec4::from(*sum) + weight.abs() * total * row).to_array();
            }
        }
    }
}

fn to_symmetric([[xx, yy, zz, _], [xy, yz, zx, _]]: FunctionInertia) -> Symmetric {
    Symmetric { xx, yy, zz, xy, yz, zx }
}

/// The inverses of such sums, 1/kg, with zeros along axes that no node of a function can move along.
pub(super) fn invert(inverses: &mut [FunctionInertia], sums: &[FunctionInertia]) {
    for (inverse, &sum) in inverses.iter_mut().zip(sums) {
        let sum = to_symmetric(sum);
        let Symmetric { xx, yy, zz, xy, yz, zx } = inverse_on_free(sum, [sum.xx, sum.yy, sum.zz]);
        *inverse = [[xx, yy, zz, 0.0], [xy, yz, zx, 0.0]];
    }
}

/// The product with a vector.
#[inline(always)]
pub(super) fn times(inertia: &FunctionInertia, vector: [f32; 3]) -> [f32; 3] {
    to_symmetric(*inertia).times(vector)
}

/// Computes `Mc`: for each axis a matrix of one unknown for each function, one after the other, in rows of
/// [`row_length`].
pub(super) fn write_mass(matrices: &mut [f32], lattice: &Lattice, places: &[LatticeNode], inertia: &[NodeInertia]) {
    matrices.fill(0.0);
    let (size, functions) = (matrices.len() / 3, lattice.functions());
    let length = row_length(functions);
    for place in places {
        let Some(node) = inertia.get(place.node()) else {
            continue;
        };
        // A held axis follows its support: no inertia.
        let masses = (node.free() * node.mass).truncate().to_array();
        let weights = lattice.weights(place);
        for (matrix, mass) in matrices.chunks_exact_mut(size.max(1)).zip(masses) {
            for (row, by) in weights.into_iter().filter(|(row, _)| *row < MAX_FUNCTIONS) {
                for (column, with) in weights.into_iter().filter(|(column, _)| *column < MAX_FUNCTIONS) {
                    let entry = matrix.get_mut(row * length + column);
                    entry.into_iter().for_each(|entry| *entry += by * with * mass);
                }
            }
        }
    }
    // An axis along which all nodes of a function are held has no force either: any mass serves.
    for matrix in matrices.chunks_exact_mut(size.max(1)) {
        for entry in matrix.iter_mut().step_by(length + 1).take(functions).filter(|entry| **entry <= 0.0) {
            *entry = 1.0;
        }
    }
}

/// Gives an axis along which all nodes of a function are held, and no force acts, the mass that [`write_mass`] has
/// there.
pub(super) fn fill_held_axes(inertia: &mut [f32], mass: &[f32], functions: usize) {
    let (stride, length) = (stride(functions), row_length(functions));
    for (axis, mass) in of_axes(mass).into_iter().enumerate() {
        let diagonal = inertia.iter_mut().skip(axis * (stride + 1)).step_by(3 * (stride + 1));
        for (inertia, mass) in diagonal.zip(mass.iter().step_by(length + 1)).take(functions) {
            if *inertia == 0.0 {
                *inertia = *mass;
            }
        }
    }
}

/// Adds `factor Mc` to the lower triangle of a matrix with three unknowns for each function, in rows of `stride`
/// entries.
pub(super) fn add_mass(matrix: &mut [f32], stride: usize, masses: &[f32], functions: usize, factor: f32) {
    let (size, length) = (masses.len() / 3, row_length(functions));
    for (axis, mass) in masses.chunks_exact(size.max(1)).enumerate() {
        for (function, masses) in mass.chunks_exact(length.max(1)).enumerate() {
            let row = matrix.get_mut((3 * function + axis) * stride + axis..).unwrap_or_default();
            for (entry, mass) in row.iter_mut().step_by(3).zip(masses).take(function + 1) {
                *entry += factor * mass;
            }
        }
    }
}
