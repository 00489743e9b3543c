//! Tissue with fibres against closed forms, and its stiffness against float64.

use supple::material::{AnyLaw, Directions, Element, Exponential, Fibres, Prony, VecMaterial};
use supple::scene::VecScene;
use supple::tled;

use crate::physics::relaxation::Specimen;
use crate::reference::tensor::{Mat3, determinant, from_fn, inverse, max_abs, product, transpose};
use crate::support::{Body, DENSITY, bound, displaced, forces, largest_distance, to_f32};

/// Constants of Holzapfel & Ogden 2009, table 1, for the shear of pig myocardium (Pa): `a`, `b`, then those of fibres,
/// sheets and the coupling of both.
const A: f32 = 59.0;
const B: f32 = 8.023;
const FIBRES: [f32; 2] = [18_472.0, 16.026];
const SHEETS: [f32; 2] = [2_481.0, 11.12];
const COUPLING: [f32; 2] = [216.0, 11.436];
/// Half the bulk modulus, Pa.
const D: f32 = 60_000.0;

fn law() -> AnyLaw {
    Exponential { a: A, b: B, d: D }.into()
}

/// Neither along an axis of the mesh nor of unit length.
const ROTATED: [[f32; 3]; 3] = [[2.0, 1.0, -2.0], [1.0, 2.0, 2.0], [2.0, -2.0, 1.0]];

/// Unit vectors along fibres, sheets and the normal of both.
fn axes() -> [[f64; 3]; 3] {
    ROTATED.map(|axis| axis.map(|component| f64::from(component) / 3.0))
}

fn material(element: Element, terms: [Option<[f32; 2]>; 3], elements: usize) -> VecMaterial {
    let directions = vec![Directions { fibre: ROTATED[0], sheet: ROTATED[1] }; elements];
    VecMaterial { fibres: vec![Fibres::new(terms).unwrap()], directions, ..VecMaterial::one(element, law(), DENSITY) }
}

fn body() -> Body {
    Body::irregular([0.03, 0.03, 0.03], [3, 3, 3])
}

/// The Cauchy stress (Pa) in axes of fibres, sheets and normal, of a body with the same deformation gradient everywhere,
/// which is given in these axes, from the forces of its nodes.
fn stress(element: Element, terms: [Option<[f32; 2]>; 3], local: &Mat3) -> Mat3 {
    let body = body();
    let q = transpose(&axes());
    let f = product(&product(&q, local), &transpose(&q));
    let scene = VecScene::build(material(element, terms, body.tets.len()), &body.mesh(), &[]).unwrap();
    let forces = forces(&scene, &body.affine(&f, [0.0; 3]));
    let volume = 0.03_f64.powi(3);
    let mut first = [[0.0; 3]; 3];
    for (point, force) in body.points.iter().zip(forces) {
        for i in 0..3 {
            for j in 0..3 {
                first[i][j] -= force[i] * f64::from(point[j]) / volume;
            }
        }
    }
    let cauchy = product(&first, &transpose(&f));
    let j = determinant(&f);
    let turned = product(&product(&transpose(&q), &cauchy), &q);
    from_fn(|i, k| turned[i][k] / j)
}

/// Half of `2 psi_1`, `2 psi_4` of a family, and `psi_8`, at the shear `k`.
fn slopes(k: f64) -> [f64; 4] {
    let [a, b] = [A, B].map(f64::from);
    let of = |[a, b]: [f32; 2]| f64::from(a) * k * k * (f64::from(b) * k.powi(4)).exp();
    let coupling = f64::from(COUPLING[0]) * k * (f64::from(COUPLING[1]) * k * k).exp();
    [0.5 * a * (b * k * k).exp(), of(FIBRES), of(SHEETS), coupling]
}

