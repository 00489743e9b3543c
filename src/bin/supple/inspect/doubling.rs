//! How long a step may be: each of several lengths is compared with two steps of half of it along the
//! scene's first part. Where a method converges the difference estimates the error of the longer one: it is three
//! quarters of it for a method of second order, half of it for one of first order.
//!
//! A body that hardly moves at any of the lengths passes as well, so the distance moved is printed too, and
//! of a length that passes all shorter ones must pass as well.

use supple::inertia::Method;
use supple::loads::Loads;
use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::step::{CriticalStep, Divergence, Status};

use super::times::{Times, Walker};
use crate::problem::Problem;
use crate::scene::setup::Setup;
use crate::screen::{output, row};

/// Lengths that are tried, times the critical step.
const MULTIPLES: [f32; 6] = [50.0, 40.0, 30.0, 20.0, 10.0, 5.0];
/// The first part of a scene: this share of it, and at least so many seconds if it has them.
const SHARE: f64 = 0.1;
const LEAST: f64 = 0.2;

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

/// Prints the table of errors, and the longest step that keeps `accuracy` (mm).
pub(crate) fn recommend(
    method: &Method,
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    loads: &Loads<'_>,
    bound: CriticalStep,
    accuracy: f64,
    times: &Times,
) -> Result<(), Problem> {
    let span = (SHARE * setup.time.end).max(LEAST).min(setup.time.end);
    output!("\nlong steps, their error estimated by two of half their length, over the first {span:.3} s");
    output!("{:<21} {:>12} {:>14} {:>14} {:>17}", "step", "seconds", "estimate, mm", "moved, mm", "real-time factor");
    let mut longest = None;
    let mut unbroken = true;
    let mut rows = vec![];
    for multiple in MULTIPLES.into_iter().rev() {
        let seconds = multiple * bound.seconds;
        let comparison = compare(setup, scene, loads, seconds, span, method)?;
        let words = match &comparison {
            Comparison::Distance(Distance { error, moved }) => {
                unbroken &= *error < accuracy;
                let factor = f64::from(seconds) / times.long;
                format!("{error:>14.4} {moved:>14.3} {factor:>17.3}")
            }
            Comparison::Diverged(divergence) => {
                unbroken = false;
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
    match longest {
        Some((multiple, error)) => row(
            "recommended",
            format!("method = \"long\", step = \"{multiple}x\" (about {error:.3} mm off, {accuracy} mm allowed)"),
        ),
        None => row("recommended", format!("method = \"exact\": none of these long steps stays below {accuracy} mm")),
    }
    Ok(())
}

/// Prints the errors that long steps will have at the worst moment of the whole scene. Step doubling at two lengths
/// gives the order of convergence `p`: `|u_2D - u_D| = (2^p - 1) E(D)`, and `E` goes with `D^p`.
pub(crate) fn predict_errors(
    method: &Method,
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    loads: &Loads<'_>,
    bound: CriticalStep,
) -> Result<(), Problem> {
    for longest in PILOTS {
        let pilot =
            |multiple: f64| compare(setup, scene, loads, multiple as f32 * bound.seconds, setup.time.end, method);
        let Comparison::Distance(long) = pilot(longest)? else { continue };
        let Comparison::Distance(short) = pilot(0.5 * longest)? else { continue };
        let order = (long.error / short.error).log2();
        // No motion has no order.
        let order = if order.is_finite() { order.clamp(ORDERS.0, ORDERS.1) } else { ORDERS.0 };
        let shortest = 0.25 * longest;
        let error = short.error / (order.exp2() - 1.0);
        let words =
            PREDICTED.map(|multiple| format!("{:.3} mm at {multiple}x", error * (multiple / shortest).powf(order)));
        row("expected error", words.join(", "));
        row("", format!("from pilots at {longest} to {shortest}x that moved {:.3} mm; order {order:.1}", short.moved));
        return Ok(());
    }
    row("expected error", "not foretold: pilots diverge or are longer than the scene");
    Ok(())
}

/// One length of step compared with its half, from rest over `span` seconds.
fn compare(
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    loads: &Loads<'_>,
    seconds: f32,
    span: f64,
    method: &Method,
) -> Result<Comparison, Problem> {
    let steps = (span / f64::from(seconds)) as u64;
    if steps == 0 {
        return Ok(Comparison::TooLong);
    }
    let mut whole = Walker::new(method, setup, scene, seconds)?;
    let mut half = Walker::new(method, setup, scene, 0.5 * seconds)?;
    let mut furthest = Distance::default();
    for _ in 0..steps {
        for turn in 0..3 {
            let walker = if turn == 0 { &mut whole } else { &mut half };
            if let Status::Diverged(divergence) = walker.step(scene, loads) {
                return Ok(Comparison::Diverged(divergence));
            }
        }
        let (mut error, mut moved) = (0.0, 0.0);
        for (a, b) in whole.state.displacements().iter().zip(half.state.displacements()) {
            error += length([0, 1, 2].map(|axis| a.to_array()[axis] - b.to_array()[axis]));
            moved += length(b.to_array());
        }
        let scale = 1e3 / scene.node_count() as f64;
        furthest.error = furthest.error.max(scale * error);
        furthest.moved = furthest.moved.max(scale * moved);
    }
    Ok(Comparison::Distance(furthest))
}

fn length(vector: [f32; 3]) -> f64 {
    vector.iter().map(|component| f64::from(component * component)).sum::<f64>().sqrt()
}
