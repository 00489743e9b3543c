//! Tests of the float64 reference itself: the judge is judged against the definitions. Each prints its figure
//! (`cargo test --test kernel physics::reference_self -- --nocapture`).

use std::time::Instant;

use crate::reference;
use crate::reference::tensor::{IDENTITY, from_fn, max_abs, rotation};
use crate::reference::{Law, Mat3, Mesh, Motion, NodalForce, Random, Simulation, Vec3};
use crate::reference::{closed_form, critical_step, deformations, internal_force, strain_energy, tangent_product};

const DENSITY: f64 = 1000.0;

const LAWS: [Law; 3] =
    [Law::NeoHookean { c: 500.0, d: 25_000.0 }, Law::PAPER, Law::Polynomial { c: 500.0, e: 750.0, d: 25_000.0 }];

/// Largest relative error per kind of deformation.
fn worst_per_kind(figure: &str, error: impl Fn(&Law, &Mat3) -> f64) -> f64 {
    let mut all = 0.0_f64;
    for law in LAWS {
        for kind in ["J in 0.6 .. 1.6", "crushed", "inverted", "above the cap"] {
            let of_kind = deformations().into_iter().filter(|(name, _)| *name == kind);
            let worst = of_kind.map(|(_, f)| error(&law, &f)).fold(0.0, f64::max);
            println!("{figure}: {law:?}, {kind}: {worst:.1e}");
            all = all.max(worst);
        }
    }
    all
}

/// Central difference of `value` along the entry `(k, l)` of `F`.
fn difference_quotient(f: &Mat3, k: usize, l: usize, value: impl Fn(&Mat3) -> f64) -> f64 {
    let h = 1e-6;
    let (mut plus, mut minus) = (*f, *f);
    plus[k][l] += h;
    minus[k][l] -= h;
    (value(&plus) - value(&minus)) / (2.0 * h)
}

