//! How much longer do implicit steps take for the same error? For each row of an explicit method the time that backward
//! Euler or the implicit midpoint rule takes with the step at which its mean error over time is the same, over the
//! row's time.

use super::method::Method;
use super::run::Row;

/// Errors below are not judged, mm: their scale is that of float32.
const LEAST: f64 = 1e-4;

/// Ratios of some runs, in ascending order.
#[derive(Clone, Debug, PartialEq)]
struct Ratios(Vec<f64>);

impl Ratios {
    fn new(mut ratios: Vec<f64>) -> Self {
        ratios.sort_by(f64::total_cmp);
        Self(ratios)
    }

    /// How many there are.
    const fn count(&self) -> usize {
        self.0.len()
    }

    /// Median, least and largest.
    fn spread(&self) -> Option<[f64; 3]> {
        let Self(ratios) = self;
        let at = |index: usize| ratios.get(index).copied();
        let last = ratios.len().checked_sub(1)?;
        Some([0.5 * (at(last / 2)? + at(last.div_ceil(2))?), at(0)?, at(last)?])
    }
}

/// The multiples of the rows, in ascending order.
fn multiples(rows: &[Row]) -> Vec<u32> {
    let mut multiples: Vec<u32> = rows.iter().map(|row| row.multiple).collect();
    multiples.sort_unstable();
    multiples.dedup();
    multiples
}

/// Error (mm) and time of a simulated second (us).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Point {
    error: f64,
    time: f64,
}

impl Point {
    fn of(row: &Row) -> Option<Self> {
        let figures = row.figures()?;
        let error = figures.errors.mean_over_time().max(LEAST);
        Some(Self { error, time: figures.us_per_step / row.step })
    }
}

/// The time at an error between those of two points of a curve, on logarithmic axes; at errors beyond the curve that of
/// its end, so that the ratio to it is too low rather than too high.
fn time_at(curve: &[Point], error: f64) -> Option<f64> {
    let within = curve.windows(2).find_map(|pair| match pair {
        [a, b] if a.error < error && error <= b.error => {
            let share = (error / a.error).ln() / (b.error / a.error).ln();
            Some(a.time * (b.time / a.time).powf(share))
        }
        _ => None,
    });
    let (first, last) = (curve.first()?, curve.last()?);
    Some(within.unwrap_or(if error <= first.error { first.time } else { last.time }))
}

/// Times of an implicit method at the errors of `method` at a multiple, over its times.
fn ratios(rows: &[Row], method: Method, multiple: u32, implicit: Method) -> Ratios {
    let ratio = |row: &Row| {
        let mut curve: Vec<(u32, Point)> = rows
            .iter()
            .filter(|other| other.method == implicit && other.scene == row.scene)
            .filter_map(|other| Some((other.multiple, Point::of(other)?)))
            .collect();
        curve.sort_by_key(|(multiple, _)| *multiple);
        let curve: Vec<Point> = curve.into_iter().map(|(_, point)| point).collect();
        let point = Point::of(row)?;
        Some(time_at(&curve, point.error)? / point.time)
    };
    let rows = rows.iter().filter(|row| row.method == method && row.multiple == multiple);
    Ratios::new(rows.filter_map(ratio).collect())
}

/// A line for each implicit method, explicit method and multiple; nothing if no implicit method was run.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    let multiples = multiples(rows);
    let mut text = String::new();
    for implicit in [Method::BackwardEuler, Method::ImplicitMidpoint] {
        for method in [Method::Tled, Method::Long] {
            for &multiple in &multiples {
                let ratios = ratios(rows, method, multiple, implicit);
                let (Some([median, least, most]), scenes) = (ratios.spread(), ratios.count()) else {
                    continue;
                };
                text += &format!(
                    "{:<18} {:<12} {multiple:>8}  {median:>7.1}  {least:>7.2} to {most:>8.1}  {scenes}\n",
                    implicit.name(),
                    method.name()
                );
            }
        }
    }
    if text.is_empty() {
        return text;
    }
    format!("time of            at the error of  multiple   median    range over scenes      scenes\n{text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_between_two_steps_are_interpolated_and_beyond_them_kept() {
        let curve = vec![Point { error: 1.0, time: 400.0 }, Point { error: 100.0, time: 100.0 }];
        for (error, time) in [(0.1, 400.0), (1.0, 400.0), (10.0, 200.0), (100.0, 100.0), (1e3, 100.0)] {
            let found = time_at(&curve, error).unwrap();
            assert!((found / time - 1.0).abs() < 1e-9, "{error}: {found}");
        }
        assert_eq!(time_at(&[], 1.0), None);
    }

    #[test]
    fn a_spread_is_median_least_and_largest() {
        assert_eq!(Ratios::new(vec![10.0, 2.0, 0.5, 1.0]).spread(), Some([1.5, 0.5, 10.0]));
        assert_eq!(Ratios::new(vec![]).spread(), None);
    }
}
