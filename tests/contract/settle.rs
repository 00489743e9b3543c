//! To rest (`supple::tled::settle`) and from displacements of the host's: judged by a long damped motion of exact steps.

use supple::contact::{Instrument, Pose, Shape};
use supple::inertia::{self, Cells};
use supple::loads::{Motion, NodalForce};
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::boundary;
use supple::pressure::SurfacePressure;
use supple::scene::{Axes, Support};
use supple::simulation::{Method, Settings, Simulation, SimulationError};
use supple::state::NodeVector;
use supple::step::{MOST_PARTS, Status};
use supple::tled::{self, DisplacementError, SettleError};

use crate::support::{Backwards, Body, NEO, bits};

const ELEMENTS: [Element; 3] = [Element::Linear, Element::NodalPressure, Element::NodalStrain];
/// m/s^2: the bar bends by a tenth of its length.
const GRAVITY: [f32; 3] = [0.6, 0.0, -1.0];
const TOLERANCE: f32 = 1e-5;
/// 1/s.
const DAMPING: f32 = 10.0;

fn body() -> Body {
    Body::irregular([0.03, 0.03, 0.06], [3, 3, 6])
}

fn held(body: &Body) -> Vec<u32> {
    body.nodes_where(|[_, _, z]| z == 0.0)
}

/// A bar that is fixed at one end, or free.
fn bar(element: Element, is_held: bool) -> Simulation<'static> {
    let body = body();
    let fixed: Vec<_> = held(&body).into_iter().filter(|_| is_held).map(Support::fixed).collect();
    Simulation::new(body.points, body.tets, VecMaterial::one(element, NEO, 1000.0), &fixed).unwrap()
}

