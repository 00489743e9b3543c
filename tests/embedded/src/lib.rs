//! Every public path of the core behind C symbols, on data that the compiler knows nothing about. The library
//! built from this must link without std, and without `core::panicking`: what could panic would show.
#![no_std]

use supple::element::{ElementMaterial, ElementTile, NodeInertia, PatchRow};
use supple::image::{FieldKind, ImageGrid, displacement_field};
use supple::inertia::{Cells, LargeStep, Method, vectors_for};
use supple::learned::{self, LearnedStep};
use supple::loads::{Loads, Motion, NodalForce, traction};
use supple::material::{Exponential, NeoHookean, NodalPressure, NodalStrain, Regions, Tissue, TissueValues};
use supple::mesh::{self, Bar, Mesh, Winding};
use supple::mlp::Network;
use supple::points::{FollowedPoint, follow, locate, words_for};
use supple::scene::{AsScene, FixedScene, SceneFacts, SceneView, Support};
use supple::state::{FixedState, NodeVector};
use supple::step::{Status, Step};
use supple::tled;

type Scene<L> = FixedScene<Tissue<L>, 100, 20>;
type State = FixedState<100>;

/// Builds a scene in place.
#[unsafe(no_mangle)]
pub extern "C" fn build(
    scene: &mut Scene<Exponential>,
    points: &[[f32; 3]; 100],
    tets: &[[u32; 4]; 300],
    supports: &[Support; 9],
    point_count: usize,
    tet_count: usize,
) -> i32 {
    let (Some(points), Some(tets)) = (points.get(..point_count), tets.get(..tet_count)) else {
        return -1;
    };
    let Ok(mesh) = Mesh::new(points, tets, Winding::Normalised) else {
        return -2;
    };
    scene.build(&mesh, supports).map_or(-3, |()| 0)
}

/// Builds a scene of several tissues with nodal pressure, asks for its critical step and takes one.
#[unsafe(no_mangle)]
pub extern "C" fn nodal_pressure(
    tissues: &'static [TissueValues; 3],
    of_element: &'static [u16; 300],
    points: &[[f32; 3]; 100],
    tets: &[[u32; 4]; 300],
    supports: &[Support; 9],
    state: &mut FixedState<100, 100>,
) -> f32 {
    let mut scene =
        FixedScene::<_, 100, 20>::new(NodalPressure(Regions { law: NeoHookean::default(), tissues, of_element }));
    let Ok(mesh) = Mesh::new(points, tets, Winding::Normalised) else {
        return -1.0;
    };
    if scene.build(&mesh, supports).is_err() {
        return -2.0;
    }
    at_critical_step(&scene, state)
}

/// The same with nodal strain, in a scene of a fixed capacity and in memory of the host.
#[unsafe(no_mangle)]
pub extern "C" fn nodal_strain(
    tissues: &'static [TissueValues; 3],
    of_element: &'static [u16; 300],
    points: &[[f32; 3]; 100],
    tets: &[[u32; 4]; 300],
    supports: &[Support; 9],
    state: &mut FixedState<100, 100>,
    rows: &mut [PatchRow; 200],
) -> f32 {
    let material = NodalStrain(Regions { law: NeoHookean::default(), tissues, of_element });
    let mut scene = FixedScene::<_, 100, 20, 200>::new(material);
    let Ok(mesh) = Mesh::new(points, tets, Winding::Normalised) else {
        return -1.0;
    };
    if scene.build(&mesh, supports).is_err() {
        return -2.0;
    }
    let (mut nodes, mut tiles) = ([NodeInertia::EMPTY; 100], [ElementTile::EMPTY; 20]);
    let supports = supports.iter().copied();
    let Ok(facts) = SceneFacts::build(&material, &mesh, supports, &mut nodes, &mut tiles, rows, &mut []) else {
        return -2.0;
    };
    let lent = SceneView::new(&material, &nodes, &tiles, rows, &[], &facts);
    at_critical_step(&scene, state) + at_critical_step(&lent, state)
}

