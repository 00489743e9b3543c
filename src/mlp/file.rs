//! Weight files (`weights/FORMAT.md`, versions 1 and 3): little-endian, checksummed, read where they are. Nothing of a
//! file is believed before its checksum and every field have been checked.

use core::fmt;

use bytemuck::{Pod, Zeroable, try_cast_slice};

use super::layers::{LayerEntry, LongEntry, Place, checked_layer};
use super::{Layer, MAX_INPUTS, MAX_LAYERS, MAX_OUTPUTS};
use crate::checksum::crc_32;
use crate::material::{AnyLaw, Element, Law, MAX_CONSTANTS};

#[cfg(target_endian = "big")]
compile_error!("weight files are little-endian and read in place");

/// First bytes of a weight file.
pub const MAGIC: [u8; 8] = *b"SUPPLE-W";
/// All layers in float32.
pub(super) const VERSION: u32 = 1;
/// Layers may be in int8. Version 2, with another kind of int8, was never released.
pub(super) const VERSION_INT8: u32 = 3;
/// Arrays begin at multiples of this.
pub(super) const ALIGNMENT: usize = 64;
/// Where the checksum's bytes begin.
pub(super) const CHECKED: usize = 20;

/// The first bytes of a file.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Header {
    pub(super) magic: [u8; 8],
    pub(super) version: u32,
    pub(super) length: u32,
    pub(super) checksum: u32,
    pub(super) inputs: u32,
    pub(super) outputs: u32,
    pub(super) layers: u32,
    pub(super) first_layers: u32,
    pub(super) law: u32,
    pub(super) constants: [f32; MAX_CONSTANTS],
    pub(super) density: f32,
    pub(super) damping: f32,
    pub(super) step: f32,
    pub(super) exact_step: f32,
    pub(super) recipe: u32,
    pub(super) recipe_length: u32,
    pub(super) recipe_hash: [u8; 32],
    pub(super) force: u32,
    pub(super) element: u32,
    pub(super) reserved: [u8; 120],
}

pub(super) const HEADER: usize = size_of::<Header>();
const _: () = assert!(HEADER == 240);

/// Scale of an input or output, and the range it had in training, in its own unit.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Range {
    /// Divides an input, multiplies an output.
    pub scale: f32,
    /// The least seen in training.
    pub least: f32,
    /// The most.
    pub most: f32,
}

/// How the learned step shows a vertex's force to the network.
#[derive(Clone, Copy, Debug, Default, Eq, PartialEq)]
#[cfg_attr(
    any(feature = "safetensors", feature = "train"),
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum ForceInput {
    /// In N, as in the paper. A vertex at the surface, where less mass is lumped, moves more under the same force than
    /// one inside, and the network cannot tell which it has before it.
    #[default]
    Newton,
    /// Over the vertex's lumped mass, m/s^2.
    PerMass,
}

/// What a network was trained on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recipe<'w> {
    /// Law and constants.
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
    pub text: &'w str,
    /// SHA-256 of the text.
    pub hash: [u8; 32],
}

/// Why bytes are not a usable weight file.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum WeightError {
    /// The memory does not begin at a multiple of four bytes.
    Misaligned,
    /// Fewer bytes than a file has at least, or than it says it has.
    Short {
        /// Bytes needed.
        needed: usize,
        /// Bytes there.
        bytes: usize,
    },
    /// It does not begin like a weight file.
    NotWeights,
    /// A version that this library does not know.
    Version {
        /// The version.
        version: u32,
    },
    /// The checksum is not that of the bytes.
    Checksum {
        /// As the file says.
        stated: u32,
        /// As it is.
        found: u32,
    },
    /// A field of the header is not one it can have.
    Header {
        /// Which.
        field: &'static str,
        /// Its value.
        value: f32,
    },
    /// The scale is not positive, or the range is empty or not finite.
    Range {
        /// "input" or "output".
        kind: &'static str,
        /// Which, from zero.
        index: u32,
        /// What it says.
        range: Range,
    },
    /// A field of the layer table is not one it can have.
    Layer {
        /// Which layer, from zero.
        layer: u32,
        /// Which field.
        field: &'static str,
        /// Its value.
        value: u32,
    },
    /// A slope is not from zero to one.
    Slope {
        /// Which layer, from zero.
        layer: u32,
        /// Its value.
        slope: f32,
    },
    /// A weight or bias is not finite.
    NotFinite {
        /// Which layer, from zero.
        layer: u32,
        /// Byte of the file.
        at: u32,
    },
    /// A whole number of an int8 layer is not one it can be.
    Number {
        /// Which layer, from zero.
        layer: u32,
        /// What it is.
        field: &'static str,
        /// Byte of the file.
        at: u32,
        /// Its value.
        value: i32,
    },
    /// A scale of an int8 layer is not positive.
    Scale {
        /// Which layer, from zero.
        layer: u32,
        /// Byte of the file.
        at: u32,
        /// Its value.
        value: f32,
    },
    /// Something other than zero where an int8 layer has no input or output.
    Padding {
        /// Which layer, from zero.
        layer: u32,
        /// Byte of the file.
        at: u32,
    },
    /// The recipe lies outside the file or is not UTF-8.
    Recipe {
        /// First byte.
        at: u32,
        /// Bytes.
        length: u32,
    },
}

