//! Adaptive steps meet what begins in the middle of a call, when the body has been at rest for long and steps are at
//! their longest: a pull, and an instrument. Exact steps of a fifth of the critical one move it as those of nine tenths.

use supple::contact::{Instrument, Pose, Shape};
use supple::loads::NodalForce;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Simulation};
use supple::step::Status;

use super::{BAR, bar, length, settings};
use crate::support::{mean_distance, to_f64};

/// s.
const BEGIN: f64 = 1.9;
const END: f64 = 2.0;
const TOLERANCE: f32 = 2e-4;

/// The fixed bar after two seconds, by one call.
fn ended(
    method: Method<'static>,
    share: Option<f32>,
    act: &dyn Fn(&mut Simulation<'static>),
) -> (Simulation<'static>, Status) {
    let mut bar = bar(Element::NodalStrain, true).meeting(false).unwrap();
    let step = share.map(|share| share * bar.critical_step().unwrap().seconds);
    let mut bar = bar.with(super::Settings { tolerance: Some(TOLERANCE), guard: true, ..settings(method, 20.0, step) });
    act(&mut bar);
    let report = bar.advance(END).unwrap();
    println!("{} exact, {} long steps, {:?}", report.exact, report.long, report.status);
    (bar, report.status)
}

/// `late`: how far exact steps may be off, as a share of the motion. An instrument moves by half a step before tissue does.
fn meets(what: &str, late: f64, act: &dyn Fn(&mut Simulation<'static>)) {
    let (exact, _) = ended(Method::Exact, None, act);
    let (fine, _) = ended(Method::Exact, Some(0.2), act);
    let super::Method::Long(lattice) = super::long() else { unreachable!() };
    let (auto, status) = ended(Method::Auto(lattice), None, act);
    let [exact, fine, auto] = [exact, fine, auto].map(|bar| to_f64(bar.state().displacements()));
    let (error, motion) = (mean_distance(&auto, &exact), mean_distance(&exact, &vec![[0.0; 3]; exact.len()]));
    let held = mean_distance(&exact, &fine);
    println!("{what}: {:.3} mm off on average, exact steps {:.3}, of {:.3} mm", 1e3 * error, 1e3 * held, 1e3 * motion);
    assert!(
        motion > 5.0 * f64::from(TOLERANCE)
            && error < f64::from(TOLERANCE)
            && held < late * motion
            && status == Status::Ok
    );
}

#[test]
fn a_pull_that_begins_late_is_met() {
    meets("a pull", 0.01, &|bar| {
        let point = [0.015, 0.015, BAR.size[2]];
        let pull = bar.pull(point, 0.02, 200.0).unwrap();
        bar.pulls[pull].move_to([0.045, 0.015, BAR.size[2]], BEGIN, END);
    });
}

#[test]
fn an_instrument_that_begins_late_is_met() {
    meets("an instrument", 0.15, &|bar| {
        let at = |x: f32| Pose::at([x, 0.015, 0.11]);
        let mut ball = Instrument::resting(Shape::Sphere { radius: 0.01 }, at(-0.02));
        ball.move_to(at(0.01), BEGIN, END);
        bar.instruments = vec![ball];
    });
}

/// A target that moves off at once, faster than exact steps let tissue gather speed: the body is late, which each frame says until it has
/// caught up.
#[test]
fn a_pull_that_is_held_back_is_told() {
    for (speed, told) in [(0.1, false), (2.0, true)] {
        let mut body = bar(Element::NodalStrain, false).with(settings(Method::Exact, 20.0, None));
        let at = [0.015, 0.015, BAR.size[2]];
        let pull = body.pull(at, 0.03, 1e4).unwrap();
        body.pulls[pull].most = f32::INFINITY;
        let (mut late, mut limited) = (0.0f32, 0);
        for frame in 1..=60_u8 {
            let end = f64::from(frame) / 60.0;
            let far = speed * (end as f32).min(0.1);
            body.pulls[pull].move_to([at[0] + far, at[1], at[2]], end - 1.0 / 60.0, end);
            let report = body.advance(1.0 / 60.0).unwrap();
            let gap = length(body.pulled(pull).unwrap().gap);
            late = late.max(gap);
            match report.status {
                Status::Ok => assert!(gap < 0.002, "{frame}: {} mm late", 1e3 * gap),
                Status::Limited { .. } => limited += 1,
                status => panic!("{status:?}"),
            }
        }
        println!("{speed} m/s: {:.1} mm late at most, told in {limited} of 60 frames", 1e3 * late);
        assert_eq!(limited > 0, told);
        assert!(limited < 20);
    }
}

/// What a call ends with hides no refusal, and is forgotten where the body comes to rest.
#[test]
fn a_held_pull_hides_no_refusal() {
    // Of jumps by more and more the first that is held back for long.
    let held = || {
        let jumped = |millimetres: u16| {
            let mut body = bar(Element::NodalStrain, false).with(settings(Method::Exact, 20.0, None));
            let at = [0.015, 0.015, BAR.size[2]];
            let pull = body.pull(at, 0.03, 1e4).unwrap();
            body.pulls[pull].most = f32::INFINITY;
            body.pulls[pull].put([at[0] + 1e-3 * f32::from(millimetres), at[1], at[2]]);
            let status = body.advance(0.006).ok()?.status;
            (body.state().pulls_held_back() == 1).then_some((body, status, millimetres))
        };
        let (body, status, millimetres) = (1..100).find_map(jumped).unwrap();
        println!("a jump by {millimetres} mm: {status:?}");
        assert!(matches!(status, Status::Limited { .. }));
        body
    };
    let mut refused = held();
    refused.forces = vec![NodalForce { node: 0, newton: [1e30, 0.0, 0.0], ramp: 0.0 }];
    println!("{}", refused.advance(1.0 / 60.0).unwrap_err());

    let mut settled = held();
    assert!(settled.settle(1e-4, 5000).unwrap().at_rest);
    assert_eq!(settled.state().pulls_held_back(), 0);
}

/// A jump that long steps overshoot takes what added inertia had, more than the balance of energy knows. What is limited then is
/// `Ok` again once the body is calm.
#[test]
fn what_a_jump_takes_is_forgotten() {
    let short = Bar { size: [0.04, 0.04, 0.08], cells: [4, 4, 8] };
    let tissue = VecMaterial::one(Element::NodalPressure, NeoHookean { c: 517.0, d: 5_000.0 }, 1000.0);
    let supports: Vec<_> = (0..25).map(Support::fixed).collect();
    let super::Method::Long(lattice) = super::long() else { unreachable!() };
    let mut body = Simulation::new(short.points(), short.tets(), tissue, &supports).unwrap();
    body.set(super::Settings { guard: true, ..settings(Method::Auto(lattice), 10.0, None) });
    let at = [0.02, 0.02, 0.08];
    let pull = body.pull(at, 0.011, 300.0).unwrap();
    let mut limited = vec![];
    for frame in 0..120 {
        let end = f64::from(frame + 1) / 60.0;
        body.pulls[pull].move_to([at[0], at[1] + if frame < 5 { 0.0 } else { 1e-3 }, at[2]], end - 1.0 / 60.0, end);
        if body.advance(1.0 / 60.0).unwrap().status != Status::Ok {
            limited.push(frame);
        }
    }
    println!("not ok: frames {limited:?}");
    assert!(limited.iter().all(|frame| *frame < 60));
}