fn at_critical_step<M: ElementMaterial>(scene: &impl AsScene<Material = M>, state: &mut FixedState<100, 100>) -> f32 {
    let Some(critical) = tled::critical_step(scene, state) else {
        return -3.0;
    };
    let Ok(step) = Step::unchecked(0.9 * critical.seconds, 1.0) else {
        return -4.0;
    };
    match tled::step(scene, &Loads::NONE, state, &step) {
        Status::Ok => tled::strain_energy(scene, state).map_or(-5.0, |energy| energy as f32),
        _ => -6.0,
    }
}

/// Renumbers the nodes.
#[unsafe(no_mangle)]
pub extern "C" fn renumber(
    points: &mut [[f32; 3]; 100],
    tets: &mut [[u32; 4]; 300],
    old: &mut [u32; 100],
    new: &mut [u32; 100],
) -> i32 {
    mesh::renumber(points, tets, old, new).map_or(-1, |()| 0)
}

/// The critical step, s.
#[unsafe(no_mangle)]
pub extern "C" fn critical(scene: &Scene<Exponential>, state: &mut State) -> f32 {
    tled::critical_step(scene, state).map_or(0.0, |critical| critical.seconds)
}

/// Starts and takes a step.
#[unsafe(no_mangle)]
pub extern "C" fn step(
    scene: &Scene<Exponential>,
    state: &mut State,
    forces: &[NodalForce; 10],
    motions: &[Motion; 10],
    start: &[[f32; 3]; 100],
    seconds: f32,
) -> i32 {
    let Ok(loads) = Loads::new(scene, [0.0, 0.0, seconds], forces, motions) else {
        return -1;
    };
    let Ok(step) = Step::unchecked(seconds, 1.0) else {
        return -2;
    };
    let started = tled::start(scene, state, &step, |node| (start.get(node).copied().unwrap_or_default(), [0.0; 3]));
    if !started {
        return -3;
    }
    match tled::step(scene, &loads, state, &step) {
        Status::Ok => 0,
        Status::Diverged(divergence) => divergence.node as i32,
        _ => 1,
    }
}

/// Element fields and energy.
#[unsafe(no_mangle)]
pub extern "C" fn fields(scene: &Scene<NeoHookean>, state: &mut State) -> f64 {
    let stresses = scene.view().element_fields(state.displacements()).map(|fields| fields.von_mises);
    stresses.sum::<f64>() + tled::strain_energy(scene, state).unwrap_or(f64::NAN)
}

/// Internal forces of the other law, N.
#[unsafe(no_mangle)]
pub extern "C" fn internal_forces(scene: &Scene<NeoHookean>, state: &mut State) -> f32 {
    let known = tled::internal_forces(scene, state);
    state.forces().iter().map(|force| force.to_array()[0]).sum::<f32>() + f32::from(known)
}

/// Traction turned into forces.
#[unsafe(no_mangle)]
pub extern "C" fn pull(points: &[[f32; 3]; 100], triangles: &[[u32; 3]; 5]) -> f32 {
    traction(points, triangles, [1.0; 3], 0.0).filter_map(Result::ok).map(|force| force.newton[0]).sum()
}

/// The structured bar.
#[unsafe(no_mangle)]
pub extern "C" fn bar(bar: &Bar) -> f32 {
    bar.points().map(|[x, _, _]| x).sum::<f32>() + bar.tets().map(|[a, ..]| a as f32).sum::<f32>()
}

/// Enough for the lattices here.
type Storage = [NodeVector; 16_000];

