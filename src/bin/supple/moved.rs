//! Commands that are the laboratory's now, and one that is Python's: what to type instead.

use crate::problem::{End, Problem};

/// Whatever stands behind the command.
#[derive(clap::Args)]
pub(crate) struct Arguments {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    all: Vec<String>,
}

/// The sentence; `now` is the command there.
pub(crate) fn refuse(command: &str, now: &str) -> Result<End, Problem> {
    let features = if command == "evaluate" { "" } else { " --features train" };
    Err(Problem(format!(
        "{command} is a command of the laboratory: cargo run --release -p supple-lab{features} -- {now}"
    )))
}

/// The sentence for a command of the Python package.
pub(crate) fn say_python(given: &Arguments) -> Result<End, Problem> {
    let rest =
        if given.all.is_empty() { "RUN --image CT.nii.gz --out warped.nii.gz".into() } else { given.all.join(" ") };
    Err(Problem(format!(
        "images are read by SimpleITK, in the Python package: pip install SimpleITK; python -m supple warp {rest}"
    )))
}
