//! The paper's bar with twisting forces at its free corners, as every bench has it.

use supple::loads::NodalForce;
use supple::material::{Exponential, Law, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{ElementBlock, NodeInertia, Scene, Support, blocks_for};
use supple::state::{NodeVector, State};
use supple::tled::Status;

/// The paper's step, s, damping, 1/s, and density, kg/m^3.
pub(crate) const DT: f32 = 3e-5;
pub(crate) const DAMPING: f32 = 20.0;
pub(crate) const DENSITY: f32 = 1000.0;
/// The paper's exponential law.
pub(crate) const EXPONENTIAL: Exponential = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
/// Nodes at the end that is held.
pub(crate) const HELD: std::ops::Range<u32> = 0..81;

pub(crate) type BarScene<L> = Scene<Tissue<L>, Vec<NodeInertia>, Vec<ElementBlock>>;
pub(crate) type HostState = State<Vec<NodeVector>>;

pub(crate) fn points() -> Vec<[f32; 3]> {
    Bar::PAPER.points().collect()
}

pub(crate) fn scene<L: Law>(law: L) -> BarScene<L> {
    let fixed: Vec<_> = HELD.map(Support::fixed).collect();
    scene_of(law, &points(), &Bar::PAPER.tets().collect::<Vec<_>>(), &fixed)
}

pub(crate) fn scene_of<L: Law>(
    law: L,
    points: &[[f32; 3]],
    tets: &[[u32; 4]],
    fixed: &[Support],
) -> BarScene<L> {
    let mesh = Mesh::new(points, tets, Winding::Checked).expect("the bar is sound");
    let nodes = vec![NodeInertia::EMPTY; points.len()];
    let blocks = vec![ElementBlock::EMPTY; blocks_for(tets.len())];
    let mut scene = Scene::over(Tissue { law, density: DENSITY }, nodes, blocks);
    scene.build(&mesh, fixed).expect("the bar is sound");
    scene
}

/// 0.07 N at each free corner.
pub(crate) fn forces() -> [NodalForce; 4] {
    let corners = [(0, 0, [1.0, -1.0]), (8, 0, [1.0, 1.0]), (8, 8, [-1.0, 1.0]), (0, 8, [-1.0, -1.0])];
    corners.map(|(i, j, [x, y])| NodalForce {
        node: Bar::PAPER.node(i, j, 17),
        newton: [0.05 * x, 0.05 * y, 0.0],
        ramp: 0.0,
    })
}

pub(crate) fn state(nodes: usize) -> HostState {
    let zero = || vec![NodeVector::ZERO; nodes];
    State::over(zero(), zero(), zero())
}

pub(crate) fn moved(status: Status) {
    assert!(matches!(status, Status::Ok | Status::Limited { .. }), "{status:?}");
}
