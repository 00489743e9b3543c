//! What a step enters in the energy balance ([`crate::energy_balance`]), J: kinetic energy of the mean of the
//! increments before and after `t_n`, and the work of loads and supports along it, from sums over the nodes.

use core::ops::{Add, Mul, Sub};

use crate::element::NodeInertia;
use crate::energy_balance::EnergyBalance;
use crate::loads::{Loads, ramp_factor};
use crate::simd::{NodeVector, Real};

use super::{Cause, Step};

/// The energies of one step, J.
pub(crate) struct Entry {
    pub(crate) finite: bool,
    pub(crate) kinetic: f64,
    pub(crate) work: f64,
    /// How far the work of supports depends on their motion between two steps.
    pub(crate) jump: f64,
}

/// A vector of floats that can be summed: the axes of a node, or one axis of several nodes.
pub(crate) trait Addends: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}

impl<V: Copy + Add<Output = V> + Sub<Output = V> + Mul<Output = V>> Addends for V {}

/// Sums over the nodes.
#[derive(Clone, Copy)]
pub(crate) struct Sums<V> {
    one: V,
    half: V,
    carry: V,
    /// Mass times the square of the mean increment, kg m^2.
    kinetic: V,
    /// Mass times the mean increment, kg m.
    momentum: V,
    /// Force times the increment of held axes, N m.
    prescribed: V,
}

impl<V: Addends> Sums<V> {
    /// Empty sums; `splat` repeats a value.
    #[inline(always)]
    pub(crate) fn new(step: &Step, splat: impl Fn(f32) -> V) -> Self {
        let zero = splat(0.0);
        let [one, half, carry] = [1.0, 0.5, step.carry()].map(splat);
        Self { one, half, carry, kinetic: zero, momentum: zero, prescribed: zero }
    }

    /// The sums of one element of the vectors.
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
            prescribed: self.prescribed.lane(lane),
        }
    }

    /// Adds nodes: masses, ones along free axes, increments, total forces and next increments.
    #[inline(always)]
    pub(crate) fn add(&mut self, mass: V, free: V, increment: V, force: V, next: V) {
        // A held axis has no inertia of its own: what moves it is counted as work.
        let moving = free * (self.half * (next + self.carry * increment));
        let prescribed = (self.one - free) * increment;
        self.kinetic = self.kinetic + mass * (moving * moving);
        self.momentum = self.momentum + mass * (free * (self.half * (next + increment)) + prescribed);
        self.prescribed = self.prescribed + force * prescribed;
    }
}

/// Totals of [`Sums`] over vectors and axes.
#[derive(Clone, Copy, Default)]
pub(crate) struct Totals {
    kinetic: f64,
    momentum: [f64; 3],
    prescribed: f64,
    /// Other work of supports, J.
    work: f64,
    /// The largest components of the last and of the next increments, m: for steps with instruments.
    pub(crate) farthest: [f32; 2],
}

impl Totals {
    pub(crate) const NONE: Self =
        Self { kinetic: 0.0, momentum: [0.0; 3], prescribed: 0.0, work: 0.0, farthest: [0.0; 2] };

