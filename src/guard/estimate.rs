//! From distances to one estimate a frame: an envelope. A distance passes through zero where one run overtakes the
//! other, an error does not; so the estimate follows a larger distance at once, and forgets it by half in a fifth of a
//! second. Between two comparisons it goes on growing as it grew between the two before.

use super::ESTIMATE;
use super::compare::{Comparison, finite};
use crate::inertia::size_of;
use crate::step::Status;

/// Time in which a held estimate falls by half, s.
const HALF_LIFE: f32 = 0.2;
/// Share of the motion so far that an error may have unless the caller says otherwise, and share of the size of the
/// body below which it does not count.
const SHARE_OF_MOTION: f32 = 0.2;
const SHARE_OF_SIZE: f32 = 0.01;
/// The same in metres at most: what matters in guidance.
const LEAST: f32 = 0.001;
/// Part of that where the estimate exceeds the motion of the run: both runs may hold a body still that moves.
const LEAST_OF_STILL: f32 = 0.1;

/// In the first steps from rest no two runs differ much. So after the first comparisons, one a step, the error may be
/// as large as the motion, until the next.
const FIRST_COMPARISONS: u32 = 3;

/// The error that a run may have before its steps are called inexact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Allowed {
    /// A fifth of the mean motion of the nodes so far; errors below a millimetre and a hundredth of the body's size do
    /// not count, of a body that has moved by less than its error those below a tenth of that.
    #[default]
    ShareOfMotion,
    /// A mean error of the nodes of this many metres.
    Metres(f32),
}

/// Estimated error of the positions of the nodes, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean over the nodes.
    pub mean: f32,
    /// The largest.
    pub largest: f32,
    /// The node that had it at the latest comparison.
    pub node: u32,
    /// What is allowed for the mean at present.
    pub allowed: f32,
}

/// Estimates over time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Envelope {
    pub(super) allowed: Allowed,
    /// Errors below do not count, m.
    least: f32,
    /// Largest mean motion so far, m.
    motion: f32,
    /// The error may be at least this, m: the motion since the start at the first comparisons, nothing after them.
    floor: f32,
    /// Seconds since the start.
    elapsed: f32,
    /// None before the first comparison.
    held: Option<Comparison>,
    comparisons: u32,
    /// Of them, those at which the error may be as large as the motion.
    first: u32,
    /// Mean distance at the latest comparison, m.
    distance: f32,
    /// By how much the mean and the largest grow in a second, m/s, and the seconds since the latest comparison.
    growth: [f32; 2],
    waited: f32,
}

impl Envelope {
    /// For a body with these points at rest, m.
    pub(super) fn new(points: &[[f32; 3]]) -> Self {
        let square: f32 = size_of(points).iter().map(|side| side * side).sum();
        let least = LEAST.min(SHARE_OF_SIZE * libm::sqrtf(square));
        Self {
            allowed: Allowed::default(),
            least,
            motion: 0.0,
            floor: 0.0,
            elapsed: 0.0,
            held: None,
            comparisons: 0,
            first: FIRST_COMPARISONS,
            distance: 0.0,
            growth: [0.0; 2],
            waited: 0.0,
        }
    }

    /// The state is another one.
    pub(super) fn forget(&mut self) {
        *self = Self {
            motion: 0.0,
            floor: 0.0,
            elapsed: 0.0,
            held: None,
            comparisons: 0,
            distance: 0.0,
            growth: [0.0; 2],
            waited: 0.0,
            ..*self
        };
    }

    /// Enters a comparison, so many seconds after the one before, where nodes have this mean speed (m/s). The motion that
    /// is compared is that from the shape at rest, of which a body may have had much at the start.
    pub(super) fn add(&mut self, found: &Comparison, seconds: f32, speed: f32) {
        let kept = libm::exp2f(-seconds / HALF_LIFE);
        let before = self.held.unwrap_or_default();
        self.motion = self.motion.max(found.motion);
        self.elapsed += seconds;
        self.floor = if self.is_new() { found.motion.min(speed * self.elapsed) } else { 0.0 };
        self.comparisons = self.comparisons.saturating_add(1);
        let [mean, largest] = [found.mean, found.largest].map(finite);
        self.distance = mean;
        let mean = mean.max(kept * before.mean);
        let largest = largest.max(kept * before.largest).max(mean);
        let growth = |now: f32, before: f32| finite(((now - before) / seconds).max(0.0));
        self.growth = [growth(mean, before.mean), growth(largest, before.largest)];
        self.waited = 0.0;
        self.held = Some(Comparison { mean, largest, ..*found });
    }

    /// Whether the first comparisons are not over.
    pub(super) const fn is_new(&self) -> bool {
        self.comparisons < self.first
    }

