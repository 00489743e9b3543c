//! `supple-lab large-strain`: elements at strains beyond a half, against nodal pressure on fine meshes.

use std::path::PathBuf;

use crate::large_strain::{Plan, evaluate};
use clap::Args;
use supple::material::Element;
use supple_cli::element_name::element_named;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, output, print};

#[derive(Args)]
pub(crate) struct Asked {
    /// Folder for large-strain.csv
    #[arg(long)]
    out: PathBuf,
    /// A few seconds of it, to see whether it runs
    #[arg(long)]
    quick: bool,
    /// Cells across the cube on the two meshes of the truth, the finer one first, multiples of six
    #[arg(long, value_names = ["N", "N"], num_args = 2)]
    truth: Vec<u32>,
    /// Tetrahedra of the truth, linear, nodal-pressure or nodal-strain
    #[arg(long, value_name = "NAME", default_value = "nodal-pressure", value_parser = element_named)]
    truth_element: Element,
    /// Stiffening of the exponential law, `b`
    #[arg(long, value_name = "B", default_value_t = 5.0)]
    stiffening: f32,
}

pub(crate) fn judge(Asked { out, quick, truth, truth_element, stiffening }: &Asked) -> Result<End, Problem> {
    let plan = if *quick { Plan::quick() } else { Plan::full() };
    let truth = match truth[..] {
        [fine, less] if fine % 6 == 0 && less % 6 == 0 && fine > less && less > 0 => [fine, less],
        [] => plan.truth,
        _ => return Err(Problem("--truth: they must be multiples of six, the larger one first".into())),
    };
    let plan = Plan { truth, truth_element: *truth_element, stiffening: *stiffening, ..plan };
    let found = evaluate(&plan, |words| message!("{words}")).map_err(Problem::of)?;
    print(found.text());
    let path = out.join("large-strain.csv");
    std::fs::create_dir_all(out).map_err(Problem::of)?;
    found.write_csv(&path).map_err(Problem::of)?;
    output!("\nresults  {}", path.display());
    Ok(End::Reached)
}
