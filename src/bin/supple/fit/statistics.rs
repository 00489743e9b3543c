//! What the data of a fit can tell: standard errors and correlations of the values, points predicted without
//! themselves. Linear about the best values: with the derivatives `J` and the residuals `r` of `m` numbers and `p`
//! values the variance of a number is `s^2 = r'r / (m - p)`, the covariance of the values `s^2 (J'J)^-1`, and what a
//! point misses if the fit does not know it `(1 - H)^-1 r` with `H = J (J'J)^-1 J'` in its rows (Cook and Weisberg,
//! "Residuals and Influence in Regression", 1982).

use nalgebra::{DMatrix, DVector};

use super::file::Unknown;
use super::solve::Solution;

/// The least singular value that counts, over the largest, of derivatives scaled to columns of length one.
const SINGULAR: f64 = 1e-6;
/// A standard error above this share of the value, or of the range that it may have, says that data cannot tell it.
const MOST_OF_VALUE: f64 = 0.5;
const MOST_OF_RANGE: f64 = 0.1;
/// Of a value near zero there is no share. Where zero is within the range that counts alone; where it is an end of it, an error below
/// this share of the range is small enough for any value.
const SMALL_OF_RANGE: f64 = 0.01;
/// Two values whose correlation is above this cannot be told apart, unless both errors are below a tenth of what is too much: or
/// whatever these are, above the second, where there is nothing but the one combination.
const MOST_CORRELATION: f64 = 0.98;
const LOOSE: f64 = 0.1;
const SAME: f64 = 0.9999;

pub(crate) struct Statistics {
    /// In the unit of the scene, as if there were no limits.
    pub(crate) standard_errors: Vec<f64>,
    /// Of all pairs.
    pub(crate) correlations: DMatrix<f64>,
    /// Sentences about what the data cannot tell.
    pub(crate) untold: Vec<String>,
    /// Whether the data tell the value.
    pub(crate) told: Vec<bool>,
    /// What each point misses without itself, mm, in the order of the groups; none where the fit needs the point.
    pub(crate) without: Vec<Option<f64>>,
}

/// `groups`: the rows of the residuals that are one point's.
pub(crate) fn of(unknowns: &[Unknown], solution: &Solution, groups: &[Vec<usize>]) -> Statistics {
    let Solution { values, residuals, jacobian, .. } = solution;
    let count = unknowns.len();
    let inverse = inverse_of_normal(jacobian);
    let freedom = residuals.len().saturating_sub(count);
    let variance = if freedom > 0 { residuals.norm_squared() / freedom as f64 } else { f64::INFINITY };
    let error = |index: usize| match jacobian.column(index).norm() {
        0.0 => f64::INFINITY,
        _ => (variance * inverse[(index, index)]).sqrt(),
    };
    let standard_errors = (0..count).map(error).collect();
    let correlations =
        DMatrix::from_fn(count, count, |a, b| inverse[(a, b)] / (inverse[(a, a)] * inverse[(b, b)]).sqrt());
    let mut statistics =
        Statistics { standard_errors, correlations, untold: vec![], told: vec![true; count], without: vec![] };
    if freedom == 0 {
        let message = format!(
            "{} measured numbers for {count} parameters: no errors can be estimated; measure more",
            residuals.len()
        );
        statistics.untold.push(message);
    }
    for (index, unknown) in unknowns.iter().enumerate() {
        statistics.judge(index, unknown, values[index], solution);
    }
    statistics.judge_pairs(unknowns, values);
    statistics.without = groups.iter().map(|rows| without(jacobian, &inverse, residuals, rows)).collect();
    statistics
}

/// `(J'J)^-1`, large and finite in directions that the data do not show.
fn inverse_of_normal(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let largest = columns.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
    let length = |norm: f64| if largest > 0.0 { norm.max(SINGULAR * largest) } else { 1.0 };
    let lengths: Vec<f64> = columns.column_iter().map(|column| length(column.norm())).collect();
    let mut scaled = columns.clone();
    for (mut column, length) in scaled.column_iter_mut().zip(&lengths) {
        column.unscale_mut(*length);
    }
    let eigen = (scaled.transpose() * &scaled).symmetric_eigen();
    let least = SINGULAR * SINGULAR;
    let inverses = eigen.eigenvalues.map(|value| 1.0 / value.max(least));
    let mut inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverses) * eigen.eigenvectors.transpose();
    for row in 0..lengths.len() {
        for column in 0..lengths.len() {
            inverse[(row, column)] /= lengths[row] * lengths[column];
        }
    }
    inverse
}

