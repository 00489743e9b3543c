//! The largest stable step: central differences are stable while `dt < 2 / omega_max`, with `omega_max^2`
//! the largest eigenvalue of `M^-1 K(u)` and `K` the tangent stiffness at the current displacement. Lumped
//! damping does not lower the limit, as it is taken at the middle of the step.
//! The bound of [`crate::element`] needs no iteration.

use crate::element::{
    CriticalBounds, ElementLaw, ElementMaterial, MeanPressure, NodalVolumeBounds, NodeInertia, NodeMatrices,
    OwnPressure, PatchBounds, VolumeRows, add_crushed_bounds, add_fibre_bounds, add_patch_fibre_bounds, balance, weigh,
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
    critical(scene.as_scene(), state.as_state(), &mut Weights { of_nodes: &mut [], chosen: false })
}

/// Weights of the nodes in the bounds of nodal pressure of one tissue and of nodal strain. The bounds hold with any;
/// those that were chosen at one state are good at others, and with them a bound takes a quarter of the time.
pub(super) struct Weights<'a> {
    /// One for each node; empty if nobody keeps them.
    pub(super) of_nodes: &'a mut [f32],
    /// Whether they are to be used, or to be chosen.
    pub(super) chosen: bool,
}

impl Weights<'_> {
    /// Chooses weights, the first numbers of the nodes' rows, unless they are chosen: `add` adds the bounds with those
    /// in the rows to sums that are zero, and they are zero again.
    fn choose(
        &mut self,
        rows: &mut [NodeVector],
        sums: &mut NodeMatrices<'_>,
        inertia: &[NodeInertia],
        mut add: impl FnMut(&mut [NodeVector], &mut NodeMatrices<'_>),
    ) {
        if self.chosen {
            for (row, weight) in rows.iter_mut().zip(&*self.of_nodes) {
                row.0[0] = *weight;
            }
            return;
        }
        for _ in 0..BALANCING_SWEEPS {
            add(rows, sums);
            let mut largest = 0.0_f32;
            for (node, inertia) in inertia.iter().enumerate() {
                let rate = sums.largest_eigenvalue(node, inertia.inverse);
                weigh(rows, node, rate);
                largest = largest.max(rate);
            }
            balance(rows, largest);
            sums.clear();
        }
        for (weight, row) in self.of_nodes.iter_mut().zip(rows) {
            *weight = row.0[0];
        }
    }
}

/// See [`critical_step`].
// Not inlined: other crates use the one that is compiled here.
#[inline(never)]
pub(super) fn critical<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    state: StateView<'_>,
    weights: &mut Weights<'_>,
) -> Option<CriticalStep> {
    if state.capacity_for(scene.element()) < scene.node_count() {
        return None;
    }
    let StateView { displacement, increment, force, volume, .. } = state;
    let with = |sums: &NodeMatrices<'_>| Largest::of(sums, scene.inertia);
    let largest = with_bounds(scene, scene.inertia, [displacement, increment, force], volume, weights, with)?;
    let seconds = 2.0 / libm::sqrtf(largest.rate) * (1.0 - ROUNDING);
    largest.finite.then_some(CriticalStep { seconds, node: largest.node })
}

/// Calls `with` with each node and the largest eigenvalue of its matrix with other masses `x` than its own, 1/s^2:
/// `K <= sum_a x_a lambda_a` for the stiffness at the displacements, the first of some vectors of the nodes; the others
/// and `volume` are scratch.
pub(crate) fn each_rate<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    inertia: &[NodeInertia],
    vectors: [&mut [NodeVector]; 3],
    volume: &mut [NodeVector],
    mut with: impl FnMut(usize, f32),
) -> Option<()> {
    let weights = &mut Weights { of_nodes: &mut [], chosen: true };
    with_bounds(scene, inertia, vectors, volume, weights, |sums| {
        for (node, inertia) in inertia.iter().enumerate() {
            with(node, sums.largest_eigenvalue(node, inertia.inverse));
        }
    })
}

