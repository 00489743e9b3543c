//! The protocol that every step follows, exact or not (`StepMethod`): begin (borrow the state, check that everything
//! fits), compute forces and next increments, enter them in the energy balance, and only then accept the step and move
//! the state, or refuse it with the node at which it went wrong. A step that is refused leaves the state as it was, and
//! what a method keeps of it: the next step is the same, to the bit, as if there had been none. Only inertia that a long
//! step has computed for other pulls than before stays, and of fast pulls the bound begins anew (`pulls.rs`).

mod cause;
mod compensated;
mod contact;
mod energy_sums;
mod heat;
mod length;
mod parts;
mod pressure;
pub(crate) mod pulls;
mod status;
pub(crate) mod threads;
mod triangles;
mod work;

pub(crate) use crate::element::Extremes;
pub use crate::energy_balance::{EnergyBalance, EnergyCycle};
pub use cause::Cause;
pub(crate) use cause::MOST_OF_SIZE;
pub(crate) use compensated::moved;
pub(crate) use energy_sums::{Sums, Totals};
pub use length::{CriticalStep, Step, StepError};
pub(crate) use length::{ROUNDING, equal_steps, extreme_lengths, is_damping};
pub(crate) use parts::{Moving, TotalForces, internal_forces, move_in_parts, nodal_volumes, write_volumes};
pub use status::{Divergence, Status};
#[cfg(feature = "parallel")]
pub use threads::Rayon;
pub use threads::{CallingThread, MOST_PARTS, Threads};
pub use work::Work;

use crate::contact::{ContactPoint, Touch};
use crate::element::{ElementMaterial, NodeInertia, mark_moment};
use crate::loads::Loads;
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::{Progress, StateView, remembered};
use energy_sums::Entry;

/// A step that is being computed: nothing has moved yet.
pub(crate) struct Trial<'a, M> {
    pub(crate) scene: SceneView<'a, M>,
    pub(crate) loads: &'a Loads<'a>,
    /// One vector for each node of the scene.
    pub(crate) displacement: &'a mut [NodeVector],
    /// What rounding has left out of the displacements ([`moved`]).
    pub(crate) remainder: &'a mut [NodeVector],
    pub(crate) increment: &'a mut [NodeVector],
    pub(crate) force: &'a mut [NodeVector],
    /// Rows of [`crate::element::NodalVolumes`] for materials with nodal pressure; with nodal strain marks of crushed
    /// elements, with linear tetrahedra nothing.
    pub(crate) volume: &'a mut [NodeVector],
    pub(crate) progress: &'a mut Progress,
    /// Whether forces need the remainders ([`heat`]): known once a step is to be computed.
    pub(crate) is_heated: bool,
    /// What the instruments feel, as far as the host wants to know.
    pub(crate) touches: &'a mut [Touch],
    /// Where they push, and how many of these are written.
    pub(crate) points: &'a mut [ContactPoint],
    pub(crate) listed: usize,
    /// Pushes of the instruments, see [`StateView`], and how many nodes touch one in this step.
    pub(crate) pushes: &'a mut [NodeVector],
    pub(crate) touched: usize,
    /// Forces of the pulls, N.
    pub(crate) pulls: &'a mut [NodeVector],
    /// How many of them an exact step holds back.
    pub(crate) held_pulls: u32,
    /// What tissue remembers, see [`StateView`], and the halves of the last step and of this one through which it
    /// relaxes, s.
    pub(crate) memory: &'a mut [NodeVector],
    pub(crate) halves: [f32; 2],
    /// The step over the last one.
    pub(crate) pace: f32,
    /// The node and the instrument that the step must not be taken with.
    pub(crate) refused: Option<(u32, Cause)>,
}

/// The result of [`StepMethod::compute`]: sums over nodes and extremes over elements.
pub(crate) struct Computed {
    pub(crate) totals: Totals,
    pub(crate) extremes: Extremes<f32>,
}

/// A way to compute the next increments.
pub(crate) trait StepMethod<M> {
    /// Computes the total forces, and what [`StepMethod::next_increment`] gives the next increments from. Where
    /// instruments touch their pushes are among the forces.
    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed;

    /// The next increment of a node, m, from its number, inertia, last increment and total force.
    fn next_increment(
        &self,
        node: usize,
        inertia: &NodeInertia,
        increment: &NodeVector,
        force: &NodeVector,
    ) -> [f32; 4];

    /// The steps in which the strain energy of all elements is computed once: of a long step it may take more time.
    const ENERGY_CYCLE: usize = 256;

    /// Whether forces need the remainders of the displacements, for methods whose steps rounding does not heat ([`heat`]).
    fn needs_remainders(&self) -> Option<bool> {
        None
    }

