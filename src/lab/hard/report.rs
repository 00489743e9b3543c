//! Judged runs for people and programs: `hard.csv` with a row a run, `hard-frames.csv` with a row a snapshot, a table, and a picture of
//! estimates over true errors. Lengths in mm.

use std::format;
use std::path::Path;
use std::string::String;
use std::vec::Vec;

use super::super::LabError;
use super::super::method::Method;
use super::super::plot::{line, put};
use super::verdict::{Judged, Verdict};
use crate::io::write_atomically;

/// Writes the files into a folder.
pub(super) fn write(judged: &[Judged], out: &Path) -> Result<(), LabError> {
    let heads = "case,method,step_s,times_critical,motion_mm,worst_error_mm,estimate_mm,verdict,silent_snapshots,wrong_from_s,\
                 told_from_s,status,us_per_simulated_second";
    write_atomically(&out.join("hard.csv"), |file| {
        writeln!(file, "{heads}")?;
        judged.iter().try_for_each(|run| writeln!(file, "{}", csv(run)))
    })?;
    write_atomically(&out.join("hard-frames.csv"), |file| {
        writeln!(
            file,
            "case,method,times_critical,time_s,motion_mm,mean_error_mm,largest_error_mm,estimate_mm,largest_estimate_mm,ok"
        )?;
        for run in judged {
            for (at, (frame, motion)) in run.row.frames.iter().zip(&run.motion).enumerate() {
                let time = (at + 1) as f64 * run.interval;
                writeln!(
                    file,
                    "{},{},{:.1},{time:.4},{motion:.5},{:.5},{:.5},{},{},{}",
                    run.row.scene,
                    run.row.method.name(),
                    run.row.step_over_limit_rest,
                    frame.mean,
                    frame.max,
                    optional(frame.estimate.map(|[mean, _]| mean)),
                    optional(frame.estimate.map(|[_, largest]| largest)),
                    frame.ok
                )?;
            }
        }
        Ok(())
    })?;
    let svg = draw(judged);
    write_atomically(&out.join("hard.svg"), |file| file.write_all(svg.as_bytes()))?;
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
        "{},{},{:.4e},{:.1},{:.4},{},{},{},{},{},{},{},{}",
        row.scene,
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

/// Methods in the order of their first run.
fn methods(judged: &[Judged]) -> Vec<Method> {
    let mut methods = Vec::new();
    for run in judged {
        if !methods.contains(&run.row.method) {
            methods.push(run.row.method);
        }
    }
    methods
}

/// A line for each method and step, then one for each silent run.
#[must_use]
pub fn text(judged: &[Judged]) -> String {
    let mut text = String::from(
        "wrong: more than 1 mm and a fifth of the motion so far (mean over the nodes) at a snapshot\n\
         silent: all steps before it were ok; error over estimate: share of the snapshots above 1 and above 2, and the median\n\
         doubted: share of the snapshots within 0.25 mm or a twentieth of the motion that were not ok\n\n\
         method                x critical   runs  right   told  silent  doubted   above 1  above 2  median\n",
    );
    let bands = [(0.0, 14.0), (14.0, 32.0), (32.0, 71.0), (71.0, f64::INFINITY)];
    for method in methods(judged) {
        for (low, high) in bands {
            let runs: Vec<&Judged> = judged
                .iter()
                .filter(|run| run.row.method == method && (low..high).contains(&run.row.step_over_limit_rest))
                .collect();
            if runs.is_empty() {
                continue;
            }
            let count = |wanted| runs.iter().filter(|run| run.verdict() == wanted).count();
            let mut ratios: Vec<f64> = runs.iter().flat_map(|run| run.ratios()).collect();
            ratios.sort_by(f64::total_cmp);
            let above = |limit: f64| {
                let above = ratios.iter().filter(|ratio| **ratio > limit).count();
                100.0 * above as f64 / ratios.len() as f64
            };
            let (good, doubted) = runs.iter().fold((0, 0), |(good, doubted), run| {
                let (more_good, more_doubted) = run.doubted();
                (good + more_good, doubted + more_doubted)
            });
            let steps =
                runs.iter().map(|run| run.row.step_over_limit_rest.ln()).sum::<f64>() / runs.len() as f64;
            text += &format!(
                "{:<21} {:>10.1} {:>6} {:>6} {:>6} {:>7} {:>6.1} %",
                method.name(),
                steps.exp(),
                runs.len(),
                count(Verdict::Right),
                count(Verdict::Told),
                count(Verdict::Silent),
                100.0 * doubted as f64 / good.max(1) as f64
            );
            text += &match ratios.get(ratios.len() / 2) {
                Some(median) => format!(" {:>7.1} % {:>6.1} % {median:>7.2}\n", above(1.0), above(2.0)),
                None => String::from("         -        -       -\n"),
            };
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

/// Estimate over true error at the worst snapshot of each run, of a silent run at the worst that is silent, with logarithmic axes. What
/// is beyond them stands at the edge, and what is silent on top.
fn draw(judged: &[Judged]) -> String {
    const SIZE: f64 = 560.0;
    const MARGIN: f64 = 70.0;
    const DECADES: core::ops::RangeInclusive<i32> = -3..=3;
    let (low, high) = (f64::from(*DECADES.start()), f64::from(*DECADES.end()));
    let along = |value: f64| (value.log10().clamp(low, high) - low) / (high - low) * (SIZE - 2.0 * MARGIN);
    let (x, y) = (|value: f64| MARGIN + along(value), |value: f64| SIZE - MARGIN - along(value));
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{SIZE}\" height=\"{SIZE}\" viewBox=\"0 0 {SIZE} {SIZE}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{SIZE}\" height=\"{SIZE}\" fill=\"white\"/>\n\
         <text x=\"{MARGIN}\" y=\"26\" font-size=\"16\">Hard cases: estimate over true error</text>\n\
         <text x=\"{MARGIN}\" y=\"46\" fill=\"#d55e00\">\u{25cf} silently wrong</text>\n\
         <text x=\"194\" y=\"46\" fill=\"#0072b2\">\u{25cf} right, or told</text>\n\
         <text x=\"312\" y=\"46\" fill=\"#555\">below the line: estimate too low</text>\n"
    );
    for decade in DECADES {
        let at = 10.0_f64.powi(decade);
        let label = match decade {
            decade if decade == *DECADES.start() => format!("\u{2264}{at}"),
            decade if decade == *DECADES.end() => format!("\u{2265}{at}"),
            _ => format!("{at}"),
        };
        line(&mut svg, (x(at), y(1e-3)), (x(at), y(1e3)), "#ddd");
        line(&mut svg, (x(1e-3), y(at)), (x(1e3), y(at)), "#ddd");
        put(
            &mut svg,
            format_args!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
                x(at),
                y(1e-3) + 18.0
            ),
        );
        put(
            &mut svg,
            format_args!(
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                x(1e-3) - 6.0,
                y(at) + 4.0
            ),
        );
    }
    let (silent, others): (Vec<&Judged>, _) = judged.iter().partition(|run| run.verdict() == Verdict::Silent);
    for run in others.into_iter().chain(silent) {
        let (frame, colour, radius, opacity) = match run.worst_silent() {
            Some((frame, ..)) => (Some(frame), "#d55e00", 3.0, 1.0),
            None => (run.worst(), "#0072b2", 2.0, 0.35),
        };
        let Some(frame) = frame else { continue };
        let Some([estimate, _]) = frame.estimate else { continue };
        put(
            &mut svg,
            format_args!(
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{colour}\" fill-opacity=\"{opacity}\"/>",
                x(frame.mean),
                y(estimate)
            ),
        );
    }
    // Above the runs, which may be thousands.
    line(&mut svg, (x(1e-3), y(1e-3)), (x(1e3), y(1e3)), "#000");
    put(
        &mut svg,
        format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">true mean error, mm</text>",
            0.5 * SIZE,
            SIZE - 20.0
        ),
    );
    put(
        &mut svg,
        format_args!(
            "<text transform=\"translate(18 {}) rotate(-90)\" text-anchor=\"middle\">estimate, mm</text>",
            0.5 * SIZE
        ),
    );
    svg += "</svg>\n";
    svg
}
