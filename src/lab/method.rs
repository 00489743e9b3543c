//! What is compared: ways to move a scene on by one step. A method is one arm in [`Method::prepare`].

use std::boxed::Box;
use std::format;
use std::path::Path;
use std::string::{String, ToString};
use std::vec;
use std::vec::Vec;

use super::host::{HostScene, HostState};
use super::networks::{self, Size};
use super::{DT, LabError};
use crate::inertia::{
    Damper, Inertia, LatticeNode, damped_numbers_for, damped_step, damped_vectors_for,
    suggested_damped_lattice, suggested_lattice,
};
use crate::loads::Loads;
use crate::material::Material;
use crate::mlp::{Network, WeightBytes};
use crate::state::{NodeVector, State};
use crate::surrogate::{self, Surrogate, Vertex};
use crate::tled::{self, Status, Step};

/// A way to move a scene.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Method {
    /// The exact step at [`super::DT`]: the truth itself, for its time.
    Tled,
    /// Nothing moves: what a method has to beat.
    Hold,
    /// The exact step's formula at longer steps, stable or not.
    TledLargeStep,
    /// Inertia raised where a step would be unstable.
    MassScaled,
    /// The same, with a coarse lattice that gives smooth motion its true inertia back.
    Multilevel,
    /// Multilevel inertia with rough motion damped as the crate's own network says.
    Best,
    /// The learned step with a network of the crate, led by the exact step for [`BURN_IN`].
    Learned(Size),
    /// The learned step with a network that somebody brings, led by the exact step for [`BURN_IN`].
    Brought(Brought),
    /// Multilevel inertia with rough motion damped as a network says that somebody brings.
    Damped(Brought),
}

/// A network at its own step.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct Brought {
    /// For the tables.
    pub name: &'static str,
    /// A weight file, at a multiple of four bytes.
    pub bytes: &'static [u8],
    /// Its step over [`DT`].
    pub multiple: u32,
}

impl Brought {
    /// A weight file's bytes, which stay in memory for good.
    pub fn kept(name: &'static str, bytes: &[u8]) -> Result<Self, LabError> {
        let bytes: &'static [u8] = Box::leak(Box::new(WeightBytes::of(bytes))).bytes();
        let multiple = (Network::parse(bytes)?.recipe().step / DT).round() as u32;
        Ok(Self { name, bytes, multiple })
    }
}

/// Time that the exact step leads before a network takes over, s (Meister et al. 2018, section 3).
pub const BURN_IN: f64 = 0.3;

/// Moves a state on by one step under loads; what it needs beside that, it holds. Gives the status and, where
/// the method has one, its own estimate of its error, m. After [`Status::Diverged`] it is not called again.
pub type Advance<'a> = Box<dyn FnMut(&mut HostState, &Loads<'_>) -> (Status, Found) + 'a>;

/// What a step says of itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    /// Estimate of the error so far, m.
    pub estimate: Option<f32>,
    /// Share of the vertices whose prediction was clipped.
    pub clipped: Option<f32>,
}

