//! From steps beyond the critical one to shorter ones. Increments span the time from `t - D` to `t`, velocities are
//! those of its middle: a shorter step would have to add the force of half a long step at once, and where inertia was
//! added the force of true inertia tears the mesh. So the last increment `du` is replaced by that of a step of `r D`
//! which ends at `t`, with the acceleration `(du+ - du) / D^2` that the long step gives:
//!
//! ```text
//! du' = r (du + du+) / 2 - r^2 (du+ - du) / 2
//! ```
//! and, where forces have yet to act for a time (`owed` of the model), with that acceleration for it. Where a host has changed
//! gravity since, it is that of the long step; where it has changed other loads, velocities stay those of the middle of the step.

use super::large_step::LargeView;
use super::lattice::rank_of;
use super::step::InertiaStep;
use crate::element::ElementMaterial;
use crate::loads::{Loads, ramp_factor};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::{Status, Step, StepMethod, Threads, Trial};

impl LargeView<'_> {
    /// To be called between the last long step and the first shorter one of any method, of `seconds`. Moves no node,
    /// and costs a step. A state whose last step was shorter stays as it is.
    pub fn shorten<M: ElementMaterial>(
        self,
        seconds: f32,
        scene: SceneView<'_, M>,
        loads: &Loads<'_>,
        mut state: StateView<'_>,
        threads: &impl Threads,
    ) -> Status {
        let (model, storage) = match self.opened(scene, &state) {
            Ok(opened) => opened,
            Err(mismatch) => return mismatch,
        };
        let nodes = model.nodes;
        // Nothing to do for a state at rest, and for lengths that are none.
        let share = seconds / state.dt;
        let Ok(step) = Step::unchecked(state.dt, model.step.damping()) else { return Status::Ok };
        if !(share > 0.0 && share < 1.0) {
            return Status::Ok;
        }
        let (mark, is_own) = (loads.mark(), model.has_stepped && model.moment == state.progress.moment());
        if is_own && mark.others != model.loads.others {
            state.respan(seconds);
            return Status::Ok;
        }
        // What a host has changed since has acted for no time yet.
        let loads = &loads.with_gravity(if is_own { model.loads.gravity } else { mark.gravity });
        let mut trial = match Trial::begin(scene, loads, state, nodes) {
            Ok(trial) => trial,
            Err(refused) => return refused,
        };
        let owed = if model.moment == trial.progress.moment() {
            core::mem::take(&mut model.owed) / step.seconds()
        } else {
            0.0
        };
        let mut method = InertiaStep::new(&step, model, storage, threads);
        let _ = method.compute(&mut trial);
        let next = |node| {
            let rank = rank_of(method.storage.places, node);
            method.storage.tables.next_increment.get(rank).copied().unwrap_or_default().0
        };
        let all_finite = (0..nodes).all(|node| next(node).iter().take(3).all(|value| value.is_finite()));
        let Trial { scene, loads, displacement, increment, force, progress, .. } = trial;
        let (mut work, gravity) = (0.0, loads.gravity());
        let shortened = |last: f32, next: f32, free: bool| {
            let gain = if all_finite && free { 0.5 * (next - last) } else { 0.0 };
            share * (last + gain) - share * share * gain + share * owed * 2.0 * gain
        };
        // What acts now has acted since the middle of the last step.
        for load in loads.forces() {
            let node = load.node as usize;
            let (Some(NodeVector(last)), Some(inertia)) = (increment.get(node), scene.inertia.get(node)) else {
                continue;
            };
            let (next, factor) = (next(node), ramp_factor(progress.time, load.ramp));
            for axis in (0..3).filter(|&axis| inertia.inverse[axis] > 0.0) {
                let way = 0.5 * (last[axis] - shortened(last[axis], next[axis], true));
                work += f64::from(factor * load.newton[axis] * way);
            }
        }
        if let Some(pressure) = loads.pressure() {
            work += pressure.work(progress.time, displacement, |node| {
                let (last, inertia) = (increment.get(node)?.0, scene.inertia.get(node)?);
                let next = next(node);
                let way = |axis: usize| 0.5 * (last[axis] - shortened(last[axis], next[axis], true));
                Some([0, 1, 2].map(|axis| if inertia.inverse[axis] > 0.0 { way(axis) } else { 0.0 }))
            });
        }
        let nodes = increment.iter_mut().zip(scene.inertia).zip(&*force);
        for (node, ((NodeVector(last), inertia), force)) in nodes.enumerate() {
            let next = next(node);
            for axis in 0..3 {
                let free = inertia.inverse[axis] > 0.0;
                let shortened = shortened(last[axis], next[axis], free);
                let way = 0.5 * (last[axis] - shortened);
                work += f64::from(way * if free { inertia.mass * gravity[axis] } else { -force.0[axis] });
                last[axis] = shortened;
            }
        }
        if work.is_finite() {
            let balance = progress.energy_balance;
            progress.energy_balance = balance.entered(work, 0.0, balance.kinetic, 0.0);
        }
        progress.dt = seconds;
        Status::Ok
    }
}
