//! What acts on a scene, set by the host whenever it likes: nodal forces (N), traction on boundary
//! triangles (Pa, turned into nodal forces on the shape at rest), pressure that follows the surface (Pa,
//! [`crate::pressure`]), gravity (m/s^2), prescribed motion (m).
//! A ramp of `r` seconds multiplies a load by `min(1, t / r)`; `r = 0` is a sudden load. In the step from
//! `t_n` to `t_(n+1)` forces are taken at `t_n`, prescribed positions at `t_(n+1)`.

use core::fmt;

use glam::{Vec3, Vec4};

use crate::contact::{Contact, Surface, kept_pushes};
use crate::element::Axes;
use crate::padding;
use crate::pressure::Pressure;
use crate::pulls::Pulls;
use crate::scene::AsScene;
use crate::simd::NodeVector;
use crate::state::StateView;

/// m. No target and no pressed point is farther away: so large a number is a mistake, and what follows from it might be none.
pub(crate) const FARTHEST: f32 = 1e6;

/// A force on one node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodalForce {
    /// The node.
    pub node: u32,
    /// Full force, N.
    pub newton: [f32; 3],
    /// Ramp, s.
    pub ramp: f32,
}

/// A displacement that one node follows along held axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// The node.
    pub node: u32,
    /// Axes that follow; each must be held by a [`Support`](crate::scene::Support).
    pub axes: Axes,
    /// Full displacement, m.
    pub metre: [f32; 3],
    /// Ramp, s.
    pub ramp: f32,
}

impl NodalForce {
    /// Checks entry `index` of a list for a scene of so many nodes.
    pub fn check(&self, index: usize, nodes: usize) -> Result<(), LoadError> {
        check("force", index, self.node, nodes, &self.newton, self.ramp)
    }
}

impl Motion {
    /// Checks entry `index` of a list for a scene of so many nodes, on which its node can be moved along these axes.
    pub fn check(&self, index: usize, nodes: usize, movable: Axes) -> Result<(), LoadError> {
        check("motion", index, self.node, nodes, &self.metre, self.ramp)?;
        match (0..3).find(|&axis| self.axes.has(axis) && !movable.has(axis)) {
            Some(axis) => Err(LoadError::NotHeld { index, node: self.node, axis }),
            None => Ok(()),
        }
    }
}

/// Why loads were refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LoadError {
    /// A load names a node that is not there.
    Node {
        /// "force", "motion", "triangle" or "pressure triangle".
        kind: &'static str,
        /// Position in its list.
        index: usize,
        /// The node it names.
        node: u32,
        /// Nodes in the scene.
        nodes: usize,
    },
    /// A component is NaN or infinite, or that of a pressed point beyond 1e6 m.
    NotFinite {
        /// "force", "motion", "traction", "gravity", "pressure" or "pressure triangle".
        kind: &'static str,
        /// Position in its list.
        index: usize,
        /// The value.
        value: f32,
    },
    /// A ramp is negative or not finite.
    Ramp {
        /// "force", "motion", "traction" or "pressure".
        kind: &'static str,
        /// Position in its list.
        index: usize,
        /// The ramp, s.
        value: f32,
    },
    /// A volume that is to be filled cannot be.
    Filling {
        /// Position in the list of surfaces.
        index: usize,
        /// The volume, m^3, which must be above zero.
        volume: f32,
        /// The stiffness, Pa, which must be zero or more.
        bulk: f32,
    },
    /// A surface that is to be filled is open.
    Open {
        /// Position in the list of surfaces.
        index: usize,
    },
    /// A triangle is of a surface that has no pressure.
    Surface {
        /// Position in the list of triangles.
        index: usize,
        /// The surface it names.
        surface: u32,
        /// Surfaces with a pressure.
        surfaces: usize,
    },
    /// A motion moves an axis that has no support which moves.
    NotHeld {
        /// Position in the list of motions.
        index: usize,
        /// The node.
        node: u32,
        /// 0, 1, 2 for x, y, z.
        axis: usize,
    },
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Node { kind, index, node, nodes } => {
                write!(f, "{kind} {index}: node {node} does not exist, the scene has {nodes} nodes")
            }
            Self::NotFinite { kind, index, value } => {
                write!(f, "{kind} {index}: a component is {value}")
            }
            Self::Ramp { kind, index, value } => {
                write!(f, "{kind} {index}: the ramp is {value} s, it must be zero or more")
            }
            Self::Filling { index, volume, bulk } => write!(
                f,
                "pressure {index}: filling to {volume} m^3 with {bulk} Pa; the volume must be positive, the stiffness zero or more"
            ),
            Self::Open { index } => write!(
                f,
                "pressure {index}: its surface is open, so it has no volume to be filled to: add the triangles that close it, or set a pressure"
            ),
            Self::Surface { index, surface, surfaces } => {
                write!(f, "pressure triangle {index}: surface {surface} does not exist, there are {surfaces}")
            }
            Self::NotHeld { index, node, axis } => {
                let axis = ["x", "y", "z"].get(axis).copied().unwrap_or("?");
                write!(f, "motion {index}: node {node} has no support that moves along {axis}")
            }
        }
    }
}

