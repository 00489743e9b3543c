//! The data set: what the exact step does over each `D`, as each vertex sees it in its frame (Meister et al. 2018,
//! section 2).
//!
//! ```text
//! at t: u(t), |u(t) - u(t-D)| / D, f_e - K u;   target (u(t+D) - 2 u(t) + u(t-D)) / D^2
//! ```
//! Copies of each frame in rough motion may be added, see [`super::noise`].
//!
//! Vertices that are held are left out, and such as are loaded alone, as in the paper: boundary conditions make them
//! jump. Loaded vertices that share elements, as those of a traction, are sampled: they move on as the others do, and
//! may be many. Local frames follow the motion once each `D`, as they do in a roll-out; where the paper's samples lie
//! closer than `D`, several sequences of local frames are kept at the same time, each with its own start.

use core::array::from_fn;
use std::format;
use std::string::ToString;
use std::vec;
use std::vec::Vec;

use glam::{DVec3, Vec3A};

use super::noise::{Moment, MovedCopy, SeenAs};
use super::random_numbers::Random;
use super::recipe::{MotionRecipe, Recipe};
use super::{TrainError, TrainingScene};
use crate::learned::frame::Frame;
use crate::learned::{FEATURES, PREDICTED};
use crate::material::VecMaterial;
use crate::mlp::Range;
use crate::scene::SceneView;
use crate::state::{NodeVector, VecState};
use crate::step::{Status, Step};
use crate::tled;

/// What vertices saw and did, frame by frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Displacement (m), speed (m/s) and force (N, or m/s^2) in the local frame.
    pub inputs: Vec<[f32; FEATURES]>,
    /// Acceleration over the step, m/s^2, in the local frame.
    pub targets: Vec<[f32; PREDICTED]>,
    /// Vertices of each frame.
    pub vertices: usize,
    /// Copies of the frames in rough motion, as many of each.
    pub rough: Rough,
}

/// What vertices see of rough motion, and the accelerations that return to the exact one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rough {
    /// As in [`Samples`].
    pub inputs: Vec<[f32; FEATURES]>,
    /// As in [`Samples`].
    pub targets: Vec<[f32; PREDICTED]>,
    /// Of each sample in the loss.
    pub weights: Vec<f32>,
}

impl Samples {
    /// Simulates the recipe's motions, those of `scenes`, and samples them: motions of one body, sampled at as many
    /// vertices.
    pub fn collect(recipe: &Recipe, scenes: &[&dyn TrainingScene]) -> Result<Self, TrainError> {
        let facts = |scene: &dyn TrainingScene| (scene.tissue(), scene.element(), scene.damping(), scene.step());
        let mut all = Self::default();
        for (number, (motion, scene)) in recipe.motion.iter().zip(scenes).enumerate() {
            let other = || {
                let must = "tissue, tetrahedra, damping, step or vertices are not those of the first motion";
                Err(TrainError::refused("scene", format!("{:?}", motion.scene), must))
            };
            // Before any time is spent on it.
            if facts(*scene) != facts(scenes[0]) {
                return other();
            }
            let seed = recipe.seed.wrapping_add(number as u64);
            let one = collect(*scene, recipe, motion, &mut Random(seed))?;
            if number > 0 && one.vertices != all.vertices {
                return other();
            }
            all.add(one);
        }
        Ok(all)
    }

    /// Further frames of as many vertices.
    fn add(&mut self, more: Self) {
        self.inputs.extend(more.inputs);
        self.targets.extend(more.targets);
        self.vertices = more.vertices;
        self.rough.inputs.extend(more.rough.inputs);
        self.rough.targets.extend(more.rough.targets);
        self.rough.weights.extend(more.rough.weights);
    }

