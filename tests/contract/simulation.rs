//! One object for scene, state, loads, method, guard and pace (`supple::simulation`): the same bits as its parts put
//! together by hand, calls that follow each other without a drift, refusals that leave nothing behind.

use supple::adaptive::{Adaptive, Request};
use supple::contact::{Instrument, Pose, Shape};
use supple::guard::{self, Guard};
use supple::inertia::{self, Cells, LargeStep};
use supple::learned::{LearnedStep, vectors_for};
use supple::loads::{LoadError, Loads, Motion, NodalForce};
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mlp::{Network, WeightBytes};
use supple::scene::{Axes, Support, VecScene};
use supple::simulation::{Method, Report, Settings, Simulation, SimulationError};
use supple::state::{NodeVector, VecState};
use supple::step::{CriticalStep, Status, Step};
use supple::tled;

use crate::support::bodies::{far_end, held, small_bar, torsion};
use crate::support::{Body, EXP, bits, mean_distance, to_f64};

const DAMPING: f32 = 20.0;
const FRAME: f64 = 1.0 / 60.0;
fn long() -> inertia::Method {
    inertia::Method::new(Cells::Suggested)
}

fn material(element: Element) -> VecMaterial {
    VecMaterial::one(element, EXP, 1000.0)
}

fn twisted(body: &Body, settings: Settings<'static>) -> Simulation<'static> {
    let material = material(Element::NodalPressure);
    let mut simulation =
        Simulation::new(body.points.clone(), body.tets.clone(), material, &held(body)).unwrap().with(settings);
    simulation.forces = torsion(body, 2e-3, 0.05);
    simulation
}

/// The parts of which the same simulation is made.
struct Parts {
    scene: VecScene<VecMaterial>,
    state: VecState,
    forces: Vec<NodalForce>,
    critical: CriticalStep,
}

impl Parts {
    fn of(body: &Body) -> Self {
        let scene = VecScene::build(material(Element::NodalPressure), &body.mesh(), &held(body)).unwrap();
        let mut state = VecState::at_rest(scene.node_count());
        let critical = tled::critical_step(&scene, &mut state).unwrap();
        Self { scene, state, forces: torsion(body, 2e-3, 0.05), critical }
    }
}

/// The largest displacement, m: a frozen body must not pass.
fn moved(state: &VecState) -> f32 {
    let lengths = state.displacements().iter().map(|u| u.to_array().iter().map(|x| x * x).sum::<f32>().sqrt());
    lengths.fold(0.0, f32::max)
}

fn frames(simulation: &mut Simulation<'_>, count: usize) -> Vec<Report> {
    (0..count).map(|_| simulation.advance(FRAME).unwrap()).collect()
}

#[test]
fn exact_steps_of_a_length_are_those_of_the_layer_below() {
    let body = small_bar();
    let mut parts = Parts::of(&body);
    let seconds = 0.8 * parts.critical.seconds;
    let step = Some(seconds);
    let mut simulation = twisted(&body, Settings { step, damping: DAMPING, ..Settings::default() });
    let count = (FRAME / f64::from(seconds)).ceil();
    let exact = Step::new((FRAME / count) as f32, DAMPING, parts.critical).unwrap();
    let loads = Loads::new(&parts.scene, [0.0; 3], &parts.forces, &[]).unwrap();
    for report in frames(&mut simulation, 12) {
        for _ in 0..count as u32 {
            assert_eq!(tled::step(&parts.scene, &loads, &mut parts.state, &exact), Status::Ok);
        }
        assert_eq!((report.status, report.exact), (Status::Ok, count as u32));
    }
    println!(
        "{} steps of {:.1} us, moved {:.3} mm",
        parts.state.steps(),
        1e6 * exact.seconds(),
        1e3 * moved(&parts.state)
    );
    assert!(moved(&parts.state) > 1e-4);
    assert_eq!(bits(simulation.state()), bits(&parts.state));
}

#[test]
fn exact_steps_follow_the_critical_step_and_frames_do_not_drift() {
    let body = small_bar();
    let mut simulation = twisted(&body, Settings { damping: DAMPING, ..Settings::default() });
    let rest = simulation.critical_step().unwrap().seconds;
    simulation.forces = torsion(&body, 40e-3, 0.1);
    let reports = frames(&mut simulation, 60);
    let least = reports.iter().map(|report| report.seconds[0]).fold(f32::INFINITY, f32::min);
    let off = simulation.state().time() - 60.0 * FRAME;
    println!("steps {:.3} of the critical one at rest and less, {off:.1e} s off after 60 frames", least / rest);
    assert!(least < 0.85 * rest, "nothing stiffened: {least} of {rest}");
    assert!(off.abs() < 2e-6 * FRAME);
    // Looks at the critical step leave the forces of the latest step: what the held end takes.
    let taken = simulation.state().forces().iter().zip(&body.points).filter(|(_, point)| point[2] == 0.0);
    let largest = taken.map(|(force, _)| force.to_array()[0].abs()).fold(0.0, f32::max);
    println!("a held node takes up to {:.3} mN", 1e3 * largest);
    assert!(largest > 1e-4, "{largest}");
}

#[test]
fn long_steps_and_their_guard_are_those_of_the_layers_below() {
    let body = small_bar();
    let mut parts = Parts::of(&body);
    let seconds = FRAME as f32 / 4.0;
    let settings =
        Settings { method: Method::Long(long()), step: Some(seconds), damping: DAMPING, ..Settings::default() };
    let mut simulation = twisted(&body, settings);
    let step = Step::unchecked(seconds, DAMPING).unwrap();
    let view = parts.scene.view();
    let mut large = LargeStep::prepare_in_vec(long(), view, &body.points, parts.state.view(), step).unwrap();
    let mut guard = Guard::prepare_in_vec(view, &body.points, parts.state.view(), step, guard::EVERY).unwrap();
    let loads = Loads::new(&parts.scene, [0.0; 3], &parts.forces, &[]).unwrap();
    for report in frames(&mut simulation, 12) {
        let mut worst = Status::Ok;
        for _ in 0..4 {
            let status = large.step(view, &loads, parts.state.view());
            worst = worst.worse(guard.follow(status, view, &loads, parts.state.view()));
        }
        assert_eq!((report.status, report.long, report.estimate), (worst, 4, guard.estimate()));
    }
    println!("{:.1} critical steps long, moved {:.3} mm", seconds / parts.critical.seconds, 1e3 * moved(&parts.state));
    assert!(moved(&parts.state) > 1e-4 && simulation.advance(FRAME).unwrap().estimate.is_some());
    assert_ne!(bits(simulation.state()), bits(&parts.state));
}

#[test]
fn steps_that_choose_their_length_are_those_of_the_layer_below() {
    let body = small_bar();
    let mut parts = Parts::of(&body);
    let longest = FRAME as f32;
    let settings = Settings {
        method: Method::Auto(long()),
        step: Some(longest),
        damping: DAMPING,
        tolerance: Some(1e-3),
        ..Settings::default()
    };
    let mut simulation = twisted(&body, settings);
    simulation.forces = torsion(&body, 1e-4, 0.2);
    parts.forces.clone_from(&simulation.forces);
    let request = Request { tolerance: 1e-3, longest: Step::unchecked(longest, DAMPING).unwrap() };
    let (scene, state) = (&parts.scene, &mut parts.state);
    let mut adaptive = Adaptive::prepare_in_vec(long(), scene.view(), &body.points, state.view(), request).unwrap();
    let mut loads = Loads::new(scene, [0.0; 3], &parts.forces, &[]).unwrap();
    let mut long = 0;
    for (frame, report) in (1..).zip(frames(&mut simulation, 60)) {
        // Without a drift.
        let left = f64::from(frame) * FRAME - state.time();
        let span = if (left - FRAME).abs() <= 1e-6 * FRAME { FRAME } else { left };
        let (status, taken) = adaptive.advance(span as f32, scene.view(), &mut loads, state.view());
        assert_eq!((report.status, report.exact, report.long), (status, taken.exact, taken.large));
        long += taken.large;
    }
    println!("{long} long steps among {}, moved {:.3} mm", state.steps(), 1e3 * moved(state));
    assert!(long > 0 && moved(state) > 1e-4);
    assert_eq!(bits(simulation.state()), bits(state));
}

#[test]
fn a_network_is_led_and_led_again_after_a_restore_or_a_reset() {
    let bytes = WeightBytes::of(include_bytes!("../../weights/compact-10.weights"));
    let network = Network::parse(bytes.bytes()).unwrap();
    let interval = network.recipe().step;
    let body = Body::paper();
    let fixed: Vec<_> = (0..81).map(Support::fixed).collect();
    let at_rest =
        || Simulation::new(body.points.clone(), body.tets.clone(), material(Element::Linear), &fixed).unwrap();
    let settings = |lead_in| Settings {
        method: Method::Learned { network, lead_in, fallback: false },
        guard: false,
        ..Settings::default()
    };
    let mut simulation = at_rest().with(settings(10.0 * f64::from(interval)));
    simulation.forces = torsion(&body, 1e-4, 0.01);
    let led = simulation.advance(10.0 * f64::from(interval)).unwrap();
    let learned = simulation.advance(5.0 * f64::from(interval)).unwrap();
    println!("lead-in {} exact steps, then {} learned ones of {:.0} us", led.exact, learned.learned, 1e6 * interval);
    assert_eq!((led.learned, learned.exact, learned.learned), (0, 0, 5));
    assert!(led.exact >= 10);

    // By hand: the same lead-in with the same steps, then the network.
    let scene = VecScene::build(material(Element::Linear), &body.mesh(), &fixed).unwrap();
    let (mut state, forces) = (VecState::at_rest(scene.node_count()), torsion(&body, 1e-4, 0.01));
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let exact = Step::unchecked(interval / 10.0, network.recipe().damping).unwrap();
    let storage = vec![NodeVector::ZERO; vectors_for(scene.node_count(), false)];
    let mut by_hand = LearnedStep::new(network, false, storage).unwrap();
    assert!(by_hand.lead(scene.view(), &loads, state.view(), (&exact, 10.0 * f64::from(interval))).unwrap().is_taken());
    for _ in 0..5 {
        assert!(by_hand.step(scene.view(), &loads, state.view(), &exact).unwrap().is_taken());
    }
    let mut same = at_rest().with(Settings { step: Some(interval / 10.0), ..settings(10.0 * f64::from(interval)) });
    same.forces.clone_from(&forces);
    same.advance(15.0 * f64::from(interval)).unwrap();
    assert_eq!(bits(same.state()), bits(&state));

    // Work that is spent within an interval of the lead-in cuts none: the network's frames follow all of it.
    let little = Settings { most_steps: Some(7), step: Some(interval / 10.0), ..settings(10.0 * f64::from(interval)) };
    let mut in_parts = at_rest().with(little);
    in_parts.forces.clone_from(&forces);
    let mut calls = 0;
    while in_parts.state().time() < (15.0 - 0.5) * f64::from(interval) {
        let left = 15.0 * f64::from(interval) - in_parts.state().time();
        assert!(in_parts.advance(left).unwrap().steps() <= 12);
        calls += 1;
    }
    println!("the same in {calls} calls of little work");
    assert!(calls >= 12);
    assert_eq!(bits(in_parts.state()), bits(&state));

    // A state from elsewhere is not led.
    let mut pushed = at_rest();
    pushed.forces.clone_from(&forces);
    pushed.advance(0.01).unwrap();
    *simulation.state_mut() = pushed.state().clone();
    let again = simulation.advance(12.0 * f64::from(interval)).unwrap();
    println!("after a restore {} exact and {} learned steps", again.exact, again.learned);
    assert_eq!(again.learned, 2);

    // After a reset all is as at the start, the frames too.
    same.state_mut().reset();
    let again = same.advance(12.0 * f64::from(interval)).unwrap();
    println!("after a reset {} exact and {} learned steps", again.exact, again.learned);
    assert_eq!((again.exact, again.learned), (100, 2));
    same.advance(3.0 * f64::from(interval)).unwrap();
    assert_eq!(bits(same.state()), bits(&state));
}

/// A frame is no whole number of a network's steps.
#[test]
fn a_networks_steps_stay_with_the_frames() {
    let bytes = WeightBytes::of(include_bytes!("../../weights/compact-10.weights"));
    let network = Network::parse(bytes.bytes()).unwrap();
    let interval = f64::from(network.recipe().step);
    let body = Body::paper();
    let fixed: Vec<_> = (0..81).map(Support::fixed).collect();
    let method = Method::Learned { network, lead_in: 0.1, fallback: true };
    let settings = Settings { method, guard: false, ..Settings::default() };
    let mut simulation = Simulation::new(body.points.clone(), body.tets.clone(), material(Element::Linear), &fixed)
        .unwrap()
        .with(settings);
    simulation.forces = torsion(&body, 1e-4, 0.1);
    let most = (1..=12).map(|frame| {
        simulation.advance(FRAME).unwrap();
        (simulation.state().time() - f64::from(frame) * FRAME).abs()
    });
    let most = most.fold(0.0, f64::max);
    println!("at most {:.2} of a network's step of {:.2} ms from the frames", most / interval, 1e3 * interval);
    assert!(most <= 0.51 * interval && most > 0.01 * interval);
}

#[test]
fn motions_without_a_ramp_go_evenly_over_a_call() {
    let body = small_bar();
    let end = far_end(&body);
    let mut supports = held(&body);
    supports.extend(end.iter().map(|&node| Support::moved(node)));
    let mut simulation =
        Simulation::new(body.points.clone(), body.tets.clone(), material(Element::NodalStrain), &supports).unwrap();
    let mut speeds = vec![];
    for frame in 1..=10 {
        let metre = [0.0, 0.0, 1e-4 * frame as f32];
        simulation.motions = end.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp: 0.0 }).collect();
        simulation.advance(FRAME).unwrap();
        let node = end[0] as usize;
        assert!((simulation.displacements()[node].to_array()[2] - metre[2]).abs() < 1e-9);
        speeds.push(simulation.state().velocity(node)[2]);
    }
    println!("speeds of the support at frames, m/s: {speeds:.4?}");
    assert!(speeds.iter().all(|speed| (speed / 6e-3 - 1.0).abs() < 0.01));
}

