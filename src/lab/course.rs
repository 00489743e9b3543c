//! How the loads of a scene vary over time on top of their ramps: a factor of all forces and prescribed motions, or a
//! turn of gravity.

use glam::Vec3;
use supple::loads::{Loads, LoadsOverTime, Motion, NodalForce};
use supple::scene::AsScene;
use supple::state::StateView;

use super::LabError;
use super::scenes::SceneSpec;
use super::touched::TouchedSurface;

/// What becomes of the loads over time.
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
    /// One; gravity turns evenly to this direction (m/s^2) in this time, s.
    Turned([f32; 3], f64),
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

    /// Gravity at a time (s) if it is this one at the start, m/s^2.
    #[must_use]
    pub fn gravity(self, start: [f32; 3], time: f64) -> [f32; 3] {
        let Self::Turned(end, seconds) = self else { return start };
        let [from, to] = [start, end].map(Vec3::from_array);
        let share = (time / seconds).clamp(0.0, 1.0) as f32;
        (from.lerp(to, share).normalize_or_zero() * from.length()).to_array()
    }
}

/// The loads of a scene at the moment, checked against it.
#[derive(Clone, Debug)]
pub struct CurrentLoads<'a> {
    spec: &'a SceneSpec,
    forces: Vec<NodalForce>,
    motions: Vec<Motion>,
    touched: Option<TouchedSurface>,
    nodes: usize,
}

impl<'a> CurrentLoads<'a> {
    pub(super) fn new(spec: &'a SceneSpec, scene: &impl AsScene) -> Result<Self, LabError> {
        Loads::new(scene, spec.gravity, &spec.forces, &spec.motions)?;
        let (forces, motions) = (spec.forces.clone(), spec.motions.clone());
        let touched = spec.touched()?;
        Ok(Self { spec, forces, motions, touched, nodes: scene.as_scene().node_count() })
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
        let gravity = course.gravity(self.spec.gravity, time);
        let loads = Loads::unchecked(gravity, &self.forces, &self.motions, self.nodes);
        let touched = self.touched.as_ref();
        // Which was checked when it was made.
        match touched.and_then(|touched| touched.by(self.spec.instrument.as_slice()).ok()) {
            Some(contact) => loads.touched_by(contact),
            None => loads,
        }
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

    #[test]
    fn gravity_turns_and_keeps_its_size() {
        let course = Course::Turned([9.81, 0.0, 0.0], 0.5);
        let down = [0.0, 0.0, -9.81];
        let half = course.gravity(down, 0.25);
        assert!((half[0] + half[2]).abs() < 1e-5 && (half[0] - 9.81 * 0.5_f32.sqrt()).abs() < 1e-4, "{half:?}");
        assert_eq!(course.gravity(down, 3.0), [9.81, 0.0, 0.0]);
        assert_eq!((Course::Steady.gravity(down, 1.0), course.factor(0.1)), (down, 1.0));
    }
}
