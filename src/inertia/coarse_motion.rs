//! The motion of the lattice in a step, from the cells' sums of the residual (kg m) and the matrices in use
//! ([`super`]); and its answer to further forces, as those of instruments (`contact.rs`).

use glam::Vec4;

use super::cells::{prolong, restrict};
use super::dense::{Row, apply, apply_by_axis, apply_functions, apply_to_two, from_components, stride, to_components};
use super::frames::{Rotation, rotate};
use super::lattice::{CoarseVectors, Lattice, MAX_FUNCTIONS};
use super::matrices::{Matrices, of_axes};
use super::nodal_sums;
use super::refresh::Refresh;
use super::supports::Pull;
use super::transport::turned_part;
use crate::simd::NodeVector;

/// Share of the strain rates that a step removes where only this share of the lattice's motion is used. There inertia
/// is about to grow by the inverse of the share; what is left has no more energy with the new inertia than it had
/// before.
pub(super) fn removed_share(share: f32) -> f32 {
    1.0 - libm::sqrtf(share)
}

/// Scalar product of two motions of the lattice.
fn inner(a: &CoarseVectors, b: &CoarseVectors) -> f32 {
    a.iter().zip(b).map(|(a, b)| Vec4::from(a.0).dot(Vec4::from(b.0))).sum()
}

/// The lattice with the frames of its functions, in which the bounds are kept.
#[derive(Clone, Copy)]
pub(super) struct CoarseSpace<'a> {
    pub(super) lattice: &'a Lattice,
    pub(super) refresh: &'a Refresh,
}

impl CoarseSpace<'_> {
    /// `share S^-1 g - least G^-1 g`: the motion by further forces, of which `residual` are the sums, zero but for
    /// these functions.
    pub(super) fn response(
        &self,
        matrices: &Matrices<'_>,
        residual: &CoarseVectors,
        functions: &[u8],
        [share, least]: [f32; 2],
    ) -> CoarseVectors {
        let (forces, mut answer, mut fine) = (self.in_frames(residual), [0.0; _], [0.0; _]);
        let stride = stride(self.lattice.functions());
        apply_functions(matrices.coarse_inverse, stride, functions, &forces, &mut answer);
        if self.refresh.fine_in_use {
            apply_functions(matrices.fine_inverse, stride, functions, &forces, &mut fine);
        } else {
            bound_product(matrices, &forces, &mut fine);
        }
        for (answer, fine) in answer.iter_mut().zip(fine) {
            *answer = share * *answer - least * fine;
        }
        self.in_world(&answer)
    }

    /// Components in the frames of the bounds.
    #[inline(never)]
    fn in_frames(&self, vectors: &CoarseVectors) -> Row {
        let mut vectors = *vectors;
        rotate(&mut vectors, self.refresh.frames.of_functions(), Rotation::in_frame);
        to_components(&vectors)
    }

    /// `G^-1 g`, in fast motion with the bound of `G`.
    #[inline(never)]
    fn fine(&self, matrices: &Matrices<'_>, forces: &Row) -> CoarseVectors {
        let mut moved: Row = [0.0; _];
        if self.refresh.fine_in_use {
            self.times(matrices.fine_inverse, forces, &mut moved);
            return self.in_world(&moved);
        }
        bound_product(matrices, forces, &mut moved);
        self.in_world(&moved)
    }

    fn times(&self, matrix: &[f32], row: &Row, out: &mut Row) {
        apply(matrix, stride(self.lattice.functions()), self.used(row), out);
    }

    /// The components of functions.
    fn used<'a>(&self, row: &'a Row) -> &'a [f32] {
        row.get(..3 * self.lattice.functions()).unwrap_or_default()
    }

    /// Vectors in the world from components in the frames of the bounds.
    fn in_world(&self, components: &Row) -> CoarseVectors {
        let mut vectors = [NodeVector::ZERO; MAX_FUNCTIONS + 1];
        from_components(self.used(components), &mut vectors);
        rotate(&mut vectors, self.refresh.frames.of_functions(), Rotation::in_world);
        vectors
    }
}

/// The product with the inverse of the bound of `G`.
fn bound_product(matrices: &Matrices<'_>, forces: &Row, moved: &mut Row) {
    let vectors = moved.as_chunks_mut::<3>().0.iter_mut().zip(forces.as_chunks::<3>().0);
    for ((moved, force), inverse) in vectors.zip(&*matrices.bound_inverse) {
        *moved = nodal_sums::times(inverse, *force);
    }
}

