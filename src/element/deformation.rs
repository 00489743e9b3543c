//! The deformation of linear tetrahedra from the displacements (m) of their nodes: `H = grad u = F - I` with its
//! cofactor and the invariants `I1 - 3` and `J - 1`, all zero at rest. Shape function gradients (1/m) are stored for
//! nodes 1, 2, 3; that of node 0 is minus their sum, so that a translation gives exactly zero.

use crate::material::Invariants;
use crate::simd::{Gather, Piece, Real, TileNodes, dot};

use super::ElementTile;
use super::symmetric::Symmetric;

/// A vector and a matrix, of one element or of a vector of elements; rows are spatial axes, columns material axes.
pub(crate) type Vector<R> = [R; 3];
pub(crate) type Matrix<R> = [[R; 3]; 3];

/// Vectors of three corners less that of the first one.
#[inline(always)]
pub(super) fn edges<R: Real>([origin, a, b, c]: [Vector<R>; 4]) -> [Vector<R>; 3] {
    let mut edges = [a, b, c];
    for edge in &mut edges {
        for (component, origin) in edge.iter_mut().zip(origin) {
            *component = *component - origin;
        }
    }
    edges
}

/// Adds to the displacements of three corners relative to the first one what rounding has left out of them. A function
/// of its own, as few steps need it.
pub(super) struct LeftOut<'a, R> {
    pub(super) tile: &'a ElementTile,
    pub(super) first: usize,
    pub(super) remainder: Gather<'a>,
    pub(super) edges: [Vector<R>; 3],
}

impl<R: Real> Piece for LeftOut<'_, R> {
    type Output = [Vector<R>; 3];

    #[inline(always)]
    fn run(self) -> [Vector<R>; 3] {
        let Self { tile, first, remainder, edges: mut sums } = self;
        let nodes = tile.nodes_below::<R>(remainder.count()).unwrap_or(TileNodes::ALL_ZERO);
        let at = |corner: usize| remainder.read_nodes::<R, 4>(&nodes, corner, first);
        for (sum, left) in sums.iter_mut().zip(edges([at(0), at(1), at(2), at(3)])) {
            for (component, left) in sum.iter_mut().zip(left) {
                *component = *component + left;
            }
        }
        sums
    }
}

/// Deformation of a vector of elements.
#[derive(Clone, Copy)]
pub(crate) struct Deformation<R> {
    /// `H = grad u = F - I`.
    pub(crate) h: Matrix<R>,
    /// `cof H`.
    pub(crate) cof_h: Matrix<R>,
    /// `tr H`.
    pub(crate) trace: R,
    pub(crate) invariants: Invariants<R>,
}

impl<R: Real> Deformation<R> {
    /// From the displacement gradient: `J - 1 = tr H + tr cof H + det H`, `I1 - 3 = 2 tr H + H:H`.
    #[inline(always)]
    pub(crate) fn new(h: Matrix<R>) -> Self {
        let zero = Invariants { i: R::splat(0.0), j: R::splat(0.0) };
        let Self { cof_h, trace, .. } = Self::with(h, zero);
        let second = cof_h[0][0] + cof_h[1][1] + cof_h[2][2];
        let j = trace + second + dot(h[0], cof_h[0]);
        let i = trace + trace + (dot(h[0], h[0]) + dot(h[1], h[1]) + dot(h[2], h[2]));
        Self { h, cof_h, trace, invariants: Invariants { i, j } }
    }

    /// From the displacement gradient and its invariants.
    #[inline(always)]
    pub(super) fn with(h: Matrix<R>, invariants: Invariants<R>) -> Self {
        let minor = |i: usize, j: usize| {
            let (p, q, r, s) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
            h[p][r].fused(h[q][s], -(h[p][s] * h[q][r]))
        };
        let cof_h = [
            [minor(0, 0), minor(0, 1), minor(0, 2)],
            [minor(1, 0), minor(1, 1), minor(1, 2)],
            [minor(2, 0), minor(2, 1), minor(2, 2)],
        ];
        let trace = h[0][0] + h[1][1] + h[2][2];
        Self { h, cof_h, trace, invariants }
    }

    /// Deformation of the elements from place `first` of a tile on; zero if the tile has nodes out of range.
    #[inline(always)]
    pub(crate) fn of_tile(tile: &ElementTile, first: usize, displacement: Gather<'_>) -> Self {
        let nodes = tile.nodes_below::<R>(displacement.count()).unwrap_or(TileNodes::ALL_ZERO);
        let at = |corner: usize| displacement.read_nodes::<R, 4>(&nodes, corner, first);
        Self::of_edges(tile, first, edges([at(0), at(1), at(2), at(3)]))
    }

    /// From the displacements of three corners relative to the first one.
    #[inline(always)]
    pub(super) fn of_edges(tile: &ElementTile, first: usize, edges: [Vector<R>; 3]) -> Self {
        let mut h = [[R::splat(0.0); 3]; 3];
        for (corner, along) in edges.into_iter().enumerate() {
            for j in 0..3 {
                let gradient = tile.gradient::<R>(corner, j, first);
                for i in 0..3 {
                    // Not fused: in ill-conditioned states this lowers the error of the forces by a fifth.
                    h[i][j] = h[i][j] + along[i] * gradient;
                }
            }
        }
        Self::new(h)
    }

    /// `F - cof F = H + H^T - tr H I - cof H`.
    #[inline(always)]
    pub(crate) fn distortion(&self, i: usize, j: usize) -> R {
        let (i, j) = (i % 3, j % 3);
        let sum = self.h[i][j] + self.h[j][i] - self.cof_h[i][j];
        if i == j { sum - self.trace } else { sum }
    }

    /// `cof F = (1 + tr H) I - H^T + cof H`.
    #[inline(always)]
    pub(crate) fn cofactor(&self, i: usize, j: usize) -> R {
        let (i, j) = (i % 3, j % 3);
        let rest = self.cof_h[i][j] - self.h[j][i];
        if i == j { rest + (R::splat(1.0) + self.trace) } else { rest }
    }

    /// `cof F - I`, to full relative accuracy.
    #[inline(always)]
    pub(super) fn cofactor_change(&self, i: usize, j: usize) -> R {
        let (i, j) = (i % 3, j % 3);
        let rest = self.cof_h[i][j] - self.h[j][i];
        if i == j { rest + self.trace } else { rest }
    }

    /// `F F^T`.
    #[inline(always)]
    pub(super) fn left_cauchy_green(&self) -> Symmetric<R> {
        let one = R::splat(1.0);
        let [[a, b, c], [d, e, f], [g, h, i]] = self.h;
        let rows = [[one + a, b, c], [d, one + e, f], [g, h, one + i]];
        let product = |i: usize, j: usize| dot(rows[i], rows[j]);
        Symmetric {
            xx: product(0, 0),
            yy: product(1, 1),
            zz: product(2, 2),
            xy: product(0, 1),
            yz: product(1, 2),
            zx: product(2, 0),
        }
    }

    /// First Piola-Kirchhoff stress `p1 (F - cof F) + s cof F`, Pa.
    #[inline(always)]
    pub(crate) fn stress(&self, p1: R, s: R) -> Matrix<R> {
        // Loops, because the compiler may leave closures over vectors as function calls.
        let mut stress = [[p1; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                stress[i][j] = p1.fused(self.distortion(i, j), s * self.cofactor(i, j));
            }
        }
        stress
    }
}
