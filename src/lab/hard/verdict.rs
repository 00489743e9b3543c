//! What was wrong in a run, whether the run told, and how far off its estimates were.

use core::ops::Add;

use super::super::run::{End, Frame, Row, Said};
use super::super::truth::Truth;

/// A mean error below is never wrong, mm.
const LEAST: f64 = 1.0;
/// Nor is one below this share of the motion so far.
const SHARE: f64 = 0.2;

/// A run with what the truth says of it.
#[derive(Clone, Debug)]
pub struct Judged {
    /// What kind of scene it is of.
    pub kind: Kind,
    /// The run.
    pub row: Row,
    /// Mean motion of the nodes in the truth so far, at each snapshot, mm.
    pub motion: Vec<f64>,
    /// Between two snapshots, s.
    pub interval: f64,
}

/// Kinds of scenes.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Kind {
    /// A case made to break a step, or a random scene.
    Hard,
    /// See [`super::press`].
    Press,
    /// See [`super::ordinary`].
    Ordinary,
}

impl Kind {
    /// For tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hard => "hard",
            Self::Press => "press",
            Self::Ordinary => "ordinary",
        }
    }
}

/// Snapshots with an error below a quarter of a millimetre or a twentieth of the motion, and how many of them were not
/// `ok`.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
pub struct Doubted {
    /// All of them.
    pub good: usize,
    /// After a step that was inexact.
    pub inexact: usize,
    /// After steps with another remark, none of them inexact.
    pub limited: usize,
}

impl Add for Doubted {
    type Output = Self;

    fn add(self, more: Self) -> Self {
        let Self { good, inexact, limited } = more;
        Self { good: self.good + good, inexact: self.inexact + inexact, limited: self.limited + limited }
    }
}

/// What became of a run.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Verdict {
    /// Never wrong.
    Right,
    /// Wrong, with a word at every wrong snapshot; or refused.
    Told,
    /// Wrong at a snapshot, and all steps since the one before were `ok`.
    Silent,
}

impl Judged {
    /// A run of a scene with this truth.
    pub(super) fn new(kind: Kind, row: Row, truth: &Truth, interval: f64) -> Self {
        let mut most = 0.0_f64;
        let motion = truth.snapshots.iter().map(|shape| {
            let length = |u: &[f32; 3]| u.iter().map(|u| f64::from(*u).powi(2)).sum::<f64>().sqrt();
            most = most.max(1e3 * shape.iter().map(length).sum::<f64>() / shape.len() as f64);
            most
        });
        Self { kind, motion: motion.collect(), row, interval }
    }

    /// The snapshots that were reached, with the motion so far, mm.
    fn frames(&self) -> impl Iterator<Item = (usize, &Frame, f64)> {
        self.row.frames.iter().zip(&self.motion).enumerate().map(|(at, (frame, motion))| (at, frame, *motion))
    }

    fn wrong(&self) -> impl Iterator<Item = (usize, &Frame)> {
        // An error that is no number is wrong.
        let wrong = |frame: &Frame, motion: f64| frame.mean.is_nan() || frame.mean > LEAST.max(SHARE * motion);
        self.frames().filter(move |(_, frame, motion)| wrong(frame, *motion)).map(|(at, frame, _)| (at, frame))
    }

