//! Copies between slices, as far as both go. Slices know functions for it, with a way to panic in them.

/// Copies the elements that both have.
pub(crate) fn copy<T: Copy>(to: &mut [T], from: &[T]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = *from;
    }
}

/// The same in a function of its own, whose arguments are known to be apart: inlined, a copy between raw memory of hosts
/// asks them for `memmove`.
#[cfg(feature = "capi-neo-hookean")]
#[inline(never)]
pub(crate) fn copy_apart<T: Copy>(to: &mut [T], from: &[T]) {
    copy(to, from);
}