impl fmt::Display for WeightError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Misaligned => write!(f, "the weights are not at a multiple of 4 bytes in memory"),
            Self::Short { needed, bytes } => write!(f, "{bytes} bytes, a weight file needs {needed}"),
            Self::NotWeights => write!(f, "it does not begin with SUPPLE-W: not a weight file"),
            Self::Version { version } => {
                write!(f, "version {version} of the weight format; this library reads {VERSION} and {VERSION_INT8}")
            }
            Self::Checksum { stated, found } => {
                write!(f, "checksum {found:08x} of the weights, the file says {stated:08x}: it is damaged")
            }
            Self::Header { field, value } => write!(f, "{field} is {value}"),
            Self::Range { kind, index, range: Range { scale, least, most } } => {
                write!(f, "{kind} {index}: scale {scale}, range {least} to {most}")
            }
            Self::Layer { layer, field, value } => write!(f, "layer {layer}: {field} is {value}"),
            Self::Slope { layer, slope } => {
                write!(f, "layer {layer}: slope is {slope}, it must be from 0 to 1")
            }
            Self::NotFinite { layer, at } => {
                write!(f, "layer {layer}: the number at byte {at} is not finite")
            }
            Self::Number { layer, field, at, value } => {
                write!(f, "layer {layer}: {field}, at byte {at}, is {value}")
            }
            Self::Scale { layer, at, value } => {
                write!(f, "layer {layer}: an output's scale, at byte {at}, is {value}")
            }
            Self::Padding { layer, at } => {
                write!(f, "layer {layer}: byte {at} belongs to no input or output and is not zero")
            }
            Self::Recipe { at, length } => {
                write!(f, "the recipe, {length} bytes from byte {at} on, is not text in the file")
            }
        }
    }
}

impl core::error::Error for WeightError {}

/// A network whose parameters lie in the bytes of a weight file.
#[derive(Clone, Copy, Debug)]
pub struct Network<'w> {
    pub(super) inputs: &'w [Range],
    pub(super) outputs: &'w [Range],
    pub(super) layers: [Layer<'w>; MAX_LAYERS],
    pub(super) count: usize,
    /// Layers of the first part.
    pub(super) first: usize,
    /// Whether any layer is in int8.
    int8: bool,
    recipe: Recipe<'w>,
}

/// `size_of::<T>() * count` bytes from `*at` on, which moves behind them.
pub(super) fn take<'w, T: Pod>(bytes: &'w [u8], at: &mut usize, count: usize) -> Result<&'w [T], WeightError> {
    let end = size_of::<T>().checked_mul(count).and_then(|size| size.checked_add(*at)).unwrap_or(usize::MAX);
    let slice = bytes.get(*at..end).ok_or(WeightError::Short { needed: end, bytes: bytes.len() })?;
    *at = end;
    try_cast_slice(slice).map_err(|_| WeightError::Misaligned)
}

fn positive(field: &'static str, value: f32) -> Result<f32, WeightError> {
    if value.is_finite() && value > 0.0 { Ok(value) } else { Err(WeightError::Header { field, value }) }
}

fn within(field: &'static str, value: u32, most: usize) -> Result<usize, WeightError> {
    if value >= 1 && value as usize <= most {
        Ok(value as usize)
    } else {
        Err(WeightError::Header { field, value: value as f32 })
    }
}

fn checked_ranges<'w>(kind: &'static str, ranges: &'w [Range]) -> Result<&'w [Range], WeightError> {
    let bad = |range: &Range| {
        let Range { scale, least, most } = *range;
        !(scale.is_finite() && scale > 0.0 && least.is_finite() && most.is_finite() && least <= most)
    };
    match ranges.iter().position(bad) {
        None => Ok(ranges),
        Some(index) => Err(WeightError::Range {
            kind,
            index: index as u32,
            range: ranges.get(index).copied().unwrap_or(Range { scale: 0.0, least: 0.0, most: 0.0 }),
        }),
    }
}

