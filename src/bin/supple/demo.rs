//! `supple demo`: a liver lobe hangs from its back, sags under its own weight, and a ball presses its dome and slides along it.
//! The mesh is in the program, so the command needs no files.

use std::path::Path;

use indicatif::ProgressBar;
use supple::io::parse_msh;
use supple::material::Exponential;
use supple::mesh::Winding;
use supple::scene::Support;

use crate::problem::{End, Problem};
use crate::results::folder::PICTURE;
use crate::results::instrument_mesh;
use crate::results::picture::{self, Panel};
use crate::scene::body::Body;
use crate::scene::instruments::Tools;
use crate::scene::setup::Setup;
use crate::screen::output;
use crate::simulate::{Simulated, Simulation};

const LOBE: &[u8] = include_bytes!("../../../meshes/lobe.msh");
/// Liver-like: shear modulus 1.5 kPa at rest, stiffening like the paper's law, nearly incompressible.
const TISSUE: Exponential = Exponential { a: 1_500.0, b: 8.023, d: 40_000.0 };
const DENSITY: f32 = 1_060.0;
/// 1/s: the lobe rings, but not through the whole second.
const DAMPING: f32 = 20.0;
/// Nodes behind this plane hang on the diaphragm, m.
const BACK: f64 = 0.030;
/// The ball: radius (m), friction, how high above the dome it begins, and how it goes from there, s and m.
const RADIUS: f32 = 0.010;
const FRICTION: f32 = 0.3;
const ABOVE: f64 = 0.002;
const WAY: [(f64, [f64; 3]); 3] = [(0.0, [0.0; 3]), (0.6, [0.0, 0.0, -0.016]), (1.0, [0.006, 0.0, -0.016])];

pub(crate) fn demo(out: &Path) -> Result<End, Problem> {
    let setup = lobe()?;
    output!(
        "A liver lobe, held at its back, sags under its own weight; a ball presses its dome and slides along it.\n"
    );
    let progress = ProgressBar::hidden();
    let simulation = Simulation { setup: &setup, out, force: true, unchecked: false, progress };
    let simulated = setup.with_material(simulation)?;
    simulated.folder.write_text(PICTURE, &draw(&setup, &simulated))?;
    let Simulated { folder, outcome, conclusion, .. } = simulated;
    folder.publish()?;
    conclusion.print();
    output!("\npicture  {}", out.join(PICTURE).display());
    output!("frames   {} (opens in ParaView)", out.join("frames.pvd").display());
    Ok(outcome.divergence.into())
}

/// The lobe with its supports and its push.
fn lobe() -> Result<Setup, Problem> {
    let mesh = parse_msh(Path::new("lobe.msh"), LOBE).map_err(Problem::of)?;
    let body = Body::new(mesh, Winding::Checked, "liver lobe".into());
    let mut setup = Setup::of_body(body, TISSUE, DENSITY);
    let points = &setup.body.mesh.points;
    let top =
        points.iter().copied().fold([0.0, 0.0, f64::NEG_INFINITY], |a, b| if b[2] > a[2] { b } else { a });
    for (node, point) in (0u32..).zip(points) {
        if point[1] > BACK {
            setup.supports.push(Support::fixed(node));
        }
    }
    let start = [top[0], top[1], top[2] + f64::from(RADIUS) + ABOVE];
    let path = WAY.map(|(time, way)| (time, [0, 1, 2].map(|axis| start[axis] + way[axis])));
    setup.tools = Tools::ball(&setup.body, RADIUS, FRICTION, &path);
    setup.gravity = [0.0, 0.0, -9.81];
    setup.damping = DAMPING;
    Ok(setup)
}

/// The lobe at rest and at the end, as SVG.
fn draw(Setup { body, tools, .. }: &Setup, Simulated { state, conclusion, .. }: &Simulated) -> String {
    let rest = &body.mesh.points;
    let vectors: Vec<_> = state.displacements().iter().map(|vector| vector.to_array()).collect();
    let moved = rest
        .iter()
        .zip(&vectors)
        .map(|(point, vector)| [0, 1, 2].map(|axis| point[axis] + f64::from(vector[axis])));
    let length = |vector: &[f32; 3]| vector.iter().map(|c| f64::from(c * c)).sum::<f64>().sqrt();
    let lengths = vectors.iter().map(length);
    // The ball as it is at either time, in the colour of what does not move.
    let [(ball, corners), (ball_after, _)] =
        [0.0, state.time()].map(|time| instrument_mesh::of(tools, body, time));
    let first = rest.len() as u32;
    let mut triangles = body.boundary();
    triangles.extend(corners.into_iter().map(|corners| corners.map(|corner| first + corner)));
    let none = vec![0.0; rest.len() + ball.len()];
    let lengths: Vec<_> = lengths.chain(ball.iter().map(|_| 0.0)).collect();
    let moved: Vec<_> = moved.chain(ball_after).collect();
    let rest: Vec<_> = rest.iter().copied().chain(ball).collect();
    let after = format!("after {:.1} s", state.time());
    let panels = [
        Panel { title: "at rest", positions: &rest, displacements: &none },
        Panel { title: &after, positions: &moved, displacements: &lengths },
    ];
    picture::draw(&panels, &triangles, conclusion.figures.max_displacement)
}
