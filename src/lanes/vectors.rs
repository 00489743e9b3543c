//! Vectors of nodes and their way into lanes and back: gather turns the vectors of `L` nodes into one
//! number in lanes per axis, scatter adds lanes to the vectors of their nodes, in the order of the lanes.

use bytemuck::{Pod, Zeroable};

use super::Real;

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

/// Rows from `first` on, one a lane; zeros if there are fewer.
#[inline(always)]
pub(crate) fn read_rows<R: Real>(rows: &[[f32; 4]], first: usize) -> [R; 4] {
    let rows = rows.get(first..first + R::COUNT).unwrap_or_default();
    if rows.len() == R::COUNT { R::from_rows(|lane| rows[lane % R::COUNT]) } else { [R::splat(0.0); 4] }
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

/// Scalar products of vectors side by side.
#[inline(always)]
pub(crate) fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vectors of nodes to read from; there is at least one.
#[derive(Clone, Copy)]
pub(crate) struct Gather<'a> {
    vectors: &'a [NodeVector],
    last: usize,
}

impl<'a> Gather<'a> {
    pub(crate) fn new(vectors: &'a [NodeVector]) -> Option<Self> {
        Some(Self { vectors, last: vectors.len().checked_sub(1)? })
    }

    #[inline(always)]
    fn read(&self, node: usize) -> [f32; 4] {
        let node = if node < self.last { node } else { self.last };
        #[allow(unsafe_code)]
        // SAFETY: `node <= last < vectors.len()`. The line above becomes a conditional move; the branch of a
        // checked access would keep the compiler from unrolling the lanes.
        unsafe {
            self.vectors.get_unchecked(node).0
        }
    }

    /// Lane `l` takes the vector of node `index(l)`; a node that does not exist reads as the last one.
    #[inline(always)]
    pub(crate) fn read_lanes<R: Real>(&self, index: impl Fn(usize) -> usize) -> [R; 3] {
        let [x, y, z, _] = R::from_rows(|lane| self.read(index(lane)));
        [x, y, z]
    }
}

/// Vectors of nodes to add to; there is at least one.
pub(crate) struct Scatter<'a> {
    vectors: &'a mut [NodeVector],
    last: usize,
}

impl<'a> Scatter<'a> {
    pub(crate) fn new(vectors: &'a mut [NodeVector]) -> Option<Self> {
        let last = vectors.len().checked_sub(1)?;
        Some(Self { vectors, last })
    }

    #[inline(always)]
    fn add(&mut self, node: usize, value: [f32; 4]) {
        let node = if node < self.last { node } else { self.last };
        #[allow(unsafe_code)]
        // SAFETY: `node <= last < vectors.len()`, as in `Gather::read`.
        let vector = unsafe { self.vectors.get_unchecked_mut(node) };
        for (sum, value) in vector.0.iter_mut().zip(value) {
            *sum += value;
        }
    }

    /// Adds the components in lane `l` to the vector of node `index(l)`; a node that does not exist counts
    /// as the last one.
    #[inline(always)]
    pub(crate) fn add_lanes<R: Real>(&mut self, index: impl Fn(usize) -> usize, values: [R; 4]) {
        R::to_rows(values, |lane, value| self.add(index(lane), value));
    }
}
