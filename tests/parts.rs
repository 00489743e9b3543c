//! A step in parts, wherever and in whatever order they run, gives the bits of the step in one; and all parts together compute
//! the forces of every element once.

mod reference;
mod support;

#[path = "support/networks.rs"]
mod networks;

use std::sync::atomic::{AtomicUsize, Ordering};

use networks::{Memory, described, numbers};
use supple::loads::{Loads, Motion};
use supple::mlp::{ForceInput, Network, Range, write};
use supple::scene::{Axes, Support};
use supple::surrogate::{self, Surrogate, Vertex};
use supple::threads::{MOST_PARTS, Threads};
use supple::tled::{self, Status, Step};
use support::bodies::{corner_torsion, held};
use support::{Body, EXP, Judged, bits, displaced, largest, largest_distance, rest_of, tissue, widened};

const DT: f32 = 2e-5;

/// Each part on a thread of its own, the last one first; counts them.
struct Backwards {
    parts: usize,
    most: AtomicUsize,
}

impl Threads for Backwards {
    fn parts(&self) -> usize {
        self.parts
    }

    fn each<T: Send>(&self, parts: &mut [T], work: impl Fn(&mut T) + Sync) {
        self.most.fetch_max(parts.len(), Ordering::Relaxed);
        let work = &work;
        std::thread::scope(|scope| {
            for part in parts.iter_mut().rev() {
                scope.spawn(move || work(part));
            }
        });
    }
}

fn taken(status: Status) {
    assert!(matches!(status, Status::Ok | Status::Limited { .. }), "{status:?}");
}

/// 13,200 elements: as many chunks as there can be parts.
fn body() -> Body {
    Body::bar([0.1, 0.1, 0.22], [10, 10, 22])
}

/// The same body with its nodes numbered and its elements listed as if by chance: nearly all elements reach from chunk to chunk.
fn shuffled() -> Body {
    let mut body = body();
    let mut random = numbers(7);
    let mut shuffle = |numbers: &mut [u32]| {
        for last in (1..numbers.len()).rev() {
            numbers.swap(last, (random().abs() * last as f32) as usize);
        }
    };
    let mut numbers: Vec<u32> = (0..body.points.len() as u32).collect();
    shuffle(&mut numbers);
    let mut points = body.points.clone();
    for (point, &number) in body.points.iter().zip(&numbers) {
        points[number as usize] = *point;
    }
    let mut order: Vec<u32> = (0..body.tets.len() as u32).collect();
    shuffle(&mut order);
    body.tets = order.iter().map(|&tet| body.tets[tet as usize].map(|node| numbers[node as usize])).collect();
    body.points = points;
    body
}

fn wave([x, y, z]: [f32; 3]) -> [f32; 3] {
    [0.02 * (40.0 * z).sin() * y, 0.05 * z * x, 0.3 * x * z]
}

/// Bits of the state after 30 exact steps under gravity, forces and a moved node.
fn exact(body: &Body, threads: &impl Threads) -> Vec<u64> {
    let far = body.farthest(2);
    let mut supports = held(body);
    supports.push(Support::moved(far));
    let scene = body.scene(tissue(EXP), &supports);
    let forces = corner_torsion(body, 0.2, 0.0);
    let motions = [Motion { node: far, axes: Axes::XYZ, metre: [1e-3, 0.0, 2e-3], ramp: 1e-3 }];
    let loads = Loads::new(&scene, [0.0, -9.81, 0.0], &forces, &motions).unwrap();
    let mut state = rest_of(&scene);
    let step = Step::insist(DT, 20.0).unwrap();
    for _ in 0..30 {
        taken(tled::step_in_parts(&scene, &loads, &mut state, &step, threads));
    }
    let mut all = bits(&state);
    all.push(state.ledger().kinetic.to_bits());
    all
}

