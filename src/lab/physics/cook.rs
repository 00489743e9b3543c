//! Cook's membrane: a tapered panel with the corners (0, 0), (48, 44), (48, 60), (0, 44) mm, clamped at the left, under
//! a dead shear traction of 6.25 MPa up its right side; plane strain, large deformation. The vertical displacement of
//! the upper right corner. The published benchmark has our law, `G/2 (I1bar - 3) + K/2 (J - 1)^2`, with E 240.565 MPa
//! and nu 0.499 (G 80.2 MPa, K 40,094 MPa). Plane strain in tetrahedra: a sheet one cell thick that does not move along
//! its normal.
//!
//! At a corner between a clamped and a free side, an angle `w` apart, displacements go as `r^l` with the least positive
//! root of `sin(l w)^2 = ((k + 1)^2 - 4 l^2 sin(w)^2) / (4 k)`, `k = 3 - 4 nu` in plane strain (Williams 1952): 0.544
//! at the upper left corner (108.4 degrees), 0.955 at the lower one (47.5 degrees). On equal cells the work of the
//! load, that is the mean rise of the loaded side, is of the order `2 l`, 1.09 in the end; on cells that shrink towards
//! the upper corner as `r^(1 - l)` it is of the order 2 (Raugel 1978), with the lower corner 1.91. At the loaded side's
//! corners shear meets free sides, which no smooth stress can satisfy: the strain depends on the direction, and the
//! rise of the corner itself is off by the load's shear strain times the cell there, an error of the order 1 that the
//! graded grid shrinks as well, by cells that are smaller towards the loaded side and the lower side.

use supple::loads::Loads;
use supple::material::Element;
use supple::scene::Axes;

use super::mesh::{BodyMesh, same};
use super::rest::mean_displacement;
use super::specimen::{Elastic, Specimen, fixed};
use super::steps::{Steps, TO_REST};
use super::{LabError, PhysicsRow, pressure, report};

pub(super) const NAME: &str = "cook";
const ELASTIC: Elastic = Elastic { young: 240.565e6, poisson: 0.499 };
const TRACTION: f64 = 6.25e6;
/// 30 quadrilaterals a side. Their sequence of meshes (6.746, 6.824, 6.859, 6.873, 6.891 mm with 10, 15, 20, 25, 30)
/// goes on to about 6.92 mm.
const REFERENCE: f64 = 6.8914;
const SOURCE: &str = "OpenGeoSys benchmark CooksMembrane; large deformation; F-bar; 30 elements a side (after de Souza Neto 1996 and Elguedj 2008)";
/// Cells along each side.
const MESHES: [u32; 3] = [8, 16, 32];
/// The root `l` of the upper left corner.
const SINGULARITY: f64 = 0.544;
const GRADED: &str = "graded grid";
/// Cells towards the loaded and the lower side shrink as this power less one of the distance.
const TOWARDS_SIDES: f64 = 1.6;
/// A quantity without a published value.
pub(super) const SIDE: &str = "mean rise of the loaded side";
const CORNER: &str = "rise of the corner";
/// Lowest frequency, 1/s: of a clamped bar of the panel's mean height.
const OMEGA: f64 = 6e3;

pub(super) fn rows(meshes: usize) -> Result<Vec<PhysicsRow>, LabError> {
    let mut rows = Vec::new();
    for graded in [false, true] {
        for element in Element::ALL {
            for steps in TO_REST {
                let (mut corners, mut sides) = (Vec::new(), Vec::new());
                for cells in MESHES.into_iter().take(meshes) {
                    let (rises, row) = measured(&body(cells, graded), element, steps, &mut rows);
                    if let Some([corner, side]) = rises {
                        corners.push((row.clone(), f64::from(cells), corner));
                        sides.push((row, f64::from(cells), side));
                    }
                }
                rows.extend(report::order_of_differences(CORNER, &corners));
                rows.extend(report::order_of_differences(SIDE, &sides));
            }
        }
    }
    Ok(rows)
}

/// Adds the rows of a run. Gives the rises of the corner and of the side, m, and a row without quantity.
fn measured(
    body: &Specimen,
    element: Element,
    steps: Steps,
    rows: &mut Vec<PhysicsRow>,
) -> (Option<[f64; 2]>, PhysicsRow) {
    let right = body.mesh.nodes(|[x, ..]| same(x, 0.048));
    let forces = body.mesh.traction(&right, (2.0 / OMEGA) as f32, |_| [0.0, TRACTION, 0.0]);
    let corner = body.mesh.nodes(|[x, y, _]| same(x, 0.048) && same(y, 0.06));
    // Rises of the corner and of the side, m, and oscillation of the pressure.
    let (found, row) = body.measure(NAME, element, steps, |setup| {
        let loads = Loads::new(setup.scene, [0.0; 3], &forces, &[])?;
        let (state, cost) = setup.at_rest(&loads, OMEGA, |state| mean_displacement(state, &corner, 1))?;
        let pressure = pressure::oscillation(body, element, state.displacements());
        // The mean by the share of each node in the traction.
        let (mut work, mut load) = (0.0, 0.0);
        for force in &forces {
            let newton = f64::from(force.newton[1]);
            work += newton * f64::from(state.displacements()[force.node as usize].to_array()[1]);
            load += newton;
        }
        Ok((([mean_displacement(&state, &corner, 1), work / load], pressure), cost))
    });
    let (rises, oscillation) = found.unzip();
    let [corner, side] = [0, 1].map(|index| rises.map(|rises: [f64; 2]| 1e3 * rises[index]));
    rows.push(PhysicsRow {
        quantity: CORNER.into(),
        unit: "mm",
        value: corner,
        reference: Some(REFERENCE),
        source: SOURCE,
        ..row.clone()
    });
    rows.push(PhysicsRow { quantity: SIDE.into(), unit: "mm", value: side, ..row.clone() });
    rows.extend(pressure::rows(oscillation, &row));
    (rises, row)
}

fn body(cells: u32, graded: bool) -> Specimen {
    let thickness = 0.044 / f64::from(cells);
    let mut mesh = BodyMesh::grid([cells, cells, 1], |[s, t, z]| {
        let (s, t) = if graded { shrunk(s, t) } else { (s, t) };
        [0.048 * s, 0.044 * s + t * (0.044 - 0.028 * s), thickness * z]
    });
    if graded {
        mesh.family = GRADED;
    }
    let supports =
        [fixed(mesh.nodes(|_| true), Axes::Z), fixed(mesh.nodes(|[x, ..]| same(x, 0.0)), Axes::X.union(Axes::Y))];
    Specimen { supports: supports.concat(), mesh, elastic: ELASTIC, density: 1000.0, masses: Vec::new() }
}

/// Parameters of the graded grid: cells shrink towards the sides `s` = 1 and `t` = 0, and squares around the corner (0, 1) towards it.
fn shrunk(s: f64, t: f64) -> (f64, f64) {
    let (s, t) = (1.0 - (1.0 - s).powf(TOWARDS_SIDES), t.powf(TOWARDS_SIDES));
    let scale = f64::max(s, 1.0 - t).powf(1.0 / SINGULARITY - 1.0);
    (scale * s, 1.0 - scale * (1.0 - t))
}
