//! The paper's claims (Meister et al. 2018, section 3) on the paper's bar: a network moves it with steps at which the
//! exact formula is unstable. Slow: tens of thousands of steps of 6,528 tetrahedra.

use supple_lab::method::Method;
use supple_lab::networks::Family;
use supple_lab::run::{End, run};
use supple_lab::scenes;
use supple_lab::truth;

/// Reversed torsion, which no network has seen, at ten times the paper's step and more.
#[test]
fn the_exact_formula_fails_on_torsion_where_the_network_does_not() {
    let scene = scenes::named("reversed").unwrap();
    let truth = truth::compute(&scene).unwrap();
    for multiple in [10, 20, 50, 100] {
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
