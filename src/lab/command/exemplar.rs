//! The scenes whose motions a network learns from: each one of the laboratory's, or a scene file's.

use std::path::Path;

use crate::training;
use supple::loads::{LoadsOverTime, NodalForce};
use supple::material::{AnyLaw, Element, Tissue, VecMaterial};
use supple::scene::{Support, VecScene};
use supple::tled;
use supple::train::recipe::{MotionRecipe, Recipe};
use supple::train::samples::Samples;
use supple::train::{TrainError, TrainingScene};
use supple_cli::problem::Problem;
use supple_cli::scene::file::SceneFile;
use supple_cli::scene::setup::Setup;
use supple_cli::scene::timing::StepChoice;
use supple_cli::screen::message;

/// Share of the critical step at rest that exact steps take unless the file says otherwise: it falls while the body
/// deforms, and the steps of one training are all alike.
const SHARE: f32 = 0.5;

/// The samples of a recipe, and the scene of its first motion. Scene files are found in the folder of `file`.
pub(super) fn learned_from(recipe: &Recipe, file: &Path) -> Result<(Box<dyn TrainingScene>, Samples), Problem> {
    let scenes = recipe.motion.iter().map(|motion| scene_of(motion, file)).collect::<Result<Vec<_>, _>>()?;
    let all: Vec<&dyn TrainingScene> = scenes.iter().map(|scene| &**scene).collect();
    let samples = Samples::collect(recipe, &all).map_err(|error| Problem::in_file(file, error))?;
    let first = scenes.into_iter().next().ok_or_else(|| Problem::in_file(file, "no motion"))?;
    Ok((first, samples))
}

fn scene_of(motion: &MotionRecipe, file: &Path) -> Result<Box<dyn TrainingScene>, Problem> {
    if !motion.is_file() {
        let scene = training::scene(motion).map_err(|error| Problem::in_file(file, error))?;
        return Ok(Box::new(scene));
    }
    let path = file.parent().unwrap_or(Path::new("")).join(&motion.scene);
    let setup = Setup::read(&SceneFile::read(&path)?)?;
    for warning in &setup.warnings {
        message!("warning: {warning}");
    }
    let mut scene = FileScene::of(setup).map_err(|error| Problem::in_file(&path, error))?;
    scene.setup.element = motion.element.unwrap_or(scene.setup.element);
    for force in &mut scene.setup.forces {
        force.newton = force.newton.map(|newton| motion.load * newton);
    }
    Ok(Box::new(scene))
}

/// A scene of one tissue that exact steps of one length move.
struct FileScene {
    setup: Setup,
    tissue: Tissue<AnyLaw>,
    /// s.
    step: f32,
}

impl FileScene {
    fn of(setup: Setup) -> Result<Self, Problem> {
        let refused = |what: &str| {
            Err(Problem(format!("{what}: a network learns from exact steps of one tissue without instruments")))
        };
        if setup.method_name() != "exact" {
            return refused(&format!("the method is {:?}", setup.method_name()));
        }
        if !setup.instruments.is_empty() {
            return refused("there is an instrument");
        }
        let Some(tissue) = setup.tissues.only() else { return refused("there are regions") };
        let step = match setup.time.step {
            StepChoice::Seconds(seconds) => seconds,
            StepChoice::Auto => SHARE * critical_at_rest(&setup)?,
            StepChoice::Multiple(multiple) => multiple * critical_at_rest(&setup)?,
        };
        Ok(Self { setup, tissue, step })
    }
}

/// The critical step at rest, s.
fn critical_at_rest(setup: &Setup) -> Result<f32, Problem> {
    let (scene, mut state) = setup.build()?;
    let critical = tled::critical_step(&scene, &mut state);
    critical.map(|step| step.seconds).ok_or_else(|| Problem("no node can move".into()))
}

impl TrainingScene for FileScene {
    fn tissue(&self) -> Tissue<AnyLaw> {
        self.tissue
    }

    fn element(&self) -> Element {
        self.setup.element
    }

    fn damping(&self) -> f32 {
        self.setup.damping
    }

    fn step(&self) -> f32 {
        self.step
    }

    fn supports(&self) -> &[Support] {
        &self.setup.supports
    }

    fn forces(&self) -> &[NodalForce] {
        &self.setup.forces
    }

    fn build(&self) -> Result<VecScene<VecMaterial>, TrainError> {
        let (scene, _) = self.setup.build().map_err(refused)?;
        Ok(scene)
    }

    fn loads(&self, scene: &VecScene<VecMaterial>) -> Result<Box<dyn LoadsOverTime + '_>, TrainError> {
        Ok(Box::new(self.setup.loads(scene).map_err(refused)?))
    }
}

fn refused(error: impl std::fmt::Display) -> TrainError {
    TrainError::Scene(error.to_string())
}