#[test]
fn a_ball_presses_and_feels_it() {
    let body = small_bar();
    let mut simulation =
        Simulation::new(body.points.clone(), body.tets.clone(), material(Element::NodalPressure), &held(&body))
            .unwrap()
            .with(Settings { damping: DAMPING, ..Settings::default() })
            .meeting(false)
            .unwrap();
    let [x, y, z] = body.points[body.farthest(2) as usize];
    let ball = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at([x, y, z + 0.0101]));
    simulation.instruments = vec![ball];
    for frame in 0..10 {
        let now = simulation.state().time();
        let depth = 2e-4 * (frame + 1) as f32;
        simulation.instruments[0].move_to(Pose::at([x, y, z + 0.0101 - depth]), now, now + FRAME);
        simulation.advance(FRAME).unwrap();
    }
    let felt = simulation.touches()[0];
    println!("{:.2} mN on {} nodes", 1e3 * felt.force[2], felt.contacts);
    assert!(felt.force[2] > 1e-4 && felt.contacts > 0);
}

#[test]
fn what_is_refused_is_told_and_leaves_the_motion_as_it_was() {
    let body = small_bar();
    let mut simulation = twisted(&body, Settings { damping: DAMPING, ..Settings::default() });
    frames(&mut simulation, 3);
    let before = bits(simulation.state());
    let refused = |simulation: &mut Simulation<'static>, seconds: f64, words: &str| {
        let error = simulation.advance(seconds).unwrap_err();
        assert_eq!(error.to_string(), words);
        error
    };
    for seconds in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        refused(&mut simulation, seconds, &format!("advance by {seconds} s: it must be a positive number"));
    }
    let good = simulation.forces.clone();
    simulation.forces[0].node = 10_000;
    let error = refused(&mut simulation, FRAME, "force 0: node 10000 does not exist, the scene has 96 nodes");
    assert!(matches!(error, SimulationError::Load(LoadError::Node { index: 0, .. })));
    simulation.forces.clone_from(&good);
    simulation.forces[0].newton = [1e30, 0.0, 0.0];
    let error = simulation.advance(FRAME).unwrap_err();
    println!("{error}");
    assert!(matches!(error, SimulationError::Refused(_)));
    assert_eq!(bits(simulation.state()), before);
    simulation.forces = good;
    simulation.set(Settings { step: Some(1.0), damping: DAMPING, ..Settings::default() });
    let error = simulation.advance(FRAME).unwrap_err().to_string();
    println!("{error}");
    assert!(error.contains("is above the stable"), "{error}");
    for (settings, words) in [
        (Settings { tolerance: Some(f32::NAN), ..Settings::default() }, "a tolerance of NaN m"),
        (Settings { tolerance: Some(-1.0), ..Settings::default() }, "a tolerance of -1 m"),
        (Settings { damping: -1.0, ..Settings::default() }, "damping"),
    ] {
        simulation.set(settings);
        let error = simulation.advance(FRAME).unwrap_err().to_string();
        println!("{error}");
        assert!(error.contains(words), "{error}");
    }
    simulation.set(Settings { damping: DAMPING, ..Settings::default() });
    assert_eq!(bits(simulation.state()), before);
    // A call after a refused one is no longer for it.
    let time = simulation.state().time();
    assert!(simulation.advance(FRAME).unwrap().is_ok());
    let gone = simulation.state().time() - time;
    assert!((gone - FRAME).abs() < 1e-6 * FRAME, "{gone} s in a call of {FRAME} s");
}

