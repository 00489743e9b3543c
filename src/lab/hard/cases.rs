//! Scenes that are made to break a step, and one of a mesh of the user's. SI units.

use std::path::Path;

use supple::io::{TetMesh, read_mesh};
use supple::loads::{Motion, NodalForce};
use supple::material::{Element, NeoHookean, Tissue};
use supple::mesh::Bar;
use supple::scene::{Axes, Support};

use super::super::LabError;
use super::super::course::Course;
use super::super::moving::{critical_step, free_bar, hold, neo_hookean, nodes_where};
use super::super::scenes::{
    self, HELD, LOBE, RigidVelocity, SceneSpec, SecondTissue, bar, held, held_at_its_end, longest, node_masses,
};
use super::{TRAINED_DAMPING, timing_of};

/// A scene and its duration, s.
type Case = (SceneSpec, f32);

/// Makes a case.
type Make = fn() -> Result<Case, LabError>;

const CASES: [(&str, Make); 23] = [
    ("sudden-load", sudden_load),
    ("reversal", reversal),
    ("release-stretched", release),
    ("at-critical-frequency", || alternating(2.2)),
    ("at-ten-critical-steps", || alternating(20.0)),
    ("many-turns", many_turns),
    ("faster-than-waves", faster_than_waves),
    ("inverted-and-back", inverted_and_back),
    ("to-and-fro", to_and_fro),
    ("slivers", slivers),
    ("coarse", || bending([2, 2, 6], 50.0)),
    ("fine", || bending([8, 8, 24], 50.0)),
    ("nearly-incompressible", || bending([4, 4, 12], 5_000.0)),
    ("one-cell-thick", || bending([1, 1, 12], 50.0)),
    ("densities-1-1000", || two_tissues(1.0, 1_000.0)),
    ("moduli-1-1000", || two_tissues(1_000.0, 1.0)),
    ("paper-bar-gravity", || paper_bar_gravity(Bar::PAPER.cells)),
    ("paper-bar-coarse", || paper_bar_gravity([4, 4, 8])),
    ("paper-bar-fine", || paper_bar_gravity([16, 16, 34])),
    ("paper-bar-other-material", other_material),
    ("million-steps", million_steps),
    ("fades-to-nothing", fades_to_nothing),
    ("metres-for-millimetres", metres_for_millimetres),
];

/// Those that take minutes: a plan has them only if they are named.
pub const LONG: [&str; 2] = ["paper-bar-fine", "million-steps"];

/// The names of these cases, and of the laboratory's scenes.
pub fn names() -> impl Iterator<Item = &'static str> {
    CASES.into_iter().map(|(name, _)| name).chain(scenes::names())
}

/// The case or scene with this name.
pub fn named(name: &str) -> Result<SceneSpec, LabError> {
    let Some((name, make)) = CASES.into_iter().find(|(of, _)| *of == name) else {
        if scenes::names().any(|of| of == name) {
            return scenes::named(name);
        }
        let known = names().collect::<Vec<_>>().join(", ");
        return Err(LabError::Unknown { kind: "case", name: name.to_string(), known });
    };
    let (mut spec, seconds) = make()?;
    spec.name = name;
    (spec.timing, spec.intervals) = timing_of(critical_step(&spec)?, seconds);
    Ok(spec)
}

/// A mesh in a file, in metres after `scale`: soft tissue, held at the low end of its longest axis, that sinks under
/// its own weight and is pulled aside at the other end by a tenth of it.
pub fn of_mesh(path: &Path, scale: f64) -> Result<SceneSpec, LabError> {
    const G: f32 = 9.81;
    let TetMesh { points, tets, .. } = read_mesh(path)?;
    let points = points.into_iter().map(|point| point.map(|component| (scale * component) as f32)).collect();
    let mut spec = held("mesh", points, tets);
    (spec.law, spec.element) = (neo_hookean(1_500.0, 50.0), Element::NodalPressure);
    let (axis, low, high) = longest(&spec.points);
    spec.gravity[(axis + 1) % 3] = -G;
    let nodes = nodes_where(&spec, |point| point[axis] > high - HELD * (high - low));
    let mass: f32 = node_masses(&spec).iter().sum();
    let mut newton = [0.0; 3];
    newton[(axis + 2) % 3] = 0.1 * G * mass / nodes.len() as f32;
    spec.forces = nodes.into_iter().map(|node| NodalForce { node, newton, ramp: 0.2 }).collect();
    (spec.timing, spec.intervals) = timing_of(critical_step(&spec)?, 0.6);
    Ok(spec)
}

