//! The data set: what the exact step does over each `D`, seen by each vertex in its frame (Meister et al. 2018, section 2).
//!
//! ```text
//! at t: u(t), |u(t) - u(t-D)| / D, f_e - K u;   target (u(t+D) - 2 u(t) + u(t-D)) / D^2
//! ```
//! Beside each frame may stand copies of it in rough motion, see [`super::noise`].
//!
//! Vertices that are held or loaded are left out, as in the paper: boundary conditions make them jump. Frames follow
//! the motion once each `D`, as they do in a roll-out; where the paper's frames lie closer than `D`, several trains of
//! frames run side by side, each with its own start.

use std::vec;
use std::vec::Vec;

use glam::{DVec3, Vec3A};

use super::noise::{Moment, Moved, Random, SeenAs};
use super::recipe::Recipe;
use crate::frame::Frame;
use crate::lab::host::{HostState, Job};
use crate::lab::scenes::{self, SceneSpec};
use crate::lab::{DT, INTERVAL_STEPS, LabError};
use crate::material::Material;
use crate::mlp::Range;
use crate::state::NodeVector;
use crate::surrogate::{FEATURES, PREDICTED};
use crate::tled::{self, Status, Step};

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

/// What vertices see of rough motion, and what leads back to the exact one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rough {
    /// As in [`Samples`].
    pub inputs: Vec<[f32; FEATURES]>,
    /// As in [`Samples`].
    pub targets: Vec<[f32; PREDICTED]>,
    /// Of each sample in the loss.
    pub weights: Vec<f32>,
}

/// One train of frames, each `D` after the one before.
struct Train {
    /// Step of the exact motion at which it started.
    start: u64,
    frames: Vec<Frame>,
    /// Way of each vertex in the last `D`, m.
    increments: Vec<DVec3>,
    /// Displacements now, one and two `D` ago.
    shapes: [Vec<DVec3>; 3],
    /// What was seen at the latest moment that is to be sampled.
    asked: Option<Asked>,
    moments: u64,
}

/// What waits for its targets.
struct Asked {
    smooth: Vec<[f32; FEATURES]>,
    rough: Vec<Moved>,
}

