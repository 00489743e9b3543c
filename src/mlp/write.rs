//! Weight files of trained networks, and memory for them on a host with a heap; [`write`] refuses what
//! [`Network::parse`] would refuse.

use std::format;
use std::string::String;
use std::vec;
use std::vec::Vec;

use super::file::{ALIGNMENT, CHECKED, HEADER, Header, MAGIC, VERSION, VERSION_INT8};
use super::int8::{GROUP, TILE_ROWS, WeightTile};
use super::layers::{LayerEntry, LongEntry};
use super::{Activation, ForceInput, Layer, Network, Parameters, Range, WeightError};
use crate::checksum::crc_32;
use crate::material::{AnyLaw, Element, Law};

/// A layer of a network to be written.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerDescription {
    /// How many values go in.
    pub inputs: usize,
    /// What follows the sums.
    pub activation: Activation,
    /// By rows of `inputs`.
    pub weights: Vec<f32>,
    /// One a row.
    pub biases: Vec<f32>,
}

/// Weights of a layer in int8, see [`super::Int8`]; its biases stay in float32.
#[derive(Clone, Debug, PartialEq)]
pub struct Int8Description {
    /// The activation that stands for zero, 1 to 254.
    pub zero: u8,
    /// By rows of as many as there are inputs, -127 to 127.
    pub weights: Vec<i8>,
    /// One a row.
    pub scales: Vec<f32>,
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
    pub law: AnyLaw,
    /// kg/m^3.
    pub density: f32,
    /// Tetrahedra of the motion it learned from.
    pub element: Element,
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

impl<'a> Description<'a> {
    /// What a network consists of, without the weights of int8 layers.
    #[must_use]
    pub fn of(network: &Network<'a>) -> Self {
        let layers = |layers: &[Layer<'_>]| {
            let described = |layer: &Layer<'_>| {
                let (weights, biases) = match layer.parameters {
                    Parameters::Float { weights, biases } => (weights, biases),
                    Parameters::Int8(int8) => (&[][..], int8.biases.get(..layer.outputs).unwrap_or_default()),
                };
                LayerDescription {
                    inputs: layer.inputs,
                    activation: layer.activation,
                    weights: weights.to_vec(),
                    biases: biases.to_vec(),
                }
            };
            layers.iter().map(described).collect()
        };
        let (first, second) = network.layers();
        let recipe = network.recipe();
        Self {
            inputs: network.inputs().to_vec(),
            outputs: network.outputs().to_vec(),
            first: layers(first),
            second: layers(second),
            law: recipe.law,
            density: recipe.density,
            element: recipe.element,
            damping: recipe.damping,
            step: recipe.step,
            exact_step: recipe.exact_step,
            force: recipe.force,
            recipe: recipe.text,
            recipe_hash: recipe.hash,
        }
    }
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
        let mut words = vec![0; bytes.len().div_ceil(4)];
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

/// Bytes of a file.
struct Image(Vec<u8>);

impl Image {
    /// Adds an array at the next multiple of [`ALIGNMENT`]. Gives its offset.
    fn add(&mut self, bytes: &[u8]) -> u32 {
        self.0.resize(self.0.len().next_multiple_of(ALIGNMENT), 0);
        let at = self.0.len();
        self.0.extend_from_slice(bytes);
        at as u32
    }

