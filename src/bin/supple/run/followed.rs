//! Where the followed points of a scene are at each frame.

use std::fmt::Write as _;

use supple::points::{FollowedPoint, VecPoints};

use crate::problem::Problem;
use crate::scene::points::ScenePoints;
use supple::state::VecState;

/// The points, and of each frame its time, s, and where they are, m from the centre of the body.
#[derive(Default)]
pub(crate) struct FollowedPoints {
    names: Vec<String>,
    points: Option<VecPoints>,
    rows: Vec<(f64, Vec<[f32; 3]>)>,
}

impl FollowedPoints {
    pub(crate) fn new(of: &ScenePoints) -> Self {
        Self { names: of.names.clone(), points: of.followed.clone(), rows: vec![] }
    }

    /// Takes down a frame.
    pub(crate) fn enter(&mut self, state: &VecState) -> Result<(), Problem> {
        let Some(points) = &mut self.points else { return Ok(()) };
        points.follow(&mut state.clone()).map_err(Problem::of)?;
        self.rows.push((state.time(), points.positions().to_vec()));
        Ok(())
    }

    /// Of each point its name, and at each frame the time, s, and how far it has moved from where it was at rest, m.
    pub(crate) fn moved(&self) -> Vec<(&str, Vec<(f64, f64)>)> {
        let Some(points) = self.points.as_ref().filter(|_| !self.rows.is_empty()) else { return vec![] };
        let way =
            |a: [f32; 3], b: [f32; 3]| (0..3).map(|axis| f64::from(b[axis] - a[axis]).powi(2)).sum::<f64>().sqrt();
        let of = |(index, point): (usize, &FollowedPoint)| {
            self.rows.iter().map(|(time, at)| (*time, way(point.rest, at[index]))).collect()
        };
        self.names.iter().map(String::as_str).zip(points.points().iter().enumerate().map(of)).collect()
    }

    /// `points.csv`, in the coordinates of the mesh.
    pub(crate) fn table(&self, centre: [f64; 3]) -> String {
        let mut text = String::from("time_s,name,x_m,y_m,z_m\n");
        for (time, positions) in &self.rows {
            for (name, position) in self.names.iter().zip(positions) {
                let [x, y, z] = [0, 1, 2].map(|axis| f64::from(position[axis]) + centre[axis]);
                // Writing to a string does not fail.
                let _ = writeln!(text, "{time:.6},{name},{x:.9},{y:.9},{z:.9}");
            }
        }
        text
    }
}
