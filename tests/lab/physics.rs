//! Elements against nature and theory, on the coarsest meshes.

use supple::material::Element;
use supple_lab::physics::report::HEADS;
use supple_lab::physics::{PhysicsRow, Plan, evaluate};

/// Rows of a case on its coarsest meshes, and what the file holds.
fn run(case: &str, meshes: usize) -> (Vec<PhysicsRow>, String) {
    let mut plan = Plan::new(&[case.to_string()]).unwrap();
    plan.meshes = meshes;
    let folder = tempfile::tempdir().unwrap();
    let rows = evaluate(&plan, folder.path(), |_| {}).unwrap();
    (rows, std::fs::read_to_string(folder.path().join("physics.csv")).unwrap())
}

/// The error (%) of a quantity on the finest of the meshes of a family.
fn error(rows: &[PhysicsRow], (mesh, element, method): (&str, Element, &str), quantity: &str) -> f64 {
    let of =
        |row: &&PhysicsRow| (row.mesh, row.element, row.method) == (mesh, element, method) && row.quantity == quantity;
    rows.iter().rev().find(of).unwrap().error_percent().unwrap()
}

#[test]
fn a_cylinder_under_pressure_grows_as_lame_says_with_nodal_pressure_only() {
    let (rows, csv) = run("cylinder", 2);
    for mesh in ["grid", "Gmsh"] {
        for surface in ["inner", "outer"] {
            let quantity = format!("radial displacement of the {surface} surface");
            let [linear, pressure, strain] =
                Element::ALL.map(|element| error(&rows, (mesh, element, "exact"), &quantity));
            println!("{mesh}, {quantity}: linear {linear:.2} %, nodal pressure {pressure:.2}, strain {strain:.2} %");
            assert!(pressure.abs() < 2.0 && strain.abs() < 2.0 && linear < -15.0);
        }
    }
    // No node moves along the axis; long steps reach the same shape across it.
    let quantity = "radial displacement of the inner surface";
    for element in Element::ALL {
        let [exact, long] = ["exact", "long 20x"].map(|method| error(&rows, ("grid", element, method), quantity));
        assert!((long - exact).abs() < 0.1, "{}: {exact} and {long} %", element.name());
    }
    assert_eq!(csv.lines().next(), Some(HEADS));
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let columns = HEADS.split(',').count();
    assert!(csv.lines().all(|line| line.split(',').count() == columns));
}

#[test]
fn torsion_converges_with_every_element_and_either_step() {
    let (rows, _) = run("torsion", 2);
    for element in Element::ALL {
        let [exact, long] = ["exact", "long 20x"].map(|method| error(&rows, ("grid", element, method), "torque"));
        println!("{}: torque {exact:+.2} %, with long steps {long:+.2} %", element.name());
        assert!(exact > 0.0 && exact < 12.0 && (long - exact).abs() < 0.7);
    }
}

/// Cells that shrink towards the singular corner bring eight of them a side nearer to the published value.
#[test]
fn a_graded_grid_brings_cooks_membrane_nearer() {
    let (rows, _) = run("cook", 1);
    for element in Element::ALL {
        let [equal, graded] =
            ["grid", "graded grid"].map(|mesh| error(&rows, (mesh, element, "exact"), "rise of the corner"));
        println!("{}: rise {equal:+.2} %, on a graded grid {graded:+.2} %", element.name());
        assert!(equal < graded && graded < 0.0);
    }
}

/// 144 tetrahedra bend by two thirds of what the real beam does with nodal strain, by half of it with nodal pressure,
/// by an eighth with linear tetrahedra.
#[test]
fn the_silicone_beam_bends_more_with_nodal_pressure() {
    let (rows, _) = run("silicone-beam", 1);
    for (load, rest) in [("gravity-a", [-88.0, -52.0, -36.0]), ("load-52g-a", [-90.0, -54.0, -38.0])] {
        let exact =
            |element, quantity: &str| error(&rows, ("grid", element, "exact"), &format!("{load} left: {quantity}"));
        for (element, expected) in Element::ALL.into_iter().zip(rest) {
            let error = exact(element, "drop at rest");
            println!("{load}, {}: drop at rest {error:+.1} %", element.name());
            assert!((error - expected).abs() < 2.0);
        }
        // A lowest point comes first, and later than in a stiffer body.
        let lowest = "from a tenth of the drop to the lowest point";
        let [linear, nodal] = [Element::Linear, Element::NodalPressure].map(|element| exact(element, lowest));
        println!("{load}: time of the lowest point: linear {linear:+.1} %, nodal pressure {nodal:+.1} %");
        assert!(linear < nodal - 20.0 && nodal < -10.0);
    }
    // The steps of most packages end at the shape of the element that they are made of.
    let rest = |method| error(&rows, ("grid", Element::Linear, method), "gravity-a left: drop at rest");
    assert!((rest("backward Euler 5 ms") - rest("exact")).abs() < 0.5);
    assert!(rows.iter().all(|row| row.note.is_empty() && row.us_per_simulated_second.is_some_and(|time| time > 0.0)));
}
