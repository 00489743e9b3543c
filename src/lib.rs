//! placeholder
#![no_std]
#[cfg(feature = "std")]
extern crate std;
#[cfg(feature = "io")]
pub mod io;
