//! `supple evaluate`: what it refuses, and the files of `--physics`. Its results are tested in `tests/lab`.
use crate::Desk;

#[test]
fn what_does_not_exist_is_named_with_what_does() {
    let desk = Desk::new();
    for (flag, value, sentence) in [
        ("--scene", "tension", "scene \"tension\" is not known; there are torsion, reversed, "),
        ("--sweep", "tension", "scene \"tension\" is not known; there are torsion, reversed, "),
        ("--method", "euler", "method \"euler\" is not known; there are tled, hold, "),
        ("--multiple", "3", "multiple 3 misses the snapshots of torsion; there are 1, 2, 4, 5, 8, 10, "),
    ] {
        let said = desk.supple(&["evaluate", "--out", "out", flag, value]);
        assert_eq!(said.code, 2);
        assert!(said.err.starts_with(&format!("error: {sentence}")), "{}", said.err);
        assert!(!desk.path("out").exists());
    }
}

#[test]
fn a_mesh_that_cannot_be_judged_is_named() {
    let desk = Desk::new();
    for (scale, sentence) in [("0", "--scale 0: it must be a positive number"), ("1", "none.msh: ")] {
        let said =
            desk.supple(&["evaluate", "--hard", "--mesh", "none.msh", "--scale", scale, "--out", "out"]);
        assert_eq!(said.code, 2);
        assert!(said.err.starts_with(&format!("error: {sentence}")), "{}", said.err);
        assert!(!desk.path("out").exists());
    }
}

#[test]
fn physics_of_a_case_is_a_table_with_orders_of_convergence() {
    let desk = Desk::new();
    let said = desk.supple(&["evaluate", "--physics", "--scene", "torsion", "--out", "out"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let table = std::fs::read_to_string(desk.path("out/physics.md")).unwrap();
    assert!(table.contains("\n| case | mesh | element |") && said.out.starts_with(&table), "{table}");
    let csv = std::fs::read_to_string(desk.path("out/physics.csv")).unwrap();
    let heads = "case,mesh,element,method,nodes,tetrahedra,quantity,unit,value,reference,source,error_percent,\
                 us_per_simulated_second,computing_seconds,note";
    assert_eq!(csv.lines().next(), Some(heads));
    // Two kinds of steps on three meshes and an order, for each of three elements.
    assert_eq!(csv.lines().count(), 1 + 3 * 7);
    assert_eq!(csv.matches("order of convergence").count(), 3);
    let page = std::fs::read_to_string(desk.path("out/report.html")).unwrap();
    assert!(page.contains("<dd>supple evaluate --physics --scene torsion --out out</dd>"));
    assert!(page.contains("\"name\":\"torsion: torque\""));

    let said = desk.supple(&["evaluate", "--physics", "--scene", "lobe", "--out", "none"]);
    assert_eq!(said.code, 2);
    let sentence =
        "error: case \"lobe\" is not known; there are silicone-beam, bending, cook, cylinder, torsion, punch";
    assert!(said.err.starts_with(sentence), "{}", said.err);
    assert!(!desk.path("none").exists());
}
