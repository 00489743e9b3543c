//! The command `supple`: simulate a scene, inspect a mesh, a scene or a network, show what the kernel does. A library,
//! so that the laboratory (`supple-lab`) reads the same scene files, prints on the same screen and adds to the same
//! kind of report.
//!
//! Exit codes: 0 as asked, 2 the input is not usable or the results cannot be written, 3 the simulation diverged, 141
//! as asked but nobody read what was printed.

// Where nobody reads they panic; `screen` has what prints.
#![deny(clippy::print_stdout, clippy::print_stderr)]
// What is public here is for the laboratory alone.
#![allow(missing_docs)]

mod added_mass;
mod convert;
mod demo;
pub mod element_name;
mod field;
mod fit;
#[cfg(test)]
mod hostile;
mod inspect;
mod moved;
pub mod problem;
pub mod report;
mod rest;
mod results;
mod run;
pub mod scene;
pub mod screen;
mod simulate;
mod unloaded;
pub mod weight_file;

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use problem::End;

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
    /// A liver that breathes and is pressed, by exact, long, adaptive and learned steps side by side: a table and report.html
    Demo {
        /// Folder for frames and report; results of an earlier demo are overwritten
        #[arg(long, default_value = "out/demo")]
        out: PathBuf,
    },
    /// The liver of the demo on a coarser mesh, as JSON: tools/page.sh makes the web page of it
    #[command(hide = true)]
    Liver,
    /// Make the signed distances of a closed surface, for an instrument of any form
    Field(field::Asked),
    Fit(fit::Asked),
    Unloaded(unloaded::Asked),
    /// Convert weight files to and from safetensors
    #[command(subcommand)]
    Weights(convert::Conversion),
    /// Warp an image with a run: `python -m supple warp`, as image formats are those of SimpleITK
    #[command(disable_help_flag = true)]
    Warp(moved::Arguments),
    /// Moved to the laboratory
    #[command(hide = true, disable_help_flag = true)]
    Evaluate(moved::Arguments),
    /// Moved to the laboratory too
    #[command(hide = true, disable_help_flag = true)]
    Train(moved::Arguments),
}

/// What the program does.
#[must_use]
pub fn main() -> ExitCode {
    screen::ended(match Arguments::parse().command {
        Command::Simulate { scene, out, force, unchecked } => simulate::simulate(&scene, &out, force, unchecked),
        Command::Inspect { file, accuracy } => inspect::inspect(&file, accuracy).map(|()| End::Reached),
        Command::Demo { out } => demo::demo(&out),
        Command::Liver => demo::page::liver(),
        Command::Field(asked) => field::make(&asked),
        Command::Fit(asked) => fit::fit(&asked),
        Command::Unloaded(asked) => unloaded::unloaded(&asked),
        Command::Weights(conversion) => convert::convert(&conversion),
        Command::Warp(given) => moved::say_python(&given),
        Command::Evaluate(_) => moved::refuse("evaluate", "methods|physics|hard|tolerance --out DIR"),
        Command::Train(_) => moved::refuse("train", "train RECIPE --out FILE"),
    })
}
