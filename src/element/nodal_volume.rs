//! Volume ratios of the nodes, the first of two passes over tetrahedra with average nodal pressure ([`super::pressure`]): each
//! element adds a quarter of its volume (m^3) and of its change to its nodes.

use core::ops::Range;

use crate::mesh::partition::Partitions;
use crate::mesh::strips::{CORNERS, LONGEST};
use crate::simd::{
    Gather, Kernel, NodeVector, Real, Scatter, ScatterBuffer, TILE, TileNodes, dispatch, unrolled,
};

use super::deformation::Deformation;
use super::internal_forces::nodes_of;
use super::{ElementTile, NodeInertia};

/// Floating-point operations that nodal pressure adds for one element: displacement gradient 63, volume ratio 29, share of a node 2,
/// sums 4; `U'` of four nodes instead of one, of a law linear in `J` 3, and their mean 4.
pub(crate) const NODAL_PRESSURE_OPERATIONS: u32 = 63 + 29 + 2 + 4 + 3 + 4;

/// The kernel that computes the rows of the nodes in some partitions: `J - 1` in the first tissue of the node and in the second,
/// then the volumes that these are means over, m^3.
pub(crate) struct NodalVolumes<'a> {
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) all: &'a Partitions,
    pub(crate) partitions: Range<usize>,
    /// The density of all elements, kg/m^3, if they are of one tissue and a node's mass is that of the tissue around it.
    pub(crate) density: Option<f32>,
    pub(crate) inertia: &'a [NodeInertia],
    pub(crate) displacement: &'a [NodeVector],
    /// Of the nodes in these partitions.
    pub(crate) rows: &'a mut [NodeVector],
}

impl NodalVolumes<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(crate) fn compute(self) {
        dispatch(self);
    }
}

impl Kernel for NodalVolumes<'_> {
    type Output = ();

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) {
        add_all::<R>(self);
    }
}

#[inline(always)]
fn add_all<R: Real>(kernel: NodalVolumes<'_>) {
    let NodalVolumes { tiles, all, partitions, density, inertia, displacement, rows } = kernel;
    rows.fill(NodeVector::ZERO);
    let displacement = Gather::new(displacement);
    let nodes = all.nodes(&partitions);
    let mut sums = Scatter::from(nodes.start, rows);
    for (touching, length) in all.touching(partitions) {
        let tiles = tiles.get(touching).unwrap_or_default();
        match (length, density.is_some()) {
            (3, true) => add_strips::<R, OneTissue, 3, 6>(tiles, displacement, &mut sums),
            (2, true) => add_strips::<R, OneTissue, 2, 5>(tiles, displacement, &mut sums),
            (_, true) => add_strips::<R, OneTissue, 1, 4>(tiles, displacement, &mut sums),
            (3, false) => add_strips::<R, TwoTissues, 3, 6>(tiles, displacement, &mut sums),
            (2, false) => add_strips::<R, TwoTissues, 2, 5>(tiles, displacement, &mut sums),
            (_, false) => add_strips::<R, TwoTissues, 1, 4>(tiles, displacement, &mut sums),
        }
    }
    if let Some(density) = density {
        for (row, inertia) in rows.iter_mut().zip(inertia.get(nodes).unwrap_or_default()) {
            let volume = inertia.mass / density;
            row.0 = [row.0[0] / volume, 0.0, volume, 0.0];
        }
        return;
    }
    for row in rows {
        let [change, volume, other_change, other_volume] = row.0;
        let ratio = |change: f32, volume: f32| if volume > 0.0 { change / volume } else { 0.0 };
        row.0 = [ratio(change, volume), ratio(other_change, other_volume), volume, other_volume];
    }
}

