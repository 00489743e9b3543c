//! A scene ready to be built: nodes in float32 around the body's centre, supports, loads, tissues, method.

use supple::contact::Instrument;
use supple::loads::{Loads, Motion, NodalForce};
use supple::material::{AnyLaw, Element, Tissue, VecMaterial};
use supple::pressure::VecPressure;
use supple::pulls::Pull;
use supple::scene::{AsScene, BuildError, SceneView, Support, VecScene};
use supple::simulation::Simulation;
use supple::state::VecState;

use super::body::{Body, read_body};
use super::file::SceneFile;
use super::instruments::SceneInstruments;
use super::learned::LearnedChoice;
use super::loads::{read_loads, read_masses};
use super::plausible;
use super::points::ScenePoints;
use super::pulls::ScenePulls;
use super::timing::{Timing, method_name};
use super::tissues::Tissues;
use crate::element_name::element_named;
use crate::problem::Problem;

/// A scene ready to be built.
pub struct Setup {
    pub body: Body,
    pub tissues: Tissues,
    pub element: Element,
    pub supports: Vec<Support>,
    /// Point masses with their nodes, kg.
    pub(crate) masses: Vec<(u32, f32)>,
    pub forces: Vec<NodalForce>,
    pub(crate) motions: Vec<Motion>,
    pub(crate) pressures: VecPressure,
    pub instruments: SceneInstruments,
    pub pulls: ScenePulls,
    pub points: ScenePoints,
    pub(crate) gravity: [f32; 3],
    /// 1/s.
    pub damping: f32,
    pub time: Timing,
    /// The network that takes over from the exact step.
    pub(crate) learned: Option<LearnedChoice>,
    pub warnings: Vec<String>,
}

impl Setup {
    pub fn read(file: &SceneFile) -> Result<Self, Problem> {
        Self::with_body(file, read_body(file, &file.scene.mesh)?)
    }

    /// The scene with this body in place of its own.
    pub(crate) fn with_body(file: &SceneFile, body: Body) -> Result<Self, Problem> {
        let scene = &file.scene;
        let gravity = file.gravity()?;
        if let Some(at) = &scene.damping
            && let damping = *at.get_ref()
            && !(damping.is_finite() && damping >= 0.0)
        {
            return Err(file.problem(at, format!("damping is {damping} 1/s, it must be zero or more")));
        }
        let time = Timing::read(file)?;
        let learned = match &scene.learned {
            Some(table) => Some(LearnedChoice::read(file, table.get_ref(), &time)?),
            None => None,
        };
        let damping = match &learned {
            Some(learned) => learned.damping(file, scene.damping.as_ref())?,
            None => scene.damping.as_ref().map_or(0.0, |damping| *damping.get_ref()),
        };
        let (supports, forces, motions, pressures) = read_loads(file, &body)?;
        let masses = read_masses(file, &body)?;
        let instruments = SceneInstruments::read(file, &body)?;
        let pulls = ScenePulls::read(file, &body)?;
        let points = ScenePoints::read(file, &body)?;
        let tissues = Tissues::read(file, &body)?;
        let mut warnings = plausible::warnings(file, &body, &tissues, gravity, &supports, &forces);
        warnings.extend(body.unused_remark());
        let held = supports.iter().map(|support| support.node).chain(pulls.pulled_nodes());
        warnings.extend(plausible::loose_part(file, &body, held));
        let element = read_element(file, learned.as_ref())?;
        let of_the_network = learned.as_ref().filter(|_| scene.mesh.get_ref().element.is_none());
        warnings.extend(locking(&file.place(&scene.mesh), of_the_network, element, &tissues));
        warnings.extend(time.old_name.clone());
        warnings.extend(instruments.warnings(file, &body, &supports)?);
        warnings.extend(points.warnings(file));
        warnings.extend(pulls.warnings(file, &body, &supports));
        if let Some(learned) = &learned {
            warnings.extend(learned.warning(&tissues, element)?);
            if tissues.relax() {
                let message = "learned steps do not know tissue that relaxes; remove prony, or take another method";
                return Err(file.problem(&scene.material, message));
            }
            if tissues.have_fibres() {
                let message = "learned steps do not know fibres; remove them, or take another method";
                return Err(file.problem(&scene.material, message));
            }
        }
        let mut setup = Self {
            body,
            tissues,
            element,
            supports,
            masses,
            forces,
            motions,
            pressures,
            instruments,
            pulls,
            points,
            gravity,
            damping,
            time,
            learned,
            warnings,
        };
        if setup.is_free() && (setup.gravity != [0.0; 3] || !setup.forces.is_empty()) {
            let message = "nothing holds the body: it goes where gravity and forces take it; [[fix]], [[spring]] or [[pull]] hold one";
            setup.warnings.push(Problem::in_file(file.path(), message).0);
        }
        Ok(setup)
    }

    /// The lobe of `supple demo`, which has no scene file.
    pub(crate) fn of_body(body: Body, law: impl Into<AnyLaw>, density: f32) -> Self {
        Self {
            body,
            tissues: Tissues::one(Tissue { law: law.into(), density }),
            element: Element::Linear,
            supports: vec![],
            masses: vec![],
            forces: vec![],
            motions: vec![],
            pressures: VecPressure::default(),
            instruments: SceneInstruments::default(),
            pulls: ScenePulls::default(),
            points: ScenePoints::default(),
            gravity: [0.0; 3],
            damping: 0.0,
            time: Timing::of_demo(),
            learned: None,
            warnings: vec![],
        }
    }