    /// See [`super::Watch::start_is_exact`].
    pub(super) const fn start_is_exact(&mut self) {
        self.first = 0;
    }

    pub(super) const fn distance(&self) -> f32 {
        self.distance
    }

    pub(super) const fn comparisons(&self) -> u32 {
        self.comparisons
    }

    /// So many seconds have gone since the latest comparison.
    pub(super) const fn wait(&mut self, seconds: f32) {
        self.waited = seconds.max(0.0);
    }

    /// Nothing could be compared: the error may be as large as the motion, and is more than is allowed.
    pub(super) fn lose(&mut self, seconds: f32) {
        let before = self.held.unwrap_or_default();
        let mean = before.mean.max(self.motion).max(self.allowed(0.0));
        self.add(&Comparison { mean, largest: before.largest.max(mean), ..before }, seconds, f32::INFINITY);
    }

    pub(super) fn estimate(&self) -> Option<Estimate> {
        let Comparison { mean, largest, node, .. } = self.held?;
        let apart = ESTIMATE * mean;
        let [mean, largest] = [(mean, self.growth[0]), (largest, self.growth[1])]
            .map(|(held, growth)| finite(ESTIMATE * (held + growth * self.waited).max(self.floor)));
        Some(Estimate { mean, largest, node, allowed: self.allowed(apart) })
    }

    /// What is allowed where this mean error is estimated, m.
    fn allowed(&self, mean: f32) -> f32 {
        match self.allowed {
            Allowed::ShareOfMotion => {
                let least = if mean > self.motion { LEAST_OF_STILL * self.least } else { self.least };
                least.max(SHARE_OF_MOTION * self.motion)
            }
            Allowed::Metres(metres) => metres,
        }
    }

    /// What is allowed at present, m.
    pub(super) fn allowed_at_present(&self) -> f32 {
        self.allowed(self.estimate().map_or(0.0, |estimate| estimate.mean))
    }

    /// The status of a step that was taken.
    pub(super) fn judge(&self, taken: Status) -> Status {
        self.estimate().map_or(taken, |Estimate { mean, allowed, .. }| judged(taken, mean, allowed))
    }
}

/// Whether an error is above a limit; one that is no number is.
pub(crate) fn exceeds(error: f32, limit: f32) -> bool {
    error.is_nan() || error > limit
}

