//! One simulated second of every method on the paper's bar: the exact step at the paper's length, the others at 20 times that.
//!
//! `cargo bench --bench second` prints the seconds each took and how many times faster than the exact step it was, from
//! runs in turn. It has no criterion group: one run takes seconds.

mod common {
    pub(crate) mod bar;
    pub(crate) mod pairs;
    pub(crate) mod scaled;
}

use common::bar::{self, DAMPING, DT};
use common::pairs::{median, seconds};
use common::scaled::{DAMPED_LATTICE, LATTICE, scaled};
use supple::loads::Loads;
use supple::mlp::{Network, WeightBytes};
use supple::surrogate::{self, Surrogate, Vertex};
use supple::tled::{self, Step};

const MULTIPLE: f32 = 20.0;
const CYCLE: u32 = 64;
const ROUNDS: usize = 5;

/// Takes the steps of a second.
type Second<'a> = Box<dyn FnMut() + 'a>;

fn main() {
    let (points, forces) = (bar::points(), bar::forces());
    let scene = bar::scene(bar::EXPONENTIAL);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).expect("nodes of the bar");
    // The exact step leads for 0.3 s, as in the paper; the networks go on from there.
    let mut state = bar::state(points.len());
    let step = Step::insist(DT, DAMPING).expect("a positive step");
    let steps = (1.0 / DT) as u32;
    let long = (1.0 / (MULTIPLE * DT)) as u32;
    let mut before = Vec::new();
    for left in (0..10_000).rev() {
        if left == MULTIPLE as u32 - 1 {
            before = state.displacements().to_vec();
        }
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
        let mut surrogate =
            Surrogate::over(network, vec![Vertex::NEW; points.len()]).expect("a network of the learned step");
        let mut start = state.clone();
        start.span(&before, MULTIPLE * DT);
        let (scene, loads) = (&scene, &loads);
        move || {
            let mut state = start.clone();
            surrogate.reset();
            (0..long).for_each(|_| bar::moved(surrogate::step(scene, loads, &mut state, &mut surrogate)));
        }
    };
    let mut mass_scaled = scaled(&scene, &loads, &points, MULTIPLE, ([0; 3], false), CYCLE);
    let mut multilevel = scaled(&scene, &loads, &points, MULTIPLE, (LATTICE, false), CYCLE);
    let mut damped = scaled(&scene, &loads, &points, MULTIPLE, (DAMPED_LATTICE, true), CYCLE);
    let mut others: [(&str, Second<'_>); 7] = [
        ("mass-scaled", Box::new(|| (0..long).for_each(|_| mass_scaled()))),
        ("multilevel", Box::new(|| (0..long).for_each(|_| multilevel()))),
        ("damped (`best`)", Box::new(|| (0..long).for_each(|_| damped()))),
        ("compact network", Box::new(learned(compact))),
        ("compact network, int8", Box::new(learned(compact_int8))),
        ("paper's network", Box::new(learned(paper))),
        ("paper's network, int8", Box::new(learned(paper_int8))),
    ];
    let mut exact_state = state.clone();
    let mut exact =
        || (0..steps).for_each(|_| bar::moved(tled::step(&scene, &loads, &mut exact_state, &step)));

    let mut times = Vec::new();
    let mut found = vec![(Vec::new(), Vec::new()); others.len()];
    for _ in 0..ROUNDS {
        // The exact step before and after the others: the machine's speed drifts.
        let first = seconds(&mut exact);
        let others: Vec<f64> = others.iter_mut().map(|(_, run)| seconds(run)).collect();
        let time = 0.5 * (first + seconds(&mut exact));
        times.push(time);
        for (found, other) in found.iter_mut().zip(others) {
            found.0.push(other);
            found.1.push(time / other);
        }
    }
    println!("one second, exact: {:.2} s in {steps} steps", median(times));
    for ((name, _), (times, ratios)) in others.iter().zip(found) {
        println!("{name}: {:.3} s in {long} steps, {:.1} times faster", median(times), median(ratios));
    }
}
