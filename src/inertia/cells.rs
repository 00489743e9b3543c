//! Restriction `W^T v` to the functions of a lattice, summed by cell, and prolongation `W x`, both vectorised over
//! nodes.

use bytemuck::{Pod, Zeroable, must_cast, must_cast_ref};
use glam::Vec4;

use super::lattice::{CoarseVectors, Lattice, LatticeNode};
use crate::simd::{NodeVector, Real, TILE};

/// Most vectors that [`TILE`] nodes fill. There are separate sums for each of the [`TILE`] places, so the bits do not
/// depend on the width.
pub(super) const VECTORS_PER_TILE: usize = 2;

/// A vector of consecutive nodes in the order of the cells, where [`Real::lane_of_row`] puts them.
pub(super) struct NodesInCells<'a, R> {
    /// Positions of the nodes in their cells.
    pub(super) position: [R; 3],
    /// Cells of the first and the last node.
    pub(super) ends: [usize; 2],
    pub(super) places: &'a [LatticeNode],
}

impl<R: Real> NodesInCells<'_, R> {
    /// The cell of the node in a lane.
    fn cell(&self, lane: usize) -> usize {
        self.places.get(R::row_of_lane(lane)).map_or(0, LatticeNode::cell)
    }

    /// Ones for the nodes in a cell, zeros for the others.
    #[inline(always)]
    fn mask(&self, cell: usize) -> R {
        R::from_fn(|lane| if self.cell(lane) == cell { 1.0 } else { 0.0 })
    }

    /// The next cell after this one that has nodes.
    #[inline(always)]
    fn after(&self, cell: usize) -> usize {
        let mut next = self.ends[1];
        for other in self.places.iter().map(LatticeNode::cell) {
            next = if other > cell && other < next { other } else { next };
        }
        next
    }
}

/// The sums of the cells of some consecutive nodes. The first cell may have nodes before these too, which another
/// thread may be adding, so its sum is separate.
pub(super) struct CellSlots<'a> {
    pub(super) first: usize,
    pub(super) head: &'a mut CellPolynomial,
    /// Cells from this one on.
    pub(super) from: usize,
    pub(super) rest: &'a mut [CellPolynomial],
}

impl CellSlots<'_> {
    #[inline(always)]
    pub(super) fn get_mut(&mut self, cell: usize) -> Option<&mut CellPolynomial> {
        if cell == self.first { Some(self.head) } else { self.rest.get_mut(cell.wrapping_sub(self.from)) }
    }
}

/// A vector field on a cell, as coefficients of the monomials `1, x, y, xy, z, xz, yz, xyz` of the position in the
/// cell. They take fewer operations a node than trilinear functions. Used for the motion of the nodes in a cell
/// (prolongation), and for sums of nodal vectors times monomials (restriction). Two vectors a row.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct CellPolynomial([[f32; 8]; 4]);

impl CellPolynomial {
    pub(super) const ZERO: Self = Self([[0.0; 8]; 4]);

    /// Adds other sums.
    pub(super) fn add_sums(&mut self, other: &Self) {
        for (sum, other) in self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()) {
            *sum += other;
        }
    }

    /// The sum of further values of the nodes.
    pub(super) const fn values(&self) -> f32 {
        self.0[0][3]
    }

    /// Adds `W^T v` of a node, and a further value.
    #[inline(always)]
    pub(super) fn add(&mut self, place: &LatticeNode, v: [f32; 3], value: f32) {
        self.0[0][3] += value;
        let [x, y, z] = place.within();
        let products = monomials([x, y, z]);
        for (sums, of) in self.0.as_flattened_mut().chunks_exact_mut(4).zip(products) {
            for (sum, v) in sums.iter_mut().zip(v) {
                *sum += of * v;
            }
        }
    }

    /// The field at the positions of a vector of nodes.
    #[inline(always)]
    pub(super) fn at<R: Real>(&self, [x, y, z]: [R; 3]) -> [R; 3] {
        let mut at = [R::splat(0.0); 3];
        for (axis, at) in at.iter_mut().enumerate() {
            let coefficient = |row: usize, half: usize| R::splat(self.0[row % 4][4 * half + axis]);
            let half = |half: usize| {
                let near = y.fused(coefficient(1, half), coefficient(0, half));
                z.fused(y.fused(coefficient(3, half), coefficient(2, half)), near)
            };
            *at = x.fused(half(1), half(0));
        }
        at
    }

    /// The eight coefficients.
    fn vectors(&self) -> [Vec4; 8] {
        let vectors: &[[f32; 4]; 8] = must_cast_ref(&self.0);
        vectors.map(Vec4::from)
    }
}

#[inline(always)]
fn monomials<R: Real>([x, y, z]: [R; 3]) -> [R; 8] {
    let (xy, xz) = (x * y, x * z);
    [R::splat(1.0), x, y, xy, z, xz, y * z, xy * z]
}

/// Sums of nodal vectors times monomials for the cell at hand, vectorised. Kept in registers while the nodes of the
/// cell are added.
pub(super) struct CellAccumulator<R> {
    cell: usize,
    sums: [[[R; 3]; 8]; VECTORS_PER_TILE],
    values: [R; VECTORS_PER_TILE],
}

