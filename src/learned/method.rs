//! The learned step as a method of the protocol of [`crate::step`]: forces, then the network's next increment of each
//! vertex (m), with what the energy balance needs.

use core::ops::Range;

use glam::Vec4;

use super::predict::{Counts, Predict};
use super::{LearnedReport, Vertex};
use crate::element::{ElementMaterial, NoVisitor, NodeInertia};
use crate::mlp::Network;
use crate::simd::NodeVector;
use crate::step::{Computed, Moving, Step, StepMethod, Threads, TotalForces, Totals, Trial, move_in_parts, moved};

/// A learned step that is being computed.
pub(super) struct Learned<'a, 'w, T> {
    pub(super) network: &'a Network<'w>,
    pub(super) step: &'a Step,
    pub(super) report: &'a mut LearnedReport,
    pub(super) vertices: &'a mut [Vertex],
    pub(super) threads: &'a T,
}

impl<M: ElementMaterial, T: Threads> StepMethod<M> for Learned<'_, '_, T> {
    const KNOWS_ALL_TISSUE: bool = false;

    fn compute(&mut self, trial: &mut Trial<'_, M>) -> Computed {
        let (network, step, inertia) = (self.network, self.step, trial.scene.inertia);
        let TotalForces { forcing, increment, volume, force, after } = trial.forcing(NoVisitor, 1);
        let displacement = forcing.displacement;
        let predict = |nodes: Range<usize>, force: &[NodeVector], vertices: &mut [Vertex]| {
            let inertia = inertia.get(nodes.clone()).unwrap_or_default();
            let displacement = displacement.get(nodes.clone()).unwrap_or_default();
            let increment = increment.get(nodes).unwrap_or_default();
            Predict { network, step, inertia, displacement, increment, force, vertices }.dispatched()
        };
        let (results, extremes) = forcing.in_parts(volume, force, self.vertices, after, self.threads, predict);
        *self.report = Counts::of_all(results.iter().map(|(_, counts)| counts)).report();
        Computed { totals: Totals::of_all(results.iter().map(|(totals, _)| totals)), extremes }
    }

    fn next_increment(&self, node: usize, _: &NodeInertia, _: &NodeVector, _: &NodeVector) -> [f32; 4] {
        self.vertices.get(node).map_or([0.0; 4], |vertex| vertex.next.0)
    }

    fn follows_pulls(&self, _: &Trial<'_, M>) -> bool {
        false
    }

    fn advance(&mut self, trial: &mut Trial<'_, M>) {
        let Trial { scene, displacement, remainder, increment, .. } = trial;
        let moving = Moving { displacement, remainder, increment };
        let (partitions, vertices) = (scene.elements().partitions, &*self.vertices);
        move_in_parts(partitions, moving, self.threads, |nodes, Moving { displacement, remainder, increment }| {
            let vertices = vertices.get(nodes).unwrap_or_default();
            let vectors = displacement.iter_mut().zip(remainder).zip(increment);
            for (((displacement, remainder), increment), vertex) in vectors.zip(vertices) {
                *increment = vertex.next;
                let sum = moved(displacement.0.into(), remainder.0.into(), Vec4::from(vertex.next.0));
                [displacement.0, remainder.0] = sum.map(|sum| sum.to_array());
            }
        });
    }
}