impl<'w> Network<'w> {
    /// Reads a weight file where it is. The bytes must begin at a multiple of four, better of 64; bytes behind the
    /// file are ignored.
    pub fn parse(bytes: &'w [u8]) -> Result<Self, WeightError> {
        let mut at = 0;
        let header: &[Header] = take(bytes, &mut at, 1)?;
        let Some(header) = header.first() else {
            return Err(WeightError::Short { needed: HEADER, bytes: bytes.len() });
        };
        if header.magic != MAGIC {
            return Err(WeightError::NotWeights);
        }
        if header.version != VERSION && header.version != VERSION_INT8 {
            return Err(WeightError::Version { version: header.version });
        }
        let length = header.length as usize;
        if length < HEADER {
            return Err(WeightError::Header { field: "the length", value: length as f32 });
        }
        let bytes = bytes.get(..length).ok_or(WeightError::Short { needed: length, bytes: bytes.len() })?;
        let found = crc_32(bytes.get(CHECKED..).unwrap_or_default());
        if found != header.checksum {
            return Err(WeightError::Checksum { stated: header.checksum, found });
        }
        if header.reserved.iter().any(|&byte| byte != 0) {
            return Err(WeightError::Header { field: "a reserved byte", value: 1.0 });
        }
        let inputs = within("the number of inputs", header.inputs, MAX_INPUTS)?;
        let outputs = within("the number of outputs", header.outputs, MAX_OUTPUTS)?;
        let count = within("the number of layers", header.layers, MAX_LAYERS)?;
        let first = within("the number of layers of the first part", header.first_layers, count)?;
        let recipe = recipe(header, bytes)?;
        let inputs = checked_ranges("input", take(bytes, &mut at, inputs)?)?;
        let outputs = checked_ranges("output", take(bytes, &mut at, outputs)?)?;
        let mut entries = [LongEntry::default(); MAX_LAYERS];
        if header.version == VERSION {
            let short: &[LayerEntry] = take(bytes, &mut at, count)?;
            for (long, &entry) in entries.iter_mut().zip(short) {
                long.entry = entry;
            }
        } else {
            for (long, &entry) in entries.iter_mut().zip(take(bytes, &mut at, count)?) {
                *long = entry;
            }
        }
        let most = u32::from(header.version == VERSION_INT8);
        let entries = entries.get(..count).unwrap_or_default();
        let mut layers = [Layer::NONE; MAX_LAYERS];
        for (number, (layer, entry)) in layers.iter_mut().zip(entries).enumerate() {
            let precision = entry.entry.precision;
            if precision > most {
                let field = "the precision";
                return Err(WeightError::Layer { layer: number as u32, field, value: precision });
            }
            let other = |number: usize| entries.get(number).map_or(LayerEntry::default(), |long| long.entry);
            let last = number + 1 == first || number + 1 == count;
            let place = Place {
                layer: number as u32,
                // The second part sees what the first has predicted.
                needed: match number {
                    0 => inputs.len(),
                    _ if number == first => inputs.len() + outputs.len(),
                    _ => other(number - 1).outputs as usize,
                },
                wanted: if last { Some(outputs.len()) } else { None },
            };
            *layer = checked_layer(bytes, entry, place)?;
        }
        let int8 = layers.iter().any(Layer::is_int8);
        Ok(Self { inputs, outputs, layers, count, first, int8, recipe })
    }

    /// Whether any layer is in int8; then the same input gives the same bits on every processor.
    #[must_use]
    pub const fn has_int8(&self) -> bool {
        self.int8
    }

    /// Scale and training range of each input.
    #[must_use]
    pub const fn inputs(&self) -> &'w [Range] {
        self.inputs
    }

    /// Scale and range, to which they are clipped, of each output.
    #[must_use]
    pub const fn outputs(&self) -> &'w [Range] {
        self.outputs
    }

    /// The layers of both parts.
    #[must_use]
    pub fn layers(&self) -> (&[Layer<'w>], &[Layer<'w>]) {
        self.layers.get(..self.count).unwrap_or_default().split_at_checked(self.first).unwrap_or_default()
    }

    /// What it was trained on.
    #[must_use]
    pub const fn recipe(&self) -> &Recipe<'w> {
        &self.recipe
    }

    /// Multiplications and additions of one prediction.
    #[must_use]
    pub fn multiply_adds(&self) -> usize {
        self.layers.iter().map(Layer::multiply_adds).sum()
    }
}

fn recipe<'w>(header: &Header, bytes: &'w [u8]) -> Result<Recipe<'w>, WeightError> {
    let law = AnyLaw::all().find(|law| law.code() == header.law);
    let law = law.ok_or(WeightError::Header { field: "the law", value: header.law as f32 })?;
    for (constant, &value) in law.constants().iter().zip(&header.constants) {
        positive(constant.name, value)?;
    }
    let damping = header.damping;
    if !(damping.is_finite() && damping >= 0.0) {
        return Err(WeightError::Header { field: "the damping", value: damping });
    }
    let force = match header.force {
        0 => ForceInput::Newton,
        1 => ForceInput::PerMass,
        code => return Err(WeightError::Header { field: "the unit of force", value: code as f32 }),
    };
    let element = Element::of_code(header.element);
    let element = element.ok_or(WeightError::Header { field: "the element", value: header.element as f32 })?;
    let (at, length) = (header.recipe, header.recipe_length);
    let end = (at as usize).checked_add(length as usize);
    let text = end.and_then(|end| bytes.get(at as usize..end)).and_then(|text| core::str::from_utf8(text).ok());
    Ok(Recipe {
        law: law.with(header.constants),
        density: positive("the density", header.density)?,
        element,
        damping,
        step: positive("the step", header.step)?,
        exact_step: positive("the exact step", header.exact_step)?,
        force,
        text: text.ok_or(WeightError::Recipe { at, length })?,
        hash: header.recipe_hash,
    })
}