/// Whatever moves it: no call takes more work than it may, each says what is missing, and nothing is made up for.
#[test]
fn a_call_ends_when_its_work_is_spent() {
    const MOST: u32 = 24;
    let body = small_bar();
    let critical = Parts::of(&body).critical.seconds;
    for (name, method, step) in [
        ("exact, paced", Method::Exact, None),
        ("exact, of one length", Method::Exact, Some(0.5 * critical)),
        ("long", Method::Long(long()), Some(6.0 * critical)),
        ("auto", Method::Auto(long()), None),
    ] {
        let settings = Settings { method, step, damping: DAMPING, most_steps: Some(MOST), ..Settings::default() };
        let mut simulation = twisted(&body, settings);
        let mut time = 0.0;
        for _ in 0..20 {
            // More than there is work for.
            let report = simulation.advance(0.1).unwrap();
            let Status::Behind { seconds } = report.status else { panic!("{:?}", report.status) };
            let work = report.exact + report.undone + 4 * report.long;
            assert!((MOST..MOST + 4).contains(&work), "{name}: {report:?}");
            assert!(report.time > time && (report.time + seconds - time - 0.1).abs() < 1e-6, "{report:?}");
            time = report.time;
        }
        println!("{name}: {:.1} mm after {time:.3} s", 1e3 * moved(simulation.state()));
        assert!(moved(simulation.state()) > 1e-3);
        // With enough of it the same steps, and no word.
        let frame = 0.25 * f64::from(critical) * f64::from(MOST);
        let report = simulation.advance(0.25 * frame).unwrap();
        assert!(!matches!(report.status, Status::Behind { .. }) && (report.time - time - 0.25 * frame).abs() < 1e-9);
    }
}

