//! A simulation that owns what it needs, on a host with a heap.

use core::fmt;
use std::boxed::Box;
use std::vec;
use std::vec::Vec;

use super::exchange::Changes;
use super::{
    Clock, Event, ExactSteps, LONG_STEPS, LONGEST_STEPS, Lead, Method, Mover, Report, Settings, usual_tolerance,
};
use crate::adaptive::{Adaptive, Request};
use crate::contact::{Contact, ContactError, Instrument, Surface, SurfaceNode, Touch, boundary, boundary_triangles};
use crate::guard::{self, Allowed, Guard};
use crate::inertia::{InertiaError, LargeStep};
use crate::learned::{self, LearnedError, LearnedModel, LearnedStep};
use crate::loads::{LoadError, Loads, LoadsOfCall, LoadsOverTime, Motion, NodalForce};
use crate::material::VecMaterial;
use crate::mesh::{Mesh, MeshError, Winding};
use crate::points::{PointError, VecPoints};
use crate::pressure::VecPressure;
use crate::pulls::{Pull, PullError, Pulled, PulledNode, Pulls, corners, let_go, patch, turn, usual_most};
use crate::scene::{BuildError, Support, VecScene};
use crate::simd::NodeVector;
use crate::state::VecState;
use crate::step::{CallingThread, CriticalStep, Divergence, Status, Step, StepError, Threads};
use crate::tled::{self, DisplacementError, Pace, SettleError, vectors_for_pace};

/// A scene in motion. Loads and instruments are set between two calls of [`Simulation::advance`] as the host likes.
#[derive(Debug)]
pub struct Simulation<'w> {
    /// Gravity, m/s^2.
    pub gravity: [f32; 3],
    /// Forces on nodes, N.
    pub forces: Vec<NodalForce>,
    /// Where moved supports go, m.
    pub motions: Vec<Motion>,
    /// Pressures that follow the surface, Pa.
    pub pressures: VecPressure,
    /// Rigid bodies that touch the tissue, after [`Simulation::meeting`].
    pub instruments: Vec<Instrument<'w>>,
    /// What draws points of the tissue to targets ([`Simulation::pull`]).
    pub pulls: Vec<Pull>,
    pub(super) pulled: Vec<PulledNode>,
    pub(super) points: Vec<[f32; 3]>,
    pub(super) tets: Vec<[u32; 4]>,
    pub(super) scene: VecScene<VecMaterial>,
    pub(super) state: VecState,
    settings: Settings<'w>,
    pub(super) touchable: Touchable,
    /// Checksum of the tables of what relaxes.
    pub(super) tables: u32,
    /// What has been removed, and what is being ablated.
    pub(super) changes: Changes,
    /// Room for where motions are in the next step.
    in_step: Vec<Motion>,
    /// None until the first call.
    pub(super) prepared: Option<Prepared<'w>>,
    /// What has moved the state under other settings, until the next call knows what acts.
    former: Option<Prepared<'w>>,
    clock: Clock,
}

/// Nodes and triangles that instruments can touch.
type Touchable = (Vec<SurfaceNode>, Vec<[u32; 3]>);

/// Steps of a method with their storage.
#[derive(Debug)]
pub(super) enum Prepared<'w> {
    Exact(Exact),
    Long(Box<LargeStep<Vec<NodeVector>>>, Option<Box<Guard<Vec<NodeVector>>>>),
    Auto(Box<Adaptive<Vec<NodeVector>>>),
    Learned(Box<LearnedStep<'w, Vec<NodeVector>>>, Exact, Lead, Option<Box<Guard<Vec<NodeVector>>>>),
}

/// See [`Simulation::acting`].
pub(super) struct Acting<'a, 'w> {
    pub(super) loads: LoadsOfCall<'a>,
    pub(super) scene: &'a VecScene<VecMaterial>,
    pub(super) state: &'a mut VecState,
    /// None before the steps are prepared.
    prepared: &'a mut Option<Prepared<'w>>,
    clock: &'a mut Clock,
}

