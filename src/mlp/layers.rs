//! The layer table of a weight file (`weights/FORMAT.md`): every field is checked before a layer is handed on, and of eight-bit
//! layers that no sum can leave 32 bits, whatever goes in.

use bytemuck::{Pod, Zeroable};

use super::file::{ALIGNMENT, HEADER, WeightError, take};
use super::int8::{BLOCK, GROUP, Int8, Outputs, Quantise, WeightTile};
use super::{Activation, Layer, MAX_WIDTH, Numbers};
use crate::lanes::int8::Requantise;

/// An entry of version 1, and what begins one of version 2.
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

/// An entry of version 2.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(super) struct LongEntry {
    pub(super) entry: LayerEntry,
    /// Where the table of [`Quantise`] begins, or zero.
    pub(super) quantise: u32,
    /// Where the table of [`Requantise`] or the scales begin, or zero.
    pub(super) outputs: u32,
    pub(super) reserved: [u32; 2],
}

/// What a layer is, among its neighbours.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// From zero.
    pub(super) number: u32,
    /// Inputs that the layer must have.
    pub(super) needed: usize,
    /// Outputs that it must have, if it is the last of a part.
    pub(super) wanted: Option<usize>,
    /// Whether the layer before it in its part hands on activations.
    pub(super) after_int8: bool,
    /// Whether the layer behind it in its part takes activations.
    pub(super) before_int8: bool,
}

/// A file, and the layer that is looked at.
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
        let numbers: &[f32] = self.array(field, offset, count)?;
        match numbers.iter().position(|number| !number.is_finite()) {
            None => Ok(numbers),
            Some(index) => Err(WeightError::NotFinite { layer: self.layer, at: place::<f32>(offset, index) }),
        }
    }

    /// That a whole number is among those it may be.
    fn within(
        self,
        field: &'static str,
        at: u32,
        value: impl Into<i32>,
        least: i32,
        most: i32,
    ) -> Result<(), WeightError> {
        let value = value.into();
        if (least..=most).contains(&value) {
            Ok(())
        } else {
            Err(WeightError::Number { layer: self.layer, field, at, value })
        }
    }

    fn scale(self, field: &'static str, at: u32, value: f32) -> Result<(), WeightError> {
        if value.is_finite() && value > 0.0 {
            Ok(())
        } else {
            Err(WeightError::Scale { layer: self.layer, field, at, value })
        }
    }

    fn int8(
        self,
        entry: &LongEntry,
        activation: Activation,
        place_of: Place,
    ) -> Result<Int8<'w>, WeightError> {
        let (inputs, outputs) = (entry.entry.inputs as usize, entry.entry.outputs as usize);
        let padded = outputs.next_multiple_of(BLOCK);
        let quantise = if place_of.after_int8 {
            if entry.quantise != 0 {
                return self.wrong("the offset of the inputs' table", entry.quantise);
            }
            None
        } else {
            Some(self.quantise(entry.quantise, inputs)?)
        };
        let groups = inputs.div_ceil(GROUP);
        let weights: &[WeightTile] =
            self.array("the offset of the weights", entry.entry.weights, groups * (padded / BLOCK))?;
        let biases: &[i32] = self.array("the offset of the biases", entry.entry.biases, padded)?;
        self.sums(entry, groups, weights, biases)?;
        let results = if place_of.before_int8 {
            Outputs::Requantised(self.requantise(entry.outputs, outputs, padded, activation)?)
        } else {
            let scales: &[f32] = self.finite("the offset of the outputs' scales", entry.outputs, padded)?;
            for (index, &scale) in scales.iter().enumerate() {
                let at = place::<f32>(entry.outputs, index);
                if index < outputs {
                    self.scale("an output's scale", at, scale)?;
                } else if scale.to_bits() != 0 {
                    return Err(WeightError::Padding { layer: self.layer, at });
                }
            }
            Outputs::Float(scales)
        };
        Ok(Int8 { quantise, weights, biases, outputs: results })
    }

    fn quantise(self, offset: u32, inputs: usize) -> Result<&'w [Quantise], WeightError> {
        let table: &[Quantise] = self.array("the offset of the inputs' table", offset, inputs)?;
        for (index, by) in table.iter().enumerate() {
            let at = place::<Quantise>(offset, index);
            self.scale("an input's scale", at, by.inverse)?;
            // Converting back tells whether it is a whole number; what is none saturates or becomes zero.
            let whole = by.zero as i16;
            if f32::from(whole).to_bits() != by.zero.to_bits() {
                return Err(WeightError::Scale {
                    layer: self.layer,
                    field: "an input's zero",
                    at: at + 4,
                    value: by.zero,
                });
            }
        }
        Ok(table)
    }

    fn requantise(
        self,
        offset: u32,
        outputs: usize,
        padded: usize,
        activation: Activation,
    ) -> Result<&'w [Requantise], WeightError> {
        let table: &[Requantise] = self.array("the offset of the outputs' table", offset, padded)?;
        for (index, by) in table.iter().enumerate() {
            let at = place::<Requantise>(offset, index);
            if index >= outputs && *by != Requantise::default() {
                return Err(WeightError::Padding { layer: self.layer, at });
            }
            self.within("the factor of positive sums", at, by.positive, 0, i32::from(i16::MAX))?;
            let least = if activation == Activation::Linear { by.positive } else { 0 };
            let most = i32::from(by.positive);
            self.within("the factor of negative sums", at + 2, by.negative, least.into(), most)?;
            self.within("the shift", at + 6, by.shift, 0, 30)?;
        }
        Ok(table)
    }

    /// That no sum leaves 32 bits, and that there is nothing where there are no inputs and outputs.
    fn sums(
        self,
        entry: &LongEntry,
        groups: usize,
        weights: &[WeightTile],
        biases: &[i32],
    ) -> Result<(), WeightError> {
        let LayerEntry { inputs, outputs, weights: start, biases: biases_start, .. } = entry.entry;
        let rows = weights.chunks_exact(groups.max(1)).zip(biases.chunks_exact(BLOCK));
        for (block, (tiles, biases)) in rows.enumerate() {
            for (row, &bias) in biases.iter().enumerate() {
                let output = block * BLOCK + row;
                let mut largest = i64::from(bias).abs();
                for (group, tile) in tiles.iter().enumerate() {
                    let Some(four) = tile.get(row) else {
                        continue;
                    };
                    for (index, &weight) in four.iter().enumerate() {
                        let tile = block * groups + group;
                        let at = start + (size_of::<WeightTile>() * tile + GROUP * row + index) as u32;
                        self.within("a weight", at, weight, -127, 127)?;
                        if weight != 0
                            && (group * GROUP + index >= inputs as usize || output >= outputs as usize)
                        {
                            return Err(WeightError::Padding { layer: self.layer, at });
                        }
                        largest += 255 * i64::from(weight).abs();
                    }
                }
                if output >= outputs as usize && bias != 0 {
                    let at = place::<i32>(biases_start, output);
                    return Err(WeightError::Padding { layer: self.layer, at });
                }
                if largest > i64::from(i32::MAX) {
                    return Err(WeightError::Overflow {
                        layer: self.layer,
                        output: output as u32,
                        sum: largest,
                    });
                }
            }
        }
        Ok(())
    }
}

