//! Vectors of the functions that a step computes with, in the caller's storage: each takes 4 kB, and hosts may have little
//! stack.

use super::lattice::CoarseVectors;
use crate::simd::NodeVector;

/// Vectors of a room.
const COUNT: usize = 7;

/// Vectors of storage.
pub(super) const VECTORS: usize = COUNT * size_of::<CoarseVectors>() / size_of::<NodeVector>();

pub(super) struct CoarseRoom<'a> {
    /// The residual `W^T r` (kg m), later the lattice's motion, m.
    pub(super) motion: &'a mut CoarseVectors,
    /// The lattice's part of the last increments, later of the next ones, m.
    pub(super) part: &'a mut CoarseVectors,
    /// See [`super::supports::Pull`].
    pub(super) pull: [&'a mut CoarseVectors; 2],
    pub(super) scratch: [&'a mut CoarseVectors; 3],
}

impl<'a> CoarseRoom<'a> {
    /// The room, and what is left of the storage.
    pub(super) fn split(storage: &'a mut [NodeVector]) -> Option<(Self, &'a mut [NodeVector])> {
        let (vectors, rest) = storage.split_at_mut_checked(VECTORS)?;
        let all: &mut [CoarseVectors; COUNT] = vectors.as_chunks_mut().0.first_chunk_mut()?;
        let [motion, part, a, b, c, d, e] = all;
        Some((Self { motion, part, pull: [a, b], scratch: [c, d, e] }, rest))
    }
}
