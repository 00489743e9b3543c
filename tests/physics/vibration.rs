//! Motion against theory: the speed of waves along a thin bar, the first torsional frequency, order of convergence
//! in time and in space.

use std::f64::consts::PI;

use supple::loads::Loads;
use supple::material::{AnyLaw, Law, NeoHookean, VecMaterial};
use supple::scene::VecScene;
use supple::state::VecState;
use supple::step::Step;
use supple::tled;

use crate::support::bodies::{held, torsion};
use crate::support::{Body, DENSITY, bound, largest, norm, reference_law, rest_of, tissue, to_f64};
use crate::{reference, support};

/// Poisson's ratio 0.3. At small strain the law is linear with shear modulus 2 c and bulk modulus 2 d.
const SHEAR: f64 = 1000.0;
const BULK: f64 = 1000.0 * 2.6 / 1.2;
const LAW: NeoHookean = NeoHookean { c: (0.5 * SHEAR) as f32, d: (0.5 * BULK) as f32 };
const YOUNG: f64 = 9.0 * BULK * SHEAR / (3.0 * BULK + SHEAR);

/// Frequency (1/s) of a free oscillation: from the first to the last of `crossings` zeros of what `measure` sees.
fn frequency(
    scene: &VecScene<VecMaterial>,
    start: impl Fn(usize) -> [f32; 3],
    measure: impl Fn(&VecState) -> f64,
    crossings: usize,
) -> f64 {
    let step = Step::unchecked(0.8 * bound(scene, &rest_of(scene)).seconds, 0.0).unwrap();
    let mut state = rest_of(scene);
    assert!(tled::start(scene, &mut state, &step, |node| (start(node), [0.0; 3])));
    let mut times = Vec::new();
    let mut last = measure(&state);
    while times.len() < crossings {
        support::run(scene, &Loads::NONE, &mut state, &step, 1);
        let now = measure(&state);
        if last * now < 0.0 {
            times.push(state.time() - f64::from(step.seconds()) * now / (now - last));
        }
        assert!(state.steps() < 200_000, "it does not oscillate");
        last = now;
    }
    (crossings - 1) as f64 / (2.0 * (times[crossings - 1] - times[0]))
}

#[test]
fn the_constants_are_those_of_linear_elasticity() {
    // Uniaxial stress needs a lateral contraction of nu; both laws agree with c = a / 4.
    let nu = (3.0 * BULK - 2.0 * SHEAR) / (2.0 * (3.0 * BULK + SHEAR));
    assert!((nu - 0.3).abs() < 1e-12 && (YOUNG - 2.0 * SHEAR * 1.3).abs() < 1e-9);
    let e = 1e-4;
    let f = [[1.0 + e, 0.0, 0.0], [0.0, 1.0 - nu * e, 0.0], [0.0, 0.0, 1.0 - nu * e]];
    let exponential = reference::Law::Exponential { a: SHEAR, b: 8.0, d: 0.5 * BULK };
    for law in [reference_law(LAW), exponential] {
        let p = law.first_piola(&f);
        println!(
            "strain 1e-4: P11 / e = {:.2} Pa (E = {YOUNG:.2}), P22 / P11 = {:.1e}",
            p[0][0] / e,
            p[1][1] / p[0][0]
        );
        assert!((p[0][0] / e / YOUNG - 1.0).abs() < 1e-3 && p[1][1].abs() < 1e-3 * p[0][0]);
    }
}

