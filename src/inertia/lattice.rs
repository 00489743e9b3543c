//! A coarse lattice around the body: trilinear functions `W` on the nodes, one for each lattice point. Motion that they
//! can represent is smooth motion. A function is zero at held axes. A function is dropped if supports or the surface of
//! the body leave it almost no mass ([`LEAST_MASS`]): its inertia would be small compared with its stiffness, and the
//! coarse system ill-conditioned.

use core::{array, fmt};

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use super::InertiaError;
use crate::element::NodeInertia;
use crate::padding;
use crate::simd::{NodeVector, Real};

/// Largest number of lattice points.
pub const MAX_POINTS: usize = 1024;
/// Largest number of functions, without the dropped ones.
pub const MAX_FUNCTIONS: usize = 128;
/// Stands for a dropped function.
const DROPPED: u8 = MAX_FUNCTIONS as u8;
/// Functions with less than this share of the largest mass of a function are dropped.
const LEAST_MASS: f32 = 0.02;

/// The place of a node in the lattice. The list of places is in the order of the cells.
/// A lattice around a body.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub struct Grid {
    /// Cells along each axis, zeros for none.
    pub cells: [u32; 3],
    /// Functions of the lattice, without those that supports or the body's shape leave almost no mass.
    pub functions: usize,
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cells: [x, y, z], functions } = self;
        write!(f, "{x} x {y} x {z} cells, {functions} functions")
    }
}

#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LatticeNode {
    /// Position in the cell, 0 to 1 along each axis.
    within: [f32; 3],
    /// Index of the node.
    node: u32,
    /// Index of the cell.
    cell: u32,
    /// In entry `n` of the list: the index in the list of the place of node `n`. A second table in the same memory.
    rank: u32,
}

impl LatticeNode {
    #[inline(always)]
    pub(super) fn cell(&self) -> usize {
        self.cell as usize
    }

    #[inline(always)]
    pub(super) fn node(&self) -> usize {
        self.node as usize
    }

    /// Position in the cell, 0 to 1 along each axis.
    #[inline(always)]
    pub(super) fn within(&self) -> [f32; 3] {
        self.within
    }

    /// The position, and the index of the node as the bits of a float ([`crate::padding`]).
    #[inline(always)]
    pub(super) fn row(&self) -> [f32; 4] {
        let [x, y, z] = self.within;
        [x, y, z, padding::from_index(self.node)]
    }

    /// Weights of the functions at the eight corners of its cell.
    #[inline(always)]
    pub(super) fn eight_weights(&self) -> [f32; 8] {
        let [x, y, z] = self.within;
        let (nx, ny, nz) = (1.0 - x, 1.0 - y, 1.0 - z);
        let (a, b, c, d) = (nx * ny, x * ny, nx * y, x * y);
        [a * nz, b * nz, c * nz, d * nz, a * z, b * z, c * z, d * z]
    }
}

/// Weights of the functions at the corners of a cell for a node at `position`, in cells from the cell's lowest corner.
/// With an axis `across`, the node may also be in the next cell along that axis: the second result is the weights of
/// the corners of that cell.
#[inline(always)]
pub(super) fn corner_weights<R: Real>(position: Vec4, across: Option<usize>) -> [R; 2] {
    let mut weights = [R::splat(1.0); 2];
    // Along each axis the weights of three layers of functions, at 0, 1 and 2 cells.
    let first = (Vec4::ONE - position).max(Vec4::ZERO).to_array();
    let third = (position - Vec4::ONE).max(Vec4::ZERO).to_array();
    let second = (Vec4::ONE - (position - Vec4::ONE).abs()).to_array();
    for axis in 0..3 {
        let far = R::from_fn(|corner| if corner >> axis & 1 == 1 { 1.0 } else { 0.0 });
        let [first, second, third] = [first[axis], second[axis], third[axis]].map(R::splat);
        let along = far.choose(second, first);
        weights[0] = weights[0] * along;
        if across.is_some() {
            let beyond = far.choose(third, second);
            weights[1] = weights[1] * if across == Some(axis) { beyond } else { along };
        }
    }
    weights
}

/// The place of a node.
#[inline(always)]
pub(super) fn node_place(places: &[LatticeNode], node: usize) -> Option<&LatticeNode> {
    places.get(places.get(node)?.rank as usize)
}