    /// What moves the scene, by name.
    pub const fn method_name(&self) -> &'static str {
        match &self.time {
            _ if self.learned.is_some() => "learned",
            time if time.is_adaptive => "auto",
            time => method_name(time.method.as_ref()),
        }
    }

    /// The kernel's scene, and a state at rest.
    pub fn build(&self) -> Result<(VecScene<VecMaterial>, VecState), Problem> {
        let scene = self.scene()?;
        let state = self.state(scene.view());
        Ok((scene, state))
    }

    fn scene(&self) -> Result<VecScene<VecMaterial>, Problem> {
        let mesh = self.body.checked()?;
        let scene = VecScene::build(self.tissues.material(self.element), &mesh, &self.supports);
        let mut scene = scene.map_err(|error| match error {
            BuildError::Mesh(error) => self.body.mesh_problem(error),
            error => Problem(format!("{}: {error}", self.body.name)),
        })?;
        for &(node, kilogram) in &self.masses {
            scene.add_mass(node as usize, kilogram).map_err(|error| Problem(format!("{}: {error}", self.body.name)))?;
        }
        Ok(scene)
    }

    /// A simulation at rest.
    pub(crate) fn simulation(&self) -> Result<Simulation<'_>, Problem> {
        let scene = self.scene()?;
        let mut simulation = Simulation::of_scene(scene, self.body.local.clone(), self.body.mesh.tets.clone());
        self.make_room(simulation.state_mut());
        Ok(simulation)
    }

    /// A state of the scene at rest.
    pub(crate) fn state(&self, scene: SceneView<'_, VecMaterial>) -> VecState {
        let mut state = VecState::of(scene);
        self.make_room(&mut state);
        state
    }

    /// For what instruments and pulls do, if there are any.
    fn make_room(&self, state: &mut VecState) {
        state.make_room_for_pulls(self.pulls.len());
        match self.instruments.surface(self.body.local.len()) {
            Ok(surface) if !self.instruments.is_empty() => state.make_room(&surface),
            _ => {}
        }
    }

    /// These loads with instruments and pulls, if there are any.
    pub(crate) fn acting<'a>(
        &'a self,
        loads: Loads<'a>,
        instruments: &'a [Instrument<'a>],
        pulls: &'a [Pull],
    ) -> Result<Loads<'a>, Problem> {
        let (mut loads, nodes) = (loads, self.body.local.len());
        if !instruments.is_empty() {
            loads = loads.touched_by(self.instruments.contact(instruments, nodes)?);
        }
        if !pulls.is_empty() {
            loads = loads.pulled_by(self.pulls.pulling(pulls, nodes)?);
        }
        Ok(loads)
    }

    /// Whether neither supports nor springs and pulls hold it, and no instrument could.
    pub(crate) fn is_free(&self) -> bool {
        self.supports.is_empty() && self.pulls.len() == 0 && self.instruments.is_empty()
    }

    /// The longest time over which a load rises, s.
    pub(crate) fn longest_ramp(&self) -> f32 {
        let forces = self.forces.iter().map(|force| force.ramp);
        let pressures = self.pressures.surfaces.iter().map(|pressure| pressure.ramp);
        let motions = self.motions.iter().map(|motion| motion.ramp);
        forces.chain(pressures).chain(motions).fold(0.0, f32::max)
    }

    /// What acts on the scene.
    pub fn loads(&self, scene: &impl AsScene) -> Result<Loads<'_>, Problem> {
        let loads = Loads::new(scene, self.gravity, &self.forces, &self.motions).map_err(Problem::of)?;
        self.pressures.on(scene, loads).map_err(Problem::of)
    }
}

/// A warning if linear tetrahedra, the scene file's or those that a network learned from, bend too little in one of the
/// tissues.
fn locking(place: &str, network: Option<&LearnedChoice>, element: Element, tissues: &Tissues) -> Option<String> {
    /// Above it a bar of 4 x 4 cells bends less than 0.6 times as far as it should.
    const MOST_POISSON_RATIO: f64 = 0.45;
    let ratio = tissues.moduli().map(|moduli| moduli.poisson_ratio()).fold(f64::NEG_INFINITY, f64::max);
    if element != Element::Linear || ratio <= MOST_POISSON_RATIO {
        return None;
    }
    let (subject, cure) = match network {
        Some(network) => {
            (format!("{network} learned from linear tetrahedra, which bend"), "a network that learned from")
        }
        None => (format!("{place}: element = \"linear\" bends"), "element ="),
    };
    Some(format!(
        "{subject} too little in tissue that hardly changes its volume (nu is {ratio:.4}, above {MOST_POISSON_RATIO}); {cure} \
         \"nodal-pressure\" does not"
    ))
}

/// The tetrahedra that `[mesh]` asks for; without a word those that a network learned from, or the ones that are
/// right more often, also at large strain (docs/accuracy.md, "Strain beyond a half").
fn read_element(file: &SceneFile, learned: Option<&LearnedChoice>) -> Result<Element, Problem> {
    let Some(at) = &file.scene.mesh.get_ref().element else {
        return learned.map_or(Ok(Element::NodalStrain), LearnedChoice::element);
    };
    element_named(at.get_ref()).map_err(|message| file.problem(at, message))
}
