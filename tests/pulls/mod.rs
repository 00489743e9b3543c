//! Pulls to targets (`supple::pulls`): closed forms, stability for any stiffness, long steps against exact ones, what is
//! refused.

mod closed_forms;
mod first_steps;
mod hostile;
mod late;
mod stiff;
mod turned;

use supple::inertia;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};

const ELEMENTS: [Element; 3] = [Element::Linear, Element::NodalPressure, Element::NodalStrain];
const BAR: Bar = Bar { size: [0.03, 0.03, 0.12], cells: [4, 4, 16] };
/// Of a bar of water's density, kg.
const MASS: f32 = 1000.0 * 0.03 * 0.03 * 0.12;

/// The bar of soft tissue, free or fixed at z = 0.
fn bar(element: Element, is_fixed: bool) -> Simulation<'static> {
    let tissue = VecMaterial::one(element, NeoHookean { c: 500.0, d: 10_000.0 }, 1000.0);
    let supports: Vec<_> = if is_fixed { (0..25).map(Support::fixed).collect() } else { vec![] };
    Simulation::new(BAR.points(), BAR.tets(), tissue, &supports).unwrap()
}

fn long() -> Method<'static> {
    Method::Long(inertia::Method::new(inertia::Cells::Suggested))
}

/// So many times the critical step, for long steps.
fn settings(method: Method<'static>, damping: f32, step: Option<f32>) -> Settings<'static> {
    Settings { method, step, damping, guard: false, ..Settings::default() }
}

fn length(vector: [f32; 3]) -> f32 {
    vector.into_iter().map(|component| component * component).sum::<f32>().sqrt()
}

/// Evenly between 0 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1u64 << 24) as f32
    }

    fn within(&mut self, size: [f32; 3]) -> [f32; 3] {
        size.map(|edge| edge * self.next())
    }
}