    /// The inertia with which pushes of instruments move a node, for methods whose next increment of a node follows
    /// from its force and one mass.
    fn inertia_of(&self, _node: usize, inertia: &NodeInertia) -> NodeInertia {
        *inertia
    }

    /// Inertia that the method has added, as a multiple of the mass.
    fn added_inertia(&self) -> f32 {
        0.0
    }

    /// The node and the load that this step must not be taken with.
    fn refused_load(&self, _trial: &Trial<'_, M>) -> Option<(u32, Cause)> {
        None
    }

    /// Whether instruments can touch the tissue in this step.
    fn meets_instruments(&self, _trial: &Trial<'_, M>) -> bool {
        false
    }

    /// Whether pulls act in this step.
    fn follows_pulls(&self, _trial: &Trial<'_, M>) -> bool {
        true
    }

    /// Whether it knows all that tissue may have: memory and fibres.
    const KNOWS_ALL_TISSUE: bool = true;

    /// Whether it has had all the time to relax.
    const IS_RELAXED: bool = false;

    /// Takes back what the method has noted for itself: the step is refused.
    fn refuse(&mut self) {}

    /// Moves the nodes: the step is accepted.
    fn advance(&mut self, trial: &mut Trial<'_, M>);

    /// What is left to do once prescribed motions have been followed. Gives whether much of the motion was held back.
    fn finish(&mut self, _trial: &mut Trial<'_, M>) -> bool {
        false
    }
}

impl<'a, M: ElementMaterial> Trial<'a, M> {
    /// Borrows what a step needs; `room` is that of the method's own storage, in nodes.
    // Not inlined: other crates use the one that is compiled here.
    #[inline(never)]
    pub(crate) fn begin(
        scene: SceneView<'a, M>,
        loads: &'a Loads<'a>,
        state: StateView<'a>,
        room: usize,
    ) -> Result<Self, Status> {
        Self::check(scene, loads, &state, room)?;
        let nodes = scene.node_count();
        let StateView { displacement, remainder, increment, force, volume, progress, .. } = state;
        let StateView { touches, points, pushes, pulls, memory, .. } = state;
        Ok(Self {
            scene,
            loads,
            displacement: displacement.get_mut(..nodes).unwrap_or_default(),
            remainder: remainder.get_mut(..nodes).unwrap_or_default(),
            increment: increment.get_mut(..nodes).unwrap_or_default(),
            force: force.get_mut(..nodes).unwrap_or_default(),
            volume: volume.get_mut(..nodes).unwrap_or_default(),
            is_heated: false,
            progress,
            touches,
            points,
            listed: 0,
            pushes,
            touched: 0,
            pulls,
            held_pulls: 0,
            memory,
            halves: [0.0; 2],
            pace: 1.0,
            refused: None,
        })
    }

    /// Whether scene, loads, state and storage belong together.
    pub(crate) fn check(
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        state: &StateView<'_>,
        room: usize,
    ) -> Result<(), Status> {
        let (nodes, room) = (scene.node_count(), room.min(state.capacity_for(scene.element())));
        let is_other = |checked| checked != nodes;
        let surface = loads.contact().map(|contact| contact.surface().scene_nodes());
        let pulls = loads.pulls().map(|pulls| pulls.scene_nodes());
        if nodes == 0 || room < nodes || [loads.nodes(), surface, pulls].into_iter().flatten().any(is_other) {
            return Err(Status::Mismatch { nodes, room });
        }
        Ok(())
    }

