//! What is compared: ways to move a scene on by one step. A method is one arm in [`Method::prepare`].

use std::path::Path;

use supple::inertia::{self, Cells, LargeStep};
use supple::learned::{self, LearnedStep};
use supple::loads::Loads;
use supple::material::VecMaterial;
use supple::mlp::{Network, WeightBytes};
use supple::scene::SceneView;
use supple::simulation::{ExactSteps, Lead, Mover};
use supple::state::{NodeVector, VecState};
use supple::step::{CallingThread, Status, Step, Work};

use super::networks::{self, Family};
use super::scenes::SceneSpec;
use super::timing::Timing;
use super::{DT, LabError, implicit};

/// A way to move a scene.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub enum Method {
    /// The exact steps of the truth, for their time: as many as a step of the scene has
    /// ([`super::timing::Timing::refinement`]).
    Tled,
    /// Nothing moves: what a method has to beat.
    Hold,
    /// The exact step's formula at longer steps, stable or not.
    TledLargeStep,
    /// Steps beyond the critical one.
    Long,
    /// Backward Euler, to compare with.
    BackwardEuler,
    /// The implicit midpoint rule, to compare with.
    ImplicitMidpoint,
    /// Long steps that the host makes half as long and as long again, in turn at every snapshot.
    Switching,
    /// The learned step with a network of the crate, after a lead-in of [`LEAD_IN`].
    Learned(Family),
    /// The same with a network of the user's.
    LearnedWith(NetworkFile),
}

/// A network of the user's at its own step.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
pub struct NetworkFile {
    /// For the tables.
    pub name: &'static str,
    /// A weight file, at a multiple of four bytes.
    pub bytes: &'static [u8],
    /// Its step over [`DT`].
    pub multiple: u32,
}

impl NetworkFile {
    /// A copy of a weight file's bytes, which stays in memory for good.
    pub fn leaked(name: &'static str, bytes: &[u8]) -> Result<Self, LabError> {
        let bytes: &'static [u8] = Box::leak(Box::new(WeightBytes::of(bytes))).bytes();
        let multiple = (Network::parse(bytes)?.recipe().step / DT).round() as u32;
        Ok(Self { name, bytes, multiple })
    }
}

/// Length of the lead-in, s (Meister et al. 2018, section 3).
pub const LEAD_IN: f64 = 0.3;

/// A step of the laboratory's own.
pub type OwnStep<'a> = Box<dyn FnMut(&mut VecState, &Loads<'_>) -> Status + 'a>;

/// What moves a state on, prepared.
pub enum Prepared<'a> {
    /// Exact steps of this length.
    Exact(Step),
    /// Steps beyond the critical one, and their damping, 1/s.
    Long(Box<LargeStep<Vec<NodeVector>>>, f32),
    /// A network's steps, and the exact ones of its lead-in.
    Learned(Box<LearnedStep<'static, Vec<NodeVector>>>, Step, Lead),
    /// Neither of these.
    Own(OwnStep<'a>),
}

impl Prepared<'_> {
    /// Moves on by `seconds` ([`Method::parts`]) under loads. Gives the status, and of a network's step the share of the
    /// vertices whose prediction was clipped. After [`Status::Diverged`] it is not called again.
    pub fn advance(
        &mut self,
        seconds: f32,
        scene: SceneView<'_, VecMaterial>,
        loads: &Loads<'_>,
        state: &mut VecState,
    ) -> Result<(Status, Option<f32>), LabError> {
        let mover = match self {
            Self::Exact(step) => Mover::Exact(ExactSteps::Fixed(*step)),
            Self::Long(large, damping) => {
                if seconds != large.model().longest() {
                    // Moves no node, and does nothing before longer steps.
                    let _ = large.shorten(seconds, scene, loads, state.view());
                    large.change_step(Step::unchecked(seconds, *damping)?);
                }
                let (model, storage) = large.parts();
                Mover::Long(model, storage, None)
            }
            Self::Learned(learned, exact, lead) => {
                Mover::Learned(learned.view(), ExactSteps::Fixed(*exact), lead, None)
            }
            Self::Own(step) => return Ok((step(state, loads), None)),
        };
        let until = state.time() + f64::from(seconds);
        let report =
            mover.advance(until, scene, &mut { *loads }, state.view(), Work::UNBOUNDED, &CallingThread, &mut |_| {})?;
        let clipped = match self {
            Self::Learned(learned, ..) if report.learned > 0 => Some(learned.model().report().clipped),
            _ => None,
        };
        Ok((report.status, clipped))
    }
}

impl Method {
    /// All methods that need no file of the user's, in the order of the tables.
    pub const ALL: [Self; 11] = [
        Self::Tled,
        Self::Hold,
        Self::TledLargeStep,
        Self::Long,
        Self::BackwardEuler,
        Self::ImplicitMidpoint,
        Self::Learned(Family::Compact),
        Self::Learned(Family::Paper),
        Self::Learned(Family::CompactInt8),
        Self::Learned(Family::OtherStep),
        Self::Switching,
    ];

    /// Those that take more than ten minutes over all scenes.
    pub const SLOW: [Self; 3] = [Self::BackwardEuler, Self::ImplicitMidpoint, Self::Learned(Family::Paper)];

