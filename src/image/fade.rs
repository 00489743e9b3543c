//! How far cells are from the tissue, and what is left of a field there. The squared distance to the nearest known cell
//! is a minimum along one axis after the other (Felzenszwalb & Huttenlocher 2012); cells of at most an eighth of the reach
//! need few neighbours to either side. Distances count from the cell next to a known one, so that nothing is lost between
//! the tissue and there: the field would jump from one point of a fine grid to the next.

use super::pyramid::Level;
use crate::copy::copy;

/// Cells within a reach, and at most where one axis has longer cells than another.
const CELLS: f64 = 8.0;
const MOST_CELLS: f64 = 24.0;

/// Whether cells are at most an eighth of the reach (m) long, or no longer than those of the grid.
pub(super) fn is_fine_enough(level: &Level, grid: &Level, reach: f32) -> bool {
    (0..3).all(|axis| level.cell[axis] <= grid.cell[axis].max(f64::from(reach) / CELLS))
}

/// Writes for each cell what is left of the field there: 1 where it is known, 0 from the reach (m) on. `second` is scratch
/// of the same length.
pub(super) fn distances(level: &Level, known: &[[f32; 3]], reach: f32, kept: &mut [f32], second: &mut [f32]) {
    for (place, value) in kept.iter_mut().zip(known) {
        *place = if value[0].is_nan() { f32::INFINITY } else { 0.0 };
    }
    let [x, y, _] = level.size;
    let mut stride = 1;
    for (axis, next) in [x, y, 1].into_iter().enumerate() {
        copy(second, kept);
        let (size, cell) = (level.size[axis], level.cell[axis]);
        let window = (f64::from(reach) / cell).min(MOST_CELLS) as usize + 1;
        let length = (size * stride).max(1);
        for (to, from) in kept.chunks_exact_mut(length).zip(second.chunks_exact(length)) {
            for step in 1..=window.min(size.saturating_sub(1)) {
                let way = (step as f64 * cell) as f32;
                nearer(to, from, step * stride, way * way);
            }
        }
        stride *= next;
    }
    let long = (0..3).filter(|&axis| level.size[axis] > 1);
    let next = long.map(|axis| level.cell[axis]).fold(0.0, f64::max) as f32;
    let over = 1.0 / (reach - next).max(f32::MIN_POSITIVE);
    for place in kept {
        let share = over * (libm::sqrtf(*place) - next).max(0.0);
        let left = (1.0 - share * share).max(0.0);
        *place = left * left;
    }
}

/// Cells `shift` places apart hear of each other's distance, and `more`, m^2.
fn nearer(to: &mut [f32], from: &[f32], shift: usize, more: f32) {
    for (to, from) in to.iter_mut().skip(shift).zip(from) {
        *to = to.min(from + more);
    }
    for (to, from) in to.iter_mut().zip(from.iter().skip(shift)) {
        *to = to.min(from + more);
    }
}

/// Distances of a coarse level, for the points of the grid.
pub(super) struct Fade<'a> {
    level: Level,
    /// Places of the level for one of the grid, along each axis.
    scale: [f32; 3],
    kept: &'a [f32],
}

impl<'a> Fade<'a> {
    pub(super) fn new(level: &Level, grid: &Level, kept: &'a [f32]) -> Self {
        let scale = core::array::from_fn(|axis| (grid.cell[axis] / level.cell[axis]) as f32);
        Self { level: *level, scale, kept }
    }

    /// The two cells around a point of the grid, and how far it is from the first to the second.
    fn around(&self, axis: usize, index: usize) -> (usize, usize, f32) {
        let at = ((index as f32 + 0.5) * self.scale[axis] - 0.5).max(0.0);
        let last = self.level.size[axis].saturating_sub(1);
        let first = (at as usize).min(last);
        (first, (first + 1).min(last), (at - first as f32).clamp(0.0, 1.0))
    }

    /// What is left at the points of a row.
    pub(super) fn row(&self, y: usize, z: usize, factors: &mut [f32]) {
        let [x_size, y_size, _] = self.level.size;
        let (y0, y1, of_y) = self.around(1, y);
        let (z0, z1, of_z) = self.around(2, z);
        let start = |y: usize, z: usize| (z * y_size + y) * x_size;
        let starts = [start(y0, z0), start(y1, z0), start(y0, z1), start(y1, z1)];
        let weights = [(1.0 - of_y) * (1.0 - of_z), of_y * (1.0 - of_z), (1.0 - of_y) * of_z, of_y * of_z];
        let at = |x: usize| {
            let rows = starts.into_iter().zip(weights);
            rows.map(|(start, weight)| weight * self.kept.get(start + x).copied().unwrap_or_default()).sum::<f32>()
        };
        // Neighbours share their cells.
        let (mut cell, mut ends) = (usize::MAX, [0.0; 2]);
        for (x, factor) in factors.iter_mut().enumerate() {
            let (x0, x1, of_x) = self.around(0, x);
            if x0 != cell {
                (cell, ends) = (x0, [at(x0), at(x1)]);
            }
            *factor = ends[0] + (ends[1] - ends[0]) * of_x;
        }
    }
}
