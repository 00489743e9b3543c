//! `[learned]` of a scene file: the network that takes over from the exact step of `[time]`, and when.

use std::path::PathBuf;

use supple::learned::{self, LearnedModel, LearnedStep};
use supple::material::Element;
use supple::mlp::{Network, WeightBytes};
use supple::plausibility::same;
use supple::simulation::Method;
use supple::state::NodeVector;
use toml::Spanned;

use super::file::{LearnedTable, SceneFile};
use super::timing::{Timing, method_name};
use super::tissues::Tissues;
use crate::problem::Problem;
use crate::weight_file::{self, describe_tissue};

/// Length of the lead-in unless the file says otherwise, s (Meister et al. 2018, section 3).
const LEAD_IN: f64 = 0.3;

/// What `[learned]` asks for.
pub(crate) struct LearnedChoice {
    pub(crate) path: PathBuf,
    /// Where the weights were asked for, for complaints.
    place: String,
    pub(crate) memory: WeightBytes,
    /// Length of the lead-in, s.
    pub(crate) lead_in: f64,
    pub(crate) fallback: bool,
}

impl LearnedChoice {
    pub(crate) fn read(file: &SceneFile, table: &LearnedTable, time: &Timing) -> Result<Self, Problem> {
        let path = file.resolve(table.weights.get_ref());
        let place = file.place(&table.weights);
        let memory = weight_file::read(&path).map_err(|problem| file.problem(&table.weights, problem))?;
        let lead_in = table.lead_in.as_ref().map_or(LEAD_IN, |seconds| *seconds.get_ref());
        let learned = Self { path, place, memory, lead_in, fallback: table.fallback.unwrap_or(false) };
        let model = LearnedModel::new(learned.network()?, learned.fallback);
        let step = f64::from(model.map_err(|error| learned.problem(error))?.seconds());
        if let (Some(at), Some(method)) = (&file.scene.time.get_ref().method, &time.method) {
            return Err(file.problem(
                at,
                format!(
                    "method is \"{}\", but with [learned] the exact step leads and the network follows; leave \
                     method out",
                    method_name(Some(method))
                ),
            ));
        }
        let at = table.lead_in.as_ref().map_or_else(|| learned.place.clone(), |at| file.place(at));
        if !(lead_in.is_finite() && lead_in >= 0.0) {
            return Err(Problem(format!("{at}: lead_in is {lead_in} s, it must be zero or more")));
        }
        if (lead_in + step) * (1.0 - 1e-6) > time.end {
            return Err(Problem(format!(
                "{at}: the exact step leads for {lead_in} s (lead_in), so a learned step of {step:.3e} s does not fit \
                 before the end, {} s",
                time.end
            )));
        }
        Ok(learned)
    }

    /// A network of the crate, for the demo.
    pub(crate) fn of_demo(name: &str, bytes: &[u8]) -> Self {
        let memory = WeightBytes::of(bytes);
        Self { path: name.into(), place: "demo".into(), memory, lead_in: LEAD_IN, fallback: false }
    }

    pub(crate) fn network(&self) -> Result<Network<'_>, Problem> {
        weight_file::parse(&self.path, &self.memory).map_err(|problem| Problem(format!("{}: {problem}", self.place)))
    }

    /// How it moves a scene.
    pub(crate) fn method(&self) -> Result<Method<'_>, Problem> {
        Ok(Method::Learned { network: self.network()?, lead_in: self.lead_in, fallback: self.fallback })
    }

    /// The learned step of a scene of so many nodes.
    pub(crate) fn step(&self, nodes: usize, fallback: bool) -> Result<LearnedStep<'_, Vec<NodeVector>>, Problem> {
        let storage = vec![NodeVector::ZERO; learned::vectors_for(nodes, fallback)];
        LearnedStep::new(self.network()?, fallback, storage).map_err(|error| self.problem(error))
    }

    /// The damping of the training, which a scene may repeat but not change.
    pub(crate) fn damping(&self, file: &SceneFile, given: Option<&Spanned<f32>>) -> Result<f32, Problem> {
        let trained = self.network()?.recipe().damping;
        match given {
            Some(at) if !same(*at.get_ref(), trained) => Err(file.problem(
                at,
                format!(
                    "damping is {} 1/s, but {} learned a motion damped by {trained} 1/s; leave damping out to take it \
                     from there",
                    at.get_ref(),
                    self.path.display()
                ),
            )),
            _ => Ok(trained),
        }
    }

    /// The exact step of about `seconds` of which a learned step is a whole number, s.
    pub(crate) fn exact_seconds(&self, seconds: f32, time: &Timing) -> Result<f32, Problem> {
        let step = self.network()?.recipe().step;
        let count = (step / seconds).round();
        if count >= 1.0 && (count * seconds - step).abs() <= 1e-4 * step {
            return Ok(step / count);
        }
        Err(Problem(format!(
            "{}: the exact step is {seconds} s and that of {} {step} s, which is no whole number of them; write step = \
             {} or step = \"auto\"",
            time.step_at,
            self.path.display(),
            step / (step / seconds).ceil().max(1.0)
        )))
    }

    /// What a user should know before trusting the network on these tissues.
    pub(crate) fn warning(&self, tissues: &Tissues, element: Element) -> Result<Option<String>, Problem> {
        let network = self.network()?;
        let recipe = network.recipe();
        if tissues.is_of(recipe) && element == recipe.element {
            return Ok(None);
        }
        Ok(Some(format!(
            "{self} learned from {}; the scene is {tissues}, {} tetrahedra: its error there is not known",
            describe_tissue(&network),
            element.name()
        )))
    }

    /// The tetrahedra of the training.
    pub(crate) fn element(&self) -> Result<Element, Problem> {
        Ok(self.network()?.recipe().element)
    }

    fn problem(&self, error: impl std::fmt::Display) -> Problem {
        Problem(format!("{self}: {error}"))
    }
}

/// Where the scene file names the network, and its name.
impl std::fmt::Display for LearnedChoice {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}: {}", self.place, self.path.display())
    }
}
