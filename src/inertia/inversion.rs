//! The inversion in place of a matrix of the lattice (kg), in pieces that steps share among them: the sweeps of
//! [`super::dense`], then one row after the other is mirrored. The inverse is sound if it takes the image of a known
//! vector back to it, and no inertia is out of proportion to its mass.

use super::dense::{PIVOTS, Row, apply, apply_lower, mirror, row_length, stride, sweep, sweeps};
use super::matrices::of_axes;

/// Measured cost of an entry of a row that is mirrored. The unit is the time of a floating-point operation of a pivot.
const ROW_COST: i64 = 12;

/// Largest ratio of inertia to mass for which a matrix is inverted. Elements that are crushed exceed it.
const LARGEST_RATIO: f32 = 1e6;

/// Largest relative error of a sound inverse.
const LARGEST_ERROR: f32 = 0.05;

/// A vector of ones with signs in no order that a mode of a body has (the last bits of a multiplicative generator).
static PROBE: Row = {
    let (mut probe, mut at, mut random) = ([1.0; _], 0, 1u32);
    while at < size_of::<Row>() / size_of::<f32>() {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        if random >> 31 == 1 {
            probe[at] = -1.0;
        }
        at += 1;
    }
    probe
};

/// The state of an inversion.
#[derive(Clone, Debug)]
pub(super) struct Inversion {
    /// The image of [`PROBE`] under the matrix.
    image: Row,
    /// Whether all inversions so far were accurate.
    pub(super) sound: bool,
}

impl Inversion {
    pub(super) const NEW: Self = Self { image: [0.0; _], sound: true };

    /// Cost of a whole inversion.
    pub(super) const fn cost(functions: usize) -> i64 {
        sweeps(3 * functions) as i64 * sweep_cost(functions) + 3 * functions as i64 * row_cost(functions)
    }

    /// A part of an inversion: a step of it, later one row. Gives its cost, and whether it was the last one.
    pub(super) fn advance(&mut self, matrix: &mut [f32], mass: &[f32], functions: usize, at: usize) -> (i64, bool) {
        let (size, stride) = (3 * functions, stride(functions));
        if at == 0 {
            self.start(matrix, mass, functions);
        }
        if at < sweeps(size) {
            self.sound &= sweep(matrix, size, stride, at);
            return (sweep_cost(functions), false);
        }
        let row = at - sweeps(size);
        mirror(matrix, stride, row, -1.0);
        let ended = row + 1 == size;
        if ended {
            self.sound &= self.is_accurate(matrix, size, stride);
        }
        (row_cost(functions), ended)
    }

    /// Computes the image of [`PROBE`]. Not inlined: the inversion does without its stack.
    #[inline(never)]
    fn start(&mut self, matrix: &[f32], mass: &[f32], functions: usize) {
        self.sound &= is_conditioned(matrix, mass, functions);
        self.image = apply_lower(matrix, stride(functions), probe(3 * functions));
    }

    /// Whether an inverse takes the image of [`PROBE`] back to it, except for rounding. Not inlined, as above.
    #[inline(never)]
    fn is_accurate(&self, inverse: &[f32], size: usize, stride: usize) -> bool {
        let mut back = [0.0; _];
        apply(inverse, stride, self.image.get(..size).unwrap_or_default(), &mut back);
        let errors = back.iter().zip(probe(size)).map(|(back, probe)| (back - probe) * (back - probe));
        errors.sum::<f32>() <= LARGEST_ERROR * LARGEST_ERROR * size as f32
    }
}

/// Whether the inertia of each unknown is at most [`LARGEST_RATIO`] times its mass, as far as single precision goes.
fn is_conditioned(inertia: &[f32], mass: &[f32], functions: usize) -> bool {
    let (stride, length) = (stride(functions), row_length(functions));
    (0..3).zip(of_axes(mass)).all(|(axis, mass)| {
        let masses = mass.iter().step_by(length + 1).take(functions);
        let inertia = inertia.iter().skip(axis * (stride + 1)).step_by(3 * (stride + 1));
        inertia.zip(masses).all(|(inertia, mass)| *inertia <= LARGEST_RATIO * mass)
    })
}

/// The first components of [`PROBE`].
fn probe(size: usize) -> &'static [f32] {
    PROBE.get(..size).unwrap_or_default()
}

/// Cost of a step of an inversion: a multiplication and an addition for each entry of the lower triangle and each
/// pivot.
const fn sweep_cost(functions: usize) -> i64 {
    (PIVOTS * 3 * functions * stride(functions)) as i64
}

/// Cost of a row that is mirrored.
const fn row_cost(functions: usize) -> i64 {
    ROW_COST * stride(functions) as i64
}
