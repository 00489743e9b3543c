//! The cells of a lattice, and what nodes side by side have to do with them: `W^T v`, summed by cell, and `W x`.

use bytemuck::{Pod, Zeroable, must_cast, must_cast_ref};
use glam::Vec4;

use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS};
use crate::lanes::{BLOCK, NodeVector, Real, write_rows};

/// Parts of [`BLOCK`] nodes: sums are kept for as many lanes whatever the width, so that their bits are the same.
pub(super) const PARTS: usize = 2;

/// Positions of nodes side by side in their cells, and the cells of the first and the last.
pub(super) struct Within<'a, R> {
    pub(super) position: [R; 3],
    pub(super) ends: [usize; 2],
    pub(super) places: &'a [LatticeNode],
}

impl<R: Real> Within<'_, R> {
    fn cell(&self, lane: usize) -> usize {
        self.places.get(lane).map_or(0, LatticeNode::cell)
    }

    /// Ones for the nodes in this cell.
    #[inline(always)]
    fn mask(&self, cell: usize) -> R {
        R::from_fn(|lane| if self.cell(lane) == cell { 1.0 } else { 0.0 })
    }

    /// The next cell that nodes are in.
    #[inline(always)]
    fn after(&self, cell: usize) -> usize {
        let mut next = self.ends[1];
        for other in self.places.iter().map(LatticeNode::cell) {
            next = if other > cell && other < next { other } else { next };
        }
        next
    }
}

/// One cell of the lattice. Its trilinear functions are taken apart into the monomials `1, x, y, xy, z, xz, yz, xyz`
/// of the position within it, which take fewer operations a node: the monomials' factors, or what is to be summed with
/// them. Two vectors a row.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(transparent)]
pub(super) struct Cell([[f32; 8]; 4]);

impl Cell {
    pub(super) const EMPTY: Self = Self([[0.0; 8]; 4]);

    /// Adds `W^T v` of a node.
    #[inline(always)]
    pub(super) fn add(&mut self, place: &LatticeNode, v: [f32; 3]) {
        let [x, y, z] = place.within();
        let products = monomials([x, y, z]);
        for (sums, of) in self.0.as_flattened_mut().chunks_exact_mut(4).zip(products) {
            for (sum, v) in sums.iter_mut().zip(v) {
                *sum += of * v;
            }
        }
    }

    /// `W x` of nodes side by side.
    #[inline(always)]
    pub(super) fn at<R: Real>(&self, [x, y, z]: [R; 3]) -> [R; 3] {
        let mut at = [R::splat(0.0); 3];
        for (axis, at) in at.iter_mut().enumerate() {
            let factor = |row: usize, half: usize| R::splat(self.0[row % 4][4 * half + axis]);
            let half = |half: usize| {
                let near = y.fused(factor(1, half), factor(0, half));
                z.fused(y.fused(factor(3, half), factor(2, half)), near)
            };
            *at = x.fused(half(1), half(0));
        }
        at
    }

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

/// Sums of one cell while its nodes are gone through, in lanes.
pub(super) struct CellSum<R> {
    cell: usize,
    parts: [[[R; 3]; 8]; PARTS],
}

impl<R: Real> CellSum<R> {
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self { cell: 0, parts: [[[R::splat(0.0); 3]; 8]; PARTS] }
    }

    /// Adds `W^T v` of nodes side by side.
    #[inline(always)]
    pub(super) fn add(&mut self, cells: &mut [Cell], within: &Within<'_, R>, part: usize, v: [R; 3]) {
        let of = monomials(within.position);
        let [mut cell, last] = within.ends;
        if cell == last {
            self.enter(cells, cell);
            self.add_products(part, &of, v);
            return;
        }
        loop {
            self.enter(cells, cell);
            let mask = within.mask(cell);
            self.add_products(part, &of, [mask * v[0], mask * v[1], mask * v[2]]);
            if cell >= last {
                return;
            }
            cell = within.after(cell);
        }
    }

    #[inline(always)]
    fn add_products(&mut self, part: usize, of: &[R; 8], v: [R; 3]) {
        for (sums, of) in self.parts[part % PARTS].iter_mut().zip(of) {
            for (sum, v) in sums.iter_mut().zip(v) {
                *sum = of.fused(v, *sum);
            }
        }
    }

    /// The sums are those of this cell from now on.
    #[inline(always)]
    fn enter(&mut self, cells: &mut [Cell], cell: usize) {
        if cell != self.cell {
            self.flush(cells);
            self.cell = cell;
        }
    }

    /// Hands the sums to their cell, lane by lane.
    #[inline(always)]
    pub(super) fn flush(&mut self, cells: &mut [Cell]) {
        let Some(cell) = cells.get_mut(self.cell) else {
            return;
        };
        for monomial in 0..8 {
            let mut sum = Vec4::ZERO;
            for part in self.parts.iter().take(BLOCK / R::COUNT) {
                let [x, y, z] = part[monomial];
                let mut rows = [[0.0; 4]; BLOCK];
                write_rows(&mut rows, 0, [x, y, z, R::splat(0.0)]);
                for row in rows.into_iter().take(R::COUNT) {
                    sum += Vec4::from(row);
                }
            }
            if let Some(place) =
                cell.0[monomial / 2].get_mut(4 * (monomial % 2)..).and_then(<[f32]>::first_chunk_mut)
            {
                *place = (Vec4::from(*place) + sum).to_array();
            }
        }
        self.parts = [[[R::splat(0.0); 3]; 8]; PARTS];
    }
}

/// `W x` of nodes side by side.
#[inline(always)]
pub(super) fn moved_by<R: Real>(cells: &[Cell], within: &Within<'_, R>) -> [R; 3] {
    let [mut cell, last] = within.ends;
    let at = |cell: usize| cells.get(cell).unwrap_or(&Cell::EMPTY).at(within.position);
    let mut moved = at(cell);
    while cell < last {
        cell = within.after(cell);
        let (mask, here) = (within.mask(cell), at(cell));
        for axis in 0..3 {
            moved[axis] = mask.choose(here[axis], moved[axis]);
        }
    }
    moved
}

/// Gives the cells' sums to their functions.
pub(super) fn restrict(cells: &[Cell], lattice: &Lattice) -> CoarseVectors {
    let mut sums = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    for (number, cell) in cells.iter().enumerate() {
        let [a, b, c, d, e, f, g, h] = cell.vectors();
        let (a, c, e, g) = (a - b, c - d, e - f, g - h);
        let (a, b, e, f) = (a - c, b - d, e - g, f - h);
        for (vector, function) in
            [a - e, b - f, c - g, d - h, e, f, g, h].into_iter().zip(lattice.functions_of(number))
        {
            if let Some(sum) = sums.get_mut(function) {
                sum.0 = (Vec4::from(sum.0) + vector).to_array();
            }
        }
    }
    sums
}

/// The factors of each cell, for vectors of the functions.
pub(super) fn prolong(vectors: &CoarseVectors, lattice: &Lattice, cells: &mut [Cell]) {
    for (number, cell) in cells.iter_mut().enumerate() {
        let at = |function: usize| Vec4::from(vectors.get(function).copied().unwrap_or_default().0);
        let [a, b, c, d, e, f, g, h] = lattice.functions_of(number).map(at);
        let (b, d, f, h) = (b - a, d - c, f - e, h - g);
        let (c, d, g, h) = (c - a, d - b, g - e, h - f);
        let factors = [a, b, c, d, e - a, f - b, g - c, h - d].map(|factor| factor.to_array());
        cell.0 = must_cast(factors);
    }
}
