//! Pulls: forces that draw points of the tissue to targets, as tracked points of a guidance system do, or supports that
//! give way. A pull acts on a patch of nodes with weights `w` ([`patch`]); its point is at `x = x0 + sum w u`, and with
//! the target `y`, the stiffness `k` (N/m) and at most `f` (N) it pulls with
//!
//! ```text
//! p = k (y - x),  |p| <= f        along a direction n only: p = k n n . (y - x)
//! ```
//! shared among the nodes by their weights. Where the body turns, `x0` goes along between calls ([`turn`]). The host sets targets, stiffnesses (0: absent) and limits whenever it likes.
//!
//! No stiffness makes a step unstable, and none lowers the critical step. Exact steps take the force of a soft pull at the mean
//! `(x+ + 2 x + x-) / 4` of three steps, which keeps energy (Newmark's average acceleration), that of a stiff one at the end of the
//! step, which calms it (backward Euler), and others between:
//!
//! ```text
//! p = k (y - x - a du+ + b du),   a = (1 + 3 t) / 4,   b = (1 - t) / 4,   y at the time t into the step
//! t = k c / (1 + k c),   c = s sum w^2 / m,   s the step's factor of force over mass
//! ```
//! It is stable for any `k`, since `a >= b` and `a + b >= 1/2`, and damps by `(k c)^2 / 2` a step at most: of second order in its
//! length. One pull is solved for after the other, and again, at most three times, where pulls share nodes. No pull moves its point by
//! more than a fiftieth of the size of the tissue at its nodes in such a step, or by little more than in the step before, so that tissue
//! is not torn before it can answer.
//! A call at whose end one is held back so for long, or has been lately, says that it is limited ([`crate::state::Progress::pulls_held_back`]).
//!
//! Long steps take the force half a step ahead of their start, at the velocity of the point, and raise inertia by twice
//! the stiffness of the pulls, as they do by that of the tissue ([`crate::inertia`]); none is stiffer there than its most
//! force over half a millimetre, or over a two-hundredth of the longest side of a body below 10 cm. Where nothing moves both
//! are the exact pull, but for that bound. Learned steps refuse pulls.
//!
//! Steps keep nothing of pulls but their forces, for the host to read ([`Pulls::read`]).

mod patch;
mod turn;

pub use patch::{corners, patch};
pub use turn::turn;

use core::fmt;

use glam::Vec3;

use crate::element::ElementTile;
use crate::loads::FARTHEST;
use crate::material::{Material, Moduli};
use crate::scene::SceneView;
use crate::simd::NodeVector;

/// A node that a pull moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct PulledNode {
    /// The node.
    pub node: u32,
    /// Its share of the force. The weights of a pull sum up to one.
    pub weight: f32,
}

/// A pull.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Pull {
    /// Its first node in the list of nodes of all pulls, and how many it has.
    pub nodes: [u32; 2],
    /// Where its point is at rest, m.
    pub at: [f32; 3],
    /// How far it has turned with the body about the mean place of its nodes, m ([`turn`]).
    pub turned: [f32; 3],
    /// When, s, modulo 64; NaN: never.
    pub turned_at: f32,
    /// N/m; 0: absent.
    pub stiffness: f32,
    /// The most force, N; infinite: no limit.
    pub most: f32,
    /// The direction along which it pulls, of any length, as the normal of a surface on which the point slides; zeros:
    /// along all.
    pub along: [f32; 3],
    /// The target at the first of the times, m.
    pub from: [f32; 3],
    /// At the second; with a first coordinate that is NaN there is none, and the pull is absent.
    pub to: [f32; 3],
    /// s. Between these times the target moves evenly, before and after it stands still.
    pub times: [f64; 2],
}

/// Lets pulls let go of nodes that belong to no element of the scene any more; those that have no other ones are absent.
pub fn let_go_of_removed<M>(scene: SceneView<'_, M>, nodes: &mut [PulledNode], pulls: &mut [Pull]) {
    for pull in pulls {
        let [first, count] = pull.nodes.map(|number| number as usize);
        let own = nodes.get_mut(first..).and_then(|nodes| nodes.get_mut(..count));
        if !let_go(scene, own.unwrap_or_default()) {
            pull.stiffness = 0.0;
        }
    }
}

