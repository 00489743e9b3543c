//! Networks to and from safetensors, the files of PyTorch (`weights/FORMAT.md`, with the code that loads one there).
//!
//! Weights and biases are tensors of float32, named as a module with two lists of linear layers names them:
//! `first.0.weight` (outputs x inputs), `first.0.bias` (outputs), ..., `second.0.weight`, ... All else that a weight
//! file holds is a JSON object under the key `supple` of the metadata. It is one key because the order of several would
//! change from run to run. Floats are written so that they come back to the bit: a file of [`super::write`] is the same
//! after there and back.

use core::fmt;
use std::collections::BTreeMap;
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

use ::safetensors::tensor::{Dtype, Metadata, SafeTensors, TensorView, serialize};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::value::RawValue;

use super::file::VERSION;
use super::{
    Activation, Description, ForceInput, Layer, LayerDescription, MAX_WIDTH, Network, Parameters, Range, WeightError,
    hexadecimal, write,
};
use crate::material::{AnyLaw, Element, Law, MAX_CONSTANTS};

/// The key of the metadata.
const KEY: &str = "supple";

/// Why a network does not come from or go to a safetensors file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ExchangeError {
    /// Not a safetensors file, or one that cannot be written.
    File(String),
    /// A tensor that the metadata's layers need is not there.
    MissingTensor(String),
    /// A tensor that no layer of the metadata has.
    UnknownTensor(String),
    /// A tensor does not hold float32.
    Type {
        /// Its name.
        tensor: String,
        /// What it holds.
        found: String,
    },
    /// A tensor does not have the shape that the layers before and after it need.
    Shape {
        /// Its name.
        tensor: String,
        /// Its shape.
        found: Vec<usize>,
        /// What it must be.
        wanted: String,
    },
    /// A value of a tensor is not finite.
    NotFinite {
        /// Its name.
        tensor: String,
        /// Its index, the last axis running fastest.
        index: usize,
        /// The value.
        value: f32,
    },
    /// A key of the metadata is missing, unknown, or holds what it cannot hold.
    Key {
        /// Which.
        key: String,
        /// What is wrong.
        problem: String,
    },
    /// A layer is in int8: PyTorch trains the float32 network that it was made from.
    Int8 {
        /// Which layer, from zero.
        layer: u32,
    },
    /// What the file says makes no network.
    Weights(WeightError),
}

