//! Renumbering of nodes along a Morton curve (Morton 1966). A step reads and adds to the nodes of each element:
//! neighbours with near indices share cache lines, and partitions for threads (`partition.rs`) need such indices. Mesh
//! generators often number nodes almost at random.

use super::{MeshError, in_range};

/// Bits of each coordinate in the place on the curve.
pub(crate) const BITS: u32 = 10;

/// Renumbers the nodes of a mesh (`points` in m, `tets` of node indices) along a Morton curve, in place. Elements keep
/// their order. Afterwards `old[n]` is the former index of node `n`, and `new[n]` the index that the former node `n`
/// has now. A host that uses its own indices keeps these tables. Allocates nothing; on an error nothing is changed.
pub fn renumber(
    points: &mut [[f32; 3]],
    tets: &mut [[u32; 4]],
    old: &mut [u32],
    new: &mut [u32],
) -> Result<(), MeshError> {
    let nodes = points.len();
    in_range(points, tets)?;
    for places in [old.len(), new.len()] {
        if places != nodes {
            return Err(MeshError::Table { places, nodes });
        }
    }
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for point in &*points {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    // The same scale for all axes, so that the boxes of the curve are cubes.
    let size = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f32::max);
    let scale = if size > 0.0 { ((1 << BITS) - 1) as f32 / size } else { 0.0 };
    let place = |node: u32| {
        let point = points.get(node as usize).copied().unwrap_or_default();
        let at = |axis: usize| ((point[axis] - low[axis]) * scale) as u32;
        // Nodes in the same box are ordered by their old indices, so the result does not depend on the sorting method.
        (every_third_bit(at(0)) | every_third_bit(at(1)) << 1 | every_third_bit(at(2)) << 2, node)
    };
    for (node, old) in old.iter_mut().enumerate() {
        *old = node as u32;
    }
    sort_by_key(old, place);
    for (index, &old) in old.iter().enumerate() {
        if let Some(new) = new.get_mut(old as usize) {
            *new = index as u32;
        }
    }
    for node in tets.as_flattened_mut() {
        *node = new.get(*node as usize).copied().unwrap_or_default();
    }
    for index in 0..nodes {
        // Points before `index` are in place. If the wanted point was there, a swap has moved it: follow the table.
        let mut from = index;
        loop {
            from = old.get(from).map_or(index, |&from| from as usize);
            if from >= index {
                break;
            }
        }
        if index < nodes && from < nodes {
            points.swap(index, from);
        }
    }
    Ok(())
}

/// Heapsort. The sort of `core` may panic on an inconsistent order, and nothing here may panic.
fn sort_by_key<K: Ord>(heap: &mut [u32], key: impl Fn(u32) -> K) {
    let sink = |heap: &mut [u32], mut parent: usize| {
        let at = |heap: &[u32], place: usize| heap.get(place).map(|&node| key(node));
        loop {
            let (left, right) = (2 * parent + 1, 2 * parent + 2);
            let child = if at(heap, right) > at(heap, left) { right } else { left };
            if child >= heap.len() || parent >= heap.len() || at(heap, child) <= at(heap, parent) {
                return;
            }
            heap.swap(parent, child);
            parent = child;
        }
    };
    for parent in (0..heap.len() / 2).rev() {
        sink(heap, parent);
    }
    let mut rest = heap;
    while let [first, .., last] = rest {
        core::mem::swap(first, last);
        rest = rest.split_last_mut().map_or(&mut [], |(_, others)| others);
        sink(rest, 0);
    }
}

/// Moves each of ten bits to every third place, with zeros between them.
pub(crate) const fn every_third_bit(bits: u32) -> u32 {
    let bits = (bits | bits << 16) & 0x0300_00ff;
    let bits = (bits | bits << 8) & 0x0300_f00f;
    let bits = (bits | bits << 4) & 0x030c_30c3;
    (bits | bits << 2) & 0x0924_9249
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    proptest! {
        #[test]
        fn elements_keep_their_points_and_the_tables_are_inverse(
            points in proptest::collection::vec(proptest::array::uniform3(-1.0f32..1.0), 4..200),
            picks in proptest::collection::vec(proptest::array::uniform4(any::<proptest::sample::Index>()), 0..100),
        ) {
            let before: Vec<[u32; 4]> =
                picks.iter().map(|tet| tet.map(|pick| pick.index(points.len()) as u32)).collect();
            let (mut moved, mut tets) = (points.clone(), before.clone());
            let (mut old, mut new) = (std::vec![9; points.len()], std::vec![9; points.len()]);
            renumber(&mut moved, &mut tets, &mut old, &mut new).unwrap();
            for (index, &old) in old.iter().enumerate() {
                prop_assert_eq!(new[old as usize] as usize, index);
                prop_assert_eq!(moved[index], points[old as usize]);
            }
            for (tet, before) in tets.iter().zip(&before) {
                prop_assert_eq!(tet.map(|node| moved[node as usize]), before.map(|node| points[node as usize]));
            }
        }
    }

    #[test]
    fn neighbours_have_near_indices() {
        // A row of points, listed from both ends in turn.
        let mut points: Vec<[f32; 3]> =
            (0..100).map(|i| [if i % 2 == 0 { i } else { 199 - i } as f32, 0.0, 0.0]).collect();
        let (mut old, mut new) = ([0; 100], [0; 100]);
        renumber(&mut points, &mut [], &mut old, &mut new).unwrap();
        assert!(points.is_sorted_by_key(|[x, _, _]| *x));
    }

    #[test]
    fn a_refused_mesh_is_unchanged() {
        let (mut points, mut tets) = ([[1.0; 3], [0.0; 3]], [[0, 1, 2, 0]]);
        let missing = MeshError::IndexOutOfRange { element: 0, node: 2, nodes: 2 };
        assert_eq!(renumber(&mut points, &mut tets, &mut [0; 2], &mut [0; 2]), Err(missing));
        let table = MeshError::Table { places: 1, nodes: 2 };
        assert_eq!(renumber(&mut points, &mut [], &mut [0; 1], &mut [0; 2]), Err(table));
        assert_eq!(renumber(&mut points, &mut [], &mut [0; 2], &mut [0; 1]), Err(table));
        assert_eq!((points, tets), ([[1.0; 3], [0.0; 3]], [[0, 1, 2, 0]]));
        points[1][2] = f32::NAN;
        assert!(matches!(
            renumber(&mut points, &mut [], &mut [0; 2], &mut [0; 2]),
            Err(MeshError::NotFinite { node: 1, axis: 2, .. })
        ));
    }
}
