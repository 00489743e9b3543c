//! Where the pressure `dU/dJ` (Pa) of an element comes from: its own volume in linear tetrahedra, or the mean over its four nodes
//! ([`crate::material::NodalPressure`]). Around a node `a` the volume ratio is `J_a = sum_e (V_e / 4) J_e / V_a` with
//! `V_a = sum_e V_e / 4` (Bonet & Burton 1998). The energy of volume is `sum_a V_a U(J_a)`, so that
//!
//! ```text
//! dPsi/du = sum_e V_e p_e C_e : dF_e/du,   p_e = sum_{a in e} U'(J_a) / 4,   C = cof F
//! ```
//! which is the stress of the linear element with `p_e` in place of `U'(J_e)`. Where tissues meet, a node has a volume ratio for
//! each of the first two; elements of a third one keep their own there.

use core::marker::PhantomData;

use crate::material::{Invariants, Law, LawState, Potential};
use crate::simd::{Gather, Pair, Part, Real, TileNodes};

use super::deformation::Deformation;
use super::{ElementTile, VolumeRows};

/// Where the pressure of elements comes from.
pub(crate) trait Pressure: Copy {
    /// What is read at a node.
    type Volumes<R: Real>: Copy;
    /// What an element keeps of its nodes.
    type Ratios<R: Real>: Copy;

    /// Nothing read yet.
    fn no_volumes<R: Real>() -> Self::Volumes<R>;
    /// Nothing known yet.
    fn none<R: Real>() -> Self::Ratios<R>;
    /// Rows in which displacements are read as well, if any.
    fn displacement(&self) -> Option<Gather<'_>>;
    /// Reads a node of each element ([`Gather::read_nodes`]).
    fn read<R: Real, const N: usize>(
        &self,
        nodes: &TileNodes<'_, N>,
        corner: usize,
        first: usize,
    ) -> Self::Volumes<R>;
    /// The same with the fourth component of the displacement known.
    fn read_with<R: Real, const N: usize>(
        &self,
        fourth: R,
        nodes: &TileNodes<'_, N>,
        corner: usize,
        first: usize,
    ) -> Self::Volumes<R>;
    /// Of the elements from place `first` of a tile on, from their corners and their own `J - 1`.
    fn ratios<R: Real>(
        &self,
        tile: &ElementTile,
        first: usize,
        corners: [Self::Volumes<R>; 4],
        own: R,
    ) -> Self::Ratios<R>;
    /// Of two vectors of elements.
    fn paired<R: Real>(one: Self::Ratios<R>, other: Self::Ratios<R>) -> Self::Ratios<Pair<R>>;
    /// The state of the law.
    fn state<R: Real, L: Law>(law: &L::Wide<R>, at: Invariants<R>, ratios: Self::Ratios<R>) -> LawState<R>;
    /// Number of nodes that can be read.
    fn count(&self) -> usize;
}

/// Reads the deformation of the elements from place `first` of a tile on, and what their pressure follows from.
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

impl<R: Real, P: Pressure> Part for ReadTile<'_, R, P> {
    type Output = (Deformation<R>, P::Ratios<R>);

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
        (deformation, pressure.ratios(tile, first, corners, deformation.invariants.j))
    }
}

/// Each element's own pressure, from its volume.
#[derive(Clone, Copy)]
pub struct OwnPressure;

impl Pressure for OwnPressure {
    type Volumes<R: Real> = ();
    type Ratios<R: Real> = ();

    #[inline(always)]
    fn no_volumes<R: Real>() {}

    #[inline(always)]
    fn none<R: Real>() {}

    #[inline(always)]
    fn displacement(&self) -> Option<Gather<'_>> {
        None
    }

    #[inline(always)]
    fn read<R: Real, const N: usize>(&self, _: &TileNodes<'_, N>, _: usize, _: usize) {}

    #[inline(always)]
    fn read_with<R: Real, const N: usize>(&self, _: R, _: &TileNodes<'_, N>, _: usize, _: usize) {}

    #[inline(always)]
    fn ratios<R: Real>(&self, _: &ElementTile, _: usize, _: [(); 4], _: R) {}

    #[inline(always)]
    fn paired<R: Real>((): (), (): ()) {}

    #[inline(always)]
    fn state<R: Real, L: Law>(law: &L::Wide<R>, at: Invariants<R>, (): ()) -> LawState<R> {
        LawState::new::<L>(law, at)
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
    /// `J - 1` at the four nodes.
    type Ratios<R: Real> = [R; 4];

    #[inline(always)]
    fn no_volumes<R: Real>() -> [R; 2] {
        [R::splat(0.0); 2]
    }

    #[inline(always)]
    fn none<R: Real>() -> [R; 4] {
        [R::splat(0.0); 4]
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
    fn ratios<R: Real>(&self, tile: &ElementTile, first: usize, corners: [[R; 2]; 4], own: R) -> [R; 4] {
        let mut ratios = [own; 4];
        for (corner, [one, other]) in corners.into_iter().enumerate() {
            ratios[corner] = if self.several_tissues {
                // 0, 1 or 2: positive minus a half is of the first tissue, and so on.
                let slot = R::from_fn(|lane| f32::from(tile.slot(corner, first + lane)));
                let half = R::splat(0.5);
                (half - slot).choose(one, (slot - (half + R::splat(1.0))).choose(own, other))
            } else {
                one
            };
        }
        ratios
    }

    #[inline(always)]
    fn paired<R: Real>([a, b, c, d]: [R; 4], [e, f, g, h]: [R; 4]) -> [Pair<R>; 4] {
        [Pair(a, e), Pair(b, f), Pair(c, g), Pair(d, h)]
    }

    #[inline(always)]
    fn state<R: Real, L: Law>(law: &L::Wide<R>, at: Invariants<R>, ratios: [R; 4]) -> LawState<R> {
        let (mut pressure, mut bulk) = (R::splat(0.0), R::splat(0.0));
        for j in ratios {
            pressure = pressure + law.volume_slope(j);
            bulk = bulk + law.volume_curvature(j);
        }
        let quarter = R::splat(0.25);
        LawState::with_volume_response::<L>(law, at, quarter * pressure, quarter * bulk)
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.rows.count()
    }
}
