//! Forces (N) of crushed elements with nodal strain ([`super::barrier`]).

use glam::Vec4;

use super::barrier::Barrier;
use super::crushed::CrushedTile;
use super::deformation::Deformation;
use super::stiffness_bound::{Coefficients, scalar_bound, scale_of};
use super::tile::vector_at;
use crate::simd::{Gather, Kernel, NodeVector, Real, TILE, dispatch, dot};

/// Adds the forces of crushed elements to nodes.
pub(crate) struct AddCrushed<'a> {
    pub(crate) displacement: &'a [NodeVector],
    /// Whether their scalar stiffness bounds are wanted.
    pub(crate) bounds: bool,
    /// The first of the nodes.
    pub(crate) first: usize,
    pub(crate) force: &'a mut [NodeVector],
    /// The least `J - 1` of all that were added.
    pub(crate) least_change: f32,
}

/// The forces of a tile of elements.
pub(crate) struct Forces {
    /// Of each corner; the fourth component is the scalar stiffness bound, N/m, if somebody asks.
    corners: [[[f32; 4]; TILE]; 4],
    /// `mu / 6 h'` of [`Barrier`], Pa: zero where there is no force.
    slopes: [f32; TILE],
}

impl Forces {
    pub(crate) const NONE: Self = Self { corners: [[[0.0; 4]; TILE]; 4], slopes: [0.0; TILE] };
}

impl AddCrushed<'_> {
    /// Those of a tile, element by element, so that a sum does not depend on which others are in the tile.
    pub(crate) fn add(&mut self, crushed: &CrushedTile, forces: &mut Forces) {
        let &mut Self { displacement, bounds, first, .. } = self;
        self.least_change = self.least_change.min(compute(CrushedForces { crushed, displacement, bounds, forces }));
        for (lane, _) in forces.slopes.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
            for (corner, rows) in forces.corners.iter().enumerate() {
                let node = crushed.tile.node(corner, lane);
                if let Some(vector) = self.force.get_mut(node.wrapping_sub(first)) {
                    vector.0 = (Vec4::from(vector.0) + Vec4::from(rows[lane % TILE])).to_array();
                }
            }
        }
    }
}

/// Compiled with this crate, as it is not generic.
#[inline(never)]
fn compute(kernel: CrushedForces<'_>) -> f32 {
    dispatch(kernel)
}

struct CrushedForces<'a> {
    crushed: &'a CrushedTile,
    displacement: &'a [NodeVector],
    bounds: bool,
    forces: &'a mut Forces,
}

impl Kernel for CrushedForces<'_> {
    /// The least `J - 1`; of places without an element that of an earlier one, or none.
    type Output = f32;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> f32 {
        let Self { crushed: CrushedTile { tile, moduli }, displacement, bounds, forces } = self;
        let displacement = Gather::new(displacement);
        let mut least = R::splat(0.0);
        for first in (0..TILE).step_by(R::COUNT) {
            let deformation = Deformation::<R>::of_tile(tile, first, displacement);
            let at = deformation.invariants;
            least = at.j.min(least);
            let barrier = Barrier::new(vector_at::<R>(moduli, first), at);
            let slope = barrier.slope * barrier.factor[1];
            for lane in 0..R::COUNT {
                forces.slopes[(first + lane) % TILE] = slope.lane(lane);
            }
            let stress = barrier.stress(&deformation);
            let minus_volume = -tile.volume::<R>(first);
            let fourth = if bounds {
                scalar_bound(&Coefficients::of_barrier(&barrier, at), at, scale_of(tile, first))
            } else {
                R::splat(0.0)
            };
            let mut corners = [[fourth; 4]; 4];
            for axis in 0..3 {
                let [x, y, z] = stress[axis];
                let row = [x * minus_volume, y * minus_volume, z * minus_volume];
                for corner in 0..3 {
                    corners[corner + 1][axis] = dot(row, tile.gradients::<R>(corner, first));
                }
                corners[0][axis] = -(corners[1][axis] + corners[2][axis] + corners[3][axis]);
            }
            for (rows, values) in forces.corners.iter_mut().zip(corners) {
                R::to_rows(values, |lane, row| rows[(first + lane) % TILE] = row);
            }
        }
        let mut least_of_all = 0.0;
        for lane in 0..R::COUNT {
            least_of_all = least.lane(lane).min(least_of_all);
        }
        least_of_all
    }
}
