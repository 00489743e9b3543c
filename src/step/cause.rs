//! Why a step was refused. A load that by itself moves a node through the tissue around it in one step, a force far too
//! large (often in another unit) or a support that jumps, is named; otherwise what the step would have left: no number,
//! or energy that nothing gave.

use core::fmt;

use crate::element::ElementMaterial;
use crate::loads::ramp_factor;

use super::{Divergence, Step, StepMethod, Trial};

/// What was wrong with a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Cause {
    /// A displacement would not be a finite number.
    NotFinite,
    /// There is several times more kinetic energy than loads and supports can have given.
    Energy {
        /// Kinetic energy, J.
        kinetic: f64,
        /// The most that was in the energy balance, J.
        available: f64,
    },
    /// A force moves the node through the tissue around it in this step.
    Force {
        /// Its place in the list of forces.
        index: usize,
        /// Its size, N.
        newton: f32,
        /// Size of the node's own tissue: the edge of a cube of its volume, m.
        size: f32,
    },
    /// A pressure moves the node through the tissue around it in this step.
    Pressure {
        /// Its surface.
        surface: usize,
        /// Pa.
        pascal: f32,
        /// As above, m.
        size: f32,
    },
    /// An instrument moves farther in this step than it is thick, or is so far inside the body that it throws the node.
    Instrument {
        /// Its place in the list of instruments.
        index: usize,
        /// How far it moves, or the node is inside it, m.
        metre: f32,
        /// The most that it may, m.
        most: f32,
    },
    /// The loads have instruments, which learned steps cannot meet, long ones only with room for pushes
    /// ([`StateView::pushing`](crate::state::StateView::pushing)).
    NoContact,
    /// The loads have pulls, which learned steps do not know, exact ones only with room for their forces
    /// ([`StateView::pulling`](crate::state::StateView::pulling)).
    NoPulls,
    /// The tissue relaxes, which learned steps do not know, others only with room for what it remembers
    /// ([`StateView::remembering`](crate::state::StateView::remembering)).
    NoRelaxation,
    /// The tissue has fibres, which learned steps do not know.
    NoFibres,
    /// Supports moved the node through most of the tissue around it in a step.
    Motion {
        /// How far, m.
        metre: f32,
        /// As above, m.
        size: f32,
    },
}

/// Share of the size of a node's own tissue by which a support or an instrument may move it in a step before that is a
/// cause, and a network at all.
pub(crate) const MOST_OF_SIZE: f32 = 0.5;

impl fmt::Display for Divergence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { time, node, cause } = self;
        match cause {
            Cause::NotFinite => write!(
                f,
                "diverged at {time:.6} s, first at node {node}: its displacement is no longer a finite number"
            ),
            Cause::Energy { kinetic, available } => write!(
                f,
                "diverged at {time:.6} s, first at node {node}: kinetic energy {kinetic:.3e} J, but loads and supports never gave \
                 more than {available:.3e} J"
            ),
            Cause::Force { index, newton, size } => write!(
                f,
                "diverged at {time:.6} s at node {node}: force {index}, of {newton:.3e} N, moves it in one step through its tissue, \
                 which is {:.3} mm across",
                1e3 * size
            ),
            Cause::Pressure { surface, pascal, size } => write!(
                f,
                "diverged at {time:.6} s at node {node}: the pressure on surface {surface}, of {pascal:.3e} Pa, moves it in one step \
                 through its tissue, which is {:.3} mm across",
                1e3 * size
            ),
            Cause::Instrument { index, metre, most } => write!(
                f,
                "diverged at {time:.6} s at node {node}: instrument {index} moves by {:.3} mm in one step, or is as far inside the body; \
                 at most {:.3} mm are possible: start outside, move slower or take steps of {:.0} % of their length",
                1e3 * metre,
                1e3 * most,
                100.0 * most / metre
            ),
            Cause::NoContact => write!(
                f,
                "stopped at {time:.6} s: the loads have instruments, which this step cannot meet, or has no room for their pushes"
            ),
            Cause::NoPulls => {
                write!(
                    f,
                    "stopped at {time:.6} s: the loads have pulls, which this step does not know, or has no room for their forces"
                )
            }
            Cause::NoRelaxation => {
                write!(
                    f,
                    "stopped at {time:.6} s: the tissue relaxes (prony), which this step does not know, or has no room for \
                     what it remembers"
                )
            }
            Cause::NoFibres => {
                write!(
                    f,
                    "stopped at {time:.6} s: the tissue has fibres, which learned steps do not know: take exact or long ones"
                )
            }
            Cause::Motion { metre, size } => write!(
                f,
                "diverged at {time:.6} s at node {node}: supports moved it by {:.3} mm in one step, its tissue is {:.3} mm across; \
                 with a ramp they take time",
                1e3 * metre,
                1e3 * size
            ),
        }
    }
}

