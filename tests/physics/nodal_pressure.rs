//! Tetrahedra with average nodal pressure against their definition in float64, and pressures that are not smeared
//! across tissues.

use supple::material::{Exponential, Law, NeoHookean, NodalPressure};
use supple::tled;

use crate::physics::nodal_elements::{self, Definition, noise, norm_where};
use crate::support::bodies::{held, small_bar};
use crate::support::{self, Body, displaced, forces, largest_distance, norm, reference_law, regions, rest_of, tissue};

const DEFINITION: Definition = Definition { energy: |body, u| body.energy(u), forces: |body, u| body.forces(u) };

#[test]
fn the_force_of_the_definition_is_minus_the_gradient_of_its_energy() {
    DEFINITION.check_gradient(1e-3);
}

#[test]
fn forces_and_energy_are_those_of_the_definition() {
    let body = small_bar();
    for law in support::laws() {
        let (scene, linear) = (body.scene(NodalPressure(tissue(law)), &[]), body.scene(tissue(law), &[]));
        DEFINITION.check_forces((law.name(), reference_law(law)), &scene, &linear);
    }
}

/// Two tissues that meet at a plane: for each element of `small_bar` its tissue, soft below.
fn halves(body: &Body) -> Vec<u16> {
    let (low, high) = body.extent(2);
    let middle = |tet: &[u32; 4]| tet.iter().map(|&node| body.points[node as usize][2]).sum::<f32>() / 4.0;
    body.tets.iter().map(|tet| u16::from(middle(tet) > 0.5 * (low + high))).collect()
}

const SOFT: NeoHookean = NeoHookean { c: 300.0, d: 3_000.0 };
const FIRM: NeoHookean = NeoHookean { c: 800.0, d: 80_000.0 };

#[test]
fn tissues_that_meet_have_pressures_of_their_own() {
    let body = small_bar();
    let (low, high) = body.extent(2);
    let of_element = halves(&body);
    let two = [SOFT, FIRM].map(tissue);
    let values = two.map(|tissue| tissue.values());
    let scene = body.scene(NodalPressure(regions(two[0].law, &values, &of_element)), &[]);
    DEFINITION.check_tissues(&[reference_law(SOFT), reference_law(FIRM)], &of_element, &scene);

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
    let only = |soft: bool| norm_where(&force, |node| in_soft[node] == soft);
    println!("force in the firm tissue over that in the soft one: {:.1e}", only(false) / only(true));
    assert!(only(true) > 0.0 && only(false) == 0.0);
}

/// A third tissue where two meet already keeps the volumes of its own elements there: its forces are the gradient of
/// its energy.
#[test]
fn a_third_tissue_at_a_node_has_an_energy() {
    let body = small_bar();
    let third = |(e, tissue): (usize, u16)| if e.is_multiple_of(7) { 2 } else { tissue };
    let of_element: Vec<_> = halves(&body).into_iter().enumerate().map(third).collect();
    let tissues = [SOFT, FIRM, SOFT].map(tissue);
    let values = tissues.map(|tissue| tissue.values());
    let scene = body.scene(NodalPressure(regions(tissues[0].law, &values, &of_element)), &[]);
    let (u, change) = (noise(&body, 4e-4, 3), noise(&body, 4e-4, 11));
    let at = |share: f32| {
        let u: Vec<_> = u.iter().zip(&change).map(|(u, v)| [0, 1, 2].map(|i| u[i] + share * v[i])).collect();
        tled::strain_energy(&scene, &mut displaced(&scene, &u)).expect("room")
    };
    let numeric = (at(-0.02) - at(0.02)) / 0.04;
    let work: f64 =
        (forces(&scene, &u).iter().zip(&change)).flat_map(|(f, v)| [0, 1, 2].map(|i| f[i] * f64::from(v[i]))).sum();
    println!("three tissues: work {work:.6e}, change of energy {numeric:.6e} J");
    assert!((work / numeric - 1.0).abs() < 1e-3);
}

