//! Why the laboratory could not do what it was asked, in a sentence for the person who asked.

use core::fmt;

use supple::contact::ContactError;
use supple::inertia::InertiaError;
use supple::io::ReadError;
use supple::learned::LearnedError;
use supple::loads::LoadError;
use supple::mlp::WeightError;
use supple::scene::BuildError;
use supple::simulation::SimulationError;
use supple::step::{Divergence, Status, StepError};

/// Why the laboratory could not do what it was asked.
#[derive(Debug)]
#[non_exhaustive]
pub enum LabError {
    /// No scene or method has this name.
    Unknown {
        /// "scene", "method" or "case".
        kind: &'static str,
        /// The name asked for.
        name: String,
        /// The names there are, separated by commas.
        known: String,
    },
    /// A mesh could not be read.
    Mesh(ReadError),
    /// A scene could not be built.
    Build(BuildError),
    /// The loads of a scene do not fit it.
    Load(LoadError),
    /// Its instrument does not.
    Contact(ContactError),
    /// A step was refused.
    Step(StepError),
    /// An inertia could not be prepared.
    Inertia(InertiaError),
    /// A simulation was refused.
    Simulation(SimulationError),
    /// The exact motion diverged, so there is no truth.
    Diverged {
        /// The scene.
        scene: &'static str,
        /// Where and when.
        divergence: Divergence,
    },
    /// The exact critical step of a scene did not converge.
    NoCriticalStep {
        /// The scene.
        scene: &'static str,
    },
    /// A case of [`super::physics`] did not come to rest.
    NotAtRest {
        /// The case.
        case: &'static str,
        /// By which share its quantity changed in the end, over the time of the lowest frequency.
        change: f64,
        /// Kinetic energy over the work of the loads in the end.
        kinetic: f64,
    },
    /// State and scene do not fit.
    Mismatch {
        /// Nodes of the scene.
        nodes: usize,
        /// Nodes of the state or of the field it is compared with.
        room: usize,
    },
    /// Steps of this multiple do not divide the interval between two snapshots.
    Multiple {
        /// The scene.
        scene: &'static str,
        /// The multiple.
        multiple: u32,
        /// Steps between two snapshots.
        interval: u32,
    },
    /// There is no network for this multiple.
    NoNetwork {
        /// The multiple.
        multiple: u32,
    },
    /// A weight file is not usable.
    Weights(WeightError),
    /// A file is not usable; the text names it.
    File(String),
    /// A network does not fit the learned step.
    LearnedStep(LearnedError),
    /// A file could not be written; the text names it.
    Write(std::io::Error),
}

impl LabError {
    /// Fails if a step of a scene was refused.
    pub(super) const fn if_refused(scene: &'static str, status: Status) -> Result<(), Self> {
        match status {
            Status::Diverged(divergence) => Err(Self::Diverged { scene, divergence }),
            Status::Mismatch { nodes, room } => Err(Self::Mismatch { nodes, room }),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for LabError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown { kind, name, known } => {
                write!(f, "{kind} \"{name}\" is not known; there are {known}")
            }
            Self::Mesh(error) => error.fmt(f),
            Self::Build(error) => error.fmt(f),
            Self::Load(error) => error.fmt(f),
            Self::Contact(error) => error.fmt(f),
            Self::Step(error) => error.fmt(f),
            Self::Inertia(error) => error.fmt(f),
            Self::Simulation(error) => error.fmt(f),
            Self::Diverged { scene, divergence } => write!(f, "the truth of {scene} {divergence}"),
            Self::NoCriticalStep { scene } => write!(f, "{scene}: the exact critical step was not found"),
            Self::NotAtRest { case, change, kinetic } => write!(
                f,
                "{case} did not come to rest: it still changes by {change:.1e}, kinetic energy over work is {kinetic:.1e}"
            ),
            Self::Mismatch { nodes, room } => {
                write!(f, "the scene has {nodes} nodes, the other side {room}")
            }
            Self::Multiple { scene, multiple, interval: steps } => {
                let known = (1..=*steps).filter(|multiple| steps.is_multiple_of(*multiple));
                let known: Vec<String> = known.map(|multiple| multiple.to_string()).collect();
                write!(f, "multiple {multiple} misses the snapshots of {scene}; there are {}", known.join(", "))
            }
            Self::NoNetwork { multiple } => {
                let known: Vec<String> = super::networks::multiples().map(|multiple| multiple.to_string()).collect();
                write!(f, "there is no network for multiple {multiple}; there are {}", known.join(", "))
            }
            Self::Weights(error) => error.fmt(f),
            Self::File(text) => f.write_str(text),
            Self::LearnedStep(error) => error.fmt(f),
            Self::Write(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for LabError {}

macro_rules! from {
    ($($source:ty => $variant:ident),*) => {
        $(impl From<$source> for LabError {
            fn from(error: $source) -> Self {
                Self::$variant(error)
            }
        })*
    };
}

from!(ReadError => Mesh, BuildError => Build, LoadError => Load, ContactError => Contact, StepError => Step, InertiaError => Inertia, WeightError => Weights, SimulationError => Simulation, LearnedError => LearnedStep, std::io::Error => Write);
