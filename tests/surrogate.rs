//! The learned step against the paper's formulas written down in float64, whatever the network predicts; and what it says
//! when it must not or cannot be taken.

mod reference;
mod support;

#[path = "support/networks.rs"]
mod networks;

use networks::{Memory, described, predicted};
use supple::loads::Loads;
use supple::mlp::{Description, ForceInput, Network, Range, write};
use supple::state::State;
use supple::surrogate::{self, Surrogate, SurrogateError, Vertex};
use supple::tled::{Cause, Status, Step};
use support::bodies::{held, small_bar, torsion};
use support::{Body, EXP, HostState, Judged, largest_distance, rest_of, tissue, to_f64};

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
        let ([tangent, normal, _], next) = (self.0, unit(increment));
        let axis = reference::tensor::cross(tangent, next);
        let (sine, cosine) = (dot(axis, axis).sqrt(), dot(tangent, next));
        let normal = if sine > 1e-12 {
            reference::tensor::apply(&reference::tensor::rotation(unit(axis), sine.atan2(cosine)), normal)
        } else {
            normal
        };
        self.0 = [next, normal, reference::tensor::cross(next, normal)];
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

/// The bar led by the exact step until it moves, its last increment spanning ten of its steps.
fn led(body: &Body) -> HostState {
    let scene = body.scene(tissue(EXP), &held(body));
    let forces = torsion(body, FORCE, 0.0);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut state = rest_of(&scene);
    let step = Step::new(DT, 20.0, support::bound(&scene, &state)).unwrap();
    for _ in 0..40 {
        let before = state.displacements().to_vec();
        support::run(&scene, &loads, &mut state, &step, MULTIPLE);
        state.span(&before, MULTIPLE as f32 * DT);
    }
    state
}

/// With the force in N, and over the mass of a vertex: those of the bar's differ several times.
#[test]
fn ten_steps_are_those_of_the_paper_in_float64() {
    let body = small_bar();
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
        let mut surrogate = Surrogate::over(network, vec![Vertex::NEW; nodes]).unwrap();
        let mut state = led(&body);
        let scene = body.scene(tissue(EXP), &held(&body));
        let forces = torsion(&body, FORCE, 0.0);
        let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();

        let du = |state: &HostState| -> Vec<Vec3> {
            (0..nodes)
                .map(|node| state.velocity(node).map(|v| f64::from(v) * f64::from(description.step)))
                .collect()
        };
        let mut external = vec![[0.0; 3]; nodes];
        for force in &forces {
            external[force.node as usize] = force.newton.map(f64::from);
        }
        let mut simple = Reference {
            mesh: body.reference(),
            law: EXP.reference(),
            frames: vec![Frame([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]); nodes],
            u: to_f64(state.displacements()),
            du: du(&state),
            external,
            free: body.points.iter().map(|x| x[2] != 0.0).collect(),
            mass: body.reference().lumped_mass(f64::from(tissue(EXP).density)),
        };
        let (start, mut clipped) = (to_f64(state.displacements()), 0.0);
        for _ in 0..10 {
            simple.step(&description);
            let status = surrogate::step(&scene, &loads, &mut state, &mut surrogate);
            assert!(matches!(status, Status::Ok | Status::Limited { .. }), "{status:?}");
            clipped += surrogate.report().clipped / 10.0;
        }
        let moved = largest_distance(&simple.u, &start);
        let off = largest_distance(&to_f64(state.displacements()), &simple.u) / moved;
        println!(
            "moved by {:.3} mm, off by {off:.1e} of that; {:.0} % clipped",
            1e3 * moved,
            100.0 * clipped
        );
        worst = worst.max(off);
    }
    assert!(worst < 1e-5);
}

#[test]
fn an_exact_step_goes_on_from_a_learned_one_at_the_same_velocity() {
    let body = small_bar();
    let scene = body.scene(tissue(EXP), &held(&body));
    let forces = torsion(&body, FORCE, 0.0);
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let mut state = led(&body);
    let nodes = 0..body.points.len();
    let velocities: Vec<_> = nodes.clone().map(|node| state.velocity(node)).collect();
    let fastest = velocities.iter().flatten().fold(0.0f32, |most, v| most.max(v.abs()));
    let largest_change = |state: &HostState| {
        let both = nodes.clone().map(|node| state.velocity(node)).zip(&velocities);
        both.flat_map(|(now, then)| [0, 1, 2].map(|axis| (now[axis] - then[axis]).abs()))
            .fold(0.0f32, f32::max)
    };
    state.respan(DT);
    assert!(largest_change(&state) < 1e-6 * fastest);
    support::run(&scene, &loads, &mut state, &Step::insist(DT, 20.0).unwrap(), 1);
    println!("{:.1e} of {fastest:.2e} m/s", largest_change(&state));
    assert!(largest_change(&state) < 0.2 * fastest);
}

#[test]
fn a_network_of_another_shape_is_refused() {
    let memory = Memory::of(&write(&described(&[6, 4, 3], &[], 1)).unwrap());
    let error = Surrogate::over(Network::parse(memory.bytes()).unwrap(), vec![Vertex::NEW; 1]).unwrap_err();
    assert_eq!(error, SurrogateError::Shape { inputs: 6, outputs: 3 });
    println!("{error}");
    assert_eq!(error.to_string(), "a network of 6 inputs and 3 outputs; the learned step needs 7 and 3");
}

#[test]
fn a_step_that_must_not_be_taken_changes_nothing() {
    let body = small_bar();
    let mut description = network(1);
    let memory = Memory::of(&write(&description).unwrap());
    let network = Network::parse(memory.bytes()).unwrap();
    let nodes = body.points.len();
    let mut surrogate = Surrogate::over(network, vec![Vertex::NEW; nodes]).unwrap();
    let state = led(&body);
    let scene = body.scene(tissue(EXP), &held(&body));
    let loads = Loads::NONE;
    let unchanged = |state: &HostState, before: &HostState| {
        assert_eq!(support::bits(state), support::bits(before));
        assert_eq!(state.steps(), before.steps());
    };

    // An increment over another time: the exact step's.
    let mut exact = state.clone();
    let step = Step::insist(DT, 20.0).unwrap();
    support::run(&scene, &loads, &mut exact, &step, 1);
    let mut tried = exact.clone();
    let status = surrogate::step(&scene, &loads, &mut tried, &mut surrogate);
    assert!(matches!(status, Status::Mismatch { .. }), "{status:?}");
    unchanged(&tried, &exact);

    // Too few vertices.
    let mut small = Surrogate::over(network, vec![Vertex::NEW; nodes - 1]).unwrap();
    let mut tried = state.clone();
    let status = surrogate::step(&scene, &loads, &mut tried, &mut small);
    assert_eq!(status, Status::Mismatch { nodes, room: nodes - 1 });
    unchanged(&tried, &state);

    // A network that gives energy that nothing has.
    for output in &mut description.outputs {
        *output = Range { scale: 1e6, least: -1e7, most: 1e7 };
    }
    let memory = Memory::of(&write(&description).unwrap());
    let wild = Network::parse(memory.bytes()).unwrap();
    let mut surrogate = Surrogate::over(wild, vec![Vertex::NEW; nodes]).unwrap();
    let mut tried = state.clone();
    let status = surrogate::step(&scene, &loads, &mut tried, &mut surrogate);
    let Status::Diverged(divergence) = status else { panic!("{status:?}") };
    println!("{divergence}");
    assert!(matches!(divergence.cause, Cause::Energy { .. }));
    unchanged(&tried, &state);
    let _: &State<_> = &tried;
}
