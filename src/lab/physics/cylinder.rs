//! A thick-walled cylinder under internal pressure, radii 10 and 20 mm, small strain, plane strain: Lamé's solution
//! `u(r) = (1 + nu) / E  p a^2 / (b^2 - a^2) ((1 - 2 nu) r + b^2 / r)` at both radii. A quarter of it, nu 0.499, on
//! grids and on irregular meshes by Gmsh, a layer thick. The pressure is a dead load on the flat triangles of the inner
//! surface.

use supple::loads::Loads;
use supple::material::Element;
use supple::scene::Axes;
use supple::state::VecState;

use super::mesh::{BodyMesh, same};
use super::specimen::{Elastic, Specimen, fixed};
use super::steps::{EXACT, Steps, TO_REST};
use super::{LabError, PhysicsRow, report};

pub(super) const NAME: &str = "cylinder";
pub(super) const INNER: f64 = 0.01;
const OUTER: f64 = 0.02;
const ELASTIC: Elastic = Elastic { young: 1e5, poisson: 0.499 };
/// Pressure over Young's modulus: the inner radius grows by four hundred-thousandths.
const PRESSURE: f64 = 2e-5;
/// Cells from the inner to the outer radius.
const CELLS: [u32; 3] = [4, 8, 16];
/// The irregular meshes, each twice as fine as the last.
const FILES: [(&str, &[u8]); 3] = [
    ("cylinder-coarse.msh", include_bytes!("../../../meshes/physics/cylinder-coarse.msh")),
    ("cylinder-middle.msh", include_bytes!("../../../meshes/physics/cylinder-middle.msh")),
    ("cylinder-fine.msh", include_bytes!("../../../meshes/physics/cylinder-fine.msh")),
];
/// Lowest frequency, 1/s: `1.47 sqrt(G / rho) / a` of the breathing mode, less for the oval one.
const OMEGA: f64 = 500.0;
const SOURCE: &str = "Lame; plane strain";

pub(super) fn rows(meshes: usize) -> Result<Vec<PhysicsRow>, LabError> {
    let grids: Vec<Specimen> = CELLS.into_iter().take(meshes).map(|cells| body(grid(cells))).collect();
    let irregular = (0..FILES.len()).take(meshes).map(|index| Ok(body(irregular(index)?)));
    let mut rows = Vec::new();
    for bodies in [grids, irregular.collect::<Result<_, LabError>>()?] {
        for element in Element::ALL {
            let mut errors = Vec::new();
            for (body, fineness) in bodies.iter().zip([1.0, 2.0, 4.0]) {
                for steps in TO_REST {
                    let (found, row) = measured(body, element, steps, &mut rows);
                    if let (Some([inner, _]), true) = (found, steps.kind == EXACT.kind) {
                        errors.push((row, fineness, inner / exact(INNER) - 1.0));
                    }
                }
            }
            rows.extend(report::order_of_errors("radial displacement of the inner surface", &errors));
        }
    }
    Ok(rows)
}

/// Adds the rows of a run. Gives the radial displacements, m, and a row without quantity.
fn measured(
    body: &Specimen,
    element: Element,
    steps: Steps,
    rows: &mut Vec<PhysicsRow>,
) -> (Option<[f64; 2]>, PhysicsRow) {
    let [inner, outer] = [INNER, OUTER].map(|radius| body.mesh.nodes(|[x, y, _]| same(x.hypot(y), radius)));
    let pascal = PRESSURE * ELASTIC.young;
    let forces = body.mesh.traction(&inner, (2.0 / OMEGA) as f32, |normal| normal.map(|x| -pascal * x));
    // Radial displacements, m.
    let (found, row) = body.measure(NAME, element, steps, |setup| {
        let loads = Loads::new(setup.scene, [0.0; 3], &forces, &[])?;
        let (state, cost) = setup.at_rest(&loads, OMEGA, |state| radial(&body.mesh, state, &inner))?;
        Ok(([&inner, &outer].map(|nodes| radial(&body.mesh, &state, nodes)), cost))
    });
    for (index, (radius, name)) in [(INNER, "inner"), (OUTER, "outer")].into_iter().enumerate() {
        rows.push(PhysicsRow {
            quantity: format!("radial displacement of the {name} surface"),
            unit: "mm",
            value: found.map(|values| 1e3 * values[index]),
            reference: Some(1e3 * exact(radius)),
            source: SOURCE,
            ..row.clone()
        });
    }
    (found, row)
}

/// Radial displacement, m.
fn exact(radius: f64) -> f64 {
    let Elastic { poisson, .. } = ELASTIC;
    let share = INNER * INNER / (OUTER * OUTER - INNER * INNER);
    (1.0 + poisson) * PRESSURE * share * ((1.0 - 2.0 * poisson) * radius + OUTER * OUTER / radius)
}

pub(super) fn grid(cells: u32) -> BodyMesh {
    let thickness = (OUTER - INNER) / f64::from(cells);
    BodyMesh::grid([cells, 2 * cells, 1], |[s, t, z]: [f64; 3]| {
        let (radius, angle) = (INNER + (OUTER - INNER) * s, core::f64::consts::FRAC_PI_2 * t);
        [radius * angle.cos(), radius * angle.sin(), thickness * z]
    })
}

pub(super) fn irregular(index: usize) -> Result<BodyMesh, LabError> {
    let (name, bytes) = FILES[index];
    BodyMesh::gmsh(name, bytes)
}

fn body(mesh: BodyMesh) -> Specimen {
    let thickness = mesh.points.iter().map(|point| f64::from(point[2])).fold(0.0, f64::max);
    let supports = [
        fixed(mesh.nodes(|[.., z]| same(z, 0.0) || same(z, thickness)), Axes::Z),
        fixed(mesh.nodes(|[_, y, _]| same(y, 0.0)), Axes::Y),
        fixed(mesh.nodes(|[x, ..]| same(x, 0.0)), Axes::X),
    ]
    .concat();
    Specimen { mesh, elastic: ELASTIC, density: 1000.0, supports, masses: Vec::new() }
}

/// Mean radial displacement of nodes, m.
fn radial(mesh: &BodyMesh, state: &VecState, nodes: &[u32]) -> f64 {
    let sum: f64 = nodes
        .iter()
        .map(|&node| {
            let [x, y, _] = mesh.point(node);
            let [u, v, _] = state.displacements()[node as usize].to_array().map(f64::from);
            (u * x + v * y) / x.hypot(y)
        })
        .sum();
    sum / nodes.len() as f64
}
