//! Elements against nature and theory, on the coarsest meshes.

use supple::lab::physics::report::HEADS;
use supple::lab::physics::{Plan, Row, evaluate};
use supple::material::Element;

/// Rows of a case on its coarsest meshes, and what the file holds.
fn run(case: &str, meshes: usize) -> (Vec<Row>, String) {
    let mut plan = Plan::new(&[case.to_string()]).unwrap();
    plan.meshes = meshes;
    let folder = tempfile::tempdir().unwrap();
    let rows = evaluate(&plan, folder.path(), |_| {}).unwrap();
    (rows, std::fs::read_to_string(folder.path().join("physics.csv")).unwrap())
}

/// The error (%) of a quantity on the finest of the meshes, by exact steps.
fn error(rows: &[Row], element: Element, quantity: &str) -> f64 {
    let of = |row: &&Row| row.element == element && row.method == "exact" && row.quantity == quantity;
    rows.iter().rev().find(of).unwrap().error_percent().unwrap()
}

#[test]
fn a_cylinder_under_pressure_grows_as_lame_says_with_nodal_pressure_only() {
    let (rows, csv) = run("cylinder", 2);
    for mesh in ["", "; irregular mesh"] {
        for surface in ["inner", "outer"] {
            let quantity = format!("radial displacement of the {surface} surface{mesh}");
            let [linear, nodal] = Element::ALL.map(|element| error(&rows, element, &quantity));
            println!("{quantity}: linear {linear:.2} %, nodal pressure {nodal:.2} %");
            assert!(nodal.abs() < 1.5 && linear < -15.0);
        }
    }
    assert_eq!(csv.lines().next(), Some(HEADS));
    assert_eq!(csv.lines().count(), rows.len() + 1);
    let columns = HEADS.split(',').count();
    assert!(csv.lines().all(|line| line.split(',').count() == columns));
}

#[test]
fn torsion_converges_with_either_element() {
    let (rows, _) = run("torsion", 2);
    for element in Element::ALL {
        let error = error(&rows, element, "torque");
        println!("{}: torque {error:+.2} %", element.name());
        assert!(error > 0.0 && error < 12.0);
    }
}

/// 144 tetrahedra bend by half of what the real beam does with nodal pressure, by an eighth with linear tetrahedra.
#[test]
fn the_silicone_beam_bends_more_with_nodal_pressure() {
    let (rows, _) = run("silicone-beam", 1);
    for (load, rest) in [("gravity-a", [-88.0, -52.0]), ("load-52g-a", [-90.0, -54.0])] {
        for (element, expected) in Element::ALL.into_iter().zip(rest) {
            let error = error(&rows, element, &format!("{load} left: drop at rest"));
            println!("{load}, {}: drop at rest {error:+.1} %", element.name());
            assert!((error - expected).abs() < 2.0);
        }
        // A lowest point comes first, and later than in a stiffer body.
        let [linear, nodal] = Element::ALL
            .map(|element| error(&rows, element, &format!("{load} left: time of the lowest point")));
        assert!(linear < nodal - 20.0 && nodal < -20.0);
    }
    assert!(rows.iter().all(|row| row.us_per_simulated_second.is_none_or(|time| time > 0.0)));
}
