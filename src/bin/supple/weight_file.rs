//! Weight files on disk, and their networks in words.

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

use supple::io::write_atomically;
use supple::mlp::{MAGIC, Network, WeightBytes};

use crate::problem::Problem;

/// Whether a file is one of weights, by its name or by how it begins.
pub(crate) fn is_weights(path: &Path) -> bool {
    let begins = || -> io::Result<bool> {
        let mut start = [0; MAGIC.len()];
        File::open(path)?.read_exact(&mut start)?;
        Ok(start == MAGIC)
    };
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("weights")) || begins().unwrap_or(false)
}

/// The bytes of any file.
pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Problem> {
    supple::io::read_file(path).map_err(|error| Problem::in_file(path, format!("cannot be read: {error}")))
}

/// A weight file in memory, not yet looked at.
pub fn read(path: &Path) -> Result<WeightBytes, Problem> {
    Ok(WeightBytes::of(&bytes(path)?))
}

/// The network of a weight file.
pub fn parse<'w>(path: &Path, memory: &'w WeightBytes) -> Result<Network<'w>, Problem> {
    Network::parse(memory.bytes()).map_err(|error| Problem::in_file(path, error))
}

/// Replaces a file by these bytes, or leaves it as it is.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Problem> {
    write_atomically(path, |file| file.write_all(bytes)).map_err(Problem::of)
}

/// The step of a network.
pub(crate) fn describe_step(network: &Network<'_>) -> String {
    let recipe = network.recipe();
    let multiple = recipe.step / recipe.exact_step;
    format!("{:.3e} s, {multiple:.1} times the exact step it learned from ({:.3e} s)", recipe.step, recipe.exact_step)
}

/// The tissue of a network's training.
pub(crate) fn describe_tissue(network: &Network<'_>) -> String {
    let recipe = network.recipe();
    format!("{}, {} kg/m^3, {} tetrahedra", recipe.law, recipe.density, recipe.element.name())
}
