//! The hot loops, for counting their instructions: `instructions LOOP TIMES` runs one of them so often. The difference
//! between two counts is the loop's alone. Counts do not depend on how busy the machine is, so that they can guard
//! against a loop that has become slower (`tools/instructions.sh`).

mod common {
    pub(crate) mod bar;
    pub(crate) mod long;
    pub(crate) mod vertices;
}

use std::hint::black_box;
use std::process::ExitCode;

use common::bar::{self, DAMPING, DT, EXPONENTIAL, moved};
use common::long::long;
use common::vertices::{ROWS, vertices};
use supple::element::ElementMaterial;
use supple::learned::{LearnedStep, vectors_for};
use supple::loads::Loads;
use supple::material::{NeoHookean, NodalPressure, NodalStrain};
use supple::mlp::{Network, WeightBytes};
use supple::scene::VecScene;
use supple::simd::Level;
use supple::state::{NodeVector, VecState};
use supple::step::Step;
use supple::tled;

const COMPACT: &[u8] = include_bytes!("../weights/compact-10.weights");
/// Small, with int8 layers.
const INT8: &[u8] = include_bytes!("../tests/data/golden-v3.weights");

fn exact<M: ElementMaterial>(scene: &VecScene<M>, times: u32) {
    let forces = bar::forces();
    let loads = Loads::new(scene, [0.0; 3], &forces, &[]).expect("nodes of the bar");
    let mut state = VecState::at_rest(scene.node_count());
    let step = Step::unchecked(DT, DAMPING).expect("a positive step");
    // In the first step, which is not counted, elements with nodal strain are all looked at.
    (0..=times).for_each(|_| moved(tled::step(scene, &loads, &mut state, &step)));
}

/// 64 steps each time, with renewals of the lattice's inertia among them.
fn large(times: u32) {
    let (points, forces, scene) = (bar::points(), bar::forces(), bar::scene(EXPONENTIAL));
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).expect("nodes of the bar");
    let mut run = long(&scene, &loads, &points, 20.0);
    (0..64 * times).for_each(|_| run());
}

fn forward(bytes: &[u8], times: u32) {
    let bytes = WeightBytes::of(bytes);
    let network = Network::parse(bytes.bytes()).expect("a weight file of the crate");
    let inputs = vertices(&network);
    let mut outputs = vec![0.0; ROWS * network.outputs().len()];
    (0..times).for_each(|_| network.predict_rows(black_box(&inputs), &mut outputs));
}

fn learned(times: u32) {
    let bytes = WeightBytes::of(COMPACT);
    let network = Network::parse(bytes.bytes()).expect("a weight file of the crate");
    let (scene, forces) = (bar::scene(EXPONENTIAL), bar::forces());
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).expect("nodes of the bar");
    let nodes = scene.node_count();
    let (mut state, storage) = (VecState::at_rest(nodes), vec![NodeVector::ZERO; vectors_for(nodes, false)]);
    let mut learned = LearnedStep::new(network, false, storage).expect("a network of the learned step");
    let exact = Step::unchecked(DT, DAMPING).expect("a positive step");
    for _ in 0..times {
        let status = learned.step(scene.view(), &loads, state.view(), &exact);
        moved(status.expect("it goes on from rest"));
    }
}

fn main() -> ExitCode {
    let lattice = std::env::args().any(|argument| argument == "long");
    // Every processor that is worth guarding has AVX2. Steps with a lattice are counted in portable code: their scalar
    // remainders hold VMOVQ between registers, which valgrind 3.19 (Debian 12) does not know.
    if !Level::force(if lattice { Level::Portable } else { Level::Avx2 }) {
        eprintln!("this processor lacks AVX2, for which the counts are kept");
        return ExitCode::FAILURE;
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, times] = arguments.as_slice() else {
        println!("exponential neo-hookean nodal-pressure nodal-strain long compact int8 learned");
        return ExitCode::SUCCESS;
    };
    let Ok(times) = times.parse() else {
        eprintln!("{times} is not a count");
        return ExitCode::FAILURE;
    };
    match name.as_str() {
        "exponential" => exact(&bar::scene(EXPONENTIAL), times),
        "neo-hookean" => exact(&bar::scene(NeoHookean { c: 500.0, d: 15_000.0 }), times),
        "nodal-pressure" => exact(&bar::scene_with(NodalPressure(bar::tissue(EXPONENTIAL))), times),
        "nodal-strain" => exact(&bar::scene_with(NodalStrain(bar::tissue(EXPONENTIAL))), times),
        "long" => large(times),
        "compact" => forward(COMPACT, times),
        "int8" => forward(INT8, times),
        "learned" => learned(times),
        _ => {
            eprintln!("there is no loop {name}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
