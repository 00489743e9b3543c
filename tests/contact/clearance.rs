//! A state that keeps clearances looks at few nodes and must find what a state without them finds.

use supple::contact::{Instrument, Pose, Shape, Touch, vectors_to_push};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::state::NodeVector;
use supple::step::Step;

use super::scene::Body;
use crate::networks::uniform;

const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [5, 5, 10] };

/// Instruments that wander, turn, jump, change and are exchanged, on a body that swings, with steps that are refused,
/// of other lengths, or taken without instruments: the same bits.
#[test]
fn a_state_that_keeps_clearances_takes_the_same_steps_to_the_bit() {
    let fixed: Vec<_> = (0..36).map(Support::fixed).collect();
    let [all, mut few] = [(); 2].map(|()| Body::new(BAR, &fixed, 2.0));
    few.pushes = vec![NodeVector::ZERO; vectors_to_push(few.surface.len(), 0)];
    same_steps(all, few, |body, _, _| body.pushes.fill(NodeVector::ZERO));
}

/// Triangles too: one of the states forgets its clearances before each step, as an instrument far away comes or goes.
#[test]
fn a_state_that_keeps_clearances_of_triangles_takes_the_same_steps_to_the_bit() {
    let fixed: Vec<_> = (0..36).map(Support::fixed).collect();
    let [all, few] = [(); 2].map(|()| Body::new(BAR, &fixed, 2.0).with_triangles());
    let far = Instrument::resting(Shape::Sphere { radius: 0.006 }, Pose::at([1.0, 1.0, 1.0]));
    same_steps(all, few, |_, instruments, is_odd| {
        if is_odd && !instruments.is_empty() {
            instruments.push(far);
        }
    });
}

/// `forget` makes the first body forget before a step, which may be an odd one, or changes its instruments so that it does.
fn same_steps(mut all: Body, mut few: Body, forget: impl Fn(&mut Body, &mut Vec<Instrument<'_>>, bool)) {
    let mut uniform = uniform(7);
    let sphere = Instrument::resting(Shape::Sphere { radius: 0.006 }, Pose::at([-0.008, 0.01, 0.03]));
    let needle = Shape::Capsule { radius: 0.003, length: 0.03 };
    let needle = Instrument::resting(needle, Pose::along([0.03, 0.01, 0.025], [0.0, 1.0, 0.2]));
    let table = Instrument::resting(Shape::Plane, Pose::along([0.0, -0.002, 0.0], [0.0, 1.0, 0.0]));
    let mut instruments = vec![sphere, needle, table];
    let (mut touched, mut refused, rounds) = (0, 0, if cfg!(feature = "slow-tests") { 800 } else { 300 });
    for round in 0..rounds {
        let now = all.time();
        for instrument in &mut instruments {
            let step = 0.001 * if uniform() > 0.97 { 30.0 } else { 1.0 };
            let home = [-0.006, 0.01, 0.03];
            let turn = [uniform(), uniform(), uniform()];
            let at = instrument.to.position;
            let to = [0, 1, 2].map(|axis| at[axis] + step * uniform() + 0.02 * (home[axis] - at[axis]));
            let to = match instrument.shape {
                Shape::Plane if uniform() < 0.8 => instrument.to,
                Shape::Plane => Pose::along([0.0, -0.002, 0.0], [0.05 * turn[0], 1.0, 0.05 * turn[2]]),
                _ => Pose { position: to, rotation: Pose::along(to, turn).rotation },
            };
            instrument.move_to(to, now, now + 20.0 * f64::from(all.step.seconds()));
        }
        match round % 10 {
            3 => instruments.reverse(),
            6 => {
                let step = Step::unchecked(all.step.seconds() * if round % 20 == 6 { 0.7 } else { 1.0 / 0.7 }, 2.0);
                (all.step, few.step) = (step.unwrap(), step.unwrap());
            }
            _ => {}
        }
        let here = if round % 10 == 8 { &[] } else { &*instruments };
        for step in 0..20 {
            let mut touches = [[Touch::default(); 4]; 2];
            let gravity = [0.0, -9.81, 0.0];
            let [with, without] = &mut touches;
            let mut of_all = here.to_vec();
            forget(&mut all, &mut of_all, step % 2 == 1);
            let status = all.step(gravity, &of_all, with);
            assert_eq!(status, few.step(gravity, here, without));
            assert_eq!(touches[0], touches[1]);
            touched += touches[0].iter().filter(|touch| touch.contacts > 0).count();
            refused += usize::from(!status.is_taken());
            if !status.is_taken() && uniform() > 0.5 {
                all.state(&mut []).reset();
                few.state(&mut []).reset();
                break;
            }
        }
        assert_eq!(all.bits(), few.bits(), "round {round}");
    }
    println!("{touched} touches, {refused} steps refused");
    assert!(touched > rounds && refused > 3);
}
