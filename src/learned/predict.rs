//! A prediction, vectorised over the vertices: frames, features, network, clipping, next increments (m), and what they
//! enter in the energy balance.

use crate::element::NodeInertia;
use crate::mlp::{ForceInput, MAX_INPUTS, Network, Scratch};
use crate::simd::{Kernel, NodeVector, Real, dispatch, dot};
use crate::step::{Step, Sums, Totals};

use super::frame::{Axes, Frame};
use super::{LearnedReport, Vertex};

/// Inputs of the network for each vertex.
pub const FEATURES: usize = 7;
/// Its outputs.
pub const PREDICTED: usize = 3;

/// The state of a vector of vertices, from which the network's inputs are made.
pub(crate) struct VertexInput<R> {
    /// m.
    pub(crate) displacement: [R; 3],
    /// m/s.
    pub(crate) speed: R,
    /// N.
    pub(crate) force: [R; 3],
    /// Lumped, kg.
    pub(crate) mass: R,
}

impl<R: Real> VertexInput<R> {
    #[inline(always)]
    pub(crate) fn features(&self, axes: &Axes<R>, input: ForceInput) -> [R; FEATURES] {
        let force = match input {
            ForceInput::Newton => self.force,
            // A vertex of no element has no mass, and no force.
            ForceInput::PerMass => {
                let mass = self.mass.choose(self.mass, R::splat(1.0));
                let [x, y, z] = self.force;
                [x.divide(mass), y.divide(mass), z.divide(mass)]
            }
        };
        let ([a, b, c], [d, e, f]) = (axes.local(self.displacement), axes.local(force));
        [a, b, c, self.speed, d, e, f]
    }
}

/// How many vertices are free, and of how many of these the acceleration was clipped or an input is outside.
#[derive(Clone, Copy, Default)]
pub(super) struct Counts {
    free: f32,
    clipped: f32,
    outside: f32,
}

impl Counts {
    pub(super) fn of_all<'a>(parts: impl Iterator<Item = &'a Self>) -> Self {
        parts.fold(Self::default(), |sum, part| Self {
            free: sum.free + part.free,
            clipped: sum.clipped + part.clipped,
            outside: sum.outside + part.outside,
        })
    }

    pub(super) fn report(&self) -> LearnedReport {
        let free = self.free.max(1.0);
        LearnedReport { clipped: self.clipped / free, outside: self.outside / free }
    }
}

/// Frames, features, network: the next increment of vertices.
pub(super) struct Predict<'a, 'w> {
    pub(super) network: &'a Network<'w>,
    pub(super) step: &'a Step,
    pub(super) inertia: &'a [NodeInertia],
    pub(super) displacement: &'a [NodeVector],
    pub(super) increment: &'a [NodeVector],
    pub(super) force: &'a [NodeVector],
    pub(super) vertices: &'a mut [Vertex],
}

impl Predict<'_, '_> {
    /// Compiled with this crate, as it is not generic.
    #[inline(never)]
    pub(super) fn dispatched(self) -> (Totals, Counts) {
        dispatch(self)
    }
}

impl Kernel for Predict<'_, '_> {
    type Output = (Totals, Counts);

    const SCALAR: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> Self::Output {
        if R::MANY_REGISTERS { self.tiles::<R, 2>() } else { self.tiles::<R, 1>() }
    }
}

/// A vector of nodes, with what their step needs after the network.
#[derive(Clone, Copy)]
struct Moving<R> {
    axes: Axes<R>,
    /// Ones along free axes.
    free: [R; 3],
    mass: R,
    increment: [R; 3],
    force: [R; 3],
    /// One where an input is outside what training has seen.
    outside: R,
}

impl<R: Real> Moving<R> {
    #[inline(always)]
    fn empty() -> Self {
        let (zero, none) = (R::splat(0.0), [R::splat(0.0); 3]);
        Self { axes: Axes::of(|_| Frame::WORLD), free: none, mass: zero, increment: none, force: none, outside: zero }
    }
}

/// Vectorised sums over the nodes.
struct PredictionSums<R> {
    balance: [Sums<R>; 3],
    free: R,
    clipped: R,
    outside: R,
}

/// One where the two values are equal, else zero.
#[inline(always)]
fn same<R: Real>(a: R, b: R) -> R {
    (R::splat(f32::MIN_POSITIVE) - (a - b).abs()).positive()
}

/// The vectors of nodes from `first` on, zero where there are none.
#[inline(always)]
fn vectors<R: Real>(of: &[NodeVector], first: usize) -> [R; 3] {
    let [x, y, z, _] = R::from_rows(|lane| of.get(first + lane).copied().unwrap_or_default().0);
    [x, y, z]
}

