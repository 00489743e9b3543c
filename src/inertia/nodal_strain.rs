//! What mass-scaled, multilevel and damped steps need of tetrahedra with nodal strain ([`crate::element`],
//! `patch_forces.rs`): the patches of nodes take the place of elements in bounds and in the coarse stiffness. The
//! stabilising energy is quadratic in the displacements, so its part of the coarse stiffness,
//!
//! ```text
//! s_c D^2 / 4 s mu sum_e V_e grad phi_c . grad phi_d I        kg
//! ```
//! is computed once. The patches' tangents have its other part, `-s mu |dF_a|^2`; both together do not feel rotations.

use glam::Vec4;

use super::assembly::{Assembly, ElementTangent, Tangent, forces};
use super::dense::{row_length, stride};
use super::direct_assembly::NO_SLOTS;
use super::frames::{Frames, Rotation};
use super::lattice::rank_of;
use super::node_tables::NodeTables;
use super::refresh::RefreshInput;
use crate::element::{
    CrushedBounds, ElementLaw, ElementMaterial, MatrixSums, PatchTile, PatchTileBounds, TileTangents, each_bounded,
    stabilising_modulus,
};
use crate::scene::SceneView;
use crate::simd::{Gather, NodeVector, Scatter, TILE};

/// Writes the coarse stiffness of the stabilising energy, of one matrix for each axis, in `to`; `matrix` is for use
/// meanwhile.
pub(super) fn write_stabilising<M: ElementMaterial>(to: &mut [f32], matrix: &mut [f32], input: &RefreshInput<'_, M>) {
    let functions = input.lattice.functions();
    let (stride, length, mut slots) = (stride(functions), row_length(functions), NO_SLOTS);
    matrix.fill(0.0);
    let mut assembly = input.assembly(matrix, stride);
    for (tile, lane, law) in input.scene.laws_at_places() {
        let modulus = stabilising_modulus(&law) as f32;
        let tangent = Tangent::isotropic(input.scaling.coarse_weight * modulus * tile.volume::<f32>(lane));
        assembly.add_element(&ElementTangent::with(tile, lane, tangent), &mut slots);
    }
    let size = to.len() / 3;
    for (axis, to) in to.chunks_exact_mut(size.max(1)).enumerate() {
        for (function, row) in to.chunks_exact_mut(length.max(1)).enumerate().take(functions) {
            let from = matrix.get((3 * function + axis) * stride + axis..).unwrap_or_default();
            for (entry, from) in row.iter_mut().zip(from.iter().step_by(3)).take(function + 1) {
                *entry = *from;
            }
        }
    }
}

/// Adds the bounds of the patches of a tile to the sums of the nodes, and their tangents to the coarse stiffness.
pub(super) fn add_tile<M: ElementMaterial>(
    input: &RefreshInput<'_, M>,
    frames: &Frames,
    tables: &mut NodeTables<'_>,
    tile: &PatchTile,
    assembly: Option<&mut Assembly<'_>>,
) -> TileTangents {
    let neighbours = input.scene.patches.neighbours_of(tile);
    let mut rotations = [Rotation::NONE.0; TILE];
    for (lane, rotation) in rotations.iter_mut().enumerate() {
        *rotation = frames.since_start(tables.frame(rank_of(input.places, tile.node(lane)))).0;
    }
    let diagonal = Scatter::new(tables.sum_diagonal);
    let tangents = M::Law::patch_tile_bounds(PatchTileBounds {
        laws: input.scene.material.laws(),
        tile,
        neighbours,
        displacement: Gather::new(input.displacement),
        sums: MatrixSums { diagonal, off_diagonal: Scatter::new(tables.sum_off_diagonal) },
        rotations: &rotations,
        weight: if assembly.is_some() { input.scaling.coarse_weight } else { 0.0 },
    });
    if let Some(assembly) = assembly {
        let mut slots = NO_SLOTS;
        for lane in (0..TILE).filter(|&lane| tile.volume(lane) > 0.0) {
            let nodes = tile.gradients(neighbours, lane).map(|(node, gradient, _)| (node, gradient));
            assembly.add_patch(nodes, &Tangent::of(&tangents, lane), &mut slots);
        }
    }
    tangents
}