/// Adds the volumes of strips of `K` elements with `N` nodes.
#[inline(always)]
fn add_strips<R: Real, T: Tissues, const K: usize, const N: usize>(
    tiles: &[ElementTile],
    displacement: Gather<'_>,
    sums: &mut Scatter<'_>,
) {
    for tiles in tiles.as_chunks::<K>().0 {
        let mut buffer = ScatterBuffer::NONE;
        let rows = nodes_of(tiles.each_ref());
        let inside = sums.checked::<R, N>(rows);
        let nodes = inside.or_else(|| TileNodes::in_range::<R>(rows, 0, displacement.count()));
        let nodes = nodes.unwrap_or(TileNodes::<N>::ALL_ZERO);
        for first in (0..TILE).step_by(R::COUNT) {
            let mut at = [[R::splat(0.0); 3]; N];
            unrolled!(node < N => {
                at[node] = displacement.read_nodes::<R, N>(&nodes, node, first);
            });
            let mut shares = [T::none::<R>(); N];
            unrolled!(element < K => {
                let [a, b, c, d] = CORNERS[element % LONGEST];
                let corners = [at[a % N], at[b % N], at[c % N], at[d % N]];
                let change = Deformation::of_displacements(&tiles[element], first, corners).invariants.j;
                let volume = R::splat(0.25) * tiles[element].volume::<R>(first);
                for corner in 0..4 {
                    let share = &mut shares[CORNERS[element % LONGEST][corner] % N];
                    *share = T::add(*share, &tiles[element], first, corner, volume * change, volume);
                }
            });
            match &inside {
                Some(nodes) => T::scatter(sums, nodes, first, shares, &mut buffer),
                // Elements with nodes of another thread's partitions.
                None => sums.add_present(rows, first, T::rows(shares)),
            }
        }
    }
}

/// Of how many tissues elements may be.
trait Tissues {
    /// What goes to a node.
    type Share<R: Real>: Copy;
    fn none<R: Real>() -> Self::Share<R>;
    /// With the change of volume and the volume of a vector of elements that have the node at `corner`.
    fn add<R: Real>(
        share: Self::Share<R>,
        tile: &ElementTile,
        first: usize,
        corner: usize,
        change: R,
        volume: R,
    ) -> Self::Share<R>;
    /// As rows: change of volume and volume of the two tissues at the node.
    fn rows<R: Real, const N: usize>(shares: [Self::Share<R>; N]) -> [[R; 4]; N];
    fn scatter<R: Real, const N: usize>(
        sums: &mut Scatter<'_>,
        nodes: &TileNodes<'_, N>,
        first: usize,
        shares: [Self::Share<R>; N],
        buffer: &mut ScatterBuffer<N>,
    );
}

/// The volume of a node follows from its mass.
struct OneTissue;

impl Tissues for OneTissue {
    type Share<R: Real> = R;

    #[inline(always)]
    fn none<R: Real>() -> R {
        R::splat(0.0)
    }

    #[inline(always)]
    fn add<R: Real>(share: R, _: &ElementTile, _: usize, _: usize, change: R, _: R) -> R {
        share + change
    }

    #[inline(always)]
    fn rows<R: Real, const N: usize>(shares: [R; N]) -> [[R; 4]; N] {
        shares.map(|share| [share, R::splat(0.0), R::splat(0.0), R::splat(0.0)])
    }

    #[inline(always)]
    fn scatter<R: Real, const N: usize>(
        sums: &mut Scatter<'_>,
        nodes: &TileNodes<'_, N>,
        first: usize,
        shares: [R; N],
        buffer: &mut ScatterBuffer<N>,
    ) {
        sums.add_numbers(nodes, first, shares, buffer);
    }
}

struct TwoTissues;

impl Tissues for TwoTissues {
    type Share<R: Real> = [R; 4];

    #[inline(always)]
    fn none<R: Real>() -> [R; 4] {
        [R::splat(0.0); 4]
    }

    #[inline(always)]
    fn add<R: Real>(
        [first_change, first_volume, second_change, second_volume]: [R; 4],
        tile: &ElementTile,
        first: usize,
        corner: usize,
        change: R,
        volume: R,
    ) -> [R; 4] {
        let is = |slot: u8| R::from_fn(|lane| f32::from(u8::from(tile.slot(corner, first + lane) == slot)));
        let (one, other) = (is(0), is(1));
        [
            first_change + one * change,
            first_volume + one * volume,
            second_change + other * change,
            second_volume + other * volume,
        ]
    }

    #[inline(always)]
    fn rows<R: Real, const N: usize>(shares: [[R; 4]; N]) -> [[R; 4]; N] {
        shares
    }

    #[inline(always)]
    fn scatter<R: Real, const N: usize>(
        sums: &mut Scatter<'_>,
        nodes: &TileNodes<'_, N>,
        first: usize,
        shares: [[R; 4]; N],
        buffer: &mut ScatterBuffer<N>,
    ) {
        sums.add_corners(nodes, first, shares, buffer);
    }
}
