//! The inertia `G = W^T M W` of the nodes projected to a lattice (kg), `G = sum_a w_c w_d (N_a + reserve m I)`. Sums
//! over nodes are first made for each cell, where all functions are known, and then added to the matrix.

use bytemuck::{Pod, Zeroable};

use super::lattice::{LatticeNode, MAX_FUNCTIONS};
use crate::element::symmetric::Symmetric;
use crate::simd::Real;

/// Functions of a cell, one for each corner.
const CORNERS: usize = 8;
/// Products of two functions of a cell: three along each axis, so 27, rounded up to whole vectors.
const PRODUCTS: usize = 32;
/// Entries of the inertia of a node.
const ENTRIES: usize = 6;

/// Sums over the nodes of one cell: for each entry of the inertia a row, because the product of two functions of a
/// cell is one of only 27 polynomials.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct CellSums([[f32; PRODUCTS]; ENTRIES]);

/// Adds a 3 x 3 submatrix at row `c` and column `d` of functions. Rows of four floats would be slower: the
/// next submatrix would read memory that was just written at another alignment, and wait for the cache.
#[inline(always)]
fn add_submatrix(matrix: &mut [f32], stride: usize, c: usize, d: usize, rows: [[f32; 3]; 3]) {
    let Some(rest) = matrix.get_mut(3 * c * stride + 3 * d..) else {
        return;
    };
    for (axis, [x, y, z]) in rows.into_iter().enumerate() {
        if let Some(place) = rest.get_mut(axis * stride..).and_then(<[f32]>::first_chunk_mut::<3>) {
            *place = [place[0] + x, place[1] + y, place[2] + z];
        }
    }
}

/// Pairs of a cell's functions on and below the diagonal: two corners and their functions, without dropped ones.
fn pairs(functions: [usize; CORNERS]) -> impl Iterator<Item = (usize, usize, usize, usize)> {
    let at = move |corner: usize| functions[corner % CORNERS];
    (0..CORNERS)
        .flat_map(move |c| (0..CORNERS).map(move |d| (c, d, at(c), at(d))))
        .filter(|&(_, _, row, column)| row < MAX_FUNCTIONS && column <= row)
}

impl CellSums {
    pub(super) const NONE: Self = Self([[0.0; PRODUCTS]; ENTRIES]);

    /// Adds the inertia of a node, kg, with zero rows at held axes.
    #[inline(always)]
    pub(super) fn add_node<R: Real>(&mut self, node: &LatticeNode, inertia: &Symmetric) {
        let Symmetric { xx, yy, zz, xy, yz, zx } = *inertia;
        let entries = [xx, yy, zz, xy, yz, zx];
        // Products of two functions along an axis: both of the near point, one of each, both of the far point.
        let [x, y, z] = node.within().map(|far| [(1.0 - far) * (1.0 - far), (1.0 - far) * far, far * far]);
        let mut products = [0.0; PRODUCTS];
        let yz_products = z.into_iter().flat_map(|z| y.map(|y| y * z));
        for (three, yz) in products.as_chunks_mut::<3>().0.iter_mut().zip(yz_products) {
            *three = x.map(|x| x * yz);
        }
        for (row, entry) in self.0.iter_mut().zip(entries) {
            add_times::<R>(row, entry, &products);
        }
    }

    /// The sums over nodes for functions `c` and `d` of the cell.
    #[inline(always)]
    fn node_sums(&self, c: usize, d: usize) -> [f32; ENTRIES] {
        let product = (c & 1) + (d & 1) + 3 * ((c >> 1 & 1) + (d >> 1 & 1)) + 9 * ((c >> 2) + (d >> 2));
        self.0.each_ref().map(|row| row[product % PRODUCTS])
    }
}

/// `row += factor values`.
#[inline(always)]
fn add_times<R: Real>(row: &mut [f32], factor: f32, values: &[f32]) {
    let factor = R::splat(factor);
    for (row, values) in row.chunks_exact_mut(R::COUNT).zip(values.chunks_exact(R::COUNT)) {
        let values = R::from_fn(|lane| values.get(lane).copied().unwrap_or(0.0));
        let sum = factor.fused(values, R::from_fn(|lane| row.get(lane).copied().unwrap_or(0.0)));
        for (lane, place) in row.iter_mut().enumerate() {
            *place = sum.lane(lane);
        }
    }
}

/// Adds the sums of a cell to `G`, and clears them.
pub(super) fn add_cell(matrix: &mut [f32], stride: usize, functions: [usize; CORNERS], sums: &mut CellSums) {
    for (c, d, row, column) in pairs(functions) {
        let [xx, yy, zz, xy, yz, zx] = sums.node_sums(c, d);
        add_submatrix(matrix, stride, row, column, [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]);
    }
    *sums = CellSums::NONE;
}
