//! Grasp and let go; and the force between two frames.

use supple::contact::{Contact, Grip, Instrument, LocalForce, Pose, Shape, Surface, Touch, vectors_to_push};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::mesh::Bar;
use supple::scene::Support;
use supple::state::{AsState, NodeVector};
use supple::step::{Status, Step};
use supple::tled;

use super::scene::Body;

const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [3, 3, 6] };
const GRAVITY: [f32; 3] = [0.0, 0.0, -9.81];

/// Forceps as a ball inside the top of the bar.
fn forceps() -> Instrument<'static> {
    Instrument::resting(Shape::Sphere { radius: 0.006 }, Pose::at([0.01, 0.01, 0.041]))
}

/// The nodes of the top that the forceps hold.
fn grips(body: &Body, displacements: &[NodeVector], forceps: Instrument<'_>, time: f64) -> Vec<Grip> {
    let surface = Surface::new(&body.surface, body.points.len()).unwrap();
    forceps.grips(0, surface, displacements, time, 0.0005).collect()
}

type Large = LargeStep<Vec<NodeVector>>;

/// A step under gravity with these grips.
fn step(
    body: &mut Body,
    large: Option<&mut Large>,
    (forceps, grips): (Instrument<'_>, &[Grip]),
    pushes: &mut [NodeVector],
) -> Touch {
    let (surface, scene, step) = (body.surface.clone(), body.scene.clone(), body.step);
    let (instruments, mut touch) = ([forceps], [Touch::default()]);
    let surface = Surface::new(&surface, body.points.len()).unwrap();
    let contact = Contact::new(surface, &instruments).unwrap().gripping(grips).unwrap();
    let loads = Loads::new(&scene, GRAVITY, &[], &[]).unwrap().touched_by(contact);
    let mut state = body.state(&mut touch).pushing(pushes);
    let status = match large {
        None => tled::step(&scene, &loads, &mut state.as_state(), &step),
        Some(large) => large.step(scene.view(), &loads, state),
    };
    assert_eq!(status, Status::Ok);
    touch[0]
}

/// A free bar is lifted by its top, turned, carried and let go, in exact and in long steps: what is held follows
/// exactly, the forceps carry the weight, and a body that was let go falls like a stone.
#[test]
fn forceps_hold_lift_and_let_go() {
    for multiple in [0.9f32, 10.0] {
        let mut body = Body::new(BAR, &[], 30.0);
        let seconds = multiple * body.step.seconds() / 0.9;
        body.step = Step::unchecked(seconds, 30.0).unwrap();
        let mut pushes = vec![NodeVector::ZERO; vectors_to_push(body.surface.len(), 0)];
        let (points, scene, length) = (body.points.clone(), body.scene.clone(), body.step);
        let mut large = (multiple > 1.0).then(|| {
            let method = Method::new(Cells::Given([1, 1, 2]));
            LargeStep::prepare_in_vec(method, scene.view(), &points, body.state(&mut []), length).unwrap()
        });
        let mut forceps = forceps();
        let held = grips(&body, &vec![NodeVector::ZERO; points.len()], forceps, 0.0);
        assert!(held.len() >= 4 && held.len() < body.surface.len() / 4, "{}", held.len());
        forceps.move_to(Pose::along([0.015, 0.01, 0.046], [0.2, 0.0, 1.0]), 0.0, 0.2);
        let (mut carried, mut steps) = (0.0f64, 0.0);
        while body.time() < 0.6 {
            let touch = step(&mut body, large.as_mut(), (forceps, &held), &mut pushes);
            assert_eq!(touch.contacts as usize, held.len());
            if body.time() > 0.5 {
                carried -= f64::from(touch.force[2]);
                steps += 1.0;
            }
        }
        let weight = 9.81 * body.momentum().1;
        // The forceps have turned by atan(0.2) about y.
        let [sin, cos] = [0.2f32, 1.0].map(|side| side / (1.04f32).sqrt());
        let mut worst = 0.0f32;
        for grip in &held {
            let entry = body.surface[grip.place as usize];
            let moved = body.displacement(entry.node as usize);
            let [x, y, z] = grip.point;
            let at = [0.015 + cos * x + sin * z, 0.01 + y, 0.046 - sin * x + cos * z];
            (0..3).for_each(|axis| worst = worst.max((entry.rest[axis] + moved[axis] - at[axis]).abs()));
        }
        println!(
            "{multiple} times: {} nodes held, off by {worst:.1e} m; carries {:.3} of {:.3} mN",
            held.len(),
            1e3 * carried / steps,
            1e3 * weight
        );
        assert!(worst < 5e-6 && (carried / steps / weight - 1.0).abs() < 0.02);
        // Free: the mean velocity changes by g, up to the damping of 30 / s.
        let (before, mass) = body.momentum();
        let start = body.time();
        forceps.move_to(Pose::at([0.0, 0.0, 1.0]), start, start + 1e-9);
        forceps = Instrument::resting(forceps.shape, Pose::at([0.0, 0.0, 1.0]));
        while body.time() < start + 0.005 {
            let touch = step(&mut body, large.as_mut(), (forceps, &[]), &mut pushes);
            assert_eq!(touch, Touch::default());
        }
        let seconds = body.time() - start;
        let fallen = (body.momentum().0[2] - before[2]) / mass / seconds;
        println!("falls with {fallen:.2} m/s^2");
        assert!((-9.9..-8.5).contains(&fallen) || multiple > 1.0);
    }
}

/// To grasp tissue that rests changes no bit of it, and what is not held is not touched.
#[test]
fn to_grasp_is_not_to_move() {
    let fixed: Vec<_> = (0..16).map(Support::fixed).collect();
    let [mut held, mut free] = [(); 2].map(|()| Body::new(BAR, &fixed, 5.0));
    let grips = grips(&held, &vec![NodeVector::ZERO; held.points.len()], forceps(), 0.0);
    let surface = held.surface.clone();
    let surface = Surface::new(&surface, held.points.len()).unwrap();
    let instruments = [forceps()];
    let contact = Contact::new(surface, &instruments).unwrap().gripping(&grips).unwrap();
    let (scene, step) = (held.scene.clone(), held.step);
    for _ in 0..3 {
        let loads = Loads::NONE.touched_by(contact);
        let _ = tled::step(&scene, &loads, &mut held.state(&mut []).as_state(), &step);
        let _ = tled::step(&scene, &Loads::NONE, &mut free.state(&mut []).as_state(), &step);
    }
    let still = (0..held.points.len()).flat_map(|node| held.displacement(node)).fold(0.0f32, |a, b| a.max(b.abs()));
    println!("{} nodes held move by at most {still:.1e} m", grips.len());
    assert!(still < 1e-9);
    let bad = [
        Grip { place: 9999, ..grips[0] },
        Grip { instrument: 1, ..grips[0] },
        Grip { point: [f32::NAN; 3], ..grips[0] },
    ];
    for bad in bad {
        let error = Contact::new(surface, &instruments).unwrap().gripping(&[bad]).unwrap_err();
        println!("{error}");
    }
    assert!(Contact::new(surface, &instruments).unwrap().gripping(&[grips[1], grips[0]]).is_err());
}

/// A ball that presses and slides back and forth, 60 frames a second: the force that the model of the frame before
/// predicts for the next one, against holding the last force.
#[test]
fn the_force_between_frames_is_predicted() {
    const FRAME: f64 = 1.0 / 60.0;
    for hertz in [0.25, 1.0, 4.0] {
        let fixed: Vec<_> = (0..16).map(Support::fixed).collect();
        let mut body = Body::new(BAR, &fixed, 40.0);
        body.pushes = vec![NodeVector::ZERO; vectors_to_push(body.surface.len(), 0)];
        let at = |time: f64| {
            let phase = 2.0 * std::f64::consts::PI * hertz * time;
            Pose::at([-0.0085 - 0.0015 * phase.cos() as f32, 0.01, 0.03 + 0.001 * (0.5 * phase).sin() as f32])
        };
        let mut ball = Instrument::resting(Shape::Sphere { radius: 0.01 }, at(0.0));
        ball.friction = 0.2;
        let (mut model, mut touch) = (LocalForce::NEW, [Touch::default()]);
        let (mut forces, mut errors, mut hold_errors) = (0.0, 0.0, 0.0);
        for frame in 1..=(60.0 * 3.0 / hertz) as u32 {
            let (start, end) = (body.time(), f64::from(frame) * FRAME);
            ball.move_to(at(end), start, end);
            while body.time() < end {
                assert!(body.step([0.0; 3], &[ball], &mut touch).is_taken());
            }
            model.follow(ball.to.position, touch[0].force);
            forces += touch[0].force.iter().map(|force| force * force).sum::<f32>().sqrt();
            errors += model.error;
            hold_errors += model.hold_error;
        }
        println!(
            "{hertz} Hz: the next frame's force is off by {:.1} % of the mean force, held by {:.1} %",
            100.0 * errors / forces,
            100.0 * hold_errors / forces
        );
        assert!(forces > 0.1 && errors < if hertz < 2.0 { 0.7 } else { 1.0 } * hold_errors);
    }
}
