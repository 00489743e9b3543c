//! Where the pulled points of a scene are at each frame.

use std::fmt::Write as _;

use supple::pulls::{Pulled, Pulls};
use supple::state::VecState;

/// Of each frame its time, s, and the pulls, m from the centre of the body.
#[derive(Default)]
pub(crate) struct PulledPoints {
    rows: Vec<(f64, Vec<Pulled>)>,
}

impl PulledPoints {
    /// Takes down a frame: the first so many pulls; what follows are springs.
    pub(crate) fn enter(&mut self, pulls: &Pulls<'_>, count: usize, state: &VecState) {
        let (time, forces) = (state.time(), state.pull_forces());
        let read = |index| pulls.read(index, state.displacements(), forces, time).unwrap_or_default();
        self.rows.push((time, (0..count).map(read).collect()));
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.at_end().is_empty()
    }

    /// The pulls at the last frame.
    pub(crate) fn at_end(&self) -> &[Pulled] {
        self.rows.last().map_or(&[], |(_, pulled)| pulled)
    }

    /// Of each pull the times of the frames, s, and its gaps, m.
    pub(crate) fn gaps(&self) -> Vec<Vec<(f64, f64)>> {
        let of = |index: usize| self.rows.iter().map(move |(time, pulled)| (*time, length(pulled[index].gap)));
        (0..self.at_end().len()).map(|index| of(index).collect()).collect()
    }

    /// `pulls.csv`, in the coordinates of the mesh.
    pub(crate) fn table(&self, centre: [f64; 3]) -> String {
        let mut text = String::from("time_s,pull,x_m,y_m,z_m,gap_x_m,gap_y_m,gap_z_m,force_x_n,force_y_n,force_z_n\n");
        for (time, pulled) in &self.rows {
            for (index, Pulled { point, gap, force }) in pulled.iter().enumerate() {
                let [x, y, z] = [0, 1, 2].map(|axis| f64::from(point[axis]) + centre[axis]);
                let ([a, b, c], [f, g, h]) = (gap, force);
                // Writing to a string does not fail.
                let _ = writeln!(
                    text,
                    "{time:.6},{index},{x:.9},{y:.9},{z:.9},{a:.6e},{b:.6e},{c:.6e},{f:.6e},{g:.6e},{h:.6e}"
                );
            }
        }
        text
    }
}

/// Of a vector.
pub(crate) fn length(vector: [f32; 3]) -> f64 {
    vector.iter().map(|component| f64::from(*component).powi(2)).sum::<f64>().sqrt()
}
