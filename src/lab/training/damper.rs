//! The network of long steps ([`supple::inertia::Damper`]), trained by random search (CMA-ES): weights are drawn
//! around the best so far, each draw moves the recipe's scenes from rest to the end, and is judged by the exact motion.
//! No gradient passes through the motion, and the whole roll-out is judged, not one step of it.
//!
//! ```toml
//! seed = 1
//!
//! [damper]
//! hidden = 8               # of the one hidden layer
//!
//! [[motion]]
//! scene = "torsion"        # of the laboratory
//! load = 0.02              # times the scene's forces
//! multiples = [20, 50]     # steps over the exact one's 30 us
//!
//! [search]
//! generations = 40
//! population = 10
//! spread = 0.3             # of the first draws, in units of each weight's own scale
//! ```
//! What is minimised is the mean over motions and steps of `ln (error / error without damping)`, errors being means
//! over nodes and time. The search starts from the rule of a constant gain.

use core::fmt;
use core::ops::ControlFlow;
use std::time::{Duration, Instant};

use cmaes::{CMAESOptions, DVector};
use serde::Deserialize;
use sha2::{Digest, Sha256};
use supple::mlp::{self, Activation, Description, LayerDescription, MAX_WIDTH, Range};
use supple::train::TrainError;

use super::super::method::{Method, NetworkFile};
use super::super::run::run;
use super::super::scenes::{self, SceneSpec};
use super::super::timing::Timing;
use super::super::truth::{self, Truth};
use super::super::{DT, LabError};

/// Inputs of a damper.
const INPUTS: usize = 4;
/// What the search starts from, and the largest gain.
const GAIN: f64 = 2.0;
const MOST: f32 = 20.0;
/// Where the hidden layer's knots lie at the start, for each input (see [`supple::inertia::Damper`]): changes of rough
/// motion from a hundredth of it to all of it in a step, rough motion from a thousandth to all of the body's, any
/// cosine, `k` from a thousandth to a seventh.
const KNOTS: [(f64, f64); INPUTS] = [(-9.0, 0.0), (-7.0, 0.0), (-1.0, 1.0), (-7.0, -2.0)];

/// A recipe as the module documents it.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Of the draws.
    pub seed: u64,
    /// What is searched.
    pub damper: Shape,
    /// What it is judged on.
    pub motion: Vec<TrialMotion>,
    /// How.
    pub search: Search,
}

/// What is searched.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// Width of the hidden layer.
    pub hidden: usize,
}

/// What it is judged on.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct TrialMotion {
    /// A scene of the laboratory.
    pub scene: String,
    /// Times its forces.
    pub load: f32,
    /// Steps over [`DT`].
    pub multiples: Vec<u32>,
}

/// How.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Search {
    /// Rounds of draws.
    pub generations: usize,
    /// Draws in each.
    pub population: usize,
    /// Of the first draws.
    pub spread: f64,
}

impl Recipe {
    /// Reads and checks a recipe.
    pub fn parse(text: &str) -> Result<Self, TrainError> {
        let recipe: Self = toml::from_str(text).map_err(|error| TrainError::Recipe(error.to_string()))?;
        let refuse = |what, value: &dyn fmt::Display, must: &str| Err(TrainError::refused(what, value, must));
        let Self { damper, motion, search, .. } = &recipe;
        if !(1..=MAX_WIDTH).contains(&damper.hidden) {
            return refuse("hidden", &damper.hidden, &format!("it must be from 1 to {MAX_WIDTH}"));
        }
        if motion.is_empty() {
            return Err(TrainError::Recipe("no [[motion]]: at least one is needed to judge by".to_string()));
        }
        for TrialMotion { load, multiples, .. } in motion {
            if !(load.is_finite() && *load != 0.0) {
                return refuse("load", load, "it must be a number other than zero");
            }
            if let Some(multiple) = multiples.iter().find(|multiple| !Timing::PAPER.hits_snapshots(**multiple)) {
                return refuse("multiples", multiple, "the laboratory's snapshots must fall on steps");
            }
        }
        if search.generations == 0 || search.population < 4 {
            let value = format!("{}, {}", search.generations, search.population);
            return refuse("generations, population", &value, "at least 1 and 4");
        }
        if !(search.spread > 0.0 && search.spread <= 10.0) {
            return refuse("spread", &search.spread, "it must be from 0 to 10");
        }
        Ok(recipe)
    }
}

