//! Sums into the dense matrices of a lattice: its tangent stiffness from the elements' bounds, its mass, and
//! the scaled inertia seen through its functions.
//!
//! ```text
//! Kc = sum_e V [ iso grad phi_c . grad phi_d I + volume (C grad phi_c)(C grad phi_d)^T ]
//! Mc = sum_a m w_c w_d I,     G = sum_a w_c w_d (N_a + reserve m I)
//! ```
//! with the gradients of the interpolated functions, `grad phi_c = sum_a w_c(a) ga`, so that `Kc` is exactly
//! `W^T K W` for the elements' bounds. At a node that is held along some axes a function has
//! one gradient for each axis.

use glam::Vec4;

use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS};
use crate::lanes::{Lanes, Real};
use crate::scene::NodeInertia;
use crate::symmetric::Symmetric;

/// One element as the assembly sees it.
pub(super) struct Element {
    pub(super) nodes: [usize; 4],
    pub(super) gradients: [[f32; 3]; 4],
    /// `V iso` and `V volume`, N m.
    pub(super) iso: f32,
    pub(super) volume: f32,
    /// Columns of `C`, padded.
    pub(super) cofactor: [[f32; 4]; 3],
}

/// A dense matrix to add to; only blocks on and below the diagonal are written.
pub(super) struct Assembly<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) nodes: &'a [LatticeNode],
    pub(super) inertia: &'a [NodeInertia],
    pub(super) matrix: &'a mut [f32],
    pub(super) stride: usize,
    /// [`CELL`] rows for each cell of the lattice, or for as many as there is room for.
    pub(super) cells: &'a mut [[f32; CORNERS]],
}

/// Functions of a cell.
pub(super) const CORNERS: usize = 8;
/// Blocks that a cell sums: `xx, yy, zz, xy, yz, zx` of `volume` and the one of `iso`.
const BLOCKS: usize = 7;
/// Rows of a cell's sums: for each function one of each block.
pub(super) const CELL: usize = BLOCKS * CORNERS;

/// Functions that four nodes can touch.
const TOUCHED: usize = 32;
const NOT_TOUCHED: u8 = u8::MAX;
/// Which functions the element at hand touches, none between elements.
pub(super) type Slots = [u8; MAX_FUNCTIONS];
pub(super) const NO_SLOTS: Slots = [NOT_TOUCHED; MAX_FUNCTIONS];

/// Adds a 3 x 3 block where function `c` meets function `d`. Not four wide: the next block would then read what
/// was just written at another alignment, which stalls until it is in the cache.
#[inline(always)]
fn add_block(matrix: &mut [f32], stride: usize, c: usize, d: usize, rows: [[f32; 3]; 3]) {
    let Some(rest) = matrix.get_mut(3 * c * stride + 3 * d..) else {
        return;
    };
    for (axis, [x, y, z]) in rows.into_iter().enumerate() {
        if let Some(place) = rest.get_mut(axis * stride..).and_then(<[f32]>::first_chunk_mut::<3>) {
            *place = [place[0] + x, place[1] + y, place[2] + z];
        }
    }
}

#[inline(always)]
fn add_four(row: &mut [f32], column: usize, values: Vec4) {
    if let Some(place) = row.get_mut(column..).and_then(<[f32]>::first_chunk_mut::<4>) {
        *place = (Vec4::from(*place) + values).to_array();
    }
}

#[inline(always)]
fn store<R: Real>(values: R) -> [f32; CORNERS] {
    let mut row = [0.0; CORNERS];
    for (corner, place) in row.iter_mut().enumerate() {
        *place = values.lane(corner);
    }
    row
}

#[inline(always)]
fn add_row<R: Real>(row: &mut [f32; CORNERS], values: R) {
    *row = store(R::from_fn(|corner| row[corner % CORNERS]) + values);
}

