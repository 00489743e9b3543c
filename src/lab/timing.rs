//! How time is counted in a scene: the step that multiples are of, the steps between two snapshots, the exact steps of
//! the truth.

use super::{DT, INTERVAL_STEPS};

/// How time is counted in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// The step that multiples are of, s.
    pub step: f32,
    /// Such steps between two snapshots.
    pub interval: u32,
    /// Exact steps of the truth in such a step.
    pub refinement: u32,
}

impl Timing {
    /// The paper's step, which is short compared with the limit of stability of most bodies.
    pub const PAPER: Self = Self { step: DT, interval: INTERVAL_STEPS, refinement: 1 };

    /// `seconds` in a whole number of intervals of 200 steps, each step as long as possible up to `longest` (s). Also
    /// gives the intervals.
    #[must_use]
    pub fn of_longest(longest: f32, seconds: f32, refinement: u32) -> (Self, usize) {
        const INTERVAL: u32 = 200;
        let intervals = (seconds / (INTERVAL as f32 * longest)).ceil().max(1.0);
        (Self { step: seconds / (intervals * INTERVAL as f32), interval: INTERVAL, refinement }, intervals as usize)
    }

    /// Time between two snapshots, s.
    #[must_use]
    pub fn interval_seconds(&self) -> f64 {
        f64::from(self.interval) * f64::from(self.step)
    }

    /// Whether every snapshot falls on a step of `multiple` times [`Timing::step`].
    #[must_use]
    pub const fn hits_snapshots(&self, multiple: u32) -> bool {
        multiple != 0 && self.interval.is_multiple_of(multiple)
    }
}
