//! Loads, supports and time: each against a formula or the float64 reference; and that the same input gives the same
//! bits, also when a run is interrupted.

use proptest::prelude::*;
use supple::inertia::{Cells, LargeStep, Method};
use supple::loads::{Loads, Motion, NodalForce, ramp_factor, traction};
use supple::material::{AnyLaw, Law};
use supple::scene::{Axes, Support, VecScene};
use supple::step::Step;
use supple::tled;

use crate::support::bodies::{far_end, held, small_bar, torsion};
use crate::support::{
    Body, DENSITY, bits, fixed, largest, largest_distance, reference_law, rest_of, tissue, to_f64, widened,
};
use crate::{reference, support};

const DT: f32 = 1e-4;

/// Whatever time a host's state has, a ramp is a share, and the smallest one is no lever.
#[test]
fn ramps_have_not_begun_before_the_start() {
    for (time, ramp, factor) in
        [(-0.01, 1e-40, 0.0), (-0.01, 0.2, 0.0), (0.0, 0.2, 0.0), (-0.01, 0.0, 1.0), (0.1, 0.2, 0.5)]
    {
        assert_eq!(ramp_factor(time, ramp), factor, "{time} {ramp}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// `min(1, t / r)`, one where there is no ramp.
    #[test]
    fn a_ramp_grows_in_proportion_to_time_and_stays_at_one(time in 0.0..10.0_f64, ramp in 0.0_f32..10.0) {
        let exact = if ramp > 0.0 { f64::min(time / f64::from(ramp), 1.0) } else { 1.0 };
        prop_assert!((f64::from(ramp_factor(time, ramp)) - exact).abs() < 1e-7);
        prop_assert_eq!(ramp_factor(time, 0.0), 1.0);
        prop_assert_eq!(ramp_factor(f64::from(ramp), ramp), 1.0);
    }
}

#[test]
fn free_fall_follows_the_discrete_parabola() {
    let body = small_bar();
    for damping in [0.0, 20.0] {
        let scene = body.scene(tissue(support::EXP), &[]);
        let loads = Loads::new(&scene, [0.5, 0.0, -9.81], &[], &[]).unwrap();
        let step = Step::unchecked(DT, damping).unwrap();
        let mut state = rest_of(&scene);
        let steps = 1_000;
        support::run(&scene, &loads, &mut state, &step, steps);
        // u_n = g dt^2 n (n + 1) / 2 without damping: g t^2 / 2 from half a step earlier. In general a sum.
        let (dt, k) = (f64::from(DT), 0.5 * f64::from(damping) * f64::from(DT));
        let (mut fallen, mut increment) = (0.0, 0.0);
        for _ in 0..steps {
            increment = ((1.0 - k) * increment + dt * dt) / (1.0 + k);
            fallen += increment;
        }
        let closed = 0.5 * dt * dt * (steps * (steps + 1)) as f64;
        assert!(damping > 0.0 || (fallen / closed - 1.0).abs() < 1e-9);
        let exact = [0.5, 0.0, -9.81].map(|g: f32| f64::from(g) * fallen);
        let worst = largest_distance(&to_f64(state.displacements()), &vec![exact; body.points.len()]);
        println!(
            "free fall, damping {damping}/s: {:.6} m in 0.1 s, off by {:.1e} of it",
            exact[2],
            worst / largest(&[exact])
        );
        assert!(worst < 2e-5 * largest(&[exact]));
    }
}

#[test]
fn a_falling_body_reaches_its_terminal_velocity() {
    let body = small_bar();
    let scene = body.scene(tissue(support::NEO), &[]);
    let loads = Loads::new(&scene, [0.0, 0.0, -9.81], &[], &[]).unwrap();
    let mut state = rest_of(&scene);
    let step = Step::unchecked(DT, 100.0).unwrap();
    support::run(&scene, &loads, &mut state, &step, 5_000);
    let exact = -9.81 / 100.0;
    let speed = |node: usize| f64::from(state.velocity(node)[2]);
    let momentum: f64 = (0..body.points.len()).map(|node| f64::from(scene.view().node_mass(node)) * speed(node)).sum();
    let mean = (momentum / scene.mass() / exact - 1.0).abs();
    let worst = (0..body.points.len()).map(|node| (speed(node) / exact - 1.0).abs()).fold(0.0, f64::max);
    // Nodes tremble: the last place of a displacement of 5 cm is a force.
    println!("terminal velocity g / mu = {exact} m/s: off by {mean:.1e} of it, single nodes by {worst:.1e}");
    assert!(mean < 1e-5 && worst < 1e-3);
}

#[test]
fn a_force_accelerates_its_node() {
    let body = small_bar();
    let scene = body.scene(tissue(support::NEO), &[]);
    let mut state = rest_of(&scene);
    let step = Step::unchecked(DT, 0.0).unwrap();
    // Listed twice: forces add up. The second ramps and is at nothing in the first step.
    let force = |newton, ramp| NodalForce { node: 30, newton, ramp };
    let forces = [force([1e-3, 0.0, 2e-3], 0.0), force([0.0, 3e-3, -1e-3], 0.0), force([1.0; 3], 0.5)];
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    support::run(&scene, &loads, &mut state, &step, 1);
    let mass = f64::from(scene.view().node_mass(30));
    for (axis, newton) in [1e-3, 3e-3, 1e-3].into_iter().enumerate() {
        let exact = newton / mass * f64::from(DT).powi(2);
        assert!((f64::from(state.displacements()[30].to_array()[axis]) / exact - 1.0).abs() < 1e-6);
        assert!((f64::from(state.velocity(30)[axis]) / (exact / f64::from(DT)) - 1.0).abs() < 1e-6);
    }
    let others = state.displacements().iter().enumerate().filter(|(node, _)| *node != 30);
    assert!(others.into_iter().all(|(_, u)| u.to_array() == [0.0; 3]));
}

/// Total momentum grows by force times time, whatever happens inside.
#[test]
fn the_sum_of_forces_moves_the_centre_of_mass() {
    let body = small_bar();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &[]);
        let forces = [NodalForce { node: 5, newton: [2e-3, -1e-3, 0.0], ramp: 0.0 }];
        let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
        let mut state = rest_of(&scene);
        support::run(&scene, &loads, &mut state, &Step::unchecked(5e-5, 0.0).unwrap(), 1_000);
        for (axis, newton) in [2e-3, -1e-3, 0.0].into_iter().enumerate() {
            let momentum: f64 = (0..body.points.len())
                .map(|node| f64::from(scene.view().node_mass(node)) * f64::from(state.velocity(node)[axis]))
                .sum();
            assert!((momentum - newton * 0.05).abs() < 1e-5 * 1e-4, "{}: {momentum:e}", law.name());
        }
    }
}

