//! The increment of a node in one step, and what the step enters in the energy account
//! ([`crate::ledger`]): kinetic energy of the mean of the increments before and after `t_n`, and the work of
//! loads and supports along it, in joules.

use core::ops::{Add, Mul, Sub};

use bytemuck::{Pod, must_cast_slice, must_cast_slice_mut};

use crate::lanes::{Kernel, Real, axes, dispatch};
use crate::ledger::Ledger;
use crate::loads::{Loads, ramp_factor};
use crate::scene::NodeInertia;
use crate::state::NodeVector;

use super::{Cause, Step};

/// The next increment of a node; held axes stand still.
#[inline(always)]
pub(crate) fn next_increment(
    inertia: &NodeInertia,
    increment: &NodeVector,
    force: &NodeVector,
    step: &Step,
) -> [f32; 4] {
    let exact = Exact::<f32>::new(step);
    let mut next = [0.0; 4];
    for (axis, inverse) in inertia.inverse.into_iter().enumerate() {
        next[axis] = exact.next(inverse, increment.0[axis], force.0[axis]);
    }
    next
}

/// The next increment of a node from its number, inertia, last increment and force.
pub(crate) trait Next: Fn(usize, &NodeInertia, &NodeVector, &NodeVector) -> [f32; 4] {}

impl<F: Fn(usize, &NodeInertia, &NodeVector, &NodeVector) -> [f32; 4]> Next for F {}

/// The energies of one step ([`crate::ledger`]), J.
pub(crate) struct Entry {
    pub(crate) finite: bool,
    pub(crate) kinetic: f64,
    pub(crate) work: f64,
    /// How far the work of supports depends on what they did between two steps.
    pub(crate) jump: f64,
}

/// Numbers side by side: the axes of a node, or one axis of several nodes.
pub(crate) trait Side: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}

impl<V: Copy + Add<Output = V> + Sub<Output = V> + Mul<Output = V>> Side for V {}

/// Sums over the nodes.
#[derive(Clone, Copy)]
pub(crate) struct Sums<V> {
    one: V,
    half: V,
    carry: V,
    /// Mass times the square of the mean increment, kg m^2.
    kinetic: V,
    /// Mass times the way, kg m.
    momentum: V,
    /// Force times the way of what supports lead, N m.
    led: V,
}

impl<V: Side> Sums<V> {
    /// Nothing yet; `splat` repeats a number.
    #[inline(always)]
    pub(crate) fn new(step: &Step, splat: impl Fn(f32) -> V) -> Self {
        let zero = splat(0.0);
        let [one, half, carry] = [1.0, 0.5, step.carry].map(splat);
        Self { one, half, carry, kinetic: zero, momentum: zero, led: zero }
    }

    /// The sums of one lane.
    #[inline(always)]
    pub(crate) fn at(&self, lane: usize) -> Sums<f32>
    where
        V: Real,
    {
        Sums {
            one: self.one.lane(lane),
            half: self.half.lane(lane),
            carry: self.carry.lane(lane),
            kinetic: self.kinetic.lane(lane),
            momentum: self.momentum.lane(lane),
            led: self.led.lane(lane),
        }
    }

    /// Adds nodes: masses, ones along free axes, increments, total forces and next increments.
    #[inline(always)]
    pub(crate) fn add(&mut self, mass: V, free: V, increment: V, force: V, next: V) {
        // A held axis has no inertia of its own: what moves it is counted as work.
        let moving = free * (self.half * (next + self.carry * increment));
        let led = (self.one - free) * increment;
        self.kinetic = self.kinetic + mass * (moving * moving);
        self.momentum = self.momentum + mass * (free * (self.half * (next + increment)) + led);
        self.led = self.led + force * led;
    }
}

/// What [`Sums`] come to.
#[derive(Clone, Copy, Default)]
pub(crate) struct Totals {
    kinetic: f64,
    momentum: [f64; 3],
    led: f64,
}

