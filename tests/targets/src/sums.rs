//! What a processor computes with each kind of step, as a checksum of the bits: on small bars, the same everywhere.
//! Only the core computes, no standard library, which differs between systems.

use super::body::{Body, DAMPING, SECONDS, TISSUE};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::NodalForce;
use supple::material::{NodalPressure, NodalStrain};
use supple::mesh::Bar;
use supple::mlp::Network;
use supple::scene::{AsScene, patch_rows_for, tiles_for};
pub use supple::simd::Level;
use supple::state::{FixedState, NodeVector};
use supple::step::Step;
use supple::tled::critical_step;

const BAR: Bar = Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 4] };
const NODES: usize = BAR.node_count();
const ELEMENTS: usize = BAR.element_count();
const SMALL: Body<NODES, ELEMENTS, { tiles_for(ELEMENTS) }> = Body {
    bar: BAR,
    fixed: 12,
    force: [NodalForce { node: BAR.node(0, 2, 4), newton: [0.02, -0.03, 0.05], ramp: 0.05 }],
};
const ROWS_OF_PATCHES: usize = patch_rows_for(NODES, ELEMENTS, 1);
/// As large as a microcontroller is for.
const LONG_BAR: Bar = Bar { size: [0.03, 0.03, 0.12], cells: [3, 3, 12] };
const LONG_NODES: usize = LONG_BAR.node_count();
const LONG_ELEMENTS: usize = LONG_BAR.element_count();
const LONG: Body<LONG_NODES, LONG_ELEMENTS, { tiles_for(LONG_ELEMENTS) }> = Body {
    bar: LONG_BAR,
    fixed: 16,
    force: [NodalForce { node: LONG_BAR.node(0, 3, 12), newton: [0.02, -0.03, 0.05], ramp: 0.05 }],
};
/// The lattice.
const CELLS: [u32; 3] = [1, 1, 3];
/// Vectors that long steps need at most.
const VECTORS: usize = 12_000;
/// Vertices whose motion a network predicts: enough for activations all over their range.
const ROWS: usize = 250;

/// A file at a multiple of 64 bytes, where networks may lie.
#[repr(C, align(64))]
struct Aligned<T: ?Sized>(T);

static NETWORK: &Aligned<[u8]> = &Aligned(*include_bytes!("../../../weights/compact-10.weights"));
static COMPACT_INT8: &Aligned<[u8]> = &Aligned(*include_bytes!("../../../weights/compact-10-i8.weights"));
static INT8: &Aligned<[u8]> = &Aligned(*include_bytes!("../../data/golden-v3.weights"));

/// What is computed; with a number of nodes, on the long bar.
pub const NAMES: [&str; 10] = [
    "exact",
    "long",
    "network",
    "learned",
    "int8",
    "exact-208",
    "learned-int8-208",
    "critical-208",
    "nodal-pressure",
    "nodal-strain",
];

/// How its sums are rounded at `level`, on which their bits depend: those of int8 layers are
/// never fused, but the learned step has others besides.
pub fn rounding(what: usize, level: Level) -> &'static str {
    let exact = matches!(level, Level::Portable | Level::Simd128);
    if exact || what == 4 || cfg!(feature = "deterministic") { "unfused" } else { "fused" }
}

/// Its checksum at `level`; zero if it could not be computed.
pub fn checksum(what: usize, level: Level) -> u32 {
    if !Level::force(level) {
        return 0;
    }
    let checksum = match what {
        0 => SMALL.exact(2_000, || ()).as_ref().map(of_state),
        1 => long(),
        2 => network(&NETWORK.0),
        3 => SMALL.learned(&NETWORK.0, 1_000, 50, || ()).map(|state| of_state(&state) ^ state.steps() as u32),
        4 => network(&INT8.0),
        5 => long_exact(500, || ()),
        6 => long_learned(500, 50, || ()),
        7 => long_critical(500),
        8 => in_other_tetrahedra(SMALL.scene_of::<_, 0>(NodalPressure(TISSUE))),
        _ => in_other_tetrahedra(SMALL.scene_of::<_, ROWS_OF_PATCHES>(NodalStrain(TISSUE))),
    };
    checksum.unwrap_or(0)
}

/// The checksum of the long bar after exact steps; `then` is called after each.
pub fn long_exact(steps: u32, then: impl FnMut()) -> Option<u32> {
    LONG.exact(steps, then).as_ref().map(of_state)
}

/// The checksum of the long bar after exact steps and learned ones with int8 layers; `then` is called after each
/// learned step.
pub fn long_learned(exact: u32, steps: u32, then: impl FnMut()) -> Option<u32> {
    LONG.learned(&COMPACT_INT8.0, exact, steps, then).map(|state| of_state(&state) ^ state.steps() as u32)
}

/// Of the critical step of the long bar after exact steps, s.
fn long_critical(steps: u32) -> Option<u32> {
    let critical = critical_step(&LONG.scene()?, &mut LONG.exact(steps, || ())?)?;
    Some(of([critical.seconds, critical.node as f32].into_iter()))
}

/// Of the small bar after exact steps, and of its critical step then, s.
fn in_other_tetrahedra(scene: Option<impl AsScene>) -> Option<u32> {
    let (scene, mut state) = (scene?, FixedState::<NODES, NODES>::new());
    SMALL.advance(&scene, &mut state, 2_000, || ())?;
    let critical = critical_step(&scene, &mut state)?;
    Some(of_state(&state) ^ of([critical.seconds, critical.node as f32].into_iter()))
}

/// FNV-1a over the bits.
fn of(values: impl Iterator<Item = f32>) -> u32 {
    values.fold(0x811c_9dc5, |hash, value| (hash ^ value.to_bits()).wrapping_mul(0x0100_0193))
}

fn of_state<const N: usize, const P: usize>(state: &FixedState<N, P>) -> u32 {
    of(state.displacements().iter().flat_map(|displacement| displacement.to_array()))
}

/// Long steps.
fn long() -> Option<u32> {
    let (scene, mut state) = (SMALL.scene()?, FixedState::<NODES>::new());
    let loads = SMALL.loads(&scene)?;
    let method = Method::new(Cells::Given(CELLS));
    let mut storage = [NodeVector::ZERO; VECTORS];
    let step = Step::unchecked(20.0 * SECONDS, DAMPING).ok()?;
    let mut long =
        LargeStep::prepare(method, scene.view(), &SMALL.points(), state.view(), step, &mut storage[..]).ok()?;
    for _ in 0..300 {
        if !long.step(scene.view(), &loads, state.view()).is_taken() {
            return None;
        }
    }
    Some(of_state(&state))
}

/// Predictions for random inputs, and for some that are not normal floats.
fn network(file: &[u8]) -> Option<u32> {
    let network = Network::parse(file).ok()?;
    let mut inputs = [0.0; 7 * ROWS];
    let mut seed = 8u32;
    for (at, input) in inputs.iter_mut().enumerate() {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let scale = network.inputs().get(at % 7)?.scale;
        *input = 2.0 * scale * ((seed >> 8) as f32 / 8_388_608.0 - 1.0);
    }
    for (at, odd) in [(0, f32::NAN), (10, f32::INFINITY), (20, -0.0), (30, f32::MIN_POSITIVE / 8.0)] {
        *inputs.get_mut(at)? = odd;
    }
    let mut outputs = [0.0; 3 * ROWS];
    network.predict_rows(&inputs, &mut outputs);
    Some(of(outputs.into_iter()))
}
