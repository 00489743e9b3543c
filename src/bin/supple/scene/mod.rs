//! From a scene file to what the kernel wants. Everything that can be wrong with a scene is told here, before any time
//! passes.
//!
//! `file` is what a person may write, `setup` what comes of it; in between each file reads one part.

pub mod body;
pub(crate) mod directions;
pub mod file;
pub mod instruments;
pub(crate) mod learned;
pub(crate) mod loads;
pub(crate) mod plausible;
pub mod points;
pub mod pulls;
pub(crate) mod select;
pub mod setup;
pub mod timing;
pub mod tissues;
