//! `supple-lab train`: a network from a recipe, with its progress and its error on frames that it has not seen.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use supple::train::fit::{Fitted, Progress, fit};
use supple::train::recipe::Recipe;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, output};
use supple_cli::weight_file;

use super::exemplar::learned_from;
use super::quantise::quantise_trained;

#[derive(Args)]
pub(crate) struct Asked {
    /// The recipe, a TOML file
    recipe: PathBuf,
    /// The weight file to write
    #[arg(long)]
    out: PathBuf,
}

/// Checkpoints stand next to the weight file until it is written.
fn checkpoints(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_os_string();
    name.push(".checkpoint");
    out.with_file_name(name)
}

pub(crate) fn train(asked: &Asked) -> Result<End, Problem> {
    let Asked { recipe, out } = asked;
    let problem = |error: &dyn std::fmt::Display| Problem::in_file(recipe, error);
    let text = supple::io::read_text(recipe).map_err(|error| problem(&error))?;
    let parsed = Recipe::parse(&text).map_err(|error| problem(&error))?;
    let folder = checkpoints(out);
    message!("simulating the motion to learn from ...");
    let (scene, collected) = learned_from(&parsed, recipe)?;
    let bar = ProgressBar::no_length();
    let style = ProgressStyle::with_template("{bar:30} {msg}").map_err(|error| problem(&error))?;
    bar.set_style(style);
    let mut told = None;
    let fitted = fit(&parsed, &text, &*scene, &collected, Some(&folder), &mut |at: &Progress| {
        bar.set_length((at.epochs * at.samples) as u64);
        bar.set_position((at.epoch * at.samples + at.done) as u64);
        bar.set_message(said(at));
        // A line an epoch where no bar can be drawn.
        if bar.is_hidden() && at.done == at.samples && told != Some(at.epoch) {
            told = Some(at.epoch);
            message!("{}", said(at));
        }
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    let Fitted { bytes, held_out, samples, loss } = fitted.map_err(|error| problem(&error))?;
    weight_file::write(out, &bytes)?;
    output!("samples     {samples}");
    output!("loss        {loss:.4} of the variance, both losses together");
    if let Some([t, n, b]) = held_out {
        output!("held out    error {t:.3}, {n:.3}, {b:.3} of the standard deviation along tangent, normal, binormal");
    }
    output!("weights     {} ({} bytes)", out.display(), bytes.len());
    quantise_trained(out, &bytes, &parsed, &collected)?;
    // Only now that both weight files are safe.
    let _ = std::fs::remove_dir_all(&folder);
    Ok(End::Reached)
}

fn said(at: &Progress) -> String {
    format!(
        "epoch {} of {}, loss {:.4}, {:.0} samples/s, {} left",
        at.epoch + 1,
        at.epochs,
        at.loss,
        at.rate,
        clock(at.remaining)
    )
}

fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    format!("{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
}
