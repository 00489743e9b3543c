//! Assembly of the tangent stiffness of a lattice (kg, with the factor `s_c D^2 / 4`) from the elements' bounds:
//!
//! ```text
//! Kc = sum_e V [ (shear / 2 + stress) p_c . p_d I + volume p_c p_d^T + shear / 2 p_d p_c^T ],   p = F^-T grad phi
//! ```
//! with the gradients of the interpolated functions, `grad phi_c = sum_a w_c(a) ga`, so that `Kc` is exactly `W^T K W`
//! for the elements' bounds (with nodal strain those of the patches, `ga = c_ab / V_a`), and zero for rotations of
//! tissue without tension. In crushed elements the terms are `iso grad phi_c . grad phi_d I + volume (C grad phi_c)(C
//! grad phi_d)^T`. At a node that is held along some axes a function has a different gradient for each axis.
//!
//! Most elements lie in a box of at most two cells along each axis, with 8, 12, 18 or 27 functions. Elements of a
//! batch that share a box are added together: first products over the box's functions, then one addition to the
//! matrix for each pair of functions. The others are added to the matrix directly (direct_assembly.rs).

use glam::Vec4;

use super::cell_boxes::{CellBox, locate};
use super::direct_assembly::{NO_SLOTS, TOUCHED};
use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS};
use crate::element::{ElementTile, NodeInertia, TileTangents};
use crate::simd::{Kernel, Real, TILE, dispatch, write_rows};

/// The bound of the tangent of an element or of a patch with nodal strain, with `s_c D^2 / 4` as a factor: see
/// [`TileTangents`].
#[derive(Clone, Copy)]
pub(super) struct Tangent {
    pub(super) columns: [[f32; 4]; 3],
    pub(super) factors: [f32; 4],
}

impl Tangent {
    const NONE: Self = Self { columns: [[0.0; 4]; 3], factors: [0.0; 4] };

    /// That of a place of a tile.
    #[inline(always)]
    pub(super) fn of(tangents: &TileTangents, lane: usize) -> Self {
        let columns = [0, 1, 2].map(|column| tangents.columns[column][lane % TILE]);
        Self { columns, factors: tangents.factors[lane % TILE] }
    }

    /// `factor |dF|^2`, with `factor` in kg m^2.
    pub(super) const fn isotropic(factor: f32) -> Self {
        let columns = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        Self { columns, factors: [factor, 0.0, 0.0, 0.0] }
    }

    /// Image of a gradient, and what the first factor is of products of.
    pub(super) fn image(&self, [x, y, z]: [f32; 3]) -> [Vec4; 2] {
        let [cx, cy, cz] = self.columns.map(Vec4::from);
        let image = cx * x + cy * y + cz * z;
        [image, if self.is_spatial() { image } else { Vec4::new(x, y, z, 0.0) }]
    }

    /// Whether the first factor is of products of images.
    #[inline(always)]
    pub(super) fn is_spatial(&self) -> bool {
        self.factors[3] > 0.0
    }
}

/// The tangent of one element with its nodes.
#[derive(Clone, Copy)]
pub(super) struct ElementTangent {
    pub(super) nodes: [usize; 4],
    /// Shape function gradients, 1/m.
    pub(super) gradients: [[f32; 3]; 4],
    pub(super) tangent: Tangent,
}

impl ElementTangent {
    pub(super) const NONE: Self = Self { nodes: [0; 4], gradients: [[0.0; 3]; 4], tangent: Tangent::NONE };

    /// That of an element of a tile.
    #[inline(always)]
    pub(super) fn of(tile: &ElementTile, tangents: &TileTangents, lane: usize) -> Self {
        Self::with(tile, lane, Tangent::of(tangents, lane))
    }

    /// An element of a tile with a tangent.
    #[inline(always)]
    pub(super) fn with(tile: &ElementTile, lane: usize, tangent: Tangent) -> Self {
        let mut gradients = [[0.0; 3]; 4];
        for corner in 0..3 {
            for axis in 0..3 {
                gradients[corner + 1][axis] = tile.gradient_of(corner, axis, lane);
                gradients[0][axis] -= gradients[corner + 1][axis];
            }
        }
        let nodes = [0, 1, 2, 3].map(|corner| tile.node(corner, lane));
        Self { nodes, gradients, tangent }
    }

    /// Its nodes and gradients.
    #[inline(always)]
    pub(super) fn corners(&self) -> impl Iterator<Item = (usize, [f32; 3])> + Clone + use<> {
        self.nodes.into_iter().zip(self.gradients)
    }
}

