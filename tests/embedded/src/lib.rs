//! Every public path of the core behind C symbols, on data the compiler knows nothing about. The library
//! built from this must link without std, and without `core::panicking`: what could panic would show.
#![no_std]

use supple::inertia::{
    self, Damper, Inertia, LatticeNode, MassScaling, damped_numbers_for, damped_vectors_for, numbers_for, vectors_for,
};
use supple::loads::{Loads, Motion, NodalForce, traction};
use supple::material::{Exponential, Literal, NeoHookean, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::Network;
use supple::numbering;
use supple::scene::{FixedScene, Support};
use supple::state::{FixedState, NodeVector};
use supple::surrogate::{self, Surrogate, Vertex};
use supple::tled::{self, Status, Step};

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

/// Numbers the nodes anew.
#[unsafe(no_mangle)]
pub extern "C" fn renumber(
    points: &mut [[f32; 3]; 100],
    tets: &mut [[u32; 4]; 300],
    old: &mut [u32; 100],
    new: &mut [u32; 100],
) -> i32 {
    numbering::renumber(points, tets, old, new).map_or(-1, |()| 0)
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
    let Ok(step) = Step::insist(seconds, 1.0) else {
        return -2;
    };
    tled::start(scene, state, &step, |node| (start.get(node).copied().unwrap_or_default(), [0.0; 3]));
    match tled::step(scene, &loads, state, &step) {
        Status::Ok => 0,
        Status::Diverged(divergence) => divergence.node as i32,
        _ => 1,
    }
}

/// Element fields and energy.
#[unsafe(no_mangle)]
pub extern "C" fn fields(scene: &Scene<Literal<NeoHookean>>, state: &State) -> f64 {
    let stresses = tled::element_fields(scene, state.displacements()).map(|fields| fields.von_mises);
    stresses.sum::<f64>() + tled::strain_energy(scene, state)
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

type Vectors = [NodeVector; vectors_for(100)];

/// Mass scaling: prepared, and a step.
#[unsafe(no_mangle)]
pub extern "C" fn scaled(
    scene: &Scene<Exponential>,
    state: &mut State,
    scaling: &mut MassScaling<Vectors>,
    points: &[[f32; 3]; 100],
    loads: &Loads<'_>,
    seconds: f32,
) -> f32 {
    let Ok(step) = Step::insist(seconds, 1.0) else {
        return -1.0;
    };
    if scaling.prepare(scene, points, state, step, [0; 3]).is_err() {
        return -2.0;
    }
    let _ = inertia::step(scene, loads, state, scaling);
    scaling.report().added_mean
}

/// Cells and functions of the largest lattice here.
const LATTICE: [u32; 3] = [2, 2, 2];
type Multilevel = Inertia<Vectors, [LatticeNode; 100], [f32; numbers_for(LATTICE, 27)]>;

/// Multilevel inertia: the lattice that suits, prepared with another, and a step.
#[unsafe(no_mangle)]
pub extern "C" fn multilevel(
    scene: &Scene<Exponential>,
    state: &mut State,
    multilevel: &mut Multilevel,
    points: &[[f32; 3]; 100],
    loads: &Loads<'_>,
    cells: &[u32; 3],
    seconds: f32,
) -> f32 {
    let Ok(step) = Step::insist(seconds, 1.0) else {
        return -1.0;
    };
    let (suggested, functions) = inertia::suggested_lattice(scene, points);
    if inertia::lattice_functions(scene, points, *cells).is_err() || functions > 27 {
        return -2.0;
    }
    let _ = multilevel.prepare(scene, points, state, step, suggested);
    if multilevel.prepare(scene, points, state, step, *cells).is_err() {
        return -3.0;
    }
    let _ = inertia::step(scene, loads, state, multilevel);
    multilevel.report().error + multilevel.functions() as f32
}

type Damped = Inertia<
    [NodeVector; damped_vectors_for(100)],
    [LatticeNode; 100],
    [f32; damped_numbers_for(LATTICE, 27)],
>;

/// Multilevel inertia with rough motion damped; of [`Inertia::damped`].
#[unsafe(no_mangle)]
pub extern "C" fn damped(
    scene: &Scene<Exponential>,
    state: &mut State,
    damped: &mut Damped,
    points: &[[f32; 3]; 100],
    loads: &Loads<'_>,
    weights: &[u8; 10_000],
    cells: &[u32; 3],
    seconds: f32,
) -> f32 {
    let (Ok(step), Ok(network)) = (Step::insist(seconds, 1.0), Network::parse(weights)) else {
        return -1.0;
    };
    let Ok(damper) = Damper::over(network) else {
        return -2.0;
    };
    if damped.prepare(scene, points, state, step, *cells).is_err() {
        return -3.0;
    }
    let _ = inertia::damped_step(scene, loads, state, damped, Some(&damper));
    damped.report().damping
}

/// A weight file, a prediction, a learned step.
#[unsafe(no_mangle)]
pub extern "C" fn learned(
    scene: &Scene<Exponential>,
    state: &mut State,
    vertices: &mut [Vertex; 100],
    weights: &[u8; 100_000],
    length: usize,
    loads: &Loads<'_>,
    outputs: &mut [f32; 8],
) -> i32 {
    let Ok(network) = Network::parse(weights.get(..length).unwrap_or_default()) else {
        return -1;
    };
    network.predict(&outputs.map(|output| output + 1.0), outputs);
    let Ok(mut surrogate) = Surrogate::over(network, &mut vertices[..]) else {
        return network.multiply_adds() as i32;
    };
    let earlier = [NodeVector::ZERO; 100];
    state.span(&earlier, surrogate.seconds());
    surrogate.follow(state);
    match surrogate::step(scene, loads, state, &mut surrogate) {
        Status::Ok => (100.0 * surrogate.report().outside) as i32,
        _ => 1,
    }
}
