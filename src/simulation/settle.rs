//! To rest, and from displacements of the host's, whatever the method.

use std::vec;

use super::owned::Acting;
use super::{Simulation, SimulationError};
use crate::loads::LoadsOverTime;
use crate::simd::NodeVector;
use crate::step::{CallingThread, Status, Threads};
use crate::tled::{self, Settled, settle_in_parts, vectors_to_settle};

/// Steps after which points of pulls turn with a body that comes to rest.
const FIRST_STEPS: u32 = 64;

impl Simulation<'_> {
    /// Brings the body to rest under its loads and instruments ([`tled::settle`]): every node to within about `metre` (m)
    /// of where it rests, in at most so many steps, each about as long as an exact one. Loads act as at the present
    /// time, which stands still, the points of pulls turned with the body ([`Simulation::turn_pulls`]), and
    /// velocities are zero afterwards; ablations are as far as they are due, and steps of every method go on from there. Where a
    /// step is refused the error says why; the body then stands where the steps before have brought it.
    pub fn settle(&mut self, metre: f32, most_steps: u32) -> Result<Settled, SimulationError> {
        self.settle_in_parts(metre, most_steps, &CallingThread)
    }

    /// The same, to the bit, on several threads of the host.
    pub fn settle_in_parts(
        &mut self,
        metre: f32,
        most_steps: u32,
        threads: &impl Threads,
    ) -> Result<Settled, SimulationError> {
        self.take_note()?;
        // What is refused turns nothing.
        self.acting()?;
        self.turn_pulls();
        let mut room = vec![NodeVector::ZERO; vectors_to_settle(self.scene().node_count())];
        // Pulls turn with the body when it is nearly at rest, before it is brought on.
        let (mut steps, mut most) = (0, if self.pulls.is_empty() { most_steps } else { FIRST_STEPS.min(most_steps) });
        loop {
            let Acting { mut loads, scene, state, .. } = self.acting()?;
            let settled = settle_in_parts(scene.view(), &mut loads, state.view(), metre, most, &mut room, threads)?;
            if let Status::Diverged(divergence) = settled.status {
                return Err(SimulationError::Refused(divergence));
            }
            steps += settled.steps;
            // Where it rests its pulls have turned it, and turn with it.
            let has_turned = !self.pulls.is_empty() && self.turn_pulls() > metre;
            let at_rest = settled.at_rest && !has_turned;
            if at_rest || steps >= most_steps || settled.steps == 0 {
                return Ok(Settled { at_rest, steps, ..settled });
            }
            most = most_steps - steps;
        }
    }

    /// The same under loads of the caller's in place of its own. A step that is refused is in the result, not an error.
    pub fn settle_under(
        &mut self,
        metre: f32,
        most_steps: u32,
        mut loads: &mut dyn LoadsOverTime,
    ) -> Result<Settled, SimulationError> {
        self.take_note()?;
        let (scene, state) = self.parts_mut();
        let mut room = vec![NodeVector::ZERO; vectors_to_settle(scene.node_count())];
        let (view, state) = (scene.view(), state.view());
        Ok(settle_in_parts(view, &mut loads, state, metre, most_steps, &mut room, &CallingThread)?)
    }

    /// Puts the nodes at these displacements (m, from rest), one for each, at a stop: velocities are zero and time stays
    /// ([`tled::displace`]). Steps are prepared anew from there, and pulls turn ([`Simulation::turn_pulls`]).
    pub fn set_displacements(&mut self, metre: &[[f32; 3]]) -> Result<(), SimulationError> {
        let (scene, state) = self.parts_mut();
        tled::displace(scene, state, metre)?;
        self.turn_pulls_anew();
        self.forget_steps();
        Ok(())
    }
}