/// How far a point is off if the fit does not know it, root of the mean over its times, mm.
fn without(columns: &DMatrix<f64>, inverse: &DMatrix<f64>, residuals: &DVector<f64>, rows: &[usize]) -> Option<f64> {
    let of_point = columns.select_rows(rows);
    let own = DVector::from_iterator(rows.len(), rows.iter().map(|&row| residuals[row]));
    let known = DMatrix::identity(rows.len(), rows.len()) - &of_point * inverse * of_point.transpose();
    // Without the point a value could be anything.
    let is_needed = known.clone().symmetric_eigen().eigenvalues.min() < 1e-6;
    let times = rows.len() as f64 / 3.0;
    if is_needed { None } else { Some((known.try_inverse()? * own).norm() / times.sqrt()) }
}

impl Statistics {
    fn judge(&mut self, index: usize, unknown: &Unknown, value: f64, solution: &Solution) {
        let (name, error) = (unknown.name(), self.standard_errors[index]);
        let (is_still, is_at_limit) = (solution.jacobian.column(index).norm() == 0.0, solution.at_limit[index]);
        self.told[index] = is_told(unknown, value, error);
        if is_at_limit && (is_still || self.told[index]) {
            let what = if is_still { "there it moves no measured point" } else { "the data want it further" };
            let others = if self.told.len() > 1 {
                ", and the other values and their errors hold only if it is the truth"
            } else {
                ""
            };
            self.untold.push(format!(
                "{name} stays at its limit, {}: {what}{others}; give a wider limit, or look for another cause of what they show",
                short(value)
            ));
        } else if is_still {
            self.untold.push(format!("{name} moves no measured point; measure elsewhere, or leave it out"));
        } else if !self.told[index] {
            self.untold.push(format!(
                "the data cannot tell {name}: its standard error is {}, its value {}{} of a range from {} to {}; give it a fixed value from \
                 another source",
                short(error),
                short(value),
                if is_at_limit { ", at its limit," } else { "" },
                unknown.least,
                unknown.most
            ));
        }
    }

    fn judge_pairs(&mut self, unknowns: &[Unknown], values: &[f64]) {
        let is_loose = |index: usize| looseness(&unknowns[index], values[index], self.standard_errors[index]) > LOOSE;
        let loose: Vec<bool> = (0..unknowns.len()).map(is_loose).collect();
        for a in 0..unknowns.len() {
            for b in 0..a {
                let correlation = self.correlations[(a, b)];
                let size = correlation.abs();
                if size > SAME || (size > MOST_CORRELATION && (loose[a] || loose[b])) {
                    (self.told[a], self.told[b]) = (false, false);
                    self.untold.push(format!(
                        "the data cannot tell {} from {}: their correlation is {correlation:.4}; fix one of them",
                        unknowns[b].name(),
                        unknowns[a].name()
                    ));
                }
            }
        }
    }
}

/// A standard error over the most that a value may have.
fn looseness(unknown: &Unknown, value: f64, error: f64) -> f64 {
    let range = unknown.most - unknown.least;
    let (of_range, of_value) = (error / (MOST_OF_RANGE * range), error / (MOST_OF_VALUE * value.abs()));
    let is_near_zero = match unknown.least * unknown.most {
        product if product < 0.0 => true,
        product => product == 0.0 && error <= SMALL_OF_RANGE * range,
    };
    if is_near_zero { of_range } else { of_range.max(of_value) }
}

fn is_told(unknown: &Unknown, value: f64, error: f64) -> bool {
    looseness(unknown, value, error) <= 1.0
}

/// Four digits.
pub(crate) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = 3 - value.abs().log10().floor() as i32;
    if (-6..=8).contains(&digits) {
        let unit = 10f64.powi(digits);
        format!("{:.*}", digits.max(0) as usize, (value * unit).round() / unit)
    } else {
        format!("{value:.3e}")
    }
}
