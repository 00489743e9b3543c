//! Central differences for the nodes, vectorised: the next increments, what they enter in the energy balance, the
//! moves.

use bytemuck::{Pod, must_cast_slice, must_cast_slice_mut};

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

/// The components of four nodes, zeros beyond the last node.
#[inline(always)]
fn four<T: Pod>(of: &[T], first: usize) -> [f32; FOUR] {
    let components: &[f32] = must_cast_slice(of);
    let components = components.get(4 * first..).unwrap_or_default();
    if let Some(four) = components.first_chunk() {
        return *four;
    }
    let mut four = [0.0; FOUR];
    for (to, from) in four.iter_mut().zip(components) {
        *to = *from;
    }
    four
}

/// Writes the components of four nodes, or of as many as there are.
#[inline(always)]
fn put(four: [f32; FOUR], into: &mut [NodeVector]) {
    let components: &mut [f32] = must_cast_slice_mut(into);
    if let Some(all) = components.first_chunk_mut() {
        *all = four;
        return;
    }
    for (to, from) in components.iter_mut().zip(four) {
        *to = from;
    }
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
        let coefficients = Coefficients::<R>::new(step);
        // Sixteen sums whatever the width, so that their bits are the same.
        let mut sums = [Sums::<R>::new(step, R::splat); 4];
        let mut farthest = [R::splat(0.0); 2];
        for first in (0..inertia.len()).step_by(4) {
            let (inertia, increment, force) = (four(inertia, first), four(increment, first), four(force, first));
            for (sums, from) in sums.iter_mut().zip((0..FOUR).step_by(R::COUNT)) {
                let inverse = axes::<R>() * vector_of::<R>(&inertia, from);
                let mass = R::from_fn(|lane| inertia[((from + lane) | 3) % FOUR]);
                let (increment, force) = (vector_of::<R>(&increment, from), vector_of::<R>(&force, from));
                let next = coefficients.next(inverse, increment, force);
                sums.add(mass, inverse.positive(), increment, force, next);
                if INSTRUMENTS {
                    for (most, moved) in farthest.iter_mut().zip([increment, next]) {
                        *most = (axes::<R>() * moved).abs().max(*most);
                    }
                }
            }
        }
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
        let moving = displacement.chunks_mut(4).zip(remainder.chunks_mut(4)).zip(increment.chunks_mut(4));
        for (((displacement, remainder), increment), first) in moving.zip((0..inertia.len()).step_by(4)) {
            let (inertia, force) = (four(inertia, first), four(force, first));
            let (mut at, mut left, mut last) = (four(displacement, 0), four(remainder, 0), four(increment, 0));
            for from in (0..FOUR).step_by(R::COUNT) {
                let inverse = axes::<R>() * vector_of::<R>(&inertia, from);
                let next = coefficients.next(inverse, vector_of(&last, from), vector_of(&force, from));
                let [here, rest] = moved(vector_of::<R>(&at, from), vector_of(&left, from), next);
                for lane in 0..R::COUNT {
                    last[(from + lane) % FOUR] = next.lane(lane);
                    at[(from + lane) % FOUR] = here.lane(lane);
                    left[(from + lane) % FOUR] = rest.lane(lane);
                }
            }
            put(at, displacement);
            put(left, remainder);
            put(last, increment);
        }
    }
}
