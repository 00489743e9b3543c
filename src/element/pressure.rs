//! Where the pressure `dU/dJ` (Pa) of an element comes from: its own volume in linear tetrahedra, or the mean over its
//! four nodes ([`crate::material::NodalPressure`]). Around a node `a` the volume ratio is `J_a = sum_e (V_e / 4) J_e /
//! V_a` with `V_a = sum_e V_e / 4` (Bonet & Burton 1998). The energy of volume is `sum_a V_a U(J_a)`, so that
//!
//! ```text
//! dPsi/du = sum_e V_e p_e C_e : dF_e/du,   p_e = sum_{a in e} U'(J_a) / 4,   C = cof F
//! ```
//! which is the stress of the linear element with `p_e` in place of `U'(J_e)`. As `U'` is linear in `J` in all laws,
//! that is its pressure at the mean volume ratio of its nodes. Where tissues meet, a node has a volume ratio for each
//! of the first two; elements of a third one keep their own there.

use core::marker::PhantomData;

use crate::simd::{Gather, Piece, Real, TileNodes};

use super::deformation::Deformation;
use super::{ElementTile, VolumeRows};

/// Where the pressure of elements comes from.
pub(crate) trait Pressure: Copy {
    /// What is read at a node.
    type Volumes<R: Real>: Copy;

    /// Nothing read yet.
    fn no_volumes<R: Real>() -> Self::Volumes<R>;
    /// Rows in which displacements are read as well, if any.
    fn displacement(&self) -> Option<Gather<'_>>;
    /// Reads a node of each element ([`Gather::read_nodes`]).
    fn read<R: Real, const N: usize>(&self, nodes: &TileNodes<'_, N>, corner: usize, first: usize) -> Self::Volumes<R>;
    /// The same with the fourth component of the displacement known.
    fn read_with<R: Real, const N: usize>(
        &self,
        fourth: R,
        nodes: &TileNodes<'_, N>,
        corner: usize,
        first: usize,
    ) -> Self::Volumes<R>;
    /// `J - 1` at which the elements from place `first` of a tile on take their pressure, from their corners and their
    /// own.
    fn change<R: Real>(&self, tile: &ElementTile, first: usize, corners: [Self::Volumes<R>; 4], own: R) -> R;
    /// Number of nodes that can be read.
    fn count(&self) -> usize;
}

/// Reads the deformation of the elements from place `first` of a tile on, and `J - 1` at which they take their
/// pressure.
pub(super) struct ReadTile<'a, R, P> {
    tile: &'a ElementTile,
    first: usize,
    displacement: Gather<'a>,
    pressure: P,
    vector: PhantomData<R>,
}

impl<'a, R: Real, P: Pressure> ReadTile<'a, R, P> {
    #[inline(always)]
    pub(super) fn new(tile: &'a ElementTile, first: usize, displacement: Gather<'a>, pressure: P) -> Self {
        Self { tile, first, displacement, pressure, vector: PhantomData }
    }
}

impl<R: Real, P: Pressure> Piece for ReadTile<'_, R, P> {
    type Output = (Deformation<R>, R);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { tile, first, displacement, pressure, .. } = self;
        let deformation = Deformation::of_tile(tile, first, displacement);
        let nodes = tile.nodes_below::<R>(pressure.count()).unwrap_or(TileNodes::ALL_ZERO);
        // A loop, because the compiler may leave a closure over vectors as a function call.
        let mut corners = [P::no_volumes::<R>(); 4];
        for (corner, volumes) in corners.iter_mut().enumerate() {
            *volumes = pressure.read::<R, 4>(&nodes, corner, first);
        }
        (deformation, pressure.change(tile, first, corners, deformation.invariants.j))
    }
}

/// Each element's own pressure, from its volume.
#[derive(Clone, Copy)]
pub struct OwnPressure;

impl Pressure for OwnPressure {
    type Volumes<R: Real> = ();

    #[inline(always)]
    fn no_volumes<R: Real>() {}

    #[inline(always)]
    fn displacement(&self) -> Option<Gather<'_>> {
        None
    }

    #[inline(always)]
    fn read<R: Real, const N: usize>(&self, _: &TileNodes<'_, N>, _: usize, _: usize) {}

    #[inline(always)]
    fn read_with<R: Real, const N: usize>(&self, _: R, _: &TileNodes<'_, N>, _: usize, _: usize) {}

    #[inline(always)]
    fn change<R: Real>(&self, _: &ElementTile, _: usize, _: [(); 4], own: R) -> R {
        own
    }

    #[inline(always)]
    fn count(&self) -> usize {
        0
    }
}

/// The mean over the nodes, from the rows of [`super::NodalVolumes`].
#[derive(Clone, Copy)]
pub struct MeanPressure<'a> {
    rows: Gather<'a>,
    several_tissues: bool,
}

impl<'a> MeanPressure<'a> {
    pub(crate) const fn new(VolumeRows { rows, several_tissues }: VolumeRows<'a>) -> Self {
        Self { rows: Gather::new(rows), several_tissues }
    }
}

impl Pressure for MeanPressure<'_> {
    type Volumes<R: Real> = [R; 2];

    #[inline(always)]
    fn no_volumes<R: Real>() -> [R; 2] {
        [R::splat(0.0); 2]
    }

    #[inline(always)]
    fn displacement(&self) -> Option<Gather<'_>> {
        if self.several_tissues { None } else { Some(self.rows) }
    }

    #[inline(always)]
    fn read<R: Real, const N: usize>(&self, nodes: &TileNodes<'_, N>, corner: usize, first: usize) -> [R; 2] {
        let [one, other, _, fourth] = self.rows.read_rows::<R, N>(nodes, corner, first);
        if self.several_tissues { [one, other] } else { [fourth, fourth] }
    }

    #[inline(always)]
    fn read_with<R: Real, const N: usize>(
        &self,
        fourth: R,
        nodes: &TileNodes<'_, N>,
        corner: usize,
        first: usize,
    ) -> [R; 2] {
        if self.several_tissues { self.read(nodes, corner, first) } else { [fourth, fourth] }
    }

    #[inline(always)]
    fn change<R: Real>(&self, tile: &ElementTile, first: usize, corners: [[R; 2]; 4], own: R) -> R {
        let [[a, _], [b, _], [c, _], [d, _]] = corners;
        let mut changes = [a, b, c, d];
        if self.several_tissues {
            for (corner, [one, other]) in corners.into_iter().enumerate() {
                // 0, 1 or 2: positive minus a half is of the first tissue, and so on.
                let slot = R::from_fn(|lane| f32::from(tile.slot(corner, first + lane)));
                let half = R::splat(0.5);
                changes[corner] = (half - slot).choose(one, (slot - (half + R::splat(1.0))).choose(own, other));
            }
        }
        R::splat(0.25) * ((changes[0] + changes[1]) + (changes[2] + changes[3]))
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.rows.count()
    }
}
