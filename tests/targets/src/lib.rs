//! The checksums of [`sums`] for programs of their own and for a web page.
#![no_std]

mod body;
mod sums;

pub use sums::*;

/// Whether this was built with the vector instructions of WebAssembly.
#[unsafe(no_mangle)]
pub extern "C" fn has_simd128() -> bool {
    Level::force(Level::Simd128)
}

/// [`checksum`] for a web page: level 0 is the portable one.
#[unsafe(no_mangle)]
pub extern "C" fn web_checksum(what: u32, level: u32) -> u32 {
    checksum(what as usize, if level == 0 { Level::Portable } else { Level::Simd128 })
}
