//! What is compared: ways to move a scene on by one step. A method is one arm in [`Method::prepare`].

use std::boxed::Box;
use std::string::ToString;
use std::vec;
use std::vec::Vec;

use super::LabError;
use super::host::{HostScene, HostState};
use crate::loads::Loads;
use crate::material::Material;
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
}

/// Moves a state on by one step under loads; what it needs beside that, it holds. After
/// [`Status::Diverged`] it is not called again.
pub type Advance<'a> = Box<dyn FnMut(&mut HostState, &Loads<'_>) -> Status + 'a>;

impl Method {
    /// All methods, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::Tled, Self::Hold, Self::TledLargeStep];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tled => "tled",
            Self::Hold => "hold",
            Self::TledLargeStep => "tled-large-step",
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
            Self::TledLargeStep => multiples.iter().copied().filter(|multiple| *multiple > 1).collect(),
        }
    }

    /// What moves a state of the scene on by steps of `dt` (s) with `damping` (1/s).
    pub fn prepare<M: Material>(
        self,
        scene: &HostScene<M>,
        dt: f32,
        damping: f32,
    ) -> Result<Advance<'_>, LabError> {
        Ok(match self {
            Self::Hold => Box::new(|_, _| Status::Ok),
            Self::Tled | Self::TledLargeStep => {
                let step = Step::insist(dt, damping)?;
                Box::new(move |state, loads| tled::step(scene, loads, state, &step))
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
        assert_eq!(said, "method \"euler\" is not known; there are tled, hold, tled-large-step");
    }
}
