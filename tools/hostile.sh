#!/usr/bin/env bash
# Hostile input for so many seconds a target: damaged files of every format (tests/hostile, src/bin/supple/hostile.rs), random calls
# in Rust (tests/hostile) and in C (tests/capi/hostile.c). Targets run on all processors, one each at a time. A failure names
# the seed and the try.
#
#     tools/hostile.sh SECONDS [SEED]
#
# CI makes a fixed number of tries with the tests. Ten minutes a target, 600, take an hour on two processors.
set -euo pipefail
cd "$(dirname "$0")/.."

[ $# -ge 1 ] || { sed -n '2,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
export SUPPLE_SECONDS=$1 SUPPLE_SEED=${2:-1}
cargo test -p supple --features safetensors --test hostile -- --nocapture
cargo test -p supple-lab --features train --test training recipes -- --nocapture
cargo test -p supple-cli --lib hostile -- --nocapture

# Once as it is installed, and once with every access of the library itself checked as well: the compiler's sanitizers are unstable.
tools/install.sh --prefix target/hostile
gcc -std=c11 -O2 -g -DSMALL -Itarget/hostile/include tests/capi/hostile.c target/hostile/lib/libsupple.a -lm -o target/hostile/calls
target/hostile/calls "${SUPPLE_SECONDS}s" "$SUPPLE_SEED"
triple=$(rustc -vV | sed -n 's/^host: //p')
RUSTC_BOOTSTRAP=1 RUSTFLAGS=-Zsanitizer=address CARGO_PROFILE_RELEASE_OPT_LEVEL=1 cargo rustc -p supple --quiet --release --lib \
    --features capi,panic-handler --crate-type staticlib --target "$triple" --target-dir target/sanitized
# No panic unwinds, but the compiled core names what would.
gcc -std=c11 -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all -Wl,--defsym=rust_eh_personality=0 -DSMALL -Iinclude \
    tests/capi/hostile.c "target/sanitized/$triple/release/libsupple.a" -lm -o target/sanitized/calls
target/sanitized/calls "${SUPPLE_SECONDS}s" "$SUPPLE_SEED"
