//! The exact step: total Lagrangian explicit dynamics (Miller et al. 2007). Lumped mass, mass-proportional
//! damping `mu` (1/s), central differences in increment form:
//!
//! ```text
//! du = ((1 - k) du + dt^2 f / m) / (1 + k),   u += du,   k = mu dt / 2
//! ```
//! Algebraically the paper's `u+ = a dt^2 + 2 u - u-`, without its rounding ([`crate::state`]). Forces are
//! taken at `t_n`, prescribed positions at `t_(n+1)`. SI units.
//!
//! A step is computed in full before anything moves: if it cannot be believed, the state stays as it was.

mod critical;
mod element;
mod energy;
mod entry;
mod parts;
#[cfg(feature = "std")]
mod spectrum;
#[cfg(test)]
mod test_scene;

pub use critical::{CriticalStep, critical_step};
pub use energy::{ElementFields, element_fields};
#[cfg(feature = "std")]
pub use spectrum::exact_critical_step;

use core::fmt;
use core::ops::Range;

use crate::loads::Loads;
use crate::material::{Law, Material};
use crate::scene::{ElementBlock, NodeInertia, Scene};
use crate::state::{NodeVector, State};
use crate::threads::{Alone, Threads};

pub(crate) use critical::CriticalBounds;
pub(crate) use element::{Beside, Deformation, Extremes, Nothing};
use entry::{Account, Advance, next_increment};
pub(crate) use entry::{Entry, Next, Side, Sums, Totals};
pub use parts::InternalForces;
pub(crate) use parts::{Forcing, external_forces, move_in_parts};

/// Coefficients of the integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    dt: f32,
    damping: f32,
    /// Seconds over which a force acts: the mean of the steps before and after it.
    span: f32,
    /// What the last increment would be had it spanned `dt`, over what it is.
    carry: f32,
    /// Factors of the carried increment and of force over mass.
    keep: f32,
    push: f32,
}

/// Why a step was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// The step is not a finite positive number.
    Step {
        /// The step, s.
        seconds: f32,
    },
    /// The damping is negative or not finite.
    Damping {
        /// The damping, 1/s.
        damping: f32,
    },
    /// The step is above the bound of stability. [`Step::insist`] takes it all the same.
    AboveCritical {
        /// The step, s.
        seconds: f32,
        /// The bound.
        critical: CriticalStep,
    },
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Step { seconds } => {
                write!(f, "the step is {seconds} s, it must be a finite positive number")
            }
            Self::Damping { damping } => write!(f, "the damping is {damping} 1/s, it must be zero or more"),
            Self::AboveCritical { seconds, critical } => write!(
                f,
                "the step of {seconds:.3e} s is above the stable {:.3e} s, which node {} sets",
                critical.seconds, critical.node
            ),
        }
    }
}

impl core::error::Error for StepError {}

impl Step {
    /// A step of `dt` seconds with mass-proportional damping (1/s), refused above the critical step.
    pub fn new(dt: f32, damping: f32, critical: CriticalStep) -> Result<Self, StepError> {
        let step = Self::insist(dt, damping)?;
        if dt > critical.seconds {
            return Err(StepError::AboveCritical { seconds: dt, critical });
        }
        Ok(step)
    }

    /// The same without asking for stability.
    pub fn insist(dt: f32, damping: f32) -> Result<Self, StepError> {
        // The square of the step must be a normal number as well.
        if !(dt.is_finite() && dt > 1e-18) {
            return Err(StepError::Step { seconds: dt });
        }
        if !(damping.is_finite() && damping >= 0.0) {
            return Err(StepError::Damping { damping });
        }
        Ok(Self::after(dt, dt, damping))
    }

    /// Central differences with a step that changes: `v+ = v- + (h + dt) / 2 a` after a step of `h`.
    fn after(h: f32, dt: f32, damping: f32) -> Self {
        let span = 0.5 * (h + dt);
        let k = 0.5 * damping * span;
        Self { dt, damping, span, carry: dt / h, keep: (1.0 - k) / (1.0 + k), push: dt * span / (1.0 + k) }
    }

    /// The step, s.
    #[must_use]
    pub const fn seconds(&self) -> f32 {
        self.dt
    }

    /// The damping, 1/s.
    #[must_use]
    pub const fn damping(&self) -> f32 {
        self.damping
    }

    /// What an increment over `h` seconds would be had it spanned this step, over what it is.
    pub(crate) fn carried_from(self, h: f32) -> Self {
        if h > 0.0 { Self { carry: self.dt / h, ..self } } else { self }
    }

    pub(crate) const fn carry(&self) -> f32 {
        self.carry
    }
}

