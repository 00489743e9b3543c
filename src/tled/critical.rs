//! The largest stable step: central differences are stable while `dt < 2 / omega_max`, with `omega_max^2`
//! the largest eigenvalue of `M^-1 K(u)` and `K` the tangent stiffness at the current displacement. Lumped
//! damping does not lower the limit, as it is taken at the middle of the step.
//! The bound of [`crate::element`] needs no iteration.

use crate::element::{
    CriticalBounds, ElementLaw, ElementMaterial, MeanPressure, NodalVolumeBounds, NodeInertia, NodeMatrices,
    OwnPressure, PatchBounds, VolumeRows, balance, weigh,
};
use crate::material::{Law, Laws, Potential};
use crate::scene::{AsScene, SceneView};
use crate::simd::NodeVector;
use crate::state::{AsState, StateView};
use crate::step::{CallingThread, CriticalStep, nodal_volumes};

/// Relative rounding of the sums; the bound is lowered by it.
const ROUNDING: f32 = 1e-5;

/// Times that weights of the nodes are chosen: with nodal pressure the step on bars is 1.12 times the linear element's
/// with none, 1.22 with one, 1.26 with two, 1.29 with three.
const BALANCING_SWEEPS: usize = 3;

/// A bound on the stable step at the state's displacement (at rest for a fresh one), never above the exact limit. It
/// takes as long as some six steps, with nodal pressure some twenty, with nodal strain some thirty, and may be called
/// between any two steps. The state's forces and volumes and the padding of its vectors serve as scratch. Nothing if
/// the state is too small for the scene or not finite.
pub fn critical_step(scene: &impl AsScene, state: &mut impl AsState) -> Option<CriticalStep> {
    critical(scene.as_scene(), state.as_state())
}

fn critical<M: ElementMaterial>(scene: SceneView<'_, M>, state: StateView<'_>) -> Option<CriticalStep> {
    let count = scene.node_count();
    if state.capacity_for(scene.element()) < count {
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
    let rate;
    if scene.element().is_nodal_strain() {
        let weights = volume.get_mut(..count)?;
        weights.fill(NodeVector([1.0, 0.0, 0.0, 0.0]));
        for _ in 0..BALANCING_SWEEPS {
            let patches = scene.patches;
            M::Law::patch_bounds(PatchBounds { laws, patches, inertia, weights, sums: &mut sums });
            let largest = Largest::of(&sums, inertia, |node, rate| weigh(weights, node, rate));
            balance(weights, largest.rate);
            sums.clear();
        }
        M::Law::patch_bounds(PatchBounds { laws, patches: scene.patches, inertia, weights, sums: &mut sums });
        rate = Largest::of(&sums, inertia, |_, _| ());
    } else if !scene.element().is_nodal_pressure() {
        let pressure = OwnPressure;
        let kernel = CriticalBounds { laws, pressure, tiles, inertia, with_volume: true, sums: &mut sums };
        M::Law::critical_bounds(kernel);
        rate = Largest::of(&sums, inertia, |_, _| ());
    } else if let Laws::One(law) = laws {
        let bulk = law.splat::<f32>().bulk_modulus();
        let mut volumes = NodalVolumeBounds { tiles, inertia, rows: &mut *volume };
        volumes.start();
        for _ in 0..BALANCING_SWEEPS {
            sums.clear();
            volumes.add(&mut sums, bulk);
            let largest = Largest::of(&sums, inertia, |node, rate| weigh(volumes.rows, node, rate));
            balance(volumes.rows, largest.rate);
        }
        sums.clear();
        volumes.add(&mut sums, bulk);
        let pressure = MeanPressure::new(VolumeRows { rows: volumes.rows, several_tissues: false });
        let kernel = CriticalBounds { laws, pressure, tiles, inertia, with_volume: false, sums: &mut sums };
        M::Law::nodal_pressure_critical_bounds(kernel);
        rate = Largest::of(&sums, inertia, |_, _| ());
    } else {
        let pressure = MeanPressure::new(VolumeRows { rows: volume, several_tissues: true });
        let kernel = CriticalBounds { laws, pressure, tiles, inertia, with_volume: true, sums: &mut sums };
        M::Law::nodal_pressure_critical_bounds(kernel);
        rate = Largest::of(&sums, inertia, |_, _| ());
    }
    sums.clear();
    // A fresh state stays as it is.
    volume.fill(NodeVector::ZERO);
    let seconds = 2.0 / libm::sqrtf(rate.rate) * (1.0 - ROUNDING);
    rate.finite.then_some(CriticalStep { seconds, node: rate.node })
}

/// The largest eigenvalue of the nodes' matrices, 1/s^2.
#[derive(Clone, Copy, Default)]
struct Largest {
    rate: f32,
    node: u32,
    /// Whether all are finite.
    finite: bool,
}

impl Largest {
    /// `enter` is given that of each node.
    fn of(sums: &NodeMatrices<'_>, inertia: &[NodeInertia], mut enter: impl FnMut(usize, f32)) -> Self {
        let mut largest = Self { finite: true, ..Self::default() };
        for (node, inertia) in inertia.iter().enumerate() {
            let rate = sums.largest_eigenvalue(node, inertia.inverse);
            enter(node, rate);
            largest.finite &= rate.is_finite();
            if rate > largest.rate {
                (largest.rate, largest.node) = (rate, node as u32);
            }
        }
        largest
    }
}