/// The largest distance of a node, m.
fn apart(a: &[NodeVector], b: &[NodeVector]) -> f32 {
    let square = |(a, b): (&NodeVector, &NodeVector)| {
        let (a, b) = (a.to_array(), b.to_array());
        (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f32>()
    };
    a.iter().zip(b).map(square).fold(0.0, f32::max).sqrt()
}

/// Where a damped motion under the same loads ends, which is still by then.
fn damped(simulation: &mut Simulation<'_>, seconds: f64) -> Vec<NodeVector> {
    simulation.set(Settings { damping: DAMPING, ..Settings::default() });
    simulation.advance(seconds).unwrap();
    let before = simulation.displacements().to_vec();
    simulation.advance(0.2).unwrap();
    let moved = apart(&before, simulation.displacements());
    assert!(moved < 0.1 * TOLERANCE, "the reference moves by {moved:.2e} m");
    simulation.displacements().to_vec()
}

/// Settles it, and tells how.
fn settled(what: &str, simulation: &mut Simulation<'_>, reference: &[NodeVector], most: f32) -> u32 {
    let time = simulation.state().time();
    let settled = simulation.settle(TOLERANCE, 10_000).unwrap();
    let error = apart(simulation.displacements(), reference);
    println!(
        "{what}: {} steps, {:.2e} m to go by the estimate, {error:.2e} m in truth, moved by {:.1} mm",
        settled.steps,
        settled.remaining,
        1e3 * apart(reference, &[NodeVector::ZERO; 1000]),
    );
    assert!(settled.at_rest && settled.status == Status::Ok && settled.remaining < TOLERANCE);
    assert!(error < most, "{what}: {error} m");
    let state = simulation.state();
    assert_eq!((state.time(), state.last_step(), state.velocity(20)), (time, 0.0, [0.0; 3]));
    let balance = state.energy_balance();
    assert!(balance.kinetic == 0.0 && balance.work == 0.0 && balance.start > 0.0);
    settled.steps
}

#[test]
fn it_rests_where_a_damped_motion_ends_under_gravity_and_a_force() {
    for element in ELEMENTS {
        let loaded = |force: [f32; 3], gravity| {
            let mut simulation = bar(element, true);
            let tip = body().farthest(2);
            simulation.gravity = gravity;
            simulation.forces = vec![NodalForce { node: tip, newton: force, ramp: 0.0 }];
            simulation
        };
        for (what, force, gravity) in [("gravity", [0.0; 3], GRAVITY), ("a force", [2e-3, 1e-3, 0.0], [0.0; 3])] {
            let reference = damped(&mut loaded(force, gravity), 4.0);
            let mut resting = loaded(force, gravity);
            // By kinetic damping alone it takes 560 to 720 under gravity.
            assert!(settled(&format!("{element:?}, {what}"), &mut resting, &reference, TOLERANCE) < 350);
            // The supports bear the load.
            let (body, forces) = (body(), resting.state().forces());
            let borne = held(&body).iter().fold([0.0; 3], |sum, &node| {
                let force = forces[node as usize].to_array();
                [0, 1, 2].map(|axis| sum[axis] + force[axis])
            });
            let mass = resting.scene().view().mass() as f32;
            for axis in 0..3 {
                let load = force[axis] + mass * gravity[axis];
                assert!((borne[axis] - load).abs() < 0.01 * mass.max(1e-3), "{borne:?}");
            }
        }
    }
}

#[test]
fn it_rests_under_a_ball_that_presses() {
    for (element, triangles) in ELEMENTS.into_iter().flat_map(|element| [(element, false), (element, true)]) {
        let pressed = || {
            let body = body();
            let mut simulation = bar(element, true).meeting(triangles).unwrap();
            let [x, y, z] = body.points[body.farthest(2) as usize];
            let pose = Pose::at([x + 0.012, y + 0.012, z + 0.012 - 1e-3]);
            simulation.instruments = vec![Instrument::resting(Shape::Sphere { radius: 0.012 }, pose)];
            simulation
        };
        let mut moved = pressed();
        let reference = damped(&mut moved, 3.0);
        let mut resting = pressed();
        // Which points of triangles are pushed hangs on the way there: with nodal strain 20 um.
        let most = if triangles { 2.5 * TOLERANCE } else { TOLERANCE };
        settled(&format!("{element:?}, a ball, triangles: {triangles}"), &mut resting, &reference, most);
        let [still, damped] = [&resting, &moved].map(|simulation| simulation.touches()[0]);
        println!("    it feels {:.3} mN, {:.3} mN in the damped motion", 1e3 * still.force[2], 1e3 * damped.force[2]);
        assert!((still.force[2] / damped.force[2] - 1.0).abs() < 0.03 && still.force[2] > 1e-3);
    }
}

/// Balls on one side and on both whose points are within triangles: exact steps come to rest, and settling moves nothing then.
#[test]
fn tissue_between_balls_rests_and_stays() {
    let bar = supple::mesh::Bar { size: [0.04, 0.04, 0.08], cells: [4, 4, 8] };
    let tissue = VecMaterial::one(Element::NodalStrain, NeoHookean { c: 3448.0, d: 33_333.0 }, 1000.0);
    let supports: Vec<_> = (0..25).map(Support::fixed).collect();
    let ball = |from: [f32; 3], to: [f32; 3]| {
        let mut ball = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at(from));
        ball.move_to(Pose::at(to), 0.0, 0.3);
        ball
    };
    let above = ball([0.018, 0.021, 0.092], [0.018, 0.021, 0.0885]);
    let left = ball([-0.0105, 0.021, 0.05], [-0.007, 0.021, 0.05]);
    let right = ball([0.0505, 0.019, 0.051], [0.047, 0.019, 0.051]);
    for (name, balls) in [("above", vec![above]), ("both sides", vec![left, right])] {
        let made = Simulation::new(bar.points(), bar.tets(), tissue.clone(), &supports);
        let mut pressed = made.unwrap().meeting(true).unwrap();
        pressed.set(Settings { damping: 40.0, ..Settings::default() });
        pressed.instruments = balls;
        for frame in 0..250 {
            let report = pressed.advance(0.01).unwrap();
            assert!(report.is_ok(), "{name}, frame {frame}: {:?}", report.status);
        }
        let rest = pressed.displacements().to_vec();
        pressed.advance(0.01).unwrap();
        let speed = apart(&rest, pressed.displacements()) / 0.01;
        // Whether or not swings of the pushes let it tell so.
        let settled = pressed.settle(TOLERANCE, 2000).unwrap();
        let away = apart(&rest, pressed.displacements());
        println!("{name}: {:.4} mm/s after 2.5 s, then settled {:.4} mm away: {settled:?}", 1e3 * speed, 1e3 * away);
        assert!(speed < 3e-4 && away < TOLERANCE && settled.status == Status::Ok);
    }
}

