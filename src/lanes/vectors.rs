//! Vectors of nodes and their way into lanes and back: gather turns the vectors of `L` nodes into one
//! number in lanes per axis, scatter adds lanes to the vectors of their nodes, in the order of the lanes.

use bytemuck::{Pod, Zeroable};

use super::{BLOCK, Real};

/// A vector of one node, padded to four numbers; between steps the fourth is zero.
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

/// Of vectors side by side as they are in memory: ones for the three axes, zero for what stands behind them.
#[inline(always)]
pub(crate) fn axes<R: Real>() -> R {
    R::from_fn(|lane| if lane % 4 == 3 { 0.0 } else { 1.0 })
}

/// Four lanes by four components, transposed.
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

/// Writes rows from `first` on, one a lane; nothing if there are fewer.
#[inline(always)]
pub(crate) fn write_rows<R: Real>(rows: &mut [[f32; 4]], first: usize, values: [R; 4]) {
    let rows = rows.get_mut(first..first + R::COUNT).unwrap_or_default();
    R::to_rows(values, |lane, value| {
        if let Some(row) = rows.get_mut(lane) {
            *row = value;
        }
    });
}

/// Where the rows of nodes side by side are.
pub(crate) trait Rows: Copy {
    /// The row of a lane.
    fn number<R: Real>(&self, lane: usize) -> usize;
    /// Rows, one a lane; zeros if there are fewer.
    fn read<R: Real>(&self, rows: &[[f32; 4]]) -> [R; 4];
    /// Writes rows, one a lane; nothing if there are fewer.
    fn write<R: Real>(&self, rows: &mut [[f32; 4]], values: [R; 4]);
}

/// Rows one after the other, from this one on; the order of lanes is that of [`Real::lane_of`].
#[derive(Clone, Copy)]
pub(crate) struct Following(pub(crate) usize);

impl Rows for Following {
    #[inline(always)]
    fn number<R: Real>(&self, lane: usize) -> usize {
        self.0 + (0..R::COUNT).find(|&row| R::lane_of(row) == lane).unwrap_or(0)
    }
    #[inline(always)]
    fn read<R: Real>(&self, rows: &[[f32; 4]]) -> [R; 4] {
        R::from_block(rows.get(self.0..self.0 + R::COUNT).unwrap_or_default())
    }
    #[inline(always)]
    fn write<R: Real>(&self, rows: &mut [[f32; 4]], values: [R; 4]) {
        R::to_block(values, rows.get_mut(self.0..self.0 + R::COUNT).unwrap_or_default());
    }
}

/// Rows in any order, known to be below some number: checked all at once, as [`BlockNodes`] are.
#[derive(Clone, Copy)]
pub(crate) struct Chosen {
    rows: [u32; BLOCK],
    /// What they are below.
    count: usize,
}

impl Chosen {
    /// The rows, if all are below `count`.
    #[inline(always)]
    pub(crate) fn below<R: Real>(rows: [u32; BLOCK], count: usize) -> Option<Self> {
        if are_among::<R, 1>([&rows], 0, count) { Some(Self { rows, count }) } else { None }
    }
}

impl Rows for Chosen {
    #[inline(always)]
    fn number<R: Real>(&self, lane: usize) -> usize {
        self.rows[lane % BLOCK] as usize
    }
    #[inline(always)]
    fn read<R: Real>(&self, rows: &[[f32; 4]]) -> [R; 4] {
        if self.count > rows.len() {
            return [R::splat(0.0); 4];
        }
        R::from_rows(|lane| {
            #[allow(unsafe_code)]
            // SAFETY: all rows are below `self.count`, which is not above how many there are.
            unsafe {
                *rows.get_unchecked(self.number::<R>(lane))
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
            let row = unsafe { rows.get_unchecked_mut(self.number::<R>(lane)) };
            *row = value;
        });
    }
}

/// Whether all of some numbers are among `count` from `first` on.
#[inline(always)]
fn are_among<R: Real, const N: usize>(rows: [&[u32; BLOCK]; N], first: usize, count: usize) -> bool {
    match (u32::try_from(first), u32::try_from(count)) {
        (Ok(first), Ok(count)) => R::are_among(rows, first, count),
        _ => false,
    }
}

/// Scalar products of vectors side by side.
#[inline(always)]
pub(crate) fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[2].fused(b[2], a[1].fused(b[1], a[0] * b[0]))
}

/// Nodes of the elements of a block, `N` rows of them, known to be in some range: they are checked all at once, so that a kernel
/// does not have to check them one by one.
#[derive(Clone, Copy)]
pub(crate) struct BlockNodes<'a, const N: usize> {
    rows: [&'a [u32; BLOCK]; N],
    /// Where they are.
    first: usize,
    count: usize,
}

impl<'a, const N: usize> BlockNodes<'a, N> {
    /// The first node, again and again.
    pub(crate) const NONE: Self = Self { rows: [&[0; BLOCK]; N], first: 0, count: 1 };

    /// The nodes, if all are among `count` from `first` on. Numbers one by one look at each node when they get there.
    #[inline(always)]
    pub(crate) fn among<R: Real>(rows: [&'a [u32; BLOCK]; N], first: usize, count: usize) -> Option<Self> {
        if R::COUNT == 1 {
            // Of no use to wider ones: so many there never are.
            return Some(Self { rows, first: 0, count: usize::MAX });
        }
        if are_among::<R, N>(rows, first, count) { Some(Self { rows, first, count }) } else { None }
    }

    /// The node in row `corner` and `lane`.
    #[inline(always)]
    fn at(&self, corner: usize, lane: usize) -> usize {
        self.rows[corner % N][lane % BLOCK] as usize
    }
}

/// Vectors of nodes to read from.
#[derive(Clone, Copy)]
pub(crate) struct Gather<'a>(&'a [NodeVector]);

