//! The core never allocates: a counting global allocator sees nothing while a scene is built, loads are checked, the
//! critical step is computed and steps are taken, in memory that is a `static`. Too little memory is an error.
#![allow(unsafe_code)] // A global allocator is an unsafe trait.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::{LazyLock, Mutex};

use supple::contact::{Contact, Instrument, Pose, Shape, Surface, SurfaceNode, Touch};
use supple::image::{FieldKind, ImageGrid, displacement_field, scratch_for};
use supple::inertia::{Cells, Grid, LargeStep, Method, vectors_for, vectors_for_lattice};
use supple::learned::{self, LearnedError, LearnedStep};
use supple::loads::{Loads, Motion, NodalForce, traction};
use supple::material::{Element, Exponential, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::Network;
use supple::points::{FollowedPoint, follow, locate, words_for};
use supple::pressure::{PressedTriangle, Pressure, SurfacePressure};
use supple::pulls::{Pull, PulledNode, Pulls, patch};
use supple::scene::{Axes, BuildError, FixedScene, Support, patch_rows_for, tiles_for};
use supple::state::{FixedState, NodeVector};
use supple::step::{Status, Step};
use supple::tled;

use crate::support::{DENSITY, EXP};

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
const TILES: usize = tiles_for(TETS);

/// Made beforehand: its tables are on the heap.
fn material(element: Element) -> VecMaterial {
    VecMaterial::one(element, EXP, DENSITY)
}

static SCENE: LazyLock<Mutex<FixedScene<VecMaterial, NODES, TILES>>> =
    LazyLock::new(|| Mutex::new(FixedScene::new(material(Element::Linear))));
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

/// The nine nodes at z = 0 fixed, one at the far end moved along z.
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
fn an_exchange_allocates_nothing() {
    let (points, tets) = mesh();
    let (mut scene, mut state) =
        (FixedScene::<_, NODES, TILES>::new(material(Element::Linear)), FixedState::<NODES>::new());
    let mut stiffer = [60.0, 62.0].map(|a| {
        let law = Exponential { a, b: 8.023, d: 60_000.0 };
        Some(VecMaterial::one(Element::Linear, law, DENSITY))
    });
    let before = allocations();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    scene.build(&mesh, &supports()).unwrap();
    let (mut taken, mut removed) = (0, [false; TETS]);
    removed[TETS - 30..].fill(true);
    for stage in 0..4 {
        match stage {
            0 => {}
            1 | 3 => {
                assert!(scene.set_constants(stiffer[stage / 2].take().unwrap()).unwrap());
                assert!(tled::carry_on(&scene, &mut state));
            }
            _ => {
                scene.build(&mesh.without(&removed).unwrap(), &supports()).unwrap();
                assert!(tled::carry_on(&scene, &mut state));
            }
        }
        let critical = tled::critical_step(&scene, &mut state).unwrap();
        let step = Step::new(0.5 * critical.seconds, 5.0, critical).unwrap();
        let loads = Loads::new(&scene, [0.0, 2.0, -9.81], &[], &[]).unwrap();
        for _ in 0..50 {
            taken += u32::from(tled::step(&scene, &loads, &mut state, &step) == Status::Ok);
        }
    }
    assert_eq!((taken, allocations()), (200, before));
}

#[test]
fn building_and_stepping_in_statics_allocates_nothing() {
    let (points, tets) = mesh();
    let (mut scene, mut state) = (SCENE.lock().unwrap(), STATE.lock().unwrap());
    let (scene, state) = (&mut *scene, &mut *state);
    let before = allocations();

    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    scene.build(&mesh, &supports()).unwrap();
    let critical = tled::critical_step(scene, state).unwrap();
    let step = Step::new(0.3 * critical.seconds, 5.0, critical).unwrap();
    let mut forces = [NodalForce::default(); 7];
    forces[0] = NodalForce { node: NODES as u32 - 3, newton: [1e-3, 0.0, 0.0], ramp: 0.01 };
    let triangles = [[36, 38, 42], [38, 44, 42]];
    for (force, share) in forces.iter_mut().skip(1).zip(traction(&points, &triangles, [0.0, 5.0, 0.0], 0.0)) {
        *force = share.unwrap();
    }
    let motions = [Motion { node: NODES as u32 - 1, axes: Axes::Z, metre: [0.0, 0.0, 1e-3], ramp: 0.01 }];
    let loads = Loads::new(scene, [0.0, 0.0, -9.81], &forces, &motions).unwrap();
    assert!(tled::start(scene, state, &step, |_| ([0.0; 3], [0.0; 3])));
    let (mut taken, mut pressed) = (0, 0);
    for _ in 0..200 {
        taken += u32::from(tled::step(scene, &loads, state, &step) == Status::Ok);
    }
    let energy = tled::strain_energy(scene, state).expect("room");
    let volume: f64 = scene.view().element_fields(state.displacements()).map(|f| f.volume_ratio).sum();
    assert!(tled::critical_step(scene, state).is_some());
    state.reset();

    // A plate presses the far end.
    let far = SurfaceNode { rest: points[NODES - 5], node: NODES as u32 - 5 };
    let above = |height: f32| Pose::along([0.0, 0.0, far.rest[2] + height], [0.0, 0.0, -1.0]);
    let mut plate = [Instrument::resting(Shape::Plane, above(0.0))];
    plate[0].move_to(above(-1e-4), 0.0, 100.0 * f64::from(step.seconds()));
    let nodes = [far];
    let contact = Contact::new(Surface::new(&nodes, NODES).unwrap(), &plate).unwrap();
    let mut touches = [Touch::default()];
    for _ in 0..100 {
        let mut state = state.view().feeling(&mut touches);
        let loads = Loads::NONE.touched_by(contact);
        pressed += u32::from(tled::step(scene, &loads, &mut state, &step).is_taken() && touches[0].contacts > 0);
    }
    state.reset();

    // A pull draws its middle aside.
    let mut nodes = [PulledNode::default(); NODES];
    let count = patch(&points, |_| 1.0, [0.01, 0.01, 0.02], 0.011, &mut nodes).unwrap() as u32;
    let mut pulls = [Pull::new([0, count], [0.01, 0.01, 0.02], 100.0)];
    pulls[0].put([0.015, 0.01, 0.02]);
    let mut pull_forces = [NodeVector::ZERO];
    let mut pulled = 0;
    for _ in 0..100 {
        let mut state = state.view().pulling(&mut pull_forces);
        let loads = Loads::NONE.pulled_by(Pulls::new(NODES, &nodes, &pulls).unwrap());
        let taken = tled::step(scene, &loads, &mut state, &step).is_taken();
        pulled += u32::from(taken && pull_forces[0] != NodeVector::ZERO);
    }
    state.reset();

    // To rest under a pressure, with instruments, and from displacements of the host's.
    let mut pressed_triangles = [PressedTriangle::default(); 2];
    for (place, (index, nodes)) in pressed_triangles.iter_mut().zip(triangles.into_iter().enumerate()) {
        *place = PressedTriangle::new(&points, index, nodes, 0).unwrap();
    }
    let surfaces = [SurfacePressure::new(10.0, 0.0)];
    let pressure = Pressure::new(scene, &pressed_triangles, &surfaces).unwrap();
    let mut room = [NodeVector::ZERO; tled::vectors_to_settle(NODES)];
    let mut loads = Loads::new(scene, [0.0, 0.0, -1.0], &[], &[]).unwrap().pressed_by(pressure).touched_by(contact);
    let settled = tled::settle(scene, &mut loads, state, 1e-5, 5000, &mut room).unwrap();
    let moved = [[1e-5; 3]; NODES];
    tled::displace(scene, state, &moved).unwrap();
    state.reset();

    // Refusals as well.
    assert!(tled::settle(scene, &mut loads, state, f32::NAN, 5000, &mut room).is_err());
    assert!(tled::displace(scene, state, &moved[1..]).is_err());
    assert!(Step::new(1.0, 0.0, critical).is_err());
    let huge = [NodalForce { newton: [f32::MAX; 3], ..forces[0] }];
    let loads = Loads::new(scene, [0.0; 3], &huge, &[]).unwrap();
    let diverged = (0..100).any(|_| matches!(tled::step(scene, &loads, state, &step), Status::Diverged(_)));
    assert!(scene.build(&mesh, &[Support::fixed(10_000)]).is_err());

    assert_eq!(allocations(), before);
    assert!(pressed > 50 && pulled == 100, "{pressed}, {pulled}");
    println!("{settled:?}");
    assert!(settled.status.is_taken() && settled.steps > 10);
    println!("200 steps, strain energy {energy:.3e} J, no allocation");
    assert!(taken == 200 && energy > 0.0 && diverged && (volume / TETS as f64 - 1.0).abs() < 0.1);
}

const ROWS: usize = patch_rows_for(NODES, TETS, 1);
static PATCHES: LazyLock<Mutex<FixedScene<VecMaterial, NODES, TILES, ROWS>>> =
    LazyLock::new(|| Mutex::new(FixedScene::new(material(Element::NodalStrain))));

#[test]
fn nodal_strain_in_a_static_allocates_nothing() {
    let (points, tets) = mesh();
    let (mut scene, mut state) = (PATCHES.lock().unwrap(), FixedState::<NODES, NODES>::new());
    let scene = &mut *scene;
    let before = allocations();

    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &supports()).unwrap();
    let critical = tled::critical_step(scene, &mut state).unwrap();
    let step = Step::new(0.5 * critical.seconds, 5.0, critical).unwrap();
    let loads = Loads::new(scene, [9.81, 0.0, 0.0], &[], &[]).unwrap();
    let taken = (0..200).filter(|_| tled::step(scene, &loads, &mut state, &step) == Status::Ok).count();
    let energy = tled::strain_energy(scene, &mut state).expect("room");

    assert_eq!(allocations(), before);
    println!(
        "200 steps, {} rows of patches of {ROWS}, strain energy {energy:.3e} J, no allocation",
        scene.patch_row_count()
    );
    assert!(taken == 200 && energy > 0.0);
}

