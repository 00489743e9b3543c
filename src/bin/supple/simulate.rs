//! `supple simulate`: a scene file in, results in a folder out.

use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use supple::element::{ElementMaterial, MaterialWork};
use supple::state::VecState;

use crate::problem::{End, Problem};
use crate::results::folder::Folder;
use crate::results::{self, Conclusion};
use crate::run::outcome::Outcome;
use crate::run::run;
use crate::run::start::Start;
use crate::scene::file::SceneFile;
use crate::scene::setup::Setup;
use crate::screen::row;

pub(crate) fn simulate(path: &Path, out: &Path, force: bool, unchecked: bool) -> Result<End, Problem> {
    let setup = Setup::read(&SceneFile::read(path)?)?;
    let progress = ProgressBar::new((setup.time.end * 1e3).ceil() as u64).with_style(progress_style());
    let simulation = Simulation { setup: &setup, out, force, unchecked, progress };
    let Simulated { folder, outcome, conclusion, .. } = setup.with_material(simulation)?;
    folder.publish()?;
    conclusion.print();
    row("results", out.display());
    Ok(outcome.divergence.into())
}

fn progress_style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:40} {pos} of {len} ms simulated, {elapsed} so far, {eta} to go")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// A simulation from rest, with its results in a folder that is not in its place yet.
pub(crate) struct Simulation<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) out: &'a Path,
    /// Whether results in a folder that is there are overwritten.
    pub(crate) force: bool,
    /// Whether a step above the critical one is taken all the same.
    pub(crate) unchecked: bool,
    pub(crate) progress: ProgressBar,
}

/// What a simulation came to.
pub(crate) struct Simulated {
    pub(crate) folder: Folder,
    pub(crate) state: VecState,
    pub(crate) outcome: Outcome,
    pub(crate) conclusion: Conclusion,
}

impl MaterialWork for Simulation<'_> {
    type Output = Result<Simulated, Problem>;

    fn run<M: ElementMaterial>(self, material: M) -> Self::Output {
        let Self { setup, out, force, unchecked, progress } = self;
        let (scene, mut state) = setup.build(material)?;
        let scene = scene.view();
        // All that can be refused in the scene is refused before there is a folder.
        let start = Start::new(setup, scene, &mut state, unchecked)?;
        let mut folder = Folder::create(out, force)?;

        let tick = |time: f64| progress.set_position((time * 1e3) as u64);
        let mut frame = |state: &mut VecState| folder.add_frame(setup, scene, state);
        let outcome = run(setup, scene, &mut state, start, &tick, &mut frame)?;
        if outcome.divergence.is_some() {
            // The last state that may be believed.
            frame(&mut state)?;
        }
        progress.finish_and_clear();
        let conclusion = results::conclude(&folder, setup, scene, &state, &outcome)?;
        Ok(Simulated { folder, state, outcome, conclusion })
    }
}
