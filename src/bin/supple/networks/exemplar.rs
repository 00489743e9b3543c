//! The scene whose motion a network learns from: one of the laboratory's, or a scene file's, with the steps of the exact motion.

use std::path::Path;

use supple::lab::course::Course;
use supple::lab::scenes::{RigidVelocity, SceneSpec};
use supple::lab::timing::Timing;
use supple::tled;
use supple::train::recipe::Recipe;

use crate::problem::Problem;
use crate::scene::file::SceneFile;
use crate::scene::setup::Setup;
use crate::scene::timing::StepChoice;

/// Share of the critical step at rest that exact steps take unless the file says otherwise: it falls while the body deforms, and the
/// steps of one training are all alike.
const SHARE: f32 = 0.5;
/// Exact steps between snapshots, which training does not take.
const INTERVAL: u32 = 1_000;

/// The scene of a recipe, which is found in the folder of `file`.
pub(super) fn learned_from(recipe: &Recipe, file: &Path) -> Result<SceneSpec, Problem> {
    let problem = |error: &dyn std::fmt::Display| Problem::in_file(file, error);
    if !recipe.motion.is_file() {
        return recipe.scene().map_err(|error| problem(&error));
    }
    let path = file.parent().unwrap_or(Path::new("")).join(&recipe.motion.scene);
    let scene = SceneFile::read(&path)?;
    let setup = Setup::read(&scene)?;
    for warning in &setup.warnings {
        crate::screen::message!("warning: {warning}");
    }
    spec_of(&setup).map(|spec| recipe.motion.of(spec)).map_err(|error| Problem::in_file(&path, error))
}

fn spec_of(setup: &Setup) -> Result<SceneSpec, Problem> {
    let refused = |what: &str| {
        Err(Problem(format!("{what}: a network learns from exact steps of one tissue without instruments")))
    };
    if setup.method_name() != "tled" {
        return refused(&format!("the method is {:?}", setup.method_name()));
    }
    if !setup.tools.is_empty() {
        return refused("there is an instrument");
    }
    let Some(tissue) = setup.tissues.only() else { return refused("there are regions") };
    let step = match setup.time.step {
        StepChoice::Seconds(seconds) => seconds,
        StepChoice::Auto => SHARE * critical_at_rest(setup)?,
        StepChoice::Multiple(multiple) => multiple * critical_at_rest(setup)?,
    };
    let timing = Timing { step, interval: INTERVAL, refinement: 1 };
    Ok(SceneSpec {
        name: String::leak(setup.body.name.clone()),
        points: setup.body.local.clone(),
        tets: setup.body.checked()?.tets().collect(),
        law: tissue.law,
        element: setup.element,
        density: tissue.density,
        damping: setup.damping,
        supports: setup.supports.clone(),
        start: RigidVelocity::default(),
        gravity: setup.gravity,
        forces: setup.forces.clone(),
        motions: setup.motions.clone(),
        course: Course::Steady,
        second: None,
        timing,
        intervals: (setup.time.end / timing.interval_seconds()).ceil() as usize,
    })
}

/// The critical step at rest, s.
fn critical_at_rest(setup: &Setup) -> Result<f32, Problem> {
    let (scene, mut state) = setup.build()?;
    let critical = tled::critical_step(&scene, &mut state);
    critical.map(|step| step.seconds).ok_or_else(|| Problem("no node can move".into()))
}
