//! The paper's bar with twisting forces at its free corners, as every bench has it.

use supple::element::{ElementLaw, ElementMaterial};
use supple::loads::NodalForce;
use supple::material::{Exponential, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{Support, VecScene};
use supple::step::Status;

/// The paper's step, s, damping, 1/s, and density, kg/m^3.
pub(crate) const DT: f32 = 3e-5;
pub(crate) const DAMPING: f32 = 20.0;
pub(crate) const DENSITY: f32 = 1000.0;
/// The paper's exponential law.
pub(crate) const EXPONENTIAL: Exponential = Exponential { a: 59.0, b: 8.023, d: 60_000.0 };
/// Nodes at the end that is held.
pub(crate) const HELD: std::ops::Range<u32> = 0..81;

pub(crate) type BarScene<L> = VecScene<Tissue<L>>;

pub(crate) fn points() -> Vec<[f32; 3]> {
    Bar::PAPER.points().collect()
}

pub(crate) fn tissue<L: ElementLaw>(law: L) -> Tissue<L> {
    Tissue { law, density: DENSITY }
}

pub(crate) fn scene<L: ElementLaw>(law: L) -> BarScene<L> {
    scene_with(tissue(law))
}

pub(crate) fn scene_with<M: ElementMaterial>(material: M) -> VecScene<M> {
    let fixed: Vec<_> = HELD.map(Support::fixed).collect();
    scene_of(material, &points(), &Bar::PAPER.tets().collect::<Vec<_>>(), &fixed)
}

pub(crate) fn scene_of<M: ElementMaterial>(
    material: M,
    points: &[[f32; 3]],
    tets: &[[u32; 4]],
    fixed: &[Support],
) -> VecScene<M> {
    let mesh = Mesh::new(points, tets, Winding::Checked).expect("the bar is sound");
    VecScene::build(material, &mesh, fixed).expect("the bar is sound")
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

pub(crate) fn moved(status: Status) {
    assert!(status.is_taken(), "{status:?}");
}
