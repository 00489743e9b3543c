//! The least volume ratio `J` of elements in a scene with nodal strain. Its forces know only the mean deformation
//! around nodes, in which an element that is turned inside out can hide. A step looks at one tile of elements in
//! [`CHECK_CYCLE`], so that every element is seen in so many steps, at a cost that is the same in each.

use crate::simd::{Gather, Kernel, NodeVector, Real, TILE, dispatch};

use super::ElementTile;
use super::deformation::Deformation;

/// Steps in which every element is looked at.
pub(crate) const CHECK_CYCLE: usize = 16;

/// The kernel that gives the least `J - 1` of the tiles whose turn it is.
pub(crate) struct VolumeCheck<'a> {
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) displacement: &'a [NodeVector],
    /// Steps taken so far.
    pub(crate) steps: u64,
}

impl VolumeCheck<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(crate) fn least_change(self) -> f32 {
        dispatch(self)
    }
}

impl Kernel for VolumeCheck<'_> {
    type Output = f32;

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> f32 {
        let displacement = Gather::new(self.displacement);
        let mut least = R::splat(f32::INFINITY);
        let turn = (self.steps % CHECK_CYCLE as u64) as usize;
        for tile in self.tiles.iter().skip(turn).step_by(CHECK_CYCLE) {
            for first in (0..TILE).step_by(R::COUNT) {
                least = Deformation::<R>::of_tile(tile, first, displacement).invariants.j.min(least);
            }
        }
        (0..R::COUNT).fold(f32::INFINITY, |least_of_all, lane| least_of_all.min(least.lane(lane)))
    }
}
