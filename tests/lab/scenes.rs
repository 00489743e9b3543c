//! The laboratory's scenes and how their loads vary.

use supple::loads::NodalForce;
use supple::material::{AnyLaw, Exponential, NeoHookean, Tissue};
use supple::mesh::{Mesh, Winding};
use supple::scene::VecScene;
use supple_lab::course::Course;
use supple_lab::{moving, scenes};

#[test]
fn every_name_has_its_scene_and_others_are_refused_with_the_names() {
    for (scene, name) in scenes::all().unwrap().iter().zip(scenes::names()) {
        assert_eq!(scene.name, name);
    }
    for name in scenes::RAMPED {
        let scene = scenes::named(name).unwrap();
        assert!((scene.duration() - 1.02).abs() < 1e-6);
        assert!(!scene.supports.is_empty(), "{name}");
        assert!(scene.forces.is_empty() != scene.motions.is_empty(), "{name}");
    }
    let said = scenes::named("tension").unwrap_err().to_string();
    assert!(said.starts_with("scene \"tension\" is not known; there are torsion, reversed,"), "{said}");
}

#[test]
fn body_forces_add_up_to_mass_times_acceleration() {
    // Masses from the volumes in meshes/README.md.
    for (name, axis, kilogram) in [("cylinder", 0, 0.2875), ("lobe", 1, 0.2886)] {
        let scene = scenes::named(name).unwrap();
        let total: f32 = scene.forces.iter().map(|force| force.newton[axis]).sum();
        assert!((total + 0.6 * kilogram).abs() < 1e-4, "{name}: {total} N");
    }
}

#[test]
fn the_push_moves_a_patch_at_the_free_end() {
    let scene = scenes::named("push").unwrap();
    assert!(scene.motions.len() > 5, "{}", scene.motions.len());
    for motion in &scene.motions {
        assert!(scene.points[motion.node as usize][0] > 0.07);
    }
    let fixed = scene.supports.len() - scene.motions.len();
    assert!(fixed > 20, "{fixed}");
}

#[test]
fn every_scene_has_its_tissue_and_a_step_below_the_critical_one() {
    for (name, ratio) in moving::names().zip([10.0, 50.0, 1000.0].into_iter().cycle()) {
        let spec = scenes::named(name).unwrap();
        let (bulk, shear) = match spec.law {
            AnyLaw::NeoHookean(NeoHookean { c, d }) => (2.0 * d, 2.0 * c),
            AnyLaw::Exponential(Exponential { a, d, .. }) => (2.0 * d, a),
            _ => panic!("{name}"),
        };
        assert!((bulk / shear / ratio - 1.0).abs() < 1e-6, "{name}: {bulk} over {shear}");
        assert!((0.25..1.01).contains(&spec.duration()), "{name}");
        let bound = moving::critical_step(&spec).unwrap();
        let step = spec.timing.step;
        assert!((0.6..0.96).contains(&(step / bound)), "{name}: {step} of {bound}");
    }
}

/// Forces are those of the start of a step, motions those of its end.
#[test]
fn loads_follow_their_course() {
    let mut spec = scenes::named("push").unwrap();
    spec.course = Course::Alternating(0.4);
    spec.forces = vec![NodalForce { node: 0, newton: [2.0, 0.0, 0.0], ramp: 0.0 }];
    let mesh = Mesh::new(&spec.points, &spec.tets, Winding::Checked).unwrap();
    let tissue = Tissue { law: NeoHookean { c: 500.0, d: 25_000.0 }, density: 1_000.0 };
    let scene = VecScene::build(tissue, &mesh, &spec.supports).unwrap();
    let mut current = spec.loads(&scene).unwrap();
    let loads = current.of_step(0.1, 0.1);
    assert!((loads.forces()[0].newton[0] - 2.0).abs() < 1e-6);
    assert!(loads.motions()[0].metre[2].abs() < 1e-6 * spec.motions[0].metre[2].abs());
}
