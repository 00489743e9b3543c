//! `supple evaluate`: what it refuses. Its results are tested in `tests/lab`.
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