    /// Those of some frames.
    #[must_use]
    pub fn of_frames(&self, wanted: impl Fn(usize) -> bool) -> Self {
        let mut some = Self { vertices: self.vertices, ..Self::default() };
        let each = self.inputs.chunks(self.vertices).zip(self.targets.chunks(self.vertices)).enumerate();
        for (_, (inputs, targets)) in each.filter(|(frame, _)| wanted(*frame)) {
            some.inputs.extend_from_slice(inputs);
            some.targets.extend_from_slice(targets);
        }
        let frames = self.inputs.len() / self.vertices.max(1);
        let copies = self.rough.inputs.len() / frames.max(1);
        for frame in (0..frames).filter(|&frame| copies > 0 && wanted(frame)) {
            let rows = frame * copies..(frame + 1) * copies;
            some.rough.inputs.extend_from_slice(&self.rough.inputs[rows.clone()]);
            some.rough.targets.extend_from_slice(&self.rough.targets[rows.clone()]);
            some.rough.weights.extend_from_slice(&self.rough.weights[rows]);
        }
        some
    }

    /// Standard deviation and range of each input, then of each target.
    #[must_use]
    pub fn ranges(&self) -> (Vec<Range>, Vec<Range>) {
        let (mut inputs, mut targets) = (ranges(&self.inputs), ranges(&self.targets));
        widen(&mut inputs, &self.rough.inputs);
        widen(&mut targets, &self.rough.targets);
        (inputs, targets)
    }

    /// Turns the normal of each sample about its tangent by a random angle.
    fn turn_normals(&mut self, random: &mut Random) {
        for (inputs, targets) in self.inputs.iter_mut().zip(&mut self.targets) {
            turn_normal(inputs, targets, random);
        }
        for (inputs, targets) in self.rough.inputs.iter_mut().zip(&mut self.rough.targets) {
            turn_normal(inputs, targets, random);
        }
    }
}

fn ranges<const N: usize>(rows: &[[f32; N]]) -> Vec<Range> {
    let count = rows.len().max(1) as f64;
    (0..N)
        .map(|column| {
            let values = || rows.iter().map(|row| row[column]);
            let mean = values().map(f64::from).sum::<f64>() / count;
            let square = values().map(|value| (f64::from(value) - mean).powi(2)).sum::<f64>() / count;
            let scale = square.sqrt() as f32;
            Range {
                // What never varies says nothing, at any scale.
                scale: if scale > 0.0 { scale } else { 1.0 },
                least: values().fold(f32::INFINITY, f32::min),
                most: values().fold(f32::NEG_INFINITY, f32::max),
            }
        })
        .collect()
}

fn widen<const N: usize>(ranges: &mut [Range], rows: &[[f32; N]]) {
    for row in rows {
        for (range, &value) in ranges.iter_mut().zip(row) {
            range.least = range.least.min(value);
            range.most = range.most.max(value);
        }
    }
}

fn turn_normal(inputs: &mut [f32; FEATURES], targets: &mut [f32; PREDICTED], random: &mut Random) {
    let (sin, cos) = (core::f64::consts::TAU * random.unit()).sin_cos();
    let (sin, cos) = (sin as f32, cos as f32);
    let turned = |normal: f32, binormal: f32| (cos * normal + sin * binormal, cos * binormal - sin * normal);
    (inputs[1], inputs[2]) = turned(inputs[1], inputs[2]);
    (inputs[5], inputs[6]) = turned(inputs[5], inputs[6]);
    (targets[1], targets[2]) = turned(targets[1], targets[2]);
}

/// When samples are taken, counted in exact steps.
struct Schedule {
    /// Exact steps in `D`.
    every: u64,
    /// Sequences of local frames.
    sequences: u64,
    /// Of the first sampled frame, and from each to the next.
    first: u64,
    spacing: f64,
    frames: usize,
    /// Of the last target.
    last: u64,
}

impl Schedule {
    fn of(motion: &MotionRecipe, multiple: u32, dt: f64) -> Self {
        let every = u64::from(multiple);
        let span = motion.to - motion.from;
        let long = every as f64 * dt;
        Self {
            every,
            sequences: ((motion.frames as f64 * long / span).ceil() as u64).clamp(1, every),
            first: (motion.from / dt).round() as u64,
            spacing: span / motion.frames as f64 / dt,
            frames: motion.frames,
            last: (motion.to / dt).round() as u64 + every,
        }
    }

