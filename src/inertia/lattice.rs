//! A coarse lattice around the body: trilinear functions `W` on the nodes, one for each lattice point. Motion that they
//! can represent is smooth motion. A function is zero at held axes. A point with too little of the body near it has no
//! function of its own ([`LightPoint`]), as its inertia would be small compared with its stiffness.

use core::{array, fmt};

use bytemuck::{Pod, Zeroable};

use glam::{Mat3, Vec4};

use super::InertiaError;
use super::frames::Matrix;
use super::layout::Layout;
use crate::element::NodeInertia;
use crate::padding;
use crate::simd::NodeVector;

/// Largest number of lattice points.
pub const MAX_POINTS: usize = 1024;
/// Largest number of functions, without the dropped ones.
pub const MAX_FUNCTIONS: usize = 240;
/// Stands for a point that supports hold: its function is zero.
const HELD: u8 = MAX_FUNCTIONS as u8;
/// Stands for a point without nodes near it.
const EMPTY: u8 = HELD + 1;
/// Stands for a light point before it has a number.
const LIGHT: u8 = HELD + 2;
/// Points with less than this share of the largest free mass of a point have no function of their own.
const LEAST_MASS: f32 = 0.02;

/// A lattice around a body.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub struct Grid {
    /// Cells along each axis, zeros for none.
    pub cells: [u32; 3],
    /// Functions of the lattice, without those that supports or the body's shape leave almost no mass.
    pub functions: usize,
}

impl Grid {
    /// Number of cells.
    pub(super) fn cell_count(&self) -> usize {
        self.cells.iter().fold(1, |product, &count| product.saturating_mul(count as usize))
    }
}

impl fmt::Display for Grid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cells: [x, y, z], functions } = self;
        write!(f, "{x} x {y} x {z} cells, {functions} functions")
    }
}

/// The place of a node in the lattice. The list of places is in the order of the cells.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LatticeNode {
    /// Position in the cell, 0 to 1 along each axis, or a little outside ([`Lattice::place`]).
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
        eight_weights(self.within)
    }
}

/// Weights of the functions at the eight corners of a cell, at a position in it or beyond it.
#[inline(always)]
pub(super) fn eight_weights([x, y, z]: [f32; 3]) -> [f32; 8] {
    let (nx, ny, nz) = (1.0 - x, 1.0 - y, 1.0 - z);
    let (a, b, c, d) = (nx * ny, x * ny, nx * y, x * y);
    [a * nz, b * nz, c * nz, d * nz, a * z, b * z, c * z, d * z]
}

/// The place of a node.
#[inline(always)]
pub(super) fn node_place(places: &[LatticeNode], node: usize) -> Option<&LatticeNode> {
    places.get(rank_of(places, node))
}

/// The index of a node in the order of the cells; without a lattice, which has no places, that of the node.
#[inline(always)]
pub(super) fn rank_of(places: &[LatticeNode], node: usize) -> usize {
    places.get(node).map_or(node, |entry| entry.rank as usize)
}

/// The node at an index in that order.
#[inline(always)]
pub(super) fn node_at(places: &[LatticeNode], rank: usize) -> usize {
    places.get(rank).map_or(rank, LatticeNode::node)
}

/// The places of the nodes of a cell.
pub(super) fn nodes_of_cell(places: &[LatticeNode], cell: usize) -> &[LatticeNode] {
    let [first, end] = [cell, cell + 1].map(|cell| places.partition_point(|place| place.cell() < cell));
    places.get(first..end).unwrap_or_default()
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

/// Free and held mass of the nodes around a lattice point, kg.
#[derive(Clone, Copy, Debug, Default)]
struct PointMass {
    free: f32,
    held: f32,
}

/// A point with too little of the body near it for a function of its own ([`LEAST_MASS`]): it moves as the nearest cell
/// without such points would take it along, so that linear motion stays linear and all motion continuous (Höllig, Reif &
/// Wipper 2001, "Weighted extended B-spline approximation").
#[derive(Clone, Copy, Debug)]
struct LightPoint {
    cell: u16,
    /// From the lowest corner of that cell, in cells.
    offset: [i8; 3],
}

/// Most light points.
const MAX_LIGHT: usize = 64;

/// A lattice on the box around a body.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Cells along each axis.
    cells: [u32; 3],
    /// Size of the box, m.
    size: [f32; 3],
    functions: usize,
    /// Function of each lattice point; or from [`Lattice::functions`] on the number of a light point, or [`HELD`] or
    /// [`EMPTY`].
    function_of_point: [u8; MAX_POINTS],
    light: [LightPoint; MAX_LIGHT],
    light_points: usize,
    /// Indices of each cell along the axes, at most 255.
    indices_of_cell: [[u8; 3]; MAX_POINTS],
}

