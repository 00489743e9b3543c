//! When does a step change its length? Lengths are numbered by how often the longest one is halved; exact steps are the
//! last. An error that one length makes grows about as its power 1.5 (measured: between 1 and 2), so an estimate above
//! the tolerance says by how many halvings the step is too long, and one far below it that the next longer step would
//! do.

use crate::guard::{ESTIMATE, exceeds};

/// Power of the length with which errors grow.
const ORDER: f32 = 1.5;
/// Share of the tolerance that is aimed at.
const AIM: f32 = 0.7;
/// Comparisons and seconds that a longer step has to wait for after a change.
const COMPARISONS: u32 = 3;
const WAIT: f32 = 0.02;
/// Seconds within which a shortened step is shortened again only if the error grows by this factor.
const SETTLE: f32 = 0.1;
const GROWTH: f32 = 1.25;
/// By which factor it must have fallen for the shortened step to be kept for as long again.
const FALL: f32 = 0.9;
/// Least time in which a body forgets half of an error, s; that of the guard's envelope. A vibration needs `2 ln 2 /
/// mu`.
const HALF_LIFE: f32 = 0.2;
/// Least and most time between two probes, least length of a probe, s, and its least number of comparisons.
const REST: [f32; 2] = [0.05, 1.6];
const PROBE: f32 = 0.04;
const PROBE_COMPARISONS: u32 = 8;
/// A probe comes before its time where the kinetic energy has fallen to this share of what it was at the end of the last,
/// of the largest ones at either time, halved in so many seconds.
const QUIETER: f64 = 0.25;
const KINETIC_HALF_LIFE: f32 = 0.1;
/// An instrument or the target of a pull that comes by so many tolerances in a step, and twice as fast as any in the last
/// [`HALF_LIFE`] or so, is met by exact steps.
const LONG_WAY: f32 = 4.0;
const FASTER: f32 = 2.0;
/// Most halvings: more are beyond single precision in any case.
const MOST: u32 = 16;

/// How many lengths there are beyond the critical step, at least one, if the longest is so many times the least.
pub(super) fn lengths(ratio: f32) -> u32 {
    (0..MOST).take_while(|&halvings| halvings == 0 || libm::exp2f(halvings as f32) <= ratio).count() as u32
}

/// The present length, and what is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Control {
    tolerance: f32,
    /// Time in which the body forgets half of an error, s; infinite without damping.
    half_life: f32,
    lengths: u32,
    halvings: u32,
    /// Halvings with which the length is no longer than the present call, or half of the one before: a short call among others
    /// changes nothing. And that, as a share of the longest length.
    of_call: u32,
    call: f32,
    /// Since the latest change, or since a probe has begun or ended.
    seconds: f32,
    comparisons: u32,
    /// Estimate of the mean error at the latest shortening, m.
    error: f32,
    /// Estimates of the mean and the largest error that exact steps began with, m, halved every `half_life`.
    left_behind: [f32; 2],
    probe: Probe,
    /// Time to the next probe, s.
    rest: f32,
    /// Largest mean distance in the present probe, m.
    distance: f32,
    /// Of the fastest instrument or target, m/s, halved every [`HALF_LIFE`].
    speed: f32,
    /// The largest kinetic energy, J, halved every [`KINETIC_HALF_LIFE`]; and at the end of the latest probe.
    kinetic: f64,
    kinetic_of_probe: f64,
}

/// While exact steps move the first run, the second run takes some steps now and then, to see whether they would do.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Probe {
    None,
    Begins,
    Runs,
}

impl Control {
    /// Begins with exact steps.
    pub(super) fn new(tolerance: f32, lengths: u32, damping: f32) -> Self {
        Self {
            half_life: (2.0 * core::f32::consts::LN_2 / damping).max(HALF_LIFE),
            tolerance,
            lengths,
            halvings: lengths,
            of_call: 0,
            call: 0.0,
            seconds: 0.0,
            comparisons: 0,
            error: 0.0,
            left_behind: [0.0; 2],
            probe: Probe::Begins,
            rest: REST[0],
            distance: 0.0,
            speed: 0.0,
            kinetic: 0.0,
            kinetic_of_probe: 0.0,
        }
    }

    pub(super) const fn lengths(&self) -> u32 {
        self.lengths
    }

    /// How often the longest step is halved; none for exact steps.
    pub(super) fn halvings(&self) -> Option<u32> {
        (self.halvings < self.lengths).then_some(self.halvings)
    }

    /// The same of the second run; none: twice the longest.
    pub(super) const fn halvings_of_second(&self) -> Option<u32> {
        self.halvings.checked_sub(1)
    }

    /// See [`super::Chooser::estimate`].
    pub(super) const fn left_behind(&self) -> [f32; 2] {
        self.left_behind
    }

    /// So many seconds have passed.
    pub(super) fn wait(&mut self, seconds: f32) {
        self.seconds += seconds;
        let kept = libm::exp2f(-seconds / self.half_life);
        self.left_behind = self.left_behind.map(|error| kept * error);
    }

