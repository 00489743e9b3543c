//! The learned step against the paper's formulas written down in float64, whatever the network predicts; and what it
//! says when it must not or cannot be taken.

use supple::learned::{LearnedError, LearnedStep, vectors_for};
use supple::loads::{Loads, NodalForce};
use supple::material::VecMaterial;
use supple::mesh::{Mesh, Winding};
use supple::mlp::{Description, ForceInput, Network, Range, write};
use supple::scene::{Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::{Cause, Status, Step};

use crate::networks::{Memory, described, predicted};
use crate::support::bodies::{held, small_bar, torsion};
use crate::support::{Body, EXP, largest_distance, reference_law, rest_of, tissue, to_f64};
use crate::{reference, support};

type Vec3 = [f64; 3];

const DT: f32 = 3e-5;
const MULTIPLE: u64 = 10;
const FORCE: f32 = 0.003;

fn dot(a: Vec3, b: Vec3) -> f64 {
    reference::tensor::dot(a, b)
}

fn unit(a: Vec3) -> Vec3 {
    a.map(|x| x / dot(a, a).sqrt())
}

/// A frame of the paper: tangent and normal, turned about the axis across two tangents by the angle between them.
#[derive(Clone, Copy)]
struct Frame([Vec3; 3]);

impl Frame {
    fn follow(&mut self, increment: Vec3) {
        if dot(increment, increment) <= 1e-30 {
            return;
        }
        let ([tangent, normal, _], new_tangent) = (self.0, unit(increment));
        let axis = reference::tensor::cross(tangent, new_tangent);
        let (sine, cosine) = (dot(axis, axis).sqrt(), dot(tangent, new_tangent));
        let normal = if sine > 1e-12 {
            reference::tensor::apply(&reference::tensor::rotation(unit(axis), sine.atan2(cosine)), normal)
        } else {
            normal
        };
        self.0 = [new_tangent, normal, reference::tensor::cross(new_tangent, normal)];
    }

    fn local(&self, v: Vec3) -> Vec3 {
        self.0.map(|axis| dot(axis, v))
    }

    fn world(&self, local: Vec3) -> Vec3 {
        [0, 1, 2].map(|i| (0..3).map(|k| local[k] * self.0[k][i]).sum())
    }
}

/// The roll-out in float64: displacements and increments.
struct Reference {
    mesh: reference::Mesh,
    law: reference::Law,
    frames: Vec<Frame>,
    u: Vec<Vec3>,
    du: Vec<Vec3>,
    external: Vec<Vec3>,
    free: Vec<bool>,
    mass: Vec<f64>,
}

impl Reference {
    fn step(&mut self, network: &Description<'_>) {
        let seconds = f64::from(network.step);
        let internal = reference::internal_force(&self.mesh, &self.law, &self.u);
        for node in 0..self.u.len() {
            let (u, du, frame) = (self.u[node], self.du[node], &mut self.frames[node]);
            frame.follow(du);
            let force = reference::tensor::difference(self.external[node], internal[node]);
            let speed = dot(du, du).sqrt() / seconds;
            let unit = if network.force == ForceInput::PerMass { self.mass[node] } else { 1.0 };
            let force = force.map(|force| force / unit);
            let inputs: Vec<f32> = [frame.local(u).as_slice(), &[speed], &frame.local(force)]
                .concat()
                .into_iter()
                .map(|x| x as f32)
                .collect();
            let local = predicted(network, &inputs);
            let acceleration = frame.world([local[0], local[1], local[2]]);
            if self.free[node] {
                for axis in 0..3 {
                    self.du[node][axis] += seconds * seconds * acceleration[axis];
                    self.u[node][axis] += self.du[node][axis];
                }
            }
        }
    }
}

/// A random network whose inputs and outputs have about the sizes of the small bar's motion.
fn network(seed: u32) -> Description<'static> {
    let mut description = described(&[7, 24, 16, 3], &[10, 12, 3], seed);
    for (input, scale) in description.inputs.iter_mut().zip([1e-2, 1e-2, 1e-2, 0.05, 3e-3, 3e-3, 3e-3]) {
        *input = Range { scale, least: -scale, most: scale };
    }
    for output in &mut description.outputs {
        *output = Range { scale: 2.0, least: -3.0, most: 2.0 };
    }
    description
}

type Scene = VecScene<VecMaterial>;