#[test]
fn traction_adds_up_to_pressure_times_area() {
    let body = Body::lobe();
    let surface = body.surface();
    let area: f64 = surface
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|node| body.points[node as usize].map(f64::from));
            let (ab, ac) = (reference::tensor::difference(b, a), reference::tensor::difference(c, a));
            let normal = reference::tensor::cross(ab, ac);
            0.5 * reference::tensor::dot(normal, normal).sqrt()
        })
        .sum();
    let pascal = [100.0, -50.0, 20.0];
    let mut total = [0.0; 3];
    let mut shares = 0;
    for force in traction(&body.points, &surface, pascal, 0.25) {
        let force = force.unwrap();
        assert_eq!(force.ramp, 0.25);
        for (total, newton) in total.iter_mut().zip(force.newton) {
            *total += f64::from(newton);
        }
        shares += 1;
    }
    assert_eq!(shares, 3 * surface.len());
    println!("traction on {:.1} cm^2 of the lobe: {total:?} N", 1e4 * area);
    for (total, pascal) in total.iter().zip(pascal) {
        assert!((total / (f64::from(pascal) * area) - 1.0).abs() < 1e-5);
    }
    // A third of one triangle to each corner.
    let one: Vec<_> = traction(&[[0.0; 3], [0.02, 0.0, 0.0], [0.0, 0.03, 0.0]], &[[0, 1, 2]], [0.0, 0.0, 1e3], 0.0)
        .map(Result::unwrap)
        .collect();
    assert!(one.iter().all(|force| (force.newton[2] - 0.1).abs() < 1e-7));
}

