//! `supple-lab physics`: elements against nature, closed forms and published values.

use std::path::PathBuf;

use crate::physics::{Plan, evaluate, tables};
use clap::Args;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, print};

use super::finish;
use crate::report::physics;

#[derive(Args)]
pub(crate) struct Asked {
    /// Folder for physics.csv, physics.md, pictures and report.html
    #[arg(long)]
    out: PathBuf,
    /// Case, one of silicone-beam, bending, cook, cylinder, torsion, punch, all of them unless given; may be repeated
    #[arg(long = "scene", value_name = "NAME")]
    scenes: Vec<String>,
}

pub(crate) fn judge(Asked { out, scenes }: &Asked) -> Result<End, Problem> {
    let plan = Plan::new(scenes).map_err(Problem::of)?;
    let rows = evaluate(&plan, out, |words| message!("{words}")).map_err(Problem::of)?;
    print(tables::tables(&rows));
    finish(out, "physics.csv", physics::NAME, &physics::part(&rows))
}
