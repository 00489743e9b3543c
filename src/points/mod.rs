//! Points that follow the tissue: a tumour, a vessel, a finer surface, targets. Each is located once in the mesh at
//! rest, and then follows its element: `x = X + sum N_i(X) u_i` with the linear shape functions `N_i` of the
//! tetrahedron that holds it (barycentric coordinates), as a barycentric mapping does elsewhere. Lengths in m.
//!
//! A point outside the mesh follows the nearest point of it, and its distance at rest is told. Its weights are those of
//! that nearest point, so none is below zero or above one, and what it does is between what the nodes do, however far
//! away it is. It keeps its place next to the tissue but does not turn with it: the error is the distance times the
//! angle of the turn.
//!
#![cfg_attr(feature = "std", doc = "```")]
#![cfg_attr(not(feature = "std"), doc = "```ignore")]
//! use supple::material::{Element, NeoHookean, VecMaterial};
//! use supple::mesh::{Bar, Mesh, Winding};
//! use supple::points::VecPoints;
//! use supple::scene::VecScene;
//! use supple::state::VecState;
//!
//! let bar = Bar { size: [0.02, 0.02, 0.1], cells: [2, 2, 10] };
//! let (points, tets): (Vec<_>, Vec<_>) = (bar.points().collect(), bar.tets().collect());
//! let mesh = Mesh::new(&points, &tets, Winding::Checked)?;
//! let mut tumour = VecPoints::locate(&mesh, &[[0.011, 0.008, 0.09], [0.011, 0.008, 0.101]])?;
//! let outside = tumour.points()[1].distance; // m
//! let mut state = VecState::at_rest(points.len());
//! // ... steps ...
//! tumour.follow(&mut state)?;
//! println!("{:?} m, {:?} m/s", tumour.positions()[0], tumour.velocities()[0]);
//! # assert!((outside - 0.001).abs() < 1e-7 && tumour.positions()[0] == [0.011, 0.008, 0.09]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod nearest;
mod tree;

use core::fmt;
pub(crate) use nearest::within;

use crate::mesh::{Mesh, MeshError};
use crate::simd::NodeVector;
use crate::state::{AsState, velocity};
use tree::Tree;

/// A point and the element that it follows. 13 words, which may be copied and kept as bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FollowedPoint {
    /// Where it is at rest, m.
    pub rest: [f32; 3],
    /// The tetrahedron that holds it, or the nearest one.
    pub element: u32,
    /// The nodes of the element.
    pub nodes: [u32; 4],
    /// How much of each node's displacement is the point's: from 0 to 1, 1 in sum.
    pub weights: [f32; 4],
    /// From the element at rest, m; 0 inside.
    pub distance: f32,
}

/// Why points were refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PointError {
    /// The mesh that they are in.
    Mesh(MeshError),
    /// A coordinate is NaN or infinite, or a weight is not from 0 to 1.
    NotFinite {
        /// The point.
        index: usize,
        /// 0, 1, 2 for x, y, z of the place; of weights the number of the weight.
        axis: usize,
        /// The number.
        value: f32,
    },
    /// A point follows a node that is not there: it was located in another mesh.
    Node {
        /// The point.
        index: usize,
        /// The node.
        node: u32,
        /// Nodes of the state.
        nodes: usize,
    },
    /// Less memory than [`words_for`] says, or fewer places to write to than points.
    Capacity {
        /// Needed.
        needed: usize,
        /// There.
        capacity: usize,
    },
}

impl fmt::Display for PointError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Mesh(error) => error.fmt(f),
            Self::NotFinite { index, axis, value } => {
                write!(
                    f,
                    "point {index}: number {axis} is {value}, it must be finite, a weight from 0 to 1: leave the point out"
                )
            }
            Self::Node { index, node, nodes } => {
                write!(f, "point {index}: node {node} does not exist, there are {nodes} nodes: locate it in this mesh")
            }
            Self::Capacity { needed, capacity } => {
                write!(f, "there is room for {capacity} words or points, {needed} are needed")
            }
        }
    }
}

impl core::error::Error for PointError {}

impl From<MeshError> for PointError {
    fn from(error: MeshError) -> Self {
        Self::Mesh(error)
    }
}

/// Words of memory that [`locate`] needs for a mesh of so many elements: at most eight for each and 64.
#[must_use]
pub const fn words_for(elements: usize) -> usize {
    Tree::words(elements)
}

/// Locates places (m) of the mesh at rest: writes for each the element that holds it, or the nearest one, with its
/// weights and the distance. `memory` has [`words_for`] words, and is free again afterwards. A place nearer to an
/// element than a millionth of its height is inside; one in several elements is in one of them, the same every time.
/// On an error nothing is written to `located`.
///
/// The search goes down a tree of boxes over the elements along a Morton curve: first to those that hold the place, then to
/// the nearest ones. A place inside takes one or two microseconds, one outside ten or more; at most all elements are looked
/// at.
pub fn locate(
    mesh: &Mesh<'_>,
    places: &[[f32; 3]],
    memory: &mut [u32],
    located: &mut [FollowedPoint],
) -> Result<(), PointError> {
    check_places(places)?;
    room_for(places.len(), located.len())?;
    let tree = Tree::build(mesh, memory)?;
    for (point, &place) in located.iter_mut().zip(places) {
        *point = tree.nearest(mesh, place);
    }
    Ok(())
}