impl Lattice {
    pub(super) const NONE: Self = Self {
        cells: [0; 3],
        size: [0.0; 3],
        functions: 0,
        function_of_point: [HELD; MAX_POINTS],
        light: [LightPoint { cell: 0, offset: [0; 3] }; MAX_LIGHT],
        light_points: 0,
        indices_of_cell: [[0; 3]; MAX_POINTS],
    };

    pub(super) const fn functions(&self) -> usize {
        self.functions
    }

    pub(super) const fn cells(&self) -> [u32; 3] {
        self.cells
    }

    /// Of the box around the body, m; zero without a lattice.
    pub(super) const fn longest_side(&self) -> f32 {
        let [x, y, z] = self.size;
        x.max(y).max(z)
    }

    /// A lattice of these cells on the box around the nodes.
    pub(super) fn new(cells: [u32; 3], layout: &Layout<'_>, inertia: &[NodeInertia]) -> Result<Self, InertiaError> {
        let mut lattice = Self::NONE;
        lattice.set(cells, layout, inertia)?;
        Ok(lattice)
    }

    /// Number of functions of such a lattice. Not inlined: its stack is free again afterwards.
    #[inline(never)]
    pub(super) fn functions_for(
        cells: [u32; 3],
        layout: &Layout<'_>,
        inertia: &[NodeInertia],
    ) -> Result<usize, InertiaError> {
        Ok(Self::new(cells, layout, inertia)?.functions)
    }

    /// Makes this such a lattice.
    #[inline(never)]
    pub(super) fn set(
        &mut self,
        cells: [u32; 3],
        layout: &Layout<'_>,
        inertia: &[NodeInertia],
    ) -> Result<(), InertiaError> {
        let fits = cells.iter().all(|&count| (1..MAX_POINTS as u32).contains(&count))
            && cells.iter().map(|&count| count as usize + 1).product::<usize>() <= MAX_POINTS;
        let Some(size) = layout.box_of(cells).filter(|_| fits) else { return Err(InertiaError::Cells { cells }) };
        (self.cells, self.size, self.functions, self.light_points) = (cells, size, 0, 0);
        let [along, across, _] = cells.map(|count| (count as usize).max(1));
        for (cell, indices) in self.indices_of_cell.iter_mut().enumerate() {
            *indices = [cell % along, cell / along % across, cell / along / across].map(|at| at as u8);
        }
        let mut masses = [PointMass::default(); MAX_POINTS];
        self.add_masses(layout, inertia, &mut masses);
        let largest = masses.iter().fold(0.0, |most, mass| f32::max(most, mass.free));
        let mut full = false;
        // First those that are light, without numbers.
        for (function, mass) in self.function_of_point.iter_mut().zip(&masses) {
            let (is_light, is_held) = (mass.free <= LEAST_MASS * largest, mass.held > mass.free);
            *function = match mass.free > 0.0 {
                true if !is_light => 0,
                true if !is_held => LIGHT,
                _ if mass.held > 0.0 => HELD,
                _ => EMPTY,
            };
        }
        let before = self.function_of_point;
        self.for_each_point(|lattice, point| {
            let nearest = if before.get(point) == Some(&LIGHT) { lattice.nearest_whole(point, &before) } else { None };
            let Some(function) = lattice.function_of_point.get_mut(point) else { return };
            if nearest.is_none() && (*function == 0 || *function == LIGHT) {
                full |= lattice.functions == MAX_FUNCTIONS;
                *function = lattice.functions.min(MAX_FUNCTIONS - 1) as u8;
                lattice.functions += 1;
            }
        });
        self.for_each_point(|lattice, point| {
            let Some(nearest) = lattice.nearest_whole(point, &before).filter(|_| before.get(point) == Some(&LIGHT))
            else {
                return;
            };
            let number = lattice.functions + lattice.light_points;
            full |= number >= MAX_FUNCTIONS || lattice.light_points >= MAX_LIGHT;
            if let (Some(place), Some(function)) =
                (lattice.light.get_mut(lattice.light_points), lattice.function_of_point.get_mut(point))
            {
                *place = nearest;
                *function = number.min(MAX_FUNCTIONS - 1) as u8;
                lattice.light_points += 1;
            }
        });
        if full { Err(InertiaError::Functions { cells }) } else { Ok(()) }
    }

