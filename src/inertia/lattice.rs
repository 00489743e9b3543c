//! A coarse lattice around the body: trilinear functions `W` (one a lattice point) on the nodes, by which
//! smooth motion is told from the rest. A function is zero at held axes. Where a support or the edge of
//! the body leaves a function almost nothing to move it is dropped ([`LEAST_MASS`]): its inertia would be
//! small beside its stiffness, and the system that is factorised ill-conditioned.

use core::array;

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use super::InertiaError;
use crate::lanes::{NodeVector, Real};
use crate::scene::NodeInertia;

/// Lattice points that a lattice may have.
pub const MAX_POINTS: usize = 1024;
/// Functions left after dropping that a lattice may have.
pub const MAX_FUNCTIONS: usize = 128;
const DROPPED: u8 = MAX_FUNCTIONS as u8;
/// Functions with less than this share of the heaviest one's mass are dropped.
const LEAST_MASS: f32 = 0.02;

/// Where a node is in the lattice. Nodes are in the order of their cells.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct LatticeNode {
    /// Position in the cell, 0 to 1.
    within: [f32; 3],
    /// Number of the node.
    node: u32,
    /// Number of the cell.
    cell: u32,
    /// Not of this node: where the one with the number of this place is.
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

    /// See the field.
    #[inline(always)]
    pub(super) fn within(&self) -> [f32; 3] {
        self.within
    }

    /// Position, and the number of the node by its bits.
    #[inline(always)]
    pub(super) fn row(&self) -> [f32; 4] {
        let [x, y, z] = self.within;
        [x, y, z, f32::from_bits(self.node)]
    }

    /// Weights of the functions at the corners of its cell.
    #[inline(always)]
    pub(super) fn eight_weights(&self) -> [f32; 8] {
        let [x, y, z] = self.within;
        let (nx, ny, nz) = (1.0 - x, 1.0 - y, 1.0 - z);
        let (a, b, c, d) = (nx * ny, x * ny, nx * y, x * y);
        [a * nz, b * nz, c * nz, d * nz, a * z, b * z, c * z, d * z]
    }

    /// In the first cell.
    pub const EMPTY: Self = Self { within: [0.0; 3], node: 0, cell: 0, rank: 0 };
}

/// Weights of the functions at the corners of a cell for a node at `place`, in cells from its lowest corner. With an axis
/// `across` it may also be in the next cell along that: first come the weights of the corners of the cell, then those of the
/// next.
#[inline(always)]
pub(super) fn corner_weights<R: Real>(place: Vec4, across: Option<usize>) -> [R; 2] {
    let mut weights = [R::splat(1.0); 2];
    // Of the three layers of functions along each axis.
    let first = (Vec4::ONE - place).max(Vec4::ZERO).to_array();
    let third = (place - Vec4::ONE).max(Vec4::ZERO).to_array();
    let second = (Vec4::ONE - (place - Vec4::ONE).abs()).to_array();
    for axis in 0..3 {
        let far = R::from_fn(|corner| if corner >> axis & 1 == 1 { 1.0 } else { 0.0 });
        let [first, second, third] = [first[axis], second[axis], third[axis]].map(R::splat);
        let along = far.choose(second, first);
        weights[0] = weights[0] * along;
        if across.is_some() {
            let next = far.choose(third, second);
            weights[1] = weights[1] * if across == Some(axis) { next } else { along };
        }
    }
    weights
}

/// Where a node is.
#[inline(always)]
pub(super) fn place_of(places: &[LatticeNode], node: usize) -> Option<&LatticeNode> {
    places.get(places.get(node)?.rank as usize)
}

/// Puts the places of nodes in the order of their cells.
pub(super) fn order(places: &mut [LatticeNode]) {
    // Where the next node of each cell goes.
    let mut next = [0u32; MAX_POINTS + 1];
    for place in &*places {
        if let Some(count) = next.get_mut(place.cell() + 1) {
            *count += 1;
        }
    }
    let mut sum = 0;
    for next in &mut next {
        sum += *next;
        *next = sum;
    }
    for (node, place) in places.iter_mut().enumerate() {
        place.node = node as u32;
        if let Some(next) = next.get_mut(place.cell()) {
            place.rank = *next;
            *next += 1;
        }
    }
    for at in 0..places.len() {
        // Each exchange brings one node to where it belongs.
        for _ in 0..places.len() {
            let Some(here) = places.get(at).copied() else {
                return;
            };
            let goes = places.get(here.node()).map_or(at, |place| place.rank as usize);
            let Some(there) = places.get(goes).copied().filter(|_| goes != at) else {
                break;
            };
            if let Some(place) = places.get_mut(goes) {
                *place = LatticeNode { rank: there.rank, ..here };
            }
            if let Some(place) = places.get_mut(at) {
                *place = LatticeNode { rank: here.rank, ..there };
            }
        }
    }
}

/// Cells along each axis and the functions that were kept.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    cells: [u32; 3],
    /// Corner and size of the box, m.
    low: [f32; 3],
    size: [f32; 3],
    functions: usize,
    /// Function of each lattice point; [`MAX_FUNCTIONS`] for a dropped one.
    of_point: [u8; MAX_POINTS],
    /// Where each cell is along the axes; none has room for more than 255.
    of_cell: [[u8; 3]; MAX_POINTS],
}