/// A learned step without fallback.
fn learned_step<'w>(network: Network<'w>, nodes: usize) -> LearnedStep<'w, Vec<NodeVector>> {
    LearnedStep::new(network, false, vec![NodeVector::ZERO; vectors_for(nodes, false)]).unwrap()
}

/// The same with fallback.
fn with_fallback<'w>(network: Network<'w>, nodes: usize) -> LearnedStep<'w, Vec<NodeVector>> {
    LearnedStep::new(network, true, vec![NodeVector::ZERO; vectors_for(nodes, true)]).unwrap()
}

/// The bar and its torsion.
fn twisted() -> (Body, Scene, Vec<NodalForce>) {
    let body = small_bar();
    let scene = body.scene(tissue(EXP), &held(&body));
    let forces = torsion(&body, FORCE, 0.0);
    (body, scene, forces)
}

/// After a lead-in of 40 learned steps; `each` sees the state after each of them.
fn after_lead_in(
    scene: &Scene,
    loads: &Loads<'_>,
    learned: &mut LearnedStep<'_, Vec<NodeVector>>,
    mut each: impl FnMut(&VecState),
) -> VecState {
    let mut state = rest_of(scene);
    let exact = Step::new(DT, 20.0, support::bound(scene, &state)).unwrap();
    for _ in 0..40 {
        let seconds = f64::from(learned.model().seconds());
        let status = learned.lead(scene.view(), loads, state.view(), (&exact, seconds)).unwrap();
        assert!(status.is_taken(), "{status:?}");
        each(&state);
    }
    assert_eq!(state.steps(), 40 * MULTIPLE);
    state
}

/// With the force in N, and over the mass of a vertex: those of the bar's differ several times.
#[test]
fn ten_steps_are_those_of_the_paper_in_float64() {
    let (body, scene, forces) = twisted();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut worst = 0.0f64;
    for (seed, force) in (0..5).zip([ForceInput::Newton, ForceInput::PerMass].into_iter().cycle()) {
        let mut description = network(seed);
        if force == ForceInput::PerMass {
            description.force = force;
            for input in &mut description.inputs[4..] {
                *input = Range { scale: 2.0, least: -2.0, most: 2.0 };
            }
        }
        let memory = Memory::of(&write(&description).unwrap());
        let network = Network::parse(memory.bytes()).unwrap();
        let nodes = body.points.len();
        let mut learned = learned_step(network, nodes);
        let (mut u, mut du) = (vec![[0.0; 3]; nodes], Vec::new());
        let mut frames = vec![Frame([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]); nodes];
        let mut state = after_lead_in(&scene, &loads, &mut learned, |state| {
            let before = std::mem::replace(&mut u, to_f64(state.displacements()));
            du = u.iter().zip(&before).map(|(u, before)| reference::tensor::difference(*u, *before)).collect();
            frames.iter_mut().zip(&du).for_each(|(frame, du)| frame.follow(*du));
        });

        let mut external = vec![[0.0; 3]; nodes];
        for force in &forces {
            external[force.node as usize] = force.newton.map(f64::from);
        }
        let mut simple = Reference {
            mesh: body.reference(),
            law: reference_law(EXP),
            frames,
            u,
            du,
            external,
            free: body.points.iter().map(|x| x[2] != 0.0).collect(),
            mass: body.reference().lumped_mass(f64::from(tissue(EXP).density)),
        };
        let (start, mut clipped) = (simple.u.clone(), 0.0);
        let exact = Step::unchecked(DT, 20.0).unwrap();
        for _ in 0..10 {
            simple.step(&description);
            let status = learned.step(scene.view(), &loads, state.view(), &exact).unwrap();
            assert!(status.is_taken(), "{status:?}");
            clipped += learned.model().report().clipped / 10.0;
        }
        let moved = largest_distance(&simple.u, &start);
        let off = largest_distance(&to_f64(state.displacements()), &simple.u) / moved;
        println!("moved by {:.3} mm, off by {off:.1e} of that; {:.0} % clipped", 1e3 * moved, 100.0 * clipped);
        worst = worst.max(off);
    }
    assert!(worst < 1e-5);
}

