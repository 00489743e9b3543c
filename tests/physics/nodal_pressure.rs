//! Tetrahedra with average nodal pressure against their definition in float64: forces, energy, tissues that meet, patch test, rigid
//! motion.

use supple::element::ElementMaterial;
use supple::loads::Loads;
use supple::material::{Exponential, NeoHookean, NodalPressure, Regions, Tissue};
use supple::scene::VecScene;
use supple::state::VecState;
use supple::step::{Status, Step, Threads};
use supple::tled;

use crate::reference::nodal_pressure::Tissues;
use crate::reference::tensor::{product, rotation};
use crate::reference::{Mat3, Random};
use crate::support::bodies::{held, small_bar};
use crate::support::{
    Body, Judged, bits, displaced, fixed, forces, largest_distance, norm, norm_of_sum, rest_of, tissue,
    widened,
};
use crate::{each_law, reference, support};

/// Random displacements of at most `size` m.
pub(crate) fn noise(body: &Body, size: f64, seed: u64) -> Vec<[f32; 3]> {
    let mut random = Random(seed);
    body.points.iter().map(|_| random.vector().map(|x| (size * x) as f32)).collect()
}

/// Elements that turn inside out in a state.
pub(crate) fn inverted(body: &Body, u: &[[f32; 3]]) -> usize {
    let gradients = body.reference().deformation_gradients(&widened(u));
    gradients.iter().filter(|f| reference::tensor::determinant(f) <= 0.0).count()
}

#[test]
fn the_force_of_the_definition_is_minus_the_gradient_of_its_energy() {
    let body = Body::bar([0.02, 0.03, 0.04], [1, 2, 2]);
    let mesh = body.reference();
    let laws = [support::EXP.reference(), support::NEO.reference()];
    let of_element: Vec<usize> = (0..mesh.tets.len()).map(|element| element / 5 % 2).collect();
    let tissues = Tissues { mesh: &mesh, laws: &laws, of_element: &of_element };
    let u = widened(&noise(&body, 1e-3, 5));
    let exact = tissues.forces(&u);
    let mut worst = 0.0_f64;
    for node in 0..u.len() {
        for axis in 0..3 {
            let energy = |h: f64| {
                let mut u = u.clone();
                u[node][axis] += h;
                tissues.energy(&u)
            };
            let numeric = (energy(-1e-7) - energy(1e-7)) / 2e-7;
            worst = worst.max((numeric - exact[node][axis]).abs());
        }
    }
    println!("difference to the gradient {:.1e}", worst / norm(&exact));
    assert!(worst < 1e-6 * norm(&exact));
}

#[test]
fn forces_and_energy_are_those_of_the_definition() {
    let body = small_bar();
    let mesh = body.reference();
    each_law!(law => {
        for size in [1e-6, 4e-4, 6e-3] {
            let u = noise(&body, size, 7);
            let tissues = Tissues { mesh: &mesh, laws: &[law.reference()], of_element: &vec![0; mesh.tets.len()] };
            let exact = tissues.forces(&widened(&u));
            let scene = body.scene(NodalPressure(tissue(law)), &[]);
            let error = norm_of_sum(&forces(&scene, &u), &exact.iter().map(|f| f.map(|x| -x)).collect::<Vec<_>>()) / norm(&exact);
            let energy = tled::strain_energy(&scene, &mut displaced(&scene, &u)).expect("room");
            let of_energy = energy / tissues.energy(&widened(&u)) - 1.0;
            println!("{}, {size} m, {} inverted: forces {error:.1e}, energy {of_energy:.1e}", law.name(), inverted(&body, &u));
            assert!(error < 1e-5 && of_energy.abs() < 1e-6);
            assert!(size < 5e-3 || inverted(&body, &u) > 10);
            // Another element: the linear one gives other forces.
            assert!(norm_of_sum(&forces(&body.scene(tissue(law), &[]), &u), &exact) > 0.01 * norm(&exact));
        }
    });
}

