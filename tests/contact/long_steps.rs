//! Instruments in long steps, against exact steps at a quarter of the critical one.

use supple::contact::{Contact, Instrument, Pose, Shape, Surface, Touch, vectors_to_push};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{self, Simulation};
use supple::state::NodeVector;
use supple::step::{Cause, Status, Step};
use supple::tled;

use super::scene::{Body, compared};
use crate::networks::uniform;

/// Who takes the steps.
enum Taker {
    Exact(Step),
    Long(Box<LargeStep<Vec<NodeVector>>>),
}

/// A body, its steps, and what the instruments do in them.
pub(crate) struct Run {
    pub(crate) body: Body,
    taker: Taker,
    pushes: Vec<NodeVector>,
    pub(crate) touch: [Touch; 1],
}

impl Run {
    pub(crate) fn new(mut body: Body, method: Option<Method>, seconds: f32, damping: f32) -> Self {
        let step = Step::unchecked(seconds, damping).unwrap();
        let (scene, points) = (body.scene.clone(), body.points.clone());
        let taker = match method {
            None => Taker::Exact(step),
            Some(method) => Taker::Long(Box::new(
                LargeStep::prepare_in_vec(method, scene.view(), &points, body.state(&mut []), step).unwrap(),
            )),
        };
        let pushes = vec![NodeVector::ZERO; vectors_to_push(body.surface.len(), body.triangles.len())];
        Self { body, taker, pushes, touch: [Touch::default()] }
    }

    pub(crate) fn step(&mut self, instrument: Instrument) -> Status {
        let Self { body, taker, pushes, touch } = self;
        let (surface, triangles, scene) = (body.surface.clone(), body.triangles.clone(), body.scene.clone());
        let instruments = [instrument];
        let surface = Surface::new(&surface, body.points.len()).unwrap().with_triangles(&triangles).unwrap();
        let contact = Contact::new(surface, &instruments).unwrap();
        let loads = Loads::NONE.touched_by(contact);
        let mut state = body.state(touch).pushing(pushes);
        match taker {
            Taker::Exact(step) => tled::step(&scene, &loads, &mut state, step),
            Taker::Long(large) => large.step(scene.view(), &loads, state),
        }
    }
}

pub(crate) const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [4, 4, 8] };

pub(crate) fn long() -> Method {
    Method::new(Cells::Given([1, 1, 2]))
}

/// A free body that is hit and dragged: the impulse of the instrument is the change of its momentum, whatever inertia
/// is added, up to the share of a force that steps give to rough motion twice in fast motion.
#[test]
fn the_impulse_of_an_instrument_is_the_change_of_momentum_in_long_steps() {
    let critical = Body::new(BAR, &[], 0.0).step.seconds();
    for multiple in [0.5, 4.0, 10.0] {
        let mut run = Run::new(Body::new(BAR, &[], 0.0), Some(long()), multiple * critical, 0.0);
        let mut sphere = Instrument::resting(Shape::Sphere { radius: 0.008 }, Pose::at([-0.0085, 0.009, 0.031]));
        sphere.friction = 0.4;
        sphere.move_to(Pose::at([-0.001, 0.012, 0.033]), 0.0, 0.1);
        let (mut impulse, mut pushed, mut first) = ([0.0f64; 3], 0, true);
        // Rough motion goes on after the hit: the mean of the momentum tells.
        let (mut mean, mut after) = ([0.0f64; 3], 0.0);
        while run.body.time() < 0.4 {
            let status = run.step(sphere);
            assert!(status.is_taken(), "{status:?}");
            // In the first step a force acts for half a step.
            let span = f64::from(multiple * critical) * if first { 0.5 } else { 1.0 };
            first = false;
            for (sum, force) in impulse.iter_mut().zip(run.touch[0].force) {
                *sum -= f64::from(force) * span;
            }
            pushed += u32::from(run.touch[0].contacts > 0);
            if run.body.time() > 0.2 {
                let (momentum, _) = run.body.momentum();
                (0..3).for_each(|axis| mean[axis] += momentum[axis]);
                after += 1.0;
            }
        }
        let scale = f64::from(run.body.step.seconds() / (multiple * critical));
        let momentum = mean.map(|sum| sum * scale / after);
        let (size, error) = compared(momentum, impulse);
        println!("{multiple} times: momentum {momentum:?}, impulse {impulse:?}, off by {:.1e}; {pushed} steps", error);
        assert!(pushed > 5 && size > 1e-5);
        assert!(error < if multiple < 1.0 { 6e-4 } else { 0.02 });
    }
}

