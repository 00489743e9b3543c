//! The same bits on every processor: this one's checksums of the computations in `tests/targets`, with each set of
//! instructions that it has, against the kept ones. `tools/cross.sh` holds other processors to the same file, by an
//! emulator or in a browser's engine.

#[path = "targets/src/body.rs"]
mod body;
#[path = "targets/src/sums.rs"]
pub mod sums;

use sums::{Level, NAMES, checksum, rounding};

/// A change that is meant to move sums in their last digit changes these: the test says what it found.
const KEPT: &str = include_str!("targets/checksums.txt");

#[test]
fn checksums_are_the_kept_ones() {
    let mut unlike = Vec::new();
    for (what, name) in NAMES.into_iter().enumerate() {
        for level in Level::available() {
            let line = format!("{name} {} {:08x}", rounding(what, level), checksum(what, level));
            println!("{line} ({level:?})");
            if !KEPT.lines().any(|kept| kept == line) && !unlike.contains(&line) {
                unlike.push(line);
            }
        }
    }
    assert!(unlike.is_empty(), "not in tests/targets/checksums.txt: {unlike:#?}");
}