impl core::error::Error for LoadError {}

/// Checked loads, borrowed from the caller; what is absent costs nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loads<'a> {
    gravity: [f32; 3],
    forces: &'a [NodalForce],
    motions: &'a [Motion],
    contact: Option<Contact<'a>>,
    pressure: Option<Pressure<'a>>,
    /// Pushes of instruments that another run has found, N, and a factor.
    given: Option<(Surface<'a>, &'a [NodeVector], f32)>,
    pulls: Option<Pulls<'a>>,
    /// Nodes of the scene they were checked against.
    nodes: Option<usize>,
}

/// What loads were in a step: gravity, m/s^2, and a sum that other forces, pressures and pulls change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LoadMark {
    pub(crate) gravity: [f32; 3],
    pub(crate) others: f64,
}

/// Loads of each step of a span of time, for prescribed motions that go on within it.
pub trait LoadsOverTime {
    /// Loads of the next step of `seconds`, from this state; so many steps are left to the end of the span, this one
    /// included.
    fn of_step(&mut self, state: &StateView<'_>, seconds: f32, left: u32) -> Loads<'_>;
}

impl LoadsOverTime for Loads<'_> {
    fn of_step(&mut self, _: &StateView<'_>, _: f32, _: u32) -> Loads<'_> {
        *self
    }
}

impl<L: LoadsOverTime + ?Sized> LoadsOverTime for &mut L {
    fn of_step(&mut self, state: &StateView<'_>, seconds: f32, left: u32) -> Loads<'_> {
        (**self).of_step(state, seconds, left)
    }
}

/// Loads of a call that moves a scene on: motions without a ramp go evenly over the whole call, from where their nodes
/// are.
#[derive(Debug)]
pub struct LoadsOfCall<'a> {
    /// With the motions as they are asked for.
    loads: Loads<'a>,
    now: &'a mut [Motion],
}

impl<'a> LoadsOfCall<'a> {
    /// `now` is as long as the motions of `loads`, and is overwritten.
    pub fn new(loads: Loads<'a>, now: &'a mut [Motion]) -> Self {
        for (now, asked) in now.iter_mut().zip(loads.motions) {
            *now = *asked;
        }
        Self { loads, now }
    }

    /// As they are asked for.
    #[must_use]
    pub const fn asked(&self) -> &Loads<'a> {
        &self.loads
    }
}

impl LoadsOverTime for LoadsOfCall<'_> {
    fn of_step(&mut self, state: &StateView<'_>, _: f32, left: u32) -> Loads<'_> {
        let moved = self.now.iter_mut().zip(self.loads.motions).filter(|(_, asked)| asked.ramp == 0.0);
        for (now, asked) in moved {
            let at = state.displacements().get(asked.node as usize).copied().unwrap_or_default().to_array();
            for (metre, (from, to)) in now.metre.iter_mut().zip(at.into_iter().zip(asked.metre)) {
                *metre = if left > 1 { from + (to - from) / left as f32 } else { to };
            }
        }
        Loads { motions: self.now, ..self.loads }
    }
}

impl<'a> Loads<'a> {
    /// No load; supports stand still.
    pub const NONE: Self = Self {
        gravity: [0.0; 3],
        forces: &[],
        motions: &[],
        contact: None,
        pressure: None,
        given: None,
        pulls: None,
        nodes: None,
    };