/// Shares a pull among those of its nodes that still belong to an element of the scene. Whether there are any: else it has
/// nothing to pull.
pub fn let_go<M>(scene: SceneView<'_, M>, nodes: &mut [PulledNode]) -> bool {
    let is_left = |node: u32| !scene.is_alone(node as usize);
    if nodes.iter().all(|pulled| is_left(pulled.node)) {
        return true;
    }
    let left: f32 = nodes.iter().filter(|pulled| is_left(pulled.node)).map(|pulled| pulled.weight).sum();
    if left < LEAST_WEIGHT {
        return false;
    }
    for pulled in nodes {
        pulled.weight = if is_left(pulled.node) { pulled.weight / left } else { 0.0 };
    }
    true
}

/// Where a pulled point is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Pulled {
    /// m.
    pub point: [f32; 3],
    /// From the point to the target, m; along the direction of a pull that has one; zero of one that is absent.
    pub gap: [f32; 3],
    /// On the tissue, N.
    pub force: [f32; 3],
}

impl Pull {
    /// A pull at a point (m, at rest), of so many N/m without a limit ([`usual_most`] is one), whose target is there.
    #[must_use]
    pub const fn new(nodes: [u32; 2], at: [f32; 3], stiffness: f32) -> Self {
        Self {
            nodes,
            at,
            stiffness,
            most: f32::INFINITY,
            turned: [0.0; 3],
            turned_at: f32::NAN,
            along: [0.0; 3],
            from: at,
            to: at,
            times: [0.0; 2],
        }
    }

    /// Whether it acts.
    pub(crate) const fn acts(&self) -> bool {
        self.stiffness > 0.0 && !self.to[0].is_nan()
    }

    /// The target moves, from where it is at the time `from` (s), to `target` (m) at the time `to`; of a pull that is
    /// absent, or is to be, it is there at once.
    pub fn move_to(&mut self, target: [f32; 3], from: f64, to: f64) {
        let is_there = self.acts() && !target[0].is_nan();
        self.from = if is_there { self.target(from).to_array() } else { target };
        (self.to, self.times) = (target, [from, to]);
    }

    /// The target is there at once, m.
    pub const fn put(&mut self, target: [f32; 3]) {
        (self.from, self.to, self.times) = (target, target, [0.0; 2]);
    }

    /// The target at a time (s), m.
    #[must_use]
    pub fn target(&self, time: f64) -> Vec3 {
        let [start, end] = self.times;
        if time >= end {
            return self.to.into();
        }
        let share = ((time - start) / (end - start)).clamp(0.0, 1.0) as f32;
        let [from, to] = [self.from, self.to].map(Vec3::from_array);
        from + share * (to - from)
    }

