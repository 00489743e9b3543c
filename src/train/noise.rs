//! Rough motion for training (as in learned simulators, Sanchez-Gonzalez et al. 2020). The exact motion is smooth: from
//! it alone a network learns the gain `1/m` of force, with which steps beyond the explicit limit ring, and nothing of
//! how rough motion ends. So the free vertices of a frame are displaced at random, now by `e` and a step ago by `e'`,
//! the forces are those of the displaced body, and the target returns to the exact motion:
//!
//! ```text
//! at t: u + e, |u - u(t-D) + c| / D, f_e - K (u + e);   target (u(t+D) - 2 u + u(t-D) - back e - c) / D^2
//! c = before (e - e')
//! ```
//! The least-squares answer to a white `e` is a gain of force near `trace K / trace K^2 / D^2`, which is below the
//! limit of stability, `4 / D^2` over the largest eigenvalue of `K`; small forces, those of smooth motion, keep theirs.
//! With a `c` the network sees that force opposes velocity, as it does in ringing, and damps it.
//!
//! One vertex cannot tell `e`, so a loss as large as what is taken back remains; the more is taken back, the less an
//! error weighs ([`super::recipe::Noise::ease`]).

use std::vec::Vec;

use glam::DVec3;

use super::random_numbers::Random;
use super::recipe::Noise;
use crate::learned::frame::Frame;
use crate::learned::{FEATURES, VertexInput};
use crate::mlp::ForceInput;
use crate::state::{NodeVector, VecState};

impl Random {
    /// Above 0, up to 1.
    pub(super) fn unit(&mut self) -> f64 {
        ((self.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }

    /// Of mean zero and variance one (Box and Muller).
    fn normal(&mut self) -> f64 {
        let (radius, angle) = ((-2.0 * self.unit().ln()).sqrt(), core::f64::consts::TAU * self.unit());
        radius * angle.cos()
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.normal(), self.normal(), self.normal())
    }
}

/// How the network sees a force.
#[derive(Clone, Copy)]
pub(super) struct SeenAs<'a> {
    /// Lumped, of each node, kg.
    pub(super) masses: &'a [f32],
    pub(super) force: ForceInput,
}

impl SeenAs<'_> {
    pub(super) fn features(
        self,
        node: usize,
        frame: &Frame,
        displacement: [f32; 3],
        speed: f32,
        force: NodeVector,
    ) -> [f32; FEATURES] {
        let (force, mass) = (force.to_array(), self.masses[node]);
        VertexInput { displacement, speed, force, mass }.features(&frame.axes(), self.force)
    }
}

/// A moment of the exact motion.
pub(super) struct Moment<'a> {
    /// Before the exact step that computes its forces.
    pub(super) state: &'a VecState,
    /// Each vertex's frame, and its increment over the last `D`, m.
    pub(super) frames: &'a [Frame],
    pub(super) increments: &'a [DVec3],
    /// Vertices that may move.
    pub(super) free: &'a [bool],
    /// `D`, s.
    pub(super) long: f64,
    pub(super) seen_as: SeenAs<'a>,
}

/// A copy of a moment, moved at random.
pub(super) struct MovedCopy {
    pub(super) seen: Vec<MovedVertex>,
    /// In the loss.
    pub(super) weight: f32,
}

/// What a vertex of it sees.
pub(super) struct MovedVertex {
    pub(super) inputs: [f32; FEATURES],
    pub(super) frame: Frame,
    /// What the next step takes back, m.
    pub(super) back: DVec3,
}

impl Moment<'_> {
    /// A copy for the vertices `sampled`; `forces_of` computes the forces of a state.
    pub(super) fn moved(
        &self,
        noise: &Noise,
        sampled: &[usize],
        random: &mut Random,
        forces_of: impl Fn(&mut VecState),
    ) -> MovedCopy {
        let Self { state, frames, increments, free, long, seen_as } = *self;
        let sd = noise.least * (noise.most / noise.least).powf(random.unit());
        let mut moved = state.clone();
        let mut changes = Vec::with_capacity(free.len());
        for (place, &free) in moved.view().displacement.iter_mut().zip(free) {
            if !free {
                changes.push([DVec3::ZERO; 2]);
                continue;
            }
            let offset = sd * random.vector();
            let change = noise.before * (offset - sd * random.vector());
            for (component, offset) in place.0.iter_mut().zip(offset.to_array()) {
                *component += offset as f32;
            }
            changes.push([change, noise.back * offset + change]);
        }
        let places = moved.displacements().to_vec();
        forces_of(&mut moved);
        let seen = sampled.iter().map(|&node| {
            let [change, back] = changes[node];
            let increment = increments[node] + change;
            let mut frame = frames[node];
            frame.follow(increment.as_vec3().to_array());
            let speed = (increment.length() / long) as f32;
            let (place, force) = (places[node].to_array(), moved.forces()[node]);
            MovedVertex { inputs: seen_as.features(node, &frame, place, speed, force), frame, back }
        });
        let taken = (noise.back + noise.before).hypot(noise.before) * sd / (long * long);
        let ease = noise.ease * noise.ease;
        MovedCopy { seen: seen.collect(), weight: (ease / (ease + taken * taken)) as f32 }
    }
}
