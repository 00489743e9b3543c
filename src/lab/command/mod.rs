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

use std::path::Path;

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
