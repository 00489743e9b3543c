//! How the lattice answers forces on few nodes, as those that an instrument touches: `S^-1` ([`super`]) between the few
//! functions that move these nodes, computed once a step, so that the many products of [`crate::contact::solve`] do not
//! run over the whole lattice. 1/kg.

use glam::Vec3;

use super::coarse_motion::CoarseSpace;
use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS, node_place};
use crate::contact::TouchedPoint;

/// Functions of a box of four cells.
pub(super) const MOST_LISTED: usize = 18;
const STRIDE: usize = 3 * MOST_LISTED;

/// Floats of the matrix.
pub(crate) const LOCAL_FLOATS: usize = STRIDE * STRIDE;

/// The functions that move some nodes, and the place of each in the list.
pub(super) struct ListedFunctions {
    list: [u8; MAX_FUNCTIONS],
    count: usize,
    places: [u8; MAX_FUNCTIONS + 1],
}

const NOT_LISTED: u8 = u8::MAX;

impl ListedFunctions {
    pub(super) fn of(points: &[TouchedPoint], places: &[LatticeNode], lattice: &Lattice) -> Self {
        let mut listed = Self { list: [0; MAX_FUNCTIONS], count: 0, places: [NOT_LISTED; MAX_FUNCTIONS + 1] };
        for (node, _) in points.iter().flat_map(TouchedPoint::corners) {
            let Some(place) = node_place(places, node) else { continue };
            for function in lattice.functions_of(place.cell()) {
                // Light points are none of the functions: the answer is that of the whole lattice.
                if lattice.is_light(function) {
                    listed.count = MAX_FUNCTIONS;
                } else if function < MAX_FUNCTIONS && listed.place(function).is_none() {
                    listed.places[function] = listed.count as u8;
                    if let Some(entry) = listed.list.get_mut(listed.count) {
                        *entry = function as u8;
                        listed.count += 1;
                    }
                }
            }
        }
        listed
    }

    fn functions(&self) -> &[u8] {
        self.list.get(..self.count).unwrap_or_default()
    }

    pub(super) fn place(&self, function: usize) -> Option<usize> {
        self.places.get(function).filter(|&&place| place != NOT_LISTED).map(|&place| usize::from(place))
    }
}

/// The matrix between the listed functions.
pub(super) struct LocalResponse<'a> {
    matrix: &'a [f32],
}

impl<'a> LocalResponse<'a> {
    /// Computes the matrix in `room`. None if there are more functions than it is for.
    pub(super) fn gathered(room: &'a mut [f32], listed: &ListedFunctions, space: &CoarseSpace<'_, '_>) -> Option<Self> {
        let functions = listed.functions();
        let room = room.get_mut(..3 * functions.len() * STRIDE).filter(|_| functions.len() <= MOST_LISTED)?;
        room.fill(0.0);
        for (rows, &row) in room.chunks_exact_mut(3 * STRIDE).zip(functions) {
            space.response(row.into(), functions, |axis, place, moved| {
                if let Some(to) = rows.get_mut(axis * STRIDE + 3 * place..).and_then(<[f32]>::first_chunk_mut) {
                    *to = moved.to_array();
                }
            });
        }
        Some(Self { matrix: room })
    }

    /// Replaces the sums of the listed functions (kg m) by their motions, m.
    pub(super) fn answer(&self, sums: &mut [Vec3; MOST_LISTED]) {
        let mut out = [0.0; STRIDE];
        for (row, factor) in self.matrix.chunks_exact(STRIDE).zip(sums.iter().flat_map(|sum| sum.to_array())) {
            out.iter_mut().zip(row).for_each(|(out, entry)| *out += factor * entry);
        }
        for (sum, &out) in sums.iter_mut().zip(out.as_chunks::<3>().0) {
            *sum = out.into();
        }
    }
}
