//! Rigid instruments that touch the tissue: where they are, and what they feel. A node that a step would put into an
//! instrument is put onto its surface instead, its speed into the instrument is removed, and its slip is reduced as far
//! as Coulomb's friction can. With the gap `g` (m, negative inside), the outward normal `n` there, and the slip `s` of
//! the node along the surface in a step:
//!
//! ```text
//! p = c (-g n - r s),   c = m / (dt h / (1 + k)),   r = min(1, mu |g| / |s|)
//! ```
//! The push `p` (N) is the force that takes the node there in this very step ([`crate::tled`]), so there is no
//! stiffness to be tuned, the critical step is that without an instrument, and the sum of the pushes is the force on
//! the instrument. A node that nothing presses is free in the next step. NiftySim's contact is of this kind (Johnsen et
//! al. 2015).
//!
//! A finger presses a bar from the side, leaves, and says how hard it pressed:
//!
#![cfg_attr(feature = "std", doc = "```")]
#![cfg_attr(not(feature = "std"), doc = "```ignore")]
#![doc = include_str!("../doc_common.txt")]
//! use supple::contact::{Contact, Instrument, Pose, Shape, Surface, Touch, boundary};
//!
//! let nodes = boundary(&mesh);
//! let surface = Surface::new(&nodes, scene.node_count())?;
//! let step = Step::new(0.9 * critical.seconds, 20.0, critical)?;
//! let mut finger = Instrument::resting(Shape::Sphere { radius: 0.01 }, Pose::at([-0.011, 0.01, 0.09]));
//! finger.friction = 0.3;
//! let (mut touches, mut most) = ([Touch::default()], 0.0f32);
//! for frame in 0..18 {
//!     let (now, end) = (state.time(), f64::from(frame + 1) / 60.0);
//!     let depth = 0.01 - (0.01 - 0.001 * frame as f32).abs(); // m
//!     finger.move_to(Pose::at([-0.011 + depth, 0.01, 0.09]), now, end);
//!     let instruments = [finger];
//!     let contact = Contact::new(surface, &instruments)?;
//!     let loads = Loads::NONE.touched_by(contact);
//!     while state.time() < end {
//!         let status = tled::step(&scene, &loads, &mut state.view().feeling(&mut touches), &step);
//!         assert_eq!(status, Status::Ok);
//!     }
//!     most = most.max(-touches[0].force[0]);
//! }
//! println!("at most {:.1} mN", 1e3 * most);
//! # assert!(most > 1e-3, "{most}");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A body of any form is a [`Field`] of signed distances. Nodes that an instrument grasps ([`Contact::gripping`]) move with it, whatever
//! force that takes. [`LocalForce`] is the force between two frames, for a haptic loop.
//!
//! Long steps solve for the pushes on all nodes together, as these move each other (`pushes.rs`), from those
//! of the step before. Learned steps refuse instruments: what they push would be inertia that is not there.
//!
//! An instrument that is thinner than edges are long meets triangles too ([`Surface::with_triangles`]): the push acts on the point of a
//! triangle that is deepest inside, with capsules two, shared among its corners by the point's weights (`triangle.rs`, `src/step/triangles.rs`).
//!
//! Work: at most each node and triangle of the surface against each instrument in each step, and 24 sweeps over the nodes and triangles that
//! touch. A state with room for pushes
//! ([`StateView::pushing`](crate::state::StateView::pushing)) knows how near each node was, and looks only at those that instruments can
//! reach (`clearance.rs`). Nodes that supports hold along all axes are passed through. A node that touches several instruments is moved by
//! one after the other, in long steps and where there are triangles by the nearest one. Damping of a few 1/s is what ends the rattling of light nodes on hard surfaces.

mod clearance;
mod field;
#[cfg(feature = "std")]
mod field_of_surface;
mod grip;
mod instrument;
mod local_force;
mod pose;
mod pushes;
mod rolling;
mod shape;
#[cfg(feature = "std")]
mod signed_distance;
mod surface;
mod triangle;

