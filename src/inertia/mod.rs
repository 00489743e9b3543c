//! Steps beyond the critical one. Inertia is raised where a step `D` (s) would be unstable, smooth motion gets its true
//! inertia back through a coarse lattice, and rough motion is damped. A step takes one force evaluation,
//! like the exact step. Precedents: selective mass scaling (Olovsson et al. 2005), reciprocal mass matrices (Tkachuk &
//! Bischoff 2015).
//!
//! # The step
//!
//! ```text
//! r   = D^2 f - 2 k m du,  g = W^T r                                         k = mu D / 2
//! du+ = du + N^-1 r + W (S^-1 (g - M w) + w + p - (removed T + drag T^2) c)  N (node.rs)
//! S   = M + A,  M = (1 + k) Mc + E,  A = s_c D^2 / 4 Kc,  T = S^-1 A          (renewal.rs, coarse_stiffness.rs)
//! ```
//! `N >= s D^2 / 4 rho b` has the scalar bound `b` of a node's stiffness that each force pass computes, times its ratio
//! at rest to a closer bound. `Kc` stands for `W^T K W`: tangents of sampled elements, averaged over the clusters of a
//! cell (held nodes, tissue), times the second moments of the cluster (`clusters.rs`). `E` is what the lattice's inertia
//! has to be larger by because nodes also move by themselves: with `t = (1 + k) m / N` of a cell, `(1 + k) m / (1 - t)`
//! in place of `(1 + k) m`. The functions `W` reproduce linear fields wherever no support holds them, so translations
//! and rotations of the shape at rest are the lattice's alone, and as `A` is zero for them their momentum is conserved.
//! `w` is the change of velocity that rotation alone brings (`transport.rs`), `p` what supports do whose speed changes
//! (`supports.rs`), `c` the lattice's part of `du`. In the first step `D^2` is halved: a force that acts from the start
//! on has acted for half a step. `T` is zero for rigid motion and small for motion that the step resolves, so drag takes
//! neither momentum nor slow motion. It is there because `S` changes with the state while velocities are kept, which
//! would feed deformation that the step cannot resolve; so it follows the rate at which the shape changes, up to 0.27.
//!
//! `S` is computed anew where the lattice has been strained and bent by more than a limit since, the less the stiffer
//! the tissue is in volume, or where the bounds of a cell's nodes have grown by a tenth; in the step that needs it, from
//! the state at its start. Between, it is used in frames that rotate with the tissue (`frames.rs`).
//!
//! # What is proved
//!
//! Central differences with the operator `B = N^-1 + W S^-1 W^T` are stable while `lambda_max(B K) < 4 / D^2`, and for
//! symmetric positive matrices `lambda_max((X + Y) K) <= lambda_max(X K) + lambda_max(Y K)`:
//!
//! ```text
//! lambda_max(B K) <= lambda_max(N^-1 K) + lambda_max(S^-1 W^T K W) <= 4 / D^2 (1 / s + q / s_c)
//! ```
//! with the largest ratio `q` of `W^T K W` to `Kc`. With `s` = 1.8 and `s_c` = 2.8 the bracket is 0.913 for `q` = 1. Drag
//! on the last increment lowers the limit: with a share `d` of rough motion and `drag` of the lattice's, `K <= 4 / D^2
//! B^-1` becomes `K <= (4 B^-1 - 2 C) / D^2`, and with `2 a b <= e a^2 + b^2 / e` for the two parts of a motion it holds
//! if `(1 + e) / s_c <= 1 - drag / 2` and `(1 + 1 / e) / s <= 1 - d / 2`. With `drag` at most 0.27 that allows `d` =
//! 0.107; damping of rough motion removes at most 0.1 (`rough_motion.rs`). Where more is removed, the step moves less by its forces,
//! `(1 - d / 2) / 0.95`.
//!
//! # What is measured or a safeguard
//!
//! - `N` is a bound at rest; `rho` is kept where the shape changes.
//! - `q` is one where elements end at cells and are alike in a cluster. Elsewhere it is larger, up to ten and more where
//!   few elements fill a cell and volume is stiff. The preparation measures it at rest by power iteration and multiplies
//!   `Kc` by it (`rest_check.rs`), and by up to 1.35 more where tissue is stiff in volume, for what bending changes.
//! - Where tissue stiffens within a step, `S` is too soft for that step. A linear bound does not cover a step that is
//!   large compared with the range of the law. So the forces of one step may move a node, relative to the lattice, by at
//!   most a fiftieth of the least height of its elements ([`Report::held_back`]), and strain a cell of the lattice by at
//!   most a tenth, a fifth with nodal strain, less in short steps; where velocities strain it by more than a fifth in a step they are damped
//!   ([`Report::coarse_share`]). With a law that becomes a hundred times as stiff in a step, a few runs in a hundred on
//!   wild meshes are refused all the same (`tests/large_steps/wild.rs`).
//! - Where inertia grows while velocities are kept, `1/2 v^T S v` grows as well. So where only a share of the lattice's
//!   part is used, `1 - sqrt(share)` of `T c` and of the rough motion is removed. The same is done with kinetic energy
//!   that cannot have come from the loads, which the energy balance shows. Neither takes momentum.
//! - Where a step is longer or shorter than the last one, `h`, its last increment is carried over as `D / h du`, and a force acts for
//!   `(h + D) / 2`, as in exact steps, but for at most 1.25 `D`: the rest acts in the steps that follow (`pass_input.rs`).
//! - Where steps of others, less than half as long, have brought the state, their vibrations are none of its velocity: added inertia
//!   grows while momentum is kept, so all of `T c` and of the rough motion is removed but `(h / D)^2` (`step.rs`). Adaptive steps,
//!   which lengthen where the motion is calm, carry all of it over: what follows bending would be lost as well.
//! - Float32 cannot invert matrices that are too ill-conditioned. At the start that is an error
//!   ([`InertiaError::Singular`]), or a coarser lattice where that is free. Later the lattice is not used until `S` is
//!   computed again, with a [`Report::coarse_share`] of zero. If a step goes wrong all the same, the energy balance
//!   detects it, and the step is refused.
//!
//! # What it costs
//!
//! Accuracy: motion that neither has its true inertia nor is carried by the lattice is too slow. [`Report`] says how
//! much inertia was added, and where; a [`crate::guard`] estimates the error. Memory: see [`vectors_for`].

