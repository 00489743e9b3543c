//! How far a step can reach that sees only what is near a vertex (docs/reach.md), on a small bar of uneven tetrahedra.
//!
//! A step `u(t + D) = 2 u(t) - u(t - D) - D^2 Q(A) u(t)` with `A = M^-1/2 K M^-1/2` sees `m` rings beyond the force if
//! `Q` is a polynomial of degree `n = m + 1`; `Q(A) = A` is the exact step. It leaves the rest shape alone if `Q(0) =
//! 0`, and is stable if `T = 1 - D^2 Q / 2` stays between -1 and 1 on the spectrum. A mode of `A` with the eigenvalue
//! `l` then moves as if its inertia were `l / Q(l)` times the true one.

use supple::loads::Loads;
use supple::material::{AnyLaw, Exponential};
use supple::mesh::Bar;
use supple::step::Step;
use supple::tled;

use crate::reference::dense::eigenvalues;
use crate::reference::tangent_product;
use crate::support::bodies::held;
use crate::support::{Body, DENSITY, EXP, NEO, displaced, reference_law, rest_of, run, tissue};

fn body() -> Body {
    Body::irregular([0.02, 0.02, 0.04], [2, 2, 5])
}

/// The eigenvalues of `A` at rest in ascending order, 1/s^2: stiffness in float64 over the lumped mass of the free
/// nodes.
fn spectrum(body: &Body, law: AnyLaw) -> Vec<f64> {
    let mesh = body.reference();
    let mass = mesh.lumped_mass(f64::from(DENSITY));
    let held: Vec<_> = held(body).iter().map(|support| support.node as usize).collect();
    let free: Vec<usize> = (0..mesh.points.len()).filter(|node| !held.contains(node)).collect();
    let rest = vec![[0.0; 3]; mesh.points.len()];
    let column = |node: usize, axis: usize| {
        let mut unit = rest.clone();
        unit[node][axis] = 1.0 / mass[node].sqrt();
        let force = tangent_product(&mesh, &reference_law(law), &rest, &unit);
        free.iter().flat_map(|&row| force[row].map(|newton| newton / mass[row].sqrt())).collect::<Vec<_>>()
    };
    let columns = free.iter().flat_map(|&node| [0, 1, 2].map(|axis| column(node, axis)));
    eigenvalues(&columns.collect())
}

/// The Chebyshev polynomial of degree `n`, between -1 and 1.
fn chebyshev(n: usize, x: f64) -> f64 {
    (n as f64 * x.clamp(-1.0, 1.0).acos()).cos()
}

/// The most by which any stable step of degree `n` can have `1 - T` at the lowest eigenvalue: `T` is the polynomial
/// through its values at 0, where it is 1, and at `n` eigenvalues, where it is at least -1 and at most 1 (Lagrange).
/// The eigenvalues are those nearest to where the Chebyshev polynomial is -1 or 1.
fn most_of_any(n: usize, spectrum: &[f64]) -> f64 {
    let (lowest, highest) = (spectrum[0], spectrum[spectrum.len() - 1]);
    let nearest = |wanted: f64| {
        spectrum.iter().copied().min_by(|a, b| (a - wanted).abs().total_cmp(&(b - wanted).abs())).unwrap()
    };
    let extreme = |k: usize| 0.5 * highest * (1.0 - (std::f64::consts::PI * k as f64 / n as f64).cos());
    let points: Vec<f64> = std::iter::once(0.0).chain((1..=n).map(|k| nearest(extreme(k)))).collect();
    let weight = |k: usize| {
        let others = points.iter().enumerate().filter(|(other, _)| *other != k);
        others.map(|(_, point)| (lowest - point) / (points[k] - point)).product::<f64>()
    };
    1.0 - weight(0) + (1..=n).map(|k| weight(k).abs()).sum::<f64>()
}