    /// A call begins that lasts so many times the longest length. No step is longer than a call, and the second run's steps
    /// belong to the length: with one far longer than that, it would be compared too seldom.
    pub(super) fn enter_call(&mut self, ratio: f32) {
        self.call = ratio.max(0.5 * self.call);
        let is_shorter = |&halvings: &u32| libm::exp2f(-(halvings as f32)) <= self.call;
        self.of_call = (0..self.lengths).find(is_shorter).unwrap_or(self.lengths);
    }

    /// Whether the length is to change as soon as it can, as it is more than twice that of the call.
    pub(super) const fn is_far_longer_than_call(&self) -> bool {
        self.halvings + 1 < self.of_call
    }

    /// Enters how far (m) instruments and targets go in a step of so many seconds. Gives whether exact steps are to meet them.
    pub(super) fn enter_way(&mut self, way: f32, seconds: f32) -> bool {
        let (before, speed) = (libm::exp2f(-seconds / HALF_LIFE) * self.speed, way / seconds);
        self.speed = speed.max(before);
        exceeds(way, LONG_WAY * self.tolerance) && speed > FASTER * before
    }

    /// Enters the kinetic energy (J) after an exact step of so many seconds.
    pub(super) fn enter_kinetic(&mut self, kinetic: f64, seconds: f32) {
        self.kinetic = kinetic.max(f64::from(libm::exp2f(-seconds / KINETIC_HALF_LIFE)) * self.kinetic);
    }

    /// Exact steps follow, with a probe at once; these estimates of the mean and the largest error are left behind, m.
    pub(super) fn go_exactly(&mut self, errors: [f32; 2]) {
        self.shorten(MOST, errors);
        self.probe = Probe::Begins;
    }

    /// Whether a probe begins with the next step.
    pub(super) fn begins_probe(&mut self) -> bool {
        let is_quieter = self.kinetic < QUIETER * self.kinetic_of_probe && self.seconds >= REST[0];
        let may_lengthen = self.of_call < self.lengths;
        if self.probe == Probe::None && may_lengthen && (is_quieter || self.seconds >= self.rest) {
            self.probe = Probe::Begins;
        }
        let begins = self.probe == Probe::Begins;
        if begins {
            self.probe = Probe::Runs;
            self.changed();
        }
        begins
    }

    /// Whether the second run follows exact steps at present.
    pub(super) fn probes(&self) -> bool {
        self.probe == Probe::Runs
    }

    /// A comparison in a probe found this mean distance, m.
    pub(super) fn probed(&mut self, distance: f32) {
        self.comparisons += 1;
        // One that is no number stays.
        self.distance = if distance <= self.distance { self.distance } else { distance };
        if exceeds(ESTIMATE * self.distance, self.tolerance) {
            self.rest();
        }
    }

    /// Decides upon the end of a probe. Gives whether steps beyond the critical one follow. An error that a body
    /// forgets by half in [`HALF_LIFE`] grows for about so long.
    pub(super) fn ends_probe(&mut self) -> bool {
        if !self.probes() || self.comparisons < PROBE_COMPARISONS || self.seconds < PROBE {
            return false;
        }
        let error = ESTIMATE * self.distance * (HALF_LIFE / self.seconds).max(1.0);
        let share = (error + self.left_behind[0]) / self.tolerance;
        self.rest();
        // The probe has shown what the shortest length would do.
        share <= AIM && self.lengthen()
    }

    /// Ends a probe without a result. Each is followed by a longer rest than the one before.
    pub(super) fn rest(&mut self) {
        (self.probe, self.kinetic_of_probe) = (Probe::None, self.kinetic);
        let [_, most] = REST;
        self.rest = (2.0 * self.rest).min(most);
        self.changed();
    }

    /// Decides after a comparison with steps beyond the critical one, which gave these estimates of the mean and the
    /// largest error (m). Gives whether the length is to change.
    pub(super) fn decide(&mut self, [mean, largest]: [f32; 2]) -> bool {
        self.comparisons += 1;
        let share = mean / self.tolerance;
        if exceeds(share, 1.0) {
            let grows = exceeds(mean, GROWTH * self.error);
            if self.seconds < SETTLE && !grows {
                return false;
            }
            if mean < FALL * self.error {
                // The body forgets what longer steps have left behind.
                self.error = mean;
                self.changed();
                return false;
            }
            let halvings = libm::ceilf(libm::log2f(share / AIM) / ORDER);
            let halvings = if halvings >= 1.0 { (halvings as u32).min(MOST) } else { MOST };
            self.shorten(halvings, [mean, largest]);
            return true;
        }
        if self.is_far_longer_than_call() {
            self.shorten(self.of_call - self.halvings, [mean, largest]);
            return true;
        }
        self.comparisons >= COMPARISONS && self.seconds >= WAIT && share * libm::exp2f(ORDER) <= AIM && self.lengthen()
    }

