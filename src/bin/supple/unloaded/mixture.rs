//! Anderson acceleration: from places and their gaps the next places. With the latest differences of places `dX` and of
//! gaps `dG` as columns, and the weights `w` that make `|g - dG w|` least, the next places are `X - g - (dX - dG) w`:
//! a step by the whole gap from where the linear model has the gaps least. `g` is `x(X) - x0`.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};

/// So many differences are remembered.
const REMEMBERED: usize = 6;
/// Differences whose singular value is below this share of the largest do not count.
const SINGULAR: f64 = 1e-3;

pub(super) struct Mixture {
    latest: Option<(DVector<f64>, DVector<f64>)>,
    differences: VecDeque<(DVector<f64>, DVector<f64>)>,
}

impl Mixture {
    pub(super) const fn new() -> Self {
        Self { latest: None, differences: VecDeque::new() }
    }

    /// The places to try next.
    pub(super) fn next(&mut self, points: &[[f64; 3]], gaps: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let vector = |rows: &[[f64; 3]]| DVector::from_column_slice(rows.as_flattened());
        let (places, gap) = (vector(points), vector(gaps));
        if let Some((before, gap_before)) = self.latest.replace((places.clone(), gap.clone())) {
            self.differences.push_back((&places - before, &gap - gap_before));
            if self.differences.len() > REMEMBERED {
                self.differences.pop_front();
            }
        }
        let mut next = &places - &gap;
        if !self.differences.is_empty() {
            let of_gaps: Vec<_> = self.differences.iter().map(|(_, gaps)| gaps.clone()).collect();
            let weights = least(&DMatrix::from_columns(&of_gaps), &gap);
            for ((of_places, of_gaps), weight) in self.differences.iter().zip(weights.iter()) {
                next -= (of_places - of_gaps) * *weight;
            }
        }
        next.as_slice().chunks_exact(3).map(|place| [place[0], place[1], place[2]]).collect()
    }
}

/// The weights on columns that come nearest to a vector: by the normal equations, whose size is that of the memory.
fn least(columns: &DMatrix<f64>, vector: &DVector<f64>) -> DVector<f64> {
    let eigen = (columns.transpose() * columns).symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let inverses = eigen.eigenvalues.map(|value| if value > SINGULAR * SINGULAR * largest { 1.0 / value } else { 0.0 });
    let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverses) * eigen.eigenvectors.transpose();
    inverse * (columns.transpose() * vector)
}
