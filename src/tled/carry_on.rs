//! Going on in another scene of the same nodes: after a resection ([`Mesh::without`](crate::mesh::Mesh::without)), with
//! other constants or densities. Positions and velocities stay, so what stays of the tissue keeps its momentum; tension
//! that the removed tissue carried is gone at once. The energy balance (J) begins with the kinetic and the strain energy
//! that there are now.

use super::strain_energy_of;
use crate::element::{ElementMaterial, Extremes, forget_crushed};
use crate::scene::{AsScene, SceneView};
use crate::simd::NodeVector;
use crate::state::{AsState, StateView};
use crate::step::EnergyBalance;

/// Lets a state go on in a scene that has taken the place of another one of the same nodes: displacements, velocities
/// and time stay; nodes that the new scene holds stand still, and the energy balance begins anew. Long, adaptive and
/// learned steps, guards and reactions must be prepared again, and exact ones need the
/// [critical step](super::critical_step) of the new scene. Work is a pass over the elements. Returns whether the state
/// has room for the scene.
#[must_use = "a state without room for the scene cannot go on in it"]
pub fn carry_on(scene: &impl AsScene, state: &mut impl AsState) -> bool {
    carry_on_in(scene.as_scene(), state.as_state())
}

/// See [`carry_on`].
pub(crate) fn carry_on_in<M: ElementMaterial>(scene: SceneView<'_, M>, mut state: StateView<'_>) -> bool {
    let Some(strain) = strain_energy_of(scene, state.reborrow()) else { return false };
    let StateView { increment, force, volume, progress, .. } = state;
    let (per_second, mut kinetic) = (if progress.dt > 0.0 { 1.0 / f64::from(progress.dt) } else { 0.0 }, 0.0);
    for (inertia, increment) in scene.inertia.iter().zip(increment) {
        let moves = inertia.movable();
        for (axis, component) in increment.0.iter_mut().take(3).enumerate() {
            if inertia.inverse.get(axis).is_some_and(|&inverse| inverse > 0.0) {
                let speed = f64::from(*component) * per_second;
                kinetic += 0.5 * f64::from(inertia.mass) * speed * speed;
            } else if !moves.has(axis) {
                *component = 0.0;
            }
        }
    }
    // Those of elements that may be gone.
    force.fill(NodeVector::ZERO);
    forget_crushed(volume);
    (progress.extremes, progress.seen) = (Extremes::REST, None);
    let start = kinetic + strain + scene.rounding_energy();
    progress.energy_balance = EnergyBalance { start, kinetic, peak: start, ..EnergyBalance::NEW };
    true
}
