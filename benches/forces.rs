//! Time of the element forces alone, by law and by size, compared with the whole step.
//!
//! `cargo bench --bench forces` prints criterion's figures for the paper's bar, then for bars from 6.5 to 100 thousand
//! tetrahedra medians of runs in turn, the share of the machine's peak as measured in between, and the share of the
//! step.

mod common {
    #[allow(dead_code)] // This bench has bars, loads and supports of its own.
    pub(crate) mod bar;
    pub(crate) mod bent;
    pub(crate) mod pairs;
    pub(crate) mod peak;
}

use common::bar;
use common::bent::Bent;
use common::pairs::{median, seconds};
use criterion::{Criterion, Throughput};
use supple::element::ElementLaw;
use supple::loads::Loads;
use supple::material::NeoHookean;
use supple::mesh::Bar;
use supple::tled;

const SIZES: [[u32; 3]; 3] = [[8, 8, 17], [16, 16, 32], [20, 20, 42]];
const ROUNDS: usize = 41;

fn forces<L: ElementLaw>(body: &mut Bent<L>) {
    assert!(tled::internal_forces(&body.scene, &mut body.state));
}

fn step<L: ElementLaw>(body: &mut Bent<L>) {
    bar::moved(tled::step(&body.scene, &Loads::NONE, &mut body.state, &body.step));
}

fn bent<L: ElementLaw>(law: L, cells: [u32; 3]) -> Bent<L> {
    let bar = Bar { size: [0.1, 0.1, 0.2], cells };
    Bent::new(law, &bar.points().collect::<Vec<_>>(), &bar.tets().collect::<Vec<_>>())
}

fn measure<L: ElementLaw>(criterion: &mut Criterion, name: &str, law: L) {
    let mut group = criterion.benchmark_group("element forces");
    let mut paper = bent(law, SIZES[0]);
    group.throughput(Throughput::Elements(paper.scene.element_count() as u64));
    group.bench_function(name, |b| b.iter(|| forces(&mut paper)));
    group.finish();

    for cells in SIZES {
        let mut body = bent(law, cells);
        let elements = body.scene.element_count() as f64;
        let times = (200_000.0 / elements).ceil() as usize;
        let (mut ns, mut of_step, mut shares) = (Vec::new(), Vec::new(), Vec::new());
        let flops = tled::element_operations(body.scene.view()) as f64;
        for _ in 0..ROUNDS {
            let before = common::peak::widest(2);
            let of_forces = seconds(|| (0..times).for_each(|_| forces(&mut body))) / times as f64;
            let of_whole = seconds(|| (0..times).for_each(|_| step(&mut body))) / times as f64;
            let peak = 0.5e9 * (before + common::peak::widest(2));
            ns.push(1e9 * of_forces / elements);
            of_step.push(of_forces / of_whole);
            shares.push(flops / of_forces / peak);
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