#[derive(Debug)]
pub(super) enum Exact {
    Fixed(Step),
    Paced { pace: Pace, kept: Vec<NodeVector>, damping: f32 },
}

impl Exact {
    fn steps(&mut self) -> ExactSteps<'_> {
        match self {
            Self::Fixed(step) => ExactSteps::Fixed(*step),
            Self::Paced { pace, kept, damping } => ExactSteps::Paced { pace, kept, damping: *damping },
        }
    }
}

impl<'w> Simulation<'w> {
    /// A scene at rest: points (m), tetrahedra with positive volumes, what they are made of, supports. Exact steps
    /// without damping move it unless [`Simulation::with`] says otherwise.
    pub fn new(
        points: impl IntoIterator<Item = [f32; 3]>,
        tets: impl IntoIterator<Item = [u32; 4]>,
        material: VecMaterial,
        supports: &[Support],
    ) -> Result<Self, SimulationError> {
        let (points, tets) = (Vec::from_iter(points), Vec::from_iter(tets));
        let mesh = Mesh::new(&points, &tets, Winding::Checked)?;
        let scene = VecScene::build(material, &mesh, supports)?;
        Ok(Self::of_scene(scene, points, tets))
    }

    /// The same of a scene that is built, whose points and tetrahedra these are.
    #[must_use]
    pub fn of_scene(scene: VecScene<VecMaterial>, points: Vec<[f32; 3]>, tets: Vec<[u32; 4]>) -> Self {
        Self {
            gravity: [0.0; 3],
            forces: vec![],
            motions: vec![],
            pressures: VecPressure::default(),
            instruments: vec![],
            pulls: vec![],
            pulled: vec![],
            points,
            tets,
            state: VecState::of(scene.view()),
            tables: scene.view().memory_checksum(),
            scene,
            settings: Settings::default(),
            touchable: (vec![], vec![]),
            changes: Changes::default(),
            in_step: vec![],
            prepared: None,
            former: None,
            clock: Clock::default(),
        }
    }

    /// With these settings. They may be set again at any time; the motion goes on as it is.
    #[must_use]
    pub fn with(mut self, settings: Settings<'w>) -> Self {
        self.set(settings);
        self
    }

    /// See [`Simulation::with`].
    pub fn set(&mut self, settings: Settings<'w>) {
        self.former =
            if matches!(settings.method, Method::Long(_)) { None } else { self.prepared.take().or(self.former.take()) };
        (self.settings, self.prepared) = (settings, None);
    }

    /// With a surface that instruments can touch: the nodes of the boundary, and the triangles between them, which
    /// instruments need that are thinner than edges are long.
    pub fn meeting(mut self, triangles: bool) -> Result<Self, SimulationError> {
        self.meet_boundary(triangles)?;
        Ok(self)
    }

    pub(super) fn meet_boundary(&mut self, triangles: bool) -> Result<(), SimulationError> {
        let mesh = Mesh::new(&self.points, &self.tets, Winding::Normalised)?.without(&self.changes.removed)?;
        let nodes = boundary(&mesh);
        let triangles = if triangles { boundary_triangles(&mesh, &nodes) } else { vec![] };
        self.meet(nodes, triangles)?;
        self.changes.meets_boundary = true;
        Ok(())
    }

    /// The same with a surface of the caller's.
    pub fn meet(&mut self, nodes: Vec<SurfaceNode>, triangles: Vec<[u32; 3]>) -> Result<(), SimulationError> {
        let touchable = (nodes, triangles);
        self.state.make_room(&surface(&touchable, self.scene.node_count())?);
        (self.touchable, self.changes.meets_boundary) = (touchable, false);
        Ok(())
    }