const LATTICE: [u32; 3] = [1, 1, 2];
/// Three layers of four points, of which the held end drops one.
const GRID: Grid = Grid { cells: LATTICE, functions: 12 };
/// More than long steps need.
const VECTORS: usize = 10_000;

/// Storage of long steps.
static LARGE: Mutex<[NodeVector; VECTORS]> = Mutex::new([NodeVector::ZERO; VECTORS]);

#[test]
fn steps_beyond_the_limit_in_statics_allocate_nothing() {
    let (points, tets) = mesh();
    let mut storage = LARGE.lock().unwrap();
    let mut scene = FixedScene::<_, NODES, TILES>::new(material(Element::Linear));
    let mut state = FixedState::<NODES>::new();
    let before = allocations();

    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &supports()).unwrap();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::unchecked(20.0 * critical.seconds, 5.0).unwrap();
    let forces = [NodalForce { node: NODES as u32 - 3, newton: [1e-5, 0.0, 0.0], ramp: 0.01 }];
    let loads = Loads::new(&scene, [0.0, 0.0, -0.01], &forces, &[]).unwrap();
    let suggested = Method::new(Cells::Suggested).grid(scene.view(), &points).unwrap();
    let method = Method::new(Cells::Given(LATTICE));
    let grid = method.grid(scene.view(), &points).unwrap();
    assert!(suggested.functions <= GRID.functions && grid.functions <= GRID.functions);
    assert!(vectors_for(&method, scene.view(), &points).is_ok_and(|count| count <= storage.len()));
    assert!(vectors_for_lattice(Element::Linear, NODES, TETS, GRID) <= VECTORS);
    let mut taken = 0;
    let mut added = 0.0;
    for _ in 0..2 {
        state.reset();
        let mut large =
            LargeStep::prepare(method, scene.view(), &points, state.view(), step, &mut storage[..]).unwrap();
        for _ in 0..100 {
            taken += u32::from(large.step(scene.view(), &loads, state.view()) == Status::Ok);
        }
        added = large.report().added_mean;
        // Refusals as well.
        let too_small = &mut FixedState::<{ NODES - 1 }>::new();
        let refused = large.step(scene.view(), &loads, too_small.view());
        assert!(matches!(refused, Status::Mismatch { .. }) && state.steps() == 100);
    }
    let other_points = &points[1..];
    let storage = &mut storage[..];
    assert!(LargeStep::prepare(method, scene.view(), other_points, state.view(), step, storage).is_err());

    assert_eq!(allocations(), before);
    println!("200 steps at 20 times the limit, {taken} of them exact, no allocation; inertia added {added:.1?}");
    assert!(taken > 0 && added > 1.0);
}

