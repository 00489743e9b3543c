//! A square bar of 20 mm twisted by a small angle: the torque `0.140577 G a^4 theta / L` of Saint-Venant (Timoshenko &
//! Goodier, section 109). Both ends turn as prescribed in their planes and are free to warp along the axis, so the
//! closed form holds for a bar of any length. nu 0.499, which torsion hardly feels. The torque is that of the internal
//! forces at rest: reactions of long steps hold inertia as well.

use supple::loads::{Loads, Motion};
use supple::material::Element;
use supple::scene::{Axes, Support};
use supple::state::VecState;
use supple::tled;

use super::mesh::{BodyMesh, same};
use super::specimen::{Cost, Elastic, Setup, Specimen, fixed};
use super::steps::{EXACT, TO_REST};
use super::{LabError, PhysicsRow, report};

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

pub(super) fn rows(meshes: usize) -> Result<Vec<PhysicsRow>, LabError> {
    let mut rows = Vec::new();
    let reference = CONSTANT * ELASTIC.shear() * WIDTH.powi(4) * ANGLE / LENGTH;
    for element in Element::ALL {
        let mut errors = Vec::new();
        for cells in MESHES.into_iter().take(meshes) {
            let body = body(cells);
            let end = body.mesh.nodes(|[.., z]| same(z, LENGTH));
            for steps in TO_REST {
                let (value, row) = body.measure(NAME, element, steps, |setup| torque(setup, &body.mesh, &end));
                if let (Some(value), true) = (value, steps.kind == EXACT.kind) {
                    errors.push((row.clone(), f64::from(cells), value / reference - 1.0));
                }
                rows.push(PhysicsRow {
                    quantity: "torque".into(),
                    unit: "N m",
                    value,
                    reference: Some(reference),
                    source: SOURCE,
                    ..row
                });
            }
        }
        rows.extend(report::order_of_errors("torque", &errors));
    }
    Ok(rows)
}

fn body(cells: u32) -> Specimen {
    let map = |[x, y, z]: [f64; 3]| [WIDTH * (x - 0.5), WIDTH * (y - 0.5), LENGTH * z];
    let mesh = BodyMesh::grid([cells, cells, cells / 2], map);
    let in_plane = Axes::X.union(Axes::Y);
    let turned = mesh.nodes(|[.., z]| same(z, LENGTH)).into_iter();
    let supports = [
        fixed(mesh.nodes(|[.., z]| same(z, 0.0)), in_plane),
        turned.map(|node| Support { node, axes: in_plane, moves: true }).collect(),
        // The middle does not warp.
        fixed(mesh.nodes(|point| point.into_iter().all(|x| same(x, 0.0))), Axes::Z),
    ]
    .concat();
    Specimen { mesh, elastic: ELASTIC, density: 1000.0, supports, masses: Vec::new() }
}

/// The torque that turns the end, N m.
fn torque(setup: &Setup<'_>, mesh: &BodyMesh, end: &[u32]) -> Result<(f64, Cost), LabError> {
    let motion = |&node: &u32| {
        let [x, y, _] = mesh.point(node);
        let metre = [-ANGLE * y, ANGLE * x, 0.0].map(|x| x as f32);
        Motion { node, axes: Axes::X.union(Axes::Y), metre, ramp: (2.0 / OMEGA) as f32 }
    };
    let torque = |state: &mut VecState| {
        if !tled::internal_forces(setup.scene, state) {
            return f64::NAN;
        }
        let moment = |&node: &u32| {
            let [x, y, _] = mesh.point(node);
            let [fx, fy, _] = state.forces()[node as usize].to_array().map(f64::from);
            x * fy - y * fx
        };
        -end.iter().map(moment).sum::<f64>()
    };
    let motions: Vec<Motion> = end.iter().map(motion).collect();
    let loads = Loads::new(setup.scene, [0.0; 3], &[], &motions)?;
    let (mut state, cost) = setup.at_rest(&loads, OMEGA, torque)?;
    Ok((torque(&mut state), cost))
}
