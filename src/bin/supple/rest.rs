//! The shape at rest of a scene under its loads, by [`Simulation::settle`], for `supple fit` and `supple unloaded`. Units: m, s.

use supple::pulls::Pull;
use supple::simulation::{Event, Method, Settings, Simulation};
use supple::step::{Divergence, Status};

use crate::problem::Problem;
use crate::report::simulation::shape;
use crate::scene::setup::Setup;

/// At most so many steps to rest.
const MOST_STEPS: u32 = 200_000;
/// While supports move, steps over those at the critical step of the start, at most: tissue that collapses takes ever shorter ones.
const MOST_STEPS_OF_SUPPORTS: f64 = 10.0;

/// Why a body did not come to rest.
pub(crate) enum Unrest {
    /// The scene cannot be simulated at all.
    Problem(Problem),
    /// A step was refused.
    Diverged(Divergence),
    /// The tissue is crushed, so that steps become too short to go on.
    Crushed,
    /// It is still so many metres away from rest after all the steps that there are.
    Moves(f64),
}

impl From<Problem> for Unrest {
    fn from(problem: Problem) -> Self {
        Self::Problem(problem)
    }
}

impl Unrest {
    /// In words, about a scene.
    pub(crate) fn of(self, name: &str) -> Problem {
        match self {
            Self::Problem(problem) => problem,
            Self::Diverged(divergence) => Problem(format!(
                "{name}: on the way to rest the simulation {divergence}; make the tissue stiffer or the loads smaller"
            )),
            Self::Crushed => Problem(format!(
                "{name}: on the way to rest the loads crush the tissue, and steps become {MOST_STEPS_OF_SUPPORTS} times shorter; make the tissue stiffer \
                 or the loads smaller"
            )),
            Self::Moves(metres) => Problem(format!(
                "{name}: the body does not come to rest, it is still {:.3} mm away from it; is it held at all?",
                1e3 * metres
            )),
        }
    }
}

/// Displacement (m) of each node at rest, to `metre` (m): at the worst node so much of the way is left. It begins at
/// the displacements `from` (m), or without any. The scene's instruments are not there, and its damping and its method
/// do not matter; targets of pulls stay where they are at its end, or that of the longest ramp.
pub(crate) fn at_rest(setup: &Setup, from: Option<&[[f32; 3]]>, metre: f64) -> Result<Vec<[f32; 3]>, Unrest> {
    if !setup.instruments.is_empty() {
        return Err(Unrest::Problem(Problem(format!(
            "{}: a state at rest with instruments cannot be found; remove [[instrument]]",
            setup.body.name
        ))));
    }
    let mut simulation = setup.simulation()?;
    let limits = setup.pulls.limit(simulation.scene().view());
    // Loads act in full from the start, but supports move there: at once they would tear the tissue.
    let ramp = f64::from(setup.longest_ramp());
    let time = ramp.max(setup.time.end);
    let start = if setup.motions.is_empty() { time } else { 0.0 };
    let at = |node: usize| [from.map_or([0.0; 3], |from| from[node]), [0.0; 3]];
    simulation.state_mut().view().put(start, 0.0, at);
    let pulls = standing(setup, time, &limits);
    if ramp > start {
        move_supports(setup, &mut simulation, &pulls, ramp)?;
    }
    let mut loads = setup.acting(setup.loads(simulation.scene())?, &[], &pulls)?;
    let settled = simulation.settle_under(metre as f32, MOST_STEPS, &mut loads).map_err(Problem::of)?;
    match settled.status {
        Status::Diverged(divergence) => Err(Unrest::Diverged(divergence)),
        _ if settled.at_rest => Ok(shape(simulation.state())),
        _ => Err(Unrest::Moves(settled.remaining.into())),
    }
}

/// Moves on to a time (s), by exact steps without damping.
fn move_supports(setup: &Setup, simulation: &mut Simulation<'_>, pulls: &[Pull], until: f64) -> Result<(), Unrest> {
    let critical = simulation.critical_step().map_err(Problem::of)?.seconds;
    let most_steps = Some((MOST_STEPS_OF_SUPPORTS * until / f64::from(critical)).ceil() as u32);
    simulation.set(Settings { method: Method::Exact, damping: 0.0, most_steps, ..Settings::default() });
    let mut loads = setup.acting(setup.loads(simulation.scene())?, &[], pulls)?;
    let report = simulation.advance_under(until, &mut loads, &mut |_: Event<'_>| {}).map_err(Problem::of)?;
    match report.status {
        Status::Diverged(divergence) => Err(Unrest::Diverged(divergence)),
        Status::Behind { .. } => Err(Unrest::Crushed),
        _ => Ok(()),
    }
}

/// The pulls with their targets where they are at a time, s.
fn standing(setup: &Setup, time: f64, limits: &[f32]) -> Vec<Pull> {
    let mut pulls = setup.pulls.at(time, limits);
    for pull in &mut pulls {
        pull.put(pull.target(time).to_array());
    }
    pulls
}
