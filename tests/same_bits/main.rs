//! The same bits at every instruction-set level and on every processor. Also built with the feature `deterministic`.

#[path = "../support/networks.rs"]
mod networks;

#[path = "../targets/src/body.rs"]
mod body;
#[path = "../targets/src/sums.rs"]
pub mod sums;

mod levels;
mod targets;
mod typed;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Held by each test: the level is that of the whole process.
fn level_guard() -> MutexGuard<'static, ()> {
    static LEVEL: Mutex<()> = Mutex::new(());
    LEVEL.lock().unwrap_or_else(PoisonError::into_inner)
}
