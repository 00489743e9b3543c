//! How the lattice answers forces on few nodes, as those that an instrument touches: `share S^-1 - least G^-1`
//! ([`super`]) between the few functions that move these nodes, gathered once a step, so that the many products of
//! [`crate::contact::solve`] do not run over the whole lattice. In the frames of the bounds; 1/kg.

use glam::Vec3;

use super::coarse_motion::CoarseSpace;
use super::dense::{Row, apply, stride};
use super::lattice::{Lattice, LatticeNode, MAX_FUNCTIONS, node_place};
use super::matrices::Matrices;
use super::nodal_sums;
use crate::contact::TouchedPoint;

/// Functions of a box of four cells.
pub(super) const MOST_LISTED: usize = 18;
const STRIDE: usize = stride(MOST_LISTED);

/// Floats of the matrix.
pub(crate) const LOCAL_FLOATS: usize = 3 * MOST_LISTED * STRIDE;

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
                if function < MAX_FUNCTIONS && listed.place(function).is_none() {
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

    pub(super) fn functions(&self) -> &[u8] {
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
    /// Gathers the matrix in `room`. None if there are more functions than it is for.
    pub(super) fn gathered(
        room: &'a mut [f32],
        listed: &ListedFunctions,
        space: &CoarseSpace<'_>,
        matrices: &Matrices<'_>,
        [share, least]: [f32; 2],
    ) -> Option<Self> {
        let functions = listed.functions();
        let stride = stride(space.lattice.functions());
        let room = room.get_mut(..3 * functions.len() * STRIDE).filter(|_| functions.len() <= MOST_LISTED)?;
        room.fill(0.0);
        let fine = if space.refresh.fine_in_use { Some(&*matrices.fine_inverse) } else { None };
        for (three, &row) in room.chunks_exact_mut(3 * STRIDE).zip(functions) {
            let row = usize::from(row);
            for (to, axis) in three.chunks_exact_mut(STRIDE).zip(0..3) {
                let from = (3 * row + axis) * stride;
                let coarse = matrices.coarse_inverse.get(from..from + stride).unwrap_or_default();
                let fine = fine.and_then(|fine| fine.get(from..from + stride)).unwrap_or_default();
                for (to, &column) in to.as_chunks_mut::<3>().0.iter_mut().zip(functions) {
                    let column = usize::from(column);
                    let three = |row: &[f32]| {
                        row.get(3 * column..).and_then(<[f32]>::first_chunk::<3>).copied().unwrap_or_default()
                    };
                    let (coarse, fine) = (three(coarse), three(fine));
                    for ((to, coarse), fine) in to.iter_mut().zip(coarse).zip(fine) {
                        *to = share * coarse - least * fine;
                    }
                    // In fast motion the bound of `G`, which is one matrix for each function.
                    if row == column
                        && !space.refresh.fine_in_use
                        && let Some(bound) = matrices.bound_inverse.get(row)
                    {
                        let unit = [0, 1, 2].map(|other| if other == axis { 1.0 } else { 0.0 });
                        for (to, bound) in to.iter_mut().zip(nodal_sums::times(bound, unit)) {
                            *to -= least * bound;
                        }
                    }
                }
            }
        }
        Some(Self { matrix: room })
    }

    /// Replaces the sums of the listed functions (kg m) by their motions (m), both in the world.
    pub(super) fn answer(&self, sums: &mut [Vec3; MOST_LISTED], listed: &ListedFunctions, space: &CoarseSpace<'_>) {
        let rotations = space.refresh.frames.of_functions();
        let rotation = |function: &u8| rotations.get(usize::from(*function));
        let (mut x, mut out): ([f32; 3 * MOST_LISTED], Row) = ([0.0; _], [0.0; _]);
        for ((x, sum), function) in x.as_chunks_mut::<3>().0.iter_mut().zip(&*sums).zip(listed.functions()) {
            *x = rotation(function).map_or([0.0; 3], |rotation| rotation.in_frame(sum.to_array()));
        }
        apply(self.matrix, STRIDE, &x, &mut out);
        for ((sum, out), function) in sums.iter_mut().zip(out.as_chunks::<3>().0).zip(listed.functions()) {
            *sum = rotation(function).map_or(Vec3::ZERO, |rotation| rotation.in_world(*out).into());
        }
    }
}
