//! What a fit compares: scenes with values put into them, moved, and the displacements of their measured points. A
//! scene whose values have not changed is not simulated again.

use std::collections::HashMap;
use std::path::PathBuf;

use super::file::{CaseTable, FitFile, LeftOut, Unknown};
use super::measured::{self, Sample};
use super::place::{Edit, edited};
use super::points::Followed;
use crate::problem::Problem;
use crate::report::simulation::shape;
use crate::rest::{Unrest, at_rest};
use crate::results::warnings;
use crate::run::Running;
use crate::run::start::Start;
use crate::scene::file::SceneFile;
use crate::scene::setup::Setup;

/// What may be left of the way to rest, as a share of what was measured.
const REST: f64 = 1e-4;
/// At least, m: displacements are float32.
const LEAST_REST: f64 = 1e-7;

/// A scene with what was measured on it.
pub(crate) struct Case {
    pub(crate) name: String,
    file: SceneFile,
    /// As the fit file names it.
    scene: PathBuf,
    pub(crate) samples: Vec<Sample>,
    /// Which samples are not fitted.
    pub(crate) left_out: Vec<bool>,
    points: Vec<Followed>,
    /// Of the scene as it is written.
    warnings: Vec<String>,
    /// How much of the way to rest may be left, m.
    pub(crate) rest: f64,
}

/// What a simulation came to.
struct Simulated {
    /// Of the samples, m.
    displacements: Vec<[f64; 3]>,
    /// Why it may be off, in sentences.
    doubts: Vec<String>,
}

/// All cases of a fit, with what has been simulated so far.
pub(crate) struct Cases<'a> {
    pub(crate) all: Vec<Case>,
    unknowns: &'a [Unknown],
    done: HashMap<(usize, String, u64), Simulated>,
    /// The latest states at rest, from which the next ones begin.
    shapes: Vec<Option<Vec<[f32; 3]>>>,
    pub(crate) simulations: u32,
    /// Warnings of the scenes.
    pub(crate) warnings: Vec<String>,
}

impl<'a> Cases<'a> {
    /// Reads all that a fit file names. What is wrong with a scene, its values or its measured points is told here.
    pub(crate) fn read(fit: &'a FitFile) -> Result<Self, Problem> {
        let all: Vec<Case> = fit.cases.iter().map(|table| Case::read(fit, table)).collect::<Result<_, _>>()?;
        let shapes = all.iter().map(|_| None).collect();
        let mut cases =
            Self { all, unknowns: &fit.unknowns, done: HashMap::new(), shapes, simulations: 0, warnings: vec![] };
        if !cases.all.iter().any(|case| case.left_out.contains(&false)) {
            return Err(Problem(format!("{}: all points are left out; what is to be fitted?", cases.all[0].name)));
        }
        for case in &cases.all {
            cases.warnings.extend(case.warnings.iter().cloned());
            let outside = case.points.iter().filter_map(|point| point.outside).fold(0.0, f64::max);
            if outside > 0.0 {
                let most = 1e3 * outside;
                cases.warnings.push(format!(
                    "{}: points are outside the mesh, up to {most:.1} mm from its nearest node; the nodes next to them carry them",
                    case.name
                ));
            }
        }
        Ok(cases)
    }

    /// What a case's scene is with values in it.
    pub(crate) fn text(&self, case: &Case, values: &[f64]) -> Result<(String, Vec<Edit>), Problem> {
        let (mut text, mut all) = (case.file.text().to_owned(), vec![]);
        for (unknown, value) in self.unknowns.iter().zip(values) {
            if !case.has(unknown) || unknown.place.is_clock() {
                continue;
            }
            let problem = |message| Problem(format!("{}: {message} (scene {})", unknown.at, case.name));
            let mut edits = unknown.place.edits(&text, *value).map_err(problem)?;
            text = edited(&text, &mut edits);
            edits.reverse();
            all.extend(edits);
        }
        Ok((text, all))
    }

    /// Displacements (m) of the samples of a case. Each simulation counts.
    pub(crate) fn displacements(&mut self, index: usize, values: &[f64]) -> Result<Vec<[f64; 3]>, Problem> {
        Ok(self.simulated(index, values)?.displacements.clone())
    }

    /// Why the simulation of a case may be off, in sentences.
    pub(crate) fn doubts(&mut self, index: usize, values: &[f64]) -> Result<Vec<String>, Problem> {
        Ok(self.simulated(index, values)?.doubts.clone())
    }