    /// Adds a pull of so many N/m, with the usual limit ([`usual_most`]), at a point (m, at rest), and gives its place in [`Simulation::pulls`], where its target
    /// and limits are set. It acts on the nodes within `radius` (m), or with a radius of zero on those of the element
    /// around the point, or else nearest to it.
    pub fn pull(&mut self, point: [f32; 3], radius: f32, stiffness: f32) -> Result<usize, SimulationError> {
        let first = self.pulled.len();
        if radius == 0.0 {
            let mesh = Mesh::new(&self.points, &self.tets, Winding::Normalised)?;
            self.pulled.extend(VecPoints::locate(&mesh, &[point])?.points().iter().flat_map(corners));
        } else {
            let nodes = self.points.len();
            self.pulled.resize(first + nodes, PulledNode::default());
            let scene = self.scene.view();
            let count = patch(&self.points, |node| scene.node_mass(node), point, radius, &mut self.pulled[first..]);
            self.pulled.truncate(first + *count.as_ref().unwrap_or(&0));
            count?;
        }
        let count = self.pulled.len() - first;
        // Of removed tissue alone it pulls nothing that moves.
        let_go(self.scene.view(), self.pulled.get_mut(first..).unwrap_or_default());
        let most = usual_most(self.scene.view(), self.pulled.get(first..).unwrap_or_default());
        self.pulls.push(Pull { most, ..Pull::new([first as u32, count as u32], point, stiffness) });
        Ok(self.pulls.len() - 1)
    }

    /// Turns the points of pulls with the body ([`turn`]), as a host does between frames of a body that turns. Gives the
    /// largest change, m.
    pub fn turn_pulls(&mut self) -> f32 {
        let Self { scene, points, state, pulled, pulls, .. } = self;
        let scene = scene.view();
        turn(points, |node| scene.node_mass(node), state, state.displacements(), pulled, pulls)
    }

    /// The same in full, as of a body that was put where it is.
    pub(super) fn turn_pulls_anew(&mut self) {
        self.pulls.iter_mut().for_each(|pull| pull.turned_at = f32::NAN);
        self.turn_pulls();
    }

    /// Where the point of a pull is and how it is pulled. None if there is no such pull.
    #[must_use]
    pub fn pulled(&self, pull: usize) -> Option<Pulled> {
        let pulls = Pulls::new(self.scene.node_count(), &self.pulled, &self.pulls).ok()?;
        pulls.read(pull, self.state.displacements(), self.state.pull_forces(), self.state.time())
    }

    /// Moves on by so many seconds, usually a frame, under its loads and instruments. A span shorter than a sixteenth of the
    /// last step is left to the next call. Where a step is refused the error says why, and the state is that before it.
    pub fn advance(&mut self, seconds: f64) -> Result<Report, SimulationError> {
        self.advance_in_parts(seconds, &CallingThread)
    }

    /// The same, to the bit, on several threads of the host.
    pub fn advance_in_parts(&mut self, seconds: f64, threads: &impl Threads) -> Result<Report, SimulationError> {
        if !(seconds > 0.0 && seconds.is_finite()) {
            return Err(SimulationError::Seconds(seconds));
        }
        self.take_note()?;
        self.prepare_once()?;
        let work = self.settings.work();
        let Acting { mut loads, scene, state, prepared, clock } = self.acting()?;
        let end = clock.end_of_call(state.time(), seconds);
        // Not reached: prepared above; there is no panic in its place.
        let Some(prepared) = prepared else { return Err(SimulationError::NotFinite) };
        let mover = prepared.mover();
        let report = mover.advance(end, scene.view(), &mut loads, state.view(), work, threads, &mut |_| {})?;
        clock.ended(state.time(), report.status);
        match report.status {
            Status::Diverged(divergence) => Err(SimulationError::Refused(divergence)),
            _ => Ok(report),
        }
    }

