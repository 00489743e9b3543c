//! How stiff pushes on triangles are by themselves. Where a triangle that an instrument of radius `R` (m) pushes by `p`
//! (N) turns, the point that is deepest rolls on: by `R` times the angle. With the slopes `g_i` (1/m) of the weights
//! that is a stiffness of at most
//!
//! ```text
//! p R |g_i| (|g_1| + |g_2| + |g_3|)
//! ```
//! at a corner, N/m: of soft tissue under a large instrument more than what the elements have.

use glam::Vec3;

use super::{Contact, ContactMemory, Placed, TrianglePoint};
use crate::simd::NodeVector;
use crate::state::Progress;

impl Contact<'_> {
    /// Adds it to the bounds of the nodes, N/m.
    pub(crate) fn add_stiffness(
        &self,
        pushes: &mut [NodeVector],
        progress: &Progress,
        displacement: &[NodeVector],
        rates: &mut [f32],
    ) {
        let surface = self.surface();
        let Some(mut memory) = ContactMemory::split(pushes, &surface) else { return };
        memory.forget_if_other(progress);
        let placed = &*self.placed(progress.time, 0.0);
        for (place, push) in memory.pushed().filter(|&(place, _)| place >= surface.nodes().len()) {
            let newton = Vec3::from_array(push.to_array()).length();
            let Some(nodes) = surface.corners(place).filter(|_| newton > 0.0) else { continue };
            let [a, b, c] = nodes.map(|node| {
                let moved = displacement.get(node.node as usize).copied().unwrap_or_default();
                Vec3::from_array(node.rest) + Vec3::from_array(moved.to_array())
            });
            let point = TrianglePoint::unpacked(push.0[3]).mean([a, b, c]);
            let distance = |placed: &&Placed<'_>| placed.meet(point).map_or(f32::INFINITY, |meeting| meeting.gap);
            let round = placed.iter().filter(|placed| !placed.is_plane());
            let Some(nearest) = round.min_by(|a, b| distance(a).total_cmp(&distance(b))) else { continue };
            let double_area = (b - a).cross(c - a).length();
            let slopes = [c - b, a - c, b - a].map(|edge| edge.length() / double_area);
            let stiffness = newton * nearest.thickness() * slopes.iter().sum::<f32>();
            for (node, slope) in nodes.into_iter().zip(slopes) {
                if let Some(rate) = rates.get_mut(node.node as usize).filter(|_| (stiffness * slope).is_finite()) {
                    *rate += stiffness * slope;
                }
            }
        }
    }
}
