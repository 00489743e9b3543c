//! Steps side by side on one body: a table for the screen and the report, shapes at the end, error over time with its
//! estimate.

use super::bodies::{distances, distances_from_mean, mean_millimetres, moved as at};
use super::made::Made;
use super::plots::{self, COLOURS, Curve, DashType, GREY, short};
use super::simulation::{body, moving};
use super::{Figure, Panel, ReportPart, Section, Table};
use crate::run::outcome::Outcome;
use crate::scene::setup::Setup;

/// Displacement of each node, m.
type Shape = Vec<[f32; 3]>;

/// Steps side by side; the first run is the exact one.
pub(crate) struct Compared {
    /// The node that has to be met, in the middle of the tumour.
    pub(crate) target: usize,
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

/// Mean distances of the nodes to the exact ones at the frames of a run, mm.
fn errors(exact: &[Shape], shapes: &[Shape]) -> Vec<f64> {
    exact.iter().zip(shapes).map(|(exact, shape)| mean_millimetres(&distances(exact, shape))).collect()
}

/// The same of one node.
fn errors_at(node: usize, exact: &[Shape], shapes: &[Shape]) -> Vec<f64> {
    let pairs = exact.iter().zip(shapes);
    pairs.map(|(exact, shape)| mean_millimetres(&distances(&[exact[node]], &[shape[node]]))).collect()
}

/// How far the nodes have moved since the first frame, mean, mm.
fn moved(exact: &[Shape]) -> Vec<f64> {
    exact.iter().map(|shape| mean_millimetres(&distances(shape, &exact[0]))).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Simulated over computing time, the guard included.
fn real_time(outcome: &Outcome) -> f64 {
    let reached = outcome.frames.last().map_or(0.0, |frame| frame.time);
    reached / outcome.spent.as_secs_f64().max(1e-9)
}

const COLUMNS: usize = 7;

const HEADS: [&str; COLUMNS] =
    ["steps", "length, ms", "times real time", "from exact, mm", "at the tumour, mm", "guard's estimate, mm", "status"];

fn rows(compared: &Compared) -> Vec<[String; COLUMNS]> {
    let exact = compared.runs.first().map_or(&[][..], Run::shapes);
    let row = |(index, run): (usize, &Run)| {
        let Ok((outcome, shapes)) = &run.done else {
            let mut row = [""; COLUMNS].map(String::from);
            (row[0], row[COLUMNS - 1]) = (run.name.into(), "refused".into());
            return row;
        };
        let of = |errors: Vec<f64>| if index == 0 { "reference".into() } else { short(mean(&errors)) };
        let estimates = outcome.frames.iter().filter_map(|frame| frame.estimate.map(|of| 1e3 * f64::from(of.mean)));
        let estimates: Vec<_> = estimates.collect();
        [
            run.name.into(),
            format!("{:.2}", 1e3 * outcome.steps.1),
            short(real_time(outcome)),
            of(errors(exact, shapes)),
            of(errors_at(compared.target, exact, shapes)),
            if estimates.is_empty() { "-".into() } else { short(mean(&estimates)) },
            outcome.status().into(),
        ]
    };
    compared.runs.iter().enumerate().map(row).collect()
}

/// What has been gained, in a sentence.
pub(crate) fn found(compared: &Compared) -> String {
    let exact = compared.runs.first().map_or(&[][..], Run::shapes);
    let done = compared
        .runs
        .iter()
        .filter_map(|run| run.done.as_ref().ok().map(|(outcome, shapes)| (run.name, outcome, shapes)));
    let (mut times, mut apart) = (vec![], vec![]);
    for (index, (name, outcome, shapes)) in done.enumerate() {
        times.push(format!("{name} {}", short(real_time(outcome))));
        if index > 0 {
            let at_target = short(mean(&errors_at(compared.target, exact, shapes)));
            apart.push(format!("{name} ones {} mm ({at_target} at the tumour)", short(mean(&errors(exact, shapes)))));
        }
    }
    format!(
        "{} times real time. The liver moves by {} mm; from the exact steps are {}.",
        times.join(", "),
        short(moved(exact).into_iter().fold(0.0, f64::max)),
        apart.join(", ")
    )
}

/// The table on the screen.
pub(crate) fn table(compared: &Compared) -> String {
    let rows = rows(compared);
    let mut widths = HEADS.map(str::len);
    for row in &rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.len().max(*width);
        }
    }
    let line = |cells: [&str; COLUMNS]| {
        let cells = cells.iter().zip(widths).enumerate().map(|(column, (cell, width))| match column {
            0 | 6 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        format!("{}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    let mut text = line(HEADS);
    text.extend(rows.iter().map(|row| line(row.each_ref().map(String::as_str))));
    text.extend(notes(compared).iter().map(|note| format!("{note}\n")));
    text
}

/// How to read the table.
pub(crate) const fn about() -> &'static str {
    "Times real time: simulated over computing time on one processor core, with the guard, a second run that estimates the error meanwhile;\n\
     above 1 is faster than real time. Distances: mean over nodes and time; that of the exact steps to nature is another matter (docs/accuracy.md)."
}

/// What a status alone does not tell.
fn notes(compared: &Compared) -> Vec<String> {
    let of_run = |run: &Run| {
        let name = run.name;
        let outcome = match &run.done {
            Err(why) => return vec![format!("{name}: refused: {why}")],
            Ok((outcome, _)) => outcome,
        };
        let inexact = outcome.guard.and_then(|guard| Some((guard.inexact, guard.first?)));
        let inexact = inexact.map(|(steps, (time, error, allowed))| {
            let [error, allowed] = [error, allowed].map(|metres| 1e3 * f64::from(metres));
            format!(
                "{name}: inexact in {steps} of {} steps, first at {time:.3} s: the error was estimated at {error:.2} mm, above {allowed:.2} mm",
                outcome.computed
            )
        });
        inexact.into_iter().collect()
    };
    compared.runs.iter().flat_map(of_run).collect()
}

/// What the words mean, for who has not read a page.
const TERMS: [&str; 2] = [
    "Exact steps (TLED) stay below the critical step. Long ones are fifty times as long as it: inertia is added where a step would be unstable, and given back to \
             smooth motion. Auto chooses the length within a tolerance of 0.5 mm. The learned step is a network that comes with the crate, learned from a twisted bar, and cannot meet instruments.",
    "Distances are to the exact steps, mean over nodes and time. The guard is a second run, which estimates the error while the simulation runs.",
];

pub(crate) fn part(compared: &Compared) -> ReportPart {
    ReportPart { made: Made::by_this_command("none"), sections: vec![section(compared)] }
}

fn section(compared: &Compared) -> Section {
    let exact = compared.runs.first().map_or(&[][..], Run::shapes);
    let heads = HEADS.map(String::from).to_vec();
    let rows = rows(compared).into_iter().map(Vec::from).collect();
    let ended: Vec<(&Run, &Shape, f64)> = compared
        .runs
        .iter()
        .filter_map(|run| Some((run, run.shapes().last()?, run.outcome()?.frames.last()?.time)))
        .collect();
    let most = exact.last().map_or(0.0, |shape| {
        let points = &compared.runs[0].setup.body.mesh.points;
        let moved = distances_from_mean(&at(points, &exact[0]), &at(points, shape));
        moved.into_iter().fold(1e-6, f64::max)
    });
    let bodies = ended.iter().map(|(run, ..)| {
        // Every other frame: they are most of the page.
        let frames = run.outcome().map_or(&[][..], |outcome| &outcome.frames).iter().zip(run.shapes()).step_by(2);
        let (times, shapes): (Vec<f64>, Vec<&Shape>) = frames.map(|(frame, shape)| (frame.time, shape)).unzip();
        Panel::new(format!("{} steps", run.name), moving(&run.setup, &shapes, &times, most))
    });
    let bodies = Figure::grid(
        "The liver, coloured by how far it has moved more or less than in the mean; in it the tumour (red) and two vessels (blue); grey: the probe. Turn one and all turn.",
        bodies.collect(),
        ended.len(),
        1e3 * most,
        "from the mean",
    );
    Section {
        title: "A liver hangs from the diaphragm, which breathes in; a probe presses it".into(),
        paragraphs: std::iter::once(found(compared)).chain(notes(compared)).chain(TERMS.map(String::from)).collect(),
        tables: vec![Table { title: "steps side by side".into(), heads, rows }],
        figures: std::iter::once(bodies).chain(where_off(&ended)).chain([over_time(compared, exact)]).collect(),
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

fn over_time(compared: &Compared, exact: &[Shape]) -> Figure {
    let mut curves = vec![];
    for (index, run) in compared.runs.iter().enumerate().skip(1) {
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
    let times = compared
        .runs
        .first()
        .and_then(Run::outcome)
        .map_or(vec![], |outcome| outcome.frames.iter().map(|frame| frame.time).collect());
    curves.push(Curve::new("motion since the start", times, moved(exact)).coloured(GREY).dashed(DashType::Dot));
    let plot = plots::over_time("mean over the nodes, mm", curves);
    Figure::choice(
        "Error against exact steps, and what the guard estimates of it while running, without exact steps.",
        vec![Panel::new("error", plot)],
    )
}
