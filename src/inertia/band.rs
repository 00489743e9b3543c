//! Symmetric positive definite matrices of a lattice, whose functions are numbered layer by layer along its longest
//! axis: entries lie in a band around the diagonal. Cholesky factors by panels of [`PANEL`] columns, and solutions with
//! them. Sums are taken in one order whatever the width of a vector.
//!
//! A row has the columns of its panel and those before it, of the lower triangle: see [`Band::at`]. A factor has in
//! place of each panel's own square the transposed inverse of the factor's square.

use crate::simd::{Kernel, Real, dispatch};

use super::lattice::{Lattice, MAX_FUNCTIONS};

/// Columns of a panel.
pub(super) const PANEL: usize = 16;

/// Most unknowns, rounded up to whole panels.
pub(super) const MOST_UNKNOWNS: usize = whole(3 * MAX_FUNCTIONS);

/// Most panels.
const MOST_PANELS: usize = MOST_UNKNOWNS / PANEL;

/// A vector of unknowns; those beyond the ones in use are zero.
pub(super) type Row = [f32; MOST_UNKNOWNS];

/// Rounded up to whole panels.
const fn whole(count: usize) -> usize {
    count.div_ceil(PANEL) * PANEL
}

/// The extent of a band.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    /// Unknowns, and columns in memory of each.
    size: usize,
    width: usize,
    /// For each panel of rows the first panel of columns with entries.
    starts: [u8; MOST_PANELS],
}

impl Band {
    pub(super) const NONE: Self = Self { size: 0, width: 0, starts: [0; MOST_PANELS] };

    /// That of `unknowns` for each function of a lattice.
    pub(super) fn new(lattice: &Lattice, unknowns: usize) -> Self {
        let mut lowest = [MAX_FUNCTIONS; MAX_FUNCTIONS];
        for cell in 0..lattice.cell_count() {
            let (numbers, mut least) = (lattice.functions_of(cell), MAX_FUNCTIONS);
            for number in numbers {
                lattice.each_function(number, |function, _| least = function.min(least));
            }
            for number in numbers {
                lattice.each_function(number, |function, _| {
                    if let Some(lowest) = lowest.get_mut(function) {
                        *lowest = least.min(*lowest);
                    }
                });
            }
        }
        let size = unknowns * lattice.functions();
        let mut band = Self { size, width: PANEL, starts: [u8::MAX; MOST_PANELS] };
        for (function, &lowest) in lowest.iter().enumerate().take(lattice.functions()) {
            let first = (unknowns * lowest.min(function) / PANEL) as u8;
            for panel in unknowns * function / PANEL..=(unknowns * (function + 1) - 1) / PANEL {
                if let Some(start) = band.starts.get_mut(panel) {
                    *start = first.min(*start);
                    band.width = band.width.max((panel + 1 - usize::from(*start)) * PANEL);
                }
            }
        }
        band
    }

    /// Floats of such a matrix for a lattice of these cells with this many functions, or more than that.
    pub(super) fn most_floats(cells: [u32; 3], functions: usize, unknowns: usize) -> usize {
        let [a, b, c] = cells.map(|count| (count as usize).saturating_add(1));
        // Four layers across the longest axis, where light points lie between, and whole panels at both ends.
        let layer = a.saturating_mul(b).min(b.saturating_mul(c)).min(a.saturating_mul(c));
        let size = whole(unknowns.saturating_mul(functions));
        size.saturating_mul(size.min(whole(unknowns.saturating_mul(layer.saturating_mul(4))) + PANEL))
    }

    /// Floats that [`factorise`] needs for so many functions with three unknowns, or more than that.
    pub(super) const fn most_scratch_floats(functions: usize) -> usize {
        whole(functions.saturating_mul(3)).saturating_mul(PANEL)
    }

    /// Floats of a matrix.
    pub(super) const fn floats(&self) -> usize {
        whole(self.size) * self.width
    }

    /// Floats that [`factorise`] needs.
    pub(super) const fn scratch_floats(&self) -> usize {
        self.width * PANEL
    }

    /// The entry of a row and a column of its band, not above the diagonal.
    #[inline(always)]
    pub(super) const fn at(&self, row: usize, column: usize) -> usize {
        row * self.width + (column + self.width).saturating_sub((row / PANEL + 1) * PANEL)
    }

