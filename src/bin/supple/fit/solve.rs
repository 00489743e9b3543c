//! Least squares with as few simulations as possible. The steps and their trust region are those of MINPACK, by the
//! crate `levenberg-marquardt` (Moré, "The Levenberg-Marquardt algorithm", 1978). Added here is what makes simulations
//! few, and limits:
//!
//! - A stiffness is searched as its inverse, in which displacements are nearly linear.
//! - The derivatives are finite differences at the start and at the end; in between they follow the steps taken (Broyden,
//!   Mathematics of Computation 19, 1965). Where those at the end want to go on, the search does.
//! - It ends when it is nearer to the best values than a fifth of their standard errors.
//! - A value at its limit towards which the data pull stays there, and the others are searched.

use std::cell::RefCell;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, TerminationReason};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

use super::file::Unknown;
use crate::problem::Problem;

/// The step of finite differences, as a share of the start value: far above what is left of the way to rest.
const DIFFERENCE: f64 = 0.05;
/// The same where that one moves nothing beyond the noise, as of a tissue that hardly changes its volume.
const LARGE_DIFFERENCE: f64 = 0.5;
/// How near to the best values is near enough, in standard errors.
const NEAR: f64 = 0.2;
/// The same as a share of the value, for data without noise.
const NEAR_SHARE: f64 = 1e-3;
/// The search begins anew at most so often.
const MOST_SEARCHES: u32 = 8;
/// Residuals at most, in mm, of values that cannot be simulated, over those at the start: they are refused.
const REFUSED: f64 = 10.0;

/// Residuals (mm) at values in the units of the scenes.
pub(crate) type Residuals<'a> = dyn FnMut(&[f64]) -> Result<DVector<f64>, Problem> + 'a;

/// Where a search came to.
pub(crate) struct Solution {
    /// In the units of the scenes.
    pub(crate) values: Vec<f64>,
    /// mm.
    pub(crate) residuals: DVector<f64>,
    /// Of the residuals over the values, mm over the unit of the scene.
    pub(crate) jacobian: DMatrix<f64>,
    /// Values that stay at a limit.
    pub(crate) at_limit: Vec<bool>,
    /// Whether the end is the best to within what was asked.
    pub(crate) converged: bool,
}

/// Searches the values with the least sum of squares.
/// Differences of residuals of a length (mm) up to `noise` say nothing.
pub(crate) fn solve(unknowns: &[Unknown], noise: f64, residuals: &mut Residuals<'_>) -> Result<Solution, Problem> {
    let axes: Vec<Axis> = unknowns.iter().map(Axis::new).collect();
    let start: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
    let at_start = |problem| Problem(format!("with the start values: {problem}"));
    let first = residuals(&start).map_err(at_start)?;
    let refused = first.map(|residual| REFUSED * (residual.abs() + 1.0));
    let mut here = Point {
        x: DVector::from_iterator(axes.len(), axes.iter().zip(&start).map(|(axis, value)| axis.x(*value))),
        residuals: first,
    };
    let mut search = Search { axes: &axes, free: (0..axes.len()).collect(), refused, noise, residuals };
    let mut jacobian = search.differences(&here)?;
    let mut converged = false;
    for _ in 0..MOST_SEARCHES {
        search.free = search.free_of(&here, &jacobian);
        let walked = search.go(&here, &jacobian);
        if walked.at_limit && walked.point.x != here.x {
            // On with the others.
            (here, jacobian) = (walked.point, walked.jacobian);
            continue;
        }
        if walked.point.x != here.x || walked.jacobian != jacobian {
            here = walked.point;
            jacobian = search.differences(&here)?;
        }
        search.free = search.free_of(&here, &jacobian);
        if search.is_near(&here, &jacobian) {
            converged = true;
            break;
        }
    }
    // One that has gone there stays there where nothing tells whether it wants to go further.
    let stays = |index: usize| axes[index].is_at_limit(here.x[index]).is_some() && here.x[index] != 1.0;
    let is_still = |index: usize| jacobian.column(index).norm() == 0.0;
    let is_at_limit = |index| !search.free.contains(&index) || (is_still(index) && stays(index));
    let at_limit = (0..axes.len()).map(is_at_limit).collect();
    let values = values(&axes, &here.x);
    // From the coordinates of the search to the values.
    for (index, axis) in axes.iter().enumerate() {
        jacobian.column_mut(index).scale_mut(axis.slope(values[index]));
    }
    Ok(Solution { values, residuals: here.residuals, jacobian, at_limit, converged })
}

