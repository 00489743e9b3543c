//! One element in stretch, shear and volume change against closed forms: forces, von Mises stress, volume ratio,
//! energy. Several tissues in one mesh.

use supple::loads::Loads;
use supple::material::{Exponential, Law, NeoHookean, Tissue};
use supple::step::Step;
use supple::tled;

use crate::reference::tensor::{determinant, from_fn, max_abs, product, transpose};
use crate::reference::{Mat3, Random, closed_form};
use crate::support::bodies::{held, small_bar, torsion};
use crate::support::{
    Body, bits, displaced, forces, norm, norm_of_sum, reference_law, regions, rest_of, tissue, widened,
};
use crate::{reference, support};

/// Deformations with their closed-form stress under a law.
fn cases(law: &reference::Law) -> Vec<(String, Mat3, Mat3)> {
    let mut cases = Vec::new();
    for s in [0.5, 0.7, 0.9, 0.99, 1.01, 1.1, 1.5, 2.0] {
        let (f, p) = (closed_form::uniaxial_stretch(s), closed_form::uniaxial_stretch_stress(law, s));
        cases.push((format!("stretch {s}"), f, p));
    }
    for q in [1e-3, 0.01, 0.1, 0.5, 1.0] {
        let (f, p) = (closed_form::simple_shear(q), closed_form::simple_shear_stress(law, q));
        cases.push((format!("shear {q}"), f, p));
    }
    for s in [0.6, 0.9, 0.99, 1.01, 1.1, 1.5] {
        let (f, p) = (closed_form::dilation(s), closed_form::dilation_stress(law, s));
        cases.push((format!("dilation {s}"), f, p));
    }
    cases
}

/// `sqrt(3/2 s : s)` of the deviator of the Cauchy stress `P F^T / J`.
fn von_mises(p: &Mat3, f: &Mat3) -> f64 {
    let cauchy = product(p, &transpose(f));
    let mean = (cauchy[0][0] + cauchy[1][1] + cauchy[2][2]) / 3.0;
    let deviator = from_fn(|i, j| (cauchy[i][j] - if i == j { mean } else { 0.0 }) / determinant(f));
    (1.5 * deviator.iter().flatten().map(|s| s * s).sum::<f64>()).sqrt()
}

/// The deformation gradient of the only element under float32 displacements, in float64.
fn gradient(body: &Body, u: &[[f32; 3]]) -> Mat3 {
    body.reference().elements()[0].deformation_gradient(&widened(u))
}

#[test]
fn forces_match_the_closed_forms() {
    let body = Body::tetrahedron();
    let element = body.reference().elements()[0];
    let mut worst = 0.0_f64;
    for law in support::laws() {
        let scene = body.scene(tissue(law), &[]);
        for (name, f, p) in cases(&reference_law(law)) {
            let exact: Vec<[f64; 3]> = element
                .gradients
                .iter()
                .map(|gradient| reference::tensor::apply(&p, *gradient).map(|x| element.volume * x))
                .collect();
            let error = norm_of_sum(&forces(&scene, &body.affine(&f, [0.0; 3])), &exact) / norm(&exact);
            assert!(error < 1e-4, "{}, {name}: {error:e}", law.name());
            worst = worst.max(error);
        }
    }
    // The closed forms know nothing of the rounding of u, 6e-8 of it against strains from 1e-3.
    println!("forces against closed forms: largest relative error {worst:.1e}");
}

#[test]
fn fields_match_the_closed_forms() {
    let body = Body::tetrahedron();
    let volume = body.reference().volumes()[0];
    let mut worst = [0.0_f64; 3];
    for law in support::laws() {
        let scene = body.scene(tissue(law), &[]);
        for (name, f, _) in cases(&reference_law(law)) {
            let u = body.affine(&f, [0.0; 3]);
            let mut state = displaced(&scene, &u);
            let fields = scene.view().element_fields(state.displacements()).next().unwrap();
            assert_eq!(fields.element, 0);
            let f = gradient(&body, &u);
            let p = reference_law(law).first_piola(&f);
            let stress = von_mises(&p, &f);
            let energy = volume * reference_law(law).energy(&f);
            let of_kernel = tled::strain_energy(&scene, &mut state).unwrap();
            // A volume change has no von Mises stress: a hundredth of what it has is the scale there.
            let errors = [
                (fields.volume_ratio / determinant(&f) - 1.0).abs(),
                (fields.von_mises - stress).abs() / stress.max(0.01 * max_abs(&p)),
                (of_kernel - energy).abs() / energy.abs().max(1e-4 * volume),
            ];
            assert!(errors.iter().all(|error| *error < 1e-5), "{}, {name}: {errors:?}", law.name());
            for (worst, error) in worst.iter_mut().zip(errors) {
                *worst = worst.max(error);
            }
        }
    }
    let [ratio, stress, energy] = worst;
    println!("volume ratio {ratio:.1e}, von Mises stress {stress:.1e}, energy {energy:.1e} off");
}