#[test]
fn an_exact_step_goes_on_from_a_learned_one_at_the_same_velocity() {
    let (body, scene, forces) = twisted();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let nodes = 0..body.points.len();
    // A network that predicts no acceleration.
    let mut description = described(&[7, 3], &[], 1);
    description.first[0].weights.fill(0.0);
    description.first[0].biases.fill(0.0);
    let memory = Memory::of(&write(&description).unwrap());
    let mut learned = learned_step(Network::parse(memory.bytes()).unwrap(), nodes.len());
    let mut state = after_lead_in(&scene, &loads, &mut learned, |_| ());
    let exact = Step::unchecked(DT, 20.0).unwrap();
    assert!(learned.step(scene.view(), &loads, state.view(), &exact).unwrap().is_taken());
    let velocities: Vec<_> = nodes.clone().map(|node| state.velocity(node)).collect();
    let fastest = velocities.iter().flatten().fold(0.0f32, |most, v| most.max(v.abs()));
    let largest_change = |state: &VecState| {
        let both = nodes.clone().map(|node| state.velocity(node)).zip(&velocities);
        both.flat_map(|(now, then)| [0, 1, 2].map(|axis| (now[axis] - then[axis]).abs())).fold(0.0f32, f32::max)
    };
    state.view().respan(DT);
    assert!(largest_change(&state) < 1e-6 * fastest);
    support::run(&scene, &loads, &mut state, &exact, 1);
    println!("{:.1e} of {fastest:.2e} m/s", largest_change(&state));
    assert!(largest_change(&state) < 0.2 * fastest);
}

#[test]
fn a_network_of_another_shape_is_refused() {
    let memory = Memory::of(&write(&described(&[6, 4, 3], &[], 1)).unwrap());
    let error = LearnedStep::new(Network::parse(memory.bytes()).unwrap(), false, Vec::new()).unwrap_err();
    assert_eq!(error, LearnedError::Shape { inputs: 6, outputs: 3 });
    println!("{error}");
    assert_eq!(error.to_string(), "a network of 6 inputs and 3 outputs; the learned step needs 7 and 3");
}

#[test]
fn a_step_that_must_not_be_taken_changes_nothing() {
    let (body, scene, forces) = twisted();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut description = network(1);
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let nodes = body.points.len();
    let step = Step::unchecked(DT, 20.0).unwrap();
    let unchanged = |state: &VecState, before: &VecState| {
        assert_eq!(support::bits(state), support::bits(before));
        assert_eq!(state.steps(), before.steps());
    };

    // The host has taken an exact step of its own.
    let mut learned = learned_step(network, nodes);
    let mut exact = after_lead_in(&scene, &loads, &mut learned, |_| ());
    support::run(&scene, &loads, &mut exact, &step, 1);
    let mut tried = exact.clone();
    let refused = learned.step(scene.view(), &loads, tried.view(), &step).unwrap_err();
    assert_eq!(refused, LearnedError::NotLed { steps: 40 * MULTIPLE + 1 });
    unchanged(&tried, &exact);

    // An exact step that does not fit the network's.
    let state = after_lead_in(&scene, &loads, &mut learned, |_| ());
    let mut tried = state.clone();
    let mut refused = |seconds: f32, damping: f32| {
        let step = Step::unchecked(seconds, damping).unwrap();
        learned.step(scene.view(), &loads, tried.view(), &step).unwrap_err()
    };
    assert_eq!(refused(DT, 10.0), LearnedError::Damping { exact: 10.0, trained: 20.0 });
    assert_eq!(refused(7e-5, 20.0), LearnedError::StepRatio { exact: 7e-5, learned: 3e-4 });
    // A whole number, but one that no host waits for.
    assert_eq!(refused(3e-11, 20.0), LearnedError::StepRatio { exact: 3e-11, learned: 3e-4 });
    unchanged(&tried, &state);

    // Too little storage.
    let mut small = learned_step(network, nodes - 1);
    let state = after_lead_in(&scene, &loads, &mut small, |_| ());
    let mut tried = state.clone();
    let status = small.step(scene.view(), &loads, tried.view(), &step).unwrap();
    assert_eq!(status, Status::Mismatch { nodes, room: nodes - 1 });
    unchanged(&tried, &state);

    // A network that gives energy that nothing has: after its first step only the increments span another time.
    for output in &mut description.outputs {
        *output = Range { scale: 1e6, least: -1e7, most: 1e7 };
    }
    let memory = Memory::of(&write(&description).unwrap());
    let mut wild = learned_step(Network::parse(memory.bytes()).unwrap(), nodes);
    let state = after_lead_in(&scene, &loads, &mut wild, |_| ());
    let mut tried = state.clone();
    let status = wild.step(scene.view(), &loads, tried.view(), &step).unwrap();
    let Status::Diverged(divergence) = status else { panic!("{status:?}") };
    println!("{divergence}");
    assert!(matches!(divergence.cause, Cause::Energy { .. }));
    assert_eq!(tried.displacements(), state.displacements());
    assert_eq!((tried.time(), tried.steps()), (state.time(), state.steps()));
    assert_eq!(tried.energy_balance(), state.energy_balance());
}

