//! `supple demo`: exact, long and learned steps side by side, and what they leave.

use super::{Desk, names};

/// Figures of a row of the table: seconds, guard, real-time factor, error, standing still.
fn figures(row: &str) -> Vec<f64> {
    row.split_whitespace().filter_map(|word| word.parse().ok()).collect()
}

#[test]
fn the_demo_compares_steps_and_leaves_a_report_and_frames() {
    let desk = Desk::new();
    let said = desk.supple(&["demo"]);
    println!("{}", said.out);
    assert_eq!(said.code, 0, "{}", said.err);
    let rows = |name: &str| -> Vec<Vec<f64>> {
        said.out.lines().filter(|line| line.split_whitespace().next() == Some(name)).map(figures).collect()
    };
    let (exact, long, learned) = (rows("exact"), rows("long"), rows("learned"));
    // One row for each instrument.
    assert_eq!([exact.len(), long.len(), learned.len()], [2, 2, 2]);
    for (exact, long) in exact.iter().zip(&long) {
        let [length, .., still] = exact[..] else { panic!("{exact:?}") };
        // The lobe moves, longer steps are near the exact ones, and none is exact.
        let [longer, _, _, _, error, same] = long[..] else { panic!("{long:?}") };
        assert!(still > 5.0 && same == still && longer > 8.0 * length, "{exact:?} {long:?}");
        assert!(error > 0.0 && error < 0.02 * still, "{long:?}");
    }
    // The learned step cannot meet the ball and says so; forceps it can follow, in steps far above the critical one.
    assert!(learned[0].is_empty(), "{learned:?}");
    let refusal = "learned: refused: stopped at 0.300000 s: the loads have instruments, which this step cannot meet";
    assert!(said.out.contains(refusal), "{}", said.out);
    let [length, _, _, _, error, still] = learned[1][..] else { panic!("{learned:?}") };
    assert!(length == 1.5 && error > 0.0 && error < 0.1 * still, "{learned:?}");

    let files = names(&desk.path("out/demo"));
    // Frames, the instruments in each, frames.pvd, final.csv, reactions.csv, summary.json and the report.
    assert_eq!(files.len(), 2 * 35 + 5, "{files:?}");
    let page = std::fs::read_to_string(desk.path("out/demo/report.html")).unwrap();
    for words in ["A ball presses the dome", "Forceps grip the front edge", "supple demo"] {
        assert!(page.contains(words), "{words}");
    }
    let summary = std::fs::read_to_string(desk.path("out/demo/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["status"], "ok");
    assert!(summary["volume_change_percent"].as_f64().unwrap().abs() < 1.0);
    assert!(summary["instruments"][0]["largest_force_n"].as_f64().unwrap() > 0.1);
}
