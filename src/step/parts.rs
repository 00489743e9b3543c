//! The work of a step in parts that share nothing, one for each thread ([`crate::mesh::partition`], [`Threads`]): first
//! the total force on each node (N) and the sums over the nodes; when all parts have these, the moves of the nodes.

use core::array::from_fn;
use core::ops::Range;

use crate::element::{
    AddCrushed, CrushedElements, CrushedForces, ElementMaterial, Elements, Extended, Extremes, Fibrous, ForcesVisitor,
    InternalForces, Look, MARKED, Marks, MaybeBound, MeanPressure, NoExtension, NodalVolumes, NodeInertia, OwnPressure,
    PatchForces, Relaxing, Seen, Series, Turn, each_marked, extended_forces, extended_nodal_pressure_forces,
    extended_patch_forces, farthest, is_marked_at, mask_of, masks,
};
use crate::loads::{Loads, ramp_factor};
use crate::material::Material;
use crate::mesh::partition::{MAX_PARTITIONS, MOST_PARTS, Partitions};
use crate::scene::SceneView;
use crate::simd::{NodeVector, Scatter};
use crate::state::{Progress, copies_of};

use super::Trial;
use super::threads::{Threads, take};

/// All tiles are looked at within at most so many steps where threads share the work.
const FEW_STEPS: u8 = 4;

/// The input of the total forces.
pub(crate) struct Forcing<'a, M, V> {
    pub(crate) scene: SceneView<'a, M>,
    /// What is computed with the forces of each element.
    pub(crate) visitor: V,
    pub(crate) displacement: &'a [NodeVector],
    pub(crate) remainder: &'a [NodeVector],
    /// Whether forces need the remainders ([`super::heat`]).
    pub(crate) is_heated: bool,
    pub(crate) loads: &'a Loads<'a>,
    /// Of the state, for the time of the loads.
    pub(crate) progress: &'a Progress,
    /// How tissue relaxes, if it does, and what it remembers.
    pub(crate) series: Option<Series<'a>>,
    pub(crate) before: &'a [NodeVector],
    /// The latest increments, m, and this step over that of them.
    pub(crate) increment: &'a [NodeVector],
    pub(crate) pace: f32,
    /// Steps of this kind in which every element is looked at where some may be crushed ([`crate::element`]).
    pub(crate) look_cycle: u8,
}

impl<M: Material> Trial<'_, M> {
    /// The input of the total forces, the latest increments, and where to write volumes and forces.
    pub(crate) fn forcing<V>(&mut self, visitor: V, look_cycle: u8) -> TotalForces<'_, M, V> {
        let Self { scene, loads, displacement, remainder, is_heated, increment, force, volume, progress, .. } = self;
        let (scene, is_heated) = (*scene, *is_heated);
        let series = scene.series(self.halves, progress.steps);
        let [before, after] = copies_of(self.memory, progress);
        let (increment, pace) = (&**increment, self.pace);
        let forcing = Forcing {
            scene,
            visitor,
            displacement,
            remainder,
            is_heated,
            loads,
            progress,
            series,
            before,
            increment,
            pace,
            look_cycle,
        };
        TotalForces { forcing, increment, volume, force, after }
    }
}

/// See [`Trial::forcing`].
pub(crate) struct TotalForces<'a, M, V> {
    pub(crate) forcing: Forcing<'a, M, V>,
    pub(crate) increment: &'a [NodeVector],
    pub(crate) volume: &'a mut [NodeVector],
    pub(crate) force: &'a mut [NodeVector],
    /// What tissue remembers after the step.
    pub(crate) after: &'a mut [NodeVector],
}

/// The partitions of one thread, with their share of the arrays.
struct Part<'a, T, F> {
    partitions: Range<usize>,
    force: &'a mut [NodeVector],
    extra: &'a mut [T],
    results: &'a mut [F],
    /// What the tissue of its tiles remembers after the step, and the first of these.
    after: &'a mut [NodeVector],
    own: usize,
    extremes: Extremes<f32>,
}

