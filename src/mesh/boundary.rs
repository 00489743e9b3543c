//! The boundary of a mesh: faces that belong to one element only.

use crate::heap_sort;

/// The faces of an element, seen from outside: of one that comes in two, each has its own.
pub(crate) const fn faces([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 4] {
    [[b, c, d], [a, d, c], [a, b, d], [a, c, b]]
}

/// Triangles that belong to one element only.
#[cfg(any(feature = "std", test))]
pub fn boundary(tets: impl IntoIterator<Item = [u32; 4]>) -> std::vec::Vec<[u32; 3]> {
    let mut found: std::vec::Vec<_> = tets.into_iter().flat_map(faces).collect();
    found.sort_unstable_by_key(|face| in_order(*face));
    let count = keep_single(&mut found);
    found.truncate(count);
    found
}

/// The same in memory of the caller, who has the faces of all elements there. Gives how many at its beginning are of
/// the boundary.
pub(crate) fn boundary_in(found: &mut [[u32; 3]]) -> usize {
    heap_sort::sort(found, in_order);
    keep_single(found)
}

/// Puts the faces that come once, of faces with equal nodes side by side, to the beginning, and gives how many they
/// are.
fn keep_single(found: &mut [[u32; 3]]) -> usize {
    let (mut at, mut kept) = (0, 0);
    while let Some(&face) = found.get(at) {
        let same = found.iter().skip(at).take_while(|other| in_order(**other) == in_order(face)).count();
        if same == 1 {
            found.get_mut(kept).into_iter().for_each(|place| *place = face);
            kept += 1;
        }
        at += same;
    }
    kept
}

/// The nodes of a face in increasing order.
pub(crate) fn in_order([a, b, c]: [u32; 3]) -> [u32; 3] {
    let (low, high) = (a.min(b), a.max(b));
    [low.min(c), low.max(high.min(c)), high.max(c)]
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
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|node| points[node as usize]);
            let middle = glam::Vec3::new(0.5, 1.0, 1.5);
            assert!((b - a).cross(c - a).dot(a - middle) > 0.0, "{triangle:?}");
        }
        let mut found: Vec<_> = bar.tets().flat_map(faces).collect();
        let count = boundary_in(&mut found);
        assert_eq!(found[..count], triangles);
    }
}
