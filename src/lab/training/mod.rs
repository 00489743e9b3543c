//! The laboratory's scenes for training (feature `train`), which networks of the learned step learn from
//! ([`supple::train`]).

use supple::loads::{LoadsOverTime, NodalForce};
use supple::material::{AnyLaw, Element, Tissue, VecMaterial};
use supple::scene::{Support, VecScene};
use supple::train::recipe::MotionRecipe;
use supple::train::{TrainError, TrainingScene};

use super::LabError;
use super::scenes::{self, SceneSpec};

impl From<LabError> for TrainError {
    fn from(error: LabError) -> Self {
        Self::Scene(error.to_string())
    }
}

impl TrainingScene for SceneSpec {
    fn tissue(&self) -> Tissue<AnyLaw> {
        Tissue { law: self.law, density: self.density }
    }

    fn element(&self) -> Element {
        self.element
    }

    fn damping(&self) -> f32 {
        self.damping
    }

    fn step(&self) -> f32 {
        self.timing.step
    }

    fn supports(&self) -> &[Support] {
        &self.supports
    }

    fn forces(&self) -> &[NodalForce] {
        &self.forces
    }

    fn build(&self) -> Result<VecScene<VecMaterial>, TrainError> {
        Ok(self.build()?)
    }

    fn loads(&self, scene: &VecScene<VecMaterial>) -> Result<Box<dyn LoadsOverTime + '_>, TrainError> {
        Ok(Box::new(self.loads(scene)?))
    }
}

/// The scene that a recipe's motion names, one of [`scenes::RAMPED`], with the load and the tetrahedra that it asks for.
pub fn scene(motion: &MotionRecipe) -> Result<SceneSpec, TrainError> {
    if !scenes::RAMPED.contains(&motion.scene.as_str()) {
        let must = format!("there are {}, and scene files, NAME.toml", scenes::RAMPED.join(", "));
        return Err(TrainError::refused("scene", format!("{:?}", motion.scene), &must));
    }
    let spec = scenes::named(&motion.scene)?.with_load(motion.load);
    Ok(SceneSpec { element: motion.element.unwrap_or(spec.element), ..spec })
}
