//! What a scene costs: critical step, memory, time of a step, and the same for steps beyond the critical one.

use std::time::Instant;

use supple::element::{ElementTile, NodeInertia, PatchRow};
use supple::inertia::{Cells, Method, vectors_for_lattice};
use supple::loads::Loads;
use supple::material::{Element, Moduli, VecMaterial};
use supple::scene::{SceneView, tiles_for};
use supple::state::{NodeVector, VecState};
use supple::step::{CriticalStep, Step};
use supple::tled;

use super::doubling::Pilots;
use super::learned_cost;
use super::times::{Times, Walker};
use crate::added_mass::describe_added;
use crate::problem::Problem;
use crate::run::start::{first_step, grid};
use crate::scene::setup::Setup;
use crate::screen::{output, row};

/// Exact steps that are timed.
const TIMED: u32 = 300;

/// Critical step, memory and cost of a scene; `accuracy` is the error that a recommended step may have, mm.
pub(crate) fn describe(setup: &Setup, mut pilots: Pilots, accuracy: Option<f64>) -> Result<(), Problem> {
    let (scene, mut state) = setup.build()?;
    let scene = scene.view();
    row("material", &setup.tissues);
    for (tissue, moduli) in setup.tissues.moduli().enumerate() {
        let name = if tissue == 0 { "moduli at rest".into() } else { format!("of region {tissue}") };
        row(&name, describe_moduli(moduli));
    }
    row("element", setup.element.name());
    row("mass", format!("{:.3} g", 1e3 * scene.mass()));
    if !setup.instruments.is_empty() {
        row("instruments", &setup.instruments);
    }
    row("elements left out", setup.body.mesh.tets.len() - scene.element_count());
    let bound = tled::critical_step(&scene, &mut state)
        .ok_or_else(|| Problem("the stiffness of some element is not a finite number".into()))?;
    describe_limits(scene, &state, bound);
    let step = first_step(setup, bound, false);
    let loads = setup.loads(&scene)?;
    describe_memory(scene);
    let seconds = describe_exact(setup, scene, &mut state, &loads, bound)?;
    if setup.time.method.is_none() {
        let wanted = step.as_ref().map_or(bound.seconds, |step| step.seconds());
        row("real-time factor", real_time(wanted, seconds));
    }
    let long = long_method(setup, scene)?;
    let times = match &long {
        Some(method) => {
            let times = describe_beyond(method, setup, scene, &loads, bound)?;
            pilots.predict_errors(method, bound)?;
            Some(times)
        }
        None => {
            row("long steps", "none: the mesh is too small for a lattice");
            None
        }
    };
    if let Some(learned) = &setup.learned {
        learned_cost::describe(learned, setup, scene, &loads)?;
    }
    let step = step?;
    if let (Some(times), true) = (&times, setup.time.method.is_some()) {
        row("real-time factor", real_time(step.seconds(), times.long));
    }
    match (accuracy, &long, &times) {
        (Some(accuracy), Some(method), Some(times)) => pilots.recommend(method, bound, accuracy, times),
        _ => Ok(()),
    }
}

fn describe_moduli(moduli: Moduli) -> String {
    let kilo = |pascal: f64| 1e-3 * pascal;
    format!(
        "E {:.4} kPa, nu {:.5} (shear modulus {:.4} kPa, bulk modulus {:.4} kPa)",
        kilo(moduli.young()),
        moduli.poisson_ratio(),
        kilo(moduli.shear),
        kilo(moduli.bulk)
    )
}

fn real_time(step: f32, spent: f64) -> String {
    format!("{:.3} at {step:.3e} s a step", f64::from(step) / spent)
}

