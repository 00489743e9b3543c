//! Time of networks: their forward pass at the paper's bar's 1,458 vertices, and learned steps with them compared with
//! the exact one.
//!
//! `cargo bench --bench network` prints criterion's figures, then times from interleaved runs and shares of the
//! machine's measured peak.

mod common {
    pub(crate) mod bar;
    pub(crate) mod pairs;
    pub(crate) mod peak;
    pub(crate) mod vertices;
}

use common::bar::{self, DAMPING, DT};
use common::pairs::{median, seconds};
use common::peak;
use common::vertices::{ROWS, vertices};
use criterion::{BenchmarkId, Criterion, Throughput};
use std::hint::black_box;
use supple::learned::{LearnedStep, vectors_for};
use supple::loads::Loads;
use supple::mlp::{Description, LayerDescription, Network, WeightBytes, write};
use supple::state::{NodeVector, VecState};
use supple::step::Step;
use supple::tled;

const ROUNDS: usize = 41;

const PAPER: &[u8] = include_bytes!("../weights/paper-10.weights");
const PAPER_INT8: &[u8] = include_bytes!("../weights/paper-10-i8.weights");
const COMPACT: &[u8] = include_bytes!("../weights/compact-10.weights");
const COMPACT_INT8: &[u8] = include_bytes!("../weights/compact-10-i8.weights");

/// A network of one small layer that predicts zero: what a learned step costs besides its network.
fn nothing(like: &Network<'_>) -> WeightBytes {
    let layer = LayerDescription {
        inputs: like.inputs().len(),
        activation: supple::mlp::Activation::Linear,
        weights: vec![0.0; like.inputs().len() * like.outputs().len()],
        biases: vec![0.0; like.outputs().len()],
    };
    let bytes = write(&Description { first: vec![layer], second: Vec::new(), ..Description::of(like) })
        .expect("a sound network");
    WeightBytes::of(&bytes)
}

fn forward(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("forward, 1458 vertices");
    group.throughput(Throughput::Elements(ROWS as u64));
    for (name, bytes, int8) in [("paper", PAPER, PAPER_INT8), ("compact", COMPACT, COMPACT_INT8)] {
        let (bytes, int8) = (WeightBytes::of(bytes), WeightBytes::of(int8));
        let network = Network::parse(bytes.bytes()).expect("a weight file of the crate");
        let int8 = Network::parse(int8.bytes()).expect("a weight file of the crate");
        let values = vertices(&network);
        let mut predicted = vec![0.0; ROWS * network.outputs().len()];
        group.bench_function(BenchmarkId::new(name, "f32"), |b| {
            b.iter(|| network.predict_rows(black_box(&values), &mut predicted));
        });
        group.bench_function(BenchmarkId::new(name, "int8"), |b| {
            b.iter(|| int8.predict_rows(black_box(&values), &mut predicted));
        });
        let flops = 2e-9 * network.multiply_adds() as f64 * ROWS as f64;
        let (mut times, mut shares) = ([Vec::new(), Vec::new()], Vec::new());
        let mut ratios = Vec::new();
        for _ in 0..ROUNDS {
            let before = peak::widest(5);
            let time = seconds(|| network.predict_rows(black_box(&values), &mut predicted));
            let in_int8 = seconds(|| int8.predict_rows(black_box(&values), &mut predicted));
            shares.push(flops / time / (0.5 * (before + peak::widest(5))));
            ratios.push(time / in_int8);
            times[0].push(time);
            times[1].push(in_int8);
        }
        let [time, in_int8] = times.map(|times| median(times) * 1e6);
        println!("{name}: {time:.0} us, {:.0} % of the machine's peak at the time", 100.0 * median(shares));
        println!("{name} int8: {in_int8:.0} us, {:.2} times as fast as float32", median(ratios));
    }
    group.finish();
}

fn steps(criterion: &mut Criterion) {
    let scene = bar::scene(bar::EXPONENTIAL);
    let (forces, nodes) = (bar::forces(), scene.node_count());
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).expect("nodes of the bar");
    let mut exact_state = VecState::at_rest(nodes);
    let exact_step = Step::unchecked(DT, DAMPING).expect("a positive step");
    let mut exact = || bar::moved(tled::step(&scene, &loads, &mut exact_state, &exact_step));
    (0..10_000).for_each(|_| exact());

    let [paper, compact, compact_int8] = [PAPER, COMPACT, COMPACT_INT8].map(WeightBytes::of);
    let empty = nothing(&Network::parse(compact.bytes()).expect("a weight file of the crate"));
    let mut learned =
        [("no network", &empty), ("compact", &compact), ("paper", &paper), ("compact int8", &compact_int8)].map(
            |(name, bytes)| {
                let network = Network::parse(bytes.bytes()).expect("a weight file of the crate");
                let storage = vec![NodeVector::ZERO; vectors_for(nodes, false)];
                let mut learned = LearnedStep::new(network, false, storage).expect("a network of the learned step");
                let mut state = VecState::at_rest(nodes);
                let (scene, loads, exact) = (&scene, &loads, &exact_step);
                let run = move || {
                    let status = learned.step(scene.view(), loads, state.view(), exact);
                    bar::moved(status.expect("it goes on from rest"));
                };
                (name, run)
            },
        );
    let mut group = criterion.benchmark_group("learned step");
    group.throughput(Throughput::Elements(nodes as u64));
    group.bench_function("exact", |b| b.iter(&mut exact));
    for (name, run) in &mut learned {
        group.bench_function(*name, |b| b.iter(&mut *run));
    }
    group.finish();

    let mut times = vec![Vec::new(); 5];
    for _ in 0..ROUNDS {
        times[0].push(seconds(|| (0..20).for_each(|_| exact())) / 20.0);
        for (times, (_, run)) in times[1..].iter_mut().zip(&mut learned) {
            times.push(seconds(|| (0..5).for_each(|_| run())) / 5.0);
        }
    }
    let [exact, nothing, compact, paper, compact_int8] = [0, 1, 2, 3, 4].map(|at| median(times[at].clone()));
    println!(
        "exact step {:.0} us; learned step without network {:.2} times that, compact {:.2} times ({:.0} us), in int8 {:.2} times \
         ({:.0} us), paper's {:.1} times",
        exact * 1e6,
        nothing / exact,
        compact / exact,
        compact * 1e6,
        compact_int8 / exact,
        compact_int8 * 1e6,
        paper / exact,
    );
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(30);
    forward(&mut criterion);
    steps(&mut criterion);
    criterion.final_summary();
}
