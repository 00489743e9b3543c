//! Data kept in spare bits of nodal vectors and of tables, where an array of its own would be memory that every host
//! has to provide and a pass over the nodes would have to read. Everything of that kind, and the bytes a node that it
//! saves:
//!
//! | where | what | written by | read by | saves |
//! |---|---|---|---|---|
//! | sign of a zero inverse mass | the axis is held, but motions may move it | [`crate::element`], when a scene is built | [`crate::loads`] | 1: the other 16 are full |
//! | fourth component of an increment or force | axes whose motion has been prescribed, as bits | [`crate::loads`] | the same, which clears it | 1, or a search through all motions for each |
//! | fourth component of increment and displacement | entries `yz`, `zx` of a node's stiffness bound | [`crate::tled::critical_step`] | the same, which clears them | 8 of every state, for a call now and then |
//! | fourth component of a force | scalar stiffness bound of the node, N/m | element loops with a bound | [`crate::inertia`], which clears it | 4, and a second scatter of the element loops |
//! | fourth component of a volume row, in a body of one tissue | `J - 1` of the node, next to its displacement, also between steps | [`crate::element`], in each step with nodal pressure | the element loops | 4, and a second read of each node |
//! | upper eight bits of an element's index | which of the tissues of each corner's node it is of, two bits each | [`crate::scene`], when it is built | [`crate::element`] | 1 of 64 an element |
//! | inverse mass and mass, while a scene is built | marks of held axes; the two lowest tissues of the node | [`crate::element`] | the same, which writes masses over them | 5, while it is built |
//! | fourth component of the next increment | what the scalar bound of the node has to be multiplied by | [`crate::inertia`], when it is prepared | its passes | 4 of 88 |
//! | fourth component of a rough increment | how far its force may move the node in a step, m | the same | the same | 4 of 88 |
//! | fourth components of a vertex's tangent, normal and increment | what rounding had left out of its displacement when an interval of exact steps began | [`crate::learned`], in a lead-in | the same, when the interval ends | 12 of 48 |
//! | fourth component of a lattice position | number of the node | [`crate::inertia`], when it is prepared | its passes | 4 of 88 |

use crate::simd::NodeVector;

/// Inverse mass of a held axis that motions may move: zero, told from that of a fixed axis by its sign.
pub(crate) const MOVABLE: f32 = -0.0;

/// Whether an inverse mass is [`MOVABLE`].
pub(crate) fn is_movable(inverse: f32) -> bool {
    inverse.to_bits() == MOVABLE.to_bits()
}

/// Marks an axis in the padding of a vector. Gives whether it had no mark yet.
pub(crate) fn mark_axis(vector: &mut [f32; 4], axis: usize) -> bool {
    let marks = vector[3].to_bits();
    vector[3] = f32::from_bits(marks | 1 << (axis % 4));
    marks >> (axis % 4) & 1 == 0
}

/// Removes the marks of all axes.
pub(crate) fn clear_marks(NodeVector(vector): &mut NodeVector) {
    vector[3] = 0.0;
}

/// A node's number as a float with the same bits.
#[inline(always)]
pub(crate) fn from_index(node: u32) -> f32 {
    f32::from_bits(node)
}

/// The number of a node from [`from_index`].
#[inline(always)]
pub(crate) fn to_index(bits: f32) -> u32 {
    bits.to_bits()
}