#[test]
fn a_long_roll_out_in_statics_allocates_nothing() {
    let (points, tets) = mesh();
    let mut storage = LARGE.lock().unwrap();
    let mut scene = FixedScene::<_, NODES, TILES>::new(material(Element::Linear));
    let mut state = FixedState::<NODES>::new();
    let before = allocations();

    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &supports()).unwrap();
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let step = Step::unchecked(20.0 * critical.seconds, 5.0).unwrap();
    let forces = [NodalForce { node: NODES as u32 - 3, newton: [1e-5, 0.0, 0.0], ramp: 0.0 }];
    let loads = Loads::new(&scene, [0.0, 0.0, -0.01], &forces, &[]).unwrap();
    let method = Method::new(Cells::Given(LATTICE));
    let mut long = LargeStep::prepare(method, scene.view(), &points, state.view(), step, &mut storage[..]).unwrap();
    let mut most = 0.0_f32;
    for _ in 0..100 {
        assert!(long.step(scene.view(), &loads, state.view()).is_taken());
        most = most.max(long.report().damping);
    }

    assert_eq!(allocations(), before);
    println!("100 long steps, at most {most:.3} of the rough motion taken away, no allocation");
    assert!(most > 0.0 && most <= 0.5);
}

/// A weight file as it would lie in flash.
#[repr(C, align(64))]
struct Flash<B: ?Sized>(B);

