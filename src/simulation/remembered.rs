//! What tissue remembers ([`crate::element`], relaxation) when another scene of the same nodes takes the place of the one
//! in which it came about: each element, or patch with nodal strain, keeps its own. Without a heap.

use crate::heap_sort::sort;
use crate::material::Material;
use crate::scene::SceneView;
use crate::simd::{NodeVector, TILE};

/// Numbers of a term in a tile, one copy.
const OF_TERM: usize = 6 * TILE;

/// A mesh element; a node with the former tissue of its patch.
type Key = [u32; 2];

/// Carries the memory of a state from one copy of that in scene `old` to one in scene `new`; what was not there remembers
/// nothing. The room is another copy, whose contents do not matter.
pub(crate) fn carry<M: Material, N: Material>(
    (old, before): (SceneView<'_, M>, &[NodeVector]),
    (new, after): (SceneView<'_, N>, &mut [NodeVector]),
    room: &mut [NodeVector],
) {
    after.fill(NodeVector::ZERO);
    let terms = [4 * old.vectors_of_tile() / OF_TERM, 4 * new.vectors_of_tile() / OF_TERM];
    let of_patches = old.element().is_nodal_strain();
    if terms.contains(&0) || of_patches != new.element().is_nodal_strain() {
        return;
    }
    // A patch is that of a tissue around a node: elements may have come to be of a tissue of their own since.
    let former = |(node, element): (usize, usize)| -> Key {
        if of_patches { [node as u32, old.material.region(element).into()] } else { [0, element as u32] }
    };
    // Keys with their places: a tile has room for as many in one term.
    let listed: &mut [[u32; 4]] = bytemuck::must_cast_slice_mut(room);
    let keys = (0..places(new)).filter_map(|place| Some((former(at_place(new, place)?), place as u32)));
    let mut count = 0;
    for (entry, ([node, number], place)) in listed.iter_mut().zip(keys) {
        (*entry, count) = ([node, number, place, 0], count + 1);
    }
    let listed = listed.get_mut(..count).unwrap_or_default();
    let key_of = |[node, number, ..]: [u32; 4]| [node, number];
    sort(listed, key_of);
    let (from, to): (&[f32], &mut [f32]) = (bytemuck::must_cast_slice(before), bytemuck::must_cast_slice_mut(after));
    for place in 0..places(old) {
        let Some(key) = at_place(old, place).map(former) else { continue };
        let first = listed.partition_point(|&entry| key_of(entry) < key);
        let same = listed.get(first..).unwrap_or_default().iter().take_while(|&&entry| key_of(entry) == key);
        for &[_, _, new_place, _] in same {
            for (term, component) in (0..terms[0].min(terms[1])).flat_map(|term| (0..6).map(move |each| (term, each))) {
                let at = |terms: usize, place: usize| {
                    OF_TERM * (terms * (place / TILE) + term) + TILE * component + place % TILE
                };
                let value = from.get(at(terms[0], place)).copied().unwrap_or_default();
                to.get_mut(at(terms[1], new_place as usize)).into_iter().for_each(|number| *number = value);
            }
        }
    }
}

/// Places of what relaxes, in the order of the tables.
fn places<M: Material>(scene: SceneView<'_, M>) -> usize {
    TILE * scene.relaxing_tiles()
}

/// What is there: a mesh element, or a node with one of the elements of its patch.
fn at_place<M: Material>(scene: SceneView<'_, M>, place: usize) -> Option<(usize, usize)> {
    let (tile, lane) = (place / TILE, place % TILE);
    if scene.element().is_nodal_strain() {
        let tile = scene.patches.tiles().get(tile)?;
        return (tile.volume(lane) > 0.0).then(|| (tile.node(lane), tile.element(lane)));
    }
    let tile = scene.tiles.get(tile)?;
    (tile.volume::<f32>(lane) > 0.0).then(|| (0, tile.element(lane)))
}
