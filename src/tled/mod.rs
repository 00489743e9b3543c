//! The exact step: total Lagrangian explicit dynamics (Miller et al. 2007). Lumped mass, mass-proportional
//! damping `mu` (1/s), central differences in increment form:
//!
//! ```text
//! du = ((1 - k) du + dt^2 f / m) / (1 + k),   u += du,   k = mu dt / 2
//! ```
//! Algebraically the paper's `u+ = a dt^2 + 2 u - u-`, without its rounding ([`crate::state`]). Forces are
//! taken at `t_n`, prescribed positions at `t_(n+1)`. SI units.

mod carry_on;
mod central_differences;
mod conjugate;
mod critical;
mod displace;
mod pace;
#[cfg(feature = "std")]
mod pressures;
mod relaxation;
mod settle;
#[cfg(feature = "std")]
mod spectrum;
#[cfg(feature = "std")]
mod tangent;

pub use carry_on::carry_on;
#[cfg(feature = "capi-neo-hookean")]
pub(crate) use carry_on::carry_on_in;
pub use critical::critical_step;
pub(crate) use critical::each_rate;
pub use displace::{DisplacementError, displace};
pub use pace::{Approach, Pace, vectors_for_pace};
#[cfg(feature = "std")]
pub use pressures::nodal_pressures;
pub use settle::{SettleError, Settled, settle, settle_in_parts, vectors_to_settle};
#[cfg(feature = "std")]
pub use spectrum::exact_critical_step;
#[cfg(feature = "std")]
pub use tangent::{ElementTangent, element_tangents};

use core::ops::Range;

use crate::element::{self, ElementMaterial, LOOK_CYCLE, NoVisitor, NodeInertia};
use crate::loads::Loads;
use crate::material::Material;
use crate::scene::{AsScene, SceneView};
use crate::simd::{NodeVector, TILE};
use crate::state::{AsState, StateView};
use crate::step::pulls::MOST_WAY;
use crate::step::{
    self, CallingThread, Cause, Computed, EnergyBalance, Moving, Status, Step, StepMethod, Threads, TotalForces,
    Totals, Trial, move_in_parts, nodal_volumes, write_volumes,
};
use central_differences::{Advance, EnergyInput, next_increment};

/// Takes one step. Every call does the same work for the same scene and loads.
pub fn step(scene: &impl AsScene, loads: &Loads<'_>, state: &mut impl AsState, step: &Step) -> Status {
    step_in_parts(scene.as_scene(), loads, state.as_state(), step, &CallingThread)
}

/// The same step, to the bit, on several threads of the host.
pub fn step_in_parts<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    loads: &Loads<'_>,
    state: StateView<'_>,
    step: &Step,
    threads: &impl Threads,
) -> Status {
    let step = step.following(state.dt);
    match Trial::begin(scene, loads, state, usize::MAX) {
        Ok(trial) => trial.take(&step, &mut Exact { step: &step, threads }),
        Err(refused) => refused,
    }
}

struct Exact<'a, T> {
    step: &'a Step,
    threads: &'a T,
}

impl<M: ElementMaterial, T: Threads> StepMethod<M> for Exact<'_, T> {
    const ENERGY_CYCLE: usize = 2048;

    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed {
        let (inertia, step, loads) = (trial.scene.inertia, self.step, trial.loads);
        let (instruments, is_pulled) = (loads.contact().is_some(), loads.pulls().is_some());
        let TotalForces { forcing, increment, volume, force, after } = trial.forcing(NoVisitor, LOOK_CYCLE);
        let total = |nodes: Range<usize>, increment: &[NodeVector], force: &[NodeVector]| {
            let inertia = inertia.get(nodes.clone()).unwrap_or_default();
            let increment = increment.get(nodes).unwrap_or_default();
            EnergyInput { step, inertia, increment, force }.total(instruments)
        };
        let totals_of = |nodes: Range<usize>, force: &[NodeVector], _: &mut [()]| {
            // The forces of pulls are not among these yet.
            if is_pulled { Totals::NONE } else { total(nodes, increment, force) }
        };
        let (totals, extremes) = forcing.in_parts(volume, force, &mut [], after, self.threads, totals_of);
        let mut totals = Totals::of_all(&totals);
        if is_pulled {
            let work = trial.pull(step, self, MOST_WAY);
            let all = 0..trial.scene.node_count();
            totals = total(all, trial.increment, trial.force);
            totals.add_work(work);
        }
        trial.meet_instruments(step, self, &mut totals);
        Computed { totals, extremes }
    }

    fn next_increment(&self, _: usize, inertia: &NodeInertia, increment: &NodeVector, force: &NodeVector) -> [f32; 4] {
        next_increment(inertia, increment, force, self.step)
    }

    fn meets_instruments(&self, trial: &Trial<'_, M>) -> bool {
        trial.surface().triangles().is_empty() || trial.has_room_for_pushes()
    }

    fn follows_pulls(&self, trial: &Trial<'_, M>) -> bool {
        trial.has_room_for_pulls()
    }

    fn refused_load(&self, trial: &Trial<'_, M>) -> Option<(u32, Cause)> {
        trial.tearing_force(self.step, self)
    }

    fn advance(&mut self, trial: &mut Trial<'_, M>) {
        let Trial { scene, displacement, remainder, increment, force, .. } = trial;
        let moving = Moving { displacement, remainder, increment };
        let (inertia, force, step) = (scene.inertia, &**force, self.step);
        let partitions = scene.elements().partitions;
        move_in_parts(partitions, moving, self.threads, |nodes, moving| {
            let inertia = inertia.get(nodes.clone()).unwrap_or_default();
            let force = force.get(nodes).unwrap_or_default();
            Advance { step, inertia, moving, force }.advance();
        });
    }
}