impl Totals {
    /// Of all nodes from those of some.
    pub(crate) fn of_all<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut all = Self::default();
        for part in parts {
            all.kinetic += part.kinetic;
            all.led += part.led;
            for (sum, momentum) in all.momentum.iter_mut().zip(part.momentum) {
                *sum += momentum;
            }
        }
        all
    }

    /// Adds sums of nodes side by side, one for each axis.
    pub(crate) fn add_lanes<R: Real>(&mut self, sums: &[Sums<R>; 3]) {
        for (sums, momentum) in sums.iter().zip(&mut self.momentum) {
            for lane in 0..R::COUNT {
                self.kinetic += f64::from(sums.kinetic.lane(lane));
                *momentum += f64::from(sums.momentum.lane(lane));
                self.led += f64::from(sums.led.lane(lane));
            }
        }
    }

    /// Adds the sums of each axis.
    pub(crate) fn add_axes(&mut self, sums: &[Sums<f32>; 3]) {
        for (sums, momentum) in sums.iter().zip(&mut self.momentum) {
            self.kinetic += f64::from(sums.kinetic);
            *momentum += f64::from(sums.momentum);
            self.led += f64::from(sums.led);
        }
    }
}

/// Numbers of four nodes.
const FOUR: usize = 16;

/// The numbers of four nodes, zeros where there are none.
#[inline(always)]
fn four<T: Pod>(of: &[T], first: usize) -> [f32; FOUR] {
    let numbers: &[f32] = must_cast_slice(of);
    let numbers = numbers.get(4 * first..).unwrap_or_default();
    if let Some(four) = numbers.first_chunk() {
        return *four;
    }
    let mut four = [0.0; FOUR];
    for (to, from) in four.iter_mut().zip(numbers) {
        *to = *from;
    }
    four
}

/// Puts the numbers of four nodes, or of as many as there are, back.
#[inline(always)]
fn put(four: [f32; FOUR], into: &mut [NodeVector]) {
    let numbers: &mut [f32] = must_cast_slice_mut(into);
    if let Some(all) = numbers.first_chunk_mut() {
        *all = four;
        return;
    }
    for (to, from) in numbers.iter_mut().zip(four) {
        *to = from;
    }
}

/// A vector of the numbers of four nodes.
#[inline(always)]
fn part<R: Real>(numbers: &[f32; FOUR], from: usize) -> R {
    R::from_fn(|lane| numbers[(from + lane) % FOUR])
}

/// The exact step along axes side by side.
struct Exact<R> {
    keep: R,
    carry: R,
    push: R,
}

impl<R: Real> Exact<R> {
    #[inline(always)]
    fn new(step: &Step) -> Self {
        Self { keep: R::splat(step.keep), carry: R::splat(step.carry), push: R::splat(step.push) }
    }

    /// The next increment of axes with these inverse masses; held axes stand still.
    #[inline(always)]
    fn next(&self, inverse: R, increment: R, force: R) -> R {
        let next = self.keep * (self.carry * increment) + self.push * (inverse * force);
        inverse.choose(next, R::splat(0.0))
    }
}

/// Sums over the nodes of an exact step.
pub(super) struct Account<'a> {
    pub(super) step: &'a Step,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) increment: &'a [NodeVector],
    pub(super) force: &'a [NodeVector],
}

impl Account<'_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn total(self) -> Totals {
        dispatch(self)
    }
}

impl Kernel for Account<'_> {
    type Output = Totals;

    #[inline(always)]
    fn run<R: Real>(self) -> Totals {
        let Self { step, inertia, increment, force } = self;
        let exact = Exact::<R>::new(step);
        // Sixteen sums whatever the width, so that their bits are the same.
        let mut sums = [Sums::<R>::new(step, R::splat); 4];
        for first in (0..inertia.len()).step_by(4) {
            let (inertia, increment, force) =
                (four(inertia, first), four(increment, first), four(force, first));
            for (sums, from) in sums.iter_mut().zip((0..FOUR).step_by(R::COUNT)) {
                let inverse = axes::<R>() * part::<R>(&inertia, from);
                let mass = R::from_fn(|lane| inertia[((from + lane) | 3) % FOUR]);
                let (increment, force) = (part::<R>(&increment, from), part::<R>(&force, from));
                sums.add(mass, inverse.positive(), increment, force, exact.next(inverse, increment, force));
            }
        }
        let mut totals = Totals::default();
        for (sums, from) in sums.iter().zip((0..FOUR).step_by(R::COUNT)) {
            for lane in 0..R::COUNT {
                totals.kinetic += f64::from(sums.kinetic.lane(lane));
                totals.led += f64::from(sums.led.lane(lane));
                if let Some(momentum) = totals.momentum.get_mut((from + lane) % 4) {
                    *momentum += f64::from(sums.momentum.lane(lane));
                }
            }
        }
        totals
    }
}

