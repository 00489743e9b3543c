//! Tetrahedra with stabilised nodal strain against their definition in float64: forces, energy, tissues that meet, patch test, rigid
//! motion, critical step, drift, parts.

use supple::loads::Loads;
use supple::material::{Exponential, NeoHookean, NodalStrain, Regions};
use supple::step::{Status, Step};
use supple::tled;

use crate::nodal_pressure::{ended, inverted, noise};
use crate::reference::Mat3;
use crate::reference::nodal_pressure::Tissues;
use crate::reference::nodal_strain::{energy, forces as exact_forces, least_nodal_ratio};
use crate::reference::tensor::{product, rotation};
use crate::support::bodies::{held, small_bar};
use crate::support::{Body, Judged, displaced, fixed, forces, norm, norm_of_sum, rest_of, tissue, widened};
use crate::{each_law, support};

fn negative(forces: &[[f64; 3]]) -> Vec<[f64; 3]> {
    forces.iter().map(|f| f.map(|x| -x)).collect()
}

#[test]
fn the_force_of_the_definition_is_minus_the_gradient_of_its_energy() {
    let body = Body::bar([0.02, 0.03, 0.04], [1, 2, 2]);
    let mesh = body.reference();
    let laws = [support::EXP.reference(), support::NEO.reference()];
    let of_element: Vec<usize> = (0..mesh.tets.len()).map(|element| element / 5 % 2).collect();
    let tissues = Tissues { mesh: &mesh, laws: &laws, of_element: &of_element };
    let u = widened(&noise(&body, 1e-3, 5));
    let exact = exact_forces(&tissues, &u);
    let mut worst = 0.0_f64;
    for node in 0..u.len() {
        for axis in 0..3 {
            let at = |h: f64| {
                let mut u = u.clone();
                u[node][axis] += h;
                energy(&tissues, &u)
            };
            let numeric = (at(-1e-7) - at(1e-7)) / 2e-7;
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
            let exact = exact_forces(&tissues, &widened(&u));
            let scene = body.scene(NodalStrain(tissue(law)), &[]);
            let error = norm_of_sum(&forces(&scene, &u), &negative(&exact)) / norm(&exact);
            let of_kernel = tled::strain_energy(&scene, &mut displaced(&scene, &u)).expect("room");
            let of_energy = of_kernel / energy(&tissues, &widened(&u)) - 1.0;
            println!("{}, {size} m, {} inverted: forces {error:.1e}, energy {of_energy:.1e}", law.name(), inverted(&body, &u));
            assert!(error < 1e-5 && of_energy.abs() < 2e-6);
            assert!(size < 5e-3 || inverted(&body, &u) > 10);
            // Another element: the linear one gives other forces.
            assert!(norm_of_sum(&forces(&body.scene(tissue(law), &[]), &u), &exact) > 0.01 * norm(&exact));
        }
    });
}

/// Three tissues side by side: each has a mean strain of its own at every node.
#[test]
fn tissues_that_meet_have_strains_of_their_own() {
    let body = small_bar();
    let mesh = body.reference();
    let soft = NeoHookean { c: 300.0, d: 3_000.0 };
    let firm = NeoHookean { c: 800.0, d: 80_000.0 };
    let laws = [soft.reference(), firm.reference(), soft.reference()];
    let of_element: Vec<u16> = (0..body.tets.len()).map(|element| (element / 3 % 3) as u16).collect();
    let u = noise(&body, 4e-4, 3);
    let wide: Vec<usize> = of_element.iter().map(|&tissue| tissue.into()).collect();
    let tissues = Tissues { mesh: &mesh, laws: &laws, of_element: &wide };
    let exact = exact_forces(&tissues, &widened(&u));
    let three = [soft, firm, soft].map(tissue);
    let scene = body.scene(NodalStrain(Regions { tissues: &three, of_element: &of_element }), &[]);
    let error = norm_of_sum(&forces(&scene, &u), &negative(&exact)) / norm(&exact);
    println!("three tissues: forces {error:.1e}");
    assert!(error < 1e-5);
}

/// Elements between fixed nodes are left out only where they count in no strain that can change.
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
    let free: Vec<bool> = (0..u.len()).map(|node| !held.contains(&(node as u32))).collect();
    let of_free = |forces: Vec<[f64; 3]>| -> Vec<[f64; 3]> {
        forces.into_iter().zip(&free).filter(|(_, free)| **free).map(|(force, _)| force).collect()
    };
    let exact = of_free(exact_forces(&tissues, &widened(&u)));
    let scene = body.scene(NodalStrain(tissue(law)), &fixed(&held));
    let error = norm_of_sum(&of_free(forces(&scene, &u)), &negative(&exact)) / norm(&exact);
    println!("{} of {} elements: forces {error:.1e}", scene.element_count(), mesh.tets.len());
    assert!(scene.element_count() < mesh.tets.len() && error < 1e-5);
}

