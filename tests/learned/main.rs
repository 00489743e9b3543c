//! The learned step and its networks: float32 and int8 layers, weight files, exchange with PyTorch.

#[path = "../support/networks.rs"]
mod networks;
#[path = "../reference/mod.rs"]
mod reference;
#[path = "../support/mod.rs"]
mod support;

#[cfg(feature = "safetensors")]
mod exchange;
mod int8;
mod learned_step;
mod organs;
mod weights;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Held while a test chooses the instruction-set level: it is that of the whole process.
fn level_guard() -> MutexGuard<'static, ()> {
    static LEVEL: Mutex<()> = Mutex::new(());
    LEVEL.lock().unwrap_or_else(PoisonError::into_inner)
}
