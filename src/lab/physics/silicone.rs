//! The silicone beam of [`super::recordings`]: E 263,824 Pa (the source's fit), nu 0.499, 1070 kg/m^3, gravity 9.80709
//! m/s^2, clamped at one end, let go at time zero. The weight is a point mass along the upper edge of the free end.
//! Each run swings until twice the first lowest point has come, and is then damped critically until it rests. The
//! damping of the swing is fitted on the finest grid: its rows say how far the curves are from the recorded ones over
//! the damping.

use supple::loads::Loads;
use supple::material::Element;
use supple::scene::{Axes, Support};
use supple::state::VecState;

use super::mesh::{BodyMesh, GRID, same};
use super::recordings::{DAMPING, GRAVITY, LEFT, LOAD, MARKERS, Measured, Recording};
use super::specimen::{Cost, Elastic, Setup, Specimen, fixed};
use super::steps::{BACKWARD_EULER, EXACT, LONG_20, LONG_100};
use super::swing::{Markers, Swing};
use super::{LabError, PhysicsRow};

pub(super) const NAME: &str = "silicone-beam";
/// The quantity of the picture.
pub(super) const DISTANCE: &str = "gravity: rms distance over time; clock shifted; mean of the recordings";
pub(super) const SIZE: [f64; 3] = [0.1, 0.03, 0.03];
const PULL: f32 = -9.80709;
const SOURCE: &str = "Soft Robotics Lab; ETH Zurich; srl-ethz/diffPD_sim2real (MIT)";
/// Cells along, across and up.
const GRIDS: [[u32; 3]; 4] = [[6, 2, 2], [13, 4, 4], [20, 6, 6], [26, 8, 8]];
/// Irregular meshes of about as many tetrahedra as the grids but the coarsest.
const FILES: [(&str, &[u8]); 3] = [
    ("beam-coarse.msh", include_bytes!("../../../meshes/physics/beam-coarse.msh")),
    ("beam-middle.msh", include_bytes!("../../../meshes/physics/beam-middle.msh")),
    ("beam-fine.msh", include_bytes!("../../../meshes/physics/beam-fine.msh")),
];
/// Dampings that are tried, 1/s.
pub(super) const DAMPINGS: [f32; 7] = [4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0];

/// What pulls at the beam, and for how long it is watched.
#[derive(Clone, Copy)]
pub(super) struct Load {
    pub(super) name: &'static str,
    pub(super) recordings: &'static [Recording; 2],
    seconds: f64,
    /// Of the weight.
    kilogram: f64,
}

/// The weight is 0.51012 N at the recordings' gravity.
pub(super) const LOADS: [Load; 2] = [
    Load { name: "gravity", recordings: &GRAVITY, seconds: 0.3, kilogram: 0.0 },
    Load { name: "52 g", recordings: &LOAD, seconds: 0.58, kilogram: 0.052_015 },
];

/// On `meshes` grids and one irregular mesh less.
pub(super) fn rows(meshes: usize) -> Result<Vec<PhysicsRow>, LabError> {
    let mut rows = Vec::new();
    for load in LOADS {
        let grids = GRIDS.into_iter().take(meshes).map(|cells| Ok(grid(cells)));
        let irregular = FILES.into_iter().take(meshes.saturating_sub(1));
        for mesh in grids.chain(irregular.map(|(name, bytes)| BodyMesh::gmsh(name, bytes))) {
            let body = body(mesh?, load);
            for element in Element::ALL {
                let implicit = load.kilogram == 0.0 && element == Element::Linear && body.mesh.family == GRID;
                let implicit = BACKWARD_EULER.into_iter().filter(|_| implicit);
                let explicit = [EXACT, LONG_20, LONG_100].into_iter();
                for steps in explicit.chain(implicit) {
                    let (found, row) = body.measure(NAME, element, steps, |setup| swing_and_rest(setup, &body, load));
                    compared(load, found, &PhysicsRow { unit: "mm", source: SOURCE, ..row }, &mut rows);
                }
            }
        }
    }
    if meshes >= GRIDS.len() {
        rows.extend(fit());
    }
    Ok(rows)
}

/// Rows of one run against both recordings.
fn compared(load: Load, found: Option<(Swing, [Measured; 3])>, row: &PhysicsRow, rows: &mut Vec<PhysicsRow>) {
    let mut add = |quantity: String, unit, value: Option<f64>, reference| {
        // A body that does not swing has no period.
        let value = value.filter(|value| value.is_finite());
        rows.push(PhysicsRow { quantity, unit, value, reference, ..row.clone() });
    };
    let mut distances = Vec::new();
    for Recording { name, markers, left } in load.recordings {
        for (index, (reference, (marker, _))) in markers.iter().zip(MARKERS).enumerate() {
            let mut add = |quantity, unit, of: fn(&Measured) -> f64| {
                let value = found.as_ref().map(|(_, found)| of(&found[index]));
                add(format!("{name} {marker}: {quantity}"), unit, value, Some(of(reference)));
            };
            add("drop at rest", "mm", |of| of.rest);
            add("drop at the lowest point", "mm", |of| of.lowest);
            add("time of the lowest point", "s", |of| of.time);
            add("from a tenth of the drop to the lowest point", "s", |of| of.since_tenth);
            add("period", "s", |of| of.period);
        }
        let swing = found.as_ref().map(|(swing, _)| swing);
        let best = swing.map(|swing| swing.best_offset(left));
        let recorded = swing.map(|swing| swing.distance(left, 0.0));
        add(format!("{name} left: rms distance over time"), "mm", recorded, None);
        let shifted = best.map(|(_, distance)| distance);
        add(format!("{name} left: rms distance over time; clock shifted"), "mm", shifted, None);
        add(format!("{name} left: clock shift"), "s", best.map(|(offset, _)| offset), None);
        distances.extend(shifted);
    }
    let (_, what) = DISTANCE.split_once(": ").unwrap_or_default();
    let mean = (!distances.is_empty()).then(|| distances.iter().sum::<f64>() / distances.len() as f64);
    add(format!("{}: {what}", load.name), "mm", mean, None);
}