pub use clearance::vectors_to_push;
pub(crate) use clearance::{ContactMemory, SolverRoom, kept_pushes, largest_component};
pub use field::{Field, FieldError};
#[cfg(feature = "std")]
pub use field_of_surface::SurfaceField;
pub use grip::Grip;
pub use instrument::{Instrument, MOST_INSTRUMENTS};
pub use local_force::LocalForce;
pub use pose::Pose;
pub(crate) use pushes::{Compliance, HELD, TouchedPoint, directions, solve};
pub use shape::Shape;
pub use surface::{Surface, SurfaceNode, passes_between};
#[cfg(any(feature = "std", test))]
pub use surface::{boundary, boundary_triangles};
pub(crate) use triangle::TrianglePoint;

use core::fmt;

use glam::Vec3;

use crate::simd::NodeVector;
use pose::Placement;

/// How fast instruments put tissue out that was inside them, m/s.
const OUTWARD: f32 = 0.25;

/// Instruments and the surface that they can touch, checked.
#[derive(Clone, Copy, Debug)]
pub struct Contact<'a> {
    surface: Surface<'a>,
    instruments: &'a [Instrument<'a>],
    grips: &'a [Grip],
}

impl<'a> Contact<'a> {
    /// Checks the instruments.
    pub fn new(surface: Surface<'a>, instruments: &'a [Instrument<'a>]) -> Result<Self, ContactError> {
        if instruments.len() > MOST_INSTRUMENTS {
            return Err(ContactError::Instruments { instruments: instruments.len() });
        }
        for (index, instrument) in instruments.iter().enumerate() {
            instrument.check(index)?;
        }
        Ok(Self { surface, instruments, grips: &[] })
    }

    /// The same with nodes that instruments hold, in increasing order of their places in the surface
    /// ([`Instrument::grips`]).
    pub fn gripping(self, grips: &'a [Grip]) -> Result<Self, ContactError> {
        let (mut least, nodes) = (0, self.surface.nodes().len());
        for (index, grip) in grips.iter().enumerate() {
            let place = grip.place as usize;
            let is_sound = place >= least
                && place < nodes
                && (grip.instrument as usize) < self.instruments.len()
                && grip.point.iter().all(|component| component.is_finite());
            if !is_sound {
                return Err(ContactError::Grip { index, grip: *grip });
            }
            least = place + 1;
        }
        Ok(Self { grips, ..self })
    }

    /// The nodes that instruments hold.
    #[must_use]
    pub const fn grips(&self) -> &'a [Grip] {
        self.grips
    }

    /// Whether an instrument holds the node, or a corner of the triangle, at this place of the surface.
    pub(crate) fn is_gripped(&self, place: usize) -> bool {
        let is_held = |place| self.grips.binary_search_by_key(&place, |grip| grip.place as usize).is_ok();
        !self.grips.is_empty() && self.surface.corner_places(place).into_iter().any(is_held)
    }

    /// The nodes that can be touched.
    #[must_use]
    pub const fn surface(&self) -> Surface<'a> {
        self.surface
    }

    /// The instruments.
    #[must_use]
    pub const fn instruments(&self) -> &'a [Instrument<'a>] {
        self.instruments
    }

    /// The instruments as they go in a step of so many seconds from `time` on.
    pub(crate) fn placed(&self, time: f64, seconds: f32) -> heapless::Vec<Placed<'a>, MOST_INSTRUMENTS> {
        let times = [time, time + f64::from(seconds)];
        self.instruments.iter().map(|instrument| Placed::new(instrument, times)).take(MOST_INSTRUMENTS).collect()
    }
}

pub(crate) const VECTORS_OF_TOUCHED: usize = size_of::<TouchedPoint>() / size_of::<NodeVector>();

/// What an instrument feels in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct Touch {
    /// Force of the tissue on the instrument, N.
    pub force: [f32; 3],
    /// Moment of the same about the position of the instrument at the end of the step, N m.
    pub moment: [f32; 3],
    /// Nodes that it pushes, and points of triangles.
    pub contacts: u32,
    /// How far the deepest one would have been inside without the instrument, m.
    pub depth: f32,
    /// Work that it does on the tissue, J.
    pub work: f32,
    /// What friction takes of the work of the instrument, J.
    pub friction_loss: f32,
}