#[test]
fn six_shears_are_those_of_the_closed_forms() {
    let terms = [Some(FIBRES), Some(SHEETS), Some(COUPLING)];
    for element in Element::ALL {
        let mut worst = 0.0_f64;
        for k in [0.05, 0.2, 0.35, 0.5] {
            let [isotropic, of_fibres, of_sheets, coupling] = slopes(k);
            // The direction that is sheared, and the one along which (Holzapfel & Ogden 2009, section 5d).
            let modes = [
                ("fs", [0, 1], 2.0 * (isotropic + of_fibres) * k + coupling),
                ("fn", [0, 2], 2.0 * (isotropic + of_fibres) * k),
                ("sf", [1, 0], 2.0 * (isotropic + of_sheets) * k + coupling),
                ("sn", [1, 2], 2.0 * (isotropic + of_sheets) * k),
                ("nf", [2, 0], 2.0 * isotropic * k),
                ("ns", [2, 1], 2.0 * isotropic * k),
            ];
            for (name, [sheared, along], expected) in modes {
                let f = from_fn(|i, j| f64::from(i == j) + if (i, j) == (along, sheared) { k } else { 0.0 });
                let computed = stress(element, terms, &f)[sheared][along];
                let error = (computed - expected).abs() / expected;
                worst = worst.max(error);
                if k == 0.5 {
                    println!("{}, {name} at {k}: {computed:.1} Pa, closed form {expected:.1}", element.name());
                }
            }
        }
        println!("{}: within {worst:.1e}", element.name());
        assert!(worst < 1e-3);
    }
}

#[test]
fn stretches_along_one_and_two_families_are_those_of_the_closed_forms() {
    // Stresses of a stretch of constant volume less that along the normal, which pressure does not change.
    let expected = |terms: [[f32; 2]; 2], [f, s]: [f64; 2]| {
        let n = 1.0 / (f * s);
        let i1 = f * f + s * s + n * n - 3.0;
        let isotropic = f64::from(A) * (f64::from(B) * i1).exp();
        let of = |[a, b]: [f32; 2], stretch: f64| {
            let x = (stretch * stretch - 1.0).max(0.0);
            isotropic * (stretch * stretch - n * n)
                + 2.0 * f64::from(a) * x * (f64::from(b) * x * x).exp() * stretch * stretch
        };
        [of(terms[0], f), of(terms[1], s)]
    };
    for element in Element::ALL {
        for (name, terms, stretches) in [
            ("uniaxial, taut", [FIBRES, [0.0; 2]], [1.15_f64, 1.15_f64.powf(-0.5)]),
            ("uniaxial, slack", [FIBRES, [0.0; 2]], [0.8, 0.8_f64.powf(-0.5)]),
            ("biaxial", [FIBRES, SHEETS], [1.1, 1.15]),
            ("biaxial, one slack", [FIBRES, SHEETS], [1.2, 0.95]),
        ] {
            let given = terms.map(|term| (term[0] > 0.0).then_some(term));
            let [f, s] = stretches;
            let deformation = [[f, 0.0, 0.0], [0.0, s, 0.0], [0.0, 0.0, 1.0 / (f * s)]];
            let cauchy = stress(element, [given[0], given[1], None], &deformation);
            let closed = expected(terms, stretches);
            let computed = [0, 1].map(|axis| cauchy[axis][axis] - cauchy[2][2]);
            println!("{}, {name}: {computed:.1?} Pa, closed form {closed:.1?}", element.name());
            for (computed, closed) in computed.into_iter().zip(closed) {
                assert!((computed - closed).abs() < 1e-3 * closed.abs().max(10.0));
            }
        }
    }
}