    /// Sets a matrix to zero, and the diagonal beyond the unknowns to one.
    pub(super) fn clear(&self, matrix: &mut [f32]) {
        matrix.fill(0.0);
        for row in self.size..whole(self.size) {
            if let Some(entry) = matrix.get_mut(self.at(row, row)) {
                *entry = 1.0;
            }
        }
    }

    const fn panels(&self) -> usize {
        self.size.div_ceil(PANEL)
    }

    fn start(&self, panel: usize) -> usize {
        self.starts.get(panel).map_or(panel, |&start| usize::from(start).min(panel))
    }

    /// The columns `columns` of a row.
    #[inline(always)]
    fn columns<'a>(&self, matrix: &'a [f32], row: usize, from: usize, to: usize) -> &'a [f32] {
        matrix.get(self.at(row, from)..self.at(row, to)).unwrap_or_default()
    }
}

/// Replaces a matrix by its factor. Gives whether its pivots were positive and finite; if not, it is of no use.
pub(super) fn factorise(band: &Band, matrix: &mut [f32], scratch: &mut [f32]) -> bool {
    dispatch(Factorise { band, matrix, scratch })
}

struct Factorise<'a> {
    band: &'a Band,
    matrix: &'a mut [f32],
    /// The rows of a panel, transposed.
    scratch: &'a mut [f32],
}

/// A panel's part of a row.
type Part = [f32; PANEL];

/// Most vectors of a [`Part`].
const VECTORS: usize = PANEL / 4;

#[inline(always)]
fn read<R: Real>(part: &Part, vector: usize) -> R {
    R::from_fn(|lane| part[(vector * R::COUNT + lane) % PANEL])
}

#[inline(always)]
fn write<R: Real>(part: &mut Part, vector: usize, values: R) {
    for lane in 0..R::COUNT {
        part[(vector * R::COUNT + lane) % PANEL] = values.lane(lane);
    }
}

/// `L^-T` of a panel's square, for which `A = L L^T`; none if a pivot is not positive and finite.
#[inline(always)]
fn inverse_of_factor(mut square: [Part; PANEL]) -> Option<[Part; PANEL]> {
    let mut inverse = [[0.0; PANEL]; PANEL];
    for k in 0..PANEL {
        inverse[k][k] = 1.0;
    }
    for k in 0..PANEL {
        let (line, inverse_line) = (square[k], inverse[k]);
        let reciprocal = 1.0 / line[k];
        if !(reciprocal > 0.0 && reciprocal.is_finite()) {
            return None;
        }
        for m in k + 1..PANEL {
            let factor = square[m][k] * reciprocal;
            for column in 0..PANEL {
                square[m][column] -= factor * line[column];
                inverse[m][column] -= factor * inverse_line[column];
            }
        }
    }
    let mut transposed = [[0.0; PANEL]; PANEL];
    for m in 0..PANEL {
        let scale = 1.0 / libm::sqrtf(square[m][m]);
        for column in 0..=m {
            transposed[column][m] = scale * inverse[m][column];
        }
    }
    Some(transposed)
}

/// Rows whose sums are computed together.
const ROWS: usize = 4;

