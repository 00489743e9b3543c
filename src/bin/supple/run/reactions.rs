//! What the instruments of a scene felt: means over short intervals, taken down step by step.

use std::fmt::Write as _;

use supple::contact::Touch;
use supple::state::StateView;

use crate::scene::timing::Timing;

/// Intervals of a simulation, and at most so many seconds each, a frame of a display.
const INTERVALS: f64 = 200.0;
const LONGEST: f64 = 1.0 / 60.0;

/// An interval of one instrument: sums over its steps, then means.
#[derive(Clone, Copy, Default)]
struct Interval {
    force: [f64; 3],
    steps: f64,
    contacts: u32,
    depth: f32,
}

/// The intervals of all instruments.
#[derive(Clone)]
pub(crate) struct Reactions {
    /// s.
    interval: f64,
    next: f64,
    current: Vec<Interval>,
    /// The time at which each interval ends, s, and the intervals of the instruments.
    rows: Vec<(f64, Vec<Interval>)>,
}

/// Where the reactions were, to take back steps.
pub(crate) struct Mark {
    next: f64,
    current: Vec<Interval>,
    rows: usize,
}

impl Reactions {
    pub(crate) const NONE: Self = Self { interval: 0.0, next: 0.0, current: vec![], rows: vec![] };

    pub(crate) fn new(instruments: usize, time: &Timing) -> Self {
        let interval = (time.end / INTERVALS).min(LONGEST);
        Self { interval, next: interval, current: vec![Interval::default(); instruments], rows: vec![] }
    }

    /// Takes down what a step's instruments felt.
    pub(crate) fn enter(&mut self, state: &StateView<'_>) {
        if self.current.is_empty() {
            return;
        }
        for (interval, Touch { force, contacts, depth, .. }) in self.current.iter_mut().zip(state.touches()) {
            for (sum, force) in interval.force.iter_mut().zip(force) {
                *sum += f64::from(*force);
            }
            interval.steps += 1.0;
            interval.contacts = interval.contacts.max(*contacts);
            interval.depth = interval.depth.max(*depth);
        }
        let time = state.time();
        if time < self.next * (1.0 - 1e-9) {
            return;
        }
        let mean = |mut interval: Interval| {
            interval.force = interval.force.map(|sum| sum / interval.steps.max(1.0));
            interval
        };
        self.rows.push((time, self.current.iter().copied().map(mean).collect()));
        self.current.fill(Interval::default());
        self.next = self.interval * ((time / self.interval * (1.0 + 1e-9)).floor() + 1.0);
    }

    pub(crate) fn mark(&self) -> Mark {
        Mark { next: self.next, current: self.current.clone(), rows: self.rows.len() }
    }

    /// Takes back the steps since the mark.
    pub(crate) fn take_back(&mut self, mark: &Mark) {
        self.next = mark.next;
        self.current.clone_from(&mark.current);
        self.rows.truncate(mark.rows);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.current.is_empty()
    }

    /// The largest mean force on each instrument, N, with its time, s, its contacts and depth, m.
    pub(crate) fn largest(&self) -> Vec<(f64, f64, u32, f32)> {
        let of = |index: usize| {
            let rows = self.rows.iter().map(|(time, of)| (length(of[index].force), *time, of[index]));
            let most = rows.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
            (most.0, most.1, most.2.contacts, most.2.depth)
        };
        (0..self.current.len()).map(of).collect()
    }

    /// Of each instrument: times, s, and mean forces, N.
    pub(crate) fn forces(&self) -> Vec<Vec<(f64, f64)>> {
        let of = |index: usize| self.rows.iter().map(move |(time, of)| (*time, length(of[index].force)));
        (0..self.current.len()).map(|index| of(index).collect()).collect()
    }

    /// `reactions.csv`.
    pub(crate) fn table(&self) -> String {
        let mut text = String::from("time_s,instrument,fx,fy,fz,contacts,depth_m\n");
        for (time, intervals) in &self.rows {
            for (instrument, Interval { force: [x, y, z], contacts, depth, .. }) in intervals.iter().enumerate() {
                // Writing to a string does not fail.
                let _ = writeln!(text, "{time:.6},{instrument},{x:.6e},{y:.6e},{z:.6e},{contacts},{depth:.6e}");
            }
        }
        text
    }
}

fn length(force: [f64; 3]) -> f64 {
    force.iter().map(|component| component * component).sum::<f64>().sqrt()
}