/// What relaxes of the stress of distortion is a share of that of the fibres as well: at a held strain the stress is
/// `P - g (1 - e^(-t / tau)) (P - p C)`, with the pressure `p` of the law.
#[test]
fn the_stress_of_fibres_relaxes_as_in_the_closed_form() {
    const TAU: f64 = 0.2;
    const SHARE: f64 = 0.6;
    let f = [[1.1, 0.2, 0.0], [0.0, 0.98, 0.1], [0.05, 0.0, 0.95]];
    let (j, cofactor) = (determinant(&f), transpose(&inverse(&f)));
    let terms = [Some(FIBRES), Some(SHEETS), Some(COUPLING)];
    for element in Element::ALL {
        let prony = vec![Prony::new(&[[SHARE as f32, TAU as f32]]).unwrap()];
        let material = VecMaterial { prony, ..material(element, terms, 162) };
        let seconds = TAU / 50.0;
        let mut specimen = Specimen::of(material, seconds);
        specimen.start(&f);
        let mut worst = 0.0_f64;
        let (mut first, mut distortion) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        for step in 0..150 {
            let stress = specimen.step(&f);
            if step == 0 {
                let pressure = 2.0 * f64::from(D) * (j - 1.0) * j;
                (first, distortion) = (stress, from_fn(|i, k| stress[i][k] - pressure * cofactor[i][k]));
            }
            let relaxed = SHARE * (1.0 - (-f64::from(step) * seconds / TAU).exp());
            let exact = from_fn(|i, k| first[i][k] - relaxed * distortion[i][k]);
            worst = worst.max(max_abs(&from_fn(|i, k| stress[i][k] - exact[i][k])) / max_abs(&distortion));
        }
        println!("{element:?}: {:.0} Pa relax within {worst:.1e}", max_abs(&distortion));
        assert!(worst < 1e-4 && max_abs(&distortion) > 500.0);
    }
}

/// A bend with stretches of 15 %, in which some fibres are taut and some slack.
fn bent(body: &Body, size: f64) -> Vec<[f32; 3]> {
    let bend = |&[x, y, z]: &[f32; 3]| {
        let [x, y, z] = [x, y, z].map(|c| f64::from(c) / 0.03);
        [0.3 * z * z - 0.1 * x * y, 0.2 * x * z + 0.1 * y, -0.25 * x * z + 0.1 * y * y].map(|c| 0.03 * size * c)
    };
    to_f32(&body.points.iter().map(bend).collect::<Vec<_>>())
}

#[test]
fn forces_are_those_of_float64_where_elements_deform_each_in_its_way() {
    let body = body();
    let terms = [Some(FIBRES), Some(SHEETS), Some(COUPLING)];
    let scene = VecScene::build(material(Element::Linear, terms, body.tets.len()), &body.mesh(), &[]).unwrap();
    for size in [1e-3, 0.3, 1.0] {
        let u = bent(&body, size);
        let computed = forces(&scene, &u);
        let mut exact = vec![[0.0; 3]; u.len()];
        for tangent in tled::element_tangents(scene.view(), |node| u[node].map(f64::from)) {
            for (node, force) in tangent.nodes.into_iter().zip(tangent.forces()) {
                (0..3).for_each(|axis| exact[node][axis] += force[axis]);
            }
        }
        let largest = largest_distance(&exact, &vec![[0.0; 3]; u.len()]);
        let error = largest_distance(&computed, &exact) / largest;
        println!("bent by {size}: {error:.1e} of {largest:.2e} N");
        assert!(error < 2e-4 && largest > 0.0);
    }
}

#[test]
fn the_critical_step_is_bounded_with_fibres_taut_and_slack() {
    let body = body();
    for (name, terms) in [
        ("fibres", [Some(FIBRES), None, None]),
        ("fibres, sheets, coupling", [Some(FIBRES), Some(SHEETS), Some(COUPLING)]),
        ("stiff fibres", [Some([2e6, 16.0]), None, None]),
    ] {
        for element in Element::ALL {
            let scene = VecScene::build(material(element, terms, body.tets.len()), &body.mesh(), &[]).unwrap();
            for size in [0.0, 0.3, 1.0] {
                let state = displaced(&scene, &bent(&body, size));
                let exact = tled::exact_critical_step(scene.view(), state.displacements()).unwrap();
                let bound = f64::from(bound(&scene, &state).seconds);
                let ratio = bound / exact;
                println!("{}, {name}, bent by {size}: bound {ratio:.3} of {exact:.2e} s", element.name());
                assert!(ratio <= 1.0);
            }
        }
    }
}
