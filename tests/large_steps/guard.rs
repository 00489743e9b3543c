//! Guards (`supple::guard`): a second run with longer steps estimates the error, and says when a step is not to be
//! believed.

use supple::guard::{Allowed, EVERY, Guard};
use supple::inertia::{Cells, InertiaError, LargeStep, Method};
use supple::loads::{Loads, NodalForce};
use supple::material::VecMaterial;
use supple::scene::VecScene;
use supple::state::VecState;
use supple::step::{Status, Step};

use crate::large_steps::VecLargeStep;
use crate::support;
use crate::support::bodies::{held, torsion};
use crate::support::{Body, EXP, bound, mean_distance, rest_of, tissue, to_f64};

type Scene = VecScene<VecMaterial>;
type VecGuard = Guard<Vec<supple::state::NodeVector>>;

const DAMPING: f32 = 20.0;
const SNAPSHOTS: usize = 10;
/// Exact steps between two snapshots.
const INTERVAL: u32 = 400;

fn bar() -> (Body, Scene) {
    let body = Body::irregular([0.02, 0.02, 0.06], [4, 4, 10]);
    let scene = body.scene(tissue(EXP), &held(&body));
    (body, scene)
}

fn prepared(body: &Body, scene: &Scene, state: &mut VecState, seconds: f32) -> (VecLargeStep, VecGuard) {
    let step = Step::unchecked(seconds, DAMPING).unwrap();
    let method = Method::new(Cells::Suggested);
    let large = LargeStep::prepare_in_vec(method, scene.view(), &body.points, state.view(), step).unwrap();
    let guard = Guard::prepare_in_vec(scene.view(), &body.points, state.view(), step, EVERY).unwrap();
    (large, guard)
}

/// Of a run against the exact one.
struct Judged {
    /// Means over nodes and snapshots, mm: the estimate, the true error, and how far the body moves.
    estimate: f64,
    error: f64,
    motion: f64,
    /// Snapshots whose error is above the estimate, and those whose step was inexact.
    above: usize,
    inexact: usize,
}

fn judged(gravity: [f32; 3], forces: &[NodalForce], multiple: u32, is_frozen: bool) -> Judged {
    let (body, scene) = bar();
    let loads = Loads::new(&scene, gravity, forces, &[]).unwrap();
    let dt = 0.5 * bound(&scene, &rest_of(&scene)).seconds;
    let exact = Step::unchecked(dt, DAMPING).unwrap();
    let (mut truth, mut state) = (rest_of(&scene), rest_of(&scene));
    let (mut large, mut guard) = prepared(&body, &scene, &mut state, multiple as f32 * dt);
    let mut judged = Judged { estimate: 0.0, error: 0.0, motion: 0.0, above: 0, inexact: 0 };
    for _ in 0..SNAPSHOTS {
        support::run(&scene, &loads, &mut truth, &exact, u64::from(INTERVAL));
        let mut last = Status::Ok;
        for _ in 0..INTERVAL / multiple {
            let seen = if is_frozen { &Loads::NONE } else { &loads };
            let status = large.step(scene.view(), seen, state.view());
            assert!(status.is_taken(), "{status:?}");
            last = guard.follow(status, scene.view(), &loads, state.view());
        }
        let estimate = guard.estimate().unwrap();
        assert!(estimate.largest >= estimate.mean && (estimate.node as usize) < body.points.len());
        let (truth, state) = (to_f64(truth.displacements()), to_f64(state.displacements()));
        let (estimate, error) = (1e3 * f64::from(estimate.mean), 1e3 * mean_distance(&truth, &state));
        judged.estimate += estimate / SNAPSHOTS as f64;
        judged.error += error / SNAPSHOTS as f64;
        judged.motion += 1e3 * mean_distance(&truth, &vec![[0.0; 3]; truth.len()]) / SNAPSHOTS as f64;
        judged.above += usize::from(error > estimate);
        judged.inexact += usize::from(matches!(last, Status::Inexact { .. }));
    }
    judged
}