impl Lattice {
    pub(super) const NONE: Self = Self {
        cells: [0; 3],
        low: [0.0; 3],
        size: [0.0; 3],
        functions: 0,
        of_point: [DROPPED; MAX_POINTS],
        of_cell: [[0; 3]; MAX_POINTS],
    };

    pub(super) const fn functions(&self) -> usize {
        self.functions
    }

    pub(super) const fn cells(&self) -> [u32; 3] {
        self.cells
    }

    /// A lattice of the given cells on the box around the points.
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
        for (number, place) in lattice.of_cell.iter_mut().enumerate() {
            *place = [number % along, number / along % across, number / along / across].map(|at| at as u8);
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
        for (function, mass) in lattice.of_point.iter_mut().zip(mass) {
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

    /// Where a point is.
    pub(super) fn place(&self, point: [f32; 3]) -> LatticeNode {
        let mut node = LatticeNode::EMPTY;
        let mut along = [0; 3];
        for axis in 0..3 {
            let (count, size) = (self.cells[axis], self.size[axis]);
            let place = if size > 0.0 { (point[axis] - self.low[axis]) / size * count as f32 } else { 0.0 };
            // Rounding may take the last node just beyond the box.
            let cell = (place as u32).min(count.saturating_sub(1));
            along[axis] = cell as u8;
            node.within[axis] = (place - cell as f32).clamp(0.0, 1.0);
        }
        node.cell = self.cell_number(along) as u32;
        node
    }

    /// The function whose frame a node turns with, [`MAX_FUNCTIONS`] for none: the one that moves it most, unless some of
    /// its axes are held, which do not turn.
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
        let [i, j, k] = self.place_of(cell).map(usize::from);
        let row = self.cells[0] as usize + 1;
        let layer = row * (self.cells[1] as usize + 1);
        let first = i + j * row + k * layer;
        let [a, b, c, d] = [first, first + 1, first + row, first + row + 1];
        [a, b, c, d, a + layer, b + layer, c + layer, d + layer]
    }

    /// Where a cell is along the axes.
    #[inline(always)]
    pub(super) fn place_of(&self, cell: usize) -> [u8; 3] {
        self.of_cell.get(cell).copied().unwrap_or_default()
    }

    /// Number of the cell at a place.
    #[inline(always)]
    pub(super) fn cell_number(&self, place: [u8; 3]) -> usize {
        let [i, j, k] = place.map(usize::from);
        i + self.cells[0] as usize * (j + self.cells[1] as usize * k)
    }

    /// Cells from one to the next along an axis.
    #[inline(always)]
    pub(super) fn next_along(&self, axis: usize) -> usize {
        let [along, across, _] = self.cells.map(|count| count as usize);
        [1, along, along * across][axis % 3]
    }

    /// All cells.
    pub(super) fn cell_count(&self) -> usize {
        self.cells.iter().map(|&count| count as usize).product()
    }

    /// Largest difference between neighbouring points over their distance, for vectors of the functions (m). Where a
    /// function was dropped nothing moves.
    pub(super) fn largest_strain(&self, vectors: &CoarseVectors) -> f32 {
        let [nx, ny, nz] = self.cells.map(|count| count as usize + 1);
        let at = |point: usize| {
            let function = self.of_point.get(point).copied().unwrap_or(DROPPED);
            vectors.get(usize::from(function)).copied().unwrap_or_default().0
        };
        // The largest square from a point to the next ones; there is none behind the last along an axis.
        let slopes = |point: usize, last: [bool; 3]| {
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
                largest = f32::max(largest, slopes(point, [i + 1 == nx, j + 1 == ny, k + 1 == nz]));
                point += 1;
            }
        }
        libm::sqrtf(largest)
    }

    /// Functions at the corners of a cell; dropped ones are number [`MAX_FUNCTIONS`].
    #[inline(always)]
    pub(super) fn functions_of(&self, cell: usize) -> [usize; 8] {
        self.corner_points(cell)
            .map(|point| usize::from(self.of_point.get(point).copied().unwrap_or(DROPPED)))
    }

    /// Functions and weights of a node; dropped ones are number [`MAX_FUNCTIONS`].
    #[inline(always)]
    pub(super) fn weights(&self, node: &LatticeNode) -> [(usize, f32); 8] {
        let (functions, weights) = (self.functions_of(node.cell()), node.eight_weights());
        array::from_fn(|corner| (functions[corner], weights[corner]))
    }
}

/// Vectors of the functions, with one more place for what dropped ones would get.
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

/// Near-cubic cells, `parts` along the longest side of the box around the points, and the next coarser: along the other
/// sides as many as fit, or one more where that comes closer to a cube.
pub(super) fn near_cubic(points: &[[f32; 3]], parts: u32) -> [[u32; 3]; 2] {
    let (_, size) = bounding_box(points);
    let longest = size.iter().copied().fold(0.0, f32::max);
    // A whole number of cells may come out a little below it.
    [0.01, 0.5].map(|up| size.map(|size| (libm::floorf(size / longest * parts as f32 + up) as u32).max(1)))
}
