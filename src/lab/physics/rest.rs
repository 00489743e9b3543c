//! The shape at rest under loads, by steps with mass-proportional damping `mu = 2 omega`, critical for the lowest
//! frequency `omega` (1/s, an estimate of the case). It ends when a quantity changes by less than two in ten thousand
//! over `1 / omega`, three times in a row, and the body stands still. Displacements are float32: what is left of the
//! way to rest is at least `6e-8 / (omega dt)` of it.

use std::time::{Duration, Instant};

use supple::loads::Loads;
use supple::state::VecState;

use super::specimen::{Cost, Setup};
use super::steps::Kind;
use crate::LabError;

/// Rounding of float32 in a sum of forces is half of it.
const TOLERANCE: f64 = 2e-4;
const MOST_WINDOWS: u32 = 120;
/// The same for long steps, whose added inertia lets rough motion rest later.
const MOST_WINDOWS_OF_LONG: u32 = 1200;
/// Kinetic energy over the work of the loads, at most: rounding of displacements leaves 1e-5 where steps are short.
const STILL: f64 = 3e-5;

impl Setup<'_> {
    /// Takes steps from rest until `quantity` rests; fails where it does not.
    pub(super) fn at_rest(
        &self,
        loads: &Loads<'_>,
        omega: f64,
        quantity: impl Fn(&mut VecState) -> f64,
    ) -> Result<(VecState, Cost), LabError> {
        let mut state = VecState::at_rest(self.scene.node_count());
        let cost = self.settle(&mut state, loads, omega, quantity)?;
        Ok((state, cost))
    }

    /// The same from a state on.
    pub(super) fn settle(
        &self,
        state: &mut VecState,
        loads: &Loads<'_>,
        omega: f64,
        quantity: impl Fn(&mut VecState) -> f64,
    ) -> Result<Cost, LabError> {
        let (from, mut computing) = (state.time(), Duration::ZERO);
        let (mut calm, mut latest, mut change, mut kinetic) = (0, f64::NAN, f64::NAN, f64::NAN);
        let damping = 2.0 * omega as f32;
        let most = if matches!(self.steps.kind, Kind::Long(_)) { MOST_WINDOWS_OF_LONG } else { MOST_WINDOWS };
        let mut advance = self.advance(state, damping)?;
        for window in 1..=most {
            let start = Instant::now();
            advance(state, loads, from + f64::from(window) / omega)?;
            computing += start.elapsed();
            let value = quantity(state);
            change = (value / latest - 1.0).abs();
            kinetic = state.energy_balance().kinetic / state.energy_balance().work.abs();
            calm = if change <= TOLERANCE { calm + 1 } else { 0 };
            latest = value;
            // Backward Euler has no energy balance.
            if calm >= 3 && (kinetic.is_nan() || kinetic <= STILL) {
                return Ok(Cost { simulated: state.time() - from, computing });
            }
            // The critical step changes with the shape; long steps follow it by themselves.
            if self.steps.kind == Kind::Exact {
                advance = self.advance(state, damping)?;
            }
        }
        Err(LabError::NotAtRest { case: self.case, change, kinetic })
    }
}

/// Mean displacement (m) of nodes along an axis.
pub(super) fn mean_displacement(state: &VecState, nodes: &[u32], axis: usize) -> f64 {
    let sum: f64 = nodes.iter().map(|&node| f64::from(state.displacements()[node as usize].to_array()[axis])).sum();
    sum / nodes.len() as f64
}
