//! Ordinary scenes: an organ under gravity, a slow push, a pull, breathing, a tilted table, an instrument that presses.
//! Soft tissue, moderate speeds, held faces. Nothing here is made to break a step, so that whoever doubts doubts
//! without reason. The same number gives the same scene.

use glam::Vec3;
use supple::contact::{Instrument, Pose, Shape};
use supple::loads::{Motion, NodalForce};
use supple::material::{AnyLaw, Element, Exponential, NeoHookean};
use supple::mesh::Bar;
use supple::scene::{Axes, Support};

use super::super::LabError;
use super::super::course::Course;
use super::super::moving::{critical_step, nodes_where};
use super::super::random_numbers::Random;
use super::super::scenes::{CYLINDER, LOBE, SceneSpec, bar, held_at_its_end};
use super::timing_of;

/// How many there are unless another number is asked for: as many of each kind.
pub const SCENES: u32 = 24;

const BEAM: &[u8] = include_bytes!("../../../meshes/physics/beam-middle.msh");

/// The most that a node moves, m.
pub(super) const FARTHEST: f64 = 0.03;

/// m/s^2.
const G: f32 = 9.81;
/// Nodes within this share of the extent of a body belong to its face.
const FACE: f32 = 0.08;

/// What happens in a scene.
type Happens = fn(&mut SceneSpec, &Body, &mut Random);

const KINDS: [(&str, Happens); 6] = [
    ("hang", hang),
    ("push", push),
    ("pull", pull),
    ("breathe", breathe),
    ("table", table),
    ("instrument", instrument),
];

/// Where a body is held, and the middle of the side across.
struct Body {
    /// Out of the body at the held face.
    outward: Vec3,
    /// At a right angle to it.
    across: Vec3,
    /// From the held face to the other side, m.
    depth: f32,
    /// The node of the other side that is nearest to its middle, m.
    far: Vec3,
    /// Shear modulus, Pa.
    shear: f32,
}

/// The scene with this number; one whose exact motion leaves the range of its law or goes beyond 30 mm is drawn anew
/// with the next `attempt`.
pub fn scene(number: u32, attempt: u32) -> Result<SceneSpec, LabError> {
    const SEED: u64 = 0x6f72_6469;
    let mut random = Random(SEED ^ (u64::from(number) << 32 | u64::from(attempt)));
    let (kind, happens) = KINDS[number as usize % KINDS.len()];
    let mut spec = mesh(number, &mut random)?;
    spec.name = String::leak(format!("{kind}-{:02}", number as usize / KINDS.len()));
    spec.element =
        random.one_of(&[Element::Linear, Element::NodalPressure, Element::NodalPressure, Element::NodalStrain]);
    spec.damping = random.one_of(&[5.0, 10.0, 20.0]);
    let shear = tissue(&mut spec, 0.3, &mut random);
    let body = hold(&mut spec, shear, &mut random);
    happens(&mut spec, &body, &mut random);
    (spec.timing, spec.intervals) = timing_of(critical_step(&spec)?, random.between(0.8, 1.2));
    Ok(spec)
}

/// Bars of 2,900 to 6,700 tetrahedra and irregular meshes of 2,400 to 8,200, with edges of 5 to 10 mm.
fn mesh(number: u32, random: &mut Random) -> Result<SceneSpec, LabError> {
    let file = match (number / KINDS.len() as u32 + number) % 6 {
        0 => Some(CYLINDER),
        2 => Some(BEAM),
        4 => Some(LOBE),
        _ => None,
    };
    if let Some(file) = file {
        let (mut spec, _) = held_at_its_end("", file)?;
        spec.supports.clear();
        return Ok(spec);
    }
    let edge = random.between(5e-3, 7e-3);
    let cells = [random.one_of(&[10, 12, 14]), random.one_of(&[8, 9, 10]), random.one_of(&[6, 7, 8])];
    let shape = Bar { size: cells.map(|count| count as f32 * edge * random.between(0.9, 1.1)), cells };
    let mut spec = SceneSpec { supports: Vec::new(), ..bar("", Vec::new()) };
    (spec.points, spec.tets) = (shape.points().collect(), shape.tets().collect());
    Ok(spec)
}

/// Young's modulus 2 to 20 kPa, Poisson's ratio 0.45 to 0.49; a share of the bodies stiffens. Gives the shear modulus, Pa.
pub(super) fn tissue(spec: &mut SceneSpec, stiffening: f32, random: &mut Random) -> f32 {
    let (young, ratio) = (random.scale(2e3, 2e4), random.one_of(&[10.0, 20.0, 50.0]));
    let shear = young * (3.0 * ratio + 1.0) / (9.0 * ratio);
    spec.law = if random.chance(stiffening) {
        AnyLaw::Exponential(Exponential { a: shear, b: random.between(1.0, 4.0), d: 0.5 * ratio * shear })
    } else {
        AnyLaw::NeoHookean(NeoHookean { c: 0.5 * shear, d: 0.5 * ratio * shear })
    };
    shear
}