#[test]
fn stress_is_the_derivative_of_the_energy() {
    let worst = worst_per_kind("P against dPsi/dF", |law, f| {
        let p = law.first_piola(f);
        let numeric = from_fn(|k, l| difference_quotient(f, k, l, |f| law.energy(f)));
        max_abs(&from_fn(|i, j| p[i][j] - numeric[i][j])) / max_abs(&p)
    });
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn tangent_is_symmetric_and_the_derivative_of_the_stress() {
    let worst = worst_per_kind("tangent against dP/dF", |law, f| {
        let tangent = law.tangent(f);
        let largest = tangent.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        let mut error = 0.0_f64;
        for (row, entries) in tangent.iter().enumerate() {
            for (col, entry) in entries.iter().enumerate() {
                let p = |f: &Mat3| law.first_piola(f)[row / 3][row % 3];
                let numeric = difference_quotient(f, col / 3, col % 3, p);
                error = error.max((entry - numeric).abs() / largest);
                let asymmetry = (entry - tangent[col][row]).abs() / largest;
                assert!(asymmetry < 1e-13, "{asymmetry:e}");
            }
        }
        error
    });
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn continuations_are_c1() {
    let mut worst = 0.0_f64;
    for law in LAWS {
        // Across J = J_MIN by a dilation, across the cap by a shear.
        let (s, q) = (reference::J_MIN.cbrt(), (reference::EXPONENT_CAP / 8.023).sqrt());
        let h = 1e-9;
        let shear_and_squeeze = |s: f64| from_fn(|i, j| s * closed_form::simple_shear(0.3)[i][j]);
        for (below, above) in [
            (shear_and_squeeze(s * (1.0 - h)), shear_and_squeeze(s * (1.0 + h))),
            (closed_form::simple_shear(q * (1.0 - h)), closed_form::simple_shear(q * (1.0 + h))),
        ] {
            let (p, r) = (law.first_piola(&below), law.first_piola(&above));
            worst = worst.max((law.energy(&below) / law.energy(&above) - 1.0).abs());
            worst = worst.max(max_abs(&from_fn(|i, j| p[i][j] - r[i][j])) / max_abs(&p));
        }
    }
    println!("jump of energy and stress across J_MIN and the cap, 1e-9 on both sides: {worst:.1e}");
    assert!(worst < 1e-6, "{worst:e}");
}

#[test]
fn stress_matches_the_closed_forms() {
    let mut worst = 0.0_f64;
    for law in LAWS {
        for x in [-0.4, -0.1, -1e-3, 0.0, 1e-3, 0.1, 0.3] {
            let cases = [
                (closed_form::uniaxial_stretch(1.0 + x), closed_form::uniaxial_stretch_stress(&law, 1.0 + x)),
                (closed_form::simple_shear(x), closed_form::simple_shear_stress(&law, x)),
                (closed_form::dilation(1.0 + x), closed_form::dilation_stress(&law, 1.0 + x)),
            ];
            for (f, exact) in cases {
                let p = law.first_piola(&f);
                // Relative to the stress of a volume change of one per cent where there is less.
                let scale = max_abs(&exact).max(0.02 * law.d());
                worst = worst.max(max_abs(&from_fn(|i, j| p[i][j] - exact[i][j])) / scale);
            }
        }
    }
    println!("P against closed forms (stretch, shear, dilation): {worst:.1e}");
    assert!(worst < 1e-13, "{worst:e}");
}

/// Largest difference of the internal force to the central difference of the strain energy, relative.
fn force_error(mesh: &Mesh, law: &Law, u: &[Vec3], h: f64) -> f64 {
    let force = internal_force(mesh, law, u);
    let largest = force.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    let mut error = 0.0_f64;
    for (node, exact) in force.iter().enumerate() {
        for (axis, exact) in exact.iter().enumerate() {
            let energy = |shift: f64| {
                let mut u = u.to_vec();
                u[node][axis] += shift;
                strain_energy(mesh, law, &u)
            };
            let numeric = (energy(h) - energy(-h)) / (2.0 * h);
            error = error.max((exact - numeric).abs() / largest);
        }
    }
    error
}

#[test]
fn force_is_the_gradient_of_the_energy() {
    let tet = Mesh {
        points: vec![[0.0, 0.0, 0.0], [0.011, 0.001, 0.0], [0.002, 0.009, -0.001], [0.001, 0.003, 0.012]],
        tets: vec![[0, 1, 2, 3]],
    };
    let worst =
        worst_per_kind("f_int against dE/du, one element", |law, f| force_error(&tet, law, &tet.affine(f), 1e-8));
    assert!(worst < 1e-7, "{worst:e}");

    let bar = Mesh::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let mut random = Random(3);
    for law in LAWS {
        let u: Vec<Vec3> = bar.points.iter().map(|_| random.vector().map(|x| 1.5e-3 * x)).collect();
        let error = force_error(&bar, &law, &u, 1e-8);
        println!("f_int against dE/du, bar of 96, noise of 15 % of the edge: {law:?}: {error:.1e}");
        assert!(error < 1e-7, "{error:e}");
    }
}

#[test]
fn tangent_product_is_the_derivative_of_the_force() {
    let mesh = Mesh::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let mut random = Random(5);
    for law in LAWS {
        let u: Vec<Vec3> = mesh.points.iter().map(|_| random.vector().map(|x| 1e-3 * x)).collect();
        let v: Vec<Vec3> = mesh.points.iter().map(|_| random.vector()).collect();
        let shifted =
            |h: f64| -> Vec<Vec3> { u.iter().zip(&v).map(|(u, v)| std::array::from_fn(|i| u[i] + h * v[i])).collect() };
        let h = 1e-8;
        let (plus, minus) = (internal_force(&mesh, &law, &shifted(h)), internal_force(&mesh, &law, &shifted(-h)));
        let exact = tangent_product(&mesh, &law, &u, &v);
        let largest = exact.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        let error = (exact.iter().flatten().zip(plus.iter().flatten().zip(minus.iter().flatten())))
            .map(|(k, (p, m))| (k - (p - m) / (2.0 * h)).abs() / largest)
            .fold(0.0, f64::max);
        println!("K v against the difference of forces: {law:?}: {error:.1e}");
        assert!(error < 1e-7, "{error:e}");
    }
}

#[test]
fn rigid_rotation_gives_no_force() {
    let mesh = Mesh::paper_bar();
    for law in &LAWS {
        let largest = |f: &Mat3| {
            let force = internal_force(&mesh, law, &mesh.affine(f));
            force.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()))
        };
        let rotated = largest(&rotation([1.0, -2.0, 0.5], 2.0));
        let stretched = largest(&closed_form::uniaxial_stretch(1.01));
        println!("rigid rotation by 2 rad: {rotated:.1e} N, stretch by 1 %: {stretched:.1e} N, {law:?}");
        assert!(rotated < 1e-10 * stretched);
    }
}