/// Prepares a method and takes a step of it: error, inertia added and damping.
fn large(
    method: Method,
    scene: &Scene<Exponential>,
    state: &mut State,
    storage: &mut Storage,
    points: &[[f32; 3]; 100],
    loads: &Loads<'_>,
    seconds: f32,
) -> f32 {
    let Ok(step) = Step::unchecked(seconds, 1.0) else {
        return -1.0;
    };
    let (scene, needed) = (scene.view(), vectors_for(&method, scene.view(), points));
    let Some(storage) = needed.ok().and_then(|needed| storage.get_mut(..needed)) else {
        return -2.0;
    };
    let Ok(mut large) = LargeStep::prepare(method, scene, points, state.view(), step, storage) else {
        return -3.0;
    };
    let _ = large.step(scene, loads, state.view());
    let report = large.report();
    report.added_mean + report.damping + large.model().grid().functions as f32
}

/// Long steps: with the lattice that suits, and with another.
#[unsafe(no_mangle)]
pub extern "C" fn long(
    scene: &Scene<Exponential>,
    state: &mut State,
    storage: &mut Storage,
    points: &[[f32; 3]; 100],
    loads: &Loads<'_>,
    cells: &[u32; 3],
    seconds: f32,
) -> f32 {
    let [suggested, given] = [Cells::Suggested, Cells::Given(*cells)].map(Method::new);
    large(suggested, scene, state, storage, points, loads, seconds)
        + large(given, scene, state, storage, points, loads, seconds)
}

/// A weight file, a prediction, a lead-in and a learned step with fallback.
#[unsafe(no_mangle)]
pub extern "C" fn learned(
    scene: &Scene<Exponential>,
    state: &mut State,
    storage: &mut [NodeVector; learned::vectors_for(100, true)],
    weights: &[u8; 100_000],
    length: usize,
    loads: &Loads<'_>,
    outputs: &mut [f32; 8],
    seconds: f32,
) -> i32 {
    let Ok(network) = Network::parse(weights.get(..length).unwrap_or_default()) else {
        return -1;
    };
    network.predict(&outputs.map(|output| output + 1.0), outputs);
    let Ok(mut learned) = LearnedStep::new(network, true, &mut storage[..]) else {
        return network.multiply_adds() as i32;
    };
    let Ok(step) = Step::unchecked(seconds, network.recipe().damping) else {
        return -2;
    };
    if learned.lead(scene.view(), loads, state.view(), (&step, 0.3)).is_err() {
        return -3;
    }
    match learned.step(scene.view(), loads, state.view(), &step) {
        Ok(Status::Ok) => (100.0 * learned.model().report().outside) as i32,
        _ => learned.model().fell_back().is_some().into(),
    }
}

/// Points that follow.
#[unsafe(no_mangle)]
pub extern "C" fn points(
    points: &[[f32; 3]; 100],
    tets: &[[u32; 4]; 300],
    places: &[[f32; 3]; 10],
    state: &mut State,
    memory: &mut [u32; words_for(300)],
    velocities: &mut [[f32; 3]; 10],
) -> i32 {
    let mut located = [FollowedPoint::default(); 10];
    let Ok(mesh) = Mesh::new(points, tets, Winding::Normalised) else {
        return -1;
    };
    if locate(&mesh, places, memory, &mut located).is_err() {
        return -2;
    }
    follow(&located, state, &mut [[0.0; 3]; 10], velocities).map_or(-3, |()| 0)
}

/// A displacement field.
#[unsafe(no_mangle)]
pub extern "C" fn field(
    points: &[[f32; 3]; 100],
    tets: &[[u32; 4]; 300],
    state: &mut State,
    grid: &ImageGrid,
    reach: f32,
    scratch: &mut [f32; 10_000],
    out: &mut [[f32; 3]; 1000],
) -> i32 {
    let Ok(mesh) = Mesh::new(points, tets, Winding::Normalised) else {
        return -1;
    };
    let moved = |node: usize| state.displacements().get(node).copied().unwrap_or_default().to_array();
    let fields = [FieldKind::Forward, FieldKind::Inverse];
    let covered = fields.map(|kind| displacement_field(&mesh, moved, (kind, grid, reach), scratch, out).unwrap_or(0));
    covered.iter().sum::<usize>() as i32
}