mod added_motion;
mod band;
#[cfg(test)]
mod band_tests;
mod cells;
mod clusters;
mod coarse_motion;
mod coarse_room;
mod coarse_stiffness;
#[cfg(test)]
mod coarse_stiffness_tests;
mod contact;
mod frames;
mod large_step;
mod lattice;
mod layout;
mod local_response;
mod matrices;
mod method;
mod motion_pass;
mod node;
mod node_tables;
mod parts;
mod pass_input;
mod pulls;
mod renewal;
mod report;
mod rest_check;
mod restriction_pass;
mod rough_motion;
mod shorten;
mod step;
mod supports;
mod transport;

pub use large_step::{LargeModel, LargeStep, LargeView};
pub(crate) use lattice::size_of;
pub use lattice::{Grid, MAX_FUNCTIONS, MAX_POINTS};
pub(crate) use local_response::LOCAL_FLOATS;
pub use method::{Cells, Method, vectors_at_most, vectors_for, vectors_for_lattice};
pub use report::Report;

use core::fmt;

/// `s` and `s_c`.
const FINE: f32 = 1.8;
const COARSE: f32 = 2.8;
/// Growth of the stiffness of a cell's nodes since `S` was computed, at which it is computed anew.
const COARSE_GROWTH: f32 = 1.1;
/// Largest distance by which a node's force may move it in one step from rest, as a part of the least height of its
/// elements.
const LARGEST_MOVE: f32 = 0.02;
/// Largest strain of a cell of the lattice by which the forces of one step may move it from rest.
const LARGEST_STRAIN: f32 = 0.1;
/// Of steps that add less than so many masses it is less, as their length is: in a short step only a body that goes wrong
/// is strained as much. Not below this share.
const ADDED_AT_LARGEST_STRAIN: f32 = 2500.0;
const LEAST_STRAIN_SHARE: f32 = 0.1;
/// The same with nodal strain, whose critical step is half as long again: strains of a step grow with its square.
const LARGEST_STRAIN_OF_PATCHES: f32 = 0.2;
/// Largest strain of a cell in one step that the velocities may go on with.
const LARGEST_KEPT: f32 = 0.2;
/// Share of the last increment's unresolved deformation of the lattice that a step removes where the stiffness changes
/// as much as it may in one step, and the largest share.
const DRAG_AT_LARGEST_CHANGE: f32 = 0.02;
const LARGEST_DRAG: f32 = 0.27;
/// Less drag is left out.
const LEAST_DRAG: f32 = 0.01;
/// The same for each multiple of the mass that is added, which grows with the square of the step.
const DRAG_OF_ADDED: f32 = 4e-5;