static WEIGHTS: &Flash<[u8]> = &Flash(*include_bytes!("../data/golden-v1.weights"));
/// With int8 layers.
static INT8: &Flash<[u8]> = &Flash(*include_bytes!("../data/golden-v3.weights"));

const LEARNED_VECTORS: usize = learned::vectors_for(NODES, true);
static LEARNED: Mutex<[NodeVector; LEARNED_VECTORS]> = Mutex::new([NodeVector::ZERO; LEARNED_VECTORS]);

#[test]
fn a_learned_roll_out_in_statics_allocates_nothing() {
    for (weights, has_int8) in [(&WEIGHTS.0, false), (&INT8.0, true)] {
        assert_eq!(Network::parse(weights).unwrap().has_int8(), has_int8);
        for fallback in [false, true] {
            learned_roll_out(weights, fallback);
        }
    }
}

fn learned_roll_out(weights: &[u8], fallback: bool) {
    let (points, tets) = mesh();
    let mut storage = LEARNED.lock().unwrap();
    let mut scene = FixedScene::<_, NODES, TILES>::new(material(Element::Linear));
    let mut state = FixedState::<NODES>::new();
    let before = allocations();

    scene.build(&Mesh::new(&points, &tets, Winding::Checked).unwrap(), &supports()).unwrap();
    let network = Network::parse(weights).unwrap();
    let mut learned = LearnedStep::new(network, fallback, &mut storage[..]).unwrap();
    let forces = [NodalForce { node: NODES as u32 - 3, newton: [1e-2, 0.0, 0.0], ramp: 0.0 }];
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let seconds = learned.model().seconds();
    let exact = Step::unchecked(0.1 * seconds, 20.0).unwrap();
    let lead_in = (&exact, 50.0 * f64::from(seconds));
    assert!(learned.lead(scene.view(), &loads, state.view(), lead_in).unwrap().is_taken());
    let exact_steps = state.steps();
    // This network has learned nothing: in the end its step is refused or undone, which allocates nothing either.
    let mut step = || learned.step(scene.view(), &loads, state.view(), &exact);
    let refused = (0..1_000).map(|_| step()).find(|status| !status.is_ok_and(|status| status.is_taken()));
    let again = step();
    let fell_back = learned.model().fell_back().is_some();
    let damaged = Network::parse(&weights[..100]);

    assert_eq!(allocations(), before);
    let taken = state.steps() - exact_steps;
    println!("{taken} learned steps, no allocation; then {refused:?}, fell back: {fell_back}");
    assert!(taken > 0 && damaged.is_err());
    match (refused, again) {
        (None, Ok(again)) => assert!(again.is_taken()),
        // Exact steps have taken over, too late.
        (Some(Ok(Status::Diverged(_))), Ok(Status::Diverged(_))) => assert!(fell_back),
        (Some(Ok(Status::Diverged(_))), Err(LearnedError::NotLed { .. })) => assert!(!fell_back),
        unexpected => panic!("{unexpected:?}"),
    }
}

