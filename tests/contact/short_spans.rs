//! A host may ask for a span far shorter than a step between others: an instrument that pushes does not throw the tissue away.

use supple::contact::{Instrument, Pose, Shape};
use supple::inertia::{Cells, Method as Lattice};
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};

use crate::support::{mean_distance, to_f64};

const FRAME: f64 = 1.0 / 60.0;

/// Where the nodes of a bar are that a ball presses by 4 mm, m, with a span of so many seconds after each frame.
fn pressed(method: Method<'static>, between: f64) -> Vec<[f64; 3]> {
    let bar = Bar { size: [0.03, 0.03, 0.06], cells: [4, 4, 8] };
    let tissue = VecMaterial::one(Element::NodalStrain, NeoHookean { c: 500.0, d: 10_000.0 }, 1000.0);
    let fixed: Vec<_> = (0..25).map(Support::fixed).collect();
    let settings = Settings { method, damping: 20.0, ..Settings::default() };
    let mut body =
        Simulation::new(bar.points(), bar.tets(), tissue, &fixed).unwrap().meeting(true).unwrap().with(settings);
    let at = |x: f32| Pose::at([x, 0.015, 0.045]);
    let mut ball = Instrument::resting(Shape::Sphere { radius: 0.01 }, at(0.041));
    ball.move_to(at(0.036), 0.0, 0.5);
    body.instruments = vec![ball];
    for _ in 0..40 {
        body.advance(FRAME).unwrap();
        if between > 0.0 {
            body.advance(between).unwrap();
        }
    }
    to_f64(body.state().displacements())
}

#[test]
fn spans_far_shorter_than_a_step_change_nothing() {
    let lattice = Lattice::new(Cells::Suggested);
    for (name, method) in [("exact", Method::Exact), ("long", Method::Long(lattice)), ("auto", Method::Auto(lattice))] {
        let without = pressed(method.clone(), 0.0);
        let motion = mean_distance(&without, &vec![[0.0; 3]; without.len()]);
        for between in [1e-9, 1e-7, 1e-5, 1e-4, 1e-3, 2e-3] {
            let off = mean_distance(&pressed(method.clone(), between), &without);
            assert!(off < 0.03 * motion && motion > 1e-3, "{name}, {between} s: {off} m");
            println!("{name}, {between:.0e} s: {:.4} mm off, of {:.3} mm", 1e3 * off, 1e3 * motion);
        }
    }
}