    /// Adds the totals of all partitions.
    pub(crate) fn of_all<'a>(parts: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut all = Self::default();
        for part in parts {
            all.kinetic += part.kinetic;
            all.prescribed += part.prescribed;
            all.work += part.work;
            for (most, farthest) in all.farthest.iter_mut().zip(part.farthest) {
                *most = farthest.max(*most);
            }
            for (sum, momentum) in all.momentum.iter_mut().zip(part.momentum) {
                *sum += momentum;
            }
        }
        all
    }

    /// Adds work that supports do on free nodes directly, J.
    pub(crate) fn add_work(&mut self, joule: f32) {
        self.work += f64::from(joule);
    }

    /// Adds work of loads, J.
    pub(crate) fn add_work_of_loads(&mut self, joule: f64) {
        self.work += joule;
    }

    /// Replaces the sums over the nodes; the work stays.
    pub(crate) fn replace_sums(&mut self, sums: &Self) {
        *self = Self { work: self.work, ..*sums };
    }

    /// Replaces what a node contributes by what it does with another force and next increment.
    pub(crate) fn change(
        &mut self,
        step: &Step,
        inertia: &NodeInertia,
        increment: &NodeVector,
        forces: [&NodeVector; 2],
        next: [&[f32; 4]; 2],
    ) {
        for (sign, (force, next)) in [-1.0, 1.0].into_iter().zip(forces.into_iter().zip(next)) {
            for (axis, inverse) in inertia.inverse.into_iter().enumerate() {
                let mut sums = Sums::new(step, |value| value);
                let free = if inverse > 0.0 { 1.0 } else { 0.0 };
                sums.add(inertia.mass, free, increment.0[axis], force.0[axis], next[axis]);
                self.kinetic += sign * f64::from(sums.kinetic);
                self.momentum[axis] += sign * f64::from(sums.momentum);
                self.prescribed += sign * f64::from(sums.prescribed);
            }
        }
    }

    /// Of nodes whose inertia in the step is not that of their masses: sums of inertia times the squares of their mean
    /// increments (kg m^2), of masses times these (kg m), of force times the increments of held axes (N m), and the
    /// largest components of the last and of the next increments, m.
    pub(crate) fn of_sums(kinetic: f64, momentum: [f32; 3], prescribed: f32, farthest: [f32; 2]) -> Self {
        Self { kinetic, momentum: momentum.map(f64::from), prescribed: prescribed.into(), work: 0.0, farthest }
    }

    /// Adds vectorised sums of nodes, one for each axis.
    pub(crate) fn add_vectors<R: Real>(&mut self, sums: &[Sums<R>; 3]) {
        for (sums, momentum) in sums.iter().zip(&mut self.momentum) {
            for lane in 0..R::COUNT {
                self.kinetic += f64::from(sums.kinetic.lane(lane));
                *momentum += f64::from(sums.momentum.lane(lane));
                self.prescribed += f64::from(sums.prescribed.lane(lane));
            }
        }
    }

    /// Adds sums of vectors as they are in memory, four components a node; the first is component `from` of four nodes.
    #[inline(always)]
    pub(crate) fn add_interleaved<R: Real>(&mut self, sums: &Sums<R>, from: usize) {
        for lane in 0..R::COUNT {
            self.kinetic += f64::from(sums.kinetic.lane(lane));
            self.prescribed += f64::from(sums.prescribed.lane(lane));
            if let Some(momentum) = self.momentum.get_mut((from + lane) % 4) {
                *momentum += f64::from(sums.momentum.lane(lane));
            }
        }
    }

    /// Adds the sums of each axis.
    pub(crate) fn add_axes(&mut self, sums: &[Sums<f32>; 3]) {
        for (sums, momentum) in sums.iter().zip(&mut self.momentum) {
            self.kinetic += f64::from(sums.kinetic);
            *momentum += f64::from(sums.momentum);
            self.prescribed += f64::from(sums.prescribed);
        }
    }
}

impl Entry {
    /// Kinetic energy of the free axes, work of gravity, and of supports along what they moved last.
    pub(crate) fn of_totals(totals: &Totals, loads: &Loads<'_>, step: &Step) -> Self {
        let dt = f64::from(step.seconds());
        let gravity = loads.gravity().into_iter().zip(totals.momentum);
        let gravity: f64 = gravity.map(|(g, momentum)| f64::from(g) * momentum).sum();
        Self {
            finite: totals.kinetic.is_finite(),
            kinetic: 0.5 * totals.kinetic / (dt * dt),
            // What a support exerts is minus the total force on its node.
            work: gravity - 0.5 * totals.prescribed + totals.work,
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
        next: impl Fn(usize, &NodeInertia, &NodeVector, &NodeVector) -> [f32; 4],
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
        increment: &mut [NodeVector],
        force: &[NodeVector],
        time: f64,
        step: &Step,
    ) -> Self {
        loads.each_prescribed(time + f64::from(step.seconds()), increment, |node, axis, position, increment| {
            let (Some(displacement), Some(force)) = (displacement.get(node), force.get(node)) else {
                return;
            };
            let next = position - displacement.0[axis % 4];
            let (force, last) = (f64::from(0.5 * force.0[axis % 4]), increment[axis % 4]);
            self.work -= force * f64::from(next);
            self.jump += force.abs() * f64::from((next - last).abs());
        });
        self
    }

    /// The balance after the step, or why the step cannot be believed.
    pub(crate) fn entered(&self, balance: EnergyBalance, step: &Step) -> Result<EnergyBalance, Cause> {
        if !(self.finite && self.work.is_finite() && self.jump.is_finite()) {
            return Err(Cause::NotFinite);
        }
        let dissipated = 2.0 * f64::from(step.damping()) * self.kinetic * f64::from(step.span());
        let entered = balance.entered(self.work, self.jump, self.kinetic, dissipated);
        if self.kinetic > entered.most() {
            return Err(Cause::Energy { kinetic: self.kinetic, available: entered.peak });
        }
        Ok(entered)
    }
}