    /// Those that are for hard cases.
    pub const HARD: [Self; 3] = [Self::Learned(Family::CompactInt8), Self::Learned(Family::OtherStep), Self::Switching];

    /// Its name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tled => "tled",
            Self::Hold => "hold",
            Self::TledLargeStep => "tled-large-step",
            Self::Long => "long",
            Self::BackwardEuler => "backward-euler",
            Self::ImplicitMidpoint => "implicit-midpoint",
            Self::Learned(Family::Compact) => "compact-f32",
            Self::Learned(Family::Paper) => "paper-f32",
            Self::Learned(Family::CompactInt8) => "compact-int8",
            Self::Learned(Family::OtherStep) => "compact-other-step",
            Self::Switching => "long-switching",
            Self::LearnedWith(file) => file.name,
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

    /// The learned step with the network of a weight file.
    pub fn with(path: &Path) -> Result<Self, LabError> {
        let problem = |error: &dyn core::fmt::Display| LabError::File(format!("{}: {error}", path.display()));
        let bytes = supple::io::read_file(path).map_err(|error| problem(&error))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        NetworkFile::leaked(String::leak(name), &bytes).map(Self::LearnedWith).map_err(|error| problem(&error))
    }

    /// At which multiples of a scene's step it is run if asked for `multiples`. At 1 the long step is the exact one,
    /// and what holds still does so at any step; networks of the learned step are for multiples of the paper's.
    #[must_use]
    pub fn multiples(self, timing: &Timing, multiples: &[u32]) -> Vec<u32> {
        let those =
            |wanted: &dyn Fn(u32) -> bool| multiples.iter().copied().filter(|&multiple| wanted(multiple)).collect();
        match self {
            Self::Learned(_) | Self::LearnedWith(_) if timing.step != DT => Vec::new(),
            Self::Tled | Self::Hold => vec![1],
            Self::Learned(family) => those(&|multiple| networks::learned(family, multiple).is_some()),
            Self::LearnedWith(file) => vec![file.multiple],
            _ => those(&|multiple| multiple > 1),
        }
    }

    /// Parts of equal length into which its steps up to a snapshot are cut: one, and two before every second snapshot
    /// for those that switch.
    #[must_use]
    pub const fn parts(self, snapshot: usize) -> u32 {
        match self {
            Self::Switching => 1 + (snapshot % 2) as u32,
            _ => 1,
        }
    }

    /// Whether it moves a body that an instrument touches: others refuse.
    #[must_use]
    pub const fn meets_instruments(self) -> bool {
        use Method as M;
        matches!(self, M::Tled | M::TledLargeStep | M::Long | M::Switching)
    }

    /// Time at the start that exact steps take, s.
    #[must_use]
    pub const fn lead_in(self) -> f64 {
        match self {
            Self::Learned(_) | Self::LearnedWith(_) => LEAD_IN,
            _ => 0.0,
        }
    }

    /// What moves a state of a scene on by steps of `dt` (s), from `state`.
    pub fn prepare<'a>(
        self,
        spec: &SceneSpec,
        scene: SceneView<'a, VecMaterial>,
        state: &mut VecState,
        dt: f32,
    ) -> Result<Prepared<'a>, LabError> {
        let damping = spec.damping;
        let exact = |count: u32| Ok(Prepared::Exact(Step::unchecked(dt / count as f32, damping)?));
        let long = |method, state: &mut VecState| {
            let step = Step::unchecked(dt, damping)?;
            let large = LargeStep::prepare_in_vec(method, scene, &spec.points, state.view(), step)?;
            Ok(Prepared::Long(Box::new(large), damping))
        };
        // The lead-in is damped as the scene is, learned steps as the training was: on a scene with other damping a
        // network is as wrong as it is.
        let learned = |bytes| {
            let network = Network::parse(bytes)?;
            let storage = vec![NodeVector::ZERO; learned::vectors_for(scene.node_count(), false)];
            let learned = LearnedStep::new(network, false, storage)?;
            let Timing { step, refinement, .. } = spec.timing;
            let count = (dt * refinement as f32 / step - 0.01).ceil().max(1.0);
            let exact = Step::unchecked(learned.model().seconds() / count, damping)?;
            let lead = Lead::new(learned.model().intervals(LEAD_IN));
            Ok(Prepared::Learned(Box::new(learned), exact, lead))
        };
        match self {
            Self::Hold => Ok(Prepared::Own(Box::new(|_, _| Status::Ok))),
            Self::Tled => exact(spec.timing.refinement),
            Self::TledLargeStep => exact(1),
            Self::Long | Self::Switching => long(inertia::Method::new(Cells::Suggested), state),
            Self::BackwardEuler => Ok(implicit::prepare(implicit::Rule::BackwardEuler, scene, state, dt, damping)),
            Self::ImplicitMidpoint => Ok(implicit::prepare(implicit::Rule::Midpoint, scene, state, dt, damping)),
            Self::Learned(family) => {
                let multiple = (dt / DT).round() as u32;
                learned(networks::learned(family, multiple).ok_or(LabError::NoNetwork { multiple })?)
            }
            Self::LearnedWith(file) => learned(file.bytes),
        }
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
            "method \"euler\" is not known; there are tled, hold, tled-large-step, long, backward-euler, \
             implicit-midpoint, compact-f32, paper-f32, compact-int8, compact-other-step, long-switching"
        );
    }
}