/// Length of a vector, which may be infinite.
fn length(vector: [f32; 3]) -> f64 {
    libm::sqrt(vector.into_iter().map(|component| f64::from(component) * f64::from(component)).sum())
}

impl<M: ElementMaterial> Trial<'_, M> {
    /// The node and the load that are to blame for a refused step, or the node and cause that the step itself tells.
    pub(super) fn blamed(&self, step: &Step, method: &impl StepMethod<M>, cause: Cause) -> (u32, Cause) {
        let load = self.jumping_support().or_else(|| self.excessive_force(step, method));
        load.unwrap_or_else(|| (self.culprit(step, method), cause))
    }

    /// The force that the step to be taken must not be taken with: one moves its node through the tissue around it,
    /// which then turns inside out before its stress can answer.
    pub(crate) fn tearing_force(&self, step: &Step, method: &impl StepMethod<M>) -> Option<(u32, Cause)> {
        let tears = |node: usize| {
            let (inertia, increment) = (self.scene.inertia.get(node)?, self.increment.get(node)?);
            let next = method.next_increment(node, inertia, increment, self.force.get(node)?);
            let change = [0, 1, 2].map(|axis| next[axis] - increment.0[axis]);
            let square: f32 = change.into_iter().map(|change| change * change).sum();
            let volume = self.scene.node_volume(node);
            // Without a root, as this is for every force in every step.
            Some(square * square * square > volume * volume)
        };
        let torn = self.loads.forces().iter().any(|load| tears(load.node as usize) == Some(true));
        if torn { self.excessive_force(step, method) } else { None }
    }

    /// The node that supports moved farthest in the step before, if that is a cause.
    fn jumping_support(&self) -> Option<(u32, Cause)> {
        let mut most = (MOST_OF_SIZE, None);
        for (node, (inertia, increment)) in self.scene.inertia.iter().zip(&*self.increment).enumerate() {
            let [x, y, z] = inertia.inverse;
            let [dx, dy, dz] = increment.to_array();
            let held = |inverse: f32, way: f32| if inverse > 0.0 { 0.0 } else { way };
            let metre = length([held(x, dx), held(y, dy), held(z, dz)]) as f32;
            if metre > 0.0 {
                let size = self.scene.node_size(node);
                if metre / size > most.0 {
                    most = (metre / size, Some((node as u32, Cause::Motion { metre, size })));
                }
            }
        }
        most.1
    }

    /// How far a force (N) by itself moves a node in this step, m.
    fn way_of(&self, step: &Step, method: &impl StepMethod<M>, node: usize, newton: f64) -> f64 {
        let seconds = f64::from(step.seconds());
        let mass = self.scene.inertia.get(node).map_or(0.0, |inertia| method.inertia_of(node, inertia).mass);
        newton * seconds * seconds / (f64::from(1.0 + method.added_inertia()) * f64::from(mass))
    }

    /// The force that by itself would move its node farthest in this step, measured by the node's tissue, if that is a
    /// cause.
    fn excessive_force(&self, step: &Step, method: &impl StepMethod<M>) -> Option<(u32, Cause)> {
        let mut most = (1.0, None);
        for (index, load) in self.loads.forces().iter().enumerate() {
            let node = load.node as usize;
            let newton = f64::from(ramp_factor(self.progress.time, load.ramp)) * length(load.newton);
            let size = self.scene.node_size(node);
            let share = self.way_of(step, method, node, newton) / f64::from(size);
            if share > most.0 {
                most = (share, Some((load.node, Cause::Force { index, newton: newton as f32, size })));
            }
        }
        most.1
    }
}