    /// Takes the step, or refuses it.
    // Not inlined: other crates use the one that is compiled here.
    #[inline(never)]
    pub(crate) fn take<C: StepMethod<M>>(mut self, step: &Step, method: &mut C) -> Status {
        if self.loads.contact().is_some() && !method.meets_instruments(&self) {
            let time = self.progress.time;
            return Status::Diverged(Divergence { time, node: 0, cause: Cause::NoContact });
        }
        if self.loads.pulls().is_some() && !method.follows_pulls(&self) {
            let time = self.progress.time;
            return Status::Diverged(Divergence { time, node: 0, cause: Cause::NoPulls });
        }
        if !C::KNOWS_ALL_TISSUE && self.scene.fibrous().is_some() {
            return Status::Diverged(Divergence { time: self.progress.time, node: 0, cause: Cause::NoFibres });
        }
        let needed = self.scene.memory_vectors();
        if needed > 0 {
            if !C::KNOWS_ALL_TISSUE || self.memory.len() < needed {
                let time = self.progress.time;
                return Status::Diverged(Divergence { time, node: 0, cause: Cause::NoRelaxation });
            }
            self.halves = if C::IS_RELAXED { [f32::INFINITY, 0.0] } else { [self.progress.half, 0.5 * step.seconds()] };
        }
        let pace = step.seconds() / self.progress.dt;
        self.pace = if pace.is_finite() { pace } else { 1.0 };
        let before = self.progress.energy_balance;
        let heat = match self.progress.steps % heat::EVERY {
            0 => heat::of_rounding(step, self.scene.inertia, self.displacement),
            _ => before.heat,
        };
        self.is_heated = method.needs_remainders().unwrap_or_else(|| EnergyBalance { heat, ..before }.is_heated());
        let Computed { mut totals, extremes } = method.compute(&mut self);
        self.enter_pressure(step, method, &mut totals);
        let balance = match self.refused {
            Some(refused) => Err(refused),
            None => self.balance(step, method, &totals).map_err(|cause| self.blamed(step, method, cause)),
        };
        let balance = balance.and_then(|balance| method.refused_load(&self).map_or(Ok(balance), Err));
        let balance = match balance {
            Ok(balance) => balance,
            Err((node, cause)) => {
                method.refuse();
                self.clear_touches();
                self.pulls.fill(NodeVector::ZERO);
                return Status::Diverged(Divergence { time: self.progress.time, node, cause });
            }
        };
        self.progress.energy_balance = EnergyBalance { heat, ..self.measured(balance, method) };
        self.progress.extremes = extremes;
        method.advance(&mut self);
        (self.progress.dt, self.progress.damping) = (step.seconds(), step.damping());
        (self.progress.half, self.progress.second) = (self.halves[1], !self.progress.second);
        self.progress.time += f64::from(step.seconds());
        self.progress.steps += 1;
        self.progress.pulls.enter(self.held_pulls);
        if self.scene.element().is_nodal_strain() {
            mark_moment(self.volume, &self.progress.moment(), self.scene.tiles.len());
        }
        self.accept_pushes();
        self.follow_motions();
        let limited = method.finish(&mut self);
        Status::of_taken(&extremes, &self.progress.energy_balance, limited)
    }

    /// The energy balance after the step, or why the step cannot be believed.
    fn balance(&mut self, step: &Step, method: &impl StepMethod<M>, totals: &Totals) -> Result<EnergyBalance, Cause> {
        let Self { scene, loads, displacement, increment, force, progress, .. } = self;
        let mut balance = progress.energy_balance;
        if progress.steps == 0 {
            balance.start = balance.start.max(scene.rounding_energy());
        }
        let next = |node, inertia: &_, increment: &_, force: &_| method.next_increment(node, inertia, increment, force);
        Entry::of_totals(totals, loads, step)
            .with_forces(loads, scene.inertia, increment, force, progress.time, next)
            .with_motions(loads, displacement, increment, force, progress.time, step)
            .entered(balance, step)
    }

    /// The balance after this step's part of the measurement of the energy.
    fn measured<C: StepMethod<M>>(&self, balance: EnergyBalance, method: &C) -> EnergyBalance {
        let Self { scene, displacement, volume, memory, progress, .. } = self;
        let (all, first) = (scene.energy_places(), balance.cycle.next as usize);
        let next = (first + all.div_ceil(C::ENERGY_CYCLE)).min(all);
        let strain = scene.strain_energy_at(first..next, displacement, volume, remembered(memory, progress));
        let next = if next < all { Some(next as u32) } else { None };
        balance.measured(strain, next, method.added_inertia().into(), scene.rounding_energy())
    }

    /// The node that a refused step names: the first whose next increment is not finite, or else the one with
    /// the most kinetic energy (increments may still be finite where their energy no longer is).
    fn culprit(&self, step: &Step, method: &impl StepMethod<M>) -> u32 {
        let mut most = (0.0, 0);
        let nodes = self.scene.inertia.iter().zip(&*self.increment).zip(&*self.force);
        for (node, ((inertia, increment), force)) in nodes.enumerate() {
            let next = method.next_increment(node, inertia, increment, force);
            if next.iter().any(|value| !value.is_finite()) {
                return node as u32;
            }
            let sums = next.iter().zip(increment.0).map(|(next, last)| next + step.carry() * last);
            let square: f32 = sums.map(|sum| sum * sum).sum();
            if inertia.mass * square > most.0 {
                most = (inertia.mass * square, node as u32);
            }
        }
        most.1
    }

    /// Puts the nodes of motions where they belong by now.
    fn follow_motions(&mut self) {
        let Self { loads, displacement, remainder, increment, progress, .. } = self;
        loads.each_prescribed(progress.time, increment, |node, axis, position, increment| {
            let (displacement, remainder) = (displacement.get_mut(node), remainder.get_mut(node));
            if let (Some(NodeVector(displacement)), Some(NodeVector(remainder))) = (displacement, remainder) {
                increment[axis % 4] = position - displacement[axis % 4];
                (displacement[axis % 4], remainder[axis % 4]) = (position, 0.0);
            }
        });
    }
}