/// Volume ratios of all nodes for materials with nodal pressure ([`NodalVolumes`]); nothing for others.
pub(crate) fn nodal_volumes<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    displacement: &[NodeVector],
    remainder: &[NodeVector],
    mut volumes: &mut [NodeVector],
    threads: &impl Threads,
) {
    if !scene.element().is_nodal_pressure() {
        return;
    }
    let elements = scene.elements();
    let (all, tiles, inertia) = (elements.partitions, elements.tiles, scene.inertia);
    let several_tissues = elements.laws.has_several_tissues();
    let from_masses = !several_tissues && !scene.has_point_masses();
    let density = if from_masses { scene.material.tissue(0).map(|tissue| tissue.density) } else { None };
    let count = all.parts(threads.parts());
    let mut parts: [_; MOST_PARTS] = from_fn(|part| {
        let mine = all.part(part, count);
        let rows = take(&mut volumes, all.nodes(&mine).len());
        (mine, rows)
    });
    threads.each(parts.get_mut(..count).unwrap_or_default(), |(mine, rows)| {
        let partitions = mine.clone();
        NodalVolumes { tiles, all, partitions, several_tissues, density, inertia, displacement, remainder, rows }
            .compute();
    });
}

impl<M: ElementMaterial, V: ForcesVisitor<M::Law>> Forcing<'_, M, V> {
    /// Displacements and their remainders; none of these if they are not needed.
    fn moved(&self) -> [&[NodeVector]; 2] {
        [self.displacement, if self.is_heated { self.remainder } else { &[] }]
    }

    /// Total forces, with the nodes' [`nodal_volumes`] where the material needs them, and for each partition the result
    /// of `then` from its nodes, their forces and their entries of `extra`, an array that the step keeps for the nodes.
    pub(crate) fn in_parts<T: Send, F: Copy + Default + Send>(
        &self,
        volumes: &mut [NodeVector],
        mut force: &mut [NodeVector],
        mut extra: &mut [T],
        mut after: &mut [NodeVector],
        threads: &impl Threads,
        then: impl Fn(Range<usize>, &[NodeVector], &mut [T]) -> F + Sync,
    ) -> ([F; MAX_PARTITIONS], Extremes<f32>) {
        let [displacement, remainder] = self.moved();
        nodal_volumes(self.scene, displacement, remainder, volumes, threads);
        let looked = self.look(volumes, threads);
        let volumes = &*volumes;
        let partitions = self.scene.elements().partitions;
        let count = partitions.parts(threads.parts());
        let mut results = [F::default(); MAX_PARTITIONS];
        let mut rest = &mut results[..];
        let mut parts: [_; MOST_PARTS] = from_fn(|part| {
            let mine = partitions.part(part, count);
            let nodes = partitions.nodes(&mine).len();
            let (force, extra) = (take(&mut force, nodes), take(&mut extra, nodes));
            let results = take(&mut rest, mine.len());
            let tiles = self.scene.relaxing_tiles_of(&mine);
            let (own, after) = (tiles.start, take(&mut after, tiles.len() * self.scene.vectors_of_tile()));
            Part { partitions: mine, force, extra, results, after, own, extremes: Extremes::none() }
        });
        let parts = parts.get_mut(..count).unwrap_or_default();
        threads.each(parts, |part| self.compute(part, volumes, &then));
        let mut extremes: Extremes<f32> =
            parts.iter().fold(Extremes::none(), |sum, part| sum.merged_with(&part.extremes));
        extremes.least_change = extremes.least_change.min(looked);
        (results, extremes)
    }

    /// Looks which elements with nodal strain are crushed: at those whose turn it is, or at all if the marks of the
    /// state are not of this moment. Gives the least `J - 1` of those that were looked at.
    fn look(&self, vectors: &mut [NodeVector], threads: &impl Threads) -> f32 {
        if !self.scene.element().is_nodal_strain() {
            return f32::INFINITY;
        }
        let (is_marked, step) = (is_marked_at(vectors, &self.progress.moment()), self.progress.steps);
        let marks = Marks::of(vectors, self.scene.tiles.len());
        let mut hurry = marks.hurry.at(step, self.look_cycle);
        let is_much_faster = hurry.is_much_faster(self.pace * farthest(self.increment), self.scene.tiles);
        let whole = is_much_faster || !is_marked;
        let turn =
            Turn { now: step as u8, whole, within: hurry.within, cycle: self.look_cycle, pace: self.pace, first: 0 };
        let moved = [self.displacement, self.increment];
        let seen = look(self.scene, moved, turn, marks, threads);
        let is_fast = hurry.enter(seen.rate, step);
        hurry.keep(vectors);
        if is_fast {
            for turn in Marks::of(vectors, self.scene.tiles.len()).next {
                *turn = (step as u8).wrapping_add(turn.wrapping_sub(step as u8).min(hurry.within));
            }
        }
        seen.least_change
    }

    fn compute<T, F>(
        &self,
        part: &mut Part<'_, T, F>,
        volumes: &[NodeVector],
        then: &impl Fn(Range<usize>, &[NodeVector], &mut [T]) -> F,
    ) {
        let Part { partitions, force, extra, results, after, own, extremes } = part;
        let elements = self.scene.elements();
        let all = elements.partitions;
        let nodes = all.nodes(partitions);
        let inertia = self.scene.inertia.get(nodes.clone()).unwrap_or_default();
        external_forces(force, nodes.start, inertia, self.loads, self.progress.time);
        if let Some(pressure) = self.loads.pressure() {
            pressure.add_forces(self.progress.time, self.displacement, nodes.start, force);
        }
        let past = self.series.map(|series| (series, self.before, &mut **after, *own));
        *extremes = internal_forces(self.scene, partitions.clone(), self.moved(), volumes, force, self.visitor, past);
        let (mut force, mut extra) = (&mut **force, &mut **extra);
        for (partition, result) in partitions.clone().zip(&mut **results) {
            let nodes = all.nodes(&(partition..partition + 1));
            let count = nodes.len();
            *result = then(nodes, take(&mut force, count), take(&mut extra, count));
        }
    }
}

