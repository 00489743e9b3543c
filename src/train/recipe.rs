//! What a network is trained on and how: a TOML file, which is kept in the weight file.
//!
//! ```toml
//! seed = 1
//! multiple = 10            # step of the network over the exact one's: 30 us in the laboratory's scenes
//!
//! [motion]                 # or [[motion]] for each of several, of one body
//! scene = "torsion"        # of the laboratory; the command takes a scene file too: "organ.toml", from the folder of the recipe
//! element = "linear"       # or "nodal-pressure", "nodal-strain"; may be left out: the scene's
//! load = 1.0               # times the scene's forces
//! from = 0.3               # s
//! to = 1.0
//! frames = 1000            # in equal intervals
//! turned = false           # each sample's normal by a random angle about its tangent
//!
//! [noise]                  # may be left out: copies of every frame, moved at random
//! copies = 1
//! least = 2e-7             # standard deviation of a vertex's displacement, m: from here
//! most = 5e-6              # to here, evenly in its logarithm
//! back = 1.0               # share of the displacement that the next step takes back
//! before = 1.0             # share of it that was not there a step ago
//! ease = 0.5               # m/s^2: where more is taken back, errors weigh less
//!
//! [network]
//! hidden = [256, 256, 128, 64, 32]
//! correction = [64, 64, 64]
//! slope = 0.01             # of the leaky ReLU
//! force = "newton"         # the paper's; or "per-mass", over the vertex's lumped mass
//!
//! [training]
//! epochs = 200
//! batch = 4096
//! rate = 0.001
//! decay = "none"           # or "cosine", to zero
//! held_out = 0.1           # share of the frames that are kept for the error at the end
//! ```

use core::fmt;
use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

use serde::Deserialize;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};

use super::TrainError;
use crate::material::Element;
use crate::mlp::{ForceInput, MAX_LAYERS, MAX_WIDTH};

/// A recipe as the module documents it.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Of the weights at the start and of the order of the samples.
    pub seed: u64,
    /// Step of the network over that of the exact step, [`super::TrainingScene::step`].
    pub multiple: u32,
    /// What is learned from: one motion or several.
    #[serde(deserialize_with = "one_or_several")]
    pub motion: Vec<MotionRecipe>,
    /// Rough motion to learn from as well.
    #[serde(default)]
    pub noise: Option<Noise>,
    /// What learns.
    pub network: Shape,
    /// How.
    pub training: Training,
}

/// What is learned from.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct MotionRecipe {
    /// A name that whoever makes the scene knows, or a scene file, `NAME.toml`.
    pub scene: String,
    /// Tetrahedra that it is made of, if not those of the scene.
    #[serde(default)]
    pub element: Option<Element>,
    /// Times the scene's forces.
    pub load: f32,
    /// s.
    pub from: f64,
    /// s.
    pub to: f64,
    /// In equal intervals.
    pub frames: usize,
    /// Whether each sample's normal is turned about its tangent by a random angle.
    #[serde(default)]
    pub turned: bool,
}

/// Copies of every frame with all free vertices moved at random, see [`super::samples`].
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Of each frame.
    pub copies: usize,
    /// Least standard deviation of a vertex's displacement along each axis, m.
    pub least: f64,
    /// And largest; evenly spread in the logarithm.
    pub most: f64,
    /// Share of the displacement that the next step takes back.
    pub back: f64,
    /// Share of it that was not there a step ago; there was another random displacement instead.
    #[serde(default)]
    pub before: f64,
    /// Acceleration beyond which errors weigh less, as its square over that of what is taken back, m/s^2.
    pub ease: f64,
}

impl Noise {
    fn usable(&self) -> bool {
        let Self { copies, least, most, back, before, ease } = *self;
        (1..=100).contains(&copies)
            && least > 0.0
            && (least..1.0).contains(&most)
            && [back, before].iter().all(|share| (0.0..=2.0).contains(share))
            && ease > 0.0
            && ease.is_finite()
    }
}

/// What learns.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// Widths of the hidden layers of the first part.
    pub hidden: Vec<usize>,
    /// And of the correction.
    pub correction: Vec<usize>,
    /// Of the leaky ReLU.
    pub slope: f32,
    /// What the network sees of the force.
    #[serde(default)]
    pub force: ForceInput,
}