/// Sorts the places of the nodes by their cells.
pub(super) fn sort_by_cell(places: &mut [LatticeNode]) {
    // Counting sort. `ends` are first counts, then the place of the next node of each cell.
    let mut ends = [0u32; MAX_POINTS + 1];
    for place in &*places {
        if let Some(count) = ends.get_mut(place.cell() + 1) {
            *count += 1;
        }
    }
    let mut sum = 0;
    for end in &mut ends {
        sum += *end;
        *end = sum;
    }
    for (node, place) in places.iter_mut().enumerate() {
        place.node = node as u32;
        if let Some(end) = ends.get_mut(place.cell()) {
            place.rank = *end;
            *end += 1;
        }
    }
    for at in 0..places.len() {
        // Each exchange puts one node into its place.
        for _ in 0..places.len() {
            let Some(here) = places.get(at).copied() else {
                return;
            };
            let target = places.get(here.node()).map_or(at, |place| place.rank as usize);
            let Some(there) = places.get(target).copied().filter(|_| target != at) else {
                break;
            };
            if let Some(place) = places.get_mut(target) {
                *place = LatticeNode { rank: there.rank, ..here };
            }
            if let Some(place) = places.get_mut(at) {
                *place = LatticeNode { rank: here.rank, ..there };
            }
        }
    }
}

/// A lattice on the box around a body.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Cells along each axis.
    cells: [u32; 3],
    /// Lowest corner and size of the box, m.
    low: [f32; 3],
    size: [f32; 3],
    functions: usize,
    /// Function of each lattice point; [`MAX_FUNCTIONS`] for a dropped one.
    function_of_point: [u8; MAX_POINTS],
    /// Indices of each cell along the axes, at most 255.
    indices_of_cell: [[u8; 3]; MAX_POINTS],
}

impl Lattice {
    pub(super) const NONE: Self = Self {
        cells: [0; 3],
        low: [0.0; 3],
        size: [0.0; 3],
        functions: 0,
        function_of_point: [DROPPED; MAX_POINTS],
        indices_of_cell: [[0; 3]; MAX_POINTS],
    };

    pub(super) const fn functions(&self) -> usize {
        self.functions
    }

    pub(super) const fn cells(&self) -> [u32; 3] {
        self.cells
    }

    /// The lattice of a grid; without functions if the grid has no cells.
    pub(super) fn of(grid: Grid, points: &[[f32; 3]], inertia: &[NodeInertia]) -> Result<Self, InertiaError> {
        if grid.cells == [0; 3] { Ok(Self::NONE) } else { Self::new(grid.cells, points, inertia) }
    }

    /// A lattice of these cells on the box around the points (m).
    pub(super) fn new(
        cells: [u32; 3],
        points: &[[f32; 3]],
        inertia: &[NodeInertia],
    ) -> Result<Self, InertiaError> {
        let fits = cells.iter().all(|&count| (1..MAX_POINTS as u32).contains(&count))
            && cells.iter().map(|&count| count as usize + 1).product::<usize>() <= MAX_POINTS;
        if !fits {
            return Err(InertiaError::Cells { cells });
        }
        let (low, size) = bounding_box(points);
        let mut lattice = Self { cells, low, size, ..Self::NONE };
        let [along, across, _] = cells.map(|count| (count as usize).max(1));
        for (cell, indices) in lattice.indices_of_cell.iter_mut().enumerate() {
            *indices = [cell % along, cell / along % across, cell / along / across].map(|at| at as u8);
        }
        let mut mass = [0.0f32; MAX_POINTS];
        for (&point, inertia) in points.iter().zip(inertia) {
            let free = inertia.inverse.iter().filter(|&&inverse| inverse > 0.0).count() as f32 / 3.0;
            let node = lattice.place(point);
            for (point, weight) in lattice.corner_points(node.cell()).into_iter().zip(node.eight_weights()) {
                if let Some(mass) = mass.get_mut(point) {
                    *mass += inertia.mass * weight * free;
                }
            }
        }
        let largest = mass.iter().copied().fold(0.0, f32::max);
        for (function, mass) in lattice.function_of_point.iter_mut().zip(mass) {
            if mass > LEAST_MASS * largest {
                if lattice.functions == MAX_FUNCTIONS {
                    return Err(InertiaError::Functions { cells });
                }
                *function = lattice.functions as u8;
                lattice.functions += 1;
            }
        }
        Ok(lattice)
    }

    /// The place of a point (m), in cells.
    pub(super) fn place(&self, point: [f32; 3]) -> LatticeNode {
        let mut node = LatticeNode::default();
        let mut indices = [0; 3];
        for axis in 0..3 {
            let (count, size) = (self.cells[axis], self.size[axis]);
            let position =
                if size > 0.0 { (point[axis] - self.low[axis]) / size * count as f32 } else { 0.0 };
            // Rounding may put the last node slightly outside the box.
            let cell = (position as u32).min(count.saturating_sub(1));
            indices[axis] = cell as u8;
            node.within[axis] = (position - cell as f32).clamp(0.0, 1.0);
        }
        node.cell = self.cell_index(indices) as u32;
        node
    }

    /// The function whose frame a node uses: the one with the largest weight. [`MAX_FUNCTIONS`], a frame that does not
    /// rotate, if some of the node's axes are held, because these do not rotate.
    pub(super) fn frame(&self, place: &LatticeNode, inertia: &NodeInertia) -> usize {
        let held = inertia.inverse.iter().filter(|&&inverse| inverse <= 0.0).count();
        let (mut frame, mut most) = (MAX_FUNCTIONS, 0.0);
        for (function, weight) in self.weights(place) {
            if function < MAX_FUNCTIONS && weight > most && (held == 0 || held == 3) {
                (frame, most) = (function, weight);
            }
        }
        frame
    }

