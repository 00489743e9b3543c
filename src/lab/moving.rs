//! Scenes of the laboratory that fall, turn, swing and sag: bodies that no slow ramp holds near equilibrium. Each comes
//! in three tissues, whose bulk modulus is 10, 50 and 1000 times the shear modulus. SI units.
//!
//! A multiple here is of nearly the critical step at rest, so that 20 means twenty times what the exact step can take.

use supple::loads::{Motion, NodalForce};
use supple::material::{AnyLaw, Exponential, NeoHookean};
use supple::mesh::Bar;
use supple::scene::{Axes, Support};
use supple::state::VecState;
use supple::tled;

use super::LabError;
use super::scenes::{LOBE, RigidVelocity, SceneSpec, bar, held_at_its_end};
use super::timing::Timing;

/// Makes a scene of tissue with this bulk over shear modulus.
type Make = fn(f32) -> Result<Scene, LabError>;

/// Scenes with the names of their three tissues.
const SCENES: [(Make, [&str; 3]); 8] = [
    (free_fall, ["free-fall-10", "free-fall-50", "free-fall-1000"]),
    (free_spin, ["free-spin-10", "free-spin-50", "free-spin-1000"]),
    (pendulum, ["pendulum-10", "pendulum-50", "pendulum-1000"]),
    (whip, ["whip-10", "whip-50", "whip-1000"]),
    (fast_pull, ["fast-pull-10", "fast-pull-50", "fast-pull-1000"]),
    (soft_sag, ["soft-sag-10", "soft-sag-50", "soft-sag-1000"]),
    (couple, ["couple-10", "couple-50", "couple-1000"]),
    (lift, ["lift-10", "lift-50", "lift-1000"]),
];
/// Bulk over shear modulus of the three tissues.
const RATIOS: [f32; 3] = [10.0, 50.0, 1000.0];

/// m/s^2.
const G: f32 = 9.81;

/// A scene before its step is known.
struct Scene {
    spec: SceneSpec,
    seconds: f32,
    refinement: u32,
}

/// The names of all these scenes, in the order of the tables.
pub fn names() -> impl Iterator<Item = &'static str> {
    SCENES.into_iter().flat_map(|(_, names)| names)
}

/// The scene with this name, if it is one of these.
pub(super) fn named(name: &str) -> Option<Result<SceneSpec, LabError>> {
    SCENES.into_iter().find_map(|(make, names)| {
        let (name, ratio) = names.into_iter().zip(RATIOS).find(|(of, _)| *of == name)?;
        Some(make(ratio).and_then(|scene| finished(name, scene)))
    })
}

/// Counts time in steps just below the bound of the critical step at rest.
fn finished(name: &'static str, scene: Scene) -> Result<SceneSpec, LabError> {
    const MARGIN: f32 = 0.95;
    let Scene { mut spec, seconds, refinement } = scene;
    spec.name = name;
    let bound = critical_step(&spec)?;
    (spec.timing, spec.intervals) = Timing::of_longest(MARGIN * bound, seconds, refinement);
    Ok(spec)
}

/// The bound of the critical step of a scene at rest, s.
pub fn critical_step(spec: &SceneSpec) -> Result<f32, LabError> {
    let scene = spec.build()?;
    let bound = tled::critical_step(&scene, &mut VecState::at_rest(scene.node_count()));
    bound.map(|bound| bound.seconds).ok_or(LabError::NoCriticalStep { scene: spec.name })
}

/// Neo-Hookean tissue with half the shear modulus `c`, Pa.
pub(super) fn neo_hookean(c: f32, ratio: f32) -> AnyLaw {
    AnyLaw::NeoHookean(NeoHookean { c, d: c * ratio })
}

/// A bar along z with a damping (1/s), free.
pub(super) fn free_bar(size: [f32; 3], cells: [u32; 3], law: AnyLaw, damping: f32) -> SceneSpec {
    let shape = Bar { size, cells };
    let (points, tets) = (shape.points().collect(), shape.tets().collect());
    SceneSpec { points, tets, law, damping, supports: Vec::new(), ..bar("", Vec::new()) }
}

pub(super) fn nodes_where(spec: &SceneSpec, holds: impl Fn([f32; 3]) -> bool) -> Vec<u32> {
    (0..).zip(&spec.points).filter(|(_, point)| holds(**point)).map(|(node, _)| node).collect()
}

pub(super) fn hold(spec: &mut SceneSpec, holds: impl Fn([f32; 3]) -> bool) {
    spec.supports = nodes_where(spec, holds).into_iter().map(Support::fixed).collect();
}

/// The liver lobe without support falls by 0.44 m.
fn free_fall(ratio: f32) -> Result<Scene, LabError> {
    let (mut spec, _) = held_at_its_end("", LOBE)?;
    spec.law = neo_hookean(1_500.0, ratio);
    spec.supports.clear();
    spec.damping = 0.0;
    spec.gravity = [0.0, 0.0, -G];
    Ok(Scene { spec, seconds: 0.3, refinement: 2 })
}

