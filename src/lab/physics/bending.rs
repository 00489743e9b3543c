//! A slender cantilever under a small end force: the tip's deflection by Timoshenko's beam, `P L^3 / (3 E I) + P L / (k G A)` with
//! Cowper's shear factor `k = 10 (1 + nu) / (12 + 11 nu)`. 80 x 10 x 10 mm, at nu 0.45 and 0.499. The held end may contract and
//! expand in its plane, as beam theory assumes: only its axial motion is held, and the motion of its two middle lines across.

use std::format;
use std::vec::Vec;

use super::body::{Body, Elastic, SceneWork};
use super::grid::Grid;
use super::rest::{Rest, at_rest, mean_displacement};
use super::{LabError, Row};
use crate::element::ElementMaterial;
use crate::loads::{Loads, NodalForce};
use crate::material::Element;
use crate::scene::{Axes, Support, VecScene};

pub(super) const NAME: &str = "bending";
const LENGTH: f64 = 0.08;
const WIDTH: f64 = 0.01;
const DENSITY: f64 = 1000.0;
/// Deflection over length, small against one.
const DEFLECTION: f64 = 1e-3;
const YOUNG: f64 = 1e5;
/// Cells across: even, for the middle lines.
const MESHES: [u32; 3] = [2, 4, 6];
const SOURCE: &str = "Timoshenko beam with the shear factor of Cowper 1966";

pub(super) fn rows(meshes: usize) -> Result<Vec<Row>, LabError> {
    let mut rows = Vec::new();
    for poisson in [0.45, 0.499] {
        for cells in MESHES.into_iter().take(meshes) {
            let elastic = Elastic { young: YOUNG, poisson };
            let body = body(cells, elastic);
            let inertia = WIDTH.powi(4) / 12.0;
            let shear_factor = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson);
            let per_newton = LENGTH.powi(3) / (3.0 * YOUNG * inertia)
                + LENGTH / (shear_factor * elastic.shear() * WIDTH * WIDTH);
            let reference = DEFLECTION * LENGTH;
            let tip = body.grid.nodes(|[i, ..]| i == body.grid.bar.cells[0]);
            let omega = 3.516 / LENGTH.powi(2) * (YOUNG * inertia / (DENSITY * WIDTH * WIDTH)).sqrt();
            let pascal = reference / per_newton / (WIDTH * WIDTH);
            let forces = body.grid.traction(&tip, (2.0 / omega) as f32, |_| [0.0, 0.0, -pascal]);
            for element in Element::ALL {
                let run = Run { forces: &forces, tip: &tip, omega };
                let (value, us) = body.with(element, run)?;
                rows.push(Row {
                    quantity: format!("tip deflection at nu {poisson}"),
                    unit: "mm",
                    value: Some(1e3 * value),
                    reference: Some(1e3 * reference),
                    source: SOURCE,
                    us_per_simulated_second: Some(us),
                    ..body.row(NAME, element, "exact")
                });
            }
        }
    }
    Ok(rows)
}

fn body(cells: u32, elastic: Elastic) -> Body {
    let map = |[x, y, z]: [f64; 3]| [LENGTH * x, WIDTH * y, WIDTH * z];
    let grid = Grid::new([8 * cells, cells, cells], 0.0, map);
    let held = |axes: Axes, chosen: &dyn Fn([u32; 3]) -> bool| -> Vec<Support> {
        let nodes = grid.nodes(|at| at[0] == 0 && chosen(at));
        nodes.into_iter().map(|node| Support { node, axes, moves: false }).collect()
    };
    let supports = [
        held(Axes::X, &|_| true),
        held(Axes::Y, &|[_, j, _]| j == cells / 2),
        held(Axes::Z, &|[_, _, k]| k == cells / 2),
    ]
    .concat();
    Body { grid, elastic, density: DENSITY as f32, supports, masses: Vec::new() }
}

struct Run<'a> {
    forces: &'a [NodalForce],
    tip: &'a [u32],
    omega: f64,
}

impl SceneWork for Run<'_> {
    /// Deflection, m, and microseconds for a simulated second.
    type Output = (f64, f64);

    fn run<M: ElementMaterial>(self, scene: &VecScene<M>) -> Result<Self::Output, LabError> {
        let loads = Loads::new(scene, [0.0; 3], self.forces, &[])?;
        let Rest { state, us_per_second } =
            at_rest(NAME, scene, &loads, self.omega, |state| mean_displacement(state, self.tip, 2))?;
        Ok((-mean_displacement(&state, self.tip, 2), us_per_second))
    }
}