/// `c = sqrt(E / rho)`: the lowest longitudinal mode of a bar held at one end has a quarter wave on its length.
#[test]
fn waves_run_along_a_thin_bar_at_their_speed() {
    let (side, length) = (0.01, 0.2);
    let body = Body::bar([side, side, length], [2, 2, 40]);
    // Held along z only, so that the section may contract at the end as well; two nodes keep it from turning.
    let end = body.nodes_where(|x| x[2] == 0.0);
    let supports: Vec<_> = end
        .iter()
        .map(|&node| {
            let [x, y, _] = body.points[node as usize];
            let middle = (x - 0.5 * side).abs() < 1e-6 && (y - 0.5 * side).abs() < 1e-6;
            let axes = if middle { supple::scene::Axes::XYZ } else { supple::scene::Axes::Z };
            supple::scene::Support { node, axes, moves: false }
        })
        .collect();
    let scene = body.scene(tissue(LAW), &supports);
    let k = 0.5 * PI / f64::from(length);
    let start = |node: usize| {
        let [x, y, z] = body.points[node].map(f64::from);
        let middle = 0.5 * f64::from(side);
        let across = -0.3 * k * (k * z).cos();
        [across * (x - middle), across * (y - middle), (k * z).sin()].map(|u| (1e-4 * u) as f32)
    };
    let tip = body.farthest(2) as usize;
    let measured = 4.0
        * f64::from(length)
        * frequency(&scene, start, |state| f64::from(state.displacements()[tip].to_array()[2]), 5);
    let exact = (YOUNG / f64::from(DENSITY)).sqrt();
    println!("wave speed {measured:.4} m/s, theory {exact:.4} m/s: {:+.2} %", 100.0 * (measured / exact - 1.0));
    assert!((measured / exact - 1.0).abs() < 0.03);
}

/// First torsional frequency of a free square bar, `f = c_t / (2 L)`, `c_t = sqrt(mu k / (rho I_p))` with Saint-
/// Venant's `k = 0.1406 a^4` and `I_p = a^4 / 6`.
#[cfg(feature = "slow-tests")]
fn torsion_frequency_error(across: u32) -> f64 {
    let (side, length) = (0.02_f32, 0.16_f32);
    let body = Body::bar([side, side, length], [across, across, 8 * across]);
    let scene = body.scene(tissue(LAW), &[]);
    let arm = |node: usize| {
        let [x, y, z] = body.points[node].map(f64::from);
        let middle = 0.5 * f64::from(side);
        let angle = (PI * z / f64::from(length)).cos();
        [-angle * (y - middle), angle * (x - middle), 0.0]
    };
    let measure = |state: &VecState| {
        let u = state.displacements().iter().enumerate();
        u.map(|(node, u)| {
            let along: f64 = u.to_array().iter().zip(arm(node)).map(|(u, arm)| f64::from(*u) * arm).sum();
            f64::from(scene.view().node_mass(node)) * along
        })
        .sum()
    };
    let start = |node: usize| arm(node).map(|u| (0.02 * u) as f32);
    let measured = frequency(&scene, start, measure, 3);
    let exact = (SHEAR / f64::from(DENSITY) * 0.1406 * 6.0).sqrt() / (2.0 * f64::from(length));
    println!(
        "torsion, {across} cells across: {measured:.4} Hz, theory {exact:.4} Hz: {:+.2} %",
        100.0 * (measured / exact - 1.0)
    );
    measured / exact - 1.0
}

#[test]
#[cfg(feature = "slow-tests")]
fn a_square_bar_twists_at_its_first_frequency() {
    let errors = [4, 8, 12].map(torsion_frequency_error);
    assert!(errors[0] > errors[1] && errors[1] > errors[2]);
    assert!(errors[2].abs() < 0.03);
}

/// The norm of the difference.
fn distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let differences: Vec<_> = a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|i| a[i] - b[i])).collect();
    norm(&differences)
}

/// Second order in time: the error falls by four when the step is halved. The load ramps up from zero, since the
/// start at rest (`u_-1 = 0`) is of first order under a load that is on from the beginning; then the bar swings to and
/// fro, so that the error outgrows the rounding. The truth is the reference at a thirty-second of the longest step.
#[test]
fn time_integration_is_of_second_order() {
    order_in_time(support::NEO);
    order_in_time(support::EXP);
}

