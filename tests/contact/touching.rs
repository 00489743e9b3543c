//! Momentum, release, refusal, and instruments in random places.

use supple::contact::{Contact, ContactError, Instrument, Pose, Shape, Surface, SurfaceNode, Touch, vectors_to_push};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::mesh::Bar;
use supple::scene::Support;
use supple::state::NodeVector;
use supple::step::{Cause, Status, Step};

use super::scene::{Body, compared};
use crate::networks::uniform;

const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [3, 3, 6] };

fn fixed_end() -> Vec<Support> {
    (0..16).map(Support::fixed).collect()
}

/// A free body that is hit by a sphere, dragged along it with friction, and left: the impulse of the instrument is the
/// change of its momentum. The body has no damping and no support.
#[test]
fn the_impulse_of_an_instrument_is_the_change_of_momentum() {
    let mut body = Body::new(BAR, &[], 0.0);
    let mut sphere = Instrument::resting(Shape::Sphere { radius: 0.008 }, Pose::at([-0.009, 0.009, 0.031]));
    sphere.friction = 0.4;
    sphere.move_to(Pose::at([-0.001, 0.012, 0.033]), 0.0, 0.04);
    let (mut touch, mut impulse, mut pushed) = ([Touch::default()], [0.0f64; 3], 0);
    while body.time() < 0.06 {
        assert!(body.step([0.0; 3], &[sphere], &mut touch).is_taken());
        for (sum, force) in impulse.iter_mut().zip(touch[0].force) {
            *sum -= f64::from(force) * f64::from(body.step.seconds());
        }
        pushed += u32::from(touch[0].contacts > 0);
    }
    let (momentum, _) = body.momentum();
    let (size, error) = compared(momentum, impulse);
    println!("momentum {momentum:?} kg m/s, off by {:.1e}; pushed in {pushed} steps", error);
    assert!(pushed > 20 && size > 1e-5);
    assert!(error < 1e-4);
    // The other axes are not all zero: friction and the slope of the sphere act.
    assert!(momentum[1].abs() > 0.01 * size);
}

/// What an instrument has left feels nothing, and the tissue returns to where it was.
#[test]
fn tissue_is_free_when_the_instrument_leaves() {
    let mut body = Body::new(BAR, &fixed_end(), 60.0);
    let mut sphere = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at([-0.0101, 0.01, 0.04]));
    sphere.friction = 0.3;
    let (mut touch, mut most) = ([Touch::default()], 0.0f32);
    sphere.move_to(Pose::at([-0.006, 0.01, 0.04]), 0.0, 0.1);
    while body.time() < 0.15 {
        assert!(body.step([0.0; 3], &[sphere], &mut touch).is_taken());
        most = most.max(-touch[0].force[0]);
    }
    let pressed = body.displacement(BAR.node(0, 1, 6) as usize)[0];
    sphere.move_to(Pose::at([-0.02, 0.01, 0.04]), 0.15, 0.2);
    while body.time() < 0.6 {
        assert!(body.step([0.0; 3], &[sphere], &mut touch).is_taken());
    }
    let left = body.displacement(BAR.node(0, 1, 6) as usize)[0];
    println!("pressed {:.3} mm with {:.1} mN, then {:.4} mm", 1e3 * pressed, 1e3 * most, 1e3 * left);
    assert!(pressed > 2e-3 && most > 1e-3);
    assert_eq!(touch[0], Touch::default());
    assert!(left.abs() < 0.01 * pressed);
}

/// Tissue that is inside an instrument goes out as fast in short steps as in long ones.
#[test]
fn tissue_inside_an_instrument_is_not_thrown() {
    let sphere = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at([-0.0085, 0.0066, 0.0267]));
    for share in [1.0, 0.1] {
        let mut body = Body::new(BAR, &fixed_end(), 20.0);
        body.step = Step::unchecked(share * body.step.seconds(), 20.0).unwrap();
        let mut most = 0.0f64;
        while body.time() < 0.03 {
            assert!(body.step([0.0; 3], &[sphere], &mut [Touch::default()]).is_taken());
            most = most.max(body.kinetic());
        }
        let out = body.displacement(BAR.node(0, 1, 4) as usize)[0];
        println!("{share} times the usual step: up to {most:.1e} J, {:.2} mm out", 1e3 * out);
        assert!(most < 3e-5 && out > 1.4e-3, "{most} J, {out} m");
    }
}