/// Prints the critical step at rest, as a bound and as it is.
fn describe_limits(scene: SceneView<'_, VecMaterial>, state: &VecState, bound: CriticalStep) {
    row("critical step", format!("{:.4e} s at rest, which node {} sets (a bound, safe)", bound.seconds, bound.node));
    match tled::exact_critical_step(scene, state.displacements()) {
        Some(exact) => row(
            "exact limit",
            format!("{exact:.4e} s at rest; the bound is {:.2} of it", f64::from(bound.seconds) / exact),
        ),
        None => row("exact limit", "not found: the iteration did not settle"),
    }
}

/// Prints the memory of scene and state.
fn describe_memory(scene: SceneView<'_, VecMaterial>) {
    let vectors = if scene.element() == Element::Linear { 3 } else { 4 };
    let of_node = size_of::<NodeInertia>() + vectors * size_of::<NodeVector>();
    let tiles =
        tiles_for(scene.element_count()) * size_of::<ElementTile>() + scene.patch_row_count() * size_of::<PatchRow>();
    row("memory", format!("{:.1} kB", (scene.node_count() * of_node + tiles) as f64 * 1e-3));
}

/// Prints what an exact step costs. Gives its time, s.
fn describe_exact(
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    state: &mut VecState,
    loads: &Loads<'_>,
    bound: CriticalStep,
) -> Result<f64, Problem> {
    let operations = tled::operations(scene);
    row("operations per step", format!("{operations} floating-point operations"));
    let step = Step::unchecked(0.5 * bound.seconds, setup.damping).map_err(Problem::of)?;
    let start = Instant::now();
    for _ in 0..TIMED {
        // Only the time counts here; what becomes of the motion is for `simulate`.
        let _ = tled::step(&scene, loads, state, &step);
    }
    let seconds = start.elapsed().as_secs_f64() / f64::from(TIMED);
    let gflops = operations as f64 / seconds * 1e-9;
    row("time per step", format!("{:.1} us here and now, {gflops:.1} GFLOP/s", 1e6 * seconds));
    Ok(seconds)
}

/// The method that long steps of the scene have, or would have. None if the mesh is too small for them.
fn long_method(setup: &Setup, scene: SceneView<'_, VecMaterial>) -> Result<Option<Method>, Problem> {
    if let Some(method) = &setup.time.method {
        grid(setup, scene, method)?;
        return Ok(Some(*method));
    }
    let method = Method::new(Cells::Suggested);
    let grid = method.grid(scene, &setup.body.local).map_err(Problem::of)?;
    Ok((grid.functions > 0).then_some(method))
}

/// Prints what steps beyond the critical one need and do at rest.
fn describe_beyond(
    method: &Method,
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    loads: &Loads<'_>,
    bound: CriticalStep,
) -> Result<Times, Problem> {
    output!("\nlong steps");
    let points = &setup.body.local;
    let suggested = Method::new(Cells::Suggested).grid(scene, points).map_err(Problem::of)?;
    let own = method.grid(scene, points).map_err(Problem::of)?;
    match suggested.functions {
        0 => row("lattice suggested", "none, too few elements"),
        _ => row("lattice suggested", suggested),
    }
    if own != suggested {
        row("lattice of the scene", own);
    }
    let vectors = vectors_for_lattice(scene.element(), scene.node_count(), scene.element_count(), own);
    let kilobytes = 1e-3 * (vectors * size_of::<NodeVector>()) as f64;
    row("memory of inertia", format!("{kilobytes:.1} kB, besides the above"));
    let times = Times::measured(method, setup, scene, loads, bound)?;
    let Times { exact, long } = times;
    row("long step", format!("{:.1} us, {:.2} times an exact one's {:.1} us", 1e6 * long, long / exact, 1e6 * exact));
    for multiple in [10.0, 20.0, 50.0] {
        let added = match Walker::new(method, setup, scene, multiple * bound.seconds) {
            Ok(walker) => describe_added(walker.step.report()),
            Err(problem) => format!("no such steps: {problem}"),
        };
        row(&format!("added mass at {multiple}x"), added);
    }
    Ok(times)
}