/// How far a search is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Rounds done, and of how many.
    pub generation: usize,
    /// See `generation`.
    pub generations: usize,
    /// The best mean of the logarithms so far.
    pub best: f64,
    /// What the rest will take.
    pub remaining: Duration,
}

/// One motion at one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// The scene, and times its forces.
    pub scene: String,
    /// See `scene`.
    pub load: f32,
    /// Step over [`DT`].
    pub multiple: u32,
    /// Mean error over nodes and time, mm: a damper that does nothing, the rule, the network.
    pub errors: [f64; 3],
}

/// What a search came to.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The weight file.
    pub bytes: Vec<u8>,
    /// Every motion at every step.
    pub judged: Vec<Judged>,
}

/// A motion at a step, with its truth.
struct Trial<'a> {
    spec: &'a SceneSpec,
    truth: &'a Truth,
    load: f32,
    multiple: u32,
}

impl Trial<'_> {
    /// Mean error over nodes and time, mm; that of a body that never moves if the motion breaks off.
    fn error(&self, method: Method) -> Result<f64, LabError> {
        let row = run(self.spec, self.truth, method, self.multiple)?;
        Ok(row.figures().map_or(row.hold, |figures| figures.errors.mean_over_time()))
    }
}

/// Searches as the recipe says. `progress` may stop it.
pub fn train(text: &str, mut progress: impl FnMut(&Progress) -> ControlFlow<()>) -> Result<Fitted, TrainError> {
    let recipe = Recipe::parse(text)?;
    let mut scenes = Vec::new();
    for motion in &recipe.motion {
        let spec = scenes::named(&motion.scene)?.with_load(motion.load);
        let truth = truth::compute(&spec)?;
        scenes.push((spec, truth, motion));
    }
    let trials: Vec<Trial<'_>> = scenes
        .iter()
        .flat_map(|(spec, truth, motion)| {
            motion.multiples.iter().map(|&multiple| Trial { spec, truth, load: motion.load, multiple })
        })
        .collect();
    let Some((first, _, _)) = scenes.first() else {
        return Err(TrainError::Recipe("no [[motion]]".to_string()));
    };
    let image = |weights: &[f64]| described(&recipe, text, first, weights);
    let start = rule(recipe.damper.hidden);
    let nothing = damped(image(&vec![0.0; start.len()])?)?;
    let undamped: Vec<f64> = trials.iter().map(|trial| trial.error(nothing)).collect::<Result<_, _>>()?;
    let judge = |weights: &[f64]| -> Result<f64, TrainError> {
        let method = damped(image(weights)?)?;
        let mut sum = 0.0;
        for (trial, undamped) in trials.iter().zip(&undamped) {
            sum += (trial.error(method)? / undamped).ln();
        }
        Ok(sum / trials.len() as f64)
    };
    let best = search(&recipe, &start, judge, &mut progress)?;

    let bytes = image(&best)?;
    let methods = [nothing, damped(image(&start)?)?, damped(bytes.clone())?];
    let mut judged = Vec::new();
    for trial in &trials {
        let mut errors = [0.0; 3];
        for (error, method) in errors.iter_mut().zip(methods) {
            *error = trial.error(method)?;
        }
        judged.push(Judged { scene: trial.spec.name.to_string(), load: trial.load, multiple: trial.multiple, errors });
    }
    Ok(Fitted { bytes, judged })
}

