//! The most work that a call may take, so that a frame of a host ends in time.

/// What a long step counts, in exact steps: what one costs that renews its matrices, on meshes of 10,000 tetrahedra and
/// more.
const OF_LONG: u32 = 4;

/// The work that a call may still take, in exact steps: each counts one, also where it is taken back, a long or a learned
/// step four.
#[derive(Clone, Copy, Debug)]
pub struct Work {
    left: u32,
}

impl Work {
    /// No bound.
    pub const UNBOUNDED: Self = Self { left: u32::MAX };

    /// So many exact steps, at least one.
    #[must_use]
    pub fn of(steps: u32) -> Self {
        Self { left: steps.max(1) }
    }

    /// Whether none is left.
    #[must_use]
    pub const fn is_spent(&self) -> bool {
        self.left == 0
    }

    /// How many exact steps are left.
    pub(crate) const fn left(&self) -> u32 {
        self.left
    }

    pub(crate) const fn exact_steps(&mut self, count: u32) {
        if self.left != u32::MAX {
            self.left = self.left.saturating_sub(count);
        }
    }

    /// A long or a learned one.
    pub(crate) const fn long_step(&mut self) {
        self.exact_steps(OF_LONG);
    }
}
