//! Eight bits after the training: a network is quantised by the samples it was trained on, in a few ways, and the way is kept
//! that is nearest to the exact motion on frames it has not seen.

use std::format;
use std::vec::Vec;

use super::TrainError;
use super::fit::{is_held_out, judged};
use super::recipe::Recipe;
use super::samples::Samples;
use crate::mlp::quantise::{Plan, Span, quantise};
use crate::mlp::{self, Description, Network};
use crate::surrogate::PREDICTED;

/// Samples that a network is quantised by, at most.
const SAMPLES: usize = 8_000;

/// A way that was tried.
#[derive(Clone, Debug)]
pub struct Tried {
    /// What the steps of activations cover.
    pub span: Span,
    /// Whether samples of rough motion were among those it was quantised by.
    pub rough: bool,
    /// Root mean square error on the frames held out, in standard deviations of each target.
    pub held_out: [f64; PREDICTED],
    /// Of each layer, see [`mlp::quantise::Quantised::errors`].
    pub layers: Vec<f64>,
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Made {
    /// The weight file.
    pub bytes: Vec<u8>,
    /// All ways, in the order of trial.
    pub tried: Vec<Tried>,
    /// Which of them the file is.
    pub best: usize,
    /// The float32 network's error on the same frames.
    pub float: [f64; PREDICTED],
}

/// Layers that stay in float32 if nobody says otherwise: the first of each part, which sees inputs of a wide range, and the last,
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

/// Every so many, so that no more than [`SAMPLES`] are left.
fn thinned<const N: usize>(rows: &[[f32; N]]) -> Vec<f32> {
    let every = rows.len().div_ceil(SAMPLES).max(1);
    rows.iter().step_by(every).flatten().copied().collect()
}

/// Quantises a network that was trained by this recipe on these samples. Without frames held out, it is judged by those of the training.
pub fn int8(
    network: &Network<'_>,
    recipe: &Recipe,
    samples: &Samples,
    float: &[usize],
) -> Result<Made, TrainError> {
    let share = recipe.training.held_out;
    let seen = samples.of_frames(|frame| !is_held_out(frame, share));
    let mut unseen = samples.of_frames(|frame| is_held_out(frame, share));
    if unseen.inputs.is_empty() {
        unseen = seen.clone();
    }
    let (smooth, rough) = (thinned(&seen.inputs), thinned(&seen.rough.inputs));
    let both = [smooth.clone(), rough.clone()].concat();
    let description = Description::of(network);
    let judge = |bytes: &[u8]| judged(bytes, &unseen, &description.outputs);
    let mut made =
        Made { bytes: Vec::new(), tried: Vec::new(), best: 0, float: judge(&mlp::write(&description)?) };
    let total = |error: [f64; PREDICTED]| error.iter().map(|error| error * error).sum::<f64>();
    for span in [Span::Whole, Span::LeastSquares] {
        for (with_rough, rows) in [(false, &smooth), (true, &both)] {
            if with_rough && rough.is_empty() {
                continue;
            }
            let quantised = quantise(network, rows, Plan { float, span })
                .map_err(|error| TrainError::Quantise(format!("{error}")))?;
            let bytes = mlp::write_int8(&description, &quantised.layers)?;
            let tried = Tried { span, rough: with_rough, held_out: judge(&bytes), layers: quantised.errors };
            let best = made.tried.get(made.best).map_or(f64::INFINITY, |best| total(best.held_out));
            if total(tried.held_out) < best {
                (made.best, made.bytes) = (made.tried.len(), bytes);
            }
            made.tried.push(tried);
        }
    }
    Ok(made)
}