/// What supports hold along the normal of an instrument they bear: no push grows from step to step, and nothing is glued aside.
#[test]
fn an_instrument_on_nodes_that_only_slide_feels_nothing() {
    let bar = supple::mesh::Bar { size: [0.04, 0.04, 0.08], cells: [4, 4, 8] };
    let tissue = VecMaterial::one(Element::Linear, NeoHookean { c: 3448.0, d: 33_333.0 }, 1000.0);
    let points: Vec<[f32; 3]> = bar.points().collect();
    let nodes = |at: f32| {
        (0..points.len() as u32).filter(|&node| (points[node as usize][2] - at).abs() < 1e-6).collect::<Vec<_>>()
    };
    let fixed = nodes(0.0).into_iter().map(Support::fixed);
    let slides = nodes(0.08).into_iter().map(|node| Support { axes: Axes::Z, ..Support::fixed(node) });
    let supports: Vec<_> = fixed.chain(slides).collect();
    let made = Simulation::new(points.clone(), bar.tets(), tissue, &supports);
    let mut pressed = made.unwrap().meeting(true).unwrap();
    pressed.set(Settings { damping: 20.0, ..Settings::default() });
    pressed.gravity = [1.0, 0.0, 0.0];
    let plane = Instrument::resting(Shape::Plane, Pose::along([0.0, 0.0, 0.0795], [0.0, 0.0, -1.0]));
    pressed.instruments = vec![Instrument { friction: 0.5, ..plane }];
    pressed.advance(1.0).unwrap();
    let (force, top) = (pressed.touches()[0].force, pressed.displacements()[nodes(0.08)[12] as usize].to_array());
    pressed.instruments.clear();
    pressed.advance(1.0).unwrap();
    let free = pressed.displacements()[nodes(0.08)[12] as usize].to_array();
    println!("{force:?} N; the top slides by {:.4} mm, {:.4} without the plane", 1e3 * top[0], 1e3 * free[0]);
    assert!(force.iter().all(|force| force.abs() < 1e-4) && free[0] > 1e-4 && (top[0] / free[0] - 1.0).abs() < 0.02);
}

#[test]
fn a_free_body_that_falls_is_not_at_rest() {
    for element in ELEMENTS {
        let mut simulation = bar(element, false);
        simulation.gravity = GRAVITY;
        let settled = simulation.settle(TOLERANCE, 300).unwrap();
        assert!(!settled.at_rest && settled.remaining > TOLERANCE, "{settled:?}");
        assert_eq!(settled.steps, 300);
        // Without loads it is where it rests.
        let mut simulation = bar(element, false);
        assert!(simulation.settle(TOLERANCE, 1000).unwrap().at_rest);
    }
}