/// Two tissues that meet at a plane, and a third along an edge: the pressure of one is not smeared into the others.
#[test]
fn tissues_that_meet_have_pressures_of_their_own() {
    let body = small_bar();
    let mesh = body.reference();
    let soft = NeoHookean { c: 300.0, d: 3_000.0 };
    let firm = NeoHookean { c: 800.0, d: 80_000.0 };
    let laws = [soft.reference(), firm.reference()];
    let (low, high) = body.extent(2);
    let middle = |element: usize| {
        body.tets[element].iter().map(|&node| body.points[node as usize][2]).sum::<f32>() / 4.0
    };
    let of_element: Vec<u16> =
        (0..body.tets.len()).map(|element| u16::from(middle(element) > 0.5 * (low + high))).collect();
    let u = noise(&body, 4e-4, 3);
    let wide: Vec<usize> = of_element.iter().map(|&tissue| tissue.into()).collect();
    let tissues = Tissues { mesh: &mesh, laws: &laws, of_element: &wide };
    let exact: Vec<_> = tissues.forces(&widened(&u)).iter().map(|f| f.map(|x| -x)).collect();
    let two = [soft, firm].map(tissue);
    let scene = body.scene(NodalPressure(Regions { tissues: &two, of_element: &of_element }), &[]);
    let error = norm_of_sum(&forces(&scene, &u), &exact) / norm(&exact);
    println!("two tissues: forces {error:.1e}");
    assert!(error < 1e-5);

    // A squeeze of the soft half leaves the inner nodes of the firm half without force.
    let touching = |wanted: u16| {
        let mut nodes = vec![false; body.points.len()];
        for (tet, _) in body.tets.iter().zip(&of_element).filter(|(_, tissue)| **tissue == wanted) {
            tet.iter().for_each(|&node| nodes[node as usize] = true);
        }
        nodes
    };
    let (in_soft, in_firm) = (touching(0), touching(1));
    let squeezed: Vec<_> = (body.points.iter().zip(&in_firm))
        .map(|(&[_, _, z], firm)| [0.0, 0.0, if *firm { 0.0 } else { -0.05 * (0.5 * (low + high) - z) }])
        .collect();
    let force = forces(&scene, &squeezed);
    let only = |soft: bool| {
        norm(&force.iter().zip(&in_soft).filter(|(_, s)| **s == soft).map(|(f, _)| *f).collect::<Vec<_>>())
    };
    println!("force in the firm tissue over that in the soft one: {:.1e}", only(false) / only(true));
    assert!(only(true) > 0.0 && only(false) == 0.0);

    // A third tissue where two meet already keeps the volumes of its own elements there.
    let thirds: Vec<u16> = of_element
        .iter()
        .enumerate()
        .map(|(e, &tissue)| if e.is_multiple_of(7) { 2 } else { tissue })
        .collect();
    let three = [soft, firm, soft].map(tissue);
    let scene = body.scene(NodalPressure(Regions { tissues: &three, of_element: &thirds }), &[]);
    let step = 1e-3_f32;
    let at = |sign: f32| {
        let u: Vec<_> =
            u.iter().zip(&squeezed).map(|(u, v)| [0, 1, 2].map(|i| u[i] + sign * step * v[i])).collect();
        tled::strain_energy(&scene, &mut displaced(&scene, &u)).expect("room")
    };
    let numeric = (at(-1.0) - at(1.0)) / (2.0 * f64::from(step));
    let work: f64 = forces(&scene, &u)
        .iter()
        .zip(&squeezed)
        .flat_map(|(f, v)| [0, 1, 2].map(|i| f[i] * f64::from(v[i])))
        .sum();
    println!("three tissues: work {work:.6e}, change of energy {numeric:.6e} J");
    assert!((work / numeric - 1.0).abs() < 1e-3);
}

/// Elements between fixed nodes are left out only where they count in no volume that can change.
#[test]
fn left_out_elements_change_no_force() {
    let body = small_bar();
    let mesh = body.reference();
    let (low, high) = body.extent(2);
    let held = body.nodes_where(|[_, _, z]| z < low + 0.6 * (high - low));
    let mut u = noise(&body, 4e-4, 9);
    held.iter().for_each(|&node| u[node as usize] = [0.0; 3]);
    let law = support::NEO;
    let tissues = Tissues { mesh: &mesh, laws: &[law.reference()], of_element: &vec![0; mesh.tets.len()] };
    let exact: Vec<_> = tissues.forces(&widened(&u)).iter().map(|f| f.map(|x| -x)).collect();
    let scene = body.scene(NodalPressure(tissue(law)), &fixed(&held));
    let linear = body.scene(tissue(law), &fixed(&held));
    let error = norm_of_sum(&forces(&scene, &u), &exact) / norm(&exact);
    println!(
        "{} of {} elements, linear {}: forces {error:.1e}",
        scene.element_count(),
        mesh.tets.len(),
        linear.element_count()
    );
    assert!(scene.element_count() < mesh.tets.len() && scene.element_count() > linear.element_count());
    assert!(error < 1e-5);
}

