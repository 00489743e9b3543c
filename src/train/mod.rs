//! Training of the learned step (feature `train`): a data set from the exact step, two losses, Adam (Meister et al. 2018,
//! section 2), and a weight file.
//!
//! | module | what it holds |
//! |---|---|
//! | [`recipe`] | the configuration, a TOML file |
//! | [`samples`] | what the exact step does, seen by each vertex in its frame |
//! | `noise` | the same of rough motion, with targets that return to the exact motion |
//! | [`fit`] | the network on burn, its losses, checkpoints |
//! | [`int8`] | the same network in int8 |
//! | [`damper`] | the network that damps rough motion, by roll-outs |
//!
//! The same recipe, seed, number of threads and processor give the same weights.

pub mod damper;
mod error;
pub mod fit;
pub mod int8;
mod noise;
pub mod recipe;
pub mod samples;

pub use error::TrainError;
