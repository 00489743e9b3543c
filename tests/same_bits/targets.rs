//! The checksums of the computations in `tests/targets` on this processor, at each instruction-set level that it has,
//! against the kept ones. `tools/cross.sh` holds other processors to the same file, with an emulator or in a browser's
//! engine.

use crate::level_guard;
use crate::sums::{Level, NAMES, checksum, rounding};

/// A change that is meant to move sums in their last digit changes these: the test prints the new ones.
const KEPT: &str = include_str!("../targets/checksums.txt");

#[test]
fn checksums_are_the_kept_ones() {
    let _guard = level_guard();
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
