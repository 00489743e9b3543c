//! Points that turn with the body, by which they are drawn, feed no motion and come to rest, also where patches are as large as the
//! body.

use supple::loads::NodalForce;
use supple::material::{Element, NeoHookean, VecMaterial};
use supple::mesh::Bar;
use supple::scene::Support;
use supple::simulation::{Method, Simulation};

use super::{length, settings};

const COARSE: Bar = Bar { size: [0.02, 0.02, 0.06], cells: [3, 3, 8] };
const POINTS: [[f32; 3]; 3] = [[0.01, 0.02, 0.06], [0.01, 0.0, 0.05], [0.0, 0.0, 0.06]];
/// Of a patch, m: it has all nodes of some layers.
const RADIUS: f32 = 0.0185;

fn coarse(is_held: bool, c: f32, damping: f32) -> Simulation<'static> {
    let tissue = VecMaterial::one(Element::NodalStrain, NeoHookean { c, d: 2.0 * c }, 1000.0);
    let supports: Vec<_> = if is_held { (0..16).map(Support::fixed).collect() } else { vec![] };
    let bar = Simulation::new(COARSE.points(), COARSE.tets(), tissue, &supports).unwrap();
    let mut bar = bar.with(settings(Method::Exact, damping, None));
    POINTS.iter().for_each(|&at| assert!(bar.pull(at, RADIUS, 300.0).is_ok()));
    bar
}

#[test]
fn they_feed_no_motion() {
    for (is_held, damping) in [(true, 20.0), (false, 20.0), (false, 2.0), (false, 0.0)] {
        let [with, without] = [true, false].map(|turns| {
            let mut bar = coarse(is_held, 6000.0, damping);
            bar.forces = vec![NodalForce { node: 143, newton: [0.01, 0.0, 0.0], ramp: 0.0 }];
            let mut kinetic = vec![];
            for _ in 0..240 {
                if turns {
                    bar.turn_pulls();
                }
                assert!(bar.advance(1.0 / 60.0).unwrap().is_ok());
                kinetic.push(bar.state().energy_balance().kinetic);
                bar.forces.clear();
            }
            let most = |energies: &[f64]| energies.iter().copied().fold(0.0, f64::max);
            [most(&kinetic[..60]), most(&kinetic[180..])]
        });
        println!("held {is_held}, damping {damping} 1/s: {with:.1?} J at first and at last, {without:.1?} without");
        assert!(with[0] > 1e-8 && with[0] < 1.2 * without[0]);
        assert!(with[1] < (1.3 * without[1]).max(1e-2 * without[0]));
    }
}

/// Targets that disagree with the body, which bends and turns.
#[test]
fn they_are_turned_where_it_rests() {
    for is_held in [true, false] {
        let mut bar = coarse(is_held, 1000.0, 20.0);
        for (pull, [x, y, z]) in bar.pulls.iter_mut().zip(POINTS) {
            let (sine, cosine) = 0.6_f32.sin_cos();
            let drawn = if is_held { [x + 0.02, y, z] } else { [cosine * x + sine * z, y, cosine * z - sine * x] };
            pull.put(drawn);
        }
        let settled = |bar: &mut Simulation<'_>| {
            let before = bar.displacements().to_vec();
            let settled = bar.settle(1e-5, 20_000).unwrap();
            let way = |(now, before): (&supple::state::NodeVector, &supple::state::NodeVector)| {
                let (now, before) = (now.to_array(), before.to_array());
                length([0, 1, 2].map(|axis| now[axis] - before[axis]))
            };
            let most = bar.displacements().iter().zip(&before).map(way).fold(0.0, f32::max);
            (settled.at_rest, settled.steps, 1e3 * most)
        };
        let (first, second) = (settled(&mut bar), settled(&mut bar));
        println!("held {is_held}: at rest {}, {} steps, {:.3} mm; again {:.4} mm", first.0, first.1, first.2, second.2);
        assert!(first.0 && second.0 && first.2 > 10.0 && second.2 < 0.05);
    }
}