#[test]
fn a_homogeneous_deformation_leaves_inner_nodes_without_force() {
    let body = Body::irregular([0.05, 0.05, 0.1], [4, 4, 8]);
    let on_surface = body.surface_nodes();
    let general: Mat3 = [[1.1, 0.15, -0.1], [-0.05, 0.9, 0.2], [0.1, -0.15, 1.1]];
    let turned = product(&rotation([1.0, 2.0, -1.0], 1.0), &general);
    each_law!(law => {
        let scene = body.scene(NodalPressure(tissue(law)), &[]);
        let rigid = body.affine(&rotation([0.3, -1.0, 0.8], 1.5), [0.02, -0.01, 0.03]);
        let scale = norm(&forces(&scene, &body.affine(&general, [0.0; 3])));
        for f in [general, turned] {
            let u = body.affine(&f, [0.0; 3]);
            let with = forces(&scene, &u);
            let of = |surface: bool| norm(&with.iter().zip(&on_surface).filter(|(_, s)| **s == surface).map(|(f, _)| *f).collect::<Vec<_>>());
            println!("{}: inner over surface force {:.1e}", law.name(), of(false) / of(true));
            assert!(of(false) < 1e-5 * of(true));
            // All volumes change alike: the linear element gives the same.
            let linear = forces(&body.scene(tissue(law), &[]), &u);
            assert!(largest_distance(&with, &linear) < 1e-4 * norm(&with));
        }
        if law.reference().is_isochoric() {
            let ratio = norm(&forces(&scene, &rigid)) / scale;
            println!("{}: rigid motion {ratio:.1e}", law.name());
            assert!(ratio < 1e-5);
        }
    });
}

/// The exact critical step is that of the tangent, which is the derivative of the forces; the bound is never above it. In a body at rest
/// that hardly changes its volume it is 1.29 times the linear element's (`4 x 4 x 13` cells, nu 0.499; eigenvalues of the assembled
/// matrices with SciPy: 1.285).
#[test]
fn the_bound_of_the_critical_step_is_below_the_exact_one() {
    let (young, nu) = (263_824.0, 0.499);
    let law =
        NeoHookean { c: (young / (4.0 * (1.0 + nu))) as f32, d: (young / (6.0 * (1.0 - 2.0 * nu))) as f32 };
    let exact = |scene: &VecScene<NodalPressure<Tissue<NeoHookean>>>, state: &VecState| {
        tled::exact_critical_step(scene.view(), state.displacements()).expect("it settles")
    };
    let beam = Body::bar([0.03, 0.03, 0.1], [4, 4, 13]);
    let (nodal, linear) = (beam.scene(NodalPressure(tissue(law)), &[]), beam.scene(tissue(law), &[]));
    let at_rest = rest_of(&linear);
    let ratio = exact(&nodal, &rest_of(&nodal))
        / tled::exact_critical_step(linear.view(), at_rest.displacements()).expect("it settles");
    println!("beam: exact critical step {ratio:.3} of the linear element's");
    assert!((ratio - 1.285).abs() < 2e-3);
    for (name, body) in [("beam", &beam), ("lobe", &Body::lobe())] {
        let (nodal, linear) = (body.scene(NodalPressure(tissue(law)), &[]), body.scene(tissue(law), &[]));
        let ratio = support::bound(&nodal, &rest_of(&nodal)).seconds
            / support::bound(&linear, &rest_of(&linear)).seconds;
        println!("{name}: bound of the critical step {ratio:.3} of the linear element's");
        assert!(ratio > 1.2);
    }

    let bodies = [
        ("beam", beam),
        ("irregular bar", Body::irregular([0.05, 0.05, 0.1], [4, 4, 8])),
        ("slivers", Body::slivers([0.04, 0.04, 0.04])),
        ("lobe", Body::lobe()),
        ("cylinder", Body::cylinder()),
    ];
    for (name, body) in bodies {
        let size = f64::from(body.extent(0).1 - body.extent(0).0);
        for law in [law, NeoHookean { c: 500.0, d: 1_000.0 }] {
            let scene = body.scene(NodalPressure(tissue(law)), &[]);
            for share in [0.0, 0.005, 0.05] {
                let state = displaced(&scene, &noise(&body, share * size, 4));
                let (bound, exact) =
                    (f64::from(support::bound(&scene, &state).seconds), exact(&scene, &state));
                println!(
                    "{name}, d {}, noise {share}: bound {:.3} of exact {exact:.3e} s",
                    law.d,
                    bound / exact
                );
                // The noise turns slivers inside out: the bound adds up pressures that nearly cancel.
                let least = if name == "slivers" && share > 0.0 { 0.05 } else { 0.6 };
                assert!(bound <= exact && bound > least * exact);
            }
        }
    }
}