impl fmt::Display for ExchangeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(problem) => write!(f, "{problem}"),
            Self::MissingTensor(name) => write!(f, "tensor {name} is missing"),
            Self::UnknownTensor(name) => write!(f, "tensor {name} belongs to no layer of the metadata"),
            Self::Type { tensor, found } => write!(f, "tensor {tensor} holds {found}, it must hold F32"),
            Self::Shape { tensor, found, wanted } => {
                write!(f, "tensor {tensor} has the shape {found:?}, it must be {wanted}")
            }
            Self::NotFinite { tensor, index, value } => {
                write!(f, "tensor {tensor}: number {index} is {value}")
            }
            Self::Key { key, problem } => write!(f, "metadata key {key}: {problem}"),
            Self::Int8 { layer } => {
                write!(f, "layer {layer} is in int8; export the float32 file that it was made from")
            }
            Self::Weights(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for ExchangeError {}

impl From<WeightError> for ExchangeError {
    fn from(error: WeightError) -> Self {
        Self::Weights(error)
    }
}

fn refused(key: &str, problem: impl fmt::Display) -> ExchangeError {
    ExchangeError::Key { key: key.to_string(), problem: problem.to_string() }
}

/// The metadata, in the order of writing.
#[derive(Serialize)]
struct About {
    version: u32,
    inputs: BTreeMap<&'static str, Vec<f32>>,
    outputs: BTreeMap<&'static str, Vec<f32>>,
    /// Slope of the leaky ReLU of each layer, null for none.
    slopes: BTreeMap<&'static str, Vec<Option<f32>>>,
    law: &'static str,
    constants: BTreeMap<&'static str, f32>,
    density: f32,
    /// Left out where it is the linear one.
    #[serde(skip_serializing_if = "Option::is_none")]
    element: Option<Element>,
    damping: f32,
    step: f32,
    exact_step: f32,
    /// Left out where it is the paper's.
    #[serde(skip_serializing_if = "Option::is_none")]
    force: Option<ForceInput>,
    recipe: String,
    recipe_sha256: String,
}

impl About {
    fn of(network: &Network<'_>) -> Self {
        let ranges = |ranges: &[Range]| {
            let column = |value: fn(&Range) -> f32| ranges.iter().map(value).collect();
            BTreeMap::from([
                ("scale", column(|range| range.scale)),
                ("least", column(|range| range.least)),
                ("most", column(|range| range.most)),
            ])
        };
        let slopes = |layers: &[Layer<'_>]| {
            let slope = |layer: &Layer<'_>| match layer.activation {
                Activation::Linear => None,
                Activation::LeakyRelu { slope } => Some(slope),
            };
            layers.iter().map(slope).collect()
        };
        let (first, second) = network.layers();
        let recipe = network.recipe();
        let names = recipe.law.constants().iter().map(|constant| constant.name);
        Self {
            version: VERSION,
            inputs: ranges(network.inputs()),
            outputs: ranges(network.outputs()),
            slopes: BTreeMap::from([("first", slopes(first)), ("second", slopes(second))]),
            law: recipe.law.name(),
            constants: names.zip(recipe.law.values()).collect(),
            density: recipe.density,
            element: (recipe.element != Element::default()).then_some(recipe.element),
            damping: recipe.damping,
            step: recipe.step,
            exact_step: recipe.exact_step,
            force: (recipe.force != ForceInput::default()).then_some(recipe.force),
            recipe: recipe.text.to_string(),
            recipe_sha256: hexadecimal(&recipe.hash),
        }
    }
}

/// The bytes of a safetensors file. The same network gives the same bytes.
pub fn to_safetensors(network: &Network<'_>) -> Result<Vec<u8>, ExchangeError> {
    let file = |error: &dyn fmt::Display| ExchangeError::File(error.to_string());
    let about = serde_json::to_string(&About::of(network)).map_err(|error| file(&error))?;
    let (first, second) = network.layers();
    let mut tensors = Vec::new();
    if let Some(layer) = first.iter().chain(second).position(Layer::is_int8) {
        return Err(ExchangeError::Int8 { layer: layer as u32 });
    }
    for (part, layers) in [("first", first), ("second", second)] {
        for (index, layer) in layers.iter().enumerate() {
            let Parameters::Float { weights, biases } = layer.parameters else {
                continue;
            };
            let arrays = [
                ("weight", weights, std::vec![layer.outputs, layer.inputs]),
                ("bias", biases, std::vec![layer.outputs]),
            ];
            for (kind, values, shape) in arrays {
                let view = TensorView::new(Dtype::F32, shape, bytemuck::cast_slice(values));
                tensors.push((format!("{part}.{index}.{kind}"), view.map_err(|error| file(&error))?));
            }
        }
    }
    let metadata = core::iter::once((KEY.to_string(), about)).collect();
    serialize(tensors, Some(metadata)).map_err(|error| file(&error))
}