/// How far the curves of the finest grid with nodal pressure are from the recorded ones, over the damping: for each
/// recording in mm, the clock shifted, and of all the root mean square in shares of the drop at rest.
fn fit() -> Vec<PhysicsRow> {
    let mut rows = Vec::new();
    let bodies = LOADS.map(|load| (load, body(grid(GRIDS[GRIDS.len() - 1]), load)));
    for damping in DAMPINGS {
        let (mut squares, mut all) = (Vec::new(), None);
        for (load, body) in &bodies {
            let (found, row) = body.measure(NAME, Element::NodalPressure, EXACT, |setup| {
                let (swing, _, cost) = let_go(setup, body, *load, damping)?;
                Ok((swing, cost))
            });
            for Recording { name, markers, left } in load.recordings {
                let distance = found.as_ref().map(|swing| swing.best_offset(left).1);
                squares.extend(distance.map(|distance| (distance / markers[LEFT].rest).powi(2)));
                rows.push(PhysicsRow {
                    quantity: format!("{name} left: rms distance over time; damping {damping} 1/s"),
                    unit: "mm",
                    value: distance,
                    source: SOURCE,
                    ..row.clone()
                });
            }
            all = Some(row);
        }
        let misfit = 100.0 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        rows.extend(all.map(|row| PhysicsRow {
            quantity: format!("all recordings: rms distance over drop at rest; damping {damping} 1/s"),
            unit: "%",
            value: Some(misfit),
            source: SOURCE,
            ..row
        }));
    }
    rows
}

pub(super) fn grid(cells: [u32; 3]) -> BodyMesh {
    BodyMesh::grid(cells, |at| core::array::from_fn(|axis| at[axis] * SIZE[axis]))
}

pub(super) fn body(mesh: BodyMesh, load: Load) -> Specimen {
    let supports: Vec<Support> = fixed(mesh.nodes(|[x, ..]| same(x, 0.0)), Axes::XYZ);
    // Each node of the edge has half of the way to its neighbours.
    let mut edge = mesh.nodes(|[x, _, z]| same(x, SIZE[0]) && same(z, SIZE[2]));
    let across = |node: u32| mesh.point(node)[1];
    edge.sort_by(|&a, &b| across(a).total_cmp(&across(b)));
    let mut masses: Vec<(u32, f32)> = edge.iter().map(|&node| (node, 0.0)).collect();
    for (index, pair) in edge.windows(2).enumerate() {
        let half = 0.5 * load.kilogram * (across(pair[1]) - across(pair[0])) / SIZE[1];
        masses[index].1 += half as f32;
        masses[index + 1].1 += half as f32;
    }
    Specimen { mesh, elastic: Elastic { young: 263_824.0, poisson: 0.499 }, density: 1070.0, supports, masses }
}

pub(super) fn markers(mesh: &BodyMesh) -> Markers {
    Markers::on(mesh, &mesh.nodes(|[x, ..]| same(x, SIZE[0])))
}

/// The swing, and what the markers do; the cost is that of the swing.
fn swing_and_rest(setup: &Setup<'_>, body: &Specimen, load: Load) -> Result<((Swing, [Measured; 3]), Cost), LabError> {
    let (swing, mut state, cost) = let_go(setup, body, load, DAMPING)?;
    let (markers, omega) = (markers(&body.mesh), core::f64::consts::PI / swing.half_period());
    setup.settle(&mut state, &weight(setup)?, omega, |state| markers.drops(state)[LEFT])?;
    let measured = swing.measured(markers.drops(&state));
    Ok(((swing, measured), cost))
}

/// The swing alone with a damping (1/s), and the state after it.
fn let_go(setup: &Setup<'_>, body: &Specimen, load: Load, damping: f32) -> Result<(Swing, VecState, Cost), LabError> {
    let mut state = VecState::at_rest(setup.scene.node_count());
    let asked = (load.seconds, damping);
    let (swing, cost) = Swing::of(setup, &weight(setup)?, &mut state, &markers(&body.mesh), asked)?;
    Ok((swing, state, cost))
}

/// The shape at rest, without a swing.
pub(super) fn hung(setup: &Setup<'_>, body: &Specimen) -> Result<(VecState, Cost), LabError> {
    let markers = markers(&body.mesh);
    // Half a period of 0.23 s.
    setup.at_rest(&weight(setup)?, 27.0, |state| markers.drops(state)[LEFT])
}

fn weight(setup: &Setup<'_>) -> Result<Loads<'static>, LabError> {
    Ok(Loads::new(setup.scene, [0.0, 0.0, PULL], &[], &[])?)
}
