//! Copies between slices, as far as both go. Slices know functions for it, with a way to panic in them.

/// Copies the elements that both have.
pub(crate) fn copy<T: Copy>(to: &mut [T], from: &[T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}
