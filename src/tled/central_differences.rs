//! Central differences for the nodes, vectorised: the next increments, what they enter in the energy balance, the
//! moves.

use bytemuck::{Pod, must_cast_slice, must_cast_slice_mut};

use crate::copy::copy;
use crate::element::NodeInertia;
use crate::simd::{Kernel, NodeVector, Real, axes, dispatch};
use crate::step::{Moving, Step, Sums, Totals, moved};

/// The next increment of a node; held axes stand still.
#[inline(always)]
pub(crate) fn next_increment(
    inertia: &NodeInertia,
    increment: &NodeVector,
    force: &NodeVector,
    step: &Step,
) -> [f32; 4] {
    let coefficients = Coefficients::<f32>::new(step);
    let mut next = [0.0; 4];
    for (axis, inverse) in inertia.inverse.into_iter().enumerate() {
        next[axis] = coefficients.next(inverse, increment.0[axis], force.0[axis]);
    }
    next
}

/// Components of four nodes.
const FOUR: usize = 16;
type Four = [f32; FOUR];

/// The components of the nodes, four nodes at a time, and those of the rest with zeros.
#[inline(always)]
fn fours<T: Pod>(of: &[T]) -> (&[Four], Four) {
    let (whole, rest) = must_cast_slice::<T, f32>(of).as_chunks();
    let mut last = [0.0; FOUR];
    copy(&mut last, rest);
    (whole, last)
}

/// The same, and the rest to write to.
#[inline(always)]
fn fours_mut(of: &mut [NodeVector]) -> (&mut [Four], Four, &mut [f32]) {
    let (whole, rest) = must_cast_slice_mut::<NodeVector, f32>(of).as_chunks_mut();
    let mut last = [0.0; FOUR];
    copy(&mut last, rest);
    (whole, last, rest)
}

/// One vector of the components of four nodes.
#[inline(always)]
fn vector_of<R: Real>(components: &[f32; FOUR], from: usize) -> R {
    R::from_fn(|lane| components[(from + lane) % FOUR])
}

/// The coefficients of the exact step, vectorised.
struct Coefficients<R> {
    keep: R,
    carry: R,
    push: R,
}

impl<R: Real> Coefficients<R> {
    #[inline(always)]
    fn new(step: &Step) -> Self {
        Self { keep: R::splat(step.keep()), carry: R::splat(step.carry()), push: R::splat(step.push()) }
    }

    /// The next increment of axes with these inverse masses; held axes stand still.
    #[inline(always)]
    fn next(&self, inverse: R, increment: R, force: R) -> R {
        let next = self.keep * (self.carry * increment) + self.push * (inverse * force);
        inverse.choose(next, R::splat(0.0))
    }
}

/// Sums over the nodes of an exact step, and the farthest that one moves if there are instruments.
pub(super) struct EnergyInput<'a> {
    pub(super) step: &'a Step,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) increment: &'a [NodeVector],
    pub(super) force: &'a [NodeVector],
}

impl EnergyInput<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn total(self, instruments: bool) -> Totals {
        if instruments { dispatch(TotalsKernel::<true>(self)) } else { dispatch(TotalsKernel::<false>(self)) }
    }
}

struct TotalsKernel<'a, const INSTRUMENTS: bool>(EnergyInput<'a>);

impl<const INSTRUMENTS: bool> Kernel for TotalsKernel<'_, INSTRUMENTS> {
    type Output = Totals;

    #[inline(always)]
    fn run<R: Real>(self) -> Totals {
        let EnergyInput { step, inertia, increment, force } = self.0;
        let mut sums = NodeSums::<R, INSTRUMENTS>::new(step);
        let (whole_inertia, inertia) = fours(inertia);
        let (whole_increment, increment) = fours(increment);
        let (whole_force, force) = fours(force);
        for ((inertia, increment), force) in whole_inertia.iter().zip(whole_increment).zip(whole_force) {
            sums.add(inertia, increment, force);
        }
        sums.add(&inertia, &increment, &force);
        let NodeSums { sums, farthest, .. } = sums;
        let mut totals = Totals::default();
        for (sums, from) in sums.iter().zip((0..FOUR).step_by(R::COUNT)) {
            totals.add_interleaved(sums, from);
        }
        if INSTRUMENTS {
            totals.farthest = farthest.map(|most| (0..R::COUNT).fold(0.0, |all, lane| most.lane(lane).max(all)));
        }
        totals
    }
}

