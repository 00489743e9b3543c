//! `supple-lab quantise`, and what `supple-lab train` does after a training: a network's layers in int8, with the error
//! that each of them makes, and that of all of them.

use std::path::{Path, PathBuf};

use clap::Args;
use supple::mlp::{Layer, Network, WeightBytes};
use supple::train::int8::{Made, int8, usual_float_layers};
use supple::train::recipe::Recipe;
use supple::train::samples::Samples;
use supple_cli::problem::{End, Problem};
use supple_cli::screen::{message, output};
use supple_cli::weight_file;

use super::exemplar::learned_from;

#[derive(Args)]
pub(crate) struct Asked {
    /// The weight file, of a learned step and all in float32
    weights: PathBuf,
    /// The weight file to write; one that is there is replaced
    #[arg(long)]
    out: PathBuf,
    /// Layer that stays in float32, counted from 0 through both parts; may be repeated; the first and last of each part
    /// unless given
    #[arg(long = "float", value_name = "LAYER")]
    float: Vec<usize>,
}

pub(crate) fn quantise(asked: &Asked) -> Result<End, Problem> {
    let Asked { weights: path, out, float } = asked;
    let memory = weight_file::read(path)?;
    let network = weight_file::parse(path, &memory)?;
    let recipe = Recipe::parse(network.recipe().text).map_err(|error| Problem::in_file(path, error))?;
    let (first, second) = network.layers();
    let count = first.len() + second.len();
    if let Some(layer) = float.iter().find(|&&layer| layer >= count) {
        return Err(Problem::in_file(path, format!("--float {layer}, but there are {count} layers")));
    }
    message!("simulating the motion it learned from ...");
    let (_, samples) = learned_from(&recipe, path)?;
    let float = if float.is_empty() { usual_float_layers(&network) } else { float.clone() };
    let made = int8(&network, &recipe, &samples, &float).map_err(|error| Problem::in_file(path, error))?;
    tell(&made, out)?;
    Ok(End::Reached)
}

/// The same of a network that has just been trained on these samples: `NAME-i8.weights` next to `NAME.weights`.
pub(crate) fn quantise_trained(path: &Path, bytes: &[u8], recipe: &Recipe, samples: &Samples) -> Result<(), Problem> {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push("-i8.weights");
    let memory = WeightBytes::of(bytes);
    let network = weight_file::parse(path, &memory)?;
    let made = int8(&network, recipe, samples, &usual_float_layers(&network));
    tell(&made.map_err(|error| Problem::in_file(path, error))?, &path.with_file_name(name))
}

/// Writes the file and says how good it is.
fn tell(made: &Made, out: &Path) -> Result<(), Problem> {
    weight_file::write(out, &made.bytes)?;
    let memory = WeightBytes::of(&made.bytes);
    let network = Network::parse(memory.bytes()).map_err(Problem::of)?;
    let Made { bytes, held_out, float, layers: errors } = made;
    output!("\nprecision               error held out, of the standard deviation along tangent, normal, binormal");
    for (name, [t, n, b]) in [("float32", float), ("int8", held_out)] {
        output!("{name:<22}  {t:.4} {n:.4} {b:.4}");
    }
    let (first, second) = network.layers();
    let layers: Vec<(String, &Layer<'_>)> = [("first", first), ("second", second)]
        .into_iter()
        .flat_map(|(part, layers)| layers.iter().enumerate().map(move |(at, layer)| (format!("{part} {at}"), layer)))
        .collect();
    output!("\nlayer     precision  multiply-adds   error of what it hands on, of its standard deviation");
    for ((name, layer), error) in layers.iter().zip(errors) {
        let precision = if layer.is_int8() { "int8" } else { "float32" };
        output!("{name:<9} {precision:<9} {:>14}   {error:.4}", layer.multiply_adds());
    }
    let of_int8 = layers.iter().filter(|(_, layer)| layer.is_int8()).map(|(_, layer)| layer.multiply_adds());
    let share = 100.0 * of_int8.sum::<usize>() as f64 / network.multiply_adds() as f64;
    output!("weights   {} ({} bytes), {share:.1} % of the multiply-adds in int8", out.display(), bytes.len());
    Ok(())
}
