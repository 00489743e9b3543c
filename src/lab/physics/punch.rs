//! A flat circular punch of radius `a` = 10 mm without friction on a half-space: `F = 2 a E d / (1 - nu^2)` (Sneddon 1965). A quarter
//! of a cylinder of radius and depth 20 a, cells growing outwards; the nodes under the punch are moved by `d` = a / 1000. Its far
//! surfaces move as those of a half-space under the point load `s F` (Boussinesq). Runs with `s` = 0 and 1 give, as the body is
//! linear at so small a strain, the force that is its own far field, `F0 / (1 - (F1 - F0) / F)`; and `F0` over it, less one, is the
//! error of a body that ends there. nu 0.499.

use supple::loads::{Loads, Motion};
use supple::material::Element;
use supple::scene::{Axes, Support};
use supple::state::VecState;
use supple::tled;

use super::mesh::{BodyMesh, same};
use super::pressure::Oscillation;
use super::specimen::{Cost, Elastic, Setup, Specimen, fixed};
use super::steps::TO_REST;
use super::{LabError, PhysicsRow, pressure};

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

pub(super) fn rows(meshes: usize) -> Result<Vec<PhysicsRow>, LabError> {
    let mut rows = Vec::new();
    let Elastic { young, poisson } = ELASTIC;
    let reference = 2.0 * RADIUS * young * DEPTH / (1.0 - poisson * poisson);
    for cells in MESHES.into_iter().take(meshes) {
        let body = body(cells);
        for element in Element::ALL {
            for steps in TO_REST {
                let run = |share: f64| {
                    body.measure(NAME, element, steps, |setup| pressed(setup, &body, element, share * reference))
                };
                let ((standing, of_standing), (moved, of_moved)) = (run(0.0), run(1.0));
                let oscillation = moved.map(|(_, oscillation)| oscillation);
                let forces = standing.zip(moved).map(|((standing, _), (moved, _))| {
                    let force = standing / (1.0 - (moved - standing) / reference);
                    (force, 100.0 * (standing / force - 1.0))
                });
                let computing = of_standing.computing_seconds.zip(of_moved.computing_seconds);
                let note = if standing.is_none() { of_standing.note } else { of_moved.note.clone() };
                let row = PhysicsRow { computing_seconds: computing.map(|(a, b)| a + b), note, ..of_moved };
                rows.push(PhysicsRow {
                    quantity: "force".into(),
                    unit: "N",
                    value: forces.map(|(force, _)| force),
                    reference: Some(reference),
                    source: SOURCE,
                    ..row.clone()
                });
                rows.push(PhysicsRow {
                    quantity: "error if the body ended at its far surfaces".into(),
                    unit: "%",
                    value: forces.map(|(_, error)| error),
                    ..row.clone()
                });
                rows.extend(pressure::rows(oscillation, &row));
            }
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

fn body(cells: u32) -> Specimen {
    // Squares around the corner become quarters of circles.
    let map = |[s, t, z]: [f64; 3]| {
        let (radius, below) = (distance(s.max(t)), -distance(1.0 - z));
        if s == 0.0 && t == 0.0 {
            return [0.0, 0.0, below];
        }
        let angle = core::f64::consts::FRAC_PI_4 * if s >= t { t / s } else { 2.0 - s / t };
        [radius * angle.cos(), radius * angle.sin(), below]
    };
    let mesh = BodyMesh::grid([3 * cells; 3], map);
    let moved = |axes: Axes, nodes: Vec<u32>| -> Vec<Support> {
        nodes.into_iter().map(|node| Support { node, axes, moves: true }).collect()
    };
    let supports = [
        fixed(mesh.nodes(|[x, ..]| same(x, 0.0)), Axes::X),
        fixed(mesh.nodes(|[_, y, _]| same(y, 0.0)), Axes::Y),
        moved(Axes::XYZ, mesh.nodes(is_far)),
        moved(Axes::Z, mesh.nodes(is_under)),
    ];
    Specimen { supports: supports.concat(), mesh, elastic: ELASTIC, density: 1000.0, masses: Vec::new() }
}

fn is_far([x, y, z]: [f64; 3]) -> bool {
    same(x.hypot(y), distance(1.0)) || same(-z, distance(1.0))
}

fn is_under([x, y, z]: [f64; 3]) -> bool {
    (x.hypot(y) < RADIUS || same(x.hypot(y), RADIUS)) && same(z, 0.0)
}

/// Displacement (m) of a half-space below z = 0 under a force (N) down at its origin.
fn boussinesq([x, y, z]: [f64; 3], force: f64) -> [f64; 3] {
    let Elastic { young, poisson } = ELASTIC;
    let (below, across) = (-z, x.hypot(y));
    let distance = below.hypot(across);
    let factor = force * (1.0 + poisson) / (2.0 * core::f64::consts::PI * young);
    let outwards =
        factor * (across * below / distance.powi(3) - (1.0 - 2.0 * poisson) * across / (distance * (distance + below)));
    let down = factor * (below * below / distance.powi(3) + 2.0 * (1.0 - poisson) / distance);
    let share = if across > 0.0 { outwards / across } else { 0.0 };
    [share * x, share * y, -down]
}

/// The force on the whole punch, N, and oscillation of the pressure. Far surfaces move as those of a half-space under
/// `far_force`.
fn pressed(
    setup: &Setup<'_>,
    body: &Specimen,
    element: Element,
    far_force: f64,
) -> Result<((f64, Oscillation), Cost), LabError> {
    let ramp = (2.0 / OMEGA) as f32;
    let under = body.mesh.nodes(is_under);
    let pressed = under.iter().map(|&node| Motion { node, axes: Axes::Z, metre: [0.0, 0.0, -DEPTH as f32], ramp });
    let far = body.mesh.nodes(is_far).into_iter().map(|node| {
        let metre = boussinesq(body.mesh.point(node), far_force).map(|x| x as f32);
        Motion { node, axes: Axes::XYZ, metre, ramp }
    });
    let motions: Vec<Motion> = pressed.chain(far).collect();
    let force = |state: &mut VecState| {
        if !tled::internal_forces(setup.scene, state) {
            return f64::NAN;
        }
        let forces = under.iter().map(|&node| f64::from(state.forces()[node as usize].to_array()[2]));
        4.0 * forces.sum::<f64>()
    };
    let loads = Loads::new(setup.scene, [0.0; 3], &[], &motions)?;
    let (mut state, cost) = setup.at_rest(&loads, OMEGA, force)?;
    let pressure = pressure::oscillation(body, element, state.displacements());
    Ok(((force(&mut state), pressure), cost))
}
