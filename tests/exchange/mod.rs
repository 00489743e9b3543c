//! Tissue that changes while it moves (`Simulation::exchange`, `remove`, `ablate`): what it comes to, what is kept, what
//! is refused.

mod ablation;
mod resection;

use supple::inertia;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};

const ELEMENTS: [Element; 3] = [Element::Linear, Element::NodalPressure, Element::NodalStrain];
const BAR: Bar = Bar { size: [0.03, 0.03, 0.12], cells: [4, 4, 16] };
const SOFT: NeoHookean = NeoHookean { c: 500.0, d: 10_000.0 };
/// kg/m^3.
const DENSITY: f32 = 1000.0;

/// The bar of soft tissue, fixed at z = 0.
fn bar(element: Element) -> Simulation<'static> {
    let tissue = VecMaterial::one(element, SOFT, DENSITY);
    let supports: Vec<_> = (0..25).map(Support::fixed).collect();
    Simulation::new(BAR.points(), BAR.tets(), tissue, &supports).unwrap()
}

fn long() -> Method<'static> {
    Method::Long(inertia::Method::new(inertia::Cells::Suggested))
}

fn settings(method: Method<'static>, damping: f32) -> Settings<'static> {
    Settings { method, damping, guard: false, ..Settings::default() }
}

/// Elements whose centre is where `is` says, m.
fn elements_where(is: impl Fn([f32; 3]) -> bool) -> Vec<u32> {
    let points: Vec<_> = BAR.points().collect();
    let centre =
        |tet: [u32; 4]| [0, 1, 2].map(|axis| tet.iter().map(|&node| points[node as usize][axis]).sum::<f32>() / 4.0);
    (0..).zip(BAR.tets()).filter(|&(_, tet)| is(centre(tet))).map(|(element, _)| element).collect()
}

/// The largest distance between the nodes of two bodies, and the largest displacement, m.
fn difference(a: &Simulation<'_>, b: &Simulation<'_>) -> (f32, f32) {
    let mut most = (0.0f32, 0.0f32);
    for (a, b) in a.displacements().iter().zip(b.displacements()) {
        let distance = (glam::Vec3::from(a.to_array()) - glam::Vec3::from(b.to_array())).length();
        most = (most.0.max(distance), most.1.max(glam::Vec3::from(b.to_array()).length()));
    }
    most
}
