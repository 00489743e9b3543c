//! Nodal vectors (displacements in m, forces in N), and gather and scatter between them and SIMD vectors. Gather reads
//! the vectors of several nodes into one SIMD vector per axis. Scatter adds SIMD vectors to the vectors of their nodes,
//! in an order that does not depend on the width.

use core::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::{Real, TILE};

/// A vector of one node, padded to four components. Between steps the fourth is zero, but of volumes, which keep `J - 1`
/// there in a body of one tissue.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct NodeVector(pub(crate) [f32; 4]);

impl NodeVector {
    /// The zero vector.
    pub const ZERO: Self = Self([0.0; 4]);

    /// Components along x, y, z.
    #[must_use]
    pub const fn to_array(self) -> [f32; 3] {
        let [x, y, z, _] = self.0;
        [x, y, z]
    }
}

/// A mask for nodal vectors as they are in memory: ones for the three axes, zeros for the padding.
#[inline(always)]
pub(crate) fn axes<R: Real>() -> R {
    R::from_fn(|lane| if lane % 4 == 3 { 0.0 } else { 1.0 })
}

/// Transposes a 4 x 4 matrix.
#[inline(always)]
pub(super) fn transpose(rows: [[f32; 4]; 4]) -> [[f32; 4]; 4] {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{__m128, _mm_movehl_ps, _mm_movelh_ps, _mm_unpackhi_ps, _mm_unpacklo_ps};
        let [a, b, c, d] = rows.map(bytemuck::cast::<[f32; 4], __m128>);
        #[allow(unsafe_code)]
        // SAFETY: SSE is part of x86-64.
        let columns = unsafe {
            let (low_ab, low_cd) = (_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
            let (high_ab, high_cd) = (_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
            [
                _mm_movelh_ps(low_ab, low_cd),
                _mm_movehl_ps(low_cd, low_ab),
                _mm_movelh_ps(high_ab, high_cd),
                _mm_movehl_ps(high_cd, high_ab),
            ]
        };
        columns.map(bytemuck::cast::<__m128, [f32; 4]>)
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        [0, 1, 2, 3].map(|column| rows.map(|row| row[column]))
    }
}

/// Places of the rows of a vector of nodes in a table with one row a node.
pub(crate) trait Rows: Copy {
    /// Index of the row that belongs to a lane.
    fn index<R: Real>(&self, lane: usize) -> usize;
    /// Reads one row for each lane; zeros if there are fewer rows.
    fn read<R: Real>(&self, rows: &[[f32; 4]]) -> [R; 4];
    /// Writes one row for each lane; nothing if there are fewer rows.
    fn write<R: Real>(&self, rows: &mut [[f32; 4]], values: [R; 4]);
}

/// Consecutive rows from this one on, in the order of [`Real::lane_of_row`].
#[derive(Clone, Copy)]
pub(crate) struct Contiguous(pub(crate) usize);

impl Rows for Contiguous {
    #[inline(always)]
    fn index<R: Real>(&self, lane: usize) -> usize {
        self.0 + R::row_of_lane(lane)
    }
    #[inline(always)]
    fn read<R: Real>(&self, rows: &[[f32; 4]]) -> [R; 4] {
        R::from_consecutive_rows(rows.get(self.0..self.0 + R::COUNT).unwrap_or_default())
    }
    #[inline(always)]
    fn write<R: Real>(&self, rows: &mut [[f32; 4]], values: [R; 4]) {
        R::to_consecutive_rows(values, rows.get_mut(self.0..self.0 + R::COUNT).unwrap_or_default());
    }
}

/// Rows in any order, all checked at once to be below a limit.
#[derive(Clone, Copy)]
pub(crate) struct Indexed {
    rows: [u32; TILE],
    /// The limit.
    count: usize,
}

impl Indexed {
    /// The rows, if all are below `count`.
    #[inline(always)]
    pub(crate) fn below<R: Real>(rows: [u32; TILE], count: usize) -> Option<Self> {
        if all_in_range::<R, 1>([&rows], 0, count) { Some(Self { rows, count }) } else { None }
    }
}

impl Rows for Indexed {
    #[inline(always)]
    fn index<R: Real>(&self, lane: usize) -> usize {
        self.rows[lane % TILE] as usize
    }
    #[inline(always)]
    fn read<R: Real>(&self, rows: &[[f32; 4]]) -> [R; 4] {
        if self.count > rows.len() {
            return [R::splat(0.0); 4];
        }
        R::from_rows(|lane| {
            #[allow(unsafe_code)]
            // SAFETY: all rows are below `self.count`, which is at most `rows.len()`.
            unsafe {
                *rows.get_unchecked(self.index::<R>(lane))
            }
        })
    }
    #[inline(always)]
    fn write<R: Real>(&self, rows: &mut [[f32; 4]], values: [R; 4]) {
        if self.count > rows.len() {
            return;
        }
        R::to_rows(values, |lane, value| {
            #[allow(unsafe_code)]
            // SAFETY: as above.
            let row = unsafe { rows.get_unchecked_mut(self.index::<R>(lane)) };
            *row = value;
        });
    }
}

/// Whether all indices are in the range of `count` indices from `first` on.
#[inline(always)]
fn all_in_range<R: Real, const N: usize>(rows: [&[u32; TILE]; N], first: usize, count: usize) -> bool {
    match (u32::try_from(first), u32::try_from(count)) {
        (Ok(first), Ok(count)) => R::all_in_range(rows, first, count),
        _ => false,
    }
}

/// Scalar products of the vectors of several elements or nodes.
#[inline(always)]
pub(crate) fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[2].fused(b[2], a[1].fused(b[1], a[0] * b[0]))
}