    /// Lattice points at the corners of a cell.
    #[inline(always)]
    fn corner_points(&self, cell: usize) -> [usize; 8] {
        let [i, j, k] = self.cell_indices(cell).map(usize::from);
        let row = self.cells[0] as usize + 1;
        let layer = row * (self.cells[1] as usize + 1);
        let first = i + j * row + k * layer;
        let [a, b, c, d] = [first, first + 1, first + row, first + row + 1];
        [a, b, c, d, a + layer, b + layer, c + layer, d + layer]
    }

    /// Indices of a cell along the axes.
    #[inline(always)]
    pub(super) fn cell_indices(&self, cell: usize) -> [u8; 3] {
        self.indices_of_cell.get(cell).copied().unwrap_or_default()
    }

    /// Index of the cell with these indices along the axes.
    #[inline(always)]
    pub(super) fn cell_index(&self, indices: [u8; 3]) -> usize {
        let [i, j, k] = indices.map(usize::from);
        i + self.cells[0] as usize * (j + self.cells[1] as usize * k)
    }

    /// Difference of the indices of neighbouring cells along an axis.
    #[inline(always)]
    pub(super) fn cell_stride(&self, axis: usize) -> usize {
        let [along, across, _] = self.cells.map(|count| count as usize);
        [1, along, along * across][axis % 3]
    }

    /// Number of cells.
    pub(super) fn cell_count(&self) -> usize {
        self.cells.iter().map(|&count| count as usize).product()
    }

    /// Largest strain of a lattice edge for vectors of the functions (m): difference of the vectors at its ends over
    /// its length. Points with a dropped function do not move.
    pub(super) fn largest_strain(&self, vectors: &CoarseVectors) -> f32 {
        let [nx, ny, nz] = self.cells.map(|count| count as usize + 1);
        let at = |point: usize| {
            let function = self.function_of_point.get(point).copied().unwrap_or(DROPPED);
            vectors.get(usize::from(function)).copied().unwrap_or_default().0
        };
        // The largest square over the edges from a point to the next points; there are none after the last along an
        // axis.
        let largest_square = |point: usize, last: [bool; 3]| {
            let (here, mut largest) = (at(point), 0.0);
            for (axis, stride) in [1, nx, nx * ny].into_iter().enumerate() {
                let (last, size, cells) = (last[axis % 3], self.size[axis % 3], self.cells[axis % 3]);
                if last || size <= 0.0 {
                    continue;
                }
                let there = at(point + stride);
                let along = |i: usize| there[i] - here[i];
                let square = along(0) * along(0) + along(1) * along(1) + along(2) * along(2);
                let per_metre = cells as f32 / size;
                largest = f32::max(largest, square * per_metre * per_metre);
            }
            largest
        };
        let (mut largest, mut point) = (0.0, 0);
        for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
            for i in 0..nx {
                largest = f32::max(largest, largest_square(point, [i + 1 == nx, j + 1 == ny, k + 1 == nz]));
                point += 1;
            }
        }
        libm::sqrtf(largest)
    }

    /// Functions at the corners of a cell; [`MAX_FUNCTIONS`] for dropped ones.
    #[inline(always)]
    pub(super) fn functions_of(&self, cell: usize) -> [usize; 8] {
        self.corner_points(cell)
            .map(|point| usize::from(self.function_of_point.get(point).copied().unwrap_or(DROPPED)))
    }

    /// Functions and weights of a node; [`MAX_FUNCTIONS`] for dropped functions.
    #[inline(always)]
    pub(super) fn weights(&self, node: &LatticeNode) -> [(usize, f32); 8] {
        let (functions, weights) = (self.functions_of(node.cell()), node.eight_weights());
        array::from_fn(|corner| (functions[corner], weights[corner]))
    }
}

/// One vector for each function, and one more that stands for the dropped functions.
pub(super) type CoarseVectors = [NodeVector; MAX_FUNCTIONS + 1];

fn bounding_box(points: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for point in points {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    (low, [0, 1, 2].map(|axis| high[axis] - low[axis]))
}

/// Two grids of near-cubic cells, with `parts` cells along the longest side of the box around the points. Along the
/// other sides the number of cells is rounded down in the first grid, and to the nearest integer in the second.
pub(super) fn near_cubic(points: &[[f32; 3]], parts: u32) -> [[u32; 3]; 2] {
    let (_, size) = bounding_box(points);
    let longest = size.iter().copied().fold(0.0, f32::max);
    // 0.01, because rounding may make an integer slightly smaller.
    [0.01, 0.5].map(|up| size.map(|size| (libm::floorf(size / longest * parts as f32 + up) as u32).max(1)))
}
