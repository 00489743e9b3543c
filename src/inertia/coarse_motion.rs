//! The motion of the lattice in a step, from the cells' sums of the residual (kg m) and the matrices in use
//! ([`super`]); and its answer to further forces, as those of instruments (`contact.rs`).

use glam::{Vec3, Vec4};

use super::band::{Row, solve, solve_part};
use super::lattice::{CoarseVectors, Lattice};
use super::matrices::Matrices;
use super::renewal::Renewal;
use super::supports::Pull;
use super::transport::turned_part;
use super::{LARGEST_KEPT, LEAST_DRAG};
use crate::simd::NodeVector;

/// Share of the strain rates that a step removes where only this share of the kinetic energy can have come from the
/// loads, or only this share of the lattice's motion is used.
pub(super) fn removed_share(share: f32) -> f32 {
    1.0 - libm::sqrtf(share)
}

/// Scalar product of two motions of the lattice.
pub(super) fn inner(a: &CoarseVectors, b: &CoarseVectors) -> f32 {
    a.iter().zip(b).map(|(a, b)| Vec4::from(a.0).dot(Vec4::from(b.0))).sum()
}

/// The lattice with its matrices.
#[derive(Clone, Copy)]
pub(super) struct CoarseSpace<'a, 'm> {
    pub(super) lattice: &'a Lattice,
    pub(super) renewal: &'a Renewal,
    pub(super) matrices: &'a Matrices<'m>,
}

impl CoarseSpace<'_, '_> {
    /// Replaces `g` by `S^-1 g`.
    #[inline(never)]
    pub(super) fn solve(&self, forces: &mut CoarseVectors) {
        let mut row: Row = [0.0; _];
        self.write_components(forces, &mut row);
        solve(&self.renewal.bands.vectors, self.matrices.factor, &mut [&mut row]);
        self.write_vectors(&row, forces);
    }

    /// The same for two.
    #[inline(never)]
    fn solve_both(&self, [first, second]: [&mut CoarseVectors; 2]) {
        let (mut a, mut b): (Row, Row) = ([0.0; _], [0.0; _]);
        self.write_components(first, &mut a);
        self.write_components(second, &mut b);
        solve(&self.renewal.bands.vectors, self.matrices.factor, &mut [&mut a, &mut b]);
        self.write_vectors(&a, first);
        self.write_vectors(&b, second);
    }

    /// Calls with each axis and function of a list, and the motion of that function by a unit vector (kg m) of another one along
    /// the axis: entries of `S^-1`, 1/kg.
    #[inline(never)]
    pub(super) fn response(&self, of: usize, functions: &[u8], mut with: impl FnMut(usize, usize, Vec3)) {
        let rotations = &self.matrices.frames;
        let unit = rotations.since_stiffness(of).transpose();
        let mut rows: [Row; 3] = [[0.0; _]; 3];
        for (row, column) in rows.iter_mut().zip([unit.x_axis, unit.y_axis, unit.z_axis]) {
            if let Some(place) = row.as_chunks_mut::<3>().0.get_mut(of) {
                *place = column.to_array();
            }
        }
        let least = functions.iter().copied().min().unwrap_or_default();
        let [x, y, z] = &mut rows;
        let part = [3 * of, 3 * usize::from(least)];
        solve_part(&self.renewal.bands.vectors, self.matrices.factor, &mut [x, y, z], part);
        for (axis, row) in rows.iter().enumerate() {
            for (place, &function) in functions.iter().enumerate() {
                let three = row.as_chunks::<3>().0.get(usize::from(function)).copied().unwrap_or_default();
                with(axis, place, rotations.since_stiffness(function.into()) * Vec3::from(three));
            }
        }
    }

    /// Components in the frames in which `S` was computed, three for each function. Folds the vectors.
    fn write_components(&self, vectors: &mut CoarseVectors, components: &mut Row) {
        self.lattice.fold(vectors);
        let functions = self.lattice.functions();
        let rows = components.as_chunks_mut::<3>().0.iter_mut().zip(&*vectors);
        for (function, (three, vector)) in rows.enumerate().take(functions) {
            let turned = self.matrices.frames.since_stiffness(function).transpose() * Vec3::from(vector.to_array());
            *three = turned.to_array();
        }
    }

    /// Vectors in the world from such components, and those of light points.
    fn write_vectors(&self, components: &Row, vectors: &mut CoarseVectors) {
        vectors.fill(NodeVector::ZERO);
        let functions = self.lattice.functions();
        for (function, (vector, three)) in
            vectors.iter_mut().zip(components.as_chunks::<3>().0).enumerate().take(functions)
        {
            let turned = self.matrices.frames.since_stiffness(function) * Vec3::from(*three);
            *vector = NodeVector(turned.extend(0.0).to_array());
        }
        self.lattice.expand(vectors);
    }

    /// Writes `((1 + k) Mc + E) x`.
    pub(super) fn multiply_by_inertia(&self, x: &CoarseVectors, out: &mut CoarseVectors) {
        self.matrices.times_inertia(self.lattice, x, out);
    }
}

/// The motion of the lattice in a step.
pub(super) struct CoarseMotion<'a, 'm> {
    pub(super) space: CoarseSpace<'a, 'm>,
    /// Whether its part of the last increments is known.
    pub(super) has_part: bool,
    /// Supports whose speed changes (`supports.rs`).
    pub(super) supports: Option<&'a Pull<'a>>,
    /// The share of the kinetic energy that can have come from the loads.
    pub(super) allowed: f32,
    /// Largest strain of a cell by which the forces of the step may move it from rest.
    pub(super) largest_strain: f32,
}

