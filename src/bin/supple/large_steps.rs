//! Steps beyond the limit of stability: their inertia on a host with a heap, and what it did on the way.

use supple::inertia::{
    Damper, Inertia, InertiaError, LatticeNode, Report, damped_numbers_for, damped_step, damped_vectors_for,
    lattice_functions, numbers_for, suggested_damped_lattice, suggested_lattice, vectors_for,
};
use supple::lab::networks;
use supple::loads::Loads;
use supple::material::Material;
use supple::mlp::Network;
use supple::state::NodeVector;
use supple::tled::{Status, Step};

use crate::prepare::{HostScene, HostState, Setup};
use crate::scene_file::Problem;
use crate::timing::Method;

/// The inertia of a scene, and what damps its rough motion.
pub(crate) struct HostInertia {
    inertia: Inertia<Vec<NodeVector>, Vec<LatticeNode>, Vec<f32>>,
    damper: Option<Damper<'static>>,
}

impl HostInertia {
    pub(crate) fn step<M: Material>(
        &mut self,
        scene: &HostScene<M>,
        loads: &Loads<'_>,
        state: &mut HostState,
    ) -> Status {
        damped_step(scene, loads, state, &mut self.inertia, self.damper.as_ref())
    }

    pub(crate) const fn report(&self) -> &Report {
        self.inertia.report()
    }
}

/// Cells along each axis and functions of a lattice, zeros for none.
#[derive(Clone, Copy, Eq, PartialEq)]
pub(crate) struct Grid {
    pub(crate) cells: [u32; 3],
    pub(crate) functions: usize,
    /// Whether what it does not carry is damped.
    pub(crate) damped: bool,
}

impl Grid {
    pub(crate) const NONE: Self = Self { cells: [0; 3], functions: 0, damped: false };

    /// The lattice that suits the scene.
    pub(crate) fn suggested<M: Material>(setup: &Setup, scene: &HostScene<M>) -> Self {
        let (damped, points) = (setup.time.method == Method::Damped, &setup.body.local);
        let (cells, functions) =
            if damped { suggested_damped_lattice(scene, points) } else { suggested_lattice(scene, points) };
        Self { cells, functions, damped }
    }

    /// The lattice that the scene file's method has.
    pub(crate) fn wanted<M: Material>(setup: &Setup, scene: &HostScene<M>) -> Result<Self, Problem> {
        if !setup.time.method.has_lattice() {
            return Ok(Self::NONE);
        }
        if let Some((cells, place)) = &setup.time.lattice {
            let functions = lattice_functions(scene, &setup.body.local, *cells)
                .map_err(|error| Problem(format!("{place}: {error}")))?;
            return Ok(Self { cells: *cells, functions, damped: setup.time.method == Method::Damped });
        }
        let grid = Self::suggested(setup, scene);
        if grid.functions == 0 {
            return Err(Problem(format!(
                "{}: with {} elements the mesh is too small for a lattice to pay; give lattice = [1, 1, 1] under \
                 [time], or method = \"mass-scaled\"",
                setup.body.name,
                scene.element_count()
            )));
        }
        Ok(grid)
    }

    /// Bytes of the inertia that a scene needs beside its state.
    pub(crate) fn bytes(self, nodes: usize) -> usize {
        let (vectors, places, numbers) = self.room(nodes);
        vectors * size_of::<NodeVector>() + places * size_of::<LatticeNode>() + numbers * size_of::<f32>()
    }

    /// Vectors, places and numbers of the inertia.
    fn room(self, nodes: usize) -> (usize, usize, usize) {
        let Self { cells, functions, damped } = self;
        let places = if functions > 0 { nodes } else { 0 };
        if damped {
            (damped_vectors_for(nodes), places, damped_numbers_for(cells, functions))
        } else {
            (vectors_for(nodes), places, numbers_for(cells, functions))
        }
    }

    /// The inertia for steps of one length from the state as it is.
    pub(crate) fn prepare<M: Material>(
        self,
        setup: &Setup,
        scene: &HostScene<M>,
        state: &mut HostState,
        step: Step,
    ) -> Result<HostInertia, InertiaError> {
        let (vectors, places, numbers) = self.room(scene.node_count());
        let mut inertia = Inertia::over(
            vec![NodeVector::ZERO; vectors],
            vec![LatticeNode::EMPTY; places],
            vec![0.0; numbers],
        );
        let mut damper = None;
        if self.damped {
            inertia = inertia.damped();
            damper = Network::parse(networks::damper()).ok().and_then(|network| Damper::over(network).ok());
        }
        inertia.prepare(scene, &setup.body.local, state, step, self.cells)?;
        Ok(HostInertia { inertia, damper })
    }
}

impl std::fmt::Display for Grid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let ([x, y, z], functions) = (self.cells, self.functions);
        write!(f, "{x} x {y} x {z} cells, {functions} functions")
    }
}

/// What the inertia did on the way.
#[derive(Clone, Copy)]
pub(crate) struct Trace {
    pub(crate) grid: Grid,
    /// After the latest step.
    pub(crate) report: Report,
    /// Steps in which nodes were held back, and the most nodes at once.
    pub(crate) steps_held_back: u64,
    pub(crate) most_held_back: u32,
    pub(crate) least_coarse_share: f32,
    /// Largest share of the rough motion that was taken away in a step.
    pub(crate) most_damping: f32,
    /// The largest estimate of the error, m.
    pub(crate) most_error: f32,
}

impl Trace {
    pub(crate) fn new(host: &HostInertia) -> Self {
        let HostInertia { inertia, damper } = host;
        let (cells, functions) = (inertia.cells(), inertia.functions());
        let grid = Grid { cells, functions, damped: damper.is_some() };
        Self {
            grid,
            report: *inertia.report(),
            steps_held_back: 0,
            most_held_back: 0,
            least_coarse_share: 1.0,
            most_damping: 0.0,
            most_error: 0.0,
        }
    }

    /// Takes the report of a step.
    pub(crate) fn add(&mut self, report: &Report) {
        self.report = *report;
        self.steps_held_back += u64::from(report.held_back > 0);
        self.most_held_back = self.most_held_back.max(report.held_back);
        self.least_coarse_share = self.least_coarse_share.min(report.coarse_share);
        self.most_damping = self.most_damping.max(report.damping);
        self.most_error = self.most_error.max(report.error);
    }
}

/// Added mass in words.
pub(crate) fn describe_added(report: &Report) -> String {
    format!(
        "on average {}, at most {} times its own mass (node {})",
        figure(report.added_mean),
        figure(report.added_largest),
        report.added_node
    )
}

/// Three figures for what may be a hundredth or thousands.
fn figure(value: f32) -> String {
    let decimals = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.decimals$}")
}
