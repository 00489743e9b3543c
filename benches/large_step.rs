//! Time of long steps on the paper's bar, compared with the exact one.
//!
//! `cargo bench --bench large_step` prints criterion's figures, then ratios from interleaved pairs of runs (the
//! machine's speed drifts; the ratio does not) and how much the dearest steps take over the mean.

mod common {
    pub(crate) mod bar;
    pub(crate) mod long;
    pub(crate) mod pairs;
}

use common::bar::{self, DAMPING, DT, moved};
use common::long::{RUN, guarded, long};
use common::pairs::{median, seconds};
use criterion::{BenchmarkId, Criterion, Throughput};
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

/// The time that one step in a hundred exceeds, and the most, over the mean.
fn dearest(run: &mut impl FnMut()) -> [f64; 2] {
    let mut times: Vec<f64> = (0..16 * RUN).map(|_| seconds(&mut *run)).collect();
    times.sort_by(f64::total_cmp);
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    [times[times.len() * 99 / 100], times[times.len() - 1]].map(|time| time / mean)
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
    let mut longest = long(&scene, &loads, &points, LONGEST);
    let mut with_guards = EVERY.map(|every| guarded(&scene, &loads, &points, MULTIPLE, Some(every)));
    let mut long = long(&scene, &loads, &points, MULTIPLE);

    let mut group = criterion.benchmark_group("beyond the critical step");
    group.throughput(Throughput::Elements(scene.element_count() as u64));
    group.bench_function(BenchmarkId::from_parameter("exact"), |b| b.iter(&mut exact));
    group.bench_function(BenchmarkId::from_parameter("long"), |b| b.iter(&mut long));
    group.finish();

    let (mut times, mut ratios) = (Vec::new(), [const { Vec::new() }; 2]);
    let mut guards = [const { Vec::new() }; EVERY.len()];
    for _ in 0..PAIRS {
        let one = seconds(|| (0..RUN).for_each(|_| exact()));
        let others = [seconds(|| (0..RUN).for_each(|_| long())), seconds(|| (0..RUN).for_each(|_| longest()))];
        for (guards, guarded) in guards.iter_mut().zip(&mut with_guards) {
            guards.push(seconds(|| (0..RUN).for_each(|_| guarded())) / others[0]);
        }
        times.push(one / f64::from(RUN));
        ratios.iter_mut().zip(others).for_each(|(ratios, other)| ratios.push(other / one));
    }
    let ([ratio, longest], [late, most]) = (ratios.map(median), dearest(&mut long));
    println!(
        "exact {:.0} us a step; long ones at {MULTIPLE} times its length {ratio:.2} times that, one in a hundred {late:.2} \
         and the dearest {most:.2} times their mean; at {LONGEST} times its length {longest:.2} times",
        median(times) * 1e6,
    );
    println!(
        "with a guard whose second run takes one step in {EVERY:?}: {:.2?} times those without",
        guards.map(median)
    );
    criterion.final_summary();
}
