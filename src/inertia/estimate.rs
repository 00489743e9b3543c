//! How far off the motion is because of the inertia that was added. What the scaling absorbs of a node's force,
//! `d = f - mu m v - m a`, drives the error: `M e'' + mu M e' + K e = d` to first order. It is followed along one
//! shape, the displacement `u`, with the stiffness of its secant: `e = x u / rms(u)`,
//!
//! ```text
//! x'' + mu x' + (-u.f_int / u.M u) x = rms(u) (u.d) / (u.M u)
//! ```
//! The velocity would be a worse shape: its short waves are far stiffer than the error's.
//! Work over all nodes, supports as well, so that a support that moves the body bears its stiffness.

use bytemuck::must_cast_slice;

use super::node::Scaling;
use crate::lanes::{Kernel, NodeVector, Real, dispatch};
use crate::tled::{Side, Step};

/// The error across the displacement is about as large again as that along it: over the laboratory's scenes,
/// methods and steps the median of `x` over the mean error of the nodes is a half.
const ACROSS: f32 = 2.0;

/// The error along the displacement, root mean square over the nodes, m: now and a step ago.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    now: f32,
    before: f32,
}

/// Sum over the nodes in a fixed order, whatever the instruction set.
pub(super) fn dot(a: &[NodeVector], b: &[NodeVector]) -> f32 {
    dispatch(Dot { a: must_cast_slice(a), b: must_cast_slice(b) })
}

struct Dot<'a> {
    a: &'a [f32],
    b: &'a [f32],
}

impl Kernel for Dot<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<R: Real>(self) -> f32 {
        // Several sums: each addition waits for the one before.
        let mut sums = [R::splat(0.0); 8];
        let (vectors, rest) = self.a.as_chunks::<WIDTH>();
        let (others, other_rest) = self.b.as_chunks::<WIDTH>();
        for (a, b) in vectors.iter().zip(others) {
            for (sum, from) in sums.iter_mut().zip((0..WIDTH).step_by(R::COUNT)) {
                let of = |numbers: &[f32; WIDTH]| R::from_fn(|lane| numbers[(from + lane) % WIDTH]);
                *sum = *sum + of(a) * of(b);
            }
        }
        // The fourth numbers of a node's vectors mean something else.
        let mut total = 0.0;
        for lane in (0..WIDTH).filter(|lane| lane % 4 < 3) {
            total += sums[lane / R::COUNT % 8].lane(lane % R::COUNT);
        }
        for (at, (a, b)) in rest.iter().zip(other_rest).enumerate() {
            total += if at % 4 < 3 { a * b } else { 0.0 };
        }
        total
    }
}

/// Numbers whose products are summed side by side.
const WIDTH: usize = 64;

/// Sums over the nodes of a step, before its displacement changes.
#[derive(Clone, Copy)]
pub(super) struct Defect<V> {
    square: V,
    /// `1 + k`, and `1 - k` times what carries increments over from another step.
    ahead: V,
    behind: V,
    defect: V,
    mass: V,
    length: V,
    total: V,
}

impl<V: Side> Defect<V> {
    /// Nothing yet; `splat` repeats a number.
    #[inline(always)]
    pub(super) fn new(step: &Step, scaling: &Scaling, splat: impl Fn(f32) -> V) -> Self {
        let k = scaling.k;
        let numbers = [step.seconds() * step.seconds(), 1.0 + k, (1.0 - k) * step.carry(), 0.0];
        let [square, ahead, behind, zero] = numbers.map(splat);
        Self { square, ahead, behind, defect: zero, mass: zero, length: zero, total: zero }
    }

    /// The sums of one lane.
    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> Defect<f32>
    where
        V: Real,
    {
        Defect {
            square: self.square.lane(lane),
            ahead: self.ahead.lane(lane),
            behind: self.behind.lane(lane),
            defect: self.defect.lane(lane),
            mass: self.mass.lane(lane),
            length: self.length.lane(lane),
            total: self.total.lane(lane),
        }
    }

    /// Adds nodes: masses, ones along free axes, displacements, their increments, total forces and next increments.
    #[inline(always)]
    pub(super) fn add(&mut self, mass: V, free: V, u: V, increment: V, force: V, next: V) {
        // D^2 d = D^2 f - k m (du+ + du) - m (du+ - du).
        let taken = mass * (self.ahead * next - self.behind * increment);
        let along = free * u;
        self.defect = self.defect + along * (self.square * force - taken);
        self.mass = self.mass + along * (mass * u);
        self.length = self.length + u * u;
        self.total = self.total + u * force;
    }
}

/// What [`Defect`] comes to.
#[derive(Clone, Copy, Default)]
pub(super) struct Defects {
    defect: f32,
    mass: f32,
    length: f32,
    total: f32,
}

impl Defects {
    /// Adds the sums of each axis.
    pub(super) fn add_axes(&mut self, sums: &[Defect<f32>; 3]) {
        for sums in sums {
            self.defect += sums.defect;
            self.mass += sums.mass;
            self.length += sums.length;
            self.total += sums.total;
        }
    }
}

impl Estimate {
    pub(super) const NONE: Self = Self { now: 0.0, before: 0.0 };

    /// The error, m.
    pub(super) fn error(&self) -> f32 {
        ACROSS * if self.now < 0.0 { -self.now } else { self.now }
    }

    /// One step of `D^2 = square` on. `external` is displacement times external force, J.
    pub(super) fn advance(&mut self, of: &Defects, external: f32, nodes: usize, k: f32, square: f32) {
        if of.mass <= 0.0 {
            return;
        }
        // Implicit: whatever the stiffness, the estimate does not ring.
        let internal = external - of.total;
        let stiffness = if internal > 0.0 { square * internal / of.mass } else { 0.0 };
        let push = libm::sqrtf(of.length / nodes as f32) * of.defect / of.mass;
        let next = (push + 2.0 * self.now - (1.0 - k) * self.before) / (1.0 + k + stiffness);
        *self = Self { now: next, before: self.now };
    }
}
