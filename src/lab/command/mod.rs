//! The commands of `supple-lab`, one a file.

pub(crate) mod cost;
#[cfg(feature = "train")]
mod exemplar;
pub(crate) mod hard;
pub(crate) mod large_strain;
pub(crate) mod methods;
pub(crate) mod physics;
pub(crate) mod pulls;
#[cfg(feature = "train")]
pub(crate) mod quantise;
pub(crate) mod tolerance;
#[cfg(feature = "train")]
pub(crate) mod train;

use std::ffi::OsString;
use std::path::Path;

use clap::{Parser, Subcommand};
use supple_cli::problem::{End, Problem};
use supple_cli::report::{self, ReportPart};
use supple_cli::screen::output;

use crate::report::NAMES;

/// Adds a part to the report, and says where results are.
fn finish(out: &Path, results: &str, name: &str, part: &ReportPart) -> Result<End, Problem> {
    let report = report::add(out, &NAMES, name, part)?;
    output!("\nresults  {}", out.join(results).display());
    output!("report   {}", report.display());
    Ok(End::Reached)
}

/// Judges ways to move soft tissue, and trains networks for it.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// How far from the exact motion methods are, and what they cost: results.csv and report.html
    Methods(methods::Asked),
    /// Elements against nature, closed forms and published values: physics.csv, physics.md, pictures and a part of
    /// report.html
    Physics(physics::Asked),
    /// Whether runs are ever wrong without a word: hard.csv, hard-frames.csv and a part of report.html
    Hard(hard::Asked),
    /// Adaptive steps over the hard cases, against fixed steps: tolerance.csv
    Tolerance(tolerance::Asked),
    /// Elements at strains beyond a half, against nodal pressure on fine meshes: large-strain.csv
    LargeStrain(large_strain::Asked),
    /// What a simulated second takes, by size of mesh and method: cost.csv
    Cost(cost::Asked),
    /// A lobe on pulls: errors and times of tracked points, what pulls cost, whether any run goes wrong
    Pulls(pulls::Asked),
    /// Train a network for the learned step; a training that was stopped goes on where it was
    #[cfg(feature = "train")]
    Train(train::Asked),
    /// A weight file with int8 layers from a float32 one, by the samples of its recipe
    #[cfg(feature = "train")]
    Quantise(quantise::Asked),
    /// Train a network for the learned step: this build cannot, the feature `train` adds it
    #[cfg(not(feature = "train"))]
    #[command(disable_help_flag = true, alias = "quantise")]
    Train {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
        _arguments: Vec<String>,
    },
}

/// Does what the arguments ask for, the first of which is the name of the program. Where they cannot be read, or ask for help, it
/// ends the process as `clap` does.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<End, Problem> {
    match Arguments::parse_from(arguments).command {
        Command::Methods(asked) => methods::judge(&asked),
        Command::Physics(asked) => physics::judge(&asked),
        Command::Hard(asked) => hard::judge(&asked),
        Command::Tolerance(asked) => tolerance::judge(&asked),
        Command::LargeStrain(asked) => large_strain::judge(&asked),
        Command::Cost(asked) => cost::judge(&asked),
        Command::Pulls(asked) => pulls::judge(&asked),
        #[cfg(feature = "train")]
        Command::Train(asked) => train::train(&asked),
        #[cfg(feature = "train")]
        Command::Quantise(asked) => quantise::quantise(&asked),
        #[cfg(not(feature = "train"))]
        Command::Train { .. } => Err(Problem(
            "this command was built without training; build it with `cargo build --release -p supple-lab --features train`"
                .into(),
        )),
    }
}
