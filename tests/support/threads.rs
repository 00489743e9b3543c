//! Threads that take the parts of a step in an odd order.

use std::sync::atomic::{AtomicUsize, Ordering};

use supple::step::Threads;

/// Each part on a thread of its own, the last one first; counts them.
pub struct Backwards {
    pub parts: usize,
    pub most: AtomicUsize,
}

impl Backwards {
    pub fn new(parts: usize) -> Self {
        Self { parts, most: AtomicUsize::new(0) }
    }
}

impl Threads for Backwards {
    fn parts(&self) -> usize {
        self.parts
    }

    fn each<T: Send>(&self, parts: &mut [T], work: impl Fn(&mut T) + Sync) {
        self.most.fetch_max(parts.len(), Ordering::Relaxed);
        let work = &work;
        std::thread::scope(|scope| {
            for part in parts.iter_mut().rev() {
                scope.spawn(move || work(part));
            }
        });
    }
}