/// Moves the nodes by an exact step.
pub(super) struct Advance<'a> {
    pub(super) step: &'a Step,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a mut [NodeVector],
    pub(super) increment: &'a mut [NodeVector],
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
        let Self { step, inertia, displacement, increment, force } = self;
        let exact = Exact::<R>::new(step);
        let moving = displacement.chunks_mut(4).zip(increment.chunks_mut(4));
        for ((displacement, increment), first) in moving.zip((0..inertia.len()).step_by(4)) {
            let (inertia, force) = (four(inertia, first), four(force, first));
            let (mut at, mut moved) = (four(displacement, 0), four(increment, 0));
            for from in (0..FOUR).step_by(R::COUNT) {
                let inverse = axes::<R>() * part::<R>(&inertia, from);
                let next = exact.next(inverse, part(&moved, from), part(&force, from));
                let here = part::<R>(&at, from) + next;
                for lane in 0..R::COUNT {
                    moved[(from + lane) % FOUR] = next.lane(lane);
                    at[(from + lane) % FOUR] = here.lane(lane);
                }
            }
            put(at, displacement);
            put(moved, increment);
        }
    }
}

impl Entry {
    /// Kinetic energy of the free axes, work of gravity, and of supports along what they moved last.
    pub(crate) fn of_totals(totals: &Totals, loads: &Loads<'_>, step: &Step) -> Self {
        let dt = f64::from(step.dt);
        let gravity = loads.gravity().into_iter().zip(totals.momentum);
        let gravity: f64 = gravity.map(|(g, momentum)| f64::from(g) * momentum).sum();
        Self {
            finite: totals.kinetic.is_finite(),
            kinetic: 0.5 * totals.kinetic / (dt * dt),
            // What a support exerts is minus the total force on its node.
            work: gravity - 0.5 * totals.led,
            jump: 0.0,
        }
    }

    /// Work of the nodal forces.
    pub(crate) fn with_forces(
        mut self,
        loads: &Loads<'_>,
        inertia: &[NodeInertia],
        increment: &[NodeVector],
        force: &[NodeVector],
        time: f64,
        next: impl Next,
    ) -> Self {
        for load in loads.forces() {
            let node = load.node as usize;
            let (Some(inertia), Some(increment), Some(force)) =
                (inertia.get(node), increment.get(node), force.get(node))
            else {
                continue;
            };
            let next = next(node, inertia, increment, force);
            let factor = ramp_factor(time, load.ramp);
            let mut work = 0.0;
            for axis in 0..3 {
                let last = increment.0[axis];
                let way = if inertia.inverse[axis] > 0.0 { 0.5 * (next[axis] + last) } else { last };
                work += load.newton[axis] * way;
            }
            self.work += f64::from(factor * work);
        }
        self
    }

    /// Work of the supports along what they move next.
    pub(crate) fn with_motions(
        mut self,
        loads: &Loads<'_>,
        displacement: &[NodeVector],
        increment: &[NodeVector],
        force: &mut [NodeVector],
        time: f64,
        step: &Step,
    ) -> Self {
        loads.each_led(time + f64::from(step.dt), force, |node, axis, position, force| {
            let (Some(displacement), Some(increment)) = (displacement.get(node), increment.get(node)) else {
                return;
            };
            let next = position - displacement.0[axis % 4];
            let (force, last) = (f64::from(0.5 * force[axis % 4]), increment.0[axis % 4]);
            self.work -= force * f64::from(next);
            self.jump += force.abs() * f64::from((next - last).abs());
        });
        self
    }

    /// The account after the step, or why the step cannot be believed.
    pub(crate) fn entered(&self, account: Ledger, step: &Step) -> Result<Ledger, Cause> {
        if !self.finite {
            return Err(Cause::NotFinite);
        }
        let dissipated = 2.0 * f64::from(step.damping) * self.kinetic * f64::from(step.span);
        let entered = account.entered(self.work, self.jump, self.kinetic, dissipated);
        if self.kinetic > entered.most() {
            return Err(Cause::Energy { kinetic: self.kinetic, available: entered.peak });
        }
        Ok(entered)
    }
}
