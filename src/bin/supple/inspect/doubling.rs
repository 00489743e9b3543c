//! How long a step may be: each of several lengths is compared with two steps of half of it along the
//! scene's first part. Where a method converges the difference estimates the error of the longer one: it is three
//! quarters of it for a method of second order, half of it for one of first order.
//!
//! A body that hardly moves at any of the lengths passes as well, so the distance moved is printed too, and
//! of a length that passes all shorter ones must pass as well. Where nothing moves nothing is said.

use supple::inertia::Method;
use supple::simulation::Simulation;
use supple::step::{CriticalStep, Divergence};

use super::times::Times;
use crate::problem::Problem;
use crate::report::simulation::shape;
use crate::run::run;
use crate::run::start::Start;
use crate::scene::setup::Setup;
use crate::scene::timing::StepChoice;
use crate::screen::{output, row};

/// Lengths that are tried, times the critical step.
const MULTIPLES: [f32; 6] = [50.0, 40.0, 30.0, 20.0, 10.0, 5.0];
/// The first part of a scene: until its loads, instruments and targets are where they stay, and then this share of it,
/// and at least so many seconds if it has them.
const SHARE: f64 = 0.1;
const LEAST: f64 = 0.2;
/// The runs are compared at most at so many times.
const MOST_LOOKS: u64 = 100;
/// A body that moves less is still, mm.
const STILL: f64 = 1e-3;

/// Multiples whose errors are predicted, and the longest of the two pilots that do it, in the order in which they are
/// tried: a pilot may diverge or be longer than the scene.
const PREDICTED: [f64; 4] = [10.0, 20.0, 50.0, 100.0];
const PILOTS: [f64; 3] = [100.0, 50.0, 25.0];
/// Orders of convergence that are believed.
const ORDERS: (f64, f64) = (1.0, 3.0);

/// Distances over the nodes, mm.
#[derive(Clone, Copy, Default)]
struct Distance {
    /// Largest mean difference between the step and its halves.
    error: f64,
    /// Largest mean displacement.
    moved: f64,
}

/// What came of a length of step.
enum Comparison {
    Distance(Distance),
    Diverged(Divergence),
    /// It is longer than the part of the scene.
    TooLong,
}

/// Runs of a scene by long steps, as `simulate` has them.
pub(crate) struct Pilots {
    setup: Setup,
    /// Of the scene, s.
    end: f64,
}

impl Pilots {
    /// Of a scene, whatever moves it.
    pub(crate) fn new(mut setup: Setup) -> Self {
        (setup.learned, setup.time.is_adaptive) = (None, false);
        Self { end: setup.time.end, setup }
    }

    /// Prints the table of errors, and the longest step that keeps `accuracy` (mm).
    pub(crate) fn recommend(
        &mut self,
        method: &Method,
        bound: CriticalStep,
        accuracy: f64,
        times: &Times,
    ) -> Result<(), Problem> {
        let span = (self.last_change() + (SHARE * self.end).max(LEAST)).min(self.end);
        output!("\nlong steps, their error estimated by two of half their length, over the first {span:.3} s");
        output!(
            "{:<21} {:>12} {:>14} {:>14} {:>17}",
            "step",
            "seconds",
            "estimate, mm",
            "moved, mm",
            "real-time factor"
        );
        let (mut longest, mut unbroken, mut is_still) = (None, true, true);
        let mut rows = vec![];
        for multiple in MULTIPLES.into_iter().rev() {
            let seconds = multiple * bound.seconds;
            let comparison = self.compare(method, seconds, span)?;
            let words = match &comparison {
                Comparison::Distance(Distance { error, moved }) => {
                    unbroken &= *error < accuracy;
                    is_still &= *moved < STILL;
                    let factor = f64::from(seconds) / times.long;
                    format!("{error:>14.4} {moved:>14.3} {factor:>17.3}")
                }
                Comparison::Diverged(divergence) => {
                    (unbroken, is_still) = (false, false);
                    format!(" diverged at {:.6} s", divergence.time)
                }
                Comparison::TooLong => {
                    unbroken = false;
                    " longer than this part of the scene".into()
                }
            };
            if let (true, Comparison::Distance(distance)) = (unbroken, &comparison) {
                longest = Some((multiple, distance.error));
            }
            rows.push(format!("{:<21} {seconds:>12.3e} {words}", format!("{multiple}x")));
        }
        rows.iter().rev().for_each(|row| output!("{row}"));
        let words = match longest {
            Some(_) if is_still => format!("none: the scene does not move in its first {span:.3} s"),
            Some((multiple, error)) => {
                format!("method = \"long\", step = \"{multiple}x\" (about {error:.3} mm off, {accuracy} mm allowed)")
            }
            None => format!("method = \"exact\": none of these long steps stays below {accuracy} mm"),
        };
        row("recommended", words);
        Ok(())
    }