#[test]
fn supports_go_where_they_are_asked_for() {
    let body = body();
    let end = body.nodes_where(|[_, _, z]| z > 0.0599);
    let mut supports: Vec<_> = held(&body).into_iter().map(Support::fixed).collect();
    supports.extend(end.iter().map(|&node| Support::moved(node)));
    let material = VecMaterial::one(Element::NodalStrain, NEO, 1000.0);
    let mut simulation = Simulation::new(body.points, body.tets, material, &supports).unwrap();
    let metre = [0.004, 0.0, 0.002];
    simulation.motions = end.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre, ramp: 0.0 }).collect();
    assert!(simulation.settle(TOLERANCE, 5000).unwrap().at_rest);
    for &node in &end {
        assert_eq!(simulation.displacements()[node as usize].to_array(), metre);
    }
    let before = simulation.displacements().to_vec();
    let report = simulation.advance(0.1).unwrap();
    assert!(report.is_ok() && apart(&before, simulation.displacements()) < 2.0 * TOLERANCE);
}

#[test]
fn steps_of_every_kind_go_on_from_rest() {
    let methods = [
        Method::Exact,
        Method::Long(inertia::Method::new(Cells::Given([1, 1, 2]))),
        Method::Auto(inertia::Method::new(Cells::Given([1, 1, 2]))),
    ];
    for (method, element) in methods.into_iter().flat_map(|method| ELEMENTS.map(|element| (method.clone(), element))) {
        let mut simulation = bar(element, true).with(Settings { method, damping: DAMPING, ..Settings::default() });
        simulation.gravity = GRAVITY;
        simulation.advance(0.05).unwrap();
        assert!(simulation.settle(TOLERANCE, 10_000).unwrap().at_rest);
        let before = simulation.displacements().to_vec();
        let reports: Vec<_> = (0..6).map(|_| simulation.advance(0.05).unwrap()).collect();
        // A guard begins anew: after its first comparisons it finds no error.
        let last = reports[5];
        assert!(last.is_ok(), "{last:?}");
        assert!(last.estimate.is_none_or(|estimate| estimate.largest < 10.0 * TOLERANCE), "{last:?}");
        let moved = apart(&before, simulation.displacements());
        println!("{element:?}: moved by {moved:.2e} m in 0.3 s");
        assert!(moved < 2.0 * TOLERANCE);
    }
}

#[test]
fn the_work_is_bounded_and_can_be_taken_in_parts() {
    let mut simulation = bar(Element::NodalPressure, true);
    simulation.gravity = GRAVITY;
    let first = simulation.settle(TOLERANCE, 40).unwrap();
    assert_eq!((first.at_rest, first.steps, simulation.state().steps()), (false, 40, 40));
    assert_eq!(simulation.state().velocity(30), [0.0; 3]);
    let rest = (0..40).find(|_| simulation.settle(TOLERANCE, 250).unwrap().at_rest);
    println!("at rest after {rest:?} more calls");
    assert!(rest.is_some());
    assert!(!bar(Element::Linear, true).settle(TOLERANCE, 0).unwrap().at_rest);
}

#[test]
fn hostile_values_are_refused_in_words() {
    let mut simulation = bar(Element::Linear, true);
    for metre in [0.0, -1e-5, f32::NAN, f32::INFINITY] {
        let error = simulation.settle(metre, 100).unwrap_err();
        assert_eq!(error.to_string(), format!("settle to within {metre} m: it must be a finite positive number"));
    }
    let (scene, state) = simulation.parts_mut();
    let mut loads = supple::loads::Loads::NONE;
    let error = tled::settle(scene, &mut loads, state, TOLERANCE, 10, &mut [NodeVector::ZERO; 7]).unwrap_err();
    let needed = tled::vectors_to_settle(scene.node_count());
    assert_eq!(error, SettleError::Capacity { needed, capacity: 7 });
    // A force that tears is named, and the state stays a number.
    simulation.forces = vec![NodalForce { node: body().farthest(2), newton: [1e12, 0.0, 0.0], ramp: 0.0 }];
    let error = simulation.settle(TOLERANCE, 100).unwrap_err();
    println!("{error}");
    assert!(matches!(error, SimulationError::Refused(_)) && error.to_string().contains("force 0"));
    assert!(simulation.displacements().iter().all(|u| u.to_array().iter().all(|axis| axis.is_finite())));
}

