//! Soft tissue in real time.
#![no_std]

#[cfg(feature = "std")]
extern crate std;

pub mod lanes;
mod ledger;
pub mod loads;
pub mod material;
pub mod mesh;
pub mod scene;
pub mod state;
pub mod tled;

#[cfg(feature = "io")]
pub mod io;

pub use ledger::Ledger;
