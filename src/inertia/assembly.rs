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

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS, corner_weights, place_of};
use crate::lanes::{Real, write_rows};
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
    /// Of each cell.
    pub(super) sums: &'a mut [CellSums],
}

/// Functions of a cell.
const CORNERS: usize = 8;
/// Sums of one cell for each pair of its functions, eight a row: for each function one row of each block. Of elements
/// the blocks are `xx, yy, zz, xy, yz, zx` of `volume` and the one of `iso`. Of nodes the sums take less: two functions of a
/// cell multiply to one of 27 products. They are kept 32 a row for the inertia and the mass along each axis, and behind them
/// a row of the eight functions for each axis of the momentum.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct CellSums([[[f32; CORNERS]; BLOCKS]; CORNERS]);

const BLOCKS: usize = 9;

impl CellSums {
    pub(super) const NONE: Self = Self([[[0.0; CORNERS]; BLOCKS]; CORNERS]);
}

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

/// In one order: glam's differs from processor to processor.
#[inline(always)]
fn sum(numbers: Vec4) -> f32 {
    (numbers.x + numbers.z) + (numbers.y + numbers.w)
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

/// `row += factors values`, a product after the other.
#[inline(always)]
fn add_row<R: Real, const N: usize>(row: &mut [f32; CORNERS], products: [(R, R); N]) {
    let mut sum = R::from_fn(|corner| row[corner % CORNERS]);
    for (factor, value) in products {
        sum = factor.fused(value, sum);
    }
    *row = store(sum);
}

/// Gradients of the eight functions of a cell (1/m) and their images under `C`, lane by lane.
#[derive(Clone, Copy)]
struct Corners<R> {
    slopes: [R; 3],
    images: [R; 3],
}

impl<R: Real> Corners<R> {
    #[inline(always)]
    fn new(slopes: [R; 3], element: &Element) -> Self {
        let mut images = [R::splat(0.0); 3];
        for (slope, column) in slopes.iter().zip(&element.cofactor) {
            for (image, &entry) in images.iter_mut().zip(column) {
                *image = *image + R::splat(entry) * *slope;
            }
        }
        Self { slopes, images }
    }

    /// Images and slopes of each corner, padded.
    #[inline(always)]
    fn by_corner(&self) -> [[[f32; 4]; CORNERS]; 2] {
        let mut corners = [[[0.0; 4]; CORNERS]; 2];
        for ([x, y, z], rows) in [self.images, self.slopes].into_iter().zip(&mut corners) {
            write_rows(rows, 0, [x, y, z, R::splat(0.0)]);
        }
        corners
    }

    #[inline(always)]
    fn masked(&self, mask: R) -> Self {
        let [p, q, r] = self.slopes;
        let [x, y, z] = self.images;
        Self { slopes: [mask * p, mask * q, mask * r], images: [mask * x, mask * y, mask * z] }
    }
}

/// The cell that all nodes of an element are in, or the lower one of two neighbours along an axis.
pub(super) struct Home {
    cell: usize,
    pub(super) across: Option<usize>,
    /// Position of each node from the cell's lowest corner, in cells; and as fourth number one if the node is free, else zero.
    nodes: [Vec4; 4],
}

impl Assembly<'_> {
    /// Where an element is, if it is in one or two cells and its nodes are wholly free or wholly held.
    #[inline(always)]
    pub(super) fn home(&self, nodes: &[usize; 4]) -> Option<Home> {
        let (mut low, mut high) = (Vec4::splat(f32::MAX), Vec4::ZERO);
        let mut places = [[Vec4::ZERO; 2]; 4];
        for (&node, place) in nodes.iter().zip(&mut places) {
            let (at, inertia) = (place_of(self.nodes, node)?, self.inertia.get(node)?);
            let [x, y, z] = at.within();
            let free = match inertia.free().cmpgt(Vec4::ZERO).bitmask() {
                0 => 0.0,
                0b111 => 1.0,
                _ => return None,
            };
            let [i, j, k] = self.lattice.place_of(at.cell()).map(f32::from);
            *place = [Vec4::new(i, j, k, 0.0), Vec4::new(x, y, z, free)];
            // A node on the border of two cells is in both.
            let [least, within] = *place;
            let border = Vec4::select(within.cmple(Vec4::ZERO), Vec4::ONE, Vec4::ZERO);
            low = low.min(least);
            high = high.max(least - border);
        }
        let span = high - low;
        let more = span.cmpgt(Vec4::ZERO).bitmask() & 0b111;
        if more.count_ones() > 1 || span.cmpgt(Vec4::ONE).any() {
            return None;
        }
        let across = if more == 0 { None } else { Some(more.trailing_zeros() as usize) };
        let [i, j, k, _] = low.to_array().map(|along| along as u8);
        let nodes = places.map(|[cell, within]| (cell - low) + within);
        Some(Home { cell: self.lattice.cell_number([i, j, k]), across, nodes })
    }

    /// Adds the stiffness bound of an element to the sums of the cell that it is in, or of the two. Says whether it could.
    #[inline(always)]
    pub(super) fn add_in_cells<R: Real>(&mut self, element: &Element) -> bool {
        if R::COUNT != CORNERS {
            return false;
        }
        let Some(Home { cell, across, nodes }) = self.home(&element.nodes) else {
            return false;
        };
        // Along the axis across, the layers of functions of two cells are numbered 0, 1, 2: `near` has 0 and 1, `far` 1
        // and 2.
        let (mut near, mut far) = ([R::splat(0.0); 3], [R::splat(0.0); 3]);
        for (place, gradient) in nodes.iter().zip(&element.gradients) {
            let weights = corner_weights::<R>(*place, across);
            for axis in 0..3 {
                let slope = R::splat(place.w * gradient[axis]);
                near[axis] = near[axis] + weights[0] * slope;
                if across.is_some() {
                    far[axis] = far[axis] + weights[1] * slope;
                }
            }
        }
        let near = Corners::new(near, element);
        let Some(sums) = self.sums.get_mut(cell) else {
            return false;
        };
        sums.add_products(element, &near, |_| near);
        if let Some(axis) = across {
            let far = Corners::new(far, element);
            let next = cell + self.lattice.next_along(axis);
            let Some(sums) = self.sums.get_mut(next) else {
                return false;
            };
            // What both have, layer 1 with itself, once.
            let last = R::from_fn(|corner| if corner >> axis & 1 == 1 { 1.0 } else { 0.0 });
            let beyond = far.masked(last);
            sums.add_products(element, &far, |corner| if corner >> axis & 1 == 1 { far } else { beyond });
            self.add_ends(element, axis, [cell, next], &near, &far);
        }
        true
    }

    /// Adds what layers 0 and 2 have with each other, which no cell sums.
    #[inline(always)]
    fn add_ends<R: Real>(
        &mut self,
        element: &Element,
        axis: usize,
        cells: [usize; 2],
        near: &Corners<R>,
        far: &Corners<R>,
    ) {
        let [low, high] = cells.map(|cell| self.lattice.functions_of(cell));
        let ([images, slopes], [far_images, far_slopes]) = (near.by_corner(), far.by_corner());
        // Of the four corners across the axis.
        let corner = |number: usize| (number >> axis) << (axis + 1) | number & ((1 << axis) - 1);
        for c in [0, 1, 2, 3].map(corner) {
            let (image, slope) = (Vec4::from(images[c % CORNERS]), Vec4::from(slopes[c % CORNERS]));
            for d in [0, 1, 2, 3].map(|number| corner(number) | 1 << axis) {
                let (first, last) = (low[c % CORNERS], high[d % CORNERS]);
                if first >= MAX_FUNCTIONS || last >= MAX_FUNCTIONS {
                    continue;
                }
                let far_image = Vec4::from(far_images[d % CORNERS]);
                let all = element.iso * sum(slope * Vec4::from(far_slopes[d % CORNERS]));
                let (row, down, column, along) = if first < last {
                    (last, far_image, first, image)
                } else {
                    (first, image, last, far_image)
                };
                let [x, y, z, _] = (element.volume * down).to_array();
                let Some(lines) = self.matrix.get_mut(3 * row * self.stride..) else {
                    continue;
                };
                let values =
                    [x * along + all * Vec4::X, y * along + all * Vec4::Y, z * along + all * Vec4::Z];
                for (line, values) in lines.chunks_exact_mut(self.stride.max(1)).zip(values) {
                    add_four(line, 3 * column, values);
                }
            }
        }
    }

    /// Adds the sums of a cell to the matrix, and makes room for the next ones.
    pub(super) fn add_cell(&mut self, number: usize) {
        let Some(sums) = self.sums.get_mut(number) else {
            return;
        };
        let functions = self.lattice.functions_of(number);
        for (c, d, row, column) in pairs(functions) {
            let at = |block: usize, c: usize, d: usize| sums.0[c % CORNERS][block][d % CORNERS];
            let all = at(6, c, d);
            let rows = [
                [at(0, c, d) + all, at(3, c, d), at(5, d, c)],
                [at(3, d, c), at(1, c, d) + all, at(4, c, d)],
                [at(5, c, d), at(4, d, c), at(2, c, d) + all],
            ];
            add_block(self.matrix, self.stride, row, column, rows);
        }
        *sums = CellSums::NONE;
    }

    /// Adds the stiffness bound of an element.
    #[inline(always)]
    pub(super) fn add_element(&mut self, element: &Element, slots: &mut Slots) {
        // Derivative of each function along each material axis (the lanes are the spatial axes: a function may be cut
        // off along some of them).
        let mut touched = [[Vec4::ZERO; 3]; TOUCHED];
        let (mut count, mut bits) = (0, 0u128);
        for (&node, gradient) in element.nodes.iter().zip(element.gradients) {
            let (Some(at), Some(inertia)) = (place_of(self.nodes, node), self.inertia.get(node)) else {
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
            let rows = self.matrix.get_mut(first..first + 3 * self.stride);
            let Some((row_x, rows)) = rows.and_then(|rows| rows.split_at_mut_checked(self.stride)) else {
                return;
            };
            let Some((row_y, row_z)) = rows.split_at_mut_checked(self.stride) else {
                return;
            };
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

/// Pairs of a cell's functions on and below the diagonal: two corners, their row and column.
fn pairs(functions: [usize; CORNERS]) -> impl Iterator<Item = (usize, usize, usize, usize)> {
    let at = move |corner: usize| functions[corner % CORNERS];
    (0..CORNERS)
        .flat_map(move |c| (0..=c).map(move |d| (c, d, at(c), at(d))))
        .filter(|&(_, _, row, column)| row < MAX_FUNCTIONS && column < MAX_FUNCTIONS)
}

impl CellSums {
    /// Adds an element: for each corner the products with all of `columns`.
    #[inline(always)]
    fn add_products<R: Real>(
        &mut self,
        element: &Element,
        corners: &Corners<R>,
        columns: impl Fn(usize) -> Corners<R>,
    ) {
        let (volume, iso) = (R::splat(element.volume), R::splat(element.iso));
        let Corners { slopes: [p, q, r], images: [x, y, z] } = *corners;
        let (ax, ay, az) = (store(volume * x), store(volume * y), store(volume * z));
        let (bp, bq, br) = (store(iso * p), store(iso * q), store(iso * r));
        for (corner, rows) in self.0.iter_mut().enumerate() {
            let Corners { slopes: [p, q, r], images: [x, y, z] } = columns(corner);
            let corner = corner % CORNERS;
            let (along_x, along_y, along_z) =
                (R::splat(ax[corner]), R::splat(ay[corner]), R::splat(az[corner]));
            let [xx, yy, zz, xy, yz, zx, all, ..] = rows;
            add_row(xx, [(along_x, x)]);
            add_row(yy, [(along_y, y)]);
            add_row(zz, [(along_z, z)]);
            add_row(xy, [(along_x, y)]);
            add_row(yz, [(along_y, z)]);
            add_row(zx, [(along_z, x)]);
            let (p_along, q_along, r_along) =
                (R::splat(bp[corner]), R::splat(bq[corner]), R::splat(br[corner]));
            add_row(all, [(p_along, p), (q_along, q), (r_along, r)]);
        }
    }

    /// Adds a node's inertia, its mass (kg, zero rows at held axes) and its momentum.
    #[inline(always)]
    pub(super) fn add_node<R: Real>(
        &mut self,
        node: &LatticeNode,
        inertia: &Symmetric,
        [mx, my, mz]: [f32; 3],
        momentum: [f32; 3],
    ) {
        let Symmetric { xx, yy, zz, xy, yz, zx } = *inertia;
        let entries = [xx, yy, zz, xy, yz, zx, mx, my, mz];
        // Of two functions along an axis: both near, one of each, both far.
        let [x, y, z] = node.within().map(|far| [(1.0 - far) * (1.0 - far), (1.0 - far) * far, far * far]);
        let mut products = [0.0; PRODUCTS];
        let of_yz = z.into_iter().flat_map(|z| y.map(|y| y * z));
        for (three, of_yz) in products.as_chunks_mut::<3>().0.iter_mut().zip(of_yz) {
            *three = x.map(|x| x * of_yz);
        }
        let numbers = self.0.as_flattened_mut().as_flattened_mut();
        let mut rows = numbers.chunks_exact_mut(PRODUCTS);
        for (row, entry) in rows.by_ref().zip(entries) {
            add_times::<R>(row, entry, &products);
        }
        let weights = node.eight_weights();
        for (row, of) in numbers.chunks_exact_mut(CORNERS).skip(MOMENTA).zip(momentum) {
            add_times::<R::Eight>(row, of, &weights);
        }
    }

    /// What has been summed of nodes where functions `c` and `d` of the cell meet.
    #[inline(always)]
    fn of_nodes(&self, c: usize, d: usize) -> [f32; ENTRIES] {
        let product = (c & 1) + (d & 1) + 3 * ((c >> 1 & 1) + (d >> 1 & 1)) + 9 * ((c >> 2) + (d >> 2));
        let numbers = self.0.as_flattened().as_flattened();
        let mut entries = [0.0; ENTRIES];
        for (entry, row) in entries.iter_mut().zip(numbers.chunks_exact(PRODUCTS)) {
            *entry = row.get(product).copied().unwrap_or(0.0);
        }
        entries
    }

    /// Adds the sums of momenta to those of the functions.
    fn add_momenta(&self, functions: [usize; CORNERS], momenta: &mut CoarseVectors) {
        let rows = self.0.as_flattened().iter().skip(MOMENTA);
        for (axis, row) in rows.take(3).enumerate() {
            for (function, sum) in functions.into_iter().zip(row) {
                if let Some(momentum) = momenta.get_mut(function) {
                    momentum.0[axis] += sum;
                }
            }
        }
    }
}

/// Products of two functions of a cell: three along each axis, and as many more as make whole vectors.
const PRODUCTS: usize = 32;
/// Numbers of a node: its inertia, and its mass along each axis.
const ENTRIES: usize = 9;
/// Rows of eight before those of the momentum.
const MOMENTA: usize = ENTRIES * PRODUCTS / CORNERS;

/// `row += factor of`.
#[inline(always)]
fn add_times<R: Real>(row: &mut [f32], factor: f32, of: &[f32]) {
    let factor = R::splat(factor);
    for (row, of) in row.chunks_exact_mut(R::COUNT).zip(of.chunks_exact(R::COUNT)) {
        let products = R::from_fn(|lane| of.get(lane).copied().unwrap_or(0.0));
        let sum = factor.fused(products, R::from_fn(|lane| row.get(lane).copied().unwrap_or(0.0)));
        for (lane, place) in row.iter_mut().enumerate() {
            *place = sum.lane(lane);
        }
    }
}

/// Dense matrices for the sums of the nodes.
pub(super) struct NodeMatrices<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) inertia: &'a mut [f32],
    pub(super) mass: &'a mut [f32],
    /// The same once more, with nothing else in it; may be empty.
    pub(super) mass_alone: &'a mut [f32],
    pub(super) momenta: &'a mut CoarseVectors,
    pub(super) stride: usize,
}

impl NodeMatrices<'_> {
    /// Adds the sums of cell `number`, and makes room for the next ones.
    pub(super) fn add_cell(&mut self, number: usize, sums: &mut CellSums) {
        sums.add_momenta(self.lattice.functions_of(number), self.momenta);
        for (c, d, row, column) in pairs(self.lattice.functions_of(number)) {
            let [xx, yy, zz, xy, yz, zx, mx, my, mz] = sums.of_nodes(c, d);
            let rows = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
            add_block(self.inertia, self.stride, row, column, rows);
            for (axis, mass) in [mx, my, mz].into_iter().enumerate() {
                let place = (3 * row + axis) * self.stride + 3 * column + axis;
                for matrix in [&mut *self.mass, &mut *self.mass_alone] {
                    if let Some(entry) = matrix.get_mut(place) {
                        *entry += mass;
                    }
                }
            }
        }
        *sums = CellSums::NONE;
    }
}
