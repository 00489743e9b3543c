//! With the feature `deterministic` the same input gives the same bits at every instruction-set level: sums are taken
//! in a fixed order, and nothing is fused. Without it levels differ by rounding, and two runs at one level by nothing.
//! Networks with int8 layers give the same bits either way.

use supple::guard::{EVERY, Guard};
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::{Loads, NodalForce};
use supple::material::{AnyLaw, Element, Exponential, NeoHookean, Polynomial, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::{Network, write, write_int8};
use supple::scene::{Support, VecScene};
use supple::simd::Level;
use supple::state::VecState;
use supple::step::{CriticalStep, Status, Step};
use supple::tled;

use crate::level_guard;
use crate::networks::{Memory, described, int8, uniform};

/// A quarter of the steps on processors that CI emulates.
const EMULATED: u64 = if cfg!(target_arch = "x86_64") { 1 } else { 4 };

type Bits = (CriticalStep, Vec<[u32; 3]>);

const BAR: Bar = Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 4] };

fn scene(material: VecMaterial, points: &[[f32; 3]]) -> VecScene<VecMaterial> {
    let tets: Vec<_> = BAR.tets().collect();
    let mesh = Mesh::new(points, &tets, Winding::Checked).unwrap();
    let fixed: Vec<_> = (0..12).map(Support::fixed).collect();
    VecScene::build(material, &mesh, &fixed).unwrap()
}

/// The displacements after exact steps of 50 us, or after steps of a method that are 20 times as long.
fn run(material: &VecMaterial, level: Level, method: Option<Method>) -> Bits {
    assert!(Level::force(level), "this processor lacks {level:?}");
    let points: Vec<_> = BAR.points().collect();
    let scene = scene(material.clone(), &points);
    let mut state = VecState::at_rest(points.len());
    let force = NodalForce { node: BAR.node(0, 2, 4), newton: [0.02, -0.03, 0.05], ramp: 0.05 };
    let forces = [force];
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &forces, &[]).unwrap();
    let mut estimate = 0.0;
    if let Some(method) = method {
        let step = Step::unchecked(20.0 * 5e-5, 10.0).unwrap();
        let mut large = LargeStep::prepare_in_vec(method, scene.view(), &points, state.view(), step).unwrap();
        let mut guard = Guard::prepare_in_vec(scene.view(), &points, state.view(), step, EVERY).unwrap();
        for _ in 0..400 / EMULATED {
            let status = large.step(scene.view(), &loads, state.view());
            let status = guard.follow(status, scene.view(), &loads, state.view());
            // Where a step is refused is among what has to be the same.
            if let Status::Diverged(divergence) = status {
                println!("after {} steps: {divergence}", state.steps());
                break;
            }
        }
        assert!(state.steps() > 10);
        assert!(large.report().added_mean > 0.0);
        estimate = guard.estimate().unwrap().mean;
        assert!(estimate > 0.0);
    } else {
        let step = Step::unchecked(5e-5, 10.0).unwrap();
        for _ in 0..2_000 / EMULATED {
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
    // The last vector is no displacement.
    let nodes = a.len() - 1;
    let pairs = a.as_flattened().iter().zip(b.as_flattened()).take(3 * nodes);
    pairs.fold(0.0, |most, (a, b)| most.max((f32::from_bits(*a) - f32::from_bits(*b)).abs()))
}

fn compare(name: &str, element: Element, law: impl Into<AnyLaw>) {
    let material = &VecMaterial::one(element, law, 1000.0);
    let methods = [("exact", None), ("long", Some(Method::new(Cells::Given([1, 1, 3]))))];
    let of_element = if element == Element::NodalStrain { 1 } else { 2 };
    for (of, method) in methods.into_iter().take(of_element) {
        let portable = run(material, Level::Portable, method);
        assert!(portable.1.iter().flatten().any(|bits| f32::from_bits(*bits).abs() > 1e-3), "nothing moved");
        for level in Level::available() {
            let other = run(material, level, method);
            println!("{name}, {of}: portable and {level:?} are {:.1e} m apart", apart(&portable, &other));
            if cfg!(feature = "deterministic") {
                assert_eq!(portable, other, "{name}, {of}: portable and {level:?} differ");
            } else {
                assert!(apart(&portable, &other) < 1e-6);
            }
            assert_eq!(other, run(material, level, method), "{name}, {of}: two runs differ");
        }
    }
}

#[test]
fn levels_differ_by_rounding_or_not_at_all() {
    let _guard = level_guard();
    let stiffening = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
    compare("neo-Hookean", Element::Linear, NeoHookean { c: 500.0, d: 15_000.0 });
    compare("polynomial", Element::Linear, Polynomial { c: 500.0, e: 750.0, d: 15_000.0 });
    compare("exponential", Element::Linear, stiffening);
    compare("exponential, nodal pressure", Element::NodalPressure, stiffening);
    compare("exponential, nodal strain", Element::NodalStrain, stiffening);
}

/// The predictions at different levels: within rounding, and with the feature `deterministic` the same bits.
#[test]
fn networks_are_within_rounding_or_the_same_bits() {
    let _guard = level_guard();
    let description = described(&[7, 40, 24, 3], &[10, 16, 3], 5);
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let mut random = uniform(8);
    let inputs: Vec<f32> = (0..7 * 50).map(|at| 2.0 * description.inputs[at % 7].scale * random()).collect();
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

/// With the feature `deterministic` and without: a network with int8 layers fuses nothing, also in its float32 layers.
#[test]
fn networks_with_int8_layers_are_the_same_bits() {
    let _guard = level_guard();
    let description = described(&[7, 40, 33, 24, 3], &[10, 16, 3], 5);
    for which in [0b0000_0001, 0b0000_0110, 0b0001_0000, 0b0011_1111] {
        let layers = int8(&description, |layer| which >> layer & 1 == 1, 6);
        let memory = Memory::of(&write_int8(&description, &layers).unwrap());
        let network = Network::parse(memory.bytes()).unwrap();
        let mut random = uniform(8);
        let inputs: Vec<f32> = (0..7 * 50).map(|at| 2.0 * description.inputs[at % 7].scale * random()).collect();
        let mut scalar = vec![0.0f32; 3 * 50];
        for (inputs, outputs) in inputs.chunks(7).zip(scalar.chunks_mut(3)) {
            network.predict(inputs, outputs);
        }
        assert!(scalar.windows(4).any(|pair| pair[0] != pair[3]), "the same for all inputs");
        for level in Level::available() {
            assert!(Level::force(level));
            let mut vectorised = vec![0.0f32; 3 * 50];
            network.predict_rows(&inputs, &mut vectorised);
            let differ = scalar.iter().zip(&vectorised).any(|(a, b)| a.to_bits() != b.to_bits());
            assert!(!differ, "layers {which:b}, {level:?}");
        }
    }
}