#[test]
fn prescribed_positions_hold_at_the_end_of_each_step() {
    let body = small_bar();
    let end = far_end(&body);
    let moved = end.iter().map(|&node| Support { node, axes: Axes::X.union(Axes::Z), moves: true });
    let supports: Vec<_> = held(&body).into_iter().chain(moved).collect();
    let scene = body.scene(tissue(support::NEO), &supports);
    let motions: Vec<_> = end
        .iter()
        .map(|&node| Motion { node, axes: Axes::X.union(Axes::Z), metre: [2e-3, 9.0, -3e-3], ramp: 0.02 })
        .collect();
    let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
    let step = Step::unchecked(DT, 5.0).unwrap();
    let mut state = rest_of(&scene);
    for n in 1..=400_u32 {
        support::run(&scene, &loads, &mut state, &step, 1);
        let time = f64::from(n) * f64::from(DT);
        assert!((state.time() - time).abs() < 1e-12);
        let factor = ramp_factor(state.time(), 0.02);
        assert!((f64::from(factor) - (time / 0.02).min(1.0)).abs() < 1e-6);
        for &node in &end {
            let [x, _, z] = state.displacements()[node as usize].to_array();
            assert_eq!([x, z], [factor * 2e-3, factor * -3e-3]);
        }
    }
    let [_, y, _] = state.displacements()[end[0] as usize].to_array();
    assert!(y != 0.0 && y.abs() < 1e-2, "free along y: {y}");
    // Without the motions the nodes stay where they are, or go on from there.
    support::run(&scene, &Loads::NONE, &mut state, &step, 100);
    let [x, _, z] = state.displacements()[end[0] as usize].to_array();
    assert_eq!([x, z], [2e-3, -3e-3]);
}

/// What the last one overrides leaves no trace, neither in velocities nor in the energy balance, whose uncertainty
/// grows with jumps of supports and blinds it. With exact and long steps.
#[test]
fn of_several_motions_of_an_axis_the_last_one_alone_counts() {
    let body = small_bar();
    let end = far_end(&body);
    let supports: Vec<_> = held(&body).into_iter().chain(end.iter().copied().map(Support::moved)).collect();
    let scene = body.scene(tissue(support::NEO), &supports);
    let of = |axes, metre| end.iter().map(move |&node| Motion { node, axes, metre, ramp: 0.02 });
    let single: Vec<_> = of(Axes::XYZ, [1e-3, 0.0, -2e-3]).collect();
    // One all of whose axes are overridden, one of another axis in between, and one of which one axis stays.
    let several: Vec<_> = of(Axes::XYZ, [5e-3, 4e-3, 3e-3])
        .chain(of(Axes::Y, [0.0; 3]))
        .chain(of(Axes::X.union(Axes::Z), [1e-3, 7.0, 9e-3]))
        .chain(of(Axes::Z, [8.0, 8.0, -2e-3]))
        .collect();
    let exact = Step::unchecked(DT, 5.0).unwrap();
    let nodes = body.points.len();
    for is_long in [false, true] {
        let [by_single, by_several] = [&single, &several].map(|motions| {
            let loads = Loads::new(&scene, [0.0; 3], &[], motions).unwrap();
            let mut state = rest_of(&scene);
            if is_long {
                let step = Step::unchecked(2e-3, 5.0).unwrap();
                let (method, points) = (Method::new(Cells::Suggested), &body.points);
                let mut long = LargeStep::prepare_in_vec(method, scene.view(), points, state.view(), step).unwrap();
                for _ in 0..200 {
                    assert!(long.step(scene.view(), &loads, state.view()).is_taken());
                }
            } else {
                support::run(&scene, &loads, &mut state, &exact, 2_000);
            }
            let velocities: Vec<_> = (0..nodes).map(|node| state.velocity(node)).collect();
            (bits(&state), velocities, *state.energy_balance())
        });
        assert!(by_single.0 == by_several.0 && by_single.1 == by_several.1);
        let (one, several) = (by_single.2, by_several.2);
        println!(
            "long {is_long}: uncertainty {:.2e} and {:.2e} J of {:.2e} J",
            one.uncertainty, several.uncertainty, one.peak
        );
        assert!((one.uncertainty - several.uncertainty).abs() <= 1e-9 * one.uncertainty);
        assert!((one.work - several.work).abs() <= 1e-9 * one.work.abs());
        assert!(one.uncertainty < one.peak);
    }
}

