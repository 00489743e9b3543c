//! Weight files from what training found, and memory for them on a host with a heap; [`write`] refuses what
//! [`Network::parse`] would refuse.

use std::format;
use std::string::String;
use std::vec::Vec;

use super::file::{ALIGNMENT, CHECKED, HEADER, Header, LayerEntry, MAGIC, VERSION};
use super::{Activation, ForceInput, Network, Range, TrainedLaw, WeightError};

/// A layer of a network to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerDescription {
    /// Numbers that go in.
    pub inputs: usize,
    /// What follows the sums.
    pub activation: Activation,
    /// By rows of `inputs`.
    pub weights: Vec<f32>,
    /// One a row.
    pub biases: Vec<f32>,
}

/// A network to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct Description<'a> {
    /// Scale and training range of each input.
    pub inputs: Vec<Range>,
    /// Scale and range of each output.
    pub outputs: Vec<Range>,
    /// The first part.
    pub first: Vec<LayerDescription>,
    /// The correction, or nothing.
    pub second: Vec<LayerDescription>,
    /// Of the training's tissue.
    pub law: TrainedLaw,
    /// kg/m^3.
    pub density: f32,
    /// 1/s.
    pub damping: f32,
    /// Step that the network predicts for, s.
    pub step: f32,
    /// Step of the exact motion it learned from, s.
    pub exact_step: f32,
    /// Unit of the learned step's force.
    pub force: ForceInput,
    /// The configuration, as text.
    pub recipe: &'a str,
    /// SHA-256 of the recipe.
    pub recipe_hash: [u8; 32],
}

/// A copy of a weight file's bytes, at a multiple of four as [`Network::parse`] needs them.
#[derive(Clone, Debug)]
pub struct WeightBytes {
    words: Vec<u32>,
    length: usize,
}

impl WeightBytes {
    /// Copies the bytes.
    #[must_use]
    pub fn of(bytes: &[u8]) -> Self {
        let mut words = std::vec![0; bytes.len().div_ceil(4)];
        let whole: &mut [u8] = bytemuck::cast_slice_mut(&mut words);
        for (to, from) in whole.iter_mut().zip(bytes) {
            *to = *from;
        }
        Self { words, length: bytes.len() }
    }

    /// The bytes.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words).get(..self.length).unwrap_or_default()
    }
}

/// Bytes of a file, each array at its place.
struct Image(Vec<u8>);

impl Image {
    /// Adds bytes at the next place for an array, and tells where that is.
    fn add(&mut self, bytes: &[u8]) -> u32 {
        self.0.resize(self.0.len().next_multiple_of(ALIGNMENT), 0);
        let at = self.0.len();
        self.0.extend_from_slice(bytes);
        at as u32
    }
}

/// The bytes of a weight file.
pub fn write(description: &Description<'_>) -> Result<Vec<u8>, WeightError> {
    let Description { inputs, outputs, first, second, law, .. } = description;
    let layers: Vec<_> = first.iter().chain(second).collect();
    let tables = size_of::<Range>() * (inputs.len() + outputs.len());
    let mut image = Image(vec_of(HEADER + tables + size_of::<LayerEntry>() * layers.len()));
    let mut entries = Vec::new();
    for layer in &layers {
        let (activation, slope) = match layer.activation {
            Activation::Linear => (0, 0.0),
            Activation::LeakyRelu { slope } => (1, slope),
        };
        entries.push(LayerEntry {
            inputs: layer.inputs as u32,
            outputs: layer.biases.len() as u32,
            activation,
            slope,
            precision: 0,
            weights: image.add(bytemuck::cast_slice(&layer.weights)),
            biases: image.add(bytemuck::cast_slice(&layer.biases)),
            reserved: 0,
        });
    }
    let recipe = image.add(description.recipe.as_bytes());
    let Image(mut bytes) = image;
    let (law, constants) = match *law {
        TrainedLaw::NeoHookean { c, d, literal } => (u32::from(literal), [c, d, 0.0, 0.0]),
        TrainedLaw::Exponential { a, b, d, literal } => (2 + u32::from(literal), [a, b, d, 0.0]),
    };
    let mut header = Header {
        magic: MAGIC,
        version: VERSION,
        length: bytes.len() as u32,
        checksum: 0,
        inputs: inputs.len() as u32,
        outputs: outputs.len() as u32,
        layers: layers.len() as u32,
        first_layers: first.len() as u32,
        law,
        constants,
        density: description.density,
        damping: description.damping,
        step: description.step,
        exact_step: description.exact_step,
        recipe,
        recipe_length: description.recipe.len() as u32,
        recipe_hash: description.recipe_hash,
        force: u32::from(description.force == ForceInput::PerMass),
        reserved: [0; 124],
    };
    let place =
        |bytes: &mut Vec<u8>, at: usize, part: &[u8]| bytes[at..at + part.len()].copy_from_slice(part);
    place(&mut bytes, HEADER, bytemuck::cast_slice(inputs));
    place(&mut bytes, HEADER + size_of::<Range>() * inputs.len(), bytemuck::cast_slice(outputs));
    place(&mut bytes, HEADER + tables, bytemuck::cast_slice(&entries));
    place(&mut bytes, 0, bytemuck::bytes_of(&header));
    header.checksum = crc32fast::hash(&bytes[CHECKED..]);
    place(&mut bytes, 0, bytemuck::bytes_of(&header));
    Network::parse(WeightBytes::of(&bytes).bytes())?;
    Ok(bytes)
}

/// The digits of a recipe's hash.
#[must_use]
pub fn hexadecimal(hash: &[u8; 32]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn vec_of(length: usize) -> Vec<u8> {
    std::vec![0; length]
}
