//! What a fit came to: a table for people, in millimetres, and a file for programs, in metres.

use std::path::Path;

use serde_json::{Value, json};

use super::MM;
use super::cases::Cases;
use super::file::Unknown;
use super::solve::Solution;
use super::statistics::{Statistics, short};
use crate::problem::Problem;
use crate::screen::{message, output, row};

/// Residuals above this share of what was measured are warned of.
const MOST_MISSED: f64 = 1.0 / 3.0;

/// Distances of points, simulated from measured, m.
#[derive(Default)]
struct Distances {
    squares: Vec<f64>,
    /// Of the displacements that were measured.
    measured: Vec<f64>,
    worst: (f64, String),
}

impl Distances {
    fn add(&mut self, metre: f64, measured: f64, name: &str) {
        self.squares.push(metre * metre);
        self.measured.push(measured * measured);
        if metre >= self.worst.0 {
            self.worst = (metre, name.to_owned());
        }
    }

    fn rms(&self) -> Option<f64> {
        rms(&self.squares)
    }

    /// That much of what was measured is missed.
    fn doubt(&self, name: &str) -> Option<String> {
        let (missed, measured) = (self.rms()?, rms(&self.measured)?);
        (missed > MOST_MISSED * measured).then(|| {
            format!(
                "{name}: the points are {:.2} mm rms from where they were measured, and have moved by {:.2} mm; is what was measured in \
                 metres, displacements and not places, and are the loads in the scene those that acted?",
                MM * missed,
                MM * measured
            )
        })
    }

    fn words(&self) -> String {
        let Some(rms) = self.rms() else { return String::new() };
        let (worst, name) = &self.worst;
        format!("{:.2} mm rms of {} points, worst {:.2} mm at {name}", MM * rms, self.squares.len(), MM * worst)
    }

    fn json(&self) -> Value {
        let (worst, name) = &self.worst;
        self.rms().map_or(
            Value::Null,
            |rms| json!({ "points": self.squares.len(), "rms_m": rms, "worst_m": worst, "worst_point": name }),
        )
    }
}