/// How.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Times that every sample is seen.
    pub epochs: usize,
    /// Samples of a step of the optimiser.
    pub batch: usize,
    /// Of Adam.
    pub rate: f64,
    /// Of the rate.
    pub decay: Decay,
    /// Share of the frames that are kept for the error at the end.
    pub held_out: f64,
}

/// How the rate falls.
#[derive(Clone, Copy, Debug, Deserialize, Eq, PartialEq)]
#[serde(rename_all = "lowercase")]
pub enum Decay {
    /// Not at all.
    None,
    /// As half a cosine, to zero.
    Cosine,
}

impl MotionRecipe {
    /// Whether the scene is that of a file.
    #[must_use]
    pub fn is_file(&self) -> bool {
        self.scene.ends_with(".toml")
    }

    fn checked(&self) -> Result<(), TrainError> {
        let Self { from, to, load, frames, .. } = *self;
        let refuse = |what, value: &dyn fmt::Display, must: &str| Err(TrainError::refused(what, value, must));
        if !(from >= 0.0 && to > from && to <= 10.0) {
            return refuse("from", &format!("{from} to {to}"), "they must rise, from zero to ten seconds");
        }
        if !(load.is_finite() && load != 0.0) {
            return refuse("load", &load, "it must be a number other than zero");
        }
        if frames == 0 || frames > 100_000 {
            return refuse("frames", &frames, "it must be from 1 to 100000");
        }
        Ok(())
    }
}

/// A table, or an array of tables.
fn one_or_several<'de, D: Deserializer<'de>>(motion: D) -> Result<Vec<MotionRecipe>, D::Error> {
    struct Motions;
    impl<'de> Visitor<'de> for Motions {
        type Value = Vec<MotionRecipe>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a motion or several")
        }

        fn visit_map<A: MapAccess<'de>>(self, one: A) -> Result<Self::Value, A::Error> {
            MotionRecipe::deserialize(MapAccessDeserializer::new(one)).map(|motion| std::vec![motion])
        }

        fn visit_seq<A: SeqAccess<'de>>(self, several: A) -> Result<Self::Value, A::Error> {
            Vec::deserialize(SeqAccessDeserializer::new(several))
        }
    }
    motion.deserialize_any(Motions)
}

impl Recipe {
    /// Reads and checks a recipe.
    pub fn parse(text: &str) -> Result<Self, TrainError> {
        let recipe: Self = toml::from_str(text).map_err(|error| TrainError::Recipe(error.to_string()))?;
        recipe.checked()
    }

    fn checked(self) -> Result<Self, TrainError> {
        let refuse = |what, value: &dyn fmt::Display, must: &str| Err(TrainError::refused(what, value, must));
        let Self { multiple, motion, noise, network, training, .. } = &self;
        if !(1..=1_000).contains(multiple) {
            return refuse("multiple", multiple, "it must be from 1 to 1000");
        }
        if !(1..=100).contains(&motion.len()) {
            return refuse("motions", &motion.len(), "from 1 to 100");
        }
        motion.iter().try_for_each(MotionRecipe::checked)?;
        if let Some(noise) = noise
            && !noise.usable()
        {
            let must = "1 to 100 copies, 0 < least <= most < 1 m, back and before from 0 to 2, ease > 0";
            return refuse("noise", &format!("{noise:?}"), must);
        }
        let widths = network.hidden.iter().chain(&network.correction);
        if let Some(width) = widths.clone().find(|width| !(1..=MAX_WIDTH).contains(*width)) {
            return refuse("a width", width, &format!("it must be from 1 to {MAX_WIDTH}"));
        }
        if widths.count() + 2 > MAX_LAYERS {
            let layers = network.hidden.len() + network.correction.len();
            return refuse("layers", &layers, &format!("at most {} hidden ones", MAX_LAYERS - 2));
        }
        if !(0.0..=1.0).contains(&network.slope) {
            return refuse("slope", &network.slope, "it must be from 0 to 1");
        }
        if training.epochs == 0 || training.batch == 0 {
            let value = format!("{}, {}", training.epochs, training.batch);
            return refuse("epochs, batch", &value, "one at least");
        }
        if !(training.rate > 0.0 && training.rate < 1.0) {
            return refuse("rate", &training.rate, "it must be between 0 and 1");
        }
        if !(0.0..0.9).contains(&training.held_out) {
            return refuse("held_out", &training.held_out, "it must be from 0 to 0.9");
        }
        Ok(self)
    }
}
