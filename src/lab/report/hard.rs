//! Hard cases: are runs ever wrong without a word, and do estimates of the error follow the true one?

use crate::evaluate::unique;
use crate::hard::report;
use crate::hard::verdict::{Judged, Verdict};
use supple_cli::report::made::Made;
use supple_cli::report::plots::{self, COLOURS, Curve, DashType, GREY, MarkerSymbol, short};
use supple_cli::report::{Figure, Panel, ReportPart, Section};

pub(crate) const NAME: &str = "hard";

/// Runs whose errors are drawn over time: the worst that are silent, then the worst others.
const DRAWN: usize = 60;

pub(crate) fn part(judged: &[Judged]) -> ReportPart {
    let seeds = "random scene N is made from the number N alone";
    let mut section = estimates(judged);
    section.listing = Some(report::text(judged));
    ReportPart { made: Made::by_this_command(seeds), sections: vec![section, over_time(judged)] }
}

fn words(run: &Judged) -> String {
    let Judged { row, .. } = run;
    let said = match run.verdict() {
        Verdict::Right => "right",
        Verdict::Told => "wrong, and told",
        Verdict::Silent => "silently wrong",
    };
    format!("{}, {}, {:.0}x the critical step: {said}", row.scene, row.method.name(), row.step_over_limit_rest)
}

/// Estimate over true error at the worst snapshot of each run.
fn estimates(judged: &[Judged]) -> Section {
    let mut curves = vec![];
    let worst = |run: &Judged| {
        let frame = run.worst_silent().map(|(frame, ..)| frame).or_else(|| run.worst())?;
        let [estimate, _] = frame.estimate?;
        (frame.mean > 0.0 && estimate > 0.0).then_some((frame.mean, estimate))
    };
    for (index, method) in unique(judged.iter().map(|run| run.row.method)).into_iter().enumerate() {
        let of = judged.iter().filter(|run| run.row.method == method);
        let points: Vec<_> = of.filter_map(|run| Some((worst(run)?, run))).collect();
        let said = points.iter().map(|((error, estimate), run)| {
            format!("{}<br>off by {} mm, estimate {} mm", words(run), short(*error), short(*estimate))
        });
        let (x, y) = points.iter().map(|(point, _)| *point).unzip();
        if points.is_empty() {
            continue;
        }
        let symbol = [MarkerSymbol::Circle, MarkerSymbol::Square][index / COLOURS.len() % 2];
        let curve = Curve::new(method.name(), x, y).coloured(COLOURS[index % COLOURS.len()]);
        curves.push(curve.points().marked(symbol).saying(said.collect()));
    }
    let silent = judged.iter().filter(|run| run.verdict() == Verdict::Silent);
    let (points, said): (Vec<_>, Vec<_>) = silent.filter_map(|run| Some((worst(run)?, words(run)))).unzip();
    if !points.is_empty() {
        let (x, y) = points.into_iter().unzip();
        let curve = Curve::new("silently wrong", x, y).coloured("#e0202a").points();
        curves.push(curve.marked(MarkerSymbol::X).saying(said));
    }
    let ends = [1e-3, 1e2];
    curves.push(Curve::new("estimate = error", ends.to_vec(), ends.to_vec()).coloured(GREY));
    let plot = plots::logarithms("true mean error, mm", "estimate, mm", curves);
    let caption = "A point is a run at its worst snapshot. Above the line the estimate is larger than the error, below it is too low.";
    Section {
        title: "Hard cases: is a run ever wrong without a word?".into(),
        figures: vec![Figure::choice(caption, vec![Panel::new("estimates", plot)])],
        ..Section::default()
    }
}

fn over_time(judged: &[Judged]) -> Section {
    let mut runs: Vec<&Judged> = judged
        .iter()
        .filter(|run| run.row.frames.iter().any(|frame| frame.estimate.is_some() && frame.mean > 0.0))
        .collect();
    let share = |run: &Judged| run.worst().map_or(0.0, |frame| frame.mean) / run.motion().max(1.0);
    runs.sort_by(|a, b| {
        let silent = |run: &Judged| run.verdict() == Verdict::Silent;
        silent(b).cmp(&silent(a)).then(share(b).total_cmp(&share(a)))
    });
    // Some of the usual ones as well: every so many after the worst half.
    let (worst, others) = runs.split_at(runs.len().min(DRAWN / 2));
    let stride = (others.len() / (DRAWN / 2)).max(1);
    let panels = worst.iter().chain(others.iter().step_by(stride)).map(|run| {
        let times: Vec<f64> = (1..=run.motion.len()).map(|count| count as f64 * run.interval).collect();
        let frames = &run.row.frames;
        let reached = times[..frames.len()].to_vec();
        let error = frames.iter().map(|frame| frame.mean).collect();
        let (at, estimate): (Vec<_>, Vec<_>) =
            times.iter().zip(frames).filter_map(|(time, frame)| Some((*time, frame.estimate?[0]))).unzip();
        let told =
            times.iter().zip(frames).filter(|(_, frame)| !frame.said.is_ok()).map(|(time, frame)| (*time, frame.mean));
        let (told_at, told): (Vec<_>, Vec<_>) = told.unzip();
        let curves = vec![
            Curve::new("true mean error", reached, error).coloured(COLOURS[1]),
            Curve::new("estimate", at, estimate).coloured(COLOURS[0]).dashed(DashType::Dash),
            Curve::new("status is not ok", told_at, told)
                .coloured(COLOURS[1])
                .points()
                .marked(MarkerSymbol::CircleOpen),
            Curve::new("mean motion so far", times, run.motion.clone()).coloured(GREY).dashed(DashType::Dot),
        ];
        Panel::new(words(run), plots::over_time("mm", curves))
    });
    let caption = "The true mean error of the nodes and its estimate while running, next to the motion so far. A ring is a snapshot before which a step was not ok. \
                   Silent runs come first, then those with the largest errors, then some of all others.";
    Section {
        title: "Error over time and its estimate".into(),
        figures: vec![Figure::choice(caption, panels.collect())],
        ..Section::default()
    }
}
