//! Adaptive steps (`supple::adaptive`): the length is chosen so that the error stays below a tolerance, and a change of
//! it changes neither displacements nor velocities.

use supple::adaptive::{Adaptive, Request, Taken};
use supple::inertia::{Cells, Method};
use supple::loads::{Loads, NodalForce};
use supple::material::VecMaterial;
use supple::scene::VecScene;
use supple::state::{NodeVector, Progress, StateView, VecState};
use supple::step::{Status, Step};
use supple::tled;

use crate::large_steps::prepared;
use crate::support;
use crate::support::bodies::{held, torsion};
use crate::support::{Body, EXP, bound, mean_distance, rest_of, tissue, to_f64};

type Scene = VecScene<VecMaterial>;
type VecAdaptive = Adaptive<Vec<NodeVector>>;

const DAMPING: f32 = 20.0;
/// s.
const FRAME: f32 = 1.0 / 60.0;

fn bar() -> (Body, Scene) {
    let body = Body::irregular([0.02, 0.02, 0.06], [4, 4, 10]);
    let scene = body.scene(tissue(EXP), &held(&body));
    (body, scene)
}

fn adaptive(body: &Body, scene: &Scene, state: &mut VecState, tolerance: f32, damping: f32) -> VecAdaptive {
    let longest = Step::unchecked(FRAME, damping).unwrap();
    let method = Method::new(Cells::Suggested);
    let request = Request { tolerance, longest };
    Adaptive::prepare_in_vec(method, scene.view(), &body.points, state.view(), request).unwrap()
}

/// Of frames against the exact run in half of its step.
struct Judged {
    /// Largest true mean error at a frame, mean motion at the end, m.
    error: f64,
    motion: f64,
    taken: Taken,
    exact_steps: u32,
    /// Frames that were not ok, and those with an error above the tolerance without a word.
    told: usize,
    silent: usize,
}

fn judged(frames: usize, tolerance: f32, mut forces: impl FnMut(f64) -> Vec<NodalForce>, gravity: [f32; 3]) -> Judged {
    let (body, scene) = bar();
    let (mut truth, mut state) = (rest_of(&scene), rest_of(&scene));
    let limit = bound(&scene, &truth).seconds;
    let count = (f64::from(FRAME) / f64::from(0.5 * limit)).ceil() as u32;
    let exact = Step::unchecked(FRAME / count as f32, DAMPING).unwrap();
    let mut adaptive = adaptive(&body, &scene, &mut state, tolerance, DAMPING);
    let exact_steps = frames as u32 * (FRAME / (0.9 * limit)).ceil() as u32;
    let mut judged = Judged { error: 0.0, motion: 0.0, taken: Taken::default(), exact_steps, told: 0, silent: 0 };
    for frame in 0..frames {
        let forces = forces(state.time());
        let mut loads = Loads::new(&scene, gravity, &forces, &[]).unwrap();
        support::run(&scene, &loads, &mut truth, &exact, u64::from(count));
        let (status, taken) = adaptive.advance(FRAME, scene.view(), &mut loads, state.view());
        assert!(status.is_taken(), "{status:?}");
        let end = f64::from(FRAME) * (frame + 1) as f64;
        assert!((state.time() - end).abs() < 1e-6 * end, "a frame ends at {} instead of {end}", state.time());
        judged.taken = judged.taken + taken;
        let (truth, state) = (to_f64(truth.displacements()), to_f64(state.displacements()));
        let error = mean_distance(&truth, &state);
        judged.error = judged.error.max(error);
        judged.motion = mean_distance(&truth, &vec![[0.0; 3]; truth.len()]);
        judged.told += usize::from(status != Status::Ok);
        judged.silent += usize::from(status == Status::Ok && error > 1.2 * f64::from(tolerance));
    }
    judged
}