/// The status of a step that was taken, with an estimate of the mean error and what is allowed, m.
pub(crate) fn judged(taken: Status, error: f32, allowed: f32) -> Status {
    if taken == Status::Ok && exceeds(error, allowed) { Status::Inexact { error, allowed } } else { taken }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(mean: f32) -> Comparison {
        Comparison { mean, largest: 2.0 * mean, node: 3, motion: 0.05 }
    }

    /// Of a body of 5 cm, after the first comparisons.
    fn later() -> Envelope {
        Envelope { comparisons: FIRST_COMPARISONS, ..Envelope::new(&[[0.0; 3], [0.03, 0.04, 0.0]]) }
    }

    #[test]
    fn at_first_the_error_may_be_the_whole_motion() {
        let mut envelope = Envelope::new(&[[0.0; 3], [0.03, 0.04, 0.0]]);
        assert_eq!(envelope.estimate(), None);
        for _ in 0..FIRST_COMPARISONS {
            envelope.add(&distance(0.001), 1e-3, f32::INFINITY);
            envelope.wait(5e-4);
            let Estimate { mean, largest, .. } = envelope.estimate().unwrap();
            assert_eq!([mean, largest], [ESTIMATE * 0.05; 2]);
        }
        // It is not held, and does not count as growth.
        envelope.add(&distance(0.001), 1e-3, f32::INFINITY);
        envelope.wait(1e-3);
        assert_eq!(envelope.estimate().unwrap().mean, ESTIMATE * 0.001);
    }

    /// A body that hung already when it was first looked at has moved by what it has done since.
    #[test]
    fn at_first_the_error_is_no_more_than_the_motion_since_the_start() {
        let mut envelope = Envelope::new(&[[0.0; 3], [0.03, 0.04, 0.0]]);
        envelope.add(&distance(1e-6), 1e-3, 0.02);
        envelope.wait(0.0);
        assert!((envelope.estimate().unwrap().mean - ESTIMATE * 2e-5).abs() < 1e-9);
        assert_eq!(envelope.judge(Status::Ok), Status::Ok);
    }

    #[test]
    fn an_estimate_is_a_number_that_is_not_negative() {
        let distances = [0.0, 1e-3, f32::MIN_POSITIVE, f32::MAX, f32::INFINITY, f32::NAN];
        for (first, second) in distances.into_iter().flat_map(|first| distances.map(|second| (first, second))) {
            for (seconds, waited) in [(0.0, -1.0), (1e-30, 0.0), (1e-3, 1e-3), (1e30, 1e30)] {
                for mut envelope in [later(), Envelope::new(&[[0.0; 3], [0.1; 3]])] {
                    envelope.add(&distance(first), seconds, f32::INFINITY);
                    envelope.add(&distance(second), seconds, f32::INFINITY);
                    envelope.wait(waited);
                    let Estimate { mean, largest, allowed, .. } = envelope.estimate().unwrap();
                    let all = [mean, largest, allowed];
                    assert!(all.iter().all(|value| value.is_finite() && *value >= 0.0), "{first} {second}: {all:?}");
                    assert!(largest >= mean);
                }
            }
        }
    }

    #[test]
    fn an_envelope_follows_at_once_and_forgets_by_half_in_a_fifth_of_a_second() {
        let mut envelope = later();
        envelope.add(&distance(0.004), 0.01, f32::INFINITY);
        envelope.add(&distance(0.0), HALF_LIFE, f32::INFINITY);
        let Estimate { mean, largest, .. } = envelope.estimate().unwrap();
        assert!((mean - ESTIMATE * 0.002).abs() < 1e-8 && (largest - ESTIMATE * 0.004).abs() < 1e-8);
        envelope.add(&distance(0.006), HALF_LIFE, f32::INFINITY);
        assert_eq!(envelope.estimate().unwrap().mean, ESTIMATE * 0.006);
    }

    #[test]
    fn a_step_is_inexact_above_a_share_of_the_motion_or_above_the_tolerance() {
        let mut envelope = later();
        assert_eq!(envelope.judge(Status::Ok), Status::Ok);
        envelope.add(&distance(0.2 * 0.05 / ESTIMATE * 0.99), 0.01, f32::INFINITY);
        assert_eq!(envelope.judge(Status::Ok), Status::Ok);
        envelope.allowed = Allowed::Metres(0.001);
        let Status::Inexact { error, allowed } = envelope.judge(Status::Ok) else { panic!() };
        assert!(error > 0.009 && allowed == 0.001);
        // What is worse stays.
        let limited = Status::Limited { least_volume_ratio: 0.0, saturation: 0.0, energy_excess: 1.0 };
        assert_eq!(envelope.judge(limited), limited);
        envelope.allowed = Allowed::default();
        envelope.add(&distance(f32::NAN), 0.01, f32::INFINITY);
        assert!(matches!(envelope.judge(Status::Ok), Status::Inexact { .. }));
    }

    #[test]
    fn where_nothing_can_be_compared_a_body_at_rest_is_doubted_as_well() {
        for allowed in [Allowed::ShareOfMotion, Allowed::Metres(0.002)] {
            let mut envelope = Envelope { allowed, ..later() };
            envelope.lose(1e-3);
            assert!(matches!(envelope.judge(Status::Ok), Status::Inexact { .. }));
        }
    }

    /// Both runs move by a tenth of a millimetre, and differ by as much: what the body does is not known. Of one that
    /// has moved by more the same error does not count.
    #[test]
    fn an_error_above_the_whole_motion_counts_below_a_millimetre() {
        let (mut still, mut moved) = (later(), later());
        still.add(&Comparison { motion: 1e-4, ..distance(1e-4) }, 1e-3, f32::INFINITY);
        moved.add(&Comparison { motion: 3e-4, ..distance(1e-4) }, 1e-3, f32::INFINITY);
        assert!(matches!(still.judge(Status::Ok), Status::Inexact { .. }));
        assert_eq!(moved.judge(Status::Ok), Status::Ok);
    }

    /// Above what is allowed, which is a share of a finite motion.
    #[test]
    fn a_distance_as_large_as_there_are_numbers_is_inexact() {
        let mut envelope = later();
        envelope.add(&Comparison { motion: f32::MAX, ..distance(f32::MAX / 2.0) }, 1e-3, f32::INFINITY);
        envelope.wait(1e-3);
        let Estimate { mean, largest, allowed, .. } = envelope.estimate().unwrap();
        assert!(mean == f32::MAX && largest == f32::MAX && allowed < mean);
        assert!(matches!(envelope.judge(Status::Ok), Status::Inexact { .. }));
    }

    #[test]
    fn where_nothing_can_be_compared_the_error_may_be_the_whole_motion() {
        let mut envelope = later();
        envelope.add(&distance(0.001), 0.01, f32::INFINITY);
        envelope.lose(0.01);
        assert_eq!(envelope.estimate().unwrap().mean, ESTIMATE * 0.05);
    }
}