/// The least inertia of the lowest mode over the true one, for steps that see 0 to 3 rings beyond the force: the
/// Chebyshev filter has `(kappa / (m + 1))^2`, and no filter on this mesh has less.
#[test]
fn beyond_m_rings_and_one_inertia_grows_with_the_square_of_the_step() {
    for (name, law) in [("neo-Hookean", NEO), ("the paper's law", EXP)] {
        let body = body();
        let spectrum = spectrum(&body, law);
        let (lowest, highest) = (spectrum[0], spectrum[spectrum.len() - 1]);
        let critical = 2.0 / highest.sqrt();
        let scene = body.scene(tissue(law), &held(&body));
        let exact = tled::exact_critical_step(scene.view(), rest_of(&scene).displacements()).unwrap();
        println!(
            "{name}: {} modes, critical step {:.3} us (kernel {:.3} us), lowest frequency over highest {:.4}",
            spectrum.len(),
            1e6 * critical,
            1e6 * exact,
            (lowest / highest).sqrt()
        );
        assert!((critical / exact - 1.0).abs() < 1e-4);
        for m in 0..4 {
            let n = m + 1;
            // Stable at every kappa: the step's length appears only in the inertia.
            let filter = |eigenvalue: f64| 1.0 - chebyshev(n, 1.0 - 2.0 * eigenvalue / highest);
            assert!(spectrum.iter().all(|&eigenvalue| (-1e-9..=2.0 + 1e-9).contains(&filter(eigenvalue))));
            // (D w / 2)^2 = kappa^2 lowest / highest, and the step's own is half of 1 - T.
            let inertia = |kappa: f64, most: f64| kappa.powi(2) * (lowest / highest) / (0.5 * most);
            let [attained, least] = [filter(lowest), most_of_any(n, &spectrum)].map(|most| inertia(1.0, most));
            let true_up_to = [attained, least].map(|inertia| inertia.sqrt().recip());
            let at = [5.0, 10.0, 20.0].map(|kappa| format!("{:.2}", (attained * kappa * kappa).max(1.0)));
            println!(
                "  {m} rings: true inertia up to kappa {:.3} (no filter beyond {:.3}), {} times it at 5, 10, 20",
                true_up_to[0],
                true_up_to[1],
                at.join(", ")
            );
            assert!((true_up_to[0] / n as f64 - 1.0).abs() < 0.01, "not (kappa / (m + 1))^2");
            assert!(true_up_to[0] <= true_up_to[1] * (1.0 + 1e-9) && true_up_to[1] < 1.02 * n as f64);
        }
    }
}

/// A symmetric step that weighs neighbours otherwise than by the forces between them is bound by the same count for
/// plane waves of compression along an axis of a regular mesh, whose critical step is `h / sqrt(E / rho)` with the
/// modulus `E` of uniaxial strain and cells of `h`. So on the paper's bar it may reach further, but not by much.
#[test]
fn plane_waves_in_the_papers_bar_have_a_longer_critical_step_than_the_bar() {
    let AnyLaw::Exponential(Exponential { a, d, .. }) = EXP else { panic!("another law") };
    let scene = Body::paper().scene(tissue(EXP), &[]);
    let critical = tled::exact_critical_step(scene.view(), rest_of(&scene).displacements()).unwrap();
    let modulus = 2.0 * f64::from(d) + 4.0 / 3.0 * f64::from(a);
    let of_waves = |axis: usize| {
        let cell = f64::from(Bar::PAPER.size[axis]) / f64::from(Bar::PAPER.cells[axis]);
        cell / (modulus / f64::from(DENSITY)).sqrt()
    };
    let [across, along] = [0, 2].map(|axis| of_waves(axis) / critical);
    println!(
        "critical step {:.1} us; that of plane waves {across:.2} times as long across the bar, {along:.2} along it",
        1e6 * critical
    );
    assert!([across, along].iter().all(|ratio| (1.0..1.7).contains(ratio)));
}

/// `m + 1` exact steps are such a filter: they see `m` rings beyond the force, node for node, and at the critical step
/// they reach `kappa = m + 1`. So no step that sees as far takes longer steps than the exact one does in parts.
#[test]
fn an_exact_step_sees_one_ring_further_each_time() {
    let body = body();
    let scene = body.scene(tissue(NEO), &held(&body));
    let moved = body.farthest(2) as usize;
    let mut rings = vec![usize::MAX; body.points.len()];
    rings[moved] = 0;
    for ring in 0..body.points.len() {
        for tet in &body.tets {
            if tet.iter().any(|&node| rings[node as usize] == ring) {
                tet.iter().for_each(|&node| rings[node as usize] = rings[node as usize].min(ring + 1));
            }
        }
    }
    let mut start = vec![[0.0; 3]; body.points.len()];
    start[moved] = [1e-6, -1e-6, 1e-6];
    let mut state = displaced(&scene, &start);
    let step = Step::unchecked(1e-4, 0.0).unwrap();
    for steps in 1..=4 {
        run(&scene, &Loads::NONE, &mut state, &step, 1);
        let reached = state.displacements().iter().zip(&rings).filter(|(u, _)| u.to_array() != [0.0; 3]);
        let farthest = reached.map(|(_, &ring)| ring).max().unwrap();
        println!("after {steps} exact steps a node's displacement has moved nodes up to {farthest} rings away");
        assert_eq!(farthest, steps);
    }
}