impl Factorise<'_> {
    /// `sum - sum_k row_k line_k` for some rows of a panel of rows, over the columns from `from` to `to`.
    #[inline(always)]
    fn subtract<R: Real>(&self, row: usize, [from, to]: [usize; 2], offset: usize, parts: &mut [Part; ROWS]) {
        let mut sums = [[R::splat(0.0); VECTORS]; ROWS];
        for r in 0..ROWS {
            for vector in 0..PANEL / R::COUNT {
                sums[r][vector % VECTORS] = read(&parts[r], vector);
            }
        }
        let lines = self.scratch.as_chunks::<PANEL>().0.get(from - offset..to - offset).unwrap_or_default();
        let mut rows = [&[][..]; ROWS];
        for (r, entries) in rows.iter_mut().enumerate() {
            *entries = self.band.columns(self.matrix, row + r, from, to).get(..lines.len()).unwrap_or_default();
        }
        let [a, b, c, d] = rows;
        for ((((line, &a), &b), &c), &d) in lines.iter().zip(a).zip(b).zip(c).zip(d) {
            for vector in 0..PANEL / R::COUNT {
                let line = read::<R>(line, vector);
                for (r, entry) in [a, b, c, d].into_iter().enumerate() {
                    let sum = &mut sums[r][vector % VECTORS];
                    *sum = R::splat(-entry).fused(line, *sum);
                }
            }
        }
        for r in 0..ROWS {
            for vector in 0..PANEL / R::COUNT {
                write(&mut parts[r], vector, sums[r][vector % VECTORS]);
            }
        }
    }

    /// Writes the rows of a panel before its own square, transposed.
    fn transpose(&mut self, first: usize, from: usize) {
        let Self { band, matrix, scratch } = self;
        for r in 0..PANEL {
            let entries = band.columns(matrix, first + r, from, first);
            for (line, &entry) in scratch.as_chunks_mut::<PANEL>().0.iter_mut().zip(entries) {
                line[r] = entry;
            }
        }
    }

    #[inline(always)]
    fn part(&self, row: usize, column: usize) -> Part {
        let entries = self.matrix.get(self.band.at(row, column)..).and_then(<[f32]>::first_chunk);
        entries.copied().unwrap_or_default()
    }

    #[inline(always)]
    fn set_part(&mut self, row: usize, column: usize, part: Part) {
        let at = self.band.at(row, column);
        if let Some(place) = self.matrix.get_mut(at..).and_then(<[f32]>::first_chunk_mut) {
            *place = part;
        }
    }
}

impl Kernel for Factorise<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<R: Real>(mut self) -> bool {
        let band = *self.band;
        for panel in 0..band.panels() {
            let (first, start) = (panel * PANEL, band.start(panel) * PANEL);
            self.transpose(first, start);
            let mut square = [[0.0; PANEL]; PANEL];
            for (group, parts) in square.as_chunks_mut::<ROWS>().0.iter_mut().enumerate() {
                let row = first + group * ROWS;
                for (r, part) in parts.iter_mut().enumerate() {
                    *part = self.part(row + r, first);
                }
                self.subtract::<R>(row, [start, first], start, parts);
            }
            for row in 0..PANEL {
                for column in row + 1..PANEL {
                    square[row][column] = square[column][row];
                }
            }
            let Some(inverse) = inverse_of_factor(square) else { return false };
            for (row, part) in inverse.into_iter().enumerate() {
                self.set_part(first + row, first, part);
            }
            for later in (panel + 1..band.panels()).filter(|&later| band.start(later) <= panel) {
                let from = start.max(band.start(later) * PANEL);
                for row in (later * PANEL..(later + 1) * PANEL).step_by(ROWS) {
                    let mut parts = [[0.0; PANEL]; ROWS];
                    for (r, part) in parts.iter_mut().enumerate() {
                        *part = self.part(row + r, first);
                    }
                    self.subtract::<R>(row, [from, first], start, &mut parts);
                    for (r, part) in parts.into_iter().enumerate() {
                        self.set_part(row + r, first, product::<R>(&part, &inverse));
                    }
                }
            }
        }
        true
    }
}

/// `sum_m part_m lines_m`.
#[inline(always)]
fn product<R: Real>(part: &Part, lines: &[Part; PANEL]) -> Part {
    let mut sums = [R::splat(0.0); VECTORS];
    for m in 0..PANEL {
        for vector in 0..PANEL / R::COUNT {
            let sum = &mut sums[vector % VECTORS];
            *sum = R::splat(part[m]).fused(read(&lines[m], vector), *sum);
        }
    }
    let mut out = [0.0; PANEL];
    for vector in 0..PANEL / R::COUNT {
        write(&mut out, vector, sums[vector % VECTORS]);
    }
    out
}

/// Replaces right sides by solutions, from the factor.
pub(super) fn solve(band: &Band, factor: &[f32], x: &mut [&mut Row]) {
    solve_part(band, factor, x, [0; 2]);
}

