//! What a processor computes with each kind of step, as a checksum of the bits: on a small bar, the same everywhere. Every
//! number is made by the core, none by a standard library, which is another one on another system.
#![no_std]

use supple::inertia::{self, Damper, Inertia, LatticeNode, damped_numbers_for, damped_vectors_for};
use supple::lanes::Level;
use supple::loads::{Loads, NodalForce};
use supple::material::{Exponential, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::Network;
use supple::scene::{FixedScene, Support, blocks_for};
use supple::state::{FixedState, NodeVector};
use supple::surrogate::{self, Surrogate, Vertex};
use supple::tled::{self, Status, Step};

const BAR: Bar = Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 4] };
const NODES: usize = BAR.node_count();
const ELEMENTS: usize = BAR.element_count();
/// Nodes of the bar's lower end.
const FIXED: usize = 12;
/// Cells of the lattice, and functions at their corners.
const CELLS: [u32; 3] = [1, 1, 3];
const FUNCTIONS: usize = 16;
/// Vertices that go through a network: enough for activations all over their range.
const ROWS: usize = 250;
/// The exact step, s: a tenth of the network's.
const SECONDS: f32 = 3e-5;

type Scene = FixedScene<Tissue<Exponential>, NODES, { blocks_for(ELEMENTS) }>;
type State = FixedState<NODES>;

/// A file at a multiple of 64 bytes, where networks may lie.
#[repr(C, align(64))]
struct Aligned<T: ?Sized>(T);

static NETWORK: &Aligned<[u8]> = &Aligned(*include_bytes!("../../../weights/compact-10.weights"));
static INT8: &Aligned<[u8]> = &Aligned(*include_bytes!("../../data/golden-v3.weights"));
static DAMPER: &Aligned<[u8]> = &Aligned(*include_bytes!("../../../weights/damper.weights"));

/// What is computed.
pub const NAMES: [&str; 5] = ["exact", "damped", "network", "learned", "int8"];

/// Whether its sums may be fused: those of networks with layers of eight bits never are.
pub fn may_fuse(what: usize) -> bool {
    what != 4
}

/// Its checksum with the instructions of `level`; zero if it could not be computed.
pub fn checksum(what: usize, level: Level) -> u32 {
    if !Level::force(level) {
        return 0;
    }
    let checksum = match what {
        0 => exact(2_000).map(|(_, state)| of_state(&state)),
        1 => damped(),
        2 => network(&NETWORK.0),
        3 => learned(),
        _ => network(&INT8.0),
    };
    checksum.unwrap_or(0)
}

/// Whether this was built with the vectors of WebAssembly.
#[unsafe(no_mangle)]
pub extern "C" fn has_simd128() -> bool {
    Level::force(Level::Simd128)
}

/// [`checksum`] for a web page: level 0 is the portable one.
#[unsafe(no_mangle)]
pub extern "C" fn web_checksum(what: u32, level: u32) -> u32 {
    checksum(what as usize, if level == 0 { Level::Portable } else { Level::Simd128 })
}

/// FNV-1a over the bits.
fn of(numbers: impl Iterator<Item = f32>) -> u32 {
    numbers.fold(0x811c_9dc5, |hash, number| (hash ^ number.to_bits()).wrapping_mul(0x0100_0193))
}

fn of_state(state: &State) -> u32 {
    of(state.displacements().iter().flat_map(|displacement| displacement.to_array()))
}

fn points() -> [[f32; 3]; NODES] {
    let mut points = [[0.0; 3]; NODES];
    for (point, of_bar) in points.iter_mut().zip(BAR.points()) {
        *point = of_bar;
    }
    points
}

fn scene() -> Option<Scene> {
    let mut tets = [[0; 4]; ELEMENTS];
    for (tet, of_bar) in tets.iter_mut().zip(BAR.tets()) {
        *tet = of_bar;
    }
    let mut fixed = [Support::fixed(0); FIXED];
    for (node, support) in (0..).zip(&mut fixed) {
        support.node = node;
    }
    let law = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
    let mut scene = Scene::new(Tissue { law, density: 1000.0 });
    scene.build(&Mesh::new(&points(), &tets, Winding::Checked).ok()?, &fixed).ok()?;
    Some(scene)
}