    /// Checks loads against the scene they will act on. Nodes may be listed more than once: forces add
    /// up, of several motions of an axis the last one holds.
    pub fn new(
        scene: &impl AsScene,
        gravity: [f32; 3],
        forces: &'a [NodalForce],
        motions: &'a [Motion],
    ) -> Result<Self, LoadError> {
        let scene = scene.as_scene();
        let nodes = scene.node_count();
        finite("gravity", 0, &gravity)?;
        for (index, force) in forces.iter().enumerate() {
            force.check(index, nodes)?;
        }
        for (index, motion) in motions.iter().enumerate() {
            motion.check(index, nodes, scene.movable(motion.node as usize))?;
        }
        Ok(Self::unchecked(gravity, forces, motions, nodes))
    }

    /// Loads that the caller has checked against a scene of so many nodes. Of those that have not been, nodes that do
    /// not exist and axes that are not held are ignored, and values that are not finite make a step diverge.
    pub const fn unchecked(gravity: [f32; 3], forces: &'a [NodalForce], motions: &'a [Motion], nodes: usize) -> Self {
        Self { gravity, forces, motions, nodes: Some(nodes), ..Self::NONE }
    }

    /// The same loads and instruments that touch the tissue.
    #[cfg(feature = "contact")]
    #[must_use]
    pub const fn touched_by(self, contact: Contact<'a>) -> Self {
        Self { contact: Some(contact), ..self }
    }

    /// The same loads and pulls.
    #[cfg(feature = "contact")]
    #[must_use]
    pub const fn pulled_by(self, pulls: Pulls<'a>) -> Self {
        Self { pulls: Some(pulls), ..self }
    }

    /// The same loads and pressures that follow the surface.
    #[must_use]
    pub const fn pressed_by(self, pressure: Pressure<'a>) -> Self {
        Self { pressure: Some(pressure), ..self }
    }

    /// Pressures that follow the surface.
    #[must_use]
    pub const fn pressure(&self) -> Option<&Pressure<'a>> {
        self.pressure.as_ref()
    }

    /// Loads with so many times the pushes that the instruments exert in the latest step of a state in place of the
    /// instruments, if it keeps them.
    pub(crate) fn with_pushes_of<'b>(&self, state: &'b StateView<'_>, times: f32) -> Loads<'b>
    where
        'a: 'b,
    {
        let given = self.contact().and_then(|contact| {
            let surface = contact.surface();
            Some((surface, kept_pushes(state.pushes, &surface)?, times))
        });
        if given.is_none() { *self } else { Loads { contact: None, given, ..*self } }
    }

    /// The sum of the lengths of these pushes, N.
    pub(crate) fn sum_of_given(&self) -> f32 {
        let length = |push: &NodeVector| Vec4::from(push.0).truncate().length();
        self.given_pushes().map_or(0.0, |(_, pushes, _)| pushes.iter().map(length).sum())
    }

    // Without the feature all that these lead to is left out of the program.

    pub(crate) const fn given_pushes(&self) -> Option<(Surface<'a>, &'a [NodeVector], f32)> {
        if cfg!(feature = "contact") { self.given } else { None }
    }

    pub(crate) const fn contact(&self) -> Option<&Contact<'a>> {
        if cfg!(feature = "contact") { self.contact.as_ref() } else { None }
    }

    pub(crate) const fn pulls(&self) -> Option<&Pulls<'a>> {
        if cfg!(feature = "contact") { self.pulls.as_ref() } else { None }
    }

    /// The longest way (m) of an instrument or of the target of a pull, from this time (s) on in so many seconds.
    pub(crate) fn way(&self, time: f64, seconds: f32) -> f32 {
        let end = time + f64::from(seconds);
        let pulls = self.pulls.iter().flat_map(Pulls::acting);
        let targets = pulls.map(|(_, pull)| pull.target(end).distance(pull.target(time)));
        let instruments = self.contact.iter().flat_map(|contact| contact.instruments());
        targets.chain(instruments.map(|instrument| instrument.way([time, end]))).fold(0.0, f32::max)
    }

    pub(crate) const fn nodes(&self) -> Option<usize> {
        self.nodes
    }

    /// To see whether a host has changed them since.
    pub(crate) fn mark(&self) -> LoadMark {
        let [x, y, z] = [1.0, core::f64::consts::SQRT_2, core::f64::consts::E];
        let of_force = |force: &NodalForce| {
            let [a, b, c] = force.newton.map(f64::from);
            (f64::from(force.node) + z) * (x * a + y * b + z * c)
        };
        let forces: f64 = self.forces.iter().map(of_force).sum();
        let pulls = self.pulls().into_iter().flat_map(Pulls::acting);
        let pulls: f64 = pulls.map(|(index, pull)| (index as f64 + z) * f64::from(pull.stiffness)).sum();
        let pressures = self.pressure.map_or(0.0, |pressure| pressure.mark());
        LoadMark { gravity: self.gravity, others: forces + y * pulls + pressures }
    }

    /// The same loads with another gravity, m/s^2.
    pub(crate) const fn with_gravity(self, gravity: [f32; 3]) -> Self {
        Self { gravity, ..self }
    }

    /// Gravity, m/s^2.
    #[must_use]
    pub const fn gravity(&self) -> [f32; 3] {
        self.gravity
    }

    /// Nodal forces.
    #[must_use]
    pub const fn forces(&self) -> &'a [NodalForce] {
        self.forces
    }

    /// Prescribed motions.
    #[must_use]
    pub const fn motions(&self) -> &'a [Motion] {
        self.motions
    }

    /// Calls `prescribe` with each node and axis that a motion moves, the position there at `time` (s), m, and the
    /// node's vector. Of several motions of an axis the last one holds: they come last first, and the axes that are
    /// done are marked in the padding of the vectors ([`crate::padding`]).
    pub(crate) fn each_prescribed(
        &self,
        time: f64,
        vectors: &mut [NodeVector],
        mut prescribe: impl FnMut(usize, usize, f32, &mut [f32; 4]),
    ) {
        for motion in self.motions.iter().rev() {
            let node = motion.node as usize;
            let Some(NodeVector(vector)) = vectors.get_mut(node) else { continue };
            let factor = ramp_factor(time, motion.ramp);
            for axis in 0..3 {
                if motion.axes.has(axis) && padding::mark_axis(vector, axis) {
                    prescribe(node, axis, factor * motion.metre[axis], vector);
                }
            }
        }
        for motion in self.motions {
            if let Some(vector) = vectors.get_mut(motion.node as usize) {
                padding::clear_marks(vector);
            }
        }
    }
}

