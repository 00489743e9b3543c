//! Pressures that follow the surface in a step ([`crate::pressure`]): their work, and whether one tears the tissue.

use glam::Vec3;

use super::contact::{axes, mean};
use super::{Cause, Step, StepMethod, Totals, Trial};
use crate::element::ElementMaterial;

impl<M: ElementMaterial> Trial<'_, M> {
    /// Enters the work of the pressures. The step is refused if one moves a node through the tissue around it.
    #[inline(always)]
    pub(super) fn enter_pressure(&mut self, step: &Step, method: &impl StepMethod<M>, totals: &mut Totals) {
        if self.loads.pressure().is_some() {
            self.enter_work_of_pressure(step, method, totals);
        }
    }

    #[inline(never)]
    fn enter_work_of_pressure(&mut self, step: &Step, method: &impl StepMethod<M>, totals: &mut Totals) {
        let Self { scene, loads, displacement, increment, force, progress, .. } = self;
        let (Some(pressure), time) = (loads.pressure(), progress.time) else { return };
        let (mut work, mut torn) = (0.0, None);
        pressure.each(
            time,
            displacement,
            |_| true,
            |nodes, newton, surface| {
                let mut way = Vec3::ZERO;
                for node in nodes {
                    let at = node as usize;
                    let (Some(inertia), Some(increment), Some(force)) =
                        (scene.inertia.get(at), increment.get(at), force.get(at))
                    else {
                        continue;
                    };
                    let next = method.next_increment(at, inertia, increment, force);
                    let free = Vec3::from_array(inertia.inverse.map(|inverse| if inverse > 0.0 { 1.0 } else { 0.0 }));
                    let last = axes(increment.0);
                    way += free * mean(next, increment.0) + (Vec3::ONE - free) * last;
                    let square = (free * (axes(next) - last)).length_squared();
                    let volume = scene.node_volume(at);
                    // Without a root.
                    if square * square * square > volume * volume {
                        torn = torn.or(Some((node, surface)));
                    }
                }
                work += f64::from(newton.dot(way));
            },
        );
        totals.add_work_of_loads(work);
        let Some((node, surface)) = torn else { return };
        // Only if it does so by itself: something else may have thrown the node.
        let mut newton = Vec3::ZERO;
        pressure.each(time, displacement, |nodes| nodes.contains(&node), |_, of_triangle, _| newton += of_triangle);
        let (size, pascal) = (scene.node_size(node as usize), pressure.pascal(surface, time, displacement));
        let way = self.way_of(step, method, node as usize, newton.length().into());
        if way > f64::from(size) {
            self.refused.get_or_insert((node, Cause::Pressure { surface, pascal, size }));
        }
    }
}
