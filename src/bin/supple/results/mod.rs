//! What a simulation leaves behind: frames for ParaView, `final.csv`, `summary.json`, and a table on the
//! screen. People read millimetres and percent; files hold SI units unless their names say otherwise.

pub(crate) mod figures;
pub(crate) mod folder;
pub(crate) mod instrument_mesh;
pub(crate) mod picture;
pub(crate) mod report;
mod staging;
pub(crate) mod warnings;

use supple::element::ElementMaterial;
use supple::scene::SceneView;
use supple::state::VecState;

use crate::problem::Problem;
use crate::run::outcome::Outcome;
use crate::scene::setup::Setup;
use crate::screen::{message, print};
use figures::Figures;
use folder::Folder;
use report::Report;

/// What there is to tell of a simulation once its results are in their place.
pub(crate) struct Conclusion {
    pub(crate) figures: Figures,
    report: Report,
    warnings: Vec<String>,
}

/// Adds `final.csv` and `summary.json` to the folder.
pub(crate) fn conclude<M: ElementMaterial>(
    folder: &Folder,
    setup: &Setup,
    scene: SceneView<'_, M>,
    state: &VecState,
    outcome: &Outcome,
) -> Result<Conclusion, Problem> {
    let figures = Figures::new(setup, scene, state, outcome);
    let warnings = warnings::of(setup, outcome);
    let report = report::of(setup, outcome, &figures, &warnings);
    folder.write_final(&setup.body, state)?;
    if !outcome.reactions.is_empty() {
        folder.write_text("reactions.csv", &outcome.reactions.table())?;
    }
    folder.write_text("summary.json", &report.summary())?;
    Ok(Conclusion { figures, report, warnings })
}

impl Conclusion {
    /// Prints the table and the warnings.
    pub(crate) fn print(&self) {
        print(self.report.table());
        for warning in &self.warnings {
            message!("warning: {warning}");
        }
    }
}
