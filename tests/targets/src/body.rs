//! A bar that stands on its lower end under gravity and a force at a corner, with exact steps in any tetrahedra and
//! with learned ones. The compiler knows its size, so that nothing needs a heap.

use supple::learned::{LearnedStep, vectors_for};
use supple::loads::{Loads, NodalForce};
use supple::material::{Exponential, Material, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::mlp::Network;
use supple::scene::{AsScene, FixedScene, Support};
use supple::state::{AsState, FixedState, NodeVector};
use supple::step::{Status, Step};
use supple::tled;

pub(crate) const TISSUE: Tissue<Exponential> =
    Tissue { law: Exponential { a: 59.0, b: 8.023, d: 60_000.0 }, density: 1000.0 };

/// The exact step, s: a tenth of the networks'.
pub(crate) const SECONDS: f32 = 3e-5;
pub(crate) const DAMPING: f32 = 20.0;

/// A bar with its number of nodes, of elements and of tiles of elements, its lower end's nodes and its load.
pub(crate) struct Body<const NODES: usize, const ELEMENTS: usize, const TILES: usize> {
    pub(crate) bar: Bar,
    pub(crate) fixed: usize,
    pub(crate) force: [NodalForce; 1],
}

pub(crate) type Scene<const NODES: usize, const TILES: usize> = FixedScene<Tissue<Exponential>, NODES, TILES>;

impl<const NODES: usize, const ELEMENTS: usize, const TILES: usize> Body<NODES, ELEMENTS, TILES> {
    pub(crate) fn points(&self) -> [[f32; 3]; NODES] {
        let mut points = [[0.0; 3]; NODES];
        for (point, of_bar) in points.iter_mut().zip(self.bar.points()) {
            *point = of_bar;
        }
        points
    }

    pub(crate) fn scene(&self) -> Option<Scene<NODES, TILES>> {
        self.scene_of(TISSUE)
    }

    /// Of a material with room for so many rows of patches.
    pub(crate) fn scene_of<M: Material, const ROWS: usize>(
        &self,
        material: M,
    ) -> Option<FixedScene<M, NODES, TILES, ROWS>> {
        let mut tets = [[0; 4]; ELEMENTS];
        for (tet, of_bar) in tets.iter_mut().zip(self.bar.tets()) {
            *tet = of_bar;
        }
        let mut fixed = [Support::fixed(0); NODES];
        for (node, support) in (0..).zip(&mut fixed) {
            support.node = node;
        }
        let mut scene = FixedScene::new(material);
        let points = self.points();
        let mesh = Mesh::new(&points, &tets, Winding::Checked).ok()?;
        scene.build(&mesh, fixed.get(..self.fixed)?).ok()?;
        Some(scene)
    }

    pub(crate) fn loads(&self, scene: &impl AsScene) -> Option<Loads<'_>> {
        Loads::new(scene, [0.0, 0.0, -9.81], &self.force, &[]).ok()
    }

    /// After some exact steps; `then` is called after each.
    pub(crate) fn exact(&self, steps: u32, then: impl FnMut()) -> Option<FixedState<NODES>> {
        let (scene, mut state) = (self.scene()?, FixedState::new());
        self.advance(&scene, &mut state, steps, then)?;
        Some(state)
    }

    pub(crate) fn advance(
        &self,
        scene: &impl AsScene,
        state: &mut impl AsState,
        steps: u32,
        mut then: impl FnMut(),
    ) -> Option<()> {
        let (loads, step) = (self.loads(scene)?, Step::unchecked(SECONDS, DAMPING).ok()?);
        for _ in 0..steps {
            if tled::step(scene, &loads, state, &step) != Status::Ok {
                return None;
            }
            then();
        }
        Some(())
    }

    /// After `exact` exact steps, a lead-in of one learned step and `steps` learned ones; `then` is called after each
    /// of these. Which step is refused has to be the same as well; in the first half none may be.
    pub(crate) fn learned(
        &self,
        network: &[u8],
        exact: u32,
        steps: u32,
        mut then: impl FnMut(),
    ) -> Option<FixedState<NODES>> {
        const NODE_VECTORS: usize = vectors_for(1, false);
        let mut storage = [[NodeVector::ZERO; NODE_VECTORS]; NODES];
        let network = Network::parse(network).ok()?;
        let mut learned = LearnedStep::new(network, false, storage.as_flattened_mut()).ok()?;
        let (scene, mut state) = (self.scene()?, FixedState::new());
        self.advance(&scene, &mut state, exact, || ())?;
        let (loads, step) = (self.loads(&scene)?, Step::unchecked(SECONDS, DAMPING).ok()?);
        let lead_in = (&step, f64::from(learned.model().seconds()));
        if learned.lead(scene.view(), &loads, state.view(), lead_in) != Ok(Status::Ok) {
            return None;
        }
        let before = state.steps();
        for _ in 0..steps {
            if !learned.step(scene.view(), &loads, state.view(), &step).ok()?.is_taken() {
                break;
            }
            then();
        }
        (state.steps() - before >= u64::from(steps.div_ceil(2))).then_some(state)
    }
}