/// Nodes of the elements of a tile, one row for each of `N` corners, all checked at once to be in a range. So a kernel
/// does not have to check each access.
#[derive(Clone, Copy)]
pub(crate) struct TileNodes<'a, const N: usize> {
    rows: [&'a [u32; TILE]; N],
    /// The range.
    pub(super) first: usize,
    pub(super) count: usize,
}

impl<'a, const N: usize> TileNodes<'a, N> {
    /// Node 0 in all places.
    pub(crate) const ALL_ZERO: Self = Self { rows: [&[0; TILE]; N], first: 0, count: 1 };

    /// Nodes that each access checks: their range is one that no table has, so that vectorised accesses refuse it.
    #[inline(always)]
    pub(super) const fn checked_at_access(rows: [&'a [u32; TILE]; N]) -> Self {
        Self { rows, first: 0, count: usize::MAX }
    }

    /// The nodes, if all are in the range of `count` nodes from `first` on. Scalar code checks each node at its access
    /// instead.
    #[inline(always)]
    pub(crate) fn in_range<R: Real>(rows: [&'a [u32; TILE]; N], first: usize, count: usize) -> Option<Self> {
        if R::COUNT == 1 {
            return Some(Self::checked_at_access(rows));
        }
        if all_in_range::<R, N>(rows, first, count) { Some(Self { rows, first, count }) } else { None }
    }

    /// The first node after the range.
    #[inline(always)]
    pub(crate) const fn end(&self) -> usize {
        self.first + self.count
    }

    /// The node in row `corner` and `lane`.
    #[inline(always)]
    pub(super) fn at(&self, corner: usize, lane: usize) -> usize {
        self.rows[corner % N][lane % TILE] as usize
    }
}

/// Vectors of nodes to read from.
#[derive(Clone, Copy)]
pub(crate) struct Gather<'a>(&'a [NodeVector]);

impl<'a> Gather<'a> {
    pub(crate) const fn new(vectors: &'a [NodeVector]) -> Self {
        Self(vectors)
    }

    /// Number of vectors.
    pub(crate) const fn count(&self) -> usize {
        self.0.len()
    }

    /// Lane `l` takes the vector of the node in row `corner` and place `first + l`; zeros if the checked range of the
    /// nodes exceeds the vectors.
    #[inline(always)]
    pub(crate) fn read_nodes<R: Real, const N: usize>(
        &self,
        nodes: &TileNodes<'_, N>,
        corner: usize,
        first: usize,
    ) -> [R; 3] {
        let [x, y, z, _] = self.read_rows::<R, N>(nodes, corner, first);
        [x, y, z]
    }

    /// The same with the fourth component.
    #[inline(always)]
    pub(crate) fn read_rows<R: Real, const N: usize>(
        &self,
        nodes: &TileNodes<'_, N>,
        corner: usize,
        first: usize,
    ) -> [R; 4] {
        if R::COUNT == 1 {
            return self.0.get(nodes.at(corner, first)).copied().unwrap_or_default().0.map(R::splat);
        }
        if nodes.end() > self.0.len() {
            return [R::splat(0.0); 4];
        }
        R::from_rows(|lane| {
            #[allow(unsafe_code)]
            // SAFETY: all nodes are below `nodes.first + nodes.count`, which is at most the number of vectors.
            unsafe {
                self.0.get_unchecked(nodes.at(corner, first + lane)).0
            }
        })
    }
}

/// Elements whose forces are added corner by corner before those of the next elements. This fixes the order of sums,
/// whatever the width of a vector.
pub(crate) const SCATTER_WIDTH: usize = 8;

/// Scalar code and vectors of four collect here what goes to the `N` corners of eight elements, and then add it in the order
/// of longer vectors.
pub(crate) struct ScatterBuffer<const N: usize>([[[f32; 4]; SCATTER_WIDTH]; N]);

impl<const N: usize> ScatterBuffer<N> {
    /// An empty buffer.
    pub(crate) const NONE: Self = Self([[[0.0; 4]; SCATTER_WIDTH]; N]);
}

/// Vectors of consecutive nodes to add to.
pub(crate) struct Scatter<'a> {
    vectors: &'a mut [NodeVector],
    /// Node of the first vector.
    first: usize,
}