impl Touch {
    /// Adds the push (N) on a node at `arm` (m) from the instrument's position, with how far it and the instrument
    /// there move, m.
    pub(crate) fn add(&mut self, push: Vec3, arm: Vec3, depth: f32, [node, instrument]: [Vec3; 2]) {
        self.force = (Vec3::from_array(self.force) - push).to_array();
        self.moment = (Vec3::from_array(self.moment) - arm.cross(push)).to_array();
        self.contacts += 1;
        self.depth = self.depth.max(depth);
        self.work += push.dot(node);
        self.friction_loss += push.dot(instrument - node);
    }
}

/// Where an instrument pushes a node or a triangle in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct ContactPoint {
    /// At the end of the step, m.
    pub position: [f32; 3],
    /// Outward normal of the instrument there; zero where it holds the node.
    pub normal: [f32; 3],
    /// Force of the instrument on the tissue, N.
    pub force: [f32; 3],
    /// How far the point would have been inside without the instrument, m.
    pub depth: f32,
    /// The node; of a triangle the corner with most of the force.
    pub node: u32,
    /// The instrument's place in the list.
    pub instrument: u32,
}

/// An instrument in a step: placed where it starts and where it ends.
pub(crate) struct Placed<'a> {
    pub(crate) instrument: &'a Instrument<'a>,
    start: Placement,
    end: Placement,
}

/// A node in the way of an instrument, or near it.
pub(crate) struct Meeting {
    /// Distance at the end of the step, m, below zero inside.
    pub(crate) gap: f32,
    pub(crate) normal: Vec3,
    /// On the surface of the instrument, m.
    pub(crate) point: Vec3,
    /// The position from the instrument's, m.
    pub(crate) arm: Vec3,
    /// How far the instrument moves there in the step, m.
    pub(crate) carried: Vec3,
}

impl Meeting {
    /// Where a point that moves so far (m) over the instrument in a step of so many seconds will be from where it should
    /// be: the gap along the normal, the slip across, m.
    pub(crate) fn relative(&self, slip: Vec3, seconds: f32) -> Vec3 {
        self.gap_to_close(slip, seconds) * self.normal + (slip - slip.dot(self.normal) * self.normal)
    }

    /// The gap (m) that a push closes: what was inside before the step, as tissue is that another instrument lets go,
    /// goes out at a bounded speed, or short steps would throw it.
    pub(crate) fn gap_to_close(&self, slip: Vec3, seconds: f32) -> f32 {
        self.gap - (self.gap - slip.dot(self.normal) + OUTWARD * seconds).min(0.0)
    }

    /// How far a point that moves by `way` (m) comes nearer to the instrument in the step, m.
    pub(crate) fn approach(&self, way: Vec3) -> f32 {
        (self.carried - way).dot(self.normal).max(0.0)
    }
}

impl<'a> Placed<'a> {
    pub(crate) fn new(instrument: &'a Instrument<'a>, times: [f64; 2]) -> Self {
        let [start, end] = times.map(|time| instrument.placement(time));
        Self { instrument, start, end }
    }

    pub(crate) fn is_plane(&self) -> bool {
        self.instrument.shape == Shape::Plane
    }

    /// A distance (m) that the point of a meeting has at the least.
    pub(crate) fn least_distance(&self, meeting: &Meeting) -> f32 {
        meeting.gap - self.instrument.shape.uncertainty()
    }

    /// How far its centre moves, m.
    pub(crate) fn way(&self) -> f32 {
        self.start.position.distance(self.end.position)
    }

    /// Whether a box (m) is nowhere near its way in the step.
    pub(crate) fn passes_by(&self, [least, most]: [Vec3; 2]) -> bool {
        let ([from, to], extent) = ([&self.start, &self.end].map(|at| at.position), self.instrument.shape.extent());
        (from.max(to) + extent).cmplt(least).any() || (from.min(to) - extent).cmpgt(most).any()
    }

    /// The farthest that it and the tissue may come nearer to each other in a step, m: farther, and tissue could be on
    /// its other side.
    pub(crate) fn thickness(&self) -> f32 {
        self.instrument.shape.thickness()
    }

    /// A point (m) from the position at the end of the step.
    pub(crate) fn arm(&self, point: Vec3) -> Vec3 {
        point - self.end.position
    }

    /// A point in the axes of the instrument at the end of the step, m.
    pub(crate) fn held(&self, point: [f32; 3]) -> Vec3 {
        self.end.position + self.end.turned(Vec3::from_array(point))
    }

