//! Errors of a motion against the truth: distances between where a node is and where it ought to be, over all
//! nodes (held ones too, as in the paper), in millimetres.

use supple::state::NodeVector;

use super::LabError;
use super::truth::Truth;

/// Errors of a motion, mm.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Errors {
    /// Mean over the nodes, at each snapshot.
    pub means: Vec<f64>,
    /// Standard deviation over the nodes at the end.
    pub sd: f64,
    /// Largest at the end.
    pub max: f64,
}

impl Errors {
    /// Mean over the nodes at the end.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.means.last().copied().unwrap_or(f64::NAN)
    }

    /// The largest mean over the nodes at a snapshot.
    #[must_use]
    pub fn largest_mean(&self) -> f64 {
        self.means.iter().copied().fold(0.0, f64::max)
    }

    /// Mean over the snapshots of the mean over the nodes.
    #[must_use]
    pub fn mean_over_time(&self) -> f64 {
        self.means.iter().sum::<f64>() / self.means.len() as f64
    }

    /// 1 is the truth, 0 no better than doing nothing, with the error `hold` (mm) of that over time.
    #[must_use]
    pub fn skill(&self, hold: f64) -> f64 {
        1.0 - self.mean_over_time() / hold
    }

    /// Compares displacements (m) with the next snapshot of the truth.
    pub fn add_snapshot(&mut self, truth: &Truth, displacements: &[NodeVector]) -> Result<(), LabError> {
        let moved: Vec<_> = displacements.iter().map(|vector| vector.to_array()).collect();
        self.add_shape(truth, &moved)
    }

    /// The same with displacements as the truth has them.
    pub(super) fn add_shape(&mut self, truth: &Truth, moved: &[[f32; 3]]) -> Result<(), LabError> {
        let shape = truth.snapshots.get(self.means.len()).map_or(&[][..], Vec::as_slice);
        if shape.is_empty() || shape.len() != moved.len() {
            return Err(LabError::Mismatch { nodes: shape.len(), room: moved.len() });
        }
        let distances: Vec<f64> = shape.iter().zip(moved).map(|(a, b)| 1e3 * distance(*a, *b)).collect();
        let count = distances.len() as f64;
        let mean = distances.iter().sum::<f64>() / count;
        let variance = distances.iter().map(|distance| (distance - mean).powi(2)).sum::<f64>() / count;
        self.means.push(mean);
        self.sd = variance.sqrt();
        self.max = distances.into_iter().fold(0.0, f64::max);
        Ok(())
    }

    /// Of a body that never moves.
    pub fn of_hold(truth: &Truth) -> Result<Self, LabError> {
        let mut errors = Self::default();
        for shape in &truth.snapshots {
            errors.add_snapshot(truth, &vec![NodeVector::ZERO; shape.len()])?;
        }
        Ok(errors)
    }
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f64 {
    let square: f64 = a.into_iter().zip(b).map(|(a, b)| (f64::from(a) - f64::from(b)).powi(2)).sum();
    square.sqrt()
}

#[cfg(test)]
mod tests {
    use supple::state::VecState;

    use super::*;

    /// Two nodes: one stands, one walks 3 mm and then 6 mm.
    fn truth() -> Truth {
        let at = |x: f32| vec![[0.0; 3], [x, 0.0, 0.0]];
        Truth {
            snapshots: vec![at(3e-3), at(6e-3)],
            limit_at_rest: 1.0,
            limit_least: 1.0,
            limit_least_time: 0.0,
            limited_steps: 0,
        }
    }

    fn judged(last: [f32; 3]) -> Errors {
        let truth = truth();
        let mut errors = Errors::default();
        let mut state = VecState::at_rest(2);
        for displacement in [[3e-3, 0.0, 0.0], last] {
            state.view().put(0.0, 0.0, |node| [displacement.map(|metre| node as f32 * metre), [0.0; 3]]);
            errors.add_snapshot(&truth, state.displacements()).unwrap();
        }
        errors
    }

    fn near(value: f64, expected: f64) {
        assert!((value - expected).abs() < 1e-6, "{value} {expected}");
    }

    #[test]
    fn errors_of_a_hand_made_field() {
        // Off by 4 mm at the end, at one of two nodes, and right before.
        let errors = judged([6e-3, 0.0, 4e-3]);
        near(errors.means[0], 0.0);
        near(errors.mean(), 2.0);
        near(errors.sd, 2.0);
        near(errors.max, 4.0);
        near(errors.mean_over_time(), 1.0);
        near(errors.skill(2.0), 0.5);
    }

    #[test]
    fn the_truth_has_skill_one_and_doing_nothing_has_none() {
        let hold = Errors::of_hold(&truth()).unwrap();
        // Means of 1.5 mm and 3 mm.
        near(hold.mean_over_time(), 2.25);
        assert_eq!(hold.skill(hold.mean_over_time()), 0.0);
        assert_eq!(judged([6e-3, 0.0, 0.0]).skill(hold.mean_over_time()), 1.0);
    }

    #[test]
    fn fields_that_do_not_fit_are_refused() {
        let truth = truth();
        let mut errors = Errors::default();
        assert!(errors.add_snapshot(&truth, &[NodeVector::ZERO]).is_err());
        errors.add_snapshot(&truth, &[NodeVector::ZERO; 2]).unwrap();
        errors.add_snapshot(&truth, &[NodeVector::ZERO; 2]).unwrap();
        assert!(errors.add_snapshot(&truth, &[NodeVector::ZERO; 2]).is_err(), "there is no further snapshot");
    }
}
