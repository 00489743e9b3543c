//! Presses: a ball comes upon a body that is free, held at a few nodes or at a face, pushes it and stops. Where a body
//! can give way, the impulse decides where it is a second later, so that nothing forgives an error of contact. The same
//! number gives the same scene.

use glam::Vec3;
use supple::contact::{Instrument, Pose, Shape};
use supple::material::Element;
use supple::mesh::Bar;
use supple::scene::Support;

use super::super::LabError;
use super::super::moving::critical_step;
use super::super::random_numbers::Random;
use super::super::scenes::{CYLINDER, LOBE, SceneSpec, bar, held_at_its_end};
use super::ordinary::tissue;
use super::random::lowest;
use super::timing_of;

/// How many there are unless another number is asked for.
pub const SCENES: u32 = 100;

/// The most that a node moves, m.
pub(super) const FARTHEST: f64 = 0.1;

/// Between ball and body at the start, m.
const GAP: f32 = 0.0005;

/// The scene with this number; a scene without a believable truth is drawn anew with the next `attempt`.
pub fn scene(number: u32, attempt: u32) -> Result<SceneSpec, LabError> {
    const SEED: u64 = 0x7072_6573;
    let mut random = Random(SEED ^ (u64::from(number) << 32 | u64::from(attempt)));
    let mut spec = body(&mut random)?;
    spec.name = String::leak(format!("press-{number:03}"));
    spec.element =
        random.one_of(&[Element::Linear, Element::NodalPressure, Element::NodalPressure, Element::NodalStrain]);
    spec.damping = random.one_of(&[0.5, 1.0, 2.0, 5.0, 10.0, 20.0]);
    tissue(&mut spec, 0.2, &mut random);
    let points: Vec<Vec3> = spec.points.iter().map(|point| Vec3::from(*point)).collect();
    let centre = points.iter().copied().sum::<Vec3>() / points.len() as f32;
    // Out of the body, where the ball is.
    let mut out = Vec3::ZERO;
    out[(random.next_u64() % 3) as usize] = if random.chance(0.5) { 1.0 } else { -1.0 };
    out = (out + Vec3::from_array([0; 3].map(|_| random.between(-0.3, 0.3)))).normalize();
    let radius = random.between(0.008, 0.016);
    // The ball touches the body where it comes first along a line near the centre.
    let aside = Vec3::from_array([0; 3].map(|_| random.between(-0.01, 0.01))).reject_from_normalized(out);
    let line = centre + aside;
    let height = |point: &Vec3| {
        let from = *point - line;
        let across = from.reject_from_normalized(out).length_squared();
        (across < radius * radius).then(|| from.dot(out) + (radius * radius - across).sqrt())
    };
    let first = points.iter().filter_map(height).fold(0.0, f32::max);
    hold(&mut spec, &points, line - out * first, &mut random);
    let depth = random.between(0.003, 0.012);
    let speed = random.scale(0.008, 0.06);
    let start = line + (first + GAP) * out;
    let way = (random.between(0.0, 0.3) * out.any_orthonormal_vector() - out).normalize();
    let mut ball = Instrument::resting(Shape::Sphere { radius }, Pose::at(start.to_array()));
    ball.friction = random.one_of(&[0.0, 0.3, 0.8]);
    ball.move_to(Pose::at((start + (depth + GAP) * way).to_array()), 0.0, f64::from((depth + GAP) / speed));
    spec.instrument = Some(ball);
    (spec.timing, spec.intervals) = timing_of(critical_step(&spec)?, random.between(0.6, 1.0));
    Ok(spec)
}

/// Bars of 800 to 3,100 tetrahedra and irregular meshes of 2,400 to 8,200.
fn body(random: &mut Random) -> Result<SceneSpec, LabError> {
    if random.chance(0.25) {
        let (mut spec, _) = held_at_its_end("", random.one_of(&[CYLINDER, LOBE]))?;
        spec.supports.clear();
        return Ok(spec);
    }
    let edge = random.between(6e-3, 9e-3);
    let cells = [0; 3].map(|_| random.one_of(&[5, 6, 7, 8]));
    let shape = Bar { size: cells.map(|count| count as f32 * edge), cells };
    let mut spec = SceneSpec { supports: Vec::new(), ..bar("", Vec::new()) };
    (spec.points, spec.tets) = (shape.points().collect(), shape.tets().collect());
    Ok(spec)
}

/// Not at all, at the nodes nearest to a corner, or at the side across from `across`.
fn hold(spec: &mut SceneSpec, points: &[Vec3], across: Vec3, random: &mut Random) {
    let share = match random.next_u64() % 10 {
        0..=4 => return,
        5..=6 => random.between(0.004, 0.02),
        _ => random.between(0.06, 0.15),
    };
    let at = if share < 0.05 { random.one_of(points) } else { across };
    let nodes = lowest(points.iter().map(|point| point.distance(at)), share);
    spec.supports = nodes.into_iter().map(Support::fixed).collect();
}