/// The [`nodal_volumes`], and where the material needs them the marks of all crushed elements.
pub(crate) fn write_volumes<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    displacement: &[NodeVector],
    volumes: &mut [NodeVector],
    threads: &impl Threads,
) {
    nodal_volumes(scene, displacement, &[], volumes, threads);
    if scene.element().is_nodal_strain() {
        let marks = Marks::of(volumes, scene.tiles.len());
        look(scene, [displacement, &[]], Turn::ALL, marks, threads);
    }
}

/// Looks which elements are crushed, at the tiles whose turn it is, and writes their marks.
fn look<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    [displacement, increment]: [&[NodeVector]; 2],
    turn: Turn,
    marks: Marks<'_>,
    threads: &impl Threads,
) -> Seen<f32> {
    let Marks { mut masks, turns, mut next, .. } = marks;
    let turns = &*turns;
    next.iter_mut().zip(turns).for_each(|(next, turn)| *next = *turn);
    let partitions = scene.elements().partitions;
    // Of a few tiles there is too little for threads.
    let count = partitions.parts(if turn.whole || turn.within <= FEW_STEPS { threads.parts() } else { 1 });
    let mut parts: [_; MOST_PARTS] = from_fn(|part| {
        let own = partitions.tiles_of(&partitions.part(part, count));
        let (masks, next) = (take(&mut masks, own.len()), take(&mut next, own.len()));
        (own, masks, next, Seen::nothing())
    });
    let see = |(own, masks, next, seen): &mut (Range<usize>, &mut [u16], &mut [u8], Seen<f32>)| {
        let (turn, tiles) = (Turn { first: own.start, ..turn }, scene.tiles.get(own.clone()).unwrap_or_default());
        let turns = turns.get(own.clone()).unwrap_or_default();
        *seen = Look { tiles, displacement, increment, below: MARKED, turn, masks, turns, next }.see();
    };
    match parts.get_mut(..count).unwrap_or_default() {
        [one] => see(one),
        several => threads.each(several, see),
    }
    parts.iter().fold(Seen::nothing(), |sum, (.., seen)| sum.merged_with(*seen))
}

