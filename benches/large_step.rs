//! Time of mass-scaled, multilevel and damped steps on the paper's bar, compared with the exact one.
//!
//! `cargo bench --bench large_step` prints criterion's figures, then ratios from interleaved pairs of runs (the
//! machine's speed drifts; the ratio does not) and what the steps of a refresh cycle cost against their mean.

mod common {
    pub(crate) mod bar;
    pub(crate) mod pairs;
    pub(crate) mod scaled;
}

use common::bar::{self, DAMPING, DT, moved};
use common::pairs::{median, seconds};
use common::scaled::{CYCLE, damped, guarded, multilevel, scaled};
use criterion::{BenchmarkId, Criterion, Throughput};
use supple::inertia::Method;
use supple::loads::Loads;
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

/// Steps in one of a guard's second run.
const EVERY: [u32; 3] = [2, 3, 10];
/// How many times longer than the exact one the steps are.
const MULTIPLE: f32 = 20.0;
const LONGEST: f32 = 100.0;
const PAIRS: usize = 41;

/// Median time of each step of a cycle over their mean, from the current step of the cycle on.
fn phases(run: &mut impl FnMut()) -> Vec<f64> {
    let mut times = vec![Vec::new(); CYCLE as usize];
    for _ in 0..PAIRS {
        for times in &mut times {
            times.push(seconds(&mut *run));
        }
    }
    let times: Vec<f64> = times.into_iter().map(median).collect();
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    times.iter().map(|time| time / mean).collect()
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(30);
    let (points, forces) = (bar::points(), bar::forces());
    let scene = bar::scene(bar::EXPONENTIAL);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).expect("nodes of the bar");

    let mut exact_state = VecState::at_rest(points.len());
    let critical = tled::critical_step(&scene, &mut exact_state).expect("the bar has a critical step");
    let small = Step::new(DT, DAMPING, critical).expect("dt is below the critical step");
    let mut exact = || moved(tled::step(&scene, &loads, &mut exact_state, &small));
    (0..8_000).for_each(|_| exact());
    let mut longest = scaled(&scene, &loads, &points, LONGEST, multilevel());
    let mut longest_damped = scaled(&scene, &loads, &points, LONGEST, damped());
    let mut mass_scaled = scaled(&scene, &loads, &points, MULTIPLE, Method::MassScaled);
    let mut multilevel = scaled(&scene, &loads, &points, MULTIPLE, multilevel());
    let mut with_guards = EVERY.map(|every| guarded(&scene, &loads, &points, MULTIPLE, damped(), Some(every)));
    let mut damped = scaled(&scene, &loads, &points, MULTIPLE, damped());

    let mut group = criterion.benchmark_group("beyond the critical step");
    group.throughput(Throughput::Elements(scene.element_count() as u64));
    group.bench_function(BenchmarkId::from_parameter("exact"), |b| b.iter(&mut exact));
    group.bench_function(BenchmarkId::from_parameter("mass-scaled"), |b| b.iter(&mut mass_scaled));
    group.bench_function(BenchmarkId::from_parameter("multilevel"), |b| b.iter(&mut multilevel));
    group.bench_function(BenchmarkId::from_parameter("damped"), |b| b.iter(&mut damped));
    group.finish();

    let mut times = Vec::new();
    let mut ratios = [const { Vec::new() }; 5];
    let mut guards = [const { Vec::new() }; EVERY.len()];
    for _ in 0..PAIRS {
        let one = seconds(|| (0..CYCLE).for_each(|_| exact())) / f64::from(CYCLE);
        let others = [
            seconds(|| (0..CYCLE).for_each(|_| mass_scaled())) / f64::from(CYCLE),
            seconds(|| (0..CYCLE).for_each(|_| multilevel())) / f64::from(CYCLE),
            seconds(|| (0..CYCLE).for_each(|_| longest())) / f64::from(CYCLE),
            seconds(|| (0..CYCLE).for_each(|_| damped())) / f64::from(CYCLE),
            seconds(|| (0..CYCLE).for_each(|_| longest_damped())) / f64::from(CYCLE),
        ];
        for (guards, guarded) in guards.iter_mut().zip(&mut with_guards) {
            guards.push(seconds(|| (0..CYCLE).for_each(|_| guarded())) / f64::from(CYCLE) / others[3]);
        }
        times.push(one);
        for (ratios, other) in ratios.iter_mut().zip(others) {
            ratios.push(other / one);
        }
    }
    let [mass_scaled_ratio, multilevel_ratio, longest_ratio, damped_ratio, longest_damped_ratio] = ratios.map(median);
    let [most, most_damped] =
        [phases(&mut multilevel), phases(&mut damped)].map(|phases| phases.into_iter().fold(0.0, f64::max));
    println!(
        "exact {:.0} us a step; at {MULTIPLE} times its length mass-scaled {mass_scaled_ratio:.2} times that, multilevel \
         {multilevel_ratio:.2} times; the dearest step of a cycle {most:.2} times their mean; at {LONGEST} times its \
         length multilevel {longest_ratio:.2} times. Damped: {damped_ratio:.2} times, the \
         dearest step {most_damped:.2} times, at {LONGEST} times its length {longest_damped_ratio:.2} times",
        median(times) * 1e6,
    );
    println!(
        "damped steps with a guard whose second run takes one step in {EVERY:?}: {:.2?} times those without",
        guards.map(median)
    );
    criterion.final_summary();
}