/// The product of a tangent with displacements of nodes: calls `add` with each node and its force, with the factor.
/// `corners` are nodes with their gradients.
pub(super) fn forces(
    tangent: &Tangent,
    corners: impl Iterator<Item = (usize, [f32; 3])> + Clone,
    displacement: impl Fn(usize) -> Vec4,
    mut add: impl FnMut(usize, Vec4),
) {
    // Sums of the outer products of displacements with gradients and of images with displacements, by their columns.
    let (mut along, mut across, mut trace) = ([Vec4::ZERO; 3], [Vec4::ZERO; 3], 0.0);
    for (node, gradient) in corners.clone() {
        let (displacement, [image, slope]) = (displacement(node), tangent.image(gradient));
        for axis in 0..3 {
            along[axis] += displacement * slope[axis];
            across[axis] += image * displacement[axis];
        }
        trace += image.dot(displacement);
    }
    let [inner, outer, exchanged, _] = tangent.factors;
    let times = |[x, y, z]: [Vec4; 3], vector: Vec4| x * vector.x + y * vector.y + z * vector.z;
    for (node, gradient) in corners {
        let [image, slope] = tangent.image(gradient);
        add(node, inner * times(along, slope) + outer * trace * image + exchanged * times(across, image));
    }
}

/// Elements that are added together: those of four tiles.
pub(super) const BATCH: usize = 4 * TILE;

/// Assembly of the stiffness: the matrix to add to, of which only the 3 x 3 submatrices on and below the diagonal are
/// written.
pub(super) struct Assembly<'a> {
    pub(super) lattice: &'a Lattice,
    /// Places of the nodes.
    pub(super) nodes: &'a [LatticeNode],
    pub(super) inertia: &'a [NodeInertia],
    pub(super) matrix: &'a mut [f32],
    pub(super) stride: usize,
}

/// Adds to four columns of a row.
#[inline(always)]
pub(super) fn add_four(row: &mut [f32], column: usize, values: Vec4) {
    if let Some(place) = row.get_mut(column..).and_then(<[f32]>::first_chunk_mut::<4>) {
        *place = (Vec4::from(*place) + values).to_array();
    }
}

/// Where an element lies in its box.
#[derive(Clone, Copy, Default)]
struct Located {
    /// The position of each node in its cell, 0 to 1 or outside. The fourth component is one if the node is free, else
    /// zero.
    within: [[f32; 4]; 4],
    /// The cell of each node, from the lowest one of the box. In bytes, because a batch is on the stack.
    cells: [[u8; 3]; 4],
}

/// Elements whose products are summed before they are added to the matrix.
const GROUP: usize = 8;
/// Most functions of a box, rounded up to whole vectors.
const SLOTS: usize = 2 * TILE;
/// The three derivatives of each function of a box along the spatial axes.
type Derivatives = [[f32; SLOTS]; 3];
/// Those of one vector of functions, with four factors: that of the inner product, that of the outer one, that of the
/// exchanged one, and the sum of the latter two.
type Scaled<R> = [[R; 3]; 4];

/// Both for a group of elements.
struct Scratch<R> {
    derivatives: [Derivatives; GROUP],
    scaled: [Scaled<R>; GROUP],
}

impl<R: Real> Scratch<R> {
    #[inline(always)]
    fn new() -> Self {
        let zero = R::splat(0.0);
        Self { derivatives: [[[0.0; SLOTS]; 3]; GROUP], scaled: [[[zero; 3]; 4]; GROUP] }
    }
}

impl Assembly<'_> {
    /// Adds these elements, at most [`BATCH`].
    #[inline(never)]
    pub(super) fn add(self, elements: &[ElementTangent]) {
        dispatch(Batch { assembly: self, elements });
    }
}

/// Not generic over laws, so compiled with this crate, once for each level.
struct Batch<'a, 'b> {
    assembly: Assembly<'a>,
    elements: &'b [ElementTangent],
}

