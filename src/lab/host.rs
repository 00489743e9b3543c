//! A scene of the laboratory as the kernel sees it: vectors for storage, one generic body for both laws.

use std::vec;
use std::vec::Vec;

use super::LabError;
use super::scenes::{LawSpec, SceneSpec};
use crate::loads::Loads;
use crate::material::{Material, Tissue};
use crate::mesh::{Mesh, Winding};
use crate::scene::{ElementBlock, NodeInertia, Scene, blocks_for};
use crate::state::{NodeVector, State};

/// A scene over vectors.
pub type HostScene<M> = Scene<M, Vec<NodeInertia>, Vec<ElementBlock>>;
/// A state over vectors.
pub type HostState = State<Vec<NodeVector>>;

/// Something to do with a scene whose law is known at run time.
pub trait Job {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<M: Material + Copy>(self, material: M) -> Self::Output;
}

impl SceneSpec {
    /// Does `job` with the material of the scene.
    pub fn with_material<J: Job>(&self, job: J) -> J::Output {
        let density = self.density;
        match self.law {
            LawSpec::Exponential(law) => job.run(Tissue { law, density }),
            LawSpec::NeoHookean(law) => job.run(Tissue { law, density }),
        }
    }

    /// Builds the scene for the kernel.
    pub fn build<M: Material>(&self, material: M) -> Result<HostScene<M>, LabError> {
        let mesh = Mesh::new(&self.points, &self.tets, Winding::Checked)
            .map_err(|error| LabError::Build(error.into()))?;
        let nodes = vec![NodeInertia::EMPTY; self.points.len()];
        let blocks = vec![ElementBlock::EMPTY; blocks_for(self.tets.len())];
        let mut scene = Scene::over(material, nodes, blocks);
        scene.build(&mesh, &self.supports)?;
        Ok(scene)
    }

    /// The loads during an interval between two snapshots, counted from 0, checked against the scene.
    pub fn loads<M: Material>(&self, scene: &HostScene<M>, interval: usize) -> Result<Loads<'_>, LabError> {
        let released = self.released_after.is_some_and(|last| interval >= last);
        let forces = if released { &[] } else { self.forces.as_slice() };
        Ok(Loads::new(scene, [0.0; 3], forces, &self.motions)?)
    }

    /// A state with room for the scene, at rest.
    #[must_use]
    pub fn state(&self) -> HostState {
        let zeros = || vec![NodeVector::ZERO; self.points.len()];
        State::over(zeros(), zeros(), zeros())
    }
}
