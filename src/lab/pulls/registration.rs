//! How well and how fast a free lobe follows tracked points of its surface. The truth is another model: eight times as
//! many elements of another kind (nodal pressure), an exponential law, gravity, a patch of the back that breathes and
//! drifts, two pads below. None of these is known to the model that follows. SI units.

use std::collections::HashMap;
use std::time::Instant;

use glam::{DMat3, DVec3, Vec3};
use supple::contact::{Instrument, Pose, Shape};
use supple::inertia::{self, Cells};
use supple::loads::Motion;
use supple::material::{Element, Exponential, VecMaterial};
use supple::mesh::{Mesh, Winding};
use supple::points::VecPoints;
use supple::scene::{Axes, BuildError, Support};
use supple::simulation::{Method, Settings, Simulation, SimulationError};
use supple::state::NodeVector;
use supple::step::Rayon;

use super::super::LabError;
use super::super::random_numbers::Random;
use super::{DAMPING, DENSITY, EDGES, FRAME, Lobe, MISSING, STIFFNESS, at};

/// Frames in which the truth moves, and all.
pub const FRAMES: [usize; 2] = [240, 300];
/// Frames at the end that count as at rest.
const AT_REST: usize = 30;
/// Error of a seen point along each axis, standard deviation, m.
const NOISE: f32 = 0.0005;
/// Targets, and how deep they are at least, m.
const TARGETS: usize = 300;
const DEEP: f32 = 0.006;
/// s; m: the patch goes along by so much while the lobe breathes in, and back; m/s: its drift.
const BREATH: f64 = 4.0;
const BREATHES: Vec3 = Vec3::new(0.004, -0.01, 0.008);
const DRIFT: Vec3 = Vec3::new(0.003, 0.0, -0.001);

/// Where surface and targets are at rest, and truly in each frame.
#[derive(Clone, Debug)]
pub struct Truth {
    targets: Vec<[f32; 3]>,
    /// In the first frame at rest under gravity: nodes of the surface, then targets, m.
    frames: Vec<Vec<[f32; 3]>>,
    /// Frames in which it moves.
    moving: usize,
}

impl Truth {
    /// Moves the other model by the first of the numbers of frames, and lets it come to rest until the second. Not
    /// `fine`, it has the mesh of the lobe itself, for tests.
    pub fn of(lobe: &Lobe, [moving, all]: [usize; 2], fine: bool) -> Result<Self, LabError> {
        let surface: Vec<Vec3> = lobe.surface.iter().map(|node| at(&lobe.points, *node)).collect();
        let is_deep = |place: &Vec3| surface.iter().all(|node| node.distance(*place) > DEEP);
        let mut random = Random(300);
        let inside = std::iter::repeat_with(|| lobe.inside(&mut random)).filter(is_deep);
        let targets: Vec<_> = inside.take(TARGETS).map(|place| place.to_array()).collect();

        let (points, tets) = if fine { refined(lobe) } else { (lobe.points.clone(), lobe.tets.clone()) };
        let held = |[x, y, _]: &[f32; 3]| (x + 0.03).abs() < 0.02 && *y > 0.025;
        let held: Vec<u32> = (0..).zip(&points).filter(|(_, point)| held(point)).map(|(node, _)| node).collect();
        let supports: Vec<_> = held.iter().copied().map(Support::moved).collect();
        let mesh = Mesh::new(&points, &tets, Winding::Checked).map_err(BuildError::Mesh)?;
        let surface = surface.iter().map(|node| node.to_array());
        let places: Vec<_> = surface.chain(targets.iter().copied()).collect();
        let mut followed = VecPoints::locate(&mesh, &places).map_err(SimulationError::Point)?;
        let law = Exponential { a: 1500.0, b: 8.023, d: 40_000.0 };
        let material = VecMaterial::one(Element::NodalPressure, law, DENSITY);
        let mut body = Simulation::new(points.clone(), tets.clone(), material, &supports)?.meeting(false)?;
        let pads = [(0.03, [0.03, -0.01, -0.03]), (0.02, [-0.04, -0.05, -0.03])];
        body.instruments =
            pads.map(|(radius, centre)| Instrument::resting(Shape::Sphere { radius }, Pose::at(centre))).to_vec();
        body.gravity = [2.0, -3.0, -8.0];
        body.settle_in_parts(1e-4, 20_000, &Rayon { parts: 2 })?;
        // Exact steps take three times as long, and are nowhere farther from these than 0.07 mm.
        let step = Some(10.0 * body.critical_step()?.seconds);
        let method = Method::Long(inertia::Method::new(Cells::Suggested));
        body.set(Settings { method, step, damping: DAMPING, guard: false, ..Settings::default() });
        let mut frames = Vec::new();
        for frame in 0..all {
            if frame > 0 {
                let time = frame.min(moving) as f64 * FRAME;
                let breath = 0.5 - 0.5 * (core::f64::consts::TAU * time / BREATH).cos();
                let metre = (breath as f32 * BREATHES + time as f32 * DRIFT).to_array();
                body.motions = held.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp: 0.0 }).collect();
                body.advance_in_parts(FRAME, &Rayon { parts: 2 })?;
            }
            followed.follow(body.state_mut()).map_err(SimulationError::Point)?;
            frames.push(followed.positions().to_vec());
        }
        Ok(Self { targets, frames, moving })
    }
}

