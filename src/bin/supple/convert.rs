//! `supple weights`: weight files to and from safetensors. What a conversion reads is checked in full before anything
//! is written.

use std::path::PathBuf;

use clap::Subcommand;
use supple::mlp::{from_safetensors, to_safetensors};

use crate::moved;
use crate::problem::{End, Problem};
use crate::screen::output;
use crate::weight_file;

#[derive(Subcommand)]
pub(crate) enum Conversion {
    /// A weight file as safetensors, for PyTorch
    Export {
        /// The weight file
        weights: PathBuf,
        /// The safetensors file to write; one that is there is replaced
        #[arg(long)]
        out: PathBuf,
    },
    /// Moved to the laboratory
    #[command(hide = true, disable_help_flag = true)]
    Quantise(moved::Arguments),
    /// A weight file from safetensors with the tensors and metadata of an export
    Import {
        /// The safetensors file
        safetensors: PathBuf,
        /// The weight file to write; one that is there is replaced
        #[arg(long)]
        out: PathBuf,
    },
}

pub(crate) fn convert(conversion: &Conversion) -> Result<End, Problem> {
    let (from, out, written) = match conversion {
        Conversion::Quantise(_) => return moved::refuse("weights quantise", "quantise FILE --out FILE"),
        Conversion::Export { weights, out } => {
            let memory = weight_file::read(weights)?;
            (weights, out, to_safetensors(&weight_file::parse(weights, &memory)?))
        }
        Conversion::Import { safetensors, out } => {
            (safetensors, out, from_safetensors(&weight_file::bytes(safetensors)?))
        }
    };
    let written = written.map_err(|error| Problem::in_file(from, error))?;
    weight_file::write(out, &written)?;
    output!("{} ({} bytes)", out.display(), written.len());
    Ok(End::Reached)
}
