//! `S` has the stiffness of clusters in place of that of elements: in cells that few elements fill, or in which they do
//! not end, it may be too soft, and steps would not be stable. So the preparation compares both at rest. How much too
//! soft depends on the step: in short ones the stiffest motions count, in long ones also those that strain little but
//! the elements' volumes. So they are compared for the step, and for one so long that a longer one changes nothing.

use glam::{Vec3, Vec4};

use super::coarse_motion::{CoarseSpace, inner};
use super::coarse_room::CoarseRoom;
use super::lattice::{CoarseVectors, LatticeNode, rank_of};
use crate::element::{ElementMaterial, ScalarBound};
use crate::scene::SceneView;
use crate::simd::NodeVector;
use crate::step::{CallingThread, Step, internal_forces, nodal_volumes};

/// Cycles of the iteration.
const CYCLES: u32 = 12;

/// Largest strain of a cell: forces are linear in it, and larger than their rounding.
const STRAIN: f32 = 1e-3;

/// Largest ratio of a suggested lattice for the step that is prepared: a coarser one has smaller ratios, and adds less
/// inertia.
pub(super) const MOST_RATIO: f32 = 3.0;

/// Functions of the smallest lattice.
pub(super) const FEWEST: usize = 8;

/// What a step adds to the mass (as a multiple, mean over the nodes) that is long enough.
const ADDED: f32 = 2500.0;

/// The longer step to compare with as well, of one that adds so much.
pub(super) fn longer_step(step: Step, added: f32) -> Option<Step> {
    let seconds = step.seconds() * libm::sqrtf(ADDED / added.max(f32::MIN_POSITIVE));
    if added < ADDED { Step::unchecked(seconds, step.damping()).ok() } else { None }
}

/// What a bent body needs more where it keeps its volume: there small rotations within a cluster cost much energy.
/// Measured: nodal strain with a bulk modulus of a thousand shear moduli, in the whip of `tests/large_steps`, needs 1.35.
const OF_BENDING: f32 = 0.35;
/// The sensitivity ([`super::renewal`]) of such tissue.
const SENSITIVITY: f32 = 22.0;

/// By how much the stiffness in `S` has to be larger, with this ratio at rest and this sensitivity.
pub(super) fn stiffening(ratio: f32, sensitivity: f32) -> f32 {
    let of_volume = (sensitivity / SENSITIVITY).min(1.0);
    let bent = 1.0 + OF_BENDING * of_volume * of_volume;
    // Of a lattice without stiffness there is none.
    if ratio.is_finite() { bent.max(ratio) } else { bent }
}

/// The lattice and the memory to compare in.
pub(super) struct RestCheck<'a, 'm, M> {
    pub(super) scene: SceneView<'a, M>,
    pub(super) places: &'a [LatticeNode],
    pub(super) space: CoarseSpace<'a, 'm>,
    /// Vectors of the nodes.
    pub(super) displacement: &'a mut [NodeVector],
    pub(super) force: &'a mut [NodeVector],
    pub(super) volume: &'a mut [NodeVector],
    /// `s_c D^2 / 4`, s^2.
    pub(super) weight: f32,
}

impl<M: ElementMaterial> RestCheck<'_, '_, M> {
    /// The largest ratio of the energies of a motion with the stiffness of the elements and with that in `S`, for the
    /// motions of a power iteration with `S^-1 W^T K W`: in the end the stiffest ones.
    #[inline(never)]
    pub(super) fn largest_ratio(&mut self, room: &mut CoarseRoom<'_>) -> f32 {
        let CoarseRoom { motion, part: forces, scratch: [other, ..], .. } = room;
        // Some motion that is not smooth.
        let mut random = 1_u32;
        for value in forces.iter_mut().flat_map(|vector| &mut vector.0[..3]) {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *value = (random >> 8) as f32 / (1 << 24) as f32 - 0.5;
        }
        let mut ratio = 0.0_f32;
        for cycle in 0..CYCLES {
            motion.copy_from_slice(&**forces);
            self.space.solve(motion);
            self.space.multiply_by_inertia(motion, other);
            let energy = inner(motion, forces) - inner(motion, other);
            self.write_forces(motion, forces);
            if cycle >= CYCLES / 2 {
                ratio = ratio.max(inner(motion, forces) / energy);
            }
        }
        ratio
    }

    /// `s_c D^2/4 W^T K W x`.
    fn write_forces(&mut self, motion: &CoarseVectors, forces: &mut CoarseVectors) {
        let Self { scene, places, ref space, weight, .. } = *self;
        let strain = space.lattice.largest_strain(motion, space.matrices.frames.since_rest());
        let scale = STRAIN / strain.max(f32::MIN_POSITIVE);
        for (node, displacement) in self.displacement.iter_mut().enumerate() {
            *displacement = NodeVector::ZERO;
            if let (Some(place), Some(inertia)) = (places.get(rank_of(places, node)), scene.inertia.get(node)) {
                let moved = space.lattice.weights(place).into_iter().map(|(function, weight)| {
                    weight * motion.get(function).map_or(Vec4::ZERO, |vector| Vec4::from(vector.0))
                });
                let moved = scale * moved.sum::<Vec4>() * inertia.free();
                *displacement = NodeVector(moved.truncate().extend(0.0).to_array());
            }
        }
        nodal_volumes(scene, self.displacement, &[], self.volume, &CallingThread);
        self.force.fill(NodeVector::ZERO);
        let all = scene.elements().partitions.all();
        internal_forces(scene, all, [self.displacement, &[]], self.volume, self.force, ScalarBound, None);
        forces.fill(NodeVector::ZERO);
        for (node, force) in self.force.iter().enumerate() {
            if let (Some(place), Some(inertia)) = (places.get(rank_of(places, node)), scene.inertia.get(node)) {
                let force = -weight / scale * Vec3::from_slice(&force.0) * inertia.free().truncate();
                for (function, weight) in space.lattice.weights(place) {
                    if let Some(sum) = forces.get_mut(function) {
                        sum.0 = (Vec4::from(sum.0) + weight * force.extend(0.0)).to_array();
                    }
                }
            }
        }
        // What stands for the dropped functions.
        forces.iter_mut().enumerate().filter(|(number, _)| !space.lattice.moves(*number)).for_each(|(_, sum)| {
            *sum = NodeVector::ZERO;
        });
    }
}
