//! Bound of the stiffness against changes of the nodes' volumes, in 1/s^2 (mass-weighted), for the critical step of
//! tetrahedra with nodal pressure of one tissue. It takes the place of the volume term of [`super::critical_bounds`],
//! which bounds the nodes' volumes by those of the elements and loses what their mean softens.
//!
//! ```text
//! V_a dJ_a = sum_b w_ab . v_b,   w_ab = sum_{e with a, b} V_e / 4 C_e g_b       C = cof F, g_b the gradient at b
//! (V_a dJ_a)^2 <= S_a sum_b (w_ab . v_b)^2 / (|w_ab| x_b),   S_a = sum_b |w_ab| x_b       Cauchy-Schwarz, any x_b > 0
//! k sum_a V_a (dJ_a)^2 <= sum_b v_b . D_b v_b,   D_b = sum_a k_a w_ab w_ab^T / (|w_ab| x_b),   k_a = k S_a / V_a
//! ```
//! `w_aa` is summed over the elements first: inside a tissue it is zero, as a node alone does not change the volume
//! around it. The others are taken element by element, which is again Cauchy-Schwarz. Weights `x_b` that are smaller
//! where `D_b` is small balance the nodes and make the bound closer; [`crate::tled::critical_step`] chooses them.

use crate::simd::{Gather, Kernel, NodeVector, Real, Scatter, ScatterBuffer, TILE, dispatch};

use super::critical_bounds::{Image, NodeMatrices, mass_weighted_gradients};
use super::deformation::Deformation;
use super::symmetric::Symmetric;
use super::{ElementTile, NodeInertia};

/// Least weight of a node over the largest: a node that hardly moves says little about the others.
const LEAST_WEIGHT: f32 = 0.1;

/// What a pass over the elements adds to the nodes.
#[derive(Clone, Copy)]
enum Pass {
    /// `w_aa`, and `S_a` without it.
    Sums,
    /// `D_b` without the part of `w_bb`.
    Matrices,
}

/// The bound over all elements. A row of a node holds its weight `x`, `k_a`, its volume (m^3), and `J - 1`.
pub(crate) struct NodalVolumeBounds<'a> {
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) inertia: &'a [NodeInertia],
    pub(crate) rows: &'a mut [NodeVector],
}

impl NodalVolumeBounds<'_> {
    /// All weights one, from the rows of [`super::NodalVolumes`].
    pub(crate) fn start(&mut self) {
        for row in &mut *self.rows {
            row.0 = [1.0, 0.0, 0.0, row.0[3]];
        }
        for tile in self.tiles {
            for lane in 0..TILE {
                for corner in 0..4 {
                    if let Some(row) = self.rows.get_mut(tile.node(corner, lane)) {
                        row.0[2] += 0.25 * tile.volume::<f32>(lane);
                    }
                }
            }
        }
    }

    /// Adds `D` to matrices that are zero. `bulk` is the bulk modulus, Pa.
    pub(crate) fn add(&mut self, sums: &mut NodeMatrices<'_>, bulk: f32) {
        self.pass(Pass::Sums, sums);
        for (node, row) in self.rows.iter_mut().enumerate() {
            let [x, y, z, others] = sums.xx_yy_zz_xy.get(node).copied().unwrap_or_default().0;
            let length = libm::sqrtf(x * x + y * y + z * z);
            let [weight, _, volume, _] = row.0;
            // A node of no element that takes part has none.
            let per_volume = if volume > 0.0 { 1.0 / volume } else { 0.0 };
            let k = bulk * (others + length * weight) * per_volume;
            row.0[1] = k;
            // The gradient of the node's own volume.
            let own = if length > 0.0 { k / length / weight } else { 0.0 };
            let matrix = Symmetric { xx: x * x, yy: y * y, zz: z * z, xy: x * y, yz: y * z, zx: z * x };
            sums.set(node, matrix.scaled(own));
        }
        self.pass(Pass::Matrices, sums);
    }

    #[inline(never)]
    fn pass(&self, pass: Pass, sums: &mut NodeMatrices<'_>) {
        dispatch(OnePass { pass, tiles: self.tiles, inertia: self.inertia, rows: self.rows, sums });
    }
}