#[test]
fn a_later_step_that_diverges_changes_nothing() {
    let (body, scene, forces) = twisted();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut description = network(1);
    for output in &mut description.outputs {
        *output = Range { scale: 1e3, least: -1e3, most: 1e3 };
    }
    let memory = Memory::of(&write(&description).unwrap());
    let mut learned = learned_step(Network::parse(memory.bytes()).unwrap(), body.points.len());
    let mut state = after_lead_in(&scene, &loads, &mut learned, |_| ());
    let exact = Step::unchecked(DT, 20.0).unwrap();
    for taken in 0..100 {
        let before = state.clone();
        let status = learned.step(scene.view(), &loads, state.view(), &exact).unwrap();
        if let Status::Diverged(divergence) = status {
            println!("after {taken} learned steps: {divergence}");
            assert!(taken > 0);
            assert_eq!(support::bits(&state), support::bits(&before));
            let refused = learned.step(scene.view(), &loads, state.view(), &exact).unwrap_err();
            assert_eq!(refused, LearnedError::NotLed { steps: state.steps() });
            return;
        }
    }
    panic!("a network that knows nothing did not diverge");
}

/// With fallback the same step is undone. Exact steps take its place, and the network is tried again, ever less often;
/// the motion is that of exact steps to the bit, but for how the first one spans the mean velocity of the lead-in's
/// last interval.
#[test]
fn a_step_that_energy_does_not_explain_is_undone_and_exact_steps_take_its_place() {
    let (body, scene, forces) = twisted();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut description = network(1);
    for output in &mut description.outputs {
        *output = Range { scale: 1e6, least: -1e7, most: 1e7 };
    }
    let memory = Memory::of(&write(&description).unwrap());
    let mut learned = with_fallback(Network::parse(memory.bytes()).unwrap(), body.points.len());
    let mut state = after_lead_in(&scene, &loads, &mut learned, |_| ());
    let (time, steps) = (state.time(), state.steps());
    let exact = Step::unchecked(DT, 20.0).unwrap();
    let mut expected = state.clone();
    let mut tried = vec![];
    for interval in 0..200 {
        let before = learned.model().fallbacks();
        let status = learned.step(scene.view(), &loads, state.view(), &exact).unwrap();
        assert!(status.is_taken(), "{status:?}");
        assert_eq!(state.steps(), steps + (interval + 1) * MULTIPLE);
        if learned.model().fallbacks() > before {
            tried.push(interval);
        }
        if interval == 0 {
            let fallback = learned.model().fell_back().unwrap();
            assert_eq!(fallback.time, time);
            assert!(fallback.status.is_unexplained());
        }
        support::run(&scene, &loads, &mut expected, &exact, MULTIPLE);
        assert_eq!(support::bits(&state), support::bits(&expected), "interval {interval}");
    }
    println!("the network was tried in intervals {tried:?}");
    assert_eq!(tried, [0, 8, 24, 56, 120]);
    learned.view().reset();
    assert_eq!(learned.model().fallbacks(), 0);
    assert!(learned.model().fell_back().is_none());
}