impl Kernel for Batch<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { mut assembly, elements } = self;
        let mut located = [Located::default(); BATCH];
        // The box and, in the last byte, the index of each element; zero if it lies in no box. Elements of a box
        // follow each other.
        let mut keys = [0u64; BATCH];
        let mut slots = NO_SLOTS;
        for (index, element) in elements.iter().enumerate().take(BATCH) {
            // Crushed elements have other products.
            match locate(assembly.lattice, assembly.nodes, assembly.inertia, &element.nodes)
                .filter(|_| element.tangent.is_spatial())
            {
                Some((cells, nodes)) => {
                    for corner in 0..4 {
                        let [cell, within] = nodes[corner];
                        let [x, y, z, _] = cell.to_array();
                        located[index].cells[corner] = [x as u8, y as u8, z as u8];
                        located[index].within[corner] = within.to_array();
                    }
                    keys[index] = cells.key() << 8 | index as u64;
                }
                _ => assembly.add_directly::<TOUCHED>(element.corners(), &element.tangent, &mut slots),
            }
        }
        // Vectors of eight, because most boxes have 8 or 12 functions.
        let mut scratch = Scratch::<R::Width8>::new();
        let mut rest: &[u64] = &keys;
        while let Some(&key) = rest.first() {
            let same = rest.iter().take(GROUP).take_while(|other| **other >> 8 == key >> 8).count();
            let Some((group, after)) = rest.split_at_checked(same.max(1)) else {
                return;
            };
            rest = after;
            let first = (key & 0xff) as usize;
            let (group, located) = (elements.get(first..first + group.len()), located.get(first..));
            if let Some((group, located)) = group.zip(located).filter(|_| key != 0) {
                let slots = BoxSlots::new(CellBox::of_key(key >> 8), assembly.lattice);
                assembly.add_group(group, located, &slots, &mut scratch);
            }
        }
    }
}

/// Weights along an axis of the layers of functions of a box for a node in cell `cell` of it, at `within`.
#[inline(always)]
fn layer_weights(cell: u8, within: f32) -> [f32; 3] {
    let (near, far) = (1.0 - within, within);
    match cell {
        0 => [near, far, 0.0],
        1 => [0.0, near, far],
        // On the upper border of the box.
        _ => [0.0, 0.0, near],
    }
}

/// The vector of slots from `first` on.
#[inline(always)]
fn slots_from<R: Real>(slots: &[f32; SLOTS], first: usize) -> R {
    match slots.get(first..first + R::COUNT) {
        Some(slots) => R::from_fn(|lane| slots[lane]),
        None => R::splat(0.0),
    }
}

/// Writes these slots.
#[inline(always)]
fn write_slots<R: Real>(slots: &mut [f32; SLOTS], first: usize, values: R) {
    if let Some(slots) = slots.get_mut(first..first + R::COUNT) {
        slots.iter_mut().enumerate().for_each(|(lane, slot)| *slot = values.lane(lane));
    }
}

/// The functions of a box, in ascending order.
struct BoxSlots {
    count: usize,
    /// For each axis and each of its at most three layers of functions: one in the slots of that layer, else zero.
    layers: [[[f32; SLOTS]; 3]; 3],
    functions: [usize; SLOTS],
}

impl BoxSlots {
    #[inline(always)]
    fn new(cells: CellBox, lattice: &Lattice) -> Self {
        let mut slots = Self { count: 0, layers: [[[0.0; SLOTS]; 3]; 3], functions: [MAX_FUNCTIONS; SLOTS] };
        let [inner, middle, outer] = lattice.axes();
        let mut offset = [0u8; 3];
        for k in 0..=cells.cells[outer % 3] {
            for j in 0..=cells.cells[middle % 3] {
                for i in 0..=cells.cells[inner % 3] {
                    (offset[inner % 3], offset[middle % 3], offset[outer % 3]) = (i, j, k);
                    let slot = slots.count % SLOTS;
                    slots.functions[slot] = lattice.function_at(cells.low, offset);
                    for axis in 0..3 {
                        slots.layers[axis][usize::from(offset[axis]) % 3][slot] = 1.0;
                    }
                    slots.count = slot + 1;
                }
            }
        }
        slots
    }
}

