//! The network: dense layers in two parts (Meister et al. 2018, figure 1). The first part predicts from the inputs, the
//! second corrects from inputs and prediction, the sum is clipped to what was seen in training.
//!
//! ```text
//! p = first(x),  y = clip(p + second([x, p])),   layer: z = W x + b, leaky ReLU or linear
//! ```
//! `x` are the inputs, each over its scale; `y` is in units of the outputs' scales. A [`Network`] borrows its
//! weights from the bytes of a weight file (`weights/FORMAT.md`), from flash or a mapped file, without a copy.

#[cfg(feature = "safetensors")]
mod exchange;
mod file;
mod forward;
mod int8;
mod layers;
#[cfg(feature = "std")]
pub mod quantise;
#[cfg(feature = "std")]
mod write;

#[cfg(feature = "safetensors")]
pub use exchange::{ExchangeError, from_safetensors, to_safetensors};
pub use file::{ForceInput, MAGIC, Network, Range, Recipe, WeightError};
pub(crate) use forward::Scratch;
pub use int8::{GROUP, Int8, TILE_ROWS, WeightTile};
#[cfg(feature = "std")]
pub use write::{Description, Int8Description, LayerDescription, WeightBytes, hexadecimal, write, write_int8};

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

impl Activation {
    /// Of negative sums.
    #[inline(always)]
    pub(crate) const fn slope(self) -> f32 {
        match self {
            Self::Linear => 1.0,
            Self::LeakyRelu { slope } => slope,
        }
    }
}

/// Weights and biases of a layer.
#[derive(Clone, Copy, Debug)]
pub enum Parameters<'w> {
    /// In float32: `outputs` rows of `inputs` weights, and a bias for each row.
    Float {
        /// By rows.
        weights: &'w [f32],
        /// One a row.
        biases: &'w [f32],
    },
    /// In int8.
    Int8(Int8<'w>),
}

/// A dense layer.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'w> {
    /// How many values go in.
    pub inputs: usize,
    /// How many come out.
    pub outputs: usize,
    /// What follows its sums.
    pub activation: Activation,
    /// Weights and biases.
    pub parameters: Parameters<'w>,
}

impl Layer<'_> {
    /// No layer.
    pub(crate) const NONE: Self = Self {
        inputs: 0,
        outputs: 0,
        activation: Activation::Linear,
        parameters: Parameters::Float { weights: &[], biases: &[] },
    };

    /// Whether it is in int8.
    #[must_use]
    pub const fn is_int8(&self) -> bool {
        matches!(self.parameters, Parameters::Int8(_))
    }

    /// Multiplications and additions.
    #[must_use]
    pub const fn multiply_adds(&self) -> usize {
        self.inputs * self.outputs
    }
}
