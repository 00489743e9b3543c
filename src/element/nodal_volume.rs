//! Volume ratios of the nodes, the first of two passes over tetrahedra with average nodal pressure
//! ([`super::pressure`]): each element adds its volume (m^3) and its change to its nodes, whose quarters cancel in the
//! ratios.

use core::ops::Range;

use bytemuck::must_cast_slice_mut;

use crate::mesh::partition::Partitions;
use crate::mesh::strips::{CORNERS, LONGEST};
use crate::simd::{
    Gather, Kernel, NodeVector, NumberBuffer, Piece, Real, Scatter, ScatterBuffer, ScatterNumbers, TILE, TileNodes,
    dispatch, unrolled,
};

use super::deformation::{Deformation, LeftOut, Matrix, Vector, edges};
use super::internal_forces::nodes_of;
use super::{ElementTile, NodeInertia};

/// Floating-point operations that nodal pressure adds for one element: displacement gradient 63, volume ratio 29, share
/// of a node 2, sums 4; mean over the nodes 4.
pub(crate) const NODAL_PRESSURE_OPERATIONS: u32 = 63 + 29 + 2 + 4 + 4;

/// The rows of all nodes. In a body of one tissue: the displacement (m), so that forces read one row a node, and `J -
/// 1`. With several: `J - 1` in the first tissue of the node and in the second.
#[derive(Clone, Copy)]
pub(crate) struct VolumeRows<'a> {
    pub(crate) rows: &'a [NodeVector],
    pub(crate) several_tissues: bool,
}

impl VolumeRows<'_> {
    /// `J - 1` of a node in the tissue of an element of this slot ([`ElementTile::slot`]); none in further tissues.
    pub(super) fn change(&self, node: usize, slot: u8) -> Option<f32> {
        let row = self.rows.get(node).copied().unwrap_or_default().0;
        match (self.several_tissues, slot) {
            (false, _) => Some(row[3]),
            (true, 0 | 1) => Some(row[usize::from(slot)]),
            (true, _) => None,
        }
    }
}

/// The kernel that computes the rows of the nodes in some partitions ([`VolumeRows`]).
pub(crate) struct NodalVolumes<'a> {
    pub(crate) tiles: &'a [ElementTile],
    pub(crate) all: &'a Partitions,
    pub(crate) partitions: Range<usize>,
    pub(crate) several_tissues: bool,
    /// The density of all elements, kg/m^3, if they are of one tissue and a node's mass is that of the tissue around
    /// it.
    pub(crate) density: Option<f32>,
    pub(crate) inertia: &'a [NodeInertia],
    pub(crate) displacement: &'a [NodeVector],
    /// What rounding has left out of the displacements, or nothing.
    pub(crate) remainder: &'a [NodeVector],
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
        match self.density {
            Some(density) => from_changes::<R>(self, density),
            None => from_changes_and_volumes::<R>(self),
        }
    }
}

/// The rows from sums of changes alone: the volume of a node follows from its mass.
#[inline(always)]
fn from_changes<R: Real>(kernel: NodalVolumes<'_>, density: f32) {
    let NodalVolumes { tiles, all, partitions, inertia, displacement, remainder, rows, .. } = kernel;
    let nodes = all.nodes(&partitions);
    let inertia = inertia.get(nodes.clone()).unwrap_or_default();
    let moved = displacement.get(nodes.clone()).unwrap_or_default();
    let count = rows.len();
    let components: &mut [f32] = must_cast_slice_mut(rows);
    // The sums are in the first quarter of the rows, so that they stay in the cache.
    let sums = components.get_mut(..count).unwrap_or_default();
    sums.fill(0.0);
    let vectors = [displacement, remainder];
    add_partitions::<R, _>((tiles, all, partitions), vectors, Changes(ScatterNumbers::from(nodes.start, sums)));
    // The last rows first: each is written over sums of later nodes.
    for first in (0..count).step_by(TILE).rev() {
        let (mut changes, mut masses) = ([0.0; TILE], [1.0; TILE]);
        let sums = components.get(first..count).unwrap_or_default();
        let of = inertia.get(first..).unwrap_or_default();
        for (change, sum) in changes.iter_mut().zip(sums) {
            *change = *sum;
        }
        for (mass, inertia) in masses.iter_mut().zip(of) {
            *mass = inertia.mass;
        }
        for from in (0..TILE).step_by(R::COUNT) {
            let change = R::from_fn(|lane| changes[(from + lane) % TILE]);
            let mass = R::from_fn(|lane| masses[(from + lane) % TILE]);
            let ratio = (R::splat(0.25 * density) * change).divide(mass);
            for lane in 0..R::COUNT {
                changes[(from + lane) % TILE] = ratio.lane(lane);
            }
        }
        let rows = components.as_chunks_mut::<4>().0.get_mut(first..).unwrap_or_default();
        let moved = moved.get(first..).unwrap_or_default();
        for ((row, moved), change) in rows.iter_mut().zip(moved).zip(changes) {
            *row = moved.0;
            row[3] = change;
        }
    }
}

