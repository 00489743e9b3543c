//! Adaptive steps meet what begins in the middle of a call, when the body has been at rest for long and steps are at
//! their longest: a pull, and an instrument.

use supple::contact::{Instrument, Pose, Shape};
use supple::material::Element;
use supple::simulation::{Method, Simulation};
use supple::step::Status;

use super::{BAR, bar, settings};
use crate::support::{mean_distance, to_f64};

/// s.
const BEGIN: f64 = 1.9;
const END: f64 = 2.0;
const TOLERANCE: f32 = 2e-4;

/// The fixed bar after two seconds, by one call.
fn ended(method: Method<'static>, act: &dyn Fn(&mut Simulation<'static>)) -> (Simulation<'static>, Status) {
    let bar = bar(Element::NodalStrain, true).meeting(false).unwrap();
    let mut bar = bar.with(super::Settings { tolerance: Some(TOLERANCE), guard: true, ..settings(method, 20.0, None) });
    act(&mut bar);
    let report = bar.advance(END).unwrap();
    println!("{} exact, {} long steps, {:?}", report.exact, report.long, report.status);
    (bar, report.status)
}

fn meets(what: &str, act: &dyn Fn(&mut Simulation<'static>)) {
    let (exact, _) = ended(Method::Exact, act);
    let super::Method::Long(lattice) = super::long() else { unreachable!() };
    let (auto, status) = ended(Method::Auto(lattice), act);
    let [exact, auto] = [exact, auto].map(|bar| to_f64(bar.state().displacements()));
    let (error, motion) = (mean_distance(&auto, &exact), mean_distance(&exact, &vec![[0.0; 3]; exact.len()]));
    println!("{what}: {:.3} mm off on average, of {:.3} mm", 1e3 * error, 1e3 * motion);
    assert!(motion > 5.0 * f64::from(TOLERANCE) && error < f64::from(TOLERANCE) && status == Status::Ok);
}

#[test]
fn a_pull_that_begins_late_is_met() {
    meets("a pull", &|bar| {
        let point = [0.015, 0.015, BAR.size[2]];
        let pull = bar.pull(point, 0.02, 200.0).unwrap();
        bar.pulls[pull].move_to([0.045, 0.015, BAR.size[2]], BEGIN, END);
    });
}

#[test]
fn an_instrument_that_begins_late_is_met() {
    meets("an instrument", &|bar| {
        let at = |x: f32| Pose::at([x, 0.015, 0.11]);
        let mut ball = Instrument::resting(Shape::Sphere { radius: 0.01 }, at(-0.02));
        ball.move_to(at(0.01), BEGIN, END);
        bar.instruments = vec![ball];
    });
}
