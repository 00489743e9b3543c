//! The tests of the registers, which stand in `src/simd`, for processors that are emulated: that folder alone compiles in seconds.
#![no_std]
#![allow(dead_code, unused_imports, unused_macros, unexpected_cfgs)]

#[path = "../../../src/simd/mod.rs"]
mod simd;