    /// Adds the arrays of a layer. Gives its entry in the layer table.
    fn add_layer(&mut self, layer: &LayerDescription, int8: Option<&Int8Description>) -> LongEntry {
        let (activation, slope) = match layer.activation {
            Activation::Linear => (0, 0.0),
            Activation::LeakyRelu { slope } => (1, slope),
        };
        let (inputs, outputs) = (layer.inputs, layer.biases.len());
        let mut long = LongEntry::default();
        if let Some(int8) = int8 {
            let sums = int8.weights.chunks(inputs.max(1)).map(|row| row.iter().map(|&w| i32::from(w)).sum::<i32>());
            let starts: Vec<i32> = sums.map(|sum| -i32::from(int8.zero) * sum).collect();
            long.entry.precision = 1;
            long.zero = int8.zero.into();
            long.entry.weights = self.add(bytemuck::cast_slice(&tiles(&int8.weights, inputs, outputs)));
            long.starts = self.add(bytemuck::cast_slice(&padded(&starts)));
            long.scales = self.add(bytemuck::cast_slice(&padded(&int8.scales)));
            long.entry.biases = self.add(bytemuck::cast_slice(&padded(&layer.biases)));
        } else {
            long.entry.weights = self.add(bytemuck::cast_slice(&layer.weights));
            long.entry.biases = self.add(bytemuck::cast_slice(&layer.biases));
        }
        let (inputs, outputs) = (inputs as u32, outputs as u32);
        long.entry = LayerEntry { inputs, outputs, activation, slope, ..long.entry };
        long
    }
}

/// Tiles of weights from rows of them, zeros where there is no input or output.
fn tiles(weights: &[i8], inputs: usize, outputs: usize) -> Vec<WeightTile> {
    let mut tiles = Vec::new();
    for rows in 0..outputs.div_ceil(TILE_ROWS) {
        for group in 0..inputs.div_ceil(GROUP) {
            let weight = |output: usize, input: usize| {
                let there = output < outputs && input < inputs;
                there.then(|| weights.get(output * inputs + input)).flatten().copied().unwrap_or(0)
            };
            tiles.push(core::array::from_fn(|row| {
                core::array::from_fn(|index| weight(rows * TILE_ROWS + row, group * GROUP + index))
            }));
        }
    }
    tiles
}

/// With zeros up to a multiple of [`TILE_ROWS`].
fn padded<T: Clone + Default>(values: &[T]) -> Vec<T> {
    let mut padded = values.to_vec();
    padded.resize(values.len().next_multiple_of(TILE_ROWS), T::default());
    padded
}

/// The bytes of a weight file, all layers in float32: version 1.
pub fn write(description: &Description<'_>) -> Result<Vec<u8>, WeightError> {
    write_int8(description, &[])
}

/// The same with some layers in int8: layer `n`, counted through both parts, has the weights of `int8[n]`, where there
/// are any, instead of the description's. Version 3 if there is one.
pub fn write_int8(description: &Description<'_>, int8: &[Option<Int8Description>]) -> Result<Vec<u8>, WeightError> {
    let Description { inputs, outputs, first, second, law, .. } = description;
    let layers: Vec<_> = first.iter().chain(second).collect();
    let version = if int8.iter().any(Option::is_some) { VERSION_INT8 } else { VERSION };
    let entry_size = if version == VERSION { size_of::<LayerEntry>() } else { size_of::<LongEntry>() };
    let tables = size_of::<Range>() * (inputs.len() + outputs.len());
    let mut image = Image(vec![0; HEADER + tables + entry_size * layers.len()]);
    let mut entries: Vec<u8> = Vec::new();
    for (number, layer) in layers.iter().enumerate() {
        let entry = image.add_layer(layer, int8.get(number).and_then(Option::as_ref));
        entries.extend(bytemuck::bytes_of(&entry).iter().take(entry_size));
    }
    let recipe = image.add(description.recipe.as_bytes());
    let Image(mut bytes) = image;
    let mut header = Header {
        magic: MAGIC,
        version,
        length: bytes.len() as u32,
        checksum: 0,
        inputs: inputs.len() as u32,
        outputs: outputs.len() as u32,
        layers: layers.len() as u32,
        first_layers: first.len() as u32,
        law: law.code(),
        constants: law.values(),
        density: description.density,
        damping: description.damping,
        step: description.step,
        exact_step: description.exact_step,
        recipe,
        recipe_length: description.recipe.len() as u32,
        recipe_hash: description.recipe_hash,
        force: u32::from(description.force == ForceInput::PerMass),
        element: description.element.code(),
        reserved: [0; 120],
    };
    let place = |bytes: &mut Vec<u8>, at: usize, part: &[u8]| bytes[at..at + part.len()].copy_from_slice(part);
    place(&mut bytes, HEADER, bytemuck::cast_slice(inputs));
    place(&mut bytes, HEADER + size_of::<Range>() * inputs.len(), bytemuck::cast_slice(outputs));
    place(&mut bytes, HEADER + tables, &entries);
    place(&mut bytes, 0, bytemuck::bytes_of(&header));
    header.checksum = crc_32(&bytes[CHECKED..]);
    place(&mut bytes, 0, bytemuck::bytes_of(&header));
    Network::parse(WeightBytes::of(&bytes).bytes())?;
    Ok(bytes)
}

/// The digits of a recipe's hash.
#[must_use]
pub fn hexadecimal(hash: &[u8; 32]) -> String {
    hash.iter().map(|byte| format!("{byte:02x}")).collect()
}
