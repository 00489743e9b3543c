//! The layer table of a weight file (`weights/FORMAT.md`): every field is checked before a layer is handed on.

use bytemuck::{Pod, Zeroable};

use super::file::{ALIGNMENT, HEADER, WeightError, take};
use super::int8::{GROUP, Int8, TILE_ROWS, WeightTile};
use super::{Activation, Layer, MAX_WIDTH, Parameters};

/// An entry of version 1; one of version 3 begins with it.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LayerEntry {
    pub(super) inputs: u32,
    pub(super) outputs: u32,
    pub(super) activation: u32,
    pub(super) slope: f32,
    pub(super) precision: u32,
    pub(super) weights: u32,
    pub(super) biases: u32,
    pub(super) reserved: u32,
}

/// An entry of version 3.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LongEntry {
    pub(super) entry: LayerEntry,
    /// Byte at which the starts of the sums begin, zero for a layer in float32.
    pub(super) starts: u32,
    /// Byte at which the scales begin, or zero.
    pub(super) scales: u32,
    /// The activation that stands for zero, or zero.
    pub(super) zero: u32,
    pub(super) reserved: u32,
}

/// Where a layer stands among the others, and what it must fit.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// Through both parts, from zero.
    pub(super) layer: u32,
    /// Inputs that the layer must have.
    pub(super) needed: usize,
    /// Outputs that it must have, if it is the last of a part.
    pub(super) wanted: Option<usize>,
}

/// The arrays of a layer.
#[derive(Clone, Copy)]
struct Arrays<'w> {
    bytes: &'w [u8],
    layer: u32,
}

impl<'w> Arrays<'w> {
    fn wrong<T>(self, field: &'static str, value: u32) -> Result<T, WeightError> {
        Err(WeightError::Layer { layer: self.layer, field, value })
    }

    fn array<T: Pod>(self, field: &'static str, offset: u32, count: usize) -> Result<&'w [T], WeightError> {
        let mut at = offset as usize;
        if !at.is_multiple_of(ALIGNMENT) || at < HEADER {
            return self.wrong(field, offset);
        }
        take(self.bytes, &mut at, count)
    }

    fn finite(self, field: &'static str, offset: u32, count: usize) -> Result<&'w [f32], WeightError> {
        let values: &[f32] = self.array(field, offset, count)?;
        match values.iter().position(|value| !value.is_finite()) {
            None => Ok(values),
            Some(index) => Err(WeightError::NotFinite { layer: self.layer, at: byte_of::<f32>(offset, index) }),
        }
    }

    fn int8(self, long: &LongEntry) -> Result<Int8<'w>, WeightError> {
        let LayerEntry { inputs, outputs, weights: start, biases, .. } = long.entry;
        let (inputs, outputs) = (inputs as usize, outputs as usize);
        let (groups, padded) = (inputs.div_ceil(GROUP), outputs.next_multiple_of(TILE_ROWS));
        let Some(zero) = u8::try_from(long.zero).ok().filter(|zero| (1..u8::MAX).contains(zero)) else {
            return self.wrong("the activation for zero", long.zero);
        };
        let weights: &[WeightTile] = self.array("the offset of the weights", start, groups * (padded / TILE_ROWS))?;
        let starts: &[i32] = self.array("the offset of the sums' starts", long.starts, padded)?;
        let scales = self.finite("the offset of the scales", long.scales, padded)?;
        let floats = self.finite("the offset of the biases", biases, padded)?;
        for (output, ((&first, &scale), &bias)) in starts.iter().zip(scales).zip(floats).enumerate() {
            let mut sum = 0;
            for group in 0..groups {
                let tile = output / TILE_ROWS * groups + group;
                let four = weights.get(tile).and_then(|tile| tile.get(output % TILE_ROWS)).copied();
                for (index, weight) in four.unwrap_or_default().into_iter().enumerate() {
                    let row = size_of::<WeightTile>() * tile + GROUP * (output % TILE_ROWS);
                    let at = start + (row + index) as u32;
                    self.number("a weight", at, weight.into(), weight != i8::MIN)?;
                    self.padding(at, weight == 0 || group * GROUP + index < inputs && output < outputs)?;
                    sum += i32::from(weight);
                }
            }
            let at = byte_of::<i32>(long.starts, output);
            self.number("the start of a sum", at, first, first == -i32::from(zero) * sum)?;
            let at = byte_of::<f32>(long.scales, output);
            if output >= outputs {
                self.padding(at, scale.to_bits() == 0)?;
                self.padding(byte_of::<f32>(biases, output), bias.to_bits() == 0)?;
            } else if scale <= 0.0 {
                return Err(WeightError::Scale { layer: self.layer, at, value: scale });
            }
        }
        Ok(Int8 { zero, weights, starts, scales, biases: floats })
    }

    /// Refuses a whole number that is not sound.
    fn number(self, field: &'static str, at: u32, value: i32, sound: bool) -> Result<(), WeightError> {
        if sound { Ok(()) } else { Err(WeightError::Number { layer: self.layer, field, at, value }) }
    }

    fn padding(self, at: u32, sound: bool) -> Result<(), WeightError> {
        if sound { Ok(()) } else { Err(WeightError::Padding { layer: self.layer, at }) }
    }
}

/// Byte of the file at which an array's value stands.
const fn byte_of<T>(offset: u32, index: usize) -> u32 {
    offset.saturating_add((size_of::<T>() * index) as u32)
}

/// The layer that an entry describes.
pub(super) fn checked_layer<'w>(bytes: &'w [u8], long: &LongEntry, place: Place) -> Result<Layer<'w>, WeightError> {
    let entry = &long.entry;
    let arrays = Arrays { bytes, layer: place.layer };
    let (inputs, outputs) = (entry.inputs as usize, entry.outputs as usize);
    if inputs != place.needed {
        return arrays.wrong("the number of inputs", entry.inputs);
    }
    if outputs == 0 || outputs > MAX_WIDTH || place.wanted.is_some_and(|wanted| outputs != wanted) {
        return arrays.wrong("the number of outputs", entry.outputs);
    }
    let activation = match entry.activation {
        0 => Activation::Linear,
        1 if (0.0..=1.0).contains(&entry.slope) => Activation::LeakyRelu { slope: entry.slope },
        1 => return Err(WeightError::Slope { layer: place.layer, slope: entry.slope }),
        code => return arrays.wrong("the activation", code),
    };
    if let Some(reserved) = [entry.reserved, long.reserved].into_iter().find(|&word| word != 0) {
        return arrays.wrong("the reserved field", reserved);
    }
    let parameters = match entry.precision {
        0 => {
            for (field, value) in [
                ("the offset of the sums' starts", long.starts),
                ("the offset of the scales", long.scales),
                ("the activation for zero", long.zero),
            ] {
                if value != 0 {
                    return arrays.wrong(field, value);
                }
            }
            let weights = arrays.finite("the offset of the weights", entry.weights, inputs * outputs)?;
            let biases = arrays.finite("the offset of the biases", entry.biases, outputs)?;
            Parameters::Float { weights, biases }
        }
        _ => Parameters::Int8(arrays.int8(long)?),
    };
    Ok(Layer { inputs, outputs, activation, parameters })
}