const SIZE: [f32; 3] = [0.02, 0.02, 0.1];
const END: f32 = SIZE[2];
/// Young's modulus about 12 kPa.
const SHEAR: f32 = 4_000.0;

/// A held bar of this bulk over shear modulus.
fn held_bar(cells: [u32; 3], ratio: f32, damping: f32) -> SceneSpec {
    let mut spec = free_bar(SIZE, cells, neo_hookean(0.5 * SHEAR, ratio), damping);
    spec.element = Element::NodalPressure;
    hold(&mut spec, |[_, _, z]| z == 0.0);
    spec
}

/// A force on the nodes of the free end, N in all.
fn at_the_end(spec: &SceneSpec, newton: [f32; 3], ramp: f32) -> Vec<NodalForce> {
    let nodes = nodes_where(spec, |[_, _, z]| z == END);
    let newton = newton.map(|newton| newton / nodes.len() as f32);
    nodes.into_iter().map(|node| NodalForce { node, newton, ramp }).collect()
}

fn sudden_load() -> Result<Case, LabError> {
    let (mut spec, _) = held_at_its_end("", LOBE)?;
    (spec.law, spec.element, spec.damping) = (neo_hookean(1_500.0, 50.0), Element::NodalPressure, 5.0);
    spec.gravity = [0.0, 0.0, -9.81];
    Ok((spec, 0.5))
}

fn reversal() -> Result<Case, LabError> {
    let mut spec = held_bar([4, 4, 16], 50.0, 5.0);
    spec.forces = at_the_end(&spec, [0.02, 0.0, 0.0], 0.1);
    spec.course = Course::Reversed(0.3);
    Ok((spec, 0.6))
}

fn release() -> Result<Case, LabError> {
    let mut spec = held_bar([4, 4, 16], 50.0, 0.0);
    spec.forces = at_the_end(&spec, [0.0, 0.0, 0.8], 0.2);
    spec.course = Course::Released(0.3);
    Ok((spec, 0.5))
}

/// A force with a period of so many critical steps.
fn alternating(steps: f32) -> Result<Case, LabError> {
    let mut spec = held_bar([4, 4, 16], 50.0, 0.0);
    spec.forces = at_the_end(&spec, [0.5, 0.0, 0.0], 0.0);
    spec.course = Course::Alternating(f64::from(steps * critical_step(&spec)?));
    Ok((spec, 0.3))
}

/// Ten turns in a second.
fn many_turns() -> Result<Case, LabError> {
    let mut spec = free_bar(SIZE, [3, 3, 12], neo_hookean(0.5 * 20_000.0, 50.0), 0.0);
    spec.start = RigidVelocity { linear: [0.0; 3], angular: [0.0, 62.83, 0.0] };
    Ok((spec, 1.0))
}

fn moved_end(spec: &mut SceneSpec, metre: [f32; 3], ramp: f32) {
    let nodes = nodes_where(spec, |[_, _, z]| z == END);
    spec.motions = nodes.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp }).collect();
    spec.supports.extend(nodes.into_iter().map(Support::moved));
}

/// The end moves across by 5 mm at twice the speed of shear waves (2 m/s).
fn faster_than_waves() -> Result<Case, LabError> {
    let mut spec = held_bar([4, 4, 16], 50.0, 2.0);
    moved_end(&mut spec, [0.005, 0.0, 0.0], 0.005 / 4.0);
    Ok((spec, 0.3))
}

/// The end is pushed through the body, to a fifth of the length behind the support, and comes back.
fn inverted_and_back() -> Result<Case, LabError> {
    let mut spec = held_bar([3, 3, 10], 10.0, 20.0);
    moved_end(&mut spec, [0.0, 0.0, -1.2 * END], 0.0);
    spec.course = Course::Alternating(1.2);
    Ok((spec, 0.6))
}

/// An instrument that moves the tip of the lobe by 8 mm to and fro, three times a second.
fn to_and_fro() -> Result<Case, LabError> {
    let mut spec = scenes::named("push")?;
    (spec.element, spec.damping) = (Element::NodalPressure, 20.0);
    for motion in &mut spec.motions {
        (motion.metre, motion.ramp) = ([0.0, 0.0, 0.008], 0.0);
    }
    spec.course = Course::Alternating(0.33);
    Ok((spec, 1.0))
}

