//! The same input gives the same bits, whatever instructions the processor offers: nothing fuses a
//! multiplication with an addition, and sums are taken in a fixed order.

use supple::lanes::Level;
use supple::loads::{Loads, NodalForce};
use supple::material::{Exponential, Law, Literal, NeoHookean, Tissue};
use supple::mesh::{Bar, Mesh, Winding};
use supple::scene::{ElementBlock, NodeInertia, Scene, Support, blocks_for};
use supple::state::{NodeVector, State};
use supple::tled::{self, CriticalStep, Step};

fn run<L: Law>(law: L, level: Level) -> (CriticalStep, Vec<[u32; 3]>) {
    assert!(Level::force(level), "this processor lacks {level:?}");
    let bar = Bar { size: [0.03, 0.02, 0.05], cells: [3, 2, 5] };
    let points: Vec<_> = bar.points().collect();
    let tets: Vec<_> = bar.tets().collect();
    let mesh = Mesh::new(&points, &tets, Winding::Checked).unwrap();
    let nodes = vec![NodeInertia::EMPTY; points.len()];
    let blocks = vec![ElementBlock::EMPTY; blocks_for(tets.len())];
    let mut scene = Scene::over(Tissue { law, density: 1000.0 }, nodes, blocks);
    let fixed: Vec<_> = (0..12).map(Support::fixed).collect();
    scene.build(&mesh, &fixed).unwrap();
    let zero = || vec![NodeVector::ZERO; points.len()];
    let mut state = State::over(zero(), zero(), zero());
    let force = NodalForce { node: bar.node(0, 2, 5), newton: [0.02, -0.03, 0.05], ramp: 0.05 };
    let forces = [force];
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &forces, &[]).unwrap();
    let step = Step::insist(5e-5, 10.0).unwrap();
    for _ in 0..2_000 {
        assert_eq!(tled::step(&scene, &loads, &mut state, &step), tled::Status::Ok);
    }
    let critical = tled::critical_step(&scene, &mut state).unwrap();
    let bits = state.displacements().iter().map(|u| u.to_array().map(f32::to_bits)).collect();
    (critical, bits)
}

fn compare<L: Law>(name: &str, law: L) {
    let best = Level::current();
    let portable = run(law, Level::Portable);
    assert!(portable.1.iter().flatten().any(|bits| f32::from_bits(*bits).abs() > 1e-3), "nothing moved");
    assert_eq!(portable, run(law, best), "{name}: portable and {best:?} differ");
    assert_eq!(portable, run(law, best), "{name}: two runs differ");
    println!("{name}: 2,000 steps, portable and {best:?} give the same bits");
}

#[test]
fn every_level_gives_the_same_bits() {
    compare("neo-Hookean", NeoHookean { c: 500.0, d: 15_000.0 });
    compare("exponential", Exponential { a: 59.0, b: 8.023, d: 60_000.0 });
    compare("exponential, literal", Literal(Exponential { a: 59.0, b: 8.023, d: 60_000.0 }));
}