/// Adds the bounds of crushed elements to the sums of the nodes, and their tangents to the coarse stiffness: of the
/// elements in the tables' tile `at` of `count` equal shares of them.
pub(super) fn add_crushed<M: ElementMaterial>(
    input: &RefreshInput<'_, M>,
    frames: &Frames,
    tables: &mut NodeTables<'_>,
    (at, count): (usize, usize),
    mut assembly: Option<&mut Assembly<'_>>,
) {
    let (tiles, displacement, mut slots) = (input.scene.tiles, input.displacement, NO_SLOTS);
    let share = |at: usize| (at * tiles.len()).checked_div(count).unwrap_or(0);
    let tiles = tiles.get(share(at)..share(at + 1)).unwrap_or_default();
    each_bounded(&input.scene.material.laws(), tiles, displacement, |crushed| {
        let mut rotations = [Rotation::NONE.0; TILE];
        for (lane, rotation) in rotations.iter_mut().enumerate() {
            *rotation = frames.since_start(tables.frame(rank_of(input.places, crushed.tile.node(0, lane)))).0;
        }
        let diagonal = Scatter::new(tables.sum_diagonal);
        let tangents = CrushedBounds {
            crushed,
            displacement: Gather::new(displacement),
            sums: MatrixSums { diagonal, off_diagonal: Scatter::new(tables.sum_off_diagonal) },
            rotations: &rotations,
            weight: if assembly.is_some() { input.scaling.coarse_weight } else { 0.0 },
        };
        let tangents = tangents.tangents();
        if let Some(assembly) = &mut assembly {
            for lane in (0..TILE).filter(|&lane| crushed.moduli[lane] > 0.0) {
                assembly.add_element(&ElementTangent::of(&crushed.tile, &tangents, lane), &mut slots);
            }
        }
    });
}

/// Calls `add` with the nodes of patches with a changed node and the forces by which these patches resist a change of
/// the displacements (m), with the factor `weight` (s^2). `changed` gives the change of a node.
pub(super) fn resist<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    weight: f32,
    displacement: &[NodeVector],
    changed: impl Fn(usize) -> Vec4,
    mut add: impl FnMut(usize, Vec4),
) {
    let (patches, laws) = (scene.patches, scene.material.laws());
    for tile in patches.tiles() {
        let neighbours = patches.neighbours_of(tile);
        let is_changed = |lane: usize| {
            tile.volume(lane) > 0.0 && tile.gradients(neighbours, lane).any(|(node, ..)| changed(node) != Vec4::ZERO)
        };
        if !(0..TILE).any(is_changed) {
            continue;
        }
        // No sums over the nodes.
        let sums = MatrixSums { diagonal: Scatter::new(&mut []), off_diagonal: Scatter::new(&mut []) };
        let (displacement, rotations) = (Gather::new(displacement), &[Rotation::NONE.0; TILE]);
        let kernel = PatchTileBounds { laws, tile, neighbours, displacement, sums, rotations, weight };
        let tangents = M::Law::patch_tile_bounds(kernel);
        for lane in (0..TILE).filter(|&lane| is_changed(lane)) {
            let nodes = tile.gradients(neighbours, lane).map(|(node, gradient, _)| (node, gradient));
            forces(&Tangent::of(&tangents, lane), nodes, &changed, &mut add);
            let own = changed(tile.node(lane));
            let mut pull = Vec4::ZERO;
            for (node, _, coupling) in tile.gradients(neighbours, lane) {
                pull += coupling * (own - changed(node));
            }
            let modulus = stabilising_modulus(&laws.of(tile.element(lane))) as f32;
            add(tile.node(lane), weight * modulus * pull);
        }
    }
    each_bounded(&laws, scene.tiles, displacement, |crushed| {
        let is_changed = |lane: usize| (0..4).any(|corner| changed(crushed.tile.node(corner, lane)) != Vec4::ZERO);
        if !(0..TILE).any(is_changed) {
            return;
        }
        let sums = MatrixSums { diagonal: Scatter::new(&mut []), off_diagonal: Scatter::new(&mut []) };
        let (displacement, rotations) = (Gather::new(displacement), &[Rotation::NONE.0; TILE]);
        let tangents = CrushedBounds { crushed, displacement, sums, rotations, weight }.tangents();
        for lane in (0..TILE).filter(|&lane| crushed.moduli[lane] > 0.0 && is_changed(lane)) {
            let element = ElementTangent::of(&crushed.tile, &tangents, lane);
            forces(&element.tangent, element.corners(), &changed, &mut add);
        }
    });
}
