//! Reports: one HTML file each that holds its figures, its data and the library that draws them (plotly.js), and works
//! offline. A report has parts, one for each command that adds to it; a part says how it was made.
//!
//! | module | what it holds |
//! |---|---|
//! | `page` | parts as HTML, with `page.html`, `page.css`, `page.js` and the library in `plotly` |
//! | `made` | command, version, machine |
//! | `plots` | curves and points, with the names of their axes |
//! | `bodies` | surfaces of bodies that turn under the mouse |
//! | `simulation`, `demo` | what `supple simulate` and `supple demo` tell |
//! | `methods`, `peers` | speed against error, error over time, the paper's figures |
//! | `physics` | error against nature over computing time |
//! | `hard` | hard cases: errors and estimates |

pub(crate) mod bodies;
pub(crate) mod demo;
pub(crate) mod hard;
pub(crate) mod made;
pub(crate) mod methods;
mod page;
pub(crate) mod peers;
pub(crate) mod physics;
pub(crate) mod plots;
pub(crate) mod simulation;

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use supple::io::write_atomically;

use crate::problem::Problem;
use made::Made;
pub(crate) use page::page;
use plots::Plot;

/// The name of a report's file.
pub(crate) const FILE: &str = "report.html";

/// What one command adds to a report.
#[derive(Deserialize, Serialize)]
pub(crate) struct Part {
    pub(crate) made: Made,
    pub(crate) sections: Vec<Section>,
}

#[derive(Default, Deserialize, Serialize)]
pub(crate) struct Section {
    pub(crate) title: String,
    pub(crate) paragraphs: Vec<String>,
    pub(crate) tables: Vec<Table>,
    pub(crate) figures: Vec<Figure>,
    /// A table in words that the screen has as well.
    pub(crate) listing: Option<String>,
}

#[derive(Deserialize, Serialize)]
pub(crate) struct Table {
    pub(crate) title: String,
    pub(crate) heads: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

/// Panels of which one is chosen, or all in a grid.
#[derive(Deserialize, Serialize)]
pub(crate) struct Figure {
    pub(crate) caption: String,
    panels: Vec<Panel>,
    /// Of the grid.
    columns: Option<usize>,
    scale: Option<Scale>,
}

/// What the colours of bodies stand for, from zero.
#[derive(Clone, Deserialize, Serialize)]
pub(crate) struct Scale {
    most: String,
    unit: String,
}

#[derive(Deserialize, Serialize)]
pub(crate) struct Panel {
    name: String,
    plot: Plot,
}

impl Panel {
    pub(crate) fn new(name: impl Into<String>, plot: Plot) -> Self {
        Self { name: name.into(), plot }
    }
}

impl Figure {
    /// One panel, which may be chosen if there are several.
    pub(crate) fn choice(caption: impl Into<String>, panels: Vec<Panel>) -> Self {
        Self { caption: caption.into(), panels, columns: None, scale: None }
    }

    /// Bodies in rows; colours reach from zero to so many millimetres.
    pub(crate) fn grid(
        caption: impl Into<String>,
        panels: Vec<Panel>,
        columns: usize,
        most: f64,
        of: &str,
    ) -> Self {
        let scale = Scale { most: plots::short(most), unit: format!("mm {of}") };
        Self { caption: caption.into(), panels, columns: Some(columns), scale: Some(scale) }
    }
}

/// Adds a part, or puts it in the place of an earlier one of this name, to the report in a folder: parts are kept in
/// `report/NAME.json`. Gives the path of the report.
pub(crate) fn add(folder: &Path, name: &str, part: &Part) -> Result<PathBuf, Problem> {
    let parts = folder.join("report");
    fs::create_dir_all(&parts).map_err(|error| Problem::in_file(&parts, error))?;
    let text = serde_json::to_string(part).map_err(Problem::of)?;
    write(&parts.join(format!("{name}.json")), &text)?;
    let mut all = vec![];
    for name in PARTS {
        let path = parts.join(format!("{name}.json"));
        if let Ok(text) = fs::read_to_string(&path) {
            all.push(serde_json::from_str(&text).map_err(|error| Problem::in_file(&path, error))?);
        }
    }
    let path = folder.join(FILE);
    write(&path, &page("supple: methods against error", &all)?)?;
    Ok(path)
}

/// The parts of an evaluation, in their order.
const PARTS: [&str; 3] = [methods::NAME, physics::NAME, hard::NAME];

fn write(path: &Path, text: &str) -> Result<(), Problem> {
    write_atomically(path, |file| file.write_all(text.as_bytes())).map_err(Problem::of)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(title: &str) -> Part {
        let section = Section { title: title.into(), ..Section::default() };
        Part { made: Made::now(&["simulate".into()], "none"), sections: vec![section] }
    }

    #[test]
    fn parts_of_earlier_commands_stay_and_the_same_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let has = |title: &str| {
            fs::read_to_string(folder.path().join(FILE)).unwrap().contains(&format!("<h2>{title}</h2>"))
        };
        for (name, title) in [(hard::NAME, "hard"), (methods::NAME, "old"), (methods::NAME, "new")] {
            add(folder.path(), name, &part(title)).unwrap();
        }
        assert!(has("hard") && has("new") && !has("old"));
        fs::write(folder.path().join("report/hard.json"), "{").unwrap();
        let said = add(folder.path(), methods::NAME, &part("new")).unwrap_err().to_string();
        assert!(said.contains("hard.json"), "{said}");
    }
}