    /// Its nodes in the list of those of all pulls.
    fn among<'a>(&self, nodes: &'a [PulledNode]) -> &'a [PulledNode] {
        let [first, count] = self.nodes.map(|number| number as usize);
        nodes.get(first..first.saturating_add(count)).unwrap_or_default()
    }

    /// From the mean place of its nodes at rest to its point there, m.
    fn arm(&self, points: &[[f32; 3]], nodes: &[PulledNode]) -> Vec3 {
        let place = |node: usize| points.get(node).copied().unwrap_or_default().into();
        Vec3::from_array(self.at) - mean(self.among(nodes), place)
    }

    /// Where its point would be if its nodes had turned only, m.
    pub(crate) fn unmoved(&self) -> Vec3 {
        Vec3::from_array(self.at) + Vec3::from_array(self.turned)
    }

    /// The direction along which it pulls, of length one, if there is one.
    fn direction(&self) -> Option<Vec3> {
        if self.along == [0.0; 3] { None } else { Vec3::from_array(self.along).try_normalize() }
    }

    /// The gap, or its part along the direction of the pull, m.
    fn gap(&self, gap: Vec3) -> Vec3 {
        self.direction().map_or(gap, |along| along.dot(gap) * along)
    }

    /// The force (N) that leaves the rest of a gap (m) which it alone makes, with what it is now, where the point moves by
    /// `compliance` under a force in the step, m/N for each axis; zero: it does not move.
    pub(crate) fn force(&self, gap: Vec3, now: Vec3, compliance: Vec3) -> Vec3 {
        let force = match self.direction() {
            Some(along) => {
                let (compliance, now) = (along.dot(compliance * along), along.dot(now));
                along * (self.stiffness * (along.dot(gap) + compliance * now) / (1.0 + self.stiffness * compliance))
            }
            None => self.stiffness * (gap + compliance * now) / (1.0 + self.stiffness * compliance),
        };
        force.clamp_length_max(self.most)
    }

    pub(crate) fn check(&self, index: usize, nodes: usize) -> Result<(), PullError> {
        let [first, count] = self.nodes.map(|number| number as usize);
        if count == 0 || first.checked_add(count).is_none_or(|end| end > nodes) {
            return Err(PullError::Range { pull: index, first, count, nodes });
        }
        let (place, target) = ("point", "target");
        let vectors =
            [(place, self.at), (place, self.turned), ("direction", self.along), (target, self.from), (target, self.to)];
        for (what, vector) in vectors.into_iter().take(if self.to[0].is_nan() { 3 } else { 5 }) {
            if let Some(&value) = vector.iter().find(|component| !is_bounded(**component)) {
                return Err(PullError::Value { pull: index, what, value });
            }
        }
        if let Some(&time) = self.times.iter().find(|time| !time.is_finite()) {
            return Err(PullError::Value { pull: index, what: "time", value: time as f32 });
        }
        if !(self.stiffness >= 0.0 && self.stiffness <= MOST_STIFFNESS) {
            return Err(PullError::Value { pull: index, what: "stiffness", value: self.stiffness });
        }
        if self.most.is_nan() || self.most < 0.0 {
            return Err(PullError::Value { pull: index, what: "most force", value: self.most });
        }
        Ok(())
    }
}

/// The most force (N) of a pull on these nodes unless the host says otherwise: a quarter of the shear modulus on the area in which they hang
/// together with other tissue, at most three quarters of it on a face of the cube that has the volume of the nodes' own tissue; half as
/// much for fewer than eight nodes. The area is the sum over the elements that have both nodes of the pull and others, of the volume times
/// the gradient between them: a patch at a thin edge hangs on less of it than its volume tells. Twice as much crushes elements there
/// where points with errors come and go. Looks at every element; faster for nodes in order. Infinite without tissue there.
#[must_use]
// Not inlined: other crates use the one that is compiled here.
#[inline(never)]
pub fn usual_most<M: Material>(scene: SceneView<'_, M>, nodes: &[PulledNode]) -> f32 {
    let is_sorted = nodes.is_sorted_by_key(|pulled| pulled.node);
    let is_pulled = |node: u32| match is_sorted {
        true => nodes.binary_search_by_key(&node, |pulled| pulled.node).is_ok(),
        false => nodes.iter().any(|pulled| pulled.node == node),
    };
    // m^3, N m, N
    let (mut volume, mut stiffness, mut across) = (0.0_f32, 0.0_f32, 0.0_f32);
    for (tile, lane) in scene.places() {
        let inside = [0, 1, 2, 3].map(|corner| is_pulled(tile.node(corner, lane) as u32));
        let corners = inside.into_iter().filter(|inside| *inside).count();
        if let Some(tissue) = scene.material.tissue(tile.element(lane)).filter(|_| corners > 0) {
            let (own, shear) = (tile.volume::<f32>(lane), Moduli::of(&tissue.law).shear as f32);
            let share = 0.25 * corners as f32 * own;
            volume += share;
            stiffness += share * shear;
            across += shear * own * gradient_of_share(tile, lane, inside).length();
        }
    }
    // G V^(2/3) with G V the sum.
    let of_volume = if volume > 0.0 { 0.75 * stiffness / libm::cbrtf(volume) } else { f32::INFINITY };
    let of_area = if across > 0.0 { 0.25 * across } else { f32::INFINITY };
    if nodes.len() < FEW { 0.5 * of_volume.min(of_area) } else { of_volume.min(of_area) }
}