impl Assembly<'_> {
    /// Adds the tangents of elements of one box, at most [`GROUP`].
    #[inline(always)]
    fn add_group<R: Real>(
        &mut self,
        group: &[ElementTangent],
        located: &[Located],
        slots: &BoxSlots,
        scratch: &mut Scratch<R>,
    ) {
        let Scratch { derivatives, scaled } = scratch;
        let (Some(derivatives), Some(scaled)) = (derivatives.get_mut(..group.len()), scaled.get_mut(..group.len()))
        else {
            return;
        };
        for ((element, located), derivatives) in group.iter().zip(located).zip(derivatives.iter_mut()) {
            derive::<R>(element, located, slots, derivatives);
        }
        for first in (0..slots.count).step_by(R::COUNT) {
            for ((scaled, derivatives), element) in scaled.iter_mut().zip(&*derivatives).zip(group) {
                *scaled = scale(element, derivatives, first);
            }
            for row in first..slots.count {
                self.add_products(&products(derivatives, scaled, row), row, first, slots);
            }
        }
    }

    /// Adds products of the function in slot `row` with those of the slots from `first` on, up to itself.
    #[inline(always)]
    fn add_products<R: Real>(&mut self, sums: &[[R; 3]; 3], row: usize, first: usize, slots: &BoxSlots) {
        let function = slots.functions[row % SLOTS];
        let rows = self.matrix.get_mut(3 * function * self.stride..).unwrap_or_default();
        let Some((row_x, rows)) = rows.split_at_mut_checked(self.stride) else {
            return;
        };
        let Some((row_y, row_z)) = rows.split_at_mut_checked(self.stride) else {
            return;
        };
        let mut lines = [[[0.0; 4]; TILE]; 3];
        for i in 0..3 {
            let [x, y, z] = sums[i];
            write_rows(&mut lines[i], 0, [x, y, z, R::splat(0.0)]);
        }
        let columns = slots.functions.get(first..(row + 1).min(first + R::COUNT)).unwrap_or_default();
        // A submatrix is added with four columns, the last of zeros in the next submatrix. That would then have to wait
        // for the cache. So every second submatrix is added first.
        for start in 0..2 {
            for (lane, &column) in columns.iter().enumerate().skip(start).step_by(2) {
                if column < MAX_FUNCTIONS {
                    add_four(row_x, 3 * column, Vec4::from(lines[0][lane % TILE]));
                    add_four(row_y, 3 * column, Vec4::from(lines[1][lane % TILE]));
                    add_four(row_z, 3 * column, Vec4::from(lines[2][lane % TILE]));
                }
            }
        }
    }
}

/// The derivatives of the box's functions in an element.
#[inline(always)]
fn derive<R: Real>(element: &ElementTangent, located: &Located, slots: &BoxSlots, derivatives: &mut Derivatives) {
    let [cx, cy, cz] = element.tangent.columns.map(Vec4::from);
    let images = element.gradients.map(|[x, y, z]| (cx * x + cy * y + cz * z).to_array());
    let mut weights = [[[0.0; 3]; 3]; 4];
    for corner in 0..4 {
        let (cell, within) = (located.cells[corner], Vec4::from(located.within[corner]));
        for axis in 0..3 {
            weights[corner][axis] = layer_weights(cell[axis], within[axis]);
        }
        // A held node moves no function.
        weights[corner][0] = weights[corner][0].map(|weight| within.w * weight);
    }
    for first in (0..slots.count).step_by(R::COUNT) {
        let mut sums = [R::splat(0.0); 3];
        for corner in 0..4 {
            let mut weight = R::splat(1.0);
            for axis in 0..3 {
                let mut along = R::splat(0.0);
                for layer in 0..3 {
                    let of_layer = slots_from::<R>(&slots.layers[axis][layer], first);
                    along = of_layer.fused(R::splat(weights[corner][axis][layer]), along);
                }
                weight = weight * along;
            }
            for axis in 0..3 {
                sums[axis] = weight.fused(R::splat(images[corner][axis]), sums[axis]);
            }
        }
        for axis in 0..3 {
            write_slots(&mut derivatives[axis], first, sums[axis]);
        }
    }
}

/// The derivatives of the functions in the slots from `first` on, with an element's factors.
#[inline(always)]
fn scale<R: Real>(element: &ElementTangent, derivatives: &Derivatives, first: usize) -> Scaled<R> {
    let [inner, outer, exchanged, _] = element.tangent.factors;
    let mut scaled = [[R::splat(0.0); 3]; 4];
    for (scaled, factor) in scaled.iter_mut().zip([inner, outer, exchanged, outer + exchanged]) {
        for axis in 0..3 {
            scaled[axis] = R::splat(factor) * slots_from(&derivatives[axis], first);
        }
    }
    scaled
}

/// The submatrices of the function in slot `row` with those of `scaled`. The sums of one row fit into 16 registers.
#[inline(always)]
fn products<R: Real>(derivatives: &[Derivatives], scaled: &[Scaled<R>], row: usize) -> [[R; 3]; 3] {
    let zero = R::splat(0.0);
    let (mut sums, mut diagonal) = ([[zero; 3]; 3], zero);
    for (own, [inner, outer, exchanged, both]) in derivatives.iter().zip(scaled) {
        let mut scalars = [zero; 3];
        for i in 0..3 {
            scalars[i] = R::splat(own[i][row % SLOTS]);
        }
        for i in 0..3 {
            diagonal = scalars[i].fused(inner[i], diagonal);
            for j in 0..3 {
                sums[i][j] = if i == j {
                    scalars[i].fused(both[i], sums[i][j])
                } else {
                    let sum = scalars[j].fused(exchanged[i], sums[i][j]);
                    scalars[i].fused(outer[j], sum)
                };
            }
        }
    }
    for i in 0..3 {
        sums[i][i] = sums[i][i] + diagonal;
    }
    sums
}