impl<'a> Scatter<'a> {
    /// Vectors of all nodes.
    pub(crate) const fn new(vectors: &'a mut [NodeVector]) -> Self {
        Self::from(0, vectors)
    }

    /// Vectors of the nodes from `first` on.
    pub(crate) const fn from(first: usize, vectors: &'a mut [NodeVector]) -> Self {
        Self { vectors, first }
    }

    /// The same vectors.
    #[inline(always)]
    pub(crate) const fn reborrow(&mut self) -> Scatter<'_> {
        Scatter { vectors: self.vectors, first: self.first }
    }

    /// The nodes of a tile, if all of them have a vector here. Vectors of fewer than eight check each node at its access.
    #[inline(always)]
    pub(crate) fn checked<'b, R: Real, const N: usize>(&self, rows: [&'b [u32; TILE]; N]) -> Option<TileNodes<'b, N>> {
        if R::COUNT < SCATTER_WIDTH {
            return Some(TileNodes::checked_at_access(rows));
        }
        TileNodes::in_range::<R>(rows, self.first, self.vectors.len())
    }

    /// Adds for each corner the components in lane `l` to the vector of the node in place `first + l`, in the order of
    /// [`Real::corners_to_rows`]; nothing if the nodes have not been checked by [`Scatter::checked`]. Vectors of fewer
    /// than eight have to call this for all places in order.
    #[inline(always)]
    pub(crate) fn add_corners<R: Real, const N: usize>(
        &mut self,
        nodes: &TileNodes<'_, N>,
        first: usize,
        values: [[R; 4]; N],
        buffer: &mut ScatterBuffer<N>,
    ) {
        if R::COUNT < SCATTER_WIDTH {
            let place = first % SCATTER_WIDTH;
            for (buffered, values) in buffer.0.iter_mut().zip(values) {
                R::to_rows(values, |lane, row| buffered[(place + lane) % SCATTER_WIDTH] = row);
            }
            if place + R::COUNT == SCATTER_WIDTH {
                self.add_buffered(nodes, first - place, buffer);
            }
            return;
        }
        if nodes.first != self.first || nodes.count > self.vectors.len() {
            return;
        }
        // The place that node 0 would have, so that nodes need no subtraction.
        let vectors = self.vectors.as_mut_ptr().wrapping_sub(self.first);
        R::corners_to_rows(values, |corner, lane, value| {
            #[allow(unsafe_code)]
            // SAFETY: all nodes are in the range of `nodes.count` from `self.first` on, and each of these has a vector.
            let vector = unsafe { &mut *vectors.wrapping_add(nodes.at(corner, first + lane)) };
            for (sum, value) in vector.0.iter_mut().zip(value) {
                *sum += value;
            }
        });
    }

    /// Adds the buffered values to the nodes in places from `first` on, those that have a vector here.
    fn add_buffered<const N: usize>(&mut self, nodes: &TileNodes<'_, N>, first: usize, buffer: &ScatterBuffer<N>) {
        for (corner, buffered) in buffer.0.iter().enumerate() {
            for (lane, row) in (first..).zip(buffered) {
                let node = nodes.at(corner, lane);
                if let Some(vector) = self.vectors.get_mut(node.wrapping_sub(self.first)) {
                    for (sum, value) in vector.0.iter_mut().zip(row) {
                        *sum += value;
                    }
                }
            }
        }
    }

    /// Adds to those nodes of a tile that have a vector here, in the same order but slower.
    #[inline(always)]
    pub(crate) fn add_present<R: Real, const N: usize>(
        &mut self,
        nodes: [&[u32; TILE]; N],
        first: usize,
        values: [[R; 4]; N],
    ) {
        let mut rows = [[[0.0; 4]; TILE]; N];
        for (rows, values) in rows.iter_mut().zip(values) {
            R::to_rows(values, |lane, row| rows[lane % TILE] = row);
        }
        self.add_rows(&nodes, first..first + R::COUNT, &rows);
    }

    /// The rows of each corner, one for each of these places. Compiled once, not for each kernel and width.
    #[inline(never)]
    fn add_rows(&mut self, nodes: &[&[u32; TILE]], places: Range<usize>, rows: &[[[f32; 4]; TILE]]) {
        for start in places.clone().step_by(SCATTER_WIDTH) {
            for (nodes, rows) in nodes.iter().zip(rows) {
                for place in start..places.end.min(start + SCATTER_WIDTH) {
                    let node = nodes[place % TILE] as usize;
                    if let Some(vector) = self.vectors.get_mut(node.wrapping_sub(self.first)) {
                        for (sum, value) in vector.0.iter_mut().zip(rows[(place - places.start) % TILE]) {
                            *sum += value;
                        }
                    }
                }
            }
        }
    }
}
