//! The shape at rest of a scene under its loads, for `supple fit` and `supple unloaded`.
//!
//! Exact steps without damping until the kinetic energy has passed its first peak, which is a quarter of a period after
//! the start: `omega = pi / (2 t)`. From there on with critical damping of that frequency, `mu = 2 omega` in proportion
//! to mass, until what is left of the way is less than asked for. Where that
//! does not come to rest, and where tissue relaxes, [`Simulation::settle`] does. Units: m, s.

use supple::pulls::Pull;
use supple::simulation::{Event, Method, Settings, Simulation};
use supple::step::{Divergence, Status};

use crate::problem::Problem;
use crate::report::simulation::shape;
use crate::scene::setup::Setup;

/// Steps between two looks at the kinetic energy.
const LOOK: f64 = 10.0;
/// The share of its peak below which the kinetic energy has passed it: less would take ripples for it.
const PASSED: f64 = 0.7;
/// At most so many looks before the first peak, and so many times `1 / omega` after it.
const MOST_LOOKS: u32 = 5_000;
const MOST_SPANS: u32 = 100;
/// Steps over those at the critical step of the start, at most: tissue that collapses takes ever shorter ones.
const MOST_STEPS: f64 = 10.0;
/// At most so many steps to rest of tissue that relaxes, or of a body that the damped motion does not bring there.
const MOST_STEPS_TO_SETTLE: u32 = 200_000;

/// Why a body did not come to rest.
pub(crate) enum Unrest {
    /// The scene cannot be simulated at all.
    Problem(Problem),
    /// A step was refused.
    Diverged(Divergence),
    /// The tissue is crushed, so that steps become too short to go on.
    Crushed,
    /// It still moves after all the time that there is, by so many metres in `1 / omega`.
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
                "{name}: on the way to rest the loads crush the tissue, and steps become {MOST_STEPS} times shorter; make the tissue stiffer \
                 or the loads smaller"
            )),
            Self::Moves(metres) => Problem(format!(
                "{name}: the body does not come to rest, it still moves by {:.3} mm; is it held at all?",
                1e3 * metres
            )),
        }
    }
}

/// Displacement (m) of each node at rest, to `metre` (m): at the worst node so much of the way is left. It begins at
/// the displacements `from` (m), or without any. The scene's instruments are not there, and its damping and its method
/// do not matter; targets of pulls stay where they are at its end, or that of the longest ramp.
pub(crate) fn at_rest(setup: &Setup, from: Option<&[[f32; 3]]>, metre: f64) -> Result<Vec<[f32; 3]>, Unrest> {
    let mut resting = Resting::new(setup, from)?;
    if setup.tissues.relax() {
        return resting.settled(metre);
    }
    let Some(omega) = resting.frequency(metre)? else { return Ok(resting.displacements()) };
    resting.damping = 2.0 * omega as f32;
    let (mut latest, mut before) = (resting.displacements(), f64::INFINITY);
    for _ in 0..MOST_SPANS {
        resting.advance(1.0 / omega)?;
        let now = resting.displacements();
        let change = largest_distance(&now, &latest);
        // Changes that shrink by the factor `q` add up to `q / (1 - q)` of the last.
        let shrinks = change / before;
        let left = change * shrinks / (1.0 - shrinks);
        if change == 0.0 || (change < metre && shrinks < 1.0 && left < metre) {
            return Ok(now);
        }
        (latest, before) = (now, change);
    }
    // Where the first peak was that of a fast motion, as along a body that hangs, the damping is too much for slow ones.
    resting.settled(metre)
}

/// The largest distance (m) between two sets of places.
pub(crate) fn largest_distance(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let square = |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|axis| f64::from(a[axis] - b[axis]).powi(2)).sum::<f64>();
    a.iter().zip(b).map(square).fold(0.0, f64::max).sqrt()
}

/// The pulls with their targets where they are at a time, s.
fn standing(setup: &Setup, time: f64, limits: &[f32]) -> Vec<Pull> {
    let mut pulls = setup.pulls.at(time, limits);
    for pull in &mut pulls {
        pull.put(pull.target(time).to_array());
    }
    pulls
}