/// A free bar that moves and turns about its short axis: half a turn.
fn free_spin(ratio: f32) -> Result<Scene, LabError> {
    let mut spec = free_bar([0.02, 0.02, 0.1], [4, 4, 20], neo_hookean(2_000.0, ratio), 0.0);
    spec.start = RigidVelocity { linear: [0.2, 0.0, 0.0], angular: [0.0, 6.0, 0.0] };
    Ok(Scene { spec, seconds: 0.5, refinement: 2 })
}

/// A soft bar that swings down about a hinge.
fn pendulum(ratio: f32) -> Result<Scene, LabError> {
    let mut spec = free_bar([0.02, 0.02, 0.1], [3, 3, 12], neo_hookean(2_000.0, ratio), 0.0);
    hold(&mut spec, |[x, _, z]| x == 0.0 && z == 0.0);
    spec.gravity = [G, 0.0, 0.0];
    Ok(Scene { spec, seconds: 0.4, refinement: 2 })
}

/// A thin bar, held at one end, that bends down and swings back.
fn whip(ratio: f32) -> Result<Scene, LabError> {
    let mut spec = free_bar([0.01, 0.01, 0.2], [2, 2, 32], neo_hookean(5_000.0, ratio), 0.0);
    hold(&mut spec, |[_, _, z]| z == 0.0);
    spec.gravity = [G, 0.0, 0.0];
    Ok(Scene { spec, seconds: 0.5, refinement: 2 })
}

/// The paper's bar under its law and with its bulk modulus, stretched by half its length in 0.04 s and held there: it
/// becomes a hundred times as stiff, so that the truth takes shorter steps.
fn fast_pull(ratio: f32) -> Result<Scene, LabError> {
    const D: f32 = 60_000.0;
    let Bar { cells: [nx, ny, nz], .. } = Bar::PAPER;
    let mut spec = bar("", Vec::new());
    spec.law = AnyLaw::Exponential(Exponential { a: 2.0 * D / ratio, b: 8.023, d: D });
    spec.motions = (Bar::PAPER.node(0, 0, nz)..=Bar::PAPER.node(nx, ny, nz))
        .map(|node| Motion { node, axes: Axes::XYZ, metre: [0.0, 0.0, 0.05], ramp: 0.04 })
        .collect();
    spec.supports.extend(spec.motions.iter().map(|motion| Support::moved(motion.node)));
    spec.damping = 5.0;
    Ok(Scene { spec, seconds: 0.3, refinement: 10 })
}

/// A bar of fat (Young's modulus 3 kPa where the ratio is 10) that sinks under its own weight.
fn soft_sag(ratio: f32) -> Result<Scene, LabError> {
    let mut spec = free_bar([0.03, 0.03, 0.1], [4, 4, 13], neo_hookean(517.0, ratio), 15.0);
    hold(&mut spec, |[_, _, z]| z == 0.0);
    spec.gravity = [0.0, G, 0.0];
    Ok(Scene { spec, seconds: 1.0, refinement: 2 })
}

/// A free cube that a couple of forces on two of its faces turns.
fn couple(ratio: f32) -> Result<Scene, LabError> {
    const SIDE: f32 = 0.02;
    /// Of each node of a face, N.
    const NEWTON: f32 = 4e-5;
    let mut spec = free_bar([SIDE; 3], [6, 6, 6], neo_hookean(2_000.0, ratio), 0.0);
    spec.forces = [(0.0, -NEWTON), (SIDE, NEWTON)]
        .into_iter()
        .flat_map(|(face, newton)| nodes_where(&spec, |[x, ..]| x == face).into_iter().map(move |node| (node, newton)))
        .map(|(node, newton)| NodalForce { node, newton: [0.0, newton, 0.0], ramp: 0.0 })
        .collect();
    Ok(Scene { spec, seconds: 0.3, refinement: 2 })
}

/// The liver lobe, gripped at one side and lifted by 50 mm in a quarter of a second, while the rest hangs down.
fn lift(ratio: f32) -> Result<Scene, LabError> {
    let (mut spec, _) = held_at_its_end("", LOBE)?;
    spec.law = neo_hookean(3_000.0, ratio);
    spec.motions = spec
        .supports
        .iter()
        .map(|support| Motion { node: support.node, axes: Axes::XYZ, metre: [0.0, 0.0, 0.05], ramp: 0.25 })
        .collect();
    spec.supports = spec.motions.iter().map(|motion| Support::moved(motion.node)).collect();
    spec.gravity = [0.0, 0.0, -G];
    spec.damping = 5.0;
    Ok(Scene { spec, seconds: 0.4, refinement: 2 })
}