/// Elements between fixed nodes are left out only where they count in no volume that can change.
#[test]
fn left_out_elements_change_no_force() {
    let (body, supports) = nodal_elements::mostly_held();
    let scene = body.scene(NodalPressure(tissue(support::NEO)), &supports);
    let linear = body.scene(tissue(support::NEO), &supports);
    DEFINITION.check_left_out(reference_law(support::NEO), &scene);
    println!("{} linear elements", linear.element_count());
    assert!(scene.element_count() > linear.element_count());
}

#[test]
fn a_homogeneous_deformation_leaves_inner_nodes_without_force() {
    let body = nodal_elements::irregular();
    for law in support::laws() {
        let (scene, linear) = (body.scene(NodalPressure(tissue(law)), &[]), body.scene(tissue(law), &[]));
        let of_nodes = nodal_elements::homogeneous().map(|u| {
            let of_nodes = nodal_elements::check_patch(law.name(), &scene, &u);
            // All volumes change alike: the linear element gives the same.
            assert!(largest_distance(&of_nodes, &forces(&linear, &u)) < 1e-4 * norm(&of_nodes));
            of_nodes
        });
        nodal_elements::check_rigid(law.name(), &scene, &of_nodes[0]);
    }
}

/// The exact critical step is that of the tangent, which is the derivative of the forces; the bound is never above it.
/// In a body at rest that hardly changes its volume it is 1.29 times the linear element's (`4 x 4 x 13` cells, nu
/// 0.499; eigenvalues of the assembled matrices with SciPy: 1.285).
#[test]
fn the_bound_of_the_critical_step_is_below_the_exact_one() {
    for (name, body) in &nodal_elements::of_bounds() {
        for law in nodal_elements::of_critical_steps() {
            let scene = body.scene(NodalPressure(tissue(law)), &[]);
            // The noise turns slivers inside out: the bound adds up pressures that nearly cancel.
            let least = |noise: f64| if *name == "slivers" && noise > 0.0 { 0.05 } else { 0.6 };
            nodal_elements::check_bounds((&format!("{name}, d {}", law.d), body), &scene, least);
            if law.d < 1e6 || !["beam", "lobe"].contains(name) {
                continue;
            }
            let linear = body.scene(tissue(law), &[]);
            let (rest, linear_rest) = (rest_of(&scene), rest_of(&linear));
            let of_bounds = support::bound(&scene, &rest).seconds / support::bound(&linear, &linear_rest).seconds;
            println!("{name}: bound of the critical step {of_bounds:.3} of the linear element's");
            assert!(of_bounds > 1.2);
            if *name == "beam" {
                let exact = tled::exact_critical_step(scene.view(), rest.displacements()).expect("it settles")
                    / tled::exact_critical_step(linear.view(), linear_rest.displacements()).expect("it settles");
                println!("beam: exact critical step {exact:.3} of the linear element's");
                assert!((exact - 1.285).abs() < 2e-3);
            }
        }
    }
}

#[test]
fn the_exact_critical_step_is_where_stability_ends() {
    let body = small_bar();
    nodal_elements::check_limit_of_stability(&body.scene(NodalPressure(tissue(support::NEO)), &held(&body)));
}

#[test]
fn the_energy_of_a_swinging_body_does_not_drift() {
    let body = small_bar();
    nodal_elements::check_drift(&body, &body.scene(NodalPressure(tissue(support::EXP)), &held(&body)));
}

/// Parts on several threads give the same steps, one tissue or two.
#[test]
fn any_number_of_parts_gives_the_same_bits() {
    let (body, held, of_element) = nodal_elements::in_parts();
    let stiffer = Exponential { a: 90.0, b: 8.023, d: 60_000.0 }.into();
    let tissues = [support::EXP, stiffer].map(tissue);
    let one = body.scene(NodalPressure(tissues[0]), &held);
    let values = tissues.map(|tissue| tissue.values());
    let two = body.scene(NodalPressure(regions(tissues[0].law, &values, &of_element)), &held);
    assert!(nodal_elements::same_bits_in_parts(&one) != nodal_elements::same_bits_in_parts(&two));
}