/// The gradient (1/m) of what is one at some corners of an element and zero at the others.
fn gradient_of_share(tile: &ElementTile, lane: usize, inside: [bool; 4]) -> Vec3 {
    let [first, others @ ..] = inside.map(|inside| if inside { 1.0_f32 } else { 0.0 });
    let of = |(corner, share)| (share - first) * Vec3::from_array(tile.gradients(corner, lane));
    others.into_iter().enumerate().map(of).sum()
}

/// Nodes below which a pull tears sooner.
const FEW: usize = 8;

/// Whether a coordinate (m) or a weight is one.
fn is_bounded(value: f32) -> bool {
    value.abs() <= FARTHEST
}

/// Below this sum of weights nothing is left of a pull.
const LEAST_WEIGHT: f32 = 1e-6;

/// The stiffest pull, N/m.
pub const MOST_STIFFNESS: f32 = 1e6;

/// Pulls of a scene, checked.
#[derive(Clone, Copy, Debug)]
pub struct Pulls<'a> {
    nodes: &'a [PulledNode],
    pulls: &'a [Pull],
    scene_nodes: usize,
}

impl<'a> Pulls<'a> {
    /// Checks pulls and their nodes for a scene of so many nodes.
    pub fn new(scene_nodes: usize, nodes: &'a [PulledNode], pulls: &'a [Pull]) -> Result<Self, PullError> {
        for (index, pulled) in nodes.iter().enumerate() {
            if pulled.node as usize >= scene_nodes {
                return Err(PullError::Node { index, node: pulled.node, nodes: scene_nodes });
            }
            if !is_bounded(pulled.weight) {
                return Err(PullError::Weight { index, value: pulled.weight });
            }
        }
        for (index, pull) in pulls.iter().enumerate() {
            pull.check(index, nodes.len())?;
        }
        Ok(Self { nodes, pulls, scene_nodes })
    }

    /// Pulls that the caller has checked against a scene of so many nodes. Of those that have not been, nodes that do not
    /// exist are ignored, and values that are not finite make a step diverge.
    #[cfg(feature = "capi-neo-hookean")]
    pub(crate) const fn unchecked(scene_nodes: usize, nodes: &'a [PulledNode], pulls: &'a [Pull]) -> Self {
        Self { nodes, pulls, scene_nodes }
    }

    pub(crate) const fn scene_nodes(&self) -> usize {
        self.scene_nodes
    }

    /// The pulls.
    #[must_use]
    pub const fn pulls(&self) -> &'a [Pull] {
        self.pulls
    }

    /// Those that act now, and their places.
    pub(crate) fn acting(&self) -> impl Iterator<Item = (usize, &'a Pull)> + use<'a> {
        self.pulls.iter().enumerate().filter(|(_, pull)| pull.acts())
    }

    /// Calls with each node of a pull and a bound of its stiffness, N/m: of `k w w^T` its part is `k |w| sum |w|`.
    pub(crate) fn each_stiffness(&self, pull: &Pull, mut with: impl FnMut(&PulledNode, f32)) {
        let nodes = self.nodes_of(pull);
        let all: f32 = nodes.iter().map(|pulled| pulled.weight.abs()).sum();
        for pulled in nodes {
            with(pulled, pull.stiffness * pulled.weight.abs() * all);
        }
    }

    /// The nodes of a pull.
    pub(crate) fn nodes_of(&self, pull: &Pull) -> &'a [PulledNode] {
        pull.among(self.nodes)
    }

    /// Where the point of a pull is at a time (s) with these displacements of the nodes (m), and how it was pulled in the
    /// latest step, from the forces that the state keeps (N). None if there is no such pull.
    #[must_use]
    pub fn read(&self, index: usize, displacements: &[NodeVector], forces: &[NodeVector], time: f64) -> Option<Pulled> {
        let pull = self.pulls.get(index)?;
        let moved = self.mean(pull, |node| displacements.get(node).copied().unwrap_or_default().to_array().into());
        let at = pull.unmoved();
        let gap = if pull.acts() { pull.gap((pull.target(time) - at) - moved) } else { Vec3::ZERO };
        let force = forces.get(index).copied().unwrap_or_default().to_array();
        Some(Pulled { point: (at + moved).to_array(), gap: gap.to_array(), force })
    }

    /// The mean of a vector over the nodes of a pull, by their weights.
    pub(crate) fn mean(&self, pull: &Pull, of_node: impl Fn(usize) -> Vec3) -> Vec3 {
        mean(self.nodes_of(pull), of_node)
    }
}