impl Method {
    /// All methods that need nothing brought, in the order of the tables.
    pub const ALL: [Self; 8] = [
        Self::Tled,
        Self::Hold,
        Self::TledLargeStep,
        Self::MassScaled,
        Self::Multilevel,
        Self::Best,
        Self::Learned(Size::Compact),
        Self::Learned(Size::Paper),
    ];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tled => "tled",
            Self::Hold => "hold",
            Self::TledLargeStep => "tled-large-step",
            Self::MassScaled => "mass-scaled",
            Self::Multilevel => "multilevel",
            Self::Best => "best",
            Self::Learned(Size::Compact) => "compact-f32",
            Self::Learned(Size::Paper) => "paper-f32",
            Self::Brought(network) | Self::Damped(network) => network.name,
        }
    }

    /// The method with this name.
    pub fn named(name: &str) -> Result<Self, LabError> {
        Self::ALL.into_iter().find(|method| method.name() == name).ok_or_else(|| LabError::Unknown {
            kind: "method",
            name: name.to_string(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }

    /// With the network of a weight file: a damper, or the learned step.
    pub fn with(path: &Path) -> Result<Self, LabError> {
        let problem = |error: &dyn core::fmt::Display| LabError::File(format!("{}: {error}", path.display()));
        let bytes = std::fs::read(path).map_err(|error| problem(&error))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let network = Brought::kept(String::leak(name), &bytes).map_err(|error| problem(&error))?;
        let damps = Damper::over(Network::parse(network.bytes)?).is_ok();
        Ok(if damps { Self::Damped(network) } else { Self::Brought(network) })
    }

    /// At which multiples of [`super::DT`] it is run if asked for `multiples`. At 1 the large step is the
    /// exact one, and what holds still does so at any step.
    #[must_use]
    pub fn multiples(self, multiples: &[u32]) -> Vec<u32> {
        match self {
            Self::Tled | Self::Hold => vec![1],
            Self::TledLargeStep | Self::MassScaled | Self::Multilevel | Self::Best | Self::Damped(_) => {
                multiples.iter().copied().filter(|multiple| *multiple > 1).collect()
            }
            Self::Learned(_) => {
                let known = |multiple: &u32| networks::MULTIPLES.contains(multiple);
                multiples.iter().copied().filter(known).collect()
            }
            Self::Brought(network) => vec![network.multiple],
        }
    }

    /// Whether it scales inertia, so that its error can be estimated.
    #[must_use]
    pub const fn scales(self) -> bool {
        matches!(self, Self::MassScaled | Self::Multilevel | Self::Best | Self::Damped(_))
    }

    /// Time at the start that another method leads, s.
    #[must_use]
    pub const fn led_for(self) -> f64 {
        match self {
            Self::Brought(_) | Self::Learned(_) => BURN_IN,
            _ => 0.0,
        }
    }

    /// What moves a state of the scene on by steps of `dt` (s) with `damping` (1/s).
    pub fn prepare<'a, M: Material>(
        self,
        scene: &'a HostScene<M>,
        points: &[[f32; 3]],
        dt: f32,
        damping: f32,
    ) -> Result<Advance<'a>, LabError> {
        Ok(match self {
            Self::Hold => Box::new(|_, _| (Status::Ok, Found::default())),
            Self::Tled | Self::TledLargeStep => {
                let step = Step::insist(dt, damping)?;
                Box::new(move |state, loads| (tled::step(scene, loads, state, &step), Found::default()))
            }
            Self::MassScaled | Self::Multilevel | Self::Best | Self::Damped(_) => {
                let weights = match self {
                    Self::Best => Some(networks::damper()),
                    Self::Damped(network) => Some(network.bytes),
                    _ => None,
                };
                let damper = match weights {
                    Some(bytes) => Some(Damper::over(Network::parse(bytes)?)?),
                    None => None,
                };
                let (cells, functions) = match (self, &damper) {
                    (Self::MassScaled, _) => ([0; 3], 0),
                    (_, None) => suggested_lattice(scene, points),
                    (_, Some(_)) => suggested_damped_lattice(scene, points),
                };
                let nodes = scene.node_count();
                // Room for either: a damped inertia needs more.
                let inertia = Inertia::over(
                    vec![NodeVector::ZERO; damped_vectors_for(nodes)],
                    vec![LatticeNode::EMPTY; nodes],
                    vec![0.0; damped_numbers_for(cells, functions)],
                );
                let mut inertia = Box::new(if damper.is_some() { inertia.damped() } else { inertia });
                // Scenes start at rest.
                let zero = || vec![NodeVector::ZERO; nodes];
                let mut rest = State::over(zero(), zero(), zero());
                inertia.prepare(scene, points, &mut rest, Step::insist(dt, damping)?, cells)?;
                Box::new(move |state, loads| {
                    let status = damped_step(scene, loads, state, &mut inertia, damper.as_ref());
                    (status, Found { estimate: Some(inertia.report().error), clipped: None })
                })
            }
            Self::Learned(size) => {
                let multiple = (dt / DT).round() as u32;
                let bytes = networks::learned(size, multiple).ok_or(LabError::NoNetwork { multiple })?;
                learned(scene, bytes, multiple, damping)?
            }
            Self::Brought(network) => learned(scene, network.bytes, network.multiple, damping)?,
        })
    }
}

/// The learned step after the exact one.
fn learned<'a, M: Material>(
    scene: &'a HostScene<M>,
    bytes: &'static [u8],
    multiple: u32,
    damping: f32,
) -> Result<Advance<'a>, LabError> {
    let nodes = scene.node_count();
    let network = Network::parse(bytes)?;
    let mut surrogate = Surrogate::over(network, vec![Vertex::NEW; nodes])?;
    let exact = Step::insist(DT, damping)?;
    let zero = || vec![NodeVector::ZERO; nodes];
    let mut lead = State::over(zero(), zero(), zero());
    Ok(Box::new(move |state, loads| {
        if lead.time() + 0.5 * f64::from(DT) >= BURN_IN {
            let status = surrogate::step(scene, loads, state, &mut surrogate);
            return (status, Found { estimate: None, clipped: Some(surrogate.report().clipped) });
        }
        let before = lead.displacements().to_vec();
        let mut worst = Status::Ok;
        for _ in 0..multiple {
            match tled::step(scene, loads, &mut lead, &exact) {
                Status::Ok => {}
                limited @ Status::Limited { .. } => worst = limited,
                other => return (other, Found::default()),
            }
        }
        state.clone_from(&lead);
        state.span(&before, surrogate.seconds());
        surrogate.follow(state);
        (worst, Found::default())
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_their_methods() {
        for method in Method::ALL {
            assert_eq!(Method::named(method.name()).unwrap(), method);
        }
        let said = Method::named("euler").unwrap_err().to_string();
        assert_eq!(
            said,
            "method \"euler\" is not known; there are tled, hold, tled-large-step, mass-scaled, multilevel, best, compact-f32, \
             paper-f32"
        );
    }
}