impl Predict<'_, '_> {
    #[inline(always)]
    fn tiles<R: Real, const COLUMNS: usize>(mut self) -> (Totals, Counts) {
        let mut scratch = Scratch::<R, COLUMNS>::new();
        let zero = R::splat(0.0);
        let mut sums =
            PredictionSums { balance: [Sums::new(self.step, R::splat); 3], free: zero, clipped: zero, outside: zero };
        for first in (0..self.inertia.len()).step_by(COLUMNS * R::COUNT) {
            let mut inputs = [[zero; COLUMNS]; MAX_INPUTS];
            // Loops and functions, no closures over vectors: those may stay calls.
            let mut moving = [Moving::empty(); COLUMNS];
            for (column, moving) in moving.iter_mut().enumerate() {
                let features;
                (*moving, features) = self.see(first + column * R::COUNT);
                for (inputs, feature) in inputs.iter_mut().zip(features) {
                    inputs[column] = feature;
                }
            }
            let [clipped, unclipped] = self.network.forward(&inputs, &mut scratch);
            for (column, moving) in moving.iter().enumerate() {
                let (mut to, mut unclipped_to) = ([zero; 3], [zero; 3]);
                for (axis, (clipped, unclipped)) in clipped.iter().zip(&unclipped).enumerate().take(3) {
                    (to[axis], unclipped_to[axis]) = (clipped[column], unclipped[column]);
                }
                self.move_on(first + column * R::COUNT, moving, to, unclipped_to, &mut sums);
            }
        }
        let mut totals = Totals::default();
        totals.add_vectors(&sums.balance);
        let total = |counts: R| (0..R::COUNT).map(|lane| counts.lane(lane)).sum::<f32>();
        let counts = Counts { free: total(sums.free), clipped: total(sums.clipped), outside: total(sums.outside) };
        (totals, counts)
    }

    /// The nodes from `first` on, with what the network sees of them; where there are none, without mass or freedom.
    #[inline(always)]
    fn see<R: Real>(&self, first: usize) -> (Moving<R>, [R; FEATURES]) {
        let [ix, iy, iz, mass] = R::from_rows(|lane| {
            let NodeInertia { inverse: [x, y, z], mass } = self.inertia.get(first + lane).copied().unwrap_or_default();
            [x, y, z, mass]
        });
        let displacement = vectors::<R>(self.displacement, first);
        let (increment, force) = (vectors::<R>(self.increment, first), vectors::<R>(self.force, first));
        let mut axes = Axes::of(|lane| self.vertices.get(first + lane).map_or(Frame::WORLD, |vertex| vertex.frame));
        axes.follow(increment);
        let speed = dot(increment, increment).root().divide(R::splat(self.step.seconds()));
        let seen = VertexInput { displacement, speed, force, mass };
        let features = seen.features(&axes, self.network.recipe().force);
        let mut inside = R::splat(1.0);
        for (&value, range) in features.iter().zip(self.network.inputs()) {
            inside = inside * same(value, value.max(R::splat(range.least)).min(R::splat(range.most)));
        }
        let outside = R::splat(1.0) - inside;
        (
            Moving { axes, free: [ix.positive(), iy.positive(), iz.positive()], mass, increment, force, outside },
            features,
        )
    }

    /// Writes the next increments of these nodes, and adds them to the sums.
    #[inline(always)]
    fn move_on<R: Real>(
        &mut self,
        first: usize,
        moving: &Moving<R>,
        clipped: [R; 3],
        unclipped: [R; 3],
        sums: &mut PredictionSums<R>,
    ) {
        let Moving { axes, free, mass, increment, force, outside } = *moving;
        let square = R::splat(self.step.seconds() * self.step.seconds());
        let acceleration = axes.world(clipped);
        let mut next = [R::splat(0.0); 4];
        for axis in 0..3 {
            let (free, increment) = (free[axis], increment[axis]);
            next[axis] = free * (increment + square * acceleration[axis]);
            sums.balance[axis].add(mass, free, increment, force[axis], next[axis]);
        }
        axes.hand_to(|lane, frame| {
            if let Some(vertex) = self.vertices.get_mut(first + lane) {
                vertex.frame = frame;
            }
        });
        R::to_rows(next, |lane, next| {
            if let Some(vertex) = self.vertices.get_mut(first + lane) {
                vertex.next.0 = next;
            }
        });
        let any = free[0].max(free[1]).max(free[2]);
        let all = same(clipped[0], unclipped[0]) * same(clipped[1], unclipped[1]) * same(clipped[2], unclipped[2]);
        sums.free = sums.free + any;
        sums.clipped = sums.clipped + any * (R::splat(1.0) - all);
        sums.outside = sums.outside + any * outside;
    }
}
