//! The energy balance does not wear out: after a long session, or a violent moment, it allows little more energy than
//! the body has.

use supple::element::ElementMaterial;
use supple::loads::{Loads, Motion, NodalForce};
use supple::material::{AnyLaw, Law, Material, VecMaterial};
use supple::scene::{Axes, Support, VecScene};
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use crate::reference::Random;
use crate::support;
use crate::support::bodies::{far_end, held, small_bar, torsion};
use crate::support::{NEO, bound, rest_of, tissue};

/// A body with an end that can be moved, and stable steps.
fn body_with_moved_end(material: impl Material<Law: Into<AnyLaw>>) -> (VecScene<VecMaterial>, Vec<u32>, Step) {
    let body = small_bar();
    let end = far_end(&body);
    let moved = end.iter().copied().map(Support::moved);
    let supports: Vec<_> = held(&body).into_iter().chain(moved).collect();
    let scene = body.scene(material, &supports);
    let step = Step::unchecked(0.3 * bound(&scene, &rest_of(&scene)).seconds, 20.0).unwrap();
    (scene, end, step)
}

fn shifted(nodes: &[u32], metre: [f32; 3], ramp: f32) -> Vec<Motion> {
    nodes.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp }).collect()
}

/// Energy of a body that began at rest, J, and the kinetic energy beyond which a step has diverged.
fn energies(scene: &VecScene<impl ElementMaterial>, state: &mut VecState) -> (f64, f64) {
    let strain = tled::strain_energy(scene, state).expect("room");
    let balance = state.energy_balance();
    (balance.start + strain + balance.kinetic, balance.most())
}

/// An end that follows a hand: every 1/60 s it jumps by up to half a millimetre, all the time.
#[test]
fn a_trembling_hand_does_not_wear_the_balance_out() {
    let seconds = if cfg!(feature = "slow-tests") { 20.0 } else { 4.0 };
    for law in support::laws() {
        let (scene, end, step) = body_with_moved_end(tissue(law));
        let (mut state, mut random) = (rest_of(&scene), Random(3));
        let (mut early, mut late) = (f64::NAN, 0.0);
        let mut frame = 0;
        while state.time() < seconds {
            frame += 1;
            let metre = random.vector().map(|x| 5e-4 * x as f32);
            let motions = shifted(&end, metre, 0.0);
            let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
            while state.time() < f64::from(frame) / 60.0 {
                assert!(tled::step(&scene, &loads, &mut state, &step).is_taken(), "{:?}", state.energy_balance());
            }
            let (has, most) = energies(&scene, &mut state);
            late = most / has;
            if frame == 60 {
                early = late;
            }
        }
        println!(
            "{}: after {frame} jumps a step diverges at {late:.0} times the body's energy, after a second at {early:.0} times",
            law.name()
        );
        assert!(late < 5.0 * early);
    }
}

/// An excess of the past is forgotten: the end is moved to and fro by 2 mm, then the body comes to rest.
#[test]
fn a_violent_moment_leaves_no_slack() {
    for law in support::laws() {
        let (scene, end, step) = body_with_moved_end(tissue(law));
        let mut state = rest_of(&scene);
        for (metre, seconds) in [(2e-3, 0.02), (-2e-3, 0.04), (0.0, 0.06), (1e-4, 3.0)] {
            let motions = shifted(&end, [0.0, metre, 0.0], 0.0);
            let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
            while state.time() < seconds {
                assert!(tled::step(&scene, &loads, &mut state, &step).is_taken());
            }
        }
        let peak = state.energy_balance().peak;
        let (has, most) = energies(&scene, &mut state);
        println!("{}: {has:.2e} J, a step diverges at {most:.2e} J, peak {peak:.2e} J", law.name());
        assert!(most < 100.0 * has);
    }
}

/// What a measurement finds is never less than the body's energy, nor half of it: a body that vibrates for long without
/// damping keeps its balance.
#[test]
fn a_vibrating_body_keeps_its_balance() {
    let body = small_bar();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let step = Step::unchecked(0.3 * bound(&scene, &rest_of(&scene)).seconds, 0.0).unwrap();
        let mut state = rest_of(&scene);
        let forces = torsion(&body, 2e-3, 0.0);
        let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
        support::run(&scene, &loads, &mut state, &step, 300);
        for _ in 0..40_000 {
            assert_eq!(tled::step(&scene, &Loads::NONE, &mut state, &step), Status::Ok);
        }
        let balance = *state.energy_balance();
        println!("{}: {balance:?}", law.name());
        assert_eq!(balance.corrected, 0.0);
    }
}

/// The work of a load that is no finite number is refused, not entered.
#[test]
fn work_that_is_not_finite_is_refused() {
    let body = small_bar();
    let scene = body.scene(tissue(NEO), &held(&body));
    let step = Step::unchecked(1e-4, 0.0).unwrap();
    let newton = [f32::MAX, 0.0, 0.0];
    let forces = far_end(&body).into_iter().map(|node| NodalForce { node, newton, ramp: 0.0 });
    let forces: Vec<_> = forces.collect();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut state = rest_of(&scene);
    let before = *state.energy_balance();
    assert!(!tled::step(&scene, &loads, &mut state, &step).is_taken());
    assert_eq!(*state.energy_balance(), before);
}
