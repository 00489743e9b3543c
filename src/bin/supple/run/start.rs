//! A simulation at rest: what moves the scene, and the length of its steps. All that can be refused is refused here.

use supple::inertia::{Grid, Method};
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::simulation::{self, LONGEST_STEPS, Settings, Simulation};
use supple::step::{CriticalStep, Step};
use supple::tled::Pace;

use crate::problem::Problem;
use crate::scene::setup::Setup;
use crate::scene::timing::StepChoice;

/// A simulation at rest.
pub(crate) struct Start<'a> {
    pub(crate) at_rest: CriticalStep,
    /// The step that was asked for, with a network the exact one.
    pub(crate) step: Step,
    pub(crate) simulation: Simulation<'a>,
}

impl<'a> Start<'a> {
    pub(crate) fn new(setup: &'a Setup, unchecked: bool) -> Result<Self, Problem> {
        let mut simulation = setup.simulation()?;
        let at_rest = simulation.critical_step().map_err(Problem::of)?;
        let step = first_step(setup, at_rest, unchecked)?;
        if let Some(method) = &setup.time.method {
            grid(setup, simulation.scene().view(), method)?;
        }
        let method = match (&setup.time.method, &setup.learned) {
            (Some(method), _) if setup.time.is_adaptive => simulation::Method::Auto(*method),
            (Some(method), _) => simulation::Method::Long(*method),
            (None, Some(choice)) => choice.method()?,
            (None, None) => simulation::Method::Exact,
        };
        simulation.set(Settings {
            method,
            step: (!setup.time.sets_own_pace()).then_some(step.seconds()),
            damping: setup.damping,
            tolerance: setup.time.tolerance,
            guard: true,
            most_steps: None,
            // The step has been checked.
            unchecked: true,
        });
        simulation.prepare().map_err(|error| Problem(format!("{}: {error}", setup.body.name)))?;
        Ok(Self { at_rest, step, simulation })
    }
}

/// The lattice of a scene's method; steps may be prepared on a coarser one than is suggested. A mesh too small for the
/// lattice that its method wants is a problem.
pub(crate) fn grid(setup: &Setup, scene: SceneView<'_, VecMaterial>, method: &Method) -> Result<Grid, Problem> {
    let grid = method.grid(scene, &setup.body.local).map_err(|error| {
        let place = setup.time.lattice_at.as_ref().unwrap_or(&setup.body.name);
        Problem(format!("{place}: {error}"))
    })?;
    if grid.functions == 0 {
        return Err(Problem(format!(
            "{}: with {} elements the mesh is too small for long steps; write method = \"exact\" under [time]",
            setup.body.name,
            scene.element_count()
        )));
    }
    Ok(grid)
}

/// The step that the scene file asks for. The exact step is refused above the critical one unless `unchecked`.
pub(crate) fn first_step(setup: &Setup, at_rest: CriticalStep, unchecked: bool) -> Result<Step, Problem> {
    let time = &setup.time;
    let is_exact = time.method.is_none();
    let seconds = match time.step {
        StepChoice::Seconds(seconds) => seconds,
        StepChoice::Multiple(multiple) => multiple * at_rest.seconds,
        StepChoice::Auto if time.is_adaptive => {
            (LONGEST_STEPS * at_rest.seconds).min((time.end / f64::from(time.frames)) as f32)
        }
        StepChoice::Auto => Pace::SHARE * at_rest.seconds,
    };
    // An interval of a network is a whole number of exact steps.
    let seconds = match (&setup.learned, time.step) {
        (None, _) | (_, StepChoice::Auto) => seconds,
        (Some(learned), _) => learned.exact_seconds(seconds, time)?,
    };
    let step = if unchecked || !is_exact {
        Step::unchecked(seconds, setup.damping)
    } else {
        Step::new(seconds, setup.damping, at_rest)
    };
    let step = step.map_err(|error| {
        let advice = if is_exact {
            "; shorten it, write step = \"auto\", unchecked with --unchecked, or go beyond with method = \"long\""
        } else {
            ""
        };
        Problem(format!("{}: {error}{advice}", time.step_at))
    })?;
    if time.sets_own_pace() {
        return Ok(step);
    }
    time.check_length(seconds)?;
    if setup.learned.is_some() {
        return Ok(step);
    }
    Step::unchecked(fitted(seconds, time.end, time.frames), setup.damping).map_err(Problem::of)
}

/// The longest step, at most `seconds`, of which whole numbers reach the frames and the end (s) but for rounding; only
/// the end, if there are more frames than steps.
fn fitted(seconds: f32, end: f64, frames: u32) -> f32 {
    let longest = f64::from(seconds);
    let between_frames = end / f64::from(frames);
    let interval = if between_frames < longest { end } else { between_frames };
    // `seconds` may have been rounded down.
    let count = whole_steps(interval, longest * (1.0 + f64::from(f32::EPSILON)));
    ((interval / count) as f32).min(seconds)
}

/// The least number of equal steps, each at most `longest` (s), that make up a span (s).
fn whole_steps(span: f64, longest: f64) -> f64 {
    (span / longest).ceil().max(1.0)
}
