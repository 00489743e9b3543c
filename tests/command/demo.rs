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