/// The state that it shows is the one that the call before has doubted.
#[test]
fn a_call_without_a_step_tells_what_is_known_of_the_state() {
    let body = small_bar();
    let critical = Parts::of(&body).critical.seconds;
    for (method, doubts) in [(Method::Long(long()), 1..30), (Method::Auto(long()), 0..30)] {
        let step = matches!(method, Method::Long(_)).then_some(20.0 * critical);
        let settings = Settings { method, step, tolerance: Some(1e-5), damping: DAMPING, ..Settings::default() };
        let mut simulation = twisted(&body, settings);
        let mut doubted = 0;
        for _ in 0..30 {
            let [long, short] = [20.0 * f64::from(critical), 1e-9].map(|span| simulation.advance(span).unwrap());
            assert_eq!((short.steps(), short.estimate), (0, long.estimate));
            assert_eq!(short.is_ok(), long.is_ok(), "{:?} after {:?}", short.status, long.status);
            doubted += usize::from(!short.is_ok());
        }
        println!("{doubted} of 30 calls without a step are doubted");
        assert!(doubts.contains(&doubted));
    }
}

/// Nodes whose forces only added inertia bears must not be thrown by the first exact step.
#[test]
fn settings_may_change_from_long_to_exact_steps() {
    let body = small_bar();
    let critical = Parts::of(&body).critical.seconds;
    let exact = Settings { damping: DAMPING, ..Settings::default() };
    let long = Settings { method: Method::Long(long()), step: Some(20.0 * critical), ..exact.clone() };
    for element in [Element::Linear, Element::NodalPressure, Element::NodalStrain] {
        let begun = |settings: &Settings<'static>| {
            let made = Simulation::new(body.points.clone(), body.tets.clone(), material(element), &held(&body));
            let mut simulation = made.unwrap().with(settings.clone());
            simulation.forces = torsion(&body, 2e-3, 0.02);
            frames(&mut simulation, 6);
            simulation
        };
        let [mut changed, mut expected] = [&long, &exact].map(begun);
        changed.set(exact.clone());
        let reports = [&mut changed, &mut expected].map(|each| each.advance(20.0 * f64::from(critical)).unwrap());
        let [kinetic, of_exact] = [&changed, &expected].map(|each| each.state().energy_balance().kinetic);
        println!("{element:?}: kinetic energy {kinetic:.2e} J, of exact steps alone {of_exact:.2e} J");
        assert!(reports.iter().all(|report| report.undone == 0 && report.is_ok()), "{reports:?}");
        // What long steps leave strained is set free, and no more: without care it is three times as much.
        assert!(kinetic < 15.0 * of_exact && of_exact > 1e-6);
    }
}