    /// Moves on under loads of the caller's in place of its own; `watch` is shown each step. Other than with
    /// [`Simulation::advance`], `until` is a time (s) and not a span, what earlier calls lack or have too much is not
    /// made up for, a time that is not ahead takes no step, and a step that is refused is in the report, not an error.
    pub fn advance_under(
        &mut self,
        until: f64,
        mut loads: &mut dyn LoadsOverTime,
        watch: &mut dyn FnMut(Event<'_>),
    ) -> Result<Report, SimulationError> {
        self.take_note()?;
        if let Some(mut former) = self.former.take() {
            let (critical, Self { scene, state, .. }) = (self.critical_step()?, &mut *self);
            former.mover().end_long_steps(critical.seconds, scene.view(), &mut loads, state.view(), &CallingThread);
        }
        self.prepare_once()?;
        let Self { scene, state, prepared, settings, .. } = self;
        let work = settings.work();
        // Not reached: prepared above; there is no panic in its place.
        let Some(prepared) = prepared else { return Err(SimulationError::NotFinite) };
        let mover = prepared.mover();
        let watch = &mut |event: Event<'_>| watch(event);
        Ok(mover.advance(until, scene.view(), &mut loads, state.view(), work, &CallingThread, watch)?)
    }

    /// What takes part in a call under its own loads, checked.
    pub(super) fn acting(&mut self) -> Result<Acting<'_, 'w>, SimulationError> {
        let Self { gravity, forces, motions, pressures, instruments, pulls, pulled, scene, state, in_step, .. } = self;
        let (nodes, touchable) = (scene.node_count(), &self.touchable);
        let mut loads = pressures.on(scene, Loads::new(scene, *gravity, forces, motions)?)?;
        if !instruments.is_empty() {
            loads = loads.touched_by(Contact::new(surface(touchable, nodes)?, instruments)?);
        }
        if !pulls.is_empty() {
            loads = loads.pulled_by(Pulls::new(nodes, pulled, pulls)?);
        }
        state.make_room_for_pulls(pulls.len());
        in_step.resize(motions.len(), Motion::default());
        let loads = LoadsOfCall::new(loads, in_step);
        Ok(Acting { loads, scene, state, prepared: &mut self.prepared, clock: &mut self.clock })
    }

    /// The next call prepares the steps anew, from the state as it is.
    pub(super) fn forget_steps(&mut self) {
        (self.prepared, self.former) = (None, None);
    }

    fn prepare_once(&mut self) -> Result<(), SimulationError> {
        if self.prepared.is_none() { self.prepare() } else { Ok(()) }
    }

    /// Prepares the steps from the state as it is, which the first call of [`Simulation::advance`] does otherwise: what
    /// is wrong with the settings is told.
    pub fn prepare(&mut self) -> Result<(), SimulationError> {
        let critical = self.critical_step()?;
        self.settings.check(critical)?;
        if let Some(mut former) = self.former.take() {
            let Acting { mut loads, scene, state, .. } = self.acting()?;
            former.mover().end_long_steps(critical.seconds, scene.view(), &mut loads, state.view(), &CallingThread);
        }
        let Self { scene, state, points, settings, .. } = self;
        let Settings { step, damping, tolerance, unchecked, .. } = *settings;
        let nodes = scene.node_count();
        if !matches!(settings.method, Method::Long(_)) {
            state.view().end_long_steps(critical);
        }
        let exact = |damping: f32| match step {
            Some(seconds) if unchecked => Ok(Exact::Fixed(Step::unchecked(seconds, damping)?)),
            _ => {
                // Refused here, not in the middle of a call.
                let pace = Pace::of(step, damping, critical)?;
                let kept = vec![NodeVector::ZERO; vectors_for_pace(nodes, scene.view().memory_vectors())];
                Ok::<_, SimulationError>(Exact::Paced { pace, kept, damping })
            }
        };
        let guarded = |state: &mut VecState, seconds: f32, damping: f32, every: u32| {
            let step = Step::unchecked(seconds, damping)?;
            let guard = Guard::prepare_in_vec(scene.view(), points, state.view(), step, every)?;
            Ok::<_, SimulationError>(Box::new(match tolerance {
                Some(metres) => guard.allowing(Allowed::Metres(metres)),
                None => guard,
            }))
        };
        let prepared = match &settings.method {
            Method::Exact => Prepared::Exact(exact(damping)?),
            Method::Long(method) => {
                let seconds = step.unwrap_or(LONG_STEPS * critical.seconds);
                let step = Step::unchecked(seconds, damping)?;
                let large = LargeStep::prepare_in_vec(*method, scene.view(), points, state.view(), step)?;
                let guard = settings.guard.then(|| guarded(state, seconds, damping, guard::EVERY));
                Prepared::Long(Box::new(large), guard.transpose()?)
            }
            Method::Auto(method) => {
                let seconds = step.unwrap_or(LONGEST_STEPS * critical.seconds);
                let longest = Step::unchecked(seconds, damping)?;
                let request = Request { tolerance: tolerance.unwrap_or_else(|| usual_tolerance(points)), longest };
                let adaptive = Adaptive::prepare_in_vec(*method, scene.view(), points, state.view(), request)?;
                Prepared::Auto(Box::new(adaptive))
            }
            Method::Learned { network, lead_in, fallback } => {
                let (seconds, damping) = (network.recipe().step, network.recipe().damping);
                let storage = vec![NodeVector::ZERO; learned::vectors_for(nodes, *fallback)];
                let learned = LearnedStep::new(*network, *fallback, storage)?;
                let lead = Lead::new(learned.model().intervals(*lead_in));
                let guard = settings.guard.then(|| guarded(state, seconds, damping, guard::EVERY_LEARNED));
                Prepared::Learned(Box::new(learned), exact(damping)?, lead, guard.transpose()?)
            }
        };
        self.prepared = Some(prepared);
        Ok(())
    }

    /// What it was told.
    #[must_use]
    pub const fn settings(&self) -> &Settings<'w> {
        &self.settings
    }

