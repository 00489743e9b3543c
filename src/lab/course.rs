//! How the loads of a scene vary over time on top of their ramps: a factor of all forces and prescribed motions.

use supple::loads::{Loads, LoadsOverTime, Motion, NodalForce};
use supple::scene::AsScene;
use supple::state::StateView;

use super::LabError;
use super::scenes::SceneSpec;

/// The factor of the loads over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// One.
    Steady,
    /// Zero from this time (s) on.
    Released(f64),
    /// Minus one from this time (s) on.
    Reversed(f64),
    /// A sine of this period, s.
    Alternating(f64),
}

impl Course {
    /// The factor at a time (s).
    #[must_use]
    pub fn factor(self, time: f64) -> f32 {
        /// Times are sums of steps, s.
        const ROUNDING: f64 = 1e-9;
        match self {
            Self::Released(at) if time + ROUNDING >= at => 0.0,
            Self::Reversed(at) if time + ROUNDING >= at => -1.0,
            Self::Alternating(period) => (core::f64::consts::TAU * time / period).sin() as f32,
            _ => 1.0,
        }
    }
}

/// The loads of a scene at the moment, checked against it.
#[derive(Clone, Debug)]
pub struct CurrentLoads<'a> {
    spec: &'a SceneSpec,
    forces: Vec<NodalForce>,
    motions: Vec<Motion>,
    nodes: usize,
}

impl<'a> CurrentLoads<'a> {
    pub(super) fn new(spec: &'a SceneSpec, scene: &impl AsScene) -> Result<Self, LabError> {
        Loads::new(scene, spec.gravity, &spec.forces, &spec.motions)?;
        let (forces, motions) = (spec.forces.clone(), spec.motions.clone());
        Ok(Self { spec, forces, motions, nodes: scene.as_scene().node_count() })
    }

    /// The loads of a step of `dt` (s) that starts at `time` (s): forces of its start, motions of its end.
    pub fn of_step(&mut self, time: f64, dt: f64) -> Loads<'_> {
        let course = self.spec.course;
        if course != Course::Steady {
            for (force, whole) in self.forces.iter_mut().zip(&self.spec.forces) {
                force.newton = whole.newton.map(|newton| course.factor(time) * newton);
            }
            for (motion, whole) in self.motions.iter_mut().zip(&self.spec.motions) {
                motion.metre = whole.metre.map(|metre| course.factor(time + dt) * metre);
            }
        }
        Loads::unchecked(self.spec.gravity, &self.forces, &self.motions, self.nodes)
    }
}

impl LoadsOverTime for CurrentLoads<'_> {
    fn of_step(&mut self, state: &StateView<'_>, seconds: f32, _: u32) -> Loads<'_> {
        Self::of_step(self, state.time(), f64::from(seconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_change_at_their_times() {
        assert_eq!(Course::Released(0.51).factor(17.0 * 0.03), 0.0);
        assert_eq!(Course::Reversed(0.5).factor(0.4), 1.0);
        assert_eq!(Course::Reversed(0.5).factor(0.5), -1.0);
    }
}
