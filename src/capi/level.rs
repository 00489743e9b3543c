//! The instruction set, for C.

use core::ffi::{CStr, c_char};

use crate::simd::Level;

use super::status::supple_status;
use supple_status::*;

/// What the library was compiled for, without more.
pub const SUPPLE_LEVEL_PORTABLE: u32 = 0;
/// x86-64 with AVX2 and FMA.
pub const SUPPLE_LEVEL_AVX2: u32 = 1;
/// x86-64 with AVX-512 (F, BW, DQ, VL, VNNI).
pub const SUPPLE_LEVEL_AVX512: u32 = 2;
/// 64-bit Arm.
pub const SUPPLE_LEVEL_NEON: u32 = 3;
/// WebAssembly with simd128.
pub const SUPPLE_LEVEL_SIMD128: u32 = 4;

const LEVELS: [(u32, Level); 5] = [
    (SUPPLE_LEVEL_PORTABLE, Level::Portable),
    (SUPPLE_LEVEL_AVX2, Level::Avx2),
    (SUPPLE_LEVEL_AVX512, Level::Avx512),
    (SUPPLE_LEVEL_NEON, Level::Neon),
    (SUPPLE_LEVEL_SIMD128, Level::Simd128),
];

/// The instructions that steps use: the best of this processor, or those chosen.
#[unsafe(no_mangle)]
pub extern "C" fn supple_level() -> u32 {
    let current = Level::current();
    LEVELS.iter().find(|(_, level)| *level == current).map_or(SUPPLE_LEVEL_PORTABLE, |&(number, _)| number)
}

/// Makes all later steps of this process use these instructions. Call it before threads take steps.
#[unsafe(no_mangle)]
pub extern "C" fn supple_set_level(level: u32) -> supple_status {
    match LEVELS.iter().find(|(number, _)| *number == level) {
        None => SUPPLE_E_CHOICE,
        Some(&(_, level)) if Level::force(level) => SUPPLE_OK,
        Some(_) => SUPPLE_E_LEVEL,
    }
}

/// Version of the interface that the library has. SUPPLE_ABI is the one of the header.
#[unsafe(no_mangle)]
pub extern "C" fn supple_abi() -> u32 {
    super::SUPPLE_ABI
}

const VERSION: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
    Ok(version) => version,
    Err(_) => c"",
};

/// Version of the library, such as "0.1.0". There for as long as the library is.
#[unsafe(no_mangle)]
pub extern "C" fn supple_version() -> *const c_char {
    VERSION.as_ptr()
}
