//! What a training asks of a scene, wherever it comes from: a laboratory, a file, a program.

use std::boxed::Box;

use super::TrainError;
use crate::loads::{LoadsOverTime, NodalForce};
use crate::material::{AnyLaw, Element, Tissue, VecMaterial};
use crate::scene::{Support, VecScene};

/// A scene at rest whose exact motion a network learns from. SI units.
pub trait TrainingScene {
    /// Its tissue, which the weight file names.
    fn tissue(&self) -> Tissue<AnyLaw>;

    /// Its tetrahedra.
    fn element(&self) -> Element;

    /// Damping, proportional to mass, 1/s.
    fn damping(&self) -> f32;

    /// The exact step, s, which the network's is a multiple of.
    fn step(&self) -> f32;

    /// Held nodes, which are not sampled.
    fn supports(&self) -> &[Support];

    /// Forces; a node that is loaded alone is not sampled either ([`super::samples`]).
    fn forces(&self) -> &[NodalForce];

    /// Builds the scene.
    fn build(&self) -> Result<VecScene<VecMaterial>, TrainError>;

    /// What acts on it over time.
    fn loads(&self, scene: &VecScene<VecMaterial>) -> Result<Box<dyn LoadsOverTime + '_>, TrainError>;
}
