//! Supports that move, coupled to the motion of the lattice. A step solves `S c + A_s d = g` for the lattice, where `d`
//! (m) is the change of the supports' increments and `A_s = s_c D^2 / 4 W^T K_s` (kg) the stiffness between the
//! lattice's functions and the supports. It has the tangents and the gradients of `coarse_stiffness.rs`, with the
//! supports' motion in place of that of further functions: so a motion of body and supports together meets no
//! resistance. Without it a support that starts leaves the body behind until its elements are stretched by a whole
//! step's motion; with it the lattice follows as far as `A` resists the strain.
//!
//! The stiffness of elements and supports together is positive, so `S^-1 A_s d` gets at most the energy `d K_ss d` of
//! supports that move alone. Where rounding gives it more, the motion is scaled down.
//!
//! **Work.** The added inertia exerts `A_sf dc + A_ss d` on the supports, where `dc` is the change of the lattice's part
//! of the increments, so supports that move by `e` do the work `e (A_sf dc + A_ss d) / D^2` besides that against the
//! stress. A body that starts with its supports has its kinetic energy from it.

use glam::Vec4;

use super::clusters::{ClusterInput, Clusters, NO_TILE, Piece};
use super::coarse_motion::inner;
use super::coarse_stiffness::ClusterTangent;
use super::lattice::CoarseVectors;
use crate::element::ElementMaterial;
use crate::loads::Loads;
use crate::simd::NodeVector;
use crate::step::Step;

/// What moving supports do to the lattice, with the change `d` of their increments and their last increments `e`.
pub(super) struct Pull<'a> {
    /// `-A_s d` and `-A_s e` for each function, kg m.
    pub(super) residual: &'a mut CoarseVectors,
    pub(super) of_last: &'a mut CoarseVectors,
    /// `d A_ss d` and `e A_ss d`, kg m^2.
    pub(super) energy: f32,
    cross: f32,
}

impl Pull<'_> {
    /// Work of the supports on added inertia, times `D^2`, where the lattice's part of the increments changes by `dc`:
    /// kg m^2.
    pub(super) fn work(&self, change: &CoarseVectors) -> f32 {
        let along = |residual: &CoarseVectors| inner(residual, change);
        self.cross + 0.5 * self.energy - along(self.of_last) - 0.5 * along(self.residual)
    }
}

/// The supports of a scene that motions may move, in a state.
pub(super) struct MovingSupports<'a, 'm, M> {
    pub(super) input: ClusterInput<'a, M>,
    pub(super) clusters: &'a Clusters<'m>,
    /// Of the clusters.
    pub(super) tangents: &'a [ClusterTangent],
    pub(super) displacement: &'a [NodeVector],
}

