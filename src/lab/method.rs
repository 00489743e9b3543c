//! What is compared: ways to move a scene on by one step. A method is one arm in [`Method::prepare`].

use std::boxed::Box;
use std::string::ToString;
use std::vec;
use std::vec::Vec;

use super::LabError;
use super::host::{HostScene, HostState};
use crate::inertia::{self, Inertia, LatticeNode, numbers_for, suggested_lattice, vectors_for};
use crate::loads::Loads;
use crate::material::Material;
use crate::state::{NodeVector, State};
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
}

/// Moves a state on by one step under loads; what it needs beside that, it holds. Gives the status and, where
/// the method has one, its own estimate of its error, m. After [`Status::Diverged`] it is not called again.
pub type Advance<'a> = Box<dyn FnMut(&mut HostState, &Loads<'_>) -> (Status, Option<f32>) + 'a>;

impl Method {
    /// All methods, in the order of the tables.
    pub const ALL: [Self; 5] =
        [Self::Tled, Self::Hold, Self::TledLargeStep, Self::MassScaled, Self::Multilevel];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tled => "tled",
            Self::Hold => "hold",
            Self::TledLargeStep => "tled-large-step",
            Self::MassScaled => "mass-scaled",
            Self::Multilevel => "multilevel",
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

    /// At which multiples of [`super::DT`] it is run if asked for `multiples`. At 1 the large step is the
    /// exact one, and what holds still does so at any step.
    #[must_use]
    pub fn multiples(self, multiples: &[u32]) -> Vec<u32> {
        match self {
            Self::Tled | Self::Hold => vec![1],
            Self::TledLargeStep | Self::MassScaled | Self::Multilevel => {
                multiples.iter().copied().filter(|multiple| *multiple > 1).collect()
            }
        }
    }

    /// Whether it scales inertia, so that its error can be estimated.
    #[must_use]
    pub const fn scales(self) -> bool {
        matches!(self, Self::MassScaled | Self::Multilevel)
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
            Self::Hold => Box::new(|_, _| (Status::Ok, None)),
            Self::Tled | Self::TledLargeStep => {
                let step = Step::insist(dt, damping)?;
                Box::new(move |state, loads| (tled::step(scene, loads, state, &step), None))
            }
            Self::MassScaled | Self::Multilevel => {
                let lattice = self == Self::Multilevel;
                let (cells, functions) = if lattice { suggested_lattice(scene, points) } else { ([0; 3], 0) };
                let nodes = scene.node_count();
                let mut inertia = Box::new(Inertia::over(
                    vec![NodeVector::ZERO; vectors_for(nodes)],
                    vec![LatticeNode::EMPTY; nodes],
                    vec![0.0; numbers_for(cells, functions)],
                ));
                // Scenes start at rest.
                let zero = || vec![NodeVector::ZERO; nodes];
                let mut rest = State::over(zero(), zero(), zero());
                inertia.prepare(scene, points, &mut rest, Step::insist(dt, damping)?, cells)?;
                Box::new(move |state, loads| {
                    let status = inertia::step(scene, loads, state, &mut inertia);
                    (status, Some(inertia.report().error))
                })
            }
        })
    }
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
            "method \"euler\" is not known; there are tled, hold, tled-large-step, mass-scaled, multilevel"
        );
    }
}
