//! The motion of the lattice in a step, from the cells' sums of the residual (kg m) and the matrices in use
//! ([`super`]); and its answer to further forces, as those of instruments (`contact.rs`).

use glam::{Vec3, Vec4};

use super::LEAST_DRAG;
use super::band::{Row, solve};
use super::lattice::{CoarseVectors, Lattice};
use super::matrices::Matrices;
use super::renewal::Renewal;
use super::supports::Pull;
use super::transport::turned_part;
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
    /// `S^-1 g`.
    pub(super) fn solved(&self, forces: &CoarseVectors) -> CoarseVectors {
        let mut row = self.in_frames(forces);
        solve(&self.renewal.bands.vectors, self.matrices.factor, [&mut row]);
        self.in_world(&row)
    }

    /// The same for two.
    fn both_solved(&self, forces: [&CoarseVectors; 2]) -> [CoarseVectors; 2] {
        let [mut a, mut b]: [Row; 2] = forces.map(|forces| self.in_frames(forces));
        solve(&self.renewal.bands.vectors, self.matrices.factor, [&mut a, &mut b]);
        [a, b].map(|row| self.in_world(&row))
    }

    /// Components in the frames in which `S` was computed, three for each function.
    fn in_frames(&self, vectors: &CoarseVectors) -> Row {
        let (mut vectors, mut components): (_, Row) = (*vectors, [0.0; _]);
        self.lattice.fold(&mut vectors);
        let functions = self.lattice.functions();
        let rows = components.as_chunks_mut::<3>().0.iter_mut().zip(&vectors);
        for (function, (three, vector)) in rows.enumerate().take(functions) {
            let turned = self.renewal.frames.since_stiffness(function).transpose() * Vec3::from(vector.to_array());
            *three = turned.to_array();
        }
        components
    }

    /// Vectors in the world from such components, and those of light points.
    fn in_world(&self, components: &Row) -> CoarseVectors {
        let mut vectors = [NodeVector::ZERO; _];
        let functions = self.lattice.functions();
        for (function, (vector, three)) in
            vectors.iter_mut().zip(components.as_chunks::<3>().0).enumerate().take(functions)
        {
            let turned = self.renewal.frames.since_stiffness(function) * Vec3::from(*three);
            *vector = NodeVector(turned.extend(0.0).to_array());
        }
        self.lattice.expand(&mut vectors);
        vectors
    }

    /// `((1 + k) Mc + E) x`.
    fn times_inertia(&self, x: &CoarseVectors) -> CoarseVectors {
        self.matrices.times_inertia(self.lattice, x)
    }
}

/// The motion of the lattice in a step.
pub(super) struct CoarseMotion<'a, 'm> {
    pub(super) space: CoarseSpace<'a, 'm>,
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
    pub(super) motion: CoarseVectors,
    /// Share of the motion that is used.
    pub(super) share: f32,
    /// Its part of the next increments.
    pub(super) next: CoarseVectors,
    /// Work of the supports on the lattice, times `D^2`: kg m^2.
    pub(super) work: f32,
}

/// `a - b`.
fn minus(a: &CoarseVectors, b: &CoarseVectors) -> CoarseVectors {
    let mut difference = *a;
    for (a, b) in difference.iter_mut().zip(b) {
        a.0 = (Vec4::from(a.0) - Vec4::from(b.0)).to_array();
    }
    difference
}

/// Adds a multiple of other vectors.
fn add(vectors: &mut CoarseVectors, factor: f32, others: &CoarseVectors) {
    for (vector, other) in vectors.iter_mut().zip(others) {
        vector.0 = (Vec4::from(vector.0) + factor * Vec4::from(other.0)).to_array();
    }
}

impl CoarseMotion<'_, '_> {
    /// The lattice's motion from the residual `g = W^T r`:
    ///
    /// ```text
    /// share S^-1 (g - M w) + p + w - (removed T + drag T^2) c        M = (1 + k) Mc + E,  T = S^-1 A = 1 - S^-1 M
    /// ```
    /// with the rotation `w` of the velocities (`transport.rs`), and `p = -S^-1 A_s d` from the supports. Reduces the
    /// share if the forces of one step would strain a cell by more than `largest_strain`.
    pub(super) fn compute(&self, forces: &CoarseVectors) -> MotionResult {
        let CoarseSpace { lattice, renewal, .. } = self.space;
        let mut given = self.turned();
        if let Some(inertia) = renewal.free_inertia {
            self.add_translation(forces, inertia, &mut given);
        }
        let forces = minus(forces, &self.space.times_inertia(&given));
        let last = self.smooth.copied().unwrap_or([NodeVector::ZERO; _]);
        let mut momentum = self.space.times_inertia(&last);
        if let Some(pull) = self.supports {
            self.add_pulled(pull, &mut given);
            add(&mut momentum, 1.0, &pull.of_last);
        }
        let [mut solution, kept] = self.space.both_solved([&forces, &momentum]);
        let (strained, drag) = (minus(&last, &kept), renewal.drag());
        let twice = if drag > LEAST_DRAG {
            minus(&strained, &self.space.solved(&self.space.times_inertia(&strained)))
        } else {
            [NodeVector::ZERO; _]
        };
        let rotations = renewal.frames.since_rest();
        let strain = lattice.largest_strain(&solution, rotations);
        let share = if strain > self.largest_strain { self.largest_strain / strain } else { 1.0 };
        let removed = removed_share(share.min(self.allowed));
        for ((solution, given), (strained, twice)) in solution.iter_mut().zip(&given).zip(strained.iter().zip(&twice)) {
            let [answer, given, strained, twice] =
                [*solution, *given, *strained, *twice].map(|vector| Vec4::from(vector.0));
            solution.0 = (share * answer + given - removed * strained - drag * twice).to_array();
        }
        let mut next = solution;
        add(&mut next, 1.0, &last);
        let work = self.supports.map_or(0.0, |pull| pull.work(&solution));
        MotionResult { motion: solution, share, next, work }
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

    /// `w`; zero without `c`.
    #[inline(never)]
    fn turned(&self) -> CoarseVectors {
        let CoarseSpace { lattice, renewal, matrices } = self.space;
        match self.smooth {
            Some(smooth) => turned_part(smooth, lattice, &renewal.frames, &renewal.bands.scalars, matrices.edge_factor),
            None => [NodeVector::ZERO; _],
        }
    }

    /// Adds `p`, as far as its energy allows.
    #[inline(never)]
    fn add_pulled(&self, pull: &Pull, motion: &mut CoarseVectors) {
        let answer = self.space.solved(&pull.residual);
        let energy = inner(&pull.residual, &answer);
        let share = if energy > pull.energy { pull.energy / energy } else { 1.0 };
        add(motion, share, &answer);
    }
}