/// The rows from sums of changes and of volumes for each tissue.
#[inline(always)]
fn from_changes_and_volumes<R: Real>(kernel: NodalVolumes<'_>) {
    let NodalVolumes { tiles, all, partitions, several_tissues, displacement, remainder, rows, .. } = kernel;
    let nodes = all.nodes(&partitions);
    rows.fill(NodeVector::ZERO);
    let moved = [displacement, remainder];
    add_partitions::<R, _>((tiles, all, partitions), moved, ChangesAndVolumes(Scatter::from(nodes.start, rows)));
    for (row, moved) in rows.iter_mut().zip(displacement.get(nodes).unwrap_or_default()) {
        let [change, volume, other_change, other_volume] = row.0;
        let ratio = |change: f32, volume: f32| if volume > 0.0 { change / volume } else { 0.0 };
        let [x, y, z] = moved.to_array();
        row.0 = if several_tissues {
            [ratio(change, volume), ratio(other_change, other_volume), 0.0, 0.0]
        } else {
            [x, y, z, ratio(change, volume)]
        };
    }
}

/// Adds the volumes of the elements that touch some partitions.
#[inline(always)]
fn add_partitions<R: Real, S: Sums>(
    (tiles, all, partitions): (&[ElementTile], &Partitions, Range<usize>),
    moved: [&[NodeVector]; 2],
    mut sums: S,
) {
    let moved = moved.map(Gather::new);
    for (touching, length) in all.touching(partitions) {
        let tiles = tiles.get(touching).unwrap_or_default();
        match length {
            3 => add_strips::<R, S, 3, 6>(tiles, moved, &mut sums),
            2 => add_strips::<R, S, 2, 5>(tiles, moved, &mut sums),
            _ => add_strips::<R, S, 1, 4>(tiles, moved, &mut sums),
        }
    }
}

/// Adds the volumes of strips of `K` elements with `N` nodes.
#[inline(always)]
fn add_strips<R: Real, S: Sums, const K: usize, const N: usize>(
    tiles: &[ElementTile],
    [displacement, remainder]: [Gather<'_>; 2],
    sums: &mut S,
) {
    for tiles in tiles.as_chunks::<K>().0 {
        let mut buffer = S::buffer::<N>();
        let rows = nodes_of(tiles.each_ref());
        let inside = sums.checked::<R, N>(rows);
        let readable = inside.filter(|nodes| nodes.end() <= displacement.count());
        let nodes = readable.or_else(|| TileNodes::in_range::<R>(rows, 0, displacement.count()));
        let nodes = nodes.unwrap_or(TileNodes::<N>::ALL_ZERO);
        for first in (0..TILE).step_by(R::COUNT) {
            let mut at = [[R::splat(0.0); 3]; N];
            unrolled!(node < N => {
                at[node] = displacement.read_nodes::<R, N>(&nodes, node, first);
            });
            // All gradients before all volumes: their operations do not wait for each other.
            let mut gradients = [[[R::splat(0.0); 3]; 3]; K];
            unrolled!(element < K => {
                let [a, b, c, d] = CORNERS[element % LONGEST];
                let corners = [at[a % N], at[b % N], at[c % N], at[d % N]];
                let mut edges = edges(corners);
                if remainder.count() > 0 {
                    edges = R::run_piece(LeftOut { tile: &tiles[element], first, remainder, edges });
                }
                gradients[element] = fused_gradient(&tiles[element], first, edges);
            });
            let mut shares = [S::none::<R>(); N];
            unrolled!(element < K => {
                let volume = tiles[element].volume::<R>(first);
                let change = volume * Deformation::new(gradients[element]).invariants.j;
                for corner in 0..4 {
                    let share = &mut shares[CORNERS[element % LONGEST][corner] % N];
                    let added = S::share((&tiles[element], first, corner), change, volume);
                    // The node's first element in the strip.
                    let new = element == 0 || corner == 0;
                    *share = if new { added } else { S::sum(*share, added) };
                }
            });
            match &inside {
                Some(nodes) => sums.scatter(nodes, first, shares, &mut buffer),
                // Elements with nodes of another thread's partitions.
                None => sums.scatter_present(rows, first, shares),
            }
        }
    }
}

/// The displacement gradients of elements from the displacements of three corners relative to the first one, with as
/// few operations as possible.
#[inline(always)]
fn fused_gradient<R: Real>(tile: &ElementTile, first: usize, edges: [Vector<R>; 3]) -> Matrix<R> {
    let mut h = [[R::splat(0.0); 3]; 3];
    for (corner, along) in edges.into_iter().enumerate() {
        for j in 0..3 {
            let gradient = tile.gradient::<R>(corner, j, first);
            for i in 0..3 {
                h[i][j] = if corner == 0 { along[i] * gradient } else { along[i].fused(gradient, h[i][j]) };
            }
        }
    }
    h
}

/// Sums over the elements around each node.
trait Sums {
    /// What goes to a node.
    type Share<R: Real>: Copy;
    /// What scalar code collects.
    type Buffer<const N: usize>;

    fn none<R: Real>() -> Self::Share<R>;
    fn buffer<const N: usize>() -> Self::Buffer<N>;
    /// Of the change of volume and the volume of the elements from a place of a tile on that have the node at a corner.
    fn share<R: Real>(place: (&ElementTile, usize, usize), change: R, volume: R) -> Self::Share<R>;
    fn sum<R: Real>(one: Self::Share<R>, other: Self::Share<R>) -> Self::Share<R>;
    fn checked<'b, R: Real, const N: usize>(&self, rows: [&'b [u32; TILE]; N]) -> Option<TileNodes<'b, N>>;
    fn scatter<R: Real, const N: usize>(
        &mut self,
        nodes: &TileNodes<'_, N>,
        first: usize,
        shares: [Self::Share<R>; N],
        buffer: &mut Self::Buffer<N>,
    );
    fn scatter_present<R: Real, const N: usize>(
        &mut self,
        nodes: [&[u32; TILE]; N],
        first: usize,
        shares: [Self::Share<R>; N],
    );
}

