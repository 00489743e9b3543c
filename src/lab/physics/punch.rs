//! A flat circular punch of radius `a` = 10 mm without friction on a half-space: `F = 2 a E d / (1 - nu^2)` (Sneddon 1965). A quarter
//! of a cylinder of radius and depth 20 a, cells growing outwards; the nodes under the punch are moved by `d` = a / 1000. Its far
//! surfaces move as those of a half-space under the point load `s F` (Boussinesq). Runs with `s` = 0 and 1 give, as the body is
//! linear at so small a strain, the force that is its own far field, `F0 / (1 - (F1 - F0) / F)`; and `F0` over it, less one, is the
//! error of a body that ends there. nu 0.499.

use std::vec::Vec;

use super::body::{Body, Elastic, SceneWork};
use super::grid::Grid;
use super::rest::{Rest, at_rest};
use super::{LabError, Row, pressure};
use crate::element::ElementMaterial;
use crate::loads::{Loads, Motion};
use crate::material::Element;
use crate::scene::{Axes, Support, VecScene};
use crate::state::VecState;
use crate::tled;

pub(super) const NAME: &str = "punch";
const RADIUS: f64 = 0.01;
const DEPTH: f64 = 1e-5;
const ELASTIC: Elastic = Elastic { young: 1e5, poisson: 0.499 };
/// Growth of cells outside of the punch: `1 + 2 (exp(b) - 1) / b` = 20.
const GROWTH: f64 = 3.55;
/// Cells along the punch's radius; twice as many outside.
const MESHES: [u32; 3] = [2, 3, 4];
/// Lowest frequency, 1/s: a shear wave over the body.
const OMEGA: f64 = 50.0;
const SOURCE: &str = "Sneddon 1965; half-space; no friction";

pub(super) fn rows(meshes: usize) -> Result<Vec<Row>, LabError> {
    let mut rows = Vec::new();
    let Elastic { young, poisson } = ELASTIC;
    let reference = 2.0 * RADIUS * young * DEPTH / (1.0 - poisson * poisson);
    for cells in MESHES.into_iter().take(meshes) {
        let body = body(cells);
        for element in Element::ALL {
            let run = |share: f64| body.with(element, Run::new(&body, cells, element, share * reference));
            let ((fixed, ..), (moved, pressure, us)) = (run(0.0)?, run(1.0)?);
            let force = fixed / (1.0 - (moved - fixed) / reference);
            let row = |quantity: &str, unit, value| Row {
                quantity: quantity.into(),
                unit,
                value: Some(value),
                us_per_simulated_second: Some(us),
                ..body.row(NAME, element, "exact")
            };
            rows.push(Row { reference: Some(reference), source: SOURCE, ..row("force", "N", force) });
            rows.push(row("error if the body ended at its far surfaces", "%", 100.0 * (fixed / force - 1.0)));
            rows.extend(pressure::rows(pressure, &row("", "", 0.0)));
        }
    }
    Ok(rows)
}

/// Distance from the middle, m, for the parameter 0 to 1.
fn distance(parameter: f64) -> f64 {
    let inside = 3.0 * parameter;
    if inside <= 1.0 {
        return RADIUS * inside;
    }
    let outside = 0.5 * (inside - 1.0);
    RADIUS * (1.0 + 2.0 * ((GROWTH * outside).exp() - 1.0) / GROWTH)
}

fn body(cells: u32) -> Body {
    // Squares around the corner become quarters of circles.
    let map = |[s, t, z]: [f64; 3]| {
        let (radius, below) = (distance(s.max(t)), -distance(1.0 - z));
        if s == 0.0 && t == 0.0 {
            return [0.0, 0.0, below];
        }
        let angle = core::f64::consts::FRAC_PI_4 * if s >= t { t / s } else { 2.0 - s / t };
        [radius * angle.cos(), radius * angle.sin(), below]
    };
    let count = 3 * cells;
    let grid = Grid::new([count; 3], 0.0, map);
    let held = |axes: Axes, moves: bool, chosen: &dyn Fn([u32; 3]) -> bool| -> Vec<Support> {
        grid.nodes(chosen).into_iter().map(|node| Support { node, axes, moves }).collect()
    };
    let supports = [
        held(Axes::X, false, &|[i, ..]| i == 0),
        held(Axes::Y, false, &|[_, j, _]| j == 0),
        held(Axes::XYZ, true, &|at| is_far(at, count)),
        held(Axes::Z, true, &|at| is_under(at, cells)),
    ];
    Body { supports: supports.concat(), grid, elastic: ELASTIC, density: 1000.0, masses: Vec::new() }
}

fn is_far([i, j, k]: [u32; 3], count: u32) -> bool {
    i == count || j == count || k == 0
}

fn is_under([i, j, k]: [u32; 3], cells: u32) -> bool {
    i.max(j) <= cells && k == 3 * cells
}

/// Displacement (m) of a half-space below z = 0 under a force (N) down at its origin.
fn boussinesq([x, y, z]: [f64; 3], force: f64) -> [f64; 3] {
    let Elastic { young, poisson } = ELASTIC;
    let (below, across) = (-z, x.hypot(y));
    let distance = below.hypot(across);
    let factor = force * (1.0 + poisson) / (2.0 * core::f64::consts::PI * young);
    let outwards = factor
        * (across * below / distance.powi(3)
            - (1.0 - 2.0 * poisson) * across / (distance * (distance + below)));
    let down = factor * (below * below / distance.powi(3) + 2.0 * (1.0 - poisson) / distance);
    let share = if across > 0.0 { outwards / across } else { 0.0 };
    [share * x, share * y, -down]
}

struct Run<'a> {
    body: &'a Body,
    element: Element,
    under: Vec<u32>,
    motions: Vec<Motion>,
}

impl<'a> Run<'a> {
    fn new(body: &'a Body, cells: u32, element: Element, far_force: f64) -> Self {
        let ramp = (2.0 / OMEGA) as f32;
        let under = body.grid.nodes(|at| is_under(at, cells));
        let pressed =
            under.iter().map(|&node| Motion { node, axes: Axes::Z, metre: [0.0, 0.0, -DEPTH as f32], ramp });
        let far = body.grid.nodes(|at| is_far(at, 3 * cells)).into_iter().map(|node| {
            let metre = boussinesq(body.grid.point(node), far_force).map(|x| x as f32);
            Motion { node, axes: Axes::XYZ, metre, ramp }
        });
        let motions = pressed.chain(far).collect();
        Self { body, element, under, motions }
    }

    /// The force on the whole punch, N.
    fn force<M: ElementMaterial>(&self, scene: &VecScene<M>, state: &mut VecState) -> f64 {
        if !tled::internal_forces(scene, state) {
            return f64::NAN;
        }
        let forces = self.under.iter().map(|&node| f64::from(state.forces()[node as usize].to_array()[2]));
        4.0 * forces.sum::<f64>()
    }
}

impl SceneWork for Run<'_> {
    /// Force, N; oscillation of the pressure; microseconds for a simulated second.
    type Output = (f64, (f64, Option<f64>), f64);

    fn run<M: ElementMaterial>(self, scene: &VecScene<M>) -> Result<Self::Output, LabError> {
        let loads = Loads::new(scene, [0.0; 3], &[], &self.motions)?;
        let Rest { mut state, us_per_second } =
            at_rest(NAME, scene, &loads, OMEGA, |state| self.force(scene, state))?;
        let pressure = pressure::oscillation(self.body, self.element, state.displacements());
        Ok((self.force(scene, &mut state), pressure, us_per_second))
    }
}
