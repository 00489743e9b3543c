//! `supple demo`: a liver lobe with a tumour and two vessels hangs from the diaphragm, which breathes in, while an
//! ultrasound probe presses it: by exact, long and adaptive steps side by side, and by a learned step, which refuses the
//! probe. The mesh is in the program, so the command needs no files.

pub(crate) mod page;

use std::collections::BTreeMap;
use std::path::Path;

use supple::inertia::{Cells, Method};
use supple::io::{TetMesh, parse_msh};
use supple::loads::Motion;
use supple::material::{AnyLaw, Element, Exponential, Tissue};
use supple::mesh::Winding;
use supple::scene::{Axes, Support};

use crate::problem::{End, Problem};
use crate::report::demo::{Compared, Run, about, found, part, table};
use crate::report::{self, simulation::shape};
use crate::results::folder::Folder;
use crate::scene::body::Body;
use crate::scene::instruments::SceneInstruments;
use crate::scene::learned::LearnedChoice;
use crate::scene::setup::Setup;
use crate::scene::timing::StepChoice;
use crate::scene::tissues::Tissues;
use crate::screen::{output, print};
use crate::simulate::{Job, Out, Simulated, progress_bar};

const LOBE: &[u8] = include_bytes!("data/lobe.msh");
/// For steps of 1.5 ms, with int8 layers.
const NETWORK: &[u8] = include_bytes!("data/compact-50-i8.weights");
/// Liver-like: shear modulus 2 kPa at rest, stiffening like the paper's law, nearly incompressible.
const TISSUE: Exponential = Exponential { a: 2_000.0, b: 8.023, d: 50_000.0 };
/// How many times as stiff as the liver: the tumour, and the walls of vessels.
const TUMOUR: f32 = 5.0;
const VESSELS: f32 = 3.0;
const DENSITY: f32 = 1_060.0;
/// 1/s: the liver rings, but not through the whole second. That of the crate's networks.
const DAMPING: f32 = 20.0;
/// Nodes behind this plane hang on the diaphragm, m.
const BACK: f64 = 0.030;
/// How the diaphragm moves while a patient breathes in, m and s.
const BREATH: [f32; 3] = [0.0, -0.003, -0.010];
const BREATHED_IN: f32 = 0.9;
/// The tumour, m.
const TARGET: [f64; 3] = [0.045, -0.010, 0.020];
const TARGET_RADIUS: f64 = 0.009;
/// Vessels: from, to, and radius, m.
const TUBES: [([f64; 3], [f64; 3], f64); 2] =
    [([0.000, 0.020, 0.020], [0.090, -0.005, 0.022], 0.004), ([0.040, 0.010, 0.020], [0.060, -0.040, 0.015], 0.003)];
/// The probe, a ball: radius (m), friction, how high above the dome it begins, which sags, and how it goes from there, s
/// and m.
const RADIUS: f32 = 0.012;
const FRICTION: f32 = 0.3;
const ABOVE: f64 = 0.002;
const WAY: [(f64, [f64; 3]); 3] = [(0.0, [0.0; 3]), (0.6, [0.0, 0.0, -0.021]), (1.0, [0.004, 0.0, -0.026])];
/// The long step, over the critical one.
const TIMES_CRITICAL: f32 = 50.0;
/// Mean error that adaptive steps may have, m.
const TOLERANCE: f32 = 0.000_5;
/// Within this distance of rest the liver hangs before it moves, m.
const SETTLED: f32 = 1e-5;

/// What moves the liver.
#[derive(Clone, Copy)]
enum Steps {
    Exact,
    Long,
    Auto,
    Learned,
}

