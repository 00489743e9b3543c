//! The length of a step, and the coefficients of central differences in increment form:
//!
//! ```text
//! du+ = ((1 - k) du + dt h f / m) / (1 + k),   k = mu h / 2,   h the mean of the steps before and after
//! ```

use core::fmt;

/// A bound on the stable step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CriticalStep {
    /// Steps up to this many seconds are stable.
    pub seconds: f32,
    /// The node that sets it.
    pub node: u32,
}

/// Coefficients of the integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    dt: f32,
    damping: f32,
    /// Seconds over which a force acts: the mean of the steps before and after it.
    span: f32,
    /// What the last increment would be had it spanned `dt`, over what it is.
    carry: f32,
    /// Factors of the carried increment and of force over mass.
    keep: f32,
    push: f32,
}

/// Why a step was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// The step is not a finite positive number.
    Step {
        /// The step, s.
        seconds: f32,
    },
    /// The damping is negative or not finite.
    Damping {
        /// The damping, 1/s.
        damping: f32,
    },
    /// The step is above the bound of stability. [`Step::unchecked`] takes it all the same.
    AboveCritical {
        /// The step, s.
        seconds: f32,
        /// The bound.
        critical: CriticalStep,
    },
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Step { seconds } => {
                write!(f, "the step is {seconds} s, it must be a finite positive number")
            }
            Self::Damping { damping } => write!(f, "the damping is {damping} 1/s, it must be zero or more"),
            Self::AboveCritical { seconds, critical } => write!(
                f,
                "the step of {seconds:.3e} s is above the stable {:.3e} s, which node {} sets",
                critical.seconds, critical.node
            ),
        }
    }
}

impl core::error::Error for StepError {}

/// Share of a span that is no step but a rounding of single precision.
pub(crate) const ROUNDING: f64 = 1e-6;

/// How many steps of at most `longest` (s) make up a span (s), and their length: `longest` itself if it differs by a
/// rounding only.
pub(crate) fn equal_steps(span: f64, longest: f32) -> (u32, f32) {
    let most = f64::from(longest);
    let count = libm::ceil(span / most * (1.0 - ROUNDING)).clamp(1.0, f64::from(u32::MAX));
    let length = span / count;
    let is_longest = libm::fabs(length - most) <= ROUNDING * most;
    (count as u32, if is_longest { longest } else { (length as f32).min(longest) })
}

/// The shortest and the longest step (s) of two sets of steps; zeros are those of none.
pub(crate) fn extreme_lengths([shortest, longest]: [f32; 2], [shorter, longer]: [f32; 2]) -> [f32; 2] {
    let is_less = shortest > 0.0 && (shorter == 0.0 || shortest < shorter);
    [if is_less { shortest } else { shorter }, longest.max(longer)]
}

/// Whether this can be a damping, 1/s.
pub(crate) const fn is_damping(damping: f32) -> bool {
    damping.is_finite() && damping >= 0.0
}

impl Step {
    /// A step of `dt` seconds with mass-proportional damping (1/s), refused above the critical step.
    pub fn new(dt: f32, damping: f32, critical: CriticalStep) -> Result<Self, StepError> {
        let step = Self::unchecked(dt, damping)?;
        if dt > critical.seconds {
            return Err(StepError::AboveCritical { seconds: dt, critical });
        }
        Ok(step)
    }

    /// The same without asking for stability.
    pub fn unchecked(dt: f32, damping: f32) -> Result<Self, StepError> {
        // The square of the step must be a normal number as well.
        if !(dt.is_finite() && dt > 1e-18) {
            return Err(StepError::Step { seconds: dt });
        }
        if !is_damping(damping) {
            return Err(StepError::Damping { damping });
        }
        Ok(Self::after(dt, dt, damping))
    }

    /// Central differences with a step that changes: `v+ = v- + (h + dt) / 2 a` after a step of `h`.
    fn after(h: f32, dt: f32, damping: f32) -> Self {
        let span = 0.5 * (h + dt);
        let k = 0.5 * damping * span;
        Self { dt, damping, span, carry: dt / h, keep: (1.0 - k) / (1.0 + k), push: dt * span / (1.0 + k) }
    }

    /// The step, s.
    #[must_use]
    pub const fn seconds(&self) -> f32 {
        self.dt
    }

    /// The damping, 1/s.
    #[must_use]
    pub const fn damping(&self) -> f32 {
        self.damping
    }

    /// This step, after a last increment that spans `h` seconds; its factors of the increment and the force are those of
    /// one after another of its length.
    pub(crate) fn carried_from(self, h: f32) -> Self {
        if h > 0.0 { Self { carry: self.dt / h, span: 0.5 * (h + self.dt), ..self } } else { self }
    }

    pub(crate) const fn carry(&self) -> f32 {
        self.carry
    }

    pub(crate) const fn keep(&self) -> f32 {
        self.keep
    }

    pub(crate) const fn push(&self) -> f32 {
        self.push
    }

    pub(crate) const fn span(&self) -> f32 {
        self.span
    }

    /// This step after one of `h` seconds, zero for none.
    pub(crate) fn following(self, h: f32) -> Self {
        if h > 0.0 && h != self.dt { Self::after(h, self.dt, self.damping) } else { self }
    }
}
