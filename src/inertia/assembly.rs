//! Assembly of the dense matrices of a lattice: the tangent stiffness `Kc` from the elements' bounds, the mass `Mc`,
//! and the projected inertia `G` of the nodes (kg).
//!
//! ```text
//! Kc = sum_e V [ iso grad phi_c . grad phi_d I + volume (C grad phi_c)(C grad phi_d)^T ]
//! Mc = sum_a m w_c w_d I,     G = sum_a w_c w_d (N_a + reserve m I)
//! ```
//! with the gradients of the interpolated functions, `grad phi_c = sum_a w_c(a) ga`, so that `Kc` is exactly `W^T K W`
//! for the elements' bounds. At a node that is held along some axes a function has a different gradient for each axis.
//!
//! Sums of elements and nodes are first made for each cell, where all functions are known, and then added to the
//! matrices.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS, corner_weights, node_place};
use crate::element::symmetric::Symmetric;
use crate::element::{ElementTile, NodeInertia, TileTangents};
use crate::simd::{Kernel, Real, TILE, dispatch, write_rows};

/// The bound of the tangent of one element, with `s_c D^2 / 4` as a factor.
pub(super) struct ElementTangent {
    pub(super) nodes: [usize; 4],
    /// Shape function gradients, 1/m.
    pub(super) gradients: [[f32; 3]; 4],
    /// `V iso` and `V volume`, kg m^2.
    pub(super) iso: f32,
    pub(super) volume: f32,
    /// Columns of `C`, padded.
    pub(super) cofactor: [[f32; 4]; 3],
}

/// Assembly of the stiffness: the matrix to add to, of which only the 3 x 3 submatrices on and below the diagonal are
/// written.
pub(super) struct Assembly<'a> {
    pub(super) lattice: &'a Lattice,
    /// Places of the nodes.
    pub(super) nodes: &'a [LatticeNode],
    pub(super) inertia: &'a [NodeInertia],
    pub(super) matrix: &'a mut [f32],
    pub(super) stride: usize,
    /// Sums of each cell.
    pub(super) sums: &'a mut [CellMatrices],
}

/// Functions of a cell, one for each corner.
const CORNERS: usize = 8;
/// Sums of one cell. While elements are summed: seven 8 x 8 matrices over the pairs of its functions,
/// `xx, yy, zz, xy, yz, zx` of `volume` and one of `iso`; for each function one row of each matrix. While nodes are
/// summed, the same memory has rows of 32 for the entries of inertia and mass, because the product of two functions of
/// a cell is one of only 27 polynomials, and then one row of eight, one for each function, for each axis of the
/// momentum.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct CellMatrices([[[f32; CORNERS]; MATRICES]; CORNERS]);

/// Matrices of a cell; seven are used.
const MATRICES: usize = 9;

impl CellMatrices {
    pub(super) const NONE: Self = Self([[[0.0; CORNERS]; MATRICES]; CORNERS]);
}

/// Most functions that are not zero at the four nodes of an element.
const TOUCHED: usize = 32;
const NOT_TOUCHED: u8 = u8::MAX;
/// For each function its index among those of the element at hand; [`NOT_TOUCHED`] for other functions, and between
/// elements.
pub(super) type Slots = [u8; MAX_FUNCTIONS];
pub(super) const NO_SLOTS: Slots = [NOT_TOUCHED; MAX_FUNCTIONS];

/// Adds a 3 x 3 submatrix at row `c` and column `d` of functions. Rows of four floats would be slower: the next
/// submatrix would read memory that was just written at another alignment, and wait for the cache.
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

/// The sum of the components, in a fixed order; that of glam depends on the processor.
#[inline(always)]
fn sum(vector: Vec4) -> f32 {
    (vector.x + vector.z) + (vector.y + vector.w)
}

#[inline(always)]
fn add_four(row: &mut [f32], column: usize, values: Vec4) {
    if let Some(place) = row.get_mut(column..).and_then(<[f32]>::first_chunk_mut::<4>) {
        *place = (Vec4::from(*place) + values).to_array();
    }
}