/// The bytes of a weight file from those of a safetensors file.
pub fn from_safetensors(bytes: &[u8]) -> Result<Vec<u8>, ExchangeError> {
    let unreadable = |error| ExchangeError::File(format!("not a safetensors file: {error}"));
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(unreadable)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(unreadable)?;
    let mut about = Keys::of(&metadata)?;
    let version: u32 = about.take("version")?;
    if version != VERSION {
        return Err(refused("version", format!("it is {version}, an export has {VERSION}")));
    }
    let (inputs, outputs) = (about.ranges("inputs")?, about.ranges("outputs")?);
    let mut slopes = about.keys("slopes")?;
    let (first, second) = (slopes.take("first")?, slopes.take("second")?);
    slopes.end()?;
    let law = about.law()?;
    let recipe: String = about.take("recipe")?;
    let hash: String = about.take("recipe_sha256")?;
    let description = Description {
        first: part(&tensors, "first", first, inputs.len(), outputs.len())?,
        second: part(&tensors, "second", second, inputs.len() + outputs.len(), outputs.len())?,
        inputs,
        outputs,
        law,
        density: about.take("density")?,
        element: about.take_if_there("element")?.unwrap_or_default(),
        damping: about.take("damping")?,
        step: about.take("step")?,
        exact_step: about.take("exact_step")?,
        force: about.take_if_there("force")?.unwrap_or_default(),
        recipe: &recipe,
        recipe_hash: sha256(&hash)?,
    };
    about.end()?;
    let known = |name: &str| {
        let layers = [("first", &description.first), ("second", &description.second)];
        layers.iter().any(|(part, layers)| {
            (0..layers.len())
                .any(|index| ["weight", "bias"].iter().any(|kind| name == format!("{part}.{index}.{kind}")))
        })
    };
    let mut names = tensors.names();
    names.sort_unstable();
    if let Some(name) = names.into_iter().find(|name| !known(name)) {
        return Err(ExchangeError::UnknownTensor(name.to_string()));
    }
    Ok(write(&description)?)
}

/// The layers of a part whose slopes are given.
fn part(
    tensors: &SafeTensors<'_>,
    name: &str,
    slopes: Vec<Option<f32>>,
    mut inputs: usize,
    outputs: usize,
) -> Result<Vec<LayerDescription>, ExchangeError> {
    let mut layers = Vec::new();
    let last = slopes.len().saturating_sub(1);
    for (index, slope) in slopes.into_iter().enumerate() {
        let activation = match slope {
            None => Activation::Linear,
            Some(slope) if (0.0..=1.0).contains(&slope) => Activation::LeakyRelu { slope },
            Some(slope) => {
                let problem = format!("layer {index} of {name} has {slope}, it must be from 0 to 1");
                return Err(refused("slopes", problem));
            }
        };
        let tensor = format!("{name}.{index}.weight");
        let (shape, weights) = shape_and_values(tensors, &tensor)?;
        let width = match *shape {
            [width, depth] if depth == inputs && (1..=MAX_WIDTH).contains(&width) => width,
            _ => 0,
        };
        if width == 0 || (index == last && width != outputs) {
            let rows = if index == last { outputs.to_string() } else { format!("1 to {MAX_WIDTH}") };
            return Err(ExchangeError::Shape { tensor, found: shape, wanted: format!("[{rows}, {inputs}]") });
        }
        let tensor = format!("{name}.{index}.bias");
        let (shape, biases) = shape_and_values(tensors, &tensor)?;
        if shape != [width] {
            return Err(ExchangeError::Shape { tensor, found: shape, wanted: format!("[{width}]") });
        }
        layers.push(LayerDescription { inputs, activation, weights, biases });
        inputs = width;
    }
    Ok(layers)
}

/// Of a tensor of float32.
fn shape_and_values(tensors: &SafeTensors<'_>, name: &str) -> Result<(Vec<usize>, Vec<f32>), ExchangeError> {
    let tensor = || name.to_string();
    let view = tensors.tensor(name).map_err(|_| ExchangeError::MissingTensor(tensor()))?;
    if view.dtype() != Dtype::F32 {
        return Err(ExchangeError::Type { tensor: tensor(), found: format!("{:?}", view.dtype()) });
    }
    let (words, _) = view.data().as_chunks();
    let values: Vec<f32> = words.iter().map(|word| f32::from_le_bytes(*word)).collect();
    match values.iter().enumerate().find(|(_, value)| !value.is_finite()) {
        None => Ok((view.shape().to_vec(), values)),
        Some((index, &value)) => Err(ExchangeError::NotFinite { tensor: tensor(), index, value }),
    }
}