fn order_in_time(law: AnyLaw) {
    let body = Body::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let (ramp, end) = (0.0625_f32, 0.5_f32);
    let scene = body.scene(tissue(law), &held(&body));
    let forces = torsion(&body, 3e-3, ramp);
    let solve = |steps: u16| {
        let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
        let step = Step::unchecked(end / f32::from(steps), 0.0).unwrap();
        let mut state = rest_of(&scene);
        support::run(&scene, &loads, &mut state, &step, u64::from(steps));
        to_f64(state.displacements())
    };
    let exact = {
        let steps = 2048 * 16;
        let dt = f64::from(end) / f64::from(steps);
        let mut simulation = reference::Simulation::new(body.reference(), reference_law(law), f64::from(DENSITY), dt);
        simulation.fix(&body.nodes_where(|x| x[2] == 0.0).iter().map(|&n| n as usize).collect::<Vec<_>>());
        simulation.forces = forces
            .iter()
            .map(|f| reference::NodalForce {
                node: f.node as usize,
                newton: f.newton.map(f64::from),
                ramp: f64::from(f.ramp),
            })
            .collect();
        simulation.run(steps as u64);
        simulation.u
    };
    // Powers of two: the steps are exact in float32 and end at the same time.
    let errors = [1024, 2048, 4096].map(|steps| distance(&solve(steps), &exact) / norm(&exact));
    let [a, b, c] = errors;
    println!(
        "{}: error {a:.2e}, {b:.2e}, {c:.2e} at {:.1e} s and halves of it: ratios {:.2}, {:.2}; largest \
             displacement {:.2} mm",
        law.name(),
        f64::from(end) / 1024.0,
        a / b,
        b / c,
        1e3 * largest(&exact)
    );
    assert!((a / b - 4.0).abs() < 0.4 && (b / c - 4.0).abs() < 0.4);
}

/// Where a bar held at one end comes to rest under a force along x on the other, m.
#[cfg(feature = "slow-tests")]
fn deflection(across: u32) -> f64 {
    let body = Body::bar([0.02, 0.02, 0.04], [across, across, 2 * across]);
    let scene = body.scene(tissue(LAW), &held(&body));
    // The end face as a traction, so that the load is the same on every mesh.
    let high = body.extent(2).1;
    let face: Vec<_> = body
        .surface()
        .into_iter()
        .filter(|triangle| triangle.iter().all(|&node| body.points[node as usize][2] == high))
        .collect();
    let forces: Vec<_> =
        supple::loads::traction(&body.points, &face, [5.0, 0.0, 0.0], 0.0).map(Result::unwrap).collect();
    let loads = Loads::new(&scene, [0.0; 3], &forces, &[]).unwrap();
    let step = Step::unchecked(0.8 * bound(&scene, &rest_of(&scene)).seconds, 30.0).unwrap();
    let mut state = rest_of(&scene);
    support::run(&scene, &loads, &mut state, &step, (1.2 / step.seconds()) as u64);
    let moved = to_f64(state.displacements());
    let end = body.nodes_where(|x| x[2] == high);
    end.iter().map(|&node| moved[node as usize][0]).sum::<f64>() / end.len() as f64
}

#[test]
#[cfg(feature = "slow-tests")]
fn errors_shrink_with_the_mesh() {
    let [a, b, c, d] = [2, 4, 8, 16].map(deflection);
    // Extrapolated from the two finest meshes at the order that the finest three show.
    let order = ((c - b) / (d - c)).log2();
    let limit = d + (d - c) / (2.0_f64.powf(order) - 1.0);
    let errors = [a, b, c, d].map(|x| (x / limit - 1.0).abs());
    println!(
        "deflection {:.5} {:.5} {:.5} {:.5} mm, limit {:.5} mm, errors {:.1} % {:.1} % {:.1} % {:.1} %, order {order:.2}",
        1e3 * a,
        1e3 * b,
        1e3 * c,
        1e3 * d,
        1e3 * limit,
        1e2 * errors[0],
        1e2 * errors[1],
        1e2 * errors[2],
        1e2 * errors[3]
    );
    assert!(a < b && b < c && c < d, "linear tetrahedra are too stiff, less so on a finer mesh");
    assert!(order > 1.3 && errors[3] < 0.04);
}