impl<M: ElementMaterial> MovingSupports<'_, '_, M> {
    /// None if no support moves. `time` (s) is that of the state, `changes` are
    /// vectors of the nodes whose first three components are free.
    #[inline(never)]
    pub(super) fn pull<'r>(
        &self,
        loads: &Loads<'_>,
        time: f64,
        step: &Step,
        increment: &mut [NodeVector],
        changes: &mut [NodeVector],
        [residual, of_last]: [&'r mut CoarseVectors; 2],
    ) -> Option<Pull<'r>> {
        if loads.motions().is_empty() {
            return None;
        }
        for NodeVector([x, y, z, _]) in &mut *changes {
            (*x, *y, *z) = (0.0, 0.0, 0.0);
        }
        let mut moves = false;
        loads.each_prescribed(time + f64::from(step.seconds()), increment, |node, axis, position, increment| {
            if let (Some(change), Some(displacement)) = (changes.get_mut(node), self.displacement.get(node)) {
                let next = position - displacement.0[axis % 4];
                let last = step.carry() * increment[axis % 4];
                change.0[axis % 3] = next - last;
                moves |= next != 0.0 || last != 0.0;
            }
        });
        if !moves {
            return None;
        }
        residual.fill(NodeVector::ZERO);
        of_last.fill(NodeVector::ZERO);
        let mut pull = Pull { residual, of_last, energy: 0.0, cross: 0.0 };
        let (scene, clusters) = (self.input.scene, self.clusters);
        let last = |node: usize| {
            let held =
                scene.inertia.get(node).map_or([0.0; 3], |inertia| (Vec4::ONE - inertia.free()).truncate().to_array());
            let last = increment.get(node).copied().unwrap_or_default().to_array();
            [0, 1, 2].map(|axis| step.carry() * held[axis] * last[axis])
        };
        let change = |node: usize| changes.get(node).copied().unwrap_or_default().to_array();
        for piece in tiles(clusters.moved).filter_map(|tile| scene.tiles.get(tile)).flat_map(Piece::of_tile) {
            let motions = [motion_of(&piece, change), motion_of(&piece, last)];
            if motions == [[[0.0; 3]; 3]; 2] {
                continue;
            }
            let cell = piece.cell(self.input.lattice, self.input.places);
            let index = self.input.find(&piece, cell, clusters.all, clusters.heads);
            let of_cluster = index.and_then(|index| Some((self.tangents.get(index)?, clusters.all.get(index)?)));
            let Some((tangent, cluster)) = of_cluster else { continue };
            let share = piece.volume() / cluster.volume;
            let stresses = motions.map(|motion| {
                let of_row = |row: &[f32; 9]| {
                    share * row.iter().zip(motion.as_flattened()).map(|(factor, along)| factor * along).sum::<f32>()
                };
                let rows: &[[f32; 9]] = tangent.as_chunks().0;
                core::array::from_fn(|entry| rows.get(entry).map_or(0.0, of_row))
            });
            self.add(&piece, cell, motions, stresses, &mut pull);
        }
        Some(pull)
    }

    /// Adds a piece with the gradients of `d` and `e`, and its tangent times these, entry `3 i + I`, kg m.
    fn add(
        &self,
        piece: &Piece<'_>,
        cell: usize,
        [change, last]: [[[f32; 3]; 3]; 2],
        [of_change, of_last]: [[f32; 9]; 2],
        pull: &mut Pull<'_>,
    ) {
        let gradients = self.input.gradients(piece, cell);
        let functions = self.input.lattice.functions_of(cell);
        for i in 0..3 {
            let along = |stress: &[f32; 9], gradient: [f32; 3]| {
                stress[3 * i..3 * i + 3].iter().zip(gradient).map(|(row, along)| row * along).sum::<f32>()
            };
            pull.energy += along(&of_change, change[i]);
            pull.cross += along(&of_change, last[i]);
            for (function, gradient) in functions.into_iter().zip(gradients[i]) {
                if let (Some(sum), Some(sum_of_last)) =
                    (pull.residual.get_mut(function), pull.of_last.get_mut(function))
                {
                    sum.0[i] -= along(&of_change, gradient);
                    sum_of_last.0[i] -= along(&of_last, gradient);
                }
            }
        }
    }
}

/// The tiles of a list.
fn tiles(list: &[u32]) -> impl Iterator<Item = usize> {
    list.iter().take_while(|tile| **tile != NO_TILE).map(|tile| *tile as usize)
}

/// Motions that differ by less than this share are alike.
const ALIKE: f32 = 1e-4;

/// `sum_a d_a g_a^T` over the nodes of a piece (1), from differences to the first node: nothing where all move alike but
/// for rounding, as deep in a part of the body that is moved.
fn motion_of(piece: &Piece<'_>, motion: impl Fn(usize) -> [f32; 3]) -> [[f32; 3]; 3] {
    let mut gradient = [[0.0; 3]; 3];
    let all = piece.nodes().map(motion);
    let [first, ..] = all;
    let most = first.iter().fold(0.0_f32, |most, along| most.max(along.abs()));
    let is_alike = |motion: &[f32; 3]| (0..3).all(|axis| (motion[axis] - first[axis]).abs() <= ALIKE * most);
    if all.iter().all(is_alike) {
        return gradient;
    }
    for (motion, of_node) in all.into_iter().zip(piece.gradients()) {
        for ((row, motion), first) in gradient.iter_mut().zip(motion).zip(first) {
            row.iter_mut().zip(of_node).for_each(|(sum, along)| *sum += (motion - first) * along);
        }
    }
    gradient
}
