//! The nodes of a pull: those within a radius of its point at rest, which move it by their mean, or the corners of the
//! tetrahedron around it.
//!
//! A force on few nodes tears a mesh, and light ones most, so all nodes of a patch have the same share. Of patches of 12 to 48
//! nodes those of 24 registered the lobe best (20 points: 1.1 mm; 8 mm and weights that fall to the rim, 10 nodes: 1.5 mm), weights
//! in proportion to the nodes' masses, or with the point as their mean position, worse.

use glam::{Mat3, Vec3};

use super::{PullError, PulledNode};

/// Writes the nodes within `radius` (m) of a point (m) to `nodes`, with equal weights. `points` are those of all nodes at
/// rest, m. Gives how many.
pub fn patch(points: &[[f32; 3]], point: [f32; 3], radius: f32, nodes: &mut [PulledNode]) -> Result<usize, PullError> {
    let centre = Vec3::from_array(point);
    if !(radius.is_finite() && radius > 0.0) {
        return Err(PullError::Value { pull: 0, what: "radius", value: radius });
    }
    if let Some(&value) = point.iter().find(|component| !component.is_finite()) {
        return Err(PullError::Value { pull: 0, what: "point", value });
    }
    let (mut count, mut nearest) = (0, f32::INFINITY);
    for (node, &at) in (0..).zip(points) {
        let distance = Vec3::from_array(at).distance(centre);
        nearest = nearest.min(distance);
        if distance <= radius {
            if let Some(place) = nodes.get_mut(count) {
                place.node = node;
            }
            count += 1;
        }
    }
    if count == 0 {
        return Err(PullError::Nothing { radius, nearest });
    }
    let capacity = nodes.len();
    let patch = nodes.get_mut(..count).ok_or(PullError::Capacity { needed: count, capacity })?;
    patch.iter_mut().for_each(|pulled| pulled.weight = 1.0 / count as f32);
    Ok(count)
}

/// The corners of the tetrahedron around a point (m, at rest), or of the one nearest to it in barycentric coordinates. Looks at all.
#[must_use]
pub fn around(points: &[[f32; 3]], tets: &[[u32; 4]], point: [f32; 3]) -> Option<[PulledNode; 4]> {
    // How far a weight is below zero: at most zero inside.
    let outside = |nodes: &[PulledNode; 4]| nodes.iter().map(|pulled| -pulled.weight).fold(0.0, f32::max);
    let of_element = |&corners: &[u32; 4]| {
        let mut at = [[0.0; 3]; 4];
        for (place, node) in at.iter_mut().zip(corners) {
            *place = *points.get(node as usize)?;
        }
        in_tetrahedron(corners, at, point)
    };
    tets.iter().filter_map(of_element).min_by(|a, b| outside(a).total_cmp(&outside(b)))
}

/// The corners of a tetrahedron with the barycentric coordinates of a point, its points at rest in m. None if it has no
/// volume.
#[must_use]
pub fn in_tetrahedron(corners: [u32; 4], points: [[f32; 3]; 4], point: [f32; 3]) -> Option<[PulledNode; 4]> {
    let [origin, a, b, c] = points.map(Vec3::from_array);
    let edges = Mat3::from_cols(a - origin, b - origin, c - origin);
    let weights = edges.inverse() * (Vec3::from_array(point) - origin);
    if !weights.is_finite() {
        return None;
    }
    let all = [1.0 - weights.x - weights.y - weights.z, weights.x, weights.y, weights.z];
    let mut nodes = [PulledNode::default(); 4];
    for (place, (node, weight)) in nodes.iter_mut().zip(corners.into_iter().zip(all)) {
        *place = PulledNode { node, weight };
    }
    Some(nodes)
}
