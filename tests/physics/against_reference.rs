//! Long runs: the paper's bar under torsion for 20,000 steps against the float64 reference, and the energy of an
//! undamped bar over 100,000 steps.

use supple::element::ElementMaterial;
use supple::loads::Loads;
use supple::material::{AnyLaw, Law};
use supple::scene::VecScene;
use supple::state::VecState;
use supple::step::{Status, Step};
use supple::tled;

use crate::support::bodies::{corner_torsion, held, small_bar};
use crate::support::{Body, DENSITY, bound, largest, largest_distance, reference_law, rest_of, tissue, to_f64};
use crate::{reference, support};

/// The bar, its torsion of `newton` per corner and direction with a ramp of 1 s, damping of 20/s, steps of 3e-5 s.
fn torsion_error(law: AnyLaw, newton: f32, steps: u64) -> f64 {
    const DT: f32 = 3e-5;
    let body = Body::paper();
    let scene = body.scene(tissue(law), &held(&body));
    let forces = corner_torsion(&body, newton, 0.5);
    assert_eq!(forces.len(), 4);

    let mut simulation =
        reference::Simulation::new(body.reference(), reference_law(law), f64::from(DENSITY), f64::from(DT));
    simulation.mu = 20.0;
    simulation.fix(&simulation.mesh.nodes_where(|x| x[2] == 0.0).into_iter().collect::<Vec<_>>());
    for force in &forces {
        simulation.forces.push(reference::NodalForce {
            node: force.node as usize,
            newton: force.newton.map(f64::from),
            ramp: f64::from(force.ramp),
        });
    }

    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::new(DT, 20.0, bound(&scene, &rest_of(&scene))).unwrap();
    let mut state = rest_of(&scene);
    let mut error = 0.0;
    for part in 1..=4 {
        simulation.run(steps / 4);
        support::run(&scene, &loads, &mut state, &step, steps / 4);
        let scale = largest(&simulation.u);
        error = largest_distance(&to_f64(state.displacements()), &simulation.u) / scale;
        println!(
            "{}, step {}: largest displacement {:.3} mm, largest difference {error:.1e} of it",
            law.name(),
            part * steps / 4,
            1e3 * scale
        );
    }
    error
}

#[test]
fn the_papers_torsion_agrees_with_float64_exponential() {
    assert!(torsion_error(support::EXP, 0.3, 10_000) <= 2e-5);
}

#[test]
fn the_papers_torsion_agrees_with_float64_neo_hookean() {
    assert!(torsion_error(support::NEO, 0.1, 3_000) <= 2e-5);
}

/// Which energy: with `b` the mean of the increments before and after `t_n` (the kinetic energy of the energy_balance
/// is that of `b / dt`), central differences keep `1/2 m (b/dt)^2 + U - dt^2/8 f M^-1 f` constant where forces are
/// linear. The last term is what `1/2 m v^2` of half a step is less than that of its middle; without it the sum swings
/// by `(omega dt)^2 / 4` of the energy of each mode. Steps are a tenth of the bound, as 3e-5 s is for the paper's bar.
fn lag<M: ElementMaterial>(scene: &VecScene<M>, state: &VecState, step: &Step) -> f64 {
    let forces = state.forces().iter().enumerate();
    let squares = forces.map(|(node, force)| {
        let free = (0..3).filter(|axis| !scene.view().held(node).has(*axis));
        let square: f64 = free.map(|axis| f64::from(force.to_array()[axis]).powi(2)).sum();
        square / f64::from(scene.view().node_mass(node))
    });
    0.125 * f64::from(step.seconds()).powi(2) * squares.sum::<f64>()
}

#[test]
fn energy_stays_for_100_000_steps() {
    let body = small_bar();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let step = Step::unchecked(0.1 * bound(&scene, &rest_of(&scene)).seconds, 0.0).unwrap();
        let mut state = rest_of(&scene);
        // Bends and twists: up to 0.3 m/s at the end.
        let start = |node: usize| {
            let [x, y, z] = body.points[node];
            let share = z / 0.04;
            ([0.0; 3], [0.2 * share * share - 10.0 * share * (y - 0.01), 10.0 * share * (x - 0.01), 0.0])
        };
        assert!(tled::start(&scene, &mut state, &step, start));
        let (mut means, mut low, mut high) = (Vec::new(), f64::INFINITY, 0.0_f64);
        let (mut plain_low, mut plain_high, mut farthest) = (f64::INFINITY, 0.0_f64, 0.0_f64);
        for _ in 0..100 {
            let mut sum = 0.0;
            for _ in 0..100 {
                support::run(&scene, &Loads::NONE, &mut state, &step, 9);
                let strain = tled::strain_energy(&scene, &mut state).expect("room");
                let status = tled::step(&scene, &Loads::NONE, &mut state, &step);
                assert_eq!(status, Status::Ok);
                let plain = strain + state.energy_balance().kinetic;
                let total = plain - lag(&scene, &state, &step);
                (plain_low, plain_high) = (plain_low.min(plain), plain_high.max(plain));
                sum += total;
                (low, high) = (low.min(total), high.max(total));
            }
            means.push(sum / 100.0);
            farthest = farthest.max(largest(&to_f64(state.displacements())));
        }
        let drift = means.iter().map(|mean| (mean / means[0] - 1.0).abs()).fold(0.0, f64::max);
        println!(
            "{}: {:.3e} J, drift {:.4} % over 100,000 steps of {:.1e} s, extremes {:.4} % apart ({:.4} % \
             without the last term), displacement up to {:.1} mm",
            law.name(),
            means[0],
            100.0 * drift,
            step.seconds(),
            100.0 * (high - low) / means[0],
            100.0 * (plain_high - plain_low) / means[0],
            1e3 * farthest
        );
        assert!(drift < 1e-3);
    }
}
