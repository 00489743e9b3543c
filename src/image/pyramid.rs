//! A pyramid of grids, each of which has half as many cells along some axes as the one below, by which values go on to
//! where there are none (push and pull). What is not known is NaN in its first component.

use super::ImageGrid;
use super::fade::{self, Fade};

/// One axis at least is halved a level: of 2^31 points 34 times at most.
const MOST_LEVELS: usize = 36;
/// Axes whose cells are at most so much longer than the shortest are halved: cells become alike.
const ALIKE: f64 = 1.5;
/// Of a value in a sum of eight, which so never overflows.
const SHARE: f32 = 0.125;

/// A grid of the pyramid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    pub(super) size: [usize; 3],
    /// Of a cell, m.
    pub(super) cell: [f64; 3],
    /// Whether a cell has two of the level below along an axis.
    halved: [bool; 3],
}

impl Level {
    pub(super) fn cells(&self) -> usize {
        self.size.iter().product()
    }

    /// The next coarser one; none above a single cell.
    fn above(&self) -> Option<Self> {
        let long = (0..3).filter(|&axis| self.size[axis] > 1);
        let shortest = long.map(|axis| self.cell[axis]).fold(f64::INFINITY, f64::min);
        let halved: [bool; 3] = core::array::from_fn(|axis| self.size[axis] > 1 && self.cell[axis] <= ALIKE * shortest);
        let half = |axis: usize| if halved[axis] { 2 } else { 1 };
        let size = core::array::from_fn(|axis| self.size[axis].div_ceil(half(axis)));
        let cell = core::array::from_fn(|axis| self.cell[axis] * half(axis) as f64);
        halved.contains(&true).then_some(Self { size, cell, halved })
    }
}

pub(super) struct Pyramid {
    /// The grid itself first.
    levels: heapless::Vec<Level, MOST_LEVELS>,
    reach: f32,
    /// The level on which distances from the tissue are found.
    fading: usize,
}

impl Pyramid {
    /// Of a grid and a reach that were checked.
    pub(super) fn of(grid: &ImageGrid, reach: f32) -> Self {
        let mut levels = heapless::Vec::new();
        let mut next = Some(Level { size: grid.sizes(), cell: grid.spacing, halved: [false; 3] });
        while let Some(level) = next {
            next = level.above();
            // There is room.
            let _ = levels.push(level);
        }
        let fine = levels
            .first()
            .map_or(0, |grid| levels.iter().take_while(|level| fade::is_fine_enough(level, grid, reach)).count());
        let fading = fine.saturating_sub(1);
        Self { levels, reach, fading }
    }

    fn level(&self, number: usize) -> Level {
        self.levels.get(number).copied().unwrap_or(Level { size: [0; 3], cell: [1.0; 3], halved: [false; 3] })
    }

    /// Numbers of scratch: the levels above the grid, a row of a level, distances.
    pub(super) fn words(&self) -> usize {
        let coarse = self.levels.iter().skip(1).map(|level| 3 * level.cells());
        let [row, _, _] = self.level(0).size;
        coarse.sum::<usize>() + 3 * row + if self.reach > 0.0 { 2 * self.level(self.fading).cells() + row } else { 0 }
    }

    /// Continues what is known, one point at least, to all points.
    pub(super) fn fill(&self, out: &mut [[f32; 3]], scratch: &mut [f32]) {
        let [row_length, _, _] = self.level(0).size;
        let (row, scratch) = split(scratch, 3 * row_length);
        let (row, _) = row.as_chunks_mut();
        let fading = self.level(self.fading);
        let (kept, scratch) = split(scratch, if self.reach > 0.0 { fading.cells() } else { 0 });
        let (second, scratch) = split(scratch, kept.len());
        let (fade_row, scratch) = split(scratch, if self.reach > 0.0 { row_length } else { 0 });
        let (coarse, _) = scratch.as_chunks_mut();
        self.push(out, coarse, row);
        if self.reach > 0.0 {
            let known = if self.fading == 0 { &*out } else { self.coarse(self.fading, coarse) };
            fade::distances(&fading, known, self.reach, kept, second);
        }
        let mut fade = (self.reach > 0.0).then(|| (Fade::new(&fading, &self.level(0), kept), fade_row));
        // From the coarsest level down.
        for number in (1..self.levels.len()).rev() {
            let (level, below) = (self.level(number), self.level(number - 1));
            let (finer, from) = coarse.split_at_mut_checked(self.start(number)).unwrap_or_default();
            if number > 1 {
                pull(&level, from, &below, finer.get_mut(self.start(number - 1)..).unwrap_or_default(), row, None);
            } else {
                pull(&level, from, &below, out, row, fade.as_mut());
            }
        }
    }

    /// Where a level begins in the memory of the coarse ones.
    fn start(&self, number: usize) -> usize {
        self.levels.iter().take(number).skip(1).map(Level::cells).sum()
    }

