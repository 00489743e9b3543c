//! `supple fit`: values of scenes from measured displacements, with what the data can tell of them.
//!
//! | module | what it does |
//! |---|---|
//! | `file`, `measured` | reads what is unknown and what was measured |
//! | `place` | finds and changes a value in the text of a scene file |
//! | `points` | follows a measured point with the nodes |
//! | `cases` | simulates the scenes with values in them |
//! | `solve` | searches the values with the least squares |
//! | `statistics` | standard errors, correlations, points left out |
//! | `tell` | the table and the result file |

mod cases;
mod file;
mod measured;
mod place;
mod points;
mod solve;
mod statistics;
mod tell;

use std::path::PathBuf;

use nalgebra::DVector;

use crate::problem::{End, Problem};
use crate::screen::message;
use cases::Cases;
use file::FitFile;

/// Values of scenes from measured displacements: a table, and a result file with standard errors and residuals
#[derive(clap::Args)]
pub(crate) struct Asked {
    /// What is unknown and what was measured, a TOML file
    fit: PathBuf,
    /// File for the result (.json)
    #[arg(long)]
    out: PathBuf,
}

/// Millimetres in a metre.
const MM: f64 = 1e3;

pub(crate) fn fit(asked: &Asked) -> Result<End, Problem> {
    let file = FitFile::read(&asked.fit)?;
    let mut cases = Cases::read(&file)?;
    for warning in &cases.warnings {
        message!("warning: {warning}");
    }
    let measured = fitted(&cases).count();
    if measured < file.unknowns.len() {
        return Err(Problem::in_file(
            &asked.fit,
            format!(
                "{} parameters, but only {measured} measured numbers; measure more, or fix some",
                file.unknowns.len()
            ),
        ));
    }
    // Both simulations of a difference may be so far from rest.
    let noise = fitted(&cases).map(|(case, ..)| (2.0 * MM * cases.all[case].rest).powi(2)).sum::<f64>().sqrt();
    let solution = solve::solve(&file.unknowns, noise, &mut |values| residuals(&mut cases, values))?;
    let statistics = statistics::of(&file.unknowns, &solution, &groups(&cases));
    let told = tell::Told::new(&mut cases, &file.unknowns, &solution, &statistics)?;
    told.write(&asked.out)?;
    told.print();
    crate::screen::row("result", asked.out.display());
    Ok(End::Reached)
}

/// Case, sample and axis of the numbers that are fitted.
fn fitted<'a>(cases: &'a Cases<'_>) -> impl Iterator<Item = (usize, usize, usize)> + use<'a> {
    let samples = cases.all.iter().enumerate().flat_map(|(index, case)| {
        (0..case.samples.len()).filter(|&sample| !case.left_out[sample]).map(move |sample| (index, sample))
    });
    samples
        .flat_map(|(case, sample)| (0..3).map(move |axis| (case, sample, axis)))
        .filter(|&(case, sample, axis)| cases.all[case].samples[sample].displacement[axis].is_some())
}

/// Simulated less measured, mm.
fn residuals(cases: &mut Cases<'_>, values: &[f64]) -> Result<DVector<f64>, Problem> {
    let mut simulated = vec![];
    for index in 0..cases.all.len() {
        // Those that are left out alone come at the end.
        let is_fitted = cases.all[index].left_out.contains(&false);
        simulated.push(if is_fitted { cases.displacements(index, values)? } else { vec![] });
    }
    let residual = |(case, sample, axis): (usize, usize, usize)| {
        let measured = cases.all[case].samples[sample].displacement[axis].unwrap_or_default();
        MM * (simulated[case][sample][axis] - measured)
    };
    let all: Vec<f64> = fitted(cases).map(residual).collect();
    Ok(DVector::from_vec(all))
}

/// The rows of the residuals that belong to one point of one case, at all of its times.
fn groups(cases: &Cases<'_>) -> Vec<Vec<usize>> {
    let mut groups: Vec<((usize, &str), Vec<usize>)> = vec![];
    for (row, (case, sample, _)) in fitted(cases).enumerate() {
        let key = (case, cases.all[case].samples[sample].name.as_str());
        match groups.iter_mut().find(|group| group.0 == key) {
            Some((_, rows)) => rows.push(row),
            None => groups.push((key, vec![row])),
        }
    }
    groups.into_iter().map(|(_, rows)| rows).collect()
}
