//! The boundary of a mesh: faces that belong to one element only.

use std::vec::Vec;

/// Corners of the faces of an element, turned outwards.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// Triangles that belong to one element only.
pub fn boundary(tets: impl IntoIterator<Item = [u32; 4]>) -> Vec<[u32; 3]> {
    let faces_of = |tet: [u32; 4]| {
        FACES.map(|face| {
            let face = face.map(|corner| tet[corner]);
            let mut key = face;
            key.sort_unstable();
            (key, face)
        })
    };
    let mut faces: Vec<_> = tets.into_iter().flat_map(faces_of).collect();
    faces.sort_unstable();
    let same_face = faces.chunk_by(|(a, _), (b, _)| a == b);
    same_face.filter_map(|same| if let [(_, face)] = same { Some(*face) } else { None }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Bar;

    /// Two triangles a square, each turned outwards: its normal points away from the middle.
    #[test]
    fn the_boundary_of_a_bar_is_its_six_sides() {
        let bar = Bar { size: [1.0, 2.0, 3.0], cells: [2, 3, 4] };
        let points: Vec<_> = bar.points().map(glam::Vec3::from).collect();
        let triangles = boundary(bar.tets());
        assert_eq!(triangles.len(), 2 * 2 * (2 * 3 + 3 * 4 + 2 * 4));
        for triangle in triangles {
            let [a, b, c] = triangle.map(|node| points[node as usize]);
            let middle = glam::Vec3::new(0.5, 1.0, 1.5);
            assert!((b - a).cross(c - a).dot(a - middle) > 0.0, "{triangle:?}");
        }
    }
}