#[test]
fn what_the_storage_held_before_changes_no_bit() {
    let settle = |held_before: f32| {
        let mut simulation = bar(Element::NodalStrain, true);
        let (scene, state) = simulation.parts_mut();
        let mut loads = supple::loads::Loads::new(scene, GRAVITY, &[], &[]).unwrap();
        let mut room = vec![bytemuck::cast([held_before; 4]); tled::vectors_to_settle(scene.node_count())];
        let settled = tled::settle(scene, &mut loads, state, TOLERANCE, 10_000, &mut room).unwrap();
        assert!(settled.at_rest);
        (settled.steps, bits(simulation.state()))
    };
    assert_eq!(settle(f32::NAN), settle(0.0));
}

#[test]
fn threads_change_no_bit() {
    let body = Body::bar([0.1, 0.1, 0.22], [10, 10, 22]);
    let fixed: Vec<_> = held(&body).into_iter().map(Support::fixed).collect();
    for element in ELEMENTS {
        let settle = |parts: usize| {
            let material = VecMaterial::one(element, NEO, 1000.0);
            let mut simulation = Simulation::new(body.points.clone(), body.tets.clone(), material, &fixed).unwrap();
            simulation.gravity = GRAVITY;
            let surface = boundary(body.tets.iter().copied());
            let pressure = SurfacePressure::new(200.0, 0.0);
            simulation.pressures.press(&body.points, &surface, pressure).unwrap();
            let threads = Backwards::new(parts);
            let settled = simulation.settle_in_parts(TOLERANCE, 60, &threads).unwrap();
            simulation.advance_in_parts(0.01, &threads).unwrap();
            (bits(simulation.state()), settled.steps, settled.remaining.to_bits(), threads.most.into_inner())
        };
        let (one, several) = (settle(1), settle(MOST_PARTS));
        assert!(several.3 > 1 && (&one.0, one.1, one.2) == (&several.0, several.1, several.2), "{element:?}");
    }
}

#[test]
fn displacements_can_be_set() {
    for element in ELEMENTS {
        let mut simulation = bar(element, true);
        simulation.gravity = GRAVITY;
        simulation.advance(0.02).unwrap();
        let mut rest = bar(element, true);
        rest.gravity = GRAVITY;
        assert!(rest.settle(TOLERANCE, 10_000).unwrap().at_rest);
        let asked: Vec<_> = rest.displacements().iter().map(|u| u.to_array()).collect();
        let before = bits(simulation.state());
        let mut bad = asked.clone();
        bad[5][1] = f32::NAN;
        let error = simulation.set_displacements(&bad).unwrap_err();
        assert_eq!(error.to_string(), "the displacement of node 5 holds NaN");
        let error = simulation.set_displacements(&asked[1..]).unwrap_err();
        assert_eq!(
            error,
            SimulationError::Displacement(DisplacementError::Count { given: asked.len() - 1, nodes: asked.len() })
        );
        assert!(bits(simulation.state()) == before);
        let time = simulation.state().time();
        simulation.set_displacements(&asked).unwrap();
        assert!(simulation.displacements().iter().zip(&asked).all(|(u, asked)| u.to_array() == *asked));
        let (of_set, of_rest) = (simulation.state().energy_balance(), rest.state().energy_balance());
        assert!((of_set.start / of_rest.start - 1.0).abs() < 1e-6 && of_set.kinetic == 0.0 && of_set.work == 0.0);
        assert_eq!((simulation.state().time(), simulation.state().velocity(30)), (time, [0.0; 3]));
        let report = simulation.advance(0.1).unwrap();
        assert!(report.is_ok());
        let moved = apart(simulation.displacements(), rest.displacements());
        assert!(moved < 2.0 * TOLERANCE, "{element:?}: {moved} m");
    }
}