impl Assembly<'_> {
    /// Adds the stiffness bound of an element to the sums of the cell that it is in. Says whether it could: its nodes
    /// must all be in one cell, and each wholly free or wholly held.
    #[inline(always)]
    pub(super) fn add_in_cell<R: Real>(&mut self, element: &Element) -> bool {
        if R::COUNT != CORNERS {
            return false;
        }
        let mut cell = [u8::MAX; 3];
        for &node in &element.nodes {
            let Some(at) = self.nodes.get(node) else {
                return false;
            };
            for (least, at) in cell.iter_mut().zip(at.cell()) {
                *least = if at < *least { at } else { *least };
            }
        }
        let mut slopes = [R::splat(0.0); 3];
        for (&node, gradient) in element.nodes.iter().zip(&element.gradients) {
            let (Some(at), Some(inertia)) = (self.nodes.get(node), self.inertia.get(node)) else {
                return false;
            };
            let [x, y, z, _] = inertia.free().to_array();
            let Some(weights) = at.corner_weights::<R>(cell) else {
                return false;
            };
            if x != y || y != z {
                return false;
            }
            let weights = R::splat(x) * weights;
            for (slope, &component) in slopes.iter_mut().zip(gradient) {
                *slope = *slope + weights * R::splat(component);
            }
        }
        let first = CELL * self.lattice.cell_number(cell);
        let Some(rows) = self.cells.get_mut(first..first + CELL) else {
            return false;
        };
        let mut images = [R::splat(0.0); 3];
        for (slope, column) in slopes.iter().zip(&element.cofactor) {
            for (image, &entry) in images.iter_mut().zip(column) {
                *image = *image + R::splat(entry) * *slope;
            }
        }
        let (volume, iso) = (R::splat(element.volume), R::splat(element.iso));
        let [x, y, z] = images;
        let [p, q, r] = slopes;
        let (ax, ay, az) = (store(volume * x), store(volume * y), store(volume * z));
        let (bp, bq, br) = (store(iso * p), store(iso * q), store(iso * r));
        for (corner, rows) in rows.as_chunks_mut::<BLOCKS>().0.iter_mut().enumerate() {
            let corner = corner % CORNERS;
            let (along_x, along_y, along_z) =
                (R::splat(ax[corner]), R::splat(ay[corner]), R::splat(az[corner]));
            let [xx, yy, zz, xy, yz, zx, all] = rows;
            add_row(xx, along_x * x);
            add_row(yy, along_y * y);
            add_row(zz, along_z * z);
            add_row(xy, along_x * y);
            add_row(yz, along_y * z);
            add_row(zx, along_z * x);
            add_row(all, R::splat(bp[corner]) * p + R::splat(bq[corner]) * q + R::splat(br[corner]) * r);
        }
        true
    }

    /// Adds the sums of a cell to the matrix.
    pub(super) fn add_cell(&mut self, number: usize) {
        let Some((rows, _)) = self.cells.get(CELL * number..).and_then(<[_]>::split_first_chunk::<CELL>)
        else {
            return;
        };
        let functions = self.lattice.corner_functions(number);
        let at = |block: usize, c: usize, d: usize| rows[(BLOCKS * c + block) % CELL][d % CORNERS];
        for (c, &row) in functions.iter().enumerate() {
            for (d, &column) in functions.iter().enumerate().take(c + 1) {
                if row >= MAX_FUNCTIONS || column >= MAX_FUNCTIONS {
                    continue;
                }
                let all = at(6, c, d);
                let rows = [
                    [at(0, c, d) + all, at(3, c, d), at(5, d, c)],
                    [at(3, d, c), at(1, c, d) + all, at(4, c, d)],
                    [at(5, c, d), at(4, d, c), at(2, c, d) + all],
                ];
                add_block(self.matrix, self.stride, row, column, rows);
            }
        }
    }

    /// Adds the stiffness bound of an element.
    #[inline(always)]
    pub(super) fn add_element(&mut self, element: &Element, slots: &mut Slots) {
        // Derivative of each function along each material axis (the lanes are the spatial axes: a function may be cut
        // off along some of them).
        let mut touched = [[Vec4::ZERO; 3]; TOUCHED];
        let (mut count, mut bits) = (0, 0u128);
        for (&node, gradient) in element.nodes.iter().zip(element.gradients) {
            let (Some(at), Some(inertia)) = (self.nodes.get(node), self.inertia.get(node)) else {
                continue;
            };
            let free = inertia.free();
            let along = gradient.map(|slope| slope * free);
            for (function, weight) in self.lattice.weights(at) {
                let Some(slot) = slots.get_mut(function) else {
                    continue;
                };
                if weight == 0.0 {
                    continue;
                }
                if let Some(touch) = touched.get_mut(usize::from(*slot)) {
                    for (slope, along) in touch.iter_mut().zip(along) {
                        *slope += weight * along;
                    }
                } else if let Some(touch) = touched.get_mut(count) {
                    *slot = count as u8;
                    *touch = along.map(|along| weight * along);
                    bits |= 1 << function;
                    count += 1;
                }
            }
        }
        let [cx, cy, cz] = element.cofactor.map(Vec4::from);
        // In ascending order of the functions: only blocks on and below the diagonal are kept.
        let mut functions = [0usize; TOUCHED];
        let mut images = [Vec4::ZERO; TOUCHED];
        let mut slopes = [[Vec4::ZERO; 3]; TOUCHED];
        for place in 0..count {
            let function = bits.trailing_zeros() as usize;
            bits &= bits.wrapping_sub(1);
            let Some(slot) = slots.get_mut(function) else {
                return;
            };
            let Some(&[x, y, z]) = touched.get(usize::from(*slot)) else {
                return;
            };
            *slot = NOT_TOUCHED;
            functions[place % TOUCHED] = function;
            images[place % TOUCHED] = cx * x + cy * y + cz * z;
            slopes[place % TOUCHED] = [x, y, z];
        }
        for c in 0..count {
            let c = c % TOUCHED;
            let first = 3 * functions[c] * self.stride;
            let Some(rows) = self.matrix.get_mut(first..first + 3 * self.stride) else {
                return;
            };
            let (row_x, rows) = rows.split_at_mut(self.stride);
            let (row_y, row_z) = rows.split_at_mut(self.stride);
            let [x, y, z] = slopes[c].map(|slope| element.iso * slope);
            let image = element.volume * images[c];
            // A block is added four wide and spills a zero into the next one, which would have to wait for it to reach
            // the cache: so every other function first.
            for d in (0..=c).step_by(2).chain((1..=c).step_by(2)) {
                let d = d % TOUCHED;
                let diagonal = x * slopes[d][0] + y * slopes[d][1] + z * slopes[d][2];
                let column = 3 * functions[d];
                add_four(row_x, column, image.x * images[d] + diagonal * Vec4::X);
                add_four(row_y, column, image.y * images[d] + diagonal * Vec4::Y);
                add_four(row_z, column, image.z * images[d] + diagonal * Vec4::Z);
            }
        }
    }
}

