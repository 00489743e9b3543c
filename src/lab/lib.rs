//! The laboratory: how far is a method from the truth, and what does it cost? Methods run over scenes at
//! multiples of a step of the scene ([`timing::Timing`]), for the paper's bar [`DT`]; the truth is the exact step
//! ([`supple::tled`]) at that step or a part of it on the same mesh.
//! SI units inside, millimetres and microseconds in the tables for people.
//!
//! | module | what it holds |
//! |---|---|
//! | [`scenes`] | bodies, supports and loads as data; [`moving`] those that fall, turn and swing |
//! | [`command`] | the command `supple-lab` |
//! | [`course`] | how loads vary over time |
//! | [`touched`] | the surface of a body where an instrument touches it |
//! | [`timing`] | how time is counted in a scene |
//! | [`truth`] | the exact motion of a scene, kept on disk |
//! | [`method`] | what is compared: one match arm each |
//! | [`implicit`] | backward Euler and the implicit midpoint rule, to compare with |
//! | [`literal`] | the laws as the paper prints them, with stress at rest |
//! | [`networks`] | the networks that come with the crate |
//! | [`run`] | one method, one scene, one step: a row |
//! | [`measure`] | errors of a motion against the truth |
//! | [`evaluate`] | rows as asked for in a [`evaluate::Plan`] |
//! | [`equal_error`] | how much longer implicit steps take for the same error |
//! | [`hard`] | is a run ever wrong without a word? |
//! | [`tolerance`] | does an adaptive step keep its tolerance, and what does it cost? |
//! | [`cost`] | what a simulated second takes, by size of mesh |
//! | [`pulls`] | a lobe on pulls: tracked points, random ones, what they cost |
//! | [`physics`] | cases with a truth that is not ours: nature, closed forms, published values |
//! | [`large_strain`] | elements at strains beyond a half |
//! | [`table`] | rows as CSV and as aligned text |
//! | `training` (feature `train`) | scenes to learn from |
//! | [`sweep`] | error over step on one scene, with fitted slopes |

// Where nobody reads they panic; `supple_cli::screen` has what prints.
#![cfg_attr(not(test), deny(clippy::print_stdout, clippy::print_stderr))]

pub mod command;
pub mod cost;
pub mod course;
pub mod equal_error;
mod error;
pub mod evaluate;
pub mod hard;
pub mod implicit;
pub mod large_strain;
pub mod literal;
pub mod measure;
pub mod method;
pub mod moving;
pub mod networks;
pub mod physics;
pub mod pulls;
#[path = "../train/random_numbers.rs"]
mod random_numbers;
mod report;
pub mod run;
pub mod scenes;
pub mod sweep;
pub mod table;
#[cfg(test)]
#[path = "../../tests/lab/main.rs"]
mod tests;
mod threads;
pub mod timing;
pub mod tolerance;
pub mod touched;
#[cfg(feature = "train")]
pub mod training;
pub mod truth;

// So that the tests read as those of a user.
#[cfg(test)]
extern crate self as supple_lab;

use std::path::Path;
use std::{fs, io};

pub use error::LabError;

/// The paper's step, s.
pub const DT: f32 = 3e-5;

/// Steps of [`DT`] between two snapshots of the truth (0.03 s): ten steps of the paper's hundredfold step.
pub const INTERVAL_STEPS: u32 = 1_000;

/// Multiples of a scene's step in the table of results.
pub const MULTIPLES: [u32; 5] = [1, 10, 20, 50, 100];

/// Makes a folder for results, unless it is there.
fn create_folder(path: &Path) -> Result<(), LabError> {
    fs::create_dir_all(path).map_err(|error| {
        let words = format!("{}: cannot be made: {error}", path.display());
        LabError::Write(io::Error::new(error.kind(), words))
    })
}