#[test]
fn the_estimate_covers_the_error_and_grows_with_the_step() {
    let (body, _) = bar();
    let twist = torsion(&body, 5e-4, 0.1);
    let lean = [0.5, 0.0, 0.0];
    type Case<'a> = (&'a str, [f32; 3], &'a [NodalForce], &'a [u32]);
    let cases: [Case; 2] = [("leaning", lean, &[][..], &[10, 20, 40][..]), ("torsion", [0.0; 3], &twist, &[10, 20])];
    for (name, gravity, forces, multiples) in cases {
        let mut before = 0.0;
        for &multiple in multiples {
            let Judged { estimate, error, motion, above, inexact } = judged(gravity, forces, multiple, false);
            println!(
                "{name} at {multiple}: {estimate:.4} mm estimated, {error:.4} mm true of \
                 {motion:.2}, {above} of {SNAPSHOTS} snapshots above, {inexact} inexact"
            );
            assert!(above <= 3 && estimate < 20.0 * error, "{name} at {multiple}");
            assert!(estimate > before, "{name} at {multiple}: {before} {estimate}");
            before = estimate;
        }
    }
}

#[test]
fn a_frozen_body_is_called_inexact_and_a_good_run_is_not() {
    // Loads that the steps do not see.
    let frozen = judged([0.5, 0.0, 0.0], &[], 20, true);
    // The first snapshots are before it could have moved by a hundredth of its size.
    assert!(frozen.error > 0.8 * frozen.motion && frozen.inexact >= 8, "{}", frozen.inexact);
    let good = judged([0.5, 0.0, 0.0], &[], 20, false);
    assert!(good.error < 0.05 * good.motion && good.inexact == 0, "{}", good.inexact);
}

#[test]
fn a_body_at_rest_has_no_error() {
    let (body, scene) = bar();
    let mut state = rest_of(&scene);
    let (mut large, mut guard) = prepared(&body, &scene, &mut state, 5e-3);
    assert_eq!(guard.estimate(), None);
    for _ in 0..50 {
        let status = large.step(scene.view(), &Loads::NONE, state.view());
        assert_eq!(guard.follow(status, scene.view(), &Loads::NONE, state.view()), Status::Ok);
        let estimate = guard.estimate().unwrap();
        assert_eq!([estimate.mean, estimate.largest], [0.0; 2]);
    }
}

#[test]
fn a_tolerance_in_metres_takes_the_place_of_the_share() {
    let (body, scene) = bar();
    let loads = Loads::new(&scene, [0.5, 0.0, 0.0], &[], &[]).unwrap();
    let mut state = rest_of(&scene);
    let (mut large, guard) = prepared(&body, &scene, &mut state, 2e-3);
    let mut guard = guard.allowing(Allowed::Metres(1e-7));
    let mut inexact = 0;
    for _ in 0..50 {
        let status = large.step(scene.view(), &loads, state.view());
        if let Status::Inexact { error, allowed } = guard.follow(status, scene.view(), &loads, state.view()) {
            assert!(error > allowed && allowed == 1e-7);
            inexact += 1;
        }
    }
    assert!(inexact > 40, "{inexact}");
}

#[test]
fn a_state_that_was_reset_begins_a_new_second_run() {
    let (body, scene) = bar();
    let loads = Loads::new(&scene, [2.0, 0.0, 0.0], &[], &[]).unwrap();
    let mut state = rest_of(&scene);
    let (mut large, mut guard) = prepared(&body, &scene, &mut state, 2e-3);
    let mut first = None;
    for _ in 0..2 {
        let mut estimates = vec![];
        for step in 0..40 {
            let status = large.step(scene.view(), &loads, state.view());
            let _ = guard.follow(status, scene.view(), &loads, state.view());
            // After a reset the guard has not seen the start.
            if step > 0 {
                estimates.push(guard.estimate().map(|estimate| estimate.mean));
            }
        }
        let moved = support::largest(&to_f64(state.displacements()));
        assert!(moved > 1e-3);
        let last = estimates.last().copied().flatten().unwrap();
        let first = *first.get_or_insert(last);
        assert!((0.5..2.0).contains(&(last / first)), "{first} {last}");
        state.reset();
    }
}