    fn coarse<'a>(&self, number: usize, coarse: &'a [[f32; 3]]) -> &'a [[f32; 3]] {
        coarse.get(self.start(number)..).unwrap_or_default()
    }

    /// Means of what is known, level by level.
    fn push(&self, out: &[[f32; 3]], coarse: &mut [[f32; 3]], row: &mut [[f32; 3]]) {
        for number in 1..self.levels.len() {
            let (level, below) = (self.level(number), self.level(number - 1));
            let (finer, to) = coarse.split_at_mut_checked(self.start(number)).unwrap_or_default();
            let finer = if number == 1 { out } else { self.coarse(number - 1, finer) };
            push(&below, finer, &level, to, row);
        }
    }
}

fn split(memory: &mut [f32], count: usize) -> (&mut [f32], &mut [f32]) {
    memory.split_at_mut_checked(count).unwrap_or_default()
}

/// Cells of the level below that a cell has along an axis.
fn children(level: &Level, below: &Level, axis: usize, index: usize) -> core::ops::Range<usize> {
    let per = if level.halved[axis] { 2 } else { 1 };
    per * index..(per * index + per).min(below.size[axis])
}

/// The mean of the known ones of the cells below each cell. `counts` has room for a row.
fn push(below: &Level, from: &[[f32; 3]], level: &Level, to: &mut [[f32; 3]], counts: &mut [[f32; 3]]) {
    let [x_size, y_size, z_size] = level.size;
    let [x_below, y_below, _] = below.size;
    let per = if level.halved[0] { 2 } else { 1 };
    for (number, row) in to.chunks_exact_mut(x_size.max(1)).take(y_size * z_size).enumerate() {
        let (y, z) = (number % y_size.max(1), number / y_size.max(1));
        row.fill([0.0; 3]);
        counts.fill([0.0; 3]);
        for z in children(level, below, 2, z) {
            for y in children(level, below, 1, y) {
                let start = (z * y_below + y) * x_below;
                let finer = from.get(start..start + x_below).unwrap_or_default();
                if finer.iter().all(|value| value[0].is_nan()) {
                    continue;
                }
                for ((sum, count), values) in row.iter_mut().zip(&mut *counts).zip(finer.chunks(per)) {
                    for value in values.iter().filter(|value| !value[0].is_nan()) {
                        count[0] += SHARE;
                        for axis in 0..3 {
                            sum[axis] += SHARE * value[axis];
                        }
                    }
                }
            }
        }
        for (mean, [count, ..]) in row.iter_mut().zip(&*counts) {
            // 0 / 0 is not known.
            *mean = mean.map(|sum| sum / count);
        }
    }
}

/// The cell above an index, and the nearer one of its neighbours, with their weights: linear between the middles of
/// cells.
fn parents(level: &Level, axis: usize, index: usize) -> [(usize, f32); 2] {
    if !level.halved[axis] {
        return [(index, 1.0), (index, 0.0)];
    }
    let above = index / 2;
    let next = if index.is_multiple_of(2) { above.saturating_sub(1) } else { (above + 1).min(level.size[axis] - 1) };
    [(above, 0.75), (next, 0.25)]
}

/// Interpolates what is not known from the level above, and lets it fade if there is a reach.
fn pull(
    level: &Level,
    from: &[[f32; 3]],
    below: &Level,
    to: &mut [[f32; 3]],
    row: &mut [[f32; 3]],
    mut fade: Option<&mut (Fade<'_>, &mut [f32])>,
) {
    let [x_above, y_above, _] = level.size;
    let [x_size, y_size, z_size] = below.size;
    for (number, finer) in to.chunks_exact_mut(x_size.max(1)).take(y_size * z_size).enumerate() {
        if !finer.iter().any(|value| value[0].is_nan()) {
            continue;
        }
        let (y, z) = (number % y_size.max(1), number / y_size.max(1));
        let mixed = row.get_mut(..x_above).unwrap_or_default();
        let rows = parents(level, 2, z).map(|(z, of_z)| {
            parents(level, 1, y).map(|(y, of_y)| {
                let start = (z * y_above + y) * x_above;
                (from.get(start..start + x_above).unwrap_or_default(), of_z * of_y)
            })
        });
        let [[(a, of_a), (b, of_b)], [(c, of_c), (d, of_d)]] = rows;
        let values = a.iter().zip(b).zip(c.iter().zip(d));
        for (mixed, ((a, b), (c, d))) in mixed.iter_mut().zip(values) {
            for axis in 0..3 {
                mixed[axis] = of_a * a[axis] + of_b * b[axis] + of_c * c[axis] + of_d * d[axis];
            }
        }
        match &mut fade {
            None => spread(level, mixed, finer, |_| 1.0),
            Some((fade, factors)) => {
                fade.row(y, z, factors);
                spread(level, mixed, finer, |x| factors.get(x).copied().unwrap_or_default());
            }
        }
    }
}

/// A row of the level above, times a factor, to those of the level below that are not known.
fn spread(level: &Level, mixed: &[[f32; 3]], finer: &mut [[f32; 3]], factor: impl Fn(usize) -> f32) {
    for (x, value) in finer.iter_mut().enumerate() {
        if value[0].is_nan() {
            let [(above, most), (next, rest)] = parents(level, 0, x);
            let [above, next] = [above, next].map(|x| mixed.get(x).copied().unwrap_or_default());
            let factor = factor(x);
            for axis in 0..3 {
                value[axis] = (most * above[axis] + rest * next[axis]) * factor;
            }
        }
    }
}
