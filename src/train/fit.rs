//! The network and its training on burn: two mean squared errors, of the first part's prediction and of the sum with
//! the correction, each against the acceleration; Adam (0.9, 0.999). Inputs and targets are divided by their standard
//! deviations.

use core::ops::ControlFlow;
use std::format;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::string::{String, ToString};
use std::time::{Duration, Instant};
use std::vec::Vec;

use burn::module::Module;
use burn::nn::{Linear, LinearConfig};
use burn::optim::{AdamConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::activation::leaky_relu;
use burn::tensor::{Device, Tensor, TensorData};
use sha2::{Digest, Sha256};

use super::random_numbers::Random;
use super::recipe::{Decay, Recipe};
use super::samples::Samples;
use super::{TrainError, TrainingScene};
use crate::io::write_atomically;
use crate::learned::{FEATURES, PREDICTED};
use crate::material::Tissue;
use crate::mlp::{self, Activation, Description, LayerDescription, Network, Range, WeightBytes};

/// Both parts.
#[derive(Module, Debug)]
struct Layers {
    first: Vec<Linear>,
    second: Vec<Linear>,
}

impl Layers {
    fn new(recipe: &Recipe, device: &Device) -> Self {
        let part = |inputs: usize, hidden: &[usize]| -> Vec<Linear> {
            let widths: Vec<usize> = [inputs].into_iter().chain(hidden.iter().copied()).chain([PREDICTED]).collect();
            widths.windows(2).map(|pair| LinearConfig::new(pair[0], pair[1]).init(device)).collect()
        };
        Self {
            first: part(FEATURES, &recipe.network.hidden),
            second: part(FEATURES + PREDICTED, &recipe.network.correction),
        }
    }

    /// The first part's prediction, and the sum with the correction.
    fn forward(&self, x: Tensor<2>, slope: f64) -> (Tensor<2>, Tensor<2>) {
        let predicted = run(&self.first, x.clone(), slope);
        let corrected = predicted.clone() + run(&self.second, Tensor::cat(std::vec![x, predicted.clone()], 1), slope);
        (predicted, corrected)
    }
}

fn run(layers: &[Linear], x: Tensor<2>, slope: f64) -> Tensor<2> {
    layers.iter().enumerate().fold(x, |x, (number, layer)| {
        let sums = layer.forward(x);
        if number + 1 < layers.len() { leaky_relu(sums, slope) } else { sums }
    })
}

/// How far a training is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Epochs done, whole ones.
    pub epoch: usize,
    /// Of how many.
    pub epochs: usize,
    /// Samples of this epoch done, and of how many.
    pub done: usize,
    /// See `done`.
    pub samples: usize,
    /// Mean over this epoch so far of the sum of both losses, in variances of the target.
    pub loss: f64,
    /// Samples a second.
    pub rate: f64,
    /// What the rest will take at this rate.
    pub remaining: Duration,
}

/// What a training came to.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The weight file.
    pub bytes: Vec<u8>,
    /// Root mean square error on the frames that were held out, in standard deviations of each target; nothing if none
    /// were.
    pub held_out: Option<[f64; PREDICTED]>,
    /// Samples that it was trained on.
    pub samples: usize,
    /// Mean loss of the last epoch.
    pub loss: f64,
}

/// A share of the frames, evenly spread, is held out.
pub(super) fn is_held_out(frame: usize, share: f64) -> bool {
    ((frame + 1) as f64 * share).floor() > (frame as f64 * share).floor()
}

