//! The fit file: which values of which scenes are unknown, and what was measured on them. TOML; paths are relative to
//! the file. Every complaint names the file and the line.

use std::fmt;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::place::Place;
use crate::problem::Problem;
use crate::scene::file::line_of;

/// A fit file with its text, for line numbers.
pub(crate) struct FitFile {
    path: PathBuf,
    text: String,
    pub(crate) cases: Vec<CaseTable>,
    pub(crate) unknowns: Vec<Unknown>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FitTable {
    #[serde(default)]
    case: Vec<CaseTable>,
    #[serde(default)]
    parameter: Vec<Spanned<ParameterTable>>,
}

/// A scene and what was measured on it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CaseTable {
    pub(crate) scene: Spanned<PathBuf>,
    pub(crate) measured: Spanned<PathBuf>,
    /// Points, or all of them, that are not fitted but predicted.
    pub(crate) left_out: Option<Spanned<LeftOut>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
pub(crate) enum LeftOut {
    All(bool),
    Names(Vec<String>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParameterTable {
    name: Spanned<String>,
    start: Spanned<f64>,
    min: Spanned<f64>,
    max: Spanned<f64>,
    scene: Option<Spanned<PathBuf>>,
}

/// A value to be found.
pub(crate) struct Unknown {
    pub(crate) place: Place,
    /// In the unit of the scene file.
    pub(crate) start: f64,
    pub(crate) least: f64,
    pub(crate) most: f64,
    /// The scene that it is of; all have it unless given.
    pub(crate) scene: Option<PathBuf>,
    /// File and line, for complaints.
    pub(crate) at: String,
}

impl Unknown {
    /// The name with the scene, if it is of one alone.
    pub(crate) fn name(&self) -> String {
        let name = self.place.name();
        self.scene.as_ref().map_or_else(|| name.to_owned(), |scene| format!("{name} of {}", scene.display()))
    }
}

impl FitFile {
    pub(crate) fn read(path: &Path) -> Result<Self, Problem> {
        let text =
            supple::io::read_text(path).map_err(|error| Problem::in_file(path, format!("cannot be read: {error}")))?;
        let table: FitTable = toml::from_str(&text).map_err(|error: toml::de::Error| {
            let line = error.span().map(|span| format!(", line {}", line_of(&text, span.start)));
            Problem(format!("{}{}: {}", path.display(), line.unwrap_or_default(), error.message()))
        })?;
        let mut file = Self { path: path.to_path_buf(), text, cases: table.case, unknowns: vec![] };
        for at in table.parameter {
            let unknown = file.unknown(&at)?;
            if file.unknowns.iter().any(|known| known.name() == unknown.name()) {
                return Err(file.problem(&at, format!("the parameter {} is there twice", unknown.name())));
            }
            file.unknowns.push(unknown);
        }
        if file.cases.is_empty() {
            return Err(Problem::in_file(path, "there is no [[case]]; give one with scene = and measured ="));
        }
        if file.unknowns.is_empty() {
            let message = "there is no [[parameter]]; give one with name =, start =, min = and max =";
            return Err(Problem::in_file(path, message));
        }
        Ok(file)
    }

    fn unknown(&self, at: &Spanned<ParameterTable>) -> Result<Unknown, Problem> {
        let ParameterTable { name, start, min, max, scene } = at.get_ref();
        let place = Place::parse(name.get_ref()).map_err(|message| self.problem(name, message))?;
        let (least, most, first) = (*min.get_ref(), *max.get_ref(), *start.get_ref());
        if !(least.is_finite() && most.is_finite() && least < most) {
            return Err(self.problem(min, format!("min is {least} and max is {most}; min must be below max")));
        }
        if !(least <= first && first <= most) {
            return Err(self.problem(start, format!("start is {first}, it must be from min, {least}, to max, {most}")));
        }
        if place.is_clock() && scene.is_none() {
            return Err(self.problem(name, "clock is that of one scene; name it with scene ="));
        }
        let scene = scene.as_ref().map(|scene| {
            let known = self.cases.iter().any(|case| case.scene.get_ref() == scene.get_ref());
            let message = || format!("no [[case]] has the scene {}", scene.get_ref().display());
            if known { Ok(scene.get_ref().clone()) } else { Err(self.problem(scene, message())) }
        });
        Ok(Unknown { place, start: first, least, most, scene: scene.transpose()?, at: self.place(name) })
    }

    /// A complaint about something in the file.
    pub(crate) fn problem<T>(&self, at: &Spanned<T>, message: impl fmt::Display) -> Problem {
        Problem(format!("{}: {message}", self.place(at)))
    }

    fn place<T>(&self, at: &Spanned<T>) -> String {
        format!("{}, line {}", self.path.display(), line_of(&self.text, at.span().start))
    }

    /// The path of a file that is named relative to this one.
    pub(crate) fn resolve(&self, file: &Path) -> PathBuf {
        self.path.parent().map_or_else(|| file.to_path_buf(), |folder| folder.join(file))
    }
}
