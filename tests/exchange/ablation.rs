//! Constants that change.

use super::*;

use supple::material::{AnyLaw, Directions, Exponential, Fibres, Law, Prony, TissueValues};
use supple::simulation::SimulationError;

const STIFF: NeoHookean = NeoHookean { c: 2500.0, d: 50_000.0 };

fn at_rest_under_gravity(mut body: Simulation<'static>, seconds: f64) -> Simulation<'static> {
    body.gravity = [4.0, 0.0, 0.0];
    for _ in 0..(seconds / 0.02).round() as u32 {
        body.advance(0.02).unwrap();
    }
    body
}

/// Where a region becomes stiffer or softer over half a second under a load, the end is that of a body that was so from
/// the start.
#[test]
fn the_end_is_that_of_a_body_that_was_so_from_the_start() {
    let region = elements_where(|[_, _, z]| (0.03..0.07).contains(&z));
    for element in ELEMENTS {
        for (method, law) in
            [(Method::Exact, STIFF), (Method::Exact, NeoHookean { c: 250.0, d: 5000.0 }), (long(), STIFF)]
        {
            let name = format!("{element:?}, {}", if matches!(method, Method::Exact) { "exact" } else { "long" });
            let made = |method| bar(element).with(settings(method, 30.0));
            let mut changed = at_rest_under_gravity(made(method.clone()), 0.2);
            changed.ablate(&region, law, 0.5).unwrap();
            let changed = at_rest_under_gravity(changed, 2.0);
            let mut of_element = vec![0; BAR.element_count()];
            region.iter().for_each(|&element| of_element[element as usize] = 1);
            let values = |law: NeoHookean| TissueValues { constants: AnyLaw::from(law).values(), density: DENSITY };
            let tissues = vec![values(SOFT), values(law)];
            let material = VecMaterial {
                element,
                law: law.into(),
                tissues,
                of_element,
                prony: vec![],
                fibres: vec![],
                directions: vec![],
            };
            let supports: Vec<_> = (0..25).map(Support::fixed).collect();
            let from_start = Simulation::new(BAR.points(), BAR.tets(), material, &supports).unwrap();
            let from_start = at_rest_under_gravity(from_start.with(settings(method, 30.0)), 2.2);
            let (off, moved) = difference(&changed, &from_start);
            println!("{name}: {:.4} of {:.1} mm", 1e3 * off, 1e3 * moved);
            assert!(off < 0.004 * moved && moved > 0.003, "{name}: {off} of {moved}");
        }
    }
}

/// Ten times as stiff or as soft, in motion and in one frame's stages: long steps keep their lattice meanwhile.
#[test]
fn long_steps_stand_strong_ablations() {
    for element in ELEMENTS {
        for (index, factor) in [10.0, 0.1, 10.0, 0.1].into_iter().enumerate() {
            let region = elements_where(|[x, y, z]| if index < 2 { z > 0.05 } else { x + y + z < 0.06 });
            let mut body = bar(element).with(settings(long(), 5.0));
            body.gravity = [2.0, 0.0, 0.0];
            body.advance(0.1).unwrap();
            body.ablate(&region, NeoHookean { c: factor * SOFT.c, d: factor * SOFT.d }, 0.2).unwrap();
            let mut largest = 0.0f32;
            for _ in 0..100 {
                let report = body.advance(0.01).unwrap();
                assert!(report.status.is_taken());
                for vector in body.displacements() {
                    largest = largest.max(glam::Vec3::from(vector.to_array()).length());
                }
            }
            println!("{element:?}, {factor} times as stiff: nodes move by {:.1} mm at most", 1e3 * largest);
            assert!(largest < 0.35);
        }
    }
}

/// The stages: 20 of them, none larger than a twentieth of the way.
#[test]
fn constants_change_in_twenty_stages() {
    let mut body = bar(Element::Linear).with(settings(Method::Exact, 10.0));
    let region = elements_where(|[_, _, z]| z > 0.06);
    body.ablate(&region, STIFF, 0.2).unwrap();
    let mut values = vec![];
    for _ in 0..60 {
        assert!(body.advance(0.004).unwrap().is_ok());
        values.push(body.scene().material().tissues[1].constants[0]);
    }
    values.dedup();
    println!("{values:?}");
    assert_eq!((values.len(), values[0], values[20]), (21, SOFT.c, STIFF.c));
    assert!(values.windows(2).all(|pair| (pair[1] - pair[0] - 100.0).abs() < 1.0));
}

/// A scene whose constants alone change keeps its tables, and takes the same steps as one that is built anew.
#[test]
fn other_constants_need_no_other_tables() {
    for element in ELEMENTS {
        let mut bodies = [(); 2].map(|()| bar(element).with(settings(Method::Exact, 10.0)));
        let stiff = VecMaterial::one(element, STIFF, DENSITY);
        for (index, body) in bodies.iter_mut().enumerate() {
            body.gravity = [3.0, 0.0, 0.0];
            body.advance(0.05).unwrap();
            if index == 0 {
                body.exchange(stiff.clone(), &[]).unwrap();
            } else {
                // Another density builds anew, and so does the former.
                let other = VecMaterial::one(element, STIFF, 2.0 * DENSITY);
                body.exchange(other, &[]).unwrap();
                body.exchange(stiff.clone(), &[]).unwrap();
            }
            assert!(body.advance(0.05).unwrap().is_ok());
        }
        let [a, b] = &bodies;
        assert_eq!(a.displacements(), b.displacements(), "{element:?}");
    }
}

/// In tables that were built anew each element remembers what it did and has its fibres, and so have the parts of a
/// tissue that became two.
#[test]
fn tissue_that_relaxes_and_has_fibres_goes_on_in_other_tables() {
    for element in ELEMENTS {
        let of_density = |factor: f32| VecMaterial {
            prony: vec![Prony::new(&[[0.5, 0.01], [0.2, 0.1]]).unwrap()],
            fibres: vec![Fibres::new([Some([500.0, 4.0]), None, None]).unwrap()],
            directions: vec![Directions { fibre: [0.0, 0.6, 0.8], sheet: [0.0; 3] }; BAR.element_count()],
            ..VecMaterial::one(element, SOFT, factor * DENSITY)
        };
        let supports: Vec<_> = (0..25).map(Support::fixed).collect();
        let [mut stays, mut changes, mut parts] = [(); 3].map(|()| {
            let body = Simulation::new(BAR.points(), BAR.tets(), of_density(1.0), &supports).unwrap();
            let mut body = body.with(settings(Method::Exact, 10.0));
            body.gravity = [3.0, 0.0, 0.0];
            body.advance(0.05).unwrap();
            body
        });
        stays.exchange(of_density(1.0), &[]).unwrap();
        changes.exchange(of_density(2.0), &[]).unwrap();
        changes.exchange(of_density(1.0), &[]).unwrap();
        parts.ablate(&elements_where(|[_, _, z]| z > 0.06), SOFT, 0.0).unwrap();
        for body in [&mut stays, &mut changes, &mut parts] {
            assert!(body.advance(0.05).unwrap().is_ok());
        }
        assert_eq!(stays.displacements(), changes.displacements(), "{element:?}");
        let (off, way) = difference(&parts, &stays);
        println!("{element:?}: two tissues of one kind, {off:.1e} of {way:.1e} m off");
        // With nodal pressure each tissue has pressures of its own where they meet.
        assert!(off < 1e-2 * way);
        // Without a corner of the free end the rest goes on as it would have; forgotten, its stress would more than double.
        stays.remove(&elements_where(|[x, _, z]| x > 0.02 && z > 0.11)).unwrap();
        for body in [&mut stays, &mut changes] {
            body.advance(0.02).unwrap();
        }
        let middle = |body: &Simulation<'_>| body.displacements()[8 * 25 + 12].to_array()[0];
        let (goes_on, would) = (middle(&stays), middle(&changes));
        println!("{element:?}: {:.4} mm without a corner, {:.4} mm with it", 1e3 * goes_on, 1e3 * would);
        assert!((goes_on / would - 1.0).abs() < 0.02);
    }
}

#[test]
fn what_cannot_be_is_refused_and_changes_nothing() {
    let mut bodies = [(); 2].map(|()| bar(Element::NodalStrain).with(settings(Method::Exact, 10.0)));
    for body in &mut bodies {
        body.gravity = [3.0, 0.0, 0.0];
        body.advance(0.05).unwrap();
    }
    let [body, other] = &mut bodies;
    let bad = NeoHookean { c: f32::NAN, d: 1.0 };
    let told = |answer: Result<(), SimulationError>| answer.unwrap_err().to_string();
    println!("{}", told(body.ablate(&[3], bad, 1.0)));
    println!("{}", told(body.ablate(&[1 << 20], STIFF, 1.0)));
    println!("{}", told(body.ablate(&[], STIFF, 1.0)));
    println!("{}", told(body.ablate(&[3], Exponential { a: 59.0, b: 8.0, d: 6e4 }, 1.0)));
    println!("{}", told(body.ablate(&[3], STIFF, f64::NAN)));
    println!("{}", told(body.ablate(&[3], STIFF, -1.0)));
    println!("{}", told(body.exchange(VecMaterial::one(Element::NodalStrain, bad, DENSITY), &[])));
    println!("{}", told(body.exchange(VecMaterial::one(Element::NodalStrain, STIFF, f32::NAN), &[])));
    println!("{}", told(body.exchange(VecMaterial { tissues: vec![], ..body.scene().material().clone() }, &[])));
    println!("{}", told(body.remove(&[1 << 20])));
    println!("{}", told(body.remove(&(0..BAR.element_count() as u32).collect::<Vec<_>>())));
    for body in [&mut *body, &mut *other] {
        assert!(body.advance(0.05).unwrap().is_ok());
    }
    assert_eq!(body.displacements(), other.displacements());
    assert_eq!(body.state().energy_balance(), other.state().energy_balance());
}

/// What cannot be prepared is found before the former scene goes: long steps of a lattice of given cells, which has no
/// room in what is left.
#[test]
fn steps_that_cannot_be_prepared_leave_all_as_it_was() {
    let mut body = bar(Element::Linear).with(settings(long(), 10.0));
    body.gravity = [3.0, 0.0, 0.0];
    body.advance(0.05).unwrap();
    let before = body.displacements().to_vec();
    let left: Vec<_> = (0..BAR.element_count() as u32).filter(|&element| element != 1500).collect();
    let answer = body.remove(&left);
    println!("{answer:?}");
    assert!(answer.is_err());
    assert_eq!(body.displacements(), before);
    assert!(!body.is_removed(0) && body.advance(0.05).unwrap().long > 0);
}

/// Another material ends an ablation where it is, so that it changes nothing of it; a removal does not. Put back to a time before it
/// began it ends as well.
#[test]
fn another_material_ends_an_ablation() {
    let region = elements_where(|[_, _, z]| z > 0.05);
    let other = NeoHookean { c: 700.0, d: 14_000.0 };
    let begun = || {
        let mut body = bar(Element::NodalStrain).with(settings(Method::Exact, 30.0));
        body.ablate(&region, STIFF, 0.2).unwrap();
        (0..6).for_each(|_| _ = body.advance(0.02).unwrap());
        body
    };
    let constants = |body: &Simulation<'static>| body.scene().material().tissues.last().unwrap().constants[0];
    let mut exchanged = begun();
    let half = constants(&exchanged);
    exchanged.exchange(VecMaterial::one(Element::NodalStrain, other, DENSITY), &[]).unwrap();
    let mut removed = begun();
    removed.remove(&[0]).unwrap();
    let mut reset = begun();
    reset.state_mut().reset();
    for body in [&mut exchanged, &mut removed, &mut reset] {
        (0..8).for_each(|_| _ = body.advance(0.04).unwrap());
    }
    let [exchanged, removed, reset] = [&exchanged, &removed, &reset].map(constants);
    println!(
        "half way {half} Pa, with another material {exchanged}, without an element {removed}, after a reset {reset}"
    );
    assert!(half > 1.2 * SOFT.c && half < 0.9 * STIFF.c);
    assert_eq!([exchanged, removed, reset], [other.c, STIFF.c, half]);
}

/// Fibres in other directions are those of a body that was built so; what are no directions is refused, and nothing changes.
#[test]
fn other_directions_of_fibres_are_taken_over() {
    let tissue = |fibre: [f32; 3], count: usize| VecMaterial {
        fibres: vec![Fibres::new([Some([20_000.0, 1.0]), None, None]).unwrap()],
        directions: vec![Directions { fibre, ..Directions::default() }; count],
        ..VecMaterial::one(Element::NodalStrain, SOFT, DENSITY)
    };
    let supports: Vec<_> = (0..25).map(Support::fixed).collect();
    let count = BAR.element_count();
    let built = |fibre| {
        let made = Simulation::new(BAR.points(), BAR.tets(), tissue(fibre, count), &supports).unwrap();
        made.with(settings(Method::Exact, 30.0))
    };
    let mut exchanged = built([1.0, 0.0, 0.0]);
    for wrong in [tissue([0.0; 3], count), tissue([0.0, 0.0, 1.0], 3)] {
        println!("{}", exchanged.exchange(wrong, &[]).unwrap_err());
    }
    exchanged.exchange(tissue([0.0, 0.0, 1.0], count), &[]).unwrap();
    let [exchanged, along, across] =
        [exchanged, built([0.0, 0.0, 1.0]), built([1.0, 0.0, 0.0])].map(|body| at_rest_under_gravity(body, 0.5));
    let [(off, moved), (other, _)] = [difference(&exchanged, &along), difference(&exchanged, &across)];
    println!("{:.4} mm off of {:.2} mm, {:.2} mm from that with fibres across", 1e3 * off, 1e3 * moved, 1e3 * other);
    assert!(off < 1e-3 * moved && other > 0.05 * moved);
}
