//! What a simulation leaves behind: frames for ParaView, `final.csv`, `summary.json`, `report.html`, and a table on the
//! screen. People read millimetres and percent; files hold SI units unless their names say otherwise.

pub(crate) mod figures;
pub(crate) mod folder;
pub(crate) mod instrument_mesh;
mod staging;
pub(crate) mod summary;
pub(crate) mod warnings;

use supple::material::VecMaterial;
use supple::scene::SceneView;
use supple::state::VecState;

use crate::problem::Problem;
use crate::run::outcome::Outcome;
use crate::scene::setup::Setup;
use crate::screen::{message, print};
use figures::Figures;
use folder::Folder;
use summary::Summary;

/// What there is to tell of a simulation once its results are in their place.
pub(crate) struct Conclusion {
    pub(crate) summary: Summary,
    pub(crate) warnings: Vec<String>,
}

/// Tells what there is to tell, and adds `final.csv` and `summary.json` to the folder, if there is one.
pub(crate) fn conclude(
    folder: Option<&Folder>,
    setup: &Setup,
    scene: SceneView<'_, VecMaterial>,
    state: &VecState,
    outcome: &Outcome,
) -> Result<Conclusion, Problem> {
    let figures = Figures::new(setup, scene, state, outcome);
    let warnings = warnings::of(setup, outcome);
    let summary = summary::of(setup, outcome, &figures, &warnings);
    if let Some(folder) = folder {
        folder.write_final(&setup.body, state)?;
        if !outcome.reactions.is_empty() {
            folder.write_text("reactions.csv", &outcome.reactions.table())?;
        }
        if !outcome.pulls.is_empty() {
            folder.write_text("pulls.csv", &outcome.pulls.table(setup.body.centre))?;
        }
        if !outcome.points.moved().is_empty() {
            folder.write_text("points.csv", &outcome.points.table(setup.body.centre))?;
        }
        folder.write_text("summary.json", &summary.json())?;
    }
    Ok(Conclusion { summary, warnings })
}

impl Conclusion {
    /// Prints the table and the warnings.
    pub(crate) fn print(&self) {
        print(self.summary.table());
        for warning in &self.warnings {
            message!("warning: {warning}");
        }
    }
}