/// Held along the normal, three planes let the body slide: uniform stretch, as one element would.
#[test]
fn partly_held_nodes_slide() {
    let body = Body::irregular([0.02, 0.02, 0.04], [3, 3, 5]);
    let planes = [Axes::X, Axes::Y, Axes::Z].into_iter().enumerate();
    let mut supports: Vec<Support> = planes
        .flat_map(|(axis, axes)| {
            body.nodes_where(move |x| x[axis] == 0.0).into_iter().map(move |node| Support { node, axes, moves: false })
        })
        .collect();
    let end = far_end(&body);
    supports.extend(end.iter().map(|&node| Support { node, axes: Axes::Z, moves: true }));
    let scene = body.scene(tissue(support::NEO), &supports);
    assert_eq!(scene.view().held(0), Axes::XYZ);
    let motions: Vec<_> =
        end.iter().map(|&node| Motion { node, axes: Axes::Z, metre: [0.0, 0.0, 8e-3], ramp: 0.2 }).collect();
    let loads = Loads::new(&scene, [0.0; 3], &[], &motions).unwrap();
    let mut state = rest_of(&scene);
    support::run(&scene, &loads, &mut state, &Step::unchecked(DT, 100.0).unwrap(), 10_000);
    // Every node on the same line: u = (e_x x, e_y y, 0.2 z).
    let u = to_f64(state.displacements());
    let corner = body.nodes_where(|x| x == [0.02, 0.02, 0.04])[0] as usize;
    let strain = [u[corner][0] / 0.02, u[corner][1] / 0.02, 0.2];
    let exact: Vec<_> = widened(&body.points).iter().map(|x| [0, 1, 2].map(|axis| strain[axis] * x[axis])).collect();
    let error = largest_distance(&u, &exact) / 8e-3;
    println!("sliding: strains {:.5} {:.5} 0.2, off a line by {error:.1e}", strain[0], strain[1]);
    assert!(error < 1e-4 && strain[0] < -0.08 && (strain[0] / strain[1] - 1.0).abs() < 1e-4);
    for node in body.nodes_where(|x| x[0] == 0.0) {
        assert_eq!(u[node as usize][0], 0.0);
    }
}

fn reference_of(body: &Body, law: AnyLaw, fixed: &[u32]) -> reference::Simulation {
    let mut simulation =
        reference::Simulation::new(body.reference(), reference_law(law), f64::from(DENSITY), f64::from(DT));
    simulation.fix(&fixed.iter().map(|&node| node as usize).collect::<Vec<_>>());
    simulation
}

