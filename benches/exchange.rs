//! What tissue that changes costs on the liver lobe: an exchange of the scene without a tenth of its elements, and a
//! stage of an ablation, in ms and in exact steps.
//!
//!     cargo bench --features io --bench exchange

use std::path::Path;
use std::time::Instant;

use supple::inertia::{self, Cells};
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};

fn lobe(element: Element, method: Method<'static>) -> Simulation<'static> {
    let file = supple::io::read_mesh(Path::new("meshes/lobe.msh")).expect("the lobe's mesh");
    let points: Vec<_> = file.points.iter().map(|point| point.map(|x| x as f32)).collect();
    let fixed: Vec<_> =
        (0..).zip(&points).filter(|(_, point)| point[1] > 0.03).map(|(node, _)| Support::fixed(node)).collect();
    let tissue = VecMaterial::one(element, NeoHookean { c: 1724.0, d: 16_667.0 }, 1060.0);
    let settings = Settings { method, damping: 20.0, guard: false, ..Settings::default() };
    let mut body = Simulation::new(points, file.tets, tissue, &fixed).expect("the lobe can be built").with(settings);
    body.gravity = [0.0, 0.0, -9.81];
    body.advance(0.05).expect("it moves");
    body
}

/// The least of some runs, ms.
fn least(mut run: impl FnMut() -> f64) -> f64 {
    (0..12).map(|_| run()).fold(f64::INFINITY, f64::min)
}

fn main() {
    println!(
        "element, method: exact step; without a tenth of the elements; region of an ablation; stage (ms, exact steps)"
    );
    for element in Element::ALL {
        let step = least(|| {
            let mut body = lobe(element, Method::Exact);
            let start = Instant::now();
            let steps = body.advance(0.05).expect("it moves").steps();
            1e3 * start.elapsed().as_secs_f64() / f64::from(steps)
        });
        for (name, method) in [("exact", Method::Exact), ("long", Method::Long(inertia::Method::new(Cells::Suggested)))]
        {
            let count = lobe(element, method.clone()).scene().element_count() as u32;
            let some: Vec<_> = (0..count / 10).collect();
            let timed = |with: &dyn Fn(&mut Simulation<'static>)| {
                let mut body = lobe(element, method.clone());
                let start = Instant::now();
                with(&mut body);
                1e3 * start.elapsed().as_secs_f64()
            };
            let removed = least(|| timed(&|body| body.remove(&some).expect("fewer elements")));
            let stiff = NeoHookean { c: 3000.0, d: 30_000.0 };
            let region = least(|| timed(&|body| body.ablate(&some, stiff, 1.0).expect("a region")));
            // A frame with a stage at its begin, over one without: steps that it takes more are part of it.
            let frame = |seconds: f64| {
                least(|| {
                    let mut body = lobe(element, method.clone());
                    body.ablate(&some, stiff, seconds).expect("a region");
                    body.advance(0.016).expect("it moves");
                    let start = Instant::now();
                    body.advance(0.016).expect("it moves");
                    1e3 * start.elapsed().as_secs_f64()
                })
            };
            let stage = frame(0.32) - frame(1e6);
            let told = [removed, region, stage].map(|ms| format!("{ms:.2} ({:.0})", ms / step));
            println!("{}, {name}: {step:.4} ms; {}; {}; {}", element.name(), told[0], told[1], told[2]);
        }
    }
}
