//! The sum `u += du` of a step with what rounding leaves out of it (Kahan 1965), m. Without that the slower part of a
//! motion is lost: at a displacement of 0.25 m float32 has no increments below 1.5e-8 m, and in steps of 1.4e-6 s
//! nothing below 10 mm/s moves on.

use core::ops::{Add, Sub};

/// The displacement and its remainder after an increment. The remainder is at most half the distance between two floats
/// at the displacement, so that it changes the increment by less than the displacement's rounding.
#[inline(always)]
pub(crate) fn moved<V>(displacement: V, remainder: V, increment: V) -> [V; 2]
where
    V: Copy + Add<Output = V> + Sub<Output = V>,
{
    let increment = increment + remainder;
    let sum = displacement + increment;
    [sum, increment - (sum - displacement)]
}