    /// A bound of the longest stable exact step at the state as it is.
    pub fn critical_step(&mut self) -> Result<CriticalStep, SimulationError> {
        tled::critical_step(&self.scene, &mut self.state).ok_or(SimulationError::NotFinite)
    }

    /// What is simulated.
    #[must_use]
    pub const fn scene(&self) -> &VecScene<VecMaterial> {
        &self.scene
    }

    /// What moves.
    #[must_use]
    pub const fn state(&self) -> &VecState {
        &self.state
    }

    /// The same, to be changed: reset, restored, started elsewhere. Steps go on from there, a network's after a new
    /// lead-in; tissue that relaxes remembers nothing after a state of other elements, as before some were removed.
    /// Lengths that are chosen at [`Simulation::prepare`], those of long steps and the longest of [`Method::Auto`], stay
    /// as they are.
    pub const fn state_mut(&mut self) -> &mut VecState {
        &mut self.state
    }

    /// Both.
    pub const fn parts_mut(&mut self) -> (&VecScene<VecMaterial>, &mut VecState) {
        (&self.scene, &mut self.state)
    }

    /// Where the nodes are at rest, m.
    #[must_use]
    pub fn points(&self) -> &[[f32; 3]] {
        &self.points
    }

    /// Displacement of each node, m.
    #[must_use]
    pub fn displacements(&self) -> &[NodeVector] {
        self.state.displacements()
    }

    /// What each instrument felt in the latest step.
    #[must_use]
    pub fn touches(&self) -> &[Touch] {
        self.state.touches()
    }

    /// The prepared steps of [`Method::Long`], for their lattice and reports.
    #[must_use]
    pub fn long_step(&self) -> Option<&LargeStep<Vec<NodeVector>>> {
        match &self.prepared {
            Some(Prepared::Long(large, _)) => Some(large),
            _ => None,
        }
    }

    /// Those of [`Method::Auto`].
    #[must_use]
    pub fn auto_step(&self) -> Option<&Adaptive<Vec<NodeVector>>> {
        match &self.prepared {
            Some(Prepared::Auto(adaptive)) => Some(adaptive),
            _ => None,
        }
    }

    /// What learned steps know of their fallbacks.
    #[must_use]
    pub fn learned_step(&self) -> Option<&LearnedModel<'w>> {
        match &self.prepared {
            Some(Prepared::Learned(learned, ..)) => Some(learned.model()),
            _ => None,
        }
    }
}