/// What a guard calls inexact gives way to exact steps as well, and the network goes on from them.
#[test]
fn the_network_goes_on_from_exact_steps_without_a_jump() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/weights/compact-10.weights");
    let memory = Memory::of(&std::fs::read(path).unwrap());
    let body = Body::paper();
    let scene = body.scene(tissue(EXP), &held(&body));
    let forces = support::bodies::corner_torsion(&body, 0.1, 0.3);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let exact = Step::unchecked(DT, 20.0).unwrap();
    let run = |inexact: &[u64]| {
        let mut learned = with_fallback(Network::parse(memory.bytes()).unwrap(), body.points.len());
        let mut state = rest_of(&scene);
        let _ = learned.lead(scene.view(), &loads, state.view(), (&exact, 0.09)).unwrap();
        let (mut exact_intervals, mut fastest) = (0, 0.0_f64);
        for interval in 0..700 {
            exact_intervals += u64::from(learned.model().is_exact_next());
            let before = to_f64(state.displacements());
            let status = learned.step(scene.view(), &loads, state.view(), &exact).unwrap();
            assert_eq!(status, Status::Ok);
            fastest = fastest.max(largest_distance(&to_f64(state.displacements()), &before));
            if inexact.contains(&interval) {
                learned.fall_back(state.time(), Status::Inexact { error: 1e-3, allowed: 1e-4 });
            }
        }
        (to_f64(state.displacements()), exact_intervals, fastest)
    };
    let (alone, none, fastest_alone) = run(&[]);
    // While exact steps move the state the guard may still call it inexact: the same fallback lasts longer. The next
    // one is as short as the first, after nearly 300 learned steps.
    let (mixed, exact_intervals, fastest) = run(&[100, 107, 108, 400]);
    let mut truth = rest_of(&scene);
    support::run(&scene, &loads, &mut truth, &exact, (300 + 700) * MULTIPLE);
    let truth = to_f64(truth.displacements());
    let off = |u: &[[f64; 3]]| largest_distance(u, &truth);
    println!(
        "of {:.1} mm the network alone is off by {:.3} mm, with {exact_intervals} of 700 intervals in exact steps by {:.3} mm; the largest \
         way in an interval is {:.4} and {:.4} mm",
        1e3 * support::largest(&truth),
        1e3 * off(&alone),
        1e3 * off(&mixed),
        1e3 * fastest_alone,
        1e3 * fastest,
    );
    assert_eq!((none, exact_intervals), (0, 9 + 8));
    assert!(off(&mixed) < 1.5 * off(&alone) && off(&mixed) < 0.1 * support::largest(&truth));
    assert!(fastest < 1.05 * fastest_alone);
}

#[test]
fn the_noise_of_a_network_at_rest_is_no_reason_to_refuse_its_first_steps() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/weights/compact-10.weights");
    let memory = Memory::of(&std::fs::read(path).unwrap());
    let points = [[0.0, 0.0, 0.0], [5e-3, 0.0, 0.0], [0.0, 5e-3, 0.0], [0.0, 0.0, 5e-3]];
    let mesh = Mesh::new(&points, &[[0, 1, 2, 3]], Winding::Checked).unwrap();
    let scene = VecScene::build(tissue(EXP), &mesh, &[Support::fixed(0)]).unwrap();
    let network = Network::parse(memory.bytes()).unwrap();
    let exact = Step::unchecked(DT, network.recipe().damping).unwrap();
    let storage = vec![NodeVector::ZERO; vectors_for(4, true)];
    let mut learned = LearnedStep::new(network, true, storage).unwrap();
    let mut state = VecState::at_rest(4);
    assert_eq!(learned.lead(scene.view(), &Loads::NONE, state.view(), (&exact, 0.03)).unwrap(), Status::Ok);
    for _ in 0..5 {
        let status = learned.step(scene.view(), &Loads::NONE, state.view(), &exact).unwrap();
        assert_eq!(status, Status::Ok);
    }
    let kinetic = state.energy_balance().kinetic;
    assert!(kinetic > 0.0, "{kinetic}");
    assert!(learned.model().fell_back().is_none(), "{:?}", learned.model().fell_back());
    println!("at rest it moves by {:.2e} m", support::largest(&to_f64(state.displacements())));
}

#[test]
fn a_lead_in_is_of_one_state_not_of_any_with_as_many_steps() {
    let (body, scene, forces) = twisted();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let description = network(3);
    let memory = Memory::of(&write(&description).unwrap());
    let mut learned = learned_step(Network::parse(memory.bytes()).unwrap(), body.points.len());
    let exact = Step::unchecked(DT, 20.0).unwrap();
    let (mut led, mut other) = (rest_of(&scene), rest_of(&scene));
    let time = 20.0 * MULTIPLE as f64 * f64::from(DT);
    let _ = learned.lead(scene.view(), &loads, led.view(), (&exact, time)).unwrap();
    support::run(&scene, &Loads::NONE, &mut other, &exact, led.steps());
    assert_eq!(other.steps(), led.steps());
    let refused = learned.step(scene.view(), &loads, other.view(), &exact);
    assert_eq!(refused, Err(LearnedError::NotLed { steps: other.steps() }));
}
