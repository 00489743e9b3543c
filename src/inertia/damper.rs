//! Rough motion, what the lattice does not carry, is far too heavy at a step beyond the limit: where it is struck it rings on
//! at low frequency, hardly damped, because damping keeps the true mass. In the exact motion it dies down at once. A small
//! network therefore decides in each step how much of the rough motion is taken away. It looks at four numbers of the
//! whole body and says nothing of directions, so it fits every mesh, law and step.
//!
//! ```text
//! y = du - W G^-1 W^T M du              rough part of the last increment, y' its change since the step before
//! inputs   ln (y'^T m y' / y^T m y),  ln (y^T m y / du^T m du),  y^T m y' / sqrt(y^T m y  y'^T m y'),  ln k
//! output   g, and d = g y'^T m y' / y^T m y, at most [`MOST`], for the next step
//! du+ = du - d y + ...
//! ```
//! A ringing of angular frequency `w` turns by `w D` in a step, so that `d` is `g (w D)^2`: what follows the smooth motion hardly
//! changes from step to step and is left alone, what rings loses `g w^2 D` a second, less the shorter the step.
//!
//! `y` is orthogonal to the lattice in `M`, and the energy of motion is `q^T S q + y^T M y`: taking some of `y` away takes
//! energy, whatever the network says. (`M` is each node's mean over the axes here, which does not turn with the tissue as
//! the bounds do; what that leaves is second order in its unevenness, and the energy account has the last word.) With
//! `d = 0` the step is the stable one.
//!
//! **Second order.** Once rough motion rests, the lattice's own added inertia is what is left of the error. With `S = M + A`
//! and `T = S^-1 A` the true inverse is `M^-1 = (1 + T + T^2 + ...) S^-1`; a damped step takes
//!
//! ```text
//! Z = S^-1 + S^-1 M S^-1 A S^-1 = (1 + T - T^2) S^-1
//! ```
//! instead of `S^-1`. For an eigenvalue `t` of `T`, from 0 to 1, `Z M` is `1 - 2 t^2 + t^3` where it was `1 - t`, and `Z A`, which
//! the proof of stability bounds by one, is `t + t^2 - t^3 <= 1`: no margin is touched. The first term of the series alone would
//! take twice the margin.

use core::fmt;

use crate::mlp::Network;

/// Numbers that go into the network.
const FEATURES: usize = 4;
/// Largest share of the rough motion that one step takes away.
const MOST: f32 = 0.5;
/// Logarithms are cut off here: there is nothing to tell apart beyond.
const FAR: f32 = 25.0;

/// Why a network cannot damp.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum DamperError {
    /// It does not have the inputs and the output of a damper.
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
                write!(
                    f,
                    "a network of {inputs} inputs and {outputs} outputs; a damper needs {FEATURES} and 1"
                )
            }
        }
    }
}

impl core::error::Error for DamperError {}

/// A network that decides how much of the rough motion a step takes away.
#[derive(Clone, Debug)]
pub struct Damper<'w> {
    network: Network<'w>,
}

impl<'w> Damper<'w> {
    /// See the type.
    pub fn over(network: Network<'w>) -> Result<Self, DamperError> {
        let (inputs, outputs) = (network.inputs().len(), network.outputs().len());
        if inputs == FEATURES && outputs == 1 {
            Ok(Self { network })
        } else {
            Err(DamperError::Shape { inputs, outputs })
        }
    }

    /// How much is taken away.
    pub(super) fn share(&self, rough: &Rough, k: f32) -> f32 {
        let Some(features) = rough.features(k) else {
            return 0.0;
        };
        let mut gain = [0.0];
        self.network.predict(&features, &mut gain);
        let share = gain[0] * (rough.change / rough.square);
        // Not a number is nothing.
        if share > 0.0 { share.min(MOST) } else { 0.0 }
    }
}

/// Sums over the nodes, kg m^2: of the rough part `y` of the last increment `y^T m y`, with its change `y'` since the step
/// before `y'^T m y'` and `y^T m y'`, and of the whole increment `du^T m du`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rough {
    square: f32,
    change: f32,
    both: f32,
    whole: f32,
}

impl Rough {
    pub(super) const NONE: Self = Self { square: 0.0, change: 0.0, both: 0.0, whole: 0.0 };

    /// Adds sums in the order of the fields.
    pub(super) fn add(&mut self, [square, change, both, whole]: [f32; 4]) {
        self.square += square;
        self.change += change;
        self.both += both;
        self.whole += whole;
    }

    /// Nothing where there is no rough motion.
    fn features(&self, k: f32) -> Option<[f32; FEATURES]> {
        let Self { square, change, both, whole } = *self;
        if !(square > 0.0 && change > 0.0 && whole > 0.0) {
            return None;
        }
        let ln = |ratio: f32| libm::logf(ratio).clamp(-FAR, FAR);
        let cosine = both / (libm::sqrtf(square) * libm::sqrtf(change));
        Some([ln(change / square), ln(square / whole), cosine.clamp(-1.0, 1.0), ln(k)])
    }
}
