//! The shipped damper against the undamped multilevel step.

use supple_lab::method::Method;
use supple_lab::run::run;
use supple_lab::{scenes, truth};

/// The paper's bar stretched, which the search has not seen, at 50 and 100 times the paper's step.
#[test]
fn the_shipped_damper_halves_the_error_on_the_papers_bar() {
    let scene = scenes::named("stretch").unwrap();
    let truth = truth::compute(&scene).unwrap();
    for multiple in [50, 100] {
        let [multilevel, damped] = [Method::Multilevel, Method::Damped].map(|method| {
            let row = run(&scene, &truth, method, multiple).unwrap();
            row.figures().unwrap().errors.mean_over_time()
        });
        println!("{multiple} times the paper's step: multilevel {multilevel:.4} mm, damped {damped:.4} mm");
        assert!(damped < 0.5 * multilevel);
    }
}
