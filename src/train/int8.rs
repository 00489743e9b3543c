//! A trained network in int8, calibrated by the samples it was trained on, those of rough motion too, without which
//! roll-outs at long steps ring, and judged on frames it has not seen.

use std::format;
use std::vec::Vec;

use super::TrainError;
use super::fit::{is_held_out, judged};
use super::recipe::Recipe;
use super::samples::Samples;
use crate::learned::PREDICTED;
use crate::mlp::quantise::quantise;
use crate::mlp::{self, Description, Network};

/// A quantised network. Errors are root mean squares on the frames held out, in standard deviations of each target.
#[derive(Clone, Debug)]
pub struct Made {
    /// The weight file.
    pub bytes: Vec<u8>,
    /// Its error.
    pub held_out: [f64; PREDICTED],
    /// The float32 network's.
    pub float: [f64; PREDICTED],
    /// Of each layer, see [`mlp::quantise::Quantised::errors`].
    pub layers: Vec<f64>,
}

/// Layers that stay in float32 by default: the first of each part, which sees inputs of a wide range, and the last,
/// whose few outputs are summed and clipped. They are a small part of the work.
#[must_use]
pub fn usual_float_layers(network: &Network<'_>) -> Vec<usize> {
    let (first, second) = network.layers();
    let ends = |start: usize, count: usize| [start, (start + count).saturating_sub(1)];
    let mut float = ends(0, first.len()).to_vec();
    if !second.is_empty() {
        float.extend(ends(first.len(), second.len()));
    }
    float.dedup();
    float
}

/// Quantises a network that was trained by this recipe on these samples. Without frames held out, it is judged by those
/// of the training.
pub fn int8(network: &Network<'_>, recipe: &Recipe, samples: &Samples, float: &[usize]) -> Result<Made, TrainError> {
    let share = recipe.training.held_out;
    let seen = samples.of_frames(|frame| !is_held_out(frame, share));
    let mut unseen = samples.of_frames(|frame| is_held_out(frame, share));
    if unseen.inputs.is_empty() {
        unseen = seen.clone();
    }
    let inputs = [seen.inputs.as_flattened(), seen.rough.inputs.as_flattened()].concat();
    let quantised = quantise(network, &inputs, float).map_err(|error| TrainError::Quantise(format!("{error}")))?;
    let bytes = mlp::write_int8(&quantised.description, &quantised.layers)?;
    let description = Description::of(network);
    let judge = |bytes: &[u8]| judged(bytes, &unseen, &description.outputs);
    let (held_out, float) = (judge(&bytes), judge(&mlp::write(&description)?));
    Ok(Made { bytes, held_out, float, layers: quantised.errors })
}
