//! A step in parts, wherever and in whatever order they run, gives the bits of the step in one; and the parts compute
//! the forces of every element once.

use supple::contact::{Contact, Instrument, Pose, Shape, Surface, SurfaceNode, Touch};
use supple::element::ElementMaterial;
use supple::inertia::{Cells, LargeStep, Method};
use supple::learned::{LearnedStep, vectors_for};
use supple::loads::{Loads, Motion};
use supple::mlp::{ForceInput, Network, Range, write};
use supple::scene::{Axes, Support, VecScene};
use supple::state::{NodeVector, VecState};
use supple::step::{MOST_PARTS, Status, Step, Threads};
use supple::tled;

use crate::networks::{Memory, described, uniform};
use crate::support::bodies::{corner_torsion, held};
use crate::support::{
    Backwards, Body, EXP, bits, displaced, largest, largest_distance, reference_law, rest_of, tissue, widened,
};
use crate::{reference, support};

const DT: f32 = 2e-5;

/// Thirty steps (s) of a scene under gravity give the same bits by every number of parts.
pub(crate) fn same_bits_in_parts<M: ElementMaterial>(scene: &VecScene<M>, seconds: f32) {
    let loads = Loads::new(scene, [0.0, -9.81, 0.0], &[], &[]).unwrap();
    let step = Step::unchecked(seconds, 20.0).unwrap();
    let of = |parts: usize| {
        let threads = Backwards::new(parts);
        let mut state = VecState::of(scene.view());
        for _ in 0..30 {
            taken(tled::step_in_parts(scene.view(), &loads, state.view(), &step, &threads));
        }
        bits(&state)
    };
    let one = of(1);
    assert!((2..=4).all(|parts| of(parts) == one), "{:?}", scene.view().element());
}

fn taken(status: Status) {
    assert!(status.is_taken(), "{status:?}");
}

/// 13,200 elements: enough partitions for as many parts as there can be.
fn body() -> Body {
    Body::bar([0.1, 0.1, 0.22], [10, 10, 22])
}

/// The same body with its nodes and elements in random order: nearly all elements reach from partition to partition.
fn shuffled() -> Body {
    let mut body = body();
    let mut random = uniform(7);
    let mut shuffle = |indices: &mut [u32]| {
        for last in (1..indices.len()).rev() {
            indices.swap(last, (random().abs() * last as f32) as usize);
        }
    };
    let mut new_nodes: Vec<u32> = (0..body.points.len() as u32).collect();
    shuffle(&mut new_nodes);
    let mut points = body.points.clone();
    for (point, &node) in body.points.iter().zip(&new_nodes) {
        points[node as usize] = *point;
    }
    let mut order: Vec<u32> = (0..body.tets.len() as u32).collect();
    shuffle(&mut order);
    body.tets = order.iter().map(|&tet| body.tets[tet as usize].map(|node| new_nodes[node as usize])).collect();
    body.points = points;
    body
}

fn wave([x, y, z]: [f32; 3]) -> [f32; 3] {
    [0.02 * (40.0 * z).sin() * y, 0.05 * z * x, 0.3 * x * z]
}

/// Bits of the state after 30 exact steps under gravity, forces and a moved node, on a rough table, with what the table
/// feels.
fn exact(body: &Body, threads: &impl Threads) -> Vec<u64> {
    let far = body.farthest(2);
    let mut supports = held(body);
    supports.push(Support::moved(far));
    let scene = body.scene(tissue(EXP), &supports);
    let forces = corner_torsion(body, 0.2, 0.0);
    let motions = [Motion { node: far, axes: Axes::XYZ, metre: [1e-3, 0.0, 2e-3], ramp: 1e-3 }];
    let surface: Vec<_> = (0..).zip(&body.points).map(|(node, &rest)| SurfaceNode { rest, node }).collect();
    let table = Instrument::resting(Shape::Plane, Pose::along([0.0; 3], [0.0, 1.0, 0.0]));
    let table = [Instrument { friction: 0.3, ..table }];
    let contact = Contact::new(Surface::new(&surface, surface.len()).unwrap(), &table).unwrap();
    let loads = Loads::new(&scene, [0.0, -9.81, 0.0], &forces, &motions).unwrap().touched_by(contact);
    let mut state = rest_of(&scene);
    let step = Step::unchecked(DT, 20.0).unwrap();
    let mut touches = [Touch::default()];
    for _ in 0..30 {
        taken(tled::step_in_parts(scene.view(), &loads, state.view().feeling(&mut touches), &step, threads));
    }
    let mut all = bits(&state);
    let [touch] = touches;
    assert!(touch.contacts > 100, "{touch:?}");
    all.extend(touch.force.iter().chain(&touch.moment).map(|component| u64::from(component.to_bits())));
    all.push(state.energy_balance().kinetic.to_bits());
    all
}

