//! Prints the checksums of this processor: one line for each level that it has, with how sums were rounded, on which their
//! bits depend.

use supple::lanes::Level;
use targets::{NAMES, checksum, may_fuse};

fn main() {
    let levels: Vec<_> = Level::available().collect();
    eprintln!("{}: {levels:?}", std::env::consts::ARCH);
    for (what, name) in NAMES.into_iter().enumerate() {
        for &level in &levels {
            let fused = !cfg!(feature = "deterministic") && level != Level::Portable && may_fuse(what);
            let rounding = if fused { "fused" } else { "unfused" };
            println!("{name} {rounding} {:08x}", checksum(what, level));
        }
    }
}
