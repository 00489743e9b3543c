//! Steps side by side on one body: a table for the screen and the report, shapes at the end, error over time with its
//! estimate.

use super::bodies::{distances, lengths, mean_millimetres};
use super::made::Made;
use super::plots::{self, COLOURS, Curve, DashType, GREY, short};
use super::simulation::body;
use super::{Figure, Panel, ReportPart, Section, Table};
use crate::run::outcome::Outcome;
use crate::scene::setup::Setup;

/// Displacement of each node, m.
type Shape = Vec<[f32; 3]>;

/// One instrument and what moved the body under it; the first run is the exact one.
pub(crate) struct Compared {
    pub(crate) instrument: &'static str,
    pub(crate) runs: Vec<Run>,
}

pub(crate) struct Run {
    pub(crate) setup: Setup,
    pub(crate) name: &'static str,
    /// Its outcome with a shape for each frame, or why there is none.
    pub(crate) done: Result<(Outcome, Vec<Shape>), String>,
}

impl Run {
    pub(crate) fn outcome(&self) -> Option<&Outcome> {
        self.done.as_ref().ok().map(|(outcome, _)| outcome)
    }

    fn shapes(&self) -> &[Shape] {
        self.done.as_ref().map_or(&[], |(_, shapes)| shapes)
    }
}

/// Mean errors of the nodes at the frames of a run, mm.
fn errors(exact: &[Shape], shapes: &[Shape]) -> Vec<f64> {
    exact.iter().zip(shapes).map(|(exact, shape)| mean_millimetres(&distances(exact, shape))).collect()
}

