//! Who computes a step. Threads belong to the host: a step is cut into parts that share nothing
//! ([`crate::mesh::partition`]), and a host with threads says where they run. The bits do not depend on it.

pub use crate::mesh::partition::MOST_PARTS;

/// Runs the parts of a step.
pub trait Threads {
    /// Parts that a step shall be cut into. There will be [`MOST_PARTS`] at most, and fewer if the scene is small.
    fn parts(&self) -> usize;

    /// Calls `work` with each of the parts once, in any order or at the same time, and returns when all calls have
    /// returned.
    fn each<T: Send>(&self, parts: &mut [T], work: impl Fn(&mut T) + Sync);
}

/// The thread that asks for the step, without others.
#[derive(Clone, Copy, Debug, Default)]
pub struct CallingThread;

impl Threads for CallingThread {
    fn parts(&self) -> usize {
        1
    }

    #[inline(always)]
    fn each<T: Send>(&self, parts: &mut [T], work: impl Fn(&mut T) + Sync) {
        parts.iter_mut().for_each(work);
    }
}

/// Threads of rayon's current pool, without an allocation. Steps should be taken within that pool
/// (`ThreadPool::install` around the loop): from elsewhere each call waits for it to wake up.
#[cfg(feature = "parallel")]
#[derive(Clone, Copy, Debug)]
pub struct Rayon {
    /// Parts that a step shall be cut into.
    pub parts: usize,
}

#[cfg(feature = "parallel")]
impl Threads for Rayon {
    fn parts(&self) -> usize {
        self.parts
    }

    fn each<T: Send>(&self, parts: &mut [T], work: impl Fn(&mut T) + Sync) {
        fn halves<T: Send>(parts: &mut [T], work: &(impl Fn(&mut T) + Sync)) {
            match parts {
                [] => {}
                [part] => work(part),
                parts => {
                    let (first, second) = parts.split_at_mut(parts.len() / 2);
                    rayon::join(|| halves(first, work), || halves(second, work));
                }
            }
        }
        halves(parts, &work);
    }
}

/// Takes the first `count` items, or those that there are.
pub(crate) fn take<'a, T>(from: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    from.split_off_mut(..count.min(from.len())).unwrap_or_default()
}
