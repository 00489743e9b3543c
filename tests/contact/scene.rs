//! Bodies of tissue and the instruments that touch them.

use supple::contact::{
    Contact, Instrument, Surface, SurfaceNode, Touch, boundary, boundary_triangles, vectors_to_push,
};
use supple::loads::Loads;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{Support, VecScene};
use supple::state::{AsState, NodeVector, Progress, StateView};
use supple::step::{CriticalStep, Status, Step};
use supple::tled::{self, Settled, settle, vectors_to_settle};

fn tissue() -> VecMaterial {
    VecMaterial::one(Element::NodalStrain, NeoHookean { c: 1000.0, d: 10_000.0 }, 1000.0)
}

/// A body with its state, and the nodes that can be touched.
pub(crate) struct Body {
    pub(crate) points: Vec<[f32; 3]>,
    pub(crate) scene: VecScene<VecMaterial>,
    pub(crate) surface: Vec<SurfaceNode>,
    /// Those of the surface that instruments touch between nodes: none, unless asked for.
    pub(crate) triangles: Vec<[u32; 3]>,
    every_triangle: Vec<[u32; 3]>,
    pub(crate) step: Step,
    pub(crate) critical: CriticalStep,
    /// What the state keeps for instruments, if anything.
    pub(crate) pushes: Vec<NodeVector>,
    vectors: [Vec<NodeVector>; 5],
    progress: Progress,
}

impl Body {
    pub(crate) fn new(bar: Bar, supports: &[Support], damping: f32) -> Self {
        Self::of(bar.points().collect(), &bar.tets().collect::<Vec<_>>(), supports, damping)
    }

    pub(crate) fn of(points: Vec<[f32; 3]>, tets: &[[u32; 4]], supports: &[Support], damping: f32) -> Self {
        let mesh = Mesh::new(&points, tets, Winding::Normalised).unwrap();
        let scene = VecScene::build(tissue(), &mesh, supports).unwrap();
        let surface = boundary(&mesh);
        let every_triangle = boundary_triangles(&mesh, &surface);
        let zeros = || vec![NodeVector::ZERO; points.len()];
        let mut vectors = [zeros(), zeros(), zeros(), zeros(), zeros()];
        let mut progress = Progress::START;
        let critical = {
            let [displacement, remainder, increment, force, volume] = &mut vectors;
            let mut state = StateView::new(displacement, remainder, increment, force, volume, &mut progress);
            tled::critical_step(&scene, &mut state).unwrap()
        };
        let step = Step::new(0.9 * critical.seconds, damping, critical).unwrap();
        Self {
            points,
            scene,
            surface,
            triangles: Vec::new(),
            every_triangle,
            step,
            critical,
            pushes: Vec::new(),
            vectors,
            progress,
        }
    }

    /// The same, touched between its nodes too.
    pub(crate) fn with_triangles(mut self) -> Self {
        self.triangles = core::mem::take(&mut self.every_triangle);
        self.pushes = vec![NodeVector::ZERO; vectors_to_push(self.surface.len(), self.triangles.len())];
        self
    }

    pub(crate) fn state<'a>(&'a mut self, touches: &'a mut [Touch]) -> StateView<'a> {
        let [displacement, remainder, increment, force, volume] = &mut self.vectors;
        StateView::new(displacement, remainder, increment, force, volume, &mut self.progress).feeling(touches)
    }

    pub(crate) fn time(&self) -> f64 {
        self.progress.time()
    }

    pub(crate) fn displacement(&self, node: usize) -> [f32; 3] {
        self.vectors[0][node].to_array()
    }

    pub(crate) fn bits(&self) -> Vec<[u32; 4]> {
        self.vectors
            .iter()
            .flatten()
            .map(|vector| vector.to_array())
            .map(|[x, y, z]| [x, y, z, 0.0].map(f32::to_bits))
            .collect()
    }

    /// One step under gravity (m/s^2), with what the instruments feel.
    pub(crate) fn step(&mut self, gravity: [f32; 3], instruments: &[Instrument], touches: &mut [Touch]) -> Status {
        let (surface, triangles) = (self.surface.clone(), self.triangles.clone());
        let surface = Surface::new(&surface, self.points.len()).unwrap().with_triangles(&triangles).unwrap();
        let contact = Contact::new(surface, instruments).unwrap();
        let [displacement, remainder, increment, force, volume] = &mut self.vectors;
        let state = StateView::new(displacement, remainder, increment, force, volume, &mut self.progress);
        let mut state = state.feeling(touches).pushing(&mut self.pushes);
        let loads = Loads::new(&self.scene, gravity, &[], &[]).unwrap().touched_by(contact);
        tled::step(&self.scene, &loads, &mut state.as_state(), &self.step)
    }

    /// To rest under the instruments, in at most so many steps.
    pub(crate) fn settle(&mut self, instruments: &[Instrument], metre: f32, most: u32) -> Settled {
        let (surface, triangles) = (self.surface.clone(), self.triangles.clone());
        let surface = Surface::new(&surface, self.points.len()).unwrap().with_triangles(&triangles).unwrap();
        let contact = Contact::new(surface, instruments).unwrap();
        let [displacement, remainder, increment, force, volume] = &mut self.vectors;
        let state = StateView::new(displacement, remainder, increment, force, volume, &mut self.progress);
        let mut state = state.pushing(&mut self.pushes);
        let mut loads = Loads::NONE.touched_by(contact);
        let mut storage = vec![NodeVector::ZERO; vectors_to_settle(self.points.len())];
        settle(&self.scene, &mut loads, &mut state.as_state(), metre, most, &mut storage).unwrap()
    }

    /// J.
    pub(crate) fn kinetic(&self) -> f64 {
        self.progress.energy_balance().kinetic
    }

    /// Momentum of all nodes, kg m/s, and the mass, kg.
    pub(crate) fn momentum(&self) -> ([f64; 3], f64) {
        let (mut sum, mut all) = ([0.0; 3], 0.0);
        for (node, increment) in self.vectors[2].iter().enumerate() {
            let mass = f64::from(self.scene.view().node_mass(node));
            all += mass;
            for (sum, component) in sum.iter_mut().zip(increment.to_array()) {
                *sum += mass * f64::from(component) / f64::from(self.step.seconds());
            }
        }
        (sum, all)
    }
}

/// Size of a vector, and its distance from another as a share of it.
pub(crate) fn compared(vector: [f64; 3], other: [f64; 3]) -> (f64, f64) {
    let length = |vector: [f64; 3]| vector.iter().map(|component| component * component).sum::<f64>().sqrt();
    let size = length(vector);
    (size, length([0, 1, 2].map(|axis| vector[axis] - other[axis])) / size)
}
