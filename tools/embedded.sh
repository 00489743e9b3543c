#!/usr/bin/env bash
# The core in a host without std (tests/embedded): a library can hold only one panic handler, so this fails if std comes in. No path in
# it may lead to a panic.
#
#     tools/embedded.sh
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --quiet --release --manifest-path tests/embedded/Cargo.toml --target-dir target/embedded
if nm target/embedded/release/libembedded.so | grep -i panicking; then
    echo "the core can panic: the symbols above should not be there" >&2
    exit 1
fi
echo "ok: no std, and no path to a panic"
