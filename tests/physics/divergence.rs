//! What is reported when a simulation diverges, and what is left of its state: everything as it was before the step
//! that was refused, and never a NaN. `stability.rs` tests that every step above the limit is reported.

use supple::element::ElementMaterial;
use supple::loads::{LoadError, Loads, Motion};
use supple::material::Law;
use supple::scene::{Axes, Support, VecScene};
use supple::state::VecState;
use supple::step::{Cause, Divergence, Status, Step};
use supple::tled;

use crate::support;
use crate::support::bodies::{far_end, held, small_bar, torsion};
use crate::support::{bits, bound, rest_of, tissue, to_f64};

/// Steps until divergence is reported; the state must stay as it was before that step.
fn until_diverged<M: ElementMaterial>(
    scene: &VecScene<M>,
    loads: &Loads<'_>,
    state: &mut VecState,
    step: &Step,
) -> Divergence {
    for _ in 0..2_000 {
        let before = bits(state);
        if let Status::Diverged(divergence) = tled::step(scene, loads, state, step) {
            assert!(bits(state) == before, "{divergence}: displacement, velocity, time or energy balance changed");
            return divergence;
        }
    }
    panic!("not reported within 2,000 steps");
}

/// Forces that throw nodes beyond float32 in a step or two.
#[test]
fn no_force_however_large_puts_a_nan_into_the_state() {
    let body = small_bar();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let step = Step::new(1e-4, 5.0, bound(&scene, &rest_of(&scene))).unwrap();
        for newton in [1e3, 1e10, 1e20, 1e30, f32::MAX] {
            // Twice the largest float is infinite.
            let forces = [torsion(&body, newton, 0.0), torsion(&body, newton, 0.0)].concat();
            let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
            let mut state = rest_of(&scene);
            // Something moves before.
            support::run(&scene, &Loads::NONE, &mut state, &step, 3);
            let divergence = until_diverged(&scene, &loads, &mut state, &step);
            println!("{}, {newton:.0e} N: {divergence}", law.name());
            assert!(to_f64(state.displacements()).iter().flatten().all(|x| x.is_finite()));
        }
    }
}

#[test]
fn loads_that_are_not_numbers_do_not_get_in() {
    let body = small_bar();
    let scene = body.scene(tissue(support::NEO), &held(&body));
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut forces = torsion(&body, 1.0, 0.0);
        forces[3].newton[1] = bad;
        let refused = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap_err();
        assert!(matches!(refused, LoadError::NotFinite { kind: "force", index: 3, .. }));
        assert!(Loads::new(&scene, [bad, 0.0, 0.0], &[], &[]).is_err());
    }
}

#[test]
fn divergence_names_time_node_and_cause() {
    let body = small_bar();
    let scene = body.scene(tissue(support::NEO), &held(&body));
    let mut forces = torsion(&body, 0.0, 0.0);
    forces[5].newton = [0.0, 0.0, 1e38];
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(1e-4, 0.0).unwrap();
    let mut state = rest_of(&scene);
    support::run(&scene, &Loads::NONE, &mut state, &step, 50);
    let divergence = until_diverged(&scene, &loads, &mut state, &step);
    assert_eq!(divergence.node, forces[5].node);
    assert!(matches!(divergence.cause, Cause::Force { index: 5, newton: 1e38, .. }), "{divergence}");
    assert_eq!(divergence.time, state.time());
    assert_eq!(
        divergence.to_string(),
        format!(
            "diverged at 0.005000 s at node {}: force 5, of 1.000e38 N, moves it in one step through its tissue, which is 6.354 mm across",
            forces[5].node
        )
    );
}

/// Also where the refused step has another length than the one before it.
#[test]
fn divergence_leaves_the_state_bit_identical() {
    let body = small_bar();
    let scene = body.scene(tissue(support::NEO), &held(&body));
    let small = torsion(&body, 1e-3, 0.0);
    let huge = torsion(&body, f32::MAX, 0.0);
    for dt in [1e-4, 3e-4, 1e-5] {
        let mut state = rest_of(&scene);
        let loads = Loads::new(&scene, [0.0; 3], &small, &[]).unwrap();
        support::run(&scene, &loads, &mut state, &Step::unchecked(1e-4, 5.0).unwrap(), 100);
        let loads = Loads::new(&scene, [0.0; 3], &huge, &[]).unwrap();
        let divergence = until_diverged(&scene, &loads, &mut state, &Step::unchecked(dt, 5.0).unwrap());
        assert!(matches!(divergence.cause, Cause::Force { .. }), "{divergence}");
    }
}

/// Also where it is the first step of all.
#[test]
fn divergence_in_the_first_step_leaves_the_state_fresh() {
    let body = small_bar();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let huge = torsion(&body, f32::MAX, 0.0);
        let loads = Loads::new(&scene, [0.0; 3], &huge, &[]).unwrap();
        until_diverged(&scene, &loads, &mut rest_of(&scene), &Step::unchecked(1e-3, 0.0).unwrap());
    }
}

