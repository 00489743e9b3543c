//! The network: dense layers in two parts (Meister et al. 2018, figure 1). The first part predicts from the inputs, the
//! second corrects from inputs and prediction, the sum is clipped to what was seen in training.
//!
//! ```text
//! p = first(x),  y = clip(p + second([x, p])),   layer: z = W x + b, leaky ReLU or linear
//! ```
//! `x` are the inputs, each over its scale; outputs are the network's times theirs. A [`Network`] borrows its
//! weights from the bytes of a weight file (`weights/FORMAT.md`), from flash or a mapped file, without a copy.

#[cfg(feature = "safetensors")]
mod exchange;
mod file;
mod forward;
#[cfg(feature = "std")]
mod write;

#[cfg(feature = "safetensors")]
pub use exchange::{ExchangeError, from_safetensors, to_safetensors};
pub use file::{ForceInput, MAGIC, Network, Range, Recipe, TrainedLaw, WeightError};
pub(crate) use forward::Scratch;
#[cfg(feature = "std")]
pub use write::{Description, LayerDescription, WeightBytes, hexadecimal, write};

/// Widest layer.
pub const MAX_WIDTH: usize = 256;
/// Layers of both parts.
pub const MAX_LAYERS: usize = 16;
/// Inputs of the first part.
pub const MAX_INPUTS: usize = 32;
/// Outputs.
pub const MAX_OUTPUTS: usize = 8;

/// What follows a layer's sums.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// Nothing.
    Linear,
    /// `x` if positive, else `slope x`.
    LeakyRelu {
        /// From zero to one.
        slope: f32,
    },
}

/// A dense layer: `outputs` rows of `inputs` weights, and a bias for each row.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'w> {
    /// Numbers that go in.
    pub inputs: usize,
    /// Numbers that come out.
    pub outputs: usize,
    /// What follows.
    pub activation: Activation,
    /// By rows.
    pub weights: &'w [f32],
    /// One a row.
    pub biases: &'w [f32],
}

impl Layer<'_> {
    /// No layer.
    pub(crate) const NONE: Self =
        Self { inputs: 0, outputs: 0, activation: Activation::Linear, weights: &[], biases: &[] };
}
