//! `supple demo`: exact, long, adaptive and learned steps side by side, and what they leave.

use super::{Desk, names};

/// Figures of a row of the table: length of the step (ms), times real time, distances from the exact steps (mm), estimate.
fn figures(row: &str) -> Vec<f64> {
    row.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn the_demo_compares_steps_and_leaves_a_report_and_frames() {
    let desk = Desk::new();
    let said = desk.supple(&["demo"]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    let row = |name: &str| -> (Vec<f64>, String) {
        let is_row = |line: &&str| line.split_whitespace().next() == Some(name) && !line.contains("times real time.");
        let row = said.out.lines().find(is_row).unwrap_or_default();
        (figures(row), row.split_whitespace().last().unwrap_or_default().into())
    };
    let ((exact, is_ok), (long, is_long_ok), (auto, is_auto_ok)) = (row("exact"), row("long"), row("auto"));
    assert_eq!([is_ok.as_str(), &is_long_ok, &is_auto_ok], ["ok"; 3]);
    // Longer steps are near the exact ones, take less time, and their errors are less than the guard's estimates.
    for other in [long, auto] {
        let &[length, times, off, at_target, estimate] = other.as_slice() else { panic!("{other:?}") };
        assert!(length > 10.0 * exact[0] && times > 1.2 * exact[1], "{exact:?} {other:?}");
        assert!(off > 0.0 && off < 0.2 && at_target < 0.3 && estimate > off, "{other:?}");
    }
    assert_eq!(row("learned").1, "refused");
    assert!(said.out.contains("the loads have instruments, which this step cannot meet"), "{}", said.out);
    // The first sentence says what was gained, of a liver that moves.
    let found = said.out.lines().find(|line| line.contains("times real time. The liver moves by ")).unwrap();
    let moved = found.split_once("moves by ").unwrap().1.split(' ').next().unwrap();
    let moved: f64 = moved.parse().unwrap();
    assert!(found.starts_with("exact ") && moved > 8.0, "{found}");

    let files = names(&desk.path("out/demo"));
    // Frames, the instruments in each, frames.pvd, final.csv, reactions.csv, summary.json and the report.
    assert_eq!(files.len(), 2 * 35 + 5, "{files:?}");
    let page = std::fs::read_to_string(desk.path("out/demo/report.html")).unwrap();
    for words in ["A liver hangs from the diaphragm", "supple demo", "\"motion\":{\"times\":"] {
        assert!(page.contains(words), "{words}");
    }
    let summary = std::fs::read_to_string(desk.path("out/demo/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["status"], "ok");
    assert!(summary["volume_change_percent"].as_f64().unwrap().abs() < 2.0);
    assert!(summary["instruments"][0]["largest_force_n"].as_f64().unwrap() > 0.1);
}

#[test]
fn the_liver_of_the_web_page_is_that_of_the_demo() {
    let said = Desk::new().supple(&["liver"]);
    assert_eq!(said.code, 0, "{}", said.err);
    let liver: serde_json::Value = serde_json::from_str(&said.out).unwrap();
    let numbers = |of: &serde_json::Value| -> Vec<f64> {
        of.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
    };
    let [points, corners, tissues] = ["points", "tetrahedra", "tissueOfElement"].map(|name| numbers(&liver[name]));
    assert_eq!((points.len(), corners.len(), tissues.len()), (3 * 2_049, 4 * 8_201, 8_201));
    // Five and three times as stiff as the liver.
    let stiffness = [0, 1, 2].map(|tissue| liver["tissues"][tissue]["constants"][0].as_f64().unwrap());
    assert_eq!(stiffness, [2_000.0, 10_000.0, 6_000.0]);
    // The tumour is what is around its middle, of about the volume of its ball.
    let (middle, radius) = (numbers(&liver["tumour"]["centre"]), liver["tumour"]["radius"].as_f64().unwrap());
    let mut volume = 0.0;
    for (tet, _) in corners.chunks(4).zip(&tissues).filter(|(_, tissue)| **tissue == 1.0) {
        let corner = |index: usize| [0, 1, 2].map(|axis| points[3 * tet[index] as usize + axis]);
        let [a, b, c, d] = [0, 1, 2, 3].map(corner);
        let [u, v, w] = [b, c, d].map(|p| [0, 1, 2].map(|axis| p[axis] - a[axis]));
        let cross = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        volume += (0..3).map(|axis| cross[axis] * w[axis]).sum::<f64>().abs() / 6.0;
        let off = |axis: usize| 0.25 * (a[axis] + b[axis] + c[axis] + d[axis]) - middle[axis];
        assert!((0..3).map(|axis| off(axis).powi(2)).sum::<f64>().sqrt() < radius);
    }
    let ball = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
    assert!((volume / ball - 1.0).abs() < 0.2, "{volume} m^3, the ball has {ball} m^3");
}
