//! The same input gives the same bits, whatever instructions the processor offers, with the feature `deterministic`: sums are
//! taken in a fixed order, and nothing is fused. Without it levels differ by rounding, and two runs at one level by nothing.
//! Networks with layers of eight bits give the same bits either way.

use std::sync::Mutex;

#[path = "support/networks.rs"]
mod networks;

use networks::{Memory, described, int8, numbers};
use supple::inertia::{self, Inertia, LatticeNode, numbers_for, vectors_for};
use supple::lanes::Level;
use supple::loads::{Loads, NodalForce};
use supple::material::{Exponential, Law, Literal, NeoHookean, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::{Network, write, write_int8};
use supple::scene::{ElementBlock, NodeInertia, Scene, Support, blocks_for};
use supple::state::{NodeVector, State};
use supple::tled::{self, CriticalStep, Status, Step};

type HostScene<L> = Scene<Tissue<L>, Vec<NodeInertia>, Vec<ElementBlock>>;
type Bits = (CriticalStep, Vec<[u32; 3]>);

const BAR: Bar = Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 4] };

fn scene<L: Law>(law: L, points: &[[f32; 3]]) -> HostScene<L> {
    let tets: Vec<_> = BAR.tets().collect();
    let mesh = Mesh::new(points, &tets, Winding::Checked).unwrap();
    let nodes = vec![NodeInertia::EMPTY; points.len()];
    let blocks = vec![ElementBlock::EMPTY; blocks_for(tets.len())];
    let mut scene = Scene::over(Tissue { law, density: 1000.0 }, nodes, blocks);
    let fixed: Vec<_> = (0..12).map(Support::fixed).collect();
    scene.build(&mesh, &fixed).unwrap();
    scene
}

/// The displacements after steps of 50 us: the exact ones, or `multiple` times as long with a lattice of `cells`.
fn run<L: Law>(law: L, level: Level, scaled: Option<(f32, [u32; 3])>) -> Bits {
    assert!(Level::force(level), "this processor lacks {level:?}");
    let points: Vec<_> = BAR.points().collect();
    let scene = scene(law, &points);
    let zero = || vec![NodeVector::ZERO; points.len()];
    let mut state = State::over(zero(), zero(), zero());
    let force = NodalForce { node: BAR.node(0, 2, 4), newton: [0.02, -0.03, 0.05], ramp: 0.05 };
    let forces = [force];
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &forces, &[]).unwrap();
    let mut estimate = 0.0;
    if let Some((multiple, cells)) = scaled {
        let functions = inertia::lattice_functions(&scene, &points, cells).unwrap_or(0);
        let mut inertia = Inertia::over(
            vec![NodeVector::ZERO; vectors_for(points.len())],
            vec![LatticeNode::EMPTY; points.len()],
            vec![0.0; numbers_for(cells, functions)],
        );
        let step = Step::insist(multiple * 5e-5, 10.0).unwrap();
        inertia.prepare(&scene, &points, &mut state, step, cells).unwrap();
        for _ in 0..400 {
            let status = inertia::step(&scene, &loads, &mut state, &mut inertia);
            // Where a step is refused is among what has to be the same.
            if let Status::Diverged(divergence) = status {
                println!("after {} steps: {divergence}", state.steps());
                break;
            }
        }
        assert!(state.steps() > 10);
        assert!(inertia.report().added_mean > 0.0);
        estimate = inertia.report().error;
        assert!(estimate > 0.0);
    } else {
        let step = Step::insist(5e-5, 10.0).unwrap();
        for _ in 0..2_000 {
            assert_eq!(tled::step(&scene, &loads, &mut state, &step), Status::Ok);
        }
    }
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let mut bits: Vec<_> = state.displacements().iter().map(|u| u.to_array().map(f32::to_bits)).collect();
    bits.push([estimate.to_bits(); 3]);
    (critical, bits)
}

/// The largest distance between two nodes along an axis, m.
fn apart((_, a): &Bits, (_, b): &Bits) -> f32 {
    // What stands behind the nodes is no displacement.
    let nodes = a.len() - 1;
    let pairs = a.as_flattened().iter().zip(b.as_flattened()).take(3 * nodes);
    pairs.fold(0.0, |most, (a, b)| most.max((f32::from_bits(*a) - f32::from_bits(*b)).abs()))
}