/// Adds the forces of crushed elements to the nodes in `partitions`, from the marks of the state. Gives their least
/// `J - 1`. Not inlined: its stack is not that of the other kernels.
#[inline(never)]
fn crushed_forces<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    partitions: Range<usize>,
    displacement: &[NodeVector],
    marks: &[NodeVector],
    force: &mut [NodeVector],
    bounds: bool,
) -> f32 {
    let Elements { laws, tiles, partitions: all } = scene.elements();
    let (masks, first) = (masks(marks, tiles.len()), all.nodes(&partitions).start);
    let mut elements = CrushedElements::of(laws, tiles);
    let mut sum = AddCrushed { displacement, bounds, first, force, least_change: f32::INFINITY };
    let mut forces = CrushedForces::NONE;
    let mut add = |crushed: &_| sum.add(crushed, &mut forces);
    for touching in all.tiles_touching(partitions) {
        if let Some(masks) = masks.get(touching.clone()) {
            each_marked(masks, touching.start, |place| elements.enter(place, &mut add));
            continue;
        }
        for index in touching {
            let mask = tiles.get(index).map_or(0, |tile| mask_of(tile, displacement, MARKED));
            each_marked(&[mask], index, |place| elements.enter(place, &mut add));
        }
    }
    elements.end(add);
    sum.least_change
}

/// What relaxes, what it remembers, and where that is written after the step, from a tile on.
type PastOfPart<'a> = (Series<'a>, &'a [NodeVector], &'a mut [NodeVector], usize);

/// Adds internal forces to those of the nodes in `partitions`, from displacements and their remainders, and from the
/// [`nodal_volumes`] where the material needs them, or the marks of crushed elements; without a past
/// of tissue that has not relaxed.
pub(crate) fn internal_forces<M: ElementMaterial, V: ForcesVisitor<M::Law>>(
    scene: SceneView<'_, M>,
    partitions: Range<usize>,
    moved: [&[NodeVector]; 2],
    volumes: &[NodeVector],
    force: &mut [NodeVector],
    visitor: V,
    past: Option<PastOfPart<'_>>,
) -> Extremes<f32> {
    // Seen by the compiler, which then leaves these kernels out where no tissue can relax or has fibres.
    let (fibres, past) = (scene.fibrous(), past.filter(|_| scene.vectors_of_tile() > 0));
    let bounds = MaybeBound(visitor.bounds());
    let mut extremes = if fibres.is_some() || past.is_some() {
        let extension = (fibres, past);
        forces_with_extension(scene, partitions.clone(), moved, volumes, force, bounds, extension)
    } else if scene.element().is_nodal_strain() {
        V::patch_forces(patch_kernel(scene, partitions.clone(), moved, force, visitor))
    } else {
        let (elements, of) = (scene.elements(), partitions.clone());
        if scene.element().is_nodal_pressure() {
            let pressure = MeanPressure::new(scene.volume_rows(volumes));
            V::nodal_pressure_forces(InternalForces::of_partitions(elements, pressure, of, moved, force, visitor))
        } else {
            V::forces(InternalForces::of_partitions(elements, OwnPressure, of, moved, force, visitor))
        }
    };
    if scene.element().is_nodal_strain() {
        let [displacement, _] = moved;
        let least = crushed_forces(scene, partitions, displacement, volumes, force, bounds.0);
        extremes.least_change = extremes.least_change.min(least);
    }
    extremes
}

/// The forces of patches.
fn patch_kernel<'a, M: ElementMaterial, V>(
    scene: SceneView<'a, M>,
    partitions: Range<usize>,
    [displacement, remainder]: [&'a [NodeVector]; 2],
    force: &'a mut [NodeVector],
    visitor: V,
) -> PatchForces<'a, M::Law, V> {
    let Elements { laws, partitions: all, .. } = scene.elements();
    let force = Scatter::from(all.nodes(&partitions).start, force);
    let (patches, extension) = (scene.patches, NoExtension);
    PatchForces { laws, patches, partitions, displacement, remainder, force, visitor, extension }
}

/// The same of tissue with fibres or that relaxes, without the forces of crushed elements. Not inlined: only such tissue
/// has this stack.
#[inline(never)]
fn forces_with_extension<M: ElementMaterial>(
    scene: SceneView<'_, M>,
    partitions: Range<usize>,
    moved: [&[NodeVector]; 2],
    volumes: &[NodeVector],
    force: &mut [NodeVector],
    bounds: MaybeBound,
    (fibres, past): (Option<Fibrous<'_>>, Option<PastOfPart<'_>>),
) -> Extremes<f32> {
    if scene.element().is_nodal_strain() {
        let extension = extension_of(scene.patches.tiles(), fibres, past);
        return extended_patch_forces(patch_kernel(scene, partitions, moved, force, bounds).with_extension(extension));
    }
    let (elements, extension) = (scene.elements(), extension_of(scene.tiles, fibres, past));
    if scene.element().is_nodal_pressure() {
        let pressure = MeanPressure::new(scene.volume_rows(volumes));
        let kernel = InternalForces::of_partitions(elements, pressure, partitions, moved, force, bounds);
        extended_nodal_pressure_forces(kernel.with_extension(extension))
    } else {
        let kernel = InternalForces::of_partitions(elements, OwnPressure, partitions, moved, force, bounds);
        extended_forces(kernel.with_extension(extension))
    }
}