/// Von Mises stress of simple shear and uniaxial stretch, written out.
#[test]
fn von_mises_stress_by_hand() {
    let body = Body::tetrahedron();
    let c = f64::from(support::NEO.values()[0]);
    let scene = body.scene(tissue(support::NEO), &[]);
    let stress = |f: &Mat3| {
        let state = displaced(&scene, &body.affine(f, [0.0; 3]));
        scene.view().element_fields(state.displacements()).next().unwrap().von_mises
    };
    for q in [0.01_f64, 0.3, 1.0] {
        // sigma = 2 c dev(F F^T): shear 2 c q, normal 2 c q^2 (2/3, -1/3, -1/3).
        let exact = 2.0 * c * (3.0 * q * q + q.powi(4)).sqrt();
        let error = (stress(&closed_form::simple_shear(q)) / exact - 1.0).abs();
        println!("shear {q}: {exact:.3} Pa, relative error {error:.1e}");
        assert!(error < 1e-5);
    }
    for s in [0.9_f64, 1.2] {
        // sigma_1 - sigma_2 = 2 c J^(-5/3) (s^2 - 1), J = s.
        let exact = 2.0 * c * s.powf(-5.0 / 3.0) * (s * s - 1.0).abs();
        let error = (stress(&closed_form::uniaxial_stretch(s)) / exact - 1.0).abs();
        println!("stretch {s}: {exact:.3} Pa, relative error {error:.1e}");
        assert!(error < 1e-5);
    }
    assert!(stress(&[[-0.9, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).is_nan(), "inverted");
}

#[test]
fn the_strain_energy_is_that_of_the_reference() {
    let body = small_bar();
    let mut random = Random(12);
    for law in support::laws() {
        let noise = body.points.iter().map(|_| random.vector().map(|x| (1e-3 * x) as f32));
        let u: Vec<_> = noise.collect();
        let scene = body.scene(tissue(law), &[]);
        let computed = tled::strain_energy(&scene, &mut displaced(&scene, &u)).expect("room");
        let exact = reference::strain_energy(&body.reference(), &reference_law(law), &widened(&u));
        println!("{}: {computed:.6e} J, relative error {:.1e}", law.name(), computed / exact - 1.0);
        assert!((computed / exact - 1.0).abs() < 1e-6);
    }
}

/// Two bodies that share no node, of two tissues in one scene, move as each does in a scene of its own.
#[test]
fn two_tissues_move_as_two_separate_scenes() {
    let one = small_bar();
    let mut both = one.clone();
    both.points.extend(one.points.iter().map(|&[x, y, z]| [x + 1.0, y, z]));
    // Exactly the same shape: the first body gets the rounded coordinates of the second.
    let far: Vec<_> = both.points[one.points.len()..].to_vec();
    let near: Vec<_> = far.iter().map(|&[x, y, z]| [x - 1.0, y, z]).collect();
    let count = one.points.len() as u32;
    both.points = near.iter().chain(&far).copied().collect();
    both.tets.extend(one.tets.iter().map(|tet| tet.map(|node| node + count)));
    let one = Body { points: near, ..one };

    let soft = Tissue { law: NeoHookean { c: 300.0, d: 10_000.0 }, density: 900.0 };
    let firm = Tissue { law: NeoHookean { c: 800.0, d: 20_000.0 }, density: 1100.0 };
    let of_element: Vec<u16> = (0..both.tets.len()).map(|e| u16::from(e >= one.tets.len())).collect();
    let values = [soft, firm].map(|tissue| tissue.values());
    let regions = regions(soft.law, &values, &of_element);
    let step = Step::unchecked(1e-4, 5.0).unwrap();

    let mut moved = Vec::new();
    for tissue in [soft, firm] {
        let scene = one.scene(tissue, &held(&one));
        let mut state = rest_of(&scene);
        let loads = Loads::new(&scene, [1.0, 0.0, -9.81], &[], &[]).unwrap();
        support::run(&scene, &loads, &mut state, &step, 500);
        moved.extend(support::to_f64(state.displacements()));
    }
    let scene = both.scene(regions, &held(&both));
    let mut state = rest_of(&scene);
    let loads = Loads::new(&scene, [1.0, 0.0, -9.81], &[], &[]).unwrap();
    support::run(&scene, &loads, &mut state, &step, 500);
    let combined = support::to_f64(state.displacements());
    let error = support::largest_distance(&combined, &moved) / support::largest(&moved);
    println!("two tissues in one scene against two scenes: relative difference {error:.1e}");
    // Elements are summed in another order, so the bits differ.
    assert!(error < 1e-5 && support::largest(&moved) > 1e-4);
    assert!((scene.mass() - 2.0 * 1000.0 * one.reference().volumes().iter().sum::<f64>()).abs() < 1e-6);
}

/// Constants of each element, mass of each element.
#[test]
fn every_element_may_have_its_own_constants() {
    let body = small_bar();
    let mut random = Random(3);
    let tissues: Vec<Tissue<Exponential>> = body
        .tets
        .iter()
        .map(|_| Tissue {
            law: Exponential {
                a: 60.0 + 30.0 * random.next() as f32,
                b: 8.0 + 2.0 * random.next() as f32,
                d: 50_000.0,
            },
            density: 1000.0 + 100.0 * random.next() as f32,
        })
        .collect();
    let of_element: Vec<u16> = (0..tissues.len() as u16).rev().collect();
    let values: Vec<_> = tissues.iter().map(Tissue::values).collect();
    let scene = body.scene(regions(tissues[0].law, &values, &of_element), &[]);
    let noise = body.points.iter().map(|_| random.vector().map(|x| (4e-4 * x) as f32));
    let u: Vec<_> = noise.collect();

    // Element by element with the reference.
    let mesh = body.reference();
    let mut exact = vec![[0.0; 3]; u.len()];
    let mut mass = vec![0.0; u.len()];
    for (element, tet) in mesh.tets.iter().enumerate() {
        let tissue = tissues[usize::from(of_element[element])];
        let single = reference::Mesh { points: mesh.points.clone(), tets: vec![*tet] };
        let force = reference::internal_force(&single, &reference_law(tissue.law), &widened(&u));
        for (sum, force) in exact.iter_mut().flatten().zip(force.iter().flatten()) {
            *sum += force;
        }
        for &node in tet {
            mass[node] += 0.25 * single.volumes()[0] * f64::from(tissue.density);
        }
    }
    let error = norm_of_sum(&forces(&scene, &u), &exact) / norm(&exact);
    println!("forces with constants of each element: relative error {error:.1e}");
    assert!(error < 1e-5);
    for (node, mass) in mass.iter().enumerate() {
        assert!((f64::from(scene.view().node_mass(node)) / mass - 1.0).abs() < 1e-6);
    }
}

#[test]
fn identical_tissues_give_the_bits_of_one() {
    let body = small_bar();
    for law in support::laws() {
        let one = tissue(law);
        let of_element: Vec<u16> = (0..body.tets.len()).map(|element| (element % 3) as u16).collect();
        let values = [one.values(); 3];
        let several = support::regions(law, &values, &of_element);
        let step = Step::unchecked(1e-4, 5.0).unwrap();
        let forces = torsion(&body, 1e-3, 0.01);
        let simple = body.scene(one, &held(&body));
        let regions = body.scene(several, &held(&body));
        let (mut a, mut b) = (rest_of(&simple), rest_of(&regions));
        let loads = Loads::new(&simple, [0.0; 3], &forces, &[]).unwrap();
        support::run(&simple, &loads, &mut a, &step, 500);
        support::run(&regions, &loads, &mut b, &step, 500);
        assert!(bits(&a) == bits(&b), "{}", law.name());
        assert_eq!(support::bound(&simple, &a), support::bound(&regions, &b));
    }
}
