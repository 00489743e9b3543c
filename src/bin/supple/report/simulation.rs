//! What one simulation tells: its table, the body at rest and at the end, motion and estimated error over time, forces
//! on instruments.

use supple::mesh::boundary;
use supple::state::VecState;

use super::bodies::{Bodies, Colour, INSTRUMENT, View, lengths, moved};
use super::made::Made;
use super::plots::{self, COLOURS, Curve, DashType, GREY, Plot};
use super::{Figure, Panel, ReportPart, Section, Table};
use crate::results::{Conclusion, instrument_mesh};
use crate::run::outcome::Outcome;
use crate::scene::setup::Setup;

pub(crate) fn part(setup: &Setup, state: &VecState, outcome: &Outcome, conclusion: &Conclusion) -> ReportPart {
    let mut sections = vec![result(setup, outcome, conclusion), shapes(setup, state), motion(outcome)];
    sections.extend(forces(outcome));
    sections.extend(gaps(outcome));
    sections.extend(followed(outcome));
    ReportPart { made: Made::by_this_command("none"), sections }
}

fn result(setup: &Setup, outcome: &Outcome, Conclusion { summary, warnings, .. }: &Conclusion) -> Section {
    let rows = summary.rows().iter().map(|(name, words)| vec![(*name).into(), words.clone()]);
    let ending =
        outcome.divergence.map(|divergence| format!("The simulation {divergence}; the results end before that."));
    let warnings = warnings.iter().map(|warning| format!("Warning: {warning}"));
    Section {
        title: format!("{} steps: {}", setup.method_name(), outcome.status()),
        paragraphs: ending.into_iter().chain(warnings).collect(),
        tables: vec![Table { title: "results".into(), heads: vec![], rows: rows.collect() }],
        ..Section::default()
    }
}

/// The displacements of a state, m.
pub(crate) fn shape(state: &VecState) -> Vec<[f32; 3]> {
    state.displacements().iter().map(|vector| vector.to_array()).collect()
}

/// A body of a scene with its instruments at a time (s), coloured up to `most` (m) by a length at each node.
pub(crate) fn body(setup: &Setup, shape: &[[f32; 3]], lengths: &[f64], time: f64, most: f64) -> Plot {
    let mut bodies = Bodies::default();
    let positions = moved(&setup.body.mesh.points, shape);
    bodies.add(&positions, &setup.body.boundary(), lengths, most);
    let gripped: Vec<_> = setup.motions.iter().map(|motion| positions[motion.node as usize]).collect();
    if !gripped.is_empty() {
        bodies.add_points(&gripped);
    }
    if !setup.instruments.is_empty() {
        let (points, triangles) = instrument_mesh::of(&setup.instruments, &setup.body, time);
        bodies.add_rigid(&points, &triangles);
    }
    bodies.plot(View::Standing)
}

/// Colours of the tissues inside, from the second on.
const INSIDE: [&str; 3] = ["#e0202a", "#2f6fd0", "#d09a2f"];

/// A body in motion, its shapes at times (s), with the tissues in it and its instruments.
pub(crate) fn moving(setup: &Setup, shapes: &[&Vec<[f32; 3]>], times: &[f64], most: f64) -> Plot {
    let mut bodies = Bodies::default();
    let positions: Vec<_> = shapes.iter().map(|shape| moved(&setup.body.mesh.points, shape)).collect();
    for (tissue, colour) in (1..).zip(INSIDE) {
        let of_tissue = setup.tissues.elements_of(tissue).map(|element| setup.body.mesh.tets[element]);
        let surface = boundary(of_tissue);
        if !surface.is_empty() {
            bodies.add_moving(times, &positions, &surface, Colour::Plain(colour));
        }
    }
    bodies.add_moving(times, &positions, &setup.body.boundary(), Colour::Moved { most });
    if !setup.instruments.is_empty() {
        let of = |time: &f64| instrument_mesh::of(&setup.instruments, &setup.body, *time);
        let places: Vec<_> = times.iter().map(|time| of(time).0).collect();
        bodies.add_moving(times, &places, &of(&0.0).1, Colour::Plain(INSTRUMENT));
    }
    bodies.plot(View::Standing)
}

fn shapes(setup: &Setup, state: &VecState) -> Section {
    let rest = vec![[0.0; 3]; setup.body.mesh.points.len()];
    let shape = shape(state);
    let most = lengths(&shape).into_iter().fold(1e-6, f64::max);
    let panel =
        |name: String, shape: &[[f32; 3]], time: f64| Panel::new(name, body(setup, shape, &lengths(shape), time, most));
    let panels =
        vec![panel("at rest".into(), &rest, 0.0), panel(format!("after {:.3} s", state.time()), &shape, state.time())];
    let caption = "Coloured by displacement; red: nodes with a prescribed motion. Turn one and both turn.";
    Section {
        title: "The body".into(),
        figures: vec![Figure::grid(caption, panels, 2, 1e3 * most, "displacement")],
        ..Section::default()
    }
}