/// A value and its coordinate in the search, which is 1 at the start.
struct Axis {
    is_inverse: bool,
    start: f64,
    unit: f64,
    /// Least and most coordinate.
    limits: [f64; 2],
}

impl Axis {
    fn new(unknown: &Unknown) -> Self {
        let is_inverse = unknown.place.is_stiffness() && unknown.least > 0.0;
        let unit = if unknown.start == 0.0 { unknown.most - unknown.least } else { unknown.start.abs() };
        let unit = if is_inverse { 1.0 / unit } else { unit };
        let start = if is_inverse { 1.0 / unknown.start } else { unknown.start };
        let mut axis = Self { is_inverse, start, unit, limits: [0.0; 2] };
        let (a, b) = (axis.x(unknown.least), axis.x(unknown.most));
        axis.limits = [a.min(b), a.max(b)];
        axis
    }

    fn x(&self, value: f64) -> f64 {
        let value = if self.is_inverse { 1.0 / value } else { value };
        1.0 + (value - self.start) / self.unit
    }

    fn value(&self, x: f64) -> f64 {
        let [least, most] = self.limits;
        let value = self.start + (x.clamp(least, most) - 1.0) * self.unit;
        if self.is_inverse { 1.0 / value } else { value }
    }

    /// Of the coordinate over the value.
    fn slope(&self, value: f64) -> f64 {
        let slope = if self.is_inverse { -1.0 / (value * value) } else { 1.0 };
        slope / self.unit
    }

    fn is_at_limit(&self, x: f64) -> Option<f64> {
        let [least, most] = self.limits;
        let near = 1e-9 * (most - least);
        if x <= least + near {
            Some(-1.0)
        } else if x >= most - near {
            Some(1.0)
        } else {
            None
        }
    }
}

fn values(axes: &[Axis], x: &DVector<f64>) -> Vec<f64> {
    axes.iter().zip(x.iter()).map(|(axis, x)| axis.value(*x)).collect()
}

#[derive(Clone)]
struct Point {
    x: DVector<f64>,
    residuals: DVector<f64>,
}

struct Search<'a, 'r> {
    axes: &'a [Axis],
    /// Which coordinates are searched.
    free: Vec<usize>,
    /// In place of residuals that cannot be simulated.
    refused: DVector<f64>,
    /// mm.
    noise: f64,
    residuals: &'a mut Residuals<'r>,
}

impl Search<'_, '_> {
    /// Derivatives by finite differences, away from the nearer limit.
    fn differences(&mut self, here: &Point) -> Result<DMatrix<f64>, Problem> {
        let mut columns = vec![];
        for (index, axis) in self.axes.iter().enumerate() {
            let [least, most] = axis.limits;
            let x = here.x[index].clamp(least, most);
            let room = (most - x).max(x - least);
            let mut to = |wanted: f64| {
                let step = wanted.min(room) * if most - x >= x - least { 1.0 } else { -1.0 };
                let mut there = here.x.clone();
                there[index] = x + step;
                let difference = (self.residuals)(&values(self.axes, &there))? - &here.residuals;
                Ok((difference.norm() > self.noise).then(|| difference / step))
            };
            let column = match to(DIFFERENCE * x.abs().clamp(DIFFERENCE, 1.0))? {
                None => to(LARGE_DIFFERENCE).unwrap_or_default(),
                column => column,
            };
            columns.push(column.unwrap_or_else(|| 0.0 * &here.residuals));
        }
        Ok(DMatrix::from_columns(&columns))
    }

    /// The coordinates that are not at a limit towards which the residuals fall.
    fn free_of(&self, here: &Point, jacobian: &DMatrix<f64>) -> Vec<usize> {
        let downhill = -(jacobian.transpose() * &here.residuals);
        let held = |index: &usize| {
            self.axes[*index].is_at_limit(here.x[*index]).is_some_and(|side| side * downhill[*index] > 0.0)
        };
        (0..self.axes.len()).filter(|index| !held(index)).collect()
    }

