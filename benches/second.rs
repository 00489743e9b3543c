//! One simulated second of every method on the paper's bar: the exact step at the paper's length, the others at 20
//! times that.
//!
//! `cargo bench --bench second` prints the seconds each took and how many times faster than the exact step it was, from
//! runs in turn. It has no criterion group: one run takes seconds.

mod common {
    pub(crate) mod bar;
    #[allow(dead_code)] // This bench has no guard.
    pub(crate) mod long;
    pub(crate) mod pairs;
}

use common::bar::{self, DAMPING, DT};
use common::long::long as long_steps;
use common::pairs::{median, seconds};
use supple::learned::{LearnedStep, vectors_for};
use supple::loads::Loads;
use supple::mlp::{Network, WeightBytes};
use supple::state::{NodeVector, VecState};
use supple::step::Step;
use supple::tled;

const MULTIPLE: f32 = 20.0;
const ROUNDS: usize = 5;

/// Takes the steps of a second.
type Second<'a> = Box<dyn FnMut() + 'a>;

fn main() {
    let (points, forces) = (bar::points(), bar::forces());
    let scene = bar::scene(bar::EXPONENTIAL);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).expect("nodes of the bar");
    // After 0.3 s of exact steps, the lead-in of the paper, from which the networks go on.
    let mut state = VecState::at_rest(points.len());
    let step = Step::unchecked(DT, DAMPING).expect("a positive step");
    let steps = (1.0 / DT) as u32;
    let long = (1.0 / (MULTIPLE * DT)) as u32;
    for _ in 0..10_000 {
        bar::moved(tled::step(&scene, &loads, &mut state, &step));
    }
    let [compact, compact_int8, paper, paper_int8]: [&'static WeightBytes; 4] = [
        include_bytes!("../weights/compact-20.weights").as_slice(),
        include_bytes!("../weights/compact-20-i8.weights"),
        include_bytes!("../weights/paper-20.weights"),
        include_bytes!("../weights/paper-20-i8.weights"),
    ]
    .map(|bytes| &*Box::leak(Box::new(WeightBytes::of(bytes))));
    let learned = |bytes: &'static WeightBytes| {
        let network = Network::parse(bytes.bytes()).expect("a weight file of the crate");
        let storage = vec![NodeVector::ZERO; vectors_for(points.len(), false)];
        let mut learned = LearnedStep::new(network, false, storage).expect("a network of the learned step");
        let (scene, loads, exact, mut start) = (&scene, &loads, &step, VecState::at_rest(points.len()));
        let status = learned.lead(scene.view(), loads, start.view(), (exact, 0.3));
        bar::moved(status.expect("the exact step fits the network's"));
        move || {
            let (mut state, mut learned) = (start.clone(), learned.clone());
            for _ in 0..long {
                let status = learned.step(scene.view(), loads, state.view(), exact);
                bar::moved(status.expect("it goes on from the lead-in"));
            }
        }
    };
    let mut long_step = long_steps(&scene, &loads, &points, MULTIPLE);
    let mut others: [(&str, Second<'_>); 5] = [
        ("long", Box::new(|| (0..long).for_each(|_| long_step()))),
        ("compact network", Box::new(learned(compact))),
        ("compact network, int8", Box::new(learned(compact_int8))),
        ("paper's network", Box::new(learned(paper))),
        ("paper's network, int8", Box::new(learned(paper_int8))),
    ];
    let mut exact_state = state.clone();
    let mut exact = || (0..steps).for_each(|_| bar::moved(tled::step(&scene, &loads, &mut exact_state, &step)));

    let mut times = Vec::new();
    let mut results = vec![(Vec::new(), Vec::new()); others.len()];
    for _ in 0..ROUNDS {
        // The exact step before and after the others: the machine's speed drifts.
        let first = seconds(&mut exact);
        let others: Vec<f64> = others.iter_mut().map(|(_, run)| seconds(run)).collect();
        let time = 0.5 * (first + seconds(&mut exact));
        times.push(time);
        for (result, other) in results.iter_mut().zip(others) {
            result.0.push(other);
            result.1.push(time / other);
        }
    }
    println!("one second, exact: {:.2} s in {steps} steps", median(times));
    for ((name, _), (times, ratios)) in others.iter().zip(results) {
        println!("{name}: {:.3} s in {long} steps, {:.1} times faster", median(times), median(ratios));
    }
}
