//! The energy balance that tells whether a step may be believed: kinetic energy can come only from the
//! work of loads and supports, less what damping took, plus the energy at the start.
//!
//! With `b = (du+ + du-) / 2`, the mean of the increments after and before `t_n`, central differences
//! satisfy exactly `T(n+1/2) - T(n-1/2) = f_n . b`. From it, for linear forces and any stable step,
//! `1/2 m (b / dt)^2` plus a term that is never negative equals the work up to `t_n`. So work of load `f` is
//! counted as `f_n . b`, and the kinetic energy of `b / dt` is compared with the balance. All in joules.
//!
//! Tissue is not linear: in a violent motion (a release from 50 % stretch) a stable step gains or loses a share
//! of its energy, which is an error and no divergence. An unstable step multiplies its energy within tens of
//! steps. Hence two limits: beyond the balance the step is called inexact, beyond four times
//! the most that it ever was the step has diverged.
//!
//! A balance that is only added to says less and less: its uncertainty grows, a violent moment leaves a slack that a
//! quiet body never needs, and what networks and added inertia take from the motion is not entered. So the energy is
//! measured as well, in cycles: each step computes the strain energy of a few elements. What the body can have at the
//! end of a cycle is at most
//!
//! ```text
//! 2 (U + T) + A        U: strain energy, each element once;  T: the largest kinetic energy;  A: absolute work in the cycle
//! ```
//! Energy changes its form and its place during a cycle. For a motion in one mode `U + T` is never less than its
//! energy, because `T` is the largest; 2 is a safeguard for others. Where the balance allows more than that, it is set
//! to what was measured.

/// Energy balance of a state, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyBalance {
    /// Energy at the start: kinetic and strain energy, and what the material can release from rest.
    pub start: f64,
    /// Work done by loads and moved supports.
    pub work: f64,
    /// Work taken by damping.
    pub dissipated: f64,
    /// What measurements of the energy have added to the balance.
    pub corrected: f64,
    /// Kinetic energy at the latest step.
    pub kinetic: f64,
    /// What the balance may be wrong by: rounding, and supports that jump, whose work between two
    /// steps is not seen.
    pub uncertainty: f64,
    /// The largest balance so far, or since a measurement that found much less.
    pub peak: f64,
    /// What rounding of the displacements can give to vibrations in the long run, J, more rather than less. Where that
    /// is no longer little, forces are computed from what it has left out as well.
    pub heat: f64,
    /// The measurement under way.
    pub cycle: EnergyCycle,
}

/// A measurement of the body's energy, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyCycle {
    /// Place of the element that is next.
    pub next: u32,
    /// Strain energy of the elements before it.
    pub strain: f64,
    /// The largest kinetic energy of the cycle's steps, that of added inertia included.
    pub kinetic: f64,
    /// Sum of the absolute work of the cycle's steps.
    pub work: f64,
}

impl EnergyCycle {
    /// The begin of a cycle.
    pub const NEW: Self = Self { next: 0, strain: 0.0, kinetic: 0.0, work: 0.0 };
}

/// Share of the largest balance by which kinetic energy may exceed the balance before a step is inexact.
const SLACK: f64 = 0.05;
/// Multiple of the largest balance and its uncertainty at which kinetic energy cannot have come from the loads.
pub(crate) const DIVERGED: f64 = 4.0;
/// Relative error of one entry, in float32 sums over the nodes.
const ROUNDING: f64 = 1e-4;
/// The most energy that a body can have over what a cycle has measured.
const MOST_OVER_MEASURED: f64 = 2.0;

impl EnergyBalance {
    /// At rest, nothing done.
    pub const NEW: Self = Self {
        start: 0.0,
        work: 0.0,
        dissipated: 0.0,
        corrected: 0.0,
        kinetic: 0.0,
        uncertainty: 0.0,
        peak: 0.0,
        heat: 0.0,
        cycle: EnergyCycle::NEW,
    };

    /// What the kinetic energy may be.
    #[must_use]
    pub fn balance(&self) -> f64 {
        self.start + self.work - self.dissipated + self.corrected
    }

    /// By how much the kinetic energy exceeds the balance and its slack, as a share of the largest balance;
    /// zero for a step that is exact as far as energy tells.
    #[must_use]
    pub fn excess(&self) -> f64 {
        let over = self.surplus();
        if over > 0.0 { over / (self.peak + self.uncertainty) } else { 0.0 }
    }

    /// The kinetic energy beyond the balance and its slack, J; negative if there is less.
    fn surplus(&self) -> f64 {
        self.kinetic - self.allowed()
    }

    /// What the kinetic energy may be before a step is inexact, J.
    fn allowed(&self) -> f64 {
        self.balance() + self.uncertainty + SLACK * self.peak
    }

    /// Whether rounding gives to vibrations more than goes unnoticed.
    pub(crate) fn is_heated(&self) -> bool {
        self.heat > SLACK * self.peak
    }

    /// The share of the kinetic energy that the balance allows, at most one.
    pub(crate) fn allowed_share(&self) -> f32 {
        let over = self.surplus();
        if over > 0.0 { (1.0 - over / self.kinetic).max(0.0) as f32 } else { 1.0 }
    }

    /// The most kinetic energy that a step can have without having diverged.
    #[must_use]
    pub fn most(&self) -> f64 {
        DIVERGED * (self.peak + self.uncertainty)
    }

    /// The balance after one more step.
    pub(crate) fn entered(self, work: f64, jump: f64, kinetic: f64, dissipated: f64) -> Self {
        let uncertainty = self.uncertainty + jump + ROUNDING * work.abs();
        let cycle = EnergyCycle { work: self.cycle.work + work.abs() + jump, ..self.cycle };
        let (work, dissipated) = (self.work + work, self.dissipated + dissipated);
        let mut entered = Self { work, dissipated, kinetic, uncertainty, cycle, ..self };
        // No body has less than no energy: where a longer step begins, loads may have taken what added inertia has.
        entered.corrected -= entered.balance().min(0.0);
        // Dissipation of this step is left out: it belongs to the time after t_n.
        let balance = entered.balance() + (dissipated - self.dissipated);
        Self { peak: if balance > self.peak { balance } else { self.peak }, ..entered }
    }

    /// The balance with `strain`, the strain energy of the elements up to place `next`, none if that was the last.
    /// Added inertia has `added` times the kinetic energy of the masses; `rounding` is the energy of a strain that may
    /// be rounding.
    pub(crate) fn measured(mut self, strain: f64, next: Option<u32>, added: f64, rounding: f64) -> Self {
        let cycle = &mut self.cycle;
        cycle.strain += strain;
        cycle.kinetic = cycle.kinetic.max((1.0 + added) * self.kinetic);
        match next {
            Some(next) => cycle.next = next,
            None => self.conclude(rounding),
        }
        self
    }

    /// Ends a cycle.
    fn conclude(&mut self, rounding: f64) {
        let EnergyCycle { strain, kinetic, work, .. } = self.cycle;
        self.cycle = EnergyCycle::NEW;
        let measured = (strain + rounding).max(0.0) + kinetic;
        let most = MOST_OVER_MEASURED * measured + work;
        if most < self.allowed() {
            self.corrected += measured - self.balance();
            self.peak = measured;
            self.uncertainty = most - (1.0 + SLACK) * measured;
        }
    }
}