pub(crate) fn demo(out: &Path) -> Result<End, Problem> {
    output!("A liver with a tumour and two vessels hangs from the diaphragm, which breathes in; a probe presses it.\n");
    let mut folder = None;
    let mut runs = vec![];
    let mesh = mesh()?;
    for steps in [Steps::Exact, Steps::Long, Steps::Auto, Steps::Learned] {
        // Frames for ParaView of the first run.
        let out = folder.is_none().then_some(Out { path: out, force: true });
        let (run, made) = run(liver(mesh.clone(), steps), steps.name(), out)?;
        folder = folder.or(made);
        runs.push(run);
    }
    let target = nearest(&runs[0].setup, TARGET);
    let compared = Compared { target, runs };
    output!("{}\n", found(&compared));
    print(table(&compared));
    output!("\n{}", about());
    let folder = folder.ok_or_else(|| Problem("there are no frames".into()))?;
    folder.write_text(report::FILE, &report::page("supple demo: a liver that breathes", &[part(&compared)])?)?;
    folder.publish()?;
    output!("\nreport   {}", out.join(report::FILE).display());
    output!("frames   {} (opens in ParaView)", out.join("frames.pvd").display());
    let divergence = compared.runs.iter().find_map(|run| run.outcome()?.divergence);
    Ok(divergence.into())
}

impl Steps {
    const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Long => "long",
            Self::Auto => "auto",
            Self::Learned => "learned",
        }
    }
}

/// A run, its results in a folder if any, and its shapes.
fn run(setup: Setup, name: &'static str, out: Option<Out<'_>>) -> Result<(Run, Option<Folder>), Problem> {
    let mut shapes = vec![];
    let job = Job {
        setup: &setup,
        out,
        unchecked: false,
        progress: progress_bar(&setup, &format!("{name} steps  ")),
        watch: &mut |state| shapes.push(shape(state)),
    };
    let Simulated { folder, outcome, .. } = job.run()?;
    // What learned steps refuse is part of the comparison.
    let refused = outcome.divergence.filter(|_| setup.learned.is_some());
    let done = refused.map_or(Ok((outcome, shapes)), |refused| Err(refused.to_string()));
    Ok((Run { setup, name, done }, folder))
}

/// The lobe of the library's meshes.
fn lobe() -> Result<TetMesh, Problem> {
    parse_msh(Path::new("lobe.msh"), LOBE).map_err(Problem::of)
}

/// The same, refined.
fn mesh() -> Result<TetMesh, Problem> {
    let lobe = lobe()?;
    let (points, tets) = refined(lobe.points, &lobe.tets);
    Ok(TetMesh { points, tets, ..TetMesh::default() })
}

/// The liver with what holds it, the probe, and what moves both.
fn liver(mesh: TetMesh, steps: Steps) -> Setup {
    let body = Body::new(mesh, Winding::Checked, "liver lobe".into());
    let mut setup = Setup::of_body(body, TISSUE, DENSITY);
    setup.tissues = tissues(&setup.body);
    setup.element = Element::NodalStrain;
    let back = (0u32..).zip(&setup.body.mesh.points).filter(|(_, point)| point[1] > BACK).map(|(node, _)| node);
    setup.motions = back.map(|node| Motion { node, axes: Axes::XYZ, metre: BREATH, ramp: BREATHED_IN }).collect();
    setup.supports = setup.motions.iter().map(|motion| Support::moved(motion.node)).collect();
    setup.gravity = [0.0, 0.0, -9.81];
    setup.damping = DAMPING;
    setup.time.settle = Some(SETTLED);
    press(&mut setup);
    match steps {
        Steps::Exact => {}
        Steps::Long => {
            setup.time.method = Some(Method::new(Cells::Suggested));
            setup.time.step = StepChoice::Multiple(TIMES_CRITICAL);
        }
        Steps::Auto => {
            setup.time.method = Some(Method::new(Cells::Suggested));
            (setup.time.is_adaptive, setup.time.tolerance) = (true, Some(TOLERANCE));
        }
        Steps::Learned => {
            setup.time.settle = None;
            setup.learned = Some(LearnedChoice::of_demo("compact-50-i8.weights", NETWORK));
        }
    }
    setup
}

/// Liver, tumour and vessels, by the middle of each element.
fn tissues(body: &Body) -> Tissues {
    let stiffer =
        |times: f32| Tissue { law: AnyLaw::from(Exponential { a: times * TISSUE.a, ..TISSUE }), density: DENSITY };
    let of = |tet: &[u32; 4]| {
        let middle =
            [0, 1, 2].map(|axis| tet.iter().map(|&node| body.mesh.points[node as usize][axis]).sum::<f64>() / 4.0);
        let in_vessel = TUBES.iter().any(|&(from, to, radius)| distance_to_line(middle, from, to) < radius);
        if distance(middle, TARGET) < TARGET_RADIUS { 1 } else { 2 * u16::from(in_vessel) }
    };
    let of_element = body.mesh.tets.iter().map(of).collect();
    Tissues::several(vec![stiffer(1.0), stiffer(TUMOUR), stiffer(VESSELS)], of_element)
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>().sqrt()
}