/// How the lattice moves.
pub(super) struct MotionResult {
    /// Share of the motion that is used.
    pub(super) share: f32,
    /// Work of the supports on the lattice, times `D^2`: kg m^2.
    pub(super) work: f32,
}

/// Replaces `b` by `a - b`.
fn subtract_from(a: &CoarseVectors, b: &mut CoarseVectors) {
    for (b, a) in b.iter_mut().zip(a) {
        b.0 = (Vec4::from(a.0) - Vec4::from(b.0)).to_array();
    }
}

/// Adds a multiple of other vectors.
fn add(vectors: &mut CoarseVectors, factor: f32, others: &CoarseVectors) {
    for (vector, other) in vectors.iter_mut().zip(others) {
        vector.0 = (Vec4::from(vector.0) + factor * Vec4::from(other.0)).to_array();
    }
}

impl CoarseMotion<'_, '_> {
    /// Replaces the residual `g = W^T r` by the lattice's motion, and the lattice's part of the last increments by that of
    /// the next ones:
    ///
    /// ```text
    /// share S^-1 (g - M w) + p + w - (removed T + drag T^2) c        M = (1 + k) Mc + E,  T = S^-1 A = 1 - S^-1 M
    /// ```
    /// with the rotation `w` of the velocities (`transport.rs`), and `p = -S^-1 A_s d` from the supports. Reduces the
    /// share if the forces of one step would strain a cell by more than `largest_strain`, or the last increments strain it
    /// by more than [`LARGEST_KEPT`].
    pub(super) fn compute(
        &self,
        motion: &mut CoarseVectors,
        part: &mut CoarseVectors,
        [given, strained, other]: [&mut CoarseVectors; 3],
    ) -> MotionResult {
        let CoarseSpace { lattice, renewal, .. } = self.space;
        self.write_turned(part, given);
        if let Some(inertia) = renewal.free_inertia.filter(|_| !renewal.pulls.any) {
            self.add_translation(motion, inertia, given);
        }
        self.space.multiply_by_inertia(given, other);
        add(motion, -1.0, other);
        if !self.has_part {
            part.fill(NodeVector::ZERO);
        }
        // The momentum, then what of the last motion is kept.
        self.space.multiply_by_inertia(part, strained);
        if let Some(pull) = self.supports {
            self.add_pulled(pull, given, other);
            add(strained, 1.0, pull.of_last);
        }
        let kept = lattice.largest_strain(part, self.space.matrices.frames.since_rest());
        self.space.solve_both([motion, strained]);
        subtract_from(part, strained);
        let drag = renewal.drag();
        if drag > LEAST_DRAG {
            self.space.multiply_by_inertia(strained, other);
            self.space.solve(other);
            subtract_from(strained, other);
        } else {
            other.fill(NodeVector::ZERO);
        }
        let rotations = self.space.matrices.frames.since_rest();
        let strain = lattice.largest_strain(motion, rotations);
        let share = if strain > self.largest_strain { self.largest_strain / strain } else { 1.0 };
        let share = if kept > LARGEST_KEPT { share.min(LARGEST_KEPT / kept) } else { share };
        let removed = removed_share(share.min(self.allowed));
        for ((motion, given), (strained, twice)) in motion.iter_mut().zip(given).zip(strained.iter().zip(&*other)) {
            let [answer, given, strained, twice] =
                [*motion, *given, *strained, *twice].map(|vector| Vec4::from(vector.0));
            motion.0 = (share * answer + given - removed * strained - drag * twice).to_array();
        }
        add(part, 1.0, motion);
        let work = self.supports.map_or(0.0, |pull| pull.work(motion));
        MotionResult { share, work }
    }

    /// Adds the translation of a free body: rounding in `S` is of no consequence for it.
    fn add_translation(&self, forces: &CoarseVectors, inertia: f32, motion: &mut CoarseVectors) {
        let CoarseSpace { lattice, .. } = self.space;
        let moving = forces.iter().enumerate().filter(|(number, _)| lattice.moves(*number));
        let sum: Vec4 = moving.map(|(_, force)| Vec4::from(force.0)).sum();
        for (_, vector) in motion.iter_mut().enumerate().filter(|(number, _)| lattice.moves(*number)) {
            let [x, y, z, _] = (Vec4::from(vector.0) + sum / inertia).to_array();
            vector.0 = [x, y, z, 0.0];
        }
    }

    /// Writes `w`; zero without `c`.
    #[inline(never)]
    fn write_turned(&self, part: &CoarseVectors, turned: &mut CoarseVectors) {
        let CoarseSpace { lattice, renewal, matrices } = self.space;
        *turned = if self.has_part {
            turned_part(part, lattice, &matrices.frames, &renewal.bands.scalars, matrices.edge_factor)
        } else {
            [NodeVector::ZERO; _]
        };
    }

    /// Adds `p`, as far as its energy allows.
    #[inline(never)]
    fn add_pulled(&self, pull: &Pull<'_>, motion: &mut CoarseVectors, answer: &mut CoarseVectors) {
        *answer = *pull.residual;
        self.space.solve(answer);
        let energy = inner(pull.residual, answer);
        let share = if energy > pull.energy { pull.energy / energy } else { 1.0 };
        add(motion, share, answer);
    }
}