    /// Whether the frame is to be sampled at the moment before this step. Moments are those nearest to equal intervals.
    fn is_due(&self, frame: usize, step: u64) -> bool {
        step >= self.first && frame < self.frames && (step - self.first) as f64 >= (frame as f64 - 0.5) * self.spacing
    }
}

/// Of the vertices those that may move, and of these the sampled ones.
fn free_and_sampled(exemplar: &dyn TrainingScene, scene: SceneView<'_, VecMaterial>) -> (Vec<bool>, Vec<usize>) {
    let marked = |nodes: &mut dyn Iterator<Item = u32>| {
        let mut marks = vec![false; scene.node_count()];
        for node in nodes {
            if let Some(mark) = marks.get_mut(node as usize) {
                *mark = true;
            }
        }
        marks
    };
    let held = marked(&mut exemplar.supports().iter().map(|support| support.node));
    let loaded = marked(&mut exemplar.forces().iter().map(|force| force.node));
    let mut neighbours = vec![false; loaded.len()];
    for (tile, lane) in scene.places() {
        let corners: [usize; 4] = from_fn(|corner| tile.node(corner, lane));
        if corners.iter().filter(|&&node| loaded[node]).count() > 1 {
            corners.iter().for_each(|&node| neighbours[node] = true);
        }
    }
    let sampled = (0..loaded.len()).filter(|&node| !held[node] && (!loaded[node] || neighbours[node]));
    let sampled = sampled.collect();
    (held.into_iter().map(|held| !held).collect(), sampled)
}

fn collect(
    exemplar: &dyn TrainingScene,
    recipe: &Recipe,
    motion: &MotionRecipe,
    random: &mut Random,
) -> Result<Samples, TrainError> {
    let scene = exemplar.build()?;
    let (seconds, dt) = (exemplar.step(), f64::from(exemplar.step()));
    let step = Step::unchecked(seconds, exemplar.damping());
    let step = step.map_err(|error| TrainError::Scene(error.to_string()))?;
    let nodes = scene.node_count();
    let mut state = VecState::at_rest(nodes);
    let (free, sampled) = free_and_sampled(exemplar, scene.view());
    let masses: Vec<f32> = (0..nodes).map(|node| scene.view().node_mass(node)).collect();
    let seen_as = SeenAs { masses: &masses, force: recipe.network.force };

    let schedule = Schedule::of(motion, recipe.multiple, dt);
    let Schedule { every, sequences: count, last, .. } = schedule;
    let long = every as f64 * dt;
    let mut sequences: Vec<Sequence> = (0..count).map(|number| Sequence::new(number * every / count, nodes)).collect();
    let mut frame = 0;
    let mut samples = Samples { vertices: sampled.len(), ..Samples::default() };
    // Increments are exact; a displacement in float32 is rounded, and a second difference shows that.
    let mut place = vec![DVec3::ZERO; nodes];
    let mut loads = exemplar.loads(&scene)?;
    for number in 0..=last {
        // Displacements are those before the step; its forces, of the same moment, are known after it.
        let moments: Vec<usize> = (0..sequences.len()).filter(|&at| sequences[at].has_moment(number, every)).collect();
        for &at in &moments {
            sequences[at].add_shape(&place);
            sequences[at].add_targets(&sampled, long, &mut samples);
        }
        let loads = loads.of_step(&state.view(), seconds, (last - number + 1) as u32);
        let keeps = recipe.noise.is_some() && !moments.is_empty() && schedule.is_due(frame, number);
        let before = keeps.then(|| state.clone());
        match tled::step(&scene, &loads, &mut state, &step) {
            Status::Diverged(divergence) => {
                return Err(TrainError::Scene(format!("the exact motion {divergence}")));
            }
            taken if taken.is_taken() => {}
            _ => return Err(TrainError::Scene("its loads are those of another scene".to_string())),
        }
        for &at in &moments {
            if !schedule.is_due(frame, number) {
                continue;
            }
            // Forces are known even after a step that is refused.
            let forces_of = |moved: &mut VecState| {
                let _ = tled::step(&scene, &loads, moved, &step);
            };
            let copies = before.iter().zip(&recipe.noise).flat_map(|(before, noise)| {
                let moment = sequences[at].moment(before, &free, long, seen_as);
                let copy = |_| moment.moved(noise, &sampled, random, forces_of);
                (0..noise.copies).map(copy).collect::<Vec<_>>()
            });
            let copies = copies.collect();
            sequences[at].sample(&sampled, long as f32, state.forces(), seen_as, copies);
            frame += 1;
        }
        for (place, increment) in place.iter_mut().zip(state.view().increment.iter()) {
            *place += Vec3A::from(increment.to_array()).as_dvec3();
        }
    }
    if motion.turned {
        samples.turn_normals(random);
    }
    Ok(samples)
}