/// The eight values of a vector.
#[inline(always)]
fn to_array<R: Real>(values: R) -> [f32; CORNERS] {
    let mut row = [0.0; CORNERS];
    for (corner, place) in row.iter_mut().enumerate() {
        *place = values.lane(corner);
    }
    row
}

/// `row += factor value` for each product, one after the other.
#[inline(always)]
fn add_row<R: Real, const N: usize>(row: &mut [f32; CORNERS], products: [(R, R); N]) {
    let mut sum = R::from_fn(|corner| row[corner % CORNERS]);
    for (factor, value) in products {
        sum = factor.fused(value, sum);
    }
    *row = to_array(sum);
}

/// Gradients of the eight functions of a cell (1/m) in an element, and their images under `C`.
#[derive(Clone, Copy)]
struct CornerGradients<R> {
    gradients: [R; 3],
    images: [R; 3],
}

impl<R: Real> CornerGradients<R> {
    #[inline(always)]
    fn new(gradients: [R; 3], element: &ElementTangent) -> Self {
        let mut images = [R::splat(0.0); 3];
        for (gradient, column) in gradients.iter().zip(&element.cofactor) {
            for (image, &entry) in images.iter_mut().zip(column) {
                *image = *image + R::splat(entry) * *gradient;
            }
        }
        Self { gradients, images }
    }

    /// Images and gradients of each corner, padded.
    #[inline(always)]
    fn by_corner(&self) -> [[[f32; 4]; CORNERS]; 2] {
        let mut corners = [[[0.0; 4]; CORNERS]; 2];
        for ([x, y, z], rows) in [self.images, self.gradients].into_iter().zip(&mut corners) {
            write_rows(rows, 0, [x, y, z, R::splat(0.0)]);
        }
        corners
    }

    /// Zeros at corners where the mask is zero.
    #[inline(always)]
    fn masked(&self, mask: R) -> Self {
        let [p, q, r] = self.gradients;
        let [x, y, z] = self.images;
        Self { gradients: [mask * p, mask * q, mask * r], images: [mask * x, mask * y, mask * z] }
    }
}

/// The one cell, or the two neighbouring cells, with all nodes of an element.
pub(super) struct ElementCells {
    /// The cell, or the lower one of two.
    cell: usize,
    /// The axis along which there is a second cell.
    pub(super) across: Option<usize>,
    /// Positions of the nodes in cells, from the cell's lowest corner. The fourth component is one if the node is free,
    /// else zero.
    nodes: [Vec4; 4],
}

impl Assembly<'_> {
    /// Adds the elements of a tile with these tangents.
    #[inline(never)]
    pub(super) fn add_tile(self, tile: &ElementTile, tangents: &TileTangents) {
        dispatch(TileAssembly { assembly: self, tile, tangents });
    }
}

/// Not generic over laws, so compiled with this crate, once for each level.
struct TileAssembly<'a, 'b> {
    assembly: Assembly<'a>,
    tile: &'b ElementTile,
    tangents: &'b TileTangents,
}

impl Kernel for TileAssembly<'_, '_> {
    type Output = ();

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { mut assembly, tile, tangents } = self;
        let mut slots = NO_SLOTS;
        for lane in 0..TILE {
            let mut gradients = [[0.0; 3]; 4];
            for corner in 0..3 {
                for axis in 0..3 {
                    gradients[corner + 1][axis] = tile.gradient_of(corner, axis, lane);
                    gradients[0][axis] -= gradients[corner + 1][axis];
                }
            }
            let nodes = [0, 1, 2, 3].map(|corner| tile.node(corner, lane));
            let columns = tangents.map(|column| column[lane % TILE]);
            let [[_, _, _, iso], [_, _, _, volume], _] = columns;
            let cofactor = columns.map(|[x, y, z, _]| [x, y, z, 0.0]);
            let element = ElementTangent { nodes, gradients, iso, volume, cofactor };
            if !assembly.add_in_cells::<R::Width8>(&element) {
                assembly.add_element(&element, &mut slots);
            }
        }
    }
}

