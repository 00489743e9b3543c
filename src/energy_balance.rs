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

/// Energy balance of a state, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyBalance {
    /// Energy at the start: kinetic and strain energy, and what the material can release from rest.
    pub start: f64,
    /// Work done by loads and moved supports.
    pub work: f64,
    /// Work taken by damping.
    pub dissipated: f64,
    /// Kinetic energy at the latest step.
    pub kinetic: f64,
    /// What the balance may be wrong by: rounding, and supports that jump, whose work between two
    /// steps is not seen.
    pub uncertainty: f64,
    /// The largest balance so far.
    pub peak: f64,
}

/// Share of the largest balance by which kinetic energy may exceed the balance before a step is inexact.
const SLACK: f64 = 0.05;
/// Multiple of the largest balance and its uncertainty at which kinetic energy cannot have come from the loads.
pub(crate) const DIVERGED: f64 = 4.0;
/// Relative error of one entry, in float32 sums over the nodes.
const ROUNDING: f64 = 1e-4;

impl EnergyBalance {
    /// At rest, nothing done.
    pub const NEW: Self =
        Self { start: 0.0, work: 0.0, dissipated: 0.0, kinetic: 0.0, uncertainty: 0.0, peak: 0.0 };

    /// What the kinetic energy may be.
    #[must_use]
    pub fn balance(&self) -> f64 {
        self.start + self.work - self.dissipated
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
        self.kinetic - self.balance() - self.uncertainty - SLACK * self.peak
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
        let (work, dissipated) = (self.work + work, self.dissipated + dissipated);
        let entered = Self { work, dissipated, kinetic, uncertainty, ..self };
        // Dissipation of this step is left out: it belongs to the time after t_n.
        let balance = entered.balance() + (dissipated - self.dissipated);
        Self { peak: if balance > self.peak { balance } else { self.peak }, ..entered }
    }
}
