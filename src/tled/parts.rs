//! The work of a step over elements and nodes, in parts that share nothing ([`crate::chunks`], [`crate::threads`]): first the
//! total force on each node (N) and what a step makes of it, and when all parts have that, the nodes' moves.

use core::array::from_fn;
use core::ops::Range;

use crate::chunks::{Chunks, MAX_CHUNKS};
use crate::lanes::{Gather, Kernel, Pair, Real, Scatter};
use crate::loads::{Loads, ramp_factor};
use crate::material::{Law, Material};
use crate::scene::{ElementBlock, Elements, NodeInertia, Scene};
use crate::state::NodeVector;
use crate::threads::{MOST_PARTS, Threads, take};

use super::element::{Beside, Extremes, Nothing, add_forces};

/// Adds internal forces, element by element in their order.
pub struct InternalForces<'a, L, H> {
    elements: Elements<'a, L>,
    /// Of the nodes in these chunks.
    chunks: Range<usize>,
    displacement: Gather<'a>,
    force: Scatter<'a>,
    beside: H,
}

impl<'a, L: Law, H> InternalForces<'a, L, H> {
    /// Of all nodes of a scene.
    pub(crate) fn of<M, N, B>(
        scene: &'a Scene<M, N, B>,
        displacement: &'a [NodeVector],
        force: &'a mut [NodeVector],
        beside: H,
    ) -> Self
    where
        M: Material<Law = L>,
        N: AsRef<[NodeInertia]>,
        B: AsRef<[ElementBlock]>,
    {
        let elements = scene.elements();
        Self::of_chunks(elements, elements.chunks.all(), displacement, force, beside)
    }

    /// Of the nodes in chunks, on which the forces are `force`.
    fn of_chunks(
        elements: Elements<'a, L>,
        chunks: Range<usize>,
        displacement: &'a [NodeVector],
        force: &'a mut [NodeVector],
        beside: H,
    ) -> Self {
        let force = Scatter::from(elements.chunks.nodes(&chunks).start, force);
        Self { elements, chunks, displacement: Gather::new(displacement), force, beside }
    }
}

impl<L: Law, H: Beside> Kernel for InternalForces<'_, L, H> {
    type Output = Extremes<f32>;

    const ONE_BY_ONE: bool = true;

    #[inline(always)]
    fn run<R: Real>(self) -> Extremes<f32> {
        let Self { elements: Elements { laws, blocks, chunks: all }, chunks, displacement, .. } = self;
        let (mut force, mut beside) = (self.force, self.beside);
        let mut extremes = Extremes::<Pair<R>>::none();
        for (touching, length) in all.touching(chunks) {
            let blocks = (blocks.get(touching).unwrap_or_default(), length);
            add_forces::<R, L>(&laws, blocks, displacement, &mut force, &mut beside, &mut extremes);
        }
        Extremes::none().with_lanes(&extremes)
    }
}

/// What total forces depend on.
#[derive(Clone, Copy)]
pub(crate) struct Forcing<'a, L> {
    pub(crate) elements: Elements<'a, L>,
    pub(crate) inertia: &'a [NodeInertia],
    pub(crate) displacement: &'a [NodeVector],
    pub(crate) loads: &'a Loads<'a>,
    /// Of the loads, s.
    pub(crate) time: f64,
}

/// Some of a scene's chunks, for one thread.
struct Part<'a, T, F> {
    chunks: Range<usize>,
    force: &'a mut [NodeVector],
    own: &'a mut [T],
    found: &'a mut [F],
    extremes: Extremes<f32>,
}

impl<L: Law> Forcing<'_, L> {
    /// Total forces, and what `then` finds in each chunk from the numbers of its nodes, their forces and what else a step
    /// has of its `own` for each node.
    pub(crate) fn in_parts<T: Send, F: Copy + Default + Send>(
        &self,
        mut force: &mut [NodeVector],
        mut own: &mut [T],
        threads: &impl Threads,
        then: impl Fn(Range<usize>, &[NodeVector], &mut [T]) -> F + Sync,
    ) -> ([F; MAX_CHUNKS], Extremes<f32>) {
        let chunks = self.elements.chunks;
        let count = chunks.parts(threads.parts());
        let mut found = [F::default(); MAX_CHUNKS];
        let mut finds = &mut found[..];
        let mut parts: [_; MOST_PARTS] = from_fn(|part| {
            let mine = chunks.part(part, count);
            let nodes = chunks.nodes(&mine).len();
            let (force, own) = (take(&mut force, nodes), take(&mut own, nodes));
            let found = take(&mut finds, mine.len());
            Part { chunks: mine, force, own, found, extremes: Extremes::none() }
        });
        let parts = parts.get_mut(..count).unwrap_or_default();
        threads.each(parts, |part| self.compute(part, &then));
        let extremes = parts.iter().fold(Extremes::none(), |sum, part| sum.with_lanes(&part.extremes));
        (found, extremes)
    }

    fn compute<T, F>(
        &self,
        part: &mut Part<'_, T, F>,
        then: &impl Fn(Range<usize>, &[NodeVector], &mut [T]) -> F,
    ) {
        let Part { chunks, force, own, found, extremes } = part;
        let all = self.elements.chunks;
        let nodes = all.nodes(chunks);
        let inertia = self.inertia.get(nodes.clone()).unwrap_or_default();
        external_forces(force, nodes.start, inertia, self.loads, self.time);
        let (elements, displacement) = (self.elements, self.displacement);
        let mine = chunks.clone();
        *extremes = L::forces(InternalForces::of_chunks(elements, mine, displacement, force, Nothing));
        let (mut force, mut own) = (&mut **force, &mut **own);
        for (chunk, found) in chunks.clone().zip(&mut **found) {
            let nodes = all.nodes(&(chunk..chunk + 1));
            let count = nodes.len();
            *found = then(nodes, take(&mut force, count), take(&mut own, count));
        }
    }
}