impl Assembly<'_> {
    /// The cells of an element, if there are at most two, and each of its nodes is free or held along all axes.
    #[inline(always)]
    pub(super) fn cells_of(&self, nodes: &[usize; 4]) -> Option<ElementCells> {
        let (mut low, mut high) = (Vec4::splat(f32::MAX), Vec4::ZERO);
        let mut places = [[Vec4::ZERO; 2]; 4];
        for (&node, place) in nodes.iter().zip(&mut places) {
            let (at, inertia) = (node_place(self.nodes, node)?, self.inertia.get(node)?);
            let [x, y, z] = at.within();
            let free = match inertia.free().cmpgt(Vec4::ZERO).bitmask() {
                0 => 0.0,
                0b111 => 1.0,
                _ => return None,
            };
            let [i, j, k] = self.lattice.cell_indices(at.cell()).map(f32::from);
            *place = [Vec4::new(i, j, k, 0.0), Vec4::new(x, y, z, free)];
            // A node on the border of two cells belongs to both.
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
        Some(ElementCells { cell: self.lattice.cell_index([i, j, k]), across, nodes })
    }

    /// Adds the tangent of an element to the sums of its one or two cells. Gives whether this was possible.
    #[inline(always)]
    pub(super) fn add_in_cells<R: Real>(&mut self, element: &ElementTangent) -> bool {
        if R::COUNT != CORNERS {
            return false;
        }
        let Some(ElementCells { cell, across, nodes }) = self.cells_of(&element.nodes) else {
            return false;
        };
        // Along `across` two cells have three layers of functions, 0, 1 and 2. `near` has layers 0 and 1, `far` layers
        // 1 and 2.
        let (mut near, mut far) = ([R::splat(0.0); 3], [R::splat(0.0); 3]);
        for (place, gradient) in nodes.iter().zip(&element.gradients) {
            let weights = corner_weights::<R>(*place, across);
            for axis in 0..3 {
                let component = R::splat(place.w * gradient[axis]);
                near[axis] = near[axis] + weights[0] * component;
                if across.is_some() {
                    far[axis] = far[axis] + weights[1] * component;
                }
            }
        }
        let near = CornerGradients::new(near, element);
        let Some(sums) = self.sums.get_mut(cell) else {
            return false;
        };
        sums.add_products(element, &near, |_| near);
        if let Some(axis) = across {
            let far = CornerGradients::new(far, element);
            let neighbour = cell + self.lattice.cell_stride(axis);
            let Some(sums) = self.sums.get_mut(neighbour) else {
                return false;
            };
            // Both cells have the products of layer 1 with itself: they are added to the first cell only.
            let last_layer = R::from_fn(|corner| if corner >> axis & 1 == 1 { 1.0 } else { 0.0 });
            let beyond = far.masked(last_layer);
            sums.add_products(element, &far, |corner| if corner >> axis & 1 == 1 { far } else { beyond });
            self.add_outer_layers(element, axis, [cell, neighbour], &near, &far);
        }
        true
    }

    /// Adds the products of layer 0 with layer 2 to the matrix; they belong to no cell.
    #[inline(always)]
    fn add_outer_layers<R: Real>(
        &mut self,
        element: &ElementTangent,
        axis: usize,
        cells: [usize; 2],
        near: &CornerGradients<R>,
        far: &CornerGradients<R>,
    ) {
        let [low, high] = cells.map(|cell| self.lattice.functions_of(cell));
        let ([images, gradients], [far_images, far_gradients]) = (near.by_corner(), far.by_corner());
        // The four corners of the lower side of a cell along the axis.
        let corner = |index: usize| (index >> axis) << (axis + 1) | index & ((1 << axis) - 1);
        for c in [0, 1, 2, 3].map(corner) {
            let (image, gradient) = (Vec4::from(images[c % CORNERS]), Vec4::from(gradients[c % CORNERS]));
            for d in [0, 1, 2, 3].map(|index| corner(index) | 1 << axis) {
                let (first, last) = (low[c % CORNERS], high[d % CORNERS]);
                if first >= MAX_FUNCTIONS || last >= MAX_FUNCTIONS {
                    continue;
                }
                let far_image = Vec4::from(far_images[d % CORNERS]);
                let diagonal = element.iso * sum(gradient * Vec4::from(far_gradients[d % CORNERS]));
                let (row, row_image, column, column_image) = if first < last {
                    (last, far_image, first, image)
                } else {
                    (first, image, last, far_image)
                };
                let [x, y, z, _] = (element.volume * row_image).to_array();
                let Some(lines) = self.matrix.get_mut(3 * row * self.stride..) else {
                    continue;
                };
                let values = [
                    x * column_image + diagonal * Vec4::X,
                    y * column_image + diagonal * Vec4::Y,
                    z * column_image + diagonal * Vec4::Z,
                ];
                for (line, values) in lines.chunks_exact_mut(self.stride.max(1)).zip(values) {
                    add_four(line, 3 * column, values);
                }
            }
        }
    }

    /// Adds the sums of a cell to the matrix, and clears them.
    pub(super) fn add_cell(&mut self, cell: usize) {
        let Some(sums) = self.sums.get_mut(cell) else {
            return;
        };
        let functions = self.lattice.functions_of(cell);
        for (c, d, row, column) in pairs(functions) {
            let at = |matrix: usize, c: usize, d: usize| sums.0[c % CORNERS][matrix][d % CORNERS];
            let diagonal = at(6, c, d);
            let rows = [
                [at(0, c, d) + diagonal, at(3, c, d), at(5, d, c)],
                [at(3, d, c), at(1, c, d) + diagonal, at(4, c, d)],
                [at(5, c, d), at(4, d, c), at(2, c, d) + diagonal],
            ];
            add_submatrix(self.matrix, self.stride, row, column, rows);
        }
        *sums = CellMatrices::NONE;
    }

    /// Adds the tangent of an element directly to the matrix.
    #[inline(always)]
    pub(super) fn add_element(&mut self, element: &ElementTangent, slots: &mut Slots) {
        // Derivatives of each function along the three material axes. Their components are the spatial axes, because a
        // function may be zero along some of these.
        let mut touched = [[Vec4::ZERO; 3]; TOUCHED];
        let (mut count, mut bits) = (0, 0u128);
        for (&node, gradient) in element.nodes.iter().zip(element.gradients) {
            let (Some(at), Some(inertia)) = (node_place(self.nodes, node), self.inertia.get(node)) else {
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
        // In ascending order of the functions, because only submatrices on and below the diagonal are kept.
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
            // A submatrix is added with four columns, the last of zeros in the next submatrix. That would then have to
            // wait for the cache. So every second submatrix is added first.
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

/// Pairs of a cell's functions on and below the diagonal: two corners and their functions, without dropped ones.
fn pairs(functions: [usize; CORNERS]) -> impl Iterator<Item = (usize, usize, usize, usize)> {
    let at = move |corner: usize| functions[corner % CORNERS];
    (0..CORNERS)
        .flat_map(move |c| (0..=c).map(move |d| (c, d, at(c), at(d))))
        .filter(|&(_, _, row, column)| row < MAX_FUNCTIONS && column < MAX_FUNCTIONS)
}

impl CellMatrices {
    /// Adds the tangent of an element: the products of each corner with `columns` of that corner.
    #[inline(always)]
    fn add_products<R: Real>(
        &mut self,
        element: &ElementTangent,
        corners: &CornerGradients<R>,
        columns: impl Fn(usize) -> CornerGradients<R>,
    ) {
        let (volume, iso) = (R::splat(element.volume), R::splat(element.iso));
        let CornerGradients { gradients: [p, q, r], images: [x, y, z] } = *corners;
        let (ax, ay, az) = (to_array(volume * x), to_array(volume * y), to_array(volume * z));
        let (bp, bq, br) = (to_array(iso * p), to_array(iso * q), to_array(iso * r));
        for (corner, rows) in self.0.iter_mut().enumerate() {
            let CornerGradients { gradients: [p, q, r], images: [x, y, z] } = columns(corner);
            let corner = corner % CORNERS;
            let (along_x, along_y, along_z) =
                (R::splat(ax[corner]), R::splat(ay[corner]), R::splat(az[corner]));
            let [xx, yy, zz, xy, yz, zx, diagonal, ..] = rows;
            add_row(xx, [(along_x, x)]);
            add_row(yy, [(along_y, y)]);
            add_row(zz, [(along_z, z)]);
            add_row(xy, [(along_x, y)]);
            add_row(yz, [(along_y, z)]);
            add_row(zx, [(along_z, x)]);
            let (p_along, q_along, r_along) =
                (R::splat(bp[corner]), R::splat(bq[corner]), R::splat(br[corner]));
            add_row(diagonal, [(p_along, p), (q_along, q), (r_along, r)]);
        }
    }

    /// Adds inertia and mass of a node (kg, with zero rows at held axes) and its momentum.
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
        // Products of two functions along an axis: both of the near point, one of each, both of the far point.
        let [x, y, z] = node.within().map(|far| [(1.0 - far) * (1.0 - far), (1.0 - far) * far, far * far]);
        let mut products = [0.0; PRODUCTS];
        let yz_products = z.into_iter().flat_map(|z| y.map(|y| y * z));
        for (three, yz) in products.as_chunks_mut::<3>().0.iter_mut().zip(yz_products) {
            *three = x.map(|x| x * yz);
        }
        let floats = self.0.as_flattened_mut().as_flattened_mut();
        let mut rows = floats.chunks_exact_mut(PRODUCTS);
        for (row, entry) in rows.by_ref().zip(entries) {
            add_times::<R>(row, entry, &products);
        }
        let weights = node.eight_weights();
        for (row, component) in floats.chunks_exact_mut(CORNERS).skip(MOMENTA).zip(momentum) {
            add_times::<R::Width8>(row, component, &weights);
        }
    }

    /// The sums over nodes for functions `c` and `d` of the cell.
    #[inline(always)]
    fn node_sums(&self, c: usize, d: usize) -> [f32; ENTRIES] {
        let product = (c & 1) + (d & 1) + 3 * ((c >> 1 & 1) + (d >> 1 & 1)) + 9 * ((c >> 2) + (d >> 2));
        let floats = self.0.as_flattened().as_flattened();
        let mut entries = [0.0; ENTRIES];
        for (entry, row) in entries.iter_mut().zip(floats.chunks_exact(PRODUCTS)) {
            *entry = row.get(product).copied().unwrap_or(0.0);
        }
        entries
    }

    /// Adds the sums of momentum to those of the functions.
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

/// Products of two functions of a cell: three along each axis, so 27, rounded up to whole vectors.
const PRODUCTS: usize = 32;
/// Entries that are summed over nodes: six of the inertia, and the mass along each axis.
const ENTRIES: usize = 9;
/// Index of the first row of the momentum, in rows of eight.
const MOMENTA: usize = ENTRIES * PRODUCTS / CORNERS;

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

/// Assembly of the matrices that come from nodes.
pub(super) struct CoarseInertia<'a> {
    pub(super) lattice: &'a Lattice,
    /// `G`.
    pub(super) inertia: &'a mut [f32],
    /// `S`, to which `(1 + k) Mc` is added.
    pub(super) mass: &'a mut [f32],
    /// `(1 + k) Mc` in a matrix of its own; may be empty.
    pub(super) mass_only: &'a mut [f32],
    pub(super) momenta: &'a mut CoarseVectors,
    pub(super) stride: usize,
}

impl CoarseInertia<'_> {
    /// Adds the sums of a cell, and clears them.
    pub(super) fn add_cell(&mut self, cell: usize, sums: &mut CellMatrices) {
        sums.add_momenta(self.lattice.functions_of(cell), self.momenta);
        for (c, d, row, column) in pairs(self.lattice.functions_of(cell)) {
            let [xx, yy, zz, xy, yz, zx, mx, my, mz] = sums.node_sums(c, d);
            let rows = [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]];
            add_submatrix(self.inertia, self.stride, row, column, rows);
            for (axis, mass) in [mx, my, mz].into_iter().enumerate() {
                let place = (3 * row + axis) * self.stride + 3 * column + axis;
                for matrix in [&mut *self.mass, &mut *self.mass_only] {
                    if let Some(entry) = matrix.get_mut(place) {
                        *entry += mass;
                    }
                }
            }
        }
        *sums = CellMatrices::NONE;
    }
}
