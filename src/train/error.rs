//! Why a training could not be done, in a sentence for the person who asked.

use core::fmt;
use std::format;
use std::path::PathBuf;
use std::string::String;

use crate::mlp::WeightError;

/// Why a training could not be done.
#[derive(Debug)]
#[non_exhaustive]
pub enum TrainError {
    /// The recipe is not usable; the text names the place and the value.
    Recipe(String),
    /// The scene could not be simulated; the text says why.
    Scene(String),
    /// The weights cannot be written as a file.
    Weights(WeightError),
    /// The network could not be quantised; the text says why.
    Quantise(String),
    /// A checkpoint is there, but of another recipe.
    OtherRecipe(PathBuf),
    /// A checkpoint could not be read or written; the text says why.
    Checkpoint(PathBuf, String),
    /// A file could not be written; the text names it.
    Write(std::io::Error),
    /// It was asked to stop.
    Stopped {
        /// Epochs done before.
        epoch: usize,
    },
    /// The loss is no longer a finite number.
    Diverged {
        /// Epochs done before.
        epoch: usize,
    },
}

impl fmt::Display for TrainError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Recipe(text) | Self::Scene(text) | Self::Quantise(text) => f.write_str(text),
            Self::Weights(error) => error.fmt(f),
            Self::Write(error) => error.fmt(f),
            Self::OtherRecipe(path) => {
                write!(f, "{}: a checkpoint of another recipe; remove it to train anew", path.display())
            }
            Self::Checkpoint(path, text) => write!(f, "{}: {text}", path.display()),
            Self::Stopped { epoch } => write!(f, "stopped after {epoch} epochs"),
            Self::Diverged { epoch } => {
                write!(f, "the loss is not finite any more after {epoch} epochs; try a smaller rate")
            }
        }
    }
}

impl core::error::Error for TrainError {}

impl TrainError {
    /// Of a recipe in which `what` has a `value` that it cannot have; what it `must` be, in words.
    #[must_use]
    pub fn refused(what: &str, value: impl fmt::Display, must: &str) -> Self {
        Self::Recipe(format!("{what} = {value}: {must}"))
    }
}

impl From<WeightError> for TrainError {
    fn from(error: WeightError) -> Self {
        Self::Weights(error)
    }
}