#[test]
fn the_error_stays_below_the_tolerance_with_fewer_steps() {
    let (body, _) = bar();
    let twist = torsion(&body, 1e-3, 0.2);
    let (mut steps, mut exact_steps) = (Vec::new(), 0);
    for tolerance in [2e-4, 5e-4, 2e-3] {
        let Judged { error, motion, taken, told, silent, exact_steps: all } =
            judged(60, tolerance, |_| twist.clone(), [0.3, 0.0, 0.0]);
        println!(
            "tolerance {:.2} mm: error at most {:.4} of {:.1} mm, {taken:?} of {all} exact steps, {told} frames told",
            1e3 * tolerance,
            1e3 * error,
            1e3 * motion
        );
        assert!(motion > 20.0 * f64::from(tolerance).min(1e-4), "the body hardly moves: {motion}");
        assert!(silent == 0 && error < 1.2 * f64::from(tolerance));
        steps.push(taken.exact);
        exact_steps = all;
    }
    assert!(steps.is_sorted_by(|a, b| a >= b), "more is tolerated, more steps are taken: {steps:?}");
    assert!(steps.last().is_some_and(|&steps| steps < exact_steps / 4));
}

/// A push that begins and ends at once: steps become shorter within frames, and errors above the tolerance are told.
#[test]
fn sudden_loads_shorten_the_steps() {
    let (body, _) = bar();
    let push: Vec<NodalForce> = torsion(&body, 2e-3, 0.0);
    let tolerance = 1e-4;
    let pushed = |time: f64| if (0.5..0.8).contains(&time) { push.clone() } else { Vec::new() };
    let Judged { error, motion, taken, told, silent, .. } = judged(90, tolerance, pushed, [0.05, 0.0, 0.0]);
    println!(
        "error at most {:.4} mm, {:.1} mm at the end, {taken:?}, {told} frames told, {silent} silent",
        1e3 * error,
        1e3 * motion
    );
    assert!(taken.changes >= 3 && taken.exact > 0 && taken.large > 0);
    assert!(silent == 0 && error < 7.0 * f64::from(tolerance));
}

/// Free fall over a metre, whose velocity any slip at a change of length would leave wrong for good: `g t^2 / 2`, and
/// half a step's more that the exact step takes at the start, at all lengths.
#[test]
fn changes_of_length_keep_the_velocity() {
    let body = Body::irregular([0.03, 0.02, 0.04], [4, 3, 5]);
    let scene = body.scene(tissue(EXP), &[]);
    let mut state = rest_of(&scene);
    let exact_seconds = 0.9 * bound(&scene, &state).seconds;
    let mut adaptive = adaptive(&body, &scene, &mut state, 5e-3, 0.0);
    let mut loads = Loads::new(&scene, [0.0, -9.81, 0.0], &[], &[]).unwrap();
    let mut taken = Taken::default();
    for _ in 0..30 {
        let (status, more) = adaptive.advance(FRAME, scene.view(), &mut loads, state.view());
        assert!(status.is_taken(), "{status:?}");
        taken = taken + more;
    }
    let time = state.time();
    let fallen = -state.displacements().iter().map(|u| f64::from(u.to_array()[1])).sum::<f64>()
        / scene.view().node_count() as f64;
    let expected = 0.5 * 9.81 * time * (time + f64::from(exact_seconds));
    println!("fallen by {:.3} mm, expected {:.3}, {taken:?}", 1e3 * fallen, 1e3 * expected);
    assert!(taken.changes >= 2 && taken.large > 20);
    assert!((fallen - expected).abs() < 1e-3 * expected);
}