/// Weighs a node by the largest eigenvalue of its matrix; weights are the first numbers of the nodes' rows.
pub(crate) fn weigh(rows: &mut [NodeVector], node: usize, rate: f32) {
    if let Some(row) = rows.get_mut(node) {
        row.0[0] *= rate;
    }
}

/// Divides the weights by the largest eigenvalue.
pub(crate) fn balance(rows: &mut [NodeVector], largest: f32) {
    for row in rows {
        let share = row.0[0] / largest;
        // Not a number where nothing moves.
        row.0[0] = if share > LEAST_WEIGHT { share.min(1.0) } else { LEAST_WEIGHT };
    }
}

struct OnePass<'a, 'b> {
    pass: Pass,
    tiles: &'a [ElementTile],
    inertia: &'a [NodeInertia],
    rows: &'a [NodeVector],
    sums: &'a mut NodeMatrices<'b>,
}

impl Kernel for OnePass<'_, '_> {
    type Output = ();

    const SELDOM: bool = true;
    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        // The first three components of a node's inertia are its inverse masses.
        let inertia = Gather::new(bytemuck::must_cast_slice(self.inertia));
        let rows = Gather::new(self.rows);
        for tile in self.tiles {
            let mut buffer = [ScatterBuffer::NONE; 3];
            for first in (0..TILE).step_by(R::COUNT) {
                add_elements::<R>(self.pass, tile, first, (inertia, rows), self.sums, &mut buffer);
            }
        }
    }
}

#[inline(always)]
fn add_elements<R: Real>(
    pass: Pass,
    tile: &ElementTile,
    first: usize,
    (inertia, rows): (Gather<'_>, Gather<'_>),
    sums: &mut NodeMatrices<'_>,
    buffers: &mut [ScatterBuffer<4>; 3],
) {
    let displacement = Gather::new(sums.zx_in_padding);
    let Some(nodes) = tile.nodes_below::<R>(displacement.count().min(rows.count())) else {
        return;
    };
    let deformation = Deformation::<R>::of_tile(tile, first, displacement);
    let (gradients, root) = mass_weighted_gradients(tile, first, &nodes, inertia);
    let quarter = R::splat(0.25) * root;
    let [g0, g1, g2, g3] = gradients;
    let images = [
        Image::of_cofactor(&deformation, g0),
        Image::of_cofactor(&deformation, g1),
        Image::of_cofactor(&deformation, g2),
        Image::of_cofactor(&deformation, g3),
    ];
    let zero = R::splat(0.0);
    let (mut lengths, mut weights, mut factors) = ([zero; 4], [zero; 4], [zero; 4]);
    for corner in 0..4 {
        let [weight, k, _] = rows.read_nodes::<R, 4>(&nodes, corner, first);
        lengths[corner] = quarter * images[corner].length * weight;
        (weights[corner], factors[corner]) = (weight, k);
    }
    match pass {
        Pass::Sums => {
            let mut added = [[zero; 4]; 4];
            for corner in 0..4 {
                let [x, y, z] = images[corner].vector;
                added[corner] = [quarter * x, quarter * y, quarter * z, of_others(lengths, corner)];
            }
            Scatter::new(sums.xx_yy_zz_xy).add_corners(&nodes, first, added, &mut buffers[0]);
        }
        Pass::Matrices => {
            let mut matrices = [Symmetric { xx: zero, yy: zero, zz: zero, xy: zero, yz: zero, zx: zero }; 4];
            for corner in 0..4 {
                let weight = (quarter * of_others(factors, corner)).divide(weights[corner]);
                matrices[corner] = images[corner].matrix(weight);
            }
            sums.add_corners(&nodes, first, matrices, buffers);
        }
    }
}

/// The sum over the other corners. Less the own of the sum over all would lose digits where one is far larger.
#[inline(always)]
fn of_others<R: Real>(values: [R; 4], corner: usize) -> R {
    let mut sum = R::splat(0.0);
    for (other, value) in values.into_iter().enumerate() {
        if other != corner {
            sum = sum + value;
        }
    }
    sum
}
