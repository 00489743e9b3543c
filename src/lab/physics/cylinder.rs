//! A thick-walled cylinder under internal pressure, radii 10 and 20 mm, small strain, plane strain: Lamé's solution
//! `u(r) = (1 + nu) / E  p a^2 / (b^2 - a^2) ((1 - 2 nu) r + b^2 / r)` at both radii. A quarter of it, nu 0.499, on regular and on
//! irregular meshes. The pressure is a dead load on the flat triangles of the inner surface.

use std::vec::Vec;

use super::body::{Body, Elastic, SceneWork};
use super::grid::Grid;
use super::rest::{Rest, at_rest};
use super::{LabError, Row, report};
use crate::element::ElementMaterial;
use crate::loads::{Loads, NodalForce};
use crate::material::Element;
use crate::scene::{Axes, Support, VecScene};
use crate::state::VecState;

pub(super) const NAME: &str = "cylinder";
const INNER: f64 = 0.01;
const OUTER: f64 = 0.02;
const ELASTIC: Elastic = Elastic { young: 1e5, poisson: 0.499 };
/// Pressure over Young's modulus: the inner radius grows by four hundred-thousandths.
const PRESSURE: f64 = 2e-5;
/// Cells from the inner to the outer radius.
const MESHES: [u32; 3] = [4, 8, 16];
/// Of an irregular mesh, over the width of a cell.
const JITTER: f64 = 0.2;
/// Lowest frequency, 1/s: `1.47 sqrt(G / rho) / a` of the breathing mode, less for the oval one.
const OMEGA: f64 = 500.0;
const SOURCE: &str = "Lame; plane strain";

pub(super) fn rows(meshes: usize) -> Result<Vec<Row>, LabError> {
    let mut rows = Vec::new();
    for (jitter, mesh) in [(0.0, ""), (JITTER, "; irregular mesh")] {
        for element in Element::ALL {
            let mut errors = Vec::new();
            for cells in MESHES.into_iter().take(meshes) {
                let body = body(cells, jitter);
                let inner = body.grid.nodes(|[i, ..]| i == 0);
                let outer = body.grid.nodes(|[i, ..]| i == cells);
                let pascal = PRESSURE * ELASTIC.young;
                let ramp = (2.0 / OMEGA) as f32;
                let forces = body.grid.traction(&inner, ramp, |normal| normal.map(|x| -pascal * x));
                let (values, us) =
                    body.with(element, Run { body: &body, forces: &forces, inner: &inner, outer: &outer })?;
                for ((value, radius), name) in values.into_iter().zip([INNER, OUTER]).zip(["inner", "outer"])
                {
                    rows.push(Row {
                        quantity: std::format!("radial displacement of the {name} surface{mesh}"),
                        unit: "mm",
                        value: Some(1e3 * value),
                        reference: Some(1e3 * exact(radius)),
                        source: SOURCE,
                        us_per_simulated_second: Some(us),
                        ..body.row(NAME, element, "exact")
                    });
                }
                errors.push((
                    body.row(NAME, element, "exact"),
                    f64::from(cells),
                    values[0] / exact(INNER) - 1.0,
                ));
            }
            rows.extend(report::order_of_errors(&errors, mesh));
        }
    }
    Ok(rows)
}

/// Radial displacement, m.
fn exact(radius: f64) -> f64 {
    let Elastic { poisson, .. } = ELASTIC;
    let share = INNER * INNER / (OUTER * OUTER - INNER * INNER);
    (1.0 + poisson) * PRESSURE * share * ((1.0 - 2.0 * poisson) * radius + OUTER * OUTER / radius)
}

fn body(cells: u32, jitter: f64) -> Body {
    let thickness = (OUTER - INNER) / f64::from(cells);
    let map = |[s, t, z]: [f64; 3]| {
        let (radius, angle) = (INNER + (OUTER - INNER) * s, core::f64::consts::FRAC_PI_2 * t);
        [radius * angle.cos(), radius * angle.sin(), thickness * z]
    };
    let grid = Grid::new([cells, 2 * cells, 1], jitter, map);
    let held = |axes: Axes, chosen: &dyn Fn([u32; 3]) -> bool| -> Vec<Support> {
        grid.nodes(chosen).into_iter().map(|node| Support { node, axes, moves: false }).collect()
    };
    let supports = [
        held(Axes::Z, &|_| true),
        held(Axes::Y, &|[_, j, _]| j == 0),
        held(Axes::X, &|[_, j, _]| j == 2 * cells),
    ]
    .concat();
    Body { grid, elastic: ELASTIC, density: 1000.0, supports, masses: Vec::new() }
}

struct Run<'a> {
    body: &'a Body,
    forces: &'a [NodalForce],
    inner: &'a [u32],
    outer: &'a [u32],
}

impl Run<'_> {
    /// Mean radial displacement of nodes, m.
    fn radial(&self, state: &VecState, nodes: &[u32]) -> f64 {
        let sum: f64 = nodes
            .iter()
            .map(|&node| {
                let [x, y, _] = self.body.grid.point(node);
                let [u, v, _] = state.displacements()[node as usize].to_array().map(f64::from);
                (u * x + v * y) / x.hypot(y)
            })
            .sum();
        sum / nodes.len() as f64
    }
}

impl SceneWork for Run<'_> {
    /// Radial displacements, m, and microseconds for a simulated second.
    type Output = ([f64; 2], f64);

    fn run<M: ElementMaterial>(self, scene: &VecScene<M>) -> Result<Self::Output, LabError> {
        let loads = Loads::new(scene, [0.0; 3], self.forces, &[])?;
        let Rest { state, us_per_second } =
            at_rest(NAME, scene, &loads, OMEGA, |state| self.radial(state, self.inner))?;
        Ok(([self.inner, self.outer].map(|nodes| self.radial(&state, nodes)), us_per_second))
    }
}
