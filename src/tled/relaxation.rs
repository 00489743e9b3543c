//! The steps of [`super::settle`]: the exact step with other masses, and the way back to a peak of the kinetic energy.

use core::ops::Range;

use glam::Vec4;

use crate::element::{ElementMaterial, LOOK_CYCLE, NoVisitor, NodeInertia};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::state::StateView;
use crate::step::{
    Cause, Computed, Moving, Step, StepMethod, Threads, TotalForces, Totals, Trial, move_in_parts, moved,
};

/// As that of exact steps ([`crate::step::pulls`]); here no inertia carries on what a pull has begun.
const MOST_WAY: f32 = 0.1;

/// Puts the nodes where the kinetic energy was largest, half a step before the last but one, at a stop.
pub(super) fn go_back<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    state: StateView<'_>,
    node: NodeMotion,
    rates: &[f32],
) {
    let StateView { displacement, remainder, increment, force, progress, .. } = state;
    let vectors = displacement.iter_mut().zip(remainder).zip(increment).zip(&*force);
    for (((((at, left), last), force), inertia), rate) in vectors.zip(scene.inertia).zip(rates) {
        let (here, rest) = (Vec4::from(at.0), Vec4::from(left.0));
        let increment = Vec4::from(last.0);
        let before = increment - node.push / rate * Vec4::from(force.0);
        let back = Vec4::select(inertia.free_axes(), increment + 0.5 * before, Vec4::ZERO);
        [at.0, left.0] = moved(here, rest, -back).map(|vector| vector.to_array());
        last.0 = [0.0; 4];
    }
    progress.dt = 0.0;
}

/// How a force moves a node.
#[derive(Clone, Copy)]
pub(super) struct NodeMotion {
    /// `b_a / s_a`.
    pub(super) push: f32,
}

impl NodeMotion {
    /// The next increment of a node; held axes stand still.
    #[inline(always)]
    fn next(self, inertia: &NodeInertia, rate: f32, increment: &NodeVector, force: &NodeVector) -> Vec4 {
        let next = Vec4::from(increment.0) + self.push / rate * Vec4::from(force.0);
        Vec4::select(inertia.free_axes(), next, Vec4::ZERO)
    }
}

/// One step.
pub(super) struct Relaxation<'a, T> {
    pub(super) step: &'a Step,
    pub(super) node: NodeMotion,
    pub(super) rates: &'a [f32],
    pub(super) threads: &'a T,
    /// Whether motions are so small that rounding of the displacements matters.
    pub(super) is_fine: bool,
}

impl<T> Relaxation<'_, T> {
    /// The inertia of a node in this step, kg.
    fn inertia(&self, inertia: &NodeInertia, rate: f32) -> NodeInertia {
        let mass = rate / self.node.push * self.step.push();
        NodeInertia { mass, inverse: inertia.inverse.map(|inverse| if inverse > 0.0 { 1.0 / mass } else { 0.0 }) }
    }

    /// The sums of these nodes.
    fn sums(
        &self,
        nodes: Range<usize>,
        inertia: &[NodeInertia],
        increment: &[NodeVector],
        force: &[NodeVector],
    ) -> Totals {
        let (increment, rates) =
            (increment.get(nodes.clone()).unwrap_or_default(), self.rates.get(nodes.clone()).unwrap_or_default());
        let nodes = inertia.get(nodes).unwrap_or_default().iter().zip(rates).zip(increment.iter().zip(force));
        let [mut momentum, mut held, mut farthest, mut farthest_next] = [Vec4::ZERO; 4];
        let mut kinetic = 0.0;
        for ((inertia, rate), (increment, force)) in nodes {
            let next = self.node.next(inertia, *rate, increment, force);
            let (increment, force, free) = (Vec4::from(increment.0), Vec4::from(force.0), inertia.free_axes());
            // A held axis has no inertia of its own: what moves it is counted as work.
            let mean = 0.5 * (next + Vec4::select(free, increment, Vec4::ZERO));
            let prescribed = Vec4::select(free, Vec4::ZERO, increment);
            kinetic += rate / self.node.push * mean.length_squared();
            momentum += inertia.mass * (mean + prescribed);
            held += force * prescribed;
            (farthest, farthest_next) = (farthest.max(increment.abs()), farthest_next.max(next.abs()));
        }
        let seconds = f64::from(self.step.seconds());
        let farthest = [farthest, farthest_next].map(|most| most.truncate().max_element());
        let held = held.x + held.y + held.z;
        Totals::of_sums(seconds * seconds * f64::from(kinetic), momentum.truncate().to_array(), held, farthest)
    }
}

