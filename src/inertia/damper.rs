//! Damping of rough motion, the part of the motion that the lattice cannot represent. At a step beyond the critical one
//! its inertia is much too large. Once excited it oscillates for a long time at a low frequency, almost undamped,
//! because damping acts on the true mass; in the exact motion it decays at once. So a small network decides in each
//! step how much of the rough motion is removed. Its inputs are four values of the whole body, without directions, so
//! it can be used with any mesh, law and step.
//!
//! ```text
//! y = du - W Mc^-1 W^T m du             rough part of the last increment, y' its change since the step before
//! inputs   ln (y'^T m y' / y^T m y),  ln (y^T m y / du^T m du),  y^T m y' / sqrt(y^T m y  y'^T m y'),  ln k
//! output   g, and d = g y'^T m y' / y^T m y, at most [`MOST`], for the next step
//! du+ = du - d y + ...
//! ```
//! An oscillation of angular frequency `w` changes phase by `w D` in a step, so `d` is `g (w D)^2`. Rough motion that
//! follows the smooth motion hardly changes from step to step and is not damped; an oscillation decays with a rate of
//! `g w^2 D`, in 1/s, which is smaller for shorter steps.
//!
//! `y` has no momentum in common with the lattice, so to remove a part of it takes true kinetic energy but no momentum
//! from the body. The energy of the step, `c^T S c + y^T M y` with `y` orthogonal to the lattice in `M`, need not fall
//! where the added inertia differs much between nodes. So [`MOST`] is small: with 0.2 and a gain of 20 some meshes
//! whose elements differ in volume by a factor of a thousand diverged. With `d = 0` this is the stable step.

use core::fmt;

use crate::mlp::Network;

/// Inputs of the network.
const FEATURES: usize = 4;
/// Largest share of the rough motion that one step removes.
pub(super) const MOST: f32 = 0.1;
/// Logarithms are clamped to this magnitude; larger ratios need not be told apart.
const LARGEST_LOGARITHM: f32 = 25.0;

/// Why a network cannot be used as a damper.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum DamperError {
    /// Its numbers of inputs and outputs are not those of a damper.
    Shape {
        /// Its inputs.
        inputs: usize,
        /// Its outputs.
        outputs: usize,
    },
}

impl fmt::Display for DamperError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Shape { inputs, outputs } => {
                write!(f, "a network of {inputs} inputs and {outputs} outputs; a damper needs {FEATURES} and 1")
            }
        }
    }
}

impl core::error::Error for DamperError {}

/// A network that decides how much of the rough motion a step removes.
#[derive(Clone, Debug)]
pub struct Damper<'w> {
    /// None damps nothing.
    network: Option<Network<'w>>,
}

/// At a multiple of 64 bytes, as the arrays of a weight file ask.
#[repr(C, align(64))]
struct Aligned<B: ?Sized>(B);

/// Linked only where [`Damper::built_in`] is called.
static BUILT_IN: &Aligned<[u8]> = &Aligned(*include_bytes!("../../weights/damper.weights"));

impl Damper<'static> {
    /// The library's own network, `weights/damper.weights`. It checks 1.2 kB at each call.
    #[must_use]
    pub fn built_in() -> Self {
        Self { network: Network::parse(&BUILT_IN.0).ok() }
    }
}

impl<'w> Damper<'w> {
    /// Another network, for instance a trained one. Checks that the network has the inputs and the output of a damper.
    pub fn new(network: Network<'w>) -> Result<Self, DamperError> {
        let (inputs, outputs) = (network.inputs().len(), network.outputs().len());
        if inputs == FEATURES && outputs == 1 {
            Ok(Self { network: Some(network) })
        } else {
            Err(DamperError::Shape { inputs, outputs })
        }
    }

    /// Share `d` of the rough motion that is removed; `k` is `mu D / 2`.
    pub(super) fn share(&self, rough: &RoughMotion, k: f32) -> f32 {
        let (Some(network), Some(features)) = (&self.network, rough.features(k)) else {
            return 0.0;
        };
        let mut gain = [0.0];
        network.predict(&features, &mut gain);
        let share = gain[0] * (rough.change / rough.square);
        // Zero for NaN.
        if share > 0.0 { share.min(MOST) } else { 0.0 }
    }
}

/// Sums over the nodes, kg m^2, with the rough part `y` of the last increment `du` and its change `y'` since the step
/// before.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughMotion {
    /// `y^T m y`.
    square: f32,
    /// `y'^T m y'`.
    change: f32,
    /// `y^T m y'`.
    both: f32,
    /// `du^T m du`.
    whole: f32,
}

impl RoughMotion {
    pub(super) const NONE: Self = Self { square: 0.0, change: 0.0, both: 0.0, whole: 0.0 };

    /// Adds the sums of other nodes.
    pub(super) fn merge(&mut self, other: &Self) {
        self.add([other.square, other.change, other.both, other.whole]);
    }

    /// Adds sums in the order of the fields.
    pub(super) fn add(&mut self, [square, change, both, whole]: [f32; 4]) {
        self.square += square;
        self.change += change;
        self.both += both;
        self.whole += whole;
    }

    /// The inputs of the network; none without rough motion.
    fn features(&self, k: f32) -> Option<[f32; FEATURES]> {
        let Self { square, change, both, whole } = *self;
        if !(square > 0.0 && change > 0.0 && whole > 0.0) {
            return None;
        }
        let ln = |ratio: f32| libm::logf(ratio).clamp(-LARGEST_LOGARITHM, LARGEST_LOGARITHM);
        let cosine = both / (libm::sqrtf(square) * libm::sqrtf(change));
        Some([ln(change / square), ln(square / whole), cosine.clamp(-1.0, 1.0), ln(k)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_network_is_that_of_the_file() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/weights/damper.weights");
        assert!(std::fs::read(path).unwrap() == BUILT_IN.0);
        assert!(Damper::new(Damper::built_in().network.unwrap()).is_ok());
    }
}
