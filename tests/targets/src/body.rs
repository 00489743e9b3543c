//! A bar that stands on its lower end under gravity and a force at a corner, with exact and with learned steps. How large
//! it is, is known to the compiler, so that nothing needs a heap.

use supple::loads::{Loads, NodalForce};
use supple::material::{Exponential, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::Network;
use supple::scene::{FixedScene, Support};
use supple::state::{FixedState, NodeVector};
use supple::surrogate::{self, Surrogate, Vertex};
use supple::tled::{self, Status, Step};

/// The exact step, s: a tenth of the networks'.
pub(crate) const SECONDS: f32 = 3e-5;
pub(crate) const DAMPING: f32 = 20.0;

/// A bar with its number of nodes, of elements and of blocks of elements, its lower end's nodes and its load.
pub(crate) struct Body<const NODES: usize, const ELEMENTS: usize, const BLOCKS: usize> {
    pub(crate) bar: Bar,
    pub(crate) fixed: usize,
    pub(crate) force: [NodalForce; 1],
}

pub(crate) type Scene<const NODES: usize, const BLOCKS: usize> =
    FixedScene<Tissue<Exponential>, NODES, BLOCKS>;

impl<const NODES: usize, const ELEMENTS: usize, const BLOCKS: usize> Body<NODES, ELEMENTS, BLOCKS> {
    pub(crate) fn points(&self) -> [[f32; 3]; NODES] {
        let mut points = [[0.0; 3]; NODES];
        for (point, of_bar) in points.iter_mut().zip(self.bar.points()) {
            *point = of_bar;
        }
        points
    }

    pub(crate) fn scene(&self) -> Option<Scene<NODES, BLOCKS>> {
        let mut tets = [[0; 4]; ELEMENTS];
        for (tet, of_bar) in tets.iter_mut().zip(self.bar.tets()) {
            *tet = of_bar;
        }
        let mut fixed = [Support::fixed(0); NODES];
        for (node, support) in (0..).zip(&mut fixed) {
            support.node = node;
        }
        let law = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
        let mut scene = Scene::new(Tissue { law, density: 1000.0 });
        let points = self.points();
        let mesh = Mesh::new(&points, &tets, Winding::Checked).ok()?;
        scene.build(&mesh, fixed.get(..self.fixed)?).ok()?;
        Some(scene)
    }

    pub(crate) fn loads(&self, scene: &Scene<NODES, BLOCKS>) -> Option<Loads<'_>> {
        Loads::new(scene, [0.0, 0.0, -9.81], &self.force, &[]).ok()
    }

    /// After some exact steps; `then` is called after each.
    pub(crate) fn exact(&self, steps: u32, then: impl FnMut()) -> Option<FixedState<NODES>> {
        let (scene, mut state) = (self.scene()?, FixedState::new());
        self.advance(&scene, &mut state, steps, then)?;
        Some(state)
    }

    fn advance(
        &self,
        scene: &Scene<NODES, BLOCKS>,
        state: &mut FixedState<NODES>,
        steps: u32,
        mut then: impl FnMut(),
    ) -> Option<()> {
        let (loads, step) = (self.loads(scene)?, Step::insist(SECONDS, DAMPING).ok()?);
        for _ in 0..steps {
            if tled::step(scene, &loads, state, &step) != Status::Ok {
                return None;
            }
            then();
        }
        Some(())
    }

    /// After `steps` learned ones that go on from `exact` ones; `then` is called after each. Where a step is refused is among
    /// what has to be the same; in the first half none may be.
    pub(crate) fn learned(
        &self,
        network: &[u8],
        exact: u32,
        steps: u32,
        mut then: impl FnMut(),
    ) -> Option<FixedState<NODES>> {
        let mut surrogate = Surrogate::over(Network::parse(network).ok()?, [Vertex::NEW; NODES]).ok()?;
        let (scene, mut state) = (self.scene()?, FixedState::new());
        self.advance(&scene, &mut state, exact, || ())?;
        let mut before = [NodeVector::ZERO; NODES];
        for (before, displacement) in before.iter_mut().zip(state.displacements()) {
            *before = *displacement;
        }
        self.advance(&scene, &mut state, 10, || ())?;
        state.span(&before, surrogate.seconds());
        surrogate.follow(&state);
        let loads = self.loads(&scene)?;
        let before = state.steps();
        for _ in 0..steps {
            if let Status::Diverged(_) = surrogate::step(&scene, &loads, &mut state, &mut surrogate) {
                break;
            }
            then();
        }
        (state.steps() - before >= u64::from(steps.div_ceil(2))).then_some(state)
    }
}
