//! How well do estimates tell the error without the truth? Estimates over true errors, both means over nodes and time, mm: the
//! method's own, from its added inertia while it runs, and that of a second run with twice the step.

use std::format;
use std::string::String;
use std::vec::Vec;

use super::method::Method;
use super::run::Row;

/// Errors below are not judged, mm: their scale is that of float32.
pub(super) const LEAST: f64 = 1e-4;
/// A factor that an estimate may be off by, either way.
const FACTOR: f64 = 3.0;

/// Ratios of some runs, in ascending order.
#[derive(Clone, Debug, PartialEq)]
pub struct Ratios(Vec<f64>);

impl Ratios {
    /// Estimates over true errors of the rows of a method at a multiple; `estimate` gives a row's, mm.
    pub fn of(rows: &[Row], method: Method, multiple: u32, estimate: impl Fn(&Row) -> Option<f64>) -> Self {
        let rows = rows.iter().filter(|row| row.method == method && row.multiple == multiple);
        let ratio = |row: &Row| {
            let error = row.figures()?.errors.mean_over_time();
            (error > LEAST).then_some(estimate(row)? / error)
        };
        Self::new(rows.filter_map(ratio).collect())
    }

    pub(super) fn new(mut ratios: Vec<f64>) -> Self {
        ratios.sort_by(f64::total_cmp);
        Self(ratios)
    }

    /// Median, least and largest.
    #[must_use]
    pub fn spread(&self) -> Option<[f64; 3]> {
        let Self(ratios) = self;
        let at = |index: usize| ratios.get(index).copied();
        let last = ratios.len().checked_sub(1)?;
        Some([0.5 * (at(last / 2)? + at(last.div_ceil(2))?), at(0)?, at(last)?])
    }

    /// How many are right to a factor of three, and how many there are.
    #[must_use]
    pub fn good(&self) -> (usize, usize) {
        let good = |ratio: &&f64| (FACTOR.recip()..=FACTOR).contains(*ratio);
        (self.0.iter().filter(good).count(), self.0.len())
    }
}

/// The multiples of the rows, in ascending order.
pub(super) fn multiples(rows: &[Row]) -> Vec<u32> {
    let mut multiples: Vec<u32> = rows.iter().map(|row| row.multiple).collect();
    multiples.sort_unstable();
    multiples.dedup();
    multiples
}

/// A line for each estimate, method and multiple; nothing if no row has an estimate.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    type Estimate = fn(&Row) -> Option<f64>;
    let running: Estimate = |row| row.figures().and_then(|figures| figures.running);
    let doubling: Estimate = |row| row.doubling;
    let multiples = multiples(rows);
    let mut text = String::new();
    for (name, estimate) in [("running", running), ("doubling", doubling)] {
        for method in Method::ALL {
            for &multiple in &multiples {
                let ratios = Ratios::of(rows, method, multiple, estimate);
                let (Some([median, least, most]), (good, all)) = (ratios.spread(), ratios.good()) else {
                    continue;
                };
                text += &format!(
                    "{name:<9} {:<12} {multiple:>8}  {median:>6.2}  {least:>6.2} to {most:>6.2}  {good} of {all}\n",
                    method.name()
                );
            }
        }
    }
    if text.is_empty() {
        return text;
    }
    format!(
        "estimate over true error; how many scenes are right to a factor of {FACTOR}\n\
             estimate  method       multiple  median  range             scenes\n{text}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::measure::Errors;
    use crate::lab::run::{End, Figures};
    use std::vec;

    fn row(error: f64, running: f64) -> Row {
        let errors = Errors { means: vec![error], sd: 0.0, max: 0.0 };
        let figures = Figures { errors, running: Some(running), clip_share: 0.0, us_per_step: 1.0 };
        Row::example(End::Reached(figures))
    }

    #[test]
    fn ratios_are_of_what_was_estimated_and_has_an_error() {
        let diverged = Row { end: End::Diverged(0.1), ..row(1.0, 1.0) };
        let rows = [row(1.0, 2.0), row(2.0, 1.0), row(1.0, 10.0), row(1.0, 1.0), row(1e-5, 1.0), diverged];
        let ratios = Ratios::of(&rows, Method::Multilevel, 10, |row| row.figures()?.running);
        assert_eq!(ratios.spread(), Some([1.5, 0.5, 10.0]));
        assert_eq!(ratios.good(), (3, 4));
        assert_eq!(Ratios::of(&rows, Method::MassScaled, 10, |_| Some(1.0)).spread(), None);
        let text = text(&rows);
        assert!(text.contains("running") && !text.contains("doubling"), "{text}");
        assert!(text.ends_with("1.50    0.50 to  10.00  3 of 4\n"), "{text}");
    }
}
