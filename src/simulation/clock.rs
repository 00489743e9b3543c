//! When calls of `advance` should end.

use crate::step::Status;

/// Calls follow each other without a drift, unless the state was restored in between; and equal calls take equal steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    /// Where the last call should have ended, and where it did, s.
    until: f64,
    ended: f64,
}

impl Clock {
    /// When a call ends that begins `now` and goes on for so many `seconds`, s.
    pub fn end_of_call(&mut self, now: f64, seconds: f64) -> f64 {
        let due = if now == self.ended { self.until } else { now };
        self.until = due + seconds;
        // Both are the same but for a rounding: this one makes the span `seconds` to the bit, and so equal calls' steps
        // equal. Where the last call ended elsewhere it is made up for.
        if libm::fabs(due - now) <= 1e-6 * seconds { now + seconds } else { self.until }
    }

    /// The call has ended at this time (s) with this status. What its work did not suffice for is not made up for, nor
    /// what comes after a step that was refused: a call is never of more than its own span.
    pub const fn ended(&mut self, time: f64, status: Status) {
        if matches!(status, Status::Behind { .. } | Status::Diverged(_)) {
            self.until = time;
        }
        self.ended = time;
    }
}