/// Byte of the file at which a number of an array stands.
const fn place<T>(offset: u32, index: usize) -> u32 {
    offset.saturating_add((size_of::<T>() * index) as u32)
}

/// A layer, of an entry that has been read.
pub(super) fn checked_layer<'w>(
    bytes: &'w [u8],
    long: &LongEntry,
    place_of: Place,
) -> Result<Layer<'w>, WeightError> {
    let entry = &long.entry;
    let arrays = Arrays { bytes, layer: place_of.number };
    let (inputs, outputs) = (entry.inputs as usize, entry.outputs as usize);
    if inputs != place_of.needed {
        return arrays.wrong("the number of inputs", entry.inputs);
    }
    if outputs == 0 || outputs > MAX_WIDTH || place_of.wanted.is_some_and(|wanted| outputs != wanted) {
        return arrays.wrong("the number of outputs", entry.outputs);
    }
    let activation = match entry.activation {
        0 => Activation::Linear,
        1 if (0.0..=1.0).contains(&entry.slope) => Activation::LeakyRelu { slope: entry.slope },
        1 => return Err(WeightError::Slope { layer: place_of.number, slope: entry.slope }),
        code => return arrays.wrong("the activation", code),
    };
    if let Some(&reserved) = [entry.reserved].iter().chain(&long.reserved).find(|&&word| word != 0) {
        return arrays.wrong("the reserved field", reserved);
    }
    let numbers = match entry.precision {
        0 => {
            if long.quantise != 0 {
                return arrays.wrong("the offset of the inputs' table", long.quantise);
            }
            if long.outputs != 0 {
                return arrays.wrong("the offset of the outputs' table", long.outputs);
            }
            let weights = arrays.finite("the offset of the weights", entry.weights, inputs * outputs)?;
            let biases = arrays.finite("the offset of the biases", entry.biases, outputs)?;
            Numbers::Float { weights, biases }
        }
        _ => Numbers::Int8(arrays.int8(long, activation, place_of)?),
    };
    Ok(Layer { inputs, outputs, activation, numbers })
}
