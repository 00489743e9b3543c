//! What a pull begins in long steps of the length that they have unless one is given: right, or doubted.

use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Settings, Simulation};
use supple::step::Status;

use super::long;
use crate::support::{mean_distance, to_f64};

const FRAME: f64 = 1.0 / 60.0;
/// What may be wrong without a doubt, m.
const MOST: f64 = 2.5e-4;

#[test]
fn the_first_long_steps_under_a_pull_are_right_or_doubted() {
    for (edge, stiffness) in [(0.03, 50.0), (0.03, 1000.0), (0.1, 200.0)] {
        let pulled = |method: Method<'static>| {
            let bar = Bar { size: [edge, edge, 4.0 * edge], cells: [4, 4, 16] };
            let tissue = VecMaterial::one(Element::NodalStrain, NeoHookean { c: 500.0, d: 5_000.0 }, 1000.0);
            let fixed: Vec<_> = (0..25).map(Support::fixed).collect();
            let settings = Settings { method, damping: 5.0, ..Settings::default() };
            let mut body = Simulation::new(bar.points(), bar.tets(), tissue, &fixed).unwrap().with(settings);
            let at = [0.5 * edge, 0.5 * edge, 3.5 * edge];
            let pull = body.pull(at, 0.5 * edge, stiffness).unwrap();
            body.pulls[pull].put([at[0] + 0.4 * edge, at[1], at[2]]);
            body
        };
        let (mut exact, mut long) = (pulled(Method::Exact), pulled(long()));
        let (mut silent, mut doubted, mut moved) = (0.0_f64, 0, 0.0_f64);
        for _ in 0..20 {
            exact.advance(FRAME).unwrap();
            let status = long.advance(FRAME).unwrap().status;
            let right = to_f64(exact.state().displacements());
            let off = mean_distance(&to_f64(long.state().displacements()), &right);
            moved = moved.max(mean_distance(&right, &vec![[0.0; 3]; right.len()]));
            doubted += u32::from(status != Status::Ok);
            silent = if status == Status::Ok { silent.max(off) } else { silent };
        }
        println!(
            "{edge} m, {stiffness} N/m: {doubted} of 20 frames doubted, others {:.3} mm off at most, of {:.1} mm",
            1e3 * silent,
            1e3 * moved
        );
        assert!(silent < MOST && moved > 5e-3);
    }
}
