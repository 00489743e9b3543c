//! The paper's claims (Meister et al. 2018, section 3) on the paper's bar: a network moves it with steps at which the
//! exact formula is unstable. Slow: tens of thousands of steps of 6,528 tetrahedra.

use supple::mlp::Network;
use supple::state::VecState;
use supple::tled;
use supple_lab::method::Method;
use supple_lab::networks::{self, Family};
use supple_lab::run::{End, run};
use supple_lab::scenes;
use supple_lab::truth;

/// Reversed torsion, which no network has seen, at twenty and a hundred times the paper's step.
#[test]
fn the_exact_formula_fails_on_torsion_where_the_network_does_not() {
    let scene = scenes::named("reversed").unwrap();
    let truth = truth::compute(&scene).unwrap();
    for multiple in [20, 100] {
        let exact = run(&scene, &truth, Method::TledLargeStep, multiple).unwrap();
        let End::Diverged(time) = exact.end else { panic!("the exact formula is stable at {multiple}") };
        let learned = run(&scene, &truth, Method::Learned(Family::Compact), multiple).unwrap();
        let Some(figures) = learned.figures() else { panic!("the network diverged at {multiple}") };
        println!(
            "{multiple} times the paper's step, {:.2} times the least exact limit: the exact formula diverges at {time:.3} s; \
             the network is {:.3} mm off at the end, {:.3} mm over time (hold {:.2}), {:.2} % clipped",
            learned.step_over_limit_trajectory,
            figures.errors.mean(),
            figures.errors.mean_over_time(),
            learned.hold,
            100.0 * figures.clip_share
        );
        assert!(learned.step_over_limit_trajectory > 1.0);
        assert!(figures.errors.skill(learned.hold) > 0.5);
    }
}

/// How strongly a network answers to a force on a vertex at rest, over what the vertex's mass would do: mean of the
/// three axes.
fn gain(network: &Network<'_>, force: f32) -> f64 {
    let answer = |axis: usize, force: f32| {
        // Displacement, speed (that of a usual sample) and force over mass.
        let mut seen = [0.0, 0.0, 0.0, network.inputs()[3].scale, 0.0, 0.0, 0.0];
        seen[4 + axis] = force;
        let mut acceleration = [0.0; 3];
        network.predict(&seen, &mut acceleration);
        f64::from(acceleration[axis])
    };
    (0..3).map(|axis| (answer(axis, force) - answer(axis, -force)) / (2.0 * f64::from(force))).sum::<f64>() / 3.0
}

/// What sees one vertex and is linear has a gain of at most `1 / kappa^2` (docs/reach.md, tests/physics/reach.rs). The
/// networks have true gain for small forces, as of smooth motion, and keep to the bound for large ones, as of rough
/// motion.
#[test]
fn networks_answer_to_large_forces_with_a_gain_that_falls_as_the_square_of_the_step() {
    let spec = scenes::named("reversed").unwrap();
    let scene = spec.build().unwrap();
    let rest = VecState::at_rest(scene.node_count());
    let critical = tled::exact_critical_step(scene.view(), rest.displacements()).unwrap();
    for multiple in networks::multiples() {
        let network = Network::parse(networks::learned(Family::Compact, multiple).unwrap()).unwrap();
        let kappa = f64::from(network.recipe().step) / critical;
        let (usual, bound) = (f64::from(network.inputs()[4].scale), kappa.powi(-2));
        let [small, large] = [0.25, 50.0].map(|force| gain(&network, force));
        println!(
            "{multiple} times the paper's step, kappa {kappa:.2}: gain {small:.3} at 0.25 m/s^2 (usual in training: \
             {usual:.2}), {large:.4} at 50 m/s^2; 1 / kappa^2 = {bound:.4}"
        );
        assert!((small - 1.0).abs() < 0.1, "not the true inertia");
        assert!((0.4..1.0).contains(&(large / bound)));
    }
}
