//! The core never allocates: a counting global allocator sees nothing while a scene is built, loads are checked, the
//! critical step is found and steps are taken, in memory that is a `static`. Too little room is an error.
#![allow(unsafe_code)] // A global allocator is an unsafe trait.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Mutex;

use supple::inertia::{
    self, Damper, Inertia, LatticeNode, MassScaling, damped_numbers_for, damped_vectors_for, numbers_for,
    vectors_for,
};
use supple::loads::{Loads, Motion, NodalForce, traction};
use supple::material::{Exponential, NeoHookean, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::Network;
use supple::scene::{Axes, BuildError, FixedScene, Support, blocks_for};
use supple::state::{FixedState, NodeVector};
use supple::surrogate::{self, Surrogate, Vertex};
use supple::tled::{self, Status, Step};

/// Counts the allocations of each thread; the test harness allocates on others.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call goes on to the system's allocator with the arguments as they are.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        // SAFETY: as promised by the caller.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as promised by the caller.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
        // SAFETY: as promised by the caller.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

const BAR: Bar = Bar { size: [0.02, 0.02, 0.04], cells: [2, 2, 4] };
const NODES: usize = BAR.node_count();
const TETS: usize = BAR.element_count();
const BLOCKS: usize = blocks_for(TETS);
const TISSUE: Tissue<Exponential> =
    Tissue { law: Exponential { a: 59.0, b: 8.023, d: 60_000.0 }, density: 1000.0 };

static SCENE: Mutex<FixedScene<Tissue<Exponential>, NODES, BLOCKS>> = Mutex::new(FixedScene::new(TISSUE));
static STATE: Mutex<FixedState<NODES>> = Mutex::new(FixedState::new());

/// Points and elements in arrays.
fn mesh() -> ([[f32; 3]; NODES], [[u32; 4]; TETS]) {
    let (mut points, mut tets) = ([[0.0; 3]; NODES], [[0; 4]; TETS]);
    for (place, point) in points.iter_mut().zip(BAR.points()) {
        *place = point;
    }
    for (place, tet) in tets.iter_mut().zip(BAR.tets()) {
        *place = tet;
    }
    (points, tets)
}

/// The nine nodes at z = 0 fixed, one at the far end led along z.
fn supports() -> [Support; 10] {
    let mut supports = [Support::fixed(0); 10];
    for (node, support) in (0..9).zip(&mut supports) {
        *support = Support::fixed(node);
    }
    supports[9] = Support { node: NODES as u32 - 1, axes: Axes::Z, moves: true };
    supports
}

#[test]
fn the_allocator_counts() {
    let before = allocations();
    let mut vector = Vec::with_capacity(3);
    vector.extend([1, 2, 3]);
    std::hint::black_box(&vector);
    vector.extend([4; 100]);
    assert!(std::hint::black_box(vector).len() == 103 && allocations() >= before + 2);
}

#[test]
fn building_and_stepping_in_statics_allocates_nothing() {
    let (points, tets) = mesh();
    let (mut scene, mut state) = (SCENE.lock().unwrap(), STATE.lock().unwrap());
    let before = allocations();

    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    scene.build(&mesh, &supports()).unwrap();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::new(0.3 * critical.seconds, 5.0, critical).unwrap();
    let mut forces = [NodalForce::default(); 7];
    forces[0] = NodalForce { node: NODES as u32 - 3, newton: [1e-3, 0.0, 0.0], ramp: 0.01 };
    let triangles = [[36, 38, 42], [38, 44, 42]];
    for (force, share) in forces.iter_mut().skip(1).zip(traction(&points, &triangles, [0.0, 5.0, 0.0], 0.0)) {
        *force = share.unwrap();
    }
    let motions = [Motion { node: NODES as u32 - 1, axes: Axes::Z, metre: [0.0, 0.0, 1e-3], ramp: 0.01 }];
    let loads = Loads::new(&*scene, [0.0, 0.0, -9.81], &forces, &motions).unwrap();
    assert!(tled::start(&scene, &mut state, &step, |_| ([0.0; 3], [0.0; 3])));
    let mut taken = 0;
    for _ in 0..200 {
        taken += u32::from(tled::step(&scene, &loads, &mut state, &step) == Status::Ok);
    }
    let energy = tled::strain_energy(&scene, &state);
    let volume: f64 = tled::element_fields(&scene, state.displacements()).map(|f| f.volume_ratio).sum();
    assert!(tled::critical_step(&scene, &mut state).is_some());
    state.reset();

    // Refusals as well.
    assert!(Step::new(1.0, 0.0, critical).is_err());
    let huge = [NodalForce { newton: [f32::MAX; 3], ..forces[0] }];
    let loads = Loads::new(&*scene, [0.0; 3], &huge, &[]).unwrap();
    let diverged =
        (0..100).any(|_| matches!(tled::step(&scene, &loads, &mut state, &step), Status::Diverged(_)));
    assert!(scene.build(&mesh, &[Support::fixed(10_000)]).is_err());

    assert_eq!(allocations(), before);
    println!("200 steps, strain energy {energy:.3e} J, no allocation");
    assert!(taken == 200 && energy > 0.0 && diverged && (volume / TETS as f64 - 1.0).abs() < 0.1);
}

const LATTICE: [u32; 3] = [1, 1, 2];
/// Three layers of four points, of which the held end drops one.
const FUNCTIONS: usize = 12;
const VECTORS: usize = vectors_for(NODES);

type FixedMultilevel =
    Inertia<[NodeVector; VECTORS], [LatticeNode; NODES], [f32; numbers_for(LATTICE, FUNCTIONS)]>;

static SCALED: Mutex<MassScaling<[NodeVector; VECTORS]>> =
    Mutex::new(MassScaling::scaling_over([NodeVector::ZERO; VECTORS]));
static MULTILEVEL: Mutex<FixedMultilevel> = Mutex::new(Inertia::over(
    [NodeVector::ZERO; VECTORS],
    [LatticeNode::EMPTY; NODES],
    [0.0; numbers_for(LATTICE, FUNCTIONS)],
));

#[test]
fn steps_beyond_the_limit_in_statics_allocate_nothing() {
    let (points, tets) = mesh();
    let (mut scaled, mut multilevel) = (SCALED.lock().unwrap(), MULTILEVEL.lock().unwrap());
    let mut scene = FixedScene::<_, NODES, BLOCKS>::new(TISSUE);
    let mut state = FixedState::<NODES>::new();
    let before = allocations();

    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &supports()).unwrap();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::insist(20.0 * critical.seconds, 5.0).unwrap();
    let forces = [NodalForce { node: NODES as u32 - 3, newton: [1e-5, 0.0, 0.0], ramp: 0.01 }];
    let loads = Loads::new(&scene, [0.0, 0.0, -0.01], &forces, &[]).unwrap();
    let (cells, functions) = inertia::suggested_lattice(&scene, &points);
    assert!(functions <= FUNCTIONS, "{cells:?}");
    assert!(inertia::lattice_functions(&scene, &points, LATTICE).is_ok_and(|count| count <= FUNCTIONS));
    let mut taken = 0;
    scaled.prepare(&scene, &points, &mut state, step, [0; 3]).unwrap();
    // More than three cycles of a refresh.
    for _ in 0..100 {
        taken += u32::from(inertia::step(&scene, &loads, &mut state, &mut *scaled) == Status::Ok);
    }
    let added = scaled.report().added_mean;
    state.reset();
    multilevel.prepare(&scene, &points, &mut state, step, LATTICE).unwrap();
    for _ in 0..100 {
        taken += u32::from(inertia::step(&scene, &loads, &mut state, &mut *multilevel) == Status::Ok);
    }
    // Refusals as well.
    assert!(multilevel.prepare(&scene, &points[1..], &mut state, step, LATTICE).is_err());
    let refused = inertia::step(&scene, &loads, &mut state, &mut *multilevel);

    assert_eq!(allocations(), before);
    println!(
        "200 steps at 20 times the limit, {taken} of them exact, no allocation; inertia added {added:.1}"
    );
    assert!(matches!(refused, Status::Mismatch { .. }) && state.steps() == 100 && taken > 0 && added > 1.0);
}

