//! Threads of the library's own, for C hosts that have none: only in a library with the feature `parallel`, which needs
//! the system's C library and its heap.
#![cfg(feature = "parallel")]

use core::ffi::c_void;
use core::ptr;
use std::sync::OnceLock;

use crate::step::{Rayon, Threads};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::memory::place_for;
use super::scene::check_choice;
use super::status::{status_of, supple_status};
use super::step::{SUPPLE_MOST_PARTS, supple_part, supple_threads};
use supple_status::*;

/// Writes threads for all functions that take them: those of a pool, one for each processor and SUPPLE_MOST_PARTS at
/// most, which the library starts at the first step that needs them, and which stay as long as the process does. A
/// process that is forked has none of them: fork before. A host defines SUPPLE_PARALLEL, and has a library with the
/// feature parallel, to use it.
///
/// @param parts that a step shall be cut into, 1 to SUPPLE_MOST_PARTS.
#[cfg(feature = "parallel")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn supple_own_threads(parts: u32, threads: *mut supple_threads) -> supple_status {
    // SAFETY: what the header asks of the caller.
    let tell = || unsafe {
        let place = place_for(threads)?;
        check_choice(super::SUPPLE_NONE as usize, parts.wrapping_sub(1), SUPPLE_MOST_PARTS - 1)?;
        place.write(supple_threads { context: ptr::null_mut(), parts, each: Some(each) });
        Ok(SUPPLE_OK)
    };
    status_of(tell())
}

/// What parts compute.
struct Work(*const c_void);
// SAFETY: what a step hands out may be used from any thread until `each` returns.
unsafe impl Sync for Work {}

/// Without a pool the caller computes what is left out.
///
/// # Safety
/// As [`supple_threads`] says.
unsafe extern "C" fn each(_: *mut c_void, part: supple_part, work: *const c_void, parts: u32) {
    static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    let most = std::thread::available_parallelism().map_or(1, usize::from).min(SUPPLE_MOST_PARTS as usize);
    let Some(pool) = POOL.get_or_init(|| ThreadPoolBuilder::new().num_threads(most).build().ok()) else { return };
    let work = Work(work);
    let mut all = [0, 1, 2, 3, 4, 5, 6, 7];
    let all = all.get_mut(..parts as usize).unwrap_or_default();
    pool.install(|| {
        let work = &work;
        // SAFETY: once for each part, while `each` runs.
        Rayon { parts: all.len() }.each(all, |number| unsafe { part(work.0, *number) });
    });
}