/// Press by 3 mm, hold, slide by 2 mm and retract.
fn path(speed: f64) -> [(f64, [f32; 3]); 5] {
    let [press, hold, slide] = [0.003 / speed, 0.1, 0.002 / speed];
    let ends = [0.0, press, press + hold, press + hold + slide, 2.0 * press + hold + slide];
    let [out, inside] = [-0.0101, -0.0071];
    let at = [[out, 0.01, 0.03], [inside, 0.01, 0.03], [inside, 0.01, 0.03], [inside, 0.01, 0.032], [out, 0.01, 0.032]];
    [0, 1, 2, 3, 4].map(|part| (ends[part], at[part]))
}

/// Means of the force over the parts of the path, N, the deepest node, m, and the nodes that still touch at the end.
fn course(method: Option<Method>, seconds: f32, speed: f64) -> (Vec<[f64; 3]>, f32, u32) {
    const DAMPING: f32 = 20.0;
    let fixed: Vec<_> = (0..25).map(Support::fixed).collect();
    let mut run = Run::new(Body::new(BAR, &fixed, DAMPING), method, seconds, DAMPING);
    let path = path(speed);
    let mut sphere = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at(path[0].1));
    sphere.friction = 0.3;
    let (mut means, mut deepest) = (Vec::new(), 0.0f32);
    for (from, to) in path.iter().zip(&path[1..]) {
        sphere.move_to(Pose::at(to.1), from.0, to.0);
        let (mut sum, mut steps) = ([0.0f64; 3], 0);
        while run.body.time() < to.0 {
            let status = run.step(sphere);
            assert!(status.is_taken(), "{status:?}");
            for (sum, force) in sum.iter_mut().zip(run.touch[0].force) {
                *sum += f64::from(force);
            }
            steps += 1;
            let share = (((run.body.time() - from.0) / (to.0 - from.0)) as f32).min(1.0);
            let centre = [0, 1, 2].map(|axis| from.1[axis] + share * (to.1[axis] - from.1[axis]));
            for entry in &run.body.surface {
                let moved = run.body.displacement(entry.node as usize);
                let way: f32 = (0..3).map(|axis| (entry.rest[axis] + moved[axis] - centre[axis]).powi(2)).sum();
                deepest = deepest.max(0.01 - way.sqrt());
            }
        }
        means.push(sum.map(|sum| sum / f64::from(steps)));
    }
    (means, deepest, run.touch[0].contacts)
}

pub(crate) fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|component| component * component).sum::<f64>().sqrt()
}

/// Mean forces and penetration at three speeds, against exact steps at a quarter of the critical one.
#[test]
fn pressing_sliding_and_retracting_give_the_forces_of_exact_steps() {
    const EDGE: f32 = 0.005;
    let fixed: Vec<_> = (0..25).map(Support::fixed).collect();
    let critical = Body::new(BAR, &fixed, 20.0).step.seconds();
    // Beyond 20 mm/s steps so long do not resolve how the bar swings.
    for (speed, most, most_inside) in [(0.005, 0.025, 0.002), (0.02, 0.11, 0.002), (0.08, 0.7, 0.02)] {
        let (exact, _, left) = course(None, 0.25 * critical, speed);
        println!("{:.0} mm/s, exact: {exact:.4?}", 1e3 * speed);
        assert!(exact[1][0] < -1e-3 && left == 0);
        let all: f64 = exact.iter().map(|force| length(*force)).sum();
        let cases = [(None, 0.9), (Some(long()), 4.0), (Some(long()), 10.0), (Some(long()), 20.0)];
        for (method, multiple) in cases {
            let name = if method.is_some() { "long" } else { "exact" };
            let method_is_exact = method.is_none();
            let (means, deepest, left) = course(method, multiple * critical, speed);
            let parts = means.iter().zip(&exact).map(|(a, b)| length([0, 1, 2].map(|axis| a[axis] - b[axis])));
            let share = parts.sum::<f64>() / all;
            println!(
                "  {name} at {multiple}: force off by {:.1} %, {:.2} % of an edge inside: {means:.4?}",
                100.0 * share,
                100.0 * deepest / EDGE
            );
            assert!(left == 0, "{left} still touch");
            assert!(share < if method_is_exact { 0.05 } else { most } && deepest < most_inside * EDGE);
        }
    }
}