/// The distance of a point to a line from one point to another.
fn distance_to_line(point: [f64; 3], from: [f64; 3], to: [f64; 3]) -> f64 {
    let along = [0, 1, 2].map(|axis| to[axis] - from[axis]);
    let share = (0..3).map(|axis| (point[axis] - from[axis]) * along[axis]).sum::<f64>()
        / along.iter().map(|component| component * component).sum::<f64>();
    distance(point, [0, 1, 2].map(|axis| from[axis] + share.clamp(0.0, 1.0) * along[axis]))
}

/// Each tetrahedron in eight: its corners, and an octahedron between the middles of its edges in four, about the shorter
/// of two diagonals (Bey 1995).
fn refined(mut points: Vec<[f64; 3]>, tets: &[[u32; 4]]) -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    let mut middles = BTreeMap::new();
    let mut fine = Vec::with_capacity(8 * tets.len());
    for &[a, b, c, d] in tets {
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let [p, q] = [a, b].map(|node| points[node as usize]);
                points.push([0, 1, 2].map(|axis| 0.5 * (p[axis] + q[axis])));
                points.len() as u32 - 1
            })
        };
        let [ab, ac, ad] = [middle(a, b), middle(a, c), middle(a, d)];
        let [bc, bd, cd] = [middle(b, c), middle(b, d), middle(c, d)];
        fine.extend([[a, ab, ac, ad], [ab, b, bc, bd], [ac, bc, c, cd], [ad, bd, cd, d]]);
        let length = |a: u32, b: u32| distance(points[a as usize], points[b as usize]);
        fine.extend(if length(ac, bd) < length(ab, cd) {
            [[ab, ac, ad, bd], [ab, ac, bd, bc], [ac, ad, bd, cd], [ac, bc, cd, bd]]
        } else {
            [[ab, ac, ad, cd], [ab, ac, cd, bc], [ab, ad, bd, cd], [ab, bc, cd, bd]]
        });
    }
    (points, fine)
}

/// The probe from above the highest node.
fn press(setup: &mut Setup) {
    let points = setup.body.mesh.points.iter().copied();
    let [x, y, z] = points.max_by(|a, b| a[2].total_cmp(&b[2])).unwrap_or_default();
    let start = [x, y, z + f64::from(RADIUS) + ABOVE];
    let path = WAY.map(|(time, way)| (time, [0, 1, 2].map(|axis| start[axis] + way[axis])));
    setup.instruments = SceneInstruments::ball(&setup.body, RADIUS, FRICTION, &path);
}

/// The node that is nearest to a point.
fn nearest(setup: &Setup, point: [f64; 3]) -> usize {
    let distances = setup.body.mesh.points.iter().map(|at| distance(*at, point)).enumerate();
    distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(node, _)| node)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All are right way round, and fill what the coarse ones fill.
    #[test]
    fn eight_tetrahedra_fill_the_one_they_are_of() {
        let points = vec![[0.0; 3], [1.0, 0.1, 0.0], [0.2, 1.3, 0.1], [0.1, 0.2, 0.9], [1.2, 1.1, 1.0]];
        let coarse = [[0, 1, 2, 3], [1, 2, 3, 4]];
        let volume = |points: &[[f64; 3]], tets: &[[u32; 4]]| {
            let of = |tet: &[u32; 4]| crate::scene::body::volume(tet.map(|node| points[node as usize]));
            tets.iter().map(of).collect::<Vec<_>>()
        };
        let whole = volume(&points, &coarse);
        let (points, fine) = refined(points, &coarse);
        let parts = volume(&points, &fine);
        for (whole, parts) in whole.iter().zip(parts.chunks(8)) {
            assert!(parts.iter().all(|part| part.signum() == whole.signum() && part.abs() > 0.1 * whole.abs() / 8.0));
            assert!((parts.iter().sum::<f64>() / whole - 1.0).abs() < 1e-12);
        }
        assert_eq!((points.len(), fine.len()), (5 + 9, 16));
    }
}
