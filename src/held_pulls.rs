//! Pulls that exact steps hold back, so that tissue is not torn ([`crate::pulls`]).

/// The steps in a row after which the motion is another. A target that jumps within a step is followed sooner.
const LONG: u8 = 5;
/// The steps afterwards in which it still is.
const RECENT: u8 = 128;

/// What the latest steps held back. Counts stop at the most that fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldPulls {
    /// How many were held back when some had been for long.
    pulls: u16,
    /// In how many steps in a row there are any.
    steps: u8,
    /// Steps since some had been for long.
    since: u8,
}

impl HeldPulls {
    pub(crate) const NONE: Self = Self { pulls: 0, steps: 0, since: u8::MAX };

    /// Enters a step.
    pub(crate) fn enter(&mut self, pulls: u32) {
        self.steps = if pulls > 0 { self.steps.saturating_add(1) } else { 0 };
        if self.steps > LONG {
            (self.pulls, self.since) = (u16::try_from(pulls).unwrap_or(u16::MAX), 0);
        } else {
            self.since = self.since.saturating_add(1);
        }
    }

    /// How many are held back, or have been lately, if it was for long.
    pub(crate) const fn for_long(self) -> u32 {
        if self.since < RECENT { self.pulls as u32 } else { 0 }
    }
}
