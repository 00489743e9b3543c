//! Which nodes and triangles of the surface the instruments can reach in a step. One that was found at a distance from
//! all instruments is looked at again only when body and instruments together can have moved that far (m):
//!
//! ```text
//! looked at  if  threshold < travelled + farthest + margin,   threshold = travelled + distance - |next| when it was looked at
//! ```
//! `travelled` sums, over the steps, the most that a node and that an instrument moved; `farthest` is the most that a
//! node moves in this step. The result is the same as that of looking at all of them.

use bytemuck::{Pod, Zeroable, must_cast_slice_mut};
use glam::Vec3;

use super::instrument::MOST_INSTRUMENTS;
use super::pushes::TouchedPoint;
use super::surface::places;
use super::{Placed, Surface, VECTORS_OF_TOUCHED};
use crate::inertia::LOCAL_FLOATS;
use crate::simd::{Kernel, NodeVector, Real, axes, dispatch};
use crate::state::Progress;

/// An increment that is rounded to the grid of the displacements is at most doubled; a vector is at most so much longer
/// than its largest component.
const LENGTH: f64 = 1.733;
const MOVED: f64 = 2.0 * LENGTH;
/// Where `travelled` begins anew, m: floats below it are exact to 0.06 um, which `SLACK` covers.
const MOST_TRAVELLED: f64 = 1.0;
const SLACK: f64 = 4e-7;

/// Where an instrument was at the end of the last step, and its shape as a number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Seen {
    pub(super) position: [f32; 3],
    pub(super) shape: u32,
    pub(super) rotation: [f32; 4],
}

/// What the thresholds count from.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
struct Head {
    /// m.
    travelled: f64,
    /// The state that the thresholds belong to.
    steps: u64,
    time: f64,
    kinetic: f64,
    last_step: f32,
    instruments: u32,
    seen: [Seen; MOST_INSTRUMENTS],
    spare: [u32; 2],
}

const VECTORS_OF_HEAD: usize = size_of::<Head>() / size_of::<NodeVector>();

const LOCAL_VECTORS: usize = LOCAL_FLOATS.div_ceil(4);

/// Vectors that a state keeps for a surface of so many nodes and triangles that instruments can touch
/// ([`StateView::pushing`](crate::state::StateView::pushing)).
#[must_use]
pub const fn vectors_to_push(nodes: usize, triangles: usize) -> usize {
    let places = places(nodes, triangles);
    places
        .saturating_mul(1 + VECTORS_OF_TOUCHED)
        .saturating_add(places.div_ceil(4) + VECTORS_OF_HEAD + LOCAL_VECTORS)
        .saturating_add(sums_of_nodes(nodes, triangles))
}

/// Triangles share nodes: their pushes are summed.
const fn sums_of_nodes(nodes: usize, triangles: usize) -> usize {
    if triangles == 0 { 0 } else { nodes }
}

/// The parts of the vectors that a state keeps for instruments.
pub(crate) struct ContactMemory<'a> {
    head: &'a mut Head,
    /// For each place of the surface, m.
    thresholds: &'a mut [f32],
    /// Pushes of the step before on the places of the surface, N, and the point of a triangle that was pushed.
    pub(crate) before: &'a mut [NodeVector],
    pub(crate) room: SolverRoom<'a>,
}

/// Room for what is solved for the pushes of a step.
#[derive(Default)]
pub(crate) struct SolverRoom<'a> {
    /// Points that touch.
    pub(crate) touched: &'a mut [TouchedPoint],
    /// The answer of a lattice to their pushes.
    pub(crate) local: &'a mut [f32],
    /// A vector for each node of the surface; empty without triangles.
    pub(crate) sums: &'a mut [NodeVector],
}

/// The pushes (N) on the places of the surface in the latest step, from the vectors that a state keeps.
pub(crate) fn kept_pushes<'a>(vectors: &'a [NodeVector], surface: &Surface<'_>) -> Option<&'a [NodeVector]> {
    let places = surface.places();
    let from = VECTORS_OF_HEAD + LOCAL_VECTORS + places.div_ceil(4);
    vectors.get(from..from.checked_add(places)?)
}