const FORCES: [NodalForce; 1] =
    [NodalForce { node: BAR.node(0, 2, 4), newton: [0.02, -0.03, 0.05], ramp: 0.05 }];
const GRAVITY: [f32; 3] = [0.0, 0.0, -9.81];

/// After some exact steps.
fn exact(steps: u32) -> Option<(Scene, State)> {
    let (scene, mut state) = (scene()?, State::new());
    let loads = Loads::new(&scene, GRAVITY, &FORCES, &[]).ok()?;
    let step = Step::insist(SECONDS, 20.0).ok()?;
    for _ in 0..steps {
        if tled::step(&scene, &loads, &mut state, &step) != Status::Ok {
            return None;
        }
    }
    Some((scene, state))
}

/// Large steps, with a lattice and a network that damps.
fn damped() -> Option<u32> {
    let (scene, mut state) = (scene()?, State::new());
    let loads = Loads::new(&scene, GRAVITY, &FORCES, &[]).ok()?;
    let damper = Damper::over(Network::parse(&DAMPER.0).ok()?).ok()?;
    let mut inertia = Inertia::over(
        [NodeVector::ZERO; damped_vectors_for(NODES)],
        [LatticeNode::EMPTY; NODES],
        [0.0; damped_numbers_for(CELLS, FUNCTIONS)],
    )
    .damped();
    let step = Step::insist(20.0 * SECONDS, 20.0).ok()?;
    inertia.prepare(&scene, &points(), &mut state, step, CELLS).ok()?;
    for _ in 0..300 {
        if let Status::Diverged(_) =
            inertia::damped_step(&scene, &loads, &mut state, &mut inertia, Some(&damper))
        {
            return None;
        }
    }
    Some(of_state(&state))
}

/// Numbers that are unlike each other, and some that are no ordinary ones, through a network.
fn network(file: &[u8]) -> Option<u32> {
    let network = Network::parse(file).ok()?;
    let mut inputs = [0.0; 7 * ROWS];
    let mut seed = 8u32;
    for (at, input) in inputs.iter_mut().enumerate() {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let scale = network.inputs().get(at % 7)?.scale;
        *input = 2.0 * scale * ((seed >> 8) as f32 / 8_388_608.0 - 1.0);
    }
    for (at, number) in [(0, f32::NAN), (10, f32::INFINITY), (20, -0.0), (30, f32::MIN_POSITIVE / 8.0)] {
        *inputs.get_mut(at)? = number;
    }
    let mut outputs = [0.0; 3 * ROWS];
    network.predict_rows(&inputs, &mut outputs);
    Some(of(outputs.into_iter()))
}

/// Learned steps that go on from exact ones.
fn learned() -> Option<u32> {
    let mut surrogate = Surrogate::over(Network::parse(&NETWORK.0).ok()?, [Vertex::NEW; NODES]).ok()?;
    let (_, before) = exact(1_000)?;
    let (scene, mut state) = exact(1_010)?;
    let loads = Loads::new(&scene, GRAVITY, &FORCES, &[]).ok()?;
    let mut earlier = [NodeVector::ZERO; NODES];
    for (earlier, displacement) in earlier.iter_mut().zip(before.displacements()) {
        *earlier = *displacement;
    }
    state.span(&earlier, surrogate.seconds());
    surrogate.follow(&state);
    for _ in 0..50 {
        // Where a step is refused is among what has to be the same.
        if let Status::Diverged(_) = surrogate::step(&scene, &loads, &mut state, &mut surrogate) {
            break;
        }
    }
    (state.steps() >= 1_010 + 30).then(|| of_state(&state) ^ state.steps() as u32)
}