/// A tenth above the limit, also where the energy balance is large from a violent past, and where it is uncertain
/// because supports move on and on.
#[test]
fn divergence_is_reported_whatever_was_before() {
    let body = small_bar();
    let end = far_end(&body);
    let moved = end.iter().copied().map(Support::moved);
    let supports: Vec<_> = held(&body).into_iter().chain(moved).collect();
    let scene = body.scene(tissue(support::NEO), &supports);
    let limit = tled::exact_critical_step(scene.view(), rest_of(&scene).displacements()).unwrap();
    let stable = Step::unchecked((0.2 * limit) as f32, 20.0).unwrap();
    let unstable = Step::unchecked((1.1 * limit) as f32, 20.0).unwrap();
    let motions = |metre: f32| {
        let follow = |&node| Motion { node, axes: Axes::XYZ, metre: [0.0, metre, 0.0], ramp: 0.0 };
        end.iter().map(follow).collect::<Vec<_>>()
    };

    let mut state = rest_of(&scene);
    for n in 0..5_000 {
        let motions = motions(if n / 100 % 2 == 0 { 1e-3 } else { -1e-3 });
        let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
        support::run(&scene, &loads, &mut state, &stable, 1);
    }
    let still = motions(0.0);
    let loads = Loads::new(&scene, [0.0; 3], &[], &still).unwrap();
    support::run(&scene, &loads, &mut state, &stable, 5_000);
    println!("after 50 jumps of 2 mm and a rest: {:?}", state.energy_balance());
    let steps = state.steps();
    let divergence = until_diverged(&scene, &loads, &mut state, &unstable);
    println!("{divergence}, after {} steps above the limit", state.steps() - steps);

    let mut state = rest_of(&scene);
    let divergence = (0..2_000).find_map(|n| {
        let motions = motions(if n % 2 == 0 { 1e-4 } else { -1e-4 });
        let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
        match tled::step(&scene, &loads, &mut state, &unstable) {
            Status::Diverged(divergence) => Some(divergence),
            _ => None,
        }
    });
    let divergence = divergence.expect("reported within 2,000 steps");
    println!("a support that jumps every step: {divergence}, after {} steps", state.steps());
    assert!(to_f64(state.displacements()).iter().flatten().all(|x| x.is_finite()));
}

/// An instrument that jumps, or a force in another unit, is named with its place and how far it may go.
#[test]
fn the_load_that_is_to_blame_is_named() {
    let body = small_bar();
    let end = far_end(&body);
    let moved = end.iter().copied().map(Support::moved);
    let supports: Vec<_> = held(&body).into_iter().chain(moved).collect();
    let scene = body.scene(tissue(support::EXP), &supports);
    let step = Step::new(1e-4, 5.0, bound(&scene, &rest_of(&scene))).unwrap();
    let follow = |&node| Motion { node, axes: Axes::XYZ, metre: [0.03, 0.0, 0.0], ramp: 0.0 };
    let motions: Vec<_> = end.iter().map(follow).collect();
    let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
    let divergence = until_diverged(&scene, &loads, &mut rest_of(&scene), &step);
    println!("{divergence}");
    assert!(end.contains(&divergence.node));
    assert!(matches!(divergence.cause, Cause::Motion { metre, size } if metre == 0.03 && (1e-3..5e-3).contains(&size)));

    // Millinewtons where newtons are meant.
    let scene = body.scene(tissue(support::EXP), &held(&body));
    let mut forces = torsion(&body, 1e-3, 0.0);
    forces[2].newton = [0.0, 50.0, 0.0];
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut state = rest_of(&scene);
    let divergence = until_diverged(&scene, &loads, &mut state, &step);
    println!("{divergence}");
    assert_eq!(state.steps(), 0, "the first step already moves the node through its tissue");
    assert_eq!(divergence.node, forces[2].node);
    assert!(matches!(divergence.cause, Cause::Force { index: 2, newton: 50.0, .. }));
}

/// A state that has got more energy than loads gave, by steps that were too long, goes on to rest from where it was
/// stopped.
#[test]
fn a_state_that_has_diverged_goes_on_once_it_is_stopped() {
    let body = small_bar();
    let scene = body.scene(tissue(support::EXP), &held(&body));
    let limit = tled::exact_critical_step(scene.view(), rest_of(&scene).displacements()).unwrap();
    let unstable = Step::unchecked((1.05 * limit) as f32, 5.0).unwrap();
    let stable = Step::unchecked((0.3 * limit) as f32, 50.0).unwrap();
    let forces = torsion(&body, 1e-3, 0.0);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut state = rest_of(&scene);
    let divergence = until_diverged(&scene, &loads, &mut state, &unstable);
    let (before, time) = (to_f64(state.displacements()), state.time());
    assert!(tled::stop(&scene, &mut state));
    assert_eq!((to_f64(state.displacements()), state.time()), (before, time));
    assert_eq!(state.velocity(50), [0.0; 3]);
    support::run(&scene, &loads, &mut state, &stable, 40_000);
    let mut settled = rest_of(&scene);
    support::run(&scene, &loads, &mut settled, &stable, 40_000);
    let (state, settled) = (to_f64(state.displacements()), to_f64(settled.displacements()));
    let off = support::largest_distance(&state, &settled) / support::largest(&settled);
    println!("{divergence}; stopped, it comes to rest where it should, within {off:.1e}");
    assert!(off < 1e-3);
}

/// After a divergence the host may go on with a shorter step, as if nothing had been.
#[test]
fn a_refused_step_may_be_taken_again_with_a_shorter_one() {
    let body = small_bar();
    let scene = body.scene(tissue(support::EXP), &held(&body));
    let forces = torsion(&body, 1e-3, 0.0);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::new(1e-4, 5.0, bound(&scene, &rest_of(&scene))).unwrap();
    let mut state = rest_of(&scene);
    support::run(&scene, &loads, &mut state, &step, 100);
    let mut disturbed = state.clone();
    let huge = torsion(&body, f32::MAX, 0.0);
    let bad = Loads::new(&scene, [0.0; 3], &huge, &[]).unwrap();
    until_diverged(&scene, &bad, &mut disturbed, &step);
    support::run(&scene, &loads, &mut state, &step, 500);
    support::run(&scene, &loads, &mut disturbed, &step, 500);
    assert!(bits(&state) == bits(&disturbed));
}
