//! From a scene file to what the kernel wants: nodes in float32 around the body's centre, supports, loads,
//! tissues. Everything that can be wrong with a scene is found here, before any time passes.

use supple::loads::{Motion, NodalForce};
use supple::material::{Exponential, Law, Literal, Material, NeoHookean, Regions, Tissue};
use supple::mlp::{Recipe, TrainedLaw};
use supple::scene::{BuildError, ElementBlock, NodeInertia, Scene, Support, blocks_for};
use supple::state::{NodeVector, State};

use crate::body::{Body, read_body};
use crate::learned::{Learned, same};
use crate::loads::read_loads;
use crate::scene_file::{Problem, SceneFile};
use crate::timing::Timing;
use crate::tissues::read_tissues;

/// The kernel's scene and state on a host with a heap.
pub(crate) type HostScene<M> = Scene<M, Vec<NodeInertia>, Vec<ElementBlock>>;
pub(crate) type HostState = State<Vec<NodeVector>>;

/// A scene ready to be built.
pub(crate) struct Setup {
    pub(crate) body: Body,
    pub(crate) supports: Vec<Support>,
    pub(crate) forces: Vec<NodalForce>,
    pub(crate) motions: Vec<Motion>,
    pub(crate) gravity: [f32; 3],
    pub(crate) damping: f32,
    pub(crate) time: Timing,
    /// The network that takes over from the exact step.
    pub(crate) learned: Option<Learned>,
    pub(crate) warnings: Vec<String>,
    law: String,
    /// `a, b, c, d, density` of `[material]`, then of each region.
    tissues: Vec<[f32; 5]>,
    of_element: Vec<u16>,
}

/// Work that is compiled once for each law.
pub(crate) trait Job {
    type Output;
    fn run<M: Material>(self, material: M) -> Self::Output;
}

impl Setup {
    pub(crate) fn read(file: &SceneFile) -> Result<Self, Problem> {
        let scene = &file.scene;
        let body = read_body(file, &scene.mesh)?;
        let mut warnings = vec![];
        let diagonal = body.diagonal();
        if !(1e-3..=5.0).contains(&diagonal) {
            warnings.push(
                file.problem(
                    &scene.mesh,
                    format!(
                        "the body is {:.4} m across; is scale right? (0.001 turns millimetres into metres)",
                        diagonal
                    ),
                )
                .to_string(),
            );
        }
        let gravity = file.gravity()?;
        if let Some(at) = &scene.damping
            && let damping = *at.get_ref()
            && !(damping.is_finite() && damping >= 0.0)
        {
            return Err(file.problem(at, format!("damping is {damping} 1/s, it must be zero or more")));
        }
        let time = Timing::read(file)?;
        let learned = match &scene.surrogate {
            Some(table) => Some(Learned::read(file, table.get_ref(), &time)?),
            None => None,
        };
        let damping = match &learned {
            Some(learned) => learned.damping(file, scene.damping.as_ref())?,
            None => scene.damping.as_ref().map_or(0.0, |damping| *damping.get_ref()),
        };
        let (supports, forces, motions) = read_loads(file, &body)?;
        let (law, tissues, of_element) = read_tissues(file, &body)?;
        let mut setup = Self {
            body,
            supports,
            forces,
            motions,
            gravity,
            damping,
            time,
            learned,
            warnings,
            law,
            tissues,
            of_element,
        };
        if let Some(learned) = &setup.learned {
            let warning = learned.warning(&setup)?;
            setup.warnings.extend(warning);
        }
        Ok(setup)
    }

    /// The lobe of `supple demo`, which has no scene file.
    pub(crate) fn of_body(body: Body, constants: Exponential, density: f32) -> Self {
        let Exponential { a, b, d } = constants;
        Self {
            body,
            supports: vec![],
            forces: vec![],
            motions: vec![],
            gravity: [0.0; 3],
            damping: 0.0,
            time: Timing::of_demo(),
            learned: None,
            warnings: vec![],
            law: "exponential".into(),
            tissues: vec![[a, b, 0.0, d, density]],
            of_element: vec![],
        }
    }

    /// What the material is, for people.
    pub(crate) fn describe_material(&self) -> String {
        let [a, b, c, d, density] = self.tissues[0];
        let constants = if self.law.starts_with("neo") {
            format!("c {c} Pa, d {d} Pa")
        } else {
            format!("a {a} Pa, b {b}, d {d} Pa")
        };
        let regions = match self.tissues.len() - 1 {
            0 => String::new(),
            1 => ", 1 further region".into(),
            more => format!(", {more} further regions"),
        };
        format!("{}, {constants}, {density} kg/m^3{regions}", self.law)
    }

    /// Whether all of it is the tissue that a network learned from.
    pub(crate) fn is_of(&self, recipe: &Recipe<'_>) -> bool {
        let wanted = match recipe.law {
            TrainedLaw::NeoHookean { c, d, .. } => [0.0, 0.0, c, d, recipe.density],
            TrainedLaw::Exponential { a, b, d, .. } => [a, b, 0.0, d, recipe.density],
        };
        let mut constants = self.tissues.iter().flat_map(|tissue| tissue.iter().zip(&wanted));
        self.law == recipe.law.name() && constants.all(|(here, there)| same(*here, *there))
    }

    /// What moves the scene, by name.
    pub(crate) const fn method(&self) -> &'static str {
        if self.learned.is_some() { "learned" } else { self.time.method.name() }
    }

    /// Runs `job` with the material of this scene.
    pub(crate) fn with_material<J: Job>(&self, job: J) -> J::Output {
        match self.law.as_str() {
            "neo-hookean" => self.with_law(job, |[_, _, c, d, _]| NeoHookean { c, d }),
            "neo-hookean-literal" => self.with_law(job, |[_, _, c, d, _]| Literal(NeoHookean { c, d })),
            "exponential-literal" => self.with_law(job, |[a, b, _, d, _]| Literal(Exponential { a, b, d })),
            _ => self.with_law(job, |[a, b, _, d, _]| Exponential { a, b, d }),
        }
    }

    fn with_law<L: Law + Default, J: Job>(&self, job: J, law: impl Fn([f32; 5]) -> L) -> J::Output {
        let tissue = |constants: &[f32; 5]| Tissue { law: law(*constants), density: constants[4] };
        if let [only] = self.tissues.as_slice() {
            return job.run(tissue(only));
        }
        let tissues: Vec<_> = self.tissues.iter().map(tissue).collect();
        job.run(Regions { tissues: &tissues, of_element: &self.of_element })
    }

    /// The kernel's scene over vectors.
    pub(crate) fn build<M: Material>(&self, material: M) -> Result<(HostScene<M>, HostState), Problem> {
        let mesh = self.body.checked()?;
        let nodes = vec![NodeInertia::EMPTY; self.body.local.len()];
        let blocks = vec![ElementBlock::EMPTY; blocks_for(mesh.element_count())];
        let mut scene = Scene::over(material, nodes, blocks);
        scene.build(&mesh, &self.supports).map_err(|error| match error {
            BuildError::Mesh(error) => self.body.mesh_problem(error),
            error => Problem(format!("{}: {error}", self.body.name)),
        })?;
        Ok((scene, self.state()))
    }

    /// A state at rest.
    pub(crate) fn state(&self) -> HostState {
        let zero = || vec![NodeVector::ZERO; self.body.local.len()];
        State::over(zero(), zero(), zero())
    }
}