fn rms(squares: &[f64]) -> Option<f64> {
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// A result that can be told.
pub(crate) struct Told {
    rows: Vec<(String, String)>,
    warnings: Vec<String>,
    json: Value,
}

impl Told {
    pub(crate) fn new(
        cases: &mut Cases<'_>,
        unknowns: &[Unknown],
        solution: &Solution,
        statistics: &Statistics,
    ) -> Result<Self, Problem> {
        let (mut rows, mut parameters) = (vec![], vec![]);
        for (index, unknown) in unknowns.iter().enumerate() {
            let (value, error) = (solution.values[index], statistics.standard_errors[index]);
            let limit = if solution.at_limit[index] { ", at its limit" } else { "" };
            let doubt = if statistics.told[index] { "" } else { " (the data cannot tell it)" };
            rows.push((unknown.name(), format!("{}{limit}, standard error {}{doubt}", short(value), short(error))));
            parameters.push(json!({
                "name": unknown.place.name(),
                "scene": unknown.scene,
                "value": value,
                "standard_error": error.is_finite().then_some(error),
                "told": statistics.told[index],
                "at_limit": solution.at_limit[index],
                "start": unknown.start,
            }));
        }
        let (fitted, left_out, of_cases) = distances(cases, solution)?;
        rows.push(("residuals".into(), fitted.words()));
        for (name, distances, _) in of_cases.iter().filter(|_| of_cases.len() > 1) {
            rows.push((format!("  {name}"), distances.words()));
        }
        let without: Vec<f64> = statistics.without.iter().flatten().copied().collect();
        let without_rms = (without.iter().map(|mm| mm * mm).sum::<f64>() / without.len() as f64).sqrt();
        if without.len() > 1 {
            let worst = without.iter().copied().fold(0.0, f64::max);
            rows.push((
                "each point left out".into(),
                format!("{without_rms:.2} mm rms, worst {worst:.2} mm, by the linear model"),
            ));
        }
        if left_out.rms().is_some() {
            rows.push(("left out".into(), left_out.words()));
        }
        rows.push(("simulations".into(), cases.simulations.to_string()));
        let mut doubts = vec![];
        for index in 0..cases.all.len() {
            doubts.extend(cases.doubts(index, &solution.values)?);
            let (name, distances, _) = &of_cases[index];
            doubts.extend(distances.doubt(name));
        }
        let mut untold = statistics.untold.clone();
        if !solution.converged {
            untold.push("the search ended before the best values; start it from these".into());
        }
        let correlations: Vec<Vec<f64>> =
            statistics.correlations.row_iter().map(|row| row.iter().copied().collect()).collect();
        let json = json!({
            "parameters": parameters,
            "correlations": correlations,
            "cannot_tell": untold,
            "warnings": cases.warnings.iter().chain(&doubts).collect::<Vec<_>>(),
            "converged": solution.converged,
            "residuals": fitted.json(),
            "left_out": left_out.json(),
            "each_point_left_out": { "rms_m": without_rms / MM, "points": without.len() },
            "simulations": cases.simulations,
            "cases": of_cases.into_iter().map(|(_, _, json)| json).collect::<Vec<_>>(),
        });
        Ok(Self { rows, warnings: doubts.into_iter().chain(untold).collect(), json })
    }

    pub(crate) fn print(&self) {
        let width = self.rows.iter().map(|(name, _)| name.len()).max().unwrap_or_default().max(21);
        for (name, words) in &self.rows {
            if width > 21 {
                output!("{name:<width$} {words}");
            } else {
                row(name, words);
            }
        }
        for sentence in &self.warnings {
            message!("warning: {sentence}");
        }
    }

    pub(crate) fn write(&self, path: &Path) -> Result<(), Problem> {
        let text = format!("{:#}\n", self.json);
        supple::io::write_atomically(path, |file| file.write_all(text.as_bytes()))
            .map_err(|error| Problem::in_file(path, format!("cannot be written: {error}")))
    }
}

type OfCases = Vec<(String, Distances, Value)>;

/// Distances of fitted points, of points left out, and those of each case with its points for the file.
fn distances(cases: &mut Cases<'_>, solution: &Solution) -> Result<(Distances, Distances, OfCases), Problem> {
    let (mut fitted, mut left_out, mut all) = (Distances::default(), Distances::default(), vec![]);
    for index in 0..cases.all.len() {
        let simulated = cases.displacements(index, &solution.values)?;
        let case = &cases.all[index];
        let (mut own, mut points) = (Distances::default(), vec![]);
        for ((sample, simulated), is_out) in case.samples.iter().zip(&simulated).zip(&case.left_out) {
            let square =
                |(measured, simulated): (&Option<f64>, &f64)| measured.map(|measured| (simulated - measured).powi(2));
            let squares: Vec<f64> = sample.displacement.iter().zip(simulated).filter_map(square).collect();
            if squares.is_empty() {
                continue;
            }
            let distance = squares.iter().sum::<f64>().sqrt();
            let moved = sample.displacement.iter().flatten().map(|metre| metre * metre).sum::<f64>().sqrt();
            let time = sample.time.map_or(String::new(), |time| format!(" at {time} s"));
            own.add(distance, moved, &format!("{}{time}", sample.name));
            if *is_out { &mut left_out } else { &mut fitted }.add(
                distance,
                moved,
                &format!("{}{time} of {}", sample.name, case.name),
            );
            points.push(json!({
                "name": sample.name, "time_s": sample.time, "left_out": is_out,
                "measured_m": sample.displacement, "simulated_m": simulated, "distance_m": distance,
            }));
        }
        let (_, edits) = cases.text(case, &solution.values)?;
        let set: Vec<Value> = edits.iter().map(|edit| json!({ "key": edit.key, "value": edit.value })).collect();
        let json = json!({ "scene": case.name, "set": set, "distances": own.json(), "points": points });
        all.push((case.name.clone(), own, json));
    }
    Ok((fitted, left_out, all))
}