/// Floating-point operations of the internal forces.
#[must_use]
pub fn element_operations<M: Material>(scene: SceneView<'_, M>) -> u64 {
    let law = scene.material.laws().law();
    let more = u64::from(element::extension_operations(scene.families(), scene.terms()));
    if scene.element().is_nodal_strain() {
        return scene.patches.operations(&law) + more * (TILE * scene.patches.tiles().len()) as u64;
    }
    let nodal = if scene.element().is_nodal_pressure() { element::NODAL_PRESSURE_OPERATIONS } else { 0 };
    scene.element_count() as u64 * (u64::from(element::operations(&law) + nodal) + more)
}

/// Floating-point operations of one step without loads, the same for every step.
#[must_use]
pub fn operations<M: Material>(scene: SceneView<'_, M>) -> u64 {
    // Per node: twice the next increment of four components (3 each), kinetic energy and momentum (6 each),
    // the new position (1 each).
    const NODE: u64 = 4 * (2 * 3 + 6 + 1);
    element_operations(scene) + scene.node_count() as u64 * NODE
}

/// Puts the scene at the displacement (m) and velocity (m/s) that `at` gives for each node, at time zero.
/// Held axes keep what is given until a motion moves them. Returns whether the state has room for the scene.
#[must_use = "a state without room for the scene is at rest"]
pub fn start(
    scene: &impl AsScene,
    state: &mut impl AsState,
    step: &Step,
    at: impl Fn(usize) -> ([f32; 3], [f32; 3]),
) -> bool {
    let (scene, mut state) = (scene.as_scene(), state.as_state());
    state.reset();
    if state.capacity() < scene.node_count() {
        return false;
    }
    let mut kinetic = 0.0;
    let vectors = state.displacement.iter_mut().zip(state.increment.iter_mut());
    for (node, ((displacement, increment), inertia)) in vectors.zip(scene.inertia).enumerate() {
        let ([ux, uy, uz], velocity) = at(node);
        displacement.0 = [ux, uy, uz, 0.0];
        for (axis, speed) in velocity.into_iter().enumerate() {
            if inertia.inverse[axis] > 0.0 {
                increment.0[axis] = speed * step.seconds();
                kinetic += 0.5 * f64::from(inertia.mass) * f64::from(speed) * f64::from(speed);
            }
        }
    }
    let Some(strain) = strain_energy_of(scene, state.reborrow()) else { return false };
    state.progress.dt = step.seconds();
    state.progress.energy_balance.start = kinetic + strain + scene.rounding_energy();
    true
}

/// Stops all motion: displacements and time stay, velocities are zero, and the energy balance begins with the strain
/// energy. To go on from a state that no step can be taken from, because it has more energy than loads and supports
/// gave. Returns whether the state has room for the scene.
#[must_use = "a state without room for the scene goes on moving"]
pub fn stop(scene: &impl AsScene, state: &mut impl AsState) -> bool {
    stop_in(scene.as_scene(), state.as_state())
}

/// See [`stop`].
pub(crate) fn stop_in<M: ElementMaterial>(scene: SceneView<'_, M>, mut state: StateView<'_>) -> bool {
    let Some(strain) = strain_energy_of(scene, state.reborrow()) else { return false };
    state.increment.fill(NodeVector::ZERO);
    (state.progress.dt, state.progress.seen) = (0.0, None);
    let start = strain + scene.rounding_energy();
    state.progress.energy_balance = EnergyBalance { start, peak: start, ..EnergyBalance::NEW };
    true
}

/// Strain energy of the scene at the state's displacements, J, zero at rest. Nothing if the state has no room for the
/// scene.
pub fn strain_energy(scene: &impl AsScene, state: &mut impl AsState) -> Option<f64> {
    strain_energy_of(scene.as_scene(), state.as_state())
}

fn strain_energy_of<M: ElementMaterial>(scene: SceneView<'_, M>, state: StateView<'_>) -> Option<f64> {
    let nodes = scene.node_count();
    if state.capacity_for(scene.element()) < nodes {
        return None;
    }
    nodal_volumes(scene, state.displacement, &[], state.volume, &CallingThread);
    Some(scene.strain_energy(state.displacement, state.volume, state.remembered()))
}

/// Forces with which the elements act on the nodes at the state's displacements, N ([`crate::state::State::forces`],
/// until the next step). Returns whether the state has room for the scene.
#[must_use = "a state without room for the scene has no forces"]
pub fn internal_forces(scene: &impl AsScene, state: &mut impl AsState) -> bool {
    internal_forces_of(scene.as_scene(), state.as_state())
}

fn internal_forces_of<M: ElementMaterial>(scene: SceneView<'_, M>, state: StateView<'_>) -> bool {
    let nodes = scene.node_count();
    if state.capacity_for(scene.element()) < nodes {
        return false;
    }
    let StateView { displacement, force, volume, .. } = state;
    let force = force.get_mut(..nodes).unwrap_or_default();
    write_volumes(scene, displacement, volume, &CallingThread);
    force.fill(NodeVector::ZERO);
    step::internal_forces(
        scene,
        scene.elements().partitions.all(),
        [displacement, &[]],
        volume,
        force,
        NoVisitor,
        None,
    );
    true
}
