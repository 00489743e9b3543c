//! Time of the element forces alone, by law and by size, beside the whole step.
//!
//! `cargo bench --bench forces` prints criterion's figures for the paper's bar, then for bars from 6.5 to 100 thousand
//! tetrahedra medians of runs in turn, the share of the machine's peak as measured in between, and the share of the step.

mod common {
    #[allow(dead_code)] // This bench has bars, loads and supports of its own.
    pub(crate) mod bar;
    pub(crate) mod pairs;
    pub(crate) mod peak;
}

use common::bar::{self, BarScene, DAMPING, HostState};
use common::pairs::{median, seconds};
use criterion::{Criterion, Throughput};
use supple::loads::Loads;
use supple::material::{Law, NeoHookean};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::tled::{self, Step};

const SIZES: [[u32; 3]; 3] = [[8, 8, 17], [16, 16, 32], [20, 20, 42]];
const ROUNDS: usize = 41;

/// A bent bar, in which no number is denormal.
struct Bent<L> {
    scene: BarScene<L>,
    state: HostState,
    step: Step,
}

impl<L: Law> Bent<L> {
    fn new(law: L, cells: [u32; 3]) -> Self {
        let bar = Bar { size: [0.1, 0.1, 0.2], cells };
        let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
        let held = points.iter().enumerate().filter(|(_, point)| point[2] == 0.0);
        let held: Vec<_> = held.map(|(node, _)| Support::fixed(node as u32)).collect();
        let scene = bar::scene_of(law, &points, &tets, &held);
        let mut state = bar::state(points.len());
        let critical = tled::critical_step(&scene, &mut state).expect("the bar has a critical step");
        let step = Step::new(critical.seconds, DAMPING, critical).expect("that step");
        let bent = |node: usize| {
            let [x, y, z] = points[node];
            ([0.01 * z * y, 0.001 * (30.0 * x).sin() * z, -0.01 * z * x], [0.0; 3])
        };
        assert!(tled::start(&scene, &mut state, &step, bent));
        Self { scene, state, step }
    }

    fn forces(&mut self) {
        assert!(tled::internal_forces(&self.scene, &mut self.state));
    }

    fn step(&mut self) {
        bar::moved(tled::step(&self.scene, &Loads::NONE, &mut self.state, &self.step));
    }
}

fn measure<L: Law>(criterion: &mut Criterion, name: &str, law: L) {
    let mut group = criterion.benchmark_group("element forces");
    let mut paper = Bent::new(law, SIZES[0]);
    group.throughput(Throughput::Elements(paper.scene.element_count() as u64));
    group.bench_function(name, |b| b.iter(|| paper.forces()));
    group.finish();

    for cells in SIZES {
        let mut body = Bent::new(law, cells);
        let elements = body.scene.element_count() as f64;
        let times = (200_000.0 / elements).ceil() as usize;
        let (mut ns, mut of_step, mut shares) = (Vec::new(), Vec::new(), Vec::new());
        let flops = tled::element_operations(&body.scene) as f64;
        for _ in 0..ROUNDS {
            let before = common::peak::widest(2);
            let forces = seconds(|| (0..times).for_each(|_| body.forces())) / times as f64;
            let step = seconds(|| (0..times).for_each(|_| body.step())) / times as f64;
            let peak = 0.5e9 * (before + common::peak::widest(2));
            ns.push(1e9 * forces / elements);
            of_step.push(forces / step);
            shares.push(flops / forces / peak);
        }
        println!(
            "{name}, {elements} tetrahedra: {:.1} ns/tet, {:.0} % of the machine's peak, {:.0} % of the step",
            median(ns),
            100.0 * median(shares),
            100.0 * median(of_step),
        );
    }
}

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(30);
    measure(&mut criterion, "neo-Hookean", NeoHookean { c: 500.0, d: 15_000.0 });
    measure(&mut criterion, "exponential", bar::EXPONENTIAL);
    criterion.final_summary();
}
