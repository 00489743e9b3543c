//! Judged runs for people and programs: `hard.csv` with a row a run, `hard-frames.csv` with a row a snapshot, a table.
//! Lengths in mm.

use core::ops::Add;
use std::path::Path;

use supple::io::write_atomically;

use super::super::LabError;
use super::super::evaluate::unique;
use super::super::method::Method;
use super::verdict::{Doubted, Judged, Kind, Verdict};

/// Writes the files into a folder.
pub(super) fn write(judged: &[Judged], out: &Path) -> Result<(), LabError> {
    let heads = "case,kind,method,step_s,times_critical,motion_mm,worst_error_mm,estimate_mm,verdict,silent_snapshots,wrong_from_s,\
                 told_from_s,status,us_per_simulated_second";
    write_atomically(&out.join("hard.csv"), |file| {
        writeln!(file, "{heads}")?;
        judged.iter().try_for_each(|run| writeln!(file, "{}", csv(run)))
    })?;
    write_atomically(&out.join("hard-frames.csv"), |file| {
        writeln!(
            file,
            "case,kind,method,times_critical,time_s,motion_mm,mean_error_mm,largest_error_mm,estimate_mm,largest_estimate_mm,\
             said"
        )?;
        for run in judged {
            for (at, (frame, motion)) in run.row.frames.iter().zip(&run.motion).enumerate() {
                let time = (at + 1) as f64 * run.interval;
                writeln!(
                    file,
                    "{},{},{},{:.1},{time:.4},{motion:.5},{:.5},{:.5},{},{},{}",
                    run.row.scene,
                    run.kind.name(),
                    run.row.method.name(),
                    run.row.step_over_limit_rest,
                    frame.mean,
                    frame.max,
                    optional(frame.estimate.map(|[mean, _]| mean)),
                    optional(frame.estimate.map(|[_, largest]| largest)),
                    frame.said.name()
                )?;
            }
        }
        Ok(())
    })?;
    Ok(())
}

fn optional(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.5}"))
}

const fn name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Right => "right",
        Verdict::Told => "told",
        Verdict::Silent => "silent",
    }
}

fn csv(run: &Judged) -> String {
    let (row, worst) = (&run.row, run.worst());
    format!(
        "{},{},{},{:.4e},{:.1},{:.4},{},{},{},{},{},{},{},{}",
        row.scene,
        run.kind.name(),
        row.method.name(),
        row.step,
        row.step_over_limit_rest,
        run.motion(),
        optional(worst.map(|frame| frame.mean)),
        optional(worst.and_then(|frame| Some(frame.estimate?[0]))),
        name(run.verdict()),
        run.silent(),
        optional(run.wrong_from()),
        optional(run.told_from()),
        row.end,
        optional(row.figures().map(|figures| figures.us_per_step / row.step)),
    )
}

/// A line for each kind of scenes, method and step, then one for each silent run.
#[must_use]
pub fn text(judged: &[Judged]) -> String {
    let mut text = String::from(
        "wrong: more than 1 mm and a fifth of the motion so far (mean over the nodes) at a snapshot\n\
         silent: all steps before it were ok; error over estimate: share of the snapshots above 1 and above 2, and the median\n\
         doubted: share of the snapshots within 0.25 mm or a twentieth of the motion that were inexact, and limited without it\n\n\
         scenes   method                x critical   runs  right   told  silent  inexact limited   above 1  above 2  median\n",
    );
    let bands = [(0.0, 14.0), (14.0, 32.0), (32.0, 71.0), (71.0, f64::INFINITY)];
    for kind in [Kind::Hard, Kind::Press, Kind::Ordinary] {
        for method in unique(judged.iter().map(|run| run.row.method)) {
            for (low, high) in bands {
                let of = |run: &&Judged| {
                    let Judged { row, .. } = run;
                    run.kind == kind && row.method == method && (low..high).contains(&row.step_over_limit_rest)
                };
                let runs: Vec<&Judged> = judged.iter().filter(of).collect();
                if !runs.is_empty() {
                    text += &line(kind, method, &runs);
                }
            }
        }
    }
    let silent: Vec<&Judged> = judged.iter().filter(|run| run.verdict() == Verdict::Silent).collect();
    text += &format!("\n{} of {} runs are silently wrong\n", silent.len(), judged.len());
    for run in silent {
        let Some((frame, time, motion)) = run.worst_silent() else { continue };
        text += &format!(
            "  {:<24} {:<21} {:>6.1}x  off by {:.2} of {motion:.2} mm at {time:.2} s\n",
            run.row.scene,
            run.row.method.name(),
            run.row.step_over_limit_rest,
            frame.mean,
        );
    }
    text
}

/// Of these runs, at least one.
fn line(kind: Kind, method: Method, runs: &[&Judged]) -> String {
    let count = |wanted| runs.iter().filter(|run| run.verdict() == wanted).count();
    let mut ratios: Vec<f64> = runs.iter().flat_map(|run| run.ratios()).collect();
    ratios.sort_by(f64::total_cmp);
    let above = |limit: f64| {
        let above = ratios.iter().filter(|ratio| **ratio > limit).count();
        100.0 * above as f64 / ratios.len() as f64
    };
    let Doubted { good, inexact, limited } = runs.iter().map(|run| run.doubted()).fold(Doubted::default(), Add::add);
    let share = |doubted: usize| 100.0 * doubted as f64 / good.max(1) as f64;
    let steps = runs.iter().map(|run| run.row.step_over_limit_rest.ln()).sum::<f64>() / runs.len() as f64;
    let mut line = format!(
        "{:<8} {:<21} {:>10.1} {:>6} {:>6} {:>6} {:>7} {:>6.1} % {:>5.1} %",
        kind.name(),
        method.name(),
        steps.exp(),
        runs.len(),
        count(Verdict::Right),
        count(Verdict::Told),
        count(Verdict::Silent),
        share(inexact),
        share(limited),
    );
    line += &match ratios.get(ratios.len() / 2) {
        Some(median) => format!(" {:>7.1} % {:>6.1} % {median:>7.2}\n", above(1.0), above(2.0)),
        None => String::from("         -        -       -\n"),
    };
    line
}
