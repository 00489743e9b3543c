//! Tetrahedra with stabilised nodal strain against their definition in float64, and the elements in it that turn inside
//! out.

use supple::loads::Loads;
use supple::material::{Exponential, Law, NeoHookean, NodalStrain};
use supple::step::{Status, Step};
use supple::tled;

use crate::physics::nodal_elements::{self, Definition};
use crate::reference::nodal_pressure::Tissues;
use crate::reference::nodal_strain::{energy, forces, least_nodal_ratio};
use crate::support::bodies::{held, small_bar};
use crate::support::{self, Body, displaced, reference_law, regions, rest_of, tissue, widened};

const DEFINITION: Definition = Definition { energy, forces };

#[test]
fn the_force_of_the_definition_is_minus_the_gradient_of_its_energy() {
    DEFINITION.check_gradient(1e-3);
    // With crushed and inverted elements.
    DEFINITION.check_gradient(6e-3);
}

#[test]
fn forces_and_energy_are_those_of_the_definition() {
    let body = small_bar();
    for law in support::laws() {
        let (scene, linear) = (body.scene(NodalStrain(tissue(law)), &[]), body.scene(tissue(law), &[]));
        DEFINITION.check_forces((law.name(), reference_law(law)), &scene, &linear);
    }
}

/// Three tissues side by side: each has a mean strain of its own at every node.
#[test]
fn tissues_that_meet_have_strains_of_their_own() {
    let body = small_bar();
    let three = [
        NeoHookean { c: 300.0, d: 3_000.0 },
        NeoHookean { c: 800.0, d: 80_000.0 },
        NeoHookean { c: 300.0, d: 3_000.0 },
    ];
    let of_element: Vec<u16> = (0..body.tets.len()).map(|element| (element / 3 % 3) as u16).collect();
    let tissues = three.map(tissue);
    let values = tissues.map(|tissue| tissue.values());
    let scene = body.scene(NodalStrain(regions(tissues[0].law, &values, &of_element)), &[]);
    DEFINITION.check_tissues(&three.map(reference_law), &of_element, &scene);
}

/// Elements between fixed nodes are left out only where they count in no strain that can change.
#[test]
fn left_out_elements_change_no_force() {
    let (body, supports) = nodal_elements::mostly_held();
    let scene = body.scene(NodalStrain(tissue(support::NEO)), &supports);
    DEFINITION.check_left_out(reference_law(support::NEO), &scene);
}

#[test]
fn a_homogeneous_deformation_leaves_inner_nodes_without_force() {
    let body = nodal_elements::irregular();
    for law in support::laws() {
        let scene = body.scene(NodalStrain(tissue(law)), &[]);
        let forces = nodal_elements::homogeneous().map(|u| nodal_elements::check_patch(law.name(), &scene, &u));
        nodal_elements::check_rigid(law.name(), &scene, &forces[0]);
    }
}

/// The exact critical step is that of the tangent, and where stability ends; the bound is never above it.
#[test]
fn the_bound_of_the_critical_step_is_below_the_exact_one() {
    for (name, body) in &nodal_elements::of_bounds() {
        for law in nodal_elements::of_critical_steps() {
            let scene = body.scene(NodalStrain(tissue(law)), &[]);
            // The noise turns slivers inside out, as with nodal pressure.
            let least = |noise: f64| if *name == "slivers" && noise > 0.0 { 0.05 } else { 0.45 };
            nodal_elements::check_bounds((&format!("{name}, d {}", law.d), body), &scene, least);
            let linear = body.scene(tissue(law), &[]);
            let ratio =
                support::bound(&scene, &rest_of(&scene)).seconds / support::bound(&linear, &rest_of(&linear)).seconds;
            println!("{name}, d {}: bound at rest {ratio:.3} of the linear element's", law.d);
            assert!(*name != "beam" || law.d < 1e6 || ratio > 1.2);
        }
    }
}

#[test]
fn the_exact_critical_step_is_where_stability_ends() {
    let body = small_bar();
    nodal_elements::check_limit_of_stability(&body.scene(NodalStrain(tissue(support::NEO)), &held(&body)));
}

#[test]
fn the_energy_of_a_swinging_body_does_not_drift() {
    let body = small_bar();
    nodal_elements::check_drift(&body, &body.scene(NodalStrain(tissue(support::EXP)), &held(&body)));
}

/// Parts on several threads give the same steps, one tissue or two.
#[test]
fn any_number_of_parts_gives_the_same_bits() {
    let (body, held, of_element) = nodal_elements::in_parts();
    let stiffer = Exponential { a: 90.0, b: 8.023, d: 60_000.0 }.into();
    let tissues = [support::EXP, stiffer].map(tissue);
    let one = body.scene(NodalStrain(tissues[0]), &held);
    let values = tissues.map(|tissue| tissue.values());
    let two = body.scene(NodalStrain(regions(tissues[0].law, &values, &of_element)), &held);
    assert!(nodal_elements::same_bits_in_parts(&one) != nodal_elements::same_bits_in_parts(&two));
}

/// The mean strain around nodes hardly changes where a node inside the body is pushed through its neighbours; the
/// elements there do. Each element is looked at once in 16 steps.
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
        let tissues = [reference_law(support::NEO)];
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