/// Gravity and nodal forces on the nodes from `first` on, N.
pub(crate) fn external_forces(
    force: &mut [NodeVector],
    first: usize,
    inertia: &[NodeInertia],
    loads: &Loads<'_>,
    time: f64,
) {
    let [gx, gy, gz] = loads.gravity();
    if loads.gravity() == [0.0; 3] {
        force.fill(NodeVector::ZERO);
    } else {
        for (vector, inertia) in force.iter_mut().zip(inertia) {
            vector.0 = [gx, gy, gz, 0.0].map(|component| component * inertia.mass);
        }
    }
    for load in loads.forces() {
        let factor = ramp_factor(time, load.ramp);
        if let Some(vector) = force.get_mut((load.node as usize).wrapping_sub(first)) {
            for (sum, newton) in vector.0.iter_mut().zip(load.newton) {
                *sum += factor * newton;
            }
        }
    }
}

/// Has `moved` move the nodes of each part, whose numbers, displacements and increments it gets.
pub(crate) fn move_in_parts(
    chunks: &Chunks,
    mut displacement: &mut [NodeVector],
    mut increment: &mut [NodeVector],
    threads: &impl Threads,
    moved: impl Fn(Range<usize>, &mut [NodeVector], &mut [NodeVector]) + Sync,
) {
    let count = chunks.parts(threads.parts());
    let mut parts: [_; MOST_PARTS] = from_fn(|part| {
        let nodes = chunks.nodes(&chunks.part(part, count));
        let count = nodes.len();
        (nodes, take(&mut displacement, count), take(&mut increment, count))
    });
    threads.each(parts.get_mut(..count).unwrap_or_default(), |(nodes, displacement, increment)| {
        moved(nodes.clone(), displacement, increment);
    });
}

#[cfg(test)]
mod tests {
    use std::{println, vec, vec::Vec};

    use super::*;
    use crate::lanes::Lanes;
    use crate::material::Exponential;
    use crate::mesh::Bar;
    use crate::tled::test_scene::scene_of;

    fn bits(vectors: &[NodeVector]) -> Vec<[u32; 4]> {
        vectors.iter().map(|vector| vector.0.map(f32::to_bits)).collect()
    }

    /// The same sums in the same order, on chains of every length, and where a node's elements are of several threads.
    #[test]
    fn numbers_one_by_one_give_the_bits_of_eight_side_by_side() {
        let law = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
        let (points, scene) = scene_of(law, Bar { size: [0.05, 0.04, 0.2], cells: [7, 5, 28] });
        let bent: Vec<_> = points
            .iter()
            .map(|&[x, y, z]| NodeVector([0.3 * z * z + 0.1 * y, 0.2 * x - 0.1 * y, 0.4 * x * z, 0.0]))
            .collect();
        let elements = scene.elements();
        let lengths: Vec<_> =
            elements.chunks.touching(elements.chunks.all()).map(|(_, length)| length).collect();
        assert!((1..=3).all(|length| lengths.contains(&length)));
        for parts in 1..=3 {
            for part in 0..parts {
                let mine = elements.chunks.part(part, elements.chunks.parts(parts));
                let count = elements.chunks.nodes(&mine).len();
                let (mut one, mut eight) = (vec![NodeVector::ZERO; count], vec![NodeVector::ZERO; count]);
                let of = |force| InternalForces::of_chunks(elements, mine.clone(), &bent, force, Nothing);
                let (by_one, by_eight) = (of(&mut one).run::<f32>(), of(&mut eight).run::<Lanes<8>>());
                assert!(eight.iter().any(|force| force.0[2] != 0.0));
                assert_eq!(bits(&one), bits(&eight), "part {part} of {parts}");
                assert_eq!(by_one.least_j.to_bits(), by_eight.least_j.to_bits());
                println!("part {part} of {parts}: {count} nodes, least J - 1 {:.3}", by_one.least_j);
            }
        }
    }
}
