//! The energy account that tells whether a step may be believed: kinetic energy can come only from the
//! work of loads and supports, less what damping took, plus the energy at the start.
//!
//! With `b = (du+ + du-) / 2`, the mean of the increments after and before `t_n`, central differences
//! satisfy exactly `T(n+1/2) - T(n-1/2) = f_n . b`. From it, for linear forces and any stable step,
//! `1/2 m (b / dt)^2` plus a term that is never negative equals the work up to `t_n`. So work of load `f` is
//! counted as `f_n . b`, and the kinetic energy of `b / dt` may not exceed the account. All in joules.

/// Energy account of a state, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ledger {
    /// Energy at the start: kinetic and strain energy, and what the material can release from rest.
    pub start: f64,
    /// Work done by loads and moved supports.
    pub work: f64,
    /// Work taken by damping.
    pub dissipated: f64,
    /// Kinetic energy at the latest step.
    pub kinetic: f64,
    /// Sum of the magnitudes of all work: the scale of the account's rounding.
    pub turnover: f64,
    /// The largest balance so far.
    pub peak: f64,
}

/// Share of the largest balance by which kinetic energy may exceed the account: internal forces are not
/// linear, so the identity above holds up to the square of the step.
const SLACK: f64 = 0.05;
/// Relative error of one entry, in float32 sums over the nodes.
const ROUNDING: f64 = 1e-4;

impl Ledger {
    /// At rest, nothing done.
    pub const NEW: Self =
        Self { start: 0.0, work: 0.0, dissipated: 0.0, kinetic: 0.0, turnover: 0.0, peak: 0.0 };

    /// What the kinetic energy may be.
    #[must_use]
    pub fn balance(&self) -> f64 {
        self.start + self.work - self.dissipated
    }

    /// The account after one more step, unless the kinetic energy exceeds it.
    pub(crate) fn entered(self, work: f64, kinetic: f64, dissipated: f64) -> Option<Self> {
        let turnover = self.turnover + work.abs();
        // Half of this step's work has been done at t_n; taking the larger of none and all keeps it simple.
        let balance = self.balance() + if work > 0.0 { work } else { 0.0 };
        let peak = if balance > self.peak { balance } else { self.peak };
        if kinetic > balance + SLACK * peak + ROUNDING * turnover {
            return None;
        }
        let dissipated = self.dissipated + dissipated;
        Some(Self { work: self.work + work, dissipated, kinetic, turnover, peak, ..self })
    }
}
