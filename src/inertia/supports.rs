//! Supports whose speed changes, coupled to the motion of the lattice. A step solves `S c + A_s d = g` for the lattice,
//! where `d` (m) is the change of the supports' increments and `A_s = s_c D^2 / 4 W^T K_s` (kg) the stiffness between
//! the lattice's functions and the supports. It has the tangents and the gradients of `coarse_stiffness.rs`, with the
//! supports' motion in place of that of further functions: so a motion of body and supports together meets no
//! resistance. Without it a support that starts leaves the body behind until its elements are stretched by a whole
//! step's motion; with it the lattice follows as far as `A` resists the strain. Supports that stand still or keep their
//! speed add nothing.
//!
//! The stiffness of elements and supports together is positive, so `S^-1 A_s d` gets at most the energy `d K_ss d` of
//! supports that move alone. Where rounding gives it more, the motion is scaled down.

use super::clusters::{ClusterInput, Clusters, NO_TILE, Piece};
use super::coarse_stiffness::ClusterTangent;
use super::lattice::{CoarseVectors, MAX_FUNCTIONS};
use crate::element::ElementMaterial;
use crate::loads::Loads;
use crate::simd::NodeVector;
use crate::step::Step;

/// What supports whose speed changes do to the lattice.
pub(super) struct Pull {
    /// `-A_s d` for each function, kg m.
    pub(super) residual: CoarseVectors,
    /// `s_c D^2 / 4 d K_ss d`, kg m^2.
    pub(super) energy: f32,
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
                change.0[axis % 3] = next - step.carry() * increment[axis % 4];
                moves |= change.0[axis % 3] != 0.0;
            }
        });
        if !moves {
            return None;
        }
        let mut pull = Pull { residual: [NodeVector::ZERO; MAX_FUNCTIONS + 1], energy: 0.0 };
        let (scene, clusters) = (self.input.scene, self.clusters);
        for piece in tiles(clusters.moved).filter_map(|tile| scene.tiles.get(tile)).flat_map(Piece::of_tile) {
            let Some(motion) = motion_of(&piece, changes) else { continue };
            let cell = piece.cell(self.input.lattice, self.input.places);
            let index = self.input.find(&piece, cell, clusters.all, clusters.heads);
            let of_cluster = index.and_then(|index| Some((self.tangents.get(index)?, clusters.all.get(index)?)));
            let Some((tangent, cluster)) = of_cluster else { continue };
            let share = piece.volume() / cluster.volume;
            let stress = |i: usize, large: usize| {
                let row: &[f32; 9] = tangent.as_chunks().0.get(3 * i + large).unwrap_or(&[0.0; 9]);
                share * row.iter().zip(motion.as_flattened()).map(|(factor, along)| factor * along).sum::<f32>()
            };
            self.add(&piece, cell, &motion, stress, &mut pull);
        }
        Some(pull)
    }

    /// Adds a piece with the gradient of its supports' motion; `stress(i, I)` is its tangent times that, kg m.
    fn add(
        &self,
        piece: &Piece<'_>,
        cell: usize,
        motion: &[[f32; 3]; 3],
        stress: impl Fn(usize, usize) -> f32,
        pull: &mut Pull,
    ) {
        let gradients = self.input.gradients(piece, cell);
        let functions = self.input.lattice.functions_of(cell);
        for i in 0..3 {
            let row = [0, 1, 2].map(|large| stress(i, large));
            let along = |gradient: [f32; 3]| row.iter().zip(gradient).map(|(row, along)| row * along).sum::<f32>();
            pull.energy += along(motion[i]);
            for (function, gradient) in functions.into_iter().zip(gradients[i]) {
                if let Some(sum) = pull.residual.get_mut(function) {
                    sum.0[i] -= along(gradient);
                }
            }
        }
    }
}

/// The tiles of a list.
fn tiles(list: &[u32]) -> impl Iterator<Item = usize> {
    list.iter().take_while(|tile| **tile != NO_TILE).map(|tile| *tile as usize)
}

/// `sum_a d_a g_a^T` over the nodes of a piece (1), if it is not zero.
fn motion_of(piece: &Piece<'_>, changes: &[NodeVector]) -> Option<[[f32; 3]; 3]> {
    let mut motion = [[0.0; 3]; 3];
    for (node, gradient) in piece.nodes().into_iter().zip(piece.gradients()) {
        let change = changes.get(node).copied().unwrap_or_default().to_array();
        for (row, change) in motion.iter_mut().zip(change) {
            row.iter_mut().zip(gradient).for_each(|(sum, along)| *sum += change * along);
        }
    }
    (motion != [[0.0; 3]; 3]).then_some(motion)
}
