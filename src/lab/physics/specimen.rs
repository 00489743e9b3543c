//! A body of one neo-Hookean tissue, `W = c (I1bar - 3) + d (J - 1)^2`, with its supports and point masses, and what is
//! measured on it with an element and a way to take steps. `c = E / (4 (1 + nu))`, `d = E / (6 (1 - 2 nu))`: half the
//! shear and half the bulk modulus, Pa. SI units.

use std::time::Duration;

use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::{Mesh, Winding};
use supple::scene::{Axes, BuildError, Support, VecScene};

use super::PhysicsRow;
use super::mesh::BodyMesh;
use super::steps::Steps;
use crate::LabError;

/// Young's modulus (Pa) and Poisson's ratio.
#[derive(Clone, Copy)]
pub(super) struct Elastic {
    pub(super) young: f64,
    pub(super) poisson: f64,
}

impl Elastic {
    /// Shear modulus, Pa.
    pub(super) fn shear(self) -> f64 {
        self.young / (2.0 * (1.0 + self.poisson))
    }

    /// Bulk modulus, Pa.
    pub(super) fn bulk(self) -> f64 {
        self.young / (3.0 * (1.0 - 2.0 * self.poisson))
    }

    fn law(self) -> NeoHookean {
        NeoHookean { c: (0.5 * self.shear()) as f32, d: (0.5 * self.bulk()) as f32 }
    }
}

/// A body.
pub(super) struct Specimen {
    pub(super) mesh: BodyMesh,
    pub(super) elastic: Elastic,
    /// kg/m^3.
    pub(super) density: f32,
    pub(super) supports: Vec<Support>,
    /// Nodes with point masses, kg.
    pub(super) masses: Vec<(u32, f32)>,
}

/// A body as a scene, and how it moves.
pub(super) struct Setup<'a> {
    /// The case, for errors.
    pub(super) case: &'static str,
    pub(super) scene: &'a VecScene<VecMaterial>,
    /// m.
    pub(super) points: &'a [[f32; 3]],
    pub(super) steps: Steps,
}

/// How long was simulated (s), and how long that took.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    pub(super) simulated: f64,
    pub(super) computing: Duration,
}

/// These nodes, fixed along axes.
pub(super) fn fixed(nodes: Vec<u32>, axes: Axes) -> Vec<Support> {
    nodes.into_iter().map(|node| Support { node, axes, moves: false }).collect()
}

impl Specimen {
    /// Does the work on a scene of an element; gives what it found and a row without quantity. If it finds nothing, the
    /// row says why.
    pub(super) fn measure<T>(
        &self,
        case: &'static str,
        element: Element,
        steps: Steps,
        work: impl FnOnce(&Setup<'_>) -> Result<(T, Cost), LabError>,
    ) -> (Option<T>, PhysicsRow) {
        let BodyMesh { points, .. } = &self.mesh;
        let found = self.build(element).and_then(|scene| work(&Setup { case, scene: &scene, points, steps }));
        let row = PhysicsRow {
            case,
            mesh: self.mesh.family,
            element,
            method: steps.name,
            nodes: self.mesh.points.len(),
            tetrahedra: self.mesh.tets.len(),
            quantity: String::new(),
            unit: "",
            value: None,
            reference: None,
            source: "",
            us_per_simulated_second: None,
            computing_seconds: None,
            note: String::new(),
        };
        match found {
            Ok((output, Cost { simulated, computing })) => {
                let seconds = computing.as_secs_f64();
                let us_per_simulated_second = Some(1e6 * seconds / simulated);
                (Some(output), PhysicsRow { us_per_simulated_second, computing_seconds: Some(seconds), ..row })
            }
            Err(LabError::Diverged { divergence, .. }) => (None, PhysicsRow { note: divergence.to_string(), ..row }),
            Err(error) => (None, PhysicsRow { note: error.to_string(), ..row }),
        }
    }

    fn build(&self, element: Element) -> Result<VecScene<VecMaterial>, LabError> {
        let BodyMesh { points, tets, .. } = &self.mesh;
        let mesh = Mesh::new(points, tets, Winding::Checked).map_err(BuildError::Mesh)?;
        let material = VecMaterial::one(element, self.elastic.law(), self.density);
        let mut scene = VecScene::build(material, &mesh, &self.supports)?;
        for &(node, kilogram) in &self.masses {
            scene.add_mass(node as usize, kilogram)?;
        }
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::super::silicone::{LOADS, body, grid};
    use super::super::steps::EXACT;
    use super::*;

    #[test]
    fn a_run_that_fails_says_why_in_its_row() {
        let body = body(grid([2, 1, 1]), LOADS[0]);
        let (value, row) = body.measure::<f64>("beam", Element::NodalPressure, EXACT, |setup| {
            Err(LabError::NotAtRest { case: setup.case, change: 0.01, kinetic: 1e-3 })
        });
        assert_eq!(value, None);
        let note = "beam did not come to rest: it still changes by 1.0e-2, kinetic energy over work is 1.0e-3";
        assert_eq!((row.note.as_str(), row.computing_seconds), (note, None));
    }
}
