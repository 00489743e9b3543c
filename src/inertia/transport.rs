//! The change of velocity that rotation alone brings. The inertia `A = S - M` that a step adds to the lattice resists
//! changes of the strain rate. Measured in the world it would also resist the rotation of velocities with the tissue:
//! a body that turns by an angle `theta` in a step would have to expand by about `theta^2` until its stress turns the
//! velocities, and gain energy where `theta` changes. So the lattice's motion is
//!
//! ```text
//! S (c+ - c - w) = g - M w,   w_b - w_a = (R - 1) (c_b - c_a) for each edge of the lattice, by least squares
//! ```
//! with the lattice's part `c` of the last increment (m) and the rotation `R` of the tissue in that step. For a rigid
//! rotation `c + w` is the exact next increment. `A` is zero for translations and rotations, so `w` changes no
//! momentum. Every edge counts with the square of its inverse length; the least squares are a constant matrix. Where
//! nodes are held `A` resists translations too, so there `w` is kept at zero: a body that swings about a hinge turns
//! about it, not about its centre.

use glam::{Mat3, Vec3, Vec4};

use super::band::{Band, Row, factorise, solve};
use super::frames::Frames;
use super::lattice::{CoarseVectors, Lattice, MAX_FUNCTIONS};
use crate::simd::NodeVector;

/// Added to the diagonal, so that the matrix of a body without supports can be inverted: a translation of `w` is of no
/// consequence.
const ANCHOR: f32 = 1e-3;

/// The same for each held node of a function, as a share of all.
const HOLD: f32 = 10.0;

/// Computes the factor of the matrix of the least squares, with one unknown a function. Gives whether it could be
/// factorised. `held` are the shares of the functions' nodes that are held.
pub(super) fn factorise_edges(
    band: &Band,
    matrix: &mut [f32],
    scratch: &mut [f32],
    lattice: &Lattice,
    held: &[f32; MAX_FUNCTIONS],
) -> bool {
    band.clear(matrix);
    let mut add = |row: usize, column: usize, value: f32| {
        if let Some(entry) = matrix.get_mut(band.at(row, column)).filter(|_| row < MAX_FUNCTIONS) {
            *entry += value;
        }
    };
    lattice.for_each_edge(|a, b, weight| {
        let anchor = |function: usize| ANCHOR + HOLD * held.get(function).copied().unwrap_or(0.0);
        add(a, a, weight * (1.0 + anchor(a)));
        add(b, b, weight * (1.0 + anchor(b)));
        if a < MAX_FUNCTIONS && b < MAX_FUNCTIONS {
            add(a.max(b), a.min(b), -weight);
        }
    });
    factorise(band, matrix, scratch)
}

/// `w` from the lattice's part `c` of the last increment, m.
pub(super) fn turned_part(
    c: &CoarseVectors,
    lattice: &Lattice,
    frames: &Frames<'_>,
    band: &Band,
    factor: &[f32],
) -> CoarseVectors {
    let mut sums = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
    let at = |function: usize| c.get(function).map_or(Vec3::ZERO, |c| Vec4::from(c.0).truncate());
    lattice.for_each_edge(|a, b, weight| {
        let turns: [Mat3; 2] = [if a < MAX_FUNCTIONS { a } else { b }, if b < MAX_FUNCTIONS { b } else { a }]
            .map(|function| frames.in_latest_step(function));
        let difference = at(b) - at(a);
        let turned = 0.5 * (turns[0] * difference + turns[1] * difference) - difference;
        for (function, sign) in [(a, -weight), (b, weight)] {
            if let Some(sum) = sums.get_mut(function) {
                sum.0 = (Vec4::from(sum.0) + (sign * turned).extend(0.0)).to_array();
            }
        }
    });
    let mut rows: [Row; 3] = [[0.0; _]; 3];
    for (axis, row) in rows.iter_mut().enumerate() {
        row.iter_mut().zip(&sums).take(lattice.functions()).for_each(|(value, sum)| *value = sum.0[axis]);
    }
    let [x, y, z] = &mut rows;
    solve(band, factor, &mut [x, y, z]);
    let mut turned = [NodeVector::ZERO; _];
    for (function, turned) in turned.iter_mut().enumerate().take(lattice.functions()) {
        let at = |row: &Row| row.get(function).copied().unwrap_or_default();
        *turned = NodeVector([at(&rows[0]), at(&rows[1]), at(&rows[2]), 0.0]);
    }
    lattice.expand(&mut turned);
    turned
}
