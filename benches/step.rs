//! Time of an exact step on the paper's bar, compared with the same step in plain scalar code, and of other elements
//! compared with linear ones.
//!
//! `cargo bench --bench step` prints criterion's figures, then ratios from interleaved pairs of runs (the
//! machine's speed drifts; the ratio does not) and the share of the machine's measured peak.

mod common {
    pub(crate) mod bar;
    pub(crate) mod pairs;
    pub(crate) mod peak;
    pub(crate) mod plain;
}

use common::bar::{self, DAMPING, DENSITY, DT, HELD};
use common::pairs::{median, seconds};
use common::plain::{self, Plain};
use criterion::{BenchmarkId, Criterion, Throughput};
use supple::element::{ElementLaw, ElementMaterial};
use supple::loads::{Loads, NodalForce};
use supple::material::{NeoHookean, NodalPressure, NodalStrain, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::VecScene;
use supple::simd::Level;
use supple::state::VecState;
use supple::step::{CriticalStep, Step};
use supple::tled;

struct Ours<M> {
    scene: VecScene<M>,
    state: VecState,
    forces: [NodalForce; 4],
    step: Step,
    /// s.
    critical: f32,
}

impl<M: ElementMaterial> Ours<M> {
    fn new(scene: VecScene<M>) -> Self {
        let mut state = VecState::at_rest(scene.node_count());
        let critical = tled::critical_step(&scene, &mut state).expect("the bar has a critical step");
        let step = Step::new(DT, DAMPING, critical).expect("dt is below the critical step");
        Self { scene, state, forces: bar::forces(), step, critical: critical.seconds }
    }

    fn bound(&mut self) -> Option<CriticalStep> {
        tled::critical_step(&self.scene, &mut self.state)
    }

    fn run(&mut self, steps: usize) {
        let loads = Loads::new(&self.scene, [0.0; 3], &self.forces, &[]).expect("nodes of the bar");
        for _ in 0..steps {
            bar::moved(tled::step(&self.scene, &loads, &mut self.state, &self.step));
        }
    }
}

/// Median of the ratios of paired runs, and the median time of one step of each, s.
fn pairs(mut plain: impl FnMut(), mut ours: impl FnMut(), steps: usize) -> (f64, f64, f64) {
    let time = |run: &mut dyn FnMut()| seconds(run) / steps as f64;
    let runs: Vec<_> = (0..21).map(|_| (time(&mut plain), time(&mut ours))).collect();
    (
        median(runs.iter().map(|(plain, ours)| plain / ours).collect()),
        median(runs.iter().map(|run| run.0).collect()),
        median(runs.iter().map(|run| run.1).collect()),
    )
}

fn compare<L: ElementLaw>(criterion: &mut Criterion, name: &str, law: L, plain_law: plain::Law) {
    let bar = Bar::PAPER;
    let points: Vec<_> = bar.points().collect();
    let tets: Vec<_> = bar.tets().collect();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).expect("the bar is sound");
    let loads = bar::forces().map(|force| (force.node, force.newton));
    let fixed: Vec<u32> = HELD.collect();
    let mut plain = Plain::new(&mesh, plain_law, DENSITY, &fixed, &loads);
    let mut ours = Ours::new(bar::scene(law));
    // Both are timed in a deformed state, and must agree on it.
    (0..2_000).for_each(|_| plain.step(DT, DAMPING, 1.0));
    ours.run(2_000);
    let tip = bar.node(8, 8, 17) as usize;
    let (a, b) = (plain.u[tip], ours.state.displacements()[tip].to_array());
    let apart = (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f32::max);
    assert!(apart < 1e-5, "{name}: plain {a:?} and ours {b:?} disagree");

    let mut group = criterion.benchmark_group("step");
    group.throughput(Throughput::Elements(tets.len() as u64));
    group.bench_function(BenchmarkId::new(name, "plain"), |b| b.iter(|| plain.step(DT, DAMPING, 1.0)));
    group.bench_function(BenchmarkId::new(name, "supple"), |b| b.iter(|| ours.run(1)));
    group.bench_function(BenchmarkId::new(name, "critical step"), |b| {
        b.iter(|| tled::critical_step(&ours.scene, &mut ours.state));
    });
    group.finish();

    let (ratio, plain_s, ours_s) = pairs(|| (0..50).for_each(|_| plain.step(DT, DAMPING, 1.0)), || ours.run(50), 50);
    let before = Level::current();
    assert!(Level::force(Level::Portable), "every processor has it");
    let (portable_ratio, _, portable_s) =
        pairs(|| (0..50).for_each(|_| plain.step(DT, DAMPING, 1.0)), || ours.run(50), 50);
    assert!(Level::force(before), "it had it before");
    let (widest, baseline) = (common::peak::widest(50), common::peak::baseline(50));
    let per_tet = |seconds: f64| seconds * 1e9 / tets.len() as f64;
    let speed = tled::operations(ours.scene.view()) as f64 / ours_s * 1e-9;
    println!(
        "{name}: plain {:.1} ns/tet, supple {:.1} ns/tet = {:.0} us a step, {ratio:.2} times faster; \
         {speed:.1} GFLOP/s = {:.0} % of the {widest:.0} GFLOP/s peak ({:.0} % of {baseline:.0} without AVX); portable \
         {:.1} ns/tet, {portable_ratio:.2} times",
        per_tet(plain_s),
        per_tet(ours_s),
        ours_s * 1e6,
        100.0 * speed / widest,
        100.0 * speed / baseline,
        per_tet(portable_s),
    );
}

/// Another element compared with linear tetrahedra, both in a deformed state.
fn compare_elements<L: ElementLaw, M: ElementMaterial>(name: &str, law: L, other: impl Fn(Tissue<L>) -> M) {
    let other = bar::scene_with(other(bar::tissue(law)));
    let (mut linear, mut other) = (Ours::new(bar::scene(law)), Ours::new(other));
    linear.run(2_000);
    other.run(2_000);
    let (ratio, other_s, linear_s) = pairs(|| other.run(50), || linear.run(50), 50);
    let critical_s = median((0..11).map(|_| seconds(|| assert!(other.bound().is_some()))).collect());
    let longer = other.critical / linear.critical;
    let per_tet = |seconds: f64| seconds * 1e9 / Bar::PAPER.tets().count() as f64;
    println!(
        "{name}, {}: {:.1} ns/tet, {ratio:.2} times linear tetrahedra's {:.1}; safe step {longer:.2} times theirs, so a simulated second \
         {:.2} times; critical step as long as {:.0} steps",
        other.scene.view().element().name(),
        per_tet(other_s),
        per_tet(linear_s),
        ratio / f64::from(longer),
        critical_s / other_s,
    );
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(30);
    compare(&mut criterion, "exponential", bar::EXPONENTIAL, plain::Law::Exponential(59.0, 8.023, 60_000.0));
    compare(
        &mut criterion,
        "neo-Hookean",
        NeoHookean { c: 500.0, d: 15_000.0 },
        plain::Law::NeoHookean(500.0, 15_000.0),
    );
    let neo_hookean = NeoHookean { c: 500.0, d: 15_000.0 };
    compare_elements("exponential", bar::EXPONENTIAL, NodalPressure);
    compare_elements("neo-Hookean", neo_hookean, NodalPressure);
    compare_elements("exponential", bar::EXPONENTIAL, NodalStrain);
    compare_elements("neo-Hookean", neo_hookean, NodalStrain);
    criterion.final_summary();
}
