//! `supple weights`: weight files to and from safetensors. What a conversion reads is checked in full before anything is
//! written.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use supple::io::write_atomically;
use supple::mlp::{Network, WeightBytes, from_safetensors, to_safetensors};

use crate::scene_file::Problem;
use crate::simulate::End;

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
    /// A weight file with layers of eight bits from a float32 one, by the samples of its recipe
    #[cfg(feature = "train")]
    Quantise(crate::quantise::Asked),
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
        #[cfg(feature = "train")]
        Conversion::Quantise(asked) => return crate::quantise::quantise(asked),
        Conversion::Export { weights, out } => {
            let memory = read(weights)?;
            (weights, out, to_safetensors(&parse(weights, &memory)?))
        }
        Conversion::Import { safetensors, out } => (safetensors, out, from_safetensors(&bytes(safetensors)?)),
    };
    let written = written.map_err(|error| Problem(format!("{}: {error}", from.display())))?;
    write_atomically(out, |file| file.write_all(&written))
        .map_err(|error| Problem(format!("{}: cannot be written: {error}", out.display())))?;
    println!("{} ({} bytes)", out.display(), written.len());
    Ok(End::Reached)
}

fn bytes(path: &Path) -> Result<Vec<u8>, Problem> {
    std::fs::read(path).map_err(|error| Problem(format!("{}: cannot be read: {error}", path.display())))
}

/// A weight file in memory, not yet looked at.
pub(crate) fn read(path: &Path) -> Result<WeightBytes, Problem> {
    Ok(WeightBytes::of(&bytes(path)?))
}

/// The network of a weight file.
pub(crate) fn parse<'w>(path: &Path, memory: &'w WeightBytes) -> Result<Network<'w>, Problem> {
    Network::parse(memory.bytes()).map_err(|error| Problem(format!("{}: {error}", path.display())))
}
