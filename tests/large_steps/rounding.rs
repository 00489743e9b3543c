//! What rounding leaves out of displacements is not lost, whatever takes the steps: a free body that drifts so slowly
//! that its displacement has no smaller change in float32 arrives where it must. And what is wrong by rounding does not
//! heat.

use supple::adaptive::{Adaptive, Request};
use supple::element::ElementMaterial;
use supple::inertia::{Cells, Method};
use supple::learned::{LearnedStep, vectors_for};
use supple::loads::{Loads, Motion};
use supple::material::{NeoHookean, NodalPressure, NodalStrain};
use supple::mlp::{Activation, Description, LayerDescription, Network, write};
use supple::scene::{Axes, Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::{Status, Step};
use supple::tled;

use crate::large_steps::prepared;
use crate::networks::{Memory, described};
use crate::reference;
use crate::support::{Body, rest_of, run, tissue, to_f64};

/// A fragment of 4 mm, as stiff as cartilage: its critical step is some microseconds.
const STIFF: NeoHookean = NeoHookean { c: 2e6, d: 2e8 };
/// m; between floats at this displacement lie 3e-8 m.
const FAR: f32 = 0.25;

fn fragment() -> Body {
    Body::bar([0.004; 3], [1, 1, 1])
}

/// Large enough for a lattice.
fn slab() -> Body {
    Body::bar([0.008, 0.008, 0.016], [2, 2, 4])
}

/// Far away, drifting along x without deformation at this speed, m/s.
fn drifting<M: ElementMaterial>(scene: &VecScene<M>, step: &Step, speed: f32) -> VecState {
    let mut state = rest_of(scene);
    assert!(tled::start(scene, &mut state, step, |_| ([FAR, 0.0, 0.0], [speed, 0.0, 0.0])));
    state
}

/// How far the body has drifted over how far it must have.
fn arrived(state: &VecState, speed: f32) -> f64 {
    let mean = to_f64(state.displacements()).iter().map(|u| u[0]).sum::<f64>() / state.displacements().len() as f64;
    (mean - f64::from(FAR)) / (f64::from(speed) * state.time())
}

fn arrives(what: &str, state: &VecState, speed: f32) {
    let share = arrived(state, speed);
    println!("{what}: {:.1} um, {share:.5} of the way", 1e6 * f64::from(speed) * state.time());
    assert!((share - 1.0).abs() < 1e-3, "{what}: {share} of the way");
}

#[test]
fn slow_exact_steps_arrive() {
    fn with<M: ElementMaterial>(element: &str, material: M) {
        let scene = fragment().scene(material, &[]);
        // Less than half of what lies between two floats in each step.
        let (step, speed) = (Step::unchecked(1e-6, 0.0).unwrap(), 0.01);
        let mut state = drifting(&scene, &step, speed);
        run(&scene, &Loads::NONE, &mut state, &step, 5_000);
        arrives(element, &state, speed);
    }
    with("linear", tissue(STIFF));
    with("nodal pressure", NodalPressure(tissue(STIFF)));
    with("nodal strain", NodalStrain(tissue(STIFF)));
}

#[test]
fn slow_long_steps_arrive() {
    let body = slab();
    let scene = body.scene(tissue(STIFF), &[]);
    let (step, speed) = (Step::unchecked(1e-5, 0.0).unwrap(), 0.001);
    let mut state = drifting(&scene, &step, speed);
    let mut large = prepared(&body, &scene, &mut state, step, 0.0);
    for _ in 0..5_000 {
        assert_eq!(large.step(scene.view(), &Loads::NONE, state.view()), Status::Ok);
    }
    arrives("long", &state, speed);
}

#[test]
fn slow_adaptive_steps_arrive() {
    let body = slab();
    let scene = body.scene(tissue(STIFF), &[]);
    let (longest, speed) = (Step::unchecked(1e-5, 0.0).unwrap(), 0.001);
    let mut state = drifting(&scene, &longest, speed);
    let request = Request { tolerance: 1e-5, longest };
    let method = Method::new(Cells::Suggested);
    let mut adaptive = Adaptive::prepare_in_vec(method, scene.view(), &body.points, state.view(), request).unwrap();
    let mut loads = Loads::NONE;
    for _ in 0..500 {
        let (status, _) = adaptive.advance(1e-4, scene.view(), &mut loads, state.view());
        assert_eq!(status, Status::Ok);
    }
    arrives("adaptive", &state, speed);
}

/// With a network that predicts no acceleration, after a lead-in.
#[test]
fn slow_learned_steps_arrive() {
    let still =
        LayerDescription { inputs: 7, activation: Activation::Linear, weights: vec![0.0; 21], biases: vec![0.0; 3] };
    let description =
        Description { first: vec![still], damping: 0.0, step: 1e-5, exact_step: 1e-6, ..described(&[7, 3], &[], 1) };
    let memory = Memory::of(&write(&description).unwrap());
    let scene = fragment().scene(tissue(STIFF), &[]);
    let (exact, speed) = (Step::unchecked(1e-6, 0.0).unwrap(), 0.001);
    let mut state = drifting(&scene, &exact, speed);
    let nodes = scene.node_count();
    let storage = vec![NodeVector::ZERO; vectors_for(nodes, true)];
    let mut learned = LearnedStep::new(Network::parse(memory.bytes()).unwrap(), true, storage).unwrap();
    assert_eq!(learned.lead(scene.view(), &Loads::NONE, state.view(), (&exact, 1e-3)), Ok(Status::Ok));
    for _ in 0..5_000 {
        assert_eq!(learned.step(scene.view(), &Loads::NONE, state.view(), &exact), Ok(Status::Ok));
    }
    assert_eq!(learned.model().fallbacks(), 0);
    arrives("learned", &state, speed);
}

/// One face is held by motions, along another axis: they do not take the remainders of the free axes.
#[test]
fn a_slow_body_on_a_moved_support_arrives() {
    let body = fragment();
    let nodes = body.nodes_where(|x| x[2] == 0.0);
    let supports: Vec<_> = nodes.iter().map(|&node| Support { node, axes: Axes::Z, moves: true }).collect();
    let scene = body.scene(tissue(STIFF), &supports);
    let motions: Vec<_> =
        nodes.iter().map(|&node| Motion { node, axes: Axes::Z, metre: [0.0; 3], ramp: 0.0 }).collect();
    let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
    let (step, speed) = (Step::unchecked(1e-6, 0.0).unwrap(), 0.01);
    let mut state = drifting(&scene, &step, speed);
    run(&scene, &loads, &mut state, &step, 5_000);
    arrives("on a moved support", &state, speed);
}

/// Turned by a radian, so that each node is rounded in its own way, and drifting: without damping what rounding does to
/// the forces would be collected. There must be no more kinetic energy than that of the drift.
#[test]
fn rounding_does_not_heat() {
    fn with<M: ElementMaterial>(element: &str, material: M) {
        let body = fragment();
        let scene = body.scene(material, &[]);
        let (step, speed) = (Step::unchecked(1e-6, 0.0).unwrap(), 0.1);
        let turn = reference::tensor::rotation([1.0, 2.0, 3.0], 1.0);
        let turned = body.affine(&turn, [0.0; 3]);
        let mut state = rest_of(&scene);
        let at = |node: usize| (core::array::from_fn(|axis| turned[node][axis] + 0.2 * FAR), [speed, 0.0, 0.0]);
        assert!(tled::start(&scene, &mut state, &step, at));
        run(&scene, &Loads::NONE, &mut state, &step, 20_000);
        let mass: f64 = (0..scene.node_count()).map(|node| f64::from(scene.view().node_mass(node))).sum();
        let drift = 0.5 * mass * f64::from(speed * speed);
        let share = state.energy_balance().kinetic / drift;
        println!("{element}: {share:.6} of the energy of the drift");
        assert!((share - 1.0).abs() < 1e-3, "{element}: {share}");
    }
    with("linear", tissue(STIFF));
    with("nodal pressure", NodalPressure(tissue(STIFF)));
    with("nodal strain", NodalStrain(tissue(STIFF)));
}

/// The same for 1.7 s from rest under a small force, where the drift goes through all sizes: the kinetic energy is the
/// work of the force.
#[cfg(feature = "slow-tests")]
#[test]
fn a_fragment_under_a_small_force_has_the_energy_of_its_work() {
    let scene = fragment().scene(tissue(STIFF), &[]);
    let nodes = scene.node_count();
    let forces: Vec<_> = (0..nodes as u32)
        .map(|node| supple::loads::NodalForce { node, newton: [2.2e-8, 0.0, 0.0], ramp: 0.0 })
        .collect();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(0.9 * crate::large_steps::limit(&scene), 0.0).unwrap();
    let mut state = rest_of(&scene);
    let steps = (1.7 / step.seconds()) as u64;
    run(&scene, &loads, &mut state, &step, steps);
    let balance = state.energy_balance();
    println!("{steps} steps: kinetic {:.4e} J, work {:.4e} J", balance.kinetic, balance.work);
    assert!((balance.kinetic / balance.work - 1.0).abs() < 1e-3);
}