impl<'a> Gather<'a> {
    pub(crate) const fn new(vectors: &'a [NodeVector]) -> Self {
        Self(vectors)
    }

    /// How many there are.
    pub(crate) const fn count(&self) -> usize {
        self.0.len()
    }

    /// Lane `l` takes the vector of the node in row `corner` and lane `first + l`; zeros if the nodes are not known to be among
    /// the vectors.
    #[inline(always)]
    pub(crate) fn read_lanes<R: Real, const N: usize>(
        &self,
        nodes: &BlockNodes<'_, N>,
        corner: usize,
        first: usize,
    ) -> [R; 3] {
        if R::COUNT == 1 {
            let vector = self.0.get(nodes.at(corner, first)).copied().unwrap_or_default();
            return vector.to_array().map(R::splat);
        }
        if nodes.first + nodes.count > self.0.len() {
            return [R::splat(0.0); 3];
        }
        let [x, y, z, _] = R::from_rows(|lane| {
            #[allow(unsafe_code)]
            // SAFETY: all nodes are below `nodes.first + nodes.count`, which is not above the number of vectors.
            unsafe {
                self.0.get_unchecked(nodes.at(corner, first + lane)).0
            }
        });
        [x, y, z]
    }
}

/// Lanes in whose order vectors of nodes are added to, however wide a vector is.
pub(crate) const EIGHT: usize = 8;

/// Numbers one by one on their way to the nodes of `N` corners: they wait until there are those of eight elements.
pub(crate) struct Waiting<const N: usize>([[[f32; 4]; EIGHT]; N]);

impl<const N: usize> Waiting<N> {
    /// None yet.
    pub(crate) const NONE: Self = Self([[[0.0; 4]; EIGHT]; N]);
}

/// Vectors of consecutive nodes to add to.
pub(crate) struct Scatter<'a> {
    vectors: &'a mut [NodeVector],
    /// Whose the first one is.
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

    /// A block's nodes, if all are among those of the vectors.
    #[inline(always)]
    pub(crate) fn all_of<'b, R: Real, const N: usize>(
        &self,
        rows: [&'b [u32; BLOCK]; N],
    ) -> Option<BlockNodes<'b, N>> {
        BlockNodes::among::<R>(rows, self.first, self.vectors.len())
    }

    /// Adds for each row of nodes the components in lane `l` to the vector of the node in lane `first + l`, in the order of
    /// [`Real::corners_to_rows`]; nothing if the nodes are not known to be among the vectors'. Numbers one by one have to come
    /// lane after lane.
    #[inline(always)]
    pub(crate) fn add_corners<R: Real, const N: usize>(
        &mut self,
        nodes: &BlockNodes<'_, N>,
        first: usize,
        values: [[R; 4]; N],
        waiting: &mut Waiting<N>,
    ) {
        if R::COUNT == 1 {
            for (eight, values) in waiting.0.iter_mut().zip(values) {
                R::to_rows(values, |_, row| eight[first % EIGHT] = row);
            }
            if first % EIGHT == EIGHT - 1 {
                self.add_waiting(nodes, first - first % EIGHT, waiting);
            }
            return;
        }
        if nodes.first != self.first || nodes.count > self.vectors.len() {
            return;
        }
        // Where node 0 would be: one subtraction for all.
        let vectors = self.vectors.as_mut_ptr().wrapping_sub(self.first);
        R::corners_to_rows(values, |corner, lane, value| {
            #[allow(unsafe_code)]
            // SAFETY: all nodes are among `nodes.count` from `self.first` on, of which there are vectors.
            let vector = unsafe { &mut *vectors.wrapping_add(nodes.at(corner, first + lane)) };
            for (sum, value) in vector.0.iter_mut().zip(value) {
                *sum += value;
            }
        });
    }

    /// Adds what waited to those of the nodes in lanes from `first` on that are among those of the vectors.
    fn add_waiting<const N: usize>(&mut self, nodes: &BlockNodes<'_, N>, first: usize, waiting: &Waiting<N>) {
        for (corner, eight) in waiting.0.iter().enumerate() {
            for (lane, row) in (first..).zip(eight) {
                let node = nodes.at(corner, lane);
                if let Some(vector) = self.vectors.get_mut(node.wrapping_sub(self.first)) {
                    for (sum, value) in vector.0.iter_mut().zip(row) {
                        *sum += value;
                    }
                }
            }
        }
    }

    /// Adds to those of a block's nodes that are among those of the vectors, slowly, in the same order.
    #[inline(always)]
    pub(crate) fn add_some<R: Real, const N: usize>(
        &mut self,
        nodes: [&[u32; BLOCK]; N],
        first: usize,
        values: [[R; 4]; N],
    ) {
        for eight in (0..R::COUNT).step_by(EIGHT) {
            for (nodes, values) in nodes.iter().zip(&values) {
                for lane in eight..R::COUNT.min(eight + EIGHT) {
                    let node = nodes[(first + lane) % BLOCK] as usize;
                    if let Some(vector) = self.vectors.get_mut(node.wrapping_sub(self.first)) {
                        for (sum, value) in vector.0.iter_mut().zip(values) {
                            *sum += value.lane(lane);
                        }
                    }
                }
            }
        }
    }
}