fn motion(Outcome { frames, .. }: &Outcome) -> Section {
    let times: Vec<f64> = frames.iter().map(|frame| frame.time).collect();
    let curve = |name: &str, metres: Vec<f64>| {
        Curve::new(name, times.clone(), metres.into_iter().map(|metre| 1e3 * metre).collect())
    };
    let mut curves = vec![
        curve("largest displacement", frames.iter().map(|frame| frame.largest).collect()).coloured(COLOURS[0]),
        curve("mean displacement", frames.iter().map(|frame| frame.mean).collect()).coloured(GREY),
    ];
    let estimated = frames.iter().filter_map(|frame| Some((frame.time, frame.estimate?)));
    let (at, estimates): (Vec<_>, Vec<_>) = estimated.unzip();
    let is_exact = estimates.is_empty();
    if !is_exact {
        let of = |name: &str, values: Vec<f64>| {
            Curve::new(name, at.clone(), values).coloured(COLOURS[1]).dashed(DashType::Dash)
        };
        curves.push(of("estimated mean error", estimates.iter().map(|e| 1e3 * f64::from(e.mean)).collect()));
        let largest = estimates.iter().map(|e| 1e3 * f64::from(e.largest)).collect();
        curves.push(of("estimated largest error", largest).dashed(DashType::Dot));
    }
    let caption = if is_exact {
        "Displacement of the nodes. These steps have no estimate of their error."
    } else {
        "Displacement of the nodes, and the error against exact steps as the guard estimates it by a second run."
    };
    let title = if is_exact { "Motion over time" } else { "Motion and estimated error over time" };
    let plot = if is_exact { plots::linear("time, s", "mm", curves) } else { plots::over_time("mm", curves) };
    Section {
        title: title.into(),
        figures: vec![Figure::choice(caption, vec![Panel::new("motion", plot)])],
        ..Section::default()
    }
}

/// A curve over time for each name, those that reach farthest if there are many; none if there are no names.
fn over_time(title: &str, unit: &str, caption: &str, mut curves: Vec<(String, Vec<(f64, f64)>)>) -> Option<Section> {
    const MOST: usize = 12;
    let most = |rows: &[(f64, f64)]| rows.iter().map(|row| row.1).fold(0.0, f64::max);
    let all = curves.len();
    if all > MOST {
        curves.sort_by(|a, b| most(&b.1).total_cmp(&most(&a.1)));
        curves.truncate(MOST);
    }
    let drawn = curves.into_iter().enumerate().map(|(index, (name, rows))| {
        let (times, values) = rows.into_iter().unzip();
        Curve::new(name, times, values).coloured(COLOURS[index % COLOURS.len()])
    });
    let plot = plots::linear("time, s", unit, drawn.collect());
    let of = if all > MOST { format!(" Of {all} the {MOST} that reach farthest.") } else { String::new() };
    (all > 0).then(|| Section {
        title: title.into(),
        figures: vec![Figure::choice(format!("{caption}{of}"), vec![Panel::new(title, plot)])],
        ..Section::default()
    })
}

fn in_millimetres(rows: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    rows.into_iter().map(|(time, metres)| (time, 1e3 * metres)).collect()
}

fn gaps(outcome: &Outcome) -> Option<Section> {
    let gaps = outcome.pulls.gaps().into_iter().enumerate();
    let curves = gaps.map(|(index, rows)| (format!("pull {index}"), in_millimetres(rows))).collect();
    let caption =
        "Distance of each pulled point from its target at the frames; points, gaps and forces are in pulls.csv.";
    over_time("Gaps of pulls", "gap, mm", caption, curves)
}

fn followed(outcome: &Outcome) -> Option<Section> {
    let moved = outcome.points.moved().into_iter();
    let curves = moved.map(|(name, rows)| (name.to_owned(), in_millimetres(rows))).collect();
    let caption = "How far each followed point is from where it was at rest; the points are in points.csv.";
    over_time("Followed points", "moved by, mm", caption, curves)
}

fn forces(outcome: &Outcome) -> Option<Section> {
    let forces = outcome.reactions.forces().into_iter().enumerate();
    let curves = forces.map(|(index, rows)| (format!("instrument {index}"), rows)).collect();
    let caption = "Mean force of the tissue on each instrument over short intervals; components and contacts are in reactions.csv.";
    over_time("Forces on instruments", "force, N", caption, curves)
}