/// Why a step beyond the critical one could not be prepared.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum InertiaError {
    /// Less memory than the scene or the lattice needs.
    Capacity {
        /// "vectors" or "nodes in the state".
        kind: &'static str,
        /// How many are needed.
        needed: usize,
        /// How many fit.
        capacity: usize,
    },
    /// A lattice has no cell along some axis or more than [`MAX_POINTS`] points.
    Cells {
        /// Cells along x, y, z.
        cells: [u32; 3],
    },
    /// A lattice has more than [`MAX_FUNCTIONS`] functions.
    Functions {
        /// Cells along x, y, z.
        cells: [u32; 3],
    },
    /// Single precision does not suffice for the inertia of a lattice.
    Singular {
        /// Cells along x, y, z.
        cells: [u32; 3],
    },
    /// A mesh is too small for a lattice of one cell.
    TooSmall {
        /// Its nodes.
        nodes: usize,
    },
    /// Not as many points as the scene has nodes.
    Points {
        /// Points given.
        points: usize,
        /// Nodes of the scene.
        nodes: usize,
    },
    /// The points are not those that the scene was built from.
    OtherPoints {
        /// An element of the mesh that has other edges.
        element: usize,
    },
    /// A step that is longer than the one that was prepared, or not a positive number.
    Step {
        /// The step, s.
        seconds: f32,
        /// The one that was prepared.
        most: f32,
    },
    /// The state is not finite, or so stiff that no step can be bounded.
    NotFinite {
        /// The first node for which this holds.
        node: u32,
    },
}

impl fmt::Display for InertiaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Capacity { kind, needed, capacity } => {
                write!(f, "the inertia needs {needed} {kind}, there is room for {capacity}")
            }
            Self::Cells { cells: [x, y, z] } => write!(
                f,
                "a lattice of {x} x {y} x {z} cells: each must be at least 1, with at most {MAX_POINTS} points"
            ),
            Self::Functions { cells: [x, y, z] } => {
                write!(f, "a lattice of {x} x {y} x {z} cells has more than {MAX_FUNCTIONS} functions")
            }
            Self::Singular { cells: [x, y, z] } => write!(
                f,
                "a lattice of {x} x {y} x {z} cells is too fine for this mesh and step, its inertia cannot be inverted: shorter or somewhat longer steps, or fewer cells, may serve, exact steps do"
            ),
            Self::TooSmall { nodes } => {
                write!(f, "a mesh of {nodes} nodes is too small for long steps: take exact ones")
            }
            Self::Points { points, nodes } => {
                write!(f, "{points} points for a scene of {nodes} nodes")
            }
            Self::OtherPoints { element } => {
                write!(f, "the scene was not built from these points: element {element} has other edges")
            }
            Self::Step { seconds, most } => {
                write!(f, "a step of {seconds:e} s: it must be above zero and at most the prepared {most:e} s")
            }
            Self::NotFinite { node } => write!(f, "node {node}: its stiffness is not a finite number"),
        }
    }
}

impl core::error::Error for InertiaError {}
