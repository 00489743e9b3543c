//! Ratios of figures of runs, and the multiples of the step that there are.

use std::vec::Vec;

use super::run::Row;

/// Errors below are not judged, mm: their scale is that of float32.
pub(super) const LEAST: f64 = 1e-4;

/// Ratios of some runs, in ascending order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Ratios(Vec<f64>);

impl Ratios {
    pub(super) fn new(mut ratios: Vec<f64>) -> Self {
        ratios.sort_by(f64::total_cmp);
        Self(ratios)
    }

    /// How many there are.
    pub(super) const fn count(&self) -> usize {
        self.0.len()
    }

    /// Median, least and largest.
    pub(super) fn spread(&self) -> Option<[f64; 3]> {
        let Self(ratios) = self;
        let at = |index: usize| ratios.get(index).copied();
        let last = ratios.len().checked_sub(1)?;
        Some([0.5 * (at(last / 2)? + at(last.div_ceil(2))?), at(0)?, at(last)?])
    }
}

/// The multiples of the rows, in ascending order.
pub(super) fn multiples(rows: &[Row]) -> Vec<u32> {
    let mut multiples: Vec<u32> = rows.iter().map(|row| row.multiple).collect();
    multiples.sort_unstable();
    multiples.dedup();
    multiples
}