impl<'a> ContactMemory<'a> {
    /// None if there is less than [`vectors_to_push`].
    pub(crate) fn split(vectors: &'a mut [NodeVector], surface: &Surface<'_>) -> Option<Self> {
        let (nodes, triangles) = (surface.nodes().len(), surface.triangles().len());
        let places = surface.places();
        let (head, rest) = vectors.split_at_mut_checked(VECTORS_OF_HEAD)?;
        let heads: &mut [Head] = must_cast_slice_mut(head.as_chunks_mut::<VECTORS_OF_HEAD>().0);
        let (local, rest) = rest.split_at_mut_checked(LOCAL_VECTORS)?;
        let (thresholds, rest) = rest.split_at_mut_checked(places.div_ceil(4))?;
        let thresholds: &mut [f32] = must_cast_slice_mut(thresholds);
        let (before, rest) = rest.split_at_mut_checked(places)?;
        let (sums, rest) = rest.split_at_mut_checked(sums_of_nodes(nodes, triangles))?;
        let touched: &mut [TouchedPoint] = must_cast_slice_mut(rest.as_chunks_mut::<VECTORS_OF_TOUCHED>().0);
        Some(Self {
            head: heads.first_mut()?,
            thresholds: thresholds.get_mut(..places)?,
            before,
            room: SolverRoom { touched: touched.get_mut(..places)?, local: must_cast_slice_mut(local), sums },
        })
    }

    /// Forgets the pushes of another state: it was restored or reset, or has gone on without instruments.
    pub(crate) fn forget_if_other(&mut self, progress: &Progress) {
        let (steps, time, kinetic, _) = moment(progress);
        let head = &*self.head;
        // One that was put back to a peak of its energy is no other.
        if (head.steps, head.time, head.kinetic) != (steps, time, kinetic) {
            self.before.fill(NodeVector::ZERO);
        }
    }

    fn follows(&self, progress: &Progress) -> bool {
        let head = &*self.head;
        (head.steps, head.time, head.kinetic, head.last_step) == moment(progress)
    }

