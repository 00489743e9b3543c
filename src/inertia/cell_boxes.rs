//! Boxes of the lattice, and the elements sorted by them. Most elements lie in a box of at most two cells along
//! each axis; the elements of a box share its functions, so the assembly adds them together (`assembly.rs`).

use glam::Vec4;

use super::lattice::{Lattice, LatticeNode, node_place};
use crate::element::{Axes, ElementTile, NodeInertia};
use crate::heap_sort::sort;
use crate::scene::SceneView;
use crate::simd::TILE;

/// A box of one or two cells along each axis.
#[derive(Clone, Copy, Default, Eq, PartialEq)]
pub(super) struct CellBox {
    /// Indices of its lowest cell along the axes.
    pub(super) low: [u8; 3],
    /// Cells along the axes, at least one.
    pub(super) cells: [u8; 3],
}

impl CellBox {
    /// An integer for each box, at least one.
    #[inline(always)]
    pub(super) fn key(&self) -> u64 {
        let ([i, j, k], [x, y, z]) = (self.low, self.cells);
        u64::from_le_bytes([i, j, k, x, y, z, 0, 0])
    }

    #[inline(always)]
    pub(super) fn of_key(key: u64) -> Self {
        let [i, j, k, x, y, z, _, _] = key.to_le_bytes();
        Self { low: [i, j, k], cells: [x, y, z] }
    }
}

/// The box of an element and the positions of its nodes in it, if each of its nodes is free or held along all axes.
#[inline(always)]
pub(super) fn locate(
    lattice: &Lattice,
    places: &[LatticeNode],
    inertia: &[NodeInertia],
    nodes: &[usize; 4],
) -> Option<(CellBox, [[Vec4; 2]; 4])> {
    let (mut low, mut high) = (Vec4::splat(f32::MAX), Vec4::ZERO);
    let mut positions = [[Vec4::ZERO; 2]; 4];
    for (&node, position) in nodes.iter().zip(&mut positions) {
        let (at, inertia) = (node_place(places, node)?, inertia.get(node)?);
        let [x, y, z] = at.within();
        let free = match inertia.free().cmpgt(Vec4::ZERO).bitmask() {
            0 => 0.0,
            0b111 => 1.0,
            _ => return None,
        };
        let [i, j, k] = lattice.cell_indices(at.cell()).map(f32::from);
        let (cell, within) = (Vec4::new(i, j, k, 0.0), Vec4::new(x, y, z, free));
        *position = [cell, within];
        // A node on the border of two cells belongs to both.
        let border = Vec4::select(within.cmpeq(Vec4::ZERO), Vec4::ONE, Vec4::ZERO);
        low = low.min(cell);
        high = high.max(cell - border);
    }
    let span = (high - low).max(Vec4::ZERO);
    if span.cmpgt(Vec4::ONE).any() {
        return None;
    }
    let indices = |vector: Vec4| vector.truncate().to_array().map(|along| along as u8);
    let cells = CellBox { low: indices(low), cells: indices(span + Vec4::ONE) };
    Some((cells, positions.map(|[cell, within]| [cell - low, within])))
}

/// Sorts the elements by their boxes, those in no box first, and before all others those that touch a node that
/// motions may move. Gives the number of these. The list has the places of all elements: `TILE` times the index of a
/// tile plus that in the tile.
pub(super) fn sort_by_box<M>(
    order: &mut [u32],
    scene: SceneView<'_, M>,
    lattice: &Lattice,
    nodes: &[LatticeNode],
) -> usize {
    let tiles = scene.tiles;
    let places = (0u32..).zip(tiles.iter().flat_map(|tile| (0..TILE).map(move |lane| (tile, lane))));
    let elements = places.filter(|(_, (tile, lane))| tile.volume::<f32>(*lane) > 0.0);
    order.iter_mut().zip(elements).for_each(|(to, (place, _))| *to = place);
    let nodes_of = |place| nodes_of(tiles, place);
    let touches = |nodes: &[usize; 4]| nodes.iter().any(|&node| scene.movable(node) != Axes::NONE);
    sort(order, |place| {
        let nodes_of = nodes_of(place);
        let cells = nodes_of.and_then(|nodes_of| locate(lattice, nodes, scene.inertia, &nodes_of));
        (!nodes_of.as_ref().is_some_and(touches), cells.map_or(0, |(cells, _)| cells.key()), place)
    });
    order.iter().take_while(|&&place| nodes_of(place).as_ref().is_some_and(touches)).count()
}

/// The nodes of the element at a place of the list.
pub(super) fn nodes_of(tiles: &[ElementTile], place: u32) -> Option<[usize; 4]> {
    let tile = tiles.get(place as usize / TILE)?;
    Some([0, 1, 2, 3].map(|corner| tile.node(corner, place as usize % TILE)))
}