impl<M: ElementMaterial, T: Threads> StepMethod<M> for Relaxation<'_, T> {
    const ENERGY_CYCLE: usize = 2048;
    const IS_RELAXED: bool = true;

    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed {
        let inertia = trial.scene.inertia;
        let TotalForces { forcing, increment, volume, force, after } = trial.forcing(NoVisitor, LOOK_CYCLE);
        let own = Relaxation { step: self.step, node: self.node, rates: self.rates, threads: &(), is_fine: false };
        let sums_of = |nodes, force: &[NodeVector], _: &mut [()]| own.sums(nodes, inertia, increment, force);
        let (sums, extremes) = forcing.in_parts(volume, force, &mut [], after, self.threads, sums_of);
        let mut totals = Totals::of_all(&sums);
        totals.add_work(trial.pull(self.step, self, MOST_WAY));
        if trial.loads.pulls().is_some() {
            let Trial { increment, force, .. } = &*trial;
            totals.replace_sums(&own.sums(0..inertia.len(), inertia, increment, force));
        }
        if trial.loads.contact().is_some() {
            trial.meet_instruments(self.step, self, &mut totals);
            let Trial { increment, force, .. } = &*trial;
            // Pushes have changed them, and their masses are not those that gravity acts on.
            totals.replace_sums(&own.sums(0..inertia.len(), inertia, increment, force));
        }
        Computed { totals, extremes }
    }

    fn next_increment(
        &self,
        node: usize,
        inertia: &NodeInertia,
        increment: &NodeVector,
        force: &NodeVector,
    ) -> [f32; 4] {
        self.rates.get(node).map_or([0.0; 4], |rate| self.node.next(inertia, *rate, increment, force).to_array())
    }

    fn needs_remainders(&self) -> Option<bool> {
        Some(self.is_fine)
    }

    fn inertia_of(&self, node: usize, inertia: &NodeInertia) -> NodeInertia {
        self.rates.get(node).map_or(*inertia, |rate| self.inertia(inertia, *rate))
    }

    fn follows_pulls(&self, trial: &Trial<'_, M>) -> bool {
        trial.has_room_for_pulls()
    }

    fn meets_instruments(&self, trial: &Trial<'_, M>) -> bool {
        trial.surface().triangles().is_empty() || trial.has_room_for_pushes()
    }

    fn refused_load(&self, trial: &Trial<'_, M>) -> Option<(u32, Cause)> {
        trial.tearing_force(self.step, self)
    }

    fn advance(&mut self, trial: &mut Trial<'_, M>) {
        let Trial { scene, displacement, remainder, increment, force, .. } = trial;
        let moving = Moving { displacement, remainder, increment };
        let (inertia, force, rates, node) = (scene.inertia, &**force, self.rates, self.node);
        move_in_parts(scene.elements().partitions, moving, self.threads, |nodes, moving| {
            let (inertia, force) = (inertia.get(nodes.clone()), force.get(nodes.clone()));
            let Moving { displacement, remainder, increment } = moving;
            let rows = displacement.iter_mut().zip(remainder).zip(increment);
            let of_nodes = inertia.unwrap_or_default().iter().zip(force.unwrap_or_default());
            for ((((at, left), last), (inertia, force)), rate) in
                rows.zip(of_nodes).zip(rates.get(nodes).unwrap_or_default())
            {
                let next = node.next(inertia, *rate, last, force);
                let (here, rest) = (Vec4::from(at.0), Vec4::from(left.0));
                [at.0, left.0] = moved(here, rest, next).map(|vector| vector.to_array());
                last.0 = next.to_array();
            }
        });
    }
}
