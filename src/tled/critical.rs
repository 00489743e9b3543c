//! The largest stable step: central differences are stable while `dt < 2 / omega_max`, with `omega_max^2`
//! the largest eigenvalue of `M^-1 K(u)` and `K` the tangent stiffness at the current displacement. Lumped
//! damping does not lower the limit, as it is taken at the middle of the step.
//! The bound of [`crate::element`] needs no iteration.

use crate::element::{CriticalBounds, ElementLaw, ElementMaterial, MeanPressure, NodeMatrices, OwnPressure};
use crate::scene::{AsScene, SceneView};
use crate::simd::Gather;
use crate::state::{AsState, StateView};
use crate::step::{CallingThread, CriticalStep, nodal_volumes};

/// Relative rounding of the sums; the bound is lowered by it.
const ROUNDING: f32 = 1e-5;

/// A bound on the stable step at the state's displacement (at rest for a fresh one), never above the
/// exact limit. It takes as long as some six steps and may be called between any two steps. The state's forces and
/// the padding of its vectors serve as scratch. Nothing if the state is too small for the scene or not finite.
pub fn critical_step(scene: &impl AsScene, state: &mut impl AsState) -> Option<CriticalStep> {
    critical(scene.as_scene(), state.as_state())
}

fn critical<M: ElementMaterial>(scene: SceneView<'_, M>, state: StateView<'_>) -> Option<CriticalStep> {
    let count = scene.node_count();
    if state.capacity_for::<M>() < count {
        return None;
    }
    let StateView { displacement, increment, force, volume, .. } = state;
    nodal_volumes(scene, displacement, volume, &CallingThread);
    let mut sums = NodeMatrices {
        xx_yy_zz_xy: force.get_mut(..count)?,
        yz_in_padding: increment.get_mut(..count)?,
        zx_in_padding: displacement.get_mut(..count)?,
    };
    sums.clear();
    let (laws, tiles, inertia) = (scene.material.laws(), scene.tiles, scene.inertia);
    if M::NODAL_PRESSURE {
        let pressure = MeanPressure(Gather::new(volume));
        let kernel = CriticalBounds { laws, pressure, tiles, inertia, sums: &mut sums };
        M::Law::nodal_pressure_critical_bounds(kernel);
    } else {
        let pressure = OwnPressure;
        M::Law::critical_bounds(CriticalBounds { laws, pressure, tiles, inertia, sums: &mut sums });
    }
    let mut largest = (0.0, 0);
    let mut finite = true;
    for (node, inertia) in scene.inertia.iter().enumerate() {
        let rate = sums.largest_eigenvalue(node, inertia.inverse);
        finite &= rate.is_finite();
        if rate > largest.0 {
            largest = (rate, node as u32);
        }
    }
    sums.clear();
    let seconds = 2.0 / libm::sqrtf(largest.0) * (1.0 - ROUNDING);
    finite.then_some(CriticalStep { seconds, node: largest.1 })
}