/// Without damping a body stays bounded at 0.98 of the exact critical step and does not at 1.02.
#[test]
fn the_exact_critical_step_is_where_stability_ends() {
    let body = small_bar();
    let scene = body.scene(NodalPressure(tissue(support::NEO)), &held(&body));
    let rest = rest_of(&scene);
    let exact = tled::exact_critical_step(scene.view(), rest.displacements()).expect("it settles");
    let after = |share: f64| {
        let step = Step::unchecked((share * exact) as f32, 0.0).unwrap();
        let mut state = rest_of(&scene);
        let kick =
            |node: usize| ([0.0; 3], if node.is_multiple_of(3) { [1e-5, -1e-5, 2e-5] } else { [0.0; 3] });
        assert!(tled::start(&scene, &mut state, &step, kick));
        (0..20_000).all(|_| tled::step(&scene, &Loads::NONE, &mut state, &step) == Status::Ok)
    };
    println!("exact critical step {exact:.3e} s");
    assert!(after(0.98) && !after(1.02));
}

/// 100,000 steps without damping keep the energy of a body that swings.
#[test]
fn the_energy_of_a_swinging_body_does_not_drift() {
    let body = small_bar();
    let scene = body.scene(NodalPressure(tissue(support::EXP)), &held(&body));
    let mut state = rest_of(&scene);
    let step = Step::unchecked(0.5 * support::bound(&scene, &state).seconds, 0.0).unwrap();
    let (low, _) = body.extent(2);
    let swing = |node: usize| ([0.0; 3], [0.3 * (body.points[node][2] - low), 0.0, 0.0]);
    assert!(tled::start(&scene, &mut state, &step, swing));
    let start = state.energy_balance().start;
    support::run(&scene, &Loads::NONE, &mut state, &step, 100_000);
    let end = state.energy_balance().kinetic + tled::strain_energy(&scene, &mut state).expect("room");
    println!("energy {start:.6e} J at the start, {end:.6e} J after {} steps", state.steps());
    assert!((end / start - 1.0).abs() < 1e-3);
}

/// Bits of a state after fifty steps under gravity, by so many threads.
pub(crate) fn ended<M: ElementMaterial>(scene: &VecScene<M>, parts: usize) -> Vec<u64> {
    struct Parts(usize);
    impl Threads for Parts {
        fn parts(&self) -> usize {
            self.0
        }
        fn each<T: Send>(&self, parts: &mut [T], work: impl Fn(&mut T) + Sync) {
            std::thread::scope(|scope| parts.iter_mut().for_each(|part| drop(scope.spawn(|| work(part)))));
        }
    }
    let mut state = rest_of(scene);
    let step = Step::unchecked(0.5 * support::bound(scene, &state).seconds, 5.0).unwrap();
    let loads = Loads::new(scene, [3.0, 0.0, -9.81], &[], &[]).unwrap();
    for _ in 0..50 {
        let status = tled::step_in_parts(scene.view(), &loads, state.view(), &step, &Parts(parts));
        assert_eq!(status, Status::Ok);
    }
    bits(&state)
}

/// Parts on several threads and every instruction set give the same steps, one tissue or two.
#[test]
fn any_number_of_parts_gives_the_same_bits() {
    let body = Body::bar([0.05, 0.05, 0.2], [8, 8, 20]);
    let of_element: Vec<u16> =
        (0..body.tets.len()).map(|element| u16::from(element.is_multiple_of(5))).collect();
    let tissues = [support::EXP, Exponential { a: 90.0, ..support::EXP }].map(tissue);
    let one = body.scene(NodalPressure(tissues[0]), &held(&body));
    let two = body.scene(NodalPressure(Regions { tissues: &tissues, of_element: &of_element }), &held(&body));
    let (of_one, of_two) = (ended(&one, 1), ended(&two, 1));
    assert!(of_one != of_two);
    for parts in [2, 3, 5] {
        assert!(ended(&one, parts) == of_one && ended(&two, parts) == of_two, "{parts} parts");
    }
}