/// What became of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use = "a step that diverged has not moved the state"]
#[non_exhaustive]
pub enum Status {
    /// The step was taken.
    Ok,
    /// The step was taken, but is not exact: some elements are beyond the range of their law (squeezed below
    /// [`J_FLOOR`](crate::material::J_FLOOR) or stretched beyond the exponent cap, where the law goes on along its tangent), or there
    /// is more kinetic energy than the account explains ([`crate::Ledger`]). For a step with scaled inertia
    /// also: much of the motion was held back ([`crate::inertia::Report`]).
    Limited {
        /// Smallest volume ratio of an element.
        least_volume_ratio: f32,
        /// Largest exponent over its cap; above 1 the cap was hit.
        saturation: f32,
        /// Kinetic energy beyond the account, as a share of the most that was ever in it; zero if none.
        energy_excess: f32,
    },
    /// The step was not taken and the state is as before.
    Diverged(Divergence),
    /// The step was not taken: the state has room for fewer nodes than the scene, or the loads were
    /// checked against a scene with another number of nodes.
    Mismatch {
        /// Nodes of the scene.
        nodes: usize,
        /// Nodes that the state has room for.
        room: usize,
    },
}

/// Where and when a simulation stopped being believable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// Start of the refused step, s.
    pub time: f64,
    /// The first node that is not finite, or else the one with the most kinetic energy.
    pub node: u32,
    /// What was wrong.
    pub cause: Cause,
}

/// What was wrong with a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// A displacement would not be a finite number.
    NotFinite,
    /// There is several times more kinetic energy than loads and supports can have given.
    Energy {
        /// Kinetic energy, J.
        kinetic: f64,
        /// The most that was ever in the energy account, J.
        available: f64,
    },
}

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "diverged at {:.6} s, first at node {}: ", self.time, self.node)?;
        match self.cause {
            Cause::NotFinite => write!(f, "its displacement is no longer a finite number"),
            Cause::Energy { kinetic, available } => write!(
                f,
                "kinetic energy {kinetic:.3e} J, but loads and supports never gave more than {available:.3e} J"
            ),
        }
    }
}

/// Takes one step. Every call does the same work for the same scene and loads.
pub fn step<M, N, B, S>(
    scene: &Scene<M, N, B>,
    loads: &Loads<'_>,
    state: &mut State<S>,
    step: &Step,
) -> Status
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
{
    step_in_parts(scene, loads, state, step, &Alone)
}

/// The same step, to the bit, on several threads of the host.
pub fn step_in_parts<M, N, B, S>(
    scene: &Scene<M, N, B>,
    loads: &Loads<'_>,
    state: &mut State<S>,
    step: &Step,
    threads: &impl Threads,
) -> Status
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
{
    let nodes = scene.node_count();
    let room = state.capacity();
    let State { displacement, increment, force, time, steps, dt, ledger, extremes: seen } = state;
    let (Some(displacement), Some(increment), Some(force)) = (
        displacement.as_mut().get_mut(..nodes),
        increment.as_mut().get_mut(..nodes),
        force.as_mut().get_mut(..nodes),
    ) else {
        return Status::Mismatch { nodes, room };
    };
    let inertia = scene.inertia();
    if nodes == 0 || loads.nodes().is_some_and(|checked| checked != nodes) {
        return Status::Mismatch { nodes, room };
    }
    let changed;
    let step = if *dt > 0.0 && *dt != step.dt {
        changed = Step::after(*dt, step.dt, step.damping);
        &changed
    } else {
        step
    };
    let mut account = *ledger;
    if *steps == 0 {
        account.start = account.start.max(scene.releasable_energy());
    }

    let elements = scene.elements();
    let forcing = Forcing { elements, inertia, displacement, loads, time: *time };
    let totals_of = |nodes: Range<usize>, force: &[NodeVector], _: &mut [()]| {
        let inertia = inertia.get(nodes.clone()).unwrap_or_default();
        let increment = increment.get(nodes).unwrap_or_default();
        Account { step, inertia, increment, force }.total()
    };
    let (totals, extremes) = forcing.in_parts(force, &mut [], threads, totals_of);
    let totals = Totals::of_all(&totals);
    let next = |_, inertia: &_, increment: &_, force: &_| next_increment(inertia, increment, force, step);
    let entry = Entry::of_totals(&totals, loads, step)
        .with_forces(loads, inertia, increment, force, *time, next)
        .with_motions(loads, displacement, increment, force, *time, step);
    let entered = match entry.entered(account, step) {
        Ok(entered) => entered,
        Err(cause) => {
            let node = culprit(inertia, increment, force, step, next);
            return Status::Diverged(Divergence { time: *time, node, cause });
        }
    };

    (*ledger, *seen) = (entered, extremes);
    let force = &*force;
    move_in_parts(elements.chunks, displacement, increment, threads, |nodes, displacement, increment| {
        let inertia = inertia.get(nodes.clone()).unwrap_or_default();
        let force = force.get(nodes).unwrap_or_default();
        Advance { step, inertia, displacement, increment, force }.advance();
    });
    *dt = step.dt;
    *time += f64::from(step.dt);
    *steps += 1;
    follow_motions(loads, displacement, increment, *time);
    extremes.status(ledger, false)
}

