//! Bodies that move freely: long explicit steps against implicit rules at the same step.

use supple_lab::method::Method;
use supple_lab::run::run;
use supple_lab::{scenes, truth};

/// At 20 times the critical step. A body that stands still is off by 100 %.
#[test]
fn long_steps_are_closer_to_the_exact_motion_than_backward_euler() {
    for name in ["pendulum-50", "couple-10", "free-spin-50"] {
        let scene = scenes::named(name).unwrap();
        let truth = truth::compute(&scene).unwrap();
        let [long, euler, midpoint] = [Method::Long, Method::BackwardEuler, Method::ImplicitMidpoint].map(|method| {
            let row = run(&scene, &truth, method, 20).unwrap();
            100.0 * row.figures().unwrap().errors.mean() / row.hold_at_end
        });
        println!("{name}: long {long:.3} %, backward Euler {euler:.2} %, implicit midpoint {midpoint:.3} %");
        assert!(long < 5.0 && long < 0.5 * euler, "{name}");
        assert!(midpoint < 0.1 * euler, "{name}");
    }
}