    /// How far the instrument moves at a point (m) of it at the end of the step.
    pub(crate) fn carried(&self, point: Vec3) -> Vec3 {
        // Zero where it stands still: a rounding in each step would carry what it holds by friction away.
        let (from, to) = (&self.start, &self.end);
        let held = to.in_shape(point);
        (to.position - from.position) + (to.turned(held) - from.turned(held))
    }

    /// The meeting with a node that will be at `point` (m) at the end of the step. None if that is not a number.
    pub(crate) fn meet(&self, point: Vec3) -> Option<Meeting> {
        let (gap, normal) = self.instrument.shape.nearest(self.end.in_shape(point));
        if gap.is_nan() {
            return None;
        }
        let normal = self.end.turned(normal);
        let point = point - gap * normal;
        Some(Meeting { gap, normal, point, arm: self.arm(point), carried: self.carried(point) })
    }
}

/// Why a surface or an instrument was refused.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ContactError {
    /// A node of the surface that the scene does not have.
    Node {
        /// Its place in the surface.
        place: usize,
        /// The node.
        node: u32,
        /// Nodes of the scene.
        nodes: usize,
    },
    /// A position at rest that is not a number.
    Point {
        /// Its place in the surface.
        place: usize,
        /// The node.
        node: u32,
    },
    /// A triangle with a corner that the surface does not have, or has twice.
    Triangle {
        /// Its place in the list.
        triangle: usize,
        /// The corner, as a place in the surface.
        place: u32,
        /// Nodes of the surface.
        nodes: usize,
    },
    /// More instruments than [`MOST_INSTRUMENTS`].
    Instruments {
        /// How many.
        instruments: usize,
    },
    /// A size, friction or time that cannot be one.
    Instrument {
        /// Its place in the list.
        instrument: usize,
        /// "radius", "length", "friction" or "time".
        what: &'static str,
        /// The value.
        value: f32,
    },
    /// A grip of a node that the surface does not have, or that is not in order, of an instrument that there is not, or
    /// at no point.
    Grip {
        /// Its place in the list.
        index: usize,
        /// The grip.
        grip: Grip,
    },
    /// A pose with a position that is not a number, or a rotation without a length.
    Pose {
        /// Its place in the list.
        instrument: usize,
    },
}

impl fmt::Display for ContactError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Node { place, node, nodes } => {
                write!(f, "entry {place} of the surface: node {node} does not exist, the scene has {nodes} nodes")
            }
            Self::Point { place, node } => {
                write!(f, "entry {place} of the surface: the position of node {node} is not a number")
            }
            Self::Triangle { triangle, place, nodes } => write!(
                f,
                "triangle {triangle} of the surface: its corner {place} comes twice or does not exist, the surface has {nodes} nodes"
            ),
            Self::Instruments { instruments } => {
                write!(f, "{instruments} instruments: at most {MOST_INSTRUMENTS} can touch a body at once")
            }
            Self::Instrument { instrument, what, value } => {
                write!(f, "instrument {instrument}: a {what} of {value} cannot be")
            }
            Self::Grip { index, grip: Grip { place, instrument, point } } => write!(
                f,
                "grip {index}, of entry {place} of the surface by instrument {instrument} at {point:?} m: both must exist, the point \
                 must be one, and entries come in increasing order"
            ),
            Self::Pose { instrument } => {
                write!(f, "instrument {instrument}: its pose is not one: three numbers and a rotation that is not zero")
            }
        }
    }
}

impl core::error::Error for ContactError {}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rounding would add up over the steps to millimetres.
    #[test]
    fn an_instrument_that_stands_still_carries_nothing() {
        for case in 0..1000 {
            let [a, b, c] = [0.37, 0.61, 0.83].map(|factor: f32| libm::sinf(factor * case as f32));
            let pose = Pose { position: [a, 0.1 * b, c], rotation: [b, c, a, 0.7] };
            let instrument = Instrument::resting(Shape::Sphere { radius: 0.01 }, pose);
            let carried = Placed::new(&instrument, [0.0, 1e-4]).carried(Vec3::new(a + 0.01, 0.1 * b, c));
            assert_eq!(carried, Vec3::ZERO, "{pose:?}");
        }
    }
}
