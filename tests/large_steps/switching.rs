//! Steps of one method after steps of another, and states that were reset or replaced: nothing is refused, and inertia
//! of another state is not used.

use supple::loads::Loads;
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use crate::large_steps::{limit, prepared};
use crate::support::bodies::{held, small_bar, torsion};
use crate::support::{Body, NEO, largest_distance, mean_distance, rest_of, tissue, to_f64};

/// 40 long steps, 200 exact ones, 40 long ones: the exact motion is followed as well as by long steps alone.
#[test]
fn long_and_exact_steps_may_follow_each_other() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let forces = torsion(&body, 5e-3, 0.05);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let short = Step::unchecked(0.4 * limit(&scene), 100.0).unwrap();
    let long = Step::unchecked(10.0 * limit(&scene), 100.0).unwrap();
    let (mut exact, mut mixed, mut alone) = (rest_of(&scene), rest_of(&scene), rest_of(&scene));
    let mut large = prepared(&body, &scene, &mut mixed, long, 2.0);
    let mut same = prepared(&body, &scene, &mut alone, long, 2.0);
    let mut run_long = |state: &mut VecState| {
        (0..40).for_each(|_| assert!(large.step(scene.view(), &loads, state.view()).is_taken()));
    };
    run_long(&mut mixed);
    for _ in 0..200 {
        assert_eq!(tled::step(&scene, &loads, &mut mixed, &short), Status::Ok);
    }
    run_long(&mut mixed);
    while exact.time() < mixed.time() {
        assert_eq!(tled::step(&scene, &loads, &mut exact, &short), Status::Ok);
    }
    while alone.time() < mixed.time() {
        assert!(same.step(scene.view(), &loads, alone.view()).is_taken());
    }
    let [truth, mixed, alone] = [&exact, &mixed, &alone].map(|state| to_f64(state.displacements()));
    let way = mean_distance(&truth, &vec![[0.0; 3]; truth.len()]);
    let [mixed, alone] = [mixed, alone].map(|moved| mean_distance(&truth, &moved) / way);
    println!("{:.1} mm, off by {mixed:.3} of that, long steps alone by {alone:.3}", 1e3 * way);
    assert!(way > 1e-3 && mixed < 1.1 * alone.max(0.01));
}

/// After a reset, and in a state of another run, a step is that of an inertia prepared for that state.
#[test]
fn inertia_of_another_state_is_computed_anew() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let forces = torsion(&body, 5e-3, 0.05);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(10.0 * limit(&scene), 5.0).unwrap();
    let mut bent = rest_of(&scene);
    let mut large = prepared(&body, &scene, &mut bent, step, 2.0);
    for _ in 0..60 {
        assert!(large.step(scene.view(), &loads, bent.view()).is_taken());
    }
    let stale = large.report().added_mean;
    for start in [rest_of(&scene), bent.clone()] {
        let mut first = start.clone();
        let mut fresh = prepared(&body, &scene, &mut first, step, 2.0);
        let mut reset = rest_of(&scene);
        assert!(large.step(scene.view(), &loads, reset.view()).is_taken());
        let mut second = start.clone();
        let mut first = start;
        for _ in 0..5 {
            assert!(fresh.step(scene.view(), &loads, first.view()).is_taken());
            assert!(large.step(scene.view(), &loads, second.view()).is_taken());
        }
        let apart = largest_distance(&to_f64(first.displacements()), &to_f64(second.displacements()));
        println!(
            "added inertia {stale:.0}, {:.0} in a state of its own, {:.0} renewed, {apart:.1e} m apart",
            fresh.report().added_mean,
            large.report().added_mean
        );
        assert!(apart < 1e-8);
    }
}

/// The number of steps alone does not tell a state.
#[test]
fn inertia_of_another_state_with_as_many_steps_is_computed_anew() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let forces = torsion(&body, 5e-3, 0.05);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(10.0 * limit(&scene), 5.0).unwrap();
    let short = Step::unchecked(0.4 * limit(&scene), 5.0).unwrap();
    let (mut bent, mut other) = (rest_of(&scene), rest_of(&scene));
    let mut large = prepared(&body, &scene, &mut bent, step, 2.0);
    for _ in 0..60 {
        assert!(large.step(scene.view(), &loads, bent.view()).is_taken());
        assert_eq!(tled::step(&scene, &Loads::NONE, &mut other, &short), Status::Ok);
    }
    assert_eq!(bent.steps(), other.steps());
    let stale = large.report().added_mean;
    let mut first = other.clone();
    let mut fresh = prepared(&body, &scene, &mut first, step, 2.0);
    for _ in 0..5 {
        assert!(fresh.step(scene.view(), &loads, first.view()).is_taken());
        assert!(large.step(scene.view(), &loads, other.view()).is_taken());
    }
    let apart = largest_distance(&to_f64(first.displacements()), &to_f64(other.displacements()));
    let added = [stale, fresh.report().added_mean, large.report().added_mean];
    println!("added inertia {added:.0?} of the bent, the own and the renewed state, {apart:.1e} m apart");
    assert!(apart < 1e-8 && (added[2] / added[1] - 1.0).abs() < 1e-3, "{added:?}");
}

/// Two scenes with the same number of nodes and elements.
#[test]
fn inertia_of_another_scene_of_the_same_size_is_refused() {
    let [body, other] = [[0.02, 0.02, 0.06], [0.02, 0.03, 0.06]].map(|size| Body::bar(size, [2, 2, 6]));
    let [scene, other] = [&body, &other].map(|body| body.scene(tissue(NEO), &held(body)));
    let mut state = rest_of(&scene);
    let step = Step::unchecked(10.0 * limit(&scene), 0.0).unwrap();
    let mut large = prepared(&body, &scene, &mut state, step, 0.0);
    let nodes = scene.node_count();
    assert_eq!(nodes, other.node_count());
    let status = large.step(other.view(), &Loads::NONE, state.view());
    assert_eq!(status, Status::Mismatch { nodes, room: 0 });
    assert_eq!(large.step(scene.view(), &Loads::NONE, state.view()), Status::Ok);
}

/// A body that falls as fast as damping lets it goes on so where steps become long, and no energy is missing: damping acts
/// as long as the weight does.
#[test]
fn a_steady_fall_goes_on_where_steps_become_long() {
    let (body, damping) = (small_bar(), 200.0);
    let scene = body.scene(tissue(NEO), &[]);
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &[], &[]).unwrap();
    let short = Step::unchecked(0.5 * limit(&scene), damping).unwrap();
    let long = Step::unchecked(10.0 * limit(&scene), damping).unwrap();
    let mut state = rest_of(&scene);
    let mut large = prepared(&body, &scene, &mut state, long, 2.0);
    while state.time() < 0.1 {
        assert_eq!(tled::step(&scene, &loads, &mut state, &short), Status::Ok);
    }
    let height = |state: &VecState| {
        let all = state.displacements();
        all.iter().map(|moved| f64::from(moved.to_array()[2])).sum::<f64>() / all.len() as f64
    };
    let (time, from) = (state.time(), height(&state));
    for _ in 0..10 {
        assert_eq!(large.step(scene.view(), &loads, state.view()), Status::Ok);
    }
    let speed = (from - height(&state)) / (state.time() - time) * f64::from(damping) / 9.81;
    println!("{speed:.4} of the steady speed in ten long steps");
    assert!((speed - 1.0).abs() < 2e-3);
}