/// The sums over the nodes, vectorised.
struct NodeSums<R, const INSTRUMENTS: bool> {
    coefficients: Coefficients<R>,
    /// Sixteen sums whatever the width, so that their bits are the same.
    sums: [Sums<R>; 4],
    farthest: [R; 2],
}

impl<R: Real, const INSTRUMENTS: bool> NodeSums<R, INSTRUMENTS> {
    #[inline(always)]
    fn new(step: &Step) -> Self {
        let (sums, farthest) = ([Sums::new(step, R::splat); 4], [R::splat(0.0); 2]);
        Self { coefficients: Coefficients::new(step), sums, farthest }
    }

    /// Adds four nodes.
    #[inline(always)]
    fn add(&mut self, inertia: &Four, increment: &Four, force: &Four) {
        for (sums, from) in self.sums.iter_mut().zip((0..FOUR).step_by(R::COUNT)) {
            let inverse = axes::<R>() * vector_of::<R>(inertia, from);
            let mass = R::from_fn(|lane| inertia[((from + lane) | 3) % FOUR]);
            let (increment, force) = (vector_of::<R>(increment, from), vector_of::<R>(force, from));
            let next = self.coefficients.next(inverse, increment, force);
            sums.add(mass, inverse.positive(), increment, force, next);
            if INSTRUMENTS {
                for (most, moved) in self.farthest.iter_mut().zip([increment, next]) {
                    *most = (axes::<R>() * moved).abs().max(*most);
                }
            }
        }
    }
}

/// Moves the nodes by an exact step.
pub(super) struct Advance<'a> {
    pub(super) step: &'a Step,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) moving: Moving<'a>,
    pub(super) force: &'a [NodeVector],
}

impl Advance<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn advance(self) {
        dispatch(self);
    }
}

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Real>(self) {
        let Self { step, inertia, moving: Moving { displacement, remainder, increment }, force } = self;
        let coefficients = Coefficients::<R>::new(step);
        let (whole_inertia, inertia) = fours(inertia);
        let (whole_force, force) = fours(force);
        let (whole_at, mut at, at_rest) = fours_mut(displacement);
        let (whole_left, mut left, left_rest) = fours_mut(remainder);
        let (whole_last, mut last, last_rest) = fours_mut(increment);
        let moving = whole_at.iter_mut().zip(whole_left).zip(whole_last);
        for (((at, left), last), (inertia, force)) in moving.zip(whole_inertia.iter().zip(whole_force)) {
            advance_four(&coefficients, (inertia, force), [at, left, last]);
        }
        advance_four(&coefficients, (&inertia, &force), [&mut at, &mut left, &mut last]);
        copy(at_rest, &at);
        copy(left_rest, &left);
        copy(last_rest, &last);
    }
}

/// Moves four nodes: their displacements, the remainders of these, and their increments.
#[inline(always)]
fn advance_four<R: Real>(
    coefficients: &Coefficients<R>,
    (inertia, force): (&Four, &Four),
    [at, left, last]: [&mut Four; 3],
) {
    for from in (0..FOUR).step_by(R::COUNT) {
        let inverse = axes::<R>() * vector_of::<R>(inertia, from);
        let next = coefficients.next(inverse, vector_of(last, from), vector_of(force, from));
        let [here, rest] = moved(vector_of::<R>(at, from), vector_of(left, from), next);
        for lane in 0..R::COUNT {
            last[(from + lane) % FOUR] = next.lane(lane);
            at[(from + lane) % FOUR] = here.lane(lane);
            left[(from + lane) % FOUR] = rest.lane(lane);
        }
    }
}
