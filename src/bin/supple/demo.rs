//! `supple demo`: a liver lobe hangs from its back, sags under its own weight and is pushed in from above.
//! The mesh is in the program, so the command needs no files.

use std::path::Path;

use indicatif::ProgressBar;
use supple::io::parse_msh;
use supple::loads::Motion;
use supple::material::Exponential;
use supple::mesh::Winding;
use supple::scene::{Axes, Support};

use crate::problem::{End, Problem};
use crate::results::folder::PICTURE;
use crate::results::picture::{self, Panel};
use crate::scene::body::Body;
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
/// The push: nodes within this distance (m) of the top of the dome go down by 10 mm in half a second.
const PATCH: f64 = 0.012;
const PUSH: ([f32; 3], f32) = ([0.0, 0.002, -0.010], 0.5);

pub(crate) fn demo(out: &Path) -> Result<End, Problem> {
    let setup = lobe()?;
    output!("A liver lobe, held at its back, sags under its own weight; its dome is pushed in by 10 mm.\n");
    let progress = ProgressBar::hidden();
    let simulation = Simulation { setup: &setup, out, force: true, unchecked: false, progress };
    let simulated = setup.with_material(simulation)?;
    simulated.folder.write_text(PICTURE, &draw(&setup.body, &simulated))?;
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
        let away = (0..3).map(|axis| (point[axis] - top[axis]).powi(2)).sum::<f64>().sqrt();
        if point[1] > BACK {
            setup.supports.push(Support::fixed(node));
        } else if away < PATCH && point[2] > top[2] - 0.004 {
            setup.supports.push(Support::moved(node));
            setup.motions.push(Motion { node, axes: Axes::XYZ, metre: PUSH.0, ramp: PUSH.1 });
        }
    }
    setup.gravity = [0.0, 0.0, -9.81];
    setup.damping = DAMPING;
    Ok(setup)
}

/// The lobe at rest and at the end, as SVG.
fn draw(body: &Body, Simulated { state, conclusion, .. }: &Simulated) -> String {
    let rest = &body.mesh.points;
    let vectors: Vec<_> = state.displacements().iter().map(|vector| vector.to_array()).collect();
    let moved: Vec<_> = rest
        .iter()
        .zip(&vectors)
        .map(|(point, vector)| [0, 1, 2].map(|axis| point[axis] + f64::from(vector[axis])))
        .collect();
    let length = |vector: &[f32; 3]| vector.iter().map(|c| f64::from(c * c)).sum::<f64>().sqrt();
    let lengths: Vec<_> = vectors.iter().map(length).collect();
    let none = vec![0.0; rest.len()];
    let after = format!("after {:.1} s", state.time());
    let panels = [
        Panel { title: "at rest", positions: rest, displacements: &none },
        Panel { title: &after, positions: &moved, displacements: &lengths },
    ];
    picture::draw(&panels, &body.boundary(), conclusion.figures.max_displacement)
}
