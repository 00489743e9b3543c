//! A rigid instrument: shape, friction, and where it moves.

use glam::Vec3;

use super::ContactError;
use super::pose::{Placement, Pose};
use super::shape::Shape;

/// The most instruments that can touch a body at once.
pub const MOST_INSTRUMENTS: usize = 8;

/// A rigid instrument that moves on a line, and turns evenly, from one pose to another. A host sets both poses and
/// their times for each frame; before and after these times the instrument stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instrument<'a> {
    /// What it looks like.
    pub shape: Shape<'a>,
    /// Coulomb's coefficient of friction, zero or more.
    pub friction: f32,
    /// Where it starts.
    pub from: Pose,
    /// Where it ends.
    pub to: Pose,
    /// Times of both, s.
    pub times: [f64; 2],
}

impl<'a> Instrument<'a> {
    /// An instrument that stands still, without friction.
    #[must_use]
    pub const fn resting(shape: Shape<'a>, pose: Pose) -> Self {
        Self { shape, friction: 0.0, from: pose, to: pose, times: [0.0; 2] }
    }

    /// Moves on, from where it will be at the time `from` (s), to `pose` at the time `to`.
    pub fn move_to(&mut self, pose: Pose, from: f64, to: f64) {
        let Placement { position, rotation } = self.placement(from);
        self.from = Pose { position: position.to_array(), rotation: rotation.to_array() };
        (self.to, self.times) = (pose, [from, to]);
    }

    pub(super) fn check(&self, instrument: usize) -> Result<(), ContactError> {
        let bad = |what, value| Err(ContactError::Instrument { instrument, what, value });
        if let Some((what, value)) = self.shape.refused_size() {
            return bad(what, value);
        }
        if !(self.friction.is_finite() && self.friction >= 0.0) {
            return bad("friction", self.friction);
        }
        if let Some(&time) = self.times.iter().find(|time| !time.is_finite()) {
            return bad("time", time as f32);
        }
        if [self.from, self.to].iter().all(Pose::is_valid) { Ok(()) } else { Err(ContactError::Pose { instrument }) }
    }

    /// How far it goes between two times (s), m.
    pub(crate) fn way(&self, times: [f64; 2]) -> f32 {
        if times[0] >= self.times[1] {
            return 0.0;
        }
        let [from, to] = times.map(|time| self.placement(time).position);
        from.distance(to)
    }

    /// Distance of a point (m) to its surface at `time` (s), m; negative inside.
    #[must_use]
    pub fn distance(&self, point: [f32; 3], time: f64) -> f32 {
        self.shape.nearest(self.placement(time).in_shape(point.into())).0
    }

    /// Where its centre is at first, and the ends of its axis, m.
    pub(crate) fn axis(&self) -> [[f32; 3]; 3] {
        let placement = self.placement(self.times[0]);
        let half = match self.shape {
            Shape::Capsule { length, .. } => 0.5 * length,
            _ => 0.0,
        };
        [0.0, -half, half].map(|z| (placement.position + placement.turned(Vec3::Z * z)).to_array())
    }

    /// Where it is at `time`, s.
    pub(super) fn placement(&self, time: f64) -> Placement {
        let [start, end] = self.times;
        let share = if time >= end { 1.0 } else { ((time - start) / (end - start)).clamp(0.0, 1.0) };
        Placement::between(&self.from, &self.to, share as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stays_on_its_way_where_the_host_has_mistaken_the_times() {
        let mut ball = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at([0.0; 3]));
        ball.move_to(Pose::at([1.0; 3]), 2.0, 1.0);
        for time in [0.0, 0.5, 1.0, 1.5, 3.0] {
            assert!((0.0..=1.0).contains(&ball.placement(time).position.x), "{time}");
        }
    }
}