    /// Whether the best values of the linear model are as near as asked.
    fn is_near(&self, here: &Point, jacobian: &DMatrix<f64>) -> bool {
        let moving: Vec<usize> = self.free.iter().copied().filter(|&free| jacobian.column(free).norm() > 0.0).collect();
        let columns = jacobian.select_columns(&moving);
        let Some(inverse) = (columns.transpose() * &columns).try_inverse() else { return true };
        let step = -(&inverse * columns.transpose() * &here.residuals);
        let count = here.residuals.len().saturating_sub(moving.len()).max(1);
        let variance = here.residuals.norm_squared() / count as f64;
        moving.iter().enumerate().all(|(index, &place)| {
            let [least, most] = self.axes[place].limits;
            let step = (here.x[place] + step[index]).clamp(least, most) - here.x[place];
            let near = (1.5 * NEAR * (variance * inverse[(index, index)]).sqrt()).max(NEAR_SHARE * here.x[place].abs());
            step.abs() <= near
        })
    }

    /// Steps from a point with its derivatives until they end, or one of the values has come to a limit.
    fn go(&mut self, here: &Point, jacobian: &DMatrix<f64>) -> Walked {
        if self.free.is_empty() {
            return Walked { point: here.clone(), jacobian: jacobian.clone(), at_limit: false };
        }
        let count = here.residuals.len() as f64;
        let columns = jacobian.select_columns(&self.free);
        let free = self.free.clone();
        let reduced = |x: &DVector<f64>| DVector::from_iterator(free.len(), free.iter().map(|&index| x[index]));
        let taken = Derivatives { x: reduced(&here.x), residuals: here.residuals.clone(), jacobian: columns };
        let walk = Walk {
            at: reduced(&here.x),
            residuals: here.residuals.clone(),
            whole: here.x.clone(),
            search: self,
            taken: RefCell::new(taken),
        };
        let method = LevenbergMarquardt::new()
            .with_stepbound(10.0)
            .with_ftol(1e-6)
            .with_xtol(NEAR_SHARE)
            .with_gtol(NEAR / count.sqrt())
            .with_patience(10);
        let (walk, report) = method.minimize(walk);
        let whole = walk.whole_at(&walk.within(&walk.at));
        let taken = walk.taken.into_inner();
        let mut jacobian = jacobian.clone();
        for (column, &index) in walk.search.free.iter().enumerate() {
            jacobian.set_column(index, &taken.jacobian.column(column));
        }
        let at_limit = matches!(report.termination, TerminationReason::User(_));
        Walked { point: Point { x: whole, residuals: walk.residuals }, jacobian, at_limit }
    }
}

/// Where steps came to.
struct Walked {
    point: Point,
    /// As far as it is known.
    jacobian: DMatrix<f64>,
    at_limit: bool,
}

/// Derivatives of the free coordinates, with where they were last.
struct Derivatives {
    x: DVector<f64>,
    residuals: DVector<f64>,
    jacobian: DMatrix<f64>,
}

/// What the optimiser sees: the free coordinates.
struct Walk<'s, 'a, 'r> {
    at: DVector<f64>,
    residuals: DVector<f64>,
    whole: DVector<f64>,
    search: &'s mut Search<'a, 'r>,
    taken: RefCell<Derivatives>,
}

impl Walk<'_, '_, '_> {
    fn whole_at(&self, at: &DVector<f64>) -> DVector<f64> {
        let mut whole = self.whole.clone();
        for (x, &index) in at.iter().zip(&self.search.free) {
            whole[index] = *x;
        }
        whole
    }

    /// The free coordinates within their limits.
    fn within(&self, at: &DVector<f64>) -> DVector<f64> {
        let limits = self.search.free.iter().map(|&index| self.search.axes[index].limits);
        DVector::from_iterator(at.len(), at.iter().zip(limits).map(|(x, [least, most])| x.clamp(least, most)))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Walk<'_, '_, '_> {
    type ParameterStorage = Owned<f64, Dyn>;
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        if *x == self.at {
            return;
        }
        let values = values(self.search.axes, &self.whole_at(x));
        let found = (self.search.residuals)(&values);
        self.residuals = found.unwrap_or_else(|_| self.search.refused.clone());
        self.at.clone_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(self.residuals.clone())
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let mut taken = self.taken.borrow_mut();
        let at = self.within(&self.at);
        let step = &at - &taken.x;
        let square = step.norm_squared();
        if square > 0.0 {
            let missing = &self.residuals - &taken.residuals - &taken.jacobian * &step;
            taken.jacobian += missing * step.transpose() / square;
            taken.residuals = self.residuals.clone();
        }
        taken.x.clone_from(&at);
        (at == self.at).then(|| taken.jacobian.clone())
    }
}