impl<'w> Prepared<'w> {
    fn mover(&mut self) -> Mover<'_, 'w> {
        match self {
            Self::Exact(exact) => Mover::Exact(exact.steps()),
            Self::Long(large, guard) => {
                let (model, storage) = large.parts();
                Mover::Long(model, storage, guard.as_mut().map(|guard| guard.view()))
            }
            Self::Auto(adaptive) => Mover::Auto(adaptive.view()),
            Self::Learned(learned, exact, lead, guard) => {
                Mover::Learned(learned.view(), exact.steps(), lead, guard.as_mut().map(|guard| guard.view()))
            }
        }
    }
}

fn surface<'a>((nodes, triangles): &'a Touchable, scene_nodes: usize) -> Result<Surface<'a>, ContactError> {
    Surface::new(nodes, scene_nodes)?.with_triangles(triangles)
}

/// Why a simulation was refused, or a step of it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum SimulationError {
    /// The mesh is not one.
    Mesh(MeshError),
    /// The scene cannot be built.
    Build(BuildError),
    /// A load cannot be.
    Load(LoadError),
    /// An instrument or a surface cannot be.
    Contact(ContactError),
    /// A pull cannot be.
    Pull(PullError),
    /// A point cannot be located.
    Point(PointError),
    /// A length of step or a damping cannot be.
    Step(StepError),
    /// Steps beyond the critical one cannot be prepared.
    Inertia(InertiaError),
    /// A network cannot move the scene.
    Learned(LearnedError),
    /// The body cannot be brought to rest as asked for.
    Settling(SettleError),
    /// Displacements cannot be.
    Displacement(DisplacementError),
    /// The stiffness of some element is not a finite number.
    NotFinite,
    /// A span (s) that cannot be.
    Seconds(f64),
    /// An element to be removed or ablated that is not there.
    Element {
        /// Its number.
        element: u32,
        /// Elements of the mesh.
        elements: usize,
    },
    /// An ablation to another law than that of the tissue, or of nothing, or to more tissues than there can be.
    Ablation,
    /// A tolerance (m) that is none.
    Tolerance(f32),
    /// The state is of another scene.
    Room {
        /// Nodes of the scene.
        nodes: usize,
        /// Nodes that the state has room for.
        room: usize,
    },
    /// A step was refused: the state is that before it.
    Refused(Divergence),
}

impl fmt::Display for SimulationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mesh(error) => error.fmt(f),
            Self::Build(error) => error.fmt(f),
            Self::Load(error) => error.fmt(f),
            Self::Contact(error) => error.fmt(f),
            Self::Pull(error) => error.fmt(f),
            Self::Point(error) => error.fmt(f),
            Self::Step(error) => error.fmt(f),
            Self::Inertia(error) => error.fmt(f),
            Self::Learned(error) => error.fmt(f),
            Self::Settling(error) => error.fmt(f),
            Self::Displacement(error) => error.fmt(f),
            Self::NotFinite => f.write_str("the stiffness of some element is not a finite number"),
            Self::Seconds(seconds) => write!(f, "advance by {seconds} s: it must be a positive number"),
            Self::Element { element, elements } => {
                write!(f, "element {element} does not exist, the mesh has {elements} elements")
            }
            Self::Ablation => f.write_str("an ablation needs elements that are there, and the law that the tissue has"),
            Self::Tolerance(metres) => write!(f, "a tolerance of {metres} m: it must be a positive number"),
            Self::Room { nodes, room } => write!(f, "the state has room for {room} nodes, the scene has {nodes}"),
            Self::Refused(divergence) => divergence.fmt(f),
        }
    }
}

impl core::error::Error for SimulationError {}

macro_rules! from {
    ($($variant:ident: $error:ty,)*) => {
        $(
            impl From<$error> for SimulationError {
                fn from(error: $error) -> Self {
                    Self::$variant(error)
                }
            }
        )*
    };
}
from! {
    Mesh: MeshError,
    Build: BuildError,
    Load: LoadError,
    Contact: ContactError,
    Pull: PullError,
    Point: PointError,
    Step: StepError,
    Inertia: InertiaError,
    Learned: LearnedError,
    Settling: SettleError,
    Displacement: DisplacementError,
    Refused: Divergence,
}
