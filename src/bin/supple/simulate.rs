//! `supple simulate`: a scene file in, results in a folder out.

use std::path::Path;

use indicatif::{ProgressBar, ProgressStyle};
use supple::material::Material;

use crate::prepare::{Job, Setup};
use crate::report::{self, Folder};
use crate::run::{self, Start};
use crate::scene_file::{Problem, SceneFile};

/// How a simulation ended, for the exit code.
pub(crate) enum End {
    Reached,
    Diverged(String),
}

pub(crate) fn simulate(path: &Path, out: &Path, force: bool, insist: bool) -> Result<End, Problem> {
    let file = SceneFile::read(path)?;
    let setup = Setup::read(&file)?;
    setup.with_material(Simulation { setup: &setup, out, force, insist })
}

struct Simulation<'a> {
    setup: &'a Setup,
    out: &'a Path,
    force: bool,
    insist: bool,
}

impl Job for Simulation<'_> {
    type Output = Result<End, Problem>;

    fn run<M: Material>(self, material: M) -> Self::Output {
        let setup = self.setup;
        let (scene, mut state) = setup.build(material)?;
        // All that can be refused is refused before the folder is touched.
        let start = Start::new(setup, &scene, &mut state, self.insist)?;
        let mut folder = Folder::create(self.out, self.force)?;

        let progress = ProgressBar::new((setup.time.end * 1e3).ceil() as u64).with_style(progress_style());
        let tick = |time: f64| progress.set_position((time * 1e3) as u64);
        let outcome = run::run(setup, &scene, &mut state, start, tick, |scene, state| {
            folder.add_frame(&setup.body, scene, state)
        })?;
        progress.finish_and_clear();

        if outcome.divergence.is_some() {
            // The last state that may be believed.
            folder.add_frame(&setup.body, &scene, &state)?;
        }
        report::conclude(&folder, setup, &scene, &state, &outcome)?;
        println!("{:<21} {}", "results", self.out.display());
        Ok(outcome.divergence.map_or(End::Reached, |divergence| End::Diverged(divergence.to_string())))
    }
}

fn progress_style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:40} {pos} of {len} ms simulated, {elapsed} so far, {eta} to go")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}