/// Each tetrahedron in eight.
fn refined(lobe: &Lobe) -> (Vec<[f32; 3]>, Vec<[u32; 4]>) {
    let (mut points, mut middles) = (lobe.points.clone(), HashMap::new());
    let mut tets = Vec::new();
    for &tet in &lobe.tets {
        let [ab, ac, ad, bc, bd, cd] = EDGES.map(|pair| {
            let [a, b] = pair.map(|corner| tet[corner]);
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                points.push((0.5 * (at(&points, a) + at(&points, b))).to_array());
                points.len() as u32 - 1
            })
        });
        let [a, b, c, d] = tet;
        tets.extend([[a, ab, ac, ad], [ab, b, bc, bd], [ac, bc, c, cd], [ad, bd, cd, d]]);
        tets.extend([[ab, bc, ac, ad], [ab, bd, bc, ad], [bc, cd, ac, ad], [bc, bd, cd, ad]]);
    }
    (points, tets)
}

/// Nodes of the surface, each as far as can be from those before.
pub(super) fn spread(lobe: &Lobe, first: u32, count: usize) -> Vec<u32> {
    let mut chosen = vec![first];
    while chosen.len() < count {
        let apart = |node: u32| {
            let from = chosen.iter().map(|other| at(&lobe.points, *other).distance(at(&lobe.points, node)));
            from.fold(f32::INFINITY, f32::min)
        };
        chosen.extend(lobe.surface.iter().copied().max_by(|a, b| apart(*a).total_cmp(&apart(*b))));
    }
    chosen
}

/// The rigid motion that brings places nearest to others, by the polar factor of their covariance: Newton's iteration
/// (Higham 1986). For places that do not lie in a plane.
fn rigid_fit(from: &[Vec3], to: &[Vec3]) -> impl Fn(Vec3) -> Vec3 + use<> {
    let mean = |places: &[Vec3]| places.iter().map(|place| place.as_dvec3()).sum::<DVec3>() / places.len() as f64;
    let (a, b) = (mean(from), mean(to));
    let mut turn = DMat3::ZERO;
    for (from, to) in from.iter().zip(to) {
        let (arm, moved) = (from.as_dvec3() - a, to.as_dvec3() - b);
        turn += DMat3::from_cols(moved * arm.x, moved * arm.y, moved * arm.z);
    }
    turn *= 1.0 / turn.determinant().cbrt();
    for _ in 0..30 {
        turn = 0.5 * (turn + turn.inverse().transpose());
    }
    move |place| (turn * (place.as_dvec3() - a) + b).as_vec3()
}