/// A bar with a layer of elements a twentieth as thick as the others.
fn slivers() -> Result<Case, LabError> {
    let mut spec = held_bar([4, 4, 12], 50.0, 5.0);
    let (from, to) = (6.0 * END / 12.0, 5.05 * END / 12.0);
    for point in &mut spec.points {
        if (point[2] - from).abs() < 1e-4 {
            point[2] = to;
        }
    }
    spec.gravity = [9.81, 0.0, 0.0];
    Ok((spec, 0.4))
}

fn bending(cells: [u32; 3], ratio: f32) -> Result<Case, LabError> {
    let mut spec = held_bar(cells, ratio, 5.0);
    spec.gravity = [9.81, 0.0, 0.0];
    Ok((spec, 0.4))
}

/// A bar with two tissues along its length: the one at the free end is so many times as stiff and as dense.
fn two_tissues(stiffer: f32, denser: f32) -> Result<Case, LabError> {
    let mut spec = held_bar([4, 4, 16], 20.0, 5.0);
    let upper = |tet: &[u32; 4]| {
        let z: f32 = tet.iter().filter_map(|&node| spec.points.get(node as usize)).map(|point| point[2]).sum();
        u16::from(z > 2.0 * END)
    };
    let of_element = spec.tets.iter().map(upper).collect();
    let c = 0.5 * SHEAR * stiffer;
    let tissue = Tissue { law: NeoHookean { c, d: 20.0 * c }, density: 1_000.0 };
    spec.second = Some(SecondTissue { tissue, of_element });
    spec.density = 1_000.0 / denser;
    spec.gravity = [2.0, 0.0, 0.0];
    Ok((spec, 0.4))
}

/// The body and tissue of the networks' training, on their mesh or another one.
fn paper_bar_gravity(cells: [u32; 3]) -> Result<Case, LabError> {
    let mut spec = bar("", Vec::new());
    let shape = Bar { cells, ..Bar::PAPER };
    (spec.points, spec.tets) = (shape.points().collect(), shape.tets().collect());
    hold(&mut spec, |[_, _, z]| z == 0.0);
    spec.gravity = [9.81, 0.0, 0.0];
    Ok((spec, 0.6))
}

/// The same bar of tissue that is 50 times as stiff and does not stiffen.
fn other_material() -> Result<Case, LabError> {
    let (mut spec, seconds) = paper_bar_gravity(Bar::PAPER.cells)?;
    spec.law = neo_hookean(1_500.0, 50.0);
    Ok((spec, seconds))
}

/// A small bar that an instrument shakes ten times a second, for a million exact steps.
fn million_steps() -> Result<Case, LabError> {
    let mut spec = free_bar([0.004, 0.004, 0.012], [2, 2, 6], neo_hookean(0.5 * SHEAR, 50.0), TRAINED_DAMPING);
    spec.element = Element::NodalPressure;
    hold(&mut spec, |[_, _, z]| z == 0.0);
    let nodes = nodes_where(&spec, |[_, _, z]| z > 0.0119);
    let newton = [0.002 / nodes.len() as f32, 0.0, 0.0];
    spec.forces = nodes.into_iter().map(|node| NodalForce { node, newton, ramp: 0.0 }).collect();
    spec.course = Course::Alternating(0.1);
    let seconds = 0.95e6 * critical_step(&spec)?;
    Ok((spec, seconds))
}

/// A cube that is let go and comes to rest: what it still moves by falls below the smallest normal number.
fn fades_to_nothing() -> Result<Case, LabError> {
    const SIDE: f32 = 0.02;
    let mut spec = free_bar([SIDE; 3], [4, 4, 4], neo_hookean(0.5 * SHEAR, 50.0), 300.0);
    spec.element = Element::NodalPressure;
    hold(&mut spec, |[_, _, z]| z == 0.0);
    let nodes = nodes_where(&spec, |[_, _, z]| z == SIDE);
    let newton = [0.4 / nodes.len() as f32, 0.0, 0.0];
    spec.forces = nodes.into_iter().map(|node| NodalForce { node, newton, ramp: 0.0 }).collect();
    spec.course = Course::Released(0.1);
    Ok((spec, 2.0))
}

/// A bar 20 m wide and 100 m long, under gravity.
fn metres_for_millimetres() -> Result<Case, LabError> {
    let mut spec = free_bar(SIZE.map(|edge| 1e3 * edge), [4, 4, 12], neo_hookean(0.5 * SHEAR, 50.0), 5.0);
    spec.element = Element::NodalPressure;
    hold(&mut spec, |[_, _, z]| z == 0.0);
    spec.gravity = [9.81, 0.0, 0.0];
    Ok((spec, 60.0))
}