/// The share of a load that acts at `time`, s.
#[inline]
#[must_use]
pub fn ramp_factor(time: f64, ramp: f32) -> f32 {
    // Before the start, where a state of the host's may be, a ramp has not begun.
    if ramp > 0.0 && time < f64::from(ramp) { (time / f64::from(ramp)).max(0.0) as f32 } else { 1.0 }
}

/// Nodal forces of a uniform traction (Pa) on boundary triangles at rest: a third of traction times area
/// to each corner. The direction stays as given while the body moves (a dead load). Where elements are removed they go on to
/// act on the nodes that are left: make them again, of the triangles that are left.
pub fn traction<'a>(
    points: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    pascal: [f32; 3],
    ramp: f32,
) -> impl Iterator<Item = Result<NodalForce, LoadError>> + 'a {
    triangles.iter().enumerate().flat_map(move |(index, &triangle)| {
        let nodes = points.len();
        let corner = |node: u32| points.get(node as usize).copied().map(Vec3::from_array);
        let [a, b, c] = triangle.map(corner);
        let share = match (a, b, c) {
            (Some(a), Some(b), Some(c)) => Some((b - a).cross(c - a).length() / 6.0),
            _ => None,
        };
        triangle.into_iter().map(move |node| {
            let Some(share) = share else {
                let missing = triangle.into_iter().find(|&node| node as usize >= nodes);
                return Err(LoadError::Node { kind: "triangle", index, node: missing.unwrap_or(node), nodes });
            };
            let newton = pascal.map(|component| component * share);
            check("traction", index, node, nodes, &newton, ramp)?;
            Ok(NodalForce { node, newton, ramp })
        })
    })
}

fn check(
    kind: &'static str,
    index: usize,
    node: u32,
    nodes: usize,
    vector: &[f32; 3],
    ramp: f32,
) -> Result<(), LoadError> {
    if node as usize >= nodes {
        return Err(LoadError::Node { kind, index, node, nodes });
    }
    if !(ramp.is_finite() && ramp >= 0.0) {
        return Err(LoadError::Ramp { kind, index, value: ramp });
    }
    finite(kind, index, vector)
}

fn finite(kind: &'static str, index: usize, vector: &[f32; 3]) -> Result<(), LoadError> {
    match vector.iter().find(|component| !component.is_finite()) {
        Some(&value) => Err(LoadError::NotFinite { kind, index, value }),
        None => Ok(()),
    }
}