/// The 32 bytes of 64 hexadecimal digits.
fn sha256(text: &str) -> Result<[u8; 32], ExchangeError> {
    let problem = || refused("recipe_sha256", format!("\"{text}\" is not 64 hexadecimal digits"));
    let (pairs, rest) = text.as_bytes().as_chunks::<2>();
    let mut hash = [0; 32];
    if pairs.len() != hash.len() || !rest.is_empty() {
        return Err(problem());
    }
    for (byte, pair) in hash.iter_mut().zip(pairs) {
        let digit = |letter: u8| char::from(letter).to_digit(16).ok_or_else(problem);
        let [high, low] = *pair;
        *byte = (16 * digit(high)? + digit(low)?) as u8;
    }
    Ok(hash)
}

/// Keys of an object that have not been taken yet, and the path of the object.
struct Keys {
    within: String,
    keys: BTreeMap<String, std::boxed::Box<RawValue>>,
}

impl Keys {
    fn of(metadata: &Metadata) -> Result<Self, ExchangeError> {
        let text = metadata.metadata().as_ref().and_then(|keys| keys.get(KEY));
        let text = text.ok_or_else(|| refused(KEY, "missing"))?;
        let keys = serde_json::from_str(text).map_err(|error| refused(KEY, error))?;
        Ok(Self { within: String::new(), keys })
    }

    fn name(&self, key: &str) -> String {
        format!("{}{key}", self.within)
    }

    fn take<T: DeserializeOwned>(&mut self, key: &str) -> Result<T, ExchangeError> {
        self.take_if_there(key)?.ok_or_else(|| refused(&self.name(key), "missing"))
    }

    fn take_if_there<T: DeserializeOwned>(&mut self, key: &str) -> Result<Option<T>, ExchangeError> {
        let Some(value) = self.keys.remove(key) else {
            return Ok(None);
        };
        serde_json::from_str(value.get()).map(Some).map_err(|error| {
            // The parser counts lines and columns within this key, so the message shows its text instead.
            let (error, shown) = (error.to_string(), value.get().chars().take(40).collect::<String>());
            let reason = error.split(" at line ").next().unwrap_or_default();
            refused(&self.name(key), format!("{shown} is not usable: {reason}"))
        })
    }

    /// The object that a key holds.
    fn keys(&mut self, key: &str) -> Result<Self, ExchangeError> {
        Ok(Self { within: format!("{}.", self.name(key)), keys: self.take(key)? })
    }

    /// All keys must have been taken.
    fn end(self) -> Result<(), ExchangeError> {
        match self.keys.keys().next() {
            None => Ok(()),
            Some(key) => Err(refused(&self.name(key), "not known")),
        }
    }

    fn ranges(&mut self, key: &str) -> Result<Vec<Range>, ExchangeError> {
        let mut keys = self.keys(key)?;
        let scale: Vec<f32> = keys.take("scale")?;
        let mut column = |name: &str| {
            let values: Vec<f32> = keys.take(name)?;
            if values.len() != scale.len() {
                let problem = format!("{} numbers, but {} in {key}.scale", values.len(), scale.len());
                return Err(refused(&format!("{key}.{name}"), problem));
            }
            Ok(values)
        };
        let (least, most) = (column("least")?, column("most")?);
        keys.end()?;
        let rows = scale.into_iter().zip(least).zip(most);
        Ok(rows.map(|((scale, least), most)| Range { scale, least, most }).collect())
    }

    fn law(&mut self) -> Result<AnyLaw, ExchangeError> {
        let name: String = self.take("law")?;
        let mut keys = self.keys("constants")?;
        let Some(law) = AnyLaw::all().find(|law| law.name() == name) else {
            let known: Vec<&str> = AnyLaw::all().map(|law| law.name()).collect();
            let (last, others) = known.split_last().unwrap_or((&"", &[]));
            let known = format!("{} and {last} are", others.join(", "));
            return Err(refused("law", format!("\"{name}\" is not known; {known}")));
        };
        let mut values = [0.0; MAX_CONSTANTS];
        for (value, constant) in values.iter_mut().zip(law.constants()) {
            *value = keys.take(constant.name)?;
        }
        keys.end()?;
        Ok(law.with(values))
    }
}
