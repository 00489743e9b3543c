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

pub mod bodies;
pub(crate) mod demo;
pub mod made;
mod page;
pub mod plots;
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
pub struct ReportPart {
    pub made: Made,
    pub sections: Vec<Section>,
}

#[derive(Default, Deserialize, Serialize)]
pub struct Section {
    pub title: String,
    pub paragraphs: Vec<String>,
    pub tables: Vec<Table>,
    pub figures: Vec<Figure>,
    /// A table in words that the screen has as well.
    pub listing: Option<String>,
}

#[derive(Deserialize, Serialize)]
pub struct Table {
    pub title: String,
    pub heads: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// Panels of which one is chosen, or all in a grid.
#[derive(Deserialize, Serialize)]
pub struct Figure {
    pub caption: String,
    panels: Vec<Panel>,
    /// Of the grid.
    columns: Option<usize>,
    scale: Option<Scale>,
}

/// What the colours of bodies stand for, from zero.
#[derive(Clone, Deserialize, Serialize)]
pub struct Scale {
    most: String,
    unit: String,
}

#[derive(Deserialize, Serialize)]
pub struct Panel {
    name: String,
    pub plot: Plot,
}

impl Panel {
    pub fn new(name: impl Into<String>, plot: Plot) -> Self {
        Self { name: name.into(), plot }
    }
}

impl Figure {
    /// One panel, which may be chosen if there are several.
    pub fn choice(caption: impl Into<String>, panels: Vec<Panel>) -> Self {
        Self { caption: caption.into(), panels, columns: None, scale: None }
    }

    /// Bodies in rows; colours reach from zero to so many millimetres.
    pub fn grid(caption: impl Into<String>, panels: Vec<Panel>, columns: usize, most: f64, of: &str) -> Self {
        let scale = Scale { most: plots::short(most), unit: format!("mm {of}") };
        Self { caption: caption.into(), panels, columns: Some(columns), scale: Some(scale) }
    }
}

/// Adds a part, or puts it in the place of an earlier one of this name, to the report in a folder: parts are kept in
/// `report/NAME.json`, and those of `names` are shown in this order. Gives the path of the report.
pub fn add(folder: &Path, names: &[&str], name: &str, part: &ReportPart) -> Result<PathBuf, Problem> {
    let parts = folder.join("report");
    fs::create_dir_all(&parts).map_err(|error| Problem::in_file(&parts, error))?;
    let text = serde_json::to_string(part).map_err(Problem::of)?;
    write(&parts.join(format!("{name}.json")), &text)?;
    let mut all = vec![];
    for name in names {
        let path = parts.join(format!("{name}.json"));
        if let Ok(text) = fs::read_to_string(&path) {
            all.push(serde_json::from_str(&text).map_err(|error| Problem::in_file(&path, error))?);
        }
    }
    let path = folder.join(FILE);
    write(&path, &page("supple: methods against error", &all)?)?;
    Ok(path)
}

fn write(path: &Path, text: &str) -> Result<(), Problem> {
    write_atomically(path, |file| file.write_all(text.as_bytes())).map_err(Problem::of)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(title: &str) -> ReportPart {
        let section = Section { title: title.into(), ..Section::default() };
        ReportPart { made: Made::now(&["simulate".into()], "none"), sections: vec![section] }
    }

    #[test]
    fn parts_of_earlier_commands_stay_and_the_same_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let has =
            |title: &str| fs::read_to_string(folder.path().join(FILE)).unwrap().contains(&format!("<h2>{title}</h2>"));
        let names = ["methods", "hard"];
        for (name, title) in [("hard", "hard"), ("methods", "old"), ("methods", "new")] {
            add(folder.path(), &names, name, &part(title)).unwrap();
        }
        assert!(has("hard") && has("new") && !has("old"));
        fs::write(folder.path().join("report/hard.json"), "{").unwrap();
        let said = add(folder.path(), &names, "methods", &part("new")).unwrap_err().to_string();
        assert!(said.contains("hard.json"), "{said}");
    }
}
