//! Where the pressure `dU/dJ` (Pa) of an element comes from: its own volume in linear tetrahedra, or the mean over its four nodes
//! ([`crate::material::NodalPressure`]). Around a node `a` the volume ratio is `J_a = sum_e (V_e / 4) J_e / V_a` with
//! `V_a = sum_e V_e / 4` (Bonet & Burton 1998). The energy of volume is `sum_a V_a U(J_a)`, so that
//!
//! ```text
//! dPsi/du = sum_e V_e p_e C_e : dF_e/du,   p_e = sum_{a in e} U'(J_a) / 4,   C = cof F
//! ```
//! which is the stress of the linear element with `p_e` in place of `U'(J_e)`. Where tissues meet, a node has a volume ratio for
//! each of the first two; elements of a third one keep their own there.

use crate::material::{Invariants, Law, LawState, Laws, Potential};
use crate::simd::{Gather, Pair, Real, TileNodes};

use super::{ElementTile, VolumeRows};

/// Where the pressure of elements comes from.
pub(crate) trait Pressure: Copy {
    /// What is read at a node.
    type Volumes<R: Real>: Copy;
    /// What an element gets.
    type Response<R: Real>: Copy;

    /// Nothing read yet.
    fn no_volumes<R: Real>() -> Self::Volumes<R>;
    /// Nothing known yet.
    fn none<R: Real>() -> Self::Response<R>;
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
    fn response<R: Real, L: Law>(
        laws: &Laws<'_, L>,
        tile: &ElementTile,
        first: usize,
        corners: [Self::Volumes<R>; 4],
        own: R,
    ) -> Self::Response<R>;
    /// Of two vectors of elements.
    fn paired<R: Real>(one: Self::Response<R>, other: Self::Response<R>) -> Self::Response<Pair<R>>;
    /// The state of the law.
    fn state<R: Real, L: Law>(
        law: &L::Wide<R>,
        at: Invariants<R>,
        response: Self::Response<R>,
    ) -> LawState<R>;
    /// Number of nodes that can be read.
    fn count(&self) -> usize;

    /// The state of the law in the elements from place `first` of a tile on, of which `laws` are the constants.
    #[inline(always)]
    fn local<R: Real, L: Law>(
        &self,
        laws: &Laws<'_, L>,
        tile: &ElementTile,
        first: usize,
        at: Invariants<R>,
    ) -> LawState<R> {
        let nodes = tile.nodes_below::<R>(self.count()).unwrap_or(TileNodes::ALL_ZERO);
        // A loop, because the compiler may leave a closure over vectors as a function call.
        let mut corners = [Self::no_volumes::<R>(); 4];
        for (corner, volumes) in corners.iter_mut().enumerate() {
            *volumes = self.read::<R, 4>(&nodes, corner, first);
        }
        let response = Self::response::<R, L>(laws, tile, first, corners, at.j);
        Self::state::<R, L>(&laws.widen(|lane| tile.element(first + lane)), at, response)
    }
}

/// Each element's own pressure, from its volume.
#[derive(Clone, Copy)]
pub struct OwnPressure;

impl Pressure for OwnPressure {
    type Volumes<R: Real> = ();
    type Response<R: Real> = ();

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
    fn response<R: Real, L: Law>(_: &Laws<'_, L>, _: &ElementTile, _: usize, _: [(); 4], _: R) {}

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

/// `U'` and `U''`, Pa, means over the nodes.
#[derive(Clone, Copy)]
pub(crate) struct VolumeResponse<R> {
    pressure: R,
    bulk: R,
}

impl Pressure for MeanPressure<'_> {
    type Volumes<R: Real> = [R; 2];
    type Response<R: Real> = VolumeResponse<R>;

    #[inline(always)]
    fn no_volumes<R: Real>() -> [R; 2] {
        [R::splat(0.0); 2]
    }

    #[inline(always)]
    fn none<R: Real>() -> VolumeResponse<R> {
        VolumeResponse { pressure: R::splat(0.0), bulk: R::splat(0.0) }
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
    fn response<R: Real, L: Law>(
        laws: &Laws<'_, L>,
        tile: &ElementTile,
        first: usize,
        corners: [[R; 2]; 4],
        own: R,
    ) -> VolumeResponse<R> {
        let law = laws.widen::<R>(|lane| tile.element(first + lane));
        let mut sum = Self::none::<R>();
        for (corner, [one, other]) in corners.into_iter().enumerate() {
            let j = if laws.differ() {
                // 0, 1 or 2: positive minus a half is of the first tissue, and so on.
                let slot = R::from_fn(|lane| f32::from(tile.slot(corner, first + lane)));
                let half = R::splat(0.5);
                (half - slot).choose(one, (slot - (half + R::splat(1.0))).choose(own, other))
            } else {
                one
            };
            sum.pressure = sum.pressure + law.volume_slope(j);
            sum.bulk = sum.bulk + law.volume_curvature(j);
        }
        let quarter = R::splat(0.25);
        VolumeResponse { pressure: quarter * sum.pressure, bulk: quarter * sum.bulk }
    }

    #[inline(always)]
    fn paired<R: Real>(one: VolumeResponse<R>, other: VolumeResponse<R>) -> VolumeResponse<Pair<R>> {
        let (pressure, bulk) = (Pair(one.pressure, other.pressure), Pair(one.bulk, other.bulk));
        VolumeResponse { pressure, bulk }
    }

    #[inline(always)]
    fn state<R: Real, L: Law>(
        law: &L::Wide<R>,
        at: Invariants<R>,
        VolumeResponse { pressure, bulk }: VolumeResponse<R>,
    ) -> LawState<R> {
        LawState::with_volume_response::<L>(law, at, pressure, bulk)
    }

    #[inline(always)]
    fn count(&self) -> usize {
        self.rows.count()
    }
}
