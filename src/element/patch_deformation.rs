//! Mean displacement gradients of patches ([`super::patch`]), and the lengths of the gradients `c_ab` of their nodes.

use crate::simd::{Gather, Piece, Real, TileNodes, dot};

use super::deformation::{Deformation, Matrix, Vector};
use super::patch::{Neighbours, PatchTile};
use super::tile::vector_at;

/// The displacement gradient of the patches from place `first` of a tile on, and `sum_b k_ab (u_b - u_a)`, from
/// displacements and what rounding has left out of them, or nothing.
#[inline(always)]
pub(super) fn gradient<R: Real>(
    tile: &PatchTile,
    neighbours: &[Neighbours],
    first: usize,
    [displacement, remainder]: [Gather<'_>; 2],
) -> (Matrix<R>, Vector<R>) {
    let zero = R::splat(0.0);
    let (mut h, mut pull) = ([[zero; 3]; 3], [zero; 3]);
    let Some(nodes) = tile.nodes_below::<R>(displacement.count()) else { return (h, pull) };
    let own = displacement.read_nodes::<R, 1>(&nodes, 0, first);
    let has_remainders = remainder.count() > 0;
    let own_remainder = if has_remainders { remainder.read_nodes::<R, 1>(&nodes, 0, first) } else { pull };
    for neighbour in neighbours {
        let nodes = neighbour.nodes_below::<R>(displacement.count()).unwrap_or(TileNodes::ALL_ZERO);
        let at = displacement.read_nodes::<R, 1>(&nodes, 0, first);
        let mut along = [at[0] - own[0], at[1] - own[1], at[2] - own[2]];
        if has_remainders {
            let at = remainder.read_nodes::<R, 1>(&nodes, 0, first);
            for axis in 0..3 {
                along[axis] = along[axis] + (at[axis] - own_remainder[axis]);
            }
        }
        let coupling = vector_at::<R>(&neighbour.couplings, first);
        for i in 0..3 {
            pull[i] = along[i].fused(coupling, pull[i]);
            for j in 0..3 {
                h[i][j] = along[i].fused(vector_at(&neighbour.gradients[j], first), h[i][j]);
            }
        }
    }
    let inverse = vector_at::<R>(&tile.inverse_volumes, first);
    for row in &mut h {
        *row = [row[0] * inverse, row[1] * inverse, row[2] * inverse];
    }
    (h, pull)
}

/// Deformations of the patches of a tile, a function of its own for all laws.
pub(super) struct PatchDeformations<'a, R, const PARTS: usize> {
    pub(super) tile: &'a PatchTile,
    pub(super) neighbours: &'a [Neighbours],
    pub(super) displacement: Gather<'a>,
    pub(super) deformations: &'a mut [Deformation<R>; PARTS],
}

impl<R: Real, const PARTS: usize> Piece for PatchDeformations<'_, R, PARTS> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { tile, neighbours, displacement, deformations } = self;
        for (part, deformation) in deformations.iter_mut().enumerate() {
            let (h, _) = gradient::<R>(tile, neighbours, part * R::COUNT, [displacement, Gather::new(&[])]);
            *deformation = Deformation::new(h);
        }
    }
}

/// Lengths of the gradients `c_ab` of a vector of patches.
#[derive(Clone, Copy)]
pub(super) struct GradientLengths<R> {
    /// Sum over the neighbours and the own node, and that of the own node, m^2.
    pub(super) sum: R,
    pub(super) own: R,
    /// `sum_b k_ab + |k_ab|`, m: with `s mu` a bound of the rows of the own node in the stabilising energy.
    pub(super) couplings: R,
}

impl<R: Real> GradientLengths<R> {
    /// Of the patches from place `first` of a tile on.
    #[inline(always)]
    pub(super) fn of(neighbours: &[Neighbours], first: usize) -> Self {
        let zero = R::splat(0.0);
        let (mut lengths, mut own) = (Self { sum: zero, own: zero, couplings: zero }, [zero; 3]);
        for neighbour in neighbours {
            let gradient = neighbour.gradient::<R>(first);
            lengths.sum = lengths.sum + dot(gradient, gradient).root();
            for axis in 0..3 {
                own[axis] = own[axis] - gradient[axis];
            }
            let coupling = vector_at::<R>(&neighbour.couplings, first);
            lengths.couplings = lengths.couplings + (coupling + coupling.abs());
        }
        lengths.own = dot(own, own).root();
        lengths.sum = lengths.sum + lengths.own;
        lengths
    }
}
