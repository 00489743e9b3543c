//! `supple demo`: a liver lobe that hangs from its back sags under its own weight, and an instrument moves it, by
//! exact, long and learned steps side by side. A ball presses its dome and slides along it, which the learned step
//! refuses; forceps grip its front edge and lift it: their nodes are moved supports. The mesh is in the program, so the
//! command needs no files.

use std::path::Path;

use supple::inertia::{Cells, Method};
use supple::io::parse_msh;
use supple::loads::Motion;
use supple::material::Exponential;
use supple::mesh::Winding;
use supple::scene::{Axes, Support};

use crate::problem::{End, Problem};
use crate::report::demo::{Compared, Run, about, part, table};
use crate::report::{self, simulation::shape};
use crate::results::folder::Folder;
use crate::scene::body::Body;
use crate::scene::instruments::SceneInstruments;
use crate::scene::learned::LearnedChoice;
use crate::scene::setup::Setup;
use crate::scene::timing::StepChoice;
use crate::screen::{output, print};
use crate::simulate::{Job, Out, Simulated, progress_bar};

const LOBE: &[u8] = include_bytes!("data/lobe.msh");
/// For steps of 1.5 ms, with int8 layers.
const NETWORK: &[u8] = include_bytes!("data/compact-50-i8.weights");
/// Liver-like: shear modulus 1.5 kPa at rest, stiffening like the paper's law, nearly incompressible.
const TISSUE: Exponential = Exponential { a: 1_500.0, b: 8.023, d: 40_000.0 };
const DENSITY: f32 = 1_060.0;
/// 1/s: the lobe rings, but not through the whole second. That of the crate's networks.
const DAMPING: f32 = 20.0;
/// Nodes behind this plane hang on the diaphragm, m.
const BACK: f64 = 0.030;
/// The ball: radius (m), friction, how high above the dome it begins, and how it goes from there, s and m.
const RADIUS: f32 = 0.010;
const FRICTION: f32 = 0.3;
const ABOVE: f64 = 0.002;
const WAY: [(f64, [f64; 3]); 3] = [(0.0, [0.0; 3]), (0.6, [0.0, 0.0, -0.016]), (1.0, [0.006, 0.0, -0.016])];
/// The forceps: within this distance of the foremost node they grip (m), and lift by so much (m) in so many seconds.
const GRIP: f64 = 0.010;
const LIFT: [f32; 3] = [0.0, -0.006, 0.020];
const LIFTED_IN: f32 = 0.6;
/// The long step, over the critical one.
const TIMES_CRITICAL: f32 = 10.0;

/// The instruments, by what they do.
const BALL: &str = "a ball presses the dome and slides along it";
const FORCEPS: &str = "forceps grip the front edge and lift it";

/// What moves the lobe.
#[derive(Clone, Copy)]
enum Steps {
    Exact,
    Long,
    Learned,
}

pub(crate) fn demo(out: &Path) -> Result<End, Problem> {
    output!("A liver lobe, held at its back, sags under its own weight, and an instrument moves it.\n");
    let mut folder = None;
    let mut cases = vec![];
    for instrument in [BALL, FORCEPS] {
        let mut runs = vec![];
        for steps in [Steps::Exact, Steps::Long, Steps::Learned] {
            // Frames for ParaView of the first run.
            let out = folder.is_none().then_some(Out { path: out, force: true });
            let (run, made) = run(lobe(instrument, steps)?, steps.name(), out)?;
            folder = folder.or(made);
            runs.push(run);
        }
        cases.push(Compared { instrument, runs });
    }
    print(table(&cases));
    output!("\n{}", about(&cases));
    let folder = folder.ok_or_else(|| Problem("there are no frames".into()))?;
    folder.write_text(report::FILE, &report::page("supple demo: a liver lobe", &[part(&cases)])?)?;
    folder.publish()?;
    output!("\nreport   {}", out.join(report::FILE).display());
    output!("frames   {} (opens in ParaView)", out.join("frames.pvd").display());
    let divergence = cases.iter().flat_map(|case| &case.runs).find_map(|run| run.outcome()?.divergence);
    Ok(divergence.into())
}

impl Steps {
    const fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Long => "long",
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

/// The lobe with its supports, what moves it, and an instrument.
fn lobe(instrument: &str, steps: Steps) -> Result<Setup, Problem> {
    let mesh = parse_msh(Path::new("lobe.msh"), LOBE).map_err(Problem::of)?;
    let body = Body::new(mesh, Winding::Checked, "liver lobe".into());
    let mut setup = Setup::of_body(body, TISSUE, DENSITY);
    for (node, point) in (0u32..).zip(&setup.body.mesh.points) {
        if point[1] > BACK {
            setup.supports.push(Support::fixed(node));
        }
    }
    setup.gravity = [0.0, 0.0, -9.81];
    setup.damping = DAMPING;
    if instrument == BALL {
        press(&mut setup)
    } else {
        grip(&mut setup)
    }
    match steps {
        Steps::Exact => {}
        Steps::Long => {
            setup.time.method = Some(Method::new(Cells::Suggested));
            setup.time.step = StepChoice::Multiple(TIMES_CRITICAL);
        }
        Steps::Learned => {
            setup.learned = Some(LearnedChoice::of_demo("compact-50-i8.weights", NETWORK));
        }
    }
    Ok(setup)
}

/// A ball from above the highest node.
fn press(setup: &mut Setup) {
    let start = |[x, y, z]: [f64; 3]| [x, y, z + f64::from(RADIUS) + ABOVE];
    let start = start(extreme(setup, |point| point[2]));
    let path = WAY.map(|(time, way)| (time, [0, 1, 2].map(|axis| start[axis] + way[axis])));
    setup.instruments = SceneInstruments::ball(&setup.body, RADIUS, FRICTION, &path);
}

/// Forceps at the foremost node: nodes that they grip move as they do.
fn grip(setup: &mut Setup) {
    let tip = extreme(setup, |point| -point[1]);
    let apart = |point: &[f64; 3]| (0..3).map(|axis| (point[axis] - tip[axis]).powi(2)).sum::<f64>().sqrt();
    let points = (0u32..).zip(&setup.body.mesh.points);
    let nodes = points.filter(|(_, point)| apart(point) < GRIP).map(|(node, _)| node);
    setup.motions = nodes.map(|node| Motion { node, axes: Axes::XYZ, metre: LIFT, ramp: LIFTED_IN }).collect();
    setup.supports.extend(setup.motions.iter().map(|motion| Support::moved(motion.node)));
}

/// The node at which a coordinate is largest.
fn extreme(setup: &Setup, along: impl Fn(&[f64; 3]) -> f64) -> [f64; 3] {
    let points = setup.body.mesh.points.iter().copied();
    points.max_by(|a, b| along(a).total_cmp(&along(b))).unwrap_or_default()
}
