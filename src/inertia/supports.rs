//! Supports whose speed changes, coupled to the motion of the lattice. A step solves `S c + A_s d = g` for the lattice,
//! where `d` (m) is the change of the supports' increments and `A_s = s_c D^2 / 4 W^T K_s` (kg) the stiffness between
//! the lattice's functions and the supports, with the bound `K` of `assembly.rs`. Without the second term a support
//! that starts leaves the body behind until its elements are stretched by a whole step's motion; with it the lattice
//! follows as far as `A` resists the strain. Supports that stand still or keep their speed add nothing.
//!
//! The bound of elements and supports together is positive, so `S^-1 A_s d` gets at most the energy `d K_ss d` of
//! supports that move alone. Where it would get more, `S` is from before tissue at the supports has stiffened, and the
//! motion is scaled down.

use glam::Vec4;

use super::assembly::{ElementTangent, forces};
use super::frames::Rotation;
use super::lattice::{CoarseVectors, Lattice, LatticeNode, MAX_FUNCTIONS, node_place};
use super::nodal_strain;
use crate::element::{
    ElementMaterial, ElementTile, MatrixSums, NodeInertia, OwnPressure, TileBounds, TileTangents, tile_bounds,
};
use crate::loads::Loads;
use crate::scene::SceneView;
use crate::simd::{Gather, NodeVector, Scatter, TILE};
use crate::step::Step;

/// What supports whose speed changes do to the lattice.
pub(super) struct Pull {
    /// `-A_s d` for each function, kg m.
    pub(super) residual: CoarseVectors,
    /// `s_c D^2 / 4 d K_ss d`, kg m^2.
    pub(super) energy: f32,
}

/// The supports of a scene that motions may move, in a state.
pub(super) struct MovingSupports<'a, M> {
    pub(super) scene: SceneView<'a, M>,
    pub(super) lattice: &'a Lattice,
    pub(super) places: &'a [LatticeNode],
    /// The elements that touch a node that motions may move; with nodal strain none.
    pub(super) elements: &'a [u32],
    /// `s_c D^2 / 4`, s^2.
    pub(super) weight: f32,
    pub(super) displacement: &'a [NodeVector],
    /// Of the nodes, for materials with nodal pressure.
    pub(super) volume: &'a [NodeVector],
}