/// Trains as the recipe, whose `text` goes into the weight file, says on the samples of a scene, or of several that are
/// alike but for their loads. With a folder for checkpoints the state is kept there after every epoch, and a training
/// that was stopped goes on from it. `progress` may stop it.
pub fn fit(
    recipe: &Recipe,
    text: &str,
    scene: &dyn TrainingScene,
    samples: &Samples,
    checkpoints: Option<&Path>,
    progress: &mut impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Fitted, TrainError> {
    if samples.inputs.is_empty() {
        let scenes: Vec<&str> = recipe.motion.iter().map(|motion| motion.scene.as_str()).collect();
        let text = format!(
            "scene = {:?}: every vertex is held, or loaded alone, none is left to learn from",
            scenes.join(", ")
        );
        return Err(TrainError::Recipe(text));
    }
    let hash: [u8; 32] = Sha256::digest(text.as_bytes()).into();
    let share = recipe.training.held_out;
    let seen = samples.of_frames(|frame| !is_held_out(frame, share));
    let unseen = samples.of_frames(|frame| is_held_out(frame, share));
    let (inputs, targets) = seen.ranges();
    let device = Device::default().autodiff();
    device.seed(recipe.seed);
    let mut parts = Layers::new(recipe, &device);
    let mut adam = AdamConfig::new().init();
    let mut first = 0;
    let folder = checkpoints.map(|path| Folder { path, hash: &hash });
    if let Some(folder) = &folder
        && let Some(epoch) = folder.latest()?
    {
        (parts, adam) = folder.load(epoch, parts, adam)?;
        first = epoch;
    }

    let rows = ScaledSamples::of(&seen, &inputs, &targets);
    let count = rows.inputs.len();
    let mut training = Training { recipe, rows, device, start: Instant::now(), taken: 0 };
    let mut loss = f64::NAN;
    for epoch in first..recipe.training.epochs {
        (parts, loss) = training.epoch(epoch, parts, &mut adam, progress)?;
        if !loss.is_finite() {
            return Err(TrainError::Diverged { epoch });
        }
        if let Some(folder) = &folder {
            folder.save(epoch + 1, &parts, &adam)?;
        }
    }

    let description = described(recipe, scene, text, hash, &parts, inputs, targets)?;
    let bytes = mlp::write(&description)?;
    let held_out = (!unseen.inputs.is_empty()).then(|| judged(&bytes, &unseen, &description.outputs));
    Ok(Fitted { bytes, held_out, samples: count, loss })
}

/// Samples over their scales, the smooth ones first, and the weight of each in the loss.
struct ScaledSamples {
    inputs: Vec<[f32; FEATURES]>,
    targets: Vec<[f32; PREDICTED]>,
    weights: Vec<[f32; 1]>,
}

impl ScaledSamples {
    fn of(samples: &Samples, inputs: &[Range], targets: &[Range]) -> Self {
        let mut rows = Self {
            inputs: scaled(&samples.inputs, inputs),
            targets: scaled(&samples.targets, targets),
            weights: std::vec![[1.0]; samples.inputs.len()],
        };
        rows.inputs.extend(scaled(&samples.rough.inputs, inputs));
        rows.targets.extend(scaled(&samples.rough.targets, targets));
        rows.weights.extend(samples.rough.weights.iter().map(|&weight| [weight]));
        rows
    }
}

/// What the epochs of a training share.
struct Training<'a> {
    recipe: &'a Recipe,
    rows: ScaledSamples,
    device: Device,
    start: Instant,
    /// Samples since the start.
    taken: usize,
}

impl Training<'_> {
    /// Gives the parts after the epoch, and its mean loss.
    fn epoch(
        &mut self,
        epoch: usize,
        mut parts: Layers,
        adam: &mut ModuleOptimizer,
        progress: &mut impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(Layers, f64), TrainError> {
        let Self { recipe: Recipe { training, network, seed, .. }, rows, device, start, taken } = self;
        let count = rows.inputs.len();
        let order = shuffled(count, seed.wrapping_add(epoch as u64));
        let rate = match training.decay {
            Decay::None => training.rate,
            Decay::Cosine => {
                let share = epoch as f64 / training.epochs as f64;
                0.5 * training.rate * (1.0 + (core::f64::consts::PI * share).cos())
            }
        };
        let (mut sum, mut done, mut loss) = (0.0, 0, f64::NAN);
        for batch in order.chunks(training.batch) {
            let (input, target) = (gathered(&rows.inputs, batch, device), gathered(&rows.targets, batch, device));
            let (predicted, corrected) = parts.forward(input, f64::from(network.slope));
            let weight = gathered(&rows.weights, batch, device);
            let squares = (predicted - target.clone()).square() + (corrected - target).square();
            let both = (squares * weight).mean();
            let gradients = GradientsParams::from_grads(both.backward(), &parts);
            parts = adam.step(rate, parts, gradients);
            sum += f64::from(both.into_scalar::<f32>()) * batch.len() as f64;
            done += batch.len();
            *taken += batch.len();
            loss = sum / done as f64;
            let rate = *taken as f64 / start.elapsed().as_secs_f64().max(1e-9);
            let left = (training.epochs - epoch) * count - done;
            let told = progress(&Progress {
                epoch,
                epochs: training.epochs,
                done,
                samples: count,
                loss,
                rate,
                remaining: Duration::from_secs_f64(left as f64 / rate),
            });
            if told.is_break() {
                return Err(TrainError::Stopped { epoch });
            }
        }
        Ok((parts, loss))
    }
}

/// ScaledSamples over the scales.
fn scaled<const N: usize>(rows: &[[f32; N]], ranges: &[Range]) -> Vec<[f32; N]> {
    let over = |row: &[f32; N]| core::array::from_fn(|column| row[column] / ranges[column].scale);
    rows.iter().map(over).collect()
}

fn gathered<const N: usize>(rows: &[[f32; N]], batch: &[u32], device: &Device) -> Tensor<2> {
    let values: Vec<f32> = batch.iter().flat_map(|&row| rows[row as usize]).collect();
    Tensor::from_data(TensorData::new(values, [batch.len(), N]), device)
}

/// The indices below `count` in an order that the seed decides (Fisher and Yates).
fn shuffled(count: usize, seed: u64) -> Vec<u32> {
    let mut random = Random(seed);
    let mut order: Vec<u32> = (0..count as u32).collect();
    for last in (1..count).rev() {
        order.swap(last, (random.next_u64() % (last as u64 + 1)) as usize);
    }
    order
}

