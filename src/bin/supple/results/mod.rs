//! What a simulation leaves behind: frames for ParaView, `final.csv`, `summary.json`, and a table on the
//! screen. People read millimetres and percent; files hold SI units unless their names say otherwise.

pub(crate) mod figures;
pub(crate) mod folder;
pub(crate) mod picture;
pub(crate) mod report;
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

/// Leaves `final.csv` and `summary.json` in the folder, the table and the warnings on the screen.
pub(crate) fn conclude<M: ElementMaterial>(
    folder: &Folder,
    setup: &Setup,
    scene: SceneView<'_, M>,
    state: &VecState,
    outcome: &Outcome,
) -> Result<Figures, Problem> {
    let figures = Figures::new(setup, scene, state, outcome);
    let warnings = warnings::of(setup, outcome);
    let report = report::of(setup, outcome, &figures, &warnings);
    folder.write_final(&setup.body, state)?;
    folder.write_text("summary.json", &report.summary())?;
    print(report.table());
    for warning in warnings {
        message!("warning: {warning}");
    }
    Ok(figures)
}