/// Writes where points are (m) and how fast (m/s, over the latest step) in a state of the mesh that they were located
/// in. On an error nothing is written.
pub fn follow(
    points: &[FollowedPoint],
    state: &mut impl AsState,
    positions: &mut [[f32; 3]],
    velocities: &mut [[f32; 3]],
) -> Result<(), PointError> {
    let state = state.as_state();
    room_for(points.len(), positions.len().min(velocities.len()))?;
    check(points, state.displacement.len().min(state.increment.len()))?;
    write_positions(points, state.displacement, positions);
    write_velocities(points, state.increment, state.progress.last_step(), velocities);
    Ok(())
}

/// That all places are finite.
pub(crate) fn check_places(places: &[[f32; 3]]) -> Result<(), PointError> {
    for (index, place) in places.iter().enumerate() {
        if let Some((axis, &value)) = place.iter().enumerate().find(|(_, component)| !component.is_finite()) {
            return Err(PointError::NotFinite { index, axis, value });
        }
    }
    Ok(())
}

/// That all points follow nodes of a state of so many, by weights from 0 to 1.
pub(crate) fn check(points: &[FollowedPoint], nodes: usize) -> Result<(), PointError> {
    for (index, point) in points.iter().enumerate() {
        if let Some(&node) = point.nodes.iter().find(|&&node| node as usize >= nodes) {
            return Err(PointError::Node { index, node, nodes });
        }
        let rest = point.rest.into_iter().map(|number| (number, number.is_finite())).enumerate();
        let weights = point.weights.into_iter().map(|number| (number, (0.0..=1.0).contains(&number))).enumerate();
        if let Some((axis, (value, _))) = rest.chain(weights).find(|(_, (_, is_good))| !is_good) {
            return Err(PointError::NotFinite { index, axis, value });
        }
    }
    Ok(())
}

fn room_for(points: usize, capacity: usize) -> Result<(), PointError> {
    if capacity < points { Err(PointError::Capacity { needed: points, capacity }) } else { Ok(()) }
}

/// Of points that were checked.
pub(crate) fn write_positions(points: &[FollowedPoint], displacements: &[NodeVector], out: &mut [[f32; 3]]) {
    for (out, point) in out.iter_mut().zip(points) {
        let moved = point.mean(displacements);
        for axis in 0..3 {
            // A number, however far away it is.
            out[axis] = (point.rest[axis] + moved[axis]).clamp(-f32::MAX, f32::MAX);
        }
    }
}

/// Of points that were checked.
pub(crate) fn write_velocities(
    points: &[FollowedPoint],
    increments: &[NodeVector],
    seconds: f32,
    out: &mut [[f32; 3]],
) {
    for (out, point) in out.iter_mut().zip(points) {
        *out = velocity(point.mean(increments), seconds);
    }
}

impl FollowedPoint {
    /// What it has of a vector of each node.
    fn mean(&self, vectors: &[NodeVector]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for (&node, weight) in self.nodes.iter().zip(self.weights) {
            let vector = vectors.get(node as usize).copied().unwrap_or_default().to_array();
            for axis in 0..3 {
                sum[axis] += weight * vector[axis];
            }
        }
        sum
    }
}

/// Points that follow, with their memory.
#[cfg(any(feature = "std", test))]
#[derive(Clone, Debug, PartialEq)]
pub struct VecPoints {
    points: std::vec::Vec<FollowedPoint>,
    positions: std::vec::Vec<[f32; 3]>,
    velocities: std::vec::Vec<[f32; 3]>,
}

#[cfg(any(feature = "std", test))]
impl VecPoints {
    /// See [`locate`].
    pub fn locate(mesh: &Mesh<'_>, places: &[[f32; 3]]) -> Result<Self, PointError> {
        let mut points = std::vec![FollowedPoint::default(); places.len()];
        locate(mesh, places, &mut std::vec![0; words_for(mesh.element_count())], &mut points)?;
        Ok(Self { points, positions: places.to_vec(), velocities: std::vec![[0.0; 3]; places.len()] })
    }

    /// To be called after each frame. See [`follow`].
    pub fn follow(&mut self, state: &mut impl AsState) -> Result<(), PointError> {
        follow(&self.points, state, &mut self.positions, &mut self.velocities)
    }

    /// Where they are at rest, what they follow, how far from it.
    #[must_use]
    pub fn points(&self) -> &[FollowedPoint] {
        &self.points
    }

    /// Where they were at the latest call of [`VecPoints::follow`], m; before it, at rest.
    #[must_use]
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// How fast they were then, m/s.
    #[must_use]
    pub fn velocities(&self) -> &[[f32; 3]] {
        &self.velocities
    }
}

#[cfg(test)]
mod tests;
