//! What a call of `advance` came to.

use crate::guard::Estimate;
use crate::step::{Status, extreme_lengths};

/// What a call of `advance` came to.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    /// The worst of its steps; where one was refused, its.
    pub status: Status,
    /// Simulated time at the end, s.
    pub time: f64,
    /// Exact steps that were taken.
    pub exact: u32,
    /// Steps beyond the critical one.
    pub long: u32,
    /// Steps of a network.
    pub learned: u32,
    /// Steps that were computed and not taken, or taken back.
    pub undone: u32,
    /// Changes of the length of steps that choose it.
    pub changes: u32,
    /// The shortest and the longest step taken, s; zeros if there was none.
    pub seconds: [f32; 2],
    /// The error by the guard's estimate, or that of steps that choose their length.
    pub estimate: Option<Estimate>,
    /// Whether exact steps took the place of learned ones.
    pub fell_back: bool,
}

impl Report {
    pub(super) const fn new(time: f64) -> Self {
        Self {
            status: Status::Ok,
            time,
            exact: 0,
            long: 0,
            learned: 0,
            undone: 0,
            changes: 0,
            seconds: [0.0; 2],
            estimate: None,
            fell_back: false,
        }
    }

    /// Steps that were taken.
    #[must_use]
    pub const fn steps(&self) -> u32 {
        self.exact.saturating_add(self.long).saturating_add(self.learned)
    }

    /// Whether every step is to be believed.
    #[must_use]
    pub fn is_ok(&self) -> bool {
        self.status == Status::Ok
    }

    pub(super) fn enter(&mut self, status: Status) {
        self.status = self.status.worse(status);
    }

    pub(super) fn enter_length(&mut self, seconds: f32) {
        self.seconds = extreme_lengths(self.seconds, [seconds; 2]);
    }
}