/// Sums of the nodes of one cell for each pair of its functions: the inertia's `xx, yy, zz, xy, yz, zx` and the mass
/// along each axis.
pub(super) struct NodeSums {
    cell: Option<LatticeNode>,
    rows: [[[f32; CORNERS]; 9]; CORNERS],
}

impl NodeSums {
    pub(super) const NONE: Self = Self { cell: None, rows: [[[0.0; CORNERS]; 9]; CORNERS] };

    /// Adds a node's inertia and its mass (kg, zero rows at held axes); the matrices get the sums of the cell before
    /// when it is in another one.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        node: &LatticeNode,
        inertia: &Symmetric,
        mass: [f32; 3],
        into: &mut NodeMatrices<'_>,
    ) {
        if self.cell.is_none_or(|last| last.cell() != node.cell()) {
            self.flush(into);
            self.cell = Some(*node);
        }
        let Symmetric { xx, yy, zz, xy, yz, zx } = *inertia;
        let entries = [xx, yy, zz, xy, yz, zx, mass[0], mass[1], mass[2]];
        let weights = node.eight_weights();
        for (rows, weight) in self.rows.iter_mut().zip(weights) {
            let products = Lanes([weight; CORNERS]) * Lanes(weights);
            for (row, entry) in rows.iter_mut().zip(entries) {
                *row = (Lanes(*row) + Lanes([entry; CORNERS]) * products).0;
            }
        }
    }

    /// Gives the sums to the matrices.
    pub(super) fn flush(&mut self, into: &mut NodeMatrices<'_>) {
        let Some(cell) = self.cell.take() else {
            return;
        };
        let functions = into.lattice.functions_of(&cell);
        for (rows, &c) in self.rows.iter_mut().zip(&functions) {
            for (corner, &d) in functions.iter().enumerate() {
                if c >= MAX_FUNCTIONS || d > c {
                    continue;
                }
                let [xx, yy, zz, xy, yz, zx, mx, my, mz] = rows.map(|row| row[corner % CORNERS]);
                add_block(into.inertia, into.stride, c, d, [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]);
                for (axis, mass) in [mx, my, mz].into_iter().enumerate() {
                    if let Some(place) = into.mass.get_mut((3 * c + axis) * into.stride + 3 * d + axis) {
                        *place += mass;
                    }
                }
            }
            *rows = [[0.0; CORNERS]; 9];
        }
    }
}

/// Dense matrices to add [`NodeSums`] to.
pub(super) struct NodeMatrices<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) inertia: &'a mut [f32],
    pub(super) mass: &'a mut [f32],
    pub(super) stride: usize,
}