/// An instrument that touches nothing changes no bit.
#[test]
fn an_instrument_far_away_changes_nothing() {
    let far = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at([1.0, 0.0, 0.0]));
    let [mut with, mut without] = [Body::new(BAR, &fixed_end(), 5.0), Body::new(BAR, &fixed_end(), 5.0)];
    for _ in 0..200 {
        let _ = with.step([0.0, -9.81, 0.0], &[far], &mut [Touch::default()]);
        let _ = without.step([0.0, -9.81, 0.0], &[], &mut []);
    }
    assert!(with.displacement(BAR.node(1, 1, 6) as usize)[1] < -1e-5);
    assert_eq!(with.bits(), without.bits());
}

#[test]
fn what_is_too_fast_or_inside_the_body_is_refused_with_its_name() {
    let mut body = Body::new(BAR, &fixed_end(), 5.0);
    let mut fast = Instrument::resting(Shape::Sphere { radius: 0.002 }, Pose::at([-0.005, 0.01, 0.03]));
    fast.move_to(Pose::at([0.025, 0.01, 0.03]), 0.0, f64::from(body.step.seconds()));
    let inside = Instrument::resting(Shape::Sphere { radius: 0.015 }, Pose::at([0.01, 0.01, 0.03]));
    let table = Instrument::resting(Shape::Plane, Pose::at([0.0, 0.0, -1.0]));
    // As fast as the first one, but nowhere near.
    let mut above = Instrument::resting(Shape::Sphere { radius: 0.002 }, Pose::at([-0.005, 0.01, 0.06]));
    above.move_to(Pose::at([0.025, 0.01, 0.06]), 0.0, f64::from(body.step.seconds()));
    let mut other = Body::new(BAR, &fixed_end(), 5.0);
    assert_eq!(other.step([0.0; 3], &[table, above], &mut [Touch::default(); 2]), Status::Ok);
    for (wrong, what) in [(fast, "fast"), (inside, "inside")] {
        let before = body.bits();
        let status = body.step([0.0; 3], &[table, wrong], &mut [Touch::default(); 2]);
        let Status::Diverged(divergence) = status else { panic!("{status:?}") };
        println!("{what}: {divergence}");
        assert!(matches!(divergence.cause, Cause::Instrument { index: 1, metre, most } if metre > most));
        let displacements = |bits: Vec<[u32; 4]>| bits[..body.points.len()].to_vec();
        assert_eq!(displacements(before), displacements(body.bits()));
    }
}

/// Long steps without room for pushes say so, and move nothing.
#[test]
fn long_steps_without_room_for_pushes_refuse_instruments() {
    let mut body = Body::new(BAR, &fixed_end(), 5.0);
    let (points, step) = (body.points.clone(), body.step);
    let scene = body.scene.clone();
    let table = [Instrument::resting(Shape::Plane, Pose::at([0.0, 0.0, -1.0]))];
    let surface = body.surface.clone();
    let contact = Contact::new(Surface::new(&surface, points.len()).unwrap(), &table).unwrap();
    let loads = Loads::new(&scene, [0.0, -9.81, 0.0], &[], &[]).unwrap().touched_by(contact);
    let method = Method::new(Cells::Given([1, 1, 2]));
    let mut long = LargeStep::prepare_in_vec(method, scene.view(), &points, body.state(&mut []), step).unwrap();
    let status = long.step(scene.view(), &loads, body.state(&mut []));
    let Status::Diverged(divergence) = status else { panic!("{status:?}") };
    println!("{divergence}");
    assert_eq!(divergence.cause, Cause::NoContact);
    assert_eq!(body.displacement(BAR.node(1, 1, 6) as usize), [0.0; 3]);
    let mut pushes = vec![NodeVector::ZERO; vectors_to_push(surface.len(), 0)];
    assert!(long.step(scene.view(), &loads, body.state(&mut []).pushing(&mut pushes)).is_taken());
}

