//! Sums into the dense matrices of a lattice: its tangent stiffness from the elements' bounds, its mass, and
//! the scaled inertia seen through its functions.
//!
//! ```text
//! Kc = sum_e V [ iso grad phi_c . grad phi_d I + volume (C grad phi_c)(C grad phi_d)^T ]
//! Mc = sum_a m w_c w_d I,     G = sum_a w_c w_d (N_a + reserve m I)
//! ```
//! with the gradients of the interpolated functions, `grad phi_c = sum_a w_c(a) ga`, so that `Kc` is exactly
//! `W^T K W` for the elements' bounds. At a node that is held along some axes a function has
//! one gradient for each axis.

use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS};
use crate::scene::NodeInertia;
use crate::symmetric::Symmetric;

/// One element as the assembly sees it.
pub(super) struct Element {
    pub(super) nodes: [usize; 4],
    pub(super) gradients: [[f32; 3]; 4],
    /// `V iso` and `V volume`, N m.
    pub(super) iso: f32,
    pub(super) volume: f32,
    /// Columns of `C`, padded.
    pub(super) cofactor: [[f32; 4]; 3],
}

/// A dense matrix to add to; only blocks on and below the diagonal are written.
pub(super) struct Assembly<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) nodes: &'a [LatticeNode],
    pub(super) inertia: &'a [NodeInertia],
    pub(super) matrix: &'a mut [f32],
    pub(super) stride: usize,
}

/// Functions that four nodes can touch.
const TOUCHED: usize = 32;
const NOT_TOUCHED: u8 = u8::MAX;

#[inline(always)]
pub(super) fn free(inverse: [f32; 3]) -> [f32; 4] {
    let [x, y, z] = inverse.map(|inverse| if inverse > 0.0 { 1.0 } else { 0.0 });
    [x, y, z, 0.0]
}

#[inline(always)]
fn add_scaled(sum: &mut [f32; 4], vector: [f32; 4], factor: f32) {
    for (sum, value) in sum.iter_mut().zip(vector) {
        *sum += factor * value;
    }
}

/// Adds a 3 x 3 block, its rows padded to four, where function `c` meets function `d`.
#[inline(always)]
fn add_block(matrix: &mut [f32], stride: usize, c: usize, d: usize, rows: [[f32; 4]; 3]) {
    let Some(rest) = matrix.get_mut(3 * c * stride..) else {
        return;
    };
    for (row, values) in rest.chunks_exact_mut(stride).zip(rows) {
        if let Some(place) = row.get_mut(3 * d..3 * d + 4) {
            for (entry, value) in place.iter_mut().zip(values) {
                *entry += value;
            }
        }
    }
}

impl Assembly<'_> {
    /// Adds the stiffness bound of an element.
    #[inline(always)]
    pub(super) fn add_element(&mut self, element: &Element) {
        let mut slot = [NOT_TOUCHED; MAX_FUNCTIONS + 1];
        let mut functions = [0usize; TOUCHED];
        // Derivative along each material axis; the four lanes are the spatial axes.
        let mut slopes = [[[0.0f32; 4]; 3]; TOUCHED];
        let mut count = 0;
        for (&node, gradient) in element.nodes.iter().zip(element.gradients) {
            let (Some(at), Some(inertia)) = (self.nodes.get(node), self.inertia.get(node)) else {
                continue;
            };
            let free = free(inertia.inverse);
            let along = gradient.map(|slope| free.map(|free| free * slope));
            for (function, weight) in self.lattice.weights(at) {
                if function >= MAX_FUNCTIONS || weight == 0.0 {
                    continue;
                }
                let Some(slot) = slot.get_mut(function) else {
                    continue;
                };
                if *slot == NOT_TOUCHED && count < TOUCHED {
                    *slot = count as u8;
                    functions[count] = function;
                    count += 1;
                }
                if let Some(slopes) = slopes.get_mut(usize::from(*slot)) {
                    for (slopes, along) in slopes.iter_mut().zip(along) {
                        add_scaled(slopes, along, weight);
                    }
                }
            }
        }
        let mut images = [[0.0f32; 4]; TOUCHED];
        for (image, slopes) in images.iter_mut().zip(&slopes).take(count) {
            for (column, slope) in element.cofactor.iter().zip(slopes) {
                for axis in 0..4 {
                    image[axis] += column[axis] * slope[axis];
                }
            }
        }
        let touched = functions.iter().zip(slopes.iter().zip(&images)).take(count);
        for (&c, (slopes_c, image_c)) in touched.clone() {
            let (iso, volume) =
                (slopes_c.map(|s| s.map(|s| element.iso * s)), image_c.map(|a| element.volume * a));
            for (&d, (slopes_d, image_d)) in touched.clone() {
                if d > c {
                    continue;
                }
                let mut rows = [[0.0f32; 4]; 3];
                for (row, &factor) in rows.iter_mut().zip(&volume) {
                    add_scaled(row, *image_d, factor);
                }
                let mut diagonal = [0.0f32; 4];
                for (iso, slope) in iso.iter().zip(slopes_d) {
                    for axis in 0..4 {
                        diagonal[axis] += iso[axis] * slope[axis];
                    }
                }
                for axis in 0..3 {
                    rows[axis][axis] += diagonal[axis];
                }
                add_block(self.matrix, self.stride, c, d, rows);
            }
        }
    }

    /// Adds a node's inertia (kg, zero rows at held axes).
    #[inline(always)]
    pub(super) fn add_node(&mut self, node: &LatticeNode, inertia: &Symmetric) {
        let rows = [
            [inertia.xx, inertia.xy, inertia.zx, 0.0],
            [inertia.xy, inertia.yy, inertia.yz, 0.0],
            [inertia.zx, inertia.yz, inertia.zz, 0.0],
        ];
        let weights = self.lattice.weights(node);
        for (c, weight_c) in weights {
            if c >= MAX_FUNCTIONS || weight_c == 0.0 {
                continue;
            }
            for (d, weight_d) in weights {
                if d <= c {
                    let rows = rows.map(|row| row.map(|entry| weight_c * weight_d * entry));
                    add_block(self.matrix, self.stride, c, d, rows);
                }
            }
        }
    }
}
