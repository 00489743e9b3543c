//! Time of an exact step from 6.5 thousand tetrahedra to a million, on one thread and on two, and with nodes in order,
//! shuffled, and renumbered ([`supple::mesh::renumber`]); and of a long step on one thread and on two.
//!
//! `cargo bench --bench size --features parallel` prints medians, and the least time in brackets, of runs in turn. It
//! has no criterion group: a body of that size takes seconds to prepare.

mod common {
    #[allow(dead_code)] // This bench has loads and supports of its own.
    pub(crate) mod bar;
    pub(crate) mod bent;
    pub(crate) mod pairs;
}

use common::bar;
use common::bent::Bent;
use common::pairs::{median, seconds};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::Loads;
use supple::material::Exponential;
use supple::mesh::{Bar, renumber};
use supple::step::{Rayon, Step};
use supple::tled;

const SIZES: [[u32; 3]; 5] = [[8, 8, 17], [16, 16, 32], [20, 20, 42], [32, 32, 64], [44, 44, 88]];
const ROUNDS: usize = 21;
const MULTIPLE: f32 = 20.0;
const LONG_SIZE: [u32; 3] = [20, 20, 42];
const LONG_STEPS: usize = 50;

/// A bar with its nodes and elements in some order.
struct Body {
    points: Vec<[f32; 3]>,
    tets: Vec<[u32; 4]>,
}

impl Body {
    fn in_order(cells: [u32; 3]) -> Self {
        let bar = Bar { size: [0.1, 0.1, 0.2], cells };
        Self { points: bar.points().collect(), tets: bar.tets().collect() }
    }

    fn shuffled(&self) -> Self {
        let mut state = 0x9e37_79b9_u64;
        let mut below = |count: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % count as u64) as usize
        };
        let mut new_nodes: Vec<u32> = (0..self.points.len() as u32).collect();
        (1..new_nodes.len()).rev().for_each(|last| new_nodes.swap(last, below(last + 1)));
        let mut points = self.points.clone();
        for (point, &node) in self.points.iter().zip(&new_nodes) {
            points[node as usize] = *point;
        }
        let mut tets: Vec<_> = self.tets.iter().map(|tet| tet.map(|node| new_nodes[node as usize])).collect();
        (1..tets.len()).rev().for_each(|last| tets.swap(last, below(last + 1)));
        Self { points, tets }
    }

    fn renumbered(mut self) -> Self {
        let (mut old, mut new) = (vec![0; self.points.len()], vec![0; self.points.len()]);
        renumber(&mut self.points, &mut self.tets, &mut old, &mut new).expect("a sound mesh");
        self
    }
}

/// A bent body, and how many steps are timed at once.
struct Run {
    body: Bent<Exponential>,
    steps: usize,
}

impl Run {
    fn new(Body { points, tets }: &Body) -> Self {
        let steps = (100_000 / tets.len()).max(1);
        Self { body: Bent::new(bar::EXPONENTIAL, points, tets), steps }
    }

    /// Seconds of a step.
    fn time(&mut self, parts: usize) -> f64 {
        let loads = Loads::NONE;
        let time = seconds(|| {
            for _ in 0..self.steps {
                let threads = Rayon { parts };
                let Bent { scene, state, step } = &mut self.body;
                bar::moved(tled::step_in_parts(scene.view(), &loads, state.view(), step, &threads));
            }
        });
        time / self.steps as f64
    }
}

/// Median, and least in brackets.
fn both(times: &[f64], unit: f64) -> String {
    let least = times.iter().copied().fold(f64::INFINITY, f64::min);
    format!("{:.1} ({:.1})", median(times.to_vec()) * unit, least * unit)
}

/// Times of a long step at [`MULTIPLE`] times the critical step, on one thread and on two, compared with an exact
/// one.
fn long(pool: &rayon::ThreadPool) {
    let Body { points, tets } = Body::in_order(LONG_SIZE);
    let Bent { scene, mut state, step } = Bent::new(bar::EXPONENTIAL, &points, &tets);
    let scene = scene.view();
    let mut exact_state = state.clone();
    let length = Step::unchecked(MULTIPLE * step.seconds(), step.damping()).expect("a length");
    let method = Method::new(Cells::Suggested);
    let mut large = LargeStep::prepare_in_vec(method, scene, &points, state.view(), length).expect("a bar");
    let loads = Loads::NONE;
    let (mut times, mut ratios) = ([const { Vec::new() }; 2], [const { Vec::new() }; 3]);
    pool.install(|| {
        for _ in 0..ROUNDS {
            let mut of = |parts| {
                let mut step = || {
                    bar::moved(large.step_in_parts(scene, &loads, state.view(), &Rayon { parts }));
                };
                seconds(|| (0..LONG_STEPS).for_each(|_| step())) / LONG_STEPS as f64
            };
            let [one, two] = [of(1), of(2)];
            let mut of = |parts| {
                let mut exact = || {
                    let view = exact_state.view();
                    bar::moved(tled::step_in_parts(scene, &loads, view, &step, &Rayon { parts }));
                };
                seconds(|| (0..LONG_STEPS).for_each(|_| exact())) / LONG_STEPS as f64
            };
            let [plain, plain_two] = [of(1), of(2)];
            times.iter_mut().zip([one, two]).for_each(|(times, time)| times.push(time));
            let round = [one / two, plain / plain_two, one / plain];
            ratios.iter_mut().zip(round).for_each(|(ratios, ratio)| ratios.push(ratio));
        }
    });
    let [one, two] = times.map(|times| both(&times, 1e6));
    let [ratio, exact, cost] = ratios.map(median);
    println!(
        "{} tetrahedra, long steps at {MULTIPLE} times the critical step: {one} us on one thread, {cost:.2} times an exact \
         step; {two} us on two threads, {ratio:.2} times faster (an exact step {exact:.2} times)",
        tets.len()
    );
}

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("two threads");
    println!("tetrahedra | ns/tet in order | shuffled | renumbered | two threads, ns/tet | times faster");
    for cells in SIZES {
        let body = Body::in_order(cells);
        let shuffled = body.shuffled();
        let unit = 1e9 / body.tets.len() as f64;
        let mut in_order = Run::new(&body);
        let mut shuffled_run = Run::new(&shuffled);
        let mut renumbered = Run::new(&shuffled.renumbered());
        let mut times = [const { Vec::new() }; 4];
        let mut ratios = Vec::new();
        pool.install(|| {
            for _ in 0..ROUNDS {
                let [one, two] = [1, 2].map(|parts| in_order.time(parts));
                ratios.push(one / two);
                let round = [one, shuffled_run.time(1), renumbered.time(1), two];
                times.iter_mut().zip(round).for_each(|(times, time)| times.push(time));
            }
        });
        let [in_order, shuffled, renumbered, two] = times.map(|times| both(&times, unit));
        println!("{} | {in_order} | {shuffled} | {renumbered} | {two} | {:.2}", body.tets.len(), median(ratios));
    }
    long(&pool);
}
