//! A square bar of 20 mm twisted by a small angle: the torque `0.140577 G a^4 theta / L` of Saint-Venant (Timoshenko & Goodier,
//! section 109). Both ends turn as prescribed in their planes and are free to warp along the axis, so the closed form holds for a bar of
//! any length. nu 0.499, which torsion hardly feels.

use std::vec::Vec;

use super::body::{Body, Elastic, SceneWork};
use super::grid::Grid;
use super::rest::{Rest, at_rest};
use super::{LabError, Row, report};
use crate::element::ElementMaterial;
use crate::loads::{Loads, Motion};
use crate::material::Element;
use crate::scene::{Axes, Support, VecScene};
use crate::state::VecState;
use crate::tled;

pub(super) const NAME: &str = "torsion";
const WIDTH: f64 = 0.02;
const LENGTH: f64 = 0.01;
const ELASTIC: Elastic = Elastic { young: 1e5, poisson: 0.499 };
const ANGLE: f64 = 1e-3;
const CONSTANT: f64 = 0.140_577;
/// Cells across.
const MESHES: [u32; 3] = [4, 8, 16];
/// Lowest frequency, 1/s.
const OMEGA: f64 = 800.0;
const SOURCE: &str = "Saint-Venant; torsion constant 0.1406 a^4";

pub(super) fn rows(meshes: usize) -> Result<Vec<Row>, LabError> {
    let mut rows = Vec::new();
    let reference = CONSTANT * ELASTIC.shear() * WIDTH.powi(4) * ANGLE / LENGTH;
    for element in Element::ALL {
        let mut errors = Vec::new();
        for cells in MESHES.into_iter().take(meshes) {
            let body = body(cells);
            let end = body.grid.nodes(|[_, _, k]| k == body.grid.bar.cells[2]);
            let (value, us) = body.with(element, Run { body: &body, end: &end })?;
            errors.push((body.row(NAME, element, "exact"), f64::from(cells), value / reference - 1.0));
            rows.push(Row {
                quantity: "torque".into(),
                unit: "N m",
                value: Some(value),
                reference: Some(reference),
                source: SOURCE,
                us_per_simulated_second: Some(us),
                ..body.row(NAME, element, "exact")
            });
        }
        rows.extend(report::order_of_errors(&errors, ""));
    }
    Ok(rows)
}

fn body(cells: u32) -> Body {
    let map = |[x, y, z]: [f64; 3]| [WIDTH * (x - 0.5), WIDTH * (y - 0.5), LENGTH * z];
    let grid = Grid::new([cells, cells, cells / 2], 0.0, map);
    let in_plane = Axes::X.union(Axes::Y);
    let held = |plane: u32, moves: bool| {
        let nodes = grid.nodes(|[_, _, k]| k == plane);
        nodes.into_iter().map(move |node| Support { node, axes: in_plane, moves })
    };
    // The middle does not warp.
    let middle = Support { node: grid.bar.node(cells / 2, cells / 2, 0), axes: Axes::Z, moves: false };
    let supports = held(0, false).chain(held(cells / 2, true)).chain([middle]).collect();
    Body { grid, elastic: ELASTIC, density: 1000.0, supports, masses: Vec::new() }
}

struct Run<'a> {
    body: &'a Body,
    end: &'a [u32],
}

impl Run<'_> {
    /// The torque that turns the end, N m.
    fn torque<M: ElementMaterial>(&self, scene: &VecScene<M>, state: &mut VecState) -> f64 {
        if !tled::internal_forces(scene, state) {
            return f64::NAN;
        }
        let moment = |&node: &u32| {
            let [x, y, _] = self.body.grid.point(node);
            let [fx, fy, _] = state.forces()[node as usize].to_array().map(f64::from);
            x * fy - y * fx
        };
        -self.end.iter().map(moment).sum::<f64>()
    }
}

impl SceneWork for Run<'_> {
    /// Torque, N m, and microseconds for a simulated second.
    type Output = (f64, f64);

    fn run<M: ElementMaterial>(self, scene: &VecScene<M>) -> Result<Self::Output, LabError> {
        let motion = |&node: &u32| {
            let [x, y, _] = self.body.grid.point(node);
            let metre = [-ANGLE * y, ANGLE * x, 0.0].map(|x| x as f32);
            Motion { node, axes: Axes::X.union(Axes::Y), metre, ramp: (2.0 / OMEGA) as f32 }
        };
        let motions: Vec<Motion> = self.end.iter().map(motion).collect();
        let loads = Loads::new(scene, [0.0; 3], &[], &motions)?;
        let Rest { mut state, us_per_second } =
            at_rest(NAME, scene, &loads, OMEGA, |state| self.torque(scene, state))?;
        Ok((self.torque(scene, &mut state), us_per_second))
    }
}