impl Samples {
    /// Simulates the recipe's motion and samples it.
    pub fn collect(recipe: &Recipe) -> Result<Self, LabError> {
        let spec = scenes::named(&recipe.motion.scene)?.with_load(recipe.motion.load);
        spec.with_material(Collect { spec: &spec, recipe })
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
        let block = self.rough.inputs.len() / frames.max(1);
        for frame in (0..frames).filter(|&frame| block > 0 && wanted(frame)) {
            let rows = frame * block..(frame + 1) * block;
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

struct Collect<'a> {
    spec: &'a SceneSpec,
    recipe: &'a Recipe,
}

impl Job for Collect<'_> {
    type Output = Result<Samples, LabError>;

    fn run<M: Material + Copy>(self, material: M) -> Self::Output {
        let Self { spec, recipe } = self;
        let scene = spec.build(material)?;
        let step = Step::insist(DT, spec.damping)?;
        let mut state = spec.state();
        let nodes = spec.points.len();
        let without = |mut marks: Vec<bool>, nodes: &mut dyn Iterator<Item = u32>| {
            for node in nodes {
                if let Some(mark) = marks.get_mut(node as usize) {
                    *mark = false;
                }
            }
            marks
        };
        let free = without(vec![true; nodes], &mut spec.supports.iter().map(|support| support.node));
        let kept = without(free.clone(), &mut spec.forces.iter().map(|force| force.node));
        let mut random = Random(recipe.seed);
        let kept: Vec<usize> = (0..nodes).filter(|&node| kept[node]).collect();
        let seen_as = SeenAs { inertia: scene.inertia(), force: recipe.network.force };

        let dt = f64::from(DT);
        let every = u64::from(recipe.multiple);
        let long = every as f64 * dt;
        let span = recipe.motion.to - recipe.motion.from;
        let trains = ((recipe.motion.frames as f64 * long / span).ceil() as u64).clamp(1, every);
        let mut trains: Vec<Train> =
            (0..trains).map(|number| Train::new(number * every / trains, nodes)).collect();
        // The moments that are nearest to those of equal intervals.
        let first = (recipe.motion.from / dt).round() as u64;
        let spacing = span / recipe.motion.frames as f64 / dt;
        let mut due = 0;
        let last = (recipe.motion.to / dt).round() as u64 + every;

        let mut samples = Samples { vertices: kept.len(), ..Samples::default() };
        let mut place = vec![DVec3::ZERO; nodes];
        for number in 0..=last {
            // Before the step: displacements of now. After it: the forces of now.
            let moments: Vec<usize> =
                (0..trains.len()).filter(|&at| trains[at].is_due(number, every)).collect();
            for &at in &moments {
                trains[at].turn(&place);
                trains[at].answer(&kept, long, &mut samples);
            }
            let interval = number as usize / INTERVAL_STEPS as usize;
            let loads = spec.loads(&scene, interval)?;
            let asks = |due: usize| {
                number >= first
                    && due < recipe.motion.frames
                    && (number - first) as f64 >= (due as f64 - 0.5) * spacing
            };
            // The step leaves displacements behind that are later than its forces.
            let before = (recipe.noise.is_some() && !moments.is_empty() && asks(due)).then(|| state.clone());
            match tled::step(&scene, &loads, &mut state, &step) {
                Status::Ok | Status::Limited { .. } => {}
                Status::Diverged(divergence) => {
                    return Err(LabError::Diverged { scene: spec.name, divergence });
                }
                Status::Mismatch { nodes, room } => return Err(LabError::Mismatch { nodes, room }),
            }
            for &at in &moments {
                if asks(due) {
                    // Forces are found even by a step that is refused.
                    let forces_of = |moved: &mut HostState| {
                        let _ = tled::step(&scene, &loads, moved, &step);
                    };
                    let copies = before.iter().zip(&recipe.noise).flat_map(|(before, noise)| {
                        let moment = trains[at].moment(before, &free, long, seen_as);
                        (0..noise.copies)
                            .map(|_| moment.moved(noise, &kept, &mut random, forces_of))
                            .collect::<Vec<_>>()
                    });
                    let copies = copies.collect();
                    trains[at].ask(&kept, long as f32, state.forces(), seen_as, copies);
                    due += 1;
                }
            }
            // Increments are exact; a displacement in float32 is rounded, and a second difference shows that.
            for (place, increment) in place.iter_mut().zip(state.increment.iter()) {
                *place += Vec3A::from(increment.to_array()).as_dvec3();
            }
        }
        if recipe.motion.turned {
            for (inputs, targets) in samples.inputs.iter_mut().zip(&mut samples.targets) {
                turn(inputs, targets, &mut random);
            }
            for (inputs, targets) in samples.rough.inputs.iter_mut().zip(&mut samples.rough.targets) {
                turn(inputs, targets, &mut random);
            }
        }
        Ok(samples)
    }
}

/// Turns the normal about the tangent by a random angle.
fn turn(inputs: &mut [f32; FEATURES], targets: &mut [f32; PREDICTED], random: &mut Random) {
    let (sin, cos) = (core::f64::consts::TAU * random.unit()).sin_cos();
    let (sin, cos) = (sin as f32, cos as f32);
    let turned = |normal: f32, binormal: f32| (cos * normal + sin * binormal, cos * binormal - sin * normal);
    (inputs[1], inputs[2]) = turned(inputs[1], inputs[2]);
    (inputs[5], inputs[6]) = turned(inputs[5], inputs[6]);
    (targets[1], targets[2]) = turned(targets[1], targets[2]);
}

impl Train {
    fn new(start: u64, nodes: usize) -> Self {
        let still = || vec![DVec3::ZERO; nodes];
        let shapes = [still(), still(), still()];
        Self {
            start,
            frames: vec![Frame::WORLD; nodes],
            increments: still(),
            shapes,
            asked: None,
            moments: 0,
        }
    }

    fn is_due(&self, number: u64, every: u64) -> bool {
        number >= self.start && (number - self.start).is_multiple_of(every)
    }

    /// A `D` has passed.
    fn turn(&mut self, place: &[DVec3]) {
        self.shapes.rotate_right(1);
        self.shapes[0].copy_from_slice(place);
        self.moments += 1;
    }

    /// Targets for what was asked a `D` ago.
    fn answer(&mut self, kept: &[usize], long: f64, samples: &mut Samples) {
        let [now, one, two] = &self.shapes;
        if let Some(asked) = self.asked.take() {
            samples.inputs.extend(asked.smooth);
            for copy in asked.rough {
                for (seen, &node) in copy.seen.iter().zip(kept) {
                    let acceleration = (now[node] - 2.0 * one[node] + two[node] - seen.back) / (long * long);
                    samples.rough.inputs.push(seen.inputs);
                    samples.rough.targets.push(seen.frame.axes().local(acceleration.as_vec3().to_array()));
                    samples.rough.weights.push(copy.weight);
                }
            }
            for &node in kept {
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

    fn moment<'a>(
        &'a self,
        state: &'a HostState,
        free: &'a [bool],
        long: f64,
        seen_as: SeenAs<'a>,
    ) -> Moment<'a> {
        let Self { frames, increments, .. } = self;
        Moment { state, frames, increments, free, long, seen_as }
    }

    /// Inputs of now.
    fn ask(
        &mut self,
        kept: &[usize],
        long: f32,
        forces: &[NodeVector],
        seen_as: SeenAs<'_>,
        rough: Vec<Moved>,
    ) {
        // The first moment has no velocity.
        if self.moments < 2 {
            return;
        }
        let [now, ..] = &self.shapes;
        let inputs = kept.iter().map(|&node| {
            let speed = self.increments[node].length() as f32 / long;
            seen_as.features(node, &self.frames[node], now[node].as_vec3().to_array(), speed, forces[node])
        });
        self.asked = Some(Asked { smooth: inputs.collect(), rough });
    }
}
