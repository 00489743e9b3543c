//! Instruments in mass-scaled and multilevel steps, against exact steps at a quarter of the critical one.

use supple::contact::{Contact, Instrument, Pose, Shape, Surface, Touch, vectors_to_push};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::mesh::Bar;
use supple::scene::Support;
use supple::state::NodeVector;
use supple::step::{Status, Step};
use supple::tled;

use super::scene::{Body, compared};

/// Who takes the steps.
enum Taker {
    Exact(Step),
    Long(Box<LargeStep<'static, Vec<NodeVector>>>),
}

/// A body, its steps, and what the instruments do in them.
struct Run {
    body: Body,
    taker: Taker,
    pushes: Vec<NodeVector>,
    touch: [Touch; 1],
}

impl Run {
    fn new(mut body: Body, method: Option<Method<'static>>, seconds: f32, damping: f32) -> Self {
        let step = Step::unchecked(seconds, damping).unwrap();
        let (scene, points) = (body.scene.clone(), body.points.clone());
        let taker = match method {
            None => Taker::Exact(step),
            Some(method) => Taker::Long(Box::new(
                LargeStep::prepare_in_vec(method, scene.view(), &points, body.state(&mut []), step).unwrap(),
            )),
        };
        let pushes = vec![NodeVector::ZERO; vectors_to_push(body.surface.len())];
        Self { body, taker, pushes, touch: [Touch::default()] }
    }

    fn step(&mut self, instrument: Instrument) -> Status {
        let Self { body, taker, pushes, touch } = self;
        let (surface, scene) = (body.surface.clone(), body.scene.clone());
        let instruments = [instrument];
        let contact = Contact::new(Surface::new(&surface, body.points.len()).unwrap(), &instruments).unwrap();
        let loads = Loads::NONE.touched_by(&contact);
        let mut state = body.state(touch).pushing(pushes);
        match taker {
            Taker::Exact(step) => tled::step(&scene, &loads, &mut state, step),
            Taker::Long(large) => large.step(scene.view(), &loads, state),
        }
    }
}

const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [4, 4, 8] };

fn methods() -> [(&'static str, Method<'static>); 2] {
    [("mass-scaled", Method::MassScaled), ("multilevel", Method::Multilevel(Cells::Given([1, 1, 2])))]
}

/// A free body that is hit and dragged: the impulse of the instrument is the change of its momentum, whatever inertia is added, up to
/// the share of a force that multilevel steps give to rough motion twice in fast motion. With mass scaling inertia has momentum too.
#[test]
fn the_impulse_of_an_instrument_is_the_change_of_momentum_in_multilevel_steps() {
    let critical = Body::new(BAR, &[], 0.0).step.seconds();
    for multiple in [0.5, 4.0, 10.0] {
        let [_, (_, multilevel)] = methods();
        let mut run = Run::new(Body::new(BAR, &[], 0.0), Some(multilevel), multiple * critical, 0.0);
        let mut sphere =
            Instrument::resting(Shape::Sphere { radius: 0.008 }, Pose::at([-0.0085, 0.009, 0.031]));
        sphere.friction = 0.4;
        sphere.move_to(Pose::at([-0.001, 0.012, 0.033]), 0.0, 0.1);
        let (mut impulse, mut pushed, mut first) = ([0.0f64; 3], 0, true);
        // Rough motion goes on after the hit: the mean of the momentum tells.
        let (mut mean, mut after) = ([0.0f64; 3], 0.0);
        while run.body.time() < 0.4 {
            let status = run.step(sphere);
            assert!(status.is_taken(), "{status:?}");
            // In the first step a force acts for half a step.
            let span = f64::from(multiple * critical) * if first { 0.5 } else { 1.0 };
            first = false;
            for (sum, force) in impulse.iter_mut().zip(run.touch[0].force) {
                *sum -= f64::from(force) * span;
            }
            pushed += u32::from(run.touch[0].contacts > 0);
            if run.body.time() > 0.2 {
                let (momentum, _) = run.body.momentum();
                (0..3).for_each(|axis| mean[axis] += momentum[axis]);
                after += 1.0;
            }
        }
        let scale = f64::from(run.body.step.seconds() / (multiple * critical));
        let momentum = mean.map(|sum| sum * scale / after);
        let (size, error) = compared(momentum, impulse);
        println!(
            "{multiple} times: momentum {momentum:?}, impulse {impulse:?}, off by {:.1e}; {pushed} steps",
            error
        );
        assert!(pushed > 5 && size > 1e-5);
        assert!(error < if multiple < 1.0 { 1e-4 } else { 0.02 });
    }
}

/// Press, hold, slide and retract at 20 mm/s: mean force and penetration against exact steps.
#[test]
fn pressing_sliding_and_retracting_give_the_forces_of_exact_steps() {
    const DAMPING: f32 = 20.0;
    let fixed: Vec<_> = (0..25).map(Support::fixed).collect();
    let critical = Body::new(BAR, &fixed, DAMPING).step.seconds();
    let path = [
        (0.0, [-0.0101, 0.01, 0.03]),
        (0.15, [-0.0071, 0.01, 0.03]),
        (0.25, [-0.0071, 0.01, 0.03]),
        (0.35, [-0.0071, 0.01, 0.032]),
        (0.5, [-0.0101, 0.01, 0.032]),
    ];
    // Means over the four parts of the path, N.
    let forces_of = |method: Option<Method<'static>>, seconds: f32| {
        let mut run = Run::new(Body::new(BAR, &fixed, DAMPING), method, seconds, DAMPING);
        let mut sphere = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at(path[0].1));
        sphere.friction = 0.3;
        let mut means = Vec::new();
        for (from, to) in path.iter().zip(&path[1..]) {
            sphere.move_to(Pose::at(to.1), from.0, to.0);
            let (mut sum, mut steps) = ([0.0f64; 3], 0);
            while run.body.time() < to.0 {
                let status = run.step(sphere);
                assert!(status.is_taken(), "{status:?}");
                for (sum, force) in sum.iter_mut().zip(run.touch[0].force) {
                    *sum += f64::from(force);
                }
                steps += 1;
            }
            means.push(sum.map(|sum| sum / f64::from(steps)));
        }
        (means, run.touch[0].contacts)
    };
    let (exact, left) = forces_of(None, 0.25 * critical);
    assert!(exact[1][0] < -1e-3 && left == 0);
    println!("exact: {exact:?}");
    for (name, method) in methods() {
        for multiple in [0.9, 4.0, 10.0] {
            let (means, left) = forces_of(Some(method.clone()), multiple * critical);
            let difference: f64 = means
                .iter()
                .zip(&exact)
                .map(|(a, b)| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt())
                .sum();
            let all: f64 = exact.iter().map(|b| b.iter().map(|f| f * f).sum::<f64>().sqrt()).sum();
            println!("{name} at {multiple}: {:.1} %: {means:?}", 100.0 * difference / all);
            // Mass-scaled steps are slow themselves: their bodies do not follow the exact motion.
            if name == "multilevel" || multiple < 1.0 {
                assert!(difference < 0.1 * all && left == 0, "{left} still touch");
            }
        }
    }
}