const DAMPED_VECTORS: usize = damped_vectors_for(NODES);
type FixedDamped = Inertia<
    [NodeVector; DAMPED_VECTORS],
    [LatticeNode; NODES],
    [f32; damped_numbers_for(LATTICE, FUNCTIONS)],
>;
static DAMPED: Mutex<FixedDamped> = Mutex::new(
    Inertia::over(
        [NodeVector::ZERO; DAMPED_VECTORS],
        [LatticeNode::EMPTY; NODES],
        [0.0; damped_numbers_for(LATTICE, FUNCTIONS)],
    )
    .damped(),
);
static DAMPER: &Flash<[u8]> = &Flash(*include_bytes!("../weights/damper.weights"));

#[test]
fn a_damped_roll_out_in_statics_allocates_nothing() {
    let (points, tets) = mesh();
    let mut damped = DAMPED.lock().unwrap();
    let mut scene = FixedScene::<_, NODES, BLOCKS>::new(TISSUE);
    let mut state = FixedState::<NODES>::new();
    let before = allocations();

    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &supports()).unwrap();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::insist(20.0 * critical.seconds, 5.0).unwrap();
    let forces = [NodalForce { node: NODES as u32 - 3, newton: [1e-5, 0.0, 0.0], ramp: 0.0 }];
    let loads = Loads::new(&scene, [0.0, 0.0, -0.01], &forces, &[]).unwrap();
    let damper = Damper::over(Network::parse(&DAMPER.0).unwrap()).unwrap();
    damped.prepare(&scene, &points, &mut state, step, LATTICE).unwrap();
    let mut most = 0.0_f32;
    for _ in 0..100 {
        let status = inertia::damped_step(&scene, &loads, &mut state, &mut *damped, Some(&damper));
        assert!(matches!(status, Status::Ok | Status::Limited { .. }));
        most = most.max(damped.report().damping);
    }

    assert_eq!(allocations(), before);
    println!("100 damped steps, at most {most:.3} of the rough motion taken away, no allocation");
    assert!(most > 0.0 && most <= 0.5);
}