/// Instruments anywhere, of any size and speed, in long steps: a step is taken with finite numbers, or
/// refused.
#[test]
fn no_pose_makes_a_long_step_wrong_and_calls_it_right() {
    let fixed: Vec<_> = (0..25).map(Support::fixed).collect();
    let critical = Body::new(BAR, &fixed, 20.0).step.seconds();
    // More of them on demand.
    let asked = std::env::var("POSES").ok().and_then(|poses| poses.parse().ok());
    let poses = asked.unwrap_or(if cfg!(feature = "slow-tests") { 4_000 } else { 1_000 });
    let body = || Body::new(BAR, &fixed, 20.0);
    for (body, multiple) in [(body(), 4.0f32), (body(), 20.0), (body().with_triangles(), 20.0)] {
        let mut run = Run::new(body, Some(long()), multiple * critical, 20.0);
        let mut uniform = uniform(3);
        let mut random = || 0.5 * (uniform() + 1.0);
        let (mut taken, mut refused, mut touched) = (0, 0, 0);
        for pose in 0..poses {
            // What strays far is in the way of most instruments, which are refused.
            if pose % 1000 == 999 {
                run.body.state(&mut []).reset();
            }
            let place = [0.06, 0.06, 0.08].map(|size| size * (random() - 0.25));
            let direction = [random() - 0.5, random() - 0.5, random() - 0.5];
            let shape = match pose % 3 {
                0 => Shape::Sphere { radius: 1e-4 + 0.02 * random() },
                1 => Shape::Capsule { radius: 1e-4 + 0.01 * random(), length: 0.1 * random() + 1e-6 },
                _ => Shape::Plane,
            };
            let mut instrument = Instrument::resting(shape, Pose::along(place, direction));
            instrument.friction = 2.0 * random();
            // Up to 3 km/s.
            let way = 3000.0 * random().powi(8) * multiple * critical;
            let end = [0, 1, 2].map(|axis| place[axis] + way * direction[axis]);
            let now = run.body.time();
            instrument.move_to(Pose::along(end, direction), now, now + f64::from(multiple * critical));
            let status = run.step(instrument);
            if status.is_taken() {
                taken += 1;
                touched += usize::from(run.touch[0].contacts > 0);
                assert!(run.touch[0].force.iter().chain(&run.touch[0].moment).all(|part| part.is_finite()));
            } else {
                refused += 1;
                if !matches!(status, Status::Diverged(d) if matches!(d.cause, Cause::Instrument { .. })) {
                    run.body.state(&mut []).reset();
                }
            }
            if pose % 100 == 0 {
                let nodes = 0..run.body.points.len();
                assert!(nodes.into_iter().all(|node| run.body.displacement(node).iter().all(|u| u.is_finite())));
            }
        }
        let triangles = run.body.triangles.len();
        println!(
            "{triangles} triangles, {multiple} times: {taken} taken, {touched} of them touched; {refused} refused"
        );
        assert!(touched > poses / 100 && refused > poses / 100);
    }
}

/// A free cube that two planes squeeze comes to rest between them, as in exact steps: 81 nodes of each side push each other.
#[test]
fn many_nodes_rest_between_planes() {
    let cube = Bar { size: [0.03; 3], cells: [8; 3] };
    let squeezed = |method: simulation::Method<'static>| {
        let tissue = VecMaterial::one(Element::NodalStrain, NeoHookean { c: 1500.0, d: 22_500.0 }, 1000.0);
        let body = Simulation::new(cube.points(), cube.tets(), tissue, &[]).unwrap();
        let settings = simulation::Settings { method, damping: 20.0, ..simulation::Settings::default() };
        let mut body = body.with(settings).meeting(false).unwrap();
        body.gravity = [0.0, 0.0, -9.81];
        let plane = |height: f32, up: f32| {
            let pose = Pose::along([0.015, 0.015, height], [0.0, 0.0, up]);
            Instrument { friction: 0.4, ..Instrument::resting(Shape::Plane, pose) }
        };
        let [lower, mut upper] = [plane(0.0, 1.0), plane(0.03, -1.0)];
        upper.move_to(Pose::along([0.016, 0.015, 0.027], [0.0, 0.0, -1.0]), 0.0, 0.2);
        body.instruments = vec![lower, upper];
        for _ in 0..120 {
            body.advance(1.0 / 60.0).unwrap();
        }
        let speed = |node: u32| length(body.state().velocity(node as usize).map(f64::from));
        let fastest = (0..body.points().len() as u32).map(speed).fold(0.0, f64::max);
        let force = body.touches()[0].force;
        println!("lower plane {force:.4?} N, nodes move with up to {:.4} mm/s", 1e3 * fastest);
        (force, fastest)
    };
    let (exact, _) = squeezed(simulation::Method::Exact);
    let (force, fastest) = squeezed(simulation::Method::Long(Method::new(Cells::Suggested)));
    assert!(fastest < 1e-3 && (force[2] / exact[2] - 1.0).abs() < 0.06, "{force:?}, exact {exact:?}");
}
