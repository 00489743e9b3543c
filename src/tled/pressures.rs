//! Pressures at nodes, Pa, for display: `-U'(J)` of the law (Bonet & Burton 1998), which is minus the mean Cauchy
//! stress, as the other part of the energy is isochoric.

use std::vec;
use std::vec::Vec;

use glam::DVec3;

use crate::element::{ElementMaterial, invariants, pressure_at, volume_ratio};
use crate::material::{Law, Potential};
use crate::scene::{AsScene, SceneView};
use crate::simd::NodeVector;
use crate::state::{AsState, StateView};
use crate::step::{CallingThread, nodal_volumes};

/// Pressure at every node of the scene, Pa, positive where tissue is compressed: the mean over the elements around it,
/// weighted by their volumes at rest. With nodal pressure that is the node's own but where tissues meet; in linear
/// tetrahedra it hides how far apart the elements' pressures are. Zero at nodes without elements. Nothing if the state
/// is too small.
pub fn nodal_pressures(scene: &impl AsScene, state: &mut impl AsState) -> Option<Vec<f32>> {
    nodal_pressures_of(scene.as_scene(), state.as_state())
}

fn nodal_pressures_of<M: ElementMaterial>(scene: SceneView<'_, M>, state: StateView<'_>) -> Option<Vec<f32>> {
    let nodes = scene.node_count();
    if state.capacity_for(scene.element()) < nodes {
        return None;
    }
    nodal_volumes(scene, state.displacement, &[], state.volume, &CallingThread);
    let volumes = scene.element().is_nodal_pressure().then(|| scene.volume_rows(state.volume));
    let mut sums = vec![(0.0, 0.0); nodes];
    if scene.element().is_nodal_strain() {
        add_patches(scene, state.displacement, &mut sums);
        return Some(means(sums));
    }
    for (tile, lane, law) in scene.laws_at_places() {
        let volume = f64::from(tile.volume::<f32>(lane));
        let ratio = volume_ratio(tile, lane, state.displacement);
        for corner in 0..4 {
            if let Some((sum, weight)) = sums.get_mut(tile.node(corner, lane)) {
                *sum += volume * pressure_at(&law, tile, lane, corner, ratio, volumes);
                *weight += volume;
            }
        }
    }
    Some(means(sums))
}

fn means(sums: Vec<(f64, f64)>) -> Vec<f32> {
    let mean = |(sum, weight): (f64, f64)| if weight > 0.0 { (sum / weight) as f32 } else { 0.0 };
    sums.into_iter().map(mean).collect()
}

/// Adds pressures and volumes of the patches of nodal strain to their nodes.
fn add_patches<M: ElementMaterial>(scene: SceneView<'_, M>, displacement: &[NodeVector], sums: &mut [(f64, f64)]) {
    let laws = scene.material.laws();
    let at = |node: usize| DVec3::from_array(displacement[node].to_array().map(f64::from));
    for (tile, lane) in scene.patches.places() {
        let law = laws.of(tile.element(lane)).splat::<f32>();
        let h = tile.gradient(scene.patches.neighbours_of(tile), lane, at);
        let pressure = -f64::from(law.bulk_modulus() * invariants(h).1 as f32);
        let (sum, weight) = &mut sums[tile.node(lane)];
        *sum += tile.volume(lane) * pressure;
        *weight += tile.volume(lane);
    }
}
