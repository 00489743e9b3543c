//! The shape at rest under loads, by exact steps with mass-proportional damping `mu = 2 omega`, critical for the lowest frequency
//! `omega` (1/s, an estimate of the case). It ends when a quantity changes by less than two in ten thousand over `1 / omega`, three
//! times in a row, and the body stands still. Displacements are float32: what is left of the way to rest is at least `6e-8 / (omega dt)` of it.

use std::time::{Duration, Instant};

use crate::element::ElementMaterial;
use crate::lab::LabError;
use crate::loads::Loads;
use crate::scene::VecScene;
use crate::state::VecState;
use crate::step::{Status, Step};
use crate::tled;

/// A body at rest.
pub(super) struct Rest {
    pub(super) state: VecState,
    /// Computing time for a simulated second, microseconds.
    pub(super) us_per_second: f64,
}

/// Share of the critical step: tissue stiffens on the way.
const SAFETY: f32 = 0.9;
/// Rounding of float32 in a sum of forces is half of it.
const TOLERANCE: f64 = 2e-4;
const MOST_WINDOWS: u32 = 120;
/// Kinetic energy over the work of the loads, at most: rounding of displacements leaves 1e-5 where steps are short.
const STILL: f64 = 3e-5;

/// Takes steps until `quantity` rests; fails where it does not.
pub(super) fn at_rest<M: ElementMaterial>(
    case: &'static str,
    scene: &VecScene<M>,
    loads: &Loads<'_>,
    omega: f64,
    quantity: impl Fn(&mut VecState) -> f64,
) -> Result<Rest, LabError> {
    let mut state = VecState::at_rest(scene.node_count());
    let (mut spent, mut calm, mut latest) = (Duration::ZERO, 0, f64::NAN);
    for window in 1..=MOST_WINDOWS {
        let critical =
            tled::critical_step(scene, &mut state).ok_or(LabError::NoCriticalStep { scene: case })?;
        let step = Step::unchecked(SAFETY * critical.seconds, 2.0 * omega as f32)?;
        let start = Instant::now();
        while state.time() * omega < f64::from(window) {
            if let Status::Diverged(divergence) = tled::step(scene, loads, &mut state, &step) {
                return Err(LabError::Diverged { scene: case, divergence });
            }
        }
        spent += start.elapsed();
        let value = quantity(&mut state);
        let settled = (value - latest).abs() <= TOLERANCE * value.abs();
        calm = if settled { calm + 1 } else { 0 };
        latest = value;
        if calm == 3 && state.energy_balance().kinetic <= STILL * state.energy_balance().work.abs() {
            let us_per_second = 1e6 * spent.as_secs_f64() / state.time();
            return Ok(Rest { state, us_per_second });
        }
    }
    Err(LabError::NotAtRest { case })
}

/// Mean displacement (m) of nodes along an axis.
pub(super) fn mean_displacement(state: &VecState, nodes: &[u32], axis: usize) -> f64 {
    let sum: f64 =
        nodes.iter().map(|&node| f64::from(state.displacements()[node as usize].to_array()[axis])).sum();
    sum / nodes.len() as f64
}