fn still(exact: &[Shape]) -> Vec<f64> {
    exact.iter().map(|shape| mean_millimetres(&lengths(shape))).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

const COLUMNS: usize = 8;

const HEADS: [&str; COLUMNS] = [
    "steps",
    "length, ms",
    "s for a simulated second",
    "guard, s",
    "real-time factor",
    "error, mm",
    "standing still, mm",
    "status",
];

fn rows(case: &Compared) -> Vec<[String; COLUMNS]> {
    let exact = case.runs.first().map_or(&[][..], Run::shapes);
    let row = |(index, run): (usize, &Run)| {
        let (outcome, shapes) = match &run.done {
            Ok(done) => done,
            Err(_) => {
                let mut row = [""; COLUMNS].map(String::from);
                (row[0], row[COLUMNS - 1]) = (run.name.into(), "refused".into());
                return row;
            }
        };
        let reached = outcome.frames.last().map_or(0.0, |frame| frame.time);
        let [spent, guarding] = [outcome.spent, outcome.guarding].map(|spent| spent.as_secs_f64());
        let error = if index == 0 { "reference".into() } else { short(mean(&errors(exact, shapes))) };
        [
            run.name.into(),
            format!("{:.2}", 1e3 * outcome.steps.1),
            short((spent - guarding) / reached.max(1e-9)),
            if outcome.guard.is_some() { short(guarding / reached.max(1e-9)) } else { "none".into() },
            short(reached / spent.max(1e-9)),
            error,
            short(mean(&still(exact))),
            outcome.status().into(),
        ]
    };
    case.runs.iter().enumerate().map(row).collect()
}

/// The table on the screen.
pub(crate) fn table(cases: &[Compared]) -> String {
    let rows: Vec<_> = cases.iter().map(rows).collect();
    let mut widths = HEADS.map(str::len);
    for row in rows.iter().flatten() {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.len().max(*width);
        }
    }
    let line = |cells: [&str; COLUMNS]| {
        let cells = cells.iter().zip(widths).enumerate().map(|(column, (cell, width))| match column {
            0 | 7 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        format!("{}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    let mut text = line(HEADS);
    for (case, rows) in cases.iter().zip(&rows) {
        text += &format!("{}:\n", case.instrument);
        text.extend(rows.iter().map(|row| line(row.each_ref().map(String::as_str))));
        text.extend(notes(case).iter().map(|note| format!("  {note}\n")));
    }
    text
}

/// How to read the table, and what it says of this body.
pub(crate) fn about(cases: &[Compared]) -> String {
    let fastest = |case: &Compared| {
        let time = |run: &Run| run.outcome().map(|outcome| outcome.spent.as_secs_f64());
        let exact = case.runs.first().and_then(time);
        exact.is_some_and(|exact| case.runs.iter().skip(1).filter_map(time).all(|other| exact < 1.3 * other))
    };
    let mut text = String::from(
        "Errors: distance to the exact steps, mean over nodes and time; standing still: that of a lobe that never moves. The guard, a second\n\
         run, estimates the error meanwhile. Real-time factor: simulated over computing time with the guard; above 1 is faster than real time.",
    );
    if cases.iter().all(fastest) {
        text += "\nThis lobe is soft and coarse: exact steps are fast enough, and longer ones with their guard gain little. They do where elements are\n\
                 small or stiff and the motion is slow (docs/benchmarks.md).";
    }
    text
}

/// What a status alone does not tell.
fn notes(case: &Compared) -> Vec<String> {
    let of_run = |run: &Run| {
        let name = run.name;
        let outcome = match &run.done {
            Err(why) => return vec![format!("{name}: refused: {why}")],
            Ok((outcome, _)) => outcome,
        };
        let fell_back = outcome.learned.as_ref().and_then(|trace| trace.fell_back.as_ref());
        let fell_back =
            fell_back.map(|(time, why)| format!("{name}: exact steps from {time:.3} s on, as the learned step {why}"));
        let inexact = outcome.guard.and_then(|guard| Some((guard.inexact, guard.first?)));
        let inexact = inexact.map(|(steps, (time, error, allowed))| {
            let [error, allowed] = [error, allowed].map(|metres| 1e3 * f64::from(metres));
            format!(
                "{name}: inexact in {steps} of {} steps, first at {time:.3} s: the error was estimated at {error:.2} mm, above {allowed:.2} mm, a \
                 fifth of the motion until then",
                outcome.computed
            )
        });
        fell_back.into_iter().chain(inexact).collect()
    };
    case.runs.iter().flat_map(of_run).collect()
}

/// What the words mean, for who has not read a page.
const TERMS: [&str; 2] = [
    "Exact steps (TLED) stay below the critical step. Long ones are ten times as long as it: inertia is added where a step would be unstable, and given back to \
             smooth motion. The learned step is a network that predicts accelerations over 1.5 ms, seven times the critical step; it follows a lead-in of 0.3 s of exact ones, comes \
             with the crate, and learned from a twisted bar, not from this lobe.",
    "Errors are distances to the exact steps, mean over nodes and time; next to them stands the error of a lobe that never moves. The guard is a second run, which \
             estimates the error while the simulation runs; a step is inexact where the estimate exceeds a fifth of the motion so far. The table has the longest step of each run.",
];

pub(crate) fn part(cases: &[Compared]) -> ReportPart {
    let mut sections: Vec<_> = cases.iter().map(section).collect();
    if let Some(first) = sections.first_mut() {
        first.paragraphs.splice(0..0, TERMS.map(String::from));
    }
    ReportPart { made: Made::by_this_command("none"), sections }
}

fn section(case: &Compared) -> Section {
    let exact = case.runs.first().map_or(&[][..], Run::shapes);
    let heads = HEADS.map(String::from).to_vec();
    let rows = rows(case).into_iter().map(Vec::from).collect();
    let ended: Vec<(&Run, &Shape, f64)> = case
        .runs
        .iter()
        .filter_map(|run| Some((run, run.shapes().last()?, run.outcome()?.frames.last()?.time)))
        .collect();
    let most = exact.last().map_or(0.0, |shape| lengths(shape).into_iter().fold(1e-6, f64::max));
    let bodies = ended.iter().map(|(run, shape, time)| {
        Panel::new(format!("{} steps", run.name), body(&run.setup, shape, &lengths(shape), *time, most))
    });
    let bodies = Figure::grid(
        "The lobe at the end, coloured by displacement; red: nodes that forceps grip. Turn one and all turn.",
        bodies.collect(),
        ended.len(),
        1e3 * most,
        "displacement",
    );
    Section {
        title: capitalised(case.instrument),
        paragraphs: notes(case),
        tables: vec![Table { title: "steps side by side".into(), heads, rows }],
        figures: std::iter::once(bodies).chain(where_off(&ended)).chain([over_time(case, exact)]).collect(),
        ..Section::default()
    }
}

/// Where longer steps are off at the end.
fn where_off(ended: &[(&Run, &Shape, f64)]) -> Option<Figure> {
    let ((_, exact, _), others) = ended.split_first()?;
    let off: Vec<Vec<f64>> = others.iter().map(|(_, shape, _)| distances(exact, shape)).collect();
    let most = off.iter().flatten().fold(1e-6, |a: f64, b| a.max(*b));
    let panels = others.iter().zip(&off).map(|((run, shape, time), off)| {
        Panel::new(format!("{} steps", run.name), body(&run.setup, shape, off, *time, most))
    });
    let columns = ended.len();
    let caption = "The same, coloured by the distance to the exact steps.";
    (!others.is_empty())
        .then(|| Figure::grid(caption, panels.collect(), columns, 1e3 * most, "distance to the exact steps"))
}

fn over_time(case: &Compared, exact: &[Shape]) -> Figure {
    let mut curves = vec![];
    for (index, run) in case.runs.iter().enumerate().skip(1) {
        let Some(outcome) = run.outcome() else { continue };
        let colour = COLOURS[index % COLOURS.len()];
        let times: Vec<f64> = outcome.frames.iter().map(|frame| frame.time).collect();
        // A run that ends early has one shape more, that of its end.
        let (times, errors): (Vec<_>, Vec<_>) = times.into_iter().zip(errors(exact, run.shapes())).unzip();
        curves.push(Curve::new(format!("{}: error", run.name), times, errors).coloured(colour));
        let estimated = outcome.frames.iter().filter_map(|frame| Some((frame.time, frame.estimate?)));
        let (at, estimates) = estimated.map(|(time, estimate)| (time, 1e3 * f64::from(estimate.mean))).unzip();
        curves
            .push(Curve::new(format!("{}: estimate", run.name), at, estimates).coloured(colour).dashed(DashType::Dash));
    }
    let times = case
        .runs
        .first()
        .and_then(Run::outcome)
        .map_or(vec![], |outcome| outcome.frames.iter().map(|frame| frame.time).collect());
    curves.push(Curve::new("standing still", times, still(exact)).coloured(GREY).dashed(DashType::Dot));
    let plot = plots::over_time("mean over the nodes, mm", curves);
    Figure::choice(
        "Error against exact steps, and what the guard estimates of it while running, without exact steps.",
        vec![Panel::new("error", plot)],
    )
}

fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
