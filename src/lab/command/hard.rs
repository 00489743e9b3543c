//! `supple-lab hard`: are runs ever wrong without a word?

use std::path::PathBuf;

use crate::hard::{Counts, Plan, evaluate, ordinary, press, report};
use clap::Args;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, print};

use super::finish;
use crate::report::hard;

#[derive(Args)]
pub(crate) struct Asked {
    /// Folder for hard.csv, hard-frames.csv, report.html and the truths
    #[arg(long)]
    out: PathBuf,
    /// Hard case or scene of the laboratory, all of them unless given but paper-bar-fine and million-steps, which take
    /// minutes; may be repeated
    #[arg(long = "scene", value_name = "NAME")]
    scenes: Vec<String>,
    /// Method, all that are for hard cases unless given; may be repeated
    #[arg(long = "method", value_name = "NAME")]
    methods: Vec<String>,
    /// Mesh to judge as a hard case, with the scenes that are named: held at one end of its longest axis, under its own
    /// weight and a pull at the other end
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Factor to metres of that mesh; 0.001 for one in millimetres
    #[arg(long, value_name = "S", default_value_t = 1.0, requires = "mesh")]
    scale: f64,
    /// Random scenes among the hard cases
    #[arg(long, value_name = "N", default_value_t = 200)]
    random: u32,
    /// Scenes in which a ball pushes a body that may give way
    #[arg(long, value_name = "N", default_value_t = press::SCENES)]
    presses: u32,
    /// Ordinary scenes, which show how often right steps are doubted
    #[arg(long, value_name = "N", default_value_t = ordinary::SCENES)]
    ordinary: u32,
    /// Steps of a run in one of its guard's second run
    #[arg(long, value_name = "N", default_value_t = supple::guard::EVERY)]
    every: u32,
}

pub(crate) fn judge(asked: &Asked) -> Result<End, Problem> {
    let Asked { out, scenes, methods, mesh, scale, random, presses, ordinary, every } = asked;
    if !(scale.is_finite() && *scale > 0.0) {
        return Err(Problem(format!("--scale {scale}: it must be a positive number")));
    }
    let mesh = mesh.as_deref().map(|path| (path, *scale));
    let counts = Counts { random: *random, presses: *presses, ordinary: *ordinary };
    let plan = Plan::new(scenes, mesh, methods, counts, *every).map_err(Problem::of)?;
    let judged = evaluate(&plan, out, |words| message!("{words}")).map_err(Problem::of)?;
    print(report::text(&judged));
    finish(out, "hard.csv", hard::NAME, &hard::part(&judged))
}
