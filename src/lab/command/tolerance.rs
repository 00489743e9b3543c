//! `supple-lab tolerance`: adaptive steps over the hard cases, against the best fixed steps.

use std::path::PathBuf;

use crate::hard::{Counts, Plan};
use crate::method::Method;
use crate::tolerance::{evaluate, text};
use clap::Args;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, output, print};

#[derive(Args)]
pub(crate) struct Asked {
    /// Folder for tolerance.csv and the truths
    #[arg(long)]
    out: PathBuf,
    /// Hard case or scene of the laboratory, all of them unless given but paper-bar-fine and million-steps, which take
    /// minutes; may be repeated
    #[arg(long = "scene", value_name = "NAME")]
    scenes: Vec<String>,
    /// Method of the fixed steps, long ones unless given; may be repeated
    #[arg(long = "method", value_name = "NAME")]
    methods: Vec<String>,
    /// Tolerance of the adaptive steps, mm; may be repeated
    #[arg(long = "tolerance", value_name = "MM", required = true)]
    tolerances: Vec<f64>,
    /// Random scenes among the hard cases
    #[arg(long, value_name = "N", default_value_t = 200)]
    random: u32,
}

pub(crate) fn judge(Asked { out, scenes, methods, tolerances, random }: &Asked) -> Result<End, Problem> {
    if let Some(wrong) = tolerances.iter().find(|tolerance| !(tolerance.is_finite() && **tolerance > 0.0)) {
        return Err(Problem(format!("--tolerance {wrong}: it must be a positive number of mm")));
    }
    let methods = if methods.is_empty() { &[Method::Long.name().to_owned()] } else { &**methods };
    let counts = Counts { random: *random, ..Counts::default() };
    let plan = Plan::new(scenes, None, methods, counts, supple::guard::EVERY).map_err(Problem::of)?;
    let rows = evaluate(&plan, tolerances, out, |words| message!("{words}")).map_err(Problem::of)?;
    print(text(&rows));
    output!("\nresults  {}", out.join("tolerance.csv").display());
    Ok(End::Reached)
}
