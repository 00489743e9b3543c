//! Pulls that exact steps hold back, so that tissue is not torn ([`crate::pulls`]).

/// The steps in a row after which the motion is another. A target that jumps within a step is followed sooner.
const LONG: u16 = 5;

/// What the latest steps held back. Counts stop at the most that fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldPulls {
    /// How many in the latest step.
    pulls: u16,
    /// In how many steps in a row there were any.
    steps: u16,
}

impl HeldPulls {
    pub(crate) const NONE: Self = Self { pulls: 0, steps: 0 };

    /// Enters a step.
    pub(crate) fn enter(&mut self, pulls: u32) {
        self.pulls = u16::try_from(pulls).unwrap_or(u16::MAX);
        self.steps = if pulls > 0 { self.steps.saturating_add(1) } else { 0 };
    }

    /// How many are held back, if any have been for long.
    pub(crate) const fn for_long(self) -> u32 {
        if self.steps > LONG { self.pulls as u32 } else { 0 }
    }
}