/// The motion of the lattice in a step.
pub(super) struct CoarseMotion<'a> {
    pub(super) space: CoarseSpace<'a>,
    /// A damped step uses the second-order operator instead of `S^-1` (`damper.rs`).
    pub(super) second_order: bool,
    /// `mu D / 2`.
    pub(super) k: f32,
    /// The least share of a node: with it the operator is positive whatever the shares of the others are.
    pub(super) least_share: f32,
    /// The lattice's part of the last increment.
    pub(super) smooth: Option<&'a CoarseVectors>,
    /// Supports whose speed changes (`supports.rs`).
    pub(super) supports: Option<&'a Pull>,
    /// The share of the kinetic energy that can have come from the loads.
    pub(super) allowed: f32,
    /// Largest strain of a cell by which the forces of the step may move it from rest.
    pub(super) largest_strain: f32,
}

/// How the lattice moves.
pub(super) struct MotionResult {
    /// Share of the motion that is used.
    pub(super) share: f32,
    /// By how much the step changes the lattice's shape.
    pub(super) change: f32,
    /// Work of the supports on the lattice, times `D^2`: kg m^2.
    pub(super) work: f32,
}

impl CoarseMotion<'_> {
    /// Turns the cells' sums of the residual `r` into the lattice's motion and what the nodes' own inertia would give
    /// to it, `G^-1 g` with `g = W^T r`. The motion is
    ///
    /// ```text
    /// share S^-1 (g - M w) + p + w - (removed T + drag T^2) c - least G^-1 g     M = (1 + k) Mc,  T = S^-1 A = 1 - S^-1 M
    /// ```
    /// with the rotation `w` of the velocities (`transport.rs`), and `p = -S^-1 A_s d` from the supports. Reduces the
    /// share if the forces of one step would strain a cell by more than `largest_strain`.
    pub(super) fn compute(&self, matrices: &mut Matrices<'_>, mut share: f32) -> MotionResult {
        let CoarseSpace { lattice, refresh } = self.space;
        let mut forces = self.forces(matrices);
        let fine = self.space.fine(matrices, &forces);
        let mut given = self.turned(matrices);
        let mut last = self.smooth.map_or([0.0; _], |smooth| self.space.in_frames(smooth));
        self.subtract_momentum(matrices, &mut forces, &given);
        let pulled = self.supports.map(|pull| self.add_pulled(matrices, pull, share, &mut given));
        let mut answer = [0.0; _];
        self.first_order(matrices, &forces, &mut answer, &mut last);
        let strained = self.space.in_world(&last);
        let twice = self.strained_twice(matrices, &mut last);
        if self.second_order {
            self.add_second_order(matrices, &mut forces, &mut answer);
        }
        let mut solution = self.space.in_world(&answer);
        let strain = lattice.largest_strain(&solution, refresh.frames.since_rest());
        if share * strain > self.largest_strain {
            share = self.largest_strain / strain;
        }
        let (removed, drag) = (removed_share(share.min(self.allowed)), refresh.drag());
        for (((solution, given), (strained, twice)), fine) in
            solution.iter_mut().zip(&given).zip(strained.iter().zip(&twice)).zip(&fine)
        {
            let [answer, given, strained, twice, fine] =
                [*solution, *given, *strained, *twice, *fine].map(|vector| Vec4::from(vector.0));
            let lost = removed * strained + drag * twice;
            solution.0 = (share * answer + given - lost - self.least_share * fine).to_array();
        }
        prolong(&solution, lattice, matrices.cells);
        prolong(&fine, lattice, matrices.fine_cells);
        for (next, last) in solution.iter_mut().zip(self.smooth.into_iter().flatten()) {
            next.0 = (Vec4::from(next.0) + Vec4::from(last.0)).to_array();
        }
        let strain = lattice.largest_strain(&solution, refresh.frames.since_rest());
        let change = strain + lattice.largest_bending(|function| refresh.frames.in_latest_step(function));
        let work = match (self.supports, pulled) {
            (Some(pull), Some(share)) => self.work(pull, share, &solution),
            _ => 0.0,
        };
        MotionResult { share, change, work }
    }

    // The parts of the above are not inlined: the stack of one is free in the others.

    /// `g` in the frames.
    #[inline(never)]
    fn forces(&self, matrices: &Matrices<'_>) -> Row {
        self.space.in_frames(&restrict(matrices.cells, self.space.lattice))
    }

    /// `w`; zero without `c`.
    #[inline(never)]
    fn turned(&self, matrices: &Matrices<'_>) -> CoarseVectors {
        let CoarseSpace { lattice, refresh } = self.space;
        match self.smooth {
            Some(smooth) => turned_part(smooth, lattice, &refresh.frames, matrices.edge_inverse),
            None => [NodeVector::ZERO; _],
        }
    }

    /// Subtracts `M w` from `g`.
    #[inline(never)]
    fn subtract_momentum(&self, matrices: &Matrices<'_>, forces: &mut Row, turned: &CoarseVectors) {
        let mut momentum = self.space.in_frames(turned);
        self.times_mass(matrices, &mut momentum);
        self.subtract(forces, &momentum);
    }

    /// Adds `p`, as far as bounds have not grown beyond their margin. Gives its share of `-S^-1 A_s d`.
    #[inline(never)]
    fn add_pulled(&self, matrices: &Matrices<'_>, pull: &Pull, mut share: f32, motion: &mut CoarseVectors) -> f32 {
        let mut answer = [0.0; _];
        self.space.times(matrices.coarse_inverse, &self.space.in_frames(&pull.residual), &mut answer);
        let answer = self.space.in_world(&answer);
        let energy = inner(&pull.residual, &answer);
        if energy > pull.energy {
            share = share.min(pull.energy / energy);
        }
        for (vector, answer) in motion.iter_mut().zip(&answer) {
            vector.0 = (Vec4::from(vector.0) + share * Vec4::from(answer.0)).to_array();
        }
        share
    }

    /// Work of this share of the supports' residual on the lattice, times `D^2`, from the lattice's part of the next
    /// increments.
    #[inline(never)]
    fn work(&self, pull: &Pull, share: f32, next: &CoarseVectors) -> f32 {
        let last = self.smooth.map_or(0.0, |smooth| inner(&pull.residual, smooth));
        0.5 * share * (inner(&pull.residual, next) + last)
    }

    /// Writes `S^-1 g`, and makes `T c` of `c`.
    #[inline(never)]
    fn first_order(&self, matrices: &Matrices<'_>, forces: &Row, answer: &mut Row, last: &mut Row) {
        let (mut momentum, mut kept) = (*last, [0.0; _]);
        self.times_mass(matrices, &mut momentum);
        let (stride, rows) =
            (stride(self.space.lattice.functions()), [forces, &momentum].map(|row| self.space.used(row)));
        apply_to_two(matrices.coarse_inverse, stride, rows, [answer, &mut kept]);
        self.subtract(last, &kept);
    }

    /// `T^2 c` in the world from `T c`, of which it makes `T^2 c` in the frames.
    #[inline(never)]
    fn strained_twice(&self, matrices: &Matrices<'_>, strained: &mut Row) -> CoarseVectors {
        let (mut momentum, mut kept) = (*strained, [0.0; _]);
        self.times_mass(matrices, &mut momentum);
        self.space.times(matrices.coarse_inverse, &momentum, &mut kept);
        self.subtract(strained, &kept);
        self.space.in_world(strained)
    }

    /// Makes the answer `S^-1 g` that of second order. What is left of `forces` is of no use.
    #[inline(never)]
    fn add_second_order(&self, matrices: &Matrices<'_>, forces: &mut Row, answer: &mut Row) {
        // `A S^-1 g` as `g - M S^-1 g`: where elements are crushed `A` is so large that products with it overflow.
        let mut passed = *answer;
        self.times_mass(matrices, &mut passed);
        self.subtract(forces, &passed);
        self.space.times(matrices.coarse_inverse, forces, &mut passed);
        self.times_mass(matrices, &mut passed);
        self.space.times(matrices.coarse_inverse, &passed, forces);
        for (answer, more) in answer.iter_mut().zip(forces) {
            *answer += *more;
        }
    }

    fn subtract(&self, row: &mut Row, other: &Row) {
        let used = 3 * self.space.lattice.functions();
        row.iter_mut().zip(other).take(used).for_each(|(component, other)| *component -= other);
    }

    /// Replaces a vector by `M` times it.
    fn times_mass(&self, matrices: &Matrices<'_>, row: &mut Row) {
        apply_by_axis(of_axes(matrices.mass), self.space.lattice.functions(), row);
        row.iter_mut().for_each(|component| *component *= 1.0 + self.k);
    }
}