/// Calls `with` with the nodes' matrices.
fn with_bounds<M: ElementMaterial, T>(
    scene: SceneView<'_, M>,
    inertia: &[NodeInertia],
    [displacement, increment, force]: [&mut [NodeVector]; 3],
    volume: &mut [NodeVector],
    weights: &mut Weights<'_>,
    with: impl FnOnce(&NodeMatrices<'_>) -> T,
) -> Option<T> {
    let count = scene.node_count();
    nodal_volumes(scene, displacement, &[], volume, &CallingThread);
    let mut sums = NodeMatrices {
        xx_yy_zz_xy: force.get_mut(..count)?,
        yz_in_padding: increment.get_mut(..count)?,
        zx_in_padding: displacement.get_mut(..count)?,
    };
    sums.clear();
    let (laws, tiles) = (scene.material.laws(), scene.tiles);
    if scene.element().is_nodal_strain() {
        let rows = volume.get_mut(..count)?;
        rows.fill(NodeVector([1.0, 0.0, 0.0, 0.0]));
        let (patches, mut crushed) = (scene.patches, true);
        let mut add = |weights: &mut [NodeVector], sums: &mut NodeMatrices<'_>| {
            M::Law::patch_bounds(PatchBounds { laws, patches, inertia, weights, sums });
            crushed = crushed && add_crushed_bounds(scene.elements(), inertia, sums);
            if let Some(fibres) = scene.fibrous() {
                add_patch_fibre_bounds(fibres, patches, inertia, weights, sums);
            }
        };
        weights.choose(rows, &mut sums, inertia, &mut add);
        add(rows, &mut sums);
    } else if !scene.element().is_nodal_pressure() {
        let pressure = OwnPressure;
        let kernel = CriticalBounds { laws, pressure, tiles, inertia, with_volume: true, sums: &mut sums };
        M::Law::critical_bounds(kernel);
    } else if let Laws::One(law) = laws {
        let bulk = law.splat::<f32>().bulk_modulus();
        NodalVolumeBounds { tiles, inertia, rows: &mut *volume }.start();
        let add = |rows: &mut [NodeVector], sums: &mut NodeMatrices<'_>| {
            NodalVolumeBounds { tiles, inertia, rows }.add(sums, bulk);
        };
        weights.choose(volume, &mut sums, inertia, add);
        add(volume, &mut sums);
        let pressure = MeanPressure::new(VolumeRows { rows: volume, several_tissues: false });
        let kernel = CriticalBounds { laws, pressure, tiles, inertia, with_volume: false, sums: &mut sums };
        M::Law::nodal_pressure_critical_bounds(kernel);
    } else {
        let pressure = MeanPressure::new(VolumeRows { rows: volume, several_tissues: true });
        let kernel = CriticalBounds { laws, pressure, tiles, inertia, with_volume: true, sums: &mut sums };
        M::Law::nodal_pressure_critical_bounds(kernel);
    }
    if let Some(fibres) = scene.fibrous().filter(|_| !scene.element().is_nodal_strain()) {
        add_fibre_bounds(fibres, tiles, inertia, &mut sums);
    }
    let answer = with(&sums);
    sums.clear();
    // A fresh state stays as it is.
    volume.fill(NodeVector::ZERO);
    Some(answer)
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
    fn of(sums: &NodeMatrices<'_>, inertia: &[NodeInertia]) -> Self {
        let mut largest = Self { finite: true, ..Self::default() };
        for (node, inertia) in inertia.iter().enumerate() {
            // Most nodes are not stiff enough to count.
            if sums.trace(node) <= largest.rate {
                continue;
            }
            let rate = sums.largest_eigenvalue(node, inertia.inverse);
            largest.finite &= rate.is_finite();
            if rate > largest.rate {
                (largest.rate, largest.node) = (rate, node as u32);
            }
        }
        largest
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use std::{println, vec, vec::Vec};

    use super::*;
    use crate::material::{Material, NeoHookean, NodalPressure, NodalStrain, Tissue};
    use crate::mesh::{Bar, Mesh, Winding};
    use crate::scene::VecScene;
    use crate::state::VecState;
    use crate::tled::exact_critical_step;

    /// Bound over exact limit of the bar that is bent by up to `most` (m), with weights that were chosen at rest, and
    /// with new ones.
    fn ratios<M: ElementMaterial + Material>(material: M, most: f32) -> [f64; 2] {
        let bar = Bar { size: [0.03, 0.03, 0.06], cells: [3, 3, 6] };
        let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
        let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
        let scene = VecScene::build(material, &mesh, &[]).unwrap();
        let mut of_nodes = vec![0.0; points.len()];
        let mut state = VecState::at_rest(points.len());
        critical(scene.view(), state.view(), &mut Weights { of_nodes: &mut of_nodes, chosen: false }).unwrap();
        assert!(of_nodes.iter().any(|&weight| weight < 1.0) && of_nodes.iter().all(|&weight| weight > 0.0));
        state.view().put(0.0, 1e-4, |node| {
            let [x, y, z] = points[node];
            let share = (z / 0.06) * (z / 0.06);
            [[most * share, 0.2 * most * share * (x / 0.03), -0.5 * most * share * (y / 0.03)], [0.0; 3]]
        });
        let exact = exact_critical_step(scene.view(), state.displacements()).unwrap();
        [true, false].map(|chosen| {
            let weights = &mut Weights { of_nodes: &mut of_nodes, chosen };
            f64::from(critical(scene.view(), state.view(), weights).unwrap().seconds) / exact
        })
    }

    /// A bound with weights of another state is no less a bound, and nearly as close.
    #[test]
    fn weights_that_were_chosen_at_rest_bound_a_bent_body() {
        let tissue = Tissue { law: NeoHookean { c: 1_500.0, d: 60_000.0 }, density: 1000.0 };
        for most in [0.0, 0.005, 0.02] {
            let [pressure, strain] = [ratios(NodalPressure(tissue), most), ratios(NodalStrain(tissue), most)];
            for ([kept, new], element) in [(pressure, "nodal pressure"), (strain, "nodal strain")] {
                println!(
                    "{element}, bent by {most} m: {kept:.3} of the exact limit with kept weights, {new:.3} with new"
                );
                assert!(kept <= 1.0 && kept > 0.9 * new);
            }
        }
    }
}
