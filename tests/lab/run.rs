//! One method over one scene, and the truths on disk that it is judged against.

use std::fs;

use supple_lab::LabError;
use supple_lab::course::Course;
use supple_lab::method::Method;
use supple_lab::run::{End, run};
use supple_lab::scenes::{self, SceneSpec};
use supple_lab::truth::{self, Truth};

/// A tenth of a second of a light scene.
fn short(name: &str) -> (SceneSpec, Truth) {
    let mut scene = scenes::named(name).unwrap();
    scene.intervals = 3;
    let truth = truth::compute(&scene).unwrap();
    (scene, truth)
}

#[test]
fn the_exact_step_is_the_truth_and_long_steps_diverge_and_say_so() {
    let (scene, truth) = short("cylinder");
    let exact = run(&scene, &truth, Method::Tled, 1).unwrap();
    let figures = exact.figures().unwrap();
    assert_eq!(figures.errors.skill(exact.hold), 1.0);
    assert_eq!(exact.end.to_string(), "ok");
    let hold = run(&scene, &truth, Method::Hold, 1).unwrap();
    assert_eq!(hold.figures().unwrap().errors.skill(hold.hold), 0.0);
    let long = run(&scene, &truth, Method::TledLargeStep, 100).unwrap();
    assert!(long.step_over_limit_rest > 1.0);
    assert!(matches!(long.end, End::Diverged(time) if time < 0.1), "{:?}", long.end);
}

#[test]
fn multiples_that_miss_the_snapshots_are_refused() {
    let (scene, truth) = short("cylinder");
    for multiple in [0, 3] {
        assert!(matches!(run(&scene, &truth, Method::Hold, multiple), Err(LabError::Multiple { .. })));
    }
}

#[test]
fn a_release_lets_go_after_its_interval() {
    let mut scene = scenes::named("release").unwrap();
    scene.course = Course::Released(2.0 * scene.timing.interval_seconds());
    let whole = |scene: &SceneSpec| {
        let Ok(truth) = truth::compute(scene) else { panic!("no truth") };
        truth
    };
    scene.intervals = 4;
    let let_go = whole(&scene);
    scene.course = Course::Steady;
    let kept = whole(&scene);
    assert_eq!(let_go.snapshots[..2], kept.snapshots[..2]);
    assert_ne!(let_go.snapshots[2], kept.snapshots[2]);
}

#[test]
fn a_damaged_file_on_disk_is_computed_again() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = scenes::named("cylinder").unwrap();
    scene.intervals = 1;
    let obtain = || truth::obtain(&[scene.clone()], folder.path(), |_, _| ()).unwrap().remove(0).1;
    let truth = obtain();
    let path = fs::read_dir(folder.path()).unwrap().next().unwrap().unwrap().path();
    let sound = fs::read(&path).unwrap();
    fs::write(&path, &sound[..sound.len() / 2]).unwrap();
    assert_eq!(obtain(), truth);
    assert_eq!(fs::read(&path).unwrap(), sound);
}

#[test]
fn whatever_changes_the_motion_changes_the_key() {
    let scene = scenes::named("release").unwrap();
    let mut keys = vec![truth::key(&scene).unwrap()];
    let mut changed = |change: &dyn Fn(&mut SceneSpec)| {
        let mut other = scene.clone();
        change(&mut other);
        keys.push(truth::key(&other).unwrap());
    };
    changed(&|scene| scene.points[3][1] = f32::from_bits(scene.points[3][1].to_bits() + 1));
    changed(&|scene| scene.tets.swap(0, 1));
    changed(&|scene| scene.density += 1e-4);
    changed(&|scene| scene.damping += 1e-6);
    changed(&|scene| scene.supports.truncate(3));
    changed(&|scene| scene.course = Course::Steady);
    changed(&|scene| scene.intervals += 1);
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), 8);
}
