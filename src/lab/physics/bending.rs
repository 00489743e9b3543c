//! A slender cantilever under a small end force: the tip's deflection by Timoshenko's beam, `P L^3 / (3 E I) + P L / (k
//! G A)` with Cowper's shear factor `k = 10 (1 + nu) / (12 + 11 nu)`. 80 x 10 x 10 mm, at nu 0.45 and 0.499. The held
//! end may contract and expand in its plane, as beam theory assumes: only its axial motion is held, and the motion of
//! its two middle lines across.

use supple::loads::Loads;
use supple::material::Element;
use supple::scene::Axes;

use super::mesh::{BodyMesh, same};
use super::rest::mean_displacement;
use super::specimen::{Elastic, Specimen, fixed};
use super::steps::TO_REST;
use super::{LabError, PhysicsRow};

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

pub(super) fn rows(meshes: usize) -> Result<Vec<PhysicsRow>, LabError> {
    let mut rows = Vec::new();
    for poisson in [0.45, 0.499] {
        for cells in MESHES.into_iter().take(meshes) {
            let elastic = Elastic { young: YOUNG, poisson };
            let body = body(cells, elastic);
            let inertia = WIDTH.powi(4) / 12.0;
            let shear_factor = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson);
            let per_newton =
                LENGTH.powi(3) / (3.0 * YOUNG * inertia) + LENGTH / (shear_factor * elastic.shear() * WIDTH * WIDTH);
            let reference = DEFLECTION * LENGTH;
            let tip = body.mesh.nodes(|[x, ..]| same(x, LENGTH));
            let omega = 3.516 / LENGTH.powi(2) * (YOUNG * inertia / (DENSITY * WIDTH * WIDTH)).sqrt();
            let pascal = reference / per_newton / (WIDTH * WIDTH);
            let forces = body.mesh.traction(&tip, (2.0 / omega) as f32, |_| [0.0, 0.0, -pascal]);
            for element in Element::ALL {
                for steps in TO_REST {
                    // Deflection, m.
                    let (value, row) = body.measure(NAME, element, steps, |setup| {
                        let loads = Loads::new(setup.scene, [0.0; 3], &forces, &[])?;
                        let (state, cost) = setup.at_rest(&loads, omega, |state| mean_displacement(state, &tip, 2))?;
                        Ok((-mean_displacement(&state, &tip, 2), cost))
                    });
                    rows.push(PhysicsRow {
                        quantity: format!("tip deflection at nu {poisson}"),
                        unit: "mm",
                        value: value.map(|value| 1e3 * value),
                        reference: Some(1e3 * reference),
                        source: SOURCE,
                        ..row
                    });
                }
            }
        }
    }
    Ok(rows)
}

fn body(cells: u32, elastic: Elastic) -> Specimen {
    let map = |[x, y, z]: [f64; 3]| [LENGTH * x, WIDTH * y, WIDTH * z];
    let mesh = BodyMesh::grid([8 * cells, cells, cells], map);
    let middle = 0.5 * WIDTH;
    let supports = [
        fixed(mesh.nodes(|[x, ..]| same(x, 0.0)), Axes::X),
        fixed(mesh.nodes(|[x, y, _]| same(x, 0.0) && same(y, middle)), Axes::Y),
        fixed(mesh.nodes(|[x, _, z]| same(x, 0.0) && same(z, middle)), Axes::Z),
    ]
    .concat();
    Specimen { mesh, elastic, density: DENSITY as f32, supports, masses: Vec::new() }
}
