//! Prints the checksums of this processor: one line for each level that it has, with how sums were rounded.

use targets::{Level, NAMES, checksum, rounding};

fn main() {
    let levels: Vec<_> = Level::available().collect();
    eprintln!("{}: {levels:?}", std::env::consts::ARCH);
    for (what, name) in NAMES.into_iter().enumerate() {
        for &level in &levels {
            println!("{name} {} {:08x}", rounding(what, level), checksum(what, level));
        }
    }
}