    /// The nearest cell without light points to a point, at most one cell away, with functions before they have numbers.
    fn nearest_whole(&self, point: usize, functions: &[u8; MAX_POINTS]) -> Option<LightPoint> {
        let (counts, at) = (self.cells.map(|count| count as usize), self.point_indices(point));
        let mut best: Option<(u32, LightPoint)> = None;
        for (k, j) in (0..4).flat_map(|k| (0..4).map(move |j| (k, j))) {
            for i in 0..4 {
                // From two cells before the point on.
                let indices = [(at[0] + i).checked_sub(2), (at[1] + j).checked_sub(2), (at[2] + k).checked_sub(2)];
                let [Some(a), Some(b), Some(c)] = indices else { continue };
                if a >= counts[0] || b >= counts[1] || c >= counts[2] {
                    continue;
                }
                let cell = a + counts[0] * (b + counts[1] * c);
                let of = |point: usize| functions.get(point).copied().unwrap_or(EMPTY);
                let corners = self.corner_points(cell).map(of);
                if corners.iter().any(|&of| of == LIGHT || of == EMPTY) || corners.iter().all(|&of| of == HELD) {
                    continue;
                }
                let offset = [at[0] as i8 - a as i8, at[1] as i8 - b as i8, at[2] as i8 - c as i8];
                let beyond = offset.map(|offset| u32::from(!(0..=1).contains(&offset)));
                let distance = beyond[0] + beyond[1] + beyond[2];
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, LightPoint { cell: cell as u16, offset }));
                }
            }
        }
        best.map(|(_, light)| light)
    }

    /// Calls `visit` with the functions that a number of a point of a cell stands for, and their weights: itself, or those
    /// that take a light point along.
    #[inline(always)]
    pub(super) fn each_function(&self, number: usize, mut visit: impl FnMut(usize, f32)) {
        match number.checked_sub(self.functions) {
            None => visit(number, 1.0),
            Some(light) => {
                let Some(light) = self.light.get(..self.light_points).and_then(|all| all.get(light)) else { return };
                let weights = eight_weights(light.offset.map(f32::from));
                for (function, weight) in self.functions_of(light.cell.into()).into_iter().zip(weights) {
                    if function < self.functions {
                        visit(function, weight);
                    }
                }
            }
        }
    }

    /// Whether a number stands for a function or a light point.
    #[inline(always)]
    pub(super) const fn moves(&self, number: usize) -> bool {
        number < self.functions + self.light_points
    }

    /// Whether a number stands for a light point.
    #[inline(always)]
    pub(super) const fn is_light(&self, number: usize) -> bool {
        number >= self.functions && self.moves(number)
    }

    /// Adds the sums of light points to those of the functions that take them along.
    pub(super) fn fold(&self, sums: &mut CoarseVectors) {
        for light in self.functions..self.functions + self.light_points {
            let sum = sums.get_mut(light).map(core::mem::take).unwrap_or_default();
            self.each_function(light, |function, weight| {
                if let Some(NodeVector(to)) = sums.get_mut(function) {
                    *to = (Vec4::from(*to) + weight * Vec4::from(sum.0)).to_array();
                }
            });
        }
    }

    /// Sets the vectors of light points from those of the functions.
    pub(super) fn expand(&self, vectors: &mut CoarseVectors) {
        for light in self.functions..self.functions + self.light_points {
            let mut sum = Vec4::ZERO;
            self.each_function(light, |function, weight| {
                sum += weight * vectors.get(function).map_or(Vec4::ZERO, |vector| Vec4::from(vector.0));
            });
            if let Some(vector) = vectors.get_mut(light) {
                vector.0 = sum.to_array();
            }
        }
    }

    /// The axes from that with the fewest cells to that with the most: the order of the functions.
    #[inline(always)]
    pub(super) fn axes(&self) -> [usize; 3] {
        let [x, y, z] = self.cells;
        let [a, b] = if y < x { [1, 0] } else { [0, 1] };
        if z < self.cells[a] {
            [2, a, b]
        } else if z < self.cells[b] {
            [a, 2, b]
        } else {
            [a, b, 2]
        }
    }

    /// Calls `visit` with each point, layer by layer along the longest axis: so the functions of an element have
    /// numbers close to each other, and the matrices narrow bands.
    fn for_each_point(&mut self, mut visit: impl FnMut(&mut Self, usize)) {
        let counts = self.cells.map(|count| count as usize + 1);
        let strides = [1, counts[0], counts[0] * counts[1]];
        let [inner, middle, outer] = self.axes().map(|axis| (counts[axis % 3], strides[axis % 3]));
        for (k, j) in (0..outer.0).flat_map(|k| (0..middle.0).map(move |j| (k, j))) {
            for i in 0..inner.0 {
                visit(self, i * inner.1 + j * middle.1 + k * outer.1);
            }
        }
    }

    /// Adds the masses (kg) of the nodes to those of the points.
    fn add_masses(&self, layout: &Layout<'_>, inertia: &[NodeInertia], masses: &mut [PointMass; MAX_POINTS]) {
        layout.each_node(self.cells, |node, offset| {
            let Some(inertia) = inertia.get(node).filter(|inertia| !inertia.is_alone()) else { return };
            let free = inertia.inverse.iter().filter(|&&inverse| inverse > 0.0).count() as f32 / 3.0;
            let node = self.place(offset);
            for (point, weight) in self.corner_points(node.cell()).into_iter().zip(node.eight_weights()) {
                if let Some(mass) = masses.get_mut(point) {
                    mass.free += inertia.mass * weight * free;
                    mass.held += inertia.mass * weight * (1.0 - free);
                }
            }
        });
    }

    /// Writes the place of each node.
    pub(super) fn write_places(&self, layout: &Layout<'_>, places: &mut [LatticeNode]) {
        layout.each_node(self.cells, |node, offset| {
            if let Some(place) = places.get_mut(node) {
                *place = self.place(offset);
            }
        });
    }

    /// The place of a point, m from the lowest corner of the box.
    fn place(&self, offset: [f32; 3]) -> LatticeNode {
        let mut position = [0.0; 3];
        for axis in 0..3 {
            let (count, size) = (self.cells[axis] as f32, self.size[axis]);
            if size > 0.0 {
                // Rounding may put the last node slightly outside the box.
                position[axis] = (offset[axis] / size * count).clamp(0.0, count);
            }
        }
        let cell = self.cell_at(position);
        let corner = self.cell_indices(cell).map(f32::from);
        let within = [0, 1, 2].map(|axis| position[axis] - corner[axis]);
        LatticeNode { within, cell: cell as u32, ..LatticeNode::default() }
    }

    /// The position of a place, in cells along each axis.
    pub(super) fn position(&self, place: &LatticeNode) -> [f32; 3] {
        let corner = self.cell_indices(place.cell()).map(f32::from);
        [0, 1, 2].map(|axis| corner[axis] + place.within[axis])
    }

    /// The cell of a position, in cells along each axis.
    pub(super) fn cell_at(&self, position: [f32; 3]) -> usize {
        let mut indices = [0; 3];
        for axis in 0..3 {
            indices[axis] = (position[axis] as u32).min(self.cells[axis].saturating_sub(1)) as u8;
        }
        self.cell_index(indices)
    }

    /// Indices of a point along the axes.
    const fn point_indices(&self, point: usize) -> [usize; 3] {
        let [x, y] = [self.cells[0] as usize + 1, self.cells[1] as usize + 1];
        [point % x, point / x % y, point / x / y]
    }

    /// Lattice points at the corners of a cell.
    #[inline(always)]
    fn corner_points(&self, cell: usize) -> [usize; 8] {
        // No closures, because the compiler may leave them as function calls.
        let [i, j, k] = self.cell_indices(cell);
        let (i, j, k) = (usize::from(i), usize::from(j), usize::from(k));
        let row = self.cells[0] as usize + 1;
        let layer = row * (self.cells[1] as usize + 1);
        let first = i + j * row + k * layer;
        let [a, b, c, d] = [first, first + 1, first + row, first + row + 1];
        [a, b, c, d, a + layer, b + layer, c + layer, d + layer]
    }

    /// Indices of a cell along the axes.
    #[inline(always)]
    fn cell_indices(&self, cell: usize) -> [u8; 3] {
        self.indices_of_cell.get(cell).copied().unwrap_or_default()
    }

    /// Index of the cell with these indices along the axes.
    #[inline(always)]
    fn cell_index(&self, indices: [u8; 3]) -> usize {
        let [i, j, k] = indices.map(usize::from);
        i + self.cells[0] as usize * (j + self.cells[1] as usize * k)
    }

    /// The position of a place, with respect to some cell.
    #[inline(always)]
    pub(super) fn within(&self, cell: usize, place: &LatticeNode) -> [f32; 3] {
        let (here, there) = (self.cell_indices(cell), self.cell_indices(place.cell()));
        let mut within = place.within;
        for axis in 0..3 {
            within[axis] += f32::from(there[axis]) - f32::from(here[axis]);
        }
        within
    }

    /// Number of cells.
    pub(super) fn cell_count(&self) -> usize {
        self.cells.iter().map(|&count| count as usize).product()
    }

    /// The largest strain of a cell for vectors of the functions (m), with the rotation of each function since rest. A
    /// translation or a rotation is none.
    pub(super) fn largest_strain(&self, vectors: &CoarseVectors, rotations: &[Matrix]) -> f32 {
        let mut largest = 0.0;
        let mut per_metre = [0.0; 3];
        for axis in 0..3 {
            if self.size[axis] > 0.0 {
                per_metre[axis] = 0.25 * self.cells[axis] as f32 / self.size[axis];
            }
        }
        for cell in 0..self.cell_count() {
            let functions = self.functions_of(cell);
            let Some(rotation) = functions.iter().find_map(|&function| rotations.get(function)) else {
                continue;
            };
            if functions.contains(&usize::from(EMPTY)) {
                continue;
            }
            let mut at = [Vec4::ZERO; 8];
            for (at, function) in at.iter_mut().zip(functions) {
                *at = vectors.get(function).map_or(Vec4::ZERO, |vector| Vec4::from(vector.0));
            }
            let [a, b, c, d, e, f, g, h] = at;
            // Mean differences along the cell's edges, in the axes at rest.
            let along = [
                (b + d + f + h) - (a + c + e + g),
                (c + d + g + h) - (a + b + e + f),
                (e + f + g + h) - (a + b + c + d),
            ];
            let rows = rotation.map(|[x, y, z]| Vec4::new(x, y, z, 0.0));
            let mut gradient = [[0.0; 4]; 3];
            for axis in 0..3 {
                let [x, y, z, _] = (per_metre[axis] * along[axis]).to_array();
                gradient[axis] = (rows[0] * x + rows[1] * y + rows[2] * z).to_array();
            }
            let mut square = 0.0;
            for i in 0..3 {
                for j in 0..3 {
                    let strain = 0.5 * (gradient[i][j] + gradient[j][i]);
                    square += strain * strain;
                }
            }
            largest = f32::max(largest, square);
        }
        libm::sqrtf(largest)
    }

    /// Largest rotation of neighbouring functions relative to each other, rad, with that of each function.
    pub(super) fn largest_bending(&self, rotation: impl Fn(usize) -> Mat3) -> f32 {
        let mut largest = 0.0;
        self.for_each_edge(|a, b, _| {
            if a < MAX_FUNCTIONS && b < MAX_FUNCTIONS {
                let difference = rotation(a) - rotation(b);
                let square = difference.to_cols_array().iter().map(|entry| entry * entry).sum::<f32>();
                largest = f32::max(largest, 0.5 * square);
            }
        });
        libm::sqrtf(largest)
    }

    /// Calls `visit` with the functions at the ends of each edge, [`MAX_FUNCTIONS`] at a held end, and the edge's
    /// inverse length squared, 1/m^2. Edges to empty points and between held ones are left out.
    #[inline(always)]
    pub(super) fn for_each_edge(&self, mut visit: impl FnMut(usize, usize, f32)) {
        let [nx, ny, nz] = self.cells.map(|count| count as usize + 1);
        let mut weights = [0.0; 3];
        for axis in 0..3 {
            let per_metre = if self.size[axis] > 0.0 { self.cells[axis] as f32 / self.size[axis] } else { 0.0 };
            weights[axis] = per_metre * per_metre;
        }
        let of = |point: usize| match self.function_of_point.get(point).copied().unwrap_or(EMPTY) {
            light if self.is_light(light.into()) => EMPTY,
            other => other,
        };
        let mut point = 0;
        for (k, j) in (0..nz).flat_map(|k| (0..ny).map(move |j| (k, j))) {
            for i in 0..nx {
                let next = [(1, i + 1 < nx), (nx, j + 1 < ny), (nx * ny, k + 1 < nz)];
                for ((stride, _), weight) in next.into_iter().zip(weights).filter(|((_, inside), _)| *inside) {
                    let (a, b) = (of(point), of(point + stride));
                    if a != EMPTY && b != EMPTY && (a != HELD || b != HELD) {
                        visit(usize::from(a), usize::from(b), weight);
                    }
                }
                point += 1;
            }
        }
    }

    /// Functions at the corners of a cell; [`MAX_FUNCTIONS`] for dropped ones.
    #[inline(always)]
    pub(super) fn functions_of(&self, cell: usize) -> [usize; 8] {
        let mut functions = [MAX_FUNCTIONS; 8];
        for (function, point) in functions.iter_mut().zip(self.corner_points(cell)) {
            *function = usize::from(self.function_of_point.get(point).copied().unwrap_or(HELD));
        }
        functions
    }

    /// The cells around the point of a function.
    pub(super) fn cells_of(&self, function: usize) -> [Option<usize>; 8] {
        let counts = self.cells.map(|count| count as usize);
        let Some(point) = self.function_of_point.iter().position(|&of| usize::from(of) == function) else {
            return [None; 8];
        };
        let at = self.point_indices(point);
        array::from_fn(|corner| {
            let mut cell = [0; 3];
            for axis in 0..3 {
                cell[axis] = at[axis].checked_sub(corner >> axis & 1).filter(|&at| at < counts[axis])?;
            }
            Some(cell[0] + counts[0] * (cell[1] + counts[1] * cell[2]))
        })
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

/// Lowest corner and size of the box around points, m.
pub(super) fn bounding_box<'a>(points: impl Iterator<Item = &'a [f32; 3]>) -> ([f32; 3], [f32; 3]) {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for point in points {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    (low, [0, 1, 2].map(|axis| high[axis] - low[axis]))
}

/// Size of the box around the points, m.
pub(crate) fn size_of(points: &[[f32; 3]]) -> [f32; 3] {
    bounding_box(points.iter()).1
}