#[test]
fn a_homogeneous_deformation_leaves_inner_nodes_without_force() {
    let body = Body::irregular([0.05, 0.05, 0.1], [4, 4, 8]);
    let on_surface = body.surface_nodes();
    let general: Mat3 = [[1.1, 0.15, -0.1], [-0.05, 0.9, 0.2], [0.1, -0.15, 1.1]];
    let turned = product(&rotation([1.0, 2.0, -1.0], 1.0), &general);
    each_law!(law => {
        let scene = body.scene(NodalStrain(tissue(law)), &[]);
        let rigid = body.affine(&rotation([0.3, -1.0, 0.8], 1.5), [0.02, -0.01, 0.03]);
        let scale = norm(&forces(&scene, &body.affine(&general, [0.0; 3])));
        for f in [general, turned] {
            let with = forces(&scene, &body.affine(&f, [0.0; 3]));
            let of = |surface: bool| norm(&with.iter().zip(&on_surface).filter(|(_, s)| **s == surface).map(|(f, _)| *f).collect::<Vec<_>>());
            println!("{}: inner over surface force {:.1e}", law.name(), of(false) / of(true));
            assert!(of(false) < 1e-5 * of(true));
        }
        if law.reference().is_isochoric() {
            let ratio = norm(&forces(&scene, &rigid)) / scale;
            println!("{}: rigid motion {ratio:.1e}", law.name());
            assert!(ratio < 1e-5);
        }
    });
}

/// The exact critical step is that of the tangent, and where stability ends; the bound is never above it.
#[test]
fn the_bound_of_the_critical_step_is_below_the_exact_one() {
    let (young, nu) = (263_824.0, 0.499);
    let law =
        NeoHookean { c: (young / (4.0 * (1.0 + nu))) as f32, d: (young / (6.0 * (1.0 - 2.0 * nu))) as f32 };
    let bodies = [
        ("beam", Body::bar([0.03, 0.03, 0.1], [4, 4, 13])),
        ("irregular bar", Body::irregular([0.05, 0.05, 0.1], [4, 4, 8])),
        ("slivers", Body::slivers([0.04, 0.04, 0.04])),
        ("lobe", Body::lobe()),
        ("cylinder", Body::cylinder()),
    ];
    for (name, body) in bodies {
        let size = f64::from(body.extent(0).1 - body.extent(0).0);
        for law in [law, NeoHookean { c: 500.0, d: 1_000.0 }] {
            let (scene, linear) = (body.scene(NodalStrain(tissue(law)), &[]), body.scene(tissue(law), &[]));
            let of_linear = f64::from(support::bound(&linear, &rest_of(&linear)).seconds);
            for share in [0.0, 0.005, 0.05] {
                let state = displaced(&scene, &noise(&body, share * size, 4));
                let bound = f64::from(support::bound(&scene, &state).seconds);
                let exact =
                    tled::exact_critical_step(scene.view(), state.displacements()).expect("it settles");
                if name == "beam" && share == 0.0 && law.d > 1e6 {
                    assert!(bound > 1.2 * of_linear);
                }
                println!(
                    "{name}, d {}, noise {share}: bound {:.3} of exact {exact:.3e} s, {:.3} of the linear element's bound at rest",
                    law.d,
                    bound / exact,
                    bound / of_linear
                );
                assert!(bound <= exact && bound > 0.45 * exact);
            }
        }
    }
}

/// Without damping a body stays bounded at 0.98 of the exact critical step and does not at 1.02.
#[test]
fn the_exact_critical_step_is_where_stability_ends() {
    let body = small_bar();
    let scene = body.scene(NodalStrain(tissue(support::NEO)), &held(&body));
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
    let scene = body.scene(NodalStrain(tissue(support::EXP)), &held(&body));
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

/// Parts on several threads give the same steps, one tissue or two.
#[test]
fn any_number_of_parts_gives_the_same_bits() {
    let body = Body::bar([0.05, 0.05, 0.2], [8, 8, 20]);
    let of_element: Vec<u16> =
        (0..body.tets.len()).map(|element| u16::from(element.is_multiple_of(5))).collect();
    let tissues = [support::EXP, Exponential { a: 90.0, ..support::EXP }].map(tissue);
    let one = body.scene(NodalStrain(tissues[0]), &held(&body));
    let two = body.scene(NodalStrain(Regions { tissues: &tissues, of_element: &of_element }), &held(&body));
    let (of_one, of_two) = (ended(&one, 1), ended(&two, 1));
    assert!(of_one != of_two);
    for parts in [2, 3, 5] {
        assert!(ended(&one, parts) == of_one && ended(&two, parts) == of_two, "{parts} parts");
    }
}

/// The mean strain around nodes hardly changes where a node inside the body is pushed through its neighbours; the elements there do.
/// Each element is looked at once in 16 steps.
#[test]
fn elements_that_are_turned_inside_out_are_told() {
    let body = Body::bar([0.04; 3], [4; 3]);
    let scene = body.scene(NodalStrain(tissue(support::NEO)), &[]);
    let inside = body.nodes_where(|x| x == [0.02; 3])[0] as usize;
    // So short that nothing moves.
    let step = Step::unchecked(1e-9, 0.0).unwrap();
    for push in [0.0, 0.011] {
        let mut u = vec![[0.0; 3]; body.points.len()];
        u[inside] = [push, 0.0, 0.0];
        let tissues = [support::NEO.reference()];
        let of_element = vec![0; body.tets.len()];
        let mesh = body.reference();
        let pushed = Tissues { mesh: &mesh, laws: &tissues, of_element: &of_element };
        let least_of_nodes = least_nodal_ratio(&pushed, &widened(&u));
        let mut state = displaced(&scene, &u);
        let told = (0..16).filter_map(|_| match tled::step(&scene, &Loads::NONE, &mut state, &step) {
            Status::Limited { least_volume_ratio, .. } => Some(least_volume_ratio),
            _ => None,
        });
        let told: Vec<_> = told.collect();
        println!("pushed by {push} m: least volume ratio of a node {least_of_nodes:.2}, told {told:?}");
        assert!(least_of_nodes > 0.5);
        assert_eq!(push > 0.0, told.iter().any(|ratio| *ratio < 0.0));
    }
}