/// Local frames that follow the motion each `D`.
struct Sequence {
    /// Exact steps before its first moment.
    start: u64,
    frames: Vec<Frame>,
    /// Of each vertex in the last `D`, m.
    increments: Vec<DVec3>,
    /// Displacements now, one and two `D` ago.
    shapes: [Vec<DVec3>; 3],
    /// Inputs of the latest moment, if it was sampled: their targets are known after the next `D`.
    pending: Option<Pending>,
    moments: u64,
}

/// Inputs without targets.
struct Pending {
    smooth: Vec<[f32; FEATURES]>,
    rough: Vec<MovedCopy>,
}

impl Sequence {
    fn new(start: u64, nodes: usize) -> Self {
        let still = || vec![DVec3::ZERO; nodes];
        let shapes = [still(), still(), still()];
        Self { start, frames: vec![Frame::WORLD; nodes], increments: still(), shapes, pending: None, moments: 0 }
    }

    fn has_moment(&self, number: u64, every: u64) -> bool {
        number >= self.start && (number - self.start).is_multiple_of(every)
    }

    /// A `D` has passed.
    fn add_shape(&mut self, place: &[DVec3]) {
        self.shapes.rotate_right(1);
        self.shapes[0].copy_from_slice(place);
        self.moments += 1;
    }

    /// Completes the samples of a `D` ago, and follows the motion since.
    fn add_targets(&mut self, sampled: &[usize], long: f64, samples: &mut Samples) {
        let [now, one, two] = &self.shapes;
        if let Some(pending) = self.pending.take() {
            samples.inputs.extend(pending.smooth);
            for copy in pending.rough {
                for (seen, &node) in copy.seen.iter().zip(sampled) {
                    let acceleration = (now[node] - 2.0 * one[node] + two[node] - seen.back) / (long * long);
                    samples.rough.inputs.push(seen.inputs);
                    samples.rough.targets.push(seen.frame.axes().local(acceleration.as_vec3().to_array()));
                    samples.rough.weights.push(copy.weight);
                }
            }
            for &node in sampled {
                let acceleration = (now[node] - 2.0 * one[node] + two[node]) / (long * long);
                samples.targets.push(self.frames[node].axes().local(acceleration.as_vec3().to_array()));
            }
        }
        let moves = self.frames.iter_mut().zip(&mut self.increments);
        for ((frame, increment), (now, one)) in moves.zip(now.iter().zip(one)) {
            *increment = *now - *one;
            frame.follow(increment.as_vec3().to_array());
        }
    }

    fn moment<'a>(&'a self, state: &'a VecState, free: &'a [bool], long: f64, seen_as: SeenAs<'a>) -> Moment<'a> {
        let Self { frames, increments, .. } = self;
        Moment { state, frames, increments, free, long, seen_as }
    }

    /// Inputs of now.
    fn sample(
        &mut self,
        sampled: &[usize],
        long: f32,
        forces: &[NodeVector],
        seen_as: SeenAs<'_>,
        rough: Vec<MovedCopy>,
    ) {
        // The first moment has no velocity.
        if self.moments < 2 {
            return;
        }
        let [now, ..] = &self.shapes;
        let inputs = sampled.iter().map(|&node| {
            let speed = self.increments[node].length() as f32 / long;
            seen_as.features(node, &self.frames[node], now[node].as_vec3().to_array(), speed, forces[node])
        });
        self.pending = Some(Pending { smooth: inputs.collect(), rough });
    }
}
