#!/usr/bin/env bash
# Builds the kernel in WebAssembly with SIMD, of it the npm package of src/javascript, and the web page of examples/page, which has it in
# one file that any static server hands out and that opens without one as well; then tests package and page in node, and the page in
# headless Chromium.
#
#     tools/page.sh [--build | --package]
#
# The page is out/page/index.html; screenshots and figures of the tests come next to it. The package is out/npm/supple-kernel-VERSION.tgz.
# --build only builds, --package builds and tests the package alone. What it needs comes from Debian (node, chromium), from npm (pinned
# in package-lock.json of both folders) and, for the compiler, from `tools/cross.sh --install`.
# The page has its liver from the command, `supple liver`, and the tests compare with it: it is built as well.
set -euo pipefail
cd "$(dirname "$0")/.."

missing=()
command -v npm >/dev/null || missing+=(nodejs npm)
command -v chromium >/dev/null || [ $# -gt 0 ] || missing+=(chromium fonts-dejavu-core)
if [ ${#missing[@]} -gt 0 ]; then
    apt-get update -qq && apt-get install -y -qq --no-install-recommends "${missing[@]}"
fi
tools/cross.sh --install

# The whole C library, as tools/install.sh builds it, but for a page.
CARGO_PROFILE_RELEASE_LTO=fat CARGO_PROFILE_RELEASE_CODEGEN_UNITS=1 \
    CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_LINKER=$(rustc --print sysroot)/lib/rustlib/x86_64-unknown-linux-gnu/bin/rust-lld \
    CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS="-C target-feature=+simd128 -C link-arg=--strip-all" \
    target/cross/cargo rustc -p supple --quiet --release --target-dir target/page --target wasm32-unknown-unknown -Zbuild-std=core \
    --lib --crate-type cdylib --features capi,panic-handler
library=target/page/wasm32-unknown-unknown/release/supple.wasm

rm -rf out/npm
node src/javascript/build.mjs "$library" out/npm/package
(cd out/npm && npm pack --silent ./package)
package=$(ls "$PWD"/out/npm/supple-kernel-*.tgz)
printf '%s  %s bytes\n' "$package" "$(stat -c %s "$package")"
if [ "${1:-}" != --build ]; then
    npm ci --prefix src/javascript --no-audit --no-fund --silent
    SUPPLE_PACKAGE=$package node --test --test-reporter=spec tests/page/package.test.mjs
fi
[ "${1:-}" != --package ] || exit 0

cargo build --quiet --release
npm ci --prefix examples/page --no-audit --no-fund --silent
mkdir -p out/page
target/release/supple liver >out/page/liver.json
node examples/page/build.mjs "$library" out/page/liver.json out/page/index.html
printf 'out/page/index.html  %s bytes\n%s  %s bytes, %s compressed\n' "$(stat -c %s out/page/index.html)" \
    "$library" "$(stat -c %s "$library")" "$(gzip -9 -c "$library" | wc -c)"
[ "${1:-}" != --build ] || exit 0

SUPPLE_WASM=$library SUPPLE_LIVER=$PWD/out/page/liver.json SUPPLE_COMMAND=target/release/supple \
    node --test --test-reporter=spec tests/page/kernel.test.mjs
SUPPLE_PAGE=$PWD/out/page/index.html node --test --test-reporter=spec tests/page/browser.test.mjs
