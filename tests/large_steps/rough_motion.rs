//! Damping of rough motion: what it may take away, and what it may not.

use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use crate::large_steps::{GAIN, prepared};
use crate::support::bodies::{corner_torsion, held, small_bar};
use crate::support::{Body, EXP, NEO, bound, mean_distance, rest_of, tissue, to_f64};

/// Less than zero is zero, to the bit.
#[test]
fn without_gain_it_is_the_undamped_step() {
    let body = small_bar();
    let scene = body.scene(tissue(EXP), &held(&body));
    let forces = corner_torsion(&body, 1e-3, 0.02);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(20.0 * bound(&scene, &rest_of(&scene)).seconds, 5.0).unwrap();
    let moved = |gain: f32| {
        let mut state = rest_of(&scene);
        let mut damped = prepared(&body, &scene, &mut state, step, gain);
        let mut most = 0.0_f32;
        for _ in 0..100 {
            let status = damped.step(scene.view(), &loads, state.view());
            assert!(status.is_taken(), "{status:?}");
            most = most.max(damped.report().damping);
        }
        (state.displacements().to_vec(), most)
    };
    let (undamped, most) = moved(0.0);
    assert!(undamped.iter().any(|u| u.to_array() != [0.0; 3]) && most == 0.0);
    assert_eq!((undamped.clone(), most), moved(-1.0));
    let (damped, most) = moved(0.2);
    assert!(undamped != damped && most > 0.0);
}

/// A free body that flies and spreads evenly: all of that is in the lattice, and stays.
#[test]
fn smooth_motion_is_left_alone() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &[]);
    let step = Step::unchecked(20.0 * bound(&scene, &rest_of(&scene)).seconds, 0.0).unwrap();
    let mut state = rest_of(&scene);
    assert!(tled::start(&scene, &mut state, &step, |_| ([0.0; 3], [0.3, -0.2, 0.1])));
    let mut large = prepared(&body, &scene, &mut state, step, GAIN);
    for _ in 0..200 {
        let status = large.step(scene.view(), &Loads::NONE, state.view());
        assert!(!matches!(status, Status::Diverged(_)), "{status:?}");
    }
    let worst = (0..body.points.len())
        .flat_map(|node| {
            let v = state.velocity(node);
            [v[0] - 0.3, v[1] + 0.2, v[2] - 0.1]
        })
        .fold(0.0_f32, |worst, off| worst.max(off.abs()));
    println!("after 200 steps at five times the usual gain: velocity off by {worst:.1e} of 0.37 m/s");
    assert!(large.report().damping > 0.0, "nothing was damped");
    assert!(worst < 1e-3);
}

/// A bar that is twisted, at eight times the critical step: there most of the error is the lattice's.
#[test]
fn it_does_no_harm() {
    let body = Body::bar([0.05, 0.05, 0.1], [6, 6, 12]);
    let scene = body.scene(tissue(EXP), &held(&body));
    let forces = corner_torsion(&body, 0.02, 0.3);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let limit = 0.8 * bound(&scene, &rest_of(&scene)).seconds;
    let exact = Step::unchecked(limit, 20.0).unwrap();
    let long = Step::unchecked(10.0 * limit, 20.0).unwrap();
    let (mut truth, mut undamped, mut damped) = (rest_of(&scene), rest_of(&scene), rest_of(&scene));
    let method = Method::new(Cells::Suggested);
    let mut with = LargeStep::prepare_in_vec(method, scene.view(), &body.points, damped.view(), long).unwrap();
    let mut without = prepared(&body, &scene, &mut undamped, long, 0.0);
    let mean = |a: &VecState, b: &VecState| 1e3 * mean_distance(&to_f64(a.displacements()), &to_f64(b.displacements()));
    let (mut errors, mut hold, mut count) = ([0.0; 2], 0.0, 0.0);
    while truth.time() < 0.6 {
        for _ in 0..10 {
            assert_eq!(tled::step(&scene, &loads, &mut truth, &exact), Status::Ok);
        }
        let _ = without.step(scene.view(), &loads, undamped.view());
        let _ = with.step(scene.view(), &loads, damped.view());
        errors[0] += mean(&truth, &undamped);
        errors[1] += mean(&truth, &damped);
        hold += mean(&truth, &rest_of(&scene));
        count += 1.0;
    }
    let [undamped, damped] = errors.map(|error| error / count);
    println!("mean over nodes and time: without {undamped:.4} mm, with {damped:.4} mm, hold {:.2} mm", hold / count);
    assert!(hold / count > 3.0 && damped < undamped);
}