/// Holds a face across one of the two shorter axes: a body that lies or hangs by a broad side.
fn hold(spec: &mut SceneSpec, shear: f32, random: &mut Random) -> Body {
    let points = || spec.points.iter().map(|point| Vec3::from(*point));
    let low = points().fold(Vec3::INFINITY, Vec3::min);
    let high = points().fold(Vec3::NEG_INFINITY, Vec3::max);
    let extent = high - low;
    let mut axes = [0, 1, 2];
    axes.sort_by(|&a, &b| extent[a].total_cmp(&extent[b]));
    let (axis, is_low) = (random.one_of(&axes[..2]), random.chance(0.5));
    let share = |point: Vec3| {
        let from_low = (point[axis] - low[axis]) / extent[axis];
        if is_low { from_low } else { 1.0 - from_low }
    };
    let mut outward = Vec3::ZERO;
    outward[axis] = if is_low { -1.0 } else { 1.0 };
    let angle = random.between(0.0, core::f32::consts::TAU);
    let mut across = Vec3::ZERO;
    [across[(axis + 1) % 3], across[(axis + 2) % 3]] = [angle.cos(), angle.sin()];
    let middle = 0.5 * (low + high);
    let off_axis = |point: Vec3| (point - middle).reject_from_normalized(outward).length();
    // Among the nodes near the middle the one farthest from the held face: the other side need not be flat.
    let near = 0.2 * extent.min_element();
    let far = points().filter(|point| off_axis(*point) < near).max_by(|a, b| share(*a).total_cmp(&share(*b)));
    let far = far.unwrap_or(middle);
    spec.supports =
        nodes_where(spec, |point| share(Vec3::from(point)) < FACE).into_iter().map(Support::fixed).collect();
    Body { outward, across, depth: share(far) * extent[axis], far, shear }
}

/// Nodes of the side across that an instrument of this radius (m) would hold.
fn patch(spec: &SceneSpec, body: &Body, radius: f32) -> Vec<u32> {
    let held: Vec<u32> = spec.supports.iter().map(|support| support.node).collect();
    let nodes = nodes_where(spec, |point| Vec3::from(point).distance(body.far) < radius);
    nodes.into_iter().filter(|node| !held.contains(node)).collect()
}

/// A way and the time that it takes at the speed of a hand.
fn way(body: &Body, random: &mut Random) -> (f32, f32) {
    let metres = random.between(0.08, 0.25) * body.depth;
    (metres, metres / random.between(0.01, 0.04))
}

/// Gravity acts from the start: the body hangs, sits, or sags aside.
fn hang(spec: &mut SceneSpec, body: &Body, random: &mut Random) {
    let down = random.one_of(&[-body.outward, body.outward, body.across]);
    spec.gravity = (G * down).to_array();
}

/// What grips the side across moves in, or aside.
fn push(spec: &mut SceneSpec, body: &Body, random: &mut Random) {
    let (metres, ramp) = way(body, random);
    let direction = (body.outward + random.between(0.0, 1.0) * body.across).normalize();
    let metre = (metres * direction).to_array();
    let nodes = patch(spec, body, random.between(0.01, 0.015));
    spec.motions = nodes.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp }).collect();
    spec.supports.extend(nodes.into_iter().map(Support::moved));
}

/// A force draws the side across out or aside, and is there within half a second.
fn pull(spec: &mut SceneSpec, body: &Body, random: &mut Random) {
    let direction = (-random.between(0.3, 1.0) * body.outward + body.across).normalize();
    let nodes = patch(spec, body, random.between(0.012, 0.018));
    let whole = random.between(0.05, 0.15) * body.shear * body.depth * body.depth;
    let newton = (whole / nodes.len() as f32 * direction).to_array();
    let ramp = random.between(0.25, 0.5);
    spec.forces = nodes.into_iter().map(|node| NodalForce { node, newton, ramp }).collect();
}

/// The held face goes to and fro under gravity.
fn breathe(spec: &mut SceneSpec, body: &Body, random: &mut Random) {
    hang(spec, body, random);
    let direction = random.one_of(&[body.across, body.outward]);
    let metre = (random.between(0.005, 0.015) * direction).to_array();
    let held = core::mem::take(&mut spec.supports);
    let motion = |support: &Support| Motion { node: support.node, axes: Axes::XYZ, metre, ramp: 0.0 };
    spec.motions = held.iter().map(motion).collect();
    spec.supports = held.into_iter().map(|support| Support::moved(support.node)).collect();
    spec.course = Course::Alternating(f64::from(random.between(2.0, 4.0)));
}

/// The body sits on its held face, and gravity turns by 15 to 35 degrees.
fn table(spec: &mut SceneSpec, body: &Body, random: &mut Random) {
    let (sin, cos) = random.between(15.0, 35.0).to_radians().sin_cos();
    spec.gravity = (G * body.outward).to_array();
    let tilted = G * (cos * body.outward + sin * body.across);
    spec.course = Course::Turned(tilted.to_array(), f64::from(random.between(0.4, 0.8)));
}

/// A ball presses into the side across.
fn instrument(spec: &mut SceneSpec, body: &Body, random: &mut Random) {
    /// m.
    const GAP: f32 = 0.001;
    let (metres, ramp) = way(body, random);
    let radius = random.between(0.01, 0.015);
    let start = body.far - (radius + GAP) * body.outward;
    let mut ball = Instrument::resting(Shape::Sphere { radius }, Pose::at(start.to_array()));
    ball.friction = random.between(0.0, 0.4);
    ball.move_to(Pose::at((start + (metres + GAP) * body.outward).to_array()), 0.0, f64::from(ramp));
    spec.instrument = Some(ball);
}