struct Changes<'a>(ScatterNumbers<'a>);

impl Sums for Changes<'_> {
    type Share<R: Real> = R;
    type Buffer<const N: usize> = NumberBuffer<N>;

    #[inline(always)]
    fn none<R: Real>() -> R {
        R::splat(0.0)
    }

    #[inline(always)]
    fn buffer<const N: usize>() -> NumberBuffer<N> {
        NumberBuffer::NONE
    }

    #[inline(always)]
    fn share<R: Real>(_: (&ElementTile, usize, usize), change: R, _: R) -> R {
        change
    }

    #[inline(always)]
    fn sum<R: Real>(one: R, other: R) -> R {
        one + other
    }

    #[inline(always)]
    fn checked<'b, R: Real, const N: usize>(&self, rows: [&'b [u32; TILE]; N]) -> Option<TileNodes<'b, N>> {
        self.0.checked::<R, N>(rows)
    }

    #[inline(always)]
    fn scatter<R: Real, const N: usize>(
        &mut self,
        nodes: &TileNodes<'_, N>,
        first: usize,
        shares: [R; N],
        buffer: &mut NumberBuffer<N>,
    ) {
        self.0.add_corners(nodes, first, shares, buffer);
    }

    #[inline(always)]
    fn scatter_present<R: Real, const N: usize>(&mut self, nodes: [&[u32; TILE]; N], first: usize, shares: [R; N]) {
        self.0.add_present(nodes, first, shares);
    }
}

/// What of the change and the volume of elements goes to a corner, to the first tissue there and to the second.
struct ShareOfTissues<'a, R> {
    tile: &'a ElementTile,
    first: usize,
    corner: usize,
    change: R,
    volume: R,
}

impl<R: Real> Piece for ShareOfTissues<'_, R> {
    type Output = [R; 4];

    #[inline(always)]
    fn run(self) -> [R; 4] {
        let Self { tile, first, corner, change, volume } = self;
        let is = |slot: u8| R::from_fn(|lane| f32::from(u8::from(tile.slot(corner, first + lane) == slot)));
        let (one, other) = (is(0), is(1));
        [one * change, one * volume, other * change, other * volume]
    }
}

/// Change and volume of the two tissues at a node.
struct ChangesAndVolumes<'a>(Scatter<'a>);

impl Sums for ChangesAndVolumes<'_> {
    type Share<R: Real> = [R; 4];
    type Buffer<const N: usize> = ScatterBuffer<N>;

    #[inline(always)]
    fn none<R: Real>() -> [R; 4] {
        [R::splat(0.0); 4]
    }

    #[inline(always)]
    fn buffer<const N: usize>() -> ScatterBuffer<N> {
        ScatterBuffer::NONE
    }

    #[inline(always)]
    fn share<R: Real>((tile, first, corner): (&ElementTile, usize, usize), change: R, volume: R) -> [R; 4] {
        R::run_piece(ShareOfTissues { tile, first, corner, change, volume })
    }

    #[inline(always)]
    fn sum<R: Real>(one: [R; 4], other: [R; 4]) -> [R; 4] {
        [one[0] + other[0], one[1] + other[1], one[2] + other[2], one[3] + other[3]]
    }

    #[inline(always)]
    fn checked<'b, R: Real, const N: usize>(&self, rows: [&'b [u32; TILE]; N]) -> Option<TileNodes<'b, N>> {
        self.0.checked::<R, N>(rows)
    }

    #[inline(always)]
    fn scatter<R: Real, const N: usize>(
        &mut self,
        nodes: &TileNodes<'_, N>,
        first: usize,
        shares: [[R; 4]; N],
        buffer: &mut ScatterBuffer<N>,
    ) {
        self.0.add_corners(nodes, first, shares, buffer);
    }

    #[inline(always)]
    fn scatter_present<R: Real, const N: usize>(
        &mut self,
        nodes: [&[u32; TILE]; N],
        first: usize,
        shares: [[R; 4]; N],
    ) {
        self.0.add_present(nodes, first, shares);
    }
}