    /// Prints the errors that long steps will have at the worst moment of the whole scene. Step doubling at two lengths
    /// gives the order of convergence `p`: `|u_2D - u_D| = (2^p - 1) E(D)`, and `E` goes with `D^p`.
    pub(crate) fn predict_errors(&mut self, method: &Method, bound: CriticalStep) -> Result<(), Problem> {
        for longest in PILOTS {
            let end = self.end;
            let mut pilot = |multiple: f64| self.compare(method, multiple as f32 * bound.seconds, end);
            let Comparison::Distance(long) = pilot(longest)? else { continue };
            let Comparison::Distance(short) = pilot(0.5 * longest)? else { continue };
            if short.moved < STILL {
                row("expected error", "not foretold: the scene does not move");
                return Ok(());
            }
            let order = (long.error / short.error).log2();
            // No error has no order.
            let order = if order.is_finite() { order.clamp(ORDERS.0, ORDERS.1) } else { ORDERS.0 };
            let shortest = 0.25 * longest;
            let error = short.error / (order.exp2() - 1.0);
            let words =
                PREDICTED.map(|multiple| format!("{:.3} mm at {multiple}x", error * (multiple / shortest).powf(order)));
            row("expected error", words.join(", "));
            row(
                "",
                format!("from pilots at {longest} to {shortest}x that moved {:.3} mm; order {order:.1}", short.moved),
            );
            return Ok(());
        }
        row("expected error", "not foretold: pilots diverge or are longer than the scene");
        Ok(())
    }

    /// When loads have risen, and instruments and targets are at the ends of their paths, s.
    fn last_change(&self) -> f64 {
        let Setup { instruments, pulls, .. } = &self.setup;
        let mut last = f64::from(self.setup.longest_ramp());
        loop {
            match instruments.next_turn(last).min(pulls.next_turn(last)) {
                turn if turn.is_finite() => last = turn,
                _ => return last,
            }
        }
    }

    /// One length of step compared with its half, over `span` seconds.
    fn compare(&mut self, method: &Method, seconds: f32, span: f64) -> Result<Comparison, Problem> {
        let steps = (span / f64::from(seconds)) as u64;
        if steps == 0 {
            return Ok(Comparison::TooLong);
        }
        let between = steps.div_ceil(MOST_LOOKS);
        let looks = steps / between;
        let time = &mut self.setup.time;
        (time.method, time.frames) = (Some(*method), looks as u32);
        time.end = (looks * between) as f64 * f64::from(seconds);
        let mut whole = vec![];
        if let Some(divergence) = self.run(seconds, &mut |shape| whole.push(shape))? {
            return Ok(Comparison::Diverged(divergence));
        }
        let (mut furthest, mut first) = (Distance::default(), None);
        let mut shapes = whole.into_iter();
        let mut enter = |half: Vec<[f32; 3]>| {
            let Some(whole) = shapes.next() else { return };
            let first = first.get_or_insert_with(|| half.clone());
            furthest.error = furthest.error.max(mean_distance(&whole, &half));
            furthest.moved = furthest.moved.max(mean_distance(first, &half));
        };
        match self.run(0.5 * seconds, &mut enter)? {
            Some(divergence) => Ok(Comparison::Diverged(divergence)),
            None => Ok(Comparison::Distance(furthest)),
        }
    }

    /// The scene by steps of so many seconds; `look` is shown the displacements at each frame.
    fn run(&mut self, seconds: f32, look: &mut dyn FnMut(Vec<[f32; 3]>)) -> Result<Option<Divergence>, Problem> {
        self.setup.time.step = StepChoice::Seconds(seconds);
        let start = Start::new(&self.setup, false)?;
        let mut frame = |simulation: &mut Simulation<'_>| {
            look(shape(simulation.state()));
            Ok(())
        };
        let (_, outcome) = run(&self.setup, start, &|_| {}, &mut frame)?;
        Ok(outcome.divergence)
    }
}

/// Over the nodes, mm.
fn mean_distance(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let distance = |(a, b): (&[f32; 3], &[f32; 3])| length([0, 1, 2].map(|axis| a[axis] - b[axis]));
    1e3 * a.iter().zip(b).map(distance).sum::<f64>() / a.len() as f64
}

fn length(vector: [f32; 3]) -> f64 {
    vector.iter().map(|component| f64::from(component * component)).sum::<f64>().sqrt()
}