/// Instruments anywhere, of any size and speed: a step is taken with finite numbers, or refused.
#[test]
fn no_pose_makes_a_step_wrong_and_calls_it_right() {
    any_poses(Body::new(BAR, &fixed_end(), 20.0));
    any_poses(Body::new(BAR, &fixed_end(), 20.0).with_triangles());
}

fn any_poses(mut body: Body) {
    let mut uniform = uniform(1);
    let mut random = || 0.5 * (uniform() + 1.0);
    let (mut taken, mut refused, mut touched) = (0, 0, 0);
    // More of them on demand.
    let asked = std::env::var("POSES").ok().and_then(|poses| poses.parse().ok());
    let poses = asked.unwrap_or(if cfg!(feature = "slow-tests") { 30_000 } else { 5_000 });
    for pose in 0..poses {
        let place = [0.06, 0.06, 0.08].map(|size| size * (random() - 0.25));
        let direction = [random() - 0.5, random() - 0.5, random() - 0.5];
        let shape = match pose % 3 {
            0 => Shape::Sphere { radius: 1e-4 + 0.02 * random() },
            1 => Shape::Capsule { radius: 1e-4 + 0.01 * random(), length: 0.1 * random() + 1e-6 },
            _ => Shape::Plane,
        };
        let mut instrument = Instrument::resting(shape, Pose::along(place, direction));
        instrument.friction = 2.0 * random();
        // Up to 3 km/s.
        let way = 3000.0 * random().powi(8) * body.step.seconds();
        let end = [place[0] + way * direction[0], place[1] + way * direction[1], place[2] + way * direction[2]];
        let now = body.time();
        instrument.move_to(Pose::along(end, direction), now, now + f64::from(body.step.seconds()));
        let mut touch = [Touch::default()];
        let status = body.step([0.0, -9.81, 0.0], &[instrument], &mut touch);
        if status.is_taken() {
            taken += 1;
            touched += u32::from(touch[0].contacts > 0);
            assert!(touch[0].force.iter().chain(&touch[0].moment).all(|component| component.is_finite()));
        } else {
            refused += 1;
            // A body that was thrown or crushed starts anew.
            if !matches!(status, Status::Diverged(d) if matches!(d.cause, Cause::Instrument { .. })) {
                body.state(&mut []).reset();
            }
        }
        if pose % 100 == 0 {
            assert!((0..body.points.len()).all(|node| body.displacement(node).iter().all(|u| u.is_finite())));
        }
    }
    println!("{} triangles: {taken} taken, {touched} of them touched; {refused} refused", body.triangles.len());
    assert!(touched > poses / 100 && refused > poses / 100);
}

#[test]
fn bad_values_are_named() {
    let nodes = [SurfaceNode { rest: [0.0; 3], node: 0 }, SurfaceNode { rest: [0.0; 3], node: 9 }];
    let error = Surface::new(&nodes, 9).unwrap_err();
    assert_eq!(error, ContactError::Node { place: 1, node: 9, nodes: 9 });
    println!("{error}");
    let surface = Surface::new(&nodes, 10).unwrap();
    for (triangle, place) in [([0, 1, 2], 2), ([0, 1, 0], 0)] {
        let error = surface.with_triangles(&[triangle]).unwrap_err();
        assert_eq!(error, ContactError::Triangle { triangle: 0, place, nodes: 2 });
        println!("{error}");
    }
    let sphere = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at([0.0; 3]));
    let bad = [
        Instrument { shape: Shape::Sphere { radius: -1.0 }, ..sphere },
        Instrument { shape: Shape::Capsule { radius: 1.0, length: f32::NAN }, ..sphere },
        Instrument { friction: f32::INFINITY, ..sphere },
        Instrument { times: [0.0, f64::NAN], ..sphere },
        Instrument { to: Pose { position: [0.0; 3], rotation: [0.0; 4] }, ..sphere },
        Instrument { from: Pose::at([f32::NAN, 0.0, 0.0]), ..sphere },
    ];
    for bad in bad {
        let error = Contact::new(surface, &[sphere, bad]).unwrap_err();
        println!("{error}");
        assert!(error.to_string().starts_with("instrument 1: "));
    }
}