/// Half of the bar is fixed: its elements are dropped, their mass and their neighbours are not.
#[test]
fn elements_that_cannot_move_are_dropped_without_a_trace() {
    let body = small_bar();
    let half = body.nodes_where(|x| x[2] < 0.02);
    let forces = torsion(&body, 2e-3, 0.01);
    let moving = |tet: &&[u32; 4]| !tet.iter().all(|node| half.contains(node));
    let kept = body.tets.iter().filter(moving).count();
    for law in support::laws() {
        let dropped = body.scene(tissue(law), &fixed(&half));
        assert_eq!(dropped.element_count(), kept);
        // The same with supports that might move: nothing is dropped, nothing moves them.
        let supports: Vec<_> = half.iter().copied().map(Support::moved).collect();
        let whole = body.scene(tissue(law), &supports);
        assert_eq!(whole.element_count(), body.tets.len());
        let step = Step::unchecked(DT, 20.0).unwrap();
        let run = |scene: &VecScene<_>| {
            let loads = Loads::new(scene, [0.0, 0.0, -9.81], &forces, &[]).unwrap();
            let mut state = rest_of(scene);
            support::run(scene, &loads, &mut state, &step, 1_000);
            to_f64(state.displacements())
        };
        let (a, b) = (run(&dropped), run(&whole));
        let mut simulation = reference_of(&body, law, &half);
        simulation.mu = 20.0;
        simulation.gravity = [0.0, 0.0, f64::from(-9.81_f32)];
        simulation.forces = forces
            .iter()
            .map(|f| reference::NodalForce {
                node: f.node as usize,
                newton: f.newton.map(f64::from),
                ramp: f64::from(f.ramp),
            })
            .collect();
        simulation.run(1_000);
        let scale = largest(&simulation.u);
        let (against_whole, against_reference) =
            (largest_distance(&a, &b) / scale, largest_distance(&a, &simulation.u) / scale);
        println!(
            "{}: {} of {} elements; against all of them {against_whole:.1e}, against the reference {against_reference:.1e}",
            law.name(),
            kept,
            body.tets.len()
        );
        // The elements are added in another order, hence other roundings.
        assert!(against_whole < 2e-5 && against_reference < 2e-5);
        for node in 0..body.points.len() {
            assert_eq!(dropped.view().node_mass(node), whole.view().node_mass(node));
        }
    }
}

/// Where no order changes, dropping changes no bit: the fixed half stands apart in the list of elements.
#[test]
fn dropping_elements_changes_no_bit_of_a_mesh_without_them() {
    let mut body = small_bar();
    let half = body.nodes_where(|x| x[2] < 0.02);
    let cannot_move = |tet: &[u32; 4]| tet.iter().all(|node| half.contains(node));
    body.tets.sort_by_key(cannot_move);
    let moving = body.tets.iter().filter(|tet| !cannot_move(tet)).count();
    // The same elements without the others, and their nodes, renumbered.
    let mut remaining = Body { tets: body.tets[..moving].to_vec(), ..body.clone() };
    let used: Vec<bool> =
        (0..remaining.points.len() as u32).map(|node| remaining.tets.iter().any(|tet| tet.contains(&node))).collect();
    remaining.points.retain({
        let mut node = 0;
        move |_| {
            node += 1;
            used[node - 1]
        }
    });
    let renumbered: Vec<u32> = {
        let mut count = 0;
        let used = (0..body.points.len() as u32).map(|node| body.tets[..moving].iter().any(|t| t.contains(&node)));
        used.map(|used| {
            count += u32::from(used);
            count.wrapping_sub(1)
        })
        .collect()
    };
    for node in remaining.tets.iter_mut().flatten() {
        *node = renumbered[*node as usize];
    }
    let kept: Vec<u32> = (0..body.points.len() as u32)
        .filter(|&node| body.tets[..moving].iter().any(|tet| tet.contains(&node)))
        .collect();
    let fixed_remaining: Vec<u32> =
        half.iter().filter(|node| kept.contains(node)).map(|&node| renumbered[node as usize]).collect();

    let step = Step::unchecked(DT, 20.0).unwrap();
    let scene = body.scene(tissue(support::EXP), &fixed(&half));
    let small = remaining.scene(tissue(support::EXP), &fixed(&fixed_remaining));
    assert_eq!(scene.element_count(), small.element_count());
    let forces = torsion(&body, 2e-3, 0.01);
    let forces_remaining: Vec<_> =
        forces.iter().map(|f| NodalForce { node: renumbered[f.node as usize], ..*f }).collect();
    let (mut a, mut b) = (rest_of(&scene), rest_of(&small));
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    support::run(&scene, &loads, &mut a, &step, 500);
    let loads = Loads::new(&small, [0.0; 3], &forces_remaining, &[]).unwrap();
    support::run(&small, &loads, &mut b, &step, 500);
    for (place, &node) in kept.iter().enumerate() {
        let (a, b) = (a.displacements()[node as usize], b.displacements()[place]);
        assert_eq!(a.to_array().map(f32::to_bits), b.to_array().map(f32::to_bits), "node {node}");
    }
}