    /// What became of it.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        if self.wrong().any(|(_, frame)| frame.said.is_ok()) {
            Verdict::Silent
        } else if self.wrong().next().is_some() || self.row.figures().is_none() {
            Verdict::Told
        } else {
            Verdict::Right
        }
    }

    /// Snapshots that are wrong without a word.
    #[must_use]
    pub fn silent(&self) -> usize {
        self.wrong().filter(|(_, frame)| frame.said.is_ok()).count()
    }

    /// Of the snapshots that are wrong without a word the one with the largest mean error, with its time (s) and the
    /// motion so far (mm).
    #[must_use]
    pub fn worst_silent(&self) -> Option<(&Frame, f64, f64)> {
        let silent = self.wrong().filter(|(_, frame)| frame.said.is_ok());
        let (at, frame) = silent.max_by(|(_, a), (_, b)| a.mean.total_cmp(&b.mean))?;
        Some((frame, (at + 1) as f64 * self.interval, self.motion.get(at).copied().unwrap_or_default()))
    }

    /// The snapshot with the largest mean error.
    #[must_use]
    pub fn worst(&self) -> Option<&Frame> {
        self.row.frames.iter().max_by(|a, b| a.mean.total_cmp(&b.mean))
    }

    /// Time of the first wrong snapshot, s.
    #[must_use]
    pub fn wrong_from(&self) -> Option<f64> {
        self.wrong().next().map(|(at, _)| (at + 1) as f64 * self.interval)
    }

    /// Time of the first snapshot before which a step was not `ok`, or of the refusal, s.
    #[must_use]
    pub fn told_from(&self) -> Option<f64> {
        let frame = self.row.frames.iter().position(|frame| !frame.said.is_ok());
        match (frame, &self.row.end) {
            (Some(at), _) => Some((at + 1) as f64 * self.interval),
            (None, End::Diverged(time)) => Some(*time),
            (None, End::Reached(_)) => None,
        }
    }

    /// Mean motion of the truth, mm.
    #[must_use]
    pub fn motion(&self) -> f64 {
        self.motion.last().copied().unwrap_or_default()
    }

    /// True mean errors over estimates, of snapshots with an estimate and an error above a hundredth of a millimetre
    /// and a thousandth of the motion.
    pub fn ratios(&self) -> impl Iterator<Item = f64> {
        self.frames().filter_map(|(_, frame, motion)| {
            (frame.mean > f64::max(0.01, 1e-3 * motion)).then_some(frame.mean / frame.estimate?[0])
        })
    }

    /// See [`Doubted`].
    #[must_use]
    pub fn doubted(&self) -> Doubted {
        let good = self.frames().filter(|(_, frame, motion)| frame.mean <= f64::max(0.25, 0.05 * motion));
        let doubted = good.map(|(_, frame, _)| Doubted {
            good: 1,
            inexact: usize::from(frame.said == Said::Inexact),
            limited: usize::from(frame.said == Said::Limited),
        });
        doubted.fold(Doubted::default(), Add::add)
    }
}

#[cfg(test)]
mod tests {
    use super::Said::{Inexact, Limited, Ok};
    use super::*;
    use crate::measure::Errors;
    use crate::run::Figures;

    fn judged(frames: &[(f64, Said)]) -> Verdict {
        run(frames).verdict()
    }

    /// With motions of 2, 20 and 20 mm so far.
    fn run(frames: &[(f64, Said)]) -> Judged {
        let frames: Vec<Frame> =
            frames.iter().map(|&(mean, said)| Frame { mean, max: mean, estimate: None, said }).collect();
        let figures = Figures { errors: Errors::default(), clip_share: 0.0, us_per_step: 1.0 };
        let row = Row { frames, ..Row::example(End::Reached(figures)) };
        Judged { kind: Kind::Hard, row, motion: vec![2.0, 20.0, 20.0], interval: 0.1 }
    }

    #[test]
    fn wrong_is_above_a_millimetre_and_a_fifth_of_the_motion() {
        assert_eq!(judged(&[(0.9, Ok), (3.9, Ok)]), Verdict::Right);
        assert_eq!(judged(&[(1.1, Inexact), (3.9, Ok)]), Verdict::Told);
        assert_eq!(judged(&[(1.1, Ok), (3.9, Ok)]), Verdict::Silent);
        // A word before or after does not help at the wrong snapshot.
        assert_eq!(judged(&[(0.1, Inexact), (4.1, Ok), (0.1, Inexact)]), Verdict::Silent);
        assert_eq!(judged(&[(0.1, Ok), (f64::NAN, Ok)]), Verdict::Silent);
    }

    #[test]
    fn the_worst_silent_snapshot_is_wrong_and_ok() {
        let run = run(&[(1.1, Ok), (9.0, Inexact), (4.1, Ok)]);
        let (frame, time, motion) = run.worst_silent().unwrap();
        assert_eq!((frame.mean, motion), (4.1, 20.0));
        assert!((time - 0.3).abs() < 1e-12);
    }

    #[test]
    fn a_run_tells_at_the_first_snapshot_that_is_not_ok_or_where_it_is_refused() {
        let told = |ok: [Said; 2], end| {
            let mut run = run(&[(0.1, ok[0]), (0.1, ok[1])]);
            run.row.end = end;
            run.told_from()
        };
        assert_eq!(told([Ok, Inexact], End::Diverged(0.25)), Some(0.2));
        assert_eq!(told([Ok, Ok], End::Diverged(0.25)), Some(0.25));
        assert_eq!(told([Ok, Ok], run(&[]).row.end), None);
    }

    #[test]
    fn a_good_snapshot_that_is_not_ok_is_doubted() {
        let run = run(&[(0.2, Inexact), (0.9, Limited), (1.1, Inexact)]);
        assert_eq!(run.doubted(), Doubted { good: 2, inexact: 1, limited: 1 });
    }
}