/// The same after 10 learned steps, with what the last one reported.
fn learned(body: &Body, threads: &impl Threads) -> Vec<u64> {
    let scene = body.scene(tissue(EXP), &held(body));
    let forces = corner_torsion(body, 0.2, 0.0);
    let loads = Loads::new(&scene, [0.0, -9.81, 0.0], &forces, &[]).unwrap();
    let mut description = described(&[7, 24, 16, 3], &[10, 12, 3], 3);
    description.force = ForceInput::PerMass;
    for (input, scale) in description.inputs.iter_mut().zip([1e-3, 1e-3, 1e-3, 0.05, 50.0, 50.0, 50.0]) {
        *input = Range { scale, least: -scale, most: scale };
    }
    for output in &mut description.outputs {
        *output = Range { scale: 2.0, least: -3.0, most: 2.0 };
    }
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let mut surrogate = Surrogate::over(network, vec![Vertex::NEW; body.points.len()]).unwrap();
    // A bent body: a network that knows nothing may move it as far as its energy allows.
    let mut state = rest_of(&scene);
    let step = Step::insist(description.step, description.damping).unwrap();
    assert!(tled::start(&scene, &mut state, &step, |node| (wave(body.points[node]), [0.0; 3])));
    for _ in 0..10 {
        taken(surrogate::step_in_parts(&scene, &loads, &mut state, &mut surrogate, threads));
    }
    let report = surrogate.report();
    assert!(report.outside > 0.0 && report.outside < 1.0, "{report:?}");
    let mut all = bits(&state);
    all.extend([report.clipped, report.outside].map(|share| u64::from(share.to_bits())));
    all
}

#[test]
fn any_number_of_parts_gives_the_same_bits() {
    for (name, body) in [("in order", body()), ("shuffled", shuffled())] {
        let alone = Backwards { parts: 1, most: AtomicUsize::new(0) };
        let (exact_alone, learned_alone) = (exact(&body, &alone), learned(&body, &alone));
        for parts in [2, 3, 5, 8, 100] {
            let threads = Backwards { parts, most: AtomicUsize::new(0) };
            assert!(exact(&body, &threads) == exact_alone, "{name}: {parts} parts of an exact step");
            assert!(learned(&body, &threads) == learned_alone, "{name}: {parts} parts of a learned step");
            assert_eq!(threads.most.into_inner(), parts.min(MOST_PARTS), "{name}");
        }
    }
}

#[cfg(feature = "parallel")]
#[test]
fn threads_of_rayon_give_the_same_bits() {
    let body = body();
    let alone = Backwards { parts: 1, most: AtomicUsize::new(0) };
    let (exact_alone, learned_alone) = (exact(&body, &alone), learned(&body, &alone));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    for parts in [1, 2, 3, 8] {
        let rayon = supple::threads::Rayon { parts };
        pool.install(|| {
            assert!(exact(&body, &rayon) == exact_alone, "{parts} parts of an exact step");
            assert!(learned(&body, &rayon) == learned_alone, "{parts} parts of a learned step");
        });
    }
}

#[test]
fn forces_are_those_of_the_reference_however_nodes_are_numbered() {
    for (name, body) in [("in order", body()), ("shuffled", shuffled())] {
        let scene = body.scene(tissue(EXP), &held(&body));
        let displacements: Vec<_> = body.points.iter().map(|&x| wave(x)).collect();
        let expected =
            reference::internal_force(&body.reference(), &EXP.reference(), &widened(&displacements));
        let mut state = displaced(&scene, &displacements);
        let loads = Loads::new(&scene, [0.0; 3], &[], &[]).unwrap();
        let step = Step::insist(1e-6, 0.0).unwrap();
        let threads = Backwards { parts: 3, most: AtomicUsize::new(0) };
        let _ = tled::step_in_parts(&scene, &loads, &mut state, &step, &threads);
        let forces: Vec<_> = support::to_f64(state.forces()).iter().map(|f| f.map(|f| -f)).collect();
        let off = largest_distance(&forces, &expected) / largest(&expected);
        println!("{name}: forces are off by {off:.1e} of the largest");
        assert!(off < 1e-5);
    }
}