impl<M: ElementMaterial> MovingSupports<'_, M> {
    /// None if no support changes its speed. `time` (s) is that of the state, `changes` are
    /// vectors of the nodes whose first three components are free.
    #[inline(never)]
    pub(super) fn pull(
        &self,
        loads: &Loads<'_>,
        time: f64,
        step: &Step,
        increment: &mut [NodeVector],
        changes: &mut [NodeVector],
    ) -> Option<Pull> {
        if loads.motions().is_empty() || (self.elements.is_empty() && !self.scene.element().is_nodal_strain()) {
            return None;
        }
        for NodeVector([x, y, z, _]) in &mut *changes {
            (*x, *y, *z) = (0.0, 0.0, 0.0);
        }
        let mut moves = false;
        loads.each_prescribed(time + f64::from(step.seconds()), increment, |node, axis, position, increment| {
            if let (Some(change), Some(displacement)) = (changes.get_mut(node), self.displacement.get(node)) {
                let next = position - displacement.0[axis % 4];
                change.0[axis % 3] = next - step.carry() * increment[axis % 4];
                moves |= change.0[axis % 3] != 0.0;
            }
        });
        if !moves {
            return None;
        }
        let mut pull = Pull { residual: [NodeVector::ZERO; MAX_FUNCTIONS + 1], energy: 0.0 };
        let changed =
            |node: usize| changes.get(node).map_or(Vec4::ZERO, |&NodeVector([x, y, z, _])| Vec4::new(x, y, z, 0.0));
        let mut add = |node, force: Vec4| {
            pull.energy += force.dot(changed(node));
            self.add_force(node, force, &mut pull.residual);
        };
        if self.scene.element().is_nodal_strain() {
            nodal_strain::resist(self.scene, self.weight, self.displacement, changed, add);
        } else {
            for places in self.elements.chunks(TILE) {
                self.add_tile(places, changed, &mut add);
            }
        }
        Some(pull)
    }

    /// Calls `add` with the nodes of the elements at these places and the forces by which they resist the changes.
    fn add_tile(&self, places: &[u32], changed: impl Fn(usize) -> Vec4, mut add: impl FnMut(usize, Vec4)) {
        let tile = ElementTile::gather(self.scene.tiles, places);
        let tangents = self.tangents(&tile);
        for lane in 0..places.len() {
            let element = ElementTangent::of(&tile, &tangents, lane);
            if element.nodes.iter().any(|&node| changed(node) != Vec4::ZERO) {
                forces(&element.tangent, element.corners(), &changed, &mut add);
            }
        }
    }

    fn tangents(&self, tile: &ElementTile) -> TileTangents {
        let Self { scene, displacement, weight, .. } = *self;
        let (laws, displacement) = (scene.material.laws(), Gather::new(displacement));
        // No sums over the nodes.
        let sums = MatrixSums { diagonal: Scatter::new(&mut []), off_diagonal: Scatter::new(&mut []) };
        let rotations = &[Rotation::NONE.0; TILE];
        tile_bounds(
            scene.element(),
            TileBounds { laws, pressure: OwnPressure, tile, displacement, sums, rotations, weight },
            self.volume,
        )
    }

    /// Subtracts the share of each function in a node's force.
    fn add_force(&self, node: usize, force: Vec4, residual: &mut CoarseVectors) {
        let Some(place) = node_place(self.places, node) else {
            return;
        };
        let free = self.scene.inertia.get(node).map_or(Vec4::ZERO, NodeInertia::free);
        for (function, weight) in self.lattice.weights(place) {
            if let Some(sum) = residual.get_mut(function) {
                sum.0 = (Vec4::from(sum.0) - weight * free * force).to_array();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::Axes;
    use crate::inertia::assembly::Assembly;
    use crate::inertia::cell_boxes::sort_by_box;
    use crate::inertia::dense::to_components;
    use crate::inertia::dense::{apply_lower, stride};
    use crate::inertia::lattice::sort_by_cell;
    use crate::loads::Motion;
    use crate::material::{NeoHookean, Tissue};
    use crate::mesh::{Bar, Mesh, Winding};
    use crate::scene::{Support, VecScene};
    use crate::state::VecState;

    /// Where body and supports move alike, no element is strained: `Kc 1 + A_s 1 = 0`.
    #[test]
    fn a_translation_of_body_and_supports_together_meets_no_resistance() {
        const BAR: Bar = Bar { size: [0.03, 0.03, 0.06], cells: [4, 4, 8] };
        const SHIFT: [f32; 3] = [1e-3, -2e-3, 3e-3];
        let (points, tets): (Vec<_>, Vec<_>) = (BAR.points().collect(), BAR.tets().collect());
        let moved: Vec<_> = (0..25).collect();
        let supports: Vec<_> = moved.iter().map(|&node| Support::moved(node)).collect();
        let motions: Vec<_> =
            moved.iter().map(|&node| Motion { node, axes: Axes::XYZ, metre: SHIFT, ramp: 0.0 }).collect();
        let mesh = Mesh::new(&points, &tets, Winding::Normalised).unwrap();
        let law = NeoHookean { c: 2000.0, d: 50_000.0 };
        let scene = VecScene::build(Tissue { law, density: 1000.0 }, &mesh, &supports).unwrap();
        let (scene, loads) = (scene.view(), Loads::new(&scene, [0.0; 3], &[], &motions).unwrap());
        let lattice = Lattice::new([2, 2, 3], &points, scene.inertia).unwrap();
        let mut places: Vec<_> = points.iter().map(|&point| lattice.place(point)).collect();
        sort_by_cell(&mut places);
        let mut order = vec![0; tets.len()];
        let touching = sort_by_box(&mut order, scene, &lattice, &places);
        let expected = tets.iter().filter(|tet| tet.iter().any(|node| moved.contains(node))).count();
        assert_eq!(touching, expected);

        let step = Step::unchecked(1e-3, 0.0).unwrap();
        let mut state = VecState::at_rest(points.len());
        let state = state.view();
        let mut changes = vec![NodeVector([7.0; 4]); points.len()];
        let supports = MovingSupports {
            scene,
            lattice: &lattice,
            places: &places,
            elements: &order[..touching],
            weight: 1e-6,
            displacement: state.displacement,
            volume: &[],
        };
        let pull = supports.pull(&loads, 0.0, &step, state.increment, &mut changes).unwrap();

        let stride = stride(lattice.functions());
        let mut matrix = vec![0.0; 3 * lattice.functions() * stride];
        let mut elements = Vec::new();
        for tile in scene.tiles {
            let tangents = supports.tangents(tile);
            elements.extend((0..TILE).map(|lane| ElementTangent::of(tile, &tangents, lane)));
        }
        for element in elements.chunks(TILE) {
            let matrix = &mut matrix;
            let (lattice, nodes, inertia) = (&lattice, &places[..], scene.inertia);
            Assembly { lattice, nodes, inertia, matrix, stride }.add(element);
        }
        let shift: Vec<_> = SHIFT.into_iter().cycle().take(3 * lattice.functions()).collect();
        let resistance = apply_lower(&matrix, stride, &shift);
        let (mut worst, mut largest) = (0.0f32, 0.0f32);
        for (a, b) in to_components(&pull.residual).iter().zip(&resistance).take(shift.len()) {
            worst = worst.max((a - b).abs());
            largest = largest.max(b.abs());
        }
        println!("{touching} elements: difference {worst:.1e} of at most {largest:.1e} kg m");
        assert!(largest > 0.0 && worst < 1e-5 * largest);
        // The supports now keep their speed.
        state.increment[..25].fill(NodeVector([SHIFT[0], SHIFT[1], SHIFT[2], 0.0]));
        assert!(supports.pull(&loads, 0.0, &step, state.increment, &mut changes).is_none());
    }
}
