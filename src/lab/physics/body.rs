//! A body of one neo-Hookean tissue, `W = c (I1bar - 3) + d (J - 1)^2`, with its supports and point masses, and the element that it is
//! cut in. `c = E / (4 (1 + nu))`, `d = E / (6 (1 - 2 nu))`: half the shear and half the bulk modulus, Pa. SI units.

use std::vec::Vec;

use super::Row;
use super::grid::Grid;
use crate::element::{ElementMaterial, MaterialWork, with_element};
use crate::lab::LabError;
use crate::material::{Element, NeoHookean, Tissue};
use crate::mesh::{Mesh, Winding};
use crate::scene::{BuildError, Support, VecScene};

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
pub(super) struct Body {
    pub(super) grid: Grid,
    pub(super) elastic: Elastic,
    /// kg/m^3.
    pub(super) density: f32,
    pub(super) supports: Vec<Support>,
    /// Nodes with point masses, kg.
    pub(super) masses: Vec<(u32, f32)>,
}

/// What is done with a scene of either element.
pub(super) trait SceneWork {
    type Output;
    fn run<M: ElementMaterial>(self, scene: &VecScene<M>) -> Result<Self::Output, LabError>;
}

impl Body {
    /// Builds the scene with an element and does the work.
    pub(super) fn with<W: SceneWork>(&self, element: Element, work: W) -> Result<W::Output, LabError> {
        let tissue = Tissue { law: self.elastic.law(), density: self.density };
        with_element(element, tissue, OfBody { body: self, work })
    }

    /// A row without quantity.
    pub(super) fn row(&self, case: &'static str, element: Element, method: &'static str) -> Row {
        Row {
            case,
            element,
            method,
            nodes: self.grid.points.len(),
            tetrahedra: self.grid.tets.len(),
            quantity: "".into(),
            unit: "",
            value: None,
            reference: None,
            source: "",
            us_per_simulated_second: None,
        }
    }
}

/// Work with the scene of a body.
struct OfBody<'a, W> {
    body: &'a Body,
    work: W,
}

impl<W: SceneWork> MaterialWork for OfBody<'_, W> {
    type Output = Result<W::Output, LabError>;

    fn run<M: ElementMaterial>(self, material: M) -> Self::Output {
        let Body { grid: Grid { points, tets, .. }, supports, masses, .. } = self.body;
        let mesh = Mesh::new(points, tets, Winding::Checked).map_err(BuildError::Mesh)?;
        let mut scene = VecScene::build(material, &mesh, supports)?;
        for &(node, kilogram) in masses {
            scene.add_mass(node as usize, kilogram);
        }
        self.work.run(&scene)
    }
}
