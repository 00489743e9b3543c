//! What one simulation tells: its table, the body at rest and at the end, motion and estimated error over time, forces
//! on instruments.

use supple::state::VecState;

use super::bodies::{Bodies, View, lengths, moved};
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

fn gaps(outcome: &Outcome) -> Option<Section> {
    let gaps = outcome.pulls.gaps();
    if gaps.is_empty() {
        return None;
    }
    let curves = gaps.into_iter().enumerate().map(|(index, rows)| {
        let (times, metres): (_, Vec<_>) = rows.into_iter().unzip();
        let millimetres = metres.into_iter().map(|metre| 1e3 * metre).collect();
        Curve::new(format!("pull {index}"), times, millimetres).coloured(COLOURS[index % COLOURS.len()])
    });
    let plot = plots::linear("time, s", "gap, mm", curves.collect());
    let caption =
        "Distance of each pulled point from its target at the frames; points, gaps and forces are in pulls.csv.";
    Some(Section {
        title: "Gaps of pulls".into(),
        figures: vec![Figure::choice(caption, vec![Panel::new("gaps", plot)])],
        ..Section::default()
    })
}

fn forces(outcome: &Outcome) -> Option<Section> {
    let forces = outcome.reactions.forces();
    if forces.is_empty() {
        return None;
    }
    let curves = forces.into_iter().enumerate().map(|(index, rows)| {
        let (times, newtons) = rows.into_iter().unzip();
        Curve::new(format!("instrument {index}"), times, newtons).coloured(COLOURS[index % COLOURS.len()])
    });
    let plot = plots::linear("time, s", "force, N", curves.collect());
    let caption = "Mean force of the tissue on each instrument over short intervals; components and contacts are in reactions.csv.";
    Some(Section {
        title: "Forces on instruments".into(),
        figures: vec![Figure::choice(caption, vec![Panel::new("forces", plot)])],
        ..Section::default()
    })
}
