//! Training of the learned step (feature `train`): a data set from the exact step, two losses, Adam (Meister et al.
//! 2018, section 2), and a weight file.
//!
//! | module | what it holds |
//! |---|---|
//! | [`recipe`] | the configuration, a TOML file |
//! | [`TrainingScene`] | what is asked of a scene to learn from |
//! | [`samples`] | what the exact step does, seen by each vertex in its frame |
//! | `noise` | the same of rough motion, with targets that return to the exact motion |
//! | [`fit`] | the network on burn, its losses, checkpoints |
//! | [`int8`] | the same network in int8 |
//!
//! The same recipe, seed, number of threads and processor give the same weights.

mod error;
pub mod fit;
pub mod int8;
mod noise;
mod random_numbers;
pub mod recipe;
pub mod samples;
mod scene;

pub use error::TrainError;
pub use scene::TrainingScene;