    fn simulated(&mut self, index: usize, values: &[f64]) -> Result<&Simulated, Problem> {
        let case = &self.all[index];
        let (text, _) = self.text(case, values)?;
        let mut of_clock = self.unknowns.iter().zip(values).filter(|(unknown, _)| unknown.place.is_clock());
        let clock = of_clock.find(|(unknown, _)| case.has(unknown)).map_or(0.0, |(_, value)| *value);
        let key = (index, text, clock.to_bits());
        if !self.done.contains_key(&key) {
            self.simulations += 1;
            let setup = Setup::read(&SceneFile::of_text(case.file.path(), key.1.clone())?)?;
            let found = if case.samples.iter().any(|sample| sample.time.is_some()) {
                case.over_time(&setup, clock)?
            } else {
                let from = self.shapes[index].as_deref();
                let shape = match at_rest(&setup, from, case.rest) {
                    // From a shape of other values it may be too far.
                    Err(Unrest::Diverged(_)) if from.is_some() => at_rest(&setup, None, case.rest),
                    found => found,
                };
                let shape = shape.map_err(|unrest| unrest.of(&case.name))?;
                let displacements = case.points.iter().map(|point| point.displacement(&shape)).collect();
                self.shapes[index] = Some(shape);
                // Steps to rest are exact, and tissue that they crush is refused.
                Simulated { displacements, doubts: vec![] }
            };
            self.done.insert(key.clone(), found);
        }
        Ok(&self.done[&key])
    }
}

impl Case {
    fn read(fit: &FitFile, table: &CaseTable) -> Result<Self, Problem> {
        let file = SceneFile::read(&fit.resolve(table.scene.get_ref()))
            .map_err(|problem| fit.problem(&table.scene, problem))?;
        let setup = Setup::read(&file)?;
        let samples = measured::read(&fit.resolve(table.measured.get_ref()))
            .map_err(|problem| fit.problem(&table.measured, problem))?;
        let mut left_out = vec![false; samples.len()];
        match table.left_out.as_ref().map(|at| (at, at.get_ref())) {
            None => {}
            Some((_, LeftOut::All(all))) => left_out.fill(*all),
            Some((at, LeftOut::Names(names))) => {
                for name in names {
                    if !samples.iter().any(|sample| sample.name == *name) {
                        return Err(fit.problem(at, format!("no measured point has the name \"{name}\"")));
                    }
                }
                left_out = samples.iter().map(|sample| names.contains(&sample.name)).collect();
            }
        }
        let points: Vec<_> = samples.iter().map(|sample| Followed::new(&setup.body, sample.point)).collect();
        let far = points
            .iter()
            .zip(&samples)
            .find(|(point, _)| point.outside.is_some_and(|far| far > 0.5 * setup.body.diagonal()));
        if let Some((point, sample)) = far {
            let far = 1e3 * point.outside.unwrap_or_default();
            let message = format!(
                "the point {} is {far:.0} mm from the mesh; places are those of the undeformed mesh in metres",
                sample.name
            );
            return Err(fit.problem(&table.measured, message));
        }
        let mut warnings = setup.warnings;
        let length =
            |sample: &Sample| sample.displacement.iter().flatten().map(|metre| metre * metre).sum::<f64>().sqrt();
        let farthest = samples.iter().map(|sample| (length(sample), &sample.name)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((metre, name)) = farthest.filter(|(metre, _)| *metre > setup.body.diagonal()) {
            let message = format!(
                "the displacement of {name} is {:.0} mm, the body is {:.0} mm across; displacements are in metres (1 mm is 0.001)",
                1e3 * metre,
                1e3 * setup.body.diagonal()
            );
            warnings.push(fit.problem(&table.measured, message).0);
        }
        let measured = samples.iter().flat_map(|sample| sample.displacement).flatten();
        let squares: Vec<f64> = measured.map(|metre| metre * metre).collect();
        let rest = (REST * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()).max(LEAST_REST);
        let name = table.scene.get_ref().display().to_string();
        Ok(Self { name, file, scene: table.scene.get_ref().clone(), samples, left_out, points, warnings, rest })
    }

    /// Whether a value is one of this case.
    fn has(&self, unknown: &Unknown) -> bool {
        unknown.scene.as_ref().is_none_or(|scene| *scene == self.scene)
    }

    /// Displacements of the samples at their times, with all that acts in the scene and by its method, which starts at
    /// `clock` (s) of these.
    fn over_time(&self, setup: &Setup, clock: f64) -> Result<Simulated, Problem> {
        let mut running = Running::begin(setup, Start::new(setup, false)?, &|_| ())?;
        let time = |index: usize| (self.samples[index].time.unwrap_or_default() - clock).max(0.0);
        let mut order: Vec<usize> = (0..self.samples.len()).collect();
        order.sort_by(|&a, &b| time(a).total_cmp(&time(b)));
        let mut displacements = vec![[0.0; 3]; self.samples.len()];
        for index in order {
            running.reach(time(index), f64::INFINITY)?;
            if let Some(divergence) = running.outcome.divergence {
                return Err(Problem(format!("{}: the simulation {divergence}", self.name)));
            }
            displacements[index] = self.points[index].displacement(&shape(running.simulation.state()));
        }
        let status = running.outcome.status();
        let remedy = match status {
            "inexact" => {
                "; write method = \"exact\" under [time], or \"auto\" with a tolerance well below the residuals"
            }
            _ => "",
        };
        let doubt = |doubt| format!("{} with the values found ({status}): {doubt}{remedy}", self.name);
        Ok(Simulated {
            displacements,
            doubts: warnings::of_run(setup, &running.outcome).into_iter().map(doubt).collect(),
        })
    }
}
