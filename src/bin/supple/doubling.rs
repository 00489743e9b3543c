//! How long a step may be: each of several lengths is compared with two steps of half of it along the
//! scene's first part. Where a method converges the difference estimates the error of the longer one: it is three
//! quarters of it for a method of second order, half of it for one of first order.
//!
//! A body that hardly moves at any of the lengths passes as well, so the distance moved stands beside it, and
//! of a length that passes all shorter ones must pass too.

use supple::loads::Loads;
use supple::material::Material;
use supple::tled::{CriticalStep, Divergence, Status, Step};

use crate::cost::Times;
use crate::inspect::row;
use crate::large_steps::{Grid, HostInertia};
use crate::prepare::{HostScene, HostState, Setup};
use crate::scene_file::Problem;
use crate::timing::Method;

/// Lengths that are tried, times the critical step.
const MULTIPLES: [f32; 6] = [50.0, 40.0, 30.0, 20.0, 10.0, 5.0];
/// The first part of a scene: this share of it, and at least so many seconds if it has them.
const SHARE: f64 = 0.1;
const LEAST: f64 = 0.2;

/// Multiples whose errors are foretold, and the longest of the two pilots that do it: the next if one of them
/// diverges or is longer than the scene.
const FORETOLD: [f64; 4] = [10.0, 20.0, 50.0, 100.0];
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
enum Found {
    Distance(Distance),
    Diverged(Divergence),
    /// It is longer than the part of the scene.
    TooLong,
}

/// Prints the table of errors, and the longest step that keeps `accuracy` (mm).
pub(crate) fn recommend<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    loads: &Loads<'_>,
    bound: CriticalStep,
    accuracy: f64,
    times: &Times,
) -> Result<(), Problem> {
    let (method, grid) = judged(setup, scene)?;
    let span = (SHARE * setup.time.end).max(LEAST).min(setup.time.end);
    println!(
        "\n{} steps, their error estimated by two of half their length, over the first {span:.3} s",
        method.name()
    );
    println!(
        "{:<21} {:>12} {:>14} {:>14} {:>17}",
        "step", "seconds", "estimate, mm", "moved, mm", "real-time factor"
    );
    let mut best = None;
    let mut unbroken = true;
    let mut rows = vec![];
    for multiple in MULTIPLES.into_iter().rev() {
        let seconds = multiple * bound.seconds;
        let found = compare(setup, scene, loads, seconds, span, grid)?;
        let words = match &found {
            Found::Distance(Distance { error, moved }) => {
                unbroken &= *error < accuracy;
                let factor = f64::from(seconds) / times.of(method);
                format!("{error:>14.4} {moved:>14.3} {factor:>17.3}")
            }
            Found::Diverged(divergence) => {
                unbroken = false;
                format!(" diverged at {:.6} s", divergence.time)
            }
            Found::TooLong => {
                unbroken = false;
                " longer than this part of the scene".into()
            }
        };
        if let (true, Found::Distance(distance)) = (unbroken, &found) {
            best = Some((multiple, distance.error));
        }
        rows.push(format!("{:<21} {seconds:>12.3e} {words}", format!("{multiple}x")));
    }
    rows.iter().rev().for_each(|row| println!("{row}"));
    match best {
        Some((multiple, error)) => row(
            "recommended",
            format!(
                "method = \"{}\", step = \"{multiple}x\" (about {error:.3} mm off, {accuracy} mm allowed)",
                method.name()
            ),
        ),
        None => row(
            "recommended",
            format!("method = \"tled\": none of these {} steps stays below {accuracy} mm", method.name()),
        ),
    }
    Ok(())
}

/// The method that long steps of the scene would have, with its lattice.
fn judged<M: Material>(setup: &Setup, scene: &HostScene<M>) -> Result<(Method, Grid), Problem> {
    Ok(match setup.time.method {
        Method::MassScaled => (Method::MassScaled, Grid::NONE),
        with_lattice @ (Method::Multilevel | Method::Damped) => (with_lattice, Grid::wanted(setup, scene)?),
        Method::Tled => match Grid::suggested(setup, scene) {
            grid if grid.functions == 0 => (Method::MassScaled, Grid::NONE),
            grid => (Method::Multilevel, grid),
        },
    })
}

/// Prints the errors that long steps will have at the worst moment of the whole scene. Step doubling at two lengths
/// gives the order of convergence `p`: `|u_2D - u_D| = (2^p - 1) E(D)`, and `E` goes with `D^p`.
pub(crate) fn foretell<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    loads: &Loads<'_>,
    bound: CriticalStep,
) -> Result<(), Problem> {
    let (method, grid) = judged(setup, scene)?;
    for longest in PILOTS {
        let pilot = |multiple: f64| {
            compare(setup, scene, loads, multiple as f32 * bound.seconds, setup.time.end, grid)
        };
        let Found::Distance(long) = pilot(longest)? else { continue };
        let Found::Distance(short) = pilot(0.5 * longest)? else { continue };
        let order = (long.error / short.error).log2();
        // No motion has no order.
        let order = if order.is_finite() { order.clamp(ORDERS.0, ORDERS.1) } else { ORDERS.0 };
        let shortest = 0.25 * longest;
        let error = short.error / (order.exp2() - 1.0);
        let words = FORETOLD
            .map(|multiple| format!("{:.3} mm at {multiple}x", error * (multiple / shortest).powf(order)));
        row("expected error", format!("{}, {}", words.join(", "), method.name()));
        row(
            "",
            format!(
                "from pilots at {longest} to {shortest}x that moved {:.3} mm; order {order:.1}",
                short.moved
            ),
        );
        return Ok(());
    }
    row(
        "expected error",
        format!("not foretold: {} pilots diverge or are longer than the scene", method.name()),
    );
    Ok(())
}

/// One length of step beside its half, from rest over `span` seconds.
fn compare<M: Material>(
    setup: &Setup,
    scene: &HostScene<M>,
    loads: &Loads<'_>,
    seconds: f32,
    span: f64,
    grid: Grid,
) -> Result<Found, Problem> {
    let steps = (span / f64::from(seconds)) as u64;
    if steps == 0 {
        return Ok(Found::TooLong);
    }
    let mut whole = Walker::new(setup, scene, seconds, grid)?;
    let mut half = Walker::new(setup, scene, 0.5 * seconds, grid)?;
    let mut furthest = Distance::default();
    for _ in 0..steps {
        for turn in 0..3 {
            let walker = if turn == 0 { &mut whole } else { &mut half };
            if let Status::Diverged(divergence) = walker.inertia.step(scene, loads, &mut walker.state) {
                return Ok(Found::Diverged(divergence));
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
    Ok(Found::Distance(furthest))
}

fn length(vector: [f32; 3]) -> f64 {
    vector.iter().map(|component| f64::from(component * component)).sum::<f64>().sqrt()
}

/// A scene on its way with one length of step.
struct Walker {
    state: HostState,
    inertia: HostInertia,
}

impl Walker {
    fn new<M: Material>(
        setup: &Setup,
        scene: &HostScene<M>,
        seconds: f32,
        grid: Grid,
    ) -> Result<Self, Problem> {
        let step = Step::insist(seconds, setup.damping).map_err(|error| Problem(error.to_string()))?;
        let mut state = setup.state();
        let inertia = grid
            .prepare(setup, scene, &mut state, step)
            .map_err(|error| Problem(format!("{}: {error}", setup.body.name)))?;
        Ok(Self { state, inertia })
    }
}