struct Resting<'a> {
    setup: &'a Setup,
    simulation: Simulation<'a>,
    /// The most force of each pull, N.
    limits: Vec<f32>,
    /// When the targets of pulls are where they stay, s.
    time: f64,
    /// Of the start, s.
    critical: f64,
    /// 1/s.
    damping: f32,
}

impl<'a> Resting<'a> {
    fn new(setup: &'a Setup, from: Option<&[[f32; 3]]>) -> Result<Self, Unrest> {
        if !setup.instruments.is_empty() {
            return Err(Unrest::Problem(Problem(format!(
                "{}: a state at rest with instruments cannot be found; remove [[instrument]]",
                setup.body.name
            ))));
        }
        let mut simulation = setup.simulation()?;
        let critical = simulation.critical_step().map_err(Problem::of)?;
        // Loads act in full from the start, but supports move there: at once they would tear the tissue.
        let ramp = f64::from(setup.longest_ramp());
        let start = if setup.motions.is_empty() { ramp.max(setup.time.end) } else { 0.0 };
        let at = |node: usize| [from.map_or([0.0; 3], |from| from[node]), [0.0; 3]];
        simulation.state_mut().view().put(start, 0.0, at);
        let limits = setup.pulls.limit(simulation.scene().view());
        let (time, critical) = (ramp.max(setup.time.end), critical.seconds.into());
        let mut resting = Self { setup, simulation, limits, time, critical, damping: 0.0 };
        if ramp > start {
            resting.advance(ramp)?;
        }
        Ok(resting)
    }

    /// The displacements at rest of tissue that has had all the time to relax.
    fn settled(&mut self, metre: f64) -> Result<Vec<[f32; 3]>, Unrest> {
        let Self { setup, simulation, limits, time, .. } = self;
        let pulls = standing(setup, *time, limits);
        let mut loads = setup.acting(setup.loads(simulation.scene())?, &[], &pulls)?;
        let settled = simulation.settle_under(metre as f32, MOST_STEPS_TO_SETTLE, &mut loads).map_err(Problem::of)?;
        match settled.status {
            Status::Diverged(divergence) => Err(Unrest::Diverged(divergence)),
            _ if settled.at_rest => Ok(self.displacements()),
            _ => Err(Unrest::Moves(settled.remaining.into())),
        }
    }

    /// Moves on by so many seconds.
    fn advance(&mut self, seconds: f64) -> Result<(), Unrest> {
        let Self { setup, simulation, limits, time, critical, damping } = self;
        let most_steps = Some((MOST_STEPS * (seconds / *critical).max(MOST_STEPS)) as u32);
        if simulation.settings().damping != *damping || simulation.settings().most_steps != most_steps {
            simulation.set(Settings { method: Method::Exact, damping: *damping, most_steps, ..Settings::default() });
        }
        let pulls = standing(setup, *time, limits);
        let mut loads = setup.acting(setup.loads(simulation.scene())?, &[], &pulls)?;
        let until = simulation.state().time() + seconds;
        let report = simulation.advance_under(until, &mut loads, &mut |_: Event<'_>| {}).map_err(Problem::of)?;
        match report.status {
            Status::Diverged(divergence) => Err(Unrest::Diverged(divergence)),
            Status::Behind { .. } => Err(Unrest::Crushed),
            _ => Ok(()),
        }
    }

    /// The lowest frequency (1/s) by the first peak of the kinetic energy; none if nothing moves.
    fn frequency(&mut self, metre: f64) -> Result<Option<f64>, Unrest> {
        let span = LOOK * self.critical;
        let start = (self.displacements(), self.simulation.state().time());
        let (mut peak, mut peaked) = (0.0, 0.0);
        for _ in 0..MOST_LOOKS {
            self.advance(span)?;
            let kinetic = self.simulation.state().energy_balance().kinetic;
            if kinetic > peak {
                (peak, peaked) = (kinetic, self.simulation.state().time() - start.1);
            } else if kinetic <= PASSED * peak {
                return Ok(Some(core::f64::consts::FRAC_PI_2 / peaked));
            }
        }
        let moved = largest_distance(&self.displacements(), &start.0);
        if moved < metre { Ok(None) } else { Err(Unrest::Moves(moved)) }
    }

    fn displacements(&self) -> Vec<[f32; 3]> {
        shape(self.simulation.state())
    }
}