/// Long steps leave velocities that the refusal of other settings leaves as they are; of a state without room nothing is taken.
#[test]
fn refused_settings_after_long_steps_change_no_velocity() {
    let body = small_bar();
    let mut simulation =
        twisted(&body, Settings { method: Method::Long(long()), damping: DAMPING, ..Settings::default() });
    frames(&mut simulation, 4);
    let velocities = |simulation: &Simulation<'static>| {
        (0..body.points.len()).map(|node| simulation.state().velocity(node)).collect::<Vec<_>>()
    };
    let before = velocities(&simulation);
    simulation.set(Settings { damping: -1.0, ..Settings::default() });
    println!("{}", simulation.advance(FRAME).unwrap_err());
    assert_eq!(velocities(&simulation), before);
    simulation.set(Settings { damping: DAMPING, ..Settings::default() });
    *simulation.state_mut() = VecState::at_rest(3);
    let error = simulation.advance(FRAME).unwrap_err().to_string();
    println!("{error}");
    assert!(error.contains("room for 3 nodes"), "{error}");
}

/// What a host loads the body with when it changes the kind of step has acted for no time yet: from rest and in motion exact steps go
/// on as if the load had come a frame after the change.
#[test]
fn a_load_that_comes_with_other_steps_gives_no_velocity() {
    let body = small_bar();
    let far = far_end(&body);
    for element in [Element::Linear, Element::NodalStrain] {
        let moved = |before: f32, is_late: bool, load: &dyn Fn(&mut Simulation<'static>)| {
            let made = Simulation::new(body.points.clone(), body.tets.clone(), material(element), &held(&body));
            let long = Settings { method: Method::Long(long()), damping: DAMPING, ..Settings::default() };
            let mut simulation = made.unwrap().with(long);
            simulation.gravity = [before, 0.0, 0.0];
            frames(&mut simulation, 3);
            if is_late {
                simulation.set(Settings { damping: DAMPING, ..Settings::default() });
                simulation.prepare().unwrap();
                load(&mut simulation);
            } else {
                load(&mut simulation);
                simulation.set(Settings { damping: DAMPING, ..Settings::default() });
            }
            simulation.advance(0.5 * FRAME).unwrap();
            simulation.displacements()[far[0] as usize].to_array()[0]
        };
        for before in [0.0, 3.0] {
            let gravity = |simulation: &mut Simulation<'static>| simulation.gravity = [12.0, 0.0, 0.0];
            let force = |simulation: &mut Simulation<'static>| {
                simulation.forces =
                    far.iter().map(|&node| NodalForce { node, newton: [1e-3, 0.0, 0.0], ramp: 0.0 }).collect();
            };
            type Load<'a> = &'a dyn Fn(&mut Simulation<'static>);
            let loads: [(&str, Load<'_>, f32); 2] = [("gravity", &gravity, 0.001), ("forces", &force, 0.2)];
            for (name, load, off) in loads {
                let [with, after] = [false, true].map(|is_late| moved(before, is_late, load));
                println!(
                    "{element:?}, {before} m/s^2 before, {name}: {:.4} mm, loaded after {:.4}",
                    1e3 * with,
                    1e3 * after
                );
                assert!((with - after).abs() <= off * after.abs() && after > 1e-5);
            }
        }
    }
}

/// A free body falls as bodies do, though calls last as they please and steps of other kinds follow: none loses momentum.
#[test]
fn a_body_falls_through_calls_of_any_length_and_changes_of_steps() {
    let body = small_bar();
    let material = VecMaterial::one(Element::NodalStrain, NeoHookean { c: 500.0, d: 5_000.0 }, 1000.0);
    let falls = |name: &str, kind: &dyn Fn(usize) -> bool, span: &dyn Fn(usize) -> f64| {
        let mut falling = Simulation::new(body.points.clone(), body.tets.clone(), material.clone(), &[]).unwrap();
        falling.gravity = [0.0, 0.0, -9.81];
        let (mut is_long, critical) = (None, falling.critical_step().unwrap().seconds);
        for call in 0..60 {
            if is_long != Some(kind(call)) {
                is_long = Some(kind(call));
                let method = if kind(call) { Method::Long(long()) } else { Method::Exact };
                let step = kind(call).then_some(20.0 * critical);
                falling.set(Settings { method, step, damping: 0.0, guard: false, ..Settings::default() });
            }
            falling.advance(span(call) * f64::from(critical)).unwrap();
        }
        let (time, nodes) = (falling.state().time(), falling.displacements().len() as f64);
        let fallen = falling.displacements().iter().map(|u| f64::from(u.to_array()[2])).sum::<f64>() / nodes;
        let expected = -0.5 * 9.81 * time * time;
        println!("{name}: {:.2} mm in {:.0} ms, closed form {:.2} mm", 1e3 * fallen, 1e3 * time, 1e3 * expected);
        // Half a step's gravity at the start, and what the last calls still owe.
        assert!((fallen / expected - 1.0).abs() < 0.015, "{name}");
    };
    falls("long steps of one length", &|_| true, &|_| 20.0);
    falls("long steps, calls of two lengths", &|_| true, &|call| if call % 2 == 0 { 20.0 } else { 4.0 });
    falls("long steps, calls of many lengths", &|_| true, &|call| 3.0 + (call * 7 % 17) as f64);
    falls("long and exact steps in turn", &|call| call / 5 % 2 == 1, &|_| 20.0);
}

/// After a rest, in which steps have become long, the next motion is followed from its beginning, in frames shorter than these
/// steps, and also after the body was brought to rest.
#[test]
fn chosen_steps_follow_what_begins_after_a_rest() {
    let body = small_bar();
    let material = VecMaterial::one(Element::NodalStrain, NeoHookean { c: 500.0, d: 5_000.0 }, 1000.0);
    let tolerance = 2e-4;
    let start = |method| {
        let settings = Settings { method, damping: 10.0, tolerance: Some(tolerance), ..Settings::default() };
        let points = body.points.clone();
        let mut bar =
            Simulation::new(points, body.tets.clone(), material.clone(), &held(&body)).unwrap().with(settings);
        bar.gravity = [0.0, 0.0, -1.0];
        bar
    };
    for (frame, settles) in [(0.004, false), (1.0 / 60.0, false), (0.004, true)] {
        let mut runs = [start(Method::Exact), start(Method::Auto(long()))];
        let (mut silent, mut way, mut worst) = (0, 0.0, 0.0f64);
        for run in &mut runs {
            while run.state().time() < 1.0 {
                run.advance(frame).unwrap();
            }
            if settles {
                assert!(run.settle(1e-5, 10_000).unwrap().at_rest);
            }
            run.gravity = [6.0, 0.0, -1.0];
        }
        for _ in 0..(0.3 / frame) as usize {
            let [exact, chosen] = &mut runs;
            exact.advance(frame).unwrap();
            let report = chosen.advance(frame).unwrap();
            let span = frame as f32 * 1.001;
            assert!(report.seconds[0] > 0.0 && report.seconds[1] <= span, "steps of {:?} s", report.seconds);
            let [truth, now] = [&*exact, &*chosen].map(|run| to_f64(run.displacements()));
            let error = mean_distance(&truth, &now);
            way = mean_distance(&truth, &vec![[0.0; 3]; truth.len()]).max(way);
            worst = worst.max(if report.is_ok() { error } else { 0.0 });
            silent += usize::from(report.is_ok() && error > 1.2 * f64::from(tolerance));
        }
        println!(
            "frames of {:.1} ms, settles: {settles}: {silent} silent, {:.3} of {:.2} mm while ok",
            1e3 * frame,
            1e3 * worst,
            1e3 * way
        );
        assert!(silent == 0 && way > 2e-3);
    }
}
