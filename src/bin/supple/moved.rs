//! Commands that are the laboratory's now: what to type instead.

use crate::problem::{End, Problem};

/// Whatever stands behind the command.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    _all: Vec<String>,
}

/// The sentence; `now` is the command there.
pub(crate) fn refuse(command: &str, now: &str) -> Result<End, Problem> {
    let features = if command == "evaluate" { "" } else { " --features train" };
    Err(Problem(format!(
        "{command} is a command of the laboratory: cargo run --release -p supple-lab{features} -- {now}"
    )))
}
