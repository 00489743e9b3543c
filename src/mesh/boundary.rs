//! The boundary of a mesh: faces that belong to one element only; and elements that overlap at faces.

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

/// Elements that take the same room, which those of no body do: a mesh that was put together, or written, with some of them twice.
#[cfg(feature = "std")]
#[derive(Clone, Debug, Eq, PartialEq)]
pub struct Overlap {
    /// The first of them, counted from 0: two with the same four nodes, or three with a face in common, which has two sides.
    pub elements: std::vec::Vec<usize>,
    /// How many times that is so in the mesh.
    pub count: usize,
}

#[cfg(feature = "std")]
impl core::fmt::Display for Overlap {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.elements[..] {
            [a, b] => write!(f, "elements {a} and {b} (counted from 0) have the same four nodes")?,
            ref all => write!(f, "elements {all:?} (counted from 0) share a face, which has two sides")?,
        }
        if self.count > 1 { write!(f, ", the first of {} such places", self.count) } else { Ok(()) }
    }
}

/// Whether elements overlap that have nodes in common. Those with a repeated node are left out.
#[cfg(feature = "std")]
pub fn overlap(tets: &[[u32; 4]]) -> Option<Overlap> {
    let in_order = |mut nodes: [u32; 4]| {
        nodes.sort_unstable();
        nodes
    };
    let nodes = tets.iter().map(|tet| in_order(*tet)).zip(0..);
    let nodes: std::vec::Vec<_> = nodes.filter(|([a, b, c, d], _)| a < b && b < c && c < d).collect();
    let of_faces = |&([a, b, c, d], element): &([u32; 4], usize)| {
        [([b, c, d], element), ([a, c, d], element), ([a, b, d], element), ([a, b, c], element)]
    };
    let faces = nodes.iter().flat_map(of_faces).collect();
    more_than(1, nodes).or_else(|| more_than(2, faces))
}

/// Of parts of elements those with the same nodes, where they are more than so many.
#[cfg(feature = "std")]
fn more_than<const N: usize>(most: usize, mut parts: std::vec::Vec<([u32; N], usize)>) -> Option<Overlap> {
    parts.sort_unstable();
    let runs = parts.chunk_by(|(a, _), (b, _)| a == b).filter(|run| run.len() > most);
    let elements = |run: &[([u32; N], usize)]| run.iter().take(most + 1).map(|(_, element)| *element).collect();
    Some(Overlap { count: runs.clone().count(), elements: runs.map(elements).min()? })
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

    #[test]
    fn elements_that_overlap_are_named() {
        let mut tets: Vec<_> = Bar { size: [1.0; 3], cells: [2; 3] }.tets().collect();
        assert_eq!(overlap(&tets), None);
        let [a, b, c, d] = tets[7];
        tets.extend([tets[9], [d, b, a, c], [a, a, b, c]]);
        let last = tets.len() - 1;
        assert_eq!(overlap(&tets), Some(Overlap { elements: vec![7, last - 1], count: 2 }));
        tets.truncate(last - 2);
        // A node that belongs to nothing else.
        tets.push([99, a, b, c]);
        let found = overlap(&tets).unwrap();
        assert_eq!((found.elements.len(), found.elements.last(), found.count), (3, Some(&(last - 2)), 1), "{found}");
    }
}