/// The weights for which `judge` is least, searched from `start`.
fn search(
    recipe: &Recipe,
    start: &[f64],
    judge: impl Fn(&[f64]) -> Result<f64, TrainError> + Sync,
    progress: &mut impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Vec<f64>, TrainError> {
    let scales = scales(recipe.damper.hidden);
    let weights = |draw: &DVector<f64>| -> Vec<f64> {
        start.iter().zip(&scales).zip(draw.iter()).map(|((start, scale), draw)| start + scale * draw).collect()
    };
    let Search { generations, population, spread } = recipe.search;
    let mut search = CMAESOptions::new(vec![0.0; start.len()], spread)
        .population_size(population)
        .seed(recipe.seed)
        .max_generations(generations)
        // What cannot be tried is no candidate.
        .build(|draw: &DVector<f64>| judge(&weights(draw)).unwrap_or(f64::MAX))
        .map_err(|error| TrainError::Recipe(format!("{error:?}")))?;
    let began = Instant::now();
    for generation in 0..generations {
        let ended = search.next_parallel().is_some();
        let best = search.overall_best_individual().map_or(f64::NAN, |individual| individual.value);
        let done = generation + 1;
        let remaining = began.elapsed().mul_f64((generations - done) as f64 / done as f64);
        if progress(&Progress { generation: done, generations, best, remaining }).is_break() {
            return Err(TrainError::Stopped { epoch: done });
        }
        if ended {
            break;
        }
    }
    let best = search.overall_best_individual().map(|individual| weights(&individual.point));
    best.ok_or(TrainError::Diverged { epoch: 0 })
}

fn damped(bytes: Vec<u8>) -> Result<Method, TrainError> {
    // A few hundred bytes for each draw, for as long as the program runs.
    Ok(Method::LongWith(NetworkFile::leaked("damper", &bytes)?))
}

/// A gain of [`GAIN`] whatever the inputs: rows of the hidden layer, its biases, the output's weights, its bias. Each
/// row of the hidden layer is a ramp of one input from a knot on, so that a small change of any weight has an effect.
fn rule(hidden: usize) -> Vec<f64> {
    let mut weights = vec![0.0; (INPUTS + 2) * hidden + 1];
    for unit in 0..hidden {
        let (input, along) = (unit % INPUTS, (unit / INPUTS) as f64 / hidden.div_ceil(INPUTS) as f64);
        let (low, high) = KNOTS[input];
        weights[INPUTS * unit + input] = 1.0;
        weights[INPUTS * hidden + unit] = -(low + along * (high - low));
    }
    weights[(INPUTS + 2) * hidden] = GAIN;
    weights
}

/// How far each of the rule's weights may reasonably move.
fn scales(hidden: usize) -> Vec<f64> {
    let scale = |place: usize| if place < INPUTS * hidden { 0.1 } else { 0.3 };
    (0..(INPUTS + 2) * hidden + 1).map(scale).collect()
}

fn described(recipe: &Recipe, text: &str, spec: &SceneSpec, weights: &[f64]) -> Result<Vec<u8>, TrainError> {
    let hidden = recipe.damper.hidden;
    let floats = |from: usize, to: usize| weights[from..to].iter().map(|weight| *weight as f32).collect();
    let range = |least: f32, most: f32| Range { scale: 1.0, least, most };
    let (rows, biases) = (INPUTS * hidden, (INPUTS + 1) * hidden);
    let multiple = recipe.motion.iter().flat_map(|motion| &motion.multiples).max().copied().unwrap_or(1);
    Ok(mlp::write(&Description {
        inputs: vec![range(-25.0, 25.0); INPUTS],
        outputs: vec![range(0.0, MOST)],
        first: vec![
            LayerDescription {
                inputs: INPUTS,
                activation: Activation::LeakyRelu { slope: 0.0 },
                weights: floats(0, rows),
                biases: floats(rows, biases),
            },
            LayerDescription {
                inputs: hidden,
                activation: Activation::Linear,
                weights: floats(biases, biases + hidden),
                biases: floats(biases + hidden, biases + hidden + 1),
            },
        ],
        second: Vec::new(),
        law: spec.law,
        density: spec.density,
        element: spec.element,
        damping: spec.damping,
        step: multiple as f32 * DT,
        exact_step: DT,
        force: mlp::ForceInput::default(),
        recipe: text,
        recipe_hash: Sha256::digest(text.as_bytes()).into(),
    })?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple::mlp::Network;

    #[test]
    fn the_search_starts_from_a_constant_gain() {
        let recipe = Recipe::parse(include_str!("../../../weights/damper.toml")).unwrap();
        let spec = scenes::named("torsion").unwrap();
        let bytes = described(&recipe, "", &spec, &rule(recipe.damper.hidden)).unwrap();
        let bytes = supple::mlp::WeightBytes::of(&bytes);
        let network = Network::parse(bytes.bytes()).unwrap();
        for inputs in [[-9.0, -3.0, 0.5, 7.0], [0.0; 4], [1.0, -20.0, -1.0, 2.0]] {
            let mut gain = [0.0];
            network.predict(&inputs, &mut gain);
            assert_eq!(gain, [GAIN as f32]);
        }
        assert!(scales(recipe.damper.hidden).iter().all(|scale| *scale > 0.0));
    }
}