fn compare<L: Law>(name: &str, law: L) {
    // The exact step, mass scaling and a lattice, whose refresh has gone round a dozen times.
    for scaled in [None, Some((20.0, [0; 3])), Some((20.0, [1, 1, 3]))] {
        let portable = run(law, Level::Portable, scaled);
        assert!(portable.1.iter().flatten().any(|bits| f32::from_bits(*bits).abs() > 1e-3), "nothing moved");
        for level in Level::available() {
            let other = run(law, level, scaled);
            println!(
                "{name}, {scaled:?}: portable and {level:?} are {:.1e} m apart",
                apart(&portable, &other)
            );
            if cfg!(feature = "deterministic") {
                assert_eq!(portable, other, "{name}, {scaled:?}: portable and {level:?} differ");
            } else {
                assert!(apart(&portable, &other) < 1e-6);
            }
            assert_eq!(other, run(law, level, scaled), "{name}, {scaled:?}: two runs differ");
        }
    }
}

/// One test at a time: the level is the whole process's.
static LEVEL: Mutex<()> = Mutex::new(());

#[test]
fn levels_differ_by_rounding_or_not_at_all() {
    let _alone = LEVEL.lock().unwrap();
    compare("neo-Hookean", NeoHookean { c: 500.0, d: 15_000.0 });
    compare("exponential", Exponential { a: 59.0, b: 8.023, d: 60_000.0 });
    compare("exponential, literal", Literal(Exponential { a: 59.0, b: 8.023, d: 60_000.0 }));
}

/// Of different levels within rounding, and with the feature `deterministic` the same bits.
#[test]
fn networks_are_within_rounding_or_the_same_bits() {
    let _alone = LEVEL.lock().unwrap();
    let description = described(&[7, 40, 24, 3], &[10, 16, 3], 5);
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let mut next = numbers(8);
    let inputs: Vec<f32> = (0..7 * 50).map(|at| 2.0 * description.inputs[at % 7].scale * next()).collect();
    let predicted = |level: Level| {
        assert!(Level::force(level));
        let mut outputs = vec![0.0f32; 3 * 50];
        network.predict_rows(&inputs, &mut outputs);
        outputs
    };
    let portable = predicted(Level::Portable);
    let largest = portable.iter().fold(0.0, |most: f32, a| most.max(a.abs()));
    for level in Level::available() {
        let other = predicted(level);
        let apart = portable.iter().zip(&other).fold(0.0, |most: f32, (a, b)| most.max((a - b).abs()));
        println!("portable and {level:?}: {apart:.1e} of {largest:.1} apart");
        assert!(apart <= if cfg!(feature = "deterministic") { 0.0 } else { 1e-6 * largest });
    }
}

/// With the feature `deterministic` and without: such a network fuses nothing, also in its layers of float32.
#[test]
fn networks_with_layers_of_eight_bits_are_the_same_bits() {
    let _alone = LEVEL.lock().unwrap();
    let description = described(&[7, 40, 33, 24, 3], &[10, 16, 3], 5);
    for which in [0b0000_0001, 0b0000_0110, 0b0001_0000, 0b0011_1111] {
        let numbers_of_layers = int8(&description, |layer| which >> layer & 1 == 1, 6);
        let memory = Memory::of(&write_int8(&description, &numbers_of_layers).unwrap());
        let network = Network::parse(memory.bytes()).unwrap();
        let mut next = numbers(8);
        let inputs: Vec<f32> =
            (0..7 * 50).map(|at| 2.0 * description.inputs[at % 7].scale * next()).collect();
        let mut alone = vec![0.0f32; 3 * 50];
        for (inputs, outputs) in inputs.chunks(7).zip(alone.chunks_mut(3)) {
            network.predict(inputs, outputs);
        }
        assert!(alone.windows(4).any(|pair| pair[0] != pair[3]), "the same for all inputs");
        for level in Level::available() {
            assert!(Level::force(level));
            let mut together = vec![0.0f32; 3 * 50];
            network.predict_rows(&inputs, &mut together);
            let differ = alone.iter().zip(&together).any(|(a, b)| a.to_bits() != b.to_bits());
            assert!(!differ, "layers {which:b}, {level:?}");
        }
    }
}
