//! Nodes that an instrument holds, as forceps do: from the step in which they are listed they move with it, whatever
//! force that takes, and in the step after they are no longer listed they are free.

use super::instrument::Instrument;
use super::surface::Surface;
use crate::simd::NodeVector;

/// A node of the surface that an instrument holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Grip {
    /// Its place in the surface.
    pub place: u32,
    /// The instrument's place in the list.
    pub instrument: u32,
    /// Where it is held, in the axes of the instrument, m.
    pub point: [f32; 3],
}

impl Instrument<'_> {
    /// The nodes of the surface that are nearer than `within` (m) to the instrument at `time` (s): to be held where
    /// they are. `index` is the place of the instrument in the list, `displacements` are those of the scene. In
    /// increasing order.
    pub fn grips<'s>(
        &'s self,
        index: u32,
        surface: Surface<'s>,
        displacements: &'s [NodeVector],
        time: f64,
        within: f32,
    ) -> impl Iterator<Item = Grip> + use<'s> {
        let placement = self.placement(time);
        (0..).zip(surface.nodes()).filter_map(move |(place, entry)| {
            let [x, y, z] = displacements.get(entry.node as usize)?.to_array();
            let [a, b, c] = entry.rest;
            let point = placement.in_shape(glam::Vec3::new(a + x, b + y, c + z));
            let (distance, _) = self.shape.nearest(point);
            (distance < within).then_some(Grip { place, instrument: index, point: point.to_array() })
        })
    }
}