/// The model, its tracked points, and the targets that tell how well it follows them.
struct Tracked {
    body: Simulation<'static>,
    /// The points at rest, m, and their places among those of the truth.
    at: Vec<Vec3>,
    places: Vec<usize>,
    /// Hidden points.
    targets: VecPoints,
    random: Random,
}

impl Tracked {
    /// So many points, far from each other, and the model where a rigid fit of them in the first frame brings it.
    fn new(lobe: &Lobe, truth: &Truth, points: usize, seed: u64) -> Result<Self, LabError> {
        let mut random = Random(seed);
        let nodes = spread(lobe, random.one_of(&lobe.surface), points);
        let places = nodes.iter().filter_map(|node| lobe.surface.binary_search(node).ok()).collect();
        let at: Vec<_> = nodes.iter().map(|node| at(&lobe.points, *node)).collect();
        let mesh = Mesh::new(&lobe.points, &lobe.tets, Winding::Checked).map_err(BuildError::Mesh)?;
        let targets = VecPoints::locate(&mesh, &truth.targets).map_err(SimulationError::Point)?;
        let mut tracked = Self { body: lobe.body(Element::NodalStrain)?, at, places, targets, random };
        let seen = tracked.seen(truth, 0);
        for (at, seen) in tracked.at.iter().zip(&seen) {
            let pull = tracked.body.pull(at.to_array(), lobe.radius, STIFFNESS)?;
            tracked.body.pulls[pull].put(seen.to_array());
        }
        let rigid = rigid_fit(&tracked.at, &seen);
        let moved = lobe.points.iter().map(|point| (rigid(Vec3::from(*point)) - Vec3::from(*point)).to_array());
        tracked.body.set_displacements(&moved.collect::<Vec<_>>())?;
        Ok(tracked)
    }

    fn seen(&mut self, truth: &Truth, frame: usize) -> Vec<Vec3> {
        let Self { places, random, .. } = self;
        places.iter().map(|place| Vec3::from(truth.frames[frame][*place]) + noise(random)).collect()
    }

    /// Where targets are now, in the model.
    fn look(&mut self) -> Result<(), LabError> {
        Ok(self.targets.follow(self.body.state_mut()).map_err(SimulationError::Point)?)
    }

    /// Mean distance of targets from where they truly are, of the model and of a rigid fit of the points, mm.
    fn errors(&self, truth: &Truth, frame: usize, seen: &[Vec3]) -> [f64; 2] {
        let (rigid, frame) = (rigid_fit(&self.at, seen), &truth.frames[frame]);
        let truly = &frame[frame.len() - truth.targets.len()..];
        let mut sums = [0.0; 2];
        for ((truly, now), rest) in truly.iter().zip(self.targets.positions()).zip(&truth.targets) {
            for (sum, place) in sums.iter_mut().zip([Vec3::from(*now), rigid(Vec3::from(*rest))]) {
                *sum += f64::from(place.distance(Vec3::from(*truly)));
            }
        }
        sums.map(|sum| 1e3 * sum / truly.len() as f64)
    }
}

/// From a normal distribution (Box and Muller 1958), m.
fn noise(random: &mut Random) -> Vec3 {
    Vec3::from_array([0; 3].map(|_| {
        let size = (-2.0 * random.between(1e-7, 1.0).ln()).sqrt();
        NOISE * size * (core::f32::consts::TAU * random.between(0.0, 1.0)).cos()
    }))
}

/// What became of moving points.
#[derive(Clone, Debug)]
pub struct Followed {
    /// Mean error of the targets, of the model and of a rigid fit, while the truth moves and at rest, mm.
    pub errors: [[f64; 2]; 2],
    /// Of each frame, in order, ms.
    pub times: Vec<f64>,
    /// Frames that were not `ok`.
    pub doubted: usize,
}

