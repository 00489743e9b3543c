//! Does an adaptive step keep its tolerance, and what does it cost? Each scene is run with a tolerance, and by fixed
//! steps of all lengths that divide its snapshots; the best of these by hand is the fastest whose error, known from the
//! truth, never exceeds the tolerance. Lengths in mm, times in microseconds for a simulated second.

use std::path::Path;
use std::time::Instant;

use supple::adaptive::{Adaptive, Request, Taken};
use supple::inertia::{self, Cells};
use supple::io::write_atomically;
use supple::step::{Status, Step};

use super::LabError;
use super::hard::{Plan as Scenes, TIMES_CRITICAL};
use super::measure::Errors;
use super::method::Method;
use super::run;
use super::scenes::SceneSpec;
use super::threads::in_parallel;
use super::truth::Truth;

/// The longest step that is tried, over the critical one.
const LONGEST: u32 = TIMES_CRITICAL[TIMES_CRITICAL.len() - 1];

/// What a scene gave with a tolerance.
#[derive(Clone, Debug)]
pub struct ToleranceRow {
    /// The scene.
    pub scene: &'static str,
    /// The mean error of the nodes that was accepted, mm.
    pub tolerance: f64,
    /// The largest mean displacement of the nodes at a snapshot, mm.
    pub motion: f64,
    /// The largest mean error of the nodes at a snapshot, mm; infinite if a step was refused.
    pub error: f64,
    /// Shares of the snapshots with a status other than `ok` before them, and with an error above the tolerance without
    /// one.
    pub doubted: f64,
    /// See [`ToleranceRow::doubted`].
    pub silent: f64,
    /// Of the adaptive step, us.
    pub time: f64,
    /// Steps and changes of their length.
    pub taken: Taken,
    /// The best fixed step: its method, its length over the critical step, its time, us.
    pub best: Option<(&'static str, f64, f64)>,
}

/// A fixed step that was tried.
struct Fixed {
    method: &'static str,
    times_critical: f64,
    error: f64,
    time: f64,
}

/// Carries the plan's scenes out on two threads, for each tolerance (mm); its methods are the fixed steps. Writes
/// `tolerance.csv`.
pub fn evaluate(
    plan: &Scenes,
    tolerances: &[f64],
    out: &Path,
    say: impl Fn(&str) + Sync,
) -> Result<Vec<ToleranceRow>, LabError> {
    let judge = |index: usize| {
        let Some((spec, truth)) = plan.scene(index, out)? else { return Ok(Vec::new()) };
        say(&format!("{}: moves by {:.1} mm", spec.name, 1e3 * truth.most()));
        rows(&spec, &truth, plan, tolerances)
    };
    let rows = in_parallel(plan.scenes(), judge, |_, _| ())?.concat();
    write_atomically(&out.join("tolerance.csv"), |file| {
        writeln!(
            file,
            "case,tolerance_mm,motion_mm,worst_error_mm,doubted,silent,us_per_simulated_second,exact_steps,large_steps,changes,\
             best_fixed,best_times_critical,best_us_per_simulated_second"
        )?;
        rows.iter().try_for_each(|row: &ToleranceRow| writeln!(file, "{}", csv(row)))
    })?;
    Ok(rows)
}

fn rows(spec: &SceneSpec, truth: &Truth, plan: &Scenes, tolerances: &[f64]) -> Result<Vec<ToleranceRow>, LabError> {
    let mut fixed = Vec::new();
    let limit = truth.limit_at_rest as f32;
    let exact = run::run(spec, truth, Method::Tled, 1)?;
    fixed.extend(entry(&exact));
    for &method in &plan.methods {
        let mut multiples: Vec<u32> = (1..=spec.timing.interval)
            .filter(|&multiple| {
                let times = multiple as f32 * spec.timing.step / limit;
                spec.timing.hits_snapshots(multiple) && (3.0..1.5 * LONGEST as f32).contains(&times)
            })
            .collect();
        // A ladder is enough.
        let mut last = 0;
        multiples.retain(|&multiple| {
            let keep = multiple as f32 > 1.25 * last as f32;
            last = if keep { multiple } else { last };
            keep
        });
        for multiple in multiples {
            match run::run(spec, truth, method, multiple) {
                Err(LabError::Inertia(_)) => {}
                row => fixed.extend(entry(&row?)),
            }
        }
    }
    let motion = Errors::of_hold(truth)?.largest_mean();
    tolerances
        .iter()
        .map(|&tolerance| {
            let run = run_adaptive(spec, truth, tolerance)?;
            let right = fixed.iter().filter(|fixed| fixed.error <= tolerance);
            let best = right.min_by(|a, b| a.time.total_cmp(&b.time));
            let best = best.map(|best| (best.method, best.times_critical, best.time));
            Ok(ToleranceRow { scene: spec.name, tolerance, motion, best, ..run })
        })
        .collect()
}

fn entry(row: &run::Row) -> Option<Fixed> {
    let figures = row.figures()?;
    Some(Fixed {
        method: row.method.name(),
        times_critical: row.step_over_limit_rest,
        error: figures.errors.largest_mean(),
        time: figures.us_per_step / row.step,
    })
}

fn run_adaptive(spec: &SceneSpec, truth: &Truth, tolerance: f64) -> Result<ToleranceRow, LabError> {
    let scene = spec.build()?;
    let mut state = spec.state(&scene, spec.timing.step / spec.timing.refinement as f32)?;
    let interval = spec.timing.interval_seconds();
    let parts = (interval / (f64::from(LONGEST) * truth.limit_at_rest)).ceil().max(1.0);
    let longest = Step::unchecked((interval / parts) as f32, spec.damping)?;
    let request = Request { tolerance: (1e-3 * tolerance) as f32, longest };
    let method = inertia::Method::new(Cells::Suggested);
    let mut adaptive = Adaptive::prepare_in_vec(method, scene.view(), &spec.points, state.view(), request)?;
    let mut loads = spec.loads(&scene)?;
    let mut errors = Errors::default();
    let (mut taken, mut spent) = (Taken::default(), 0.0);
    let (mut doubted, mut silent, mut refused) = (0, 0, false);
    for _ in 0..spec.intervals {
        let mut ok = true;
        let start = Instant::now();
        for _ in 0..parts as u32 {
            let (status, more) = adaptive.advance(longest.seconds(), scene.view(), &mut loads, state.view());
            taken = taken + more;
            ok &= status == Status::Ok;
            refused |= !status.is_taken();
        }
        spent += start.elapsed().as_secs_f64();
        errors.add_snapshot(truth, state.displacements())?;
        doubted += u32::from(!ok);
        silent += u32::from(ok && errors.mean() > tolerance);
        if refused {
            break;
        }
    }
    let share = |count: u32| f64::from(count) / spec.intervals as f64;
    Ok(ToleranceRow {
        scene: spec.name,
        tolerance,
        motion: 0.0,
        error: if refused { f64::INFINITY } else { errors.largest_mean() },
        doubted: share(doubted),
        silent: share(silent),
        time: 1e6 * spent / state.time(),
        taken,
        best: None,
    })
}

fn csv(row: &ToleranceRow) -> String {
    let (name, times, time) = row.best.unwrap_or(("", f64::NAN, f64::NAN));
    format!(
        "{},{},{:.4},{:.5},{:.3},{:.3},{:.1},{},{},{},{name},{times:.1},{time:.1}",
        row.scene,
        row.tolerance,
        row.motion,
        row.error,
        row.doubted,
        row.silent,
        row.time,
        row.taken.exact,
        row.taken.large,
        row.taken.changes,
    )
}

/// A line for each tolerance.
#[must_use]
pub fn text(rows: &[ToleranceRow]) -> String {
    let mut tolerances: Vec<f64> = rows.iter().map(|row| row.tolerance).collect();
    tolerances.sort_by(f64::total_cmp);
    tolerances.dedup();
    let mut text = String::from(
        "error: the largest mean error of the nodes at a snapshot, over the tolerance; time: over that of the best fixed step\n\
         by hand, exact ones included; silent: snapshots above the tolerance with all steps ok; doubted: snapshots with another status\n\n\
         tolerance mm   runs  error median, 90 %, worst  above  time median, 90 %  silent  doubted\n",
    );
    for tolerance in tolerances {
        let rows = || rows.iter().filter(|row| row.tolerance == tolerance);
        let sorted = |mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            values
        };
        let errors = sorted(rows().map(|row| row.error / tolerance).collect());
        let times = sorted(rows().filter_map(|row| Some(row.time / row.best?.2)).collect());
        let at = |values: &[f64], share: f64| {
            let index = (share * values.len().saturating_sub(1) as f64).round() as usize;
            values.get(index).copied().unwrap_or(f64::NAN)
        };
        let mean = |value: fn(&ToleranceRow) -> f64| 100.0 * rows().map(value).sum::<f64>() / errors.len() as f64;
        let above = errors.iter().filter(|error| **error > 1.0).count();
        text += &format!(
            "{tolerance:12.2} {:6} {:9.2} {:7.2} {:7.1} {above:6} {:9.2} {:7.2} {:7.2} % {:6.1} %\n",
            errors.len(),
            at(&errors, 0.5),
            at(&errors, 0.9),
            at(&errors, 1.0),
            at(&times, 0.5),
            at(&times, 0.9),
            mean(|row| row.silent),
            mean(|row| row.doubted),
        );
    }
    text
}