/// A weight file as it would lie in flash.
#[repr(C, align(64))]
struct Flash<B: ?Sized>(B);

static WEIGHTS: &Flash<[u8]> = &Flash(*include_bytes!("data/golden-v1.weights"));
/// With layers of eight bits.
static INT8: &Flash<[u8]> = &Flash(*include_bytes!("data/golden-v3.weights"));
static VERTICES: Mutex<[Vertex; NODES]> = Mutex::new([Vertex::NEW; NODES]);

#[test]
fn a_learned_roll_out_in_statics_allocates_nothing() {
    for (weights, has_int8) in [(&WEIGHTS.0, false), (&INT8.0, true)] {
        assert_eq!(Network::parse(weights).unwrap().has_int8(), has_int8);
        learned_roll_out(weights);
    }
}

fn learned_roll_out(weights: &[u8]) {
    let (points, tets) = mesh();
    let mut vertices = VERTICES.lock().unwrap();
    let mut scene = FixedScene::<_, NODES, BLOCKS>::new(TISSUE);
    let mut state = FixedState::<NODES>::new();
    let mut earlier = [NodeVector::ZERO; NODES];
    let before = allocations();

    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &supports()).unwrap();
    let network = Network::parse(weights).unwrap();
    let mut surrogate = Surrogate::over(network, &mut vertices[..]).unwrap();
    let forces = [NodalForce { node: NODES as u32 - 3, newton: [1e-2, 0.0, 0.0], ramp: 0.0 }];
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let exact = Step::insist(0.1 * surrogate.seconds(), 20.0).unwrap();
    // The exact step leads.
    for _ in 0..50 {
        earlier.copy_from_slice(state.displacements());
        for _ in 0..10 {
            let _ = tled::step(&scene, &loads, &mut state, &exact);
        }
    }
    state.span(&earlier, surrogate.seconds());
    surrogate.follow(&state);
    let led = state.steps();
    // This network has learned nothing: in the end it is refused, which allocates nothing either.
    let refused = (0..1_000).map(|_| surrogate::step(&scene, &loads, &mut state, &mut surrogate)).last();
    let damaged = Network::parse(&weights[..100]);

    assert_eq!(allocations(), before);
    let taken = state.steps() - led;
    println!("{taken} learned steps, no allocation; then {refused:?}");
    assert!(taken > 0 && damaged.is_err());
    assert!(matches!(refused, Some(Status::Ok | Status::Limited { .. } | Status::Diverged(_))));
}

/// Of one vertex and of many, with layers of eight bits.
#[test]
fn a_forward_pass_allocates_nothing() {
    let mut outputs = [0.0; 3 * 37];
    let before = allocations();

    let network = Network::parse(&INT8.0).unwrap();
    let inputs: [f32; 7 * 37] = std::array::from_fn(|at| (at % 11) as f32 - 5.0);
    network.predict_rows(&inputs, &mut outputs);
    let many = outputs;
    network.predict(&inputs, &mut outputs);

    assert_eq!(allocations(), before);
    assert_eq!(many, outputs);
    assert!(network.has_int8() && outputs.iter().all(|number| number.is_finite()));
}

#[test]
fn too_few_nodes_or_blocks_is_an_error_and_leaves_the_scene_empty() {
    let (points, tets) = mesh();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let tissue = Tissue { law: NeoHookean { c: 500.0, d: 25_000.0 }, density: 1000.0 };
    let mut scene = FixedScene::<_, { NODES - 1 }, BLOCKS>::new(tissue);
    assert_eq!(scene.build(&mesh, &[]), Err(BuildError::NodeCapacity { needed: NODES, capacity: NODES - 1 }));
    assert_eq!((scene.node_count(), scene.element_count()), (0, 0));

    let mut scene = FixedScene::<_, NODES, { BLOCKS - 1 }>::new(tissue);
    assert_eq!(
        scene.build(&mesh, &[]),
        Err(BuildError::BlockCapacity { needed: BLOCKS, capacity: BLOCKS - 1 })
    );
    assert_eq!((scene.node_count(), scene.element_count()), (0, 0));

    // More room than needed does no harm.
    let mut scene = FixedScene::<_, { NODES + 5 }, { BLOCKS + 2 }>::new(tissue);
    assert_eq!(scene.build(&mesh, &[]), Ok(()));
    assert_eq!((scene.node_count(), scene.element_count()), (NODES, TETS));

    // A state with too little room is refused at every door.
    let mut state = FixedState::<{ NODES - 1 }>::new();
    let step = Step::insist(1e-4, 0.0).unwrap();
    let refused = Status::Mismatch { nodes: NODES, room: NODES - 1 };
    assert_eq!(tled::step(&scene, &Loads::NONE, &mut state, &step), refused);
    assert_eq!(tled::critical_step(&scene, &mut state), None);
    assert_eq!(tled::exact_critical_step(&scene, state.displacements()), None);
    assert!(!tled::start(&scene, &mut state, &step, |_| ([0.0; 3], [0.0; 3])));
    assert_eq!(state.steps(), 0);
}