fn mean(nodes: &[PulledNode], of_node: impl Fn(usize) -> Vec3) -> Vec3 {
    nodes.iter().map(|pulled| pulled.weight * of_node(pulled.node as usize)).sum()
}

/// Why a pull was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum PullError {
    /// It names a node that is not there.
    Node {
        /// Place in the list of nodes.
        index: usize,
        /// The node.
        node: u32,
        /// Nodes of the scene.
        nodes: usize,
    },
    /// A weight is not a number, or beyond 1e6.
    Weight {
        /// Place in the list of nodes.
        index: usize,
        /// The weight.
        value: f32,
    },
    /// It has no nodes, or others than there are.
    Range {
        /// Its place in the list of pulls.
        pull: usize,
        /// Its first node in the list of nodes.
        first: usize,
        /// How many.
        count: usize,
        /// How many the list has.
        nodes: usize,
    },
    /// A value that cannot be.
    Value {
        /// Its place in the list of pulls.
        pull: usize,
        /// "point", "direction", "target", "time", "stiffness" or "most force".
        what: &'static str,
        /// The value.
        value: f32,
    },
    /// No node is near enough to the point.
    Nothing {
        /// The radius that was asked for, m.
        radius: f32,
        /// Distance of the nearest node, m.
        nearest: f32,
    },
    /// More nodes are near than there is room for.
    Capacity {
        /// How many.
        needed: usize,
        /// How many fit.
        capacity: usize,
    },
}

impl fmt::Display for PullError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Node { index, node, nodes } => {
                write!(f, "entry {index} of the pulled nodes: node {node} does not exist, the scene has {nodes} nodes")
            }
            Self::Weight { index, value } => {
                write!(
                    f,
                    "entry {index} of the pulled nodes: a weight of {value}, it must be a number up to {FARTHEST:e}"
                )
            }
            Self::Range { pull, first, count, nodes } => write!(
                f,
                "pull {pull}: {count} nodes from entry {first} on, of a list of {nodes}: it needs at least one, and all must be there"
            ),
            Self::Value { pull, what: "stiffness", value } => {
                write!(f, "pull {pull}: a stiffness of {value} N/m, it must be from 0 (absent) to {MOST_STIFFNESS:e}")
            }
            Self::Value { pull, what: "most force", value } => {
                write!(f, "pull {pull}: a most force of {value} N, it must be zero or more, infinite for no limit")
            }
            Self::Value { pull, what: "time", value } => {
                write!(f, "pull {pull}: a time of {value} s, it must be a finite number")
            }
            Self::Value { what: "radius", value, .. } => {
                write!(f, "a radius of {value} m, it must be a finite positive number")
            }
            Self::Value { pull, what, value } => {
                write!(f, "pull {pull}: a component of its {what} is {value}, it must be a number up to {FARTHEST:e}")
            }
            Self::Nothing { radius, nearest } => write!(
                f,
                "a pull of radius {:.3} mm: the nearest node is {:.3} mm away, a larger radius reaches it",
                1e3 * radius,
                1e3 * nearest
            ),
            Self::Capacity { needed, capacity } => {
                write!(f, "the pulls need room for {needed} nodes, there is room for {capacity}")
            }
        }
    }
}

impl core::error::Error for PullError {}

#[cfg(test)]
mod tests {
    use super::Pull;

    #[test]
    fn a_target_stays_between_where_it_was_and_where_it_goes() {
        let mut pull = Pull::new([0, 1], [0.0; 3], 1.0);
        // Also where the host has mistaken the times.
        for [from, to] in [[1.0, 2.0], [2.0, 1.0], [2.0, f64::MIN_POSITIVE], [1.0, 1.0]] {
            pull.put([0.0; 3]);
            pull.move_to([1.0; 3], from, to);
            for time in [0.0, 0.5, 1.0, 1.5, 3.0] {
                assert!((0.0..=1.0).contains(&pull.target(time).x), "{from} {to} {time}");
            }
        }
    }
}
