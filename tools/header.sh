#!/usr/bin/env bash
# Makes include/supple.h from src/capi.rs as include/cbindgen.toml tells. With --verify it changes nothing and fails if the
# header is not the one it would make.
#
#     tools/header.sh [--verify]
#
# Takes the cbindgen that the variable CBINDGEN names, or builds its own into target/tools.
set -euo pipefail
cd "$(dirname "$0")/.."

# Other versions make other headers. Nobody waits for a fast one.
version=0.29.4
cbindgen=${CBINDGEN:-target/tools/bin/cbindgen}
if ! [ -x "$cbindgen" ]; then
    cargo install cbindgen --quiet --version "$version" --locked --root target/tools --config profile.release.opt-level=0 \
        --config profile.release.codegen-units=16 --config profile.release.lto=false
fi
if [ "$("$cbindgen" --version)" != "cbindgen $version" ]; then
    echo "$cbindgen is not cbindgen $version" >&2
    exit 1
fi
"$cbindgen" --quiet --config include/cbindgen.toml --crate supple --output include/supple.h "$@"