#[test]
fn bar_has_the_counts_volume_and_mass_of_the_paper() {
    let mesh = Mesh::paper_bar();
    let volumes = mesh.volumes();
    let smallest = volumes.iter().copied().fold(f64::INFINITY, f64::min);
    let volume: f64 = volumes.iter().sum();
    let mass: f64 = mesh.lumped_mass(DENSITY).iter().sum();
    println!(
        "bar: {} nodes, {} tetrahedra, volume {volume:.6e} m^3 (smallest {smallest:.3e}), mass {mass:.6} kg",
        mesh.points.len(),
        mesh.tets.len()
    );
    assert_eq!((mesh.points.len(), mesh.tets.len()), (1458, 6528));
    assert!((volume / 2.5e-4 - 1.0).abs() < 1e-12 && smallest > 0.0);
    assert!((mass / 0.25 - 1.0).abs() < 1e-12);
    assert_eq!(mesh.points[1457], [0.05, 0.05, 0.1]);
    assert_eq!(mesh.points[1 + 9 * (2 + 9 * 3)], [0.05 / 8.0, 0.05 * 2.0 / 8.0, 0.1 * 3.0 / 17.0]);

    // Every face inside belongs to two elements, the others to the surface: 2 triangles per cell side.
    let mut faces = std::collections::HashMap::new();
    for tet in &mesh.tets {
        for skipped in 0..4 {
            let mut face: Vec<usize> = (0..4).filter(|a| *a != skipped).map(|a| tet[a]).collect();
            face.sort_unstable();
            *faces.entry(face).or_insert(0) += 1;
        }
    }
    assert!(faces.values().all(|count| *count <= 2));
    assert_eq!(faces.values().filter(|count| **count == 1).count(), 2 * (2 * 8 * 8 + 4 * 8 * 17));
}

/// A small bar held at z = 0 with a twisting force at the other end.
fn small_bar(law: Law, dt: f64, ramp: f64) -> Simulation {
    let mesh = Mesh::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let held = mesh.nodes_where(|x| x[2] == 0.0);
    let end = mesh.nodes_where(|x| x[2] == 0.04);
    let mut simulation = Simulation::new(mesh, law, DENSITY, dt);
    simulation.fix(&held);
    for node in end {
        let [x, y, _] = simulation.mesh.points[node];
        let newton = [-(y - 0.01), x - 0.01, 0.002].map(|lever| 0.5 * lever);
        simulation.forces.push(NodalForce { node, newton, ramp });
    }
    simulation
}

