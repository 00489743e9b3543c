//! Pulls and springs in a scene file: `pulls.csv`, and complaints.

use super::{Desk, bar};

/// A bar that lies on springs is drawn aside by its end; the springs carry it.
#[test]
fn a_bar_on_springs_is_drawn_to_a_target() {
    const LOADS: &str = "[[spring]]\nplane = { axis = \"z\", at = 0.0 }\nstiffness = 20.0\n\
        [[pull]]\npoint = [0.01, 0.01, 0.05]\nradius = 0.012\nstiffness = 100.0\nmost = inf\n\
        path = [[0.0, 0.01, 0.01, 0.05], [0.2, 0.014, 0.01, 0.05]]\n\
        [[pull]]\npoint = [0.01, 0.01, 0.025]\nstiffness = 50.0\nalong = [0.0, 1.0, 0.0]\ngravity = [0.0, 0.0, -9.81]\n";
    for time in ["", "method = \"long\"\nstep = \"10x\"\nlattice = [1, 1, 2]\n"] {
        let desk = Desk::new();
        let said = desk.simulate(&bar(&format!("{LOADS}[time]\nend = 1.0\nframes = 4\n{time}")), &[]);
        println!("{}", said.out);
        assert_eq!(said.code, 0, "{}", said.err);
        let text = std::fs::read_to_string(desk.path("out/pulls.csv")).unwrap();
        let mut lines = text.lines();
        let heads = "time_s,pull,x_m,y_m,z_m,gap_x_m,gap_y_m,gap_z_m,force_x_n,force_y_n,force_z_n";
        assert_eq!(lines.next(), Some(heads));
        let rows: Vec<Vec<f64>> =
            lines.map(|line| line.split(',').map(|value| value.parse().unwrap()).collect()).collect();
        // At rest and at four frames, two pulls.
        assert_eq!(rows.len(), 10);
        let end = &rows[8];
        println!("{end:?}");
        assert!((end[2] + end[5] - 0.014).abs() < 1e-6 && end[2] > 0.012 && (end[8] - 100.0 * end[5]).abs() < 1e-3);
        assert_eq!(rows[9][5], 0.0);
        let summary = desk.summary();
        assert!(
            (summary["pulls"][0]["gap_mm"].as_f64().unwrap()
                - 1e3 * (end[5].powi(2) + end[6].powi(2) + end[7].powi(2)).sqrt())
            .abs()
                < 1e-3
        );
    }
}

/// Millimetres in place of metres.
#[test]
fn a_pull_far_outside_the_mesh_is_remarked_upon() {
    let desk = Desk::new();
    let pull = "[[pull]]\npoint = [10.0, 10.0, 50.0]\nstiffness = 1.0\n";
    let said = desk.simulate(&bar(&format!("{pull}[time]\nend = 0.01\n")), &[]);
    println!("{}", said.err);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.err.contains("mm outside the mesh: the nearest element is pulled"), "{}", said.err);
}

#[test]
fn points_follow_the_tissue() {
    let desk = Desk::new();
    let loads = "[[move]]\nplane = { axis = \"z\", at = 0.05 }\nmetre = [0.0, 0.0, 0.005]\nramp = 0.2\n\
        [[fix]]\nplane = { axis = \"z\", at = 0.0 }\n\
        [[point]]\nname = \"middle\"\nat = [0.01, 0.01, 0.025]\n\
        [[point]]\nname = \"above\"\nat = [0.01, 0.01, 0.052]\n";
    let said = desk.simulate(&bar(&format!("{loads}[time]\nend = 1.0\nframes = 2\n")), &[]);
    assert_eq!(said.code, 0, "{}", said.err);
    assert!(said.err.contains("point \"above\" is 2.00 mm outside the mesh"), "{}", said.err);
    let text = std::fs::read_to_string(desk.path("out/points.csv")).unwrap();
    println!("{text}");
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0].join(","), "time_s,name,x_m,y_m,z_m");
    assert!(rows.len() == 7 && rows[5][1] == "middle" && rows[6][1] == "above");
    let height = |row: usize| rows[row][4].parse::<f64>().unwrap();
    // The middle goes half the way, the end all of it.
    assert!((height(5) - 0.0275).abs() < 2e-4 && (height(6) - 0.057).abs() < 1e-6);
    let report = std::fs::read_to_string(desk.path("out/report.html")).unwrap();
    assert!(report.contains("Followed points") && report.contains("\"middle\"") && !report.contains("Gaps of pulls"));
}

#[test]
fn pulls_that_cannot_be_are_refused_with_their_line() {
    let pull = "[[pull]]\npoint = [0.01, 0.01, 0.05]\nstiffness = 100.0\n";
    let spring = "[[spring]]\nplane = { axis = \"z\", at = 0.0 }\nstiffness = 20.0\n";
    let cases = [
        (pull.replace("100.0", "-1.0"), "stiffness is -1 N/m, it must be above zero and at most 1e6"),
        (format!("{pull}radius = 0.0\n"), "radius is 0, it must be positive"),
        (format!("{pull}most = -1.0\n"), "most is -1 N, it must be positive, inf for no limit"),
        (format!("{pull}path = []\n"), "the path has no point"),
        (format!("{pull}along = [0.0, 0.0, 0.0]\n"), "along is [0.0, 0.0, 0.0]; it needs a length"),
        (format!("{pull}along = [nan, 0.0, 0.0]\n"), "a component of its direction is NaN"),
        (format!("{pull}radius = 0.001\n").replace("0.05]", "0.2]"), "the nearest node is 150.000 mm away"),
        (format!("{pull}length = 1.0\n"), "unknown field `length`"),
        (
            spring.replace("stiffness = 20.0\n", ""),
            "give exactly one of stiffness (N/m, each node) and per_area (Pa/m)",
        ),
        (spring.replace("at = 0.0", "at = 0.5"), "this selects no node"),
        (
            spring
                .replace("stiffness = 20.0", "per_area = 1e6")
                .replace("plane = { axis = \"z\", at = 0.0 }", "nodes = [0]"),
            "no boundary triangle",
        ),
    ];
    let point = "[[point]]\nname = \"a\"\nat = [0.01, 0.01, 0.02]\n";
    let points = [
        (format!("{point}{point}"), "two points are named"),
        (point.replace("0.02]", "nan]"), "at holds NaN"),
        (point.replace("\"a\"", "\"a,b\""), "must not be empty, nor hold a comma"),
    ];
    for (loads, words) in cases.into_iter().chain(points) {
        let desk = Desk::new();
        let said = desk.simulate(&bar(&format!("{loads}[time]\nend = 0.1\n")), &[]);
        println!("{}", said.err);
        assert!(said.code == 2 && said.err.contains("line ") && said.err.contains(words), "{words}: {}", said.err);
    }
}