impl<R: Real> CellAccumulator<R> {
    #[inline(always)]
    /// `cell` is that of the first node.
    pub(super) fn new(cell: usize) -> Self {
        let zero = R::splat(0.0);
        Self { cell, sums: [[[zero; 3]; 8]; VECTORS_PER_TILE], values: [zero; VECTORS_PER_TILE] }
    }

    /// Adds `W^T v` of a vector of nodes, the one with index `vector` in its tile, and further values of them.
    #[inline(always)]
    pub(super) fn add(
        &mut self,
        cells: &mut CellSlots<'_>,
        nodes: &NodesInCells<'_, R>,
        vector: usize,
        v: [R; 3],
        value: R,
    ) {
        let of = monomials(nodes.position);
        let [mut cell, last] = nodes.ends;
        if cell == last {
            self.enter(cells, cell);
            self.add_products(vector, &of, v, value);
            return;
        }
        loop {
            self.enter(cells, cell);
            let mask = nodes.mask(cell);
            self.add_products(vector, &of, [mask * v[0], mask * v[1], mask * v[2]], mask * value);
            if cell >= last {
                return;
            }
            cell = nodes.after(cell);
        }
    }

    #[inline(always)]
    fn add_products(&mut self, vector: usize, of: &[R; 8], v: [R; 3], value: R) {
        let sum = &mut self.values[vector % VECTORS_PER_TILE];
        *sum = *sum + value;
        for (sums, of) in self.sums[vector % VECTORS_PER_TILE].iter_mut().zip(of) {
            for (sum, v) in sums.iter_mut().zip(v) {
                *sum = of.fused(v, *sum);
            }
        }
    }

    /// Makes this the cell at hand.
    #[inline(always)]
    fn enter(&mut self, cells: &mut CellSlots<'_>, cell: usize) {
        if cell != self.cell {
            self.flush(cells);
            self.cell = cell;
        }
    }

    /// Adds the sums to their cell, in the order of the nodes, and clears them.
    #[inline(always)]
    pub(super) fn flush(&mut self, cells: &mut CellSlots<'_>) {
        let Some(cell) = cells.get_mut(self.cell) else {
            return;
        };
        for monomial in 0..8 {
            let mut sum = Vec4::ZERO;
            for (sums, &values) in self.sums.iter().zip(&self.values).take(TILE / R::COUNT) {
                let [x, y, z] = sums[monomial];
                let value = if monomial == 0 { values } else { R::splat(0.0) };
                let mut rows = [[0.0; 4]; TILE];
                let here = rows.get_mut(..R::COUNT).unwrap_or_default();
                R::to_consecutive_rows([x, y, z, value], here);
                for row in rows.into_iter().take(R::COUNT) {
                    sum += Vec4::from(row);
                }
            }
            if let Some(place) = cell.0[monomial / 2].get_mut(4 * (monomial % 2)..).and_then(<[f32]>::first_chunk_mut) {
                *place = (Vec4::from(*place) + sum).to_array();
            }
        }
        *self = Self::new(self.cell);
    }
}

/// `W x` of a vector of nodes.
#[inline(always)]
pub(super) fn motion_at<R: Real>(cells: &[CellPolynomial], nodes: &NodesInCells<'_, R>) -> [R; 3] {
    let [mut cell, last] = nodes.ends;
    let at = |cell: usize| cells.get(cell).unwrap_or(&CellPolynomial::ZERO).at(nodes.position);
    let mut moved = at(cell);
    while cell < last {
        cell = nodes.after(cell);
        let (mask, here) = (nodes.mask(cell), at(cell));
        for axis in 0..3 {
            moved[axis] = mask.choose(here[axis], moved[axis]);
        }
    }
    moved
}

/// Writes `W^T v` for each function, from the sums of the cells.
pub(super) fn restrict(cells: &[CellPolynomial], lattice: &Lattice, sums: &mut CoarseVectors) {
    sums.fill(NodeVector::ZERO);
    for (index, cell) in cells.iter().enumerate() {
        let [a, b, c, d, e, f, g, h] = cell.vectors();
        let (a, c, e, g) = (a - b, c - d, e - f, g - h);
        let (a, b, e, f) = (a - c, b - d, e - g, f - h);
        for (vector, function) in [a - e, b - f, c - g, d - h, e, f, g, h].into_iter().zip(lattice.functions_of(index))
        {
            if let Some(sum) = sums.get_mut(function) {
                sum.0 = (Vec4::from(sum.0) + vector).to_array();
            }
        }
    }
}

/// Sets the coefficients of each cell from vectors of the functions.
pub(super) fn prolong(vectors: &CoarseVectors, lattice: &Lattice, cells: &mut [CellPolynomial]) {
    for (index, cell) in cells.iter_mut().enumerate() {
        let at = |function: usize| Vec4::from(vectors.get(function).copied().unwrap_or_default().0);
        let [a, b, c, d, e, f, g, h] = lattice.functions_of(index).map(at);
        let (b, d, f, h) = (b - a, d - c, f - e, h - g);
        let (c, d, g, h) = (c - a, d - b, g - e, h - f);
        let coefficients = [a, b, c, d, e - a, f - b, g - c, h - d].map(|vector| vector.to_array());
        cell.0 = must_cast(coefficients);
    }
}
