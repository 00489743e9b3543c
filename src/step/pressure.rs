//! Pressures that follow the surface in a step ([`crate::pressure`]): their work, and whether one tears the tissue.

use glam::Vec4;

use super::{Cause, Step, StepMethod, Totals, Trial};
use crate::element::ElementMaterial;

/// Triangles that meet at a node of a surface, more or less.
const AROUND: f32 = 6.0;

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
        let density = scene.density();
        // What the forces of the triangles around a node, each as large as one of them, move it by for each kilogram.
        let push = AROUND * step.seconds() * step.seconds() / (1.0 + method.added_inertia());
        pressure.each(
            time,
            displacement,
            |_| true,
            |nodes, newton, surface| {
                let (mut way, mut least, mut tissue) = (Vec4::ZERO, f32::INFINITY, f32::INFINITY);
                for node in nodes.map(|node| node as usize) {
                    let (Some(inertia), Some(increment), Some(force)) =
                        (scene.inertia.get(node), increment.get(node), force.get(node))
                    else {
                        continue;
                    };
                    let next = Vec4::from(method.next_increment(node, inertia, increment, force));
                    let free = inertia.free_axes();
                    let last = Vec4::from(increment.0);
                    way += Vec4::select(free, 0.5 * (next + last), last);
                    // What is held does not tear.
                    if free.any() {
                        least = least.min(method.inertia_of(node, inertia).mass);
                        tissue = tissue.min(inertia.mass);
                    }
                }
                work += f64::from(newton.dot(way.truncate()));
                let far = push * newton.length() / least;
                if far * far * far * density > tissue {
                    torn = torn.or(Some((nodes[0], surface)));
                }
            },
        );
        totals.add_work_of_loads(work);
        if let Some((node, surface)) = torn {
            let (size, pascal) = (scene.node_size(node as usize), pressure.pascal(surface, time, displacement));
            self.refused.get_or_insert((node, Cause::Pressure { surface, pascal, size }));
        }
    }
}