fn described<'a>(
    recipe: &Recipe,
    scene: &dyn TrainingScene,
    text: &'a str,
    recipe_hash: [u8; 32],
    parts: &Layers,
    inputs: Vec<Range>,
    outputs: Vec<Range>,
) -> Result<Description<'a>, TrainError> {
    let layers = |layers: &[Linear]| -> Vec<LayerDescription> {
        let last = layers.len() - 1;
        let each = layers.iter().enumerate();
        each.map(|(number, layer)| {
            let slope = recipe.network.slope;
            let activation = if number < last { Activation::LeakyRelu { slope } } else { Activation::Linear };
            let [count, _] = layer.weight.val().dims();
            // burn keeps a column for each output.
            let weights = values(layer.weight.val().transpose());
            let biases = layer.bias.as_ref().map(|bias| values(bias.val())).unwrap_or_default();
            LayerDescription { inputs: count, activation, weights, biases }
        })
        .collect()
    };
    let Tissue { law, density } = scene.tissue();
    Ok(Description {
        inputs,
        outputs,
        first: layers(&parts.first),
        second: layers(&parts.second),
        law,
        density,
        element: scene.element(),
        damping: scene.damping(),
        step: recipe.multiple as f32 * scene.step(),
        exact_step: scene.step(),
        force: recipe.network.force,
        recipe: text,
        recipe_hash,
    })
}

fn values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec().unwrap_or_default()
}

/// Root mean square errors of [`Network::predict`], in standard deviations of each target.
pub(super) fn judged(bytes: &[u8], samples: &Samples, outputs: &[Range]) -> [f64; PREDICTED] {
    let memory = WeightBytes::of(bytes);
    let mut squares = [0.0; PREDICTED];
    if let Ok(network) = Network::parse(memory.bytes()) {
        for (input, target) in samples.inputs.iter().zip(&samples.targets) {
            let mut predicted = [0.0; PREDICTED];
            network.predict(input, &mut predicted);
            for (axis, square) in squares.iter_mut().enumerate() {
                let off = f64::from(predicted[axis] - target[axis]) / f64::from(outputs[axis].scale);
                *square += off * off;
            }
        }
    }
    squares.map(|square| (square / samples.inputs.len() as f64).sqrt())
}

/// A folder of checkpoints: for the latest epoch the weights and the state of Adam, and a file that names both and the
/// recipe, written last.
struct Folder<'a> {
    path: &'a Path,
    hash: &'a [u8; 32],
}

impl Folder<'_> {
    fn files(&self, epoch: usize) -> [PathBuf; 2] {
        ["weights", "adam"].map(|kind| self.path.join(format!("{kind}-{epoch:05}.bpk")))
    }

    fn mark(&self) -> PathBuf {
        self.path.join("latest")
    }

    /// Epochs of the checkpoint that is there.
    fn latest(&self) -> Result<Option<usize>, TrainError> {
        let Ok(text) = std::fs::read_to_string(self.mark()) else {
            return Ok(None);
        };
        let mut words = text.split_whitespace();
        let (epoch, recipe) = (words.next(), words.next());
        if recipe != Some(mlp::hexadecimal(self.hash).as_str()) {
            return Err(TrainError::OtherRecipe(self.path.to_path_buf()));
        }
        let epoch = epoch.and_then(|epoch| epoch.parse().ok());
        epoch.map(Some).ok_or_else(|| TrainError::Checkpoint(self.mark(), format!("cannot be read: {text:?}")))
    }

    fn load(
        &self,
        epoch: usize,
        parts: Layers,
        adam: ModuleOptimizer,
    ) -> Result<(Layers, ModuleOptimizer), TrainError> {
        let [weights, state] = self.files(epoch);
        let problem = |path: &Path, text: String| TrainError::Checkpoint(path.to_path_buf(), text);
        let parts = parts.try_load_file(&weights).map_err(|error| problem(&weights, error.to_string()))?;
        let adam = adam.load(&state).map_err(|error| problem(&state, error.to_string()))?;
        Ok((parts, adam))
    }

    fn save(&self, epoch: usize, parts: &Layers, adam: &ModuleOptimizer) -> Result<(), TrainError> {
        let problem = |path: &Path, text: String| TrainError::Checkpoint(path.to_path_buf(), text);
        std::fs::create_dir_all(self.path).map_err(|error| problem(self.path, error.to_string()))?;
        let [weights, state] = self.files(epoch);
        parts.clone().save_file(&weights).map_err(|error| problem(&weights, error.to_string()))?;
        adam.save(&state).map_err(|error| problem(&state, error.to_string()))?;
        // On the disk before the file that names them.
        for path in [&weights, &state] {
            let synchronised = File::options().write(true).open(path).and_then(|file| file.sync_all());
            synchronised.map_err(|error| problem(path, error.to_string()))?;
        }
        let hash = mlp::hexadecimal(self.hash);
        write_atomically(&self.mark(), |file| writeln!(file, "{epoch} {hash}")).map_err(TrainError::Write)?;
        // The files of the epoch before are of no more use.
        for old in epoch.checked_sub(1).map(|before| self.files(before)).into_iter().flatten() {
            let _ = std::fs::remove_file(old);
        }
        Ok(())
    }
}