/// Floating-point operations of the internal forces.
#[must_use]
pub fn element_operations<M: Material, N, B>(scene: &Scene<M, N, B>) -> u64 {
    scene.element_count() as u64 * u64::from(element::operations::<M::Law>())
}

/// Floating-point operations of one step without loads, the same for every step.
#[must_use]
pub fn operations<M: Material, N, B>(scene: &Scene<M, N, B>) -> u64 {
    // Per node: twice the next increment of four components (3 each), kinetic energy and momentum (6 each),
    // the new position (1 each).
    const NODE: u64 = 4 * (2 * 3 + 6 + 1);
    element_operations(scene) + scene.node_count() as u64 * NODE
}

/// Puts the scene at the displacement (m) and velocity (m/s) that `at` gives for each node, at time zero.
/// Held axes keep what is given until a motion moves them. Returns whether the state has room for the scene.
pub fn start<M, N, B, S>(
    scene: &Scene<M, N, B>,
    state: &mut State<S>,
    step: &Step,
    at: impl Fn(usize) -> ([f32; 3], [f32; 3]),
) -> bool
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
{
    state.reset();
    if state.capacity() < scene.node_count() {
        return false;
    }
    let mut kinetic = 0.0;
    let vectors = state.displacement.as_mut().iter_mut().zip(state.increment.as_mut());
    for (node, ((displacement, increment), inertia)) in vectors.zip(scene.inertia()).enumerate() {
        let ([ux, uy, uz], velocity) = at(node);
        displacement.0 = [ux, uy, uz, 0.0];
        for (axis, speed) in velocity.into_iter().enumerate() {
            if inertia.inverse[axis] > 0.0 {
                increment.0[axis] = speed * step.dt;
                kinetic += 0.5 * f64::from(inertia.mass) * f64::from(speed) * f64::from(speed);
            }
        }
    }
    state.dt = step.dt;
    let strain = energy::strain_energy(scene, state.displacement.as_ref());
    state.ledger.start = kinetic + strain + scene.releasable_energy();
    true
}

/// Strain energy of the scene in this state, J, zero at rest.
pub fn strain_energy<M, N, B, S>(scene: &Scene<M, N, B>, state: &State<S>) -> f64
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]>,
{
    energy::strain_energy(scene, state.displacement.as_ref())
}

/// Forces with which the elements act on the nodes at the state's displacements, N ([`State::forces`], until the next step).
/// Returns whether the state has room for the scene.
pub fn internal_forces<M, N, B, S>(scene: &Scene<M, N, B>, state: &mut State<S>) -> bool
where
    M: Material,
    N: AsRef<[NodeInertia]>,
    B: AsRef<[ElementBlock]>,
    S: AsRef<[NodeVector]> + AsMut<[NodeVector]>,
{
    let State { displacement, force, .. } = state;
    let nodes = scene.node_count();
    let (Some(displacement), Some(force)) =
        (displacement.as_ref().get(..nodes), force.as_mut().get_mut(..nodes))
    else {
        return false;
    };
    force.fill(NodeVector::ZERO);
    M::Law::forces(InternalForces::of(scene, displacement, force, Nothing));
    true
}

/// Puts the nodes of motions where they belong at `time`.
pub(crate) fn follow_motions(
    loads: &Loads<'_>,
    displacement: &mut [NodeVector],
    increment: &mut [NodeVector],
    time: f64,
) {
    loads.each_led(time, increment, |node, axis, position, increment| {
        if let Some(NodeVector(displacement)) = displacement.get_mut(node) {
            increment[axis % 4] = position - displacement[axis % 4];
            displacement[axis % 4] = position;
        }
    });
}

/// The node that a refused step names: the first whose next increment is not finite, or else the one with
/// the most kinetic energy (increments may still be finite where their energy no longer is).
pub(crate) fn culprit(
    inertia: &[NodeInertia],
    increment: &[NodeVector],
    force: &[NodeVector],
    step: &Step,
    next: impl Next,
) -> u32 {
    let mut most = (0.0, 0);
    for (node, ((inertia, increment), force)) in inertia.iter().zip(increment).zip(force).enumerate() {
        let next = next(node, inertia, increment, force);
        if next.iter().any(|value| !value.is_finite()) {
            return node as u32;
        }
        let sums = next.iter().zip(increment.0).map(|(next, last)| next + step.carry * last);
        let square: f32 = sums.map(|sum| sum * sum).sum();
        if inertia.mass * square > most.0 {
            most = (inertia.mass * square, node as u32);
        }
    }
    most.1
}