    /// Doubles the length. Gives whether it could.
    fn lengthen(&mut self) -> bool {
        let longer = self.halvings > self.of_call;
        if longer {
            self.halvings -= 1;
            self.changed();
        }
        longer
    }

    /// A step was refused: the next are half as long.
    pub(super) fn refused(&mut self, errors: [f32; 2]) {
        self.shorten(1, errors);
    }

    fn shorten(&mut self, halvings: u32, [mean, largest]: [f32; 2]) {
        self.halvings = (self.halvings + halvings).min(self.lengths);
        self.error = mean;
        if self.halvings == self.lengths {
            self.left_behind = [mean, largest];
            self.rest = REST[0];
        }
        self.changed();
    }

    const fn changed(&mut self) {
        (self.seconds, self.comparisons, self.distance) = (0.0, 0, 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TOLERANCE: f32 = 1e-3;
    const LENGTHS: u32 = 5;
    const DAMPING: f32 = 20.0;

    /// Beyond the critical step, after so many halvings and a long time.
    fn running(halvings: u32) -> Control {
        Control {
            halvings,
            probe: Probe::None,
            seconds: 10.0,
            comparisons: 10,
            ..Control::new(TOLERANCE, LENGTHS, DAMPING)
        }
    }

    #[test]
    fn lengths_are_halved_down_to_the_least() {
        assert_eq!([0.1, 1.0, 1.9, 2.0, 17.0, f32::NAN, f32::INFINITY].map(lengths), [1, 1, 1, 2, 5, 1, MOST]);
    }

    #[test]
    fn a_probe_that_shows_little_error_ends_exact_steps() {
        for (distance, longer) in [(0.01, true), (0.1, false), (f32::NAN, false)] {
            let mut control = Control::new(TOLERANCE, LENGTHS, DAMPING);
            assert!(control.begins_probe() && control.probes() && !control.begins_probe());
            let mut ended = false;
            for _ in 0..2 * PROBE_COMPARISONS {
                control.wait(PROBE / PROBE_COMPARISONS as f32);
                control.probed(distance * TOLERANCE);
                ended |= control.ends_probe();
            }
            assert_eq!((ended, control.halvings()), (longer, longer.then_some(LENGTHS - 1)), "{distance}");
        }
    }

    #[test]
    fn rests_between_probes_become_longer() {
        let mut control = Control::new(TOLERANCE, LENGTHS, DAMPING);
        let mut begun = 0;
        for _ in 0..1000 {
            begun += u32::from(control.begins_probe());
            if control.probes() {
                control.probed(TOLERANCE);
            }
            control.wait(0.01);
        }
        assert!((5..=12).contains(&begun), "{begun} probes in 10 s");
    }

    #[test]
    fn a_small_error_doubles_the_length_and_a_large_one_divides_it() {
        let mut control = running(3);
        assert!(control.decide([0.2 * TOLERANCE; 2]) && control.halvings() == Some(2));
        // Not at once again.
        assert!(!control.decide([0.2 * TOLERANCE; 2]));
        let mut control = running(1);
        assert!(!control.decide([0.9 * TOLERANCE; 2]));
        assert!(control.decide([4.0 * TOLERANCE; 2]) && control.halvings() == Some(3));
        // As large as before: what was wrong stays for a while.
        control.wait(0.5 * SETTLE);
        assert!(!control.decide([4.0 * TOLERANCE; 2]));
        // Larger: the steps are still too long.
        assert!(control.decide([8.0 * TOLERANCE; 2]) && control.halvings().is_none());
        assert_eq!(control.left_behind(), [8.0 * TOLERANCE; 2]);
        control.wait(HALF_LIFE);
        assert!((control.left_behind()[0] - 4.0 * TOLERANCE).abs() < 1e-6);
    }

    #[test]
    fn without_damping_nothing_is_forgotten() {
        let mut control = Control { halvings: LENGTHS - 1, ..Control::new(TOLERANCE, LENGTHS, 0.0) };
        control.refused([TOLERANCE; 2]);
        control.wait(100.0);
        assert_eq!(control.left_behind(), [TOLERANCE; 2]);
    }

    #[test]
    fn an_error_that_falls_keeps_the_length() {
        let mut control = running(0);
        assert!(control.decide([2.0 * TOLERANCE; 2]));
        let shortened = control.halvings();
        for share in [1.7, 1.5, 1.3, 1.1] {
            control.wait(SETTLE);
            assert!(!control.decide([share * TOLERANCE; 2]) && control.halvings() == shortened);
        }
    }

    #[test]
    fn an_error_that_is_no_number_and_refusals_shorten_the_steps() {
        let mut control = running(1);
        assert!(control.decide([f32::NAN; 2]) && control.halvings().is_none());
        let mut control = running(1);
        control.refused([0.0; 2]);
        assert_eq!(control.halvings(), Some(2));
    }
}