    /// Begins a step in which the instruments go as `placed`, of a body whose nodes have moved by up to `last` along
    /// each axis in the step before and will move by up to `next`, m. Gives the limit of the thresholds for nodes that
    /// come nearer than `margin`.
    pub(crate) fn begin(
        &mut self,
        progress: &Progress,
        placed: &[Placed<'_>],
        [last, next]: [f32; 2],
        margin: f32,
    ) -> f32 {
        let (way, follows) = (self.way(placed), self.follows(progress));
        self.forget_if_other(progress);
        let head = &mut *self.head;
        let travelled = head.travelled + MOVED * f64::from(last) + way.map_or(0.0, f64::from);
        // Not a number, or infinite: begins anew as well.
        if follows && way.is_some() && travelled < MOST_TRAVELLED {
            head.travelled = travelled;
        } else {
            head.travelled = 0.0;
            self.thresholds.fill(f32::NEG_INFINITY);
        }
        self.set_moment(progress);
        (self.head.travelled + LENGTH * f64::from(next) + f64::from(margin) + SLACK) as f32
    }

    /// The most that a point of an instrument has moved since the last step, m, and notes where they are. None if they
    /// are others.
    fn way(&mut self, placed: &[Placed<'_>]) -> Option<f32> {
        let same = self.head.instruments as usize == placed.len();
        self.head.instruments = placed.len() as u32;
        let mut most = same.then_some(0.0f32);
        for (seen, placed) in self.head.seen.iter_mut().zip(placed) {
            let now = placed.seen();
            most = match (most, placed.way_from(seen)) {
                (Some(most), Some(way)) => Some(most.max(way)),
                _ => None,
            };
            *seen = now;
        }
        most
    }

    /// Notes that the thresholds belong to the state.
    pub(crate) fn set_moment(&mut self, progress: &Progress) {
        let head = &mut *self.head;
        (head.steps, head.time, head.kinetic, head.last_step) = moment(progress);
    }

    /// The next place of the surface, from `from` on, that is to be looked at.
    pub(crate) fn next_in_reach(&self, from: usize, limit: f32) -> Option<usize> {
        const AT_ONCE: usize = 32;
        let out_of_reach = |threshold: &f32| *threshold >= limit;
        let mut place = from;
        while let Some(rest) = self.thresholds.get(place..).filter(|rest| !rest.is_empty()) {
            // Without branches, so that it is vectorised.
            if let Some(several) = rest.first_chunk::<AT_ONCE>()
                && several.iter().fold(true, |all, threshold| all & out_of_reach(threshold))
            {
                place += AT_ONCE;
                continue;
            }
            let several = rest.iter().take(AT_ONCE);
            let far = several.len();
            match several.clone().position(|threshold| !out_of_reach(threshold)) {
                Some(at) => return Some(place + at),
                None => place += far,
            }
        }
        None
    }

    /// The places of the surface where the step before may have pushed, with the pushes.
    pub(crate) fn pushed(&self) -> impl Iterator<Item = (usize, &NodeVector)> {
        let mut from = 0;
        core::iter::from_fn(move || {
            let place = self.next_in_reach(from, f32::MIN)?;
            from = place + 1;
            Some((place, self.before.get(place)?))
        })
    }

    /// Notes how far a node or triangle was from all instruments at the least, m, at the start of the step.
    pub(crate) fn note(&mut self, place: usize, distance: f32) {
        // One that was pushed stays in reach until the push is let go.
        let is_pushed = self.before.get(place).is_some_and(|push| push.to_array() != [0.0; 3]);
        if let Some(threshold) = self.thresholds.get_mut(place).filter(|_| !is_pushed) {
            *threshold = (self.head.travelled + f64::from(distance)) as f32;
        }
    }

    /// Keeps the pushes of a step that is accepted; those places are looked at in the next one.
    pub(crate) fn accept(&mut self, touched: usize) {
        for each in self.room.touched.iter().take(touched) {
            let place = each.place as usize;
            if let (Some(before), Some(threshold)) = (self.before.get_mut(place), self.thresholds.get_mut(place)) {
                let [x, y, z] = each.push;
                before.0 = [x, y, z, each.point().packed()];
                if each.push != [0.0; 3] {
                    *threshold = f32::NEG_INFINITY;
                }
            }
        }
    }
}

fn moment(progress: &Progress) -> (u64, f64, f64, f32) {
    (progress.steps(), progress.time(), progress.energy_balance().kinetic, progress.last_step())
}

impl Placed<'_> {
    fn seen(&self) -> Seen {
        Seen {
            position: self.end.position.to_array(),
            shape: self.instrument.shape.number(),
            rotation: self.end.rotation.to_array(),
        }
    }

    /// The most that a point of the instrument has moved since it was seen, m. None if it was another one, or has no
    /// bound.
    fn way_from(&self, seen: &Seen) -> Option<f32> {
        let now = self.seen();
        let moved = Vec3::from_array(now.position).distance(Vec3::from_array(seen.position));
        let [a, b] = [now.rotation, seen.rotation].map(glam::Quat::from_array);
        let b = if a.dot(b) < 0.0 { -b } else { b };
        // Twice the chord of the quaternions is at least the chord of the turn.
        let turned = 2.0 * (a - b).length();
        let turned = if turned > 0.0 { turned * self.instrument.shape.extent() } else { 0.0 };
        (now.shape == seen.shape && (moved + turned).is_finite()).then_some(moved + turned)
    }
}

/// The largest component of vectors.
struct Largest<'a>(&'a [NodeVector]);

/// The largest component of vectors, without their padding.
#[inline(never)]
pub(crate) fn largest_component(vectors: &[NodeVector]) -> f32 {
    dispatch(Largest(vectors))
}

impl Kernel for Largest<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<R: Real>(self) -> f32 {
        const FOUR: usize = 16;
        let (whole, rest) = self.0.as_chunks::<4>();
        let mut most = [R::splat(0.0); 4];
        for four in whole {
            let components: &[f32; FOUR] = bytemuck::must_cast_ref(four);
            for (most, from) in most.iter_mut().zip((0..FOUR).step_by(R::COUNT)) {
                let components = R::from_fn(|lane| components[(from + lane) % FOUR]);
                *most = (axes::<R>() * components).abs().max(*most);
            }
        }
        let rest = rest.iter().flat_map(|vector| vector.to_array()).fold(0.0, |most: f32, each| most.max(each.abs()));
        most.iter().fold(rest, |all, most| (0..R::COUNT).fold(all, |all, lane| all.max(most.lane(lane))))
    }
}