/// All kinds of loads and supports at once, against the reference.
#[test]
fn everything_at_once_agrees_with_the_reference() {
    let body = small_bar();
    let end = far_end(&body);
    let (prescribed, pulled) = end.split_at(end.len() / 2);
    let bottom = body.nodes_where(|x| x[2] == 0.0);
    for law in support::laws() {
        let moved = prescribed.iter().map(|&node| Support { node, axes: Axes::X.union(Axes::Y), moves: true });
        let supports: Vec<_> = fixed(&bottom).into_iter().chain(moved).collect();
        let scene = body.scene(tissue(law), &supports);
        let motions: Vec<_> = prescribed
            .iter()
            .map(|&node| Motion { node, axes: Axes::X, metre: [3e-3, 0.0, 0.0], ramp: 0.03 })
            .collect();
        let forces: Vec<_> =
            pulled.iter().map(|&node| NodalForce { node, newton: [0.0, 1e-3, 1e-3], ramp: 0.05 }).collect();
        let loads = Loads::new(&scene, [0.0, -9.81, 0.0], &forces, &motions).unwrap();
        let mut state = rest_of(&scene);
        support::run(&scene, &loads, &mut state, &Step::unchecked(DT, 10.0).unwrap(), 2_000);

        let mut simulation = reference_of(&body, law, &bottom);
        simulation.mu = 10.0;
        simulation.gravity = [0.0, f64::from(-9.81_f32), 0.0];
        for &node in prescribed {
            simulation.fixed[node as usize] = [true, true, false];
            simulation.motions.push(reference::Motion {
                node: node as usize,
                axes: [true, false, false],
                metre: [f64::from(3e-3_f32), 0.0, 0.0],
                ramp: f64::from(0.03_f32),
            });
        }
        for force in &forces {
            simulation.forces.push(reference::NodalForce {
                node: force.node as usize,
                newton: force.newton.map(f64::from),
                ramp: f64::from(force.ramp),
            });
        }
        simulation.run(2_000);
        let error = largest_distance(&to_f64(state.displacements()), &simulation.u) / largest(&simulation.u);
        println!(
            "{}: {:.2} mm after 2,000 steps, {error:.1e} from the reference",
            law.name(),
            1e3 * largest(&simulation.u)
        );
        assert!(error < 2e-5);
    }
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let body = small_bar();
    let forces = torsion(&body, 2e-3, 0.02);
    for law in support::laws() {
        let run = || {
            let scene = body.scene(tissue(law), &held(&body));
            let loads = Loads::new(&scene, [0.0, 1.0, 0.0], &forces, &[]).unwrap();
            let mut state = rest_of(&scene);
            support::run(&scene, &loads, &mut state, &Step::unchecked(DT, 5.0).unwrap(), 1_000);
            bits(&state)
        };
        assert!(run() == run());
    }
}

#[test]
fn a_run_that_is_resumed_equals_one_that_was_not_interrupted() {
    let body = small_bar();
    let forces = torsion(&body, 2e-3, 0.02);
    let step = Step::unchecked(DT, 5.0).unwrap();
    for law in support::laws() {
        let scene = body.scene(tissue(law), &held(&body));
        let loads = Loads::new(&scene, [0.0, 1.0, 0.0], &forces, &[]).unwrap();
        let mut whole = rest_of(&scene);
        support::run(&scene, &loads, &mut whole, &step, 100);
        let mut saved = whole.clone();
        support::run(&scene, &loads, &mut whole, &step, 400);
        // Resumed later, on a scene that was built anew, with questions asked in between.
        let again = body.scene(tissue(law), &held(&body));
        for _ in 0..4 {
            support::run(&again, &loads, &mut saved, &step, 100);
            tled::critical_step(&again, &mut saved).unwrap();
            assert!(tled::strain_energy(&again, &mut saved.clone()).expect("room").is_finite());
        }
        assert!(bits(&whole) == bits(&saved), "{}", law.name());
        saved.reset();
        assert!(bits(&saved) == bits(&rest_of(&scene)));
    }
}