/// Of one vertex and of many, with int8 layers.
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
    assert!(network.has_int8() && outputs.iter().all(|output| output.is_finite()));
}

#[test]
fn too_few_nodes_or_tiles_is_an_error_and_leaves_the_scene_empty() {
    let (points, tets) = mesh();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let mut scene = FixedScene::<_, { NODES - 1 }, TILES>::new(material(Element::Linear));
    assert_eq!(scene.build(&mesh, &[]), Err(BuildError::NodeCapacity { needed: NODES, capacity: NODES - 1 }));
    assert_eq!((scene.node_count(), scene.element_count()), (0, 0));

    let mut scene = FixedScene::<_, NODES, { TILES - 1 }>::new(material(Element::Linear));
    assert_eq!(scene.build(&mesh, &[]), Err(BuildError::TileCapacity { needed: TILES, capacity: TILES - 1 }));
    assert_eq!((scene.node_count(), scene.element_count()), (0, 0));

    // More room than needed does no harm.
    let mut scene = FixedScene::<_, { NODES + 5 }, { TILES + 2 }>::new(material(Element::Linear));
    assert_eq!(scene.build(&mesh, &[]), Ok(()));
    assert_eq!((scene.node_count(), scene.element_count()), (NODES, TETS));

    // A state with too little room is refused everywhere.
    let mut state = FixedState::<{ NODES - 1 }>::new();
    let step = Step::unchecked(1e-4, 0.0).unwrap();
    let refused = Status::Mismatch { nodes: NODES, room: NODES - 1 };
    assert_eq!(tled::step(&scene, &Loads::NONE, &mut state, &step), refused);
    assert_eq!(tled::critical_step(&scene, &mut state), None);
    assert_eq!(tled::exact_critical_step(scene.view(), state.displacements()), None);
    assert!(!tled::start(&scene, &mut state, &step, |_| ([0.0; 3], [0.0; 3])));
    assert_eq!(state.steps(), 0);
}

#[test]
fn points_and_fields_in_arrays_allocate_nothing() {
    let (points, tets) = mesh();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let mut state = FixedState::<NODES>::new();
    state.view().put(0.0, 1e-3, |node| [[1e-3, 0.0, points[node][2] / 10.0], [1e-6, 0.0, 0.0]]);
    let (mut memory, mut scratch) = ([0; words_for(TETS)], vec![0.0; 40_000]);
    let mut out = vec![[0.0; 3]; 20 * 20 * 30];
    let before = allocations();

    let places = [[0.01, 0.012, 0.013], [0.01, 0.01, 0.05], [0.0, 0.0, 0.0]];
    let (mut located, mut now, mut fast) = ([FollowedPoint::default(); 3], [[0.0; 3]; 3], [[0.0; 3]; 3]);
    locate(&mesh, &places, &mut memory, &mut located).unwrap();
    follow(&located, &mut state, &mut now, &mut fast).unwrap();
    let grid = ImageGrid::aligned([-0.01; 3], [0.002; 3], [20, 20, 30]);
    let mut covered = 0;
    for (kind, reach) in [(FieldKind::Forward, 0.0), (FieldKind::Inverse, 0.015), (FieldKind::Inverse, 0.004)] {
        assert!(scratch_for(&grid, reach).unwrap() <= scratch.len());
        let moved = |node: usize| state.displacements()[node].to_array();
        covered = displacement_field(&mesh, moved, (kind, &grid, reach), &mut scratch, &mut out).unwrap();
    }
    // Refusals as well.
    assert!(locate(&mesh, &[[f32::NAN; 3]], &mut memory, &mut located).is_err());
    assert!(scratch_for(&ImageGrid { size: [0; 3], ..grid }, 0.0).is_err());

    assert_eq!(allocations(), before);
    assert!((now[0][0] - 0.011).abs() < 1e-8 && (fast[0][0] - 1e-3).abs() < 1e-8, "{now:?} {fast:?}");
    assert!((located[1].distance - 0.01).abs() < 1e-7 && covered > 1000, "{located:?} {covered}");
}