/// The same of right sides that are zero before an unknown, for the solutions from another one on; what is before it is
/// of no use.
pub(super) fn solve_part(band: &Band, factor: &[f32], x: &mut [&mut Row], [given, asked]: [usize; 2]) {
    dispatch(Solve { band, factor, x, first: given / PANEL, least: asked / PANEL });
}

struct Solve<'a, 'b> {
    band: &'a Band,
    factor: &'a [f32],
    x: &'a mut [&'b mut Row],
    /// Panels.
    first: usize,
    least: usize,
}

#[inline(always)]
fn part_of(x: &Row, panel: usize) -> Part {
    x.as_chunks().0.get(panel).copied().unwrap_or_default()
}

#[inline(always)]
fn set_part_of(x: &mut Row, panel: usize, part: Part) {
    if let Some(place) = x.as_chunks_mut().0.get_mut(panel) {
        *place = part;
    }
}

/// The sum of each row's values.
#[inline(always)]
fn sums_of_rows<R: Real>(rows: &[Part; PANEL]) -> Part {
    let mut out = [0.0; PANEL];
    for vector in 0..PANEL / R::COUNT {
        let mut sum = R::splat(0.0);
        for quarter in 0..4 {
            let [a, b, c, d] = R::from_rows(|lane| {
                let row = &rows[(vector * R::COUNT + lane) % PANEL];
                [row[4 * quarter], row[4 * quarter + 1], row[4 * quarter + 2], row[4 * quarter + 3]]
            });
            sum = sum + ((a + b) + (c + d));
        }
        write(&mut out, vector, sum);
    }
    out
}

impl Kernel for Solve<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { band, factor, x, first: given, least } = self;
        let square_of = |panel: usize| {
            let mut square = [[0.0; PANEL]; PANEL];
            for (r, part) in square.iter_mut().enumerate() {
                let row = panel * PANEL + r;
                let entries = factor.get(band.at(row, panel * PANEL)..).and_then(<[f32]>::first_chunk);
                *part = entries.copied().unwrap_or_default();
            }
            square
        };
        for panel in given..band.panels() {
            let (first, start) = (panel * PANEL, band.start(panel).max(given));
            let square = square_of(panel);
            for x in x.iter_mut() {
                let mut rows = [[0.0; PANEL]; PANEL];
                for (r, row) in rows.iter_mut().enumerate() {
                    let entries = band.columns(factor, first + r, start * PANEL, first).as_chunks::<PANEL>().0;
                    let mut sums = [R::splat(0.0); VECTORS];
                    for (entries, x) in entries.iter().zip(x.as_chunks::<PANEL>().0.get(start..).unwrap_or_default()) {
                        for vector in 0..PANEL / R::COUNT {
                            let sum = &mut sums[vector % VECTORS];
                            *sum = read::<R>(entries, vector).fused(read(x, vector), *sum);
                        }
                    }
                    for vector in 0..PANEL / R::COUNT {
                        write(row, vector, sums[vector % VECTORS]);
                    }
                }
                let (mut side, sums) = (part_of(x, panel), sums_of_rows::<R>(&rows));
                side.iter_mut().zip(sums).for_each(|(side, sum)| *side -= sum);
                set_part_of(x, panel, product::<R>(&side, &square));
            }
        }
        for panel in (least..band.panels()).rev() {
            let (first, start) = (panel * PANEL, band.start(panel).max(least));
            let square = square_of(panel);
            for x in x.iter_mut() {
                let side = part_of(x, panel);
                let mut rows = square;
                for row in &mut rows {
                    row.iter_mut().zip(side).for_each(|(entry, side)| *entry *= side);
                }
                let solved = sums_of_rows::<R>(&rows);
                set_part_of(x, panel, solved);
                for (r, value) in solved.into_iter().enumerate() {
                    let entries = band.columns(factor, first + r, start * PANEL, first).as_chunks::<PANEL>().0;
                    let before = x.as_chunks_mut::<PANEL>().0.get_mut(start..panel).unwrap_or_default();
                    for (entries, before) in entries.iter().zip(before) {
                        for vector in 0..PANEL / R::COUNT {
                            let rest = R::splat(-value).fused(read(entries, vector), read(before, vector));
                            write(before, vector, rest);
                        }
                    }
                }
            }
        }
    }
}