fn extension_of<'a, T>(table: &[T], fibres: Option<Fibrous<'a>>, past: Option<PastOfPart<'a>>) -> Extended<'a> {
    let relaxing = past.map(|(series, before, after, own)| Relaxing::new(series, table, before, after, own));
    Extended::new(table, fibres, relaxing)
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

/// The vectors of nodes that a step moves.
pub(crate) struct Moving<'a> {
    pub(crate) displacement: &'a mut [NodeVector],
    /// See [`super::moved`].
    pub(crate) remainder: &'a mut [NodeVector],
    pub(crate) increment: &'a mut [NodeVector],
}

/// Calls `advance` with the node range and the vectors of each part.
pub(crate) fn move_in_parts(
    partitions: &Partitions,
    moving: Moving<'_>,
    threads: &impl Threads,
    advance: impl Fn(Range<usize>, Moving<'_>) + Sync,
) {
    let Moving { mut displacement, mut remainder, mut increment } = moving;
    let count = partitions.parts(threads.parts());
    let mut parts: [_; MOST_PARTS] = from_fn(|part| {
        let nodes = partitions.nodes(&partitions.part(part, count));
        let count = nodes.len();
        (nodes, [&mut displacement, &mut remainder, &mut increment].map(|vectors| take(vectors, count)))
    });
    threads.each(parts.get_mut(..count).unwrap_or_default(), |(nodes, [displacement, remainder, increment])| {
        advance(nodes.clone(), Moving { displacement, remainder, increment });
    });
}

#[cfg(test)]
mod tests {
    use std::{println, vec, vec::Vec};

    use super::*;
    use crate::element::NoVisitor;
    use crate::material::Exponential;
    use crate::mesh::Bar;
    use crate::scene::test_scene::scene_of;
    use crate::simd::{Baseline, Kernel};

    fn bits(vectors: &[NodeVector]) -> Vec<[u32; 4]> {
        vectors.iter().map(|vector| vector.0.map(f32::to_bits)).collect()
    }

    /// The same sums in the same order, on strips of every length, and where a node's elements are of several threads.
    #[test]
    fn scalars_give_the_bits_of_vectors_of_eight() {
        let law = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
        let (points, scene) = scene_of(law, Bar { size: [0.05, 0.04, 0.2], cells: [7, 5, 28] });
        let bent: Vec<_> = points
            .iter()
            .map(|&[x, y, z]| NodeVector([0.3 * z * z + 0.1 * y, 0.2 * x - 0.1 * y, 0.4 * x * z, 0.0]))
            .collect();
        let scene = scene.view();
        let elements = scene.elements();
        let lengths: Vec<_> =
            elements.partitions.touching(elements.partitions.all()).map(|(_, length)| length).collect();
        assert!((1..=3).all(|length| lengths.contains(&length)));
        for parts in 1..=3 {
            for part in 0..parts {
                let mine = elements.partitions.part(part, elements.partitions.parts(parts));
                let count = elements.partitions.nodes(&mine).len();
                let (mut one, mut eight) = (vec![NodeVector::ZERO; count], vec![NodeVector::ZERO; count]);
                let of = |force| {
                    InternalForces::of_partitions(elements, OwnPressure, mine.clone(), [&bent, &[]], force, NoVisitor)
                };
                let (by_one, by_eight) = (of(&mut one).run_scalar(), of(&mut eight).run::<Baseline>());
                assert!(eight.iter().any(|force| force.0[2] != 0.0));
                assert_eq!(bits(&one), bits(&eight), "part {part} of {parts}");
                assert_eq!(by_one.least_change.to_bits(), by_eight.least_change.to_bits());
                println!("part {part} of {parts}: {count} nodes, least J - 1 {:.3}", by_one.least_change);
            }
        }
    }
}
