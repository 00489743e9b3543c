//! Independent work on two threads, each taking the next piece when it has done one.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use super::LabError;

const THREADS: usize = 2;

/// The results of `count` pieces of work in their order, or the first failure, after which no piece is begun. `tick` is
/// called on this thread with each that is ready.
pub(super) fn in_parallel<T: Send>(
    count: usize,
    work: impl Fn(usize) -> Result<T, LabError> + Sync,
    mut tick: impl FnMut(usize, &T),
) -> Result<Vec<T>, LabError> {
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    let mut results: Vec<(usize, T)> = thread::scope(|scope| {
        for _ in 0..THREADS {
            let (next, sender, work) = (&next, sender.clone(), &work);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    // The receiver is gone once a piece has failed.
                    if index >= count || sender.send((index, work(index))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(sender);
        let mut results = Vec::new();
        for (index, result) in receiver {
            let result = result?;
            tick(index, &result);
            results.push((index, result));
        }
        Ok::<_, LabError>(results)
    })?;
    results.sort_by_key(|(index, _)| *index);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}
