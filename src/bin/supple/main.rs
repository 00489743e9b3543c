//! The command `supple`: simulate a scene, inspect a mesh, a scene or a network, show what the kernel does, judge methods.
//!
//! Exit codes: 0 as asked, 2 the input is not usable or the results cannot be written, 3 the simulation diverged, 141 as asked
//! but nobody read what was printed.

// Where nobody reads they panic; `screen` has what prints.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod added_mass;
mod demo;
mod element_name;
mod evaluate;
mod field;
#[cfg(test)]
mod hostile;
mod inspect;
mod networks;
mod problem;
mod report;
mod results;
mod run;
mod scene;
mod screen;
mod simulate;
mod weight_file;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use networks::convert;
#[cfg(feature = "train")]
use networks::train;
use problem::End;
use screen::message;

/// Moves soft tissue: total Lagrangian explicit dynamics on tetrahedral meshes.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Simulate a scene: frames for ParaView, final.csv, summary.json and report.html
    Simulate {
        /// The scene, a TOML file
        scene: PathBuf,
        /// Folder for the results
        #[arg(long)]
        out: PathBuf,
        /// Overwrite the results in a folder that is there
        #[arg(long)]
        force: bool,
        /// Take a step above the critical one all the same
        #[arg(long)]
        unchecked: bool,
    },
    /// Look at a mesh, a scene or a weight file: sizes, quality, critical step, memory, cost, training
    Inspect {
        /// A mesh (.vtk, .vtu, .msh, .node, .ele), a scene (.toml) or a network (.weights)
        file: PathBuf,
        /// Recommend a step for the scene whose error, by step doubling, is below this (mm)
        #[arg(long, value_name = "MM")]
        accuracy: Option<f64>,
    },
    /// A liver lobe that an instrument moves, by exact, damped and learned steps side by side: a table and report.html
    Demo {
        /// Folder for frames and report; results of an earlier demo are overwritten
        #[arg(long, default_value = "out/demo")]
        out: PathBuf,
    },
    /// How far from the exact motion methods are, and what they cost: results.csv and report.html
    Evaluate(evaluate::Asked),
    /// Train a network for the learned step; a training that was stopped goes on where it was
    #[cfg(feature = "train")]
    Train(train::Asked),
    /// Train a network for the learned step: this build cannot, the feature `train` adds it
    #[cfg(not(feature = "train"))]
    #[command(disable_help_flag = true)]
    Train {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
        _arguments: Vec<String>,
    },
    /// Make the signed distances of a closed surface, for an instrument of any form
    Field(field::Asked),
    /// Convert weight files to and from safetensors
    #[command(subcommand)]
    Weights(convert::Conversion),
}

fn main() -> ExitCode {
    let done = match Arguments::parse().command {
        Command::Simulate { scene, out, force, unchecked } => {
            simulate::simulate(&scene, &out, force, unchecked)
        }
        Command::Inspect { file, accuracy } => inspect::inspect(&file, accuracy).map(|()| End::Reached),
        Command::Demo { out } => demo::demo(&out),
        Command::Evaluate(asked) => evaluate::evaluate(&asked),
        #[cfg(feature = "train")]
        Command::Train(asked) => train::train(&asked),
        #[cfg(not(feature = "train"))]
        Command::Train { .. } => Err(problem::Problem(
            "train: this command was built without training; build it with `cargo build --release --features train`".into(),
        )),
        Command::Field(asked) => field::make(&asked),
        Command::Weights(conversion) => convert::convert(&conversion),
    };
    match done {
        Ok(End::Reached) => screen::exit_code(),
        Ok(End::Diverged(divergence)) => {
            message!("error: the simulation {divergence}; the results end before that");
            ExitCode::from(3)
        }
        Err(problem) => {
            message!("error: {problem}");
            ExitCode::from(2)
        }
    }
}