/// Follows so many points through the frames of the truth, each of which lacks 30 % of them, with so many seeds. The
/// time is that to set targets, turn points, advance, and look where the targets are. The rigid fit has each point
/// where it was seen last.
pub fn follow(lobe: &Lobe, truth: &Truth, points: usize, seeds: u64) -> Result<Followed, LabError> {
    let (mut times, mut errors, mut counts, mut doubted) = (vec![], [[0.0; 2]; 2], [0.0; 2], 0);
    for seed in 0..seeds {
        let mut tracked = Tracked::new(lobe, truth, points, seed)?;
        tracked.body.settle(1e-4, 20_000)?;
        tracked.body.prepare()?;
        let mut last = tracked.seen(truth, 0);
        for frame in 1..truth.frames.len() {
            let mut seen = tracked.seen(truth, frame);
            for (seen, last) in seen.iter_mut().zip(&mut last) {
                if tracked.random.chance(MISSING) {
                    *seen = Vec3::NAN;
                } else {
                    *last = *seen;
                }
            }
            let begin = Instant::now();
            let now = tracked.body.state().time();
            for (pull, seen) in tracked.body.pulls.iter_mut().zip(&seen) {
                pull.move_to(seen.to_array(), now, now + FRAME);
            }
            tracked.body.turn_pulls();
            let report = tracked.body.advance(FRAME)?;
            tracked.look()?;
            times.push(1e3 * begin.elapsed().as_secs_f64());
            doubted += usize::from(!report.is_ok());
            let is_at_rest = frame + AT_REST >= truth.frames.len();
            if frame <= truth.moving || is_at_rest {
                let kind = usize::from(is_at_rest);
                let [model, rigid] = tracked.errors(truth, frame, &last);
                errors[kind] = [errors[kind][0] + model, errors[kind][1] + rigid];
                counts[kind] += 1.0;
            }
        }
    }
    Ok(Followed { errors: [0, 1].map(|kind| errors[kind].map(|sum| sum / counts[kind])), times, doubted })
}

/// What a cold start takes with one seed.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    /// Steps until the body says that it rests.
    pub steps: u32,
    /// The same in ms.
    pub time: f64,
    /// Steps after which every node stays within a tenth of a millimetre of where it rests, to the next 10.
    pub within: u32,
    /// How far the farthest node is from there when the body says that it rests, mm.
    pub remaining: f64,
    /// Mean error of the targets then, of the model and of a rigid fit, mm.
    pub errors: [f64; 2],
}

/// From a rigid fit of so many points to rest. Where that is tells a body that settles a hundred times as near.
pub fn start(lobe: &Lobe, truth: &Truth, points: usize, seed: u64) -> Result<Start, LabError> {
    const LOOK: u32 = 10;
    const METRE: f32 = 1e-4;
    let mut tracked = Tracked::new(lobe, truth, points, seed)?;
    let begun: Vec<_> = tracked.body.displacements().iter().map(|moved| moved.to_array()).collect();
    let mut settle = |metre: f32, most: u32| {
        tracked.body.set_displacements(&begun)?;
        let begin = Instant::now();
        let settled = tracked.body.settle(metre, most)?;
        Ok::<_, LabError>((settled, 1e3 * begin.elapsed().as_secs_f64(), tracked.body.displacements().to_vec()))
    };
    let (end, _, rest) = settle(0.01 * METRE, 20_000)?;
    if !end.at_rest {
        return Err(LabError::File(format!("{points} points, seed {seed}: the body does not come to rest")));
    }
    let far = |now: &[NodeVector]| {
        let [now, rest] = [now, &rest].map(|all| all.iter().map(|moved| Vec3::from_array(moved.to_array())));
        now.zip(rest).map(|(now, rest)| now.distance(rest)).fold(0.0, f32::max)
    };
    let (settled, time, shape) = settle(METRE, 20_000)?;
    let mut within = 0;
    for steps in (LOOK..=settled.steps).step_by(LOOK as usize) {
        if far(&settle(METRE, steps)?.2) > METRE {
            within = steps + LOOK;
        }
    }
    settle(METRE, 20_000)?;
    tracked.look()?;
    let seen: Vec<_> = tracked.body.pulls.iter().map(|pull| Vec3::from(pull.to)).collect();
    let errors = tracked.errors(truth, 0, &seen);
    Ok(Start { steps: settled.steps, time, within, remaining: 1e3 * f64::from(far(&shape)), errors })
}
