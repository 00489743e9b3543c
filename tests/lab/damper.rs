//! The shipped damper against one that damps nothing.

#[path = "../support/networks.rs"]
mod networks;

use supple_lab::method::{Method, NetworkFile};
use supple_lab::run::run;
use supple_lab::{scenes, truth};

/// The paper's bar stretched, which the search has not seen, at 100 times the paper's step.
#[test]
fn the_shipped_damper_nearly_halves_the_error_on_the_papers_bar() {
    let scene = scenes::named("stretch").unwrap();
    let truth = truth::compute(&scene).unwrap();
    let nothing = NetworkFile::leaked("nothing", networks::constant(4, 0.0).bytes()).unwrap();
    let [without, with] = [Method::LongWith(nothing), Method::Long].map(|method| {
        let row = run(&scene, &truth, method, 100).unwrap();
        row.figures().unwrap().errors.mean_over_time()
    });
    println!("without damper {without:.4} mm, with {with:.4} mm");
    assert!(with < 0.6 * without);
}
