//! Cook's membrane: a tapered panel with the corners (0, 0), (48, 44), (48, 60), (0, 44) mm, clamped at the left, under a dead shear
//! traction of 6.25 MPa up its right side; plane strain, large deformation. The vertical displacement of the upper right corner.
//! The published benchmark has our law, `G/2 (I1bar - 3) + K/2 (J - 1)^2`, with E 240.565 MPa and nu 0.499 (G 80.2 MPa,
//! K 40,094 MPa). Plane strain in tetrahedra: a sheet one cell thick that does not move along its normal.

use std::vec::Vec;

use super::body::{Body, Elastic, SceneWork};
use super::grid::Grid;
use super::rest::{Rest, at_rest, mean_displacement};
use super::{LabError, Row, pressure, report};
use crate::element::ElementMaterial;
use crate::loads::{Loads, NodalForce};
use crate::material::Element;
use crate::scene::{Axes, Support, VecScene};

pub(super) const NAME: &str = "cook";
const ELASTIC: Elastic = Elastic { young: 240.565e6, poisson: 0.499 };
const TRACTION: f64 = 6.25e6;
/// 30 quadrilaterals a side. Their sequence of meshes (6.746, 6.824, 6.859, 6.873, 6.891 mm with 10, 15, 20, 25, 30) goes on to about
/// 6.92 mm.
const REFERENCE: f64 = 6.8914;
const SOURCE: &str = "OpenGeoSys benchmark CooksMembrane; large deformation; F-bar; 30 elements a side (after de Souza Neto 1996 and Elguedj 2008)";
/// Cells along each side.
const MESHES: [u32; 3] = [8, 16, 32];
/// Lowest frequency, 1/s: of a clamped bar of the panel's mean height.
const OMEGA: f64 = 6e3;

pub(super) fn rows(meshes: usize) -> Result<Vec<Row>, LabError> {
    let mut rows = Vec::new();
    for element in Element::ALL {
        let mut values = Vec::new();
        for cells in MESHES.into_iter().take(meshes) {
            let body = body(cells);
            let right = body.grid.nodes(|[i, ..]| i == cells);
            let forces = body.grid.traction(&right, (2.0 / OMEGA) as f32, |_| [0.0, TRACTION, 0.0]);
            let corner = body.grid.nodes(|[i, j, _]| i == cells && j == cells);
            let run = Run { body: &body, element, forces: &forces, corner: &corner };
            let (value, pressure, us) = body.with(element, run)?;
            let row = |quantity: &str, unit, value| Row {
                quantity: quantity.into(),
                unit,
                value: Some(value),
                us_per_simulated_second: Some(us),
                ..body.row(NAME, element, "exact")
            };
            values.push((body.row(NAME, element, "exact"), f64::from(cells), value));
            rows.push(Row {
                reference: Some(REFERENCE),
                source: SOURCE,
                ..row("rise of the corner", "mm", 1e3 * value)
            });
            rows.extend(pressure::rows(pressure, &row("", "", 0.0)));
        }
        rows.extend(report::order_of_differences(&values));
    }
    Ok(rows)
}

fn body(cells: u32) -> Body {
    let thickness = 0.044 / f64::from(cells);
    let map = |[s, t, z]: [f64; 3]| [0.048 * s, 0.044 * s + t * (0.044 - 0.028 * s), thickness * z];
    let grid = Grid::new([cells, cells, 1], 0.0, map);
    let plane = grid.nodes(|_| true).into_iter().map(|node| Support { node, axes: Axes::Z, moves: false });
    let clamped = grid.nodes(|[i, ..]| i == 0).into_iter().map(Support::fixed);
    let supports = plane.chain(clamped).collect();
    Body { grid, elastic: ELASTIC, density: 1000.0, supports, masses: Vec::new() }
}

struct Run<'a> {
    body: &'a Body,
    element: Element,
    forces: &'a [NodalForce],
    corner: &'a [u32],
}

impl SceneWork for Run<'_> {
    /// Rise, m; oscillation of the pressure; microseconds for a simulated second.
    type Output = (f64, (f64, Option<f64>), f64);

    fn run<M: ElementMaterial>(self, scene: &VecScene<M>) -> Result<Self::Output, LabError> {
        let loads = Loads::new(scene, [0.0; 3], self.forces, &[])?;
        let Rest { state, us_per_second } =
            at_rest(NAME, scene, &loads, OMEGA, |state| mean_displacement(state, self.corner, 1))?;
        let pressure = pressure::oscillation(self.body, self.element, state.displacements());
        Ok((mean_displacement(&state, self.corner, 1), pressure, us_per_second))
    }
}