/// Places of which a scene makes no use, as a state of fixed size has them, do not slow a body down.
#[test]
fn room_to_spare_changes_no_estimate() {
    let (body, scene) = bar();
    let loads = Loads::new(&scene, [2.0, 0.0, 0.0], &[], &[]).unwrap();
    let estimates = |room: usize| {
        let mut state = VecState::at_rest(room * scene.node_count());
        let (mut large, mut guard) = prepared(&body, &scene, &mut state, 2e-3);
        let mut estimates = vec![];
        for _ in 0..40 {
            let status = large.step(scene.view(), &loads, state.view());
            let _ = guard.follow(status, scene.view(), &loads, state.view());
            estimates.push(guard.estimate().map(|estimate| [estimate.mean, estimate.largest]));
        }
        estimates
    };
    let [narrow, wide] = [1, 8].map(estimates);
    println!("{:?} m at first, {:?} at last", narrow.iter().flatten().next(), narrow.last());
    assert!(narrow.iter().flatten().count() > 20);
    assert_eq!(narrow, wide);
}

#[test]
fn memory_that_is_too_small_is_told_with_what_is_needed() {
    let (body, scene) = bar();
    let step = Step::unchecked(2e-3, DAMPING).unwrap();
    let needed = supple::guard::vectors_for(scene.view(), &body.points).unwrap();
    let mut storage = vec![supple::state::NodeVector::ZERO; needed - 1];
    let mut state = rest_of(&scene);
    let refused = Guard::prepare(scene.view(), &body.points, state.view(), step, EVERY, storage.as_mut_slice()).err();
    let capacity = needed - 1;
    assert_eq!(refused, Some(InertiaError::Capacity { kind: "vectors", needed, capacity }));
}

#[test]
fn a_step_may_be_shorter_than_the_one_that_was_prepared() {
    let body = Body::irregular([0.02, 0.02, 0.06], [4, 4, 10]);
    let scene = body.scene(tissue(EXP), &[]);
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &[], &[]).unwrap();
    let mut state = rest_of(&scene);
    let longest = 1e-3_f32;
    let step = Step::unchecked(longest, DAMPING).unwrap();
    let method = Method::new(Cells::Suggested);
    let mut large = LargeStep::prepare_in_vec(method, scene.view(), &body.points, state.view(), step).unwrap();
    let mut count = 0_u32;
    while state.time() < 0.4 {
        let seconds = longest * [1.0, 0.3, 0.5, 0.8][count as usize / 100 % 4];
        large.set_seconds(seconds).unwrap();
        let status = large.step(scene.view(), &loads, state.view());
        assert_eq!(status, Status::Ok, "{count} {:?}", large.report());
        count += 1;
    }
    // Falling with mass-proportional damping: v = g / mu (1 - exp(-mu t)).
    let (time, rate) = (state.time(), f64::from(DAMPING));
    let fallen = 9.81 / rate * (time - (1.0 - (-rate * time).exp()) / rate);
    for node in to_f64(state.displacements()) {
        assert!((node[2] / -fallen - 1.0).abs() < 5e-3, "{} of {fallen}", node[2]);
    }
    let refused = large.set_seconds(2e-3);
    assert_eq!(refused, Err(InertiaError::Step { seconds: 2e-3, most: 1e-3 }));
    let said = refused.unwrap_err().to_string();
    assert_eq!(said, "a step of 2e-3 s: it must be above zero and at most the prepared 1e-3 s");
}

/// Times of both runs are sums of rounded steps.
#[test]
fn a_guard_stays_in_step_over_a_long_session() {
    let (body, scene) = bar();
    let loads = Loads::new(&scene, [0.5, 0.0, 0.0], &[], &[]).unwrap();
    let mut state = rest_of(&scene);
    // Late in a session, after a step that is no binary fraction.
    let (mut large, mut guard) = prepared(&body, &scene, &mut state, 7e-4);
    let mut known = 0;
    for step in 0..30_000 {
        let status = large.step(scene.view(), &loads, state.view());
        let _ = guard.follow(status, scene.view(), &loads, state.view());
        known += usize::from(guard.estimate().is_some());
        assert_eq!(known, step + 1, "the second run was begun anew at {} s", state.time());
    }
    assert!(guard.estimate().unwrap().mean < 1e-4);
}