fn distance(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn time_integration_is_second_order() {
    let end = 0.064;
    let order = |law: Law, ramp: f64| {
        let solve = |steps: u64| {
            let mut simulation = small_bar(law, end / steps as f64, ramp);
            simulation.mu = 20.0;
            simulation.run(steps);
            simulation.u
        };
        let [coarse, middle, fine] = [640, 1280, 2560].map(solve);
        let largest = fine.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
        ((distance(&coarse, &middle) / distance(&middle, &fine)).log2(), largest)
    };
    for law in LAWS {
        let (ramped, largest) = order(law, end);
        let (stepped, _) = order(law, 0.0);
        println!(
            "order in time: {ramped:.3} with a ramp, {stepped:.3} with a step; \
             largest displacement {:.2} mm of 40, {law:?}",
            1e3 * largest
        );
        assert!((ramped - 2.0).abs() < 0.1, "{ramped}");
        // u_0 = u_-1 = 0 costs an order where the load is on at t = 0.
        assert!((stepped - 1.0).abs() < 0.2, "{stepped}");
    }
}

#[test]
fn energy_is_conserved() {
    // Largest |kinetic + strain + dissipated - external work| over a run, relative to the largest strain
    // energy.
    let imbalance = |law: Law, mu: f64, dt: f64| {
        let mut simulation = small_bar(law, dt, 0.0);
        simulation.mu = mu;
        let start = simulation.energy().strain;
        let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
        for _ in 0..(0.2 / dt) as u64 {
            simulation.step();
            let e = simulation.energy();
            worst = worst.max((e.kinetic + e.strain - start + e.dissipated - e.external_work).abs());
            largest = largest.max(e.strain - start);
        }
        worst / largest
    };
    for law in LAWS {
        for mu in [0.0, 20.0] {
            let (coarse, fine) = (imbalance(law, mu, 1e-4), imbalance(law, mu, 5e-5));
            println!("energy imbalance in 0.2 s, mu = {mu}: {coarse:.1e} at 1e-4 s, {fine:.1e} at 5e-5 s, {law:?}");
            assert!(fine < 1e-2 && fine < 0.35 * coarse, "{fine:e}");
        }
    }
}

#[test]
fn energy_balances_under_prescribed_motion() {
    let mut simulation = small_bar(Law::PAPER, 5e-5, 0.0);
    simulation.forces.clear();
    simulation.mu = 20.0;
    simulation.gravity = [0.0, 0.0, -9.81];
    simulation.gravity_ramp = 0.02;
    let metre = [2e-3, -1e-3, 5e-3];
    for node in simulation.mesh.nodes_where(|x| x[2] == 0.04) {
        simulation.motions.push(Motion { node, axes: [true, false, true], metre, ramp: 0.05 });
    }
    let moved = simulation.motions[0].node;
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for n in 1..=2000 {
        simulation.step();
        let share = (n as f64 * 5e-5 / 0.05).min(1.0);
        assert!([0, 2].into_iter().all(|i: usize| (simulation.u[moved][i] - share * metre[i]).abs() < 1e-17));
        let e = simulation.energy();
        worst = worst.max((e.kinetic + e.strain + e.dissipated - e.external_work).abs());
        largest = largest.max(e.strain);
    }
    println!("energy imbalance under prescribed motion and gravity: {:.1e}", worst / largest);
    assert!(worst < 1e-2 * largest);
}

#[test]
fn increment_form_is_the_central_difference() {
    // (M/dt^2 + mu M/(2 dt)) u+ = f + 2 M/dt^2 u - (M/dt^2 - mu M/(2 dt)) u-
    let mut simulation = small_bar(Law::PAPER, 1e-4, 0.01);
    simulation.mu = 50.0;
    let (dt, mu) = (simulation.dt, simulation.mu);
    let mut worst = 0.0_f64;
    for _ in 0..500 {
        let before = simulation.clone();
        let (internal, external) = (before.internal_force(), before.external_force(before.time()));
        simulation.step();
        for node in 0..before.u.len() {
            for axis in (0..3).filter(|axis| !before.fixed[node][*axis]) {
                let (u, m) = (before.u[node][axis], before.mass[node] / (dt * dt));
                let f = external[node][axis] - internal[node][axis];
                let k = mu * dt / 2.0;
                let old = u - before.du[node][axis];
                let expected = (f + 2.0 * m * u - m * (1.0 - k) * old) / (m * (1.0 + k));
                worst = worst.max((simulation.u[node][axis] - expected).abs());
            }
        }
    }
    println!("increment form against the central difference: {worst:.1e} m per step");
    assert!(worst < 1e-16, "{worst:e}");
}

#[test]
fn free_fall_ends_at_the_terminal_velocity() {
    let mut simulation = Simulation::new(Mesh::bar([0.02; 3], [2; 3]), Law::PAPER, DENSITY, 1e-4);
    simulation.gravity = [0.0, 0.0, -9.81];
    simulation.mu = 100.0;
    simulation.run(5000);
    let terminal = -9.81 / 100.0;
    let worst = (simulation.du.iter()).fold(0.0_f64, |m, du| m.max((du[2] / 1e-4 / terminal - 1.0).abs()));
    println!("terminal velocity g / mu: relative error {worst:.1e}");
    assert!(worst < 1e-9, "{worst:e}");
}

/// Growth of a tiny random disturbance of `u` within `count` steps.
fn growth(mesh: &Mesh, u: &[Vec3], fixed: &[[bool; 3]], dt: f64, count: u64) -> f64 {
    let mut simulation = Simulation::new(mesh.clone(), Law::PAPER, DENSITY, dt);
    let mut random = Random(11);
    simulation.fixed = fixed.to_vec();
    simulation.u = u.to_vec();
    for (x, held) in simulation.u.iter_mut().flatten().zip(fixed.iter().flatten()) {
        *x += if *held { 0.0 } else { 1e-10 * random.next() };
    }
    let start = distance(&simulation.u, u);
    let mut largest = 1.0_f64;
    for _ in 0..count {
        simulation.step();
        largest = largest.max(distance(&simulation.u, u) / start);
        if largest > 1e4 {
            break;
        }
    }
    largest
}

#[test]
fn critical_step_is_the_limit_of_stability() {
    // At rest with one end held.
    let bar = Mesh::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let end_held: Vec<[bool; 3]> = bar.points.iter().map(|x| [x[2] == 0.0; 3]).collect();
    // Stretched by half with its whole surface held: in equilibrium, and stiffer.
    let cube = Mesh::bar([0.02; 3], [4; 3]);
    let inside = |x: f64| x > 1e-9 && x < 0.02 - 1e-9;
    let surface_held: Vec<[bool; 3]> = cube.points.iter().map(|x| [!x.iter().all(|x| inside(*x)); 3]).collect();
    let stretched = cube.affine(&closed_form::uniaxial_stretch(1.5));
    let rest = vec![[0.0; 3]; bar.points.len()];

    let cases = [("at rest", &bar, rest, end_held), ("stretched by half", &cube, stretched, surface_held)];
    for (name, mesh, u, fixed) in cases {
        let limit = critical_step(mesh, &Law::PAPER, DENSITY, &u, &fixed);
        let below = growth(mesh, &u, &fixed, 0.98 * limit, 5000);
        let above = growth(mesh, &u, &fixed, 1.02 * limit, 5000);
        println!("{name}: limit {limit:.4e} s; growth {below:.1} at 0.98, {above:.1e} at 1.02");
        assert!(below < 20.0 && above > 1e4);
    }
}

#[test]
fn critical_step_of_one_element_matches_its_dilation_mode() {
    // A regular tetrahedron breathes: u = e X, f = V dP grad N, with dP = 6 d e I for the isochoric law at
    // rest and grad N_a parallel to X_a, |grad N| = 1 / (4/3 r) for corners at distance r. So m omega^2 r = V
    // 6 d 3 / (4 r) and m = rho V / 4 give omega^2 = 18 d / (rho r^2); d outweighs the shear modes.
    let r = 0.01;
    let a = r / 3.0_f64.sqrt();
    let mesh = Mesh { points: vec![[a, a, a], [a, -a, -a], [-a, a, -a], [-a, -a, a]], tets: vec![[0, 2, 1, 3]] };
    assert!(mesh.volumes()[0] > 0.0);
    let exact = 2.0 / (18.0 * 60_000.0 / (DENSITY * r * r)).sqrt();
    let computed = critical_step(&mesh, &Law::PAPER, DENSITY, &[[0.0; 3]; 4], &[[false; 3]; 4]);
    println!("critical step of a regular tetrahedron: {computed:.6e} s, by hand {exact:.6e} s");
    assert!((computed / exact - 1.0).abs() < 1e-6);
}

#[test]
fn critical_step_of_the_paper_bar() {
    let mesh = Mesh::paper_bar();
    let fixed: Vec<[bool; 3]> = mesh.points.iter().map(|x| [x[2] == 0.0; 3]).collect();
    let rest = vec![[0.0; 3]; mesh.points.len()];
    let started = Instant::now();
    let limit = critical_step(&mesh, &Law::PAPER, DENSITY, &rest, &fixed);
    let elapsed = started.elapsed();
    println!("paper's bar at rest: 2/omega_max = {limit:.6e} s, computed in {elapsed:.2?}");
    assert!((limit / 3.478_931e-4 - 1.0).abs() < 2e-6, "{limit:e}");

    let below = growth(&mesh, &rest, &fixed, 0.98 * limit, 500);
    let above = growth(&mesh, &rest, &fixed, 1.02 * limit, 500);
    println!("growth {below:.1} at 0.98, {above:.1e} at 1.02");
    assert!(below < 20.0 && above > 1e4);

    // The usual estimate, smallest height over the speed of pressure waves, is on the unsafe side.
    let steepest = (mesh.elements().iter().flat_map(|e| e.gradients))
        .fold(0.0_f64, |m, g| m.max(reference::tensor::dot(g, g).sqrt()));
    let pressure_modulus = Law::PAPER.tangent(&IDENTITY)[0][0];
    let estimate = 1.0 / steepest / (pressure_modulus / DENSITY).sqrt();
    println!("height over wave speed: {estimate:.4e} s, {:.3} of the limit", estimate / limit);
    assert!(estimate > limit);
}

/// Largest eigenvalue of `M^-1 K` by power iteration, as a second opinion on Lanczos.
#[test]
fn power_iteration_agrees_with_lanczos() {
    let mesh = Mesh::bar([0.02, 0.02, 0.04], [2, 2, 4]);
    let fixed: Vec<[bool; 3]> = mesh.points.iter().map(|x| [x[2] == 0.0; 3]).collect();
    let mass = mesh.lumped_mass(DENSITY);
    let u = mesh.affine(&closed_form::uniaxial_stretch(1.2));
    let mut random = Random(2);
    let mut v: Vec<Vec3> = fixed.iter().map(|_| random.vector()).collect();
    let mut lambda = 0.0;
    for _ in 0..5000 {
        for (x, held) in v.iter_mut().flatten().zip(fixed.iter().flatten()) {
            *x *= f64::from(!held);
        }
        lambda = distance(&v, &vec![[0.0; 3]; v.len()]);
        v.iter_mut().flatten().for_each(|x| *x /= lambda);
        let force = tangent_product(&mesh, &Law::PAPER, &u, &v);
        v = force.iter().zip(&mass).map(|(f, m)| f.map(|f| f / m)).collect();
    }
    let (power, lanczos) = (2.0 / lambda.sqrt(), critical_step(&mesh, &Law::PAPER, DENSITY, &u, &fixed));
    println!("critical step by power iteration {power:.8e} s, by Lanczos {lanczos:.8e} s");
    assert!((power / lanczos - 1.0).abs() < 1e-6);
}
