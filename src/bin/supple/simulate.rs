//! `supple simulate`: a scene file in, results in a folder out.

use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use supple::simulation::Simulation;
use supple::state::VecState;

use crate::problem::{End, Problem};
use crate::report::{self, simulation};
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
    let job = Job {
        setup: &setup,
        out: Some(Out { path: out, force }),
        unchecked,
        progress: progress_bar(&setup, ""),
        watch: &mut |_| {},
    };
    let Simulated { folder, state, outcome, conclusion } = job.run()?;
    if let Some(folder) = folder {
        let part = simulation::part(&setup, &state, &outcome, &conclusion);
        let title = format!("supple: {}", path.display());
        folder.write_text(report::FILE, &report::page(&title, &[part])?)?;
        folder.publish()?;
    }
    conclusion.print();
    row("results", out.display());
    row("report", out.join(report::FILE).display());
    Ok(outcome.divergence.into())
}

/// A bar for a simulation, with what it is about.
pub(crate) fn progress_bar(setup: &Setup, about: &str) -> ProgressBar {
    let style =
        ProgressStyle::with_template("{msg}{bar:40} {pos} of {len} ms simulated, {elapsed} so far, {eta} to go")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new((setup.time.end * 1e3).ceil() as u64).with_style(style).with_message(about.to_owned())
}

/// A simulation from rest, with its results in a folder that is not in its place yet, if any.
pub(crate) struct Job<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) out: Option<Out<'a>>,
    /// Whether a step above the critical one is taken all the same.
    pub(crate) unchecked: bool,
    pub(crate) progress: ProgressBar,
    /// Is shown the state at each frame.
    pub(crate) watch: &'a mut dyn FnMut(&VecState),
}

/// Where results go.
pub(crate) struct Out<'a> {
    pub(crate) path: &'a Path,
    /// Whether results in a folder that is there are overwritten.
    pub(crate) force: bool,
}

/// What a simulation came to.
pub(crate) struct Simulated {
    pub(crate) folder: Option<Folder>,
    pub(crate) state: VecState,
    pub(crate) outcome: Outcome,
    pub(crate) conclusion: Conclusion,
}

impl Job<'_> {
    pub(crate) fn run(self) -> Result<Simulated, Problem> {
        let Self { setup, out, unchecked, progress, watch } = self;
        // All that can be refused in the scene is refused before there is a folder.
        let start = Start::new(setup, unchecked)?;
        let mut folder = out.map(|Out { path, force }| Folder::create(path, force)).transpose()?;

        let tick = |time: f64| progress.set_position((time * 1e3) as u64);
        let mut frame = |simulation: &mut Simulation<'_>| {
            let (scene, state) = simulation.parts_mut();
            watch(state);
            folder.as_mut().map_or(Ok(()), |folder| folder.add_frame(setup, scene.view(), state))
        };
        let (mut simulation, outcome) = run(setup, start, &tick, &mut frame)?;
        if outcome.divergence.is_some() {
            // The last state that may be believed.
            frame(&mut simulation)?;
        }
        progress.finish_and_clear();
        let scene = simulation.scene().view();
        let conclusion = results::conclude(folder.as_ref(), setup, scene, simulation.state(), &outcome)?;
        Ok(Simulated { folder, state: simulation.state().clone(), outcome, conclusion })
    }
}
