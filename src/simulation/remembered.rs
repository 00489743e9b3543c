//! What tissue remembers ([`crate::element`], relaxation) when another scene of the same nodes takes the place of the one
//! in which it came about: each element, or patch with nodal strain, keeps its own.

use std::collections::BTreeMap;
use std::vec;
use std::vec::Vec;

use crate::material::{Material, VecMaterial};
use crate::scene::SceneView;
use crate::simd::{NodeVector, TILE};

/// Numbers of a term in a tile, one copy.
const OF_TERM: usize = 6 * TILE;

/// Where something keeps its memory: tile and place in it.
type Place = (usize, usize);

/// A mesh element, or a node with one of the elements of its patch.
type Key = (u32, usize);

/// Everything that relaxes, in the order of the tables.
fn places(scene: SceneView<'_, VecMaterial>) -> Vec<(Key, Place)> {
    let with_lanes = |tiles: usize| (0..tiles).flat_map(|tile| (0..TILE).map(move |lane| (tile, lane)));
    if scene.element().is_nodal_strain() {
        let tiles = scene.patches.tiles();
        let places = with_lanes(tiles.len()).filter(|&(tile, lane)| tiles[tile].volume(lane) > 0.0);
        return places
            .map(|(tile, lane)| ((tiles[tile].node(lane) as u32, tiles[tile].element(lane)), (tile, lane)))
            .collect();
    }
    let places = with_lanes(scene.tiles.len()).filter(|&(tile, lane)| scene.tiles[tile].volume::<f32>(lane) > 0.0);
    places.map(|(tile, lane)| ((0, scene.tiles[tile].element(lane)), (tile, lane))).collect()
}

/// The memory of a state in scene `new`, from one copy of that in scene `old`.
pub(super) fn carried(
    old: SceneView<'_, VecMaterial>,
    new: SceneView<'_, VecMaterial>,
    memory: &[NodeVector],
) -> Vec<NodeVector> {
    let mut carried = vec![NodeVector::ZERO; new.memory_vectors()];
    let terms = |scene: SceneView<'_, VecMaterial>| 4 * scene.vectors_of_tile() / OF_TERM;
    let (before, after) = (terms(old), terms(new));
    // A patch is that of a tissue around a node: elements may have come to be of a tissue of their own since.
    let former = |(node, element): Key| match old.element().is_nodal_strain() {
        true => (node, usize::from(old.material.region(element))),
        false => (0, element),
    };
    let of_old: BTreeMap<_, _> = places(old).into_iter().map(|(key, place)| (former(key), place)).collect();
    let from: &[f32] = bytemuck::cast_slice(memory);
    let to: &mut [f32] = bytemuck::cast_slice_mut(&mut carried);
    for (key, (tile, lane)) in places(new) {
        let Some(&(old_tile, old_lane)) = of_old.get(&former(key)) else { continue };
        for term in 0..before.min(after) {
            for component in 0..6 {
                let at =
                    |tile: usize, terms: usize, lane: usize| OF_TERM * (terms * tile + term) + TILE * component + lane;
                let value = from.get(at(old_tile, before, old_lane)).copied().unwrap_or_default();
                if let Some(place) = to.get_mut(at(tile, after, lane)) {
                    *place = value;
                }
            }
        }
    }
    carried
}