/// From long steps to exact ones while a sudden twist spreads: with the increment of a long step as it is, the forces
/// of half a long step act at once on what has only its own inertia, and set the mesh ringing.
#[test]
fn a_shortened_increment_does_not_make_the_mesh_ring() {
    let (body, scene) = bar();
    let twist = torsion(&body, 1e-3, 0.0);
    let loads = Loads::new(&scene, [0.0; 3], &twist, &[]).unwrap();
    let limit = bound(&scene, &rest_of(&scene)).seconds;
    let (short, long) = (0.5 * limit, 20.0 * limit);
    let [exact, large] = [short, long].map(|seconds| Step::unchecked(seconds, DAMPING).unwrap());
    let mut truth = rest_of(&scene);
    support::run(&scene, &loads, &mut truth, &exact, 4 * 40 + 20);
    // Kinetic energy over that of the exact motion, 20 exact steps after 4 long ones.
    let ringing = [false, true].map(|shortened| {
        let mut state = rest_of(&scene);
        let mut step = prepared(&body, &scene, &mut state, large, 2.0);
        (0..4).for_each(|_| assert!(step.step(scene.view(), &loads, state.view()).is_taken()));
        if shortened {
            assert_eq!(step.shorten(short, scene.view(), &loads, state.view()), Status::Ok);
        }
        for _ in 0..20 {
            let _ = tled::step(&scene, &loads, &mut state, &exact);
        }
        state.energy_balance().kinetic / truth.energy_balance().kinetic
    });
    println!("{:.2} times the kinetic energy as it is, {:.2} shortened", ringing[0], ringing[1]);
    assert!(ringing[1] < 0.5 * ringing[0] && (0.2..2.0).contains(&ringing[1]));
}

#[test]
fn a_span_that_is_none_moves_nothing() {
    let (body, scene) = bar();
    let mut state = rest_of(&scene);
    let mut adaptive = adaptive(&body, &scene, &mut state, 1e-4, DAMPING);
    let mut loads = Loads::new(&scene, [1.0, 0.0, 0.0], &[], &[]).unwrap();
    for seconds in [0.0, -1.0, 1e-20, f32::MIN_POSITIVE, f32::NAN, f32::NEG_INFINITY] {
        let (status, taken) = adaptive.advance(seconds, scene.view(), &mut loads, state.view());
        assert_eq!((status, taken, state.steps()), (Status::Ok, Taken::default(), 0), "{seconds}");
    }
}

/// A host's frames are not of the length of the longest step to the last bit.
#[test]
fn frames_that_are_longer_by_a_rounding_are_followed() {
    let (body, scene) = bar();
    let mut state = rest_of(&scene);
    let mut adaptive = adaptive(&body, &scene, &mut state, 5e-3, DAMPING);
    let mut loads = Loads::new(&scene, [0.1, 0.0, 0.0], &[], &[]).unwrap();
    let mut last = Taken::default();
    for frame in 0..60 {
        let longer = FRAME * (1.0 + (frame % 8) as f32 * f32::EPSILON);
        let (status, taken) = adaptive.advance(longer, scene.view(), &mut loads, state.view());
        assert_eq!(status, Status::Ok, "frame {frame}");
        last = taken;
    }
    let expected = Taken { large: 1, seconds: last.seconds, ..Taken::default() };
    assert_eq!((last, adaptive.model().seconds()), (expected, FRAME), "the longest step is not in use");
}

/// A state that is no state is refused at every call, in a time that is bounded.
#[test]
fn a_state_without_a_critical_step_is_refused() {
    let (body, scene) = bar();
    let mut state = rest_of(&scene);
    let mut adaptive = adaptive(&body, &scene, &mut state, 1e-4, DAMPING);
    let mut loads = Loads::new(&scene, [1.0, 0.0, 0.0], &[], &[]).unwrap();
    let nodes = scene.view().node_count();
    let [mut displacement, mut remainder, mut increment, mut force] =
        [f32::NAN, 0.0, 0.0, 0.0].map(|component| vec![bytemuck::cast::<[f32; 4], NodeVector>([component; 4]); nodes]);
    let mut progress = Progress::START;
    let mut lost =
        StateView::new(&mut displacement, &mut remainder, &mut increment, &mut force, &mut [], &mut progress);
    for _ in 0..3 {
        let (status, taken) = adaptive.advance(FRAME, scene.view(), &mut loads, lost.reborrow());
        assert!(matches!(status, Status::Diverged(_)) && taken == Taken::default(), "{status:?} {taken:?}");
        assert_eq!(lost.steps(), 0);
    }
}