/// The same after a lead-in and 10 learned steps, with what the last one reported.
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
    let storage = vec![NodeVector::ZERO; vectors_for(body.points.len(), false)];
    let mut learned = LearnedStep::new(network, false, storage).unwrap();
    // A bent body: a network that knows nothing may move it as far as its energy allows.
    let mut state = rest_of(&scene);
    let exact = Step::unchecked(description.exact_step, description.damping).unwrap();
    assert!(tled::start(&scene, &mut state, &exact, |node| (wave(body.points[node]), [0.0; 3])));
    let lead_in = (&exact, f64::from(description.step));
    taken(learned.view().lead(scene.view(), &loads, state.view(), lead_in, threads).unwrap());
    for _ in 0..10 {
        taken(learned.view().step(scene.view(), &loads, state.view(), &exact, threads).unwrap());
    }
    let report = learned.model().report();
    assert!(report.outside > 0.0 && report.outside < 1.0, "{report:?}");
    let mut all = bits(&state);
    all.extend([report.clipped, report.outside].map(|share| u64::from(share.to_bits())));
    all
}

/// The same after 30 long steps, with their report.
fn large(body: &Body, threads: &impl Threads) -> Vec<u64> {
    let far = body.farthest(2);
    let mut supports = held(body);
    supports.push(Support::moved(far));
    let scene = body.scene(tissue(EXP), &supports);
    let forces = corner_torsion(body, 0.2, 0.0);
    let motions = [Motion { node: far, axes: Axes::XYZ, metre: [1e-3, 0.0, 2e-3], ramp: 1e-2 }];
    let loads = Loads::new(&scene, [0.0, -9.81, 0.0], &forces, &motions).unwrap();
    let method = Method::new(Cells::Suggested);
    let mut state = rest_of(&scene);
    let step = Step::unchecked(20.0 * DT, 20.0).unwrap();
    let mut large = LargeStep::prepare_in_vec(method, scene.view(), &body.points, state.view(), step).unwrap();
    for _ in 0..30 {
        taken(large.step_in_parts(scene.view(), &loads, state.view(), threads));
    }
    let moved = largest(&support::to_f64(state.displacements()));
    assert!(moved > 1e-3, "moved by {:.3} mm", 1e3 * moved);
    let report = large.report();
    let mut all = bits(&state);
    all.push(state.energy_balance().kinetic.to_bits());
    all.extend([report.added_mean, report.damping].map(|value| u64::from(value.to_bits())));
    all
}

#[test]
fn any_number_of_parts_gives_the_same_bits_of_large_steps() {
    for (name, body) in [("in order", body()), ("shuffled", shuffled())] {
        let of = |parts| large(&body, &Backwards::new(parts));
        let one = of(1);
        for parts in [2, 3, 5, 8] {
            assert!(of(parts) == one, "{name}: {parts} parts of a long step");
        }
    }
}

#[test]
fn any_number_of_parts_gives_the_same_bits() {
    for (name, body) in [("in order", body()), ("shuffled", shuffled())] {
        let one = Backwards::new(1);
        let (exact_bits, learned_bits) = (exact(&body, &one), learned(&body, &one));
        for parts in [2, 3, 5, 8, 100] {
            let threads = Backwards::new(parts);
            assert!(exact(&body, &threads) == exact_bits, "{name}: {parts} parts of an exact step");
            assert!(learned(&body, &threads) == learned_bits, "{name}: {parts} parts of a learned step");
            assert_eq!(threads.most.into_inner(), parts.min(MOST_PARTS), "{name}");
        }
    }
}

#[cfg(feature = "parallel")]
#[test]
fn threads_of_rayon_give_the_same_bits() {
    let body = body();
    let one = Backwards::new(1);
    let (exact_bits, learned_bits) = (exact(&body, &one), learned(&body, &one));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    for parts in [1, 2, 3, 8] {
        let rayon = supple::step::Rayon { parts };
        pool.install(|| {
            assert!(exact(&body, &rayon) == exact_bits, "{parts} parts of an exact step");
            assert!(learned(&body, &rayon) == learned_bits, "{parts} parts of a learned step");
        });
    }
}

#[test]
fn forces_are_those_of_the_reference_in_any_order_of_nodes() {
    for (name, body) in [("in order", body()), ("shuffled", shuffled())] {
        let scene = body.scene(tissue(EXP), &held(&body));
        let displacements: Vec<_> = body.points.iter().map(|&x| wave(x)).collect();
        let expected = reference::internal_force(&body.reference(), &reference_law(EXP), &widened(&displacements));
        let mut state = displaced(&scene, &displacements);
        let loads = Loads::new(&scene, [0.0; 3], &[], &[]).unwrap();
        let step = Step::unchecked(1e-6, 0.0).unwrap();
        let threads = Backwards::new(3);
        let _ = tled::step_in_parts(scene.view(), &loads, state.view(), &step, &threads);
        let forces: Vec<_> = support::to_f64(state.forces()).iter().map(|f| f.map(|f| -f)).collect();
        let off = largest_distance(&forces, &expected) / largest(&expected);
        println!("{name}: forces are off by {off:.1e} of the largest");
        assert!(off < 1e-5);
    }
}
