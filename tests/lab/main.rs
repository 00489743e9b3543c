//! Methods judged against the exact step over the scenes of the laboratory.

mod command;
#[cfg(feature = "slow-tests")]
mod evaluate;
mod hard;
mod large_strain;
#[cfg(feature = "slow-tests")]
mod moving;
#[cfg(feature = "slow-tests")]
mod paper;
mod physics;
mod pulls;
mod run;
mod scenes;
